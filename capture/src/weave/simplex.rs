//! Nelder and Mead's simplex search (1965).

/// The lowest point that a simplex (Nelder and Mead 1965) of given steps from `start` finds; `most` evaluations, about.
pub(super) fn simplex<const N: usize>(f: &impl Fn(&[f64; N]) -> f64, start: [f64; N], steps: [f64; N], most: usize) -> [f64; N] {
    let mut points: Vec<([f64; N], f64)> = vec![(start, f(&start))];
    for k in 0..N {
        let mut p = start;
        p[k] += steps[k];
        points.push((p, f(&p)));
    }
    let mut used = N + 1;
    while used < most {
        points.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (lowest, second, highest) = (points[0].1, points[N - 1].1, points[N].1);
        if highest - lowest < 1e-5 * lowest.abs() {
            break;
        }
        let mut middle = [0.0; N];
        for (p, _) in &points[..N] {
            (0..N).for_each(|k| middle[k] += p[k] / N as f64);
        }
        let worst = points[N].0;
        let along = |factor: f64| {
            let mut p = middle;
            (0..N).for_each(|k| p[k] += factor * (worst[k] - middle[k]));
            (p, f(&p))
        };
        let reflected = along(-1.0);
        used += 1;
        if reflected.1 < lowest {
            let expanded = along(-2.0);
            used += 1;
            points[N] = if expanded.1 < reflected.1 { expanded } else { reflected };
        } else if reflected.1 < second {
            points[N] = reflected;
        } else {
            let contracted = along(if reflected.1 < highest { -0.5 } else { 0.5 });
            used += 1;
            if contracted.1 < highest.min(reflected.1) {
                points[N] = contracted;
            } else {
                let best = points[0].0;
                for point in &mut points[1..] {
                    (0..N).for_each(|k| point.0[k] = 0.5 * (point.0[k] + best[k]));
                    point.1 = f(&point.0);
                }
                used += N;
            }
        }
    }
    points.into_iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or(start, |p| p.0)
}
