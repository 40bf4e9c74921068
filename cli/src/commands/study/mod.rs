//! `biscale study`: the same question asked of every method at every setting; error against time.
//!
//! Each run is a process of its own ([`child`]) and a line of `study.csv` ([`record`]), so that a study that was interrupted goes on
//! where it stopped. From the lines come plots ([`chart`]) and a report ([`report`]).

mod args;
mod axes;
mod chart;
mod child;
mod folder;
mod pictures;
mod plan;
mod points;
mod record;
mod report;
mod report_parts;
mod runs;
mod summary;

pub use args::StudyArgs;
pub use child::{RunArgs, run as run_one};

use crate::common::options::CommonArgs;
use crate::common::output;
use crate::common::progress;
use biscale::error::Result;
use biscale::filter::Control;
use folder::{Folder, Opening};
use pictures::Studio;
use plan::StudyPlan;
use record::Records;
use report::ReportPictures;
use runs::Runs;
use summary::StudySummary;

/// Share of the progress that the runs take; the pictures take the rest.
const RUNS: f64 = 0.8;

/// Runs the command.
///
/// # Errors
/// Bad input, i/o, and `Interrupted`, after which a rerun goes on.
pub fn run(args: &StudyArgs, common: &CommonArgs) -> Result<()> {
    let plan = StudyPlan::new(args, common)?;
    let opening = Opening { force: args.force, inputs: &[Some(&args.material), args.pairs.as_ref()], pictures: &pictures::old_files() };
    let folder = Folder::open(&args.output, &plan.identity(), &opening)?;
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
    let share = if studio.is_some() { RUNS } else { 1.0 };
    let (truths, rendered) = progress::with_control(common, |control| {
        let of_runs = |stage: &str, done: f64| (control.progress)(stage, share * done);
        let runs = Runs { plan: &plan, folder: &folder, records: &mut records };
        let truths = runs.carry_out(&Control { progress: &of_runs, ..*control })?;
        let of_pictures = |done: f64| (control.progress)("pictures", share + (1.0 - share) * done);
        let rendered = studio.as_ref().map(|s| s.make(&folder, &of_pictures, control)).transpose()?;
        Ok((truths, rendered.unwrap_or_default()))
    })?;
    folder.remove_cache()?;
    let points = points::points(&plan.ladder, &records.all);
    let pictures = ReportPictures {
        pareto: chart::pareto(&plan.material.name, plan.table[0], &points, &truths),
        placement: chart::placement(&plan.material.name, &points),
        ranks: chart::ranks(&plan.material.name, &plan.ladder, &points),
        rendered,
    };
    for (name, chart) in
        [("pareto", Some(&pictures.pareto)), ("placement", pictures.placement.as_ref()), ("ranks", pictures.ranks.as_ref())]
    {
        if let Some(chart) = chart {
            folder.write_chart(name, chart)?;
        }
    }
    let study = report::Study { plan: &plan, records: &records.all, truths: &truths, points: &points };
    folder.write(folder::REPORT, study.html(&pictures, &folder)?.as_bytes())?;
    let summary = StudySummary::new(&plan, &folder, &points, &truths, records.all.len() - before);
    if common.json {
        return output::print_json(&summary);
    }
    output::tell(common, &summary.to_string());
    Ok(())
}
