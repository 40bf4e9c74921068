//! The large-scale appearance: scene, camera, lights, environment map -> picture.
//!
//! ```text
//! scene file -> scene -> world -> gather -> query -> shade -> picture
//!            (mesh, shapes, environment, opacity, layers, normal_map)
//! ```
//!
//! `L = fbar E av/cos_o + (1 - c) background`: `E` is the irradiance on a plane that faces the light, `c` the share of rays from
//! the viewer that hit anything (`docs/formats.md`). For a surface without gaps that is `fbar E`. Light is direct light at the large
//! scale; objects shadow each other.
//!
//! An object may be covered by several materials (`layers`): each place has a list of them with weights that sum to 1, from masks that are
//! filtered to the footprint of a sample (`mapping`, `texture`). `gather` makes one point of each, so that what follows knows points of one
//! material only: `query` and `shade` see a place with three layers as three points of one pixel, and sum their radiance:
//! `L = Σ w t fbar E av/cos_o + (1 - Σ w c) background`, with weights `w` and tints `t`.
//!
//! The effective BRDF is computed only for the cells of directions that the picture's pixels and lights touch (`query_table`).

mod compare;
mod environment;
mod environment_lighting;
mod gather;
#[cfg(test)]
mod layer_tests;
mod layers;
mod light_sampling;
mod mapping;
mod mesh;
mod normal_map;
mod opacity;
mod picture;
mod query_plan;
mod query_table;
mod renderer;
mod scene;
mod scene_picture;
mod shade;
mod shapes;
#[cfg(test)]
mod tests;
mod texture;
mod world;

pub use compare::{Difference, colour_code, difference, difference_of};
pub use environment::Environment;
pub use environment_lighting::{EnvironmentLit, EnvironmentReport, LEAST_TOLERANCE, PictureError, ResponseReport};
pub use gather::{Lit, Point, View, gather_all, lights};
pub use layers::{Blend, Cover, Covering, Layer, Mask, Tint};
pub use light_sampling::{MOST_LIGHTS, light_sampling};
pub use mapping::{Chart, Footprint, ImagePlace, Projection};
pub use mesh::{LargeMesh, Placement, Tangents};
pub use normal_map::NormalMap;
pub use opacity::Opacity;
pub use picture::{Picture, SOFTWARE};
pub use query_plan::{PROBES, QueryPlan};
pub use query_table::QueryTable;
pub use renderer::{LightSampling, MaterialReport, Rendered};
pub use scene::{Camera, Exposure, LEAST_LIGHTS, Light, Lighting, Object, SCENE_TEMPLATE, Scene, SceneMaterial, Shape, Surroundings};
pub use scene_picture::render;
pub use shade::{Frame, colours, touched};
pub use shapes::{Cylinder, Plane, Sphere, any_across};
pub use texture::{Texture, Wrap};
pub use world::{SurfacePoint, World};
