//! Photographs minus model: the equations that a state of the material must meet, and the colours that meet them best.

pub mod derivatives;
pub mod equations;
pub mod indirect;
pub mod model;
mod near;
pub mod registration;
pub mod tile_view;
pub mod unknowns;
