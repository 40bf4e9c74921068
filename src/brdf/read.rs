//! Reading and setting the parameters of a BRDF by the keys that its model declares.

use super::facet::Colour;
use super::measured::{self, Measured};
use super::models::Brdf;
use super::params::{Fallback, Model, Param, Value};
use super::{blinn_phong, cook_torrance, lambert, ward};
use crate::error::{BadInput, Result};
use crate::toml_reader::{TableReader, suggest};
use std::fmt::Write as _;

/// The models, in the order of the documentation.
pub const MODELS: [Model; 5] = [lambert::MODEL, blinn_phong::MODEL, cook_torrance::MODEL, ward::MODEL, measured::MODEL];

/// The values of one `brdf` table, read by its model's parameters.
struct Values<'t, 'a> {
    table: &'t TableReader<'a>,
    model: &'static Model,
}

impl Values<'_, '_> {
    fn param(&self, key: &str) -> &'static Param {
        self.model.params.iter().find(|p| p.key == key).unwrap_or_else(|| unreachable!("{} declares no `{key}`", self.model.name))
    }

    /// A colour, its default, or `None` if it may be left out.
    fn colour(&self, key: &'static str) -> Result<Option<Colour>> {
        let Value::Colour(fallback, range) = self.param(key).value else { unreachable!("`{key}` is not a colour") };
        Ok(match self.table.colour(key, range)? {
            Some(colour) => Some(colour),
            None => self.fallback(key, fallback)?.map(|v| [v; 3]),
        })
    }

    /// A colour that has a default or must be there.
    fn some_colour(&self, key: &'static str) -> Result<Colour> {
        Ok(self.colour(key)?.expect("its fallback is not `Without`"))
    }

    /// A number that has a default or must be there.
    fn number(&self, key: &'static str) -> Result<f64> {
        let Value::Number(fallback, range) = self.param(key).value else { unreachable!("`{key}` is not a number") };
        Ok(match self.table.f64(key, range)? {
            Some(number) => number,
            None => self.fallback(key, fallback)?.expect("its fallback is not `Without`"),
        })
    }

    fn fallback(&self, key: &str, fallback: Fallback) -> Result<Option<f64>> {
        match fallback {
            Fallback::Default(value) => Ok(Some(value)),
            Fallback::Without(_) => Ok(None),
            Fallback::Required(example) => Err(self.table.missing(key, &example.to_string())),
        }
    }

    /// One of the words, by its place.
    fn choice(&self, key: &'static str) -> Result<usize> {
        let Value::Choice(words) = self.param(key).value else { unreachable!("`{key}` is not a choice") };
        Ok(self.table.choice(key, words)?.unwrap_or(0))
    }

    /// The measured BRDF that `file` or `name` tells.
    fn measured(&self) -> Result<Measured> {
        if self.table.has("file") && self.table.has("name") {
            return Err(self.table.error_at("name", "both `file` and `name` are there", "keep one of them"));
        }
        let scale = self.number("scale")?;
        if let Some(file) = self.table.path("file")? {
            Measured::read(&file, scale)
        } else if let Some(name) = self.table.str("name")? {
            Measured::fit(name, scale).map_err(|bad| self.table.error_at("name", bad.problem, bad.remedy))
        } else {
            let remedy = "add `file = \"table.binary\"` (MERL), `file = \"table.bsdf\"` (RGL) or `name = \"gold-paint\"`";
            Err(self.table.error("neither `file` nor `name` is there", remedy))
        }
    }
}

impl Brdf {
    /// Reads a `brdf` table; for `measured` also the file that it names.
    ///
    /// # Errors
    /// [`crate::Error::BadInput`] for an unknown model or key, a missing key, a value outside its range; as [`Measured::read`].
    pub fn read(table: TableReader<'_>) -> Result<Self> {
        let place = table.choice("model", &MODELS.map(|m| m.name))?.ok_or_else(|| table.missing("model", "\"lambert\""))?;
        let values = Values { table: &table, model: &MODELS[place] };
        let brdf = match values.model.name {
            "lambert" => Self::Lambert { albedo: values.some_colour("albedo")? },
            "blinn-phong" => Self::BlinnPhong {
                diffuse: values.some_colour("diffuse")?,
                specular: values.some_colour("specular")?,
                exponent: values.number("exponent")?,
            },
            "cook-torrance" => Self::CookTorrance {
                diffuse: values.some_colour("diffuse")?,
                specular: values.some_colour("specular")?,
                alpha: values.number("alpha")?,
                distribution: cook_torrance::DISTRIBUTIONS[values.choice("distribution")?],
                f0: values.colour("f0")?,
            },
            "ward" => Self::Ward {
                diffuse: values.some_colour("diffuse")?,
                specular: values.some_colour("specular")?,
                alpha: values.number("alpha")?,
            },
            "measured" => Self::Measured(values.measured()?.into()),
            other => unreachable!("MODELS holds no \"{other}\""),
        };
        table.finish()?;
        Ok(brdf)
    }

    /// The model that it is one of.
    pub fn model(&self) -> &'static Model {
        let name = match self {
            Self::Lambert { .. } => "lambert",
            Self::BlinnPhong { .. } => "blinn-phong",
            Self::CookTorrance { .. } => "cook-torrance",
            Self::Ward { .. } => "ward",
            Self::Measured(_) => "measured",
        };
        MODELS.iter().find(|m| m.name == name).expect("every model is in the table")
    }

    /// The key by which a number or a colour of this model is set ([`Self::set_colour`]).
    ///
    /// # Errors
    /// A key that the model lacks, or that is neither.
    pub fn number_key(&self, key: &str) -> Result<&'static str, BadInput> {
        let params = self.model().params;
        let Some(param) = params.iter().find(|p| p.key == key) else {
            let keys: Vec<&str> = params.iter().map(|p| p.key).collect();
            return Err(BadInput::new(format!("unknown key `{key}`"), suggest(key, &keys)));
        };
        match param.value {
            Value::Colour(..) | Value::Number(..) => Ok(param.key),
            Value::Choice(_) | Value::File | Value::Fit => Err(BadInput::new(format!("`{key}` is no number"), "name a key that is one")),
        }
    }

    /// Sets a colour, or a number from the first channel. A colour that is one number is `[number; 3]`.
    ///
    /// # Errors
    /// A value out of range.
    pub fn set_colour(&mut self, key: &'static str, value: Colour) -> Result<(), BadInput> {
        let param = self.model().params.iter().find(|p| p.key == key).unwrap_or_else(|| unreachable!("no key `{key}`"));
        let (Value::Colour(_, range) | Value::Number(_, range)) = param.value else { unreachable!("`{key}` is no number") };
        range.check(&value)?;
        match (self, key) {
            (Self::Lambert { albedo }, "albedo") => *albedo = value,
            (Self::BlinnPhong { diffuse, .. } | Self::CookTorrance { diffuse, .. } | Self::Ward { diffuse, .. }, "diffuse") => {
                *diffuse = value;
            }
            (Self::BlinnPhong { specular, .. } | Self::CookTorrance { specular, .. } | Self::Ward { specular, .. }, "specular") => {
                *specular = value;
            }
            (Self::BlinnPhong { exponent, .. }, "exponent") => *exponent = value[0],
            (Self::CookTorrance { alpha, .. } | Self::Ward { alpha, .. }, "alpha") => *alpha = value[0],
            (Self::CookTorrance { f0, .. }, "f0") => *f0 = Some(value),
            (Self::Measured(measured), "scale") => *measured = Measured::clone(measured).with_scale(value[0]).into(),
            (_, other) => unreachable!("no number has the key `{other}`"),
        }
        Ok(())
    }
}

/// All models and their parameters as Markdown, for the documentation.
pub fn markdown() -> String {
    let mut text = String::new();
    for model in &MODELS {
        let (name, help, formula) = (model.name, model.help, model.formula);
        writeln!(text, "### `{name}`\n\n{help}: `fr = {formula}`.\n\n| key | type and range | default | meaning |\n|---|---|---|---|")
            .expect("a String can be written to");
        for p in model.params {
            writeln!(text, "| `{}` | {} | {} | {} |", p.key, p.domain(), p.default_text(), p.help).expect("a String can be written to");
        }
        text.push('\n');
    }
    text
}
