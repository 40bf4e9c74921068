//! The runs of a study: the truths first, then each setting, seed by seed.

use super::child::{self, RunEnd};
use super::folder::{self, Folder};
use super::plan::StudyPlan;
use super::record::{Record, Records, TRUTH};
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use biscale::study::{self, Asked, Question, Truth};
use std::path::PathBuf;
use std::time::Duration;

/// What the truth takes beyond its time is loading, and its last round.
const TRUTH_PATIENCE: Duration = Duration::from_secs(120);
/// Distance of the truth's seed from the study's: it must share no rays with a run of `reference`.
const TRUTH_SEED: u64 = 0x5EED_0000_0000;
/// What the truth counts for in the progress, in runs.
const TRUTH_SHARE: f64 = 10.0;

/// A study being carried out.
pub struct Runs<'a> {
    pub plan: &'a StudyPlan,
    pub folder: &'a Folder,
    pub records: &'a mut Records,
}

impl Runs<'_> {
    /// Makes the runs that are not in the records yet; returns the truth of each question.
    ///
    /// # Errors
    /// A truth that cannot be had; i/o; `Interrupted`.
    pub fn carry_out(mut self, control: &Control<'_>) -> Result<Vec<(Asked, Truth)>> {
        let plan = self.plan;
        if let Some((_, question)) = plan.asked.iter().find(|(asked, _)| *asked == Asked::List) {
            self.folder.write_pairs(&question.pairs)?;
        }
        let runs = planned(plan);
        let all = TRUTH_SHARE * plan.asked.len() as f64 + runs.len() as f64;
        let mut truths = Vec::new();
        for (k, (asked, question)) in plan.asked.iter().enumerate() {
            (control.progress)(&format!("truth of the {}", asked.name()), TRUTH_SHARE * k as f64 / all);
            truths.push((*asked, self.truth(*asked, question, control)?));
        }
        for (k, (asked, setting, seed)) in runs.iter().enumerate() {
            (control.progress)(&format!("run {} of {}", k + 1, runs.len()), (TRUTH_SHARE * truths.len() as f64 + k as f64) / all);
            if self.records.find(*asked, setting, *seed).is_some() {
                continue;
            }
            let arguments = plan.arguments(*asked, &self.list(), setting, *seed);
            let end = child::make(&arguments, &self.folder.path(folder::CACHE), plan.time_limit, control)?;
            let truth = &truths.iter().find(|(of, _)| of == asked).expect("each question has its truth").1;
            let deviation =
                |result: &child::RunResult| (result.fbar.len() == truth.value.len()).then(|| study::deviation(&result.fbar, truth));
            self.records.add(Record::new(*asked, setting, *seed, &end, deviation))?;
        }
        Ok(truths)
    }

    /// The file of the list's pairs.
    fn list(&self) -> PathBuf {
        self.folder.path(folder::PAIRS)
    }

    /// The truth of a question: read, or computed and written.
    fn truth(&mut self, asked: Asked, question: &Question, control: &Control<'_>) -> Result<Truth> {
        let (plan, folder) = (self.plan, self.folder);
        let judged = &question.pairs[..question.judged];
        if self.records.find(asked, TRUTH, plan.seed).is_some()
            && let Some(truth) = folder.read_truth(asked, judged.len())?
        {
            return Ok(truth);
        }
        // Only those judged are computed, whatever the question: `reference` shares nothing between pairs.
        let pairs = match asked {
            Asked::List => self.list(),
            Asked::Table => folder.write_judged(judged)?,
        };
        let arguments = plan.arguments(Asked::List, &pairs, &plan.truth.to_string(), plan.seed ^ TRUTH_SEED);
        let end = child::make(&arguments, &folder.path(folder::CACHE), plan.truth_time + TRUTH_PATIENCE, control)?;
        let result = match &end {
            RunEnd::Done(result) => result,
            RunEnd::Failed { kind, message } if kind == "bad-input" => {
                return Err(BadInput::new(message.clone(), "see the message").in_file(&plan.material.file).into());
            }
            RunEnd::Failed { message, .. } => return Err(Error::Numeric(format!("the truth of the {}: {message}", asked.name()))),
            RunEnd::TimedOut => {
                let problem = format!("the truth of the {} takes far longer than its time", asked.name());
                return Err(Error::Numeric(format!("{problem}; give it more with `truth_time`")));
            }
        };
        let truth = Truth { value: result.fbar.clone(), se: result.se.clone() };
        folder.write_truth(asked, judged, &truth)?;
        self.records.add(Record::new(asked, TRUTH, plan.seed, &end, |_| None))?;
        Ok(truth)
    }
}

/// Each question, setting and seed once, seed by seed.
fn planned(plan: &StudyPlan) -> Vec<(Asked, String, u64)> {
    let mut runs: Vec<(Asked, String, u64)> = Vec::new();
    for seed in plan.seed..plan.seed.saturating_add(plan.seeds) {
        for series in &plan.ladder {
            for (_, work) in &series.steps {
                let run = (series.asked, work.to_string(), seed);
                if !runs.contains(&run) {
                    runs.push(run);
                }
            }
        }
    }
    runs
}
