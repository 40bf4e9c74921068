//! File formats that other programs read and write.
//!
//! A reader takes bytes that anyone may have written: it checks every count and offset against the bytes that are there before
//! it allocates, and answers a wrong file with a [`crate::BadInput`] that names the field.

pub mod merl;
pub mod rgl;

use crate::error::{BadInput, Error, Result};
use std::path::Path;

/// The bytes of a file of at most `limit` bytes; `remedy` says what a longer one should have been.
fn read_bounded(path: &Path, limit: u64, remedy: &str) -> Result<Vec<u8>> {
    let length = std::fs::metadata(path).map_err(|e| Error::reading(path, e))?.len();
    if length > limit {
        return Err(BadInput::new(format!("the file has {length} bytes"), remedy).in_file(path).into());
    }
    std::fs::read(path).map_err(|e| Error::reading(path, e))
}

#[cfg(test)]
pub(crate) mod test_files;
