//! What decoders have in common.

use crate::error::BadInput;
use rayon::prelude::*;

/// Most bytes that decoding may take.
pub const MAX_BYTES: u64 = 1 << 30;

/// One or three channels, and alpha.
pub type Channels = (Vec<Vec<f32>>, Option<Vec<f32>>);

pub fn unreadable(kind: &str, why: impl std::fmt::Display) -> BadInput {
    BadInput::new(format!("not a readable {kind} image: {why}"), "write the image again")
}

/// Splits interleaved samples of a kind into channels of floats and alpha, the last of two or four.
pub fn deinterleave<T: Copy + Sync>(samples: &[T], stride: usize, value: impl Fn(T) -> f32 + Sync) -> Channels {
    let channel = |c: usize| samples.par_chunks_exact(stride).map(|pixel| value(pixel[c])).collect();
    let alpha = matches!(stride, 2 | 4).then(|| channel(stride - 1));
    ((0..if stride >= 3 { 3 } else { 1 }).map(channel).collect(), alpha)
}
