//! Conversions of numbers that may lose something, each with its rule.
//!
//! Three rules cover what the program needs: a real number is rounded to `f32` ([`narrow`]); its fraction is dropped and it saturates
//! at the ends of a whole type (`truncate_*`; write `truncate_u8((255.0 * x).round())` to round first); a count is converted exactly
//! ([`index_u32`]). They are what `as` does, under names that say so, so that a bare `as` which loses digits stays a lint.

/// The nearest `f32`; infinite beyond its range.
#[expect(clippy::cast_possible_truncation, reason = "rounding to nearest is what this is for")]
#[inline(always)]
pub const fn narrow(x: f64) -> f32 {
    x as f32
}

/// A count or an index that is known to be below 2^32: triangles, facets, nodes, pixels.
///
/// # Panics
/// With debug assertions, if it is not; the low 32 bits otherwise.
#[expect(clippy::cast_possible_truncation, reason = "asserted")]
#[inline(always)]
pub const fn index_u32(index: usize) -> u32 {
    debug_assert!(index as u64 <= u32::MAX as u64, "an index of 32 bits");
    index as u32
}

/// The high and the low 32 bits.
#[expect(clippy::cast_possible_truncation, reason = "both halves are kept")]
#[inline(always)]
pub const fn halves(bits: u64) -> [u32; 2] {
    [(bits >> 32) as u32, bits as u32]
}

macro_rules! truncate {
    ($($name:ident, $whole:ty;)*) => { $(
        #[doc = concat!("Drops the fraction, towards 0; the nearest `", stringify!($whole), "` of what is out of range, 0 of what is not a number.")]
        #[expect(clippy::allow_attributes, reason = "one macro for signed and unsigned types")]
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates by the rule above")]
        #[inline(always)]
        pub const fn $name(x: f64) -> $whole {
            x as $whole
        }
    )* };
}

truncate! {
    truncate_u8, u8;
    truncate_u32, u32;
    truncate_u64, u64;
    truncate_usize, usize;
    truncate_i32, i32;
    truncate_i64, i64;
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_narrowed_number_is_the_nearest() {
        assert_eq!(narrow(0.1), 0.1_f32);
        assert_eq!(narrow(1e300), f32::INFINITY);
        assert!(narrow(f64::NAN).is_nan());
    }

    #[test]
    fn whole_numbers_saturate_and_lose_their_fraction_towards_zero() {
        assert_eq!([truncate_u8(-1.0), truncate_u8(254.9), truncate_u8(1e9)], [0, 254, 255]);
        assert_eq!([truncate_u32(1e10), truncate_u32(f64::NAN)], [u32::MAX, 0]);
        assert_eq!([truncate_i32(-2.9), truncate_i32(-1e99)], [-2, i32::MIN]);
        assert_eq!([truncate_i64(2.9), truncate_i64(f64::INFINITY)], [2, i64::MAX]);
        assert_eq!((truncate_usize(7.5), truncate_u64(7.5)), (7, 7));
    }

    #[test]
    fn both_halves_of_a_word_are_kept() {
        assert_eq!(halves(0x0123_4567_89ab_cdef), [0x0123_4567, 0x89ab_cdef]);
        assert_eq!(index_u32(7), 7);
    }
}
