//! Progress of long work, on standard error.
//!
//! Nothing is shown in the first second. Then a terminal gets a bar; anything else (a log file) a line now and then. A thread of
//! its own does the showing, so that it goes on however rarely the work reports.

use super::interrupt;
use super::options::CommonArgs;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::numerics::cast::truncate_u64;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Work that is done sooner shows no progress.
const SILENT: Duration = Duration::from_secs(1);
/// Time between two states of the bar.
const BETWEEN_FRAMES: Duration = Duration::from_millis(100);
/// Time between two lines where there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);
/// Steps of the bar.
const STEPS: u64 = 1000;

/// What the work reported last: the stage, and the share of all work in `0..=1`.
type Latest = Mutex<(String, f64)>;

/// Runs `work` with a [`Control`] that shows its progress and stops it at Ctrl-C.
///
/// # Errors
/// Those of `work`; `Interrupted` also when Ctrl-C came before it began.
pub fn with_control<T>(common: &CommonArgs, work: impl FnOnce(&Control<'_>) -> Result<T>) -> Result<T> {
    let start = Instant::now();
    let latest = Latest::new(("working".to_owned(), 0.0));
    let report = |stage: &str, share: f64| {
        let mut latest = latest.lock().unwrap_or_else(PoisonError::into_inner);
        stage.clone_into(&mut latest.0);
        latest.1 = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    };
    let clock = || start.elapsed().as_secs_f64();
    let control = Control { cancel: interrupt::flag(), progress: &report, clock: &clock };
    control.check()?;
    if common.quiet {
        return work(&control);
    }
    std::thread::scope(|scope| {
        // The end of `working`, also by a panic, ends the showing.
        let (working, ended) = channel::<()>();
        scope.spawn(|| show(&latest, ended, start));
        let result = work(&control);
        drop(working);
        result
    })
}

/// Shows `latest` until `ended` is disconnected.
fn show(latest: &Latest, ended: Receiver<()>, start: Instant) {
    let goes_on = |pause: Duration| ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout);
    let now = || latest.lock().unwrap_or_else(PoisonError::into_inner).clone();
    if !goes_on(SILENT) {
        return;
    }
    if std::io::stderr().is_terminal() {
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
        bar.set_style(ProgressStyle::with_template("{msg:12} {wide_bar} {percent:>3} % {elapsed}").expect("the template is right"));
        loop {
            let (stage, share) = now();
            bar.set_message(stage);
            bar.set_position(truncate_u64(share * STEPS as f64));
            if !goes_on(BETWEEN_FRAMES) {
                break;
            }
        }
        bar.finish_and_clear();
    } else {
        loop {
            let (stage, share) = now();
            // A log that cannot be written must not stop the work.
            let _ = writeln!(std::io::stderr(), "{stage}: {:.0} % after {:.0} s", share * 100.0, start.elapsed().as_secs_f64());
            if !goes_on(BETWEEN_LINES) {
                break;
            }
        }
    }
}
