//! What a command that filtered a surface says about it: on standard error, or as part of its JSON.

use super::bounces::Bounces;
use super::options::CommonArgs;
use biscale::filter::{self, LowRankFacts, Quality};
use biscale::material::{Material, SmallScale};
use biscale::numerics::words::percent;
use biscale::table::EffectiveTable;
use serde::{Serialize, Serializer};
use std::fmt;

/// How a result was made. Shown as a few lines of text, or serialised.
#[derive(Clone, Debug, Serialize)]
pub struct FilterSummary<'a> {
    material: &'a str,
    method: &'static str,
    /// What `--plan` takes to repeat the bits.
    plan: String,
    #[serde(flatten)]
    bounces: Bounces,
    seed: u64,
    pairs: usize,
    facets: usize,
    clusters: usize,
    directions: usize,
    milliseconds: Stages,
    /// Estimated, of fbar over all pairs and channels.
    relative_rms_error: f64,
    tolerance: f64,
    /// Matrices of the low-rank method.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    low_rank: &'a [LowRankFacts],
    notes: Vec<String>,
    /// How it was done, for who knows the method: text shows it where it is asked for.
    details: Vec<String>,
    #[serde(skip)]
    verbose: bool,
}

/// Milliseconds of each stage, in the order of the work; a JSON object.
#[derive(Clone, Debug)]
pub struct Stages(pub Vec<(&'static str, f64)>);

impl fmt::Display for Stages {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stages: Vec<String> = self.0.iter().map(|(name, ms)| format!("{name} {ms:.1}")).collect();
        write!(f, "milliseconds: {}", stages.join(", "))
    }
}

impl Serialize for Stages {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|&(name, ms)| (name, (ms * 1e3).round() / 1e3)))
    }
}

impl<'a> FilterSummary<'a> {
    /// Gathers what is to be said: `before` are the stages before the library's, `notes` those of the command.
    pub fn new(
        material: &'a Material,
        surface: &SmallScale,
        quality: &Quality,
        pairs: usize,
        before: &[(&'static str, f64)],
        summary: &'a filter::Summary,
        notes: Vec<String>,
    ) -> Self {
        let mut stages: Vec<(&'static str, f64)> = Vec::new();
        for &(name, ms) in before.iter().chain(&summary.stages) {
            match stages.iter_mut().find(|(n, _)| *n == name) {
                Some((_, sum)) => *sum += ms,
                None => stages.push((name, ms)),
            }
        }
        let mut all: Vec<String> = Vec::new();
        for note in surface.tile.notes.iter().chain(&summary.notes).chain(&notes) {
            if !all.contains(note) {
                all.push(note.clone());
            }
        }
        let told = summary.notes.iter().any(|n| n.contains("is not met"));
        if !told && quality.budget.is_none() && quality.plan.is_none() && summary.relative_rms > quality.tolerance {
            all.push(format!("the tolerance of {} is not met", percent(quality.tolerance)));
        }
        Self {
            material: &material.name,
            method: summary.method,
            plan: summary.plan_text(),
            bounces: Bounces::of(quality, material.bounces),
            seed: quality.seed,
            pairs,
            facets: summary.facets,
            clusters: summary.clusters,
            directions: summary.directions,
            milliseconds: Stages(stages),
            relative_rms_error: summary.relative_rms,
            tolerance: quality.tolerance,
            low_rank: &summary.low_rank,
            notes: all,
            details: summary.details.clone(),
            verbose: false,
        }
    }

    /// The same as a user reads it: with flags in the place of the fields that its notes name, and details where they are asked for.
    #[must_use]
    pub fn for_user(mut self, common: &CommonArgs) -> Self {
        self.notes = common.flags.in_texts(self.notes);
        self.details = common.flags.in_texts(self.details);
        self.verbose = common.verbose;
        self
    }

    /// The same for values out of a baked table; its error is that between the nodes.
    pub fn of_table(table: &'a EffectiveTable, pairs: usize, stages: &[(&'static str, f64)], notes: Vec<String>) -> Self {
        let about = &table.about;
        Self {
            material: &about.name,
            method: "table",
            plan: about.plan.clone(),
            bounces: Bounces::of_table(about.bounces),
            seed: about.seed,
            pairs,
            facets: about.facets,
            clusters: about.facets,
            directions: table.grid().nodes().len(),
            milliseconds: Stages(stages.to_vec()),
            relative_rms_error: about.error.relative_rms,
            tolerance: about.tolerance,
            low_rank: &[],
            notes: about.notes.iter().cloned().chain(notes).collect(),
            details: Vec::new(),
            verbose: false,
        }
    }
}

impl fmt::Display for FilterSummary<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: method {}, {} facets, {} clusters, {} directions, {} pairs",
            self.material, self.method, self.facets, self.clusters, self.directions, self.pairs
        )?;
        if self.bounces.is_told() {
            writeln!(f, "{}", self.bounces)?;
        }
        writeln!(f, "{}", self.milliseconds)?;
        write!(f, "estimated relative RMS error: {:.3} %", self.relative_rms_error * 100.0)?;
        if !self.plan.is_empty() {
            write!(f, "\nplan: {} (seed {})", self.plan, self.seed)?;
        }
        for m in self.low_rank.iter().filter(|_| self.verbose) {
            let ([n_rows, n_columns], [m_rows, m_columns]) = (m.n_size, m.m_size);
            write!(
                f,
                "\nsurface {}: N {n_rows} x {n_columns}, rank {} ({:.2} % of its power); ",
                m.surface + 1,
                m.n_rank,
                100.0 * m.n_energy
            )?;
            write!(f, "M {m_rows} x {m_columns}, rank {} ({:.2} %), {:.1} MB", m.m_rank, 100.0 * m.m_energy, m.m_bytes as f64 / 1e6)?;
        }
        for note in &self.notes {
            write!(f, "\nnote: {note}")?;
        }
        for detail in self.details.iter().filter(|_| self.verbose) {
            write!(f, "\n{detail}")?;
        }
        Ok(())
    }
}
