//! A folder that a command fills file by file.

use biscale::error::{BadInput, Error, Result};
use std::path::{Path, PathBuf};

/// The folder of a command's outputs. One that was made here and stayed empty goes away again.
pub struct MadeFolder {
    path: PathBuf,
    made: bool,
}

impl MadeFolder {
    /// Makes the folder at `path` if it is not there.
    ///
    /// # Errors
    /// Bad input if something else stands there; i/o.
    pub fn create(path: &Path) -> Result<Self> {
        if path.exists() && !path.is_dir() {
            return Err(BadInput::new("the output is no folder", "name a folder").in_file(path).at_field("output").into());
        }
        let made = !path.exists();
        std::fs::create_dir_all(path).map_err(|source| Error::Io { action: "create", path: path.to_path_buf(), source })?;
        Ok(Self { path: path.to_path_buf(), made })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for MadeFolder {
    fn drop(&mut self) {
        if self.made {
            // Refused where there is something in it, as it should be.
            let _ = std::fs::remove_dir(&self.path);
        }
    }
}
