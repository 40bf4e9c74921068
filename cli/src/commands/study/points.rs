//! Runs of one setting with several seeds as one point of a plot and one line of a table.

use super::record::{DONE, Record};
use biscale::filter::LowRankFacts;
use biscale::numerics::statistics::{mean, median};
use biscale::study::{Asked, Family, Series, Work, cost_at, frontier};

/// What the runs of a setting say together.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    pub asked: Asked,
    pub work: Work,
    /// Runs that are done.
    pub runs: usize,
    /// `done`, or how the first run that was not ended, with its message.
    pub status: String,
    pub message: String,
    /// Root of the mean square over the runs.
    pub error: f64,
    /// The same of what the errors are below with 97.7 % probability.
    pub at_most: f64,
    /// Root of the mean square of the method's own estimates.
    pub estimated: Option<f64>,
    /// Of the mean square differences.
    pub psnr_db: Option<f64>,
    /// Means.
    pub p95: f64,
    pub bias: f64,
    /// Medians.
    pub cpu_s: f64,
    pub wall_s: f64,
    /// Largest.
    pub peak_mib: Option<f64>,
    pub added_mib: Option<f64>,
    /// CPU seconds that some run put into what the others found ready.
    pub precomputed_s: Option<f64>,
    /// Of the first run that is done.
    pub low_rank: Vec<LowRankFacts>,
    /// Of the first run.
    pub facets: usize,
    pub clusters: usize,
    pub directions: usize,
    pub plan: String,
}

impl Point {
    /// The point of a setting; `None` if it was not run.
    pub fn new(asked: Asked, work: &Work, records: &[Record]) -> Option<Self> {
        let name = work.to_string();
        let runs: Vec<&Record> = records.iter().filter(|r| r.question == asked.name() && r.setting == name).collect();
        let first = runs.first()?;
        let failed = runs.iter().find(|r| r.status != DONE);
        let done: Vec<&Record> = runs.iter().filter(|r| r.status == DONE).copied().collect();
        let all = |of: fn(&Record) -> Option<f64>| -> Vec<f64> { done.iter().filter_map(|r| of(r)).collect() };
        let rms = |v: &[f64]| mean(v.iter().map(|x| x * x)).sqrt();
        let largest = |v: Vec<f64>| v.into_iter().reduce(f64::max);
        let some = |v: Vec<f64>| (!v.is_empty()).then_some(v);
        // Without a CPU clock the wall's is the best there is.
        let cpu = some(all(|r| r.cpu_s)).unwrap_or_else(|| all(|r| r.wall_s));
        Some(Self {
            asked,
            work: work.clone(),
            runs: done.len(),
            status: failed.unwrap_or(first).status.clone(),
            message: failed.unwrap_or(first).message.clone(),
            error: rms(&all(|r| r.error)),
            at_most: rms(&all(|r| r.error_at_most)),
            estimated: some(all(|r| r.estimated_error)).map(|v| rms(&v)),
            psnr_db: some(all(|r| r.psnr_db)).map(|v| -10.0 * mean(v.iter().map(|p| 10.0_f64.powf(-0.1 * p))).log10()),
            p95: mean(all(|r| r.p95).into_iter()),
            bias: mean(all(|r| r.bias).into_iter()),
            cpu_s: median(cpu).unwrap_or_default(),
            wall_s: median(all(|r| r.wall_s)).unwrap_or_default(),
            peak_mib: largest(all(|r| r.peak_mib)),
            added_mib: largest(all(|r| r.added_mib)),
            precomputed_s: largest(all(|r| r.precomputed_s)),
            low_rank: done.first().and_then(|r| serde_json::from_str(&r.low_rank).ok()).unwrap_or_default(),
            facets: first.facets.unwrap_or_default(),
            clusters: first.clusters.unwrap_or_default(),
            directions: first.directions.unwrap_or_default(),
            plan: first.plan.clone(),
        })
    }

    /// Whether some run is done, so that there is something to show.
    pub fn is_done(&self) -> bool {
        self.runs > 0
    }

    /// Whether the truth is exact enough to tell the error: more of the squared difference is error than two standard deviations of noise.
    pub fn is_resolved(&self) -> bool {
        2.0 * self.error * self.error >= self.at_most * self.at_most
    }

    /// The error if it is resolved, or else what it is at most.
    pub fn shown_error(&self) -> f64 {
        if self.is_resolved() { self.error } else { self.at_most }
    }
}

/// All points of a ladder, each setting once.
pub fn points(ladder: &[Series], records: &[Record]) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::new();
    for series in ladder {
        for (_, work) in &series.steps {
            if !points.iter().any(|p| p.asked == series.asked && p.work == *work) {
                points.extend(Point::new(series.asked, work, records));
            }
        }
    }
    points
}

/// The competing points of a question that are done, and which of them are on the frontier, cheapest first.
pub fn competing(points: &[Point], asked: Asked) -> (Vec<&Point>, Vec<usize>) {
    let competing: Vec<&Point> = points.iter().filter(|p| p.asked == asked && p.is_done() && p.work.family().competes()).collect();
    let places: Vec<[f64; 2]> = competing.iter().map(|p| [p.cpu_s, p.shown_error()]).collect();
    let frontier = frontier(&places);
    (competing, frontier)
}

/// What the best of the settings that are not `auto` would cost for an error: `None` where none is as exact.
pub fn best_other(points: &[Point], asked: Asked, error: f64) -> Option<f64> {
    let (shown, _) = competing(points, asked);
    // A bound of an error is none.
    let others = shown.iter().filter(|p| p.work.family() != Family::Auto && p.is_resolved());
    cost_at(&others.map(|p| [p.cpu_s, p.error]).collect::<Vec<_>>(), error)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(seed: u64, error: f64, cpu: f64) -> Record {
        Record {
            question: "list".to_owned(),
            setting: "direct:64x1".to_owned(),
            seed,
            status: DONE.to_owned(),
            error: Some(error),
            error_at_most: Some(error),
            psnr_db: Some(20.0),
            cpu_s: Some(cpu),
            wall_s: Some(cpu),
            ..Record::default()
        }
    }

    #[test]
    fn seeds_are_taken_together() {
        let work = Work::parse("direct:64x1").unwrap();
        let records = [record(0, 0.03, 1.0), record(1, 0.04, 5.0), record(2, 0.0, 2.0)];
        let point = Point::new(Asked::List, &work, &records).unwrap();
        assert!((point.error - (0.0025_f64 / 3.0).sqrt()).abs() < 1e-12 && point.cpu_s == 2.0 && point.is_resolved(), "{point:?}");
        assert!((point.psnr_db.unwrap() - 20.0).abs() < 1e-9 && point.runs == 3 && point.estimated.is_none());
        assert_eq!(Point::new(Asked::Table, &work, &records), None);
        let late = Record { status: "timed-out".to_owned(), error: None, cpu_s: None, ..record(3, 0.0, 0.0) };
        let point = Point::new(Asked::List, &work, &[record(0, 0.03, 1.0), late]).unwrap();
        assert_eq!((point.runs, point.status.as_str(), point.cpu_s), (1, "timed-out", 1.0));
    }

    #[test]
    fn what_the_truth_cannot_tell_is_shown_as_a_bound() {
        let work = Work::parse("direct:64x1").unwrap();
        let blurred = Record { error: Some(0.001), error_at_most: Some(0.002), ..record(0, 0.0, 1.0) };
        let point = Point::new(Asked::List, &work, &[blurred]).unwrap();
        assert!(!point.is_resolved() && point.shown_error() == 0.002);
    }
}
