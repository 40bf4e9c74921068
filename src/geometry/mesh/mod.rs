//! `kind = "mesh"`: triangles from an OBJ, PLY or STL file, periodic in x and y.
//!
//! A file's own normals are not used: interpolated ones break `av = cos(theta_o)` and energy. Its vertices may reach over the period.
//! Faces that are turned against the others of their surface are turned, with a note.
//! The readers never trust a count in a file: nothing is allocated that the file's size does not back.

mod diagonals;
mod face_groups;
mod file;
mod obj;
mod orientation;
mod ply;
mod polygon;
mod recipe;
mod soup;
mod stl;
mod textures;
mod turning;

pub use face_groups::{FaceGroups, edges};
pub(crate) use file::load_coloured;
pub use file::{PlainMesh, read_plain};
pub use recipe::{Mesh, PARAMS, PARTS};
