//! The end of a time limit as computations see it: they are asked to stop, as an interrupt asks them.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// Time between two looks at the clock. Chosen, not measured: a tenth of the shortest limit that makes sense.
const BETWEEN_LOOKS: Duration = Duration::from_millis(5);

/// Does `work`, and sets `stop` for it once `over` holds.
pub(super) fn stopped_when<T>(stop: &AtomicBool, over: impl Fn() -> bool + Sync, work: impl FnOnce() -> T) -> T {
    std::thread::scope(|scope| {
        // The end of `working`, also by a panic, ends the looking.
        let (working, ended) = channel::<()>();
        let over = &over;
        let look = move || {
            while !over() {
                if ended.recv_timeout(BETWEEN_LOOKS) != Err(RecvTimeoutError::Timeout) {
                    return;
                }
            }
            stop.store(true, Ordering::Relaxed);
        };
        let looking = scope.spawn(look);
        let result = work();
        drop(working);
        if let Err(panic) = looking.join() {
            std::panic::resume_unwind(panic);
        }
        result
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    #[test]
    fn work_that_waits_for_the_end_is_told_and_work_that_ends_first_is_not_waited_for() {
        let begun = Instant::now();
        let stop = AtomicBool::new(false);
        let waited = stopped_when(
            &stop,
            || begun.elapsed() > Duration::from_millis(20),
            || {
                while !stop.load(Ordering::Relaxed) {
                    std::thread::yield_now();
                }
                7
            },
        );
        assert_eq!(waited, 7);
        let stop = AtomicBool::new(false);
        assert_eq!(stopped_when(&stop, || false, || 8), 8);
        assert!(!stop.load(Ordering::Relaxed));
    }
}
