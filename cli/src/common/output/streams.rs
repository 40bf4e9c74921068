//! JSON and text on standard output, words on standard error.

use super::colour::is_coloured;
use crate::common::options::CommonArgs;
use biscale::error::{Error, Result};
use serde::Serialize;
use std::borrow::Cow;
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

/// `text` as a terminal may show it. Names come from files, and a control character in one could move the cursor, colour what follows or hide it: it is shown as
/// Rust writes it (`\u{1b}`). The same goes for the characters that turn the direction of writing (Unicode Bidirectional Algorithm, UAX #9, section 2).
pub fn plain(text: &str) -> Cow<'_, str> {
    let is_unsafe = |c: char| {
        (c.is_control() && c != '\n' && c != '\t')
            || matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' | '\u{61c}')
    };
    if !text.contains(is_unsafe) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len());
    for c in text.chars() {
        if is_unsafe(c) {
            plain.extend(c.escape_unicode());
        } else {
            plain.push(c);
        }
    }
    Cow::Owned(plain)
}

/// Writes `text` to standard output.
///
/// # Errors
/// I/o.
pub fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(plain(text).as_bytes()).and_then(|()| out.flush()).map_err(stdout_error)
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
    let _ = writeln!(io::stderr().lock(), "{}", plain(text));
}

/// Says an error, in the colours of clap's.
pub fn say_error(text: &str) {
    let head = if is_coloured() { "\x1b[1m\x1b[31merror:\x1b[0m" } else { "error:" };
    let _ = writeln!(io::stderr().lock(), "{head} {}", plain(text));
}

/// Says `text` unless the user wants quiet, or JSON, which carries the same.
pub fn tell(common: &CommonArgs, text: &str) {
    if !common.quiet && !common.json {
        say(text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_command_a_terminal_is_shown_and_all_other_text_is_as_it_was() {
        for (text, shown) in [
            ("plain, \u{e9}, \u{6f22}\u{5b57},\n\ttwo lines", "plain, \u{e9}, \u{6f22}\u{5b57},\n\ttwo lines"),
            ("\u{1b}[31mred\u{7}", "\\u{1b}[31mred\\u{7}"),
            ("over\rwritten\u{8}", "over\\u{d}written\\u{8}"),
            ("\u{9b}2J \u{7f} \0", "\\u{9b}2J \\u{7f} \\u{0}"),
            ("\u{202e}gpj.exe", "\\u{202e}gpj.exe"),
        ] {
            assert_eq!(plain(text), shown);
        }
    }
}
