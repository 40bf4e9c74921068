//! A measured value with its standard error.

use serde::Serialize;

/// A value with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Standard error, in the same unit.
    pub error: f64,
}
