//! Low-discrepancy points and the hashes that scramble them.
//!
//! Everything random in this crate comes from here or from [`super::random`]: a function of a seed and of indices, so that results do not
//! depend on the order in which threads work.

use super::cast::halves;
use super::random::hash_64;

/// A 32-bit fraction as a number in 0..1, at the middle of its step.
pub fn fraction(bits: u32) -> f64 {
    (f64::from(bits) + 0.5) / 4_294_967_296.0
}

/// Point `index` of the Sobol' sequence in two dimensions, Owen-scrambled by `seed`, as 32-bit fractions.
pub fn sobol_2d(index: u32, seed: u32) -> [u32; 2] {
    // The second dimension's generator matrix is Pascal's triangle mod 2: direction number k is the one before, added to itself shifted.
    let (mut second, mut direction, mut rest) = (0_u32, 1_u32 << 31, index);
    while rest != 0 {
        if rest & 1 == 1 {
            second ^= direction;
        }
        direction ^= direction >> 1;
        rest >>= 1;
    }
    [owen_scramble(index.reverse_bits(), hash(seed ^ hash(1))), owen_scramble(second, hash(seed ^ hash(2)))]
}

/// Point `index` of the Sobol' sequence in three dimensions, Owen-scrambled by `seed`, as 32-bit fractions; the first two are those of
/// [`sobol_2d`].
pub fn sobol_3d(index: u32, seed: u32) -> [u32; 3] {
    let [first, second] = sobol_2d(index, seed);
    // The third dimension of Joe and Kuo (2008): primitive polynomial x² + x + 1, first direction numbers 1 and 3.
    let (mut third, mut before, mut direction, mut rest) = (0_u32, 1_u32 << 31, 3_u32 << 30, index);
    while rest != 0 {
        if rest & 1 == 1 {
            third ^= before;
        }
        (before, direction) = (direction, direction ^ before ^ (before >> 2));
        rest >>= 1;
    }
    [first, second, owen_scramble(third, hash(seed ^ hash(3)))]
}

/// Nested uniform scramble by a hash in which each bit depends on higher bits only (Laine and Karras 2011, with the constants of
/// Vegdahl 2021, "Building a better LK hash").
fn owen_scramble(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// A hash of 32 bits with low bias (Wellons 2018, "lowbias32").
pub fn hash(mut x: u32) -> u32 {
    x = x.wrapping_add(0x9e37_79b9);
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ x >> 16
}

/// A number of the standard normal distribution: number `counter` of the stream `seed` (Box and Muller 1958).
pub fn gaussian(seed: u64, counter: u64) -> f64 {
    let bits = hash_64(hash_64(seed) ^ counter);
    let [radius, turn] = halves(bits).map(fraction);
    (-2.0 * libm::log(radius)).sqrt() * libm::cos(std::f64::consts::TAU * turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_aligned_block_of_points_has_one_in_each_elementary_interval() {
        const POINTS: u32 = 256;
        for start in [0, POINTS, 6 * POINTS] {
            for first_bits in 0..=8_u32 {
                let mut seen = vec![false; POINTS as usize];
                for index in start..start + POINTS {
                    let [x, y] = sobol_2d(index, 7);
                    let cell = (u64::from(x) >> (32 - first_bits) << (8 - first_bits) | u64::from(y) >> (24 + first_bits)) as usize;
                    assert!(!seen[cell], "two points of block {start} in interval {cell} of {first_bits} bits");
                    seen[cell] = true;
                }
            }
        }
    }

    #[test]
    fn each_coordinate_of_the_third_dimension_is_stratified() {
        for dimension in 0..3 {
            let mut strata: Vec<u32> = (512..1024).map(|index| sobol_3d(index, 3)[dimension] >> 23).collect();
            strata.sort_unstable();
            assert_eq!(strata, (0..512).collect::<Vec<_>>(), "dimension {dimension}");
        }
    }

    #[test]
    fn seeds_give_other_points() {
        assert_ne!(sobol_2d(5, 1), sobol_2d(5, 2));
        assert_ne!(hash(0), 0);
    }

    #[test]
    fn gaussian_numbers_have_the_moments_of_the_normal_distribution_and_neighbours_do_not_correlate() {
        const COUNT: u64 = 1 << 18;
        for seed in [0, 1, u64::MAX] {
            let mean = |f: &dyn Fn(u64) -> f64| (0..COUNT).map(f).sum::<f64>() / COUNT as f64;
            let power = |n: i32| mean(&|k| gaussian(seed, k).powi(n));
            // Standard errors: 1/sqrt(COUNT) = .002 times sqrt(1), sqrt(2), sqrt(15), sqrt(96); five of them are allowed.
            for (n, expected, allowed) in [(1, 0.0, 0.01), (2, 1.0, 0.014), (3, 0.0, 0.038), (4, 3.0, 0.096)] {
                assert!((power(n) - expected).abs() < allowed, "moment {n} of seed {seed}: {}", power(n));
            }
            let neighbours = mean(&|k| gaussian(seed, k) * gaussian(seed, k + 1));
            assert!(neighbours.abs() < 0.01, "seed {seed}: {neighbours}");
            let streams = mean(&|k| gaussian(seed, k) * gaussian(seed ^ 5, k));
            assert!(streams.abs() < 0.01, "seed {seed}: {streams}");
        }
    }
}
