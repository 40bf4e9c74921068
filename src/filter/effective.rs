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
    match quality.method_to_run()? {
        MethodToRun::PredictedDirect => auto::auto(surface, pairs, quality, control),
        MethodToRun::Direct => direct::direct(surface, pairs, quality, control),
        MethodToRun::Reference => reference::reference(surface, pairs, quality, control),
        MethodToRun::LowRank => low_rank::low_rank(surface, pairs, quality, control),
        MethodToRun::SphericalGaussian => spherical_gaussians::spherical_gaussians(surface, pairs, quality, control),
    }
}
