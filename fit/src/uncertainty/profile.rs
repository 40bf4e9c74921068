//! Profiles: how the objective rises when one unknown is held beside its best value, and all others answer.

use crate::parallel::in_parallel;
use crate::residuals::derivatives::{Derivatives, residuals};
use crate::residuals::equations::Evaluated;
use crate::residuals::model::Model;
use crate::residuals::unknowns::Variable;
use crate::uncertainty::identify::Identified;
use crate::uncertainty::params::PARAMS;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::numerics::linear_algebra::Cholesky;
use serde::Serialize;

/// The best objective that is found with one unknown held at some values.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Profile {
    /// Which unknown.
    pub name: String,
    /// Values and objectives.
    pub points: Vec<[f64; 2]>,
    /// By how much farther the unknown may move for the same rise of the objective than its derivatives say, 1 to [`WIDEST`]: a valley that bends is longer than it looks.
    pub wider: f64,
}

/// How much wider a valley counts at most: one that does not rise at all has bounds and priors to end it.
pub const WIDEST: f64 = 3.0;

/// Profiles of the `count` parameters that are known worst: each is held at values around the best one, and all others answer, by steps
/// with the derivatives at the best point. With each comes which of the unknowns it is. The objective of a profile is never better than it could be; it may be worse.
///
/// # Errors
/// Those of the model.
pub fn profiles(
    model: &Model<'_>,
    point: &[f64],
    best: &Evaluated,
    identified: &Identified,
    derivatives: &Derivatives,
    count: usize,
    control: &Control<'_>,
) -> Result<Vec<(usize, Profile)>> {
    let n = point.len();
    let mut worst: Vec<usize> = (0..n).filter(|&i| matches!(model.variables[i], Variable::Parameter(_))).collect();
    let share = |i: usize| identified.known.get(i).map_or(0.0, |k| k.sigma / k.range);
    worst.sort_by(|&a, &b| share(b).total_cmp(&share(a)).then(a.cmp(&b)));
    worst.truncate(count);
    let tasks: Vec<(usize, f64)> = worst
        .iter()
        .flat_map(|&i| {
            let sigma = share(i).clamp(PARAMS.profile_sigma[0], PARAMS.profile_sigma[1]);
            let mut at: Vec<f64> = PARAMS.profile.iter().map(|s| (point[i] + s * sigma).clamp(0.0, 1.0)).collect();
            at.dedup();
            at.into_iter().map(move |u| (i, u))
        })
        .collect();
    let objectives = in_parallel(&tasks, |_, &(held, value)| {
        let mut at = point.to_vec();
        let mut now = best.clone();
        let mut least = if value == point[held] { best.objective } else { f64::INFINITY };
        let mut step = value - point[held];
        for _ in 0..PARAMS.profile_steps {
            let weighted: Vec<f64> =
                residuals(&now).iter().enumerate().map(|(k, r)| r * best.rows.get(k).map_or(1.0, |(row, _)| row.weight).sqrt()).collect();
            let Some(answer) = answer(derivatives, held, step, &weighted) else { break };
            for (i, u) in at.iter_mut().enumerate() {
                *u = (*u + answer[i]).clamp(0.0, 1.0);
            }
            at[held] = value;
            step = 0.0;
            let Some(found) = model.evaluate(&at, control)? else { break };
            least = least.min(found.objective);
            now = found;
        }
        Ok(least)
    })?;
    let profile = |&i: &usize| {
        let points = tasks.iter().zip(&objectives).filter(|((k, _), f)| *k == i && f.is_finite());
        let points = points.map(|(&(_, u), &f)| [model.variables[i].at(model.input.spec, &model.unknowns, u), f]).collect();
        let sigma = share(i).clamp(PARAMS.profile_sigma[0], PARAMS.profile_sigma[1]);
        let telling = |u: f64| (PARAMS.telling[0]..=PARAMS.telling[1]).contains(&((u - point[i]) / sigma).abs());
        let wider = (tasks.iter().zip(&objectives))
            .filter(|((k, u), f)| *k == i && f.is_finite() && telling(*u))
            .map(|(&(_, u), &f)| wider(derivatives, i, u - point[i], identified.residuals * (f - best.objective)))
            .fold(1.0, f64::max);
        (i, Profile { name: model.variables[i].name(model.input.spec, &model.unknowns), points, wider })
    };
    Ok(worst.iter().map(profile).collect())
}

/// See [`Profile::wider`]: for a step of one unknown after which the sum of squares has risen by `rise`, all others having answered.
fn wider(derivatives: &Derivatives, held: usize, step: f64, rise: f64) -> f64 {
    let Some(answer) = answer(derivatives, held, step, &vec![0.0; derivatives.rows.len()]) else { return 1.0 };
    let expected: f64 = derivatives.rows.iter().map(|row| row.iter().zip(&answer).map(|(a, b)| a * b).sum::<f64>().powi(2)).sum();
    (expected / rise.max(expected / (WIDEST * WIDEST))).sqrt().max(1.0)
}

/// The least-squares step of all unknowns but `held` that answers to a step of that one.
fn answer(derivatives: &Derivatives, held: usize, step: f64, residuals: &[f64]) -> Option<Vec<f64>> {
    let n = derivatives.rows.first().map_or(0, Vec::len);
    let (mut gram, mut rhs) = (vec![0.0; n * n], vec![0.0; n]);
    for (row, r) in derivatives.rows.iter().zip(residuals) {
        let target = -(r + row[held] * step);
        for i in 0..n {
            if i == held || row[i] == 0.0 {
                continue;
            }
            rhs[i] += row[i] * target;
            for j in (0..n).filter(|&j| j != held) {
                gram[i * n + j] += row[i] * row[j];
            }
        }
    }
    gram[held * n + held] = 1.0;
    // What nothing tells stays.
    for i in 0..n {
        gram[i * n + i] += PARAMS.profile_ridge[0] * gram[i * n + i]
            + PARAMS.bounds_precision * f64::from(u8::from(i < derivatives.variables))
            + PARAMS.profile_ridge[1];
    }
    let mut step_of = Cholesky::new(&gram, n)?.solve(&rhs);
    step_of[held] = step;
    Some(step_of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_valley_is_as_wide_as_its_objective_says() {
        let d = Derivatives { rows: vec![vec![10.0]], close_up: vec![false], groups: vec![0], residuals: vec![0.0], variables: 1 };
        // The derivatives expect a rise of 4.
        for (rise, wide) in [(4.0, 1.0), (1.0, 2.0), (9.0, 1.0), (0.0, WIDEST), (-1.0, WIDEST)] {
            assert!((wider(&d, 0, 0.2, rise) - wide).abs() < 1e-12, "{rise}");
        }
    }

    #[test]
    fn the_answer_of_the_others_undoes_what_the_held_one_does() {
        // Two unknowns that do the same: one step forward is answered by one back.
        let rows = vec![vec![100.0, 100.0], vec![200.0, 200.0]];
        let d = Derivatives { rows, close_up: vec![false; 2], groups: vec![0; 2], residuals: vec![0.0; 2], variables: 2 };
        let found = answer(&d, 0, 0.1, &[0.0, 0.0]).unwrap();
        assert!((found[1] + 0.1).abs() < 1e-3 && found[0] == 0.1, "{found:?}");
    }
}
