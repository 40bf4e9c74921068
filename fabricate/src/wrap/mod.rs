//! The sheet that is wrapped around a large object, with its markers.

pub mod aruco;
mod board;
mod clip;
mod frame;
mod joins;
mod lines;
mod markers;
mod measures;
mod patches;
mod plan;
mod sheet;
mod target;

pub use board::{BoardDesign, board_page};
pub use markers::Marker;
pub use measures::JOIN;
pub use patches::Patch;
pub use sheet::{SheetPart, Wrap, wrap};
pub use target::{SEAM, Target, WrapFit};
