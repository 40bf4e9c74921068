//! Reading the pairs of directions that `eval` is asked for.
//!
//! CSV with a header: `wi_x,wi_y,wi_z,wo_x,wo_y,wo_z` in any order, other columns ignored. Strict about numbers, liberal about
//! the rest: any encoding and line ends, blank lines, spaces around values, quotes and lines that begin with `#` are all right.

use biscale::bounded_file::{MAX_DATA_BYTES, read_bounded, read_stream};
use biscale::direction::Pair;
use biscale::error::{BadInput, Error, Result};
use biscale::text_file::decode;
use csv::ByteRecord;
use glam::DVec3;
use std::io::Read;
use std::path::Path;

/// The columns of a pair, in the order of [`Pairs::written`].
pub const COLUMNS: [&str; 6] = ["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z"];

/// A direction is normalised if its length is this near 1, and refused otherwise.
pub const LENGTH_TOLERANCE: f64 = 1e-3;

/// What to do with a file that is too long.
const REMEDY: &str = "ask for fewer pairs at once";

/// Longest piece of a user's file that a message repeats.
const SHOWN: usize = 40;

/// The pairs of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pairs {
    /// The numbers as they stand in the file, in the order of [`COLUMNS`].
    pub written: Vec<[f64; 6]>,
    /// The pairs, normalised.
    pub pairs: Vec<Pair>,
}

/// Reads the pairs in the file at `path`; `-` is standard input.
///
/// # Errors
/// Bad input, with the line: a missing file or column, a row of another length than the header, a value that is no finite
/// number, a direction whose length is not within [`LENGTH_TOLERANCE`] of 1.
pub fn load(path: &Path) -> Result<Pairs> {
    if path.as_os_str() == "-" {
        return read(std::io::stdin().lock(), Path::new("standard input"));
    }
    parse(&read_bounded(path, MAX_DATA_BYTES, REMEDY)?, path)
}

/// Reads pairs; `name` is the file's name in messages.
///
/// # Errors
/// As [`load`].
pub fn read(input: impl Read, name: &Path) -> Result<Pairs> {
    parse(&read_stream(input, name, MAX_DATA_BYTES, REMEDY)?, name)
}

fn parse(bytes: &[u8], name: &Path) -> Result<Pairs> {
    let text = decode(bytes);
    // A line end at the very end, wanted or not, makes the reader's line number that of the next line after each record.
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .terminator(csv::Terminator::Any(b'\n'))
        .comment(Some(b'#'))
        .buffer_capacity(1 << 16)
        .from_reader(text.as_bytes().chain(&b"\n"[..]));
    let mut record = ByteRecord::new();
    let mut header: Option<Header> = None;
    let mut out = Pairs::default();
    loop {
        let more = reader.read_byte_record(&mut record).map_err(|e| match e.into_kind() {
            csv::ErrorKind::Io(e) => Error::reading(name, e),
            other => BadInput::new(format!("not CSV: {other:?}"), "see docs/formats.md").in_file(name).into(),
        })?;
        if !more {
            break;
        }
        if record.len() <= 1 && record.as_slice().trim_ascii().is_empty() {
            continue;
        }
        let line = usize::try_from(reader.position().line()).unwrap_or(usize::MAX).saturating_sub(1);
        let placed = |bad: BadInput| bad.in_file(name).at_line(line);
        match &header {
            None => header = Some(Header::read(&record).map_err(placed)?),
            Some(header) => {
                let written = header.row(&record).map_err(placed)?;
                let [a, b, c, d, e, f] = written;
                let wi = direction("wi", DVec3::new(a, b, c)).map_err(placed)?;
                let wo = direction("wo", DVec3::new(d, e, f)).map_err(placed)?;
                out.written.push(written);
                out.pairs.push(Pair { wi, wo });
            }
        }
    }
    if header.is_none() {
        return Err(BadInput::new("the file is empty", remedy()).in_file(name).into());
    }
    Ok(out)
}

fn remedy() -> String {
    format!("begin it with the line {}", COLUMNS.join(","))
}

/// Where the columns stand.
struct Header {
    columns: usize,
    places: [usize; 6],
}

impl Header {
    fn read(record: &ByteRecord) -> Result<Self, BadInput> {
        let names: Vec<&[u8]> = record.iter().map(<[u8]>::trim_ascii).collect();
        if let Some(twice) = COLUMNS.iter().find(|c| names.iter().filter(|n| **n == c.as_bytes()).count() > 1) {
            return Err(BadInput::new("the header has this column twice", "keep one of them").at_field(*twice));
        }
        let place = |column: &str| names.iter().position(|n| *n == column.as_bytes());
        let missing: Vec<&str> = COLUMNS.into_iter().filter(|c| place(c).is_none()).collect();
        if !missing.is_empty() {
            let commas = if names.len() == 1 && names[0].iter().any(|b| b";\t ".contains(b)) { ", separated by commas" } else { "" };
            let plural = if missing.len() == 1 { "column" } else { "columns" };
            return Err(BadInput::new(format!("the header lacks the {plural} {}", missing.join(", ")), format!("{}{commas}", remedy())));
        }
        Ok(Self { columns: names.len(), places: COLUMNS.map(|c| place(c).expect("none is missing")) })
    }

    fn row(&self, record: &ByteRecord) -> Result<[f64; 6], BadInput> {
        if record.len() != self.columns {
            let problem = format!("this row has {} values and the header {} columns", record.len(), self.columns);
            return Err(BadInput::new(problem, "give each row a value for each column, with a point in decimal numbers"));
        }
        let mut row = [0.0; 6];
        for ((slot, column), place) in row.iter_mut().zip(COLUMNS).zip(self.places) {
            *slot = number(&record[place]).map_err(|bad| bad.at_field(column))?;
        }
        Ok(row)
    }
}

fn number(bytes: &[u8]) -> Result<f64, BadInput> {
    let text = String::from_utf8_lossy(bytes.trim_ascii());
    let shown = || {
        let cut = if text.chars().count() > SHOWN { "..." } else { "" };
        format!("\"{}{cut}\"", text.chars().take(SHOWN).collect::<String>().escape_debug())
    };
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => Err(BadInput::new(format!("{} is not finite", shown()), "write a number from -1 to 1")),
        Err(_) if text.is_empty() => Err(BadInput::new("there is no value", "write a number from -1 to 1")),
        Err(_) => Err(BadInput::new(format!("{} is not a number", shown()), "write a number from -1 to 1, such as -0.25")),
    }
}

fn direction(name: &str, w: DVec3) -> Result<DVec3, BadInput> {
    let length = w.length();
    if (length - 1.0).abs() <= LENGTH_TOLERANCE {
        return Ok(w / length);
    }
    let problem = format!("({}, {}, {}) has length {length:.6}", w.x, w.y, w.z);
    Err(BadInput::new(problem, "write a direction of length 1, within 0.001").at_field(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n";

    fn pairs(text: &str) -> Result<Pairs> {
        read(text.as_bytes(), Path::new("pairs.csv"))
    }

    fn message(text: &str) -> String {
        pairs(text).unwrap_err().to_string()
    }

    #[test]
    fn columns_may_stand_in_any_order_among_others() {
        let got = pairs("name,wo_z,wo_y,wo_x,wi_z,wi_y,wi_x\nfirst,1,0,0,0.8,0,0.6\n").unwrap();
        assert_eq!(got.written, [[0.6, 0.0, 0.8, 0.0, 0.0, 1.0]]);
        assert_eq!(got.pairs, [Pair { wi: DVec3::new(0.6, 0.0, 0.8), wo: DVec3::Z }]);
    }

    #[test]
    fn marks_line_ends_spaces_quotes_blank_lines_and_comments_are_all_right() {
        let text =
            "\u{feff}# from a spreadsheet\r\n wi_x , wi_y,\"wi_z\",wo_x,wo_y,wo_z \r\n\r\n 0, 0 ,1,0,0,\"1\"\r\n   \r\n#end\r\n0,0,1,0,0,1";
        assert_eq!(pairs(text).unwrap().written.len(), 2);
    }

    #[test]
    fn other_columns_may_hold_anything() {
        let mut text = b"note,".to_vec();
        text.extend(HEADER.as_bytes());
        text.extend(b"\"caf\xe9,\nand more\",0,0,1,0,0,1\n");
        assert_eq!(read(&text[..], Path::new("p")).unwrap().written.len(), 1);
    }

    #[test]
    fn a_header_alone_is_no_pairs() {
        assert_eq!(pairs(HEADER).unwrap(), Pairs::default());
    }

    #[test]
    fn lengths_within_a_thousandth_are_normalised_and_others_refused() {
        let got = pairs(&format!("{HEADER}0,0,1.0009,0,0,0.9991\n")).unwrap();
        assert_eq!(got.pairs, [Pair { wi: DVec3::Z, wo: DVec3::Z }]);
        assert_eq!(got.written, [[0.0, 0.0, 1.0009, 0.0, 0.0, 0.9991]], "the numbers stay as written");
        for z in ["1.0011", "0.9989", "0", "1e300", "-2"] {
            let text = message(&format!("{HEADER}0,0,1,0,0,1\n0,0,1,0,0,{z}\n"));
            assert!(text.contains("pairs.csv:3: wo: ") && text.contains("length"), "{z}: {text}");
        }
    }

    #[test]
    fn the_line_is_counted_as_an_editor_counts_it() {
        for (text, line) in [
            (format!("{HEADER}x,0,1,0,0,1"), 2),
            (format!("\n# c\n\n{HEADER}\n\n0,0,1,0,0,1\nx,0,1,0,0,1\n"), 8),
            (format!("{HEADER}0,0,1,0,0,1\n# c\n\nx,0,1,0,0,1\n0,0,1,0,0,1\n").replace('\n', "\r\n"), 5),
        ] {
            let message = message(&text);
            assert!(message.starts_with(&format!("pairs.csv:{line}: wi_x: \"x\" is not a number")), "{text:?}: {message}");
        }
    }

    #[test]
    fn what_is_missing_is_named() {
        assert!(message("").contains("empty"));
        assert!(message("\n\n").contains("empty"));
        assert!(message("wi_x,wi_y,wi_z,wo_x,wo_z\n").contains("lacks the column wo_y"));
        assert!(message("wi_x;wi_y;wi_z;wo_x;wo_y;wo_z\n").contains("separated by commas"));
        assert!(message(&format!("wi_x,{HEADER}")).contains("wi_x: the header has this column twice"));
        assert!(message(&format!("{HEADER}0,0,1,0,0\n")).contains("5 values and the header 6"));
        assert!(message(&format!("{HEADER}0,0,1,0,0,1,5\n")).contains("7 values and the header 6"));
        assert!(message(&format!("{HEADER}0,0,1,0,,1\n")).contains("wo_y: there is no value"));
    }

    #[test]
    fn numbers_that_are_none_are_shown() {
        for (value, words) in
            [("nan", "not finite"), ("inf", "not finite"), ("1e999", "not finite"), ("0x1", "not a number"), ("1.0.0", "not a number")]
        {
            let text = message(&format!("{HEADER}0,0,{value},0,0,1\n"));
            assert!(text.contains(&format!("wi_z: \"{value}\" is {words}")), "{text}");
        }
    }
}
