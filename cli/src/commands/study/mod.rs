//! `biscale study`: the same question asked of every method at every setting; error against time.
//!
//! Each run is a process of its own ([`child`]) and a line of `study.csv` ([`record`]), so that a study that was interrupted goes on
//! where it stopped. From the lines come plots ([`chart`]) and a report ([`report`]).

mod axes;
mod chart;
mod child;
mod folder;
mod pictures;
mod points;
mod record;
mod report;

use crate::common::options::{self, CommonArgs};
use crate::common::output;
use crate::common::progress;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use biscale::material::{Material, SmallScale};
use biscale::study::{self, Asked, Question, Series, Truth, Work};
pub use child::{RunArgs, run as run_one};

use child::Ended;
use clap::Args;
use folder::{Asks, Folder};
use pictures::Studio;
use record::{DONE, Record, Records, TRUTH};
use serde::Serialize;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Arguments of `biscale study`.
#[derive(Args, Debug)]
#[command(
    after_help = "Writes study.csv (a line a run), report.md, pareto.svg and .png, placement.svg and .png, and what makes them again. \
                        A study that was interrupted goes on where it stopped. See docs/study.md."
)]
pub struct StudyArgs {
    /// Material file
    pub(crate) material: PathBuf,
    /// Folder for the results, made if it is not there
    #[arg(long, short, value_name = "FOLDER")]
    output: PathBuf,
    /// Pairs to ask, as for `eval`, in place of the study's own two questions
    #[arg(long, value_name = "PAIRS.csv")]
    pairs: Option<PathBuf>,
    /// Methods to try; `points` are plain sums over facets placed in several ways
    #[arg(long, value_enum, value_name = "METHODS", value_delimiter = ',', default_values_t = Tried::ALL)]
    methods: Vec<Tried>,
    /// A short ladder and a rougher truth, for a first look
    #[arg(long)]
    quick: bool,
    /// Seed of the questions and of the runs
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    seed: u64,
    /// Runs of each setting, each with a seed of its own [default: 3, with --quick 1]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=1000), allow_negative_numbers = true)]
    seeds: Option<u64>,
    /// Wall time of one run: one that takes longer is stopped
    #[arg(long, value_name = "TIME", default_value = "2m", value_parser = options::time, allow_hyphen_values = true)]
    time_limit: Duration,
    /// Relative RMS error that the truth is computed to [default: 0.001, with --quick 0.005]
    #[arg(long, value_name = "ERROR", value_parser = options::tolerance, allow_negative_numbers = true)]
    truth_tolerance: Option<f64>,
    /// Wall time for the truth of each question: then it is as exact as it got [default: 1m, with --quick 10s]
    #[arg(long, value_name = "TIME", value_parser = options::time, allow_hyphen_values = true)]
    truth_time: Option<Duration>,
    /// Make no pictures of a sphere and a ring
    #[arg(long)]
    no_pictures: bool,
    /// Begin anew in a folder that holds another study, or files that this command did not make
    #[arg(long)]
    force: bool,
}

/// A method of `--methods`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Tried {
    Auto,
    Direct,
    Lowrank,
    Sg,
    Reference,
    Points,
}

impl Tried {
    const ALL: [Self; 6] = [Self::Auto, Self::Direct, Self::Lowrank, Self::Sg, Self::Reference, Self::Points];
}

impl std::fmt::Display for Tried {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Auto => "auto",
            Self::Direct => "direct",
            Self::Lowrank => "lowrank",
            Self::Sg => "sg",
            Self::Reference => "reference",
            Self::Points => "points",
        })
    }
}

/// Pairs of the list that the study asks, and of a quick one.
const LIST_PAIRS: [usize; 2] = [256, 48];
/// Directions of the table, and pairs of it that are judged. 272 make 37,128 different pairs.
const TABLE: [[u64; 2]; 2] = [[272, 256], [64, 64]];
/// Error and wall seconds of the truth.
const TRUTH_TOLERANCE: [f64; 2] = [0.001, 0.005];
const TRUTH_SECONDS: [f64; 2] = [60.0, 10.0];
/// Runs of a setting.
const SEEDS: [u64; 2] = [3, 1];
/// What the truth takes beyond its time is loading, and its last round.
const TRUTH_PATIENCE: Duration = Duration::from_secs(120);
/// Distance of the truth's seed from the study's: it must share no rays with a run of `reference`.
const TRUTH_SEED: u64 = 0x5EED_0000_0000;
/// Share of the progress that the runs take; the pictures take the rest.
const RUNS: f64 = 0.8;
/// What the truth counts for in the progress, in runs.
const TRUTH_SHARE: f64 = 10.0;

/// What is asked, and what is run.
struct Plan {
    material: Material,
    small: SmallScale,
    ladder: Vec<Series>,
    asked: Vec<(Asked, Question)>,
    /// Arguments of the table's child: directions, judged, seed.
    table: [u64; 3],
    seed: u64,
    seeds: u64,
    truth: Work,
    truth_time: Duration,
    time_limit: Duration,
    threads: u16,
}

/// Runs the command.
///
/// # Errors
/// Bad input, i/o, and `Interrupted`, after which a rerun goes on.
pub fn run(args: &StudyArgs, common: &CommonArgs) -> Result<()> {
    let plan = Plan::new(args, common)?;
    let folder = Folder::open(&args.output, &plan.asks(), args.force, &[Some(&args.material), args.pairs.as_ref()])?;
    let mut records = Records::open(&folder.path(folder::CSV))?;
    let before = records.all.len();
    let studio = (!args.no_pictures).then(|| Studio {
        material: &args.material,
        methods: &args.methods,
        quick: args.quick,
        seed: args.seed,
        threads: common.threads,
        time_limit: args.time_limit,
    });
    let runs = if studio.is_some() { RUNS } else { 1.0 };
    let (truths, made) = progress::with_control(common, |control| {
        let of_runs = |stage: &str, done: f64| (control.progress)(stage, runs * done);
        let truths = plan.carry_out(&folder, &mut records, &Control { progress: &of_runs, ..*control })?;
        let of_pictures = |done: f64| (control.progress)("pictures", runs + (1.0 - runs) * done);
        let made = studio.as_ref().map(|s| s.make(&folder, &of_pictures, control)).transpose()?;
        Ok((truths, made.unwrap_or_default()))
    })?;
    folder.remove_cache()?;
    let study = report::Study { plan: &plan, records: &records.all, truths: &truths };
    let points = points::points(&plan.ladder, &records.all);
    let pareto = chart::pareto(&plan.material.name, plan.table[0], &points, &truths);
    folder.write_chart("pareto", &pareto)?;
    let placement = chart::placement(&plan.material.name, &points);
    if let Some(placement) = &placement {
        folder.write_chart("placement", placement)?;
    }
    let ranks = chart::ranks(&plan.material.name, &plan.ladder, &points);
    if let Some(ranks) = &ranks {
        folder.write_chart("ranks", ranks)?;
    }
    let pictures = report::Pictures { placement: placement.is_some(), ranks: ranks.is_some(), rendered: made };
    let text = study.markdown(&points, &pictures);
    folder.write(folder::REPORT, text.as_bytes())?;
    let summary = Summary::new(&plan, &folder, &points, &truths, records.all.len() - before);
    if common.json {
        return output::print_json(&summary);
    }
    output::tell(common, &summary.to_string());
    Ok(())
}

impl Plan {
    fn new(args: &StudyArgs, common: &CommonArgs) -> Result<Self> {
        let material = Material::load(&args.material)?;
        let small = material.build()?;
        let quick = usize::from(args.quick);
        let [directions, judged] = TABLE[quick];
        let table = [directions, judged, args.seed];
        let asked = match &args.pairs {
            Some(path) => {
                let pairs = crate::common::pairs::load(path)?.pairs;
                if pairs.is_empty() {
                    return Err(BadInput::new("there are no pairs", "write at least one").in_file(path).into());
                }
                vec![(Asked::List, Question { judged: pairs.len(), pairs })]
            }
            None => {
                let count = |n: u64| usize::try_from(n).expect("hundreds");
                vec![
                    (Asked::List, study::list(LIST_PAIRS[quick], args.seed)),
                    (Asked::Table, study::table(count(directions), count(judged), args.seed)),
                ]
            }
        };
        let wanted = |work: &Work| args.methods.iter().any(|m| m.to_string() == work.family().method());
        let mut ladder = study::ladder(args.quick);
        for series in &mut ladder {
            series.steps.retain(|(_, work)| wanted(work));
        }
        ladder.retain(|s| !s.steps.is_empty() && asked.iter().any(|(asked, _)| *asked == s.asked));
        let truth_time = args.truth_time.unwrap_or(Duration::from_secs_f64(TRUTH_SECONDS[quick]));
        Ok(Self {
            truth: study::truth(args.truth_tolerance.unwrap_or(TRUTH_TOLERANCE[quick]), truth_time.as_secs_f64()),
            truth_time,
            seed: args.seed,
            seeds: args.seeds.unwrap_or(SEEDS[quick]),
            time_limit: args.time_limit,
            threads: common.threads,
            material,
            small,
            ladder,
            asked,
            table,
        })
    }

    /// What makes two studies comparable.
    fn asks(&self) -> Asks {
        Asks {
            name: self.material.name.clone(),
            material: folder::hash_of_surface(&self.small),
            pairs: folder::hash_of_pairs(self.asked.iter().map(|(_, q)| &q.pairs[..])),
            seed: self.seed,
            truth: self.truth.to_string(),
        }
    }

    /// Arguments of a child that runs a setting.
    fn arguments(&self, asked: Asked, pairs: &Path, setting: &str, seed: u64) -> Vec<OsString> {
        let mut arguments: Vec<OsString> = ["study-run", "--json", "--quiet", "--threads"].map(OsString::from).to_vec();
        arguments.push(self.threads.to_string().into());
        arguments.extend(["--setting".into(), setting.into(), "--seed".into(), seed.to_string().into()]);
        match asked {
            Asked::List => arguments.extend(["--pairs".into(), pairs.into()]),
            Asked::Table => arguments.extend(["--table".into(), self.table.map(|n| n.to_string()).join(",").into()]),
        }
        arguments.push("--".into());
        arguments.push(self.material.file.clone().into());
        arguments
    }

    /// Makes the runs that are not in `records` yet, the truths first, then seed by seed.
    fn carry_out(&self, folder: &Folder, records: &mut Records, control: &Control<'_>) -> Result<Vec<(Asked, Truth)>> {
        let list = folder.path(folder::PAIRS);
        if let Some((_, question)) = self.asked.iter().find(|(asked, _)| *asked == Asked::List) {
            folder.write_pairs(&question.pairs)?;
        }
        let mut runs: Vec<(Asked, String, u64)> = Vec::new();
        for seed in self.seed..self.seed.saturating_add(self.seeds) {
            for series in &self.ladder {
                for (_, work) in &series.steps {
                    let run = (series.asked, work.to_string(), seed);
                    if !runs.contains(&run) {
                        runs.push(run);
                    }
                }
            }
        }
        let all = TRUTH_SHARE * self.asked.len() as f64 + runs.len() as f64;
        let mut truths = Vec::new();
        for (k, (asked, question)) in self.asked.iter().enumerate() {
            (control.progress)(&format!("truth of the {}", asked.name()), TRUTH_SHARE * k as f64 / all);
            truths.push((*asked, self.truth(*asked, question, &list, folder, records, control)?));
        }
        for (k, (asked, setting, seed)) in runs.iter().enumerate() {
            (control.progress)(&format!("run {} of {}", k + 1, runs.len()), (TRUTH_SHARE * truths.len() as f64 + k as f64) / all);
            if records.find(*asked, setting, *seed).is_some() {
                continue;
            }
            let arguments = self.arguments(*asked, &list, setting, *seed);
            let ended = child::make(&arguments, &folder.path(folder::CACHE), self.time_limit, control)?;
            let truth = &truths.iter().find(|(of, _)| of == asked).expect("each question has its truth").1;
            let deviation = |found: &child::Found| (found.fbar.len() == truth.value.len()).then(|| study::deviation(&found.fbar, truth));
            records.add(Record::new(*asked, setting, *seed, &ended, deviation))?;
        }
        Ok(truths)
    }

    /// The truth of a question: read, or computed and written.
    fn truth(
        &self,
        asked: Asked,
        question: &Question,
        list: &Path,
        folder: &Folder,
        records: &mut Records,
        control: &Control<'_>,
    ) -> Result<Truth> {
        let judged = &question.pairs[..question.judged];
        if records.find(asked, TRUTH, self.seed).is_some()
            && let Some(truth) = folder.read_truth(asked, judged.len())?
        {
            return Ok(truth);
        }
        // Only those judged are computed, whatever the question: `reference` shares nothing between pairs.
        let pairs = match asked {
            Asked::List => list.to_path_buf(),
            Asked::Table => folder.write_judged(judged)?,
        };
        let arguments = self.arguments(Asked::List, &pairs, &self.truth.to_string(), self.seed ^ TRUTH_SEED);
        let ended = child::make(&arguments, &folder.path(folder::CACHE), self.truth_time + TRUTH_PATIENCE, control)?;
        let found = match &ended {
            Ended::Done(found) => found,
            Ended::Failed { kind, message } if kind == "bad-input" => {
                return Err(BadInput::new(message.clone(), "see the message").in_file(&self.material.file).into());
            }
            Ended::Failed { message, .. } => return Err(Error::Numeric(format!("the truth of the {}: {message}", asked.name()))),
            Ended::TimedOut => {
                let problem = format!("the truth of the {} takes far longer than its time", asked.name());
                return Err(Error::Numeric(format!("{problem}; give it more with --truth-time")));
            }
        };
        let truth = Truth { value: found.fbar.clone(), se: found.se.clone() };
        folder.write_truth(asked, judged, &truth)?;
        records.add(Record::new(asked, TRUTH, self.seed, &ended, |_| None))?;
        Ok(truth)
    }
}

/// What a study comes to. Shown as a few lines of text, or serialised.
#[derive(Debug, Serialize)]
struct Summary<'a> {
    material: &'a str,
    files: Vec<PathBuf>,
    /// Runs that were made now, and those that are not done: cannot be done, failed, took too long.
    runs_made: usize,
    settings: usize,
    settings_not_done: usize,
    /// Relative RMS error of the truth of each question.
    truth_error: Vec<(&'static str, f64)>,
    frontier: Vec<OnFrontier>,
}

/// A setting on the frontier.
#[derive(Debug, Serialize)]
struct OnFrontier {
    question: &'static str,
    setting: String,
    cpu_s: f64,
    error: f64,
    /// Whether the error is only a bound: the truth is not exact enough to tell it.
    error_is_bound: bool,
}

impl<'a> Summary<'a> {
    fn new(plan: &'a Plan, folder: &Folder, points: &[points::Point], truths: &[(Asked, Truth)], runs_made: usize) -> Self {
        let mut frontier = Vec::new();
        for (asked, _) in truths {
            let (competing, best) = points::competing(points, *asked);
            frontier.extend(best.iter().map(|&k| OnFrontier {
                question: asked.name(),
                setting: competing[k].work.to_string(),
                cpu_s: competing[k].cpu_s,
                error: competing[k].shown_error(),
                error_is_bound: !competing[k].is_resolved(),
            }));
        }
        Self {
            material: &plan.material.name,
            files: folder.written(),
            runs_made,
            settings: points.len(),
            settings_not_done: points.iter().filter(|p| p.status != DONE).count(),
            truth_error: truths.iter().map(|(asked, truth)| (asked.name(), truth.relative_rms())).collect(),
            frontier,
        }
    }
}

impl std::fmt::Display for Summary<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(
            f,
            "{}: {} settings, {} of them not done; {} runs made now",
            self.material, self.settings, self.settings_not_done, self.runs_made
        )?;
        for (name, error) in &self.truth_error {
            writeln!(f, "truth of the {name}: relative RMS error {:.3} %", 100.0 * error)?;
        }
        for best in &self.frontier {
            let OnFrontier { question, setting, cpu_s, error, error_is_bound } = best;
            let bound = if *error_is_bound { "at most " } else { "" };
            writeln!(f, "{question}: {:.1} CPU ms, error {bound}{:.3} %: {setting}", 1e3 * cpu_s, 100.0 * error)?;
        }
        let report = self.files.iter().find(|p| p.ends_with(folder::REPORT)).expect("the report is written");
        write!(f, "wrote {} and {} files that it refers to or is made of", report.display(), self.files.len() - 1)
    }
}
