//! The method of Iwasaki, Dobashi and Nishita (2012): normals and BRDFs as spherical Gaussians, whose products have closed integrals.
//!
//! ```text
//! S(wi,wo) = ∫ gamma(n,wi,wo) fr(n,wi,wo) (n·wi)+ (n·wo)+ dn,   gamma ~ sum_j of lobes about the normals,  fr ~ sum_k of lobes about h
//! ```
//!
//! | file | in -> out |
//! |---|---|
//! | `normals` | facets of a surface -> lobes of their normals |
//! | `amplitudes` | lobes, and what a pair sees -> the amplitude of each lobe for the pair |
//! | `brdf_lobes` | a BRDF -> lobes about the half vector |
//! | `integrals` | lobes of both -> `S` of a pair, in f32 lanes |
//! | `method` | a surface and pairs -> values with errors; the search for a tolerance |

mod amplitudes;
mod brdf_lobes;
mod integrals;
mod method;
mod normals;

pub(super) use method::spherical_gaussians;
