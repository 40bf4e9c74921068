//! Which thread is on top at each crossing: the drafts that leave the least of a fold unexplained.

use super::draft_fit::{DraftFit, USUAL_FILL, canonical, draft_penalty};
use super::fold::Fold;
use super::gaps::Gaps;
use super::grid::Repeat;
use super::model::{ClothShape, ModelFit, Table};
use super::shape_fit::{refine, sharpen};
use biscale::geometry::weave::Draft;
use rayon::prelude::*;

/// How many drafts are tried, and where their shapes begin. Chosen on drawn cloths (see [`super`]): more of each costs time in proportion, fewer lose drafts
/// that only the fitted shape tells apart.
struct DraftParams {
    /// Crossings of a repeat up to which every draft is tried: 2^8 - 2 drafts.
    exhaustive: usize,
    /// Drafts, best first, of one placement that are kept by their residual at the first shape.
    screened: usize,
    /// The best regular drafts of a large repeat that single changes begin from.
    descended: usize,
    /// Drafts whose shapes are fitted.
    finalists: usize,
    /// Drafts whose shapes are fitted together with the blur.
    sharpened: usize,
    /// Placements of one draft that are kept.
    placements: usize,
    /// Distance of the threads' middles from which on placements differ, in threads.
    apart: f64,
    /// Distance of two guesses of a thread's middle from which on both are tried, in threads.
    middles_apart: f64,
    /// Relative gain below which changing single labels ends.
    least_gain: f64,
    /// Height over width before it is fitted.
    first_flatness: f64,
    /// Bend before it is fitted: threads that touch.
    first_bend: f64,
    /// Step of the parameters at which the fit on the coarse fold ends.
    coarse_step: f64,
}

const PARAMS: DraftParams = DraftParams {
    exhaustive: 8,
    screened: 20,
    descended: 3,
    finalists: 5,
    sharpened: 2,
    placements: 2,
    apart: 0.25,
    middles_apart: 0.12,
    least_gain: 1e-6,
    first_flatness: 0.35,
    first_bend: 1.0,
    coarse_step: 0.02,
};

/// Sum of squared changes of brightness below which a crossing leans to neither thread; keeps a division from 0.
const NO_CHANGE: f32 = 1e-9;

/// The drafts that explain a fold best, best first, no two of them the same cloth; `coarse` and `fine` are the same repeat in few and in
/// many bins, `pitch` is in pixels.
///
/// With a `given` draft only its placements in the repeat are compared.
/// Where dark holes are seen, threads lie between them, as wide as the holes leave: the brightest place of a thread is not its middle when light comes
/// from one side.
pub(super) fn search(coarse: &Fold, fine: &Fold, pitch: [f64; 2], gaps: Option<&Gaps>, given: Option<&Draft>) -> Vec<DraftFit> {
    let mut rated: Vec<DraftFit> = Vec::new();
    for middle in gaps.map_or_else(|| middles(fine), |g| vec![g.middle]) {
        let shape = ClothShape {
            middle,
            fill: gaps.map_or([USUAL_FILL; 2], |g| g.fill),
            flatness: PARAMS.first_flatness,
            bend: PARAMS.first_bend,
            aspect: pitch[1] / pitch[0],
        };
        rated.extend(screen(coarse, &shape, given).into_iter().map(|(residual, labels)| DraftFit {
            labels,
            shape,
            fit: ModelFit { residual, shares: [0.0; 3] },
            fill_error: [0.0; 2],
        }));
    }
    best_placements(&mut rated, coarse.repeat, PARAMS.finalists);
    let mut refined: Vec<DraftFit> = rated.into_iter().map(|fit| refine(coarse, fit, PARAMS.coarse_step, gaps.is_some())).collect();
    best_placements(&mut refined, coarse.repeat, PARAMS.sharpened);
    refined
}

/// The drafts that leave least of a fold with threads of this shape, with what they leave: all of a small repeat, regular ones of a large one and what
/// single changes make of them, or the placements of a given draft.
fn screen(coarse: &Fold, shape: &ClothShape, given: Option<&Draft>) -> Vec<(f64, Vec<bool>)> {
    let table = Table::new(shape, coarse);
    let rate = |labels: Vec<bool>| (table.residual(&labels), labels);
    let mut rated: Vec<(f64, Vec<bool>)> = match given {
        Some(draft) => placements(coarse.repeat, draft).into_iter().map(rate).collect(),
        None => candidates(coarse.repeat).into_iter().map(rate).collect(),
    };
    rated.retain(|f| given.is_some() || holds(coarse.repeat, &f.1));
    let mut priced: Vec<(f64, (f64, Vec<bool>))> = rated.into_iter().map(|f| (f.0 * draft_penalty(coarse.repeat, &f.1), f)).collect();
    priced.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut best: Vec<(f64, Vec<bool>)> = priced.into_iter().take(PARAMS.screened).map(|f| f.1).collect();
    if given.is_none() && coarse.repeat.crossings() > PARAMS.exhaustive {
        let mut starts: Vec<(f64, Vec<bool>)> = best.iter().take(PARAMS.descended).cloned().collect();
        starts.extend(self::starts(coarse, shape.middle).into_iter().map(rate));
        best.extend(starts.into_iter().map(|(residual, labels)| descend(&table, labels, residual)));
        best.retain(|f| holds(coarse.repeat, &f.1));
    }
    best
}

/// Fits the shapes of the best drafts with the blur of the lens and sorts them again.
pub(super) fn sharpen_all(fine: &Fold, fits: &mut Vec<DraftFit>, pitch: [f64; 2], gaps: Option<&Gaps>) {
    fits.par_iter_mut().for_each(|fit| sharpen(fine, fit, pitch, gaps));
    best_distinct(fits, fine.repeat, PARAMS.sharpened);
}

/// Sorts by cost and keeps the first of each cloth.
fn best_distinct(fits: &mut Vec<DraftFit>, repeat: Repeat, most: usize) {
    fits.sort_by(|a, b| a.cost(repeat).total_cmp(&b.cost(repeat)));
    let mut seen: Vec<Vec<bool>> = Vec::new();
    let mut kept = Vec::new();
    for fit in fits.drain(..) {
        let cloth = canonical(repeat, &fit.labels);
        if !seen.contains(&cloth) {
            seen.push(cloth);
            kept.push(fit);
            if kept.len() == most {
                break;
            }
        }
    }
    *fits = kept;
}

/// Sorts by cost and keeps the best placements of the best `most` cloths: one cloth may lie a thread or half a thread off, which only its
/// shape tells.
fn best_placements(fits: &mut Vec<DraftFit>, repeat: Repeat, most: usize) {
    fits.sort_by(|a, b| a.cost(repeat).total_cmp(&b.cost(repeat)));
    let mut kept: Vec<(Vec<bool>, DraftFit)> = Vec::new();
    let mut cloths = 0;
    for fit in fits.drain(..) {
        let cloth = canonical(repeat, &fit.labels);
        let own: Vec<&DraftFit> = kept.iter().filter(|k| k.0 == cloth).map(|k| &k.1).collect();
        let near = |other: &&DraftFit| {
            let apart = |k: usize| ((other.shape.middle[k] - fit.shape.middle[k] + 0.5).rem_euclid(1.0) - 0.5).abs();
            other.labels == fit.labels && apart(0) < PARAMS.apart && apart(1) < PARAMS.apart
        };
        if own.len() >= PARAMS.placements || own.iter().any(near) || (own.is_empty() && cloths == most) {
            continue;
        }
        cloths += usize::from(own.is_empty());
        kept.push((cloth, fit));
    }
    *fits = kept.into_iter().map(|k| k.1).collect();
}

/// Whether every thread passes from one side of the cloth to the other, so that it is held.
fn holds(repeat: Repeat, labels: &[bool]) -> bool {
    let tall = repeat.tall();
    let at = |i: i64, j: i64| labels[repeat.place(i, j)];
    // Columns beyond the first `columns` repeat them; rows beyond `rows` are earlier rows moved.
    (0..repeat.columns).all(|i| (1..tall).any(|j| at(i, j) != at(i, 0)))
        && (0..repeat.rows).all(|j| (1..repeat.columns).any(|i| at(i, j) != at(0, j)))
}

/// The labels of a draft at all its placements in a repeat; none if it does not repeat so.
fn placements(repeat: Repeat, draft: &Draft) -> Vec<Vec<bool>> {
    let (columns, rows) = (draft.columns as i64, draft.rows as i64);
    let over = |i: i64, j: i64| draft.over(i.rem_euclid(columns) as usize, j.rem_euclid(rows) as usize);
    let same = |di: i64, dj: i64| (0..rows).all(|j| (0..columns).all(|i| over(i + di, j + dj) == over(i, j)));
    if !same(repeat.columns, 0) || !same(repeat.shift, repeat.rows) {
        return Vec::new();
    }
    let n = repeat.crossings() as i64;
    let labels = |di: i64, dj: i64| (0..n).map(|k| over(k % repeat.columns + di, k / repeat.columns + dj)).collect();
    (0..n).map(|k| labels(k % repeat.columns, k / repeat.columns)).collect()
}

/// All labels of few crossings; of many those whose wefts each have one run of warps over, moved from weft to weft.
fn candidates(repeat: Repeat) -> Vec<Vec<bool>> {
    let n = repeat.crossings();
    if n <= PARAMS.exhaustive {
        return (1..(1_u32 << n) - 1).map(|bits| (0..n).map(|k| bits >> k & 1 == 1).collect()).collect();
    }
    if repeat.rows != 1 {
        return Vec::new();
    }
    let n = n as i64;
    (0..n).flat_map(|first| (1..n).map(move |over| (0..n).map(|i| (i - first).rem_euclid(n) < over).collect())).collect()
}

/// First labels for cloths of many crossings: by the shading, and by colour.
fn starts(fold: &Fold, middle: [f64; 2]) -> Vec<Vec<bool>> {
    let mut starts = starts_by_shading(fold, middle);
    starts.extend(starts_by_colour(fold, middle));
    starts
}

/// The middle of a crossing in bins of the fold.
fn middle_bin(fold: &Fold, middle: [f64; 2], crossing: i64) -> (i64, i64) {
    let (i, j) = (crossing % fold.repeat.columns, crossing / fold.repeat.columns);
    (((i as f64 + middle[0]) * fold.kx as f64) as i64, ((j as f64 + middle[1]) * fold.ky as f64) as i64)
}

/// Warp over where brightness changes more across than along, with thresholds at the quartiles.
fn starts_by_shading(fold: &Fold, middle: [f64; 2]) -> Vec<Vec<bool>> {
    let n = fold.repeat.crossings();
    let (kx, ky) = (fold.kx as i64, fold.ky as i64);
    let value = |x: i64, y: i64| fold.colour[fold.bin(x, y)].iter().sum::<f32>();
    let lean: Vec<f32> = (0..n as i64)
        .map(|crossing| {
            let (x0, y0) = middle_bin(fold, middle, crossing);
            let (mut across, mut along) = (0.0, 0.0);
            for y in y0 - ky / 3..=y0 + ky / 3 {
                for x in x0 - kx / 3..=x0 + kx / 3 {
                    across += (value(x + 1, y) - value(x - 1, y)).powi(2);
                    along += (value(x, y + 1) - value(x, y - 1)).powi(2);
                }
            }
            (across - along) / (across + along).max(NO_CHANGE)
        })
        .collect();
    let mut sorted = lean.clone();
    sorted.sort_by(f32::total_cmp);
    [n / 4, n / 2, 3 * n / 4].into_iter().map(|k| sorted[k]).map(|limit| lean.iter().map(|&l| l >= limit).collect()).collect()
}

/// Two groups of crossings by the colour of their middles: parted at the widest gap between the values of each channel, either group the warp.
fn starts_by_colour(fold: &Fold, middle: [f64; 2]) -> Vec<Vec<bool>> {
    let n = fold.repeat.crossings();
    let centre: Vec<[f32; 3]> = (0..n as i64)
        .map(|crossing| {
            let (x, y) = middle_bin(fold, middle, crossing);
            fold.colour[fold.bin(x, y)]
        })
        .collect();
    let mut starts: Vec<Vec<bool>> = Vec::new();
    for c in 0..3 {
        let mut values: Vec<f32> = centre.iter().map(|v| v[c]).collect();
        values.sort_by(f32::total_cmp);
        let gap = (1..n).max_by(|&a, &b| (values[a] - values[a - 1]).total_cmp(&(values[b] - values[b - 1]))).unwrap_or(1);
        let limit = 0.5 * (values[gap] + values[gap - 1]);
        starts.push(centre.iter().map(|v| v[c] > limit).collect());
        starts.push(centre.iter().map(|v| v[c] <= limit).collect());
    }
    starts
}

/// Changes single labels as long as that explains more.
fn descend(table: &Table, mut labels: Vec<bool>, mut residual: f64) -> (f64, Vec<bool>) {
    loop {
        let mut best = (residual * (1.0 - PARAMS.least_gain), None);
        for k in 0..labels.len() {
            labels[k] = !labels[k];
            let changed = table.residual(&labels);
            labels[k] = !labels[k];
            if changed < best.0 {
                best = (changed, Some(k));
            }
        }
        let (now, Some(k)) = best else { return (residual, labels) };
        labels[k] = !labels[k];
        residual = now;
    }
}

/// Where the middle of a warp and of a weft may lie in the mean crossing: brightness is highest there or, for dark threads, lowest, and
/// changes least.
fn middles(fold: &Fold) -> Vec<[f64; 2]> {
    let cell = fold.mean_cell();
    let (kx, ky) = (fold.kx, fold.ky);
    let value = |x: usize, y: usize| cell[y % ky * kx + x % kx];
    let across = phases(kx, ky, &value);
    let along = phases(ky, kx, &|k, l| value(l, k));
    across.iter().flat_map(|&s| along.iter().map(move |&t| [s, t])).collect()
}

/// Phases along the first of two coordinates of `n` and `m` bins at which a thread's middle may lie: the phase of the first harmonic of brightness, its
/// opposite, and the phase where brightness changes least.
fn phases(n: usize, m: usize, at: &dyn Fn(usize, usize) -> [f64; 3]) -> Vec<f64> {
    use std::f64::consts::TAU;
    let (mut bright, mut change) = ([0.0; 2], [0.0; 2]);
    for k in 0..n {
        let (sin, cos) = (TAU * (k as f64 + 0.5) / n as f64).sin_cos();
        let (sin_edge, cos_edge) = (TAU * (k as f64 + 1.0) / n as f64).sin_cos();
        for l in 0..m {
            let (a, b) = (at(k, l), at(k + 1, l));
            let light: f64 = a.iter().sum();
            let step: f64 = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum();
            bright = [bright[0] + light * cos, bright[1] + light * sin];
            change = [change[0] - step * cos_edge, change[1] - step * sin_edge];
        }
    }
    let phase = |v: [f64; 2]| (v[1].atan2(v[0]) / TAU).rem_euclid(1.0);
    let mut distinct: Vec<f64> = Vec::new();
    for p in [phase(bright), (phase(bright) + 0.5).rem_euclid(1.0), phase(change)] {
        if distinct.iter().all(|f| ((p - f + 0.5).rem_euclid(1.0) - 0.5).abs() > PARAMS.middles_apart) {
            distinct.push(p);
        }
    }
    distinct
}
