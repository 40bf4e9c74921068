//! What `OpenCV` finds in photographs: boards, markers, checkers, balls; and the camera that explains them.

pub mod board;
pub mod calibrate;
pub mod checker;
pub mod circle;
mod image;
pub mod markers;
pub mod pnp;

pub use image::{GreyImage8, Luminance, set_threads};
