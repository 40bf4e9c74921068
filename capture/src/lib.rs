//! Photographs in, calibrated linear measurements out.

pub mod weave;
