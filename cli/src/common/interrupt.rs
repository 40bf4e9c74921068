//! Ctrl-C.
//!
//! The first one asks the work to stop: the library looks at [`flag`] and returns `Interrupted`. A second one, or a program
//! that has not stopped two seconds later (it waits for input, or reads a large file), ends the process at once. Either way the
//! exit status is 130 and no temporary file stays.

use super::output;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

/// Exit status of an interrupted program, by convention 128 + SIGINT.
pub const STATUS: u8 = 130;

/// How long the work has to stop by itself, seconds.
static PATIENCE: AtomicU64 = AtomicU64::new(2);

static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Gives the work this long to stop by itself: for a command that then writes what it has.
pub fn be_patient(seconds: u64) {
    PATIENCE.store(seconds, Ordering::Relaxed);
}

/// Set once the user has asked to stop.
pub fn flag() -> &'static AtomicBool {
    &INTERRUPTED
}

/// Listens to Ctrl-C and to requests to terminate. Without a handler (the system refuses one) Ctrl-C still ends the process.
pub fn install() {
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::SeqCst) {
            end();
        }
        std::thread::spawn(|| {
            std::thread::sleep(Duration::from_secs(PATIENCE.load(Ordering::Relaxed)));
            end();
        });
    });
}

fn end() -> ! {
    output::remove_unfinished();
    std::process::exit(i32::from(STATUS))
}
