//! Which thread is on top at each crossing: the draft and the shape that leave the least of a fold unexplained.

use super::class::Class;
use super::fold::Fold;
use super::gaps::Gaps;
use super::grid::Repeat;
use super::model::{ClothShape, ModelFit, Table};
use biscale::geometry::weave::draft::Draft;
use rayon::prelude::*;

/// A draft with the shape that fits it best.
#[derive(Clone, Debug)]
pub(super) struct Guess {
    /// For each different crossing whether the warp lies over.
    pub labels: Vec<bool>,
    /// Shape of the cloth.
    pub shape: ClothShape,
    /// How well both explain the fold.
    pub fit: ModelFit,
    /// Standard errors of the widths, as shares of the pitch.
    pub fill_error: [f64; 2],
}

impl Guess {
    /// What is compared between drafts: the residual, more of a draft that has no name, and of a shape that is hardly woven.
    ///
    /// Of the drafts of a repeat only few are woven; one that is not must explain clearly more than one that is.
    pub fn cost(&self, repeat: Repeat) -> f64 {
        self.fit.residual * unlikely(&self.shape) * price(repeat, &self.labels)
    }
}

/// What a shape's residual is multiplied by: 1 for a likely one.
///
/// Threads that cross touch each other, so the bend follows from the sections: less would let them run through each other, more would leave air between
/// them. Without this a wrong draft explains a photograph by a shape that cannot be.
fn unlikely(shape: &ClothShape) -> f64 {
    let off = |value: f64, usual: f64, spread: f64| ((value / usual).ln() / spread).powi(2);
    1.0 + 0.03 * off(shape.bend, BEND, 0.3) + 0.01 * off(shape.flatness, FLATNESS, 0.5)
}

/// Bend of threads that touch.
const BEND: f64 = 1.05;
/// Height of a thread over its width, in the middle of those that are woven.
const FLATNESS: f64 = 0.4;

/// By how much a draft of no known class must leave less unexplained than one of a known class.
const OTHER_PRICE: f64 = 1.5;

fn price(repeat: Repeat, labels: &[bool]) -> f64 {
    if Class::of(&draft_of(repeat, labels)) == Class::Other { OTHER_PRICE } else { 1.0 }
}

/// Up to so many different crossings every draft is tried.
const EXHAUSTIVE: usize = 8;
/// Drafts whose shapes are fitted.
const FINALISTS: usize = 5;
/// Drafts whose shapes are fitted together with the blur.
const SHARPENED: usize = 2;
/// Rounds over all parameters of a shape.
const MAX_ROUNDS: usize = 40;
/// The same when blur is fitted too, before the simplex.
const BLUR_ROUNDS: usize = 12;
/// Widths before they are fitted.
const FIRST_FILL: f64 = 0.85;

/// The drafts that explain a fold best, best first, no two of them the same cloth; `coarse` and `fine` are the same repeat in few and in
/// many bins.
///
/// With a `given` draft only its places in the repeat are compared.
/// Where dark holes are seen, threads lie between them, as wide as the holes leave: the brightest place of a thread is not its middle when light comes
/// from one side.
pub(super) fn search(coarse: &Fold, fine: &Fold, pitch: [f64; 2], gaps: Option<&Gaps>, given: Option<&Draft>) -> Vec<Guess> {
    let mut rated: Vec<Guess> = Vec::new();
    for middle in gaps.map_or_else(|| middles(fine), |g| vec![g.middle]) {
        let shape =
            ClothShape { middle, fill: gaps.map_or([FIRST_FILL; 2], |g| g.fill), flatness: 0.35, bend: 1.0, aspect: pitch[1] / pitch[0] };
        let table = Table::new(&shape, coarse);
        let rate = |labels: Vec<bool>| (table.residual(&labels), labels);
        let mut found: Vec<(f64, Vec<bool>)> = match given {
            Some(draft) => places(coarse.repeat, draft).into_iter().map(rate).collect(),
            None => candidates(coarse.repeat).into_iter().map(rate).collect(),
        };
        found.retain(|f| given.is_some() || holds(coarse.repeat, &f.1));
        let mut priced: Vec<(f64, (f64, Vec<bool>))> = found.into_iter().map(|f| (f.0 * price(coarse.repeat, &f.1), f)).collect();
        priced.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found: Vec<(f64, Vec<bool>)> = priced.into_iter().take(4 * FINALISTS).map(|f| f.1).collect();
        if given.is_none() && coarse.repeat.crossings() > EXHAUSTIVE {
            // The best of the regular ones and others, and what single changes make of them.
            let mut starts: Vec<(f64, Vec<bool>)> = found.iter().take(3).cloned().collect();
            starts.extend(self::starts(coarse, middle).into_iter().map(rate));
            found.extend(starts.into_iter().map(|(residual, labels)| descend(&table, labels, residual)));
            found.retain(|f| holds(coarse.repeat, &f.1));
        }
        rated.extend(found.into_iter().map(|(residual, labels)| Guess {
            labels,
            shape,
            fit: ModelFit { residual, shares: [0.0; 3] },
            fill_error: [0.0; 2],
        }));
    }
    best_variants(&mut rated, coarse.repeat, FINALISTS);
    let mut refined: Vec<Guess> = rated.into_iter().map(|guess| refine(coarse, guess, 0.02, gaps.is_some())).collect();
    best_variants(&mut refined, coarse.repeat, SHARPENED);
    refined
}

/// Fits the shapes of the best guesses with the blur of the lens and sorts them again.
pub(super) fn sharpen_all(fine: &Fold, guesses: &mut Vec<Guess>, pitch: [f64; 2], gaps: Option<&Gaps>) {
    guesses.par_iter_mut().for_each(|guess| sharpen(fine, guess, pitch, gaps));
    best_distinct(guesses, fine.repeat, SHARPENED);
}

/// Sorts by cost and keeps the first of each cloth.
fn best_distinct(guesses: &mut Vec<Guess>, repeat: Repeat, most: usize) {
    guesses.sort_by(|a, b| a.cost(repeat).total_cmp(&b.cost(repeat)));
    let mut seen: Vec<Vec<bool>> = Vec::new();
    let mut kept = Vec::new();
    for guess in guesses.drain(..) {
        let cloth = canonical(repeat, &guess.labels);
        if !seen.contains(&cloth) {
            seen.push(cloth);
            kept.push(guess);
            if kept.len() == most {
                break;
            }
        }
    }
    *guesses = kept;
}

/// Sorts by cost and keeps the best places of the best `most` cloths: one cloth may lie a thread or half a thread off, which only its
/// shape tells.
fn best_variants(guesses: &mut Vec<Guess>, repeat: Repeat, most: usize) {
    /// Places of one cloth.
    const VARIANTS: usize = 2;
    /// Places of the threads that are told apart, in threads.
    const APART: f64 = 0.25;
    guesses.sort_by(|a, b| a.cost(repeat).total_cmp(&b.cost(repeat)));
    let mut kept: Vec<(Vec<bool>, Guess)> = Vec::new();
    let mut cloths = 0;
    for guess in guesses.drain(..) {
        let cloth = canonical(repeat, &guess.labels);
        let own: Vec<&Guess> = kept.iter().filter(|k| k.0 == cloth).map(|k| &k.1).collect();
        let near = |other: &&Guess| {
            let apart = |k: usize| ((other.shape.middle[k] - guess.shape.middle[k] + 0.5).rem_euclid(1.0) - 0.5).abs();
            other.labels == guess.labels && apart(0) < APART && apart(1) < APART
        };
        if own.len() >= VARIANTS || own.iter().any(near) || (own.is_empty() && cloths == most) {
            continue;
        }
        cloths += usize::from(own.is_empty());
        kept.push((cloth, guess));
    }
    *guesses = kept.into_iter().map(|k| k.1).collect();
}

/// The first of all translations of the labels.
pub(super) fn canonical(repeat: Repeat, labels: &[bool]) -> Vec<bool> {
    let translated = |di: i64, dj: i64| -> Vec<bool> {
        (0..labels.len() as i64).map(|k| labels[repeat.place(k % repeat.columns + di, k / repeat.columns + dj)]).collect()
    };
    (0..labels.len() as i64).map(|k| translated(k % repeat.columns, k / repeat.columns)).min().unwrap_or_default()
}

/// The draft of labels, over the rectangle after which it repeats.
pub(super) fn draft_of(repeat: Repeat, labels: &[bool]) -> Draft {
    let over = |i: usize, j: usize| labels[repeat.place(i as i64, j as i64)];
    let draft = Draft::from_fn(repeat.columns as usize, repeat.tall() as usize, over);
    let (columns, rows) = (draft.column_period(|_, _| true), draft.row_period(|_, _| true));
    draft.cropped(columns, rows)
}

/// Whether every thread changes sides, so that it is held.
fn holds(repeat: Repeat, labels: &[bool]) -> bool {
    let tall = repeat.tall();
    let at = |i: i64, j: i64| labels[repeat.place(i, j)];
    // Columns beyond the first `columns` repeat them; rows beyond `rows` are earlier rows moved.
    (0..repeat.columns).all(|i| (1..tall).any(|j| at(i, j) != at(i, 0)))
        && (0..repeat.rows).all(|j| (1..repeat.columns).any(|i| at(i, j) != at(0, j)))
}

/// The labels of a draft at all its places in a repeat; none if it does not repeat so.
fn places(repeat: Repeat, draft: &Draft) -> Vec<Vec<bool>> {
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
    if n <= EXHAUSTIVE {
        return (1..(1_u32 << n) - 1).map(|bits| (0..n).map(|k| bits >> k & 1 == 1).collect()).collect();
    }
    if repeat.rows != 1 {
        return Vec::new();
    }
    let n = n as i64;
    (0..n).flat_map(|first| (1..n).map(move |over| (0..n).map(|i| (i - first).rem_euclid(n) < over).collect())).collect()
}

/// First labels for cloths of many crossings: warp over where brightness changes more across than along.
fn starts(fold: &Fold, middle: [f64; 2]) -> Vec<Vec<bool>> {
    let n = fold.repeat.crossings();
    let (kx, ky) = (fold.kx as i64, fold.ky as i64);
    let value = |x: i64, y: i64| fold.colour[fold.bin(x, y)].iter().sum::<f32>();
    let lean: Vec<f32> = (0..n as i64)
        .map(|crossing| {
            let (i, j) = (crossing % fold.repeat.columns, crossing / fold.repeat.columns);
            let (x0, y0) = (((i as f64 + middle[0]) * kx as f64) as i64, ((j as f64 + middle[1]) * ky as f64) as i64);
            let (mut across, mut along) = (0.0, 0.0);
            for y in y0 - ky / 3..=y0 + ky / 3 {
                for x in x0 - kx / 3..=x0 + kx / 3 {
                    across += (value(x + 1, y) - value(x - 1, y)).powi(2);
                    along += (value(x, y + 1) - value(x, y - 1)).powi(2);
                }
            }
            (across - along) / (across + along).max(1e-9)
        })
        .collect();
    let mut sorted = lean.clone();
    sorted.sort_by(f32::total_cmp);
    let mut starts: Vec<Vec<bool>> =
        [n / 4, n / 2, 3 * n / 4].into_iter().map(|k| sorted[k]).map(|limit| lean.iter().map(|&l| l >= limit).collect()).collect();
    // By colour: two groups along the direction in which the crossings' middles differ most.
    let centre: Vec<[f32; 3]> = (0..n as i64)
        .map(|crossing| {
            let (i, j) = (crossing % fold.repeat.columns, crossing / fold.repeat.columns);
            fold.colour[fold.bin(((i as f64 + middle[0]) * kx as f64) as i64, ((j as f64 + middle[1]) * ky as f64) as i64)]
        })
        .collect();
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
        let mut best = (residual * (1.0 - 1e-6), None);
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
    let phases = |n: usize, m: usize, at: &dyn Fn(usize, usize) -> [f64; 3]| -> Vec<f64> {
        let (mut bright, mut change) = ([0.0; 2], [0.0; 2]);
        for k in 0..n {
            let (sin, cos) = (std::f64::consts::TAU * (k as f64 + 0.5) / n as f64).sin_cos();
            let (sin_edge, cos_edge) = (std::f64::consts::TAU * (k as f64 + 1.0) / n as f64).sin_cos();
            for l in 0..m {
                let (a, b) = (at(k, l), at(k + 1, l));
                let light: f64 = a.iter().sum();
                let step: f64 = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum();
                bright = [bright[0] + light * cos, bright[1] + light * sin];
                change = [change[0] - step * cos_edge, change[1] - step * sin_edge];
            }
        }
        let phase = |v: [f64; 2]| (v[1].atan2(v[0]) / std::f64::consts::TAU).rem_euclid(1.0);
        let mut found: Vec<f64> = Vec::new();
        for p in [phase(bright), (phase(bright) + 0.5).rem_euclid(1.0), phase(change)] {
            if found.iter().all(|f| ((p - f + 0.5).rem_euclid(1.0) - 0.5).abs() > 0.12) {
                found.push(p);
            }
        }
        found
    };
    let across = phases(kx, ky, &value);
    let along = phases(ky, kx, &|k, l| value(l, k));
    across.iter().flat_map(|&s| along.iter().map(move |&t| [s, t])).collect()
}

/// Fits the shape: each parameter in turn by smaller and smaller steps; of threads that are `placed` their heights only.
fn refine(fold: &Fold, mut guess: Guess, finest: f64, placed: bool) -> Guess {
    guess.fit = guess.shape.fit(fold, &guess.labels);
    let mut step = 0.08;
    let mut rounds = 0;
    while step > finest && rounds < MAX_ROUNDS {
        rounds += 1;
        let mut moved = false;
        for parameter in if placed { 4..6 } else { 0..6 } {
            for sign in [1.0, -1.0] {
                let mut shape = guess.shape;
                let change = sign * step;
                match parameter {
                    0 | 1 => shape.middle[parameter] += change,
                    2 | 3 => shape.fill[parameter - 2] = (shape.fill[parameter - 2] + change).clamp(0.3, 1.0),
                    4 => shape.flatness = (shape.flatness * (1.0 + 2.0 * change)).clamp(0.08, 1.2),
                    _ => shape.bend = (shape.bend * (1.0 + 2.0 * change)).clamp(0.3, 2.5),
                }
                let fit = shape.fit(fold, &guess.labels);
                if fit.residual * unlikely(&shape) < guess.fit.residual * unlikely(&guess.shape) * (1.0 - 1e-4) {
                    guess.shape = shape;
                    guess.fit = fit;
                    moved = true;
                    break;
                }
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    guess
}

/// Fits the shape of a guess together with the blur of the lens, and estimates how sure its widths are.
///
/// A simplex search (Nelder and Mead 1965) over middle, widths, flatness, bend and blur, begun again around its own result.
fn sharpen(fold: &Fold, guess: &mut Guess, pitch: [f64; 2], gaps: Option<&Gaps>) {
    let start = guess.shape;
    // What holes tell is hardly moved.
    let (usual, wide, moved) = gaps.map_or(([FIRST_FILL; 2], 0.06, 0.05), |g| (g.fill, 0.004, 0.01));
    // Unbounded parameters, each about 1 for a sensible change.
    let shape_of = |p: &[f64; 7]| {
        let mut shape = start;
        (0..2).for_each(|k| shape.middle[k] = start.middle[k] + moved * p[k]);
        (0..2).for_each(|k| shape.fill[k] = (usual[k] + wide * p[2 + k]).clamp(0.3, 1.0));
        shape.flatness = (0.4 * (0.4 * p[4]).exp()).clamp(0.1, 1.0);
        shape.bend = (1.1 * (0.3 * p[5]).exp()).clamp(0.4, 2.5);
        (shape, (0.8 * (0.3 * p[6]).exp()).clamp(0.3, 3.0))
    };
    let rate = |p: &[f64; 7]| {
        let (shape, sigma) = shape_of(p);
        // A weak pull to where parameters are likely keeps those that the photograph does not show.
        let pull: f64 = [0, 1, 2, 3, 6].map(|k| p[k] * p[k]).iter().sum();
        shape.fit_blurred(fold, &guess.labels, pitch.map(|p| sigma / p)) * (1.0 + PULL * pull) * unlikely(&shape)
    };
    // Widths have several minima: the search begins at the best of a few.
    let mut best = [0.0; 7];
    let mut value = f64::INFINITY;
    for k in (0..18).filter(|_| gaps.is_none()) {
        let p = [0.0, 0.0, f64::from(k % 3) * 2.0 - 3.5, f64::from(k / 3 % 3) * 2.0 - 3.5, 0.0, f64::from(k / 9) * -2.0, 0.0];
        let shape = shape_of(&p).0;
        let now = shape.fit(fold, &guess.labels).residual * unlikely(&shape);
        if now < value {
            (best, value) = (p, now);
        }
    }
    let mut value = rate(&best);
    let mut step = 1.0;
    let mut rounds = 0;
    while step > 0.1 && rounds < BLUR_ROUNDS {
        rounds += 1;
        let mut moved = false;
        for parameter in 0..7 {
            for sign in [1.0, -1.0] {
                let mut next = best;
                next[parameter] += sign * step;
                let now = rate(&next);
                if now < value * (1.0 - 1e-4) {
                    (best, value, moved) = (next, now, true);
                    break;
                }
            }
        }
        if !moved {
            step *= 0.5;
        }
    }
    best = simplex(&rate, best, [0.4; 7], EVALUATIONS);
    let (shape, sigma) = shape_of(&best);
    guess.fit.residual = shape.fit_blurred(fold, &guess.labels, pitch.map(|p| sigma / p));
    guess.fit.shares = shape.fit(fold, &guess.labels).shares;
    // How far a width can be changed before the fit is clearly worse.
    guess.fill_error = [0, 1].map(|k| {
        let worse = |change: f64| {
            let mut other = shape;
            other.fill[k] = (shape.fill[k] + change).clamp(0.2, 1.1);
            shape_worse(fold, &guess.labels, &other, pitch.map(|p| sigma / p), guess.fit.residual)
        };
        [0.01, 0.02, 0.04, 0.08, 0.16].into_iter().find(|&d| worse(d) && worse(-d)).unwrap_or(0.3)
    });
    guess.shape = shape;
}

/// Whether a shape leaves clearly more than `residual`.
fn shape_worse(fold: &Fold, labels: &[bool], shape: &ClothShape, blur: [f64; 2], residual: f64) -> bool {
    shape.fit_blurred(fold, labels, blur) > CLEARLY * residual
}

/// A fit this many times as bad is clearly worse.
const CLEARLY: f64 = 1.15;

/// Share by which a parameter one step off its likely value makes a fit worse.
const PULL: f64 = 0.005;
/// Most shapes that one simplex looks at.
const EVALUATIONS: usize = 120;

/// The lowest point that a simplex (Nelder and Mead 1965) of given steps from `start` finds; `most` evaluations, about.
pub(super) fn simplex<const N: usize>(f: &impl Fn(&[f64; N]) -> f64, start: [f64; N], steps: [f64; N], most: usize) -> [f64; N] {
    let mut points: Vec<([f64; N], f64)> = vec![(start, f(&start))];
    for k in 0..N {
        let mut p = start;
        p[k] += steps[k];
        points.push((p, f(&p)));
    }
    let mut used = N + 1;
    while used < most {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (lowest, second, highest) = (points[0].1, points[N - 1].1, points[N].1);
        if highest - lowest < 1e-5 * lowest.abs() {
            break;
        }
        let mut middle = [0.0; N];
        for (p, _) in &points[..N] {
            (0..N).for_each(|k| middle[k] += p[k] / N as f64);
        }
        let worst = points[N].0;
        let along = |factor: f64| {
            let mut p = middle;
            (0..N).for_each(|k| p[k] += factor * (worst[k] - middle[k]));
            (p, f(&p))
        };
        let reflected = along(-1.0);
        used += 1;
        if reflected.1 < lowest {
            let expanded = along(-2.0);
            used += 1;
            points[N] = if expanded.1 < reflected.1 { expanded } else { reflected };
        } else if reflected.1 < second {
            points[N] = reflected;
        } else {
            let contracted = along(if reflected.1 < highest { -0.5 } else { 0.5 });
            used += 1;
            if contracted.1 < highest.min(reflected.1) {
                points[N] = contracted;
            } else {
                let best = points[0].0;
                for point in &mut points[1..] {
                    (0..N).for_each(|k| point.0[k] = 0.5 * (point.0[k] + best[k]));
                    point.1 = f(&point.0);
                }
                used += N;
            }
        }
    }
    points.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(start, |p| p.0)
}
