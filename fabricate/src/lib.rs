//! Folding patterns of small-scale surfaces: from the design to sheets that a person can print, cut, fold and glue.

pub mod aruco;
pub mod assembly;
pub mod design;
pub mod drawing;
pub mod exchange;
pub mod fold;
pub mod fold_file;
pub mod labels;
pub mod layout;
pub mod mesh;
pub mod offset;
pub mod output;
pub mod pattern;
pub mod pdf;
pub mod polygon;
pub mod preview;
pub mod random;
pub mod sheets;
pub mod simplify;
pub mod split;
pub mod strips;
pub mod svg;
pub mod target;
pub mod unfold;
pub mod verify;
