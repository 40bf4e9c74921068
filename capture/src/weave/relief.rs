//! Embossed surfaces: grooves, which repeat along one direction, and pyramids, which repeat along two with nothing crossing.

use super::input::RectifiedPhoto;
use super::measured::Measured;
use super::scale::Scale;
use glam::DVec2;
use serde::Serialize;

/// Class of a relief, as `biscale::geometry` knows them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// Two sides of about the same width.
    V {
        /// Width of the narrower side over the period.
        side: f64,
    },
    /// Two sides of different width.
    Sawtooth {
        /// Width of the steep side over the period.
        steep: f64,
    },
    /// Floor and top with steep sides between.
    Flat {
        /// Width of the floor, the darker part, over the period.
        floor: f64,
        /// Width of the tops over the period.
        top: f64,
    },
    /// Repeats along two directions.
    Pyramids,
}

/// An embossed surface.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Relief {
    /// Its class.
    pub profile: Profile,
    /// Distances after which it repeats: one across grooves, two for pyramids; in the unit of the analysis.
    pub period: Vec<Measured>,
    /// Counter-clockwise turn of the repetition from the x axis, in degrees.
    pub turn_deg: f64,
    /// Mean linear colour.
    pub colour: [f64; 3],
    /// Share of the brightness profile that levels of constant brightness explain (grooves).
    pub explained: f64,
}

/// How a profile of brightness is told. Chosen, not measured, on the grooves and pyramids of `capture/tests/weave`.
struct ReliefParams {
    /// Bins of a profile: an edge is located to 1/64 of the period.
    bins: usize,
    /// Difference of the sides' widths from half of the period below which they are those of a V.
    alike: f64,
    /// Width of a blurred edge in pixels: levels as narrow are edges.
    edge_pixels: f64,
    /// What four levels leave over what two leave, at most, where four are believed.
    levels_gain: f64,
    /// Places of a period in which repetition is measured.
    places: i64,
}

const PARAMS: ReliefParams = ReliefParams { bins: 64, alike: 0.12, edge_pixels: 2.0, levels_gain: 0.35, places: 16 };

/// Share of the variation across grooves that must repeat; of a single edge it is one over the periods that the cut holds, at most 1/3.5.
pub(super) const MIN_REPEATING: f64 = 0.4;

/// How much of the brightness across the first vector of the lattice repeats with it: of a surface all but noise, of one edge hardly any.
pub(super) fn repeating(scale: &Scale) -> f64 {
    let (field, f) = (&scale.field, scale.lattice.basis[0]);
    let mut profile: std::collections::BTreeMap<i64, [f64; 2]> = std::collections::BTreeMap::new();
    for row in 0..field.height {
        for column in 0..field.width {
            let pixel = row * field.width + column;
            if field.valid[pixel] {
                let place = (f.dot(field.position(column, row)) * PARAMS.places as f64).floor() as i64;
                let entry = profile.entry(place).or_default();
                *entry = [entry[0] + f64::from(field.ratio[pixel].iter().sum::<f32>()), entry[1] + 1.0];
            }
        }
    }
    let mut folded = vec![[0.0; 2]; PARAMS.places as usize];
    let mut all = [0.0; 2];
    for (place, value) in &profile {
        for sum in [&mut folded[place.rem_euclid(PARAMS.places) as usize], &mut all] {
            *sum = [sum[0] + value[0], sum[1] + value[1]];
        }
    }
    let mean = |v: [f64; 2]| v[0] / v[1].max(1.0);
    let (mut left, mut total) = (0.0, 0.0);
    for (place, value) in &profile {
        left += value[1] * (mean(*value) - mean(folded[place.rem_euclid(PARAMS.places) as usize])).powi(2);
        total += value[1] * (mean(*value) - mean(all)).powi(2);
    }
    if total > 0.0 { 1.0 - left / total } else { 0.0 }
}

/// The relief that a lattice of one or two vectors shows.
pub(super) fn describe(photo: &RectifiedPhoto<'_>, scale: &Scale) -> Relief {
    let unit = photo.mm_per_pixel.unwrap_or(1.0) * scale.field.factor as f64;
    let field = &scale.field;
    let (mut colour, mut count) = ([0.0; 3], 0.0_f64);
    for (rgb, _) in field.rgb.iter().zip(&field.valid).filter(|p| *p.1) {
        (0..3).for_each(|c| colour[c] += f64::from(rgb[c]));
        count += 1.0;
    }
    let colour = colour.map(|c| c / count.max(1.0));
    let measured = |f: DVec2, error: f64| {
        let period = 1.0 / f.length();
        Measured { value: period * unit, error: period * period * error * unit }
    };
    let lattice = &scale.lattice;
    let turn_deg = |f: DVec2| {
        let f = if f.x < 0.0 { -f } else { f };
        f.y.atan2(f.x).to_degrees()
    };
    if let [a, b] = lattice.basis[..] {
        // The vector nearer to x first.
        let (x, y) = if a.x.abs() * b.length() >= b.x.abs() * a.length() {
            ((a, [1.0, 0.0]), (b, [0.0, 1.0]))
        } else {
            ((b, [0.0, 1.0]), (a, [1.0, 0.0]))
        };
        let period = [x, y].map(|(f, [m, n])| measured(f, lattice.error_of(m, n))).to_vec();
        return Relief { profile: Profile::Pyramids, period, turn_deg: turn_deg(x.0), colour, explained: lattice.explained };
    }
    let f = lattice.basis[0];
    let (mut sums, mut counts) = (vec![0.0_f64; PARAMS.bins], vec![0.0_f64; PARAMS.bins]);
    for row in 0..field.height {
        for column in 0..field.width {
            let pixel = row * field.width + column;
            if field.valid[pixel] {
                let bin = ((f.dot(field.position(column, row)).rem_euclid(1.0) * PARAMS.bins as f64) as usize).min(PARAMS.bins - 1);
                sums[bin] += f64::from(field.ratio[pixel].iter().sum::<f32>());
                counts[bin] += 1.0;
            }
        }
    }
    let profile: Vec<f64> = (0..PARAMS.bins).map(|k| sums[k] / counts[k].max(1.0)).collect();
    let (_, widths, left_two, total) = levels(&profile, 2);
    let (four, parts, left_four, _) = levels(&profile, 4);
    let explained = 1.0 - left_two.min(left_four) / total.max(1e-12);
    let narrow = widths.iter().copied().fold(1.0, f64::min);
    // Levels as narrow as the lens blurs are edges.
    let seen = parts.iter().all(|p| p / f.length() > PARAMS.edge_pixels);
    let profile = if seen && left_four < PARAMS.levels_gain * left_two {
        // Tops and floor are opposite one another; the darker is the floor, which gets less light.
        let pair = usize::from(parts[1] + parts[3] > parts[0] + parts[2]);
        let (a, b) = (pair, pair + 2);
        let (floor, top) = if four[a] < four[b] { (parts[a], parts[b]) } else { (parts[b], parts[a]) };
        Profile::Flat { floor, top }
    } else if (0.5 - narrow).abs() < PARAMS.alike {
        Profile::V { side: narrow }
    } else {
        Profile::Sawtooth { steep: narrow }
    };
    Relief { profile, period: vec![measured(f, lattice.error_of(1.0, 0.0))], turn_deg: turn_deg(f), colour, explained }
}

/// The periodic profile of `k` constant levels nearest to a profile: levels, widths as shares, squares left, squares about the mean.
fn levels(profile: &[f64], k: usize) -> (Vec<f64>, Vec<f64>, f64, f64) {
    let n = profile.len();
    let mut best = (vec![0.0; k], vec![1.0 / k as f64; k], f64::INFINITY);
    let mean = profile.iter().sum::<f64>() / n as f64;
    let total = profile.iter().map(|v| (v - mean).powi(2)).sum();
    for start in 0..n {
        // Sums from the start; dynamic programming over where levels end.
        let at = |i: usize| profile[(start + i) % n];
        let (mut sum, mut square) = (vec![0.0; n + 1], vec![0.0; n + 1]);
        for i in 0..n {
            sum[i + 1] = sum[i] + at(i);
            square[i + 1] = square[i] + at(i) * at(i);
        }
        let cost = |i: usize, j: usize| {
            let s: f64 = sum[j] - sum[i];
            square[j] - square[i] - s * s / (j - i) as f64
        };
        let mut table = vec![vec![(f64::INFINITY, 0); n + 1]; k + 1];
        table[0][0] = (0.0, 0);
        for level in 1..=k {
            for j in level..=n {
                for i in level - 1..j {
                    let value = table[level - 1][i].0 + cost(i, j);
                    if value < table[level][j].0 {
                        table[level][j] = (value, i);
                    }
                }
            }
        }
        if table[k][n].0 < best.2 {
            let (mut ends, mut j) = (vec![n], n);
            for level in (1..=k).rev() {
                j = table[level][j].1;
                ends.push(j);
            }
            ends.reverse();
            let values = (0..k).map(|l| (sum[ends[l + 1]] - sum[ends[l]]) / (ends[l + 1] - ends[l]) as f64).collect();
            let widths = (0..k).map(|l| (ends[l + 1] - ends[l]) as f64 / n as f64).collect();
            best = (values, widths, table[k][n].0);
        }
    }
    (best.0, best.1, best.2, total)
}
