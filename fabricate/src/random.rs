//! Random numbers whose bits depend on the seed and nothing else.

/// The output function of `SplitMix64` (Steele, Lea and Flood 2014; Vigna's public-domain `splitmix64.c`).
#[derive(Clone, Debug)]
pub struct Random(u64);

/// `floor(2^64 / golden ratio)`, odd.
const GOLDEN_GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;

impl Random {
    /// Another seed gives another sequence.
    pub fn new(seed: u64) -> Self {
        Self(mix(seed.wrapping_mul(GOLDEN_GAMMA)))
    }

    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(GOLDEN_GAMMA);
        mix(self.0)
    }

    /// The next number in `0..1`.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A whole number below `n`, which is positive.
    pub fn below(&mut self, n: usize) -> usize {
        // The multiply-shift of Lemire 2019; its bias of n / 2^32 does not matter to a search.
        usize::try_from(((self.bits() >> 32) * n as u64) >> 32).expect("below n")
    }
}

fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number made of two: for signatures of shapes, not against an adversary.
pub fn hash(a: u64, b: u64) -> u64 {
    mix(a.rotate_left(5) ^ mix(b.wrapping_add(GOLDEN_GAMMA)))
}
