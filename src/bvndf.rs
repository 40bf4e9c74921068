//! The bidirectional visible normal distribution function: how much of each normal cluster two directions see (Wu et al. 2011, eq. 6 and 11).
//!
//! With facets of one area `dA`, `gamma(cluster; wi, wo) = dA · popcount(V(wi) & V(wo) & cluster)`. Facets of a cluster fill whole words,
//! and the replicate of a facet is its bit's place mod 8: the standard error needs eight counts. Words are turned ([`by_replicate`]) so that
//! each replicate has a byte of its own, once a direction; a pair then needs one `and` and one count of bits in bytes for all eight.
//! Counts are integers: equal bits give equal values at any number of threads.

/// Words whose counts fit the bytes of one number: each adds at most 8.
pub const WORDS_PER_BYTES: usize = 31;

/// Moves bit `8 a + b` to `8 b + a`: the facets of replicate `r` are then byte `r` (Warren, *Hacker's Delight*, section 7-3).
#[inline(always)]
pub const fn by_replicate(mut word: u64) -> u64 {
    let mut swap = (word ^ (word >> 7)) & 0x00AA_00AA_00AA_00AA;
    word ^= swap ^ (swap << 7);
    swap = (word ^ (word >> 14)) & 0x0000_CCCC_0000_CCCC;
    word ^= swap ^ (swap << 14);
    swap = (word ^ (word >> 28)) & 0x0000_0000_F0F0_F0F0;
    word ^ swap ^ (swap << 28)
}

/// Facets of a word, turned by [`by_replicate`], that both directions see: byte `r` for replicate `r`.
#[inline(always)]
pub const fn both_see(light: u64, viewer: u64) -> u64 {
    let both = light & viewer;
    let twos = both - ((both >> 1) & 0x5555_5555_5555_5555);
    let fours = (twos & 0x3333_3333_3333_3333) + ((twos >> 2) & 0x3333_3333_3333_3333);
    (fours + (fours >> 4)) & 0x0F0F_0F0F_0F0F_0F0F
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facets::REPLICATES;
    use crate::numerics::low_discrepancy::hash;

    #[test]
    fn counts_are_those_of_a_loop_over_bits() {
        let word = |k: u32| u64::from(hash(k)) << 32 | u64::from(hash(k + 1000));
        for words in [0, 1, 9, WORDS_PER_BYTES] {
            let (mut a, mut b): (Vec<u64>, Vec<u64>) = (0..words as u32).map(|k| (word(k), word(k + 100))).unzip();
            if words == WORDS_PER_BYTES {
                // The most that a byte has to hold.
                (a, b) = (vec![u64::MAX; words], vec![u64::MAX; words]);
            }
            let mut expected = [0; REPLICATES];
            for bit in 0..words * 64 {
                let see = |words: &[u64]| words[bit / 64] >> (bit % 64) & 1 == 1;
                expected[bit % REPLICATES] += u64::from(see(&a) && see(&b));
            }
            let counts: u64 = a.iter().zip(&b).map(|(&a, &b)| both_see(by_replicate(a), by_replicate(b))).sum();
            assert_eq!(std::array::from_fn::<u64, REPLICATES, _>(|r| counts >> (8 * r) & 0xFF), expected, "{words} words");
        }
    }

    #[test]
    fn turning_twice_gives_the_word_back() {
        for k in 0..64 {
            assert_eq!(by_replicate(1 << k), 1 << (k % 8 * 8 + k / 8));
            assert_eq!(by_replicate(by_replicate(1 << k)), 1 << k);
        }
    }
}
