//! Equations, linear in the unknowns: what the photographs and priors ask of the colours, and the ones that answer best.

use crate::bounded_least_squares::Normal;
use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::params::PARAMS;

/// Residuals beyond this many standard deviations count linearly.
const HUBER: f64 = PARAMS.huber;

/// One equation, linear in the unknowns.
#[derive(Clone, Debug, Default)]
pub struct Row {
    /// Coefficients.
    pub terms: Vec<(usize, f64)>,
    /// What the left side is beside them.
    pub known: f64,
    /// The right side.
    pub value: f64,
    /// Standard deviation.
    pub sigma: f64,
    /// How many residuals it counts for.
    pub weight: f64,
}

/// What the photographs and priors ask of a state.
#[derive(Clone, Debug, Default)]
pub struct Equations {
    /// Rows with their origins.
    pub rows: Vec<(Row, Origin)>,
    /// Residuals that do not depend on the unknowns, in standard deviations, with their origins.
    pub fixed: Vec<(f64, Origin)>,
}

/// Where a row, or a residual that no unknown changes, comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A bin of a distant photograph: photograph, bin, channel.
    Bin(usize, usize, usize),
    /// The close-up: the light of a cluster, of a tone, or of a bin of its mean period; the cover of a cluster.
    CloseUp,
    /// Something known beforehand.
    Prior,
}

/// A guess evaluated.
#[derive(Clone, Debug)]
pub struct Evaluated {
    /// The weighted mean of the squared residuals, Huber's: 1 where they are as large as the standard deviations assumed.
    pub objective: f64,
    /// The unknowns.
    pub linear: Vec<f64>,
    /// All rows with their origins.
    pub rows: Vec<(Row, Origin)>,
    /// Residuals of what does not depend on the unknowns: covers and priors of parameters, in standard deviations, with their origins.
    pub fixed: Vec<(f64, Origin)>,
}

impl Evaluated {
    /// The residual of a row in standard deviations.
    pub fn residual(&self, row: &Row) -> f64 {
        let sum: f64 = row.terms.iter().map(|&(i, a)| a * self.linear[i]).sum();
        (sum + row.known - row.value) / row.sigma
    }

    /// The origins of all residuals: those of the rows, then those that no unknown changes.
    pub fn origins(&self) -> impl Iterator<Item = Origin> {
        self.rows.iter().map(|(_, origin)| *origin).chain(self.fixed.iter().map(|(_, origin)| *origin))
    }

    /// The radiance that the model shows in the bins of a distant photograph.
    pub fn predicted(&self, photograph: usize, bins: &DirectionBins) -> Vec<[f64; 3]> {
        let mut predicted = vec![[0.0; 3]; bins.bins.len()];
        for (row, origin) in &self.rows {
            if let Origin::Bin(p, bin, c) = *origin
                && p == photograph
            {
                predicted[bin][c] = row.value + self.residual(row) * row.sigma;
            }
        }
        predicted
    }

    /// Relative RMS difference from the distant photographs: see [`DirectionBins::relative_rms`].
    pub fn relative_rms(&self, photographs: &[DirectionBins]) -> f64 {
        let squares = photographs.iter().enumerate().map(|(p, bins)| bins.squares(&self.predicted(p, bins)));
        let (difference, energy) = squares.fold((0.0, 0.0), |sum, s| (sum.0 + s.0, sum.1 + s.1));
        if energy > 0.0 { (difference / energy).sqrt() } else { f64::INFINITY }
    }
}

/// Twice Huber's loss of a residual: its square, or linear beyond [`HUBER`].
pub fn huber(r: f64) -> f64 {
    let a = r.abs();
    if a <= HUBER { a * a } else { HUBER * (2.0 * a - HUBER) }
}

/// What a residual counts in the least squares that have the same slope as Huber's loss.
pub fn huber_weight(r: f64) -> f64 {
    if r.abs() <= HUBER { 1.0 } else { HUBER / r.abs() }
}

/// The unknowns that make Huber's loss of the rows least, by reweighted least squares.
pub fn solve(Equations { rows, fixed }: Equations, lower: &[f64], upper: &[f64]) -> Evaluated {
    let count = (rows.iter().map(|(row, _)| row.weight).sum::<f64>() + fixed.len() as f64).max(1e-9);
    let constant: f64 = fixed.iter().map(|&(r, _)| huber(r)).sum();
    let mut best = Evaluated { objective: f64::INFINITY, linear: vec![0.0; lower.len()], rows, fixed };
    let mut weights = vec![1.0; best.rows.len()];
    for _ in 0..PARAMS.huber_rounds {
        let mut normal = Normal::new(lower.len());
        for ((row, _), w) in best.rows.iter().zip(&weights) {
            normal.add(&row.terms, row.value - row.known, w * row.weight / (row.sigma * row.sigma));
        }
        best.linear = normal.solve(lower, upper);
        let residuals: Vec<f64> = best.rows.iter().map(|(row, _)| best.residual(row)).collect();
        let sum: f64 = residuals.iter().zip(&best.rows).map(|(&r, (row, _))| row.weight * huber(r)).sum();
        let objective = (sum + constant) / count;
        let settled = (best.objective - objective).abs() <= PARAMS.huber_settled * objective;
        best.objective = objective;
        if settled || residuals.iter().all(|r| r.abs() <= HUBER) && weights.iter().all(|&w| w == 1.0) {
            break;
        }
        weights = residuals.iter().copied().map(huber_weight).collect();
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_outlier_counts_linearly_and_hardly_moves_the_answer() {
        let row = |value| (Row { terms: vec![(0, 1.0)], known: 0.5, value, sigma: 0.01, weight: 1.0 }, Origin::Prior);
        let rows = vec![row(0.8), row(0.8), row(0.8), row(0.8), row(1.4)];
        let found = solve(Equations { rows, fixed: vec![(1.0, Origin::Prior)] }, &[0.0], &[1.0]);
        // Four residuals of x pull as much as the outlier does: 4 x = 2.5.
        assert!((found.linear[0] - (0.3 + 0.01 * 2.5 / 4.0)).abs() < 1e-6, "{found:?}");
        let r = found.residual(&found.rows[4].0);
        let expected = (4.0 * 0.625_f64.powi(2) + 2.5 * (2.0 * r.abs() - 2.5) + 1.0) / 6.0;
        assert!((found.objective - expected).abs() < 1e-4, "{found:?}");
    }
}
