//! Reading files that anyone may have written.

use crate::error::{BadInput, Error, Result};
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// The bytes of a file of at most `limit` bytes; `remedy` says what a longer one should have been.
pub(super) fn read_bounded(path: &Path, limit: u64, remedy: &str) -> Result<Vec<u8>> {
    let file = File::open(path).map_err(|e| Error::reading(path, e))?;
    let length = file.metadata().map_err(|e| Error::reading(path, e))?.len();
    let mut bytes = Vec::new();
    // A pipe or a device tells no length: read one byte more than is allowed, and see.
    if length <= limit {
        file.take(limit + 1).read_to_end(&mut bytes).map_err(|e| Error::reading(path, e))?;
    }
    if length.max(bytes.len() as u64) > limit {
        let problem = format!("the file has {} bytes", if length > limit { length.to_string() } else { format!("over {limit}") });
        return Err(BadInput::new(problem, remedy).in_file(path).into());
    }
    Ok(bytes)
}
