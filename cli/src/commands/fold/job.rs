//! What `biscale fold` has read, and what its two ways, facets and strips, share.

use super::args::FoldArgs;
use super::outputs::Outputs;
use crate::common::wrap_sidecar::wrap_json;
use biscale::error::{BadInput, Result};
use biscale::filter::Control;
use biscale::geometry::weave::Weave;
use biscale_fabricate::design::{FoldRecipe, Source};
use biscale_fabricate::formats::Format;
use biscale_fabricate::paper::Paper;
use biscale_fabricate::preview::{self, Preview};
use biscale_fabricate::wrap::{self, Target, Wrap};
use serde_json::{Value, json};
use std::path::Path;

/// Inner radius of folds that a preview rounds them by, mm, if none is given.
const PREVIEW_RADIUS: f64 = 0.3;

/// A design, and how it is to be folded.
pub(super) struct FoldJob<'a> {
    pub(super) args: &'a FoldArgs,
    pub(super) source: &'a Source,
    /// The file of `source`.
    pub(super) path: &'a Path,
    pub(super) recipe: FoldRecipe,
    pub(super) paper: Paper,
    pub(super) format: Format,
    pub(super) outputs: Outputs,
}

impl<'a> FoldJob<'a> {
    /// The weave, if the design is one and is made of strips.
    pub(super) fn weave(&self) -> Option<&'a Weave> {
        self.source.weave().filter(|_| !self.args.sheet.facets)
    }

    /// The recipe as the files keep it.
    pub(super) fn recipe_json(&self) -> Value {
        let mut recipe = json!(self.recipe);
        recipe["margin_mm"] = json!(self.paper.margin);
        recipe
    }

    /// The wrap sheet, if one is asked for, and what the sidecar tells of it.
    pub(super) fn wrap_sheet(&self, title: &str) -> Result<Option<(Wrap, Value)>> {
        let Some(on) = &self.args.shape.on else { return Ok(None) };
        let target = Target::parse(on)?;
        let thickness = self.recipe.thickness;
        let fit = target.fit(self.source.period(self.recipe.scale), thickness);
        let wrap = wrap::wrap(target, fit, thickness, &self.source.colours(), self.paper, title)?;
        let told = wrap_json(target, fit, &wrap);
        Ok(Some((wrap, told)))
    }

    /// How far the folded paper's effective BRDF is from the design's, if that is asked for.
    pub(super) fn preview(&self, control: &Control<'_>) -> Result<Option<Preview>> {
        if !self.args.shape.preview {
            return Ok(None);
        }
        let Source::Material(material) = self.source else {
            return Err(BadInput::new("a mesh file has no BRDF to compare", "leave `preview` out, or write a material file")
                .at_field("preview")
                .into());
        };
        let printed = self.recipe.scale * self.source.unit_mm();
        let (thickness, seed) = (self.recipe.thickness, self.args.search.seed);
        match self.weave() {
            Some(weave) => preview::preview_strips(&material.1, weave, printed, thickness, seed, control),
            None => {
                let radius = self.args.shape.fold_radius.unwrap_or(PREVIEW_RADIUS);
                preview::preview(&material.1, printed, radius, thickness, seed, control)
            }
        }
        .map(Some)
    }
}
