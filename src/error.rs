//! What can go wrong, by cause.
//!
//! The cause decides the exit status of the command line (`formats.md`: bad input 2, interrupted 130, the rest 1), so it is
//! a variant here and not a word in a message. Bad input always names where it stands, what was found and what would be right.

use std::fmt;
use std::path::{Path, PathBuf};

/// `Result` with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What can go wrong, by cause.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file, a field or an argument of the user's is wrong.
    #[error("{0}")]
    BadInput(BadInput),
    /// The input is right, but this build cannot do what it asks for.
    #[error("{what} is not supported: {remedy}")]
    Unsupported {
        /// What was asked for.
        what: String,
        /// What to do instead.
        remedy: String,
    },
    /// Reading or writing failed for a reason that lies outside the file's contents.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// What was tried: "read", "write", "create", ...
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A computation could not reach what it promises.
    #[error("{0}")]
    Numeric(String),
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
}

/// One mistake in the input: where, what was found, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BadInput {
    /// The file, when the mistake is in one.
    pub file: Option<PathBuf>,
    /// Line in the file, from 1, when known.
    pub line: Option<usize>,
    /// Field (`geometry.period`), column, argument or part, when known.
    pub field: Option<String>,
    /// What was found, with the value.
    pub problem: String,
    /// What would be right.
    pub remedy: String,
}

impl fmt::Display for BadInput {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{}", file.display())?;
            if let Some(line) = self.line {
                write!(f, ":{line}")?;
            }
            write!(f, ": ")?;
        }
        if let Some(field) = &self.field {
            write!(f, "{field}: ")?;
        }
        write!(f, "{}; {}", self.problem, self.remedy)
    }
}

impl BadInput {
    /// A mistake that is not yet placed: `problem` says what was found, `remedy` what would be right.
    pub fn new(problem: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self { file: None, line: None, field: None, problem: problem.into(), remedy: remedy.into() }
    }

    /// Places the mistake in a file.
    #[must_use]
    pub fn in_file(mut self, file: &Path) -> Self {
        self.file = Some(file.to_path_buf());
        self
    }

    /// Places the mistake at a line, from 1.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// Places the mistake at a field.
    #[must_use]
    pub fn at_field(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }
}

impl From<BadInput> for Error {
    fn from(bad: BadInput) -> Self {
        Self::BadInput(bad)
    }
}

impl Error {
    /// Reading `path` failed: a missing file is the user's mistake, anything else the system's.
    pub fn reading(path: &Path, source: std::io::Error) -> Self {
        use std::io::ErrorKind::{InvalidFilename, IsADirectory, NotADirectory, NotFound};
        match source.kind() {
            NotFound | NotADirectory | InvalidFilename => {
                BadInput::new("there is no such file", "check the path; paths in a file are relative to that file").in_file(path).into()
            }
            IsADirectory => BadInput::new("this is a folder", "name a file").in_file(path).into(),
            _ => Self::Io { action: "read", path: path.to_path_buf(), source },
        }
    }
}
