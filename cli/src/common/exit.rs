//! Exit statuses, as formats.md lists them.

use super::interrupt;
use biscale::error::Error;

/// Bad input or arguments.
pub const BAD_INPUT: u8 = 2;
/// Everything else that fails.
pub const FAILED: u8 = 1;

/// The exit status of an error.
pub fn status(error: &Error) -> u8 {
    match error {
        Error::BadInput(_) => BAD_INPUT,
        Error::Interrupted => interrupt::STATUS,
        Error::Unsupported { .. } | Error::Io { .. } | Error::Numeric(_) => FAILED,
    }
}
