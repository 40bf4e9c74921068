//! Running a kernel with the widest registers that the machine has.
//!
//! Kernels are plain loops over arrays of lanes. Compiled for each level of the processor they become vector code, and since none of
//! them fuses or reorders additions, every level gives the same bits.

use pulp::{Arch, Simd, WithSimd};
use std::ops::AddAssign;

/// Numbers that kernels take at once.
pub const LANES: usize = 16;
/// One number for each of them.
pub type Lanes = [f32; LANES];

/// A kernel: its `run` and all that it calls must be `#[inline(always)]`, or they are compiled for the oldest processor.
pub trait Kernel {
    /// What it computes.
    type Output;
    /// Computes it.
    fn run(self) -> Self::Output;
}

/// Sum of `N` numbers, a power of two, halved again and again: short chains of additions.
#[inline(always)]
pub fn sum<T: Copy + AddAssign, const N: usize>(mut x: [T; N]) -> T {
    let mut n = N;
    while n > 1 {
        n /= 2;
        for r in 0..n {
            let other = x[r + n];
            x[r] += other;
        }
    }
    x[0]
}

struct Vectorised<K>(K);

impl<K: Kernel> WithSimd for Vectorised<K> {
    type Output = K::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> K::Output {
        self.0.run()
    }
}

/// Runs `kernel`, compiled for this machine's processor.
pub fn run<K: Kernel>(kernel: K) -> K::Output {
    Arch::new().dispatch(Vectorised(kernel))
}
