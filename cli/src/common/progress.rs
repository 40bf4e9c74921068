//! Progress of long work, on standard error.
//!
//! Nothing is shown in the first second. Then a terminal gets a bar; anything else (a log file) a line now and then. A thread of
//! its own does the showing, so that it goes on however rarely the work reports. The bar never goes back, and is full only when the
//! work has ended.

use super::interrupt;
use super::options::CommonArgs;
use super::output::plain;
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
/// Most that is shown of work that has not ended.
const ALMOST: f64 = 0.99;
/// No remaining time is told of work that is younger, or has done less. Chosen, not measured.
const TOO_YOUNG: (f64, f64) = (3.0, 0.01);
/// Work that will take so much longer, once it is old enough to tell, is told about. Chosen, not measured.
const LONG: (f64, f64) = (60.0, 6.0);

/// Runs `work` with a [`Control`] that shows its progress and stops it at Ctrl-C.
///
/// # Errors
/// Those of `work`; `Interrupted` also when Ctrl-C came before it began.
pub fn with_control<T>(common: &CommonArgs, work: impl FnOnce(&Control<'_>) -> Result<T>) -> Result<T> {
    run(common, Latest::new(""), |control, _| work(control))
}

/// What the work may say while it runs: the seconds that it has left, and a text, which may be empty.
pub type Say<'a> = dyn Fn(f64, String) + 'a;

/// The same where `advice` says how to spend less time, in half a sentence: told once it shows that the work is long.
///
/// # Errors
/// As [`with_control`].
pub fn with_advice<T>(common: &CommonArgs, advice: &str, work: impl FnOnce(&Control<'_>) -> Result<T>) -> Result<T> {
    run(common, Latest::new(advice), |control, _| work(control))
}

/// The same for work that says itself what it has left, once it knows: until then its share tells no time.
///
/// # Errors
/// As [`with_control`].
pub fn with_forecast<T>(common: &CommonArgs, work: impl FnOnce(&Control<'_>, &Say<'_>) -> Result<T>) -> Result<T> {
    run(common, Latest { foresees: true, ..Latest::new("") }, work)
}

fn run<T>(common: &CommonArgs, latest: Latest, work: impl FnOnce(&Control<'_>, &Say<'_>) -> Result<T>) -> Result<T> {
    let start = Instant::now();
    let latest = Mutex::new(latest);
    let clock = || start.elapsed().as_secs_f64();
    let state = || latest.lock().unwrap_or_else(PoisonError::into_inner);
    let report = |stage: &str, share: f64| state().report(stage, share, clock());
    let say = |left: f64, text: String| state().say(left, text, clock());
    let control = Control { cancel: interrupt::flag(), progress: &report, clock: &clock };
    control.check()?;
    if common.quiet {
        return work(&control, &say);
    }
    std::thread::scope(|scope| {
        // The end of `working`, also by a panic, ends the showing.
        let (working, ended) = channel::<()>();
        scope.spawn(|| show(&latest, ended, start));
        let result = work(&control, &say);
        drop(working);
        result
    })
}

/// What the work reported last.
#[derive(Debug)]
struct Latest {
    stage: String,
    /// Share of all work, in `0..=1`; never falls.
    share: f64,
    /// Seconds and shares so far, at least a hundredth of the time apart: how fast the work is.
    history: Vec<(f64, f64)>,
    /// When the work knew what it had left: seconds, share, seconds left.
    foreseen: Option<(f64, f64, f64)>,
    /// Whether nothing is told of what is left before the work says it.
    foresees: bool,
    /// What is to be said and is not said yet.
    texts: Vec<String>,
    advice: Option<String>,
}

impl Latest {
    fn new(advice: &str) -> Self {
        let advice = Some(advice.to_owned()).filter(|a| !a.is_empty());
        Self {
            stage: "working".to_owned(),
            share: 0.0,
            history: vec![(0.0, 0.0)],
            foreseen: None,
            foresees: false,
            texts: Vec::new(),
            advice,
        }
    }

    fn report(&mut self, stage: &str, share: f64, now: f64) {
        plain(stage).as_ref().clone_into(&mut self.stage);
        if share.is_finite() {
            self.share = self.share.max(share.clamp(0.0, 1.0));
        }
        if self.history.last().is_none_or(|last| now > 1.01 * last.0 + 0.01) {
            self.history.push((now, self.share));
        }
    }

    fn say(&mut self, left: f64, text: String, now: f64) {
        self.texts.extend(Some(text).filter(|t| !t.is_empty()));
        self.foreseen = Some((now, self.share, left));
    }

    /// Seconds that are left: by the speed since half of the time; by what was foreseen until a fifth of that time has passed.
    fn left(&self, now: f64) -> Option<f64> {
        let (since, share) = match self.foreseen {
            None if self.foresees => return None,
            Some((then, _, left)) if now < then + 0.2 * left => return Some(left - (now - then)),
            Some((then, share, _)) if then > 0.5 * now => (then, share),
            _ => *self.history.iter().rfind(|(time, _)| *time <= 0.5 * now)?,
        };
        let speed = (self.share - share) / (now - since);
        (now >= TOO_YOUNG.0 && self.share >= TOO_YOUNG.1 && speed > 0.0).then(|| (1.0 - self.share) / speed)
    }

    /// What is to be said now, which takes it away.
    fn take_texts(&mut self, now: f64) -> Vec<String> {
        if let (Some(left), true) = (self.left(now), now >= LONG.1)
            && left >= LONG.0
            && let Some(advice) = self.advice.take()
        {
            self.texts.push(format!("this will take about {} more; {advice}", duration(left)));
        }
        std::mem::take(&mut self.texts)
    }

    /// `, 3 min left`, or nothing.
    fn left_in_words(&self, now: f64) -> String {
        self.left(now).map_or_else(String::new, |left| format!(", about {} left", duration(left)))
    }
}

/// A time as people say it: `12 s`, `3 min`, `2.5 h`.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 10.0 => format!("{:.0} s", s.max(1.0)),
        s if s < 57.5 => format!("{:.0} s", 5.0 * (s / 5.0).round()),
        s if s < 570.0 => format!("{:.0} min", (s / 60.0).max(1.0)),
        s if s < 3570.0 => format!("{:.0} min", 5.0 * (s / 300.0).round()),
        s => format!("{:.1} h", s / 3600.0),
    }
}

/// Shows `latest` until `ended` is disconnected.
fn show(latest: &Mutex<Latest>, ended: Receiver<()>, start: Instant) {
    let goes_on = |pause: Duration| ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout);
    let state = || latest.lock().unwrap_or_else(PoisonError::into_inner);
    let now = || start.elapsed().as_secs_f64();
    if !goes_on(SILENT) {
        return;
    }
    if std::io::stderr().is_terminal() {
        let bar = ProgressBar::with_draw_target(Some(STEPS), ProgressDrawTarget::stderr());
        bar.set_style(ProgressStyle::with_template("{wide_bar} {percent:>3} % {msg}").expect("the template is right"));
        loop {
            let mut state = state();
            state.take_texts(now()).iter().for_each(|text| bar.println(plain(text)));
            bar.set_message(format!("{} s{}: {}", now().trunc(), state.left_in_words(now()), state.stage));
            bar.set_position(truncate_u64(state.share.min(ALMOST) * STEPS as f64));
            drop(state);
            if !goes_on(BETWEEN_FRAMES) {
                break;
            }
        }
        bar.finish_and_clear();
    } else {
        let mut next_line = 0.0;
        loop {
            let mut state = state();
            let mut lines = state.take_texts(now());
            if now() >= next_line {
                next_line = now() + BETWEEN_LINES.as_secs_f64();
                let percent = 100.0 * state.share.min(ALMOST);
                lines.push(format!("{}: {percent:.0} % after {:.0} s{}", state.stage, now(), state.left_in_words(now())));
            }
            drop(state);
            for line in lines {
                // A log that cannot be written must not stop the work.
                let _ = writeln!(std::io::stderr(), "{}", plain(&line));
            }
            if !goes_on(BETWEEN_FRAMES) {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_never_goes_back_and_speed_tells_what_is_left() {
        let mut latest = Latest::new("");
        for (now, share) in [(1.0, 0.1), (2.0, 0.05), (4.0, f64::NAN), (5.0, 0.2), (10.0, 0.4)] {
            latest.report("sums", share, now);
        }
        assert_eq!(latest.share, 0.4);
        // From 5 s on .2 in 5 s: .6 take 15 s.
        let left = latest.left(10.0).unwrap();
        assert!((left - 15.0).abs() < 1e-9, "{left}");
        assert_eq!(Latest::new("").left(100.0), None, "nothing is known of work that never reported");
    }

    #[test]
    fn what_was_foreseen_counts_until_the_work_shows_its_speed() {
        let mut latest = Latest { foresees: true, ..Latest::new("") };
        latest.report("probes", 0.05, 1.0);
        latest.report("probes", 0.1, 2.0);
        assert_eq!(latest.left(3.5), None, "nobody knows yet");
        latest.say(100.0, "it will take 100 s".to_owned(), 2.0);
        assert_eq!(latest.left(12.0), Some(90.0));
        latest.report("sums", 0.55, 42.0);
        let left = latest.left(42.0).unwrap();
        assert!((left - 40.0).abs() < 1e-9, "{left}");
        assert_eq!(latest.take_texts(42.0), ["it will take 100 s"]);
    }

    #[test]
    fn long_work_is_told_about_once() {
        let mut latest = Latest::new("a looser `--tolerance` takes less");
        for second in 1..=12 {
            latest.report("rays", 0.001 * f64::from(second), f64::from(second));
        }
        assert_eq!(latest.take_texts(12.0), ["this will take about 15 min more; a looser `--tolerance` takes less"]);
        assert!(latest.take_texts(13.0).is_empty());
    }

    #[test]
    fn times_are_told_in_round_numbers() {
        for (seconds, told) in
            [(0.2, "1 s"), (7.4, "7 s"), (12.4, "10 s"), (58.0, "1 min"), (200.0, "3 min"), (840.0, "15 min"), (5400.0, "1.5 h")]
        {
            assert_eq!(duration(seconds), told);
        }
    }
}
