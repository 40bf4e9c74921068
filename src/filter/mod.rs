//! From a small-scale surface to effective BRDF values, by any method and with an error on every value.
//!
//! All methods are reached through [`effective()`]. What a caller wants is in [`Quality`]; what it lends (a clock, a way to report progress and to be
//! stopped) in [`Control`], so that no stage reads a global. The files stand in the order of the flow, and import only what stands above them:
//!
//! | file | in -> out |
//! |---|---|
//! | `tolerance` | a tolerance and an estimated error -> a number of samples |
//! | `plan/` | a run -> a text that repeats its bits, and back |
//! | `value`, `control`, `quality` | what is answered, lent and asked for |
//! | `query`, `subset` | a list of pairs -> its distinct directions and pairs, each once; some of them |
//! | `facet_sampler` | samples of the surface -> facets, and the bits of which directions see them |
//! | `lobes` | a BRDF -> what depends on one direction, and what on both |
//! | `sums/` | facets, bits, lobes -> sums of `S` and of visible area, a replicate each |
//! | `estimate` | sums -> values with standard errors |
//! | `importance` | a pilot run -> where samples are worth most |
//! | `prepared` | facets and bits, kept while materials change |
//! | `common_random_numbers` | the same samples on a surface whose shape changes: for fitting |
//! | `visible_facets`, `probes` | facets and the bits of a whole query; how far what stands for them is off |
//! | `direct/`, `reference/`, `low_rank/`, `spherical_gaussians/` | the methods |
//! | `auto`, `effective` | which method, and how many samples it starts with |

mod auto;
mod common_random_numbers;
mod control;
mod direct;
mod effective;
mod estimate;
mod facet_sampler;
mod importance;
#[cfg(test)]
mod kernel_tests;
mod lobes;
pub mod low_rank;
mod plan;
mod prepared;
mod probes;
mod quality;
mod query;
mod reference;
mod spherical_gaussians;
mod subset;
mod sums;
mod tolerance;
mod value;
mod visible_facets;

pub use common_random_numbers::{BasisReflectance, CommonRandomNumbers, PlacedSamples, Slot, SlotColour, basis_brdf, basis_tint};
pub use control::Control;
pub(crate) use control::RisingShare;
pub use direct::prepare;
pub use effective::effective;
pub(crate) use facet_sampler::FacetSampler;
pub(crate) use lobes::{Half, Lobe, cosines, exp, lobes};
pub use plan::{
    CLUSTER_WIDTHS, DirectPlan, LARGEST_MAPS, LobeCount, LowRankPlan, MapSides, Plan, ReferencePlan, SphericalGaussianPlan, Variant,
};
pub use prepared::Prepared;
pub use quality::{MatrixCache, Method, MethodToRun, Quality};
pub(crate) use query::{Query, QueryEntry};
pub use spherical_gaussians::{LobeResponses, LobeValue, PreparedLobes, prepare_lobes};
pub(crate) use sums::surface_lobes;
pub(crate) use sums::{FacetSums, Views, visible_area};
pub use tolerance::DEFAULT_TOLERANCE;
pub(crate) use tolerance::{SAFETY, keeps};
pub use value::{Effective, LowRankFacts, Summary, Value};
