//! What the photographs can say: standard deviations and correlations of all unknowns, and which of them are not to be trusted.
//!
//! The residuals are linear in the colours and nearly so, near the best point, in everything else. Their derivatives there, by central
//! differences over a step that visibility bits do not spoil, give the covariance `(Jᵀ S⁻¹ J)⁻¹`. `S` has for each group of rows (a distant
//! photograph, the close-up) its mean squared residual, at least 1: a group that is not explained is not made up for by others that are. It has
//! three times that, since the three channels of a pixel leave the same out. What other samples of the surface would change (`replicates`), and
//! light that the model leaves out (`missing`), is added to the covariance. The bounds count as knowledge as well, of a standard deviation of `range/√12`: what nothing tells has that one.

use crate::residuals::derivatives::{Derivatives, weights};
use crate::residuals::equations::Evaluated;
use crate::residuals::model::Model;
use crate::residuals::unknowns::{Shot, UnknownKind, Variable};
use crate::uncertainty::params::PARAMS;
use biscale::numerics::linear_algebra::{Cholesky, symmetric_eigenvalues};
use serde::Serialize;

/// Share of its range from which on a standard deviation means that nothing is known.
pub const NOT_IDENTIFIED: f64 = 0.25;
/// Standard deviation over value from which on an unknown is weak.
pub const WEAK: f64 = 0.1;
/// Correlations that are worth telling.
pub const CORRELATED: f64 = 0.9;

/// How well one unknown is known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Known {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its standard deviation; NaN where it was not computed.
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
    /// Of a colour: its standard deviation against the other colours, without the scale that all of them share.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma_of_ratio: Option<f64>,
    /// Of a colour: whether that scale rests on an irradiance whose standard deviation nobody gave.
    pub scale_assumed: bool,
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
    /// A value within its bounds, of which nothing else is told yet.
    fn of(value: f64, bounds: [f64; 2]) -> Self {
        Self {
            name: String::new(),
            value,
            sigma: 0.0,
            range: bounds[1] - bounds[0],
            bounds,
            at_bound: false,
            not_identified: false,
            weak: false,
            sigma_of_ratio: None,
            scale_assumed: false,
            sigma_without_close_up: None,
            from_close_up: false,
            kind: "parameter",
            scale: 1.0,
        }
    }

    /// Takes a standard deviation, a share of the range.
    fn set_sigma(&mut self, share: f64) {
        self.sigma = share * self.scale;
        self.not_identified = share > NOT_IDENTIFIED;
        self.weak = !["light", "veil", "blur"].contains(&self.kind) && self.sigma > WEAK * self.value.abs();
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
    /// Adds what is not known of the scale that all colours share, a share of each of them: `sigma`. It comes from the irradiance of the
    /// photographs, which nothing in them tells. Correlations stay those without it: with it all colours have one.
    pub fn add_scale(&mut self, sigma: f64, assumed: bool) {
        let n = self.known.len();
        let of = |known: &Known| if known.kind == "colour" { sigma * known.value / known.scale } else { 0.0 };
        let column: Vec<f64> = self.known.iter().map(of).collect();
        for (i, known) in self.known.iter_mut().enumerate().filter(|(_, known)| known.kind == "colour") {
            known.sigma_of_ratio = Some(known.sigma);
            known.scale_assumed = assumed;
            for j in 0..n {
                self.covariance[i * n + j] += column[i] * column[j];
            }
            known.set_sigma(self.covariance[i * n + i].sqrt());
            known.sigma_without_close_up = known.sigma_without_close_up.map(|s| s.hypot(sigma * known.value));
        }
    }

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

/// The best point, and what its unknowns and residuals are measured by.
struct BestPoint<'a> {
    model: &'a Model<'a>,
    point: &'a [f64],
    evaluated: &'a Evaluated,
    derivatives: &'a Derivatives,
    /// Residuals there, colours and all, of models with other samples.
    replicates: &'a [Vec<f64>],
    /// What residuals change by where light is added that the model leaves out.
    missing: Option<&'a [f64]>,
    /// Ranges of all unknowns in the units of the derivatives.
    range: Vec<f64>,
    /// Which linear unknowns lie on a bound of their own, and do not answer to the others.
    held: Vec<bool>,
    /// See [`trust`].
    trust: Vec<f64>,
}

impl BestPoint<'_> {
    /// All unknowns.
    fn total(&self) -> usize {
        self.range.len()
    }

    /// What a residual is worth where only those that `keep` are told.
    fn worth(&self, keep: &dyn Fn(usize) -> bool, k: usize) -> f64 {
        if keep(k) { self.trust[k] } else { 0.0 }
    }

    /// Covariance of all unknowns in shares of their ranges, from the residuals that `keep` tells; `None` if a matrix is not positive definite.
    fn covariance(&self, keep: &dyn Fn(usize) -> bool) -> Option<Vec<f64>> {
        let total = self.total();
        let mut gram = self.derivatives.gram(&self.range, |k| self.worth(keep, k));
        for i in 0..total {
            for j in 0..total {
                if (self.held[i] || self.held[j]) && i != j {
                    gram[i * total + j] = 0.0;
                }
            }
            // The bounds, whose knowledge no residual makes worse.
            gram[i * total + i] += PARAMS.bounds_precision;
        }
        let inverse = Cholesky::new(&gram, total)?.inverse();
        let share = 1.0 / (self.replicates.len() as f64).sqrt();
        let of_samples = self.differences().into_iter().map(|difference| (share, difference));
        // Of light that is left out all is missing: the change is no deviation about a mean. What colours are uncertain by for it is in their common scale.
        let of_missing = self.missing.map(|change| (1.0, change.to_vec()));
        let mut found = inverse.clone();
        for ((share, difference), count) in of_samples.map(|s| (s, total)).chain(of_missing.map(|m| (m, self.point.len()))) {
            let answer = self.answer(&inverse, keep, &difference);
            for i in (0..count).filter(|&i| !self.held[i]) {
                for j in (0..count).filter(|&j| !self.held[j]) {
                    found[i * total + j] += share * share * answer[i] * answer[j];
                }
            }
        }
        Some(found)
    }

    /// What each replicate's residuals differ by from the mean of all.
    fn differences(&self) -> Vec<Vec<f64>> {
        let count = self.replicates.len() as f64;
        let mean: Vec<f64> = (0..self.derivatives.rows.len()).map(|k| self.replicates.iter().map(|r| r[k]).sum::<f64>() / count).collect();
        // The mean of the replicates is one of them as well.
        let unbiased = (count / (count - 1.0).max(1.0)).sqrt();
        self.replicates.iter().map(|replicate| replicate.iter().zip(&mean).map(|(r, mean)| unbiased * (r - mean)).collect()).collect()
    }

    /// How the unknowns, in units of their ranges, answer to a change of the residuals; `inverse` is that of the weighted `JᵀJ`.
    fn answer(&self, inverse: &[f64], keep: &dyn Fn(usize) -> bool, change: &[f64]) -> Vec<f64> {
        let Self { derivatives, range, .. } = self;
        let roots = weights(self.evaluated);
        let n = range.len();
        let mut gradient = vec![0.0; n];
        for (k, row) in derivatives.rows.iter().enumerate() {
            let r = self.worth(keep, k) * roots[k] * change[k];
            (0..n).for_each(|i| gradient[i] += row[i] * range[i] * r);
        }
        (0..n).map(|i| -(0..n).map(|j| inverse[i * n + j] * gradient[j]).sum::<f64>()).collect()
    }

    /// How well unknown `i` is known, by its standard deviation as a share of the range and that without the close-up.
    fn known(&self, i: usize, share: f64, share_without: Option<f64>) -> Known {
        let mut known = match i.checked_sub(self.point.len()) {
            None => known_variable(self.model, self.point, i),
            Some(k) => known_linear(self.model, self.evaluated, k, self.range[i], self.held[i]),
        };
        known.sigma_without_close_up = share_without.map(|s| s * known.scale);
        known.from_close_up =
            share_without.is_some_and(|s| s > PARAMS.from_close_up * share || (s > NOT_IDENTIFIED && share <= NOT_IDENTIFIED));
        known.set_sigma(share);
        known
    }
}

/// An unknown of the search, without its standard deviations.
fn known_variable(model: &Model<'_>, point: &[f64], i: usize) -> Known {
    let (variable, unit) = (&model.variables[i], point[i]);
    let at = |u: f64| variable.at(model.input.spec, &model.unknowns, u);
    // A parameter that moves by factors is not as wide here as there.
    let (low, high) = ((unit - PARAMS.at_bound).max(0.0), (unit + PARAMS.at_bound).min(1.0));
    Known {
        name: variable.name(model.input.spec, &model.unknowns),
        at_bound: !(PARAMS.at_bound..=1.0 - PARAMS.at_bound).contains(&unit),
        kind: match variable {
            Variable::Parameter(_) => "parameter",
            Variable::Light { .. } => "light",
            Variable::Blur => "blur",
            Variable::Linear(_) => "colour",
        },
        scale: (at(high) - at(low)) / (high - low),
        ..Known::of(at(unit), [at(0.0), at(1.0)])
    }
}

/// A linear unknown, without its standard deviations.
fn known_linear(model: &Model<'_>, best: &Evaluated, k: usize, range: f64, held: bool) -> Known {
    let unknown = &model.unknowns[k];
    let (kind, bounds) = match unknown.kind {
        UnknownKind::Colour(..) => ("colour", unknown.bounds),
        UnknownKind::StrayLight(..) => ("veil", [0.0, range]),
        UnknownKind::Exposure => ("exposure", unknown.bounds),
    };
    let known = Known::of(best.linear[k], bounds);
    Known { name: unknown.name.clone(), at_bound: held, kind, scale: range, ..known }
}

/// Ranges of all unknowns in the units of the derivatives: of the box for the search; a colour cannot be more than all, stray light than the picture; an
/// exposure is as large as it is.
fn ranges(model: &Model<'_>, variables: usize, best: &Evaluated) -> Vec<f64> {
    let exposure = model.unknowns.iter().position(|u| u.kind == UnknownKind::Exposure).map_or(1.0, |k| best.linear[k]);
    let linear = model.unknowns.iter().zip(&best.linear).map(|(u, value)| match u.kind {
        UnknownKind::Colour(..) => (u.bounds[1] - u.bounds[0]).max(PARAMS.least_range),
        UnknownKind::StrayLight(Shot::Distant(p), c) => model.input.photographs[p].mean[c].max(PARAMS.least_range),
        UnknownKind::StrayLight(Shot::CloseUp, c) => {
            (exposure * model.input.close_up.map_or(0.0, |found| found.mean[c])).max(PARAMS.least_range)
        }
        UnknownKind::Exposure => *value,
    });
    std::iter::repeat_n(1.0, variables).chain(linear).collect()
}

/// Which linear unknowns lie on a bound of their own and stay there: linear ones only, those of the search move on. Stray light does not stay
/// at none: that it may be more is what others are uncertain by.
fn on_walls(model: &Model<'_>, variables: usize, best: &Evaluated) -> Vec<bool> {
    let linear = model.unknowns.iter().zip(&best.linear).map(|(u, value)| {
        let [low, high] = u.bounds;
        let stays = !matches!(u.kind, UnknownKind::StrayLight(..));
        stays && (*value <= low + PARAMS.on_wall * (1.0 + low.abs()) || *value >= high - PARAMS.on_wall * (1.0 + high.abs()))
    });
    std::iter::repeat_n(false, variables).chain(linear).collect()
}

/// Pairs of unknowns whose correlation is over [`CORRELATED`], the largest first.
fn correlated(known: &[Known], covariance: &[f64]) -> Vec<Correlation> {
    let n = known.len();
    let mut correlations = Vec::new();
    for i in 0..n {
        for j in 0..i {
            let correlation = covariance[i * n + j] / (covariance[i * n + i] * covariance[j * n + j]).sqrt();
            if correlation.abs() > CORRELATED {
                correlations.push(Correlation { a: known[j].name.clone(), b: known[i].name.clone(), correlation });
            }
        }
    }
    correlations.sort_by(|a, b| b.correlation.abs().total_cmp(&a.correlation.abs()));
    correlations
}

/// Largest over smallest singular value of a matrix `A`, from its `AᵀA` of `n` rows; infinite if the smallest is 0.
fn condition(gram: &[f64], n: usize) -> f64 {
    let values = symmetric_eigenvalues(gram, n);
    let (low, high) = (values[0].max(0.0), values[n - 1]);
    if low > 0.0 { (high / low).sqrt() } else { f64::INFINITY }
}

/// What is known at the best point. `replicates` are the residuals there, colours and all, of models with other samples; `missing` what residuals change by where light
/// is added that the model leaves out.
pub fn identify(
    model: &Model<'_>,
    point: &[f64],
    best: &Evaluated,
    derivatives: &Derivatives,
    (replicates, missing): (&[Vec<f64>], Option<&[f64]>),
) -> Identified {
    let counts: Vec<f64> = best.rows.iter().map(|(row, _)| row.weight).chain(best.fixed.iter().map(|_| 1.0)).collect();
    let residuals: f64 = counts.iter().sum();
    let chi2 = derivatives.residuals.iter().map(|r| r * r).sum::<f64>() / residuals.max(1.0);
    let at = BestPoint {
        model,
        point,
        evaluated: best,
        derivatives,
        replicates,
        missing,
        range: ranges(model, point.len(), best),
        held: on_walls(model, point.len(), best),
        trust: trust(derivatives, &counts, model.input.photographs.len()),
    };
    let total = at.total();
    if total == 0 {
        return Identified { chi2, condition: 1.0, residuals, ..Identified::default() };
    }
    let Some(covariance) = at.covariance(&|_| true) else {
        return Identified { chi2, condition: f64::INFINITY, ..Identified::default() };
    };
    let has_close_up = derivatives.close_up.contains(&true);
    let without = if has_close_up { at.covariance(&|k| !derivatives.close_up[k]) } else { None };
    let share = |covariance: &[f64], i: usize| covariance[i * total + i].sqrt();
    let known: Vec<Known> = (0..total).map(|i| at.known(i, share(&covariance, i), without.as_ref().map(|w| share(w, i)))).collect();
    let correlations = correlated(&known, &covariance);
    let condition = condition(&derivatives.gram(&at.range, |_| 1.0), total);
    Identified { known, correlations, condition, chi2, residuals, covariance }
}

/// The values at the best point, where there was no time to tell how well they are known: standard deviations, χ² and condition are NaN.
pub fn values_only(model: &Model<'_>, point: &[f64], best: &Evaluated) -> Identified {
    let range = ranges(model, point.len(), best);
    let held = on_walls(model, point.len(), best);
    let known = |i: usize| {
        let known = match i.checked_sub(point.len()) {
            None => known_variable(model, point, i),
            Some(k) => known_linear(model, best, k, range[i], held[i]),
        };
        Known { sigma: f64::NAN, ..known }
    };
    Identified {
        known: (0..range.len()).map(known).collect(),
        condition: f64::NAN,
        chi2: f64::NAN,
        residuals: f64::NAN,
        ..Identified::default()
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// An unknown of a kind, between 0 and 1.
    pub fn known_as(name: &str, kind: &'static str) -> Known {
        Known { name: name.to_owned(), kind, ..Known::of(0.5, [0.0, 1.0]) }
    }

    #[test]
    fn what_answers_to_an_unknown_that_is_known_worse_is_known_worse_itself() {
        let known = |name: &str| Known { name: name.to_owned(), scale: 2.0, ..Known::of(1.0, [0.0, 1.0]) };
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
    fn the_scale_of_colours_is_known_no_better_than_the_irradiance() {
        let mut found = Identified { known: vec![known_as("a", "colour"), known_as("b", "parameter")], ..Identified::default() };
        found.covariance = vec![1e-4, 0.0, 0.0, 1e-4];
        found.known.iter_mut().for_each(|known| known.set_sigma(0.01));
        found.add_scale(0.05, true);
        let [a, b] = [0, 1].map(|k| &found.known[k]);
        assert!((a.sigma - 0.01_f64.hypot(0.025)).abs() < 1e-12 && a.sigma_of_ratio == Some(0.01) && a.scale_assumed, "{a:?}");
        assert!(b.sigma == 0.01 && b.sigma_of_ratio.is_none() && !b.scale_assumed, "{b:?}");
    }

    #[test]
    fn the_condition_of_a_known_matrix() {
        // Eigenvalues 2 - √2, 2, 2 + √2.
        let found = condition(&[2.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0], 3);
        assert!((found - ((2.0 + 2.0_f64.sqrt()) / (2.0 - 2.0_f64.sqrt())).sqrt()).abs() < 1e-12, "{found}");
        assert_eq!(condition(&[1.0, 0.0, 0.0, 0.0], 2), f64::INFINITY);
    }
}
