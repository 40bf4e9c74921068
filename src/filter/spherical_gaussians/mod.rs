//! The method of Iwasaki, Dobashi and Nishita (2012): normals and BRDFs as spherical Gaussians, whose products have closed integrals.
//!
//! ```text
//! S(wi,wo) = ∫ gamma(n,wi,wo) fr(n,wi,wo) (n·wi)+ (n·wo)+ dn,   gamma ~ sum_j of lobes about the normals,  fr ~ sum_k of lobes about h
//! ```
//!
//! | file | in -> out |
//! |---|---|
//! | `normals` | facets of a surface -> lobes of their normals |
//! | `lobe_areas` | facets of each lobe, and what a pair sees -> the visible area of each lobe |
//! | `least_squares` | sums over facets -> the area of each lobe, as published |
//! | `products` | a lobe of the normals, lobes about the half vector -> integrals of their products |
//! | `mode_query` | a list of pairs -> its query, and the pairs that modes are learnt from |
//! | `modes` | visible areas of many lobes -> few amplitudes, and back |
//! | `amplitudes` | a query -> amplitudes of each pair |
//! | `brdf_lobes` | a BRDF -> lobes about the half vector |
//! | `integrals` | lobes of both, amplitudes -> `S` of a pair, in f32 lanes |
//! | `surface` | one surface: lobes, amplitudes, BRDF -> `S` of each pair |
//! | `method` | a surface and pairs -> values with errors; the search for a tolerance |
//! | `prepared` | a surface and pairs -> lobes and amplitudes, kept while BRDFs change |
//! | `responses` | lobes and amplitudes -> sums for each sharpness of a BRDF's lobes, kept for faster changes |

mod amplitudes;
mod brdf_lobes;
mod integrals;
mod least_squares;
mod lobe_areas;
mod method;
mod mode_query;
mod modes;
mod normals;
mod prepared;
mod products;
mod responses;
mod surface;

pub(super) use method::spherical_gaussians;
pub use prepared::{LobeValue, PreparedLobes, prepare_lobes};
pub use responses::LobeResponses;
