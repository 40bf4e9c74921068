//! Photographs in, calibrated linear measurements out.
//!
//! ```text
//! shoot file -> photographs -> linear values -> flat field -> colour -> camera and poses -> light -> rectified close-up -> capture.json
//! ```
//!
//! What finds something in a picture (boards, markers, checkers) is `OpenCV`'s and stands in `vision`, behind the feature `opencv`; `run` puts all together
//! and needs it, too. The rest is plain arithmetic and builds without. Nothing here prints.

#![allow(clippy::cast_possible_wrap, reason = "pixels, cells and threads are counted by numbers far below 2^31")]
#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(a < b)` is meant: what is no number must not pass")]

pub mod board;
pub mod checks;
pub mod colour;
pub mod dictionary;
pub mod edge_pose;
pub mod edges;
pub mod flat;
pub mod kit;
pub mod lens;
pub mod lens_group;
pub mod light;
pub mod linear;
pub mod metadata;
pub mod noise;
pub mod photo;
pub mod pose;
pub mod report;
pub mod resample;
#[cfg(feature = "opencv")]
pub mod run;
pub mod sheet;
pub mod shoot;
pub mod single;
#[cfg(feature = "opencv")]
pub mod sort;
pub mod surface;
#[cfg(feature = "opencv")]
pub mod vision;
pub mod weave;
