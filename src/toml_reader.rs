//! Reading our TOML files so that every mistake names file, line, field, value and remedy.
//!
//! `serde` stops at the first error and knows neither ranges nor units, so files are walked by hand: a [`TableReader`] hands
//! out the values of one table, checks their type and range, remembers which keys are known, and [`TableReader::finish`]
//! refuses the rest with the nearest known key. It does not write files and does not keep comments.

use crate::bounded_file::{MAX_TEXT_BYTES, read_bounded};
use crate::error::{BadInput, Error, Result};
use crate::file_signature::{self, Signature};
use crate::numerics::cast::truncate_u32;
use std::cell::RefCell;
use std::fs::File;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A file's name and text: what is needed to say on which line something stands.
#[derive(Clone, Debug)]
pub struct Source {
    /// Where the text came from.
    pub path: PathBuf,
    /// The whole text.
    pub text: String,
}

impl Source {
    /// Reads a text file. A missing file, a folder, bytes that are not UTF-8 and files of other programs are bad input.
    pub fn read(path: &Path) -> Result<Self> {
        if let Some(signature) = Signature::of_head(&head(path)) {
            return Err(signature.is_no_toml(path).into());
        }
        let by_name = |error: Error| match (Signature::of_name(path), &error) {
            (Some(signature), Error::BadInput(_)) if path.is_file() => signature.is_no_toml(path).into(),
            _ => error,
        };
        Self::read_text(path).map_err(by_name)
    }

    fn read_text(path: &Path) -> Result<Self> {
        let bytes = read_bounded(path, MAX_TEXT_BYTES, "no file of this kind is so long: this is something else")?;
        let text = String::from_utf8(bytes).map_err(|e| {
            let good = e.utf8_error().valid_up_to();
            let line = e.as_bytes()[..good].iter().filter(|&&b| b == b'\n').count() + 1;
            BadInput::new("this is not UTF-8 text", "write the file as UTF-8").in_file(path).at_line(line)
        })?;
        Ok(Self { path: path.to_path_buf(), text })
    }

    /// Line of a byte offset, from 1.
    pub fn line(&self, offset: usize) -> usize {
        self.text.as_bytes()[..offset.min(self.text.len())].iter().filter(|&&b| b == b'\n').count() + 1
    }

    /// The folder that paths inside this file are relative to.
    pub fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    /// Parses the text as TOML.
    pub fn parse(&self) -> Result<Spanned<DeTable<'_>>> {
        DeTable::parse(&self.text).map_err(|e| {
            if let Some(signature) = Signature::of_name(&self.path) {
                return signature.is_no_toml(&self.path).into();
            }
            let line = e.span().map_or(1, |s| self.line(s.start));
            let message = e.message().lines().collect::<Vec<_>>().join(", ");
            BadInput::new(format!("not valid TOML: {message}"), "see https://toml.io for the syntax")
                .in_file(&self.path)
                .at_line(line)
                .into()
        })
    }
}

/// Bounds of a number, both included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Smallest value that is allowed.
    pub min: f64,
    /// Largest value that is allowed.
    pub max: f64,
}

impl Range {
    /// Whether all of these lie within the bounds.
    ///
    /// # Errors
    /// The first one that does not, or is not a number.
    pub fn check(self, values: &[f64]) -> Result<(), BadInput> {
        let Self { min, max } = self;
        match values.iter().find(|&&v| !(v >= min && v <= max)) {
            None => Ok(()),
            Some(value) => Err(BadInput::new(format!("{value} is out of range"), format!("write a number from {min} to {max}"))),
        }
    }
}

/// Shorthand for [`Range`].
pub const fn range(min: f64, max: f64) -> Range {
    Range { min, max }
}

/// One table of a file, read key by key.
#[derive(Debug)]
pub struct TableReader<'a> {
    source: &'a Source,
    /// Name of the table for messages: `geometry`, `surface[0].brdf`.
    name: String,
    table: &'a DeTable<'a>,
    /// Byte offset of the table, for keys that are missing.
    offset: usize,
    known: RefCell<Vec<&'static str>>,
}

impl<'a> TableReader<'a> {
    /// Reads `table`, which `source` holds at byte `offset`, under the name `name` (empty for the file's own top level).
    pub fn new(source: &'a Source, name: impl Into<String>, table: &'a DeTable<'a>, offset: usize) -> Self {
        Self { source, name: name.into(), table, offset, known: RefCell::new(Vec::new()) }
    }

    /// The same table, to be read once more.
    #[must_use]
    pub fn again(&self) -> Self {
        Self::new(self.source, self.name.clone(), self.table, self.offset)
    }

    /// The file that is being read.
    pub fn source(&self) -> &'a Source {
        self.source
    }

    /// Name of the table for messages; empty for the file's own top level.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Line of a key, from 1; of the table if the key is not there.
    pub fn line_of(&self, key: &str) -> usize {
        self.source.line(self.table.get(key).map_or(self.offset, |v| v.span().start))
    }

    fn field(&self, key: &str) -> String {
        if self.name.is_empty() { key.to_owned() } else { format!("{}.{key}", self.name) }
    }

    /// Line of the table in its file, from 1.
    pub fn line(&self) -> usize {
        self.source.line(self.offset)
    }

    /// A mistake in this table as a whole.
    pub fn error(&self, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        let bad = BadInput::new(problem, remedy).in_file(&self.source.path).at_line(self.source.line(self.offset));
        if self.name.is_empty() { bad.into() } else { bad.at_field(&*self.name).into() }
    }

    /// A mistake at `key`, at its line if it is there and at the table's otherwise.
    pub fn error_at(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        let offset = self.table.get(key).map_or(self.offset, |v| v.span().start);
        BadInput::new(problem, remedy).in_file(&self.source.path).at_line(self.source.line(offset)).at_field(self.field(key)).into()
    }

    /// The value as it stands in the file, for messages.
    fn written(&self, value: &Spanned<DeValue<'a>>) -> String {
        let text = self.source.text.get(value.span()).unwrap_or("?").split_whitespace().collect::<Vec<_>>().join(" ");
        if text.chars().count() > 60 { text.chars().take(57).chain("...".chars()).collect() } else { text }
    }

    fn wrong_type(&self, key: &str, value: &Spanned<DeValue<'a>>, wanted: &str) -> Error {
        self.error_at(key, format!("{} is {}", self.written(value), an(value.get_ref().type_str())), format!("write {wanted}"))
    }

    fn get(&self, key: &'static str) -> Option<&'a Spanned<DeValue<'a>>> {
        self.known.borrow_mut().push(key);
        self.table.get(key)
    }

    /// Whether `key` is there; marks it as known.
    pub fn has(&self, key: &'static str) -> bool {
        self.get(key).is_some()
    }

    /// What every file of ours begins with: `format = 1`, which must be there, and its name, by default that of the file.
    ///
    /// # Errors
    /// [`BadInput`] for another format, or none.
    pub fn head(&self) -> Result<String> {
        match self.integer("format", 0, u32::MAX)? {
            Some(1) => {}
            Some(other) => return Err(self.error_at("format", format!("format {other} is not known"), "this version reads `format = 1`")),
            None => return Err(self.missing("format", "1")),
        }
        Ok(match self.str("name")? {
            Some(name) => name.to_owned(),
            None => self.source.path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        })
    }

    /// A key that has no default is missing. A key that was not asked for yet and is written nearly so may be meant.
    pub fn missing(&self, key: &str, wanted: &str) -> Error {
        let table = if self.name.is_empty() { "the file".to_owned() } else { format!("[{}]", self.name) };
        let problem = format!("{table} lacks the required key `{key}`");
        match self.meant(key) {
            Some((other, line)) => {
                let remedy = format!("did you mean it by the key `{other}` on line {line}? Else add `{key} = {wanted}`");
                let bad = BadInput::new(problem, remedy).in_file(&self.source.path).at_line(line);
                bad.at_field(self.field(key)).into()
            }
            None => self.error_at(key, problem, format!("add `{key} = {wanted}`")),
        }
    }

    /// The table, or list of tables, `key` is missing, which `problem` says. As with [`Self::missing`] another one may be meant.
    pub fn no_table(&self, key: &str, problem: &str, remedy: &str) -> Error {
        match self.meant(key) {
            Some((other, line)) => {
                let remedy = format!("did you mean it by `{other}` on line {line}? Else {remedy}");
                BadInput::new(problem, remedy).in_file(&self.source.path).at_line(line).into()
            }
            None => self.error(problem, remedy),
        }
    }

    /// The key of this table that is most like `key` among those that nobody asked for yet, and its line.
    pub fn meant(&self, key: &str) -> Option<(String, usize)> {
        let known = self.known.borrow();
        let others = self.table.iter().filter(|(k, _)| !known.contains(&k.get_ref().as_ref()));
        let near = others.filter_map(|(k, _)| nearness(key, k.get_ref()).map(|distance| (distance, k)));
        let (_, other) = near.min_by_key(|(distance, _)| *distance)?;
        Some((other.get_ref().to_string(), self.source.line(other.span().start)))
    }

    fn number(&self, key: &str, value: &Spanned<DeValue<'a>>, range: Range, wanted: &str) -> Result<f64> {
        let number = match value.get_ref() {
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|v| v as f64),
            DeValue::Float(f) => f.as_str().parse::<f64>().ok(),
            _ => return Err(self.wrong_type(key, value, wanted)),
        };
        match number {
            Some(v) if v >= range.min && v <= range.max => Ok(v),
            _ => Err(self.error_at(
                key,
                format!("{} is out of range", self.written(value)),
                format!("write a number from {} to {}", range.min, range.max),
            )),
        }
    }

    /// A number within `range`, if the key is there.
    pub fn f64(&self, key: &'static str, range: Range) -> Result<Option<f64>> {
        self.get(key).map(|v| self.number(key, v, range, "a number")).transpose()
    }

    /// A whole number within `min..=max`, if the key is there.
    pub fn integer(&self, key: &'static str, min: u32, max: u32) -> Result<Option<u32>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        if !matches!(value.get_ref(), DeValue::Integer(_)) {
            return Err(self.wrong_type(key, value, "a whole number"));
        }
        let number = self.number(key, value, range(min.into(), max.into()), "a whole number")?;
        Ok(Some(truncate_u32(number)))
    }

    /// Whole numbers from `min` to `max`, at least one and at most `most`, if the key is there.
    pub fn integers(&self, key: &'static str, min: u32, max: u32, most: usize) -> Result<Option<Vec<u32>>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let wanted = format!("1 to {most} whole numbers in brackets");
        let Some(array) = value.get_ref().as_array() else { return Err(self.wrong_type(key, value, &wanted)) };
        if !(1..=most).contains(&array.len()) {
            return Err(self.error_at(key, format!("{} has {} elements", self.written(value), array.len()), format!("write {wanted}")));
        }
        let one = |element: &Spanned<DeValue<'_>>| {
            if !matches!(element.get_ref(), DeValue::Integer(_)) {
                return Err(self.wrong_type(key, element, &wanted));
            }
            let number = self.number(key, element, range(min.into(), max.into()), &wanted)?;
            Ok(truncate_u32(number))
        };
        array.iter().map(one).collect::<Result<_>>().map(Some)
    }

    /// True or false, if the key is there.
    pub fn bool(&self, key: &'static str) -> Result<Option<bool>> {
        self.get(key).map(|v| v.get_ref().as_bool().ok_or_else(|| self.wrong_type(key, v, "true or false"))).transpose()
    }

    /// A text, if the key is there.
    pub fn str(&self, key: &'static str) -> Result<Option<&'a str>> {
        self.get(key).map(|v| v.get_ref().as_str().ok_or_else(|| self.wrong_type(key, v, "a text in quotes"))).transpose()
    }

    /// A text, if the key is there and is one: for keys that may also be something else.
    pub fn text(&self, key: &'static str) -> Option<&'a str> {
        self.get(key)?.get_ref().as_str()
    }

    /// One of a few words, by its place in `words`, if the key is there. A wrong word is answered with the nearest right one.
    pub fn choice(&self, key: &'static str, words: &[&str]) -> Result<Option<usize>> {
        let Some(word) = self.str(key)? else { return Ok(None) };
        match words.iter().position(|&w| w == word) {
            Some(place) => Ok(Some(place)),
            None => Err(self.error_at(key, format!("\"{word}\" is not known here"), suggest(word, words))),
        }
    }

    /// `N` numbers within `range`, if the key is there.
    pub fn array<const N: usize>(&self, key: &'static str, range: Range) -> Result<Option<[f64; N]>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let wanted = format!("{N} numbers in brackets");
        let Some(array) = value.get_ref().as_array() else { return Err(self.wrong_type(key, value, &wanted)) };
        if array.len() != N {
            return Err(self.error_at(key, format!("{} has {} elements", self.written(value), array.len()), format!("write {wanted}")));
        }
        let mut out = [0.0; N];
        for (slot, element) in out.iter_mut().zip(array.iter()) {
            *slot = self.number(key, element, range, &wanted)?;
        }
        Ok(Some(out))
    }

    /// A colour: three numbers, or one for all three, if the key is there.
    pub fn colour(&self, key: &'static str, range: Range) -> Result<Option<[f64; 3]>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        if value.get_ref().as_array().is_some() {
            self.array::<3>(key, range)
        } else {
            Ok(Some([self.number(key, value, range, "three numbers in brackets, or one number")?; 3]))
        }
    }

    /// Rows of texts (a weaving draft), if the key is there.
    pub fn strings(&self, key: &'static str) -> Result<Option<Vec<&'a str>>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let wanted = "texts in brackets";
        let Some(array) = value.get_ref().as_array() else { return Err(self.wrong_type(key, value, wanted)) };
        array.iter().map(|e| e.get_ref().as_str().ok_or_else(|| self.wrong_type(key, e, wanted))).collect::<Result<_>>().map(Some)
    }

    /// A table inside this one, if the key is there.
    pub fn table(&self, key: &'static str) -> Result<Option<Self>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let table = value.get_ref().as_table().ok_or_else(|| self.wrong_type(key, value, "a table"))?;
        Ok(Some(Self::new(self.source, self.field(key), table, value.span().start)))
    }

    /// The tables of a list of tables (`[[key]]`); none if the key is not there.
    pub fn tables(&self, key: &'static str) -> Result<Vec<Self>> {
        let Some(value) = self.get(key) else { return Ok(Vec::new()) };
        let wanted = format!("tables headed [[{key}]]");
        let array = value.get_ref().as_array().ok_or_else(|| self.wrong_type(key, value, &wanted))?;
        let one = |(i, e): (usize, &'a Spanned<DeValue<'a>>)| {
            let table = e.get_ref().as_table().ok_or_else(|| self.wrong_type(key, e, &wanted))?;
            Ok(Self::new(self.source, format!("{}[{i}]", self.field(key)), table, e.span().start))
        };
        array.iter().enumerate().map(one).collect()
    }

    /// The path of a file to read, relative to the folder of this file, if the key is there. Where no file stands is a mistake
    /// at this key, and not one of whoever opens it.
    pub fn path(&self, key: &'static str) -> Result<Option<PathBuf>> {
        use std::io::ErrorKind::{InvalidFilename, NotADirectory, NotFound};
        let Some(written) = self.str(key)? else { return Ok(None) };
        let path = self.source.folder().join(written);
        match std::fs::metadata(&path) {
            Ok(metadata) if metadata.is_dir() => Err(self.error_at(key, format!("\"{written}\" is a folder"), "name a file")),
            Err(e) if matches!(e.kind(), NotFound | NotADirectory | InvalidFilename) => {
                let problem = format!("there is no file \"{written}\"");
                Err(self.error_at(key, problem, "write a path relative to the folder of this file"))
            }
            _ => Ok(Some(path)),
        }
    }

    /// Refuses every key that was never asked for, naming the nearest known one.
    pub fn finish(self) -> Result<()> {
        let known = self.known.borrow();
        let Some((key, _)) = self.table.iter().find(|(k, _)| !known.contains(&k.get_ref().as_ref())) else { return Ok(()) };
        let line = self.source.line(key.span().start);
        let bad = BadInput::new(format!("unknown key `{}`", key.get_ref()), suggest(key.get_ref(), &known));
        Err(bad.in_file(&self.source.path).at_line(line).at_field(self.field(key.get_ref())).into())
    }
}

/// The first bytes of a file; none of what cannot be read, and of a pipe, which can be read once only.
fn head(path: &Path) -> Vec<u8> {
    let mut head = Vec::new();
    if path.is_file()
        && let Ok(file) = File::open(path)
    {
        // What cannot be read is told by whoever reads all of it.
        let _ = file.take(file_signature::HEAD).read_to_end(&mut head);
    }
    head
}

fn an(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}

/// How many letters two words differ in, if so few that one may be meant by the other.
fn nearness(word: &str, other: &str) -> Option<usize> {
    Some(strsim::damerau_levenshtein(word, other)).filter(|&distance| distance <= 1 + word.chars().count() / 3)
}

/// The nearest of `words` to `word`, or all of them when none is near.
pub fn suggest(word: &str, words: &[&str]) -> String {
    let nearest = words.iter().filter_map(|w| nearness(word, w).map(|distance| (distance, w))).min();
    match nearest {
        Some((_, near)) => format!("did you mean `{near}`?"),
        None => format!("known here: {}", words.join(", ")),
    }
}
