//! A file as the output of a command: whole, or not there.

use super::streams::{BUFFER, stdout_error};
use super::unfinished;
use biscale::error::{BadInput, Error, Result};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Temporary files that are being written, so that an interrupt can remove them.
static UNFINISHED: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes the temporary files of outputs that are not finished. For the end of an interrupted process only.
pub fn remove_unfinished() {
    for path in UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).drain(..) {
        // The process ends here: there is nobody left to tell.
        let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    }
}

/// A file to be written: checked before the work begins, written beside its place and renamed when it is whole.
#[derive(Clone, Debug)]
pub struct Target {
    /// The file as the user named it.
    path: PathBuf,
    kind: Kind,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Kind {
    /// A regular file at this path (links followed); `replace` if one that exists may be overwritten.
    File { real: PathBuf, replace: bool },
    /// Standard output (`-`).
    Stdout,
    /// A device or pipe: written as it is.
    Device,
}

impl Target {
    /// Checks that `path` can be written, before any work is done.
    ///
    /// An existing file is refused unless `force`, or `made_here` recognises it as an output of the same command.
    /// `inputs` are files that the command reads: the output may be none of them unless `force`. `-` is standard output.
    ///
    /// # Errors
    /// Bad input if the folder is missing, `path` is a folder, or the file exists; i/o if the folder cannot be written.
    pub fn new(path: &Path, force: bool, inputs: &[&Path], made_here: impl Fn(&Path) -> bool) -> Result<Self> {
        let bad = |problem: String, remedy: &str| Error::from(BadInput::new(problem, remedy).in_file(path));
        if path.as_os_str() == "-" {
            return Ok(Self::stdout());
        }
        if path.as_os_str().is_empty() {
            return Err(BadInput::new("the name of the output is empty", "name a file").into());
        }
        let existing = match std::fs::metadata(path) {
            Ok(metadata) => Some(metadata),
            Err(e) if is_missing(&e) => None,
            Err(e) if e.kind() == io::ErrorKind::InvalidFilename => {
                return Err(bad("this name is too long or not allowed".into(), "name another file"));
            }
            Err(source) => return Err(Error::Io { action: "write", path: path.to_path_buf(), source }),
        };
        let Some(metadata) = existing else {
            let real = path.to_path_buf();
            check_folder(path, &real)?;
            return Ok(Self { path: path.to_path_buf(), kind: Kind::File { real, replace: false } });
        };
        if metadata.is_dir() {
            return Err(bad("the output is a folder".into(), "name a file"));
        }
        if !metadata.is_file() {
            return Ok(Self { path: path.to_path_buf(), kind: Kind::Device });
        }
        let real = std::fs::canonicalize(path).map_err(|source| Error::Io { action: "write", path: path.to_path_buf(), source })?;
        if !force {
            if inputs.iter().any(|input| std::fs::canonicalize(input).is_ok_and(|input| input == real)) {
                return Err(bad("this file is also read by the command".into(), "name another output, or replace it with --force"));
            }
            if !made_here(&real) {
                return Err(bad("this file exists already".into(), "name another output, or replace it with --force"));
            }
        }
        check_folder(path, &real)?;
        Ok(Self { path: path.to_path_buf(), kind: Kind::File { real, replace: true } })
    }

    /// Checks that no two of several outputs are one file, however their names are written.
    ///
    /// # Errors
    /// Bad input if two are.
    pub fn check_distinct(targets: &[Self]) -> Result<()> {
        let places: Vec<Option<PathBuf>> = targets.iter().map(Self::place).collect();
        for (k, target) in targets.iter().enumerate() {
            if places[k].is_some() && places[..k].contains(&places[k]) {
                return Err(BadInput::new("this output is named twice", "name each file once")
                    .in_file(&target.path)
                    .at_field("output")
                    .into());
            }
        }
        Ok(())
    }

    /// Where a file will lie, by the real path of its folder.
    fn place(&self) -> Option<PathBuf> {
        let Kind::File { real, .. } = &self.kind else { return None };
        Some(folder_of(real).canonicalize().ok()?.join(real.file_name()?))
    }

    /// Standard output.
    pub fn stdout() -> Self {
        Self { path: PathBuf::from("-"), kind: Kind::Stdout }
    }

    /// The file as the user named it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether this is standard output.
    pub fn is_stdout(&self) -> bool {
        self.kind == Kind::Stdout
    }

    /// Writes the output with `content`. A file appears whole or, after an error, not at all.
    ///
    /// # Errors
    /// Those of `content`; i/o if the file cannot be written; bad input if it came into being since [`Target::new`].
    pub fn write(&self, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<()> {
        let failed = |source| Error::Io { action: "write", path: self.path.clone(), source };
        match &self.kind {
            Kind::Stdout => {
                let mut out = BufWriter::with_capacity(BUFFER, io::stdout().lock());
                content(&mut out).and_then(|()| out.flush()).map_err(stdout_error)
            }
            Kind::Device => {
                let file = File::options().write(true).open(&self.path).map_err(failed)?;
                let mut out = BufWriter::with_capacity(BUFFER, file);
                content(&mut out).and_then(|()| out.flush()).map_err(failed)
            }
            Kind::File { .. } => self.write_file(|file| {
                let mut out = BufWriter::with_capacity(BUFFER, file);
                content(&mut out)?;
                out.flush()
            }),
        }
    }

    /// As [`Target::write`], for writers that seek; standard output and pipes cannot, and are bad input.
    ///
    /// # Errors
    /// As [`Target::write`].
    pub fn write_file(&self, content: impl FnOnce(&mut File) -> io::Result<()>) -> Result<()> {
        let Kind::File { real, replace } = &self.kind else {
            return Err(BadInput::new("this output must be a file", "name a file in a folder").in_file(&self.path).into());
        };
        let failed = |source| Error::Io { action: "write", path: self.path.clone(), source };
        let mut unfinished = Unfinished::create(real).map_err(failed)?;
        content(unfinished.temporary.as_file_mut()).map_err(failed)?;
        unfinished.finish(real, *replace).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => {
                BadInput::new("this file came into being while the command ran", "name another output, or replace it with --force")
                    .in_file(&self.path)
                    .into()
            }
            _ => failed(source),
        })
    }
}

/// A temporary file beside the place of an output. Without [`Unfinished::finish`] it goes away.
struct Unfinished {
    temporary: tempfile::NamedTempFile,
    listed: Listed,
}

/// An entry of [`UNFINISHED`]; it is taken off the list when this goes away.
#[derive(Debug)]
pub struct Listed(PathBuf);

/// Lists something unfinished, to be removed by an interrupt.
pub fn list_unfinished(path: &Path) -> Listed {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_path_buf());
    Listed(path.to_path_buf())
}

impl Drop for Listed {
    fn drop(&mut self) {
        UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner).retain(|p| *p != self.0);
    }
}

impl Unfinished {
    fn create(real: &Path) -> io::Result<Self> {
        let mut builder = tempfile::Builder::new();
        let prefix = unfinished::prefix();
        builder.prefix(&prefix).suffix(unfinished::SUFFIX);
        #[cfg(unix)]
        {
            // As any program creates a file: the umask takes away what it should.
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        // The lock is held until the new file is listed: an interrupt in between would leave it.
        let mut list = UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner);
        let temporary = builder.tempfile_in(folder_of(real))?;
        unfinished::claim(temporary.as_file());
        let path = temporary.path().to_path_buf();
        list.push(path.clone());
        Ok(Self { temporary, listed: Listed(path) })
    }

    /// Gives the file its place; with `replace` whatever is there goes.
    fn finish(self, real: &Path, replace: bool) -> io::Result<()> {
        let Self { temporary, listed: _listed } = self;
        if replace {
            return temporary.persist(real).map(drop).map_err(|e| e.error);
        }
        match temporary.persist_noclobber(real) {
            Ok(_) => Ok(()),
            Err(e) if e.error.kind() == io::ErrorKind::AlreadyExists => Err(e.error),
            // Some file systems cannot rename without replacing in one step.
            Err(e) if !real.exists() => e.file.persist(real).map(drop).map_err(|e| e.error),
            Err(e) => Err(e.error),
        }
    }
}

/// Whether nothing stands at a path.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Checks that a file can be created beside `real`, by creating one. What killed processes left there goes.
fn check_folder(path: &Path, real: &Path) -> Result<()> {
    let folder = folder_of(real);
    match std::fs::metadata(folder) {
        Ok(metadata) if metadata.is_dir() => {}
        Ok(_) => {
            return Err(BadInput::new(format!("{} is not a folder", folder.display()), "name a file in a folder").in_file(path).into());
        }
        Err(e) if is_missing(&e) => {
            let problem = format!("there is no folder {}", folder.display());
            return Err(BadInput::new(problem, "create it first, or name another output").in_file(path).into());
        }
        Err(source) => return Err(Error::Io { action: "write", path: path.to_path_buf(), source }),
    }
    unfinished::sweep(folder);
    Unfinished::create(real).map(drop).map_err(|source| Error::Io { action: "write", path: path.to_path_buf(), source })
}
