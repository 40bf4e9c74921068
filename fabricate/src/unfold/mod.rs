//! Unfolding: a surface of facets becomes pieces that lie flat without overlaps, tabs included.

mod alike;
mod begin;
mod copies;
mod effort;
mod fits;
mod net;
mod pattern;
mod piece;
mod search;
mod strips;
mod tab_shapes;

pub use copies::Copies;
pub use effort::{Effort, Stop};
pub use fits::{ROLL_LENGTH, room};
pub use net::{Change, Move, Net, Outcome, Pose, Problem, Sheet, TabChoice};
pub use pattern::{FLAT_ANGLE_DEG, Pattern};
pub use piece::{Fold, Glue, Piece, Tab};
pub use search::search;
pub use strips::{Crossing, END, Strip, bend_length, strips};
pub use tab_shapes::{TabShapes, TabStyle};

use crate::mesh::Mesh;
use biscale::error::BadInput;
use fits::check_fit;

/// Unfolds a mesh; parts that are alike are unfolded once, unless they are `textured`: then each copy is painted in its own way.
/// Also tells how many glued edges have no place for a tab.
///
/// # Errors
/// A facet larger than the page.
pub fn unfold(
    mesh: &Mesh,
    textured: bool,
    sheet: Sheet,
    tabs: TabStyle,
    effort: Effort,
    stop: &Stop<'_>,
) -> Result<(Pattern, usize), BadInput> {
    check_fit(mesh, sheet)?;
    let copies = if textured { Copies::none(mesh) } else { Copies::find(mesh) };
    let problem = Problem::new(&copies.once, TabShapes::new(&copies.once, tabs), sheet);
    let mut net: Net<'_, '_> = search(&problem, effort, stop);
    net.align_tabs();
    let bare = net.without_tab().map(|e| copies.count(e)).sum();
    Ok((copies.expand(mesh, Pattern::new(&net)), bare))
}
