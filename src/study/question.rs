//! What every method is asked: lists of pairs of directions, made from a seed.

use crate::direction::Pair;
use crate::numerics::cast::halves;
use crate::numerics::low_discrepancy::{fraction, sobol_2d};
use crate::numerics::random::hash_64;
use crate::numerics::seed::fold;
use glam::DVec3;
use std::f64::consts::TAU;

/// Which of the questions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Asked {
    /// Some pairs, each with directions of its own.
    List,
    /// All pairs of some directions: what a table takes, and long enough for what pays over many pairs only.
    Table,
}

impl Asked {
    /// Both, in their order.
    pub const ALL: [Self; 2] = [Self::List, Self::Table];

    /// As files call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::List => "list",
            Self::Table => "table",
        }
    }
}

/// A question.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// All pairs that a method computes.
    pub pairs: Vec<Pair>,
    /// How many of them, from the first on, are compared with the truth.
    pub judged: usize,
}

/// Light of the slice, degrees from the normal.
const SLICE_LIGHT_DEG: f64 = 30.0;
/// Viewers of the slice: from minus this to this, degrees, in the plane of the light.
const SLICE_VIEW_DEG: i32 = 85;
const SLICE_STEP_DEG: usize = 5;

/// `count` pairs whose directions are independent and uniform in projected solid angle, and a slice: light at 30 degrees towards x, viewers
/// from -85 to 85 degrees in its plane.
pub fn list(count: usize, seed: u64) -> Question {
    let mut bits = (0_u64..).map(|k| hash_64(hash_64(seed) ^ k));
    let mut direction = || {
        let word = bits.next().expect("an endless stream");
        // Each half is one number.
        let [first, second] = halves(word).map(fraction);
        on_disc(first, second)
    };
    let mut pairs: Vec<Pair> = (0..count).map(|_| Pair { wi: direction(), wo: direction() }).collect();
    let in_plane = |deg: f64| DVec3::new(deg.to_radians().sin(), 0.0, deg.to_radians().cos());
    let viewers = (-SLICE_VIEW_DEG..=SLICE_VIEW_DEG).step_by(SLICE_STEP_DEG);
    pairs.extend(viewers.map(|deg| Pair { wi: in_plane(SLICE_LIGHT_DEG), wo: in_plane(deg.into()) }));
    Question { judged: pairs.len(), pairs }
}

/// All pairs of `count` directions that cover the hemisphere evenly in projected solid angle; `judged` of them, drawn at random, come first.
pub fn table(count: usize, judged: usize, seed: u64) -> Question {
    let scramble = fold(seed);
    let directions: Vec<DVec3> = (0_u32..)
        .take(count)
        .map(|k| {
            let [a, b] = sobol_2d(k, scramble);
            on_disc(fraction(a), fraction(b))
        })
        .collect();
    let mut pairs: Vec<Pair> = directions.iter().flat_map(|&wo| directions.iter().map(move |&wi| Pair { wi, wo })).collect();
    let judged = judged.min(pairs.len());
    // The first steps of a shuffle (Fisher and Yates).
    for k in 0..judged {
        let left = (pairs.len() - k) as u64;
        #[expect(clippy::cast_possible_truncation, reason = "below the number of pairs")]
        let step = ((u128::from(hash_64(hash_64(seed ^ 1) ^ k as u64)) * u128::from(left)) >> 64) as usize;
        pairs.swap(k, k + step);
    }
    Question { pairs, judged }
}

/// The direction over a point of the unit disc whose squared radius is `first` and whose azimuth is `second` of a turn.
fn on_disc(first: f64, second: f64) -> DVec3 {
    let (r, azimuth) = (first.sqrt(), TAU * second);
    DVec3::new(r * libm::cos(azimuth), r * libm::sin(azimuth), (1.0 - first).max(0.0).sqrt()).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_are_uniform_in_projected_solid_angle() {
        const COUNT: usize = 20_000;
        for pairs in [list(COUNT, 3).pairs[..COUNT].to_vec(), table(150, 0, 3).pairs] {
            // Mean of cos under the density cos/pi is 2/3, of its square 1/2; the standard deviation of cos is .24.
            let mean = |f: &dyn Fn(&Pair) -> f64| pairs.iter().map(f).sum::<f64>() / pairs.len() as f64;
            assert!((mean(&|p| p.wi.z) - 2.0 / 3.0).abs() < 0.008);
            assert!((mean(&|p| p.wo.z * p.wo.z) - 0.5).abs() < 0.01);
            assert!(mean(&|p| p.wi.x).abs() < 0.02 && mean(&|p| p.wo.y).abs() < 0.02);
        }
    }

    #[test]
    fn a_table_has_each_pair_once_and_those_judged_first_are_a_random_part() {
        let whole = table(20, 0, 5);
        let part = table(20, 100, 5);
        assert_eq!((whole.pairs.len(), part.pairs.len(), part.judged), (400, 400, 100));
        let key = |p: &Pair| [p.wi, p.wo].map(|w| w.to_array().map(f64::to_bits));
        let mut keys: Vec<_> = part.pairs.iter().map(key).collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys.len(), 400);
        let first: Vec<DVec3> = part.pairs[..100].iter().map(|p| p.wo).collect();
        assert!(part.pairs.iter().filter(|p| first.contains(&p.wo)).count() > 380, "those judged leave directions out");
        assert_eq!(table(2, 100, 0).judged, 4);
    }

    #[test]
    fn another_seed_asks_other_pairs() {
        assert_ne!(list(10, 1).pairs[0], list(10, 2).pairs[0]);
        assert_ne!(table(10, 5, 1).pairs[0], table(10, 5, 2).pairs[0]);
    }
}
