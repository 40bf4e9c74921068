//! `kind = "height-field"`: heights from an image or a scan.
//!
//! The heights are taken in this order: read, scaled, a plane removed (`detrend`), reduced by a box filter (`resolution`), made
//! periodic (`edge`). Row 0 of the file is its upper edge, at the largest y. The tile keeps the heights as a [`HeightGrid`](crate::geometry::HeightGrid), and its
//! triangles are exactly what that grid interpolates. Texture coordinates are the position over the tile.

mod grid;
mod recipe;
mod tmd;

pub use recipe::{Edge, HeightField, PARAMS, PARTS, Scale};
pub use tmd::{HeightMap, write as write_tmd};
