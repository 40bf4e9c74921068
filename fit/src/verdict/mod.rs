//! Whether the fitted material is to be believed: its pictures beside the photographs, and a photograph that was held out.

pub mod assumption;
pub mod evidence;
pub mod gates;
pub mod near;
pub mod params;
pub mod picture;
pub mod validate;
