//! The values of one `[geometry]` table: read and checked one by one, then asked for by key, and set without a file.
//!
//! A [`GeometryValues`] holds what the file gives, each value of the right type and within its range. Defaults and the comparison of values with
//! each other are left to the kinds, which build their recipe from it ([`super::kinds::Geometry::of`]). A search that changes numbers sets them
//! here and builds the recipe again: no text is printed or parsed.

use super::params::{Fallback, Param, Value};
use crate::error::{BadInput, Error, Result};
use crate::toml_reader::{TableReader, range, suggest};
use std::path::{Path, PathBuf};

/// What one `[geometry]` table gives, typed and in range.
///
/// Asking for a key that the parameters do not declare, or by the wrong type, is a mistake in this crate and panics; the tests
/// that build every template run through all of them.
#[derive(Clone, Debug, PartialEq)]
pub struct GeometryValues {
    /// The kind, one of [`super::kinds::KINDS`].
    pub kind: &'static str,
    params: &'static [Param],
    given: Vec<Given>,
    file: PathBuf,
    /// Name of the table, and the line at which it begins.
    table: (String, usize),
}

/// A value that the table gives.
#[derive(Clone, Debug, PartialEq)]
struct Given {
    key: &'static str,
    value: GivenValue,
    line: usize,
}

#[derive(Clone, Debug, PartialEq)]
enum GivenValue {
    Number(f64),
    Pair([f64; 2]),
    Whole(u32),
    Word(&'static str),
    Flag(bool),
    File(PathBuf),
    Texts(Vec<String>),
}

impl GivenValue {
    /// The value of a parameter, if the table has its key.
    fn read(table: &TableReader<'_>, param: &Param) -> Result<Option<Self>> {
        let key = param.key;
        Ok(match param.value {
            Value::Number { range, .. } => table.f64(key, range)?.map(Self::Number),
            Value::Pair { range, .. } => table.array::<2>(key, range)?.map(Self::Pair),
            Value::Whole { min, max, .. } => table.integer(key, min, max)?.map(Self::Whole),
            Value::Choice { words, .. } => table.choice(key, words)?.map(|place| Self::Word(words[place])),
            Value::Flag { .. } => table.bool(key)?.map(Self::Flag),
            Value::File { .. } => table.path(key)?.map(Self::File),
            Value::Texts { .. } => table.strings(key)?.map(|texts| Self::Texts(texts.into_iter().map(str::to_owned).collect())),
        })
    }
}

impl GeometryValues {
    /// Reads the table of a `kind` with these parameters; `table` may hold `kind` beside them and nothing else.
    pub(super) fn read(table: TableReader<'_>, kind: &'static str, params: &'static [Param]) -> Result<Self> {
        let mut given = Vec::new();
        for param in params {
            if let Some(value) = GivenValue::read(&table, param)? {
                given.push(Given { key: param.key, value, line: table.line_of(param.key) });
            }
        }
        let file = table.source().path.clone();
        let name = (table.name().to_owned(), table.line());
        table.finish()?;
        Ok(Self { kind, params, given, file, table: name })
    }

    /// The key by which a number of this kind is set ([`Self::set_number`]).
    ///
    /// # Errors
    /// A key that the kind lacks, or that is no number.
    pub fn number_key(&self, key: &str) -> Result<&'static str, BadInput> {
        let Some(param) = self.params.iter().find(|p| p.key == key) else {
            let keys: Vec<&str> = self.params.iter().map(|p| p.key).collect();
            return Err(BadInput::new(format!("unknown key `{key}`"), suggest(key, &keys)));
        };
        match param.value {
            Value::Number { .. } => Ok(param.key),
            _ => Err(BadInput::new(format!("`{key}` is no number that can move by steps"), "name a key that is a number")),
        }
    }

    /// Sets a number, whether the table gives it or not.
    ///
    /// # Errors
    /// A value out of range. Values that contradict each other are found by [`super::kinds::Geometry::of`].
    pub fn set_number(&mut self, key: &'static str, value: f64) -> Result<(), BadInput> {
        let Value::Number { range, .. } = self.param(key).value else { unreachable!("`{key}` is not a number") };
        range.check(&[value])?;
        self.set(key, GivenValue::Number(value));
        Ok(())
    }

    /// Sets a whole number, whether the table gives it or not.
    ///
    /// # Errors
    /// A value out of range.
    pub fn set_whole(&mut self, key: &'static str, value: u32) -> Result<(), BadInput> {
        let Value::Whole { min, max, .. } = self.param(key).value else { unreachable!("`{key}` is not whole") };
        range(min.into(), max.into()).check(&[value.into()])?;
        self.set(key, GivenValue::Whole(value));
        Ok(())
    }

    fn set(&mut self, key: &'static str, value: GivenValue) {
        match self.given.iter_mut().find(|g| g.key == key) {
            Some(given) => given.value = value,
            None => self.given.push(Given { key, value, line: self.table.1 }),
        }
    }

    fn param(&self, key: &str) -> &'static Param {
        self.params.iter().find(|p| p.key == key).unwrap_or_else(|| unreachable!("`{key}` is not declared"))
    }

    fn given(&self, key: &str) -> Option<&GivenValue> {
        self.given.iter().find(|g| g.key == key).map(|g| &g.value)
    }

    /// A number, or its default.
    pub fn number(&self, key: &'static str) -> f64 {
        let Value::Number { default, .. } = self.param(key).value else { unreachable!("`{key}` is not a number") };
        match (self.optional(key), default) {
            (Some(value), _) | (None, Fallback::Fixed(value)) => value,
            (None, Fallback::Scaled(by, factor)) => self.number(by) * factor,
            (None, Fallback::Derived { .. }) => unreachable!("`{key}` has no default of its own"),
        }
    }

    /// A number whose default follows from other values: `None` if the key is not there.
    pub fn optional(&self, key: &'static str) -> Option<f64> {
        let Value::Number { .. } = self.param(key).value else { unreachable!("`{key}` is not a number") };
        self.given(key).map(|v| if let GivenValue::Number(v) = v { *v } else { unreachable!("read as a number") })
    }

    /// Two numbers, or their default.
    pub fn pair(&self, key: &'static str) -> Option<[f64; 2]> {
        let Value::Pair { default, .. } = self.param(key).value else { unreachable!("`{key}` is not a pair") };
        self.given(key).map(|v| if let GivenValue::Pair(v) = v { *v } else { unreachable!("read as a pair") }).or(default)
    }

    /// A whole number, or its default, if it has one.
    pub fn whole(&self, key: &'static str) -> Option<u32> {
        let Value::Whole { default, .. } = self.param(key).value else { unreachable!("`{key}` is not whole") };
        self.given(key).map(|v| if let GivenValue::Whole(v) = v { *v } else { unreachable!("read as whole") }).or(default)
    }

    /// One of the words, or the default, if there is one.
    pub fn choice(&self, key: &'static str) -> Option<&'static str> {
        let Value::Choice { default, .. } = self.param(key).value else { unreachable!("`{key}` is not a choice") };
        self.given(key).map(|v| if let GivenValue::Word(v) = v { *v } else { unreachable!("read as a word") }).or(default)
    }

    /// True or false, or the default.
    pub fn flag(&self, key: &'static str) -> bool {
        let Value::Flag { default } = self.param(key).value else { unreachable!("`{key}` is not a flag") };
        self.given(key).map_or(default, |v| if let GivenValue::Flag(v) = v { *v } else { unreachable!("read as a flag") })
    }

    /// A path, if it is there; an error if it must be.
    pub fn path(&self, key: &'static str) -> Result<Option<&Path>> {
        let Value::File { example, required } = self.param(key).value else { unreachable!("`{key}` is not a file") };
        match self.given(key) {
            None if required => Err(self.missing(key, &format!("\"{example}\""))),
            given => Ok(given.map(|v| if let GivenValue::File(v) = v { &**v } else { unreachable!("read as a file") })),
        }
    }

    /// Texts, if they are there.
    pub fn texts(&self, key: &'static str) -> Option<&[String]> {
        let Value::Texts { .. } = self.param(key).value else { unreachable!("`{key}` is not a list of texts") };
        self.given(key).map(|v| if let GivenValue::Texts(v) = v { &**v } else { unreachable!("read as texts") })
    }

    /// Whether the file has this key.
    pub fn has(&self, key: &'static str) -> bool {
        self.given(self.param(key).key).is_some()
    }

    /// A mistake at `key`.
    pub fn error_at(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> Error {
        let line = self.given.iter().find(|g| g.key == key).map_or(self.table.1, |g| g.line);
        BadInput::new(problem, remedy).in_file(&self.file).at_line(line).at_field(format!("{}.{key}", self.table.0)).into()
    }

    /// A key that is required here is missing.
    pub fn missing(&self, key: &str, wanted: &str) -> Error {
        let problem = format!("[{}] lacks the required key `{key}`", self.table.0);
        self.error_at(key, problem, format!("add `{key} = {wanted}`"))
    }
}
