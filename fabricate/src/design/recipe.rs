//! How large, how thick, how reduced: what makes the same surface again.

use serde::{Deserialize, Serialize};

/// How large, in words that an output keeps so that a verifier can build the same design again.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoldRecipe {
    /// Printed mm for one mm of the design (of a mesh file: for one of its units).
    pub scale: f64,
    /// Whole periods in x and y; 1 x 1 for a mesh file.
    pub periods: [u32; 2],
    /// Thickness of the paper, mm; with 0 folds take nothing.
    pub thickness: f64,
    /// Inner radius of folds, mm, for what they take (see [`crate::surface::Bend`]).
    #[serde(default)]
    pub fold_radius: f64,
    /// Where the paper keeps its length, from the inner side of a fold, as a share of its thickness.
    #[serde(default)]
    pub k_factor: f64,
    /// Most facets, if the surface was reduced.
    pub max_facets: Option<usize>,
    /// Largest slope error of the reduction, degrees, if it was reduced to that.
    pub slope_tolerance_deg: Option<f64>,
    /// Largest facet, mm, if larger ones were split.
    pub split: Option<[f64; 2]>,
}
