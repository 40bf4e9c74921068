//! Folding patterns of small-scale surfaces: from the design to sheets that a person can print, cut, fold and glue.

pub mod design;
pub mod drawing;
pub mod formats;
pub mod layout;
pub mod mesh;
pub mod paper;
pub mod polygon;
pub mod preview;
pub mod surface;
pub mod unfold;
pub mod verify;
pub mod wrap;
