//! `study.csv`: one line a run, written as soon as the run is over.

use super::child::{RunEnd, RunResult};
use biscale::error::{BadInput, Error, Result};
use biscale::study::{Asked, Deviation};
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// One run. What does not apply is empty.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// `list` or `table`.
    pub question: String,
    /// What was run, or `truth`.
    pub setting: String,
    pub seed: u64,
    /// `done`, `timed-out`, or the kind of error.
    pub status: String,
    /// Relative RMS error, the truth's own taken off in squares.
    pub error: Option<f64>,
    /// What the error is below with 97.7 % probability.
    pub error_at_most: Option<f64>,
    /// What the method itself estimates.
    pub estimated_error: Option<f64>,
    pub psnr_db: Option<f64>,
    pub p95: Option<f64>,
    pub bias: Option<f64>,
    /// CPU seconds of all threads.
    pub cpu_s: Option<f64>,
    pub wall_s: Option<f64>,
    pub peak_mib: Option<f64>,
    pub added_mib: Option<f64>,
    /// CPU seconds, not in `cpu_s`, that went into what is kept for the next run: compressed BRDFs.
    pub precomputed_s: Option<f64>,
    pub facets: Option<usize>,
    pub clusters: Option<usize>,
    pub directions: Option<usize>,
    pub pairs: Option<usize>,
    pub plan: String,
    /// Matrices of the low-rank method as JSON, one element a surface.
    pub low_rank: String,
    pub message: String,
}

/// The setting's name of the truth.
pub const TRUTH: &str = "truth";
/// The status of a run that end as it should.
pub const DONE: &str = "done";

impl Record {
    /// What is known of a run that ended so.
    pub fn new(asked: Asked, setting: &str, seed: u64, end: &RunEnd, deviation: impl FnOnce(&RunResult) -> Option<Deviation>) -> Self {
        let base = Self { question: asked.name().to_owned(), setting: setting.to_owned(), seed, ..Self::default() };
        let result = match end {
            RunEnd::TimedOut => return Self { status: "timed-out".to_owned(), message: "longer than --time-limit".to_owned(), ..base },
            RunEnd::Failed { kind, message } => return Self { status: kind.clone(), message: message.clone(), ..base },
            RunEnd::Done(result) => result,
        };
        let deviation = deviation(result);
        // Plain sums have no standard errors, and so no estimate.
        let estimated = result.se.iter().flatten().any(|s| *s > 0.0);
        Self {
            status: DONE.to_owned(),
            error: deviation.map(|d| d.error),
            error_at_most: deviation.map(|d| d.at_most),
            estimated_error: estimated.then_some(result.estimated),
            psnr_db: deviation.map(|d| d.psnr).filter(|x| x.is_finite()),
            p95: deviation.map(|d| d.p95),
            bias: deviation.map(|d| d.bias),
            cpu_s: result.cost.cpu_s,
            wall_s: Some(result.cost.wall_s),
            peak_mib: result.cost.peak_mib,
            added_mib: result.cost.added_mib,
            precomputed_s: result.precomputed_s,
            facets: Some(result.facets),
            clusters: Some(result.clusters),
            directions: Some(result.directions),
            pairs: Some(result.pairs),
            plan: result.plan.clone(),
            low_rank: if result.low_rank.is_empty() { String::new() } else { serde_json::to_string(&result.low_rank).unwrap_or_default() },
            message: result.notes.join("; "),
            ..base
        }
    }

    /// Whether this is the run of a setting with a seed.
    pub fn is(&self, asked: Asked, setting: &str, seed: u64) -> bool {
        self.question == asked.name() && self.setting == setting && self.seed == seed
    }
}

/// The file, and what stands in it.
pub struct Records {
    path: PathBuf,
    file: File,
    pub all: Vec<Record>,
}

impl Records {
    /// Opens the file at `path`, or begins it. A last line without its end, which an interrupt may have left, is taken away.
    ///
    /// # Errors
    /// I/o; bad input for a line that is no record.
    pub fn open(path: &Path) -> Result<Self> {
        let failed = |action| move |source| Error::Io { action, path: path.to_path_buf(), source };
        let mut file = File::options().read(true).write(true).create(true).truncate(false).open(path).map_err(failed("open"))?;
        let text = std::fs::read(path).map_err(failed("read"))?;
        let whole = text.iter().rposition(|&b| b == b'\n').map_or(0, |end| end + 1);
        file.set_len(whole as u64).and_then(|()| file.seek(SeekFrom::End(0))).map_err(failed("write"))?;
        let mut reader = csv::Reader::from_reader(&text[..whole]);
        let read: std::result::Result<Vec<Record>, csv::Error> = reader.deserialize().collect();
        let all = read.map_err(|e| {
            let line = e.position().and_then(|p| usize::try_from(p.line()).ok()).unwrap_or(1);
            let bad = BadInput::new(format!("this line is no run of a study: {e}"), "begin anew with --force, or in another folder");
            Error::from(bad.in_file(path).at_line(line))
        })?;
        Ok(Self { path: path.to_path_buf(), file, all })
    }

    /// Adds a run, in the file too.
    ///
    /// # Errors
    /// I/o.
    pub fn add(&mut self, mut record: Record) -> Result<()> {
        record.message = record.message.split_whitespace().collect::<Vec<_>>().join(" ");
        let failed = |source| Error::Io { action: "write", path: self.path.clone(), source };
        let is_empty = self.file.metadata().map_err(failed)?.len() == 0;
        let mut writer = csv::WriterBuilder::new().has_headers(is_empty).from_writer(Vec::new());
        writer.serialize(&record).map_err(|e| Error::Numeric(format!("a run cannot be written as CSV: {e}; please report this")))?;
        let bytes = writer.into_inner().map_err(|e| failed(e.into_error()))?;
        // One write a line: what an interrupt leaves is whole, or a line without its end.
        self.file.write_all(&bytes).and_then(|()| self.file.flush()).map_err(failed)?;
        self.all.push(record);
        Ok(())
    }

    /// The run of a setting with a seed, if it was made.
    pub fn find(&self, asked: Asked, setting: &str, seed: u64) -> Option<&Record> {
        self.all.iter().find(|r| r.is(asked, setting, seed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_read_as_they_were_written_and_half_a_line_is_forgotten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.csv");
        let first = Record {
            question: "list".to_owned(),
            setting: "lowrank:paper:energy=0.995,0.98".to_owned(),
            seed: 3,
            status: "unsupported".to_owned(),
            message: "says \"no\", in one line".to_owned(),
            ..Record::default()
        };
        let second = Record { setting: "direct:64x1".to_owned(), error: Some(0.1 + 0.2), facets: Some(64), ..first.clone() };
        let mut records = Records::open(&path).unwrap();
        records.add(Record { message: first.message.replace(", ", ",\n"), ..first.clone() }).unwrap();
        records.add(second.clone()).unwrap();
        drop(records);
        let mut text = std::fs::read(&path).unwrap();
        text.extend(b"list,half a li");
        std::fs::write(&path, text).unwrap();
        let mut records = Records::open(&path).unwrap();
        assert_eq!(records.all, [first.clone(), second.clone()]);
        assert_eq!(records.find(Asked::List, "direct:64x1", 3), Some(&second));
        assert_eq!(records.find(Asked::Table, "direct:64x1", 3), None);
        records.add(first.clone()).unwrap();
        assert_eq!(Records::open(&path).unwrap().all, [first.clone(), second, first]);
    }

    #[test]
    fn a_file_that_is_none_is_refused_with_its_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("study.csv");
        std::fs::write(&path, "question,setting,seed\nlist,x,three\n").unwrap();
        let message = Records::open(&path).err().unwrap().to_string();
        assert!(message.contains("study.csv:2: this line is no run of a study"), "{message}");
    }
}
