//! Reading files that anyone may have written: none is read beyond the size that its kind can have.

use crate::error::{BadInput, Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Most bytes of a mesh, an image, or a list of pairs: a gigabyte.
pub const MAX_DATA_BYTES: u64 = 1 << 30;
/// Most bytes of a text that people write, a material or a draft: 64 MiB.
pub const MAX_TEXT_BYTES: u64 = 64 << 20;

/// How a text begins that stands for a large file where a repository was copied without its Git LFS.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";

/// The bytes of a file of at most `limit` bytes; `remedy` says what a longer one should have been.
///
/// # Errors
/// [`Error::BadInput`] for a longer or a missing file, or one that only points to another, [`Error::Io`].
pub fn read_bounded(path: &Path, limit: u64, remedy: &str) -> Result<Vec<u8>> {
    let file = File::open(path).map_err(|e| Error::reading(path, e))?;
    let length = file.metadata().map_err(|e| Error::reading(path, e))?.len();
    if length > limit {
        return Err(too_long(length.to_string(), limit, remedy).in_file(path).into());
    }
    read_stream(file, path, limit, remedy)
}

/// The same of a pipe or a device, which tells no length; `name` is its name in messages.
///
/// # Errors
/// As [`read_bounded`].
pub fn read_stream(input: impl Read, name: &Path, limit: u64, remedy: &str) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // One byte more than is allowed, to see whether there is one.
    input.take(limit + 1).read_to_end(&mut bytes).map_err(|e| Error::reading(name, e))?;
    if bytes.len() as u64 > limit {
        return Err(too_long(format!("over {limit}"), limit, remedy).in_file(name).into());
    }
    if bytes.starts_with(LFS_POINTER) {
        let problem = "the file itself is not here: this is a pointer of Git LFS to it";
        return Err(BadInput::new(problem, "fetch it with `git lfs pull`").in_file(name).into());
    }
    Ok(bytes)
}

fn too_long(length: String, limit: u64, remedy: &str) -> BadInput {
    BadInput::new(format!("the file has {length} bytes, and {limit} are read at most"), remedy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_to_its_limit_and_not_beyond() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("seven");
        std::fs::write(&path, b"sevenby").unwrap();
        assert_eq!(read_bounded(&path, 7, "").unwrap(), b"sevenby");
        let message = read_bounded(&path, 6, "name another").unwrap_err().to_string();
        assert!(message.contains("seven: the file has 7 bytes, and 6 are read at most") && message.contains("name another"), "{message}");
        let endless = read_stream(std::io::repeat(0), Path::new("zeros"), 1000, "name another").unwrap_err().to_string();
        assert!(endless.contains("zeros: the file has over 1000 bytes"), "{endless}");
        assert!(read_bounded(&folder.path().join("none"), 6, "").is_err());
        std::fs::write(&path, b"version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 12345\n").unwrap();
        let message = read_bounded(&path, 1000, "").unwrap_err().to_string();
        assert!(message.contains("seven: the file itself is not here") && message.contains("git lfs pull"), "{message}");
    }
}
