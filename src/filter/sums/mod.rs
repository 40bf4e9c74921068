//! Sums over facets: `S` of many pairs and `av` of their directions, for several replicates at once.
//!
//! `task`: runs of pairs that share directions. `views`: what a direction sees of a block of facets. `area`: visible area. `facets`: facet by
//! facet, in lanes. `tables`: measured tables. `clusters`: by popcount over clusters of normals. `batch`: which of these a batch takes.

mod area;
mod batch;
mod clusters;
mod facets;
mod tables;
mod task;
mod views;

pub(crate) use area::visible_area;
pub(crate) use batch::surface_lobes;
pub(super) use batch::{Materials, add_areas, add_pairs, undersampled};
pub(crate) use facets::FacetSums;
pub(super) use task::PairSums;
pub(super) use task::{of_task, split_by_task};
pub(crate) use views::Views;
pub(super) use views::{BLOCK_FACETS, normals, seen_cosine};
