//! What has no light in it: conversions, statistics, colour, sampling, linear algebra, searches for a minimum.
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
//! | [`hash`], [`stable_bytes`] | FNV-1a for checksums that files hold; what such hashes are taken of |
//! | [`random`], [`low_discrepancy`], [`seed`] | streams, Sobol' points, and the folding of a seed |
//! | [`linear_algebra`] | Cholesky and symmetric eigenvalues (`faer`) |
//! | [`least_squares`] | Levenberg-Marquardt with numeric derivatives (`basin`) |
//! | [`nelder_mead`] | Nelder and Mead's simplex with bounds (`basin`) |
//! | [`words`] | numbers as notes tell them |
//! | [`outcome`] | how a search ended |
//! | [`non_negative`] | least squares with unknowns of at least 0 |
//! | [`randomized_svd`] | singular values of large matrices by random probes |

pub mod cast;
pub mod clustering;
pub mod colour;
pub mod convex_hull;
pub mod hash;
pub mod least_squares;
pub mod linear_algebra;
pub mod low_discrepancy;
pub mod nelder_mead;
pub mod non_negative;
pub mod outcome;
pub mod random;
pub mod randomized_svd;
pub mod seed;
pub mod stable_bytes;
pub mod statistics;
pub mod words;
