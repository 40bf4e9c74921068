//! Values of a surface that is changed a little again and again, by the same samples each time: for fitting.
//!
//! Of one bounce the symmetric kernel `S` is linear in the colours of the small-scale BRDFs. So it is not computed for colours, but for
//! [`Slot`]s, each the share of one colour when that colour is 1: whoever knows the shares finds the colours by linear least squares.

use super::Control;
use super::demand::Demand;
use super::lobes::{self, Lobe};
use super::prepared::Tracer;
use super::sums::{self, Views};
use crate::brdf::Brdf;
use crate::direction::Pair;
use crate::error::{Error, Result};
use crate::facets::{self, Facets, NO_TRIANGLE, SETS};
use crate::material::{SmallScale, Tint};

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
    /// `scale` of a measured BRDF, with its tint; the share is that of the tint when it is 1.
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
fn only(brdf: &Brdf, colour: SlotColour) -> Brdf {
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

/// Samples that keep their places, and whether light passes the surface.
#[derive(Clone, Debug)]
pub struct Frozen {
    samples: facets::frozen::Frozen,
}

/// What [`Frozen::shares`] finds for a list of pairs.
#[derive(Clone, Debug, Default)]
pub struct Shares {
    /// For each slot and pair its share of `S`, 1/sr, in each channel: the tint and Fresnel's factor may be coloured.
    pub s: Vec<Vec<[f64; 3]>>,
    /// For each pair the visible projected area from the viewer over the footprint.
    pub av: Vec<f64>,
}

/// What a viewer sees of each surface under a light.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parts {
    /// For each surface the projected area over the footprint that the viewer sees, lit or not.
    pub seen: Vec<f64>,
    /// The same, of what the light reaches as well.
    pub lit: Vec<f64>,
}

impl Frozen {
    /// Draws `samples` samples, a power of two from 64.
    pub fn new(small: &SmallScale, samples: u32, seed: u32) -> Self {
        Self { samples: facets::frozen::Frozen::new(small, samples, seed) }
    }

    /// Whether the samples can be kept on `small`: it has the triangles of the surface that they were drawn on, in another shape.
    pub fn fits(&self, small: &SmallScale) -> bool {
        self.samples.fits(small)
    }

    /// The shares of `slots` in what `small` reflects, for each pair; and, for the pair `parts`, what is seen of each surface.
    ///
    /// # Errors
    /// [`Error::Unsupported`] if [`Self::fits`] says no; `Interrupted`.
    pub fn shares(&self, small: &SmallScale, pairs: &[Pair], slots: &[Slot], control: &Control<'_>) -> Result<Shares> {
        let (tracer, facets) = self.tracer(small, control)?;
        let symmetric = !small.surfaces.iter().any(|s| matches!(s.brdf, Brdf::Measured(_)));
        let demand = Demand::new(pairs, symmetric);
        let bits = tracer.see(&facets, &demand.directions)?;
        let scale = 1.0 / self.samples.samples() as f64;
        let areas: Vec<f64> = (demand.directions.iter().enumerate())
            .map(|(d, &w)| scale * sums::visible_area(&facets, w, bits.row(d)).iter().sum::<f64>())
            .collect();
        let mut views = Views::default();
        let mut shares = Shares { s: Vec::with_capacity(slots.len()), av: vec![0.0; pairs.len()] };
        for slot in slots {
            let surface = &small.surfaces[slot.surface];
            let brdf = only(&surface.brdf, slot.colour);
            let tint = match surface.tint {
                Tint::Uniform(tint) if slot.colour != SlotColour::Tint => tint,
                _ => [1.0; 3],
            };
            let mut of_surfaces: Vec<Vec<Lobe<'_>>> = vec![Vec::new(); small.surfaces.len()];
            of_surfaces[slot.surface] = lobes::lobes(&brdf, tint);
            let mut sums = vec![[[0.0; 3]; SETS]; demand.pairs.len()];
            let mut rest = &mut sums[..];
            for task in demand.tasks() {
                let (slice, after) = rest.split_at_mut(task.len());
                sums::add_pairs(&facets, &bits, &demand, task, &tracer.surface.groups, &of_surfaces, &mut views, slice);
                rest = after;
            }
            let value = |sets: &[[f64; 3]; SETS]| std::array::from_fn(|c| scale * sets.iter().map(|set| set[c]).sum::<f64>());
            let wanted = demand.wanted.iter();
            shares.s.push(wanted.map(|w| w.map_or([0.0; 3], |w| value(&sums[w.pair as usize]))).collect());
        }
        for (av, wanted) in shares.av.iter_mut().zip(&demand.wanted) {
            *av = wanted.map_or(0.0, |w| areas[w.viewer as usize]);
        }
        Ok(shares)
    }

    /// What is seen of each surface at one pair.
    ///
    /// # Errors
    /// As [`Self::shares`].
    pub fn parts(&self, small: &SmallScale, pair: Pair, control: &Control<'_>) -> Result<Parts> {
        let (tracer, facets) = self.tracer(small, control)?;
        let bits = tracer.see(&facets, &[pair.wi, pair.wo])?;
        let mut parts = Parts { seen: vec![0.0; small.surfaces.len()], lit: vec![0.0; small.surfaces.len()] };
        for (f, &t) in facets.triangle.iter().enumerate().filter(|(_, t)| **t != NO_TRIANGLE) {
            let surface = usize::from(tracer.surface.surface[t as usize]);
            let sees = |row: usize| bits.row(row)[f / 64] >> (f % 64) & 1 == 1;
            if sees(1) {
                let cosine = facets.normal_of(f).as_dvec3().dot(pair.wo).clamp(0.0, 1.0);
                let area = f64::from(facets.weight[f]) * cosine / self.samples.samples() as f64;
                parts.seen[surface] += area;
                if sees(0) {
                    parts.lit[surface] += area;
                }
            }
        }
        Ok(parts)
    }

    fn tracer<'a>(&self, small: &'a SmallScale, control: &Control<'a>) -> Result<(Tracer<'a>, Facets)> {
        let (surface, facets) = self.samples.on(small).ok_or_else(|| Error::Unsupported {
            what: "a surface of other triangles than the one that the samples were drawn on".to_owned(),
            remedy: "draw new samples".to_owned(),
        })?;
        Ok((Tracer::of(small, surface, control), facets))
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
    fn shares_times_colours_add_up_to_the_values_of_the_direct_method() {
        let cancel = AtomicBool::new(false);
        let material = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/photos/weave.toml");
        let small = Material::load(&material).unwrap().build().unwrap();
        let slots: Vec<Slot> =
            (0..2).flat_map(|surface| [SlotColour::Diffuse, SlotColour::Specular].map(|colour| Slot { surface, colour })).collect();
        let colours = [[0.45, 0.06, 0.05], [0.25; 3], [0.05, 0.12, 0.40], [0.25; 3]];
        let shares = Frozen::new(&small, 1 << 14, 3).shares(&small, &pairs(), &slots, &control(&cancel)).unwrap();
        let quality = Quality { tolerance: 2e-3, ..Quality::default() };
        let exact = effective(&small, &pairs(), &quality, &control(&cancel)).unwrap();
        for (k, value) in exact.values.iter().enumerate() {
            assert!((shares.av[k] / value.av - 1.0).abs() < 0.01, "{} and {}", shares.av[k], value.av);
            for c in 0..3 {
                let sum: f64 = shares.s.iter().zip(&colours).map(|(s, colour)| s[k][c] * colour[c]).sum();
                assert!((sum / value.s[c] - 1.0).abs() < 0.02, "pair {k}, channel {c}: {sum} and {}", value.s[c]);
            }
        }
    }

    #[test]
    fn what_is_seen_of_the_surfaces_adds_up_to_the_visible_area() {
        let cancel = AtomicBool::new(false);
        let material = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/photos/weave.toml");
        let small = Material::load(&material).unwrap().build().unwrap();
        let frozen = Frozen::new(&small, 4096, 3);
        for pair in pairs() {
            let parts = frozen.parts(&small, pair, &control(&cancel)).unwrap();
            let slots = [Slot { surface: 0, colour: SlotColour::Diffuse }];
            let av = frozen.shares(&small, &[pair], &slots, &control(&cancel)).unwrap().av[0];
            assert!((parts.seen.iter().sum::<f64>() / av - 1.0).abs() < 1e-5, "{parts:?}, {av}");
            assert!(parts.lit.iter().zip(&parts.seen).all(|(lit, seen)| lit <= seen && *lit > 0.0), "{parts:?}");
        }
    }
}
