//! What folds take of the paper: the bend allowance.
//!
//! The design's surface is the printed side. Paper of thickness `t` that is folded by the angle `a` around an inner radius `R` keeps its
//! length at `K t` from the inner side (`K = 1/2`: in its middle), on an arc of `a (R + K t)`. The planes of the printed side meet outside of
//! a mountain's arc and inside of a valley's, at `(R + t) tan(a / 2)` and `R tan(a / 2)` from where it begins. So a fold takes from the two facets
//! together (DIN 6935; Machinery's Handbook, "Bend allowance"; the setback and deduction of sheet metal)
//!
//! ```text
//! mountain: 2 (R + t) tan(a / 2) - a (R + K t)        valley: 2 R tan(a / 2) - a (R + K t)
//! ```
//!
//! where a negative number is given and not taken. Where all folds are parallel (grooves, any strip) every facet is narrowed by just that.
//! Where folds meet in corners, facets cannot all be narrowed and still meet: the surface is moved inwards as a whole, by `d`, which takes
//! `2 d tan(a / 2)` from a mountain and gives as much to a valley. `d` is the best by least squares over the lengths of the folds; it is exact
//! where all folds are alike, as on a regular solid, and what is left is told.

mod allowance;
mod apply;
mod strip;

pub use allowance::Bend;
