//! What a rectified close-up says about a woven or embossed surface: where it repeats, how its threads lie, how wide they are, which is on top.
//!
//! ```text
//! photograph -> field (cut, even light) -> spectrum -> lattice of its peaks -> grid of threads -> fold (one repeat, noise averaged)
//!                                              \-> autocorrelation                        \-> model: draft and shape -> class, widths
//! ```
//!
//! Angles are counter-clockwise with y up, though the rows of a photograph run down. Warp threads are those nearer to the vertical.
//! How each step works, and how well, stands in `docs/weave-analysis.md`.
//!
//! Where parameters come from: a parameter with a derivation has it beside it. The others are chosen, not measured one by one: the whole was developed on the
//! drawn cloths of seeds 7 and 8 and judged on those of 9, 10 and 11, by
//! `SEED=7 COUNT=140 cargo test -p biscale-capture --test weave table_of -- --ignored --nocapture`.

mod analyse;
mod analysis;
mod autocorrelation;
mod class;
mod cloth;
mod draft_fit;
mod drafts;
mod enlarged;
mod field;
mod finding;
mod fold;
mod gaps;
mod grid;
mod hole;
mod input;
mod lattice;
mod material;
mod measured;
mod model;
mod orientation;
mod relief;
mod scale;
mod shape_fit;
mod simplex;
mod spectrum;
mod threads;

pub use analyse::{MAX_UNEXPLAINED, MIN_CONFIDENCE, MIN_PIXELS_A_THREAD, analyse};
pub use analysis::{Analysis, Axis, Weave};
pub use class::{Class, TwillDirection};
pub use finding::{Finding, FindingCode};
pub use input::{MIN_SIDE, RectifiedPhoto, WeaveOptions};
pub use material::MaterialGuesses;
pub use measured::Measured;
pub use relief::{Profile, Relief};
