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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_points_that_none_beats_are_on_the_frontier() {
        let points = [[3.0, 0.1], [1.0, 1.0], [2.0, 2.0], [2.0, 0.5], [2.0, 0.5], [4.0, 0.1], [f64::NAN, 0.0], [0.5, f64::INFINITY]];
        assert_eq!(frontier(&points), [1, 3, 0]);
        assert!(frontier(&[]).is_empty());
    }
}
