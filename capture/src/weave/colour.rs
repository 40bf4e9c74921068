//! Colours of the threads: k-means in Lab, whose distances are those of the eye.

/// One group of pixels of like colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColourCluster {
    /// Mean of the linear colours.
    pub linear: [f64; 3],
    /// Mean in Lab.
    pub lab: [f64; 3],
    /// Weight of its pixels.
    pub weight: f64,
}

/// Rounds of k-means; it settles in far fewer.
const ROUNDS: usize = 60;

/// CIE L*a*b* (D65) of a linear sRGB colour whose white is 1.
pub(super) fn lab(linear: [f64; 3]) -> [f64; 3] {
    let [r, g, b] = linear.map(|v| v.max(0.0));
    // IEC 61966-2-1, over the white point of D65.
    let x = (0.412_456_4 * r + 0.357_576_1 * g + 0.180_437_5 * b) / 0.950_47;
    let y = 0.212_672_9 * r + 0.715_152_2 * g + 0.072_175 * b;
    let z = (0.019_333_9 * r + 0.119_192 * g + 0.950_304_1 * b) / 1.088_83;
    let f = |t: f64| if t > (6.0_f64 / 29.0).powi(3) { t.cbrt() } else { t / (3.0 * (6.0_f64 / 29.0).powi(2)) + 4.0 / 29.0 };
    let (fx, fy, fz) = (f(x), f(y), f(z));
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// Distance of two colours, Delta E 1976.
pub(super) fn delta_e(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// At most `k` groups of weighted linear colours; `white` is the linear value that counts as white.
///
/// The first centre is the mean, each further one the colour farthest from all centres, weighted: no random numbers, the same groups each time.
pub(super) fn k_means(colours: &[([f64; 3], f64)], k: usize, white: f64) -> Vec<ColourCluster> {
    let scaled: Vec<([f64; 3], [f64; 3], f64)> =
        colours.iter().filter(|c| c.1 > 0.0).map(|&(linear, weight)| (linear, lab(linear.map(|v| v / white)), weight)).collect();
    let total: f64 = scaled.iter().map(|s| s.2).sum();
    if total <= 0.0 || k == 0 {
        return Vec::new();
    }
    let mean = [0, 1, 2].map(|c| scaled.iter().map(|s| s.1[c] * s.2).sum::<f64>() / total);
    let mut centres = vec![mean];
    while centres.len() < k {
        let far = |s: &([f64; 3], [f64; 3], f64)| centres.iter().map(|&c| delta_e(c, s.1)).fold(f64::INFINITY, f64::min).powi(2) * s.2;
        let Some(next) = scaled.iter().max_by(|a, b| far(a).total_cmp(&far(b))) else { break };
        if centres.len() == 1 && k == 2 {
            // Two groups lie on both sides of the mean.
            centres[0] = [0, 1, 2].map(|c| 2.0 * mean[c] - next.1[c]);
        }
        centres.push(next.1);
    }
    let mut groups = Vec::new();
    for _ in 0..ROUNDS {
        let mut sums = vec![([0.0; 3], [0.0; 3], 0.0); centres.len()];
        for (linear, lab, weight) in &scaled {
            let nearest = (0..centres.len()).min_by(|&a, &b| delta_e(centres[a], *lab).total_cmp(&delta_e(centres[b], *lab))).unwrap_or(0);
            let sum = &mut sums[nearest];
            (0..3).for_each(|c| {
                sum.0[c] += linear[c] * weight;
                sum.1[c] += lab[c] * weight;
            });
            sum.2 += weight;
        }
        groups = sums
            .iter()
            .filter(|s| s.2 > 0.0)
            .map(|s| ColourCluster { linear: s.0.map(|v| v / s.2), lab: s.1.map(|v| v / s.2), weight: s.2 })
            .collect();
        let moved = groups.len() != centres.len() || groups.iter().zip(&centres).any(|(g, &c)| delta_e(g.lab, c) > 1e-6);
        centres = groups.iter().map(|g| g.lab).collect();
        if !moved {
            break;
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lab_of_known_colours() {
        // The sRGB primaries and white in CIE L*a*b*, D65 (Lindbloom's calculator, two digits).
        for (linear, expected) in [
            ([1.0, 1.0, 1.0], [100.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]),
            ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ] {
            let found = lab(linear);
            assert!(delta_e(found, expected) < 0.05, "{linear:?}: {found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn two_colours_are_parted_and_counted() {
        let mut pixels = Vec::new();
        for k in 0..100 {
            let light = 0.7 + 0.006 * f64::from(k);
            pixels.push(([0.5, 0.1, 0.1].map(|v| v * light), 1.0));
            if k % 4 == 0 {
                pixels.push(([0.1, 0.2, 0.5].map(|v| v * light), 1.0));
            }
        }
        let groups = k_means(&pixels, 2, 1.0);
        let (red, blue) = if groups[0].linear[0] > groups[0].linear[2] { (groups[0], groups[1]) } else { (groups[1], groups[0]) };
        assert_eq!((red.weight, blue.weight), (100.0, 25.0));
        assert!((red.linear[0] / red.linear[1] - 5.0).abs() < 1e-9 && (blue.linear[2] / blue.linear[1] - 2.5).abs() < 1e-9);
    }
}
