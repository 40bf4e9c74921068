//! How bright images of bytes are made.

use crate::error::Result;
use crate::toml_reader::{TableReader, range};

/// How bright an image of bytes is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Radiance times two to the power of so many stops.
    Stops(f64),
    /// By the picture: see [`Picture::auto_exposure`](crate::render::Picture::auto_exposure).
    Auto,
}

impl Default for Exposure {
    fn default() -> Self {
        Self::Stops(0.0)
    }
}

impl Exposure {
    /// Most stops either way.
    pub const MOST: f64 = 64.0;
    /// The name of [`Exposure::Auto`] in files and on the command line.
    pub const AUTO: &str = "auto";

    pub(super) fn read(table: &TableReader<'_>) -> Result<Self> {
        if table.text("exposure").is_some_and(|text| text == Self::AUTO) {
            return Ok(Self::Auto);
        }
        Ok(table.f64("exposure", range(-Self::MOST, Self::MOST))?.map_or_else(Self::default, Self::Stops))
    }
}
