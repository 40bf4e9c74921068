//! Commands that formats.md promises and that are not built yet. They are listed so that the order of the work shows, and say so.

use biscale::error::{Error, Result};
use clap::Args;
use std::ffi::OsString;

/// Whatever follows.
#[derive(Args, Clone, Debug)]
pub struct UnbuiltArgs {
    /// Not read yet
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    pub rest: Vec<OsString>,
}

/// Says that `command` is not built yet.
///
/// # Errors
/// Always [`Error::Unsupported`].
pub fn run(command: &str) -> Result<()> {
    Err(Error::Unsupported { what: format!("`biscale {command}`"), remedy: "it is not built yet in this version".into() })
}
