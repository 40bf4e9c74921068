//! From a guess to residuals: the material with its numbers, its effective BRDF where the photographs need it, and the colours that fit best.

use crate::photograph::close_up::CloseUp;
use crate::photograph::mean_period::MeanPeriod;
use crate::residuals::block::ResidualBlock;
use crate::residuals::close_up::Comparison;
use crate::residuals::colour_basis::ColourBasis;
use crate::residuals::distant::Distant;
use crate::residuals::equations::{Equations, Evaluated, Origin, huber, solve};
use crate::residuals::input::{ModelInput, Sampling};
use crate::residuals::near_model::{NearModel, surface_of};
use crate::residuals::params::PARAMS;
use crate::residuals::priors::Priors;
use crate::residuals::state::State;
use crate::residuals::tile_view::TileView;
use crate::residuals::unknowns::{Shot, Unknown, UnknownKind, Variable, slots, unknowns, variables};
use biscale::direction::Pair;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::filter::{BasisReflectance, CommonRandomNumbers, Slot};
use biscale::material::{MaterialValues, SmallScale};
use serde::Serialize;

/// The model at one level.
pub struct Model<'a> {
    /// What it is made of.
    pub input: ModelInput<'a>,
    /// What the search moves.
    pub variables: Vec<Variable>,
    /// What is solved for.
    pub unknowns: Vec<Unknown>,
    near: Option<NearModel<'a>>,
    samples_in_place: CommonRandomNumbers,
    sampling: Sampling,
    slots: Vec<Slot>,
}

/// The height at which the periods of a close-up are registered, and how well the material explains them there; in JSON as `[height, doubt]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(into = "[f64; 2]")]
pub struct Registration {
    /// Height over the plane of the tile.
    pub height: f64,
    /// What the standard deviations of the mean period are multiplied by, at least 1.
    pub doubt: f64,
}

impl From<Registration> for [f64; 2] {
    fn from(registration: Registration) -> Self {
        [registration.height, registration.doubt]
    }
}

/// A state as the photographs see it.
struct SeenState {
    state: State,
    small: SmallScale,
    basis_reflectance: BasisReflectance,
    /// What the close-up shows.
    view: Option<TileView>,
}

/// Bounds of the linear unknowns; equal ones hold them.
struct Bounds {
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> Model<'a> {
    /// With samples drawn on the surface of the parameters `values`.
    ///
    /// # Errors
    /// Bad input if these make no surface.
    pub fn new(input: ModelInput<'a>, sampling: Sampling, values: &[f64], control: &Control<'_>) -> Result<Self> {
        let small = input.material_values(values)?.material()?.build()?;
        let slots = slots(&input.spec.material.surfaces);
        let mut pairs: Vec<Pair> = input.photographs.iter().flat_map(|bins| bins.pairs([0.0; 2])).collect();
        pairs.extend(input.close_up.and_then(|c| c.middle).map(|m| m.pair([0.0; 2])));
        let mut near = NearModel::new(input, sampling, slots.clone());
        if let Some(near) = &mut near {
            near.register_at(near.height_of_edges(&small, control)?);
        }
        Ok(Self {
            input,
            variables: variables(input.spec, input.close_up),
            unknowns: unknowns(input.spec, input.photographs.len(), input.close_up.and_then(CloseUp::exposures)),
            near,
            samples_in_place: CommonRandomNumbers::new(&small, sampling.samples, sampling.seed, &pairs, control)?,
            sampling,
            slots,
        })
    }

    /// The mean period of the close-up, where the model's own can be compared with it.
    pub fn mean_period(&self) -> Option<&MeanPeriod> {
        self.near.as_ref()?.mean_period()
    }

    /// How the periods of the close-up are registered, if they are compared.
    pub fn registration(&self) -> Option<Registration> {
        let near = self.near.as_ref().filter(|near| near.mean_period().is_some())?;
        Some(Registration { height: near.height(), doubt: near.doubt })
    }

    /// Registers the periods of the close-up as another model did.
    pub fn register(&mut self, Registration { height, doubt }: Registration) {
        if let Some(near) = &mut self.near {
            near.register_at(height);
            near.doubt = doubt;
        }
    }

    /// The surface as it is seen from near, if it is another one: threads are round there.
    ///
    /// # Errors
    /// Failures that are no matter of the numbers.
    pub fn rounded(&self, values: &MaterialValues) -> Result<Option<SmallScale>> {
        self.near.as_ref().map_or(Ok(None), |near| near.rounded(values))
    }

    /// Lets the search move the colours, too.
    pub fn move_colours(&mut self) {
        let colours = (0..self.unknowns.len()).filter(|&k| matches!(self.unknowns[k].kind, UnknownKind::Colour(..)));
        self.variables.extend(colours.map(Variable::Linear));
    }

    /// The parameters' values, and the lights' angles, at a point of the unit box.
    pub fn state(&self, point: &[f64]) -> State {
        let spec = self.input.spec;
        let mut values: Vec<f64> = spec.parameters.iter().map(|p| if p.is_free() { p.start } else { p.bounds[0] }).collect();
        let mut lights = vec![[0.0; 2]; self.input.photographs.len()];
        let mut near_light = [0.0; 2];
        let mut blur = 1.0;
        let mut linear = Vec::new();
        for (variable, &unit) in self.variables.iter().zip(point) {
            let value = variable.at(spec, &self.unknowns, unit);
            match variable {
                Variable::Parameter(k) => values[*k] = value,
                Variable::Light { shot: Shot::Distant(photograph), axis, .. } => lights[*photograph][*axis] = value,
                Variable::Light { shot: Shot::CloseUp, axis, .. } => near_light[*axis] = value,
                Variable::Blur => blur = value,
                Variable::Linear(k) => linear.push((*k, value)),
            }
        }
        State { values, lights, near_light, blur, linear }
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

    /// As [`Self::evaluate`], with the linear unknowns held at `held` if these are given.
    ///
    /// # Errors
    /// As [`Self::objective`].
    pub fn evaluate_with(&self, point: &[f64], held: Option<&[f64]>, control: &Control<'_>) -> Result<Option<Evaluated>> {
        control.check()?;
        let Some(seen) = self.see(self.state(point), control)? else { return Ok(None) };
        let bounds = self.bounds(&seen.state, held);
        Ok(match (&self.near, &seen.view) {
            (Some(near), Some(view)) if near.mean_period().is_some() => self.solve_mean_period(&seen, (near, view), &bounds, held),
            _ => Some(self.solve_clusters(&seen, &bounds, held)),
        })
    }

    /// The surface of a state, its basis reflectance in all pairs that the photographs need, and its period from near; `None` where the
    /// numbers make no surface.
    fn see(&self, state: State, control: &Control<'_>) -> Result<Option<SeenState>> {
        let values = self.input.material_values(&state.values);
        let built = values.and_then(|values| Ok((values.material()?.build()?, values)));
        let Some((small, values)) = surface_of(built)? else { return Ok(None) };
        let mut pairs: Vec<Pair> = Vec::new();
        for (bins, light) in self.input.photographs.iter().zip(&state.lights) {
            pairs.extend(bins.pairs(*light));
        }
        // A surface of other triangles gets samples of its own.
        let fresh;
        let samples = if self.samples_in_place.fits(&small) {
            &self.samples_in_place
        } else {
            let Sampling { samples, seed } = self.sampling;
            fresh = CommonRandomNumbers::new(&small, samples, seed, &pairs, control)?;
            &fresh
        };
        let basis_reflectance = samples.on(&small, control)?.basis_reflectance(&pairs, &self.slots)?;
        let view = match &self.near {
            Some(near) => near.view(near.rounded(&values)?.as_ref().unwrap_or(&small), &state, control)?,
            None => None,
        };
        Ok(Some(SeenState { state, small, basis_reflectance, view }))
    }

    /// Bounds of the linear unknowns, where the search moves some of them and `held` are all of them, if these are held.
    fn bounds(&self, state: &State, held: Option<&[f64]>) -> Bounds {
        if let Some(held) = held {
            return Bounds { lower: held.to_vec(), upper: held.to_vec() };
        }
        let (mut lower, mut upper): (Vec<f64>, Vec<f64>) = self.unknowns.iter().map(|u| (u.bounds[0], u.bounds[1])).unzip();
        for &(k, value) in &state.linear {
            (lower[k], upper[k]) = (value, value);
        }
        Bounds { lower, upper }
    }

    fn basis<'b>(&'b self, small: &'b SmallScale) -> ColourBasis<'b> {
        ColourBasis { colours: &self.input.spec.colours, unknowns: &self.unknowns, slots: &self.slots, small }
    }

    /// The linear unknowns that fit best, and where in the period the close-up begins: that answers to the colours a little, and these to it.
    fn solve_mean_period(
        &self,
        seen: &SeenState,
        (near, view): (&NearModel<'_>, &TileView),
        bounds: &Bounds,
        held: Option<&[f64]>,
    ) -> Option<Evaluated> {
        let basis = self.basis(&seen.small);
        let solved = |shift: [f64; 2], before: Option<&[f64]>| self.solve(seen, Comparison::MeanPeriod { shift, before }, bounds);
        let shifts = near.coarse_shifts(view, seen.small.surfaces.len()).into_iter();
        let candidates = shifts.map(|shift| (solved(shift, held), shift));
        let (mut found, mut shift) = candidates.min_by(|a, b| a.0.objective.total_cmp(&b.0.objective))?;
        for _ in 0..PARAMS.registrations {
            shift = near.refined_shift(view, &basis, &found.linear, shift);
            found = solved(shift, Some(&found.linear));
            if held.is_some() {
                break;
            }
        }
        Some(found)
    }

    /// The linear unknowns that fit best, where the close-up is compared cluster by cluster, or there is none.
    ///
    /// How the pixels of the close-up are clustered depends on the colours, and these on how they are clustered: highlights on a coloured
    /// thread count as a white one's, or not, and either answer agrees with itself. So it is begun from both sides: from the surfaces
    /// themselves, and from what the distant photographs say of the colours. The one that explains the photographs better holds.
    fn solve_clusters(&self, seen: &SeenState, bounds: &Bounds, held: Option<&[f64]>) -> Evaluated {
        if let Some(held) = held {
            return self.solve(seen, Comparison::ClustersByColour(held), bounds);
        }
        let first = self.solve(seen, Comparison::WholeLight, bounds);
        if seen.view.is_none() {
            return first;
        }
        let by_colour = |guess: &Evaluated| self.solve(seen, Comparison::ClustersByColour(&guess.linear), bounds);
        let from_light = by_colour(&first);
        let from_surfaces = by_colour(&self.solve(seen, Comparison::ClustersBySurface, bounds));
        if from_surfaces.objective < from_light.objective { from_surfaces } else { from_light }
    }

    /// The linear unknowns that fit best, with the close-up compared so.
    fn solve(&self, seen: &SeenState, comparison: Comparison<'_>, bounds: &Bounds) -> Evaluated {
        let basis = self.basis(&seen.small);
        let distant = Distant {
            photographs: self.input.photographs,
            basis_reflectance: &seen.basis_reflectance,
            opaque: self.input.opaque,
            interreflection: self.input.interreflection.map(|found| &found.bins[..]),
        };
        let close_up = self.near.as_ref().zip(seen.view.as_ref()).map(|(near, view)| near.residuals(view, comparison));
        let priors = Priors {
            parameters: &self.input.spec.parameters,
            variables: &self.variables,
            state: &seen.state,
            photographs: self.input.photographs,
            close_up: self.input.close_up,
            exposure: if let Comparison::MeanPeriod { before: Some(before), .. } = comparison { basis.exposure(before) } else { 1.0 },
        };
        let blocks = [Some(&distant as &dyn ResidualBlock), close_up.as_ref().map(|block| block as &dyn ResidualBlock), Some(&priors)];
        let mut equations = Equations::default();
        for block in blocks.into_iter().flatten() {
            block.add_to(&basis, &mut equations);
        }
        solve(equations, &bounds.lower, &bounds.upper)
    }

    /// Finds the height at which the periods of the close-up are registered: the one at which the model's mean period is most like that of
    /// the photograph. It is a matter of the photograph, and the same for all states of the material; but none tells it before the material
    /// is nearly known. What the material explains worse than its noise counts less by as much from then on. Returns how often the objective
    /// was evaluated.
    ///
    /// # Errors
    /// Those of the model.
    pub fn settle_height(&mut self, point: &[f64], control: &Control<'_>) -> Result<usize> {
        if self.mean_period().is_none() {
            return Ok(0);
        }
        let Some([low, high]) = self.see(self.state(point), control)?.and_then(|seen| seen.view?.heights()) else { return Ok(0) };
        let mut step = (high - low) / PARAMS.heights as f64;
        let mut tried: Vec<(f64, f64)> = Vec::new();
        let mut places: Vec<f64> = (0..=PARAMS.heights).map(|k| low + step * k as f64).collect();
        for _ in 0..PARAMS.height_halvings {
            for height in places {
                self.register_at(height);
                tried.push((self.objective(point, control)?, height));
            }
            tried.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            step *= 0.5;
            places = vec![tried[0].1 - step, tried[0].1 + step];
        }
        self.register(Registration { height: tried[0].1, doubt: 1.0 });
        if let Some(found) = self.evaluate(point, control)? {
            self.register(Registration { height: tried[0].1, doubt: doubt(&found) });
        }
        Ok(tried.len() + 1)
    }

    fn register_at(&mut self, height: f64) {
        if let Some(near) = &mut self.near {
            near.register_at(height);
        }
    }
}

/// The root of the mean squared residual of the close-up, Huber's, at least 1.
fn doubt(found: &Evaluated) -> f64 {
    let near = found.rows.iter().filter(|(_, origin)| *origin == Origin::CloseUp).map(|(row, _)| row);
    let (sum, count) = near.fold((0.0, 0.0), |(s, n), row| (s + row.weight * huber(found.residual(row)), n + row.weight));
    (sum / f64::max(count, f64::MIN_POSITIVE)).max(1.0).sqrt()
}
