//! `biscale eval`: the effective BRDF at listed directions.

use crate::common::filter_summary::FilterSummary;
use crate::common::options::{CommonArgs, QualityArgs};
use crate::common::output::{self, Target};
use crate::common::pairs::{self, Pairs};
use crate::common::progress;
use biscale::error::{Error, Result};
use biscale::filter::{self, Effective, Quality, Value};
use biscale::material::Material;
use biscale::table::EffectiveTable;
use biscale::table::is_openexr;
use clap::Args;
use rayon::prelude::*;
use serde::{Serialize, Serializer};
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Instant;

/// The header of the CSV output.
pub const HEADER: &str = "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z,fbar_r,fbar_g,fbar_b,fhat_r,fhat_g,fhat_b,se_r,se_g,se_b,av";

/// Arguments of `biscale eval`.
#[derive(Args, Debug)]
pub struct EvalArgs {
    /// Material file, or a table that `bake` wrote
    pub(crate) material: PathBuf,
    /// CSV with the columns `wi_x,wi_y,wi_z,wo_x,wo_y,wo_z`; `-` is standard input
    #[arg(long, value_name = "PAIRS.csv")]
    pairs: PathBuf,
    /// CSV to write; without it, or with `-`, standard output
    #[arg(long, short, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Replace an output that exists and was not made by this command
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    quality: QualityArgs,
}

/// Runs the command.
///
/// # Errors
/// Bad input, and those of [`filter::effective`]; nothing is written then.
pub fn run(args: &EvalArgs, common: &CommonArgs) -> Result<()> {
    let quality = args.quality.quality()?;
    let target = match &args.output {
        Some(path) => {
            let inputs = [args.material.as_path(), args.pairs.as_path()];
            Some(Target::new(path, args.force, &inputs, |file| output::begins_with(file, HEADER))?).filter(|t| !t.is_stdout())
        }
        None => None,
    };
    if is_openexr(&args.material) {
        return between_nodes(args, common, target.as_ref());
    }
    let start = Instant::now();
    let material = Material::load(&args.material)?;
    quality.method_for(&material)?;
    let surface = material.build()?;
    let loaded = Instant::now();
    let Pairs { written, pairs } = pairs::load(&args.pairs)?;
    let before = [("load", (loaded - start).as_secs_f64() * 1e3), ("pairs", loaded.elapsed().as_secs_f64() * 1e3)];
    let advice = args.quality.advice(quality.bounces_of(material.bounces));
    let Effective { values, summary } =
        progress::with_advice(common, advice, |control| filter::effective(&surface, &pairs, &quality, control))?;
    drop(pairs);
    refuse_not_finite(&values)?;
    let rows = Rows { written: &written, values: &values };
    let summary = FilterSummary::new(&material, &surface, &quality, values.len(), &before, &summary, args.quality.notes());
    write(common, target.as_ref(), rows, summary)
}

/// Evaluates a baked table between its nodes.
fn between_nodes(args: &EvalArgs, common: &CommonArgs, target: Option<&Target>) -> Result<()> {
    let start = Instant::now();
    let table = EffectiveTable::load(&args.material)?;
    let loaded = Instant::now();
    let Pairs { written, pairs } = pairs::load(&args.pairs)?;
    let read = Instant::now();
    let values: Vec<Value> = pairs.par_iter().map(|p| table.eval(p.wi, p.wo)).collect();
    let ms = |time: std::time::Duration| time.as_secs_f64() * 1e3;
    let stages = [("load", ms(loaded - start)), ("pairs", ms(read - loaded)), ("interpolation", ms(read.elapsed()))];
    let mut notes = args.quality.notes();
    if (Quality { cache: None, ..args.quality.quality()? }) != Quality::default() {
        notes.push("a baked table is evaluated as it is: options of quality do not apply to it".to_owned());
    }
    let summary = FilterSummary::of_table(&table, values.len(), &stages, notes);
    write(common, target, Rows { written: &written, values: &values }, summary)
}

fn write(common: &CommonArgs, target: Option<&Target>, rows: Rows<'_>, summary: FilterSummary<'_>) -> Result<()> {
    let summary = summary.for_user(common);
    match target {
        Some(target) => target.write(|out| rows.write_csv(out))?,
        None if !common.json => Target::stdout().write(|out| rows.write_csv(out))?,
        None => {}
    }
    if common.json {
        return output::print_json(&Object { summary, rows: target.is_none().then_some(rows) });
    }
    output::tell(common, &summary.to_string());
    if let Some(target) = target {
        output::tell(common, &format!("wrote {}", target.path().display()));
    }
    Ok(())
}

/// The method promises finite values: anything else is a fault of this program and must not pass as a result.
fn refuse_not_finite(values: &[Value]) -> Result<()> {
    let finite = |v: &Value| v.fbar.iter().chain(&v.fhat).chain(&v.se).all(|x| x.is_finite()) && v.av.is_finite();
    match values.iter().position(|v| !finite(v)) {
        None => Ok(()),
        Some(row) => Err(Error::Numeric(format!("the value of pair {} is not finite; please report this", row + 1))),
    }
}

/// The output of `--json`.
#[derive(Serialize)]
struct Object<'a> {
    summary: FilterSummary<'a>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rows: Option<Rows<'a>>,
}

/// All rows of the output, made one at a time: there may be millions.
#[derive(Clone, Copy)]
struct Rows<'a> {
    written: &'a [[f64; 6]],
    values: &'a [Value],
}

impl<'a> Rows<'a> {
    fn iter(self) -> impl Iterator<Item = [f64; 16]> + 'a {
        self.written.iter().zip(self.values).map(|(w, v)| {
            let [a, b, c, d, e, f] = *w;
            let ([r, g, bl], [hr, hg, hb], [sr, sg, sb]) = (v.fbar, v.fhat, v.se);
            [a, b, c, d, e, f, r, g, bl, hr, hg, hb, sr, sg, sb, v.av]
        })
    }

    /// Numbers are the shortest that read back to the same bits.
    fn write_csv(self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "{HEADER}")?;
        let mut line = Vec::with_capacity(512);
        for row in self.iter() {
            line.clear();
            for number in row {
                serde_json::to_writer(&mut line, &number)?;
                line.push(b',');
            }
            line.pop();
            line.push(b'\n');
            out.write_all(&line)?;
        }
        Ok(())
    }
}

impl Serialize for Rows<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter().map(Row))
    }
}

/// One row as an object with the names of the columns.
struct Row([f64; 16]);

impl Serialize for Row {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(HEADER.split(',').zip(self.0))
    }
}
