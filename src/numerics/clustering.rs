//! Weighted k-means in any number of dimensions (Lloyd 1982), without random numbers.

/// A point, and how much it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weighted<const N: usize> {
    /// Where it lies.
    pub point: [f64; N],
    /// Its weight; points that do not weigh more than 0 are left out.
    pub weight: f64,
}

/// Most rounds: where clusters are told apart at all they settle in far fewer, and a few more change nothing that is seen.
const ROUNDS: usize = 60;
/// Distance, in units of the points, below which a centre has not moved. Chosen far below what is seen (ΔE of 1) and above rounding.
const SETTLED: f64 = 1e-6;

/// The cluster of each point, `None` of points without weight, and the number of clusters, at most `k`. Each cluster has a member.
///
/// The first centre is the mean, each further one the point with the largest weighted squared distance from all centres so far; where two are
/// wanted, the first then is the mirror image of the second at the mean. So the same points give the same clusters.
pub fn k_means<const N: usize>(points: &[Weighted<N>], k: usize) -> (Vec<Option<usize>>, usize) {
    let total: f64 = points.iter().filter(|p| p.weight > 0.0).map(|p| p.weight).sum();
    if total <= 0.0 || k == 0 {
        return (vec![None; points.len()], 0);
    }
    let mut centres = first_centres(points, total, k);
    let mut labels = Vec::new();
    for _ in 0..ROUNDS {
        labels = points.iter().map(|p| (p.weight > 0.0).then(|| nearest(&centres, p.point))).collect();
        let mut sums = vec![([0.0; N], 0.0); centres.len()];
        for (p, label) in points.iter().zip(&labels) {
            if let Some(label) = *label {
                (0..N).for_each(|c| sums[label].0[c] += p.point[c] * p.weight);
                sums[label].1 += p.weight;
            }
        }
        // Clusters that have lost all members go, and the others move up.
        let new_label: Vec<usize> = (0..sums.len()).map(|l| sums[..l].iter().filter(|s| s.1 > 0.0).count()).collect();
        labels.iter_mut().for_each(|label| *label = label.map(|l| new_label[l]));
        let means: Vec<[f64; N]> = sums.iter().filter(|s| s.1 > 0.0).map(|s| s.0.map(|v| v / s.1)).collect();
        let moved = means.len() != centres.len() || means.iter().zip(&centres).any(|(m, c)| distance(*m, *c) > SETTLED);
        centres = means;
        if !moved {
            break;
        }
    }
    (labels, centres.len())
}

fn first_centres<const N: usize>(points: &[Weighted<N>], total: f64, k: usize) -> Vec<[f64; N]> {
    let heavy = || points.iter().filter(|p| p.weight > 0.0);
    let mean: [f64; N] = std::array::from_fn(|c| heavy().map(|p| p.point[c] * p.weight).sum::<f64>() / total);
    let mut centres = vec![mean];
    let mut to_nearest: Vec<f64> = heavy().map(|p| distance(mean, p.point)).collect();
    while centres.len() < k {
        let far = |(p, d): &(&Weighted<N>, &f64)| d.powi(2) * p.weight;
        let Some((next, _)) = heavy().zip(&to_nearest).max_by(|a, b| far(a).total_cmp(&far(b))) else { break };
        to_nearest = heavy().zip(&to_nearest).map(|(p, d)| d.min(distance(next.point, p.point))).collect();
        if centres.len() == 1 && k == 2 {
            // Two clusters lie on both sides of the mean.
            centres[0] = std::array::from_fn(|c| 2.0 * mean[c] - next.point[c]);
        }
        centres.push(next.point);
    }
    centres
}

fn nearest<const N: usize>(centres: &[[f64; N]], point: [f64; N]) -> usize {
    (0..centres.len()).min_by(|&a, &b| distance(centres[a], point).total_cmp(&distance(centres[b], point))).expect("there are centres")
}

fn distance<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    (0..N).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_clouds_are_told_apart_whatever_their_weights() {
        for heavy in [1.0, 100.0] {
            let cloud = |x: f64, weight: f64| (0..20).map(move |k| Weighted { point: [x + 0.01 * f64::from(k), 0.0, 1.0], weight });
            let points: Vec<Weighted<3>> = cloud(0.0, heavy).chain(cloud(5.0, 1.0)).collect();
            let (labels, count) = k_means(&points, 2);
            assert_eq!(count, 2);
            assert!(
                labels[..20].iter().all(|l| *l == labels[0]) && labels[20..].iter().all(|l| *l == labels[20]) && labels[0] != labels[20]
            );
        }
    }

    #[test]
    fn equal_points_are_one_cluster_and_weightless_ones_none() {
        let p = |weight| Weighted { point: [1.0, 2.0, 3.0], weight };
        assert_eq!(k_means(&[p(1.0), p(0.0), p(2.0)], 3), (vec![Some(0), None, Some(0)], 1));
        assert_eq!(k_means(&[p(0.0)], 2), (vec![None], 0));
        assert_eq!(k_means::<3>(&[], 2), (vec![], 0));
        assert_eq!(k_means(&[p(1.0)], 0), (vec![None], 0));
    }
}
