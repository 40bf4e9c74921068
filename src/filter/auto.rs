//! The method `auto`: which method, and how many samples it starts with, by a small model of costs and errors.
//!
//! | what is known | what follows | measured by |
//! |---|---|---|
//! | reflections after the first are wanted | `reference`: no other method has them | |
//! | anything else | `direct`: 1.5 to 750 times less CPU time than `reference` for the same tolerance, on grooves, rods, lists of 1 to 1,600 pairs; `lowrank` shares its facets and visibility and adds to both | `cargo bench --bench methods`; `biscale study` |
//! | up to 64 distinct normals | relative RMS error of 2,048 samples about .003, whatever the lobe | `cargo bench --bench accuracy` |
//! | more, area `r` footprints, sharpest lobe `alpha` (1 for diffuse) | about `r (.0025 + .005 (1/alpha - 1))`; within a factor of 3 but for diffuse rods, of 4 | same |
//! | `n` samples in place of 2,048 | `(2,048/n)^.75` of it | same |
//! | 1,024 pairs or 512 directions, and more | the samples are found on one in 24 of the pairs, at least 64 | `biscale study` |
//! | over 262,144 pairs | clusters of unequal normals, as wide as their error allows | `biscale study --pairs`; `cargo bench --bench paper_matrix` |
//! | some directions see next to none of 2^18 samples, up to 256 pairs | `reference`, which looks from the viewer: under-sampled directions do not contribute to the estimate of `direct` | `cargo test --test extremes` |
//!
//! The model only says where to start: what is kept is the error that the method then estimates, and a budget is kept by the clock. A start that
//! is too low costs a part of the doublings that follow, one that is too high all that is too much: so it is a quarter of what the
//! model says, or all of it where a round costs more than that (many triangles). Where four times as many as it says are fewer than the 2,048
//! that the method starts with by itself, those do.

use super::control::Control;
use super::direct::{MOST_SEARCH, StartHint, direct_from};
use super::quality::Quality;
use super::reference::reference;
use super::tolerance::{RATE, SAFETY};
use super::value::Effective;
use crate::direction::Pair;
use crate::error::Result;
use crate::material::SmallScale;
use crate::numerics::cast::truncate_u32;
use crate::numerics::words::{percent, significant};
use rustc_hash::FxHashSet;

/// The model of errors and costs: how many samples a surface and a tolerance will need.
struct AutoModel {
    /// Distinct normals that are few: the direct method sums over clusters of these.
    few_normals: usize,
    /// Samples that the errors below are of: those that the direct method starts with by itself.
    samples: f64,
    /// Relative RMS error of a surface of few normals, whatever the lobe (`cargo bench --bench accuracy`).
    few_error: f64,
    /// Error of others for each footprint of area, without a lobe (`cargo bench --bench accuracy`).
    wide_error: f64,
    /// What a lobe of roughness `alpha` adds, times `1/alpha - 1` (`cargo bench --bench accuracy`: within a factor of 3, of diffuse rods 4).
    lobe_error: f64,
    /// Roughness of the narrowest lobe that is told apart: `1/alpha` of narrower ones would ask for more samples than there are.
    least_roughness: f64,
    /// How many times as many samples as are predicted are certainly enough: the model is within a factor of 3 to 4.
    enough: f64,
    /// Most samples to start with: the model says where to start, not how far to go. Chosen, not measured.
    most: u32,
    /// Most pairs for which what direct samples under-sample is looked for by the reference method. Chosen, not measured.
    reference_pairs: usize,
}

const MODEL: AutoModel = AutoModel {
    few_normals: 64,
    samples: 2048.0,
    few_error: 0.003,
    wide_error: 0.0025,
    lobe_error: 0.005,
    least_roughness: 1e-3,
    enough: 4.0,
    most: 1 << 20,
    reference_pairs: 256,
};

/// Share of the progress that the direct method makes where the reference method may follow. Chosen, not measured.
const DIRECT_PROGRESS: f64 = 0.8;

/// What the model looks at.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Features {
    /// Distinct normals; one more than [`AutoModel::few_normals`] for any more.
    normals: usize,
    /// Area over the footprint.
    area: f64,
    /// Roughness of the sharpest lobe, 1 for none.
    alpha: f64,
}

impl Features {
    fn of(small: &SmallScale) -> Self {
        let tile = &small.tile;
        let mut normals = FxHashSet::default();
        let mut area = 0.0;
        for k in 0..tile.triangles.len() {
            let [a, b, c] = tile.corners(k);
            let cross = (b - a).cross(c - a);
            area += 0.5 * cross.length();
            if normals.len() <= MODEL.few_normals {
                // Normals that agree to six digits are one.
                normals.insert((cross.normalize_or_zero() * 1e6).round().to_array().map(|x| (x + 0.0).to_bits()));
            }
        }
        let alpha = small.surfaces.iter().map(|s| s.brdf.roughness().clamp(MODEL.least_roughness, 1.0)).fold(1.0, f64::min);
        Self { normals: normals.len(), area: area / tile.footprint(), alpha }
    }

    /// Relative RMS error of [`AutoModel::samples`] samples.
    fn error(&self) -> f64 {
        if self.normals <= MODEL.few_normals {
            MODEL.few_error
        } else {
            self.area * (MODEL.wide_error + MODEL.lobe_error * (1.0 / self.alpha - 1.0))
        }
    }

    /// Samples that a tolerance will probably need.
    fn samples(&self, tolerance: f64) -> f64 {
        MODEL.samples * (SAFETY * self.error() / tolerance).powf(1.0 / RATE)
    }
}

/// What the model chooses; the details say so.
pub(super) fn auto(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    let features = Features::of(small);
    let predicted = features.samples(quality.tolerance);
    let samples = |share: f64| truncate_u32((share * predicted).clamp(1.0, f64::from(MODEL.most)));
    let start = StartHint { enough: samples(MODEL.enough), expected: samples(1.0) };
    // What the reference method may have to do after it is known only then.
    let alone = quality.budget.is_some() || pairs.len() > MODEL.reference_pairs;
    let share = if alone { 1.0 } else { DIRECT_PROGRESS };
    let (mut result, undersampled) = control.part(0.0..share, |control| direct_from(small, pairs, quality, control, start))?;
    if undersampled > 0 && !alone {
        let mut result = control.part(share..1.0, |control| reference(small, pairs, quality, control))?;
        result.summary.details.insert(
            0,
            format!("the method reference was chosen: {undersampled} directions see next to none of {MOST_SEARCH} samples of the surface"),
        );
        return Ok(result);
    }
    let kind = match features.normals {
        n if n > MODEL.few_normals => {
            format!(
                "more than {} normals, {} footprints of area, sharpest lobe {}",
                MODEL.few_normals,
                significant(features.area),
                significant(features.alpha)
            )
        }
        n => format!("{n} normals"),
    };
    let detail = format!(
        "auto chose direct ({kind}): about {} samples were expected for a tolerance of {}, and {} taken",
        significant(predicted),
        percent(quality.tolerance),
        result.summary.facets
    );
    result.summary.details.insert(0, detail);
    Ok(result)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::toml_reader::Source;

    fn features(geometry: &str, brdf: &str) -> Features {
        let text = format!("format = 1\n[geometry]\nkind = {geometry}\n[[surface]]\npart = \"*\"\nbrdf = {brdf}\n");
        let small = Material::parse(&Source { path: "m.toml".into(), text }).unwrap().build().unwrap();
        Features::of(&small)
    }

    #[test]
    fn features_are_those_of_the_surface() {
        let lambert = "{ model = \"lambert\", albedo = 0.5 }";
        let grooves = features("\"grooves\"\nprofile = \"v\"", lambert);
        assert_eq!((grooves.normals, grooves.alpha), (2, 1.0));
        let weave = features("\"weave\"", "{ model = \"cook-torrance\", specular = 0.5, alpha = 0.05 }");
        assert!(weave.normals > MODEL.few_normals && weave.area > 2.0 && weave.alpha == 0.05, "{weave:?}");
        let phong = features("\"grooves\"", "{ model = \"blinn-phong\", specular = 0.5, exponent = 198.0 }");
        assert!((phong.alpha - 0.1).abs() < 1e-12, "{phong:?}");
    }

    #[test]
    fn narrower_lobes_more_area_and_smaller_tolerances_need_more_samples() {
        let few = Features { normals: 2, area: 2.0, alpha: 0.05 };
        let flat = Features { normals: MODEL.few_normals + 1, area: 1.2, alpha: 1.0 };
        let narrow = Features { alpha: 0.05, ..flat };
        let rods = Features { area: 5.4, ..narrow };
        assert!(few.samples(0.01) < narrow.samples(0.01));
        assert!(flat.samples(0.01) < narrow.samples(0.01) && narrow.samples(0.01) < rods.samples(0.01));
        assert!(flat.samples(0.03) < flat.samples(0.01));
        // The tiles of the truth tests, measured with 2,048 samples: bumpy .0027, .0171, .1619; weave .239; rods .56.
        for (features, measured) in [
            (Features { normals: 65, area: 1.17, alpha: 1.0 }, 0.0027),
            (Features { normals: 65, area: 1.17, alpha: 0.3 }, 0.0171),
            (Features { normals: 65, area: 1.17, alpha: 0.05 }, 0.1619),
            (Features { normals: 65, area: 3.92, alpha: 0.05 }, 0.239),
            (Features { normals: 65, area: 5.41, alpha: 0.05 }, 0.56),
        ] {
            let ratio = features.error() / measured;
            assert!((1.0 / 3.0..3.0).contains(&ratio), "{features:?}: {} for {measured}", features.error());
        }
    }
}
