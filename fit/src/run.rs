//! The whole fit: photographs in, material out, with all that says how far to trust it.

use crate::cells::{Cells, Sight, scene_of, sights};
use crate::close_up::CloseUp;
use crate::identify::Identified;
use crate::mean_period;
use crate::model::{self, Level, Model, State};
use crate::optimise::Optimiser;
use crate::photograph::{Photograph, Role};
use crate::picture::Picture;
use crate::profile::Profile;
use crate::recipe::Recipe;
use crate::search::{Entry, Memory, Shared, Stage, Start};
use crate::spec::Spec;
use crate::unknowns::{self, Unknown, UnknownKind};
use crate::validate::Validation;
use crate::variant::{Variant, Variants};
use biscale::error::Result;
use biscale::filter::Control;
use biscale::filter::common_random_numbers::Slot;
use biscale::geometry::{Geometry, Tile};
use biscale::material::{Material, SmallScale};
use biscale::render::coverage::Coverage;
use biscale::render::world::World;
use serde::Serialize;

mod finish;
mod stages;

use stages::Search;

/// The model while all starts explore.
pub const COARSE: Level = Level { samples: 1024, cells: 48 };
/// The model that the best of them refine.
pub const FINE: Level = Level { samples: 4096, cells: 144 };
/// Samples of the last look.
pub const POLISH_SAMPLES: u32 = 8192;
/// Profiles that are made.
const PROFILES: usize = 3;
/// Largest difference of the objective of two minima that are equally good, as a share of the better one.
const EQUALLY_GOOD: f64 = 0.05;

/// What the caller wants.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Which optimiser.
    pub optimiser: Optimiser,
    /// Number of starts.
    pub starts: usize,
    /// Whether colours move with everything else, and are not solved for.
    pub joint: bool,
    /// Seed of everything random.
    pub seed: u64,
    /// Seconds after which the search ends with the best so far.
    pub time_limit: Option<f64>,
    /// How closely the search looks.
    pub effort: Effort,
}

/// How closely a search looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Tolerances of the coarse and of the fine search, in coordinates of the unit box.
    pub size: [f64; 2],
    /// The same of the objective.
    pub cost: [f64; 2],
    /// Whether starts explore a coarse model first.
    pub coarse_first: bool,
    /// Whether a search of Nelder and Mead ends by steps of Levenberg and Marquardt, on the fine model.
    pub descent: bool,
}

impl Default for Effort {
    fn default() -> Self {
        Self { size: [0.02, 0.004], cost: [0.02, 0.002], coarse_first: true, descent: true }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { optimiser: Optimiser::default(), starts: 8, joint: false, seed: 0, time_limit: None, effort: Effort::default() }
    }
}

/// A photograph beside the fitted material, as the same camera would see it.
#[derive(Clone, Debug)]
pub struct Compared {
    /// Which photograph of the fit file.
    pub photograph: Photograph,
    /// The material.
    pub picture: Picture,
    /// Pixels that are compared.
    pub used: Vec<u32>,
    /// Relative RMS difference over the cells of directions.
    pub relative_rms: f64,
    /// The same over single pixels.
    pub pixel_relative_rms: f64,
    /// Mean ΔE ITP.
    pub delta_e_itp: f64,
}

/// What the fit found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The start material with the numbers that were found.
    pub recipe: Recipe,
    /// The same, read.
    pub material: Material,
    /// All unknowns, how well they are known, and what is mixed up.
    pub identified: Identified,
    /// Profiles of the parameters that are known worst.
    pub profiles: Vec<Profile>,
    /// Mean squared residual, Huber's; 1 is the noise.
    pub objective: f64,
    /// Relative RMS difference over the cells of the distant photographs.
    pub training: f64,
    /// The starts, those that were refined with their last state, best first.
    pub starts: Vec<Start>,
    /// Other minima as good as the best one.
    pub several: Vec<Vec<(String, f64)>>,
    /// Every evaluation.
    pub trace: Vec<Entry>,
    /// Names of the coordinates of a point of the trace.
    pub coordinates: Vec<String>,
    /// Values of all variables at a point of the trace.
    pub best: Vec<f64>,
    /// What the close-up says.
    pub close_up: Option<CloseUp>,
    /// Cells of the distant photographs.
    pub cells: Vec<Cells>,
    /// Distant photographs beside the fitted material.
    pub compared: Vec<Compared>,
    /// Held-out photographs beside it.
    pub validations: Vec<(Validation, Compared)>,
    /// What ended the search early, if anything.
    pub ended_early: Option<Early>,
    /// Name and seconds of each part of the work.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Whether the fit is to be believed: see [`Outcome::failures`].
    pub failures: Vec<String>,
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
    /// What the model shows of a distant photograph: each pixel of a cell has that cell's radiance; `None` for the other pixels.
    ///
    /// # Errors
    /// Those of the model.
    pub fn picture(&self, photograph: usize, control: &Control<'_>) -> Result<Option<Vec<[f32; 3]>>> {
        let Some(evaluated) = self.model.evaluate(self.point, control)? else { return Ok(None) };
        let image = &self.photographs[photograph].image;
        let cells = &self.model.photographs[photograph];
        let mut rgb = vec![[f32::NAN; 3]; image.rgb.len()];
        for (members, value) in cells.members.iter().zip(evaluated.predicted(photograph, cells)) {
            for &pixel in members {
                #[expect(clippy::cast_possible_truncation, reason = "pictures are in f32")]
                {
                    rgb[pixel as usize] = value.map(|v| v as f32);
                }
            }
        }
        Ok(Some(rgb))
    }
}

/// What does not change while the search runs.
struct Prepared<'a> {
    spec: &'a Spec,
    distant: Vec<&'a Photograph>,
    coarse: Vec<Cells>,
    fine: Vec<Cells>,
    close_up: Option<CloseUp>,
    opaque: bool,
    start: SmallScale,
    notes: Vec<String>,
}

/// Where the photographs of a fit file can be used, without a search: what `check` says.
#[derive(Clone, Debug, Serialize)]
pub struct Survey {
    /// For each distant photograph its file, the pixels that can be used, and the cells of the fine model.
    pub distant: Vec<(String, usize, usize)>,
    /// What the close-up says.
    pub close_up: Option<CloseUp>,
    /// Names of what the search moves.
    pub variables: Vec<String>,
    /// Names of what is solved for.
    pub unknowns: Vec<String>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Looks at all that a fit file names.
///
/// # Errors
/// Bad input; `Interrupted`.
pub fn survey(spec: &Spec, control: &Control<'_>) -> Result<Survey> {
    let prepared = Prepared::new(spec, control)?;
    let unknowns = unknowns::unknowns(spec, prepared.distant.len(), prepared.close_up.as_ref().is_some_and(CloseUp::scales));
    Ok(Survey {
        distant: prepared
            .distant
            .iter()
            .zip(&prepared.fine)
            .map(|(p, c)| (p.file.display().to_string(), c.pixels, c.cells.len()))
            .collect(),
        variables: unknowns::variables(spec).iter().map(|v| v.name(spec, &unknowns)).collect(),
        unknowns: unknowns.into_iter().map(|u| u.name).collect(),
        close_up: prepared.close_up,
        notes: prepared.notes,
    })
}

impl<'a> Prepared<'a> {
    fn new(spec: &'a Spec, control: &Control<'_>) -> Result<Self> {
        let start = spec.material.build()?;
        let opaque = is_opaque(&spec.material, &start.tile, control)?;
        let mut notes = spec.notes.clone();
        for photograph in &spec.photographs {
            let name = photograph.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            notes.extend(photograph.image.notes.iter().map(|n| format!("{name}: {n}")));
            if !photograph.exposure_known && photograph.role != Role::CloseUp {
                notes.push(format!("{name}: its irradiance is not known and was taken as given: all colours share an unknown factor"));
            }
        }
        let distant: Vec<&Photograph> = spec.of_role(Role::Distant).collect();
        let (mut coarse, mut fine) = (Vec::new(), Vec::new());
        for photograph in &distant {
            let sights = look(photograph, spec, &start);
            coarse.push(Cells::new(photograph, &sights, (COARSE.cells / distant.len()).max(8))?);
            fine.push(Cells::new(photograph, &sights, (FINE.cells / distant.len()).max(8))?);
            control.check()?;
        }
        let colours: Vec<[f64; 3]> = (0..start.surfaces.len()).map(|s| surface_colour(&start, s)).collect();
        let close_up = spec
            .of_role(Role::CloseUp)
            .next()
            .map(|p| CloseUp::new(p, &look(p, spec, &start), &start, mean_period::uniform(&spec.material.geometry), &colours));
        match &close_up {
            Some(found) => notes.extend(found.notes.iter().map(|n| format!("close-up: {n}"))),
            None => notes.push(
                "there is no close-up: from afar cover times colour is all that shows, and single colours are not to be trusted".to_owned(),
            ),
        }
        Ok(Self { spec, distant, coarse, fine, close_up, opaque, start, notes })
    }

    /// How the photographs may be read.
    fn variants(&self) -> Variants {
        let own = || vec![(0..self.start.surfaces.len()).collect()];
        let found = self.close_up.as_ref().filter(|c| !c.choices.is_empty());
        let likely = found.map_or_else(own, |c| c.choices.clone());
        let rest = found.map_or_else(Vec::new, |c| c.other_choices.clone());
        Variants::new(self.spec, &likely, &rest)
    }
}

fn look(photograph: &Photograph, spec: &Spec, start: &SmallScale) -> Vec<Sight> {
    let scene = scene_of(photograph, &spec.material, start);
    sights(&World::opaque(&scene), photograph)
}

/// Whether no light passes the surface. Cloth always counts as open: its gaps may close and open while it moves.
fn is_opaque(material: &Material, tile: &Tile, control: &Control<'_>) -> Result<bool> {
    if matches!(material.geometry, Geometry::Weave(_)) {
        return Ok(false);
    }
    Ok(Coverage::of(tile, control)?.is_opaque())
}

/// What one surface looks like on the whole: its colours added up.
fn surface_colour(small: &SmallScale, surface: usize) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &colour in Slot::of(&small.surfaces[surface].brdf) {
        let c = unknowns::colour_of(small, Slot { surface, colour });
        (0..3).for_each(|k| sum[k] += c[k]);
    }
    sum
}

/// Seconds of the parts of the work.
struct Stopwatch<'a> {
    control: &'a Control<'a>,
    last: f64,
    parts: Vec<(&'static str, f64)>,
}

impl Stopwatch<'_> {
    fn lap(&mut self, name: &'static str) {
        let now = (self.control.clock)();
        self.parts.push((name, now - self.last));
        self.last = now;
    }
}

/// Fits.
///
/// The same fit file, options and seed give the same result at any thread count, unless the time limit or the user ends the search. With
/// `memory`, the evaluations of an earlier run of the same fit, the search goes on where that one ended.
///
/// # Errors
/// Bad input; failures of the filter. Not `Interrupted` once the search has evaluated anything: then the outcome is the best so far.
pub fn fit(
    spec: &Spec,
    options: &Options,
    memory: &Memory,
    better: &(dyn Fn(&Better<'_>) + Sync),
    control: &Control<'_>,
) -> Result<Outcome> {
    let mut watch = Stopwatch { control, last: (control.clock)(), parts: Vec::new() };
    let deadline = options.time_limit.map(|t| (control.clock)() + t);
    (control.progress)("photographs", 0.0);
    let prepared = Prepared::new(spec, control)?;
    watch.lap("photographs");
    let told = |entry: &Entry, model: &Model<'_>| {
        let Entry { stage, objective, point, .. } = entry;
        better(&Better { stage: *stage, objective: *objective, point, model, photographs: &prepared.distant });
    };
    let shared = Shared::new(control, deadline, memory, &told);
    let found = Search { prepared: &prepared, options, shared: &shared }.run(&mut watch)?;
    finish::finish(&prepared, options, &shared, found, watch)
}

/// The start material with the numbers and colours that were found.
pub fn recipe_of(spec: &Spec, variant: &Variant, state: &State, unknowns: &[Unknown], linear: &[f64]) -> Recipe {
    let mut recipe = spec.recipe.clone();
    variant.write(&mut recipe);
    model::write(&mut recipe, &spec.parameters, &state.values);
    for (k, colour) in spec.colours.iter().enumerate() {
        let mut found = [0.0; 3];
        for (unknown, &value) in unknowns.iter().zip(linear) {
            match unknown.kind {
                UnknownKind::Colour(j, None) if j == k => found = [value; 3],
                UnknownKind::Colour(j, Some(c)) if j == k => found[c] = value,
                _ => {}
            }
        }
        recipe.set_colour(&colour.place, found);
    }
    recipe
}

/// Veil of a distant photograph.
fn veil(unknowns: &[Unknown], linear: &[f64], photograph: usize) -> [f64; 3] {
    let mut veil = [0.0; 3];
    for (unknown, &value) in unknowns.iter().zip(linear) {
        if let UnknownKind::Veil(p, c) = unknown.kind
            && p == photograph
        {
            veil[c] = value;
        }
    }
    veil
}
