//! One run of a study in a process of its own: what it takes is not mixed with what came before, a run that takes too long can be stopped,
//! and one that fails takes nothing with it.

use crate::common::cost::{Cost, measure};
use crate::common::options::CommonArgs;
use crate::common::{lowrank_cache, output, pairs, progress};
use biscale::direction::Pair;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::{Control, LowRankFacts};
use biscale::material::Material;
use biscale::study::{self, Question, Work};
use clap::Args;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use std::ffi::OsString;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

/// Arguments of `biscale study-run`.
#[derive(Args, Debug)]
pub struct RunArgs {
    /// Material file
    material: PathBuf,
    /// Setting, as study.csv names it
    #[arg(long)]
    setting: String,
    /// Seed of the run
    #[arg(long)]
    seed: u64,
    /// Pairs that are asked, all of them judged
    #[arg(long, value_name = "PAIRS.csv", required_unless_present = "table", conflicts_with = "table")]
    pairs: Option<PathBuf>,
    /// In place of pairs: all pairs of some directions, as DIRECTIONS,JUDGED,SEED
    #[arg(long, value_name = "D,J,S", value_delimiter = ',', num_args = 1)]
    table: Option<Vec<u64>>,
}

/// What a run found and what it took.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunResult {
    pub cost: Cost,
    /// CPU seconds that went into what is kept for the next time, and are not in `cost`.
    pub precomputed_s: Option<f64>,
    /// Matrices of the low-rank method, one element a surface.
    pub low_rank: Vec<LowRankFacts>,
    pub plan: String,
    pub facets: usize,
    pub clusters: usize,
    pub directions: usize,
    /// Pairs that were computed.
    pub pairs: usize,
    /// Estimated relative RMS error.
    pub estimated: f64,
    pub notes: Vec<String>,
    /// `fbar` of the pairs that are judged.
    pub fbar: Vec<[f64; 3]>,
    /// Their standard errors.
    pub se: Vec<[f64; 3]>,
}

/// How a run ended.
#[derive(Clone, Debug)]
pub enum RunEnd {
    Done(Box<RunResult>),
    /// The method says that it cannot, or failed: the kind of error and its message.
    Failed {
        kind: String,
        message: String,
    },
    /// It took longer than it may.
    TimedOut,
}

/// Runs the command.
///
/// # Errors
/// Bad input, and those of the method.
pub fn run(args: &RunArgs, common: &CommonArgs) -> Result<()> {
    let work = Work::parse(&args.setting).map_err(|bad| bad.at_field("setting"))?;
    let material = Material::load(&args.material)?;
    let small = material.build()?;
    let question = match (&args.pairs, args.table.as_deref()) {
        (Some(path), _) => {
            let pairs: Vec<Pair> = pairs::load(path)?.pairs;
            Question { judged: pairs.len(), pairs }
        }
        (None, Some(&[directions, judged, seed])) => {
            let count = |n: u64| usize::try_from(n).unwrap_or(usize::MAX);
            study::table(count(directions.min(4096)), count(judged), seed)
        }
        _ => return Err(BadInput::new("there is no question", "write three numbers").at_field("table").into()),
    };
    let cache = lowrank_cache::user_cache();
    // A folder that is not there yet keeps nothing.
    let kept = || cache.as_ref().and_then(|cache| std::fs::read_dir(&cache.folder).ok()).map_or(0, Iterator::count);
    let work = |control: &Control<'_>| {
        let before = kept();
        let once = || measure(|| study::run(&small, &question.pairs, &work, args.seed, cache.clone(), control));
        let (result, cost) = once();
        if kept() == before {
            return Ok((result?, cost, None));
        }
        // What was computed for good is there now: the cost of all but it, and the difference.
        let (result, warm) = once();
        Ok((result?, warm, cost.cpu_s.zip(warm.cpu_s).map(|(cold, warm)| cold - warm)))
    };
    let (effective, cost, precomputed_s) = progress::with_control(common, work)?;
    let judged = &effective.values[..question.judged];
    let summary = effective.summary;
    let result = RunResult {
        cost,
        precomputed_s,
        plan: summary.plan_text(),
        low_rank: summary.low_rank,
        facets: summary.facets,
        clusters: summary.clusters,
        directions: summary.directions,
        pairs: question.pairs.len(),
        estimated: summary.relative_rms,
        notes: summary.notes,
        fbar: judged.iter().map(|v| v.fbar).collect(),
        se: judged.iter().map(|v| v.se).collect(),
    };
    if result.fbar.iter().flatten().any(|x| !x.is_finite()) {
        return Err(Error::Numeric("a value is not finite; please report this".to_owned()));
    }
    output::print_json(&result)
}

/// Time between two looks at a child.
const BETWEEN_LOOKS: Duration = Duration::from_millis(10);

/// What a child process said.
pub struct ChildOutput {
    pub status: ExitStatus,
    pub stdout: Vec<u8>,
    pub stderr: String,
}

/// Runs this program with `arguments` as a child until it ends, `limit` is over (then `None`), or `control` asks to stop; it keeps compressed
/// BRDFs in `cache`.
///
/// # Errors
/// `Interrupted`; i/o if it cannot be started.
pub fn spawn(arguments: &[OsString], cache: &Path, limit: Duration, control: &Control<'_>) -> Result<Option<ChildOutput>> {
    let failed = |source| Error::Io { action: "start", path: "another process of this program".into(), source };
    let program = std::env::current_exe().map_err(failed)?;
    control.check()?;
    let mut child = Command::new(program)
        .args(arguments)
        .env(lowrank_cache::VARIABLE, cache)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(failed)?;
    let (mut stdout, mut stderr) = (child.stdout.take().expect("piped"), child.stderr.take().expect("piped"));
    let begun = Instant::now();
    std::thread::scope(|scope| {
        // Read at once: a child whose pipe is full would wait for ever.
        let out = scope.spawn(move || {
            let mut bytes = Vec::new();
            stdout.read_to_end(&mut bytes).map(|_| bytes)
        });
        let err = scope.spawn(move || {
            let mut bytes = Vec::new();
            // What cannot be read is not known to have been said.
            let _ = stderr.read_to_end(&mut bytes);
            String::from_utf8_lossy(&bytes).into_owned()
        });
        let status = loop {
            match child.try_wait().map_err(failed)? {
                Some(status) => break Some(status),
                None if control.check().is_err() || begun.elapsed() > limit => {
                    // It may have ended by itself meanwhile.
                    let _ = child.kill();
                    child.wait().map_err(failed)?;
                    break None;
                }
                None => std::thread::sleep(BETWEEN_LOOKS),
            }
        };
        let (stdout, stderr) = (out.join().expect("reading does not panic").map_err(failed)?, err.join().expect("nor does this"));
        control.check()?;
        Ok(status.map(|status| ChildOutput { status, stdout, stderr }))
    })
}

/// Makes a run in a child process.
///
/// # Errors
/// `Interrupted`; i/o if the child cannot be started.
pub fn make(arguments: &[OsString], cache: &Path, limit: Duration, control: &Control<'_>) -> Result<RunEnd> {
    let Some(said) = spawn(arguments, cache, limit, control)? else { return Ok(RunEnd::TimedOut) };
    if said.status.success()
        && let Ok(result) = serde_json::from_slice(&said.stdout)
    {
        return Ok(RunEnd::Done(result));
    }
    let object: Json = serde_json::from_slice(&said.stdout).unwrap_or_default();
    let text = |key: &str| object["error"][key].as_str().map(str::to_owned);
    match (text("kind"), text("message")) {
        // A Ctrl-C goes to all processes of a terminal.
        (Some(kind), _) if kind == "interrupted" => Err(Error::Interrupted),
        (Some(kind), Some(message)) => Ok(RunEnd::Failed { kind, message }),
        // Killed from outside, out of memory, or a bug.
        _ => {
            let last = said.stderr.lines().last().unwrap_or_default();
            Ok(RunEnd::Failed { kind: "failed".to_owned(), message: format!("the run ended with {}: {last}", said.status) })
        }
    }
}
