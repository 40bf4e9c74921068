//! Where searches begin: the fit file's own start, and others spread over the bounds.

use crate::residuals::input::Interreflection;
use crate::residuals::model::{Model, Registration};
use crate::residuals::unknowns::Variable;
use biscale::numerics::cast::halves;
use biscale::numerics::low_discrepancy::{fraction, hash};
use serde::Serialize;
use std::sync::Arc;

/// Distance, in any coordinate of the unit box, from which on two minima are two.
pub const APART: f64 = 0.1;

/// One start of a search.
#[derive(Clone, Debug, Serialize)]
pub struct Start {
    /// Its number.
    pub number: usize,
    /// The point where it stands.
    pub point: Vec<f64>,
    /// The objective there.
    pub objective: f64,
    /// Evaluations of all stages, those between them included that find at what height the periods of the close-up are registered.
    pub evaluations: usize,
    /// Whether the last search of it ended because its points came together.
    pub converged: bool,
    /// Restarts after a simplex had degenerated, or to confirm.
    pub restarts: usize,
    /// Which surfaces the colour clusters of the close-up were taken for.
    pub choice: usize,
    /// How the periods of the close-up are registered, once it is known.
    pub registration: Option<Registration>,
    /// Light that was reflected more than once, once it is known.
    #[serde(skip)]
    pub interreflection: Option<Arc<Interreflection>>,
}

impl Start {
    /// One of which nothing is known yet.
    pub fn blank(choice: usize) -> Self {
        Self {
            number: 0,
            point: Vec::new(),
            objective: f64::INFINITY,
            evaluations: 0,
            converged: false,
            restarts: 0,
            choice,
            registration: None,
            interreflection: None,
        }
    }
}

/// Points of a Latin hypercube: in each coordinate one point in each of `count` equal parts.
pub fn latin_hypercube(count: usize, dimensions: usize, seed: u64) -> Vec<Vec<f64>> {
    let [high, low] = halves(seed);
    let seed = hash(low ^ hash(high));
    let mut points = vec![vec![0.0; dimensions]; count];
    for d in 0..dimensions {
        let number = |k: usize, salt: u32| hash(hash(seed ^ salt) ^ hash((k as u32) << 8 | d as u32));
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&k| (number(k, 0x51ed), k));
        for (part, &k) in order.iter().enumerate() {
            points[k][d] = (part as f64 + fraction(number(k, 0x7a3b))) / count as f64;
        }
    }
    points
}

/// Where the starts begin: the first one where the fit file says, the others spread over the bounds; all with the lights as they were given, and the blur as is usual of what
/// edges tell.
pub fn starts(model: &Model<'_>, count: usize, seed: u64) -> Vec<Vec<f64>> {
    let spread = latin_hypercube(count.saturating_sub(1), model.variables.len(), seed);
    let own = |variable: &Variable| match variable {
        Variable::Parameter(k) => model.input.spec.parameters[*k].to_unit(model.input.spec.parameters[*k].start),
        Variable::Light { .. } | Variable::Blur | Variable::Linear(_) => 0.5,
    };
    let first: Vec<f64> = model.variables.iter().map(own).collect();
    let mut points = vec![first];
    points.extend(spread.into_iter().map(|mut point| {
        for (u, variable) in point.iter_mut().zip(&model.variables) {
            if matches!(variable, Variable::Light { .. } | Variable::Blur) {
                *u = 0.5;
            }
        }
        point
    }));
    points.truncate(count.max(1));
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_latin_hypercube_has_one_point_in_each_part_of_each_coordinate() {
        for count in [1, 7, 8] {
            let points = latin_hypercube(count, 5, 42);
            for d in 0..5 {
                let mut parts: Vec<usize> = points.iter().map(|p| (p[d] * count as f64) as usize).collect();
                parts.sort_unstable();
                assert_eq!(parts, (0..count).collect::<Vec<_>>());
            }
            assert_ne!(points, latin_hypercube(count, 5, 43));
        }
    }
}
