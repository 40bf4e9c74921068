//! The stages of a search: all starts on a coarse model, the best ones on a fine one, and the best one once more.

use super::found::found;
use super::options::{COARSE, FINE, Options, POLISH_SAMPLES};
use super::prepared::Prepared;
use super::stopwatch::Stopwatch;
use crate::fit_file::variant::{Variant, Variants};
use crate::parallel::in_parallel;
use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::equations::Evaluated;
use crate::residuals::input::{Interreflection, ModelInput, Sampling, material_values};
use crate::residuals::interreflection::{NearScene, trace_interreflection};
use crate::residuals::model::{Model, Registration};
use crate::residuals::near_interreflection::PathOptions;
use crate::residuals::unknowns::{Shot, Variable};
use crate::search::optimise::{Limits, Optimiser};
use crate::search::{self, APART, SearchShared, Stage, Start, Task};
use biscale::error::{Error, Result};
use biscale::filter::Control;
use biscale::numerics::cast::halves;
use std::ops::Range;
use std::sync::Arc;

/// Rounds of interreflections and colours at a start that has none yet. Chosen, not measured.
const FIRST_ROUNDS: usize = 3;
/// Starts that are refined.
const REFINED: usize = 3;
/// Objective of the coarse model from which on surfaces that the start material's colours rule out are tried as well.
const AT_A_LOSS: f64 = 4.0;

/// Distance, in any coordinate, below which two starts of one variant ended in the same minimum: a third of what makes two minima two.
const SAME_MINIMUM: f64 = 0.3 * APART;

/// How one stage searches.
#[derive(Clone, Copy, Debug)]
struct StageParams {
    /// Size of the first simplex, or longest step of a descent, over the range.
    step: f64,
    /// Most evaluations: in all, and more for each dimension.
    evaluations: [usize; 2],
    /// Size of the simplices that confirm a minimum; 0 for none.
    confirm: f64,
}

/// How the stages search.
#[derive(Clone, Copy, Debug)]
struct StagesParams {
    /// All starts, on the coarse model.
    explore: StageParams,
    /// The best starts, on the fine model.
    refine: StageParams,
    /// All starts on the fine model, where nothing was explored before.
    refine_alone: StageParams,
    /// The best start, with more samples.
    polish: StageParams,
}

/// Chosen, not measured one by one; what tolerances and optimisers buy with them is in `docs/fit.md` (`cargo bench --bench fit_trade`). Wider
/// first simplices leave the valley that a start stands in; fewer evaluations end searches before their points come together.
const STAGES: StagesParams = StagesParams {
    explore: StageParams { step: 0.2, evaluations: [60, 25], confirm: 0.0 },
    refine: StageParams { step: 0.08, evaluations: [100, 35], confirm: 0.04 },
    refine_alone: StageParams { step: 0.2, evaluations: [200, 80], confirm: 0.05 },
    polish: StageParams { step: 0.1, evaluations: [40, 10], confirm: 0.0 },
};

/// By how much a light is pushed, as a share of its range: 3 degrees where that is 24. Chosen, not measured: a fit that stood still
/// went on from there (`FROM=2 COUNT=1 cargo test --test coverage`).
const PUSH: f64 = 0.125;

/// A search.
pub(super) struct Search<'a> {
    pub(super) prepared: &'a Prepared<'a>,
    pub(super) options: &'a Options,
    pub(super) shared: &'a SearchShared<'a>,
}

/// What the search leaves.
pub(super) struct Searched {
    /// The starts, best first; only the first ones were refined.
    pub(super) starts: Vec<Start>,
    /// How many were.
    pub(super) refined: usize,
}

impl Search<'_> {
    /// The model of one start.
    fn model<'m>(&'m self, bins: &'m [DirectionBins], samples: u32, start: &'m Start, variants: &'m [Variant]) -> Result<Model<'m>> {
        model_of(self.prepared, self.options, bins, samples, start, &variants[start.choice], self.shared.control)
    }

    fn limits(&self, stage: Stage, dimensions: usize) -> (Limits, f64) {
        let effort = self.options.effort;
        let (k, StageParams { step, evaluations: [least, each], confirm }) = match stage {
            Stage::Explore => (0, STAGES.explore),
            Stage::Refine if !effort.coarse_first => (1, STAGES.refine_alone),
            Stage::Refine => (1, STAGES.refine),
            Stage::Polish => (1, STAGES.polish),
        };
        (Limits { step, size: effort.size[k], cost: effort.cost[k], evaluations: least + each * dimensions }, confirm)
    }

    /// Whether stages after the first follow the residuals.
    fn descends(&self) -> bool {
        let Options { optimiser, joint, effort, .. } = *self.options;
        effort.descent && optimiser == Optimiser::NelderMead && !joint
    }

    /// One stage of some starts; the best first.
    fn stage(&self, stage: Stage, bins: &[DirectionBins], samples: u32, starts: &[Start], variants: &[Variant]) -> Result<Vec<Start>> {
        let dimensions = starts.first().map_or(0, |s| s.point.len());
        let (limits, confirm) = self.limits(stage, dimensions);
        self.shared.begin_stage(starts.len() * limits.evaluations * 2 / 3);
        let optimiser = self.options.optimiser;
        let descends = self.descends() && stage != Stage::Explore;
        let optimiser = if descends { Optimiser::Lm } else { optimiser };
        let task = Task { stage, optimiser, limits, confirm, seed: self.options.seed };
        let one = |start: &Start| {
            let model = match self.model(bins, samples, start, variants) {
                // A start that was not begun is no reason to lose what the others have found.
                Err(Error::Interrupted) => return Ok(Start { objective: f64::INFINITY, ..start.clone() }),
                model => model?,
            };
            search::search(&model, start, &task, self.shared)
        };
        // A single start has all threads for itself.
        let mut found = if let [start] = starts { vec![one(start)?] } else { in_parallel(starts, |_, start| one(start))? };
        found.sort_by(|a, b| a.objective.total_cmp(&b.objective).then(a.number.cmp(&b.number)));
        Ok(found)
    }

    /// All stages, the best start first.
    ///
    /// # Errors
    /// `Interrupted` if nothing was evaluated before the search had to end.
    pub(super) fn run(&self, watch: &mut Stopwatch<'_>) -> Result<Searched> {
        let variants = self.prepared.variants();
        let starts = self.explored(&variants, watch)?;
        if starts[0].evaluations == 0 && self.shared.must_end() {
            return Err(Error::Interrupted);
        }
        // Of starts that ended in the same minimum the best one is enough.
        let most = if self.options.effort.coarse_first { REFINED } else { usize::MAX };
        let (chosen, rest) = choose(starts, &variants.all, most);
        let (mut starts, unrefined) = self.refined(chosen, &variants.all, watch)?;
        if self.may_go_on() {
            let others = starts.iter().chain(&unrefined).chain(&rest);
            let first = others.map(|s| s.number).max().unwrap_or(0) + 1;
            let pushed = self.pushed(&starts[0], first, &variants.all, watch)?;
            let (pushed, leads) = self.on_the_same_samples(&starts[0], pushed, &variants.all)?;
            // The best one stays in front where it is better still, the close-up believed as much.
            let place = usize::from(!is_doubted(&starts[0]) && !leads);
            starts.splice(place..place, pushed);
        }
        if self.may_go_on() {
            starts[0] = self.polished(starts[0].clone(), &variants.all, watch)?;
        }
        let refined = starts.len();
        starts.extend(unrefined.into_iter().chain(rest));
        Ok(Searched { starts, refined })
    }

    /// Whether another stage may begin. A search that is resumed begins all of them: what an earlier run evaluated costs nothing.
    fn may_go_on(&self) -> bool {
        !self.shared.must_end() || !self.shared.memory.is_empty()
    }

    /// The starts, and where the effort asks for it what the coarse model makes of them, the best first.
    pub(super) fn explored(&self, variants: &Variants, watch: &mut Stopwatch<'_>) -> Result<Vec<Start>> {
        let Self { prepared, options, .. } = *self;
        let Variants { all, likely } = variants;
        let blank = Start::blank(0);
        let own = self.model(&prepared.coarse, COARSE.samples, &blank, all)?;
        let starts = self.deal(&own, &blank, 0..*likely);
        if !options.effort.coarse_first {
            return Ok(starts);
        }
        let explore = |starts: &[Start]| self.stage(Stage::Explore, &prepared.coarse, COARSE.samples, starts, all);
        let mut found = explore(&starts)?;
        if found[0].objective > AT_A_LOSS && *likely < all.len() && self.may_go_on() {
            let next = Start { number: found.len(), ..blank.clone() };
            let others = explore(&self.deal(&own, &next, *likely..all.len()))?;
            // Ties are those of nothing evaluated.
            found.extend(others.into_iter().filter(|s| s.objective.is_finite()));
            found.sort_by(|a, b| a.objective.total_cmp(&b.objective).then(a.number.cmp(&b.number)));
        }
        watch.lap("explore");
        Ok(found)
    }

    /// Starts like `first`, numbered from its number on, dealt out to a range of the variants: as many as the options say, and at least one each.
    fn deal(&self, own: &Model<'_>, first: &Start, variants: Range<usize>) -> Vec<Start> {
        let options = self.options;
        let nothing_moves = self.prepared.variables().is_empty() && !options.joint;
        let points = if nothing_moves {
            vec![Vec::new(); variants.len()]
        } else {
            search::starts(own, options.starts.max(variants.len()), options.seed)
        };
        let one = |(k, point)| Start { number: first.number + k, point, choice: variants.start + k % variants.len(), ..first.clone() };
        points.into_iter().enumerate().map(one).collect()
    }

    /// The chosen starts on the fine model, the best first; as they were where the search must end before.
    fn refined(&self, mut chosen: Vec<Start>, variants: &[Variant], watch: &mut Stopwatch<'_>) -> Result<(Vec<Start>, Vec<Start>)> {
        if self.prepared.spec.bounces > 0 {
            chosen = chosen.into_iter().map(|start| self.interreflecting(start, FIRST_ROUNDS, variants)).collect::<Result<_>>()?;
            watch.lap("interreflections");
        }
        let chosen = self.registered(chosen, FINE.samples, variants)?;
        if !self.may_go_on() {
            return Ok((chosen, Vec::new()));
        }
        let refined = self.stage(Stage::Refine, &self.prepared.fine, FINE.samples, &chosen, variants)?;
        watch.lap("refine");
        // A start whose refinement did not begin stands where it stood.
        let (refined, others): (Vec<Start>, Vec<Start>) = refined.into_iter().partition(|s| s.objective.is_finite());
        if refined.is_empty() {
            return Ok((chosen, Vec::new()));
        }
        let as_before = |other: Start| {
            let stood = chosen.iter().find(|s| s.number == other.number).cloned();
            stood.map(|s| Start { evaluations: other.evaluations, ..s })
        };
        Ok((refined, others.into_iter().filter_map(as_before).collect()))
    }

    /// Starts from the best one, numbered from `first` on, with a light pushed to either side, and refined again; the best first. Where a light is not
    /// what the file says, geometry and colours make up for it, along a valley whose floor a descent loses: from beside it goes on. Empty where no light moves.
    fn pushed(&self, best: &Start, first: usize, variants: &[Variant], watch: &mut Stopwatch<'_>) -> Result<Vec<Start>> {
        let variables = self.prepared.variables();
        let compared = self.prepared.close_up.as_ref().is_some_and(|found| found.mean_period.is_some());
        let may_push = |v: &Variable| match v {
            Variable::Light { shot: Shot::CloseUp, .. } => compared,
            Variable::Light { shot: Shot::Distant(_), .. } => true,
            _ => false,
        };
        let mut points: Vec<Vec<f64>> = Vec::new();
        for (k, _) in variables.iter().enumerate().filter(|(_, v)| may_push(v)) {
            points.extend([-PUSH, PUSH].map(|push| {
                let mut point = best.point.clone();
                point[k] = (point[k] + push).clamp(0.0, 1.0);
                point
            }));
        }
        if points.is_empty() || !self.descends() || !best.objective.is_finite() {
            return Ok(Vec::new());
        }
        // Believed less for being explained badly, the close-up would not pull it back.
        if is_doubted(best) {
            points.insert(0, best.point.clone());
        }
        let registration = best.registration.map(|registration| Registration { doubt: 1.0, ..registration });
        let one = |(k, point)| Start { number: first + k, point, registration, ..best.clone() };
        let starts: Vec<Start> = points.into_iter().enumerate().map(one).collect();
        let found = self.stage(Stage::Refine, &self.prepared.fine, FINE.samples, &starts, variants)?;
        watch.lap("refine");
        Ok(found.into_iter().filter(|s| s.objective.is_finite()).collect())
    }

    /// Pushed starts in the order of their objectives on the samples of `best`, and whether the first one is better than that: each was refined on samples of its own,
    /// and the least of many objectives is that of the luckiest samples.
    fn on_the_same_samples(&self, best: &Start, pushed: Vec<Start>, variants: &[Variant]) -> Result<(Vec<Start>, bool)> {
        if pushed.is_empty() {
            return Ok((pushed, false));
        }
        let control = self.shared.control;
        let compared = self.model(&self.prepared.fine, FINE.samples, best, variants).and_then(|model| {
            let own = model.objective(&best.point, control)?;
            Ok((own, in_parallel(&pushed, |_, start| model.objective(&start.point, control))?))
        });
        let (own, objectives) = match compared {
            Ok(compared) => compared,
            // Whoever stops the search wants what it has found.
            Err(Error::Interrupted) => return Ok((pushed, false)),
            Err(error) => return Err(error),
        };
        self.shared.count(1 + pushed.len());
        let mut order: Vec<(f64, Start)> = objectives.into_iter().zip(pushed).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.number.cmp(&b.1.number)));
        let leads = order[0].0 < own;
        Ok((order.into_iter().map(|(_, start)| start).collect(), leads))
    }

    /// The best start with more samples, and the interreflections of where it stands now.
    fn polished(&self, mut best: Start, variants: &[Variant], watch: &mut Stopwatch<'_>) -> Result<Start> {
        if self.prepared.spec.bounces > 0 {
            best = self.interreflecting(best, 1, variants)?;
            watch.lap("interreflections");
        }
        let begin = self.registered(vec![best.clone()], POLISH_SAMPLES, variants)?;
        let polished = self.stage(Stage::Polish, &self.prepared.fine, POLISH_SAMPLES, &begin, variants)?.swap_remove(0);
        watch.lap("polish");
        Ok(if polished.objective.is_finite() { polished } else { Start { evaluations: polished.evaluations, ..best } })
    }

    /// The starts with the heights at which the close-up's periods are registered with the model's.
    fn registered(&self, starts: Vec<Start>, samples: u32, variants: &[Variant]) -> Result<Vec<Start>> {
        let one = |start: &Start| {
            let settled = self.model(&self.prepared.fine, samples, start, variants).and_then(|mut model| {
                let evaluations = model.settle_height(&start.point, self.shared.control)?;
                self.shared.count(evaluations);
                Ok((model.registration(), start.evaluations + evaluations))
            });
            match settled {
                Ok((registration, evaluations)) => Ok(Start { registration, evaluations, ..start.clone() }),
                // Whoever stops the search wants what it has found.
                Err(Error::Interrupted) => Ok(start.clone()),
                Err(error) => Err(error),
            }
        };
        in_parallel(&starts, |_, start| one(start))
    }

    /// A start with the interreflections that it has where it stands. These depend on the colours, and the colours on them: `rounds` of both
    /// in turns.
    pub(super) fn interreflecting(&self, mut start: Start, rounds: usize, variants: &[Variant]) -> Result<Start> {
        for _ in 0..rounds {
            match self.interreflection(&start, variants) {
                Ok(Some(found)) => start.interreflection = Some(Arc::new(found)),
                // Whoever stops the search wants what it has found.
                Ok(None) | Err(Error::Interrupted) => break,
                Err(error) => return Err(error),
            }
        }
        Ok(start)
    }

    /// The interreflections at a start, with the colours that go with what is known of it; `None` where its numbers make no surface.
    fn interreflection(&self, start: &Start, variants: &[Variant]) -> Result<Option<Interreflection>> {
        let (prepared, control) = (self.prepared, self.shared.control);
        let model = self.model(&prepared.fine, COARSE.samples, start, variants)?;
        let Some(evaluated) = model.evaluate(&start.point, control)? else { return Ok(None) };
        let options = PathOptions { bounces: prepared.spec.bounces, seed: self.options.seed };
        interreflection_at(prepared, &model, (&start.point, &evaluated), options, control).map(Some)
    }
}

/// The interreflections at a point of a model, traced anew.
///
/// # Errors
/// Those of the filter.
pub(super) fn interreflection_at(
    prepared: &Prepared<'_>,
    model: &Model<'_>,
    (point, evaluated): (&[f64], &Evaluated),
    options: PathOptions,
    control: &Control<'_>,
) -> Result<Interreflection> {
    let state = model.state(point);
    let values = material_values(prepared.spec, &found(prepared.spec, model.input.variant, &state, &model.unknowns, &evaluated.linear))?;
    let small = values.material()?.build()?;
    let round = model.rounded(&values)?;
    let near =
        prepared.close_up.as_ref().map(|close_up| NearScene { close_up, light: state.near_light, small: round.as_ref().unwrap_or(&small) });
    trace_interreflection(&small, &prepared.fine, &state.lights, near, options, control)
}

/// The starts that are refined, the best one first, and the rest: of starts that ended in the same minimum the best one. The coarse model tells the sides of threads badly: the best start of each number of them
/// comes before all others.
fn choose(starts: Vec<Start>, variants: &[Variant], most: usize) -> (Vec<Start>, Vec<Start>) {
    let mut chosen: Vec<Start> = Vec::new();
    let sides = |start: &Start| variants[start.choice].sides;
    for one_each in [true, false] {
        for start in &starts {
            let is_near = |other: &Start| other.choice == start.choice && distance(&other.point, &start.point) < SAME_MINIMUM;
            let is_first = !chosen.iter().any(|other| sides(other) == sides(start));
            if chosen.len() < most && (is_first || !one_each) && !chosen.iter().any(is_near) {
                chosen.push(start.clone());
            }
        }
    }
    let is_chosen = |start: &Start| chosen.iter().any(|c| c.number == start.number);
    let rest = starts.into_iter().filter(|s| !is_chosen(s)).collect();
    (chosen, rest)
}

/// Whether the close-up was believed less while a start was refined, since it was explained badly.
pub(super) fn is_doubted(start: &Start) -> bool {
    start.registration.is_some_and(|registration| registration.doubt > 1.0)
}

/// Largest distance in a coordinate.
pub(super) fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub(super) fn model_of<'m>(
    prepared: &'m Prepared<'_>,
    options: &Options,
    bins: &'m [DirectionBins],
    samples: u32,
    start: &'m Start,
    variant: &'m Variant,
    control: &Control<'_>,
) -> Result<Model<'m>> {
    let spec = prepared.spec;
    let [_, seed] = halves(biscale::numerics::random::hash_64(options.seed ^ (start.number as u64) << 32));
    let input = ModelInput {
        spec,
        photographs: bins,
        close_up: prepared.close_up.as_ref(),
        variant,
        interreflection: start.interreflection.as_deref(),
        opaque: prepared.opaque,
    };
    let at = |values: &[f64]| Model::new(input, Sampling { samples, seed }, values, control);
    let own: Vec<f64> = spec.parameters.iter().map(|p| p.start).collect();
    let mut model = at(&own)?;
    if options.joint {
        model.move_colours();
    }
    if !start.point.is_empty() {
        // Samples are drawn where the search begins, or on the start material if there is no surface.
        match at(&model.state(&start.point).values) {
            Ok(mut moved) => {
                if options.joint {
                    moved.move_colours();
                }
                model = moved;
            }
            Err(Error::BadInput(_)) => {}
            Err(error) => return Err(error),
        }
    }
    if let Some(registration) = start.registration {
        model.register(registration);
    }
    Ok(model)
}
