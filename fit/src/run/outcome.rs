//! What a fit gives: the material, all that says how far to trust it, and the best guess so far while the search runs.

use super::diagnosis::Cause;
use crate::fit_file::material_text::MaterialText;
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::DirectionBins;
use crate::photograph::image::Photograph;
use crate::residuals::model::Model;
use crate::search::{Stage, Start, Trace};
use crate::uncertainty::identify::Identified;
use crate::uncertainty::profile::Profile;
use crate::verdict::near::NearComparison;
use crate::verdict::picture::RenderedPhotograph;
use crate::verdict::validate::Validation;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::material::Material;
use biscale::numerics::cast::narrow;
use serde::Serialize;

/// A photograph beside the fitted material, as the same camera would see it.
#[derive(Clone, Debug)]
pub struct Compared {
    /// Which photograph of the fit file.
    pub photograph: Photograph,
    /// The material.
    pub picture: RenderedPhotograph,
    /// Pixels that are compared.
    pub used: Vec<u32>,
    /// Relative RMS difference over the bins of directions.
    pub relative_rms: f64,
    /// The same over single pixels.
    pub pixel_relative_rms: f64,
    /// Mean ΔE ITP.
    pub delta_e_itp: f64,
}

/// What the fit found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The text of the start material with the numbers that were found.
    pub text: MaterialText,
    /// The same, read.
    pub material: Material,
    /// All unknowns, how well they are known, and what is mixed up.
    pub identified: Identified,
    /// Profiles of the parameters that are known worst.
    pub profiles: Vec<Profile>,
    /// Mean squared residual, Huber's; 1 is the noise.
    pub objective: f64,
    /// Relative RMS difference over the bins of the distant photographs.
    pub training: f64,
    /// The starts, those that were refined with their last state, best first.
    pub starts: Vec<Start>,
    /// Other minima as good as the best one.
    pub several: Vec<Vec<(String, f64)>>,
    /// Every evaluation of the stages.
    pub trace: Trace,
    /// Evaluations of this run: those of the trace, and those between the stages that find where the periods of the close-up lie.
    pub evaluations: usize,
    /// Values of all variables at a point of the trace.
    pub best: Vec<f64>,
    /// What the close-up says.
    pub close_up: Option<CloseUp>,
    /// The close-up beside the fitted material, where its light is compared.
    pub near: Option<NearComparison>,
    /// Direction bins of the distant photographs.
    pub bins: Vec<DirectionBins>,
    /// Distant photographs beside the fitted material.
    pub compared: Vec<Compared>,
    /// Held-out photographs beside it.
    pub validations: Vec<(Validation, Compared)>,
    /// What ended the search early, if anything.
    pub ended_early: Option<Early>,
    /// Parts of the report that were left out since it ended early.
    pub left_out: Vec<&'static str>,
    /// Name and seconds of each part of the work.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Why the fit is not to be believed ([`crate::verdict::gates`]); empty if it may be.
    pub failures: Vec<String>,
    /// What makes the photographs agree, the likeliest first; looked for where the fit fails.
    pub causes: Vec<Cause>,
}

/// What ended a search early.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Early {
    /// The user.
    Interrupted,
    /// The time limit.
    TimeLimit,
}

/// The best guess so far, as told to the caller.
pub struct Better<'a> {
    /// Which part of the search.
    pub stage: Stage,
    /// The objective.
    pub objective: f64,
    /// Where it is, with the model that it was found by.
    pub point: &'a [f64],
    /// The model.
    pub model: &'a Model<'a>,
    /// The photographs that are fitted.
    pub photographs: &'a [&'a Photograph],
}

impl Better<'_> {
    /// What the model shows of a distant photograph: each pixel of a bin has that bin's radiance; `None` for the other pixels.
    ///
    /// # Errors
    /// Those of the model.
    pub fn picture(&self, photograph: usize, control: &Control<'_>) -> Result<Option<Vec<[f32; 3]>>> {
        let Some(evaluated) = self.model.evaluate(self.point, control)? else { return Ok(None) };
        let image = &self.photographs[photograph].image;
        let bins = &self.model.input.photographs[photograph];
        let mut rgb = vec![[f32::NAN; 3]; image.rgb.len()];
        for (members, value) in bins.members.iter().zip(evaluated.predicted(photograph, bins)) {
            for &pixel in members {
                rgb[pixel as usize] = value.map(narrow);
            }
        }
        Ok(Some(rgb))
    }
}
