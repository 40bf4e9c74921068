//! Material files: TOML in, a [`Material`] out, and with its geometry built a [`SmallScale`] surface.
//!
//! Every mistake names file, line, field, value and remedy. The format is documented in `docs/formats.md`.

mod file;
mod recipe;
mod small_scale;
mod surface;
mod values;

pub use crate::image_file::TintImage;
pub use recipe::{MAX_BOUNCES, MAX_HEIGHT, Material, UNITS};
pub use small_scale::{SmallScale, are_reciprocal};
pub use surface::{Surface, Tint};
pub use values::{MaterialValues, NumberKey};
