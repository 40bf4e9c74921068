//! A failure as JSON.

use biscale::error::Error;
use serde::Serialize;
use std::path::Path;

/// A failure as JSON: `{"error": {...}}`.
#[derive(Debug, Serialize)]
pub struct Failure {
    error: Description,
}

/// What went wrong; `null` where it does not apply.
#[derive(Debug, Serialize)]
pub struct Description {
    /// `bad-input`, `arguments`, `unsupported`, `io`, `numeric` or `interrupted`.
    kind: &'static str,
    file: Option<String>,
    line: Option<usize>,
    field: Option<String>,
    /// What standard error says.
    message: String,
}

impl Failure {
    /// Describes an error of the library.
    pub fn new(error: &Error) -> Self {
        Self { error: Description::new(error) }
    }

    /// Describes wrong arguments.
    pub fn arguments(error: &clap::Error) -> Self {
        let message = error.render().to_string().trim().to_owned();
        Self { error: Description { kind: "arguments", file: None, line: None, field: None, message } }
    }
}

impl Description {
    /// Describes an error of the library.
    pub fn new(error: &Error) -> Self {
        let name = |path: &Path| path.display().to_string();
        let (kind, file, line, field) = match error {
            Error::BadInput(bad) => ("bad-input", bad.file.as_deref().map(name), bad.line, bad.field.clone()),
            Error::Unsupported { .. } => ("unsupported", None, None, None),
            Error::Io { path, .. } => ("io", Some(name(path)), None, None),
            Error::Numeric(_) => ("numeric", None, None, None),
            Error::Interrupted => ("interrupted", None, None, None),
        };
        Self { kind, file, line, field, message: error.to_string() }
    }
}
