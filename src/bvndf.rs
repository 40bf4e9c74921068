//! The bidirectional visible normal distribution function: how much of each normal cluster two directions see (Wu et al. 2011, eq. 6 and 11).
//!
//! With facets of one area `dA`, `gamma(cluster; wi, wo) = dA · popcount(V(wi) & V(wo) & cluster)`. Facets of a cluster fill whole words,
//! and the set of a facet is its bit's place mod 8, so that eight masked popcounts a word give the eight sums that the standard
//! error needs. Counts are integers: equal bits give equal values at any number of threads.

use crate::facets::SETS;

/// One bit in each byte.
const EACH_BYTE: u64 = 0x0101_0101_0101_0101;

/// Facets that both directions see, for each set; `light` and `viewer` are the words of one cluster.
#[inline(always)]
pub fn both_see(light: &[u64], viewer: &[u64]) -> [u32; SETS] {
    let mut counts = [0; SETS];
    for (l, v) in light.iter().zip(viewer) {
        let both = l & v;
        for (r, count) in counts.iter_mut().enumerate() {
            *count += (both & (EACH_BYTE << r)).count_ones();
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::low_discrepancy::hash;

    #[test]
    fn counts_are_those_of_a_loop_over_bits() {
        let word = |k: u32| u64::from(hash(k)) << 32 | u64::from(hash(k + 1000));
        let (a, b): (Vec<u64>, Vec<u64>) = (0..9).map(|k| (word(k), word(k + 100))).unzip();
        let mut expected = [0; SETS];
        for bit in 0..9 * 64 {
            let see = |words: &[u64]| words[bit / 64] >> (bit % 64) & 1 == 1;
            expected[bit % SETS] += u32::from(see(&a) && see(&b));
        }
        assert_eq!(both_see(&a, &b), expected);
        assert_eq!(both_see(&[], &[]), [0; SETS]);
    }
}
