//! The lattice that the peaks of a spectrum lie on, and what it says about the surface: along how many directions it repeats, and how.
//!
//! A surface that repeats by the vectors `a1`, `a2` has power only at frequencies `m b1 + n b2`, where `b1`, `b2` are dual to them.
//! A lattice is judged by how much better it explains the peaks than chance does: a peak within [`TOLERANCE`] cycles of a point of
//! a lattice with cells of `D` square cycles would be there by chance with probability `pi TOLERANCE^2 / D`. So a lattice that is too
//! fine explains everything and gains little, and one that is too coarse misses peaks.

use super::spectrum::Peak;
use glam::{DMat2, DVec2};

/// A peak belongs to a lattice point within this distance, in cycles over the cut.
const TOLERANCE: f64 = 0.8;
/// Share of the peaks that may be no part of the lattice.
const STRAY: f64 = 0.03;
/// Shortest vector of a lattice, in cycles over the cut: fewer repeats are no repetition.
const MIN_CYCLES: f64 = 3.5;
/// Smallest cell of a lattice in square cycles, a few times what the tolerance covers.
const MIN_CELL: f64 = 9.0;
/// Peaks from which candidates are made.
const SEEDS: usize = 14;
/// A lattice is made finer at most by this factor at once.
const MAX_PARTS: u32 = 12;
/// Logarithm of how much better than chance a finer lattice explains the peaks that were missed.
const MIN_GAIN: f64 = 4.0;
/// Pairs that are refined.
const FINALISTS: usize = 80;

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
        let points: Vec<(DVec2, f64)> = peaks.iter().map(|p| (p.frequency / bin, p.contrast.ln().min(8.0))).collect();
        // Half of the plane of frequencies, in square cycles.
        let area = 0.5 / (bin.x * bin.y);
        let mut candidates: Vec<DVec2> = points.iter().take(2 * SEEDS).map(|p| p.0).collect();
        let seeds: Vec<DVec2> = points.iter().take(SEEDS).map(|p| p.0).collect();
        for (k, &a) in seeds.iter().enumerate() {
            for &b in &seeds[..k] {
                candidates.extend([a - b, a + b]);
            }
        }
        candidates.retain(|c| c.length() >= MIN_CYCLES);
        let mut distinct: Vec<DVec2> = Vec::new();
        for c in candidates {
            if distinct.iter().all(|d| (*d - c).length() > 0.4 && (*d + c).length() > 0.4) {
                distinct.push(c);
            }
        }
        let mut rated: Vec<(f64, Vec<DVec2>)> = Vec::new();
        for (k, &a) in distinct.iter().enumerate() {
            rated.push((rate(&[a], &points, area, 1.5 * TOLERANCE).0, vec![a]));
            for &b in &distinct[..k] {
                let (a, b) = reduced(a, b);
                if a.length() >= MIN_CYCLES && a.perp_dot(b).abs() >= MIN_CELL {
                    rated.push((rate(&[a, b], &points, area, 1.5 * TOLERANCE).0, vec![a, b]));
                }
            }
        }
        rated.sort_by(|a, b| b.0.total_cmp(&a.0));
        rated.truncate(FINALISTS);
        let refined = rated.into_iter().filter_map(|(_, basis)| Self::refine(basis, &points, area));
        let best = refined.max_by(|a, b| a.score.total_cmp(&b.score)).filter(|l| l.score > 0.0)?;
        let mut best = Self::completed(best, &points, area);
        if let [a, b] = best.basis[..]
            && a.perp_dot(b) < 0.0
        {
            best.basis[1] = -b;
            best.covariance[1] *= -1.0;
        }
        let (a, b) = (best.basis[0] * bin, best.basis.get(1).map(|b| *b * bin));
        // One error for both axes of a cut that may be oblong: the coarser.
        let scale = bin.max_element() * bin.max_element();
        Some(Self { basis: std::iter::once(a).chain(b).collect(), covariance: best.covariance.map(|v| v * scale), ..best })
    }

    /// Adds what weak peaks demand: a lattice that misses few is the better one by its score, yet peaks that are no noise and lie
    /// on a lattice a few times as fine were missed.
    fn completed(mut best: Self, points: &[(DVec2, f64)], area: f64) -> Self {
        while let [a, b] = best.basis[..] {
            let off = |basis: &[DVec2], p: DVec2| (value(basis, nearest(basis, p)) - p).length();
            let missed: Vec<(DVec2, f64)> = points.iter().copied().filter(|p| off(&best.basis, p.0) >= TOLERANCE).collect();
            let inverse = DMat2::from_cols(a, b).inverse();
            let mut finer: Option<(f64, Self)> = None;
            for &(p, _) in &missed {
                let c = inverse * p;
                for parts in 2..=MAX_PARTS {
                    let n = f64::from(parts);
                    // All lattices with `parts` as many points that hold this peak's fraction.
                    let fraction = ((c * n).round()) / n;
                    if ((fraction - c).x * a + (fraction - c).y * b).length() > TOLERANCE {
                        continue;
                    }
                    let basis = joined([a, b], fraction, parts);
                    if basis[0].length() < MIN_CYCLES || basis[0].perp_dot(basis[1]).abs() < MIN_CELL {
                        continue;
                    }
                    let now = missed.iter().filter(|m| off(&basis, m.0) < TOLERANCE).count() as f64;
                    let chance = (std::f64::consts::PI * TOLERANCE * TOLERANCE / basis[0].perp_dot(basis[1]).abs()).min(0.5);
                    let expected = chance * missed.len() as f64;
                    let gain = now * (now / expected.max(1e-3)).max(1e-3).ln() - (now - expected);
                    if now > expected && now >= 2.0 && gain > MIN_GAIN && finer.as_ref().is_none_or(|f| gain > f.0) {
                        finer = Self::refine(basis, points, area).map(|l| (gain, l)).or(finer);
                    }
                    break;
                }
            }
            match finer {
                Some((_, lattice)) if lattice.explained > best.explained => best = lattice,
                _ => break,
            }
        }
        best
    }

    /// Fits a basis to the peaks that it explains, nearest to 0 first; units are cycles over the cut.
    fn refine(mut basis: Vec<DVec2>, points: &[(DVec2, f64)], area: f64) -> Option<Self> {
        let farthest = points.iter().map(|p| p.0.length()).fold(0.0, f64::max);
        let shortest = basis.iter().map(|b| b.length()).fold(f64::INFINITY, f64::min);
        let mut reach = 2.5 * shortest;
        let mut covariance = [f64::INFINITY; 3];
        let mut settled = 0;
        while settled < 3 {
            reach = (1.5 * reach).min(farthest + 1.0);
            settled += usize::from(reach > farthest);
            let used: Vec<([f64; 2], DVec2, f64)> = points
                .iter()
                .filter(|p| p.0.length() <= reach)
                .filter_map(|&(point, weight)| {
                    let whole = nearest(&basis, point);
                    let off = (value(&basis, whole) - point).length();
                    (off < TOLERANCE && whole != [0.0, 0.0]).then_some((whole, point, weight))
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
        let (score, explained) = rate(&basis, points, area, TOLERANCE);
        if let [a, b] = basis[..] {
            let (ra, rb) = reduced(a, b);
            if ra.length() < MIN_CYCLES || ra.perp_dot(rb).abs() < MIN_CELL {
                return None;
            }
        }
        Some(Self { basis, covariance, score, explained })
    }
}

/// Reduced basis of the lattice of `a`, `b` and `fraction` (in parts of them).
fn joined([a, b]: [DVec2; 2], fraction: DVec2, parts: u32) -> Vec<DVec2> {
    // The shortest vectors of all points within one cell and its edges.
    let mut points: Vec<DVec2> = vec![a, b, a + b, a - b];
    for k in 1..parts {
        let f = fraction * f64::from(k);
        let f = f - f.round();
        let p = a * f.x + b * f.y;
        points.extend([p, p + a, p - a, p + b, p - b, p + a + b, p - a - b, p + a - b, p - a + b]);
    }
    points.retain(|p| p.length() > 1e-6);
    points.sort_by(|p, q| p.length().total_cmp(&q.length()));
    let first = points[0];
    let second = points.iter().copied().find(|p| p.perp_dot(first).abs() > 1e-3 * a.perp_dot(b).abs()).unwrap_or(b);
    let (first, second) = reduced(first, second);
    vec![first, second]
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
    let (hit, miss) = (((1.0 - STRAY) / chance + STRAY).ln(), STRAY.ln());
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
    let variance = (squares / weight * used.len() as f64 / freedom.max(1.0)).max(0.02 * 0.02);
    let mean_weight = weight / used.len() as f64;
    Some((basis, inverse.map(|v| v * variance * mean_weight)))
}

/// The two shortest vectors of the same lattice (Gauss), the shorter first.
pub(super) fn reduced(mut a: DVec2, mut b: DVec2) -> (DVec2, DVec2) {
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
