//! The reference method: fresh rays from the viewer for every pair, no facets and no clusters, optionally with
//! interreflections.
//!
//! Parallel rays start uniformly over one period above the surface. Those that meet a front face see the visible projected
//! area: their share times `cos(theta_o)` is `av`, and the mean of `fr (n·wi)+ V(wi)` over them is `fbar`. A ray that meets a
//! back face sees black and is not in `av`; one that passes through a gap is not either.
//!
//! Each pair has [`BATCHES`](super::plan::BATCHES) independent randomised sequences. With `S_r` the light and `a_r` the front share of batch `r`,
//! and `q = mean S / mean a`, the squared standard error is `sum (S_r - q a_r)^2 / (R mean(a)^2)` (`numerics.md`,
//! section 3.6); averaging the ratios of the batches would be biased. Rays that are given up after
//! [`MAX_PERIODS`](crate::visibility::MAX_PERIODS) cells add what they could have changed.
//!
//! Samples go where they help: until the relative RMS error meets the tolerance, the pair is doubled whose doubling takes away
//! most squared error for its rays. A plan is the list of those doublings' counts, one a round.
//!
//! [`transport`](crate::transport) follows one ray. `rays`: what those of a batch bring back. `tally`: mean and error of a pair. `rounds`: how many rays each pair gets. `method` puts them together.

mod method;
mod rays;
mod rounds;
mod tally;

pub(super) use method::reference;
