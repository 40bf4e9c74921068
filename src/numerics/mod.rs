//! What has no light in it: conversions, statistics, colour, sampling, linear algebra.
//!
//! Each file is one subject, with one definition of each quantity; the other crates of the workspace use them too. Functions are pure, work on plain
//! slices, and run on the thread that calls them unless they say otherwise. The files are named by subject (`statistics::median`,
//! `cast::narrow`), so they are public as modules.
//!
//! | file | what it has |
//! |---|---|
//! | [`cast`] | conversions that may lose digits, each with its rule |
//! | [`statistics`] | median, ranks, quantiles, relative RMS |
//! | [`colour`] | sRGB, luminance, CIE L\*a\*b\* |
//! | [`convex_hull`] | hull of points in the plane |
//! | [`clustering`] | weighted k-means |
//! | [`hash`] | FNV-1a for checksums that files hold |
//! | [`random`], [`low_discrepancy`], [`seed`] | streams, Sobol' points, and the folding of a seed |
//! | [`linear_algebra`] | Cholesky and symmetric eigenvalues (`faer`) |
//! | [`randomized_svd`] | singular values of large matrices by random probes |

pub mod cast;
pub mod clustering;
pub mod colour;
pub mod convex_hull;
pub mod hash;
pub mod linear_algebra;
pub mod low_discrepancy;
pub mod random;
pub mod randomized_svd;
pub mod seed;
pub mod statistics;
