//! Random numbers whose bits depend on the seed and nothing else.

/// A stream of uniform numbers: number `k` of a seed is a hash of both, the same on every platform and in every version.
///
/// The hash is the output function of `SplitMix64` (Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators", and
/// Vigna's public-domain `splitmix64.c`): the state advances by the golden gamma, each output is mixed on its own.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

/// `floor(2^64 / golden ratio)`, odd.
const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

impl Random {
    /// Another seed gives another sequence.
    pub fn new(seed: u64) -> Self {
        // One round apart from the stream itself, so that neighbouring seeds share nothing.
        Self { state: mix(seed.wrapping_mul(GOLDEN_GAMMA)) }
    }

    /// The stream of `splitmix64.c` from a state.
    pub fn from_state(state: u64) -> Self {
        Self { state }
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GOLDEN_GAMMA);
        mix(self.state)
    }

    /// The next number in `0..1`, a multiple of 2^-53.
    pub fn unit(&mut self) -> f64 {
        to_unit(self.bits())
    }

    /// A whole number below `n`, which is positive.
    pub fn below(&mut self, n: usize) -> usize {
        // The multiply-shift of Lemire 2019; its bias of n / 2^32 does not matter to a search.
        usize::try_from(((self.bits() >> 32) * n as u64) >> 32).expect("below n")
    }
}

/// A number in `0..1`, a multiple of 2^-53, of 64 random bits.
pub fn to_unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

/// A hash of 64 bits: the `x`-th output of `SplitMix64` from 0 on.
pub fn hash_64(x: u64) -> u64 {
    mix(x.wrapping_add(1).wrapping_mul(GOLDEN_GAMMA))
}

/// The output function: changes about half of the bits when one of `z` changes.
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_the_published_numbers_of_splitmix64() {
        // First outputs of splitmix64.c for the state 1234567, as its test vectors list them.
        let mut stream = Random::from_state(1_234_567);
        let expected = [6_457_827_717_110_365_317_u64, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        for value in expected {
            assert_eq!(stream.unit(), (value >> 11) as f64 / (1_u64 << 53) as f64);
        }
    }

    #[test]
    fn is_uniform_and_neighbouring_seeds_are_unrelated() {
        let draws = |seed| {
            let mut stream = Random::new(seed);
            (0..10_000).map(|_| stream.unit()).collect::<Vec<f64>>()
        };
        let (a, b) = (draws(1), draws(2));
        let mean = a.iter().sum::<f64>() / 1e4;
        let correlation = a.iter().zip(&b).map(|(x, y)| (x - 0.5) * (y - 0.5)).sum::<f64>() / 1e4 * 12.0;
        // Five standard errors: sqrt(1/12/1e4) = .0029, and 1/sqrt(1e4) = .01.
        assert!((mean - 0.5).abs() < 0.0145, "mean {mean}");
        assert!(correlation.abs() < 0.05, "correlation {correlation}");
    }
}
