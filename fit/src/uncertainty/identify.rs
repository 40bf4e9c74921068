//! What the photographs can say: standard deviations and correlations of all unknowns, and which of them are not to be trusted.
//!
//! The residuals are linear in the colours and nearly so, near the best point, in everything else. Their derivatives there, by central
//! differences over a step that visibility bits do not spoil, give the covariance `(Jᵀ S⁻¹ J)⁻¹`. `S` has for each group of rows (a distant
//! photograph, the close-up) its mean squared residual, at least 1: a group that is not explained is not made up for by others that are. It has
//! three times that, since the three channels of a pixel leave the same out. What other samples of the surface would change (`replicates`) is
//! added to the covariance. The bounds count as knowledge as well, of a standard deviation of `range/√12`: what nothing tells has that one.

use crate::bounded_least_squares::{cholesky, cholesky_solve};
use crate::residuals::derivatives::{Derivatives, weights};
use crate::residuals::equations::Evaluated;
use crate::residuals::model::Model;
use crate::residuals::unknowns::{UnknownKind, Variable};
use crate::uncertainty::params::PARAMS;
use serde::Serialize;

/// Share of its range from which on a standard deviation means that nothing is known.
pub const NOT_IDENTIFIED: f64 = 0.25;
/// Standard deviation over value from which on an unknown is weak.
pub const WEAK: f64 = 0.1;
/// Correlations that are worth telling.
pub const CORRELATED: f64 = 0.9;

/// How well one unknown is known.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Known {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation.
    pub sigma: f64,
    /// Width of its bounds.
    pub range: f64,
    /// Its bounds.
    pub bounds: [f64; 2],
    /// Whether it lies on one of its bounds.
    pub at_bound: bool,
    /// Whether its standard deviation is over 25 % of its range: its value says nothing.
    pub not_identified: bool,
    /// Whether its standard deviation is over 10 % of its value.
    pub weak: bool,
    /// Its standard deviation without the close-up, if there is one.
    pub sigma_without_close_up: Option<f64>,
    /// Whether it is the close-up that tells it: without it the standard deviation is three times as large, or all of the range.
    pub from_close_up: bool,
    /// What it is: `parameter`, `light`, `colour`, `veil`, `exposure`.
    pub kind: &'static str,
    /// What a standard deviation that is a share of the range is multiplied by.
    #[serde(skip)]
    pub scale: f64,
}

impl Known {
    /// Takes a standard deviation, a share of the range.
    fn set_sigma(&mut self, share: f64) {
        self.sigma = share * self.scale;
        self.not_identified = share > NOT_IDENTIFIED;
        self.weak = !["light", "veil"].contains(&self.kind) && self.sigma > WEAK * self.value.abs();
    }
}

/// Two unknowns that the photographs hardly tell apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Correlation {
    /// The one.
    pub a: String,
    /// The other.
    pub b: String,
    /// Between -1 and 1.
    pub correlation: f64,
}

/// What the photographs can say.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Identified {
    /// All unknowns: those of the search, then the linear ones.
    pub known: Vec<Known>,
    /// Pairs with a correlation over .9.
    pub correlations: Vec<Correlation>,
    /// Largest over smallest singular value of the derivatives, each unknown in units of its range.
    pub condition: f64,
    /// Mean squared residual.
    pub chi2: f64,
    /// Residuals that the unknowns are found from: those of bins that share their model error count as one.
    pub residuals: f64,
    /// Covariance of all unknowns in shares of their ranges, rows of the one.
    #[serde(skip)]
    pub covariance: Vec<f64>,
}

impl Identified {
    /// Makes one standard deviation larger by a factor, and those of all unknowns that answer to that one.
    pub fn widen(&mut self, unknown: usize, factor: f64) {
        let n = self.known.len();
        let column: Vec<f64> = (0..n).map(|i| self.covariance[i * n + unknown]).collect();
        let more = (factor * factor - 1.0) / column[unknown];
        for i in 0..n {
            for j in 0..n {
                self.covariance[i * n + j] += more * column[i] * column[j];
            }
            self.known[i].set_sigma(self.covariance[i * n + i].sqrt());
        }
    }
}

/// What each row is worth beside its weight: one over the mean squared residual of its group, at most 1, and [`super::params::UncertaintyParams::channels_alike`] of what photographs tell.
/// `counts` is what each row counts; groups up to `photographs` are those of photographs.
fn trust(derivatives: &Derivatives, counts: &[f64], photographs: usize) -> Vec<f64> {
    let mut sums = vec![(0.0, 0.0); derivatives.groups.iter().max().map_or(0, |m| m + 1)];
    for ((&group, r), count) in derivatives.groups.iter().zip(&derivatives.residuals).zip(counts) {
        sums[group].0 += r * r;
        sums[group].1 += count;
    }
    let worth = |group: usize| if group <= photographs { PARAMS.channels_alike } else { 1.0 };
    derivatives.groups.iter().map(|&group| worth(group) * sums[group].1 / sums[group].0.max(sums[group].1).max(f64::MIN_POSITIVE)).collect()
}

/// Inverse of a positive symmetric matrix.
fn inverse(matrix: &[f64], n: usize) -> Option<Vec<f64>> {
    let l = cholesky(matrix, n)?;
    let mut out = vec![0.0; n * n];
    for j in 0..n {
        let mut unit = vec![0.0; n];
        unit[j] = 1.0;
        for (i, v) in cholesky_solve(&l, &unit).into_iter().enumerate() {
            out[i * n + j] = v;
        }
    }
    Some(out)
}

/// Eigenvalues of a symmetric matrix by Jacobi's rotations, ascending.
fn eigenvalues(matrix: &[f64], n: usize) -> Vec<f64> {
    let mut a = matrix.to_vec();
    for _ in 0..60 {
        let off: f64 = (0..n).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i * n + j].powi(2)).sum();
        let size: f64 = a.iter().map(|v| v * v).sum();
        if off <= 1e-30 * size {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                if a[p * n + q] == 0.0 {
                    continue;
                }
                let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * a[p * n + q]);
                let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
                let (c, s) = (1.0 / (t * t + 1.0).sqrt(), t / (t * t + 1.0).sqrt());
                for k in 0..n {
                    let (x, y) = (a[k * n + p], a[k * n + q]);
                    (a[k * n + p], a[k * n + q]) = (c * x - s * y, s * x + c * y);
                }
                for k in 0..n {
                    let (x, y) = (a[p * n + k], a[q * n + k]);
                    (a[p * n + k], a[q * n + k]) = (c * x - s * y, s * x + c * y);
                }
            }
        }
    }
    let mut values: Vec<f64> = (0..n).map(|i| a[i * n + i]).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// How the unknowns, in units of `range`, answer to what each replicate's residuals differ by from the mean of all; `inverse` is that of the weighted `JᵀJ`.
fn answers(
    derivatives: &Derivatives,
    roots: &[f64],
    inverse: &[f64],
    range: &[f64],
    weight: impl Fn(usize) -> f64,
    replicates: &[Vec<f64>],
) -> Vec<Vec<f64>> {
    let (n, count) = (range.len(), replicates.len() as f64);
    let mean: Vec<f64> = (0..derivatives.rows.len()).map(|k| replicates.iter().map(|r| r[k]).sum::<f64>() / count).collect();
    // The mean of the replicates is one of them as well.
    let unbiased = (count / (count - 1.0).max(1.0)).sqrt();
    let answer = |replicate: &Vec<f64>| {
        let mut gradient = vec![0.0; n];
        for (k, row) in derivatives.rows.iter().enumerate() {
            let r = unbiased * weight(k) * roots[k] * (replicate[k] - mean[k]);
            (0..n).for_each(|i| gradient[i] += row[i] * range[i] * r);
        }
        (0..n).map(|i| -(0..n).map(|j| inverse[i * n + j] * gradient[j]).sum::<f64>()).collect()
    };
    replicates.iter().map(answer).collect()
}

/// What is known at the best point. `replicates` are the residuals there, colours and all, of models with other samples.
pub fn identify(model: &Model<'_>, point: &[f64], best: &Evaluated, derivatives: &Derivatives, replicates: &[Vec<f64>]) -> Identified {
    let spec = model.input.spec;
    let n = point.len();
    let total = n + best.linear.len();
    // Ranges in the units of the derivatives: of the box for the search; a colour cannot be more than all, stray light than the picture; an exposure is as large as it is.
    let range: Vec<f64> = (0..total)
        .map(|i| match i.checked_sub(n).map(|k| &model.unknowns[k]) {
            None => 1.0,
            Some(u) => match u.kind {
                UnknownKind::Colour(..) => (u.bounds[1] - u.bounds[0]).max(PARAMS.least_range),
                UnknownKind::StrayLight(p, c) => model.input.photographs[p].mean[c].max(PARAMS.least_range),
                UnknownKind::Exposure => best.linear[i - n],
            },
        })
        .collect();
    // What lies on a bound of its own does not answer to the others.
    let held: Vec<bool> = (0..total)
        .map(|i| {
            i.checked_sub(n).is_some_and(|k| {
                let [low, high] = model.unknowns[k].bounds;
                best.linear[k] <= low + PARAMS.on_wall * (1.0 + low.abs()) || best.linear[k] >= high - PARAMS.on_wall * (1.0 + high.abs())
            })
        })
        .collect();
    let count: f64 = best.rows.iter().map(|(row, _)| row.weight).sum::<f64>() + best.fixed.len() as f64;
    let chi2 = derivatives.residuals.iter().map(|r| r * r).sum::<f64>() / count.max(1.0);
    let counts: Vec<f64> = best.rows.iter().map(|(row, _)| row.weight).chain(best.fixed.iter().map(|_| 1.0)).collect();
    let trust = trust(derivatives, &counts, model.input.photographs.len());
    let covariance = |keep: &dyn Fn(usize) -> bool| {
        let mut gram = derivatives.gram(&range, |k| if keep(k) { trust[k] } else { 0.0 });
        for i in 0..total {
            for j in 0..total {
                if (held[i] || held[j]) && i != j {
                    gram[i * total + j] = 0.0;
                }
            }
            // The bounds, whose knowledge no residual makes worse.
            gram[i * total + i] += PARAMS.bounds_precision;
        }
        let mut found = inverse(&gram, total)?;
        let own = found.clone();
        for answer in answers(derivatives, &weights(best), &own, &range, |k| if keep(k) { trust[k] } else { 0.0 }, replicates) {
            for i in (0..total).filter(|&i| !held[i]) {
                for j in (0..total).filter(|&j| !held[j]) {
                    found[i * total + j] += answer[i] * answer[j] / (replicates.len() as f64);
                }
            }
        }
        Some(found)
    };
    if total == 0 {
        return Identified { chi2, condition: 1.0, residuals: count, ..Identified::default() };
    }
    let has_close_up = derivatives.close_up.contains(&true);
    let Some(with) = covariance(&|_| true) else { return Identified { chi2, condition: f64::INFINITY, ..Identified::default() } };
    let without = if has_close_up { covariance(&|k| !derivatives.close_up[k]) } else { None };
    let known = (0..total)
        .map(|i| {
            let share = with[i * total + i].sqrt();
            let share_without = without.as_ref().map(|w| w[i * total + i].sqrt());
            let (name, value, bounds, width, kind) = match i.checked_sub(n) {
                None => {
                    let variable = &model.variables[i];
                    let at = |u: f64| variable.at(spec, &model.unknowns, u);
                    // A parameter that moves by factors is not as wide here as there.
                    let (low, high) = ((point[i] - PARAMS.at_bound).max(0.0), (point[i] + PARAMS.at_bound).min(1.0));
                    let local = (at(high) - at(low)) / (high - low);
                    let kind = if matches!(variable, Variable::Parameter(_)) { "parameter" } else { "light" };
                    (variable.name(spec, &model.unknowns), at(point[i]), [at(0.0), at(1.0)], local, kind)
                }
                Some(k) => {
                    let u = &model.unknowns[k];
                    let kind = match u.kind {
                        UnknownKind::Colour(..) => "colour",
                        UnknownKind::StrayLight(..) => "veil",
                        UnknownKind::Exposure => "exposure",
                    };
                    let bounds = if kind == "veil" { [0.0, range[i]] } else { u.bounds };
                    (u.name.clone(), best.linear[k], bounds, range[i], kind)
                }
            };
            let at_bound = match i.checked_sub(n) {
                None => point[i] < PARAMS.at_bound || point[i] > 1.0 - PARAMS.at_bound,
                Some(_) => held[i],
            };
            let mut known = Known {
                at_bound,
                not_identified: false,
                weak: false,
                sigma_without_close_up: share_without.map(|s| s * width),
                from_close_up: share_without
                    .is_some_and(|s| s > PARAMS.from_close_up * share || (s > NOT_IDENTIFIED && share <= NOT_IDENTIFIED)),
                range: bounds[1] - bounds[0],
                name,
                value,
                sigma: 0.0,
                bounds,
                kind,
                scale: width,
            };
            known.set_sigma(share);
            known
        })
        .collect::<Vec<_>>();
    let mut correlations = Vec::new();
    for i in 0..total {
        for j in 0..i {
            let correlation = with[i * total + j] / (with[i * total + i] * with[j * total + j]).sqrt();
            if correlation.abs() > CORRELATED {
                correlations.push(Correlation { a: known[j].name.clone(), b: known[i].name.clone(), correlation });
            }
        }
    }
    correlations.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    let values = eigenvalues(&derivatives.gram(&range, |_| 1.0), total);
    let (low, high) = (values[0].max(0.0), values[total - 1]);
    let condition = if low > 0.0 { (high / low).sqrt() } else { f64::INFINITY };
    Identified { known, correlations, condition, chi2, residuals: count, covariance: with }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_answers_to_an_unknown_that_is_known_worse_is_known_worse_itself() {
        let known = |name: &str| Known {
            name: name.to_owned(),
            value: 1.0,
            sigma: 0.0,
            range: 1.0,
            bounds: [0.0, 1.0],
            at_bound: false,
            not_identified: false,
            weak: false,
            sigma_without_close_up: None,
            from_close_up: false,
            kind: "parameter",
            scale: 2.0,
        };
        // The first two go together, the third by itself.
        let covariance = vec![4e-4, 3e-4, 0.0, 3e-4, 4e-4, 0.0, 0.0, 0.0, 1e-4];
        let mut found = Identified { known: ["a", "b", "c"].map(known).into(), covariance, ..Identified::default() };
        found.widen(0, 3.0);
        let sigma: Vec<f64> = found.known.iter().map(|k| k.sigma).collect();
        let answering = 2.0 * (4e-4_f64 + 8.0 * 9e-8 / 4e-4).sqrt();
        assert!((sigma[0] - 0.12).abs() < 1e-12 && (sigma[1] - answering).abs() < 1e-12 && (sigma[2] - 0.02).abs() < 1e-12, "{sigma:?}");
        assert!(found.known[0].weak && !found.known[2].weak);
    }

    #[test]
    fn eigenvalues_of_a_known_matrix() {
        let values = eigenvalues(&[2.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0], 3);
        for (value, exact) in values.iter().zip([2.0 - 2.0_f64.sqrt(), 2.0, 2.0 + 2.0_f64.sqrt()]) {
            assert!((value - exact).abs() < 1e-12, "{values:?}");
        }
    }
}
