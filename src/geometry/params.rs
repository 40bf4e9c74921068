//! The parameters of the kinds, declared once.
//!
//! A kind's table of [`Param`]s is at once how its `[geometry]` table is read ([`super::GeometryValues`]), what `biscale new` writes
//! ([`mod@super::template`]), and what `docs/geometry.md` says ([`markdown`]; a test compares). It does not describe BRDFs.

use crate::toml_reader::Range;
use std::fmt::Write as _;

/// One key of a `[geometry]` table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Param {
    /// The key.
    pub key: &'static str,
    /// Type, unit, range and default.
    pub value: Value,
    /// One line for the user.
    pub help: &'static str,
}

/// Type, unit, range and default of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Number {
        /// What it measures.
        unit: Unit,
        /// Value when the key is not there.
        default: Fallback,
        /// Bounds, both included.
        range: Range,
    },
    /// Two numbers, for x and y.
    Pair {
        /// What they measure.
        unit: Unit,
        /// Value when the key is not there; `None` if there is none.
        default: Option<[f64; 2]>,
        /// What a template writes.
        example: [f64; 2],
        /// Bounds of both, included.
        range: Range,
    },
    /// A whole number.
    Whole {
        /// Value when the key is not there; `None` if it follows from others.
        default: Option<u32>,
        /// Smallest.
        min: u32,
        /// Largest.
        max: u32,
    },
    /// One of a few words.
    Choice {
        /// Value when the key is not there; `None` if it follows from others.
        default: Option<&'static str>,
        /// What is allowed.
        words: &'static [&'static str],
    },
    /// True or false.
    Flag {
        /// Value when the key is not there.
        default: bool,
    },
    /// A file, relative to the material file.
    File {
        /// What a template writes.
        example: &'static str,
        /// Whether the key must be there.
        required: bool,
    },
    /// Texts in brackets, optional.
    Texts {
        /// What a template writes, as TOML.
        example: &'static str,
    },
}

/// What a number measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A length in the file's `unit`.
    Length,
    /// An angle in degrees; the key ends in `_deg`.
    Degrees,
    /// A share or a factor, without a unit.
    One,
}

/// Value of a number when the key is not there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fallback {
    /// This number.
    Fixed(f64),
    /// Another number of the same table times a factor.
    Scaled(&'static str, f64),
    /// Follows from other values, or belongs to some choices only; [`super::GeometryValues::optional`] gives it.
    Derived {
        /// In words.
        how: &'static str,
        /// What a template writes.
        example: f64,
        /// Whether it stands in a template as a key and not as a comment.
        shown: bool,
    },
}

/// A number as TOML and people write it: `1.0`, `0.25`, `1e-6`, `1e9`; to twelve digits, which leaves out what products of decimals round.
pub(super) fn written(value: f64) -> String {
    let value: f64 = format!("{value:.11e}").parse().expect("a number that was written");
    if value != 0.0 && (value.abs() < 1e-3 || value.abs() >= 1e5) { format!("{value:e}") } else { format!("{value:?}") }
}

impl Unit {
    fn name(self) -> &'static str {
        match self {
            Self::Length => "length, ",
            Self::Degrees => "degrees, ",
            Self::One => "",
        }
    }
}

impl Param {
    /// The same, with a derived default written as a key into templates.
    pub(super) const fn shown(self) -> Self {
        let Value::Number { unit, default: Fallback::Derived { how, example, .. }, range } = self.value else { return self };
        Self { value: Value::Number { unit, default: Fallback::Derived { how, example, shown: true }, range }, ..self }
    }

    /// Unit and range in words: `length, 1e-6 to 1e6`.
    pub fn domain(&self) -> String {
        let span = |unit: Unit, range: Range| format!("{}{} to {}", unit.name(), written(range.min), written(range.max));
        let quoted = |words: &[&str]| words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(" or ");
        match self.value {
            Value::Number { unit, range, .. } => span(unit, range),
            Value::Pair { unit, range, .. } => format!("[x, y], {}", span(unit, range)),
            Value::Whole { min, max, .. } => format!("whole, {min} to {max}"),
            Value::Choice { words, .. } => quoted(words),
            Value::Flag { .. } => "true or false".into(),
            Value::File { .. } => "file, relative to the material file".into(),
            Value::Texts { .. } => "texts".into(),
        }
    }

    /// The default in words: `0.5`, `0.3 period`, `required`.
    pub fn default_text(&self) -> String {
        match self.value {
            Value::Number { default: Fallback::Fixed(value), .. } => written(value),
            Value::Number { default: Fallback::Scaled(by, factor), .. } => {
                let parts = (1.0 / factor).round();
                // A third has no decimals that end.
                if factor * 1e3 % 1.0 != 0.0 && factor * parts == 1.0 {
                    format!("{by} / {parts}")
                } else {
                    format!("{} {by}", written(factor))
                }
            }
            Value::Number { default: Fallback::Derived { how, .. }, .. } => how.into(),
            Value::Pair { default: Some([x, y]), .. } => format!("[{}, {}]", written(x), written(y)),
            Value::Whole { default: Some(value), .. } => value.to_string(),
            Value::Choice { default: Some(word), .. } => format!("\"{word}\""),
            Value::Flag { default } => default.to_string(),
            Value::File { required: true, .. } => "required".into(),
            _ => "none".into(),
        }
    }

    /// What a template writes for this key, and whether it stands there as a comment.
    fn example(&self, all: &[Self]) -> (String, bool) {
        match self.value {
            Value::Number { default: Fallback::Fixed(value), .. } => (written(value), false),
            Value::Number { default: Fallback::Scaled(..), .. } => (written(default_number(self.key, all)), false),
            Value::Number { default: Fallback::Derived { example, shown, .. }, .. } => (written(example), !shown),
            Value::Pair { example: [x, y], default, .. } => {
                let [x, y] = default.unwrap_or([x, y]);
                (format!("[{}, {}]", written(x), written(y)), false)
            }
            Value::Whole { default, min, .. } => (default.unwrap_or(min).to_string(), default.is_none()),
            Value::Choice { default, words } => (format!("\"{}\"", default.unwrap_or(words[0])), default.is_none()),
            Value::Flag { default } => (default.to_string(), false),
            Value::File { example, required } => (format!("\"{example}\""), !required),
            Value::Texts { example } => (example.into(), true),
        }
    }

    /// The lines of a template: help, unit and range as a comment, then the key with its default.
    pub(super) fn template_lines(&self, all: &[Self]) -> String {
        let (example, commented) = self.example(all);
        let default = match self.value {
            Value::File { required: true, .. } => "; required".into(),
            Value::Number { default: Fallback::Fixed(_), .. } | Value::Choice { default: Some(_), .. } | Value::Flag { .. } => {
                String::new()
            }
            _ => format!("; default: {}", self.default_text()),
        };
        format!("# {} ({}{default})\n{}{} = {example}\n", self.help, self.domain(), if commented { "# " } else { "" }, self.key)
    }
}

/// Default of a number that has one, following the numbers it is scaled by.
fn default_number(key: &str, all: &[Param]) -> f64 {
    match all.iter().find(|p| p.key == key).map(|p| p.value) {
        Some(Value::Number { default: Fallback::Fixed(value), .. }) => value,
        Some(Value::Number { default: Fallback::Scaled(by, factor), .. }) => default_number(by, all) * factor,
        _ => unreachable!("`{key}` is scaled by a number with a default"),
    }
}

/// The parameters as a Markdown table, for the documentation.
pub fn markdown(params: &[Param]) -> String {
    let mut text = String::from("| key | unit and range | default | meaning |\n|---|---|---|---|\n");
    for p in params {
        writeln!(text, "| `{}` | {} | {} | {} |", p.key, p.domain(), p.default_text(), p.help).expect("a String can be written to");
    }
    text
}

/// A number with a fixed default.
pub(super) const fn number(key: &'static str, unit: Unit, default: f64, range: Range, help: &'static str) -> Param {
    Param { key, value: Value::Number { unit, default: Fallback::Fixed(default), range }, help }
}

/// A length that is a factor of another one by default.
pub(super) const fn scaled(key: &'static str, by: &'static str, factor: f64, range: Range, help: &'static str) -> Param {
    Param { key, value: Value::Number { unit: Unit::Length, default: Fallback::Scaled(by, factor), range }, help }
}

/// A number whose default follows from other values, or that belongs to some choices only.
pub(super) const fn derived(key: &'static str, unit: Unit, (how, example): (&'static str, f64), range: Range, help: &'static str) -> Param {
    Param { key, value: Value::Number { unit, default: Fallback::Derived { how, example, shown: false }, range }, help }
}

/// A whole number with a default.
pub(super) const fn whole(key: &'static str, default: u32, min: u32, max: u32, help: &'static str) -> Param {
    Param { key, value: Value::Whole { default: Some(default), min, max }, help }
}

/// One of a few words.
pub(super) const fn choice(key: &'static str, default: &'static str, words: &'static [&'static str], help: &'static str) -> Param {
    Param { key, value: Value::Choice { default: Some(default), words }, help }
}
