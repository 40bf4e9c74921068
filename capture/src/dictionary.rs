//! Dictionaries of markers: those that `OpenCV` has by name, and one's own, from a file in `OpenCV`'s format.
//!
//! The file is what `cv::aruco::Dictionary::writeDictionary` writes and `readDictionary` reads, a list of keys in YAML:
//!
//! ```text
//! %YAML:1.0
//! ---
//! nmarkers: 35
//! markersize: 6
//! maxCorrectionBits: 5
//! marker_0: "101011111011111001001001101100000000"
//! ```
//!
//! `marker_K` holds the bits inside of the black border, row by row from the upper left, 1 white. YAML beyond that is refused.

use biscale::error::{BadInput, Error, Result};
use biscale::toml_reader::Source;
use std::path::Path;
use std::sync::Arc;

const NAMES: &str = "DICT_4X4_50 DICT_4X4_100 DICT_4X4_250 DICT_4X4_1000 DICT_5X5_50 DICT_5X5_100 DICT_5X5_250 DICT_5X5_1000 DICT_6X6_50 \
                     DICT_6X6_100 DICT_6X6_250 DICT_6X6_1000 DICT_7X7_50 DICT_7X7_100 DICT_7X7_250 DICT_7X7_1000 DICT_ARUCO_ORIGINAL";

/// Names of `OpenCV`'s dictionaries, in the order of its numbers.
pub fn names() -> Vec<&'static str> {
    NAMES.split(' ').collect()
}

/// Which markers there are, and what they look like.
#[derive(Clone, Debug, PartialEq)]
pub enum Dictionary {
    /// One of `OpenCV`'s, by one of [`names`].
    Predefined(&'static str),
    /// One that was read from a file.
    Custom(Arc<CustomDictionary>),
}

/// A dictionary of one's own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CustomDictionary {
    /// Name of its file.
    pub name: String,
    /// Bits along the side of a marker, without its border.
    pub side: usize,
    /// Wrong bits up to which a marker is still read.
    pub correction: usize,
    /// Bits of each marker by its number, row by row from the upper left, true where white.
    pub markers: Vec<Vec<bool>>,
}

/// Bits along the side of a marker.
const SIDES: std::ops::RangeInclusive<usize> = 3..=16;
/// Most markers of a file, and most bytes.
const MAX_MARKERS: usize = 10_000;
const MAX_BYTES: u64 = 1 << 23;

impl Dictionary {
    /// One of `OpenCV`'s.
    pub fn named(name: &str) -> Option<Self> {
        names().into_iter().find(|n| *n == name).map(Self::Predefined)
    }

    /// Reads a dictionary file.
    ///
    /// # Errors
    /// Bad input names file, line and key.
    pub fn read(path: &Path) -> Result<Self> {
        let length = std::fs::metadata(path).map_err(|e| Error::reading(path, e))?.len();
        if length > MAX_BYTES {
            let remedy = "name a file as OpenCV's `Dictionary::writeDictionary` writes it";
            return Err(BadInput::new(format!("the file has {length} bytes, no dictionary has"), remedy).in_file(path).into());
        }
        CustomDictionary::parse(&Source::read(path)?).map(|own| Self::Custom(Arc::new(own)))
    }

    /// Its name: `OpenCV`'s, or that of its file.
    pub fn name(&self) -> &str {
        match self {
            Self::Predefined(name) => name,
            Self::Custom(own) => &own.name,
        }
    }

    /// Cells along the side of its markers, the black border of one cell on each side included.
    pub fn cells(&self) -> usize {
        match self {
            Self::Custom(own) => own.side + 2,
            Self::Predefined(name) => match name.as_bytes().get(5) {
                Some(digit @ b'4'..=b'7') => usize::from(digit - b'0') + 2,
                // The original one has 5 x 5 bits.
                _ => 7,
            },
        }
    }

    /// How many markers it has: their numbers are less.
    pub fn count(&self) -> usize {
        match self {
            Self::Custom(own) => own.markers.len(),
            Self::Predefined(name) => name.rsplit('_').next().and_then(|n| n.parse().ok()).unwrap_or(1024),
        }
    }
}

/// What a dictionary file must look like.
const FORM: &str = "write `nmarkers`, `markersize` and `marker_0`, `marker_1` ..., a `key: value` a line, as OpenCV does";

fn bad_line(source: &Source, line: usize, problem: String, remedy: &str) -> Error {
    BadInput::new(problem, remedy).in_file(&source.path).at_line(line).into()
}

/// The keys of a dictionary file, each with its line.
#[derive(Default)]
struct DictionaryKeys<'a> {
    count: Option<(usize, usize)>,
    side: Option<(usize, usize)>,
    correction: Option<(usize, usize)>,
    /// Number, line and bits of each marker.
    markers: Vec<(usize, usize, &'a str)>,
}

impl<'a> DictionaryKeys<'a> {
    fn read(source: &'a Source) -> Result<Self> {
        let bad = |line: usize, problem: String, remedy: &str| bad_line(source, line, problem, remedy);
        let mut keys = Self::default();
        for (k, text) in source.text.lines().enumerate() {
            let (line, text) = (k + 1, text.trim());
            if text.is_empty() || text.starts_with(['%', '#']) || matches!(text, "---" | "...") {
                continue;
            }
            let Some((key, value)) = text.split_once(':') else {
                return Err(bad(line, format!("\"{}\" is no key with a value", shortened(text)), FORM));
            };
            let (key, value) = (key.trim(), unquoted(value.split(" #").next().unwrap_or_default().trim()));
            let number = |least: usize, most: usize| match value.parse::<usize>() {
                Ok(v) if (least..=most).contains(&v) => Ok((line, v)),
                _ => Err(bad(line, format!("{key} is \"{}\"", shortened(value)), &format!("write a whole number from {least} to {most}"))),
            };
            let slot = match key {
                "nmarkers" => (&mut keys.count, number(1, MAX_MARKERS)?),
                "markersize" => (&mut keys.side, number(*SIDES.start(), *SIDES.end())?),
                "maxCorrectionBits" => (&mut keys.correction, number(0, SIDES.end() * SIDES.end())?),
                _ => {
                    let id = key.strip_prefix("marker_").and_then(|id| id.parse::<usize>().ok()).filter(|id| *id < MAX_MARKERS);
                    let Some(id) = id else { return Err(bad(line, format!("there is no key \"{}\"", shortened(key)), FORM)) };
                    if let Some(old) = keys.markers.iter().find(|t| t.0 == id) {
                        return Err(bad(line, format!("{key} stands in line {} already", old.1), "keep one of the two"));
                    }
                    keys.markers.push((id, line, value));
                    continue;
                }
            };
            if let Some((old, _)) = slot.0.replace(slot.1) {
                return Err(bad(line, format!("{key} stands in line {old} already"), "keep one of the two"));
            }
        }
        keys.markers.sort_by_key(|t| t.0);
        Ok(keys)
    }

    /// The bits of `count` markers, numbered from 0, each of `side` x `side`.
    fn bits(&self, source: &Source, (count_line, count): (usize, usize), side: usize) -> Result<Vec<Vec<bool>>> {
        for (k, (id, line, _)) in self.markers.iter().enumerate() {
            if *id != k {
                let problem = format!("marker_{k} is missing before marker_{id}");
                return Err(bad_line(source, *line, problem, "number the markers from 0 without gaps"));
            }
        }
        if self.markers.len() != count {
            let problem = format!("nmarkers is {count}, but there are {} markers", self.markers.len());
            return Err(bad_line(source, count_line, problem, "write as many as there are"));
        }
        let mut markers = Vec::with_capacity(count);
        for (id, line, text) in &self.markers {
            if text.len() != side * side || !text.bytes().all(|b| matches!(b, b'0' | b'1')) {
                let problem = format!("marker_{id} is \"{}\" ({} characters)", shortened(text), text.chars().count());
                let remedy = format!("write {} times 0 or 1, the bits row by row, for a marker of {side} x {side}", side * side);
                return Err(bad_line(source, *line, problem, &remedy));
            }
            markers.push(text.bytes().map(|b| b == b'1').collect::<Vec<bool>>());
        }
        Ok(markers)
    }
}

impl CustomDictionary {
    fn parse(source: &Source) -> Result<Self> {
        let keys = DictionaryKeys::read(source)?;
        let end = source.text.lines().count().max(1);
        let missing = |key: &str| bad_line(source, end, format!("`{key}` is missing"), FORM);
        let (count, (_, side)) = (keys.count.ok_or_else(|| missing("nmarkers"))?, keys.side.ok_or_else(|| missing("markersize"))?);
        let markers = keys.bits(source, count, side)?;
        // As OpenCV's own dictionaries: what is nearer to one marker than to any other, however it is turned, is that one.
        let (nearest, pair) = nearest(&markers, side);
        if nearest == 0 {
            let problem = format!("marker_{} and marker_{} look alike, or alike when turned", pair.0, pair.1);
            let remedy = "keep markers that differ in every turn, and from themselves turned";
            return Err(bad_line(source, keys.markers[pair.1].1, problem, remedy));
        }
        let most = (nearest - 1) / 2;
        if let Some((line, bits)) = keys.correction.filter(|c| c.1 > most) {
            let problem = format!("maxCorrectionBits is {bits}, but marker_{} and marker_{} differ in {nearest} bits only", pair.0, pair.1);
            return Err(bad_line(source, line, problem, &format!("write at most {most}, or leave it out")));
        }
        let name = source.path.file_name().map_or_else(|| "dictionary".to_owned(), |n| n.to_string_lossy().into_owned());
        Ok(Self { name, side, correction: keys.correction.map_or(most, |c| c.1), markers })
    }
}

fn unquoted(value: &str) -> &str {
    let inside = |quote: char| value.strip_prefix(quote).and_then(|v| v.strip_suffix(quote));
    inside('"').or_else(|| inside('\'')).unwrap_or(value)
}

fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    if text.chars().count() <= MOST { text.to_owned() } else { text.chars().take(MOST).chain("...".chars()).collect() }
}

/// In how many bits the two markers differ that are most alike, in any turn (of one, from itself turned), and which they are.
fn nearest(markers: &[Vec<bool>], side: usize) -> (usize, (usize, usize)) {
    let packed = |bits: &[bool]| -> Vec<u64> {
        bits.chunks(64).map(|c| c.iter().enumerate().fold(0, |word, (k, b)| word | u64::from(*b) << k)).collect()
    };
    let turned = |bits: &[bool]| -> Vec<bool> { (0..side * side).map(|k| bits[(side - 1 - k % side) * side + k / side]).collect() };
    let turns: Vec<[Vec<u64>; 4]> = markers
        .iter()
        .map(|bits| {
            let quarter = turned(bits);
            let half = turned(&quarter);
            [packed(bits), packed(&quarter), packed(&half), packed(&turned(&half))]
        })
        .collect();
    let apart = |a: &[u64], b: &[u64]| a.iter().zip(b).map(|(x, y)| (x ^ y).count_ones() as usize).sum::<usize>();
    let mut best = (side * side, (0, 0));
    for (b, own) in turns.iter().enumerate() {
        for (a, other) in turns[..=b].iter().enumerate() {
            for turn in own.iter().skip(usize::from(a == b)) {
                let distance = apart(&other[0], turn);
                if distance < best.0 {
                    best = (distance, (a, b));
                }
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<CustomDictionary> {
        CustomDictionary::parse(&Source { path: "markers.yml".into(), text: text.to_owned() })
    }

    const GOOD: &str = "%YAML:1.0\n---\n# three of 3 x 3\nnmarkers: 3\nmarkersize: 3\nmarker_0: \"110100000\"\nmarker_1: '111110101'\nmarker_2: 001011000\n";

    #[test]
    fn a_dictionary_is_read_and_its_correction_follows_from_its_markers() {
        let own = parsed(GOOD).unwrap();
        assert_eq!((own.side, own.markers.len(), own.name.as_str()), (3, 3, "markers.yml"));
        assert_eq!(own.markers[0], [true, true, false, true, false, false, false, false, false]);
        assert_eq!(own.correction, 0);
        // All 16 bits of one against its turns by hand: corners 1000 and edges apart.
        let four = parsed("nmarkers: 2\nmarkersize: 4\nmarker_0: 1111111100000000\nmarker_1: 1000000000000000\n").unwrap();
        assert_eq!(nearest(&four.markers, 4), (2, (1, 1)));
        let dictionary = Dictionary::Custom(Arc::new(four));
        assert_eq!((dictionary.cells(), dictionary.count(), dictionary.name()), (6, 2, "markers.yml"));
        let named = |name| Dictionary::named(name).map(|d| (d.cells(), d.count()));
        assert_eq!(named("DICT_7X7_1000"), Some((9, 1000)));
        assert_eq!(named("DICT_ARUCO_ORIGINAL"), Some((7, 1024)));
        assert_eq!(named("DICT_9X9_50"), None);
    }

    #[test]
    fn the_example_of_the_documentation_is_one() {
        let text = include_str!("../../docs/capture.md").split("```yaml\n").nth(1).unwrap().split("```").next().unwrap();
        let own = parsed(text).unwrap();
        assert_eq!((own.side, own.markers.len(), own.correction), (4, 2, 1));
    }

    #[test]
    fn mistakes_name_line_and_remedy() {
        for (change, line, word) in [
            (("nmarkers: 3", "nmarkers: 4"), 4, "nmarkers is 4, but there are 3"),
            (("nmarkers: 3", "nmarkers: many"), 4, "whole number"),
            (("nmarkers: 3\n", ""), 7, "`nmarkers` is missing"),
            (("markersize: 3", "markersize: 99"), 5, "3 to 16"),
            (("markersize: 3", "markersize: 3\nmaxCorrectionBits: 4"), 6, "at most 0"),
            (("110100000", "11010000"), 6, "9 times 0 or 1"),
            (("110100000", "11010000x"), 6, "9 times 0 or 1"),
            (("110100000", "101000101"), 6, "look alike"),
            (("marker_1", "marker_0"), 7, "stands in line 6 already"),
            (("marker_2", "marker_7"), 8, "marker_2 is missing"),
            (("marker_2", "makrer_2"), 8, "there is no key"),
            (("marker_2: 001011000", "marker_2"), 8, "no key with a value"),
            (("001011000", "000001011"), 8, "look alike"),
        ] {
            let message = parsed(&GOOD.replace(change.0, change.1)).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains(&format!("markers.yml:{line}")), "{change:?}: {message}");
        }
        assert!(parsed("").unwrap_err().to_string().contains("nmarkers"));
        assert!(parsed("<?xml version=\"1.0\"?>").is_err());
    }
}
