//! Where a search stands.

/// A point of the search in its own units.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Values of all parameters of the fit file.
    pub values: Vec<f64>,
    /// Azimuth and elevation of the light of each distant photograph against what was given, degrees.
    pub lights: Vec<[f64; 2]>,
    /// The same of the light of the close-up.
    pub near_light: [f64; 2],
    /// Blur of the close-up over what its edges tell.
    pub blur: f64,
    /// Linear unknowns that the search moves.
    pub linear: Vec<(usize, f64)>,
}
