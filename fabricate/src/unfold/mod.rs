//! Unfolding: a surface of facets becomes pieces that lie flat without overlaps, tabs included.

pub mod net;
pub mod search;
pub mod tabs;
