//! Folding patterns of small-scale surfaces: from the design to sheets that a person can print, cut, fold and glue.

pub mod mesh;
pub mod polygon;
pub mod random;
pub mod unfold;
