//! `kind = "mesh"`: triangles from an OBJ, PLY or STL file, periodic in x and y.
//!
//! A file's own normals are not used: interpolated ones break `av = cos(theta_o)` and energy. Its vertices may reach over the period.
//! The readers never trust a count in a file: nothing is allocated that the file's size does not back.

mod file;
mod obj;
mod orientation;
mod ply;
mod polygon;
mod recipe;
mod soup;
mod stl;
mod textures;

pub(crate) use file::load_coloured;
pub use file::{PlainMesh, read_plain};
pub use recipe::{Mesh, PARAMS, PARTS};
