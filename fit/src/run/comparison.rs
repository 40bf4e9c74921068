//! Photographs beside the fitted material, those that were held out as well.

use super::held_out_light::{Free, HeldOutLight};
use super::options::POLISH_SAMPLES;
use super::outcome::Compared;
use crate::photograph::direction_bins::DirectionBins;
use crate::photograph::image::Photograph;
use crate::residuals::equations::Evaluated;
use crate::residuals::input::Interreflection;
use crate::residuals::interreflection::trace_interreflection;
use crate::residuals::model::Model;
use crate::residuals::near_interreflection::PathOptions;
use crate::residuals::unknowns::{self, Shot, stray_light};
use crate::verdict::picture;
use crate::verdict::validate::{self, Validation, verdict};
use biscale::error::Result;
use biscale::filter::CommonRandomNumbers;
use biscale::filter::Control;
use biscale::material::{Material, SmallScale};
use biscale::numerics::cast::narrow;
use biscale::render::Light;

/// Samples of a prediction, which is made once: four times those of the last look of the search.
const PREDICTION_SAMPLES: u32 = 4 * POLISH_SAMPLES;

/// The fitted material.
#[derive(Clone, Copy)]
pub(super) struct Fitted<'a> {
    /// As a file describes it.
    pub(super) material: &'a Material,
    /// Its surface.
    pub(super) small: &'a SmallScale,
    /// Whether it has no gaps.
    pub(super) opaque: bool,
}

/// What a photograph shows beside direct light.
#[derive(Clone, Copy, Debug)]
pub(super) struct OtherLight<'a> {
    /// The same in all pixels.
    pub(super) stray_light: [f64; 3],
    /// By direction bin, radiance over irradiance.
    pub(super) interreflection: Option<&'a [[f64; 3]]>,
}

/// What a photograph that was held out is judged by.
pub(super) struct Validating<'a> {
    pub(super) fitted: Fitted<'a>,
    /// The photographs that were fitted.
    pub(super) compared: &'a [Compared],
    /// Their relative RMS difference.
    pub(super) training: f64,
    /// Stray light of the first one of them, over the mean radiance of its pixels, where there may be any.
    pub(super) stray_light: Option<[f64; 3]>,
    pub(super) seed: u64,
}

impl Fitted<'_> {
    /// A photograph beside the material, whose relative RMS difference over direction bins is known.
    pub(super) fn compare(
        &self,
        photograph: Photograph,
        bins: &DirectionBins,
        light: OtherLight<'_>,
        relative_rms: f64,
        control: &Control<'_>,
    ) -> Result<Compared> {
        let mut picture = picture::render(&photograph, self.material, self.small, self.opaque, light.stray_light, control)?;
        if let Some(extra) = light.interreflection {
            for ((members, bin), extra) in bins.members.iter().zip(&bins.bins).zip(extra) {
                for &pixel in members {
                    for c in 0..3 {
                        picture.rgb[pixel as usize][c] += narrow(bin.irradiance[c] * extra[c]);
                    }
                }
            }
        }
        let used: Vec<u32> = bins.members.iter().flatten().copied().filter(|&p| !picture.rgb[p as usize][0].is_nan()).collect();
        let pixel_relative_rms = validate::pixel_relative_rms(&photograph, &picture, &used);
        let delta_e_itp = validate::mean_delta_e_itp(&photograph, &picture, &used);
        Ok(Compared { photograph, picture, used, relative_rms, pixel_relative_rms, delta_e_itp })
    }

    /// Radiance that the material shows in the direction bins of a photograph whose light is turned by `turn_deg`, by so many samples of the
    /// surface.
    pub(super) fn predict(
        &self,
        bins: &DirectionBins,
        (turn_deg, samples): ([f64; 2], u32),
        light: OtherLight<'_>,
        control: &Control<'_>,
    ) -> Result<Vec<[f64; 3]>> {
        let slots = unknowns::slots(&self.small.surfaces);
        let pairs = bins.pairs(turn_deg);
        let samples = CommonRandomNumbers::new(self.small, samples, 0, &pairs, control)?;
        let basis = samples.on(self.small, control)?.basis_reflectance(&pairs, &slots)?;
        let value = |k: usize| {
            let bin = &bins.bins[k];
            let factor = bin.inverse_cosine * if self.opaque && basis.av[k] > 0.0 { bin.wo.z / basis.av[k] } else { 1.0 };
            std::array::from_fn(|c| {
                let direct: f64 = slots.iter().zip(&basis.s).map(|(slot, s)| s[k][c] * unknowns::colour_of(self.small, *slot)[c]).sum();
                let extra = light.interreflection.map_or(0.0, |i| i[k][c]);
                bin.irradiance[c] * (factor * direct + extra) + light.stray_light[c]
            })
        };
        Ok((0..bins.bins.len()).map(value).collect())
    }
}

impl Validating<'_> {
    /// A photograph that was held out, with its direction bins, beside the material with all of its numbers; what a user should know of its
    /// interreflection goes to `notes`.
    pub(super) fn validate(
        &self,
        photograph: &Photograph,
        bins: DirectionBins,
        bounces: u32,
        notes: &mut Vec<String>,
        control: &Control<'_>,
    ) -> Result<(Validation, Compared)> {
        let name = photograph.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut bins = [bins];
        let traced = self.interreflection(&name, &bins, bounces, notes, control)?;
        let interreflection = traced.as_ref().map(|i| &i.bins[0][..]);
        let mut light = OtherLight { stray_light: [0.0; 3], interreflection };
        let mut predicted = self.fitted.predict(&bins[0], ([0.0; 2], PREDICTION_SAMPLES), light, control)?;
        let mut photograph = photograph.clone();
        // How bright a light was whose irradiance is not known says the photograph alone.
        let found = HeldOutLight::of(&bins[0], &predicted, Free { factor: !photograph.exposure_known, stray_light: self.stray_light });
        light.stray_light = found.stray_light;
        let mut exposure = None;
        if !photograph.exposure_known {
            let factor = found.factor;
            exposure = Some(factor);
            predicted.iter_mut().flatten().for_each(|p| *p *= factor);
            bins[0].bins.iter_mut().for_each(|bin| bin.irradiance = bin.irradiance.map(|i| factor * i));
            match &mut photograph.light {
                Light::Directional { irradiance: light, .. } | Light::Point { intensity: light, .. } => *light = light.map(|i| factor * i),
            }
        }
        predicted.iter_mut().for_each(|p| (0..3).for_each(|c| p[c] += light.stray_light[c]));
        let relative_rms = bins[0].relative_rms(&predicted);
        let own = validate::direction(&photograph);
        let angle = |other: &Compared| own.angle_between(validate::direction(&other.photograph)).to_degrees();
        let angle_deg = self.compared.iter().map(angle).fold(f64::INFINITY, f64::min);
        let compared = self.fitted.compare(photograph, &bins[0], light, relative_rms, control)?;
        let validation = Validation {
            photograph: name,
            verdict: verdict(relative_rms, self.training, angle_deg),
            relative_rms,
            pixel_relative_rms: compared.pixel_relative_rms,
            ratio: relative_rms / self.training.max(f64::MIN_POSITIVE),
            delta_e_itp: compared.delta_e_itp,
            angle_deg,
            pixels: compared.used.len(),
            stray_light: light.stray_light,
            exposure,
        };
        Ok((validation, compared))
    }

    /// What the material reflects more than once in the bins of the photograph `name`; `None` without bounces.
    pub(super) fn interreflection(
        &self,
        name: &str,
        bins: &[DirectionBins; 1],
        bounces: u32,
        notes: &mut Vec<String>,
        control: &Control<'_>,
    ) -> Result<Option<Interreflection>> {
        if bounces == 0 {
            return Ok(None);
        }
        let options = PathOptions { bounces, seed: self.seed };
        let found = trace_interreflection(self.fitted.small, bins, &[[0.0; 2]], None, options, control)?;
        notes.extend(found.notes.iter().map(|note| format!("{name}: {note}")));
        Ok(Some(found))
    }
}

/// Stray light of a fitted photograph over the mean radiance of its pixels: what to expect of another one. That of the first distant one.
pub(super) fn usual_stray_light(bins: &DirectionBins, model: &Model<'_>, evaluated: &Evaluated) -> [f64; 3] {
    let found = stray_light(&model.unknowns, &evaluated.linear, Shot::Distant(0));
    std::array::from_fn(|c| if bins.mean[c] > 0.0 { found[c] / bins.mean[c] } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photograph::direction_bins::DirectionBin;
    use crate::residuals::distant::tests::bin;
    use crate::residuals::near_interreflection::tests::floor_under_wall;
    use biscale::direction::Pair;
    use biscale::toml_reader::Source;
    use glam::DVec3;

    #[test]
    fn interreflection_of_a_held_out_photograph_that_is_in_doubt_is_told_with_its_name() {
        let text = "format = 1\n[geometry]\nkind = \"grooves\"\n[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.5 }\n";
        let material = Material::parse(&Source { path: "m.toml".into(), text: text.into() }).unwrap();
        let pair = Pair { wi: DVec3::new(0.0, 0.3, 1.0).normalize(), wo: DVec3::Z };
        let bins = [DirectionBins { bins: vec![DirectionBin { wi: pair.wi, wo: pair.wo, ..bin(0.5) }], ..DirectionBins::default() }];
        let told = |distance: f64, bounces: u32| {
            let small = floor_under_wall(distance);
            let fitted = Fitted { material: &material, small: &small, opaque: true };
            let question = Validating { fitted, compared: &[], training: 0.01, stray_light: None, seed: 1 };
            let mut notes = Vec::new();
            let found = question.interreflection("held_out.exr", &bins, bounces, &mut notes, &Control::quiet()).unwrap();
            (found.is_some(), notes.join("; "))
        };
        assert_eq!(told(0.1, 1), (true, String::new()));
        assert_eq!(told(1e4, 0), (false, String::new()));
        let (found, notes) = told(1e4, 1);
        assert!(found && notes.contains("held_out.exr: interreflection: rays of 1 pairs passed"), "{notes}");
    }
}
