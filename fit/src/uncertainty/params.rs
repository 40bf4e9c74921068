//! The numbers of this stage, and where they come from.

/// What counts as known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertaintyParams {
    /// What each of the three channels of a pixel counts: what the model leaves out of the shape of a surface, all three leave out alike.
    pub channels_alike: f64,
    /// Distance from a bound, over the range, at which an unknown lies on it; also half the step of the derivative of a parameter by its
    /// share of the way between the bounds. Chosen, not measured: more calls values bound that a search left on purpose, less misses those that it could
    /// not bring all the way.
    pub at_bound: f64,
    /// Factor by which an unknown must be worse known without the close-up to be known from it. Chosen, not measured (`docs/fit.md`, step
    /// 10): more hides what the close-up decides, less names it for what the photographs tell nearly as well.
    pub from_close_up: f64,
    /// Least range of an unknown: guards a division where bounds are equal, or a photograph is black.
    pub least_range: f64,
    /// Relative distance from its wall at which a linear unknown lies on it: a few thousand roundings.
    pub on_wall: f64,
    /// One over the variance of a uniform distribution over a range of 1: what bounds say by themselves.
    pub bounds_precision: f64,
    /// Values of a profile, in standard deviations.
    pub profile: [f64; 7],
    /// Those that tell how wide its valley is, from and to: nearer the samples tell as much, and farther nobody asks.
    pub telling: [f64; 2],
    /// Steps towards the least objective at each value. Chosen, not measured: the first answers to the held unknown, the second to what
    /// is not linear; each costs an evaluation a value, and fewer leave profiles too high, which calls an unknown better known than it is.
    pub profile_steps: usize,
    /// Least and largest standard deviation that a profile steps by, over the range. Chosen, not measured: steps below the least show the noise of
    /// samples in place of the valley, and above the largest the farthest value of [`profile`](Self::profile) lies beyond both bounds.
    pub profile_sigma: [f64; 2],
    /// What is added to the diagonal of the answers' matrix: over the diagonal, and in all. Keeps it positive definite; what nothing
    /// tells stays.
    pub profile_ridge: [f64; 2],
}

/// The values of this version.
pub const PARAMS: UncertaintyParams = UncertaintyParams {
    channels_alike: 1.0 / 3.0,
    at_bound: 0.005,
    from_close_up: 3.0,
    least_range: 1e-9,
    on_wall: 1e-12,
    bounds_precision: 12.0,
    profile: [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0],
    telling: [1.5, 2.5],
    profile_steps: 2,
    profile_sigma: [0.003, 0.35],
    profile_ridge: [1e-6, 1e-9],
};
