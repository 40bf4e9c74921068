//! How the parameters of a model are declared: once, in the model's own file.
//!
//! A model's table of [`Param`]s is how its `brdf` table is read ([`Brdf::read`](super::Brdf::read)), what `docs/brdf.md` says
//! ([`markdown`](super::markdown); a test compares) and what help texts can print. All parameters are numbers without a unit.

use crate::toml_reader::{Range, range};

/// Smallest and largest roughness `alpha`.
pub const ALPHA: Range = range(1e-3, 1.0);
/// Smallest and largest Blinn-Phong exponent.
pub const EXPONENT: Range = range(0.0, 1e6);

/// Albedo, diffuse, specular and f0 are reflectances.
pub(super) const REFLECTANCE: Range = range(0.0, 1.0);
/// A model of small-scale BRDFs, as material files name it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Model {
    /// The value of `model`.
    pub name: &'static str,
    /// One line for the user.
    pub help: &'static str,
    /// `fr`, as text.
    pub formula: &'static str,
    /// Its keys.
    pub params: &'static [Param],
}

/// One key of a `brdf` table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Param {
    /// The key.
    pub key: &'static str,
    /// Type, range and default.
    pub value: Value,
    /// One line for the user.
    pub help: &'static str,
}

/// Type, range and default of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Linear RGB: three numbers, or one for all three.
    Colour(Fallback, Range),
    /// A number.
    Number(Fallback, Range),
    /// One of a few words, the first one by default.
    Choice(&'static [&'static str]),
    /// A file, relative to the material file.
    File,
    /// The name of a built-in fit.
    Fit,
}

/// What holds when a key is not there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fallback {
    /// The key is required; this is what an example says.
    Required(f64),
    /// This value.
    Default(f64),
    /// Nothing, which means what the text says.
    Without(&'static str),
}

pub(super) const DIFFUSE: Param =
    Param { key: "diffuse", value: Value::Colour(Fallback::Default(0.0), REFLECTANCE), help: "Reflectance of the diffuse part" };
pub(super) const SPECULAR: Param =
    Param { key: "specular", value: Value::Colour(Fallback::Required(0.5), REFLECTANCE), help: "Factor of the lobe" };
pub(super) const ROUGHNESS: Param =
    Param { key: "alpha", value: Value::Number(Fallback::Required(0.2), ALPHA), help: "Roughness of the lobe" };

impl Param {
    /// Type and range in words: `colour, 0 to 1`.
    pub fn domain(&self) -> String {
        let span = |kind: &str, range: Range| format!("{kind}, {} to {}", range.min, range.max);
        match self.value {
            Value::Colour(_, range) => span("colour", range),
            Value::Number(_, range) => span("number", range),
            Value::Choice(words) => words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(" or "),
            Value::File => "path, relative to the material file".into(),
            Value::Fit => "text".into(),
        }
    }

    /// The default in words: `0`, `required`.
    pub fn default_text(&self) -> String {
        match self.value {
            Value::Colour(fallback, _) | Value::Number(fallback, _) => match fallback {
                Fallback::Required(_) => "required".into(),
                Fallback::Default(value) => value.to_string(),
                Fallback::Without(meaning) => format!("none: {meaning}"),
            },
            Value::Choice(words) => format!("\"{}\"", words[0]),
            Value::File | Value::Fit => "one of `file` and `name` is required".into(),
        }
    }
}
