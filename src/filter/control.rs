//! What a caller lends to a computation.

use crate::error::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};

/// What the caller lends.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Set to make the computation stop with [`Error::Interrupted`] soon.
    pub cancel: &'a AtomicBool,
    /// Told the name of the stage and the share of all work done so far, in `0..=1`; may be called from any thread.
    pub progress: &'a (dyn Fn(&str, f64) + Sync),
    /// Seconds since any fixed moment.
    pub clock: &'a (dyn Fn() -> f64 + Sync),
}

impl Control<'static> {
    /// Lends nothing: not to be stopped, nobody is told of progress, and the clock stands still, so that stages take no time and a
    /// [`Quality::budget`](super::Quality::budget) is never used up.
    pub fn quiet() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { cancel: &NEVER, progress: &|_, _| {}, clock: &|| 0.0 }
    }
}

impl Control<'_> {
    /// Stops with [`Error::Interrupted`] when the caller has asked for it.
    pub fn check(&self) -> Result<()> {
        if self.cancel.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
    }
}
