//! The shape of a cloth whose draft is known: where its threads lie, how wide, high and bent they are, and how blurred the photograph is.

use super::draft_fit::{DraftFit, USUAL_FILL, shape_penalty};
use super::fold::Fold;
use super::gaps::Gaps;
use super::model::ClothShape;
use super::simplex::simplex;

/// Pattern search over the shape without blur. Chosen on drawn cloths (see [`super`]).
struct RefineParams {
    /// First step: of middles and widths in threads; of flatness and bend half of their relative change.
    first_step: f64,
    /// Rounds over all parameters; the step is halved after a round without gain, so the usual search ends long before.
    most_rounds: usize,
    /// Relative gain that a step must bring.
    least_gain: f64,
    /// Range of the widths over the pitch.
    fill: [f64; 2],
    /// Range of the height over the width.
    flatness: [f64; 2],
    /// Range of the bend.
    bend: [f64; 2],
}

const REFINE: RefineParams =
    RefineParams { first_step: 0.08, most_rounds: 40, least_gain: 1e-4, fill: [0.3, 1.0], flatness: [0.08, 1.2], bend: [0.3, 2.5] };

/// Fits the shape: each parameter in turn by smaller and smaller steps, down to `finest`; of threads that are `placed` flatness and bend only.
pub(super) fn refine(fold: &Fold, mut best: DraftFit, finest: f64, placed: bool) -> DraftFit {
    best.fit = best.shape.fit(fold, &best.labels);
    let mut step = REFINE.first_step;
    let mut rounds = 0;
    while step > finest && rounds < REFINE.most_rounds {
        rounds += 1;
        let mut moved = false;
        for parameter in if placed { 4..6 } else { 0..6 } {
            for sign in [1.0, -1.0] {
                let shape = stepped(best.shape, parameter, sign * step);
                let fit = shape.fit(fold, &best.labels);
                let bound = best.fit.residual * shape_penalty(&best.shape) * (1.0 - REFINE.least_gain);
                if fit.residual * shape_penalty(&shape) < bound {
                    (best.shape, best.fit, moved) = (shape, fit, true);
                    break;
                }
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    best
}

/// A shape with one parameter changed: middles (0, 1), widths (2, 3), flatness (4), bend (5).
fn stepped(mut shape: ClothShape, parameter: usize, change: f64) -> ClothShape {
    match parameter {
        0 | 1 => shape.middle[parameter] += change,
        2 | 3 => shape.fill[parameter - 2] = within(shape.fill[parameter - 2] + change, REFINE.fill),
        4 => shape.flatness = within(shape.flatness * (1.0 + 2.0 * change), REFINE.flatness),
        _ => shape.bend = within(shape.bend * (1.0 + 2.0 * change), REFINE.bend),
    }
    shape
}

fn within(value: f64, [low, high]: [f64; 2]) -> f64 {
    value.clamp(low, high)
}

/// Fit of shape and blur together. Parameters are unbounded, each about 1 for a sensible change. Chosen on drawn cloths (see [`super`]).
struct SharpenParams {
    /// Usual widths over the pitch, where no hole tells them.
    fill: f64,
    /// Change of a width by one unit, in threads: where no hole is seen, and where one is. What holes tell is hardly moved.
    fill_unit: [f64; 2],
    /// Change of a middle by one unit, in threads: where no hole is seen, and where one is.
    middle_unit: [f64; 2],
    /// Range of the widths.
    fill_range: [f64; 2],
    /// Usual flatness, and the logarithm that one unit is.
    flatness: [f64; 2],
    /// Range of the flatness.
    flatness_range: [f64; 2],
    /// Usual bend, and the logarithm that one unit is.
    bend: [f64; 2],
    /// Range of the bend.
    bend_range: [f64; 2],
    /// Usual standard deviation of the blur in pixels, and the logarithm that one unit is.
    blur: [f64; 2],
    /// Range of the blur, in pixels: a pixel alone has 0.29 along each axis.
    blur_range: [f64; 2],
    /// Share by which one unit off the usual middle, width or blur makes a fit worse: it keeps those that the photograph does not show.
    pull: f64,
    /// Widths from which the search may begin, in units; widths have several minima.
    starts: [f64; 3],
    /// Bends from which it may begin, in units.
    bend_starts: [f64; 2],
    /// First and last step of the search along the parameters, in units.
    steps: [f64; 2],
    /// Rounds of it.
    rounds: usize,
    /// Relative gain that a step must bring.
    least_gain: f64,
    /// First size of the simplex that follows, in units.
    simplex: f64,
    /// Shapes that the simplex looks at, about.
    evaluations: usize,
    /// A residual this many times as large is clearly worse: what the standard error of a width is told by.
    clearly: f64,
    /// Changes of a width that are tried for its standard error, in threads.
    changes: [f64; 5],
    /// Standard error where none of them is clearly worse, in threads.
    unknown: f64,
    /// Range of the widths in that trial.
    trial_range: [f64; 2],
}

const SHARPEN: SharpenParams = SharpenParams {
    fill: USUAL_FILL,
    fill_unit: [0.06, 0.004],
    middle_unit: [0.05, 0.01],
    fill_range: [0.3, 1.0],
    flatness: [0.4, 0.4],
    flatness_range: [0.1, 1.0],
    bend: [1.1, 0.3],
    bend_range: [0.4, 2.5],
    blur: [0.8, 0.3],
    blur_range: [0.3, 3.0],
    pull: 0.005,
    starts: [-3.5, -1.5, 0.5],
    bend_starts: [0.0, -2.0],
    steps: [1.0, 0.1],
    rounds: 12,
    least_gain: 1e-4,
    simplex: 0.4,
    evaluations: 120,
    clearly: 1.15,
    changes: [0.01, 0.02, 0.04, 0.08, 0.16],
    unknown: 0.3,
    trial_range: [0.2, 1.1],
};

/// Unknowns of the fit with blur, in units of [`SharpenParams`]: middles, widths, flatness, bend, blur.
type Unknowns = [f64; UNKNOWNS];
/// How many they are.
const UNKNOWNS: usize = 7;
/// Those that are pulled to their usual values; flatness and bend have [`shape_penalty`].
const PULLED: [usize; 5] = [0, 1, 2, 3, 6];

/// What the fit with blur compares.
struct Blurred<'a> {
    fold: &'a Fold,
    labels: &'a [bool],
    start: ClothShape,
    pitch: [f64; 2],
    usual_fill: [f64; 2],
    fill_unit: f64,
    middle_unit: f64,
}

impl Blurred<'_> {
    /// The shape, and the standard deviation of the blur in threads.
    fn shape_of(&self, p: &Unknowns) -> (ClothShape, [f64; 2]) {
        let mut shape = self.start;
        (0..2).for_each(|k| shape.middle[k] = self.start.middle[k] + self.middle_unit * p[k]);
        (0..2).for_each(|k| shape.fill[k] = within(self.usual_fill[k] + self.fill_unit * p[2 + k], SHARPEN.fill_range));
        let scaled = |[usual, unit]: [f64; 2], p: f64| usual * (unit * p).exp();
        shape.flatness = within(scaled(SHARPEN.flatness, p[4]), SHARPEN.flatness_range);
        shape.bend = within(scaled(SHARPEN.bend, p[5]), SHARPEN.bend_range);
        let sigma = within(scaled(SHARPEN.blur, p[6]), SHARPEN.blur_range);
        (shape, self.pitch.map(|pitch| sigma / pitch))
    }

    /// What is minimised.
    fn rate(&self, p: &Unknowns) -> f64 {
        let (shape, blur) = self.shape_of(p);
        let pull: f64 = PULLED.map(|k| p[k] * p[k]).iter().sum();
        shape.fit_blurred(self.fold, self.labels, blur) * (1.0 + SHARPEN.pull * pull) * shape_penalty(&shape)
    }

    /// The best of a grid of widths and bends, rated without blur.
    fn best_start(&self) -> Unknowns {
        let (mut best, mut value) = ([0.0; UNKNOWNS], f64::INFINITY);
        for bend in SHARPEN.bend_starts {
            for weft in SHARPEN.starts {
                for warp in SHARPEN.starts {
                    let p = [0.0, 0.0, warp, weft, 0.0, bend, 0.0];
                    let shape = self.shape_of(&p).0;
                    let now = shape.fit(self.fold, self.labels).residual * shape_penalty(&shape);
                    if now < value {
                        (best, value) = (p, now);
                    }
                }
            }
        }
        best
    }

    /// Searches along one parameter after the other, by steps that are halved.
    fn descend(&self, mut best: Unknowns) -> Unknowns {
        let mut value = self.rate(&best);
        let mut step = SHARPEN.steps[0];
        let mut rounds = 0;
        while step > SHARPEN.steps[1] && rounds < SHARPEN.rounds {
            rounds += 1;
            let mut moved = false;
            for parameter in 0..best.len() {
                for sign in [1.0, -1.0] {
                    let mut next = best;
                    next[parameter] += sign * step;
                    let now = self.rate(&next);
                    if now < value * (1.0 - SHARPEN.least_gain) {
                        (best, value, moved) = (next, now, true);
                        break;
                    }
                }
            }
            if !moved {
                step *= 0.5;
            }
        }
        best
    }
}

/// Fits the shape of a draft together with the blur of the lens, and estimates how sure its widths are. `pitch` in pixels.
///
/// A search along the parameters, then a simplex search over all of them from its result.
pub(super) fn sharpen(fold: &Fold, best: &mut DraftFit, pitch: [f64; 2], gaps: Option<&Gaps>) {
    let seen = usize::from(gaps.is_some());
    let search = Blurred {
        fold,
        labels: &best.labels,
        start: best.shape,
        pitch,
        usual_fill: gaps.map_or([SHARPEN.fill; 2], |g| g.fill),
        fill_unit: SHARPEN.fill_unit[seen],
        middle_unit: SHARPEN.middle_unit[seen],
    };
    let start = if gaps.is_none() { search.best_start() } else { [0.0; UNKNOWNS] };
    let unknowns = simplex(&|p| search.rate(p), search.descend(start), [SHARPEN.simplex; UNKNOWNS], SHARPEN.evaluations);
    let (shape, blur) = search.shape_of(&unknowns);
    best.fit.residual = shape.fit_blurred(fold, &best.labels, blur);
    best.fit.shares = shape.fit(fold, &best.labels).shares;
    best.fill_error = [0, 1].map(|k| width_error(fold, &best.labels, &shape, blur, k));
    best.shape = shape;
}

/// Standard error of a width, as a share of the pitch: the least change of it by which the fit is clearly worse either way.
fn width_error(fold: &Fold, labels: &[bool], shape: &ClothShape, blur: [f64; 2], k: usize) -> f64 {
    let residual = shape.fit_blurred(fold, labels, blur);
    let worse = |change: f64| {
        let mut other = *shape;
        other.fill[k] = within(shape.fill[k] + change, SHARPEN.trial_range);
        other.fit_blurred(fold, labels, blur) > SHARPEN.clearly * residual
    };
    SHARPEN.changes.into_iter().find(|&d| worse(d) && worse(-d)).unwrap_or(SHARPEN.unknown)
}
