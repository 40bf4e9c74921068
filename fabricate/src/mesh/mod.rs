//! The surface to be folded: triangles in mm, checked, coplanar neighbours merged to facets, edges with their fold angles.
//!
//! A facet is a polygon that stays flat; an edge is where two facets meet, or where the surface ends. What paper cannot do is
//! refused here: three facets at one edge, facets turned against each other, one facet twice, corners that are no numbers.

mod adjacency;
mod build;
mod facet;
mod faceted;
mod intersections;
mod merge;
mod nearest;
mod repair;
mod t_junctions;
mod tolerance;
mod triangles;

pub(crate) use adjacency::Adjacency;
pub use adjacency::{Edge, Side};
pub use build::MAX_FACETS;
pub use facet::{Facet, width};
pub use faceted::Mesh;
pub use intersections::Crossing;
pub use nearest::NearTriangle;
pub(crate) use nearest::nearest;
pub(crate) use repair::repair;
pub(crate) use t_junctions::close_t_junctions;
pub use tolerance::Tolerance;
pub(crate) use tolerance::WELD_SHARE;
pub use triangles::Triangles;
