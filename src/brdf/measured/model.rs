//! The keys of a measured BRDF.

use super::super::params::{Fallback, Model, Param, Value};
use crate::toml_reader::{Range, range};

/// Factor of measured values.
const SCALE: Range = range(0.0, 1000.0);

pub(in super::super) const MODEL: Model = Model {
    name: "measured",
    help: "A table from a file, or a built-in fit of one",
    formula: "scale times the table",
    params: &[
        Param { key: "file", value: Value::File, help: "MERL .binary or isotropic RGL .bsdf (RGB)" },
        Param { key: "name", value: Value::Fit, help: "Instead of a file: one of the built-in fits" },
        Param { key: "scale", value: Value::Number(Fallback::Default(1.0), SCALE), help: "Factor of the values" },
    ],
};
