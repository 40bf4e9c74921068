//! Photographs of a sample to calibrated linear measurements.

pub mod weave;
