//! JSON and text on standard output, words on standard error.

use super::colour::is_coloured;
use crate::common::options::CommonArgs;
use biscale::error::{Error, Result};
use serde::Serialize;
use std::io::{self, BufWriter, Write};

/// Bytes that a [`BufWriter`] of this program gathers: 1 MiB, so that millions of rows are few system calls. Chosen, not measured.
pub const BUFFER: usize = 1 << 20;

/// An error of standard output; [`is_broken_pipe`] recognises the one that is none.
pub fn stdout_error(source: io::Error) -> Error {
    Error::Io { action: "write", path: "standard output".into(), source }
}

/// Whether `error` only says that nobody reads our output any more (`biscale ... | head`).
pub fn is_broken_pipe(error: &Error) -> bool {
    matches!(error, Error::Io { source, .. } if source.kind() == io::ErrorKind::BrokenPipe)
}

/// Writes `text` to standard output.
///
/// # Errors
/// I/o.
pub fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush()).map_err(stdout_error)
}

/// Writes `value` as one JSON object, with a line end, to standard output.
///
/// # Errors
/// I/o.
pub fn print_json(value: &impl Serialize) -> Result<()> {
    let mut out = BufWriter::with_capacity(BUFFER, io::stdout().lock());
    serde_json::to_writer(&mut out, value)
        .map_err(io::Error::from)
        .and_then(|()| writeln!(out))
        .and_then(|()| out.flush())
        .map_err(stdout_error)
}

/// Writes `text` and a line end to standard error; one that cannot be written is nobody's loss.
pub fn say(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Says an error, in the colours of clap's.
pub fn say_error(text: &str) {
    let head = if is_coloured() { "\x1b[1m\x1b[31merror:\x1b[0m" } else { "error:" };
    say(&format!("{head} {text}"));
}

/// Says `text` unless the user wants quiet, or JSON, which carries the same.
pub fn tell(common: &CommonArgs, text: &str) {
    if !common.quiet && !common.json {
        say(text);
    }
}
