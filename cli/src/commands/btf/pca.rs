//! `biscale btf pca`.

use crate::common::options::{self, CommonArgs};
use crate::common::output::{self, Target};
use crate::common::progress;
use biscale::btf::{
    Arrangement, BtfAbout, BtfFile, BtfWriter, ImageMean, LocalPca, LocalPcaSettings, LocalPcaSize, MOST_CLUSTERS, MOST_COMPONENTS,
    Precision, Vectors, ViewImages,
};
use biscale::error::{BadInput, Error, Result};
use biscale::filter::Control;
use biscale::numerics::cast::narrow;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::io::BufWriter;
use std::path::PathBuf;

/// Most numbers of a BTF: a gigabyte of 32-bit floats, which are held up to five times. Chosen, not measured.
const MOST_NUMBERS: usize = 1 << 28;
/// What is tried where nothing is said, and with a tolerance.
const CLUSTERS: [usize; 4] = [1, 4, 16, 32];
const COMPONENTS: [usize; 2] = [4, 8];
const CLUSTERS_FOR_A_TOLERANCE: [usize; 6] = [1, 2, 4, 8, 16, 32];
const COMPONENTS_FOR_A_TOLERANCE: [usize; 8] = [1, 2, 4, 8, 12, 16, 24, 32];

/// Arguments of `biscale btf pca`.
#[derive(Args, Debug)]
pub struct PcaArgs {
    /// BTF file
    btf: PathBuf,
    /// BTF file to write, with the values that are reconstructed from the smallest result that keeps `--tolerance`, or from the only one
    #[arg(long, short, value_name = "OUT.btf.npz")]
    output: Option<PathBuf>,
    /// Relative RMS error to stay within: the smallest result that does is named
    #[arg(long, value_name = "T", value_parser = options::tolerance)]
    tolerance: Option<f64>,
    /// What a vector is
    #[arg(long, value_enum, default_value_t = ArrangementArg::Both)]
    arrangement: ArrangementArg,
    /// Numbers of clusters to try; without them 1,4,16,32, or with a tolerance powers of 2 up to 32
    #[arg(long, value_name = "K,...", value_delimiter = ',')]
    clusters: Vec<usize>,
    /// Numbers of components to try; without them 4,8, or with a tolerance 1 to 32 up to the first that keeps it
    #[arg(long, value_name = "C,...", value_delimiter = ',')]
    components: Vec<usize>,
    /// How means, components and weights are stored
    #[arg(long, value_enum, default_value_t = PrecisionArg::Half)]
    precision: PrecisionArg,
    /// Starts of each search, of which the best result is kept
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u16).range(1..=1000))]
    starts: u16,
    /// Seed of the starts
    #[arg(long, value_name = "SEED", default_value_t = 0)]
    seed: u64,
    /// Replace an output that exists
    #[arg(long)]
    force: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ArrangementArg {
    /// A texel's values in all pairs of view and light
    Brdf,
    /// A pair's values at all texels
    Texture,
    /// Both are tried
    Both,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum PrecisionArg {
    /// 32-bit floats
    Float,
    /// 16-bit floats
    Half,
    /// Bytes, with a range for each mean, component and column of weights
    Byte,
}

impl From<PrecisionArg> for Precision {
    fn from(argument: PrecisionArg) -> Self {
        match argument {
            PrecisionArg::Float => Self::Float,
            PrecisionArg::Half => Self::Half,
            PrecisionArg::Byte => Self::Byte,
        }
    }
}

/// One line of the table.
#[derive(Clone, Debug, Serialize)]
struct Tried {
    arrangement: &'static str,
    clusters: usize,
    components: usize,
    /// Relative RMS errors as computed, and as stored.
    relative_rms: f64,
    relative_rms_stored: f64,
    /// Bytes of components and weights, and of everything.
    bytes_of_components: usize,
    bytes: usize,
    turns: usize,
}

/// What is kept for an output.
struct Kept {
    line: usize,
    values: Vec<[f32; 3]>,
}

/// Runs the command.
///
/// # Errors
/// Bad input, and i/o; nothing is written then.
pub fn run(args: &PcaArgs, common: &CommonArgs) -> Result<()> {
    if let Some(out) = args.output.as_ref().filter(|out| output::ending(out) != "npz") {
        return Err(output::unknown_ending(out, "use .btf.npz"));
    }
    let target = args.output.as_ref().map(|out| Target::new(out, args.force, &[&args.btf], |_| false)).transpose()?;
    let mut btf = BtfFile::open(&args.btf)?;
    let (values, texels) = (all_values(&mut btf)?, btf.about.texels[0] * btf.about.texels[1]);
    let settings = Ladder::new(args, values.len(), texels)?;
    if target.is_some() && args.tolerance.is_none() && settings.count() != 1 {
        let bad = BadInput::new(
            "it is not said which result to write",
            "give `--tolerance`, or one arrangement, one number of clusters and one of components",
        );
        return Err(bad.at_field("output").into());
    }
    let raw = 2 * 3 * values.len();
    let (tried, kept) = progress::with_control(common, |control| settings.run(args, &values, texels, control))?;
    if let Some(target) = &target {
        let Some(kept) = &kept else {
            let bad = BadInput::new(
                "no result that was tried keeps the tolerance: nothing is written",
                "loosen it, or try more `--clusters` or `--components`",
            );
            return Err(bad.at_field("tolerance").into());
        };
        let images = reconstructed(&btf, &values, &kept.values);
        let about = about(&btf.about, &tried[kept.line], args.precision);
        target.write_file(|file| {
            let mut writer = BtfWriter::new(BufWriter::new(file), btf.about.texels, &btf.views, &btf.lights)?;
            images.iter().try_for_each(|view| writer.push(view))?;
            writer.finish(&about)
        })?;
    }
    tell(
        args,
        common,
        &Summary { raw_bytes: raw, tried: &tried, chosen: kept.as_ref().map(|k| &tried[k.line]), output: args.output.as_ref() },
    )
}

/// All images, view after view.
fn all_values(btf: &mut BtfFile) -> Result<Vec<[f32; 3]>> {
    let numbers =
        [btf.views.len(), btf.lights.len(), btf.about.texels[0], btf.about.texels[1], 3].iter().try_fold(1_usize, |n, k| n.checked_mul(*k));
    if numbers.is_none_or(|n| n > MOST_NUMBERS) {
        let what = "the BTF has too many values to be held at once".to_owned();
        let remedy = format!("make it with fewer texels or directions: at most {MOST_NUMBERS} numbers");
        return Err(Error::Unsupported { what, remedy });
    }
    (0..btf.views.len()).try_fold(Vec::new(), |mut all, view| {
        all.append(&mut btf.view(view)?);
        Ok(all)
    })
}

/// What is tried.
struct Ladder {
    arrangements: Vec<Arrangement>,
    clusters: Vec<usize>,
    components: Vec<usize>,
}

impl Ladder {
    fn new(args: &PcaArgs, values: usize, texels: usize) -> Result<Self> {
        let arrangements = match args.arrangement {
            ArrangementArg::Brdf => vec![Arrangement::Brdf],
            ArrangementArg::Texture => vec![Arrangement::Texture],
            ArrangementArg::Both => vec![Arrangement::Brdf, Arrangement::Texture],
        };
        let most = arrangements.iter().map(|a| vectors_of(*a, values, texels)).fold(MOST_CLUSTERS, usize::min);
        let list = |field: &str, given: &[usize], least: usize, most: usize, otherwise: &[usize]| -> Result<Vec<usize>> {
            if let Some(bad) = given.iter().find(|n| !(least..=most).contains(*n)) {
                return Err(BadInput::new(format!("{bad}"), format!("use {least} to {most}")).at_field(field).into());
            }
            let mut list = if given.is_empty() { otherwise.iter().copied().filter(|n| *n <= most).collect() } else { given.to_vec() };
            list.sort_unstable();
            list.dedup();
            Ok(list)
        };
        let searched = args.tolerance.is_some();
        let clusters: &[usize] = if searched { &CLUSTERS_FOR_A_TOLERANCE } else { &CLUSTERS };
        let components: &[usize] = if searched { &COMPONENTS_FOR_A_TOLERANCE } else { &COMPONENTS };
        Ok(Self {
            arrangements,
            clusters: list("clusters", &args.clusters, 1, most, clusters)?,
            components: list("components", &args.components, 0, MOST_COMPONENTS, components)?,
        })
    }

    /// Settings that are tried at most.
    fn count(&self) -> usize {
        self.arrangements.len() * self.clusters.len() * self.components.len()
    }

    /// Tries all of it; with a tolerance only what is smaller than the smallest result that keeps it, and than the values themselves.
    fn run(&self, args: &PcaArgs, values: &[[f32; 3]], texels: usize, control: &Control<'_>) -> Result<(Vec<Tried>, Option<Kept>)> {
        let (mut tried, mut kept): (Vec<Tried>, Option<Kept>) = (Vec::new(), None);
        let precision = Precision::from(args.precision);
        let steps = self.count();
        let mut step = 0;
        for &arrangement in &self.arrangements {
            let vectors = Vectors::arrange(values, texels, arrangement)?;
            for &clusters in &self.clusters {
                for (nth, &components) in self.components.iter().enumerate() {
                    let size = LocalPcaSize::of(vectors.count(), vectors.length, clusters, components, precision);
                    let most = kept.as_ref().map_or(2 * 3 * values.len(), |kept| tried[kept.line].bytes);
                    if args.tolerance.is_some() && size.all >= most {
                        break;
                    }
                    let settings = LocalPcaSettings { clusters, components, starts: usize::from(args.starts), seed: args.seed };
                    let share = (step + nth) as f64 / steps as f64..(step + nth + 1) as f64 / steps as f64;
                    let found = control.part(share, |control| LocalPca::fit(&vectors, &settings, control))?;
                    let stored = found.stored(&vectors, precision);
                    tried.push(Tried {
                        arrangement: arrangement.name(),
                        clusters,
                        components,
                        relative_rms: found.relative_rms,
                        relative_rms_stored: stored.relative_rms,
                        bytes_of_components: size.components,
                        bytes: size.all,
                        turns: found.turns,
                    });
                    let keeps = args.tolerance.map_or(steps == 1, |tolerance| stored.relative_rms <= tolerance);
                    if keeps {
                        kept = Some(Kept { line: tried.len() - 1, values: stored.reconstruct().images(arrangement) });
                    }
                    if keeps && args.tolerance.is_some() {
                        break;
                    }
                }
                step += self.components.len();
            }
        }
        Ok((tried, kept))
    }
}

fn vectors_of(arrangement: Arrangement, values: usize, texels: usize) -> usize {
    match arrangement {
        Arrangement::Brdf => texels,
        Arrangement::Texture => values / texels.max(1),
    }
}

/// The images that a result stands for: negative values, which no surface has, are 0. Their error is that of the images before and what they differ by.
fn reconstructed(btf: &BtfFile, before: &[[f32; 3]], values: &[[f32; 3]]) -> Vec<ViewImages> {
    let (lights, texels) = (btf.lights.len(), btf.about.texels[0] * btf.about.texels[1]);
    let view = |view: usize| {
        let mut images = ViewImages::default();
        images.cover.extend_from_slice(&btf.cover[view * texels..(view + 1) * texels]);
        for light in 0..lights {
            let at = view * lights + light;
            let range = at * texels..(at + 1) * texels;
            let image: Vec<[f32; 3]> = values[range.clone()].iter().map(|v| v.map(|v| v.max(0.0))).collect();
            let differ = image.iter().flatten().zip(before[range].iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
            let error = (differ / (3 * texels) as f64).sqrt().hypot(btf.errors[at]);
            images.error.extend(std::iter::repeat_n([narrow(error); 3], texels));
            let mean: [f64; 3] = std::array::from_fn(|c| image.iter().map(|v| f64::from(v[c])).sum::<f64>() / texels as f64);
            let was = btf.means[at];
            images.means.push(ImageMean { mean, error: std::array::from_fn(|c| was.error[c].hypot(mean[c] - was.mean[c])) });
            images.value.extend(image);
        }
        images
    };
    (0..btf.views.len()).map(view).collect()
}

/// What the output says of itself.
fn about(before: &BtfAbout, made: &Tried, precision: PrecisionArg) -> BtfAbout {
    let note = format!(
        "reconstructed from a local principal component analysis: vectors are {}s, clusters {}, components {}, {} bytes as {}, relative RMS error {:.3} %",
        if made.arrangement == Arrangement::Brdf.name() { "texel" } else { "pair" },
        made.clusters,
        made.components,
        made.bytes,
        match precision {
            PrecisionArg::Float => "32-bit floats",
            PrecisionArg::Half => "16-bit floats",
            PrecisionArg::Byte => "bytes",
        },
        100.0 * made.relative_rms_stored
    );
    let notes = before.notes.iter().cloned().chain([note]).collect();
    BtfAbout { notes, relative_rms: before.relative_rms.hypot(made.relative_rms_stored), ..before.clone() }
}

/// The output of `--json`.
#[derive(Serialize)]
struct Summary<'a> {
    /// Bytes of the values as 16-bit floats.
    raw_bytes: usize,
    tried: &'a [Tried],
    chosen: Option<&'a Tried>,
    output: Option<&'a PathBuf>,
}

fn tell(args: &PcaArgs, common: &CommonArgs, summary: &Summary<'_>) -> Result<()> {
    if common.json {
        return output::print_json(summary);
    }
    output::tell(common, "arrangement  clusters  components  error     stored    bytes        of 16-bit values");
    for t in summary.tried {
        let share = 100.0 * t.bytes as f64 / summary.raw_bytes as f64;
        output::tell(
            common,
            &format!(
                "{:<12} {:<9} {:<11} {:<9} {:<9} {:<12} {share:.1} %",
                t.arrangement,
                t.clusters,
                t.components,
                format!("{:.2} %", 100.0 * t.relative_rms),
                format!("{:.2} %", 100.0 * t.relative_rms_stored),
                t.bytes
            ),
        );
    }
    match (summary.chosen, args.tolerance) {
        (Some(c), Some(tolerance)) => output::tell(
            common,
            &format!(
                "the smallest that keeps {:.3} %: {}, clusters {}, components {}, {} bytes",
                100.0 * tolerance,
                c.arrangement,
                c.clusters,
                c.components,
                c.bytes
            ),
        ),
        (None, Some(tolerance)) => {
            output::tell(common, &format!("note: nothing that was tried and is smaller than the values keeps {:.3} %", 100.0 * tolerance));
        }
        _ => {}
    }
    if let Some(out) = summary.output {
        output::tell(common, &format!("wrote {}", out.display()));
    }
    Ok(())
}
