//! From a lattice to a cloth: which directions are threads, how many there are, and the draft that explains the folded repeat.

use super::fold::Fold;
use super::gaps::{self, Gaps};
use super::grid::Grid;
use super::hole::{self, Hole};
use super::labels::{self, Guess};
use super::orientation::Edges;
use super::scale::Scale;
use biscale::geometry::weave::draft::Draft;

/// A cloth that explains a photograph.
pub(super) struct Cloth {
    /// Its threads.
    pub grid: Grid,
    /// One repeat of the photograph.
    pub fold: Fold,
    /// What dark holes tell of its threads, where they are seen.
    pub gaps: Option<Gaps>,
    /// The same of a hole that is small or coloured, where there are no dark ones.
    pub hole: Option<Hole>,
    /// Drafts that explain it, best first.
    pub guesses: Vec<Guess>,
}

impl Cloth {
    /// Width of the warp's (0) or the weft's (1) threads as a share of their pitch, with its standard error: by holes where they are seen, else by the shape
    /// that explains the shading best.
    ///
    /// The errors are what cloths of the tests were off by: of holes, which have round sides only in the mean, `HOLE_ERROR` and half of the blur; of shading at
    /// least `SHADING_ERROR`; of small or coloured holes `SMALL_HOLE_ERROR`.
    pub fn fill(&self, k: usize) -> (f64, f64) {
        /// Shares of a width.
        const HOLE_ERROR: f64 = 0.02;
        const SMALL_HOLE_ERROR: f64 = 0.045;
        const SHADING_ERROR: f64 = 0.08;
        let best = &self.guesses[0];
        match (&self.gaps, &self.hole) {
            (Some(gaps), _) => (gaps.fill[k], (HOLE_ERROR * gaps.fill[k]).hypot(0.5 * gaps.blur[k])),
            (None, Some(hole)) => (hole.fill[k], SMALL_HOLE_ERROR * hole.fill[k]),
            (None, None) => (best.shape.fill[k], best.fill_error[k].max(SHADING_ERROR * best.shape.fill[k])),
        }
    }
}

/// Ways to count threads that are looked at.
const HYPOTHESES: usize = 5;
/// A way that explains so much that no other could do clearly better.
const ENOUGH: f64 = 0.06;
/// A way to count threads costs at most this much more than the cheapest.
const MAX_COST: f64 = 6.0;
/// Largest turn of the threads from the picture's axes, in radians.
pub(super) const MAX_TURN: f64 = 0.53;
/// Bins of a crossing when drafts are searched.
const COARSE: usize = 8;
/// Bins of a crossing when holes are measured.
const HOLES: usize = 32;
/// Share of its sides over which a pixel is spread when the shape of a hole is fitted: more would blur what is a pixel wide.
const HOLE_SPREAD: f64 = 0.5;
/// Bins of a crossing when shapes are fitted.
const FINE: (usize, usize) = (8, 14);
/// Twice as many threads must explain at least this much more.
const FINER_GAIN: f64 = 0.6;
/// Those that explain at least this much more are compared by their best shapes, with the blur of the lens.
const CLOSE: f64 = 0.95;
/// The same, for repeats of up to so many crossings: it takes time.
const CLOSE_CROSSINGS: usize = 16;
/// Threads twice as fine are looked at where the power at their frequency is at least this share of that at half of it.
const FINER_POWER: f64 = 0.25;
/// A plain cloth whose crossings look so much alike that the spectrum shows no difference must be explained up to this share.
const ALIKE: f64 = 0.2;
/// Cloth whose crossings differ by more than this many threads is not looked at.
const MAX_CROSSINGS: usize = 64;

/// The cloth that explains a cut best.
pub(super) fn find(scale: &Scale, edges: &Edges, given: Option<&Draft>) -> Option<Cloth> {
    let turn = edges.turn(MAX_TURN);
    let grids = Grid::candidates(&scale.lattice, turn, MAX_TURN);
    let cheapest = grids.first()?.0;
    let mut best: Option<Cloth> = None;
    for (_, grid) in grids.into_iter().filter(|g| g.0 <= cheapest + MAX_COST).take(HYPOTHESES) {
        let mut own: Option<Cloth> = None;
        for (mx, my) in multiples(scale, &grid) {
            let Some(grid) = grid.finer(&scale.lattice, mx, my) else { continue };
            let grid = if grid.repeat.crossings() == 1 { grid.as_plain() } else { grid };
            let crossings = grid.repeat.crossings();
            if !(2..=MAX_CROSSINGS).contains(&crossings) || grid.pitch().min_element() < 2.0 {
                continue;
            }
            let cloth = explain(scale, grid, given);
            // What hardly differs from crossing to crossing may be no cloth at all.
            if grid.whole_is_one_crossing() && cost(&cloth) > ALIKE {
                continue;
            }
            if !cloth.guesses.is_empty() && own.as_ref().is_none_or(|old| finer_is_better(old, &cloth)) {
                own = Some(cloth);
            }
        }
        let Some(own) = own else { continue };
        // An unlikelier way to count must explain clearly more.
        if best.as_ref().is_none_or(|b| cost(&own) < FINER_GAIN * cost(b)) {
            best = Some(own);
        }
        if best.as_ref().is_some_and(|b| cost(b) < ENOUGH) {
            break;
        }
    }
    if let Some(cloth) = &mut best {
        let pitch = cloth.grid.pitch();
        let pitch = [pitch.x, pitch.y];
        labels::sharpen_all(&cloth.fold, &mut cloth.guesses, pitch, cloth.gaps.as_ref());
        if cloth.gaps.is_none() {
            let fold = Fold::of(&scale.field, &cloth.grid, hole::BINS, hole::BINS, |_, _| [0.0; 2]).spread(pitch, HOLE_SPREAD);
            cloth.hole = hole::find(&fold, pitch);
        }
    }
    best
}

fn cost(cloth: &Cloth) -> f64 {
    cloth.guesses.first().map_or(f64::INFINITY, |g| g.cost(cloth.grid.repeat))
}

/// Whether more threads explain a photograph clearly better than fewer.
fn finer_is_better(coarse: &Cloth, fine: &Cloth) -> bool {
    let gain = cost(fine) / cost(coarse);
    if !(FINER_GAIN..CLOSE).contains(&gain) || fine.grid.repeat.crossings() > CLOSE_CROSSINGS {
        return gain < FINER_GAIN;
    }
    // Pairs of threads that lie alike look like one, until their shape is fitted.
    let sharp = |cloth: &Cloth| {
        let (pitch, mut first) = (cloth.grid.pitch(), vec![cloth.guesses[0].clone()]);
        labels::sharpen_all(&cloth.fold, &mut first, [pitch.x, pitch.y], cloth.gaps.as_ref());
        first[0].cost(cloth.grid.repeat)
    };
    sharp(fine) < FINER_GAIN * sharp(coarse)
}

/// By how many threads those of a grid may have to be replaced, fewest first: groups of threads that lie alike repeat more coarsely than
/// their threads, but the threads' own frequency is strong.
fn multiples(scale: &Scale, grid: &Grid) -> Vec<(i64, i64)> {
    let along = |f: glam::DVec2| -> Vec<i64> {
        let power = |k: i64| scale.spectrum.power_near(f * k as f64);
        let limit = |k: i64| f.length() * k as f64 <= 0.45;
        let strongest = (1..=4).filter(|&k| limit(k)).map(power).fold(0.0, f64::max);
        (1..=4).filter(|&k| k == 1 || (limit(k) && power(k) >= FINER_POWER * strongest)).collect()
    };
    let (across, upward) = (along(grid.u), along(grid.v));
    let mut pairs: Vec<(i64, i64)> = across.iter().flat_map(|&mx| upward.iter().map(move |&my| (mx, my))).collect();
    pairs.sort_by_key(|(mx, my)| (mx * my, *mx));
    pairs
}

/// Folds a cut by a grid and looks for the draft.
fn explain(scale: &Scale, grid: Grid, given: Option<&Draft>) -> Cloth {
    let pitch = grid.pitch();
    let bins = |p: f64| (p.round() as usize).clamp(FINE.0, FINE.1);
    let none = |_: usize, _: usize| [0.0; 2];
    let fine = Fold::of(&scale.field, &grid, bins(pitch.x), bins(pitch.y), none);
    let coarse = Fold::of(&scale.field, &grid, COARSE, COARSE, none);
    let gaps = gaps::find(&Fold::of(&scale.field, &grid, HOLES, HOLES, none).spread([pitch.x, pitch.y], 1.0));
    let guesses = labels::search(&coarse, &fine, [pitch.x, pitch.y], gaps.as_ref(), given);
    Cloth { grid, fold: fine, gaps, hole: None, guesses }
}
