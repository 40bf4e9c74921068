//! How an output is recognised as made by its command: by a mark near its beginning.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Where a mark is looked for, bytes: the head of an image, an SVG or an HTML page is shorter. Chosen, not measured.
const HEAD: u64 = 4096;

/// Whether the file at `path` has `mark` near its beginning. One that cannot be read has not.
pub fn has_mark(path: &Path, mark: &str) -> bool {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && head.windows(mark.len()).any(|w| w == mark.as_bytes())
}

/// Whether the first line of the file at `path` is `line`: for text that begins with a header.
pub fn begins_with(path: &Path, line: &str) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let mut first = String::new();
    let limit = line.len() as u64 + 2;
    BufReader::new(file.take(limit)).read_line(&mut first).is_ok() && first.trim_end() == line
}
