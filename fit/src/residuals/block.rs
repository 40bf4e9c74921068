//! A residual block: one source of knowledge that a state of the material is compared with.

use crate::residuals::colour_basis::ColourBasis;
use crate::residuals::equations::Equations;

/// One source of knowledge. The objective is Huber's loss over the equations of all blocks, in the order in which they are added.
///
/// A block is made for one state. It knows what it measures and what the model shows there, as light that is linear in the colours; which
/// colours are solved for is the basis's matter.
pub trait ResidualBlock {
    /// Adds its equations, and the residuals that no unknown changes.
    fn add_to(&self, basis: &ColourBasis<'_>, equations: &mut Equations);
}
