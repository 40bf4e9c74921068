//! Progress of long work, on standard error.
//!
//! Nothing is shown in the first second. Then a terminal gets a bar; anything else (a log file) a line now and then.

use crate::interrupt;
use crate::options::CommonArgs;
use biscale::error::Result;
use biscale::filter::Control;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Work that is done sooner shows no progress.
const SILENT: Duration = Duration::from_secs(1);
/// Time between two lines where there is no terminal.
const BETWEEN_LINES: Duration = Duration::from_secs(10);
/// Steps of the bar.
const STEPS: u64 = 1000;

/// Runs `work` with a [`Control`] that shows its progress and stops it at Ctrl-C.
///
/// # Errors
/// Those of `work`; `Interrupted` also when Ctrl-C came before it began.
pub fn with_control<T>(common: &CommonArgs, work: impl FnOnce(&Control<'_>) -> Result<T>) -> Result<T> {
    let progress = Progress::new(common.quiet);
    let start = Instant::now();
    let report = |stage: &str, share: f64| progress.report(stage, share);
    let clock = || start.elapsed().as_secs_f64();
    let control = Control { cancel: interrupt::flag(), progress: &report, clock: &clock };
    control.check()?;
    let result = work(&control);
    progress.clear();
    result
}

/// Shows how far the work is.
struct Progress {
    start: Instant,
    style: Style,
}

enum Style {
    Quiet,
    Bar(Mutex<Option<ProgressBar>>),
    /// When the last line was written.
    Lines(Mutex<Option<Instant>>),
}

impl Progress {
    fn new(quiet: bool) -> Self {
        let style = if quiet {
            Style::Quiet
        } else if std::io::stderr().is_terminal() {
            Style::Bar(Mutex::new(None))
        } else {
            Style::Lines(Mutex::new(None))
        };
        Self { start: Instant::now(), style }
    }

    /// Shows `share`, in `0..=1`, of the work; may be called from any thread and often.
    fn report(&self, stage: &str, share: f64) {
        if self.start.elapsed() < SILENT {
            return;
        }
        let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
        // A thread that finds another one at it leaves the showing to that one.
        match &self.style {
            Style::Quiet => {}
            Style::Bar(bar) => {
                if let Ok(mut bar) = bar.try_lock() {
                    let bar = bar.get_or_insert_with(new_bar);
                    bar.set_message(stage.to_owned());
                    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "share is in 0..=1")]
                    bar.set_position((share * STEPS as f64) as u64);
                }
            }
            Style::Lines(last) => {
                if let Ok(mut last) = last.try_lock()
                    && last.is_none_or(|l| l.elapsed() >= BETWEEN_LINES)
                {
                    *last = Some(Instant::now());
                    // A log that cannot be written must not stop the work.
                    let _ =
                        writeln!(std::io::stderr(), "{stage}: {:.0} % after {:.0} s", share * 100.0, self.start.elapsed().as_secs_f64());
                }
            }
        }
    }

    /// Takes the bar away.
    fn clear(&self) {
        if let Style::Bar(bar) = &self.style
            && let Some(bar) = bar.lock().unwrap_or_else(std::sync::PoisonError::into_inner).take()
        {
            bar.finish_and_clear();
        }
    }
}

fn new_bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{msg:12} {wide_bar} {percent:>3} % {elapsed}").expect("the template is right");
    ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr()).with_style(style)
}
