//! Random numbers whose bits depend on nothing but the seed.

/// Counter-based uniform numbers: number `k` of a seed is a hash of both, the same on every platform and in every version.
///
/// The hash is the output function of `SplitMix64` (Steele, Lea and Flood 2014, "Fast splittable pseudorandom number generators", and
/// Vigna's public-domain `splitmix64.c`): the state advances by the golden gamma, each output is mixed on its own.
#[derive(Clone, Debug)]
pub(super) struct Uniform {
    state: u64,
}

/// `floor(2^64 / golden ratio)`, odd.
const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

impl Uniform {
    pub(super) fn new(seed: u32) -> Self {
        // One round apart from the stream itself, so that neighbouring seeds share nothing.
        Self { state: mix(u64::from(seed).wrapping_mul(GOLDEN_GAMMA)) }
    }

    /// The next number in `0..1`, a multiple of 2^-53.
    pub(super) fn next(&mut self) -> f64 {
        self.state = self.state.wrapping_add(GOLDEN_GAMMA);
        (mix(self.state) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn mix(mut z: u64) -> u64 {
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
        let mut stream = Uniform { state: 1_234_567 };
        let expected = [6_457_827_717_110_365_317_u64, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423];
        for value in expected {
            assert_eq!(stream.next(), (value >> 11) as f64 / (1_u64 << 53) as f64);
        }
    }

    #[test]
    fn is_uniform_and_neighbouring_seeds_are_unrelated() {
        let draws = |seed| {
            let mut stream = Uniform::new(seed);
            (0..10_000).map(|_| stream.next()).collect::<Vec<f64>>()
        };
        let (a, b) = (draws(1), draws(2));
        let mean = a.iter().sum::<f64>() / 1e4;
        let correlation = a.iter().zip(&b).map(|(x, y)| (x - 0.5) * (y - 0.5)).sum::<f64>() / 1e4 * 12.0;
        // Five standard errors: sqrt(1/12/1e4) = .0029, and 1/sqrt(1e4) = .01.
        assert!((mean - 0.5).abs() < 0.0145, "mean {mean}");
        assert!(correlation.abs() < 0.05, "correlation {correlation}");
    }
}
