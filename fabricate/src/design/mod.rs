//! What is to be made: a material's tile repeated over a size, or a mesh as it is, in mm.

mod colours;
mod recipe;
mod source;
mod texture;

pub use recipe::FoldRecipe;
pub use source::{DEFAULT_SIZE, Extent, MAX_TRIANGLES, MESH_ENDINGS, Source, check_scale};
pub use texture::Texture;
