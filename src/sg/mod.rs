//! Spherical Gaussians: lobes on the sphere whose products and integrals have closed forms (Iwasaki, Dobashi and Nishita 2012).
//!
//! ```
//! use biscale::sg::Lobe;
//! use glam::Vec3;
//!
//! // A surface's normals about z, seen by a glossy BRDF whose half vector is 10 degrees away.
//! let normals = Lobe::density(Vec3::Z, 40.0);
//! let half = Vec3::new(10_f32.to_radians().sin(), 0.0, 10_f32.to_radians().cos());
//! let glossy = Lobe { axis: half, sharpness: 512.0, amplitude: 1.0 };
//! let exact = normals.product_integral(&glossy);
//! // One lobe in place of the integral (eq. 14) is within .1 % of the peak of it.
//! let closed = glossy.product_closure(&normals);
//! assert!((closed.eval(half) - exact).abs() < 1e-3 * closed.amplitude);
//! ```
//!
//! A lobe is `G(w; x, l, a) = a exp(l (w·x - 1))`, with unit axis `x`, sharpness `l` of at least 0 and amplitude `a` (eq. 3). Everything here is pure and
//! knows neither surfaces nor light: `crate::filter::spherical_gaussians` is the method made of it.
//!
//! | file | what it has |
//! |---|---|
//! | `lobe` | one lobe: value, integral, product, integral of a product, its closure in one lobe |
//! | `mixture` | a density of directions as a sum of lobes: spherical expectation maximisation |
//! | `hemisphere` | integrals of one lobe over a hemisphere, plain and with the cosine |
//! | `warp` | a lobe of half vectors as lobes of incident directions |
//! | `zonal` | a function of the angle to an axis as a sum of lobes about that axis, and its second harmonic in azimuth |

mod hemisphere;
mod lobe;
mod mixture;
mod warp;
mod zonal;

pub use hemisphere::{clamped_cosine_integral, hemispherical_integral};
pub use lobe::{Lobe, integral_of_product};
pub use mixture::{MAX_SHARPNESS, Mixture, MixtureLobe, Order, WeightedDirection, WeightedLobes, distinct};
pub use warp::{mirrored, warp};
pub use zonal::{ZonalBasis, ZonalFit, ZonalProfile};
