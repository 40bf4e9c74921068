//! What a fit sets in a material: numbers and colours by key, the same for the typed values of the inner loop and for the text of the
//! file that is written.

use biscale::error::{BadInput, Result};
use biscale::material::{MaterialValues, NumberKey};

/// A value for a number or colour of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Assignment {
    /// A number; a colour gets it in all channels.
    Number(NumberKey, f64),
    /// A whole number of the geometry.
    Whole(&'static str, u32),
    /// A colour.
    Colour(NumberKey, [f64; 3]),
}

/// Sets values in a typed material.
///
/// # Errors
/// A value out of range.
pub fn assign(material: &mut MaterialValues, assignments: &[Assignment]) -> Result<(), BadInput> {
    assignments.iter().try_for_each(|assignment| match *assignment {
        Assignment::Number(number, value) => material.set(number, value),
        Assignment::Whole(key, value) => material.geometry.set_whole(key, value),
        Assignment::Colour(number, colour) => material.set_colour(number, colour),
    })
}
