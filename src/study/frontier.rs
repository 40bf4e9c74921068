//! The Pareto frontier: runs that no other run beats in both cost and error.

/// Places of the points `[cost, error]` on the frontier, cheapest first: no other point is at most as dear and has at most its error, unless
/// it is equal in both and comes later. Points that are not finite are never on it.
pub fn frontier(points: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).filter(|&k| points[k].iter().all(|x| x.is_finite())).collect();
    order.sort_by(|&a, &b| points[a][0].total_cmp(&points[b][0]).then(points[a][1].total_cmp(&points[b][1])).then(a.cmp(&b)));
    let mut least = f64::INFINITY;
    order.retain(|&k| {
        let better = points[k][1] < least;
        least = least.min(points[k][1]);
        better
    });
    order
}

/// What the frontier of the points `[cost, error]` costs at an error: between two of its points by a power law, `None` where no point is as
/// exact, and that of the cheapest where an error is larger than any on it.
pub fn cost_at(points: &[[f64; 2]], error: f64) -> Option<f64> {
    let best: Vec<[f64; 2]> = frontier(points).into_iter().map(|k| points[k]).collect();
    let next = best.iter().position(|p| p[1] <= error)?;
    let after = best[next];
    let Some(before) = next.checked_sub(1).map(|k| best[k]) else { return Some(after[0]) };
    // An error of zero has no logarithm; nor has a cost.
    if after[1] <= 0.0 || before[0] <= 0.0 {
        return Some(after[0]);
    }
    let share = (error / before[1]).ln() / (after[1] / before[1]).ln();
    Some(before[0] * (after[0] / before[0]).powf(share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_points_that_none_beats_are_on_the_frontier() {
        let points = [[3.0, 0.1], [1.0, 1.0], [2.0, 2.0], [2.0, 0.5], [2.0, 0.5], [4.0, 0.1], [f64::NAN, 0.0], [0.5, f64::INFINITY]];
        assert_eq!(frontier(&points), [1, 3, 0]);
        assert!(frontier(&[]).is_empty());
    }

    #[test]
    fn cost_follows_a_power_law_between_points() {
        // A point that is beaten by another one changes nothing.
        let points = [[1.0, 0.1], [4.0, 0.05], [8.0, 0.06], [16.0, 0.025]];
        let cost = |error: f64| cost_at(&points, error);
        assert_eq!((cost(0.5), cost(0.1), cost(0.02)), (Some(1.0), Some(1.0), None));
        assert!((cost(0.05).unwrap() - 4.0).abs() < 1e-12);
        let middle = (0.1_f64 * 0.05).sqrt();
        assert!((cost(middle).unwrap() - 2.0).abs() < 1e-12);
        assert_eq!(cost_at(&[[1.0, 0.1], [2.0, 0.0]], 0.01), Some(2.0));
        assert_eq!(cost_at(&[], 0.01), None);
    }
}
