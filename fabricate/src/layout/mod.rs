//! Where pieces lie on pages: nested by their true shapes, strips on shelves.

mod grid;
mod nest;
mod place;
mod shelves;
mod turns;

pub use nest::nest;
pub use place::{GAP, PiecePlace};
pub use shelves::shelves;
