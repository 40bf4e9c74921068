//! Scene files: TOML in, a [`Scene`] out, with all that it names loaded and checked.
//!
//! The format is documented in `docs/scenes.md`; every mistake names file, line, field, value and remedy.

mod camera;
mod covering;
#[cfg(test)]
mod covering_tests;
mod exposure;
mod fields;
mod file;
mod light;
mod material;
mod object;
mod shape;

pub use camera::Camera;
pub use exposure::Exposure;
pub use file::{SCENE_TEMPLATE, Scene};
pub use light::{LEAST_LIGHTS, Light, Lighting, Surroundings};
pub use material::SceneMaterial;
pub use object::Object;
pub use shape::Shape;
