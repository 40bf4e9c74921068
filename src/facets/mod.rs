//! Facets: the points at which a small-scale surface is sampled.
//!
//! Sample `t` of an Owen-scrambled Sobol' sequence in two dimensions goes to the point of the surface that the first coordinate finds along
//! the cumulative area of the triangles in a coherent order, and, inside the triangle, along its longer side; the second coordinate
//! chooses the point across. Three properties of the sequence are used:
//!
//! - every aligned block of 2^k samples is stratified over the whole surface, so that more samples can be added to those
//!   already there, and errors fall faster than at random;
//! - the eight sub-blocks of a block are such samples themselves. They are the *replicates* whose spread gives the standard error
//!   (`numerics.md`, section 3.6), and halves and quarters of them tell how fast the error falls;
//! - sorted along the first coordinate, the p-th samples of the eight replicates lie in the same stretch of the surface. They are
//!   stored side by side: lane `l` of the sums belongs to replicate `l mod 8`, and neighbouring lanes see nearly the same.
//!
//! `surface`: the triangles in a coherent order. `density`: where samples go. `samples`: the facets. `random`: facets as Wu et al. place them.
//! `common_random_numbers`: samples that keep their places while the surface changes.

mod common_random_numbers;
mod density;
mod random;
mod samples;
mod surface;

pub use common_random_numbers::CommonSamples;
pub use density::Density;
pub use random::random;
pub(crate) use samples::at_places;
pub use samples::{ALIGNMENT, Facets, NO_TRIANGLE, REPLICATES, Runs, sample};
pub use surface::{Clustering, Group, Surface};
