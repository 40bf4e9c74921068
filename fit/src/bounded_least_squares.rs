//! Least squares with bounds: the colours at every step of a search.
//!
//! An active-set method in the manner of Stark and Parker 1995 ("Bounded-variable least-squares"): variables at a bound are held there, the
//! others solved for; a step that would leave the box ends at its wall, and a held variable whose gradient points inward is let go.
//! The problem comes as normal equations, which weights change cheaply. Its columns are scaled first, and a ridge of [`RIDGE`] keeps
//! columns that are the same apart.

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
        let n = self.n;
        let scale: Vec<f64> = (0..n).map(|i| self.gram[i * n + i].sqrt()).map(|d| if d > 0.0 { 1.0 / d } else { 0.0 }).collect();
        let g = |i: usize, j: usize| {
            let value = self.gram[i * n + j] * scale[i] * scale[j];
            if i == j { value.max(f64::from(u8::from(scale[i] == 0.0))) + RIDGE } else { value }
        };
        let h: Vec<f64> = (0..n).map(|i| self.rhs[i] * scale[i]).collect();
        // A scaled unknown is the unknown over its scale.
        let bound = |b: f64, i: usize| if scale[i] > 0.0 { b / scale[i] } else { 0.0 };
        let low: Vec<f64> = (0..n).map(|i| bound(lower[i], i)).collect();
        let high: Vec<f64> = (0..n).map(|i| bound(upper[i], i)).collect();
        let mut x: Vec<f64> = (0..n).map(|i| 0.0_f64.clamp(low[i], high[i].max(low[i]))).collect();
        // Where each unknown is held: below, not at all, above.
        let mut held: Vec<i8> =
            (0..n).map(|i| if high[i] > low[i] && x[i] == low[i] { -1 } else { i8::from(high[i] <= low[i]) * 2 }).collect();
        for _ in 0..10 * n * n + 10 {
            // To the least squares of the free unknowns, or to the first wall on the way.
            loop {
                let free: Vec<usize> = (0..n).filter(|&i| held[i] == 0).collect();
                let Some(target) = solve_free(&free, &x, &g, &h) else { break };
                let mut step = 1.0;
                let mut wall = None;
                for (k, &i) in free.iter().enumerate() {
                    let to = target[k];
                    let limit = if to < low[i] {
                        low[i]
                    } else if to > high[i] {
                        high[i]
                    } else {
                        continue;
                    };
                    let share = if to == x[i] { 0.0 } else { (limit - x[i]) / (to - x[i]) };
                    if share < step {
                        step = share.max(0.0);
                        wall = Some((i, limit));
                    }
                }
                for (k, &i) in free.iter().enumerate() {
                    x[i] = (x[i] + step * (target[k] - x[i])).clamp(low[i], high[i]);
                }
                let Some((i, limit)) = wall else { break };
                x[i] = limit;
                held[i] = if limit == low[i] { -1 } else { 1 };
            }
            let gradient = |i: usize| (0..n).map(|j| g(i, j) * x[j]).sum::<f64>() - h[i];
            let size = h.iter().fold(1e-300_f64, |m, v| m.max(v.abs()));
            let gain = |i: usize| match held[i] {
                -1 => -gradient(i),
                1 => gradient(i),
                _ => 0.0,
            };
            let best =
                (0..n).map(|i| (gain(i), i)).fold((STATIONARY * size, None), |best, (v, i)| if v > best.0 { (v, Some(i)) } else { best });
            match best.1 {
                Some(i) => held[i] = 0,
                None => break,
            }
        }
        (0..n)
            .map(|i| {
                if scale[i] > 0.0 {
                    (x[i] * scale[i]).clamp(lower[i], upper[i].max(lower[i]))
                } else {
                    0.0_f64.clamp(lower[i], upper[i].max(lower[i]))
                }
            })
            .collect()
    }
}

/// The least squares over the unknowns `free`, the others held at `x`; `None` if there are none, or if they cannot be told apart.
fn solve_free(free: &[usize], x: &[f64], g: &dyn Fn(usize, usize) -> f64, h: &[f64]) -> Option<Vec<f64>> {
    if free.is_empty() {
        return None;
    }
    let m = free.len();
    let matrix: Vec<f64> = free.iter().flat_map(|&i| free.iter().map(move |&j| (i, j))).map(|(i, j)| g(i, j)).collect();
    let is_free = |j: &usize| free.contains(j);
    let rhs: Vec<f64> = free.iter().map(|&i| h[i] - (0..x.len()).filter(|j| !is_free(j)).map(|j| g(i, j) * x[j]).sum::<f64>()).collect();
    let factor = cholesky(&matrix, m)?;
    Some(cholesky_solve(&factor, &rhs))
}

/// Lower factor `L` of a symmetric positive matrix of `n` rows, `L Lᵀ`; `None` if it is not positive.
pub fn cholesky(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    let mut l = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let sum = matrix[i * n + j] - (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum::<f64>();
            if i == j {
                if !(sum > 0.0 && sum.is_finite()) {
                    return None;
                }
                l[i * n + i] = sum.sqrt();
            } else {
                l[i * n + j] = sum / l[j * n + j];
            }
        }
    }
    Some(l)
}

/// The solution of `L Lᵀ x = b`.
pub fn cholesky_solve(l: &[f64], b: &[f64]) -> Vec<f64> {
    let n = b.len();
    let mut x = b.to_vec();
    for i in 0..n {
        x[i] = (x[i] - (0..i).map(|k| l[i * n + k] * x[k]).sum::<f64>()) / l[i * n + i];
    }
    for i in (0..n).rev() {
        x[i] = (x[i] - (i + 1..n).map(|k| l[k * n + i] * x[k]).sum::<f64>()) / l[i * n + i];
    }
    x
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
            let place = |i: usize| choice / 3_usize.pow(i as u32) % 3;
            let mut x: Vec<f64> = (0..n).map(|i| if place(i) == 0 { lower[i] } else { upper[i] }).collect();
            let free: Vec<usize> = (0..n).filter(|&i| place(i) == 2).collect();
            let g = |i: usize, j: usize| p.gram[i * n + j];
            if let Some(found) = solve_free(&free, &x, &g, &p.rhs) {
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
