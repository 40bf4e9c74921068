//! The close-up beside the fitted material: its mean period bin by bin, or its colour clusters.

use crate::photograph::close_up::CloseUp;
use crate::residuals::equations::{Evaluated, Origin};

/// What the close-up shows, and what the material shows there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NearComparison {
    /// Bins of the mean period along x and y; none where colour clusters are compared.
    pub size: Option<[usize; 2]>,
    /// Radiance of the photograph: of each bin, or light and tones of each cluster, one after the other.
    pub seen: Vec<[f64; 3]>,
    /// The same of the material, with the stray light and the exposure that were found.
    pub model: Vec<[f64; 3]>,
    /// `sqrt(sum w d² / sum w v²)` over all of these, where `d` is the difference, `v` the photograph's value and `w` what it counts.
    pub relative_rms: f64,
}

impl NearComparison {
    /// Of an evaluation; `None` where the light of the close-up is not compared.
    pub fn of(close_up: &CloseUp, evaluated: &Evaluated) -> Option<Self> {
        let mut found = Self { size: close_up.mean_period.as_ref().map(|mean| mean.size), ..Self::default() };
        let (mut difference, mut energy) = (0.0, 0.0);
        for rows in evaluated.rows.iter().filter(|(_, origin)| *origin == Origin::CloseUp).collect::<Vec<_>>().chunks_exact(3) {
            let (mut seen, mut shown) = ([0.0; 3], [0.0; 3]);
            for (c, (row, _)) in rows.iter().enumerate() {
                let off = evaluated.residual(row) * row.sigma;
                seen[c] = row.value;
                shown[c] = row.value + off;
                difference += row.weight * off * off;
                energy += row.weight * seen[c] * seen[c];
            }
            found.seen.push(seen);
            found.model.push(shown);
        }
        found.relative_rms = if energy > 0.0 { (difference / energy).sqrt() } else { f64::INFINITY };
        (!found.seen.is_empty()).then_some(found)
    }
}
