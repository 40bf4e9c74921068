//! Plans: all that fixes the bits of a run beside its seed. A summary holds the plan that was carried out; given to another run it repeats the bits.
//!
//! The printed text is a contract: [`Plan`] prints and parses it, and what was printed parses to the same plan.

mod any;
mod direct;
mod low_rank;
mod reference;
mod spherical_gaussian;
mod variant;

pub use any::Plan;
pub use direct::{CLUSTER_WIDTHS, DirectPlan};
pub use low_rank::{LARGEST_MAPS, LowRankPlan, MAX_FACETS, MAX_NORMALS, MIN_FACETS, MapSides};
pub use reference::{BATCHES, MAX_RAYS, ReferencePlan};
pub use spherical_gaussian::{AmplitudeFit, BrdfLobes, LobeCount, MAX_CHOSEN_LOBES, MAX_LOBES, ProductIntegral, SphericalGaussianPlan};
pub use variant::Variant;
