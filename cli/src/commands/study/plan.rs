//! What a study asks, and what it runs.

use super::args::StudyArgs;
use super::folder::StudyIdentity;
use crate::common::content_hash::{hash_of_pairs, hash_of_surface};
use crate::common::options::CommonArgs;
use crate::common::pairs;
use biscale::error::{BadInput, Result};
use biscale::material::{Material, SmallScale};
use biscale::study::{self, Asked, Question, Series, Work};
use std::ffi::OsString;
use std::path::Path;
use std::time::Duration;

/// Pairs of the list that the study asks, and of a quick one. Chosen, as the numbers below, not measured: more pairs cost time at every setting, fewer
/// leave little to judge by.
const LIST_PAIRS: [usize; 2] = [256, 48];
/// Directions of the table, and pairs of it that are judged. 272 make 37,128 different pairs.
const TABLE: [[u64; 2]; 2] = [[272, 256], [64, 64]];
/// Relative RMS error of the truth.
const TRUTH_TOLERANCE: [f64; 2] = [0.001, 0.005];
/// Wall seconds of the truth.
const TRUTH_SECONDS: [f64; 2] = [60.0, 10.0];
/// Runs of a setting.
const SEEDS: [u64; 2] = [3, 1];

/// What is asked, and what is run.
pub struct StudyPlan {
    pub material: Material,
    pub small: SmallScale,
    pub ladder: Vec<Series>,
    pub asked: Vec<(Asked, Question)>,
    /// Arguments of the table's child: directions, judged, seed.
    pub table: [u64; 3],
    pub seed: u64,
    pub seeds: u64,
    pub truth: Work,
    pub truth_time: Duration,
    pub time_limit: Duration,
    pub threads: u16,
}

impl StudyPlan {
    /// Reads the files that the arguments name.
    ///
    /// # Errors
    /// Bad input and i/o.
    pub fn new(args: &StudyArgs, common: &CommonArgs) -> Result<Self> {
        let material = Material::load(&args.material)?;
        let small = material.build()?;
        let quick = usize::from(args.quick);
        let [directions, judged] = TABLE[quick];
        let table = [directions, judged, args.seed];
        let asked = match &args.pairs {
            Some(path) => {
                let pairs = pairs::load(path)?.pairs;
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

    /// What is to be said of a material that says `bounces`.
    pub fn direct_light(&self) -> String {
        format!(
            "direct light only; the `bounces = {}` of the material are left aside, since most methods know no others",
            self.small.bounces
        )
    }

    /// What makes two studies comparable.
    pub fn identity(&self) -> StudyIdentity {
        StudyIdentity {
            name: self.material.name.clone(),
            material: hash_of_surface(&self.small),
            pairs: hash_of_pairs(self.asked.iter().map(|(_, q)| &q.pairs[..])),
            seed: self.seed,
            truth: self.truth.to_string(),
        }
    }

    /// Arguments of a child that runs a setting.
    pub fn arguments(&self, asked: Asked, pairs: &Path, setting: &str, seed: u64) -> Vec<OsString> {
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
}
