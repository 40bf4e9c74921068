//! The one function by which all methods are reached.

use super::control::Control;
use super::quality::{MethodToRun, Quality};
use super::value::Effective;
use super::{auto, direct, low_rank, reference, spherical_gaussians};
use crate::direction::Pair;
use crate::error::Result;
use crate::material::SmallScale;

/// Effective BRDF values of `surface` at `pairs`.
///
/// A direction below the horizon gives 0; one within [`crate::direction::MIN_COSINE`] of it is evaluated there. The same
/// surface, pairs and quality give the same bits at any thread count, unless `quality.budget` is set.
///
/// # Errors
/// [`Error::Unsupported`](crate::Error::Unsupported) for a budget of a method that keeps none, [`Error::Interrupted`](crate::Error::Interrupted) when `control` asks to stop,
/// [`Error::BadInput`](crate::Error::BadInput) for a plan that is none.
///
/// ```
/// use biscale::{Control, Material, Method, Pair, Quality, effective};
/// use glam::DVec3;
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
/// let surface = Material::load(path.as_ref())?.build()?;
/// let pair = Pair { wi: DVec3::new(0.6, 0.0, 0.8), wo: DVec3::new(0.0, 0.6, 0.8) };
/// let swapped = Pair { wi: pair.wo, wo: pair.wi };
/// let quality = Quality { method: Method::Direct, tolerance: 0.1, ..Quality::default() };
/// let result = effective(&surface, &[pair, swapped], &quality, &Control::quiet())?;
/// let [a, b] = result.values[..] else { panic!("one value a pair") };
/// // The kernel S is symmetric; fhat is fbar over the cosine of the light.
/// assert_eq!(a.s, b.s);
/// assert!((a.fhat[0] * 0.8 / a.fbar[0] - 1.0).abs() < 1e-12);
/// # Ok::<(), biscale::Error>(())
/// ```
pub fn effective(surface: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    match quality.method_to_run(surface.bounces)? {
        MethodToRun::PredictedDirect => auto::auto(surface, pairs, quality, control),
        MethodToRun::Direct => direct::direct(surface, pairs, quality, control),
        MethodToRun::Reference => reference::reference(surface, pairs, quality, control),
        MethodToRun::LowRank => low_rank::low_rank(surface, pairs, quality, control),
        MethodToRun::SphericalGaussian => spherical_gaussians::spherical_gaussians(surface, pairs, quality, control),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{LowRankPlan, MapSides, Method, Plan};
    use crate::material::Material;
    use crate::numerics::random::Random;
    use glam::DVec3;
    use std::sync::Mutex;

    /// Pairs of so many directions to the light and to the viewer, all with all.
    fn pairs(directions: usize) -> Vec<Pair> {
        let mut random = Random::from_state(7);
        let mut any = || {
            let (radius, (sin, cos)) = (random.unit().sqrt(), (std::f64::consts::TAU * random.unit()).sin_cos());
            DVec3::new(radius * cos, radius * sin, (1.0 - radius * radius).sqrt())
        };
        let (lights, viewers): (Vec<DVec3>, Vec<DVec3>) = (0..directions).map(|_| (any(), any())).unzip();
        viewers.iter().flat_map(|&wo| lights.iter().map(move |&wi| Pair { wi, wo })).collect()
    }

    #[test]
    fn progress_never_falls_and_leaves_no_long_step_to_its_end() {
        let path = |name: &str| std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("samples").join(name);
        let small = Material::load(&path("hammered.toml")).unwrap().build().unwrap();
        let direct = Quality { tolerance: 0.02, ..Quality::default() };
        let LowRankPlan::Paper { facets, energy, .. } = LowRankPlan::PAPER else { panic!("the paper's plan is one of its own") };
        let coarse = LowRankPlan::Paper { facets, directions: 12, rates: MapSides { directions: 12, normals: 16 }, energy };
        let low_rank = Quality { method: Method::LowRank, plan: Some(Plan::LowRank(coarse)), ..Quality::default() };
        // A short list; one whose samples are found on a part; one that is long.
        for (what, quality, directions) in
            [("short", &direct, 5), ("part", &direct, 40), ("long", &direct, 190), ("low rank", &low_rank, 20)]
        {
            let seen = Mutex::new(vec![0.0]);
            let progress = |_: &str, share: f64| seen.lock().unwrap().push(share);
            effective(&small, &pairs(directions), quality, &Control { progress: &progress, ..Control::quiet() }).unwrap();
            let seen = seen.into_inner().unwrap();
            assert!(seen.windows(2).all(|w| w[1] >= w[0] - 1e-12), "{what}: {seen:?}");
            let last = seen[seen.len() - 1];
            // What is kept for rounds that were not needed stays undone.
            assert!((0.6..=1.0).contains(&last), "{what}: ends at {last}");
        }
    }
}
