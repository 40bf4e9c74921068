//! The direct method: facets shared by all pairs, visibility for exactly the directions of the query, direct sums.
//!
//! How many samples a tolerance needs is found by trying: 2,048 spread by area, or more where the triangles are many; if those leave much to do, a pilot
//! run of at least 8,192 shows where samples are worth most, and these are doubled, sums made so far being kept, until the estimated error meets the
//! tolerance. All but short lists of pairs try this on a part of the list: the whole then mostly takes one round.
//!
//! `params`: the numbers of these choices. `part`: the part of a list that is tried. `clustering`: how triangles are clustered, and what that costs.
//! `run`: sums of blocks of samples. `rounds`: how many samples, round by round. `long_list`: the whole of a list whose sums are not kept. `method` puts
//! them together.

mod clustering;
mod long_list;
mod method;
mod params;
mod part;
mod rounds;
mod run;

pub use method::prepare;
pub(super) use method::{direct, direct_from};
pub(super) use run::StartHint;

/// Samples up to which under-sampled directions are searched.
pub(super) const MOST_SEARCH: u32 = params::PARAMS.most_search;
