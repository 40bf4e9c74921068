//! The files of `biscale fold`.

use crate::common::output::Target;
use biscale::bounded_file::{MAX_DATA_BYTES, read_bounded};
use biscale::error::{Error, Result};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The files to be written: checked as far as their names are known before the work.
pub(super) struct Outputs {
    out: PathBuf,
    material: PathBuf,
    force: bool,
}

impl Outputs {
    pub(super) fn new(out: &Path, force: bool, material: &Path) -> Result<Self> {
        let outputs = Self { out: out.to_path_buf(), material: material.to_path_buf(), force };
        // How many pages there will be is not known yet; one and the sidecar stand for all.
        outputs.target(out)?;
        outputs.target(&out.with_extension("json"))?;
        Ok(outputs)
    }

    fn target(&self, path: &Path) -> Result<Target> {
        Target::new(path, self.force, &[&self.material], made_here)
    }

    /// `OUT.svg`, or `OUT-1.svg` and so on.
    fn numbered(&self, k: usize, count: usize) -> PathBuf {
        if count == 1 {
            return self.out.clone();
        }
        let stem = self.out.file_stem().unwrap_or_default().to_string_lossy();
        let ending = self.out.extension().unwrap_or_default().to_string_lossy();
        self.out.with_file_name(format!("{stem}-{}.{ending}", k + 1))
    }

    pub(super) fn write(&self, files: &[Vec<u8>], sidecar: &Value) -> Result<Vec<PathBuf>> {
        let mut names: Vec<PathBuf> = (0..files.len()).map(|k| self.numbered(k, files.len())).collect();
        let targets: Vec<Target> = names.iter().map(|n| self.target(n)).collect::<Result<_>>()?;
        let beside = self.out.with_extension("json");
        let beside_target = self.target(&beside)?;
        for (target, bytes) in targets.iter().zip(files) {
            target.write(|out| out.write_all(bytes))?;
        }
        let text = serde_json::to_vec_pretty(sidecar).map_err(|e| Error::Numeric(format!("cannot write the sidecar: {e}")))?;
        beside_target.write(|out| out.write_all(&text))?;
        names.push(beside);
        Ok(names)
    }
}

/// Whether a file was written by this command: it says so.
fn made_here(path: &Path) -> bool {
    let creator = biscale_fabricate::formats::CREATOR.as_bytes();
    read_bounded(path, MAX_DATA_BYTES, "").is_ok_and(|bytes| bytes.windows(creator.len()).any(|w| w == creator))
}
