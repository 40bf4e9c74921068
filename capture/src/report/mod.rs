//! `report.html`: every photograph with what was found in it, every number, every check. One file that needs no other.

mod page;
mod sections;
mod text;
mod view;

pub use page::Report;
pub use view::{Mark, PhotoView};
