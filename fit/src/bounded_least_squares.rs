//! Least squares with bounds: the colours at every step of a search.
//!
//! An active-set method in the manner of Stark and Parker 1995 ("Bounded-variable least-squares"): variables at a bound are held there, the
//! others solved for; a step that would leave the box ends at its wall, and a held variable whose gradient points inward is let go.
//! The problem comes as normal equations, which weights change cheaply. Its columns are scaled first, and a ridge of [`RIDGE`] keeps
//! columns that are the same apart.

use biscale::numerics::linear_algebra::Cholesky;

/// Share of the diagonal that is added to it.
const RIDGE: f64 = 1e-11;
/// Slack in the gradient of a scaled problem that counts as none.
const STATIONARY: f64 = 1e-9;

/// Normal equations `G x = h` of a least-squares problem.
#[derive(Clone, Debug, PartialEq)]
pub struct Normal {
    /// Number of unknowns.
    pub n: usize,
    /// `AᵀWA`, by rows.
    pub gram: Vec<f64>,
    /// `AᵀWb`.
    pub rhs: Vec<f64>,
}

impl Normal {
    /// No equation yet, for `n` unknowns.
    pub fn new(n: usize) -> Self {
        Self { n, gram: vec![0.0; n * n], rhs: vec![0.0; n] }
    }

    /// Adds an equation `row · x = value` of this weight. Zeros cost nothing.
    pub fn add(&mut self, row: &[(usize, f64)], value: f64, weight: f64) {
        for &(i, a) in row {
            self.rhs[i] += weight * a * value;
            for &(j, b) in row {
                self.gram[i * self.n + j] += weight * a * b;
            }
        }
    }

    /// The `x` within `lower..=upper` of the least squares. Finite for finite input; an unknown in no equation is its bound nearest to 0.
    pub fn solve(&self, lower: &[f64], upper: &[f64]) -> Vec<f64> {
        let problem = Scaled::new(self, lower, upper);
        let mut at = problem.start();
        for _ in 0..10 * self.n * self.n + 10 {
            problem.to_the_least_of_the_free(&mut at);
            match problem.wants_in(&at) {
                Some(i) => at.held[i] = Held::Free,
                None => break,
            }
        }
        let value = |i: usize| if problem.scale[i] > 0.0 { at.x[i] * problem.scale[i] } else { 0.0 };
        (0..self.n).map(|i| value(i).clamp(lower[i], upper[i].max(lower[i]))).collect()
    }
}

/// Where an unknown is held.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Held {
    /// Nowhere.
    Free,
    /// At its lower bound.
    Low,
    /// At its upper bound.
    High,
    /// At both: they are the same.
    Closed,
}

/// A point on the way.
struct Point {
    x: Vec<f64>,
    held: Vec<Held>,
}

/// A problem whose unknowns are scaled so that the diagonal of its matrix is 1, and the ridge.
struct Scaled {
    n: usize,
    /// A scaled unknown is the unknown over its scale; 0 of one that is in no equation.
    scale: Vec<f64>,
    gram: Vec<f64>,
    rhs: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

impl Scaled {
    fn new(normal: &Normal, lower: &[f64], upper: &[f64]) -> Self {
        let n = normal.n;
        let scale: Vec<f64> = (0..n).map(|i| normal.gram[i * n + i].sqrt()).map(|d| if d > 0.0 { 1.0 / d } else { 0.0 }).collect();
        let mut gram: Vec<f64> = (0..n * n).map(|k| normal.gram[k] * scale[k / n] * scale[k % n]).collect();
        for i in 0..n {
            let diagonal = gram[i * n + i].max(if scale[i] == 0.0 { 1.0 } else { 0.0 });
            gram[i * n + i] = diagonal + RIDGE;
        }
        let rhs = (0..n).map(|i| normal.rhs[i] * scale[i]).collect();
        let bounds = |bounds: &[f64]| (0..n).map(|i| if scale[i] > 0.0 { bounds[i] / scale[i] } else { 0.0 }).collect();
        Self { n, gram, rhs, low: bounds(lower), high: bounds(upper), scale }
    }

    /// Every unknown at 0, or at its bound nearest to it.
    fn start(&self) -> Point {
        let x: Vec<f64> = (0..self.n).map(|i| 0.0_f64.clamp(self.low[i], self.high[i].max(self.low[i]))).collect();
        let held = |i: usize| {
            if self.high[i] <= self.low[i] {
                Held::Closed
            } else if x[i] == self.low[i] {
                Held::Low
            } else {
                Held::Free
            }
        };
        Point { held: (0..self.n).map(held).collect(), x }
    }

    /// Moves to the least squares of the free unknowns; one that meets its bound on the way is held there, and the others go on.
    fn to_the_least_of_the_free(&self, at: &mut Point) {
        loop {
            let free: Vec<usize> = (0..self.n).filter(|&i| at.held[i] == Held::Free).collect();
            let Some(target) = solve_free(&free, &at.x, &self.gram, &self.rhs) else { return };
            let (share, wall) = self.first_wall(&free, &at.x, &target);
            for (k, &i) in free.iter().enumerate() {
                at.x[i] = (at.x[i] + share * (target[k] - at.x[i])).clamp(self.low[i], self.high[i]);
            }
            let Some((i, limit)) = wall else { return };
            at.x[i] = limit;
            at.held[i] = if limit == self.low[i] { Held::Low } else { Held::High };
        }
    }

    /// What share of the way to `target` the free unknowns can go, and which one then meets which bound.
    fn first_wall(&self, free: &[usize], x: &[f64], target: &[f64]) -> (f64, Option<(usize, f64)>) {
        let (mut least, mut wall) = (1.0, None);
        for (&i, &to) in free.iter().zip(target) {
            let limit = to.clamp(self.low[i], self.high[i]);
            if limit == to {
                continue;
            }
            let share = (limit - x[i]) / (to - x[i]);
            if share < least {
                least = share.max(0.0);
                wall = Some((i, limit));
            }
        }
        (least, wall)
    }

    /// The held unknown whose gradient points inward most; `None` where none does.
    fn wants_in(&self, at: &Point) -> Option<usize> {
        let gradient = |i: usize| (0..self.n).map(|j| self.gram[i * self.n + j] * at.x[j]).sum::<f64>() - self.rhs[i];
        let gain = |i: usize| match at.held[i] {
            Held::Low => -gradient(i),
            Held::High => gradient(i),
            Held::Free | Held::Closed => 0.0,
        };
        let size = self.rhs.iter().fold(1e-300_f64, |m, v| m.max(v.abs()));
        let best =
            (0..self.n).map(|i| (gain(i), i)).fold((STATIONARY * size, None), |best, (v, i)| if v > best.0 { (v, Some(i)) } else { best });
        best.1
    }
}

/// The least squares over the unknowns `free`, the others held at `x`; `None` if there are none, or if they cannot be told apart. `gram` by rows.
fn solve_free(free: &[usize], x: &[f64], gram: &[f64], rhs: &[f64]) -> Option<Vec<f64>> {
    if free.is_empty() {
        return None;
    }
    let (m, n) = (free.len(), x.len());
    let matrix: Vec<f64> = (0..m * m).map(|k| gram[free[k / m] * n + free[k % m]]).collect();
    let held: Vec<usize> = (0..n).filter(|j| !free.contains(j)).collect();
    let rhs: Vec<f64> = free.iter().map(|&i| rhs[i] - held.iter().map(|&j| gram[i * n + j] * x[j]).sum::<f64>()).collect();
    Some(Cholesky::new(&matrix, m)?.solve(&rhs))
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::numerics::low_discrepancy::gaussian;

    fn value(p: &Normal, x: &[f64]) -> f64 {
        let n = p.n;
        let quadratic: f64 = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| x[i] * p.gram[i * n + j] * x[j]).sum();
        quadratic - 2.0 * x.iter().zip(&p.rhs).map(|(x, h)| x * h).sum::<f64>()
    }

    /// The best of all choices of which unknowns lie at which bound.
    fn brute_force(p: &Normal, lower: &[f64], upper: &[f64]) -> f64 {
        let n = p.n;
        let mut best = f64::INFINITY;
        for choice in 0..3_usize.pow(n as u32) {
            let held = |i: usize| choice / 3_usize.pow(i as u32) % 3;
            let mut x: Vec<f64> = (0..n).map(|i| if held(i) == 0 { lower[i] } else { upper[i] }).collect();
            let free: Vec<usize> = (0..n).filter(|&i| held(i) == 2).collect();
            if let Some(found) = solve_free(&free, &x, &p.gram, &p.rhs) {
                for (k, &i) in free.iter().enumerate() {
                    x[i] = found[k];
                }
            }
            if (0..n).all(|i| x[i] >= lower[i] - 1e-12 && x[i] <= upper[i] + 1e-12) {
                best = best.min(value(p, &x));
            }
        }
        best
    }

    fn problem(seed: u64, n: usize, rows: usize) -> Normal {
        let mut p = Normal::new(n);
        for r in 0..rows {
            let row: Vec<(usize, f64)> = (0..n).map(|i| (i, gaussian(seed, (r * (n + 1) + i) as u64))).collect();
            p.add(&row, 2.0 * gaussian(seed, (r * (n + 1) + n) as u64), 1.0);
        }
        p
    }

    #[test]
    fn it_finds_what_trying_every_choice_of_bounds_finds() {
        for seed in 0..60 {
            let n = 1 + (seed % 5) as usize;
            let p = problem(seed, n, n + 3);
            let (lower, upper) = (vec![0.0; n], vec![0.4; n]);
            let x = p.solve(&lower, &upper);
            let (found, best) = (value(&p, &x), brute_force(&p, &lower, &upper));
            assert!(x.iter().all(|&v| (0.0..=0.4).contains(&v)), "seed {seed}: {x:?}");
            assert!(found <= best + 1e-8 * (1.0 + best.abs()), "seed {seed}: {found} for {best}, {x:?}");
        }
    }

    #[test]
    fn equal_columns_unknowns_in_no_equation_and_closed_bounds_do_no_harm() {
        let mut p = Normal::new(4);
        p.add(&[(0, 1.0), (1, 1.0)], 1.0, 1.0);
        p.add(&[(0, 2.0), (1, 2.0), (3, 1.0)], 2.5, 1.0);
        let x = p.solve(&[0.0, 0.0, 0.0, 0.5], &[1.0, 1.0, 1.0, 0.5]);
        assert!((x[0] + x[1] - 1.0).abs() < 1e-5, "{x:?}");
        assert_eq!((x[2], x[3]), (0.0, 0.5));
    }
}
