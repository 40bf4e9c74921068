//! What covers a part of the geometry: a BRDF and its colour weight.

use crate::brdf::Brdf;
use crate::error::Result;
use crate::image_file::{self, TintImage};
use crate::toml_reader::{Range, TableReader, range};
use std::sync::Arc;

/// Bounds of a colour weight.
pub(super) const TINT: Range = range(0.0, 1.0);

/// What covers one part of the geometry.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Name of the part, or `*` for all that no other surface names.
    pub part: String,
    /// How it reflects.
    pub brdf: Brdf,
    /// Colour weight of the BRDF (Wu et al. 2011, section 3.7).
    pub tint: Tint,
    /// Line in the file, for messages.
    pub line: usize,
}

/// Colour weights: linear RGB factors of a BRDF, from 0.
#[derive(Clone, Debug)]
pub enum Tint {
    /// The same everywhere.
    Uniform([f64; 3]),
    /// By position, from an image over the tile (height fields) or over the uv unit square (meshes with uv).
    Image(Arc<TintImage>),
}

impl Surface {
    /// Reads a `[[surface]]` table, and the image that it names.
    pub(super) fn read(table: TableReader<'_>) -> Result<Self> {
        let part = table.str("part")?.ok_or_else(|| table.missing("part", "\"*\""))?.to_owned();
        let brdf = table.table("brdf")?.ok_or_else(|| table.missing("brdf", "{ model = \"lambert\", albedo = 0.5 }"))?;
        let brdf = Brdf::read(brdf)?;
        let tint = match table.text("tint").and_then(|_| table.path("tint").transpose()) {
            Some(path) => Tint::Image(Arc::new(image_file::read_tint(&path?)?)),
            None => Tint::Uniform(table.colour("tint", TINT)?.unwrap_or([1.0; 3])),
        };
        let line = table.line();
        table.finish()?;
        Ok(Self { part, brdf, tint, line })
    }
}
