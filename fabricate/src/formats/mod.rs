//! The files of a pattern, by the ending that the user chose.

mod dxf;
mod fold_file;
mod origami_simulator;
mod output;
mod pdf;
mod png;
mod svg;
mod svg_tree;

pub use fold_file::CREATOR;
pub use output::{Content, Format, side_by_side};
