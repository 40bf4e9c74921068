//! `biscale btf ptm`.

use crate::common::options::{self, CommonArgs};
use crate::common::output::{self, Target};
use biscale::btf::{BtfFile, LightFit, Ptm};
use biscale::error::Result;
use biscale::numerics::cast::narrow;
use biscale::numerics::colour::linear_to_srgb;
use biscale::render::Picture;
use clap::Args;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Arguments of `biscale btf ptm`.
#[derive(Args, Debug)]
pub struct PtmArgs {
    /// BTF file
    btf: PathBuf,
    /// File to write: `.ptm`
    #[arg(long, short, value_name = "OUT.ptm")]
    output: PathBuf,
    /// Which view, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    view: usize,
    /// A polynomial for each channel (format RGB) in place of one for luminance (format LRGB)
    #[arg(long)]
    rgb: bool,
    /// Stops to brighten by; without it bright texels become white
    #[arg(long, value_name = "STOPS", value_parser = options::exposure, allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Keep values linear: viewers show them too dark, and measure them right
    #[arg(long)]
    linear: bool,
    /// Replace an output that exists
    #[arg(long)]
    force: bool,
}

/// Runs the command.
///
/// # Errors
/// Bad input, and i/o; nothing is written then.
pub fn run(args: &PtmArgs, common: &CommonArgs) -> Result<()> {
    if output::ending(&args.output) != "ptm" {
        return Err(output::unknown_ending(&args.output, "use .ptm"));
    }
    let target = Target::new(&args.output, args.force, &[&args.btf], |_| false)?;
    let mut btf = BtfFile::open(&args.btf)?;
    let values = btf.view(args.view)?;
    // All images of the view are one picture: what is white in one is so in all.
    let picture = Picture { rgb: values, ..Picture::new(0, 0) };
    let stops = args.exposure.unwrap_or_else(|| picture.auto_exposure());
    let mut values = picture.rgb;
    let shown = |v: f32| {
        let level = (f64::from(v) * stops.exp2()).min(1.0);
        narrow(if args.linear { level } else { linear_to_srgb(level) })
    };
    values.iter_mut().for_each(|rgb| *rgb = rgb.map(shown));
    let fit = LightFit::new(&btf.lights)?;
    let ptm = if args.rgb { Ptm::fit_rgb(&fit, btf.about.texels, &values) } else { Ptm::fit_luminance(&fit, btf.about.texels, &values) };
    let mut bytes = Vec::new();
    ptm.write(&mut bytes).map_err(|source| biscale::error::Error::Io { action: "write", path: args.output.clone(), source })?;
    let summary = Summary {
        output: &args.output,
        view: args.view,
        lights: btf.lights.len(),
        rank: fit.rank,
        exposure: stops,
        linear: args.linear,
        relative_rms: ptm.relative_rms(&btf.lights, &values),
        relative_rms_of_file: Ptm::read(&bytes)?.relative_rms(&btf.lights, &values),
    };
    target.write(|out| out.write_all(&bytes))?;
    if common.json {
        return output::print_json(&summary);
    }
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    output::tell(
        common,
        &format!(
            "view {} in {} lights, brightened by {stops:.1} stops{}: relative RMS difference {}, with the bytes of the file {}",
            args.view,
            summary.lights,
            if args.linear { "" } else { " and encoded for a screen (sRGB)" },
            percent(summary.relative_rms),
            percent(summary.relative_rms_of_file)
        ),
    );
    if fit.rank < biscale::btf::TERMS {
        output::tell(common, &format!("note: the lights tell {} of the six coefficients", fit.rank));
    }
    output::tell(common, &format!("wrote {}", args.output.display()));
    Ok(())
}

/// The output of `--json`.
#[derive(Serialize)]
struct Summary<'a> {
    output: &'a Path,
    view: usize,
    lights: usize,
    rank: usize,
    exposure: f64,
    linear: bool,
    relative_rms: f64,
    relative_rms_of_file: f64,
}
