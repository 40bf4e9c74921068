//! Derivatives of the residuals by all unknowns, by central differences over a step that visibility bits do not spoil.

use crate::parallel::in_parallel;
use crate::residuals::equations::{Evaluated, Origin, huber_weight};
use crate::residuals::model::Model;
use crate::residuals::params::PARAMS;
use crate::residuals::unknowns::UnknownKind;
use biscale::error::Result;
use biscale::filter::Control;

/// Derivatives of the residuals by the unknowns.
#[derive(Clone, Debug)]
pub struct Derivatives {
    /// One row a residual, weighted as Huber does: unknowns of the search (by unit of the box), then linear ones.
    pub rows: Vec<Vec<f64>>,
    /// Whether each row comes from the close-up.
    pub close_up: Vec<bool>,
    /// The group of each row: those that are explained well or badly together.
    pub groups: Vec<usize>,
    /// The residuals, weighted alike.
    pub residuals: Vec<f64>,
    /// Unknowns of the search.
    pub variables: usize,
}

/// All residuals of an evaluation, in standard deviations.
pub fn residuals(evaluated: &Evaluated) -> Vec<f64> {
    evaluated.rows.iter().map(|(row, _)| evaluated.residual(row)).chain(evaluated.fixed.iter().map(|(r, _)| *r)).collect()
}

/// The points at which residuals tell derivatives: a step back and a step on along each unknown of the search.
pub fn difference_points(point: &[f64]) -> Vec<Vec<f64>> {
    let side = |(i, step): (usize, f64)| {
        let mut at = point.to_vec();
        at[i] = (at[i] + step).clamp(0.0, 1.0);
        at
    };
    (0..point.len()).flat_map(|i| [(i, -PARAMS.difference_step), (i, PARAMS.difference_step)]).map(side).collect()
}

/// The derivatives at a point.
///
/// The rows of bins are linear in the colours; those of the close-up are so only as long as its pixels are clustered alike. How they are clustered answers to
/// the colours as well, and takes part of what a colour does away again: there the derivative is that of a step.
///
/// # Errors
/// Those of the model.
pub fn derivatives(model: &Model<'_>, point: &[f64], best: &Evaluated, control: &Control<'_>) -> Result<Derivatives> {
    let moved = in_parallel(&difference_points(point), |_, at| model.evaluate_with(at, Some(&best.linear), control))?;
    let mut derivatives = derivatives_of(model, point, best, &moved);
    if model.input.close_up.is_none() {
        return Ok(derivatives);
    }
    let n = point.len();
    let colours = (0..best.linear.len()).filter(|&k| matches!(model.unknowns[k].kind, UnknownKind::Colour(..)));
    let steps: Vec<(usize, [f64; 2])> = colours
        .map(|k| {
            let [low, high] = model.unknowns[k].bounds;
            let step = (PARAMS.colour_step * best.linear[k]).max(PARAMS.least_colour_step);
            (k, [-step, step].map(|s| (best.linear[k] + s).clamp(low, high)))
        })
        .filter(|(_, [low, high])| high > low)
        .collect();
    let tasks: Vec<(usize, f64)> = steps.iter().flat_map(|&(k, ends)| ends.map(|end| (k, end))).collect();
    let found = in_parallel(&tasks, |_, &(k, value)| {
        let mut linear = best.linear.clone();
        linear[k] = value;
        Ok(model.evaluate_with(point, Some(&linear), control)?.map(|e| residuals(&e)))
    })?;
    let weights = weights(best);
    for (&(k, [low, high]), ends) in steps.iter().zip(found.chunks(2)) {
        let [Some(before), Some(after)] = ends else { continue };
        for (row, derivative) in derivatives.rows.iter_mut().enumerate().filter(|(row, _)| derivatives.close_up[*row]) {
            derivative[n + k] = weights[row] * (after[row] - before[row]) / (high - low);
        }
    }
    Ok(derivatives)
}

/// Roots of the weights of all residuals: their own, and Huber's.
pub fn weights(best: &Evaluated) -> Vec<f64> {
    let weight = |k: usize| best.rows.get(k).map_or(1.0, |(row, _)| row.weight);
    residuals(best).iter().enumerate().map(|(k, r)| (weight(k) * huber_weight(*r)).sqrt()).collect()
}

/// The derivatives at a point, from the evaluations of its [`difference_points`] with the linear unknowns held; `None` of those that make no surface.
pub fn derivatives_of(model: &Model<'_>, point: &[f64], best: &Evaluated, moved: &[Option<Evaluated>]) -> Derivatives {
    let n = point.len();
    let places = difference_points(point);
    let here = residuals(best);
    let total = n + best.linear.len();
    let mut rows = vec![vec![0.0; total]; here.len()];
    for i in 0..n {
        // Where a side makes no surface the other one does with the middle.
        let side = |k: usize| match &moved[2 * i + k] {
            Some(evaluated) => (places[2 * i + k][i], residuals(evaluated)),
            None => (point[i], here.clone()),
        };
        let ((low, before), (high, after)) = (side(0), side(1));
        if high > low {
            for (k, row) in rows.iter_mut().enumerate() {
                row[i] = (after[k] - before[k]) / (high - low);
            }
        }
    }
    for (k, (row, _)) in best.rows.iter().enumerate() {
        for &(j, a) in &row.terms {
            rows[k][n + j] += a / row.sigma;
        }
    }
    let close_up: Vec<bool> = best.origins().map(|origin| origin == Origin::CloseUp).collect();
    let photographs = model.input.photographs.len();
    let group = |origin| match origin {
        Origin::Bin(p, ..) => p,
        Origin::CloseUp => photographs,
        Origin::Prior => photographs + 1,
    };
    let groups = best.origins().map(group).collect();
    let weights = weights(best);
    for (row, w) in rows.iter_mut().zip(&weights) {
        row.iter_mut().for_each(|v| *v *= w);
    }
    let residuals = here.iter().zip(&weights).map(|(r, w)| r * w).collect();
    Derivatives { rows, close_up, groups, residuals, variables: n }
}

impl Derivatives {
    /// `Jᵀ W J` with a weight for each row, unknowns in units of `range`.
    pub fn gram(&self, range: &[f64], weight: impl Fn(usize) -> f64) -> Vec<f64> {
        let n = range.len();
        let mut gram = vec![0.0; n * n];
        for (k, row) in self.rows.iter().enumerate() {
            let w = weight(k);
            for i in (0..n).filter(|&i| w * row[i] != 0.0) {
                for j in 0..n {
                    gram[i * n + j] += w * row[i] * range[i] * row[j] * range[j];
                }
            }
        }
        gram
    }
}
