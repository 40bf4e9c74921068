//! What a caller lends to a computation.

use crate::error::{Error, Result};
use std::ops::Range;
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
    /// Does a part of the work, which is told the same but for its progress: `share` of the whole is this part's.
    pub fn part<T>(&self, share: Range<f64>, work: impl FnOnce(&Control<'_>) -> T) -> T {
        let progress = |stage: &str, done: f64| (self.progress)(stage, share.start + done.clamp(0.0, 1.0) * (share.end - share.start));
        work(&Control { progress: &progress, ..*self })
    }

    /// Stops with [`Error::Interrupted`] when the caller has asked for it.
    pub fn check(&self) -> Result<()> {
        if self.cancel.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
    }
}

/// The share of work that is done where more of it may turn out to be needed: the share that is left is divided anew among what is left, so that it
/// rises and never falls.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RisingShare(f64);

impl RisingShare {
    /// Of the share that is left, what stays for steps that nobody expects yet. Chosen, not measured.
    const KEPT: f64 = 0.05;

    /// The shares at which a step begins and ends that is `amount` of the work `left`, in any unit. `last` is one that surely nothing follows.
    pub fn step(&mut self, amount: f64, left: f64, last: bool) -> (f64, f64) {
        let begins = self.0;
        let part = if left > amount { amount / left } else { 1.0 };
        self.0 += (1.0 - begins) * part * if last { 1.0 } else { 1.0 - Self::KEPT };
        (begins, self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Mutex;

    #[test]
    fn shares_rise_towards_1_however_often_more_is_needed() {
        let mut share = RisingShare::default();
        let first = share.step(1.0, 4.0, false);
        assert!(first.0 == 0.0 && (0.2..0.25).contains(&first.1), "{first:?}");
        let mut before = first.1;
        for (amount, left) in [(1.0, 40.0), (2.0, 2.0), (4.0, 1.0), (f64::MAX, f64::MAX)] {
            let (begins, ends) = share.step(amount, left, false);
            assert!(begins == before && ends > begins && ends < 1.0, "{begins} to {ends}");
            before = ends;
        }
        assert_eq!(share.step(1.0, 1.0, true), (before, 1.0));
    }

    #[test]
    fn a_part_of_a_part_reports_its_share_of_the_whole() {
        let told = Mutex::new(Vec::new());
        let progress = |_: &str, share: f64| told.lock().unwrap().push(share);
        let control = Control { progress: &progress, ..Control::quiet() };
        control.part(0.5..1.0, |control| control.part(0.0..0.5, |control| [0.0, 0.5, 7.0].map(|done| (control.progress)("x", done))));
        assert_eq!(*told.lock().unwrap(), [0.5, 0.625, 0.75]);
    }
}
