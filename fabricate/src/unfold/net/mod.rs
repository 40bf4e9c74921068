//! Nets: a surface as pieces that lie flat, and the one kind of change of them.

mod align;
mod moves;
mod pieces;
mod pose;
mod problem;
mod span;

pub use moves::{Change, Move, Outcome};
pub use pieces::{Net, TabChoice};
pub use pose::Pose;
pub use problem::{Problem, Sheet};
