//! Running the binary in a folder of its own.

pub mod cases;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A material file that is right, for [`PLANE`].
pub const MATERIAL: &str = r#"format = 1
name = "plane"

[geometry]
kind = "mesh"
file = "plane.obj"
period = [1.0, 1.0]

[[surface]]
part = "*"
brdf = { model = "lambert", albedo = 0.5 }
"#;

/// A mesh that is right: one flat tile in two parts.
pub const PLANE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl low\nf 1 2 3\nusemtl high\nf 1 3 4\n";

/// Pairs that are right.
pub const PAIRS: &str = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n0,0,1,0,0,1\n0.6,0,0.8,0,0.6,0.8\n";

/// A folder with a material (`m.toml`), its mesh (`plane.obj`) and pairs (`p.csv`), all right.
pub struct Folder(tempfile::TempDir);

/// What a run said.
pub struct Said {
    /// Exit status.
    pub status: i32,
    /// Standard output.
    pub stdout: String,
    /// Standard error.
    pub stderr: String,
}

impl Folder {
    /// A folder with the three files.
    pub fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        folder.write("m.toml", MATERIAL);
        folder.write("plane.obj", PLANE);
        folder.write("p.csv", PAIRS);
        folder
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a file in it.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        std::fs::write(self.path(name), content).unwrap();
    }

    /// The text of a file in it.
    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    /// The names and contents of all files in it.
    pub fn snapshot(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut files = BTreeMap::new();
        let mut folders = vec![self.0.path().to_path_buf()];
        while let Some(folder) = folders.pop() {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    folders.push(path.clone());
                }
                files.insert(path.clone(), std::fs::read(&path).unwrap_or_default());
            }
        }
        files
    }

    /// The command with these arguments, to be run in this folder, with a cache in its subfolder `cache`.
    pub fn command<I: IntoIterator<Item: AsRef<OsStr>>>(&self, arguments: I) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_biscale"));
        command.args(arguments).current_dir(self.0.path()).env("BISCALE_CACHE", self.path("cache"));
        command
    }

    /// Runs the command with these arguments in this folder.
    pub fn run<I: IntoIterator<Item: AsRef<OsStr>>>(&self, arguments: I) -> Said {
        Said::from(self.command(arguments).output().unwrap())
    }
}

impl From<Output> for Said {
    fn from(output: Output) -> Self {
        Self {
            status: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

/// A file of the project.
pub fn project(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path)
}
