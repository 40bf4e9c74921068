//! Values of a surface that is changed a little again and again, by the same samples each time (common random numbers): for fitting.
//!
//! For direct light the kernel `S` is linear in the colours of the small-scale BRDFs,
//!
//! ```text
//! S(wi,wo) = sum over slots k of colour_k · B_k(wi,wo)
//! ```
//!
//! so not `S` is computed, but the basis reflectances `B_k`, each of one colour of one surface ([`Slot`]) with that colour 1 and all others 0. Given
//! values of `S`, the colours follow from linear least squares.

use super::control::Control;
use super::facet_sampler::FacetSampler;
use super::lobes::{self, Lobe};
use super::query::Query;
use super::sums::{self, FacetSums, Views};
use crate::brdf::Brdf;
use crate::direction::{Pair, above_horizon};
use crate::error::{Error, Result};
use crate::facets::{CommonSamples, Facets, NO_TRIANGLE, REPLICATES};
use crate::material::{SmallScale, Surface, Tint};
use crate::numerics::cast::truncate_usize;
use glam::DVec3;

/// One colour of one surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Place of the surface in [`SmallScale::surfaces`].
    pub surface: usize,
    /// Which of its colours.
    pub colour: SlotColour,
}

/// A colour that the light reflected by a surface is proportional to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotColour {
    /// `albedo` or `diffuse`.
    Diffuse,
    /// `specular`.
    Specular,
    /// `scale` of a measured BRDF, with its tint; the basis reflectance is that of the tint when it is 1.
    Tint,
}

impl Slot {
    /// The slots that a BRDF has.
    pub fn of(brdf: &Brdf) -> &'static [SlotColour] {
        match brdf {
            Brdf::Lambert { .. } => &[SlotColour::Diffuse],
            Brdf::BlinnPhong { .. } | Brdf::CookTorrance { .. } | Brdf::Ward { .. } => &[SlotColour::Diffuse, SlotColour::Specular],
            Brdf::Measured(_) => &[SlotColour::Tint],
        }
    }
}

/// A BRDF whose colour `colour` is 1 and whose other colour is 0.
pub fn basis_brdf(brdf: &Brdf, colour: SlotColour) -> Brdf {
    let (one, zero) = ([1.0; 3], [0.0; 3]);
    let (d, s) = if colour == SlotColour::Diffuse { (one, zero) } else { (zero, one) };
    match brdf {
        Brdf::Lambert { .. } => Brdf::Lambert { albedo: d },
        Brdf::BlinnPhong { exponent, .. } => Brdf::BlinnPhong { diffuse: d, specular: s, exponent: *exponent },
        Brdf::CookTorrance { alpha, distribution, f0, .. } => {
            Brdf::CookTorrance { diffuse: d, specular: s, alpha: *alpha, distribution: *distribution, f0: *f0 }
        }
        Brdf::Ward { alpha, .. } => Brdf::Ward { diffuse: d, specular: s, alpha: *alpha },
        Brdf::Measured(measured) => Brdf::Measured(measured.clone()),
    }
}

/// Stretches of the surface whose importance is told apart: eight samples of the pilot each.
const STRETCHES: usize = 256;
/// Samples of the pilot that tells it: the fewest that the direct method starts with.
const PILOT_SAMPLES: u32 = 2048;
/// Directions of that pilot. Chosen, not measured.
const PILOT_DIRECTIONS: usize = 24;
/// Least importance, as a share of the mean: what is hidden now may be seen when the surface has changed. Chosen, not measured.
const LEAST_IMPORTANCE: f64 = 0.2;

/// Samples that keep their places.
#[derive(Clone, Debug)]
pub struct CommonRandomNumbers {
    samples: CommonSamples,
}

/// The samples on one shape of their surface.
pub struct PlacedSamples<'a> {
    small: &'a SmallScale,
    sampler: FacetSampler<'a>,
    facets: Facets,
    samples: f64,
}

/// What [`PlacedSamples::basis_reflectance`] finds for a list of pairs.
#[derive(Clone, Debug, Default)]
pub struct BasisReflectance {
    /// For each slot and pair `B`, 1/sr, in each channel: the tint and Fresnel's factor may be coloured.
    pub s: Vec<Vec<[f64; 3]>>,
    /// For each pair the visible projected area from the viewer over the footprint.
    pub av: Vec<f64>,
}

impl CommonRandomNumbers {
    /// Draws `samples` samples, a power of two from 64, more of them where `pairs` see the surface.
    ///
    /// # Errors
    /// `Interrupted`.
    pub fn new(small: &SmallScale, samples: u32, seed: u32, pairs: &[Pair], control: &Control<'_>) -> Result<Self> {
        let pilot = Self { samples: CommonSamples::new(small, PILOT_SAMPLES, seed) };
        let placed = pilot.on(small, control)?;
        let all: Vec<DVec3> = pairs.iter().flat_map(|p| [p.wi, p.wo]).filter_map(above_horizon).collect();
        let some: Vec<DVec3> = all.iter().copied().step_by(all.len().div_ceil(PILOT_DIRECTIONS).max(1)).collect();
        let bits = placed.sampler.see(&placed.facets, &some)?;
        let mut importance = [0.0; STRETCHES];
        for (f, _) in placed.facets.triangle.iter().enumerate().filter(|(_, t)| **t != NO_TRIANGLE) {
            let stretch = truncate_usize(f64::from(placed.facets.along[f]) * STRETCHES as f64).min(STRETCHES - 1);
            let normal = placed.facets.normal_of(f).as_dvec3();
            for (d, w) in some.iter().enumerate() {
                if bits.row(d)[f / 64] >> (f % 64) & 1 == 1 {
                    importance[stretch] += normal.dot(*w).clamp(0.0, 1.0);
                }
            }
        }
        let mean = importance.iter().sum::<f64>() / STRETCHES as f64;
        let importance: Vec<f64> = importance.iter().map(|i| i + LEAST_IMPORTANCE * mean).collect();
        let importance = if mean > 0.0 { &importance[..] } else { &[1.0] };
        Ok(Self { samples: CommonSamples::with_importance(small, samples, seed, importance) })
    }

    /// Whether the samples can be kept on `small`: it has the triangles of the surface that they were drawn on, in another shape.
    pub fn fits(&self, small: &SmallScale) -> bool {
        self.samples.fits(small)
    }

    /// Puts the samples on `small`.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if [`Self::fits`] says no.
    pub fn on<'a>(&self, small: &'a SmallScale, control: &Control<'a>) -> Result<PlacedSamples<'a>> {
        let (surface, facets) = self.samples.on(small).ok_or_else(|| Error::Unsupported {
            what: "a surface of other triangles than the one that the samples were drawn on".to_owned(),
            remedy: "draw new samples".to_owned(),
        })?;
        Ok(PlacedSamples { small, sampler: FacetSampler::of(small, surface, control), facets, samples: self.samples.samples() as f64 })
    }
}

impl PlacedSamples<'_> {
    /// The basis reflectances of `slots` for each pair.
    ///
    /// # Errors
    /// `Interrupted`; failures of the visibility.
    pub fn basis_reflectance(&self, pairs: &[Pair], slots: &[Slot]) -> Result<BasisReflectance> {
        let Self { small, sampler, facets, samples } = self;
        let query = Query::new(pairs, small.is_reciprocal());
        let bits = sampler.see(facets, &query.directions)?;
        let scale = 1.0 / samples;
        let areas: Vec<f64> = (query.directions.iter().enumerate())
            .map(|(d, &w)| scale * sums::visible_area(facets, w, bits.row(d)).iter().sum::<f64>())
            .collect();
        let mut views = Views::default();
        let mut reflectance = BasisReflectance { s: Vec::with_capacity(slots.len()), av: vec![0.0; pairs.len()] };
        for slot in slots {
            let surface = &small.surfaces[slot.surface];
            let brdf = basis_brdf(&surface.brdf, slot.colour);
            let mut of_surfaces: Vec<Vec<Lobe<'_>>> = vec![Vec::new(); small.surfaces.len()];
            of_surfaces[slot.surface] = lobes::lobes(&brdf, basis_tint(surface, slot.colour));
            let mut sums = vec![[[0.0; 3]; REPLICATES]; query.pairs.len()];
            let mut rest = &mut sums[..];
            let of_facets = FacetSums { facets, bits: &bits, query: &query, groups: &sampler.surface.groups, lobes: &of_surfaces };
            for task in query.tasks() {
                let (slice, after) = rest.split_at_mut(task.len());
                of_facets.add(task, &mut views, slice);
                rest = after;
            }
            let value = |sets: &[[f64; 3]; REPLICATES]| std::array::from_fn(|c| scale * sets.iter().map(|set| set[c]).sum::<f64>());
            let entries = query.entries.iter();
            reflectance.s.push(entries.map(|w| w.map_or([0.0; 3], |w| value(&sums[w.pair as usize]))).collect());
        }
        for (av, entry) in reflectance.av.iter_mut().zip(&query.entries) {
            *av = entry.map_or(0.0, |w| areas[w.viewer as usize]);
        }
        Ok(reflectance)
    }
}

/// What a surface's tint multiplies a colour by.
pub fn basis_tint(surface: &Surface, colour: SlotColour) -> [f64; 3] {
    match surface.tint {
        Tint::Uniform(tint) if colour != SlotColour::Tint => tint,
        _ => [1.0; 3],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{Quality, effective};
    use crate::material::Material;
    use glam::DVec3;
    use std::path::Path;
    use std::sync::atomic::AtomicBool;

    fn control(cancel: &AtomicBool) -> Control<'_> {
        Control { cancel, progress: &|_, _| {}, clock: &|| 0.0 }
    }

    fn pairs() -> Vec<Pair> {
        let w = |x: f64, y: f64| DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
        vec![
            Pair { wi: w(0.3, -0.2), wo: w(0.0, 0.4) },
            Pair { wi: w(-0.6, 0.5), wo: w(0.2, 0.1) },
            Pair { wi: w(0.1, 0.8), wo: w(-0.5, 0.6) },
        ]
    }

    #[test]
    fn basis_reflectances_times_colours_add_up_to_the_values_of_the_direct_method() {
        let cancel = AtomicBool::new(false);
        let material = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/photos/weave.toml");
        let small = Material::load(&material).unwrap().build().unwrap();
        let slots: Vec<Slot> =
            (0..2).flat_map(|surface| [SlotColour::Diffuse, SlotColour::Specular].map(|colour| Slot { surface, colour })).collect();
        let colours = [[0.45, 0.06, 0.05], [0.25; 3], [0.05, 0.12, 0.40], [0.25; 3]];
        let reflectance = CommonRandomNumbers::new(&small, 1 << 14, 3, &pairs(), &control(&cancel)).unwrap();
        let reflectance = reflectance.on(&small, &control(&cancel)).unwrap().basis_reflectance(&pairs(), &slots).unwrap();
        let quality = Quality { tolerance: 2e-3, ..Quality::default() };
        let exact = effective(&small, &pairs(), &quality, &control(&cancel)).unwrap();
        for (k, value) in exact.values.iter().enumerate() {
            assert!((reflectance.av[k] / value.av - 1.0).abs() < 0.01, "{} and {}", reflectance.av[k], value.av);
            for c in 0..3 {
                let sum: f64 = reflectance.s.iter().zip(&colours).map(|(s, colour)| s[k][c] * colour[c]).sum();
                assert!((sum / value.s[c] - 1.0).abs() < 0.02, "pair {k}, channel {c}: {sum} and {}", value.s[c]);
            }
        }
    }
}
