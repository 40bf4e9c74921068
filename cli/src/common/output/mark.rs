//! How an output is recognised as made by its command: by a mark near its beginning.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Where a mark is looked for, bytes: the head of an image, an SVG or an HTML page is shorter. Chosen, not measured.
const HEAD: u64 = 4096;

/// The longest JSON file that is asked who made it, bytes. Chosen, not measured: far over what is written here.
const LARGEST_JSON: u64 = 1 << 28;

/// Whether the file at `path` has `mark` near its beginning. One that cannot be read has not.
pub fn has_mark(path: &Path, mark: &str) -> bool {
    let mut head = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEAD).read_to_end(&mut head));
    read.is_ok() && head.windows(mark.len()).any(|w| w == mark.as_bytes())
}

/// Whether the file at `path` is a JSON object whose `creator` begins with `mark`, wherever in it that stands.
pub fn has_creator(path: &Path, mark: &str) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let made: Result<serde_json::Map<String, serde_json::Value>, _> = serde_json::from_reader(BufReader::new(file.take(LARGEST_JSON)));
    made.is_ok_and(|made| made.get("creator").and_then(|c| c.as_str()).is_some_and(|c| c.starts_with(mark)))
}

/// Whether the first line of the file at `path` is `line`: for text that begins with a header.
pub fn begins_with(path: &Path, line: &str) -> bool {
    let Ok(file) = File::open(path) else { return false };
    let mut first = String::new();
    let limit = line.len() as u64 + 2;
    BufReader::new(file.take(limit)).read_line(&mut first).is_ok() && first.trim_end() == line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_creator_of_a_json_file_is_found_behind_anything_and_nowhere_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        let long = "x".repeat(100_000);
        for (text, made) in [
            (format!("{{\"close_up\": \"{long}\", \"creator\": \"made by us 1\"}}"), true),
            (format!("{{\"close_up\": \"{long}\", \"creator\": \"made by them\"}}"), false),
            ("{\"name\": \"made by us 1\"}".to_owned(), false),
            ("{\"inner\": {\"creator\": \"made by us\"}}".to_owned(), false),
            ("{\"creator\": \"made by us\"".to_owned(), false),
            ("[\"made by us\"]".to_owned(), false),
            (String::new(), false),
        ] {
            std::fs::write(&path, text).unwrap();
            assert_eq!(has_creator(&path, "made by us"), made);
        }
        assert!(!has_creator(folder.path(), "made by us"));
    }
}
