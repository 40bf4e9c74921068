//! Small-scale geometry: a recipe in, a [`Tile`] out.
//!
//! A tile is one period of the surface as a triangle mesh, z up, repeated on the lattice `(period.x, 0)`, `(0, period.y)`.
//! It may overhang its cell: the surface is the union of all its translates.

mod builder;
mod clean;
mod grooves;
pub mod height_field;
mod kinds;
pub mod mesh;
pub mod params;
mod pyramids;
mod rods;
mod template;
#[cfg(test)]
mod tests;
mod tile;
mod values;
pub mod weave;

pub use builder::MAX_TRIANGLES;
pub use grooves::{Grooves, Profile};
pub use kinds::{Description, Geometry, KINDS, describe};
pub use pyramids::Pyramids;
pub use rods::Rods;
pub use template::template;
pub use tile::{HeightGrid, Tile};
pub use values::GeometryValues;
