//! The lattice that the peaks of a spectrum lie on, and what it says about the surface: along how many directions it repeats, and how.
//!
//! A surface that repeats by the vectors `a1`, `a2` has power only at frequencies `m b1 + n b2`, where `b1`, `b2` are dual to them.
//! A lattice is judged by how much better it explains the peaks than chance does: a peak within `tolerance` cycles of a point of
//! a lattice with cells of `D` square cycles would be there by chance with probability `pi tolerance^2 / D`. So a lattice that is too
//! fine explains everything and gains little, and one that is too coarse misses peaks.

use super::spectrum::Peak;
use glam::{DMat2, DVec2};

/// How a lattice is sought and judged. Chosen on drawn cloths (see [`super`]) where no derivation is given; "cycles" are cycles over the cut.
struct LatticeParams {
    /// Distance within which a peak belongs to a lattice point, in cycles. The main lobe of a Hann window reaches 2 cycles from its peak; the peak itself is
    /// located to a few hundredths, and 0.8 leaves room for threads that do not lie quite straight.
    tolerance: f64,
    /// The same for a basis that is not yet fitted, over [`Self::tolerance`].
    rough: f64,
    /// Share of the peaks that may be no part of the lattice.
    stray: f64,
    /// Shortest vector of a lattice, in cycles: fewer repeats are no repetition.
    least_cycles: f64,
    /// Smallest cell of a lattice in square cycles: a few times the `pi tolerance^2 = 2` that the tolerance covers, else all peaks lie on it by chance.
    least_cell: f64,
    /// Peaks, strongest first, that a lattice is judged by.
    strong: usize,
    /// Peaks whose sums and differences are candidates for a basis; twice as many are candidates themselves.
    seeds: usize,
    /// Distance below which two candidates are one, in cycles: half of [`Self::tolerance`].
    same: f64,
    /// Pairs of candidates that are fitted.
    finalists: usize,
    /// Logarithm of contrast at which a peak's weight is cut off: a contrast of 3000.
    most_weight: f64,
    /// Points are fitted first within this many shortest vectors of 0, where a wrong basis is off by little, ...
    first_reach: f64,
    /// ... then within so many times as far, until all are in.
    reach_growth: f64,
    /// Fits with all points within reach, after which nothing moves any more.
    settled: usize,
    /// Least standard deviation of a peak's place along an axis, in cycles: what interpolation between frequencies leaves.
    least_deviation: f64,
    /// Most points of a finer lattice to one of the coarser.
    most_parts: u32,
    /// Contrast above which a peak between the others speaks for a finer lattice.
    new_contrast: f64,
    /// The most that one point speaks for a lattice: twice the logarithm of its contrast over [`Self::new_contrast`], up to this.
    most_gain: f64,
    /// What a point without power speaks against it: about half the points of a weave's lattice have none.
    absence: f64,
    /// Order of the basis up to which peaks are looked at when a finer lattice is sought: the first harmonics and what is half a step beyond.
    order: f64,
    /// Half width of a strong peak under a Hann window with its first side lobe, in cycles: the main lobe ends at 2, the first side lobe at 3.
    lobe: f64,
    /// What a finer lattice must reach.
    least_gain: f64,
}

const PARAMS: LatticeParams = LatticeParams {
    tolerance: 0.8,
    rough: 1.5,
    stray: 0.03,
    least_cycles: 3.5,
    least_cell: 9.0,
    strong: 40,
    seeds: 14,
    same: 0.4,
    finalists: 80,
    most_weight: 8.0,
    first_reach: 2.5,
    reach_growth: 1.5,
    settled: 3,
    least_deviation: 0.02,
    most_parts: 24,
    new_contrast: 4.0,
    most_gain: 6.0,
    absence: 0.5,
    order: 1.55,
    lobe: 3.2,
    least_gain: 6.0,
};

/// A lattice of frequencies.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lattice {
    /// One vector if the surface repeats along one direction only, else two, counter-clockwise; cycles per pixel.
    pub basis: Vec<DVec2>,
    /// Covariance of the basis vectors' components (the same for x and y): variance of the first, covariance, variance of the second.
    pub covariance: [f64; 3],
    /// Logarithm of how much better than chance the peaks are explained.
    pub score: f64,
    /// Share of the peaks' weight that lies on the lattice.
    pub explained: f64,
}

impl Lattice {
    /// Standard error of the components of `m b1 + n b2`, cycles per pixel.
    pub fn error_of(&self, m: f64, n: f64) -> f64 {
        let [a, b, c] = self.covariance;
        (m * m * a + 2.0 * m * n * b + n * n * c).max(0.0).sqrt()
    }

    /// The vector `m b1 + n b2`.
    pub fn at(&self, m: f64, n: f64) -> DVec2 {
        self.basis[0] * m + self.basis.get(1).map_or(DVec2::ZERO, |b| *b * n)
    }

    /// The lattice that explains the peaks best, if any does better than chance.
    pub fn of(peaks: &[Peak], bin: DVec2) -> Option<Self> {
        if peaks.is_empty() {
            return None;
        }
        let all: Vec<(DVec2, f64)> = peaks.iter().map(|p| (p.frequency / bin, p.contrast.ln().min(PARAMS.most_weight))).collect();
        let points = &all[..all.len().min(PARAMS.strong)];
        // Half of the plane of frequencies, in square cycles.
        let area = 0.5 / (bin.x * bin.y);
        let mut candidates: Vec<DVec2> = points.iter().take(2 * PARAMS.seeds).map(|p| p.0).collect();
        let seeds: Vec<DVec2> = points.iter().take(PARAMS.seeds).map(|p| p.0).collect();
        for (k, &a) in seeds.iter().enumerate() {
            for &b in &seeds[..k] {
                candidates.extend([a - b, a + b]);
            }
        }
        candidates.retain(|c| c.length() >= PARAMS.least_cycles);
        let mut distinct: Vec<DVec2> = Vec::new();
        for c in candidates {
            if distinct.iter().all(|d| (*d - c).length() > PARAMS.same && (*d + c).length() > PARAMS.same) {
                distinct.push(c);
            }
        }
        let mut rated: Vec<(f64, Vec<DVec2>)> = Vec::new();
        for (k, &a) in distinct.iter().enumerate() {
            rated.push((rate(&[a], points, area, PARAMS.rough * PARAMS.tolerance).0, vec![a]));
            for &b in &distinct[..k] {
                let (a, b) = reduced(a, b);
                if a.length() >= PARAMS.least_cycles && a.perp_dot(b).abs() >= PARAMS.least_cell {
                    rated.push((rate(&[a, b], points, area, PARAMS.rough * PARAMS.tolerance).0, vec![a, b]));
                }
            }
        }
        rated.sort_by(|a, b| b.0.total_cmp(&a.0));
        rated.truncate(PARAMS.finalists);
        let refined = rated.into_iter().filter_map(|(_, basis)| Self::refine(basis, points, area));
        let best = refined.max_by(|a, b| a.score.total_cmp(&b.score)).filter(|l| l.score > 0.0)?;
        Some(best.in_cycles_per_pixel(bin))
    }

    /// The finer lattice that weaker peaks speak for: strong peaks alone are those of the threads, and the weaker ones between them say
    /// after how many threads the cloth repeats.
    ///
    /// Of all lattices that hold this one, with up to `most_parts` times its points, the one is taken whose new points hold the most
    /// and strongest of the peaks that were missed. Points without a peak count against a lattice, so that single peaks between, which an uneven cloth
    /// has, do not make one.
    #[must_use]
    pub fn completed(self, peaks: &[Peak], bin: DVec2) -> Self {
        let [b1, b2] = self.basis[..] else { return self };
        let inverse = DMat2::from_cols(b1, b2).inverse();
        // Coordinates on this lattice and contrast of the peaks that it misses.
        let missed: Vec<(DVec2, f64)> = peaks
            .iter()
            .map(|p| (inverse * p.frequency, p.contrast))
            .filter(|(f, _)| f.abs().max_element() < PARAMS.order && off(f - f.round(), [b1, b2], bin) > PARAMS.lobe)
            .collect();
        let mut best: Option<(f64, [DVec2; 2])> = None;
        for parts in 2..=PARAMS.most_parts {
            for a in (1..=parts).filter(|a| parts % a == 0) {
                let c = parts / a;
                for b in 0..a {
                    // Shifts by (a, 0) and (b, c) repeats of this lattice's surface: their dual.
                    let (a, b, c) = (f64::from(a), f64::from(b), f64::from(c));
                    let fractions = [DVec2::new(1.0 / a, -b / (a * c)), DVec2::new(0.0, 1.0 / c)];
                    let vectors = fractions.map(|f| b1 * f.x + b2 * f.y);
                    let (shortest, _) = reduced(vectors[0] / bin, vectors[1] / bin);
                    if shortest.length() < PARAMS.lobe {
                        continue;
                    }
                    let into = DMat2::from_cols(fractions[0], fractions[1]);
                    let back = into.inverse();
                    let (mut hits, mut gain) = (0.0, 0.0);
                    for &(f, contrast) in &missed {
                        let whole = (back * f).round();
                        if off(into * whole - f, [b1, b2], bin) < PARAMS.tolerance {
                            hits += 1.0;
                            gain += (2.0 * (contrast / PARAMS.new_contrast).ln()).clamp(0.0, PARAMS.most_gain);
                        }
                    }
                    // New points in half of the region that is looked at.
                    let points = f64::from(parts - 1) * 2.0 * PARAMS.order * PARAMS.order;
                    gain -= PARAMS.absence * (points - hits).max(0.0);
                    if gain > best.map_or(PARAMS.least_gain, |b| b.0) {
                        best = Some((gain, vectors));
                    }
                }
            }
        }
        let Some((_, [a, b])) = best else { return self };
        let points: Vec<(DVec2, f64)> = peaks.iter().map(|p| (p.frequency / bin, p.contrast.ln().min(PARAMS.most_weight))).collect();
        let (a, b) = reduced(a / bin, b / bin);
        let area = 0.5 / (bin.x * bin.y);
        // A finer lattice holds all points of the coarser one: if it explains less, its fit has slipped onto peaks that are of no lattice.
        let explained = rate(&[b1 / bin, b2 / bin], &points, area, PARAMS.tolerance).1;
        let finer = Self::refine(vec![a, b], &points, area);
        finer.filter(|l| l.explained >= explained).map_or(self, |l| l.in_cycles_per_pixel(bin))
    }

    /// The lattice in cycles per pixel instead of cycles over the cut, with a counter-clockwise basis.
    fn in_cycles_per_pixel(mut self, bin: DVec2) -> Self {
        if let [a, b] = self.basis[..]
            && a.perp_dot(b) < 0.0
        {
            self.basis[1] = -b;
            self.covariance[1] *= -1.0;
        }
        // One error for both axes of a cut that may be oblong: the coarser.
        let scale = bin.max_element() * bin.max_element();
        Self { basis: self.basis.iter().map(|b| *b * bin).collect(), covariance: self.covariance.map(|v| v * scale), ..self }
    }

    /// Fits a basis to the peaks that it explains, nearest to 0 first; units are cycles over the cut.
    fn refine(mut basis: Vec<DVec2>, points: &[(DVec2, f64)], area: f64) -> Option<Self> {
        let farthest = points.iter().map(|p| p.0.length()).fold(0.0, f64::max);
        let shortest = basis.iter().map(|b| b.length()).fold(f64::INFINITY, f64::min);
        let mut reach = PARAMS.first_reach * shortest;
        let mut covariance = [f64::INFINITY; 3];
        let mut settled = 0;
        while settled < PARAMS.settled {
            reach = (PARAMS.reach_growth * reach).min(farthest + 1.0);
            settled += usize::from(reach > farthest);
            let used: Vec<([f64; 2], DVec2, f64)> = points
                .iter()
                .filter(|p| p.0.length() <= reach)
                .filter_map(|&(point, weight)| {
                    let whole = nearest(&basis, point);
                    let off = (value(&basis, whole) - point).length();
                    (off < PARAMS.tolerance && whole != [0.0, 0.0]).then_some((whole, point, weight))
                })
                .collect();
            let Some((fitted, own)) = least_squares(&used, basis.len()) else {
                if settled > 0 {
                    return None;
                }
                continue;
            };
            (basis, covariance) = (fitted, own);
        }
        let (score, explained) = rate(&basis, points, area, PARAMS.tolerance);
        if let [a, b] = basis[..] {
            let (ra, rb) = reduced(a, b);
            if ra.length() < PARAMS.least_cycles || ra.perp_dot(rb).abs() < PARAMS.least_cell {
                return None;
            }
        }
        Some(Self { basis, covariance, score, explained })
    }
}

/// Distance in cycles over the cut, from coordinates on a basis.
fn off(coordinates: DVec2, [b1, b2]: [DVec2; 2], bin: DVec2) -> f64 {
    ((b1 * coordinates.x + b2 * coordinates.y) / bin).length()
}

/// `m b1 + n b2`.
fn value(basis: &[DVec2], [m, n]: [f64; 2]) -> DVec2 {
    basis[0] * m + basis.get(1).map_or(DVec2::ZERO, |b| *b * n)
}

/// Whole coordinates of the lattice point nearest to `point`, for a reduced basis.
fn nearest(basis: &[DVec2], point: DVec2) -> [f64; 2] {
    match *basis {
        [a, b] => {
            let c = DMat2::from_cols(a, b).inverse() * point;
            [c.x.round(), c.y.round()]
        }
        _ => [(point.dot(basis[0]) / basis[0].length_squared()).round(), 0.0],
    }
}

/// Score against chance, and the share of the weight that is explained.
fn rate(basis: &[DVec2], points: &[(DVec2, f64)], area: f64, tolerance: f64) -> (f64, f64) {
    let farthest = (2.0 * area / std::f64::consts::PI).sqrt();
    let count = match *basis {
        [a, b] => area / a.perp_dot(b).abs(),
        _ => farthest / basis[0].length(),
    };
    let chance = (count * std::f64::consts::PI * tolerance * tolerance / area).min(1.0);
    let (hit, miss) = (((1.0 - PARAMS.stray) / chance + PARAMS.stray).ln(), PARAMS.stray.ln());
    let (mut score, mut explained, mut total) = (0.0, 0.0, 0.0);
    for &(point, weight) in points {
        let whole = nearest(basis, point);
        let on = whole != [0.0, 0.0] && (value(basis, whole) - point).length() < tolerance;
        score += weight * if on { hit } else { miss };
        explained += if on { weight } else { 0.0 };
        total += weight;
    }
    let mean_weight = total / points.len() as f64;
    (score / mean_weight, explained / total)
}

/// The basis whose whole multiples come nearest to the points, and its covariance.
fn least_squares(used: &[([f64; 2], DVec2, f64)], rank: usize) -> Option<(Vec<DVec2>, [f64; 3])> {
    let (mut mm, mut mn, mut nn, mut mp, mut np) = (0.0, 0.0, 0.0, DVec2::ZERO, DVec2::ZERO);
    for &([m, n], point, weight) in used {
        (mm, mn, nn) = (mm + weight * m * m, mn + weight * m * n, nn + weight * n * n);
        (mp, np) = (mp + point * weight * m, np + point * weight * n);
    }
    let determinant = if rank == 2 { mm * nn - mn * mn } else { mm };
    // Whole coordinates make it whole multiples of squared weights; what is smaller is rounding.
    if determinant <= 1e-9 {
        return None;
    }
    let (basis, inverse) = if rank == 2 {
        let inverse = [nn / determinant, -mn / determinant, mm / determinant];
        (vec![mp * inverse[0] + np * inverse[1], mp * inverse[1] + np * inverse[2]], inverse)
    } else {
        (vec![mp / mm], [1.0 / mm, 0.0, 0.0])
    };
    let weight: f64 = used.iter().map(|u| u.2).sum();
    let squares: f64 = used.iter().map(|&(whole, point, w)| w * (value(&basis, whole) - point).length_squared()).sum();
    // Per component; with few peaks the digits of the grid bound what is known.
    let freedom = (2 * used.len()) as f64 - (2 * rank) as f64;
    let variance = (squares / weight * used.len() as f64 / freedom.max(1.0)).max(PARAMS.least_deviation * PARAMS.least_deviation);
    let mean_weight = weight / used.len() as f64;
    Some((basis, inverse.map(|v| v * variance * mean_weight)))
}

/// The two shortest vectors of the same lattice (Gauss), the shorter first.
pub(super) fn reduced(mut a: DVec2, mut b: DVec2) -> (DVec2, DVec2) {
    // Each round shortens a vector; the bound ends it for numbers that are none.
    for _ in 0..200 {
        if a.length_squared() > b.length_squared() {
            std::mem::swap(&mut a, &mut b);
        }
        let times = (a.dot(b) / a.length_squared()).round();
        if times == 0.0 || !times.is_finite() {
            break;
        }
        b -= a * times;
    }
    (a, b)
}
