//! From a lattice to a cloth: which directions are threads, how many there are, and the draft that explains the folded repeat.

use super::draft_fit::DraftFit;
use super::drafts;
use super::fold::Fold;
use super::gaps::{self, Gaps};
use super::grid::Grid;
use super::hole::{self, Hole};
use super::orientation::Edges;
use super::scale::Scale;
use biscale::geometry::weave::Draft;

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
    pub fits: Vec<DraftFit>,
}

impl Cloth {
    /// Width of the warp's (0) or the weft's (1) threads as a share of their pitch, with its standard error: by holes where they are seen, else by the shape
    /// that explains the shading best.
    ///
    /// Errors of holes have the blur of their sides in them, of which half is taken.
    pub fn fill(&self, k: usize) -> (f64, f64) {
        let best = &self.fits[0];
        match (&self.gaps, &self.hole) {
            (Some(gaps), _) => (gaps.fill[k], (PARAMS.dark_hole_error * gaps.fill[k]).hypot(0.5 * gaps.blur[k])),
            (None, Some(hole)) => (hole.fill[k], PARAMS.small_hole_error * hole.fill[k]),
            (None, None) => (best.shape.fill[k], best.fill_error[k].max(PARAMS.shading_error * best.shape.fill[k])),
        }
    }
}

/// How a cloth is looked for. Errors are measured, all other values chosen on drawn cloths (see [`super`]).
struct ClothParams {
    /// Relative error of a width by dark holes: what drawn cloths of seeds 7 and 8 were off by.
    dark_hole_error: f64,
    /// Relative error of a width by small or coloured holes: the same.
    small_hole_error: f64,
    /// Least relative error of a width by shading: the same.
    shading_error: f64,
    /// Ways to count threads that are looked at.
    hypotheses: usize,
    /// Cost up to which no other way to count threads could do clearly better.
    enough: f64,
    /// Cost of counting threads ([`Grid::candidates`]) over the cheapest one, at most.
    most_extra_cost: f64,
    /// Largest turn of the threads from the picture's axes, in radians (30 degrees).
    most_turn: f64,
    /// Bins of a crossing along each axis when drafts are searched.
    coarse_bins: usize,
    /// Bins of a crossing along each axis when dark holes are measured.
    gap_bins: usize,
    /// Share of its sides over which a pixel is spread when the shape of a hole is fitted: more would blur what is a pixel wide.
    hole_spread: f64,
    /// Least and most bins of a crossing along each axis when shapes are fitted: one a pixel between them.
    fine_bins: (usize, usize),
    /// More threads must reduce the cost to this share.
    finer_gain: f64,
    /// Those that reduce it to between [`Self::finer_gain`] and this share are compared by their best shapes, with the blur of the lens.
    close: f64,
    /// The same, for repeats of up to so many crossings: it takes time.
    close_crossings: usize,
    /// Power at a multiple of the threads' frequency over the strongest of the multiples, from which on that many threads are tried.
    finer_power: f64,
    /// Multiples of the threads' frequency that are tried.
    multiples: i64,
    /// Highest frequency that is tried, in cycles per pixel: a little below the 0.5 that pixels can show.
    highest_frequency: f64,
    /// Cost up to which a plain cloth is believed whose crossings look so much alike that the spectrum shows no difference.
    alike: f64,
    /// Most different crossings of a cloth.
    most_crossings: usize,
    /// Fewest pixels from thread to thread.
    least_pitch: f64,
}

const PARAMS: ClothParams = ClothParams {
    dark_hole_error: 0.02,
    small_hole_error: 0.045,
    shading_error: 0.08,
    hypotheses: 5,
    enough: 0.06,
    most_extra_cost: 6.0,
    most_turn: 0.53,
    coarse_bins: 8,
    gap_bins: 32,
    hole_spread: 0.5,
    fine_bins: (8, 14),
    finer_gain: 0.6,
    close: 0.95,
    close_crossings: 16,
    finer_power: 0.25,
    multiples: 4,
    highest_frequency: 0.45,
    alike: 0.2,
    most_crossings: 64,
    least_pitch: 2.0,
};

/// The cloth that explains a cut best.
pub(super) fn find(scale: &Scale, edges: &Edges, given: Option<&Draft>) -> Option<Cloth> {
    let turn = edges.turn(PARAMS.most_turn);
    let grids = Grid::candidates(&scale.lattice, turn, PARAMS.most_turn);
    let cheapest = grids.first()?.0;
    let mut best: Option<Cloth> = None;
    for (_, grid) in grids.into_iter().filter(|g| g.0 <= cheapest + PARAMS.most_extra_cost).take(PARAMS.hypotheses) {
        let Some(own) = best_multiple(scale, &grid, given) else { continue };
        // An unlikelier way to count must explain clearly more.
        if best.as_ref().is_none_or(|b| cost(&own) < PARAMS.finer_gain * cost(b)) {
            best = Some(own);
        }
        if best.as_ref().is_some_and(|b| cost(b) < PARAMS.enough) {
            break;
        }
    }
    if let Some(cloth) = &mut best {
        let pitch = cloth.grid.pitch();
        let pitch = [pitch.x, pitch.y];
        drafts::sharpen_all(&cloth.fold, &mut cloth.fits, pitch, cloth.gaps.as_ref());
        if cloth.gaps.is_none() {
            let fold = Fold::of(&scale.field, &cloth.grid, hole::BINS, hole::BINS, |_, _| [0.0; 2]).spread(pitch, PARAMS.hole_spread);
            cloth.hole = hole::find(&fold, pitch);
        }
    }
    best
}

/// The cloth of the threads of a grid, or of a multiple of them, that explains a cut best.
fn best_multiple(scale: &Scale, grid: &Grid, given: Option<&Draft>) -> Option<Cloth> {
    let mut best: Option<Cloth> = None;
    for (mx, my) in multiples(scale, grid) {
        let Some(grid) = grid.finer(&scale.lattice, mx, my) else { continue };
        let grid = if grid.repeat.crossings() == 1 { grid.as_plain() } else { grid };
        let crossings = grid.repeat.crossings();
        if !(2..=PARAMS.most_crossings).contains(&crossings) || grid.pitch().min_element() < PARAMS.least_pitch {
            continue;
        }
        let cloth = explain(scale, grid, given);
        // What hardly differs from crossing to crossing may be no cloth at all.
        if grid.whole_is_one_crossing() && cost(&cloth) > PARAMS.alike {
            continue;
        }
        if !cloth.fits.is_empty() && best.as_ref().is_none_or(|old| finer_is_better(old, &cloth)) {
            best = Some(cloth);
        }
    }
    best
}

/// Cost of the best draft of a cloth.
fn cost(cloth: &Cloth) -> f64 {
    cloth.fits.first().map_or(f64::INFINITY, |g| g.cost(cloth.grid.repeat))
}

/// Whether more threads explain a photograph clearly better than fewer.
fn finer_is_better(coarse: &Cloth, fine: &Cloth) -> bool {
    let gain = cost(fine) / cost(coarse);
    if !(PARAMS.finer_gain..PARAMS.close).contains(&gain) || fine.grid.repeat.crossings() > PARAMS.close_crossings {
        return gain < PARAMS.finer_gain;
    }
    // Pairs of threads that lie alike look like one, until their shape is fitted.
    let sharp = |cloth: &Cloth| {
        let (pitch, mut first) = (cloth.grid.pitch(), vec![cloth.fits[0].clone()]);
        drafts::sharpen_all(&cloth.fold, &mut first, [pitch.x, pitch.y], cloth.gaps.as_ref());
        first[0].cost(cloth.grid.repeat)
    };
    sharp(fine) < PARAMS.finer_gain * sharp(coarse)
}

/// Multiples of a grid's warps and wefts that are tried, fewest first: groups of threads that lie alike repeat more coarsely than
/// their threads, but the threads' own frequency is strong.
fn multiples(scale: &Scale, grid: &Grid) -> Vec<(i64, i64)> {
    let along = |f: glam::DVec2| -> Vec<i64> {
        let power = |k: i64| scale.spectrum.power_near(f * k as f64);
        let limit = |k: i64| f.length() * k as f64 <= PARAMS.highest_frequency;
        let strongest = (1..=PARAMS.multiples).filter(|&k| limit(k)).map(power).fold(0.0, f64::max);
        (1..=PARAMS.multiples).filter(|&k| k == 1 || (limit(k) && power(k) >= PARAMS.finer_power * strongest)).collect()
    };
    let (across, upward) = (along(grid.u), along(grid.v));
    let mut pairs: Vec<(i64, i64)> = across.iter().flat_map(|&mx| upward.iter().map(move |&my| (mx, my))).collect();
    pairs.sort_by_key(|(mx, my)| (mx * my, *mx));
    pairs
}

/// Folds a cut by a grid and looks for the draft.
fn explain(scale: &Scale, grid: Grid, given: Option<&Draft>) -> Cloth {
    let pitch = grid.pitch();
    let bins = |p: f64| (p.round() as usize).clamp(PARAMS.fine_bins.0, PARAMS.fine_bins.1);
    let none = |_: usize, _: usize| [0.0; 2];
    let fine = Fold::of(&scale.field, &grid, bins(pitch.x), bins(pitch.y), none);
    let coarse = Fold::of(&scale.field, &grid, PARAMS.coarse_bins, PARAMS.coarse_bins, none);
    let gaps = gaps::find(&Fold::of(&scale.field, &grid, PARAMS.gap_bins, PARAMS.gap_bins, none).spread([pitch.x, pitch.y], 1.0));
    let fits = drafts::search(&coarse, &fine, [pitch.x, pitch.y], gaps.as_ref(), given);
    Cloth { grid, fold: fine, gaps, hole: None, fits }
}
