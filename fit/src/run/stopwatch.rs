//! Where the time of a fit goes.

use biscale::filter::Control;

/// Seconds of the parts of the work.
pub(super) struct Stopwatch<'a> {
    pub(super) control: &'a Control<'a>,
    pub(super) last: f64,
    pub(super) parts: Vec<(&'static str, f64)>,
}

impl<'a> Stopwatch<'a> {
    pub(super) fn new(control: &'a Control<'a>) -> Self {
        Self { control, last: (control.clock)(), parts: Vec::new() }
    }

    pub(super) fn lap(&mut self, name: &'static str) {
        let now = (self.control.clock)();
        self.parts.push((name, now - self.last));
        self.last = now;
    }
}
