//! From the 64-bit seed of a caller to the 32-bit seeds of scrambled sequences.

use super::cast::halves;
use super::low_discrepancy::hash;

/// The 32-bit seed of a 64-bit one: both halves take part, `hash(hash(low) ^ high)`. About 1 in 4 · 10⁹ pairs of seeds collide.
///
/// A stream of its own is had by flipping bits of the seed first: `fold(seed ^ u64::from(SALT))`.
pub fn fold(seed: u64) -> u32 {
    let [high, low] = halves(seed);
    hash(hash(low) ^ high)
}

/// The 32-bit seed of a 64-bit one and of indices (of a pair, a batch, a pixel): equal only if all are equal, up to collisions.
///
/// `h ← hash(h ^ hash(word))` over the high half, the low half and the indices, from 0. It is not [`fold`] where there are no indices: sequences
/// of the two are independent.
pub fn fold_with(seed: u64, indices: &[u32]) -> u32 {
    halves(seed).into_iter().chain(indices.iter().copied()).fold(0, |h, word| hash(h ^ hash(word)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn each_half_and_each_index_gives_another_seed() {
        let seeds = [0, 1, 1 << 32, (1 << 32) | 1, u64::MAX];
        assert_eq!(seeds.iter().map(|&s| fold(s)).collect::<HashSet<u32>>().len(), seeds.len());
        let with = |s: u64, a: u32, b: u32| fold_with(s, &[a, b]);
        let all = [with(0, 0, 0), with(1, 0, 0), with(1 << 32, 0, 0), with(0, 1, 0), with(0, 0, 1), with(0, 1, 1), fold(0)];
        assert_eq!(HashSet::from(all).len(), all.len());
    }
}
