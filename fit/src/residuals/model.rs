//! From a guess to residuals: the material with its numbers, its effective BRDF where the photographs need it, and the colours that fit best.

use crate::fit_file::assignment::{Assignment, assign};
use crate::fit_file::spec::Spec;
use crate::fit_file::variant::Variant;
use crate::near_paths::{self, Seen};
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::Cells;
use crate::residuals::equations::{Equations, Evaluated, Origin, Row, solve};
use crate::residuals::tile_view::TileView;
use crate::residuals::unknowns::{Unknown, UnknownKind, Variable, colour_of, slots, unknowns, variables};
use biscale::direction::Pair;
use biscale::error::{Error, Result};
use biscale::filter::Control;
use biscale::filter::common_random_numbers::{BasisReflectance, CommonRandomNumbers, Slot};
use biscale::material::{MaterialValues, SmallScale};

/// How often the model's period is laid on that of the close-up anew, with the colours that were found.
const ALIGNMENTS: usize = 2;
/// Standard deviation of the veil where no unlit place shows it, as a share of the mean radiance of its photograph.
const VEIL_SIGMA: f64 = 0.02;
/// The same where one does: as a share of the mean, and of what is seen there. Light from a room, or through the cloth, is not the same all over.
const UNLIT_SIGMA: [f64; 2] = [0.002, 0.4];

/// How fine a model is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Samples of the small-scale surface.
    pub samples: u32,
    /// Most cells of all distant photographs.
    pub cells: usize,
}

/// Light that was reflected more than once, as it was found for one state of the material: kept while the search moves.
#[derive(Clone, Debug, Default)]
pub struct Indirect {
    /// For each distant photograph and cell its radiance over irradiance.
    pub cells: Vec<Vec<[f64; 3]>>,
    /// In the close-up, all kinds together; nothing where it is compared place by place.
    pub close_up: [f64; 3],
    /// For each kind of the close-up its share of that.
    pub kinds: Vec<[f64; 3]>,
    /// In the close-up place by place of a period, as each of its viewers sees it, if that is how it is compared.
    pub near: Vec<Seen>,
}

/// The model at one level.
pub struct Model<'a> {
    /// The question.
    pub spec: &'a Spec,
    /// Cells of the distant photographs.
    pub photographs: &'a [Cells],
    /// What the close-up says.
    pub close_up: Option<&'a CloseUp>,
    /// Which surface each kind of the close-up is, and what else is no number that moves.
    pub variant: &'a Variant,
    /// What the search moves.
    pub variables: Vec<Variable>,
    /// What is solved for.
    pub unknowns: Vec<Unknown>,
    /// What is added to direct light.
    pub indirect: Option<&'a Indirect>,
    /// What the standard deviations of the close-up's mean period are multiplied by: how badly the material explains it, at least 1.
    pub doubt: f64,
    /// Height at which the periods of the close-up were laid on top of each other: first that of its edges, then what [`Model::settle_height`] found.
    height: f64,
    /// What is reflected more than once, place by place of the close-up's period.
    pub(crate) between: Vec<[f64; 3]>,
    samples_in_place: CommonRandomNumbers,
    pub(crate) samples: u32,
    pub(crate) seed: u32,
    opaque: bool,
    pub(crate) slots: Vec<Slot>,
}

/// What a variant and the values of all parameters set in the start material.
pub fn assignments(spec: &Spec, variant: &Variant, values: &[f64]) -> Vec<Assignment> {
    variant.assignment().into_iter().chain(spec.parameters.iter().zip(values).flat_map(|(p, &value)| p.assignments(value))).collect()
}

/// The start material with these values.
///
/// # Errors
/// Bad input for a value out of range.
pub fn material_values(spec: &Spec, assignments: &[Assignment]) -> Result<MaterialValues> {
    let mut values = spec.values.clone();
    assign(&mut values, assignments)?;
    Ok(values)
}

impl<'a> Model<'a> {
    /// At a level, with samples drawn on the surface of the parameters `values`.
    ///
    /// # Errors
    /// Bad input if these make no surface.
    #[expect(clippy::too_many_arguments, reason = "what a model is made of")]
    pub fn new(
        spec: &'a Spec,
        photographs: &'a [Cells],
        close_up: Option<&'a CloseUp>,
        variant: &'a Variant,
        indirect: Option<&'a Indirect>,
        samples: u32,
        seed: u32,
        values: &[f64],
        opaque: bool,
        control: &Control<'_>,
    ) -> Result<Self> {
        let small = material_values(spec, &assignments(spec, variant, values))?.material()?.build()?;
        let slots = slots(&spec.material.surfaces);
        let mut pairs: Vec<Pair> = photographs.iter().flat_map(|cells| cells.pairs([0.0; 2])).collect();
        pairs.extend(close_up.and_then(|c| c.pair));
        let mut model = Self {
            spec,
            photographs,
            close_up,
            variant,
            variables: variables(spec),
            unknowns: unknowns(spec, photographs.len(), close_up.is_some_and(CloseUp::scales)),
            indirect,
            doubt: 1.0,
            height: 0.0,
            between: Vec::new(),
            samples_in_place: CommonRandomNumbers::new(&small, samples, seed, &pairs, control)?,
            samples,
            seed,
            opaque,
            slots,
        };
        model.lay_at(model.height_of_edges(&small, control)?);
        Ok(model)
    }

    /// Height at which the periods of the close-up were laid on top of each other.
    pub fn height(&self) -> f64 {
        self.height
    }

    /// Lays the periods of the close-up on top of each other at a height.
    pub fn lay_at(&mut self, height: f64) {
        self.height = height;
        self.between = match self.indirect {
            Some(indirect) if !indirect.near.is_empty() => near_paths::laid_at(&indirect.near, height),
            _ => Vec::new(),
        };
    }

    /// Lets the search move the colours, too.
    pub fn move_colours(&mut self) {
        let colours = (0..self.unknowns.len()).filter(|&k| matches!(self.unknowns[k].kind, UnknownKind::Colour(..)));
        self.variables.extend(colours.map(Variable::Linear));
    }

    /// How many residuals [`Evaluated::fixed`] begins with that come from the close-up.
    pub fn covers(&self) -> usize {
        match self.close_up {
            Some(c) if self.mean_period().is_none() && c.pair.is_some() && c.tells_surfaces_apart(self.spec.material.surfaces.len()) => {
                c.kinds.len()
            }
            _ => 0,
        }
    }

    /// The parameters' values, and the lights' angles, at a point of the unit box.
    pub fn state(&self, point: &[f64]) -> State {
        let mut values: Vec<f64> = self.spec.parameters.iter().map(|p| if p.is_free() { p.start } else { p.bounds[0] }).collect();
        let mut lights = vec![[0.0; 2]; self.photographs.len()];
        let mut linear = Vec::new();
        for (variable, &unit) in self.variables.iter().zip(point) {
            let value = variable.at(self.spec, &self.unknowns, unit);
            match variable {
                Variable::Parameter(k) => values[*k] = value,
                Variable::Light { photograph, axis, .. } => lights[*photograph][*axis] = value,
                Variable::Linear(k) => linear.push((*k, value)),
            }
        }
        State { values, lights, linear }
    }

    /// The material at a state and its surface, the colours those of the start material; `None` if the numbers make no surface.
    ///
    /// # Errors
    /// Failures that are no matter of the numbers.
    pub fn surface(&self, state: &State) -> Result<Option<(MaterialValues, SmallScale)>> {
        let values = material_values(self.spec, &assignments(self.spec, self.variant, &state.values));
        match values.and_then(|values| Ok((values.material()?.build()?, values))) {
            Ok((small, values)) => Ok(Some((values, small))),
            Err(Error::BadInput(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The objective at a point of the unit box; infinite where the numbers make no surface, or nothing finite comes out.
    ///
    /// # Errors
    /// `Interrupted`, and failures that are no matter of the point.
    pub fn objective(&self, point: &[f64], control: &Control<'_>) -> Result<f64> {
        Ok(self.evaluate(point, control)?.map_or(f64::INFINITY, |e| if e.objective.is_finite() { e.objective } else { f64::INFINITY }))
    }

    /// Evaluates a point of the unit box; `None` where the numbers make no surface.
    ///
    /// # Errors
    /// As [`Self::objective`].
    pub fn evaluate(&self, point: &[f64], control: &Control<'_>) -> Result<Option<Evaluated>> {
        self.evaluate_with(point, None, control)
    }

    /// As [`Self::evaluate`], with the linear unknowns held at `linear` if these are given.
    ///
    /// # Errors
    /// As [`Self::objective`].
    pub fn evaluate_with(&self, point: &[f64], linear: Option<&[f64]>, control: &Control<'_>) -> Result<Option<Evaluated>> {
        control.check()?;
        let state = self.state(point);
        let Some((values, small)) = self.surface(&state)? else { return Ok(None) };
        let (mut lower, mut upper): (Vec<f64>, Vec<f64>) = self.unknowns.iter().map(|u| (u.bounds[0], u.bounds[1])).unzip();
        for &(k, value) in &state.linear {
            (lower[k], upper[k]) = (value, value);
        }
        if let Some(held) = linear {
            lower.clone_from_slice(held);
            upper.clone_from_slice(held);
        }
        let looked = self.look(&state, (&values, &small), control)?;
        if let Some(view) = looked.near.as_ref().filter(|_| self.mean_period().is_some()) {
            // Where in the period the picture begins answers to the colours a little, and these to it.
            let solved = |shift, exposure| {
                let (rows, fixed) = self.equations(&state, &small, &looked, Sorting::Laid(shift, exposure));
                solve(rows, fixed, &lower, &upper)
            };
            let exposure = linear.map_or(1.0, |held| self.exposure(held));
            let first = self.laid(view, &small).into_iter().map(|shift| (solved(shift, exposure), shift));
            let Some((mut found, mut shift)) = first.min_by(|a, b| a.0.objective.total_cmp(&b.0.objective)) else { return Ok(None) };
            for _ in 0..ALIGNMENTS {
                shift = self.laid_better(view, &small, &found.linear, shift);
                found = solved(shift, self.exposure(&found.linear));
                if linear.is_some() {
                    break;
                }
            }
            return Ok(Some(found));
        }
        if let Some(held) = linear {
            let (rows, fixed) = self.equations(&state, &small, &looked, Sorting::ByColour(held));
            return Ok(Some(solve(rows, fixed, &lower, &upper)));
        }
        let solved = |sorting: Sorting<'_>| {
            let (rows, fixed) = self.equations(&state, &small, &looked, sorting);
            solve(rows, fixed, &lower, &upper)
        };
        if looked.near.is_none() {
            return Ok(Some(solved(Sorting::None)));
        }
        // How the pixels of the close-up are sorted depends on the colours, and these on how they are sorted: highlights on a coloured thread count as a
        // white one's, or not, and either answer agrees with itself. So it is begun from both sides: from the surfaces themselves, and from
        // what the distant photographs say of the colours. The one that explains the photographs better holds.
        let mut best: Option<Evaluated> = None;
        for first in [Sorting::None, Sorting::BySurface] {
            let guess = solved(first);
            let found = solved(Sorting::ByColour(&guess.linear));
            if best.as_ref().is_none_or(|b| found.objective < b.objective) {
                best = Some(found);
            }
        }
        Ok(best)
    }

    /// Looks at the surface in all pairs that the photographs need.
    fn look(&self, state: &State, (values, small): (&MaterialValues, &SmallScale), control: &Control<'_>) -> Result<Looked> {
        let mut pairs: Vec<Pair> = Vec::new();
        for (cells, light) in self.photographs.iter().zip(&state.lights) {
            pairs.extend(cells.pairs(*light));
        }
        // A surface of other triangles gets samples of its own.
        let fresh;
        let samples_in_place = if self.samples_in_place.fits(small) {
            &self.samples_in_place
        } else {
            fresh = CommonRandomNumbers::new(small, self.samples, self.seed, &pairs, control)?;
            &fresh
        };
        let shares = samples_in_place.on(small, control)?.basis_reflectance(&pairs, &self.slots)?;
        let near = self.near_view(self.rounded(values)?.as_ref().unwrap_or(small), control)?;
        Ok(Looked { shares, near })
    }

    /// The equations of a state, and the residuals that are none.
    fn equations(&self, state: &State, small: &SmallScale, looked: &Looked, sorting: Sorting<'_>) -> Equations {
        let shares = &looked.shares;
        let mut rows = Vec::new();
        let mut first = 0;
        for (p, cells) in self.photographs.iter().enumerate() {
            for (k, cell) in cells.cells.iter().enumerate() {
                let at = first + k;
                // Over a surface without gaps the area that samples show stands for the cosine: they share their noise.
                let factor = if self.opaque && shares.av[at] > 0.0 { cell.wo.z / shares.av[at] } else { 1.0 } * cell.inverse_cosine;
                for c in 0..3 {
                    let scale = cell.irradiance[c] * factor;
                    let (mut terms, mut known) = self.terms(|slot| scale * shares.s[slot][at][c], c, small);
                    if let Some(indirect) = self.indirect {
                        known += cell.irradiance[c] * indirect.cells[p][k][c];
                    }
                    if let Some(veil) = self.unknowns.iter().position(|u| u.kind == UnknownKind::Veil(p, c)) {
                        terms.push((veil, 1.0));
                    }
                    let row = Row { terms, known, value: cell.mean[c], sigma: cell.sigma[c], weight: cell.weight };
                    rows.push((row, Origin::Cell(p, k, c)));
                }
            }
            first += cells.cells.len();
        }
        let mut fixed = Vec::new();
        if let Some((close_up, view)) = self.close_up.zip(looked.near.as_ref()) {
            self.close_up_rows(close_up, view, small, sorting, (&mut rows, &mut fixed));
        }
        self.priors(state, &mut rows, &mut fixed);
        (rows, fixed)
    }

    /// Coefficients of the unknowns in light of which `share` is the part of each slot in a channel, and what is known of it.
    pub(crate) fn terms(&self, share: impl Fn(usize) -> f64, channel: usize, small: &SmallScale) -> (Vec<(usize, f64)>, f64) {
        let (mut terms, mut known) = (Vec::new(), 0.0);
        for (place, slot) in self.slots.iter().enumerate() {
            let share = share(place);
            match self.unknown(*slot, channel) {
                Some(k) => terms.push((k, share)),
                None => known += share * colour_of(small, *slot)[channel],
            }
        }
        (terms, known)
    }

    /// The unknown that a slot's colour is in a channel.
    pub(crate) fn unknown(&self, slot: Slot, channel: usize) -> Option<usize> {
        self.unknowns.iter().position(|u| match u.kind {
            UnknownKind::Colour(k, c) => self.spec.colours[k].slot == slot && c.is_none_or(|c| c == channel),
            UnknownKind::Veil(..) | UnknownKind::Exposure => false,
        })
    }

    /// The irradiance of the close-up that was given over what it is.
    pub(crate) fn exposure(&self, linear: &[f64]) -> f64 {
        self.unknowns.iter().position(|u| u.kind == UnknownKind::Exposure).map_or(1.0, |k| linear[k])
    }

    fn priors(&self, state: &State, rows: &mut Vec<(Row, Origin)>, fixed: &mut Vec<f64>) {
        for (parameter, value) in self.spec.parameters.iter().zip(&state.values) {
            if let Some([mean, sigma]) = parameter.prior {
                fixed.push((value - mean) / sigma);
            }
        }
        for variable in &self.variables {
            if let Variable::Light { photograph, axis, sigma } = variable {
                fixed.push(state.lights[*photograph][*axis] / sigma);
            }
        }
        for (k, unknown) in self.unknowns.iter().enumerate() {
            if let UnknownKind::Veil(p, c) = unknown.kind {
                let Cells { mean, unlit, .. } = &self.photographs[p];
                let (value, sigma) = match unlit {
                    Some(unlit) => (unlit[c], (UNLIT_SIGMA[0] * mean[c]).hypot(UNLIT_SIGMA[1] * unlit[c])),
                    None => (0.0, VEIL_SIGMA * mean[c]),
                };
                rows.push((Row { terms: vec![(k, 1.0)], known: 0.0, value, sigma: sigma.max(1e-12), weight: 1.0 }, Origin::Prior));
            }
        }
    }
}

/// How the pixels of the close-up are sorted into kinds.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Sorting<'a> {
    /// Not at all: only their light counts, of all together.
    None,
    /// By the surface that each shows most of.
    BySurface,
    /// By colour, where the unknowns are these.
    ByColour(&'a [f64]),
    /// Not at all: place by place of the mean period, with this shift and about this exposure.
    Laid([f64; 2], f64),
}

/// The surface as the photographs need it.
struct Looked {
    shares: BasisReflectance,
    /// What the close-up shows.
    near: Option<TileView>,
}

/// A point of the search in its own units.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    /// Values of all parameters of the fit file.
    pub values: Vec<f64>,
    /// Azimuth and elevation of the light of each distant photograph against what was given, degrees.
    pub lights: Vec<[f64; 2]>,
    /// Linear unknowns that the search moves.
    pub linear: Vec<(usize, f64)>,
}
