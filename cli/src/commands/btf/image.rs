//! `biscale btf image`.

use crate::common::options::{self, CommonArgs};
use crate::common::output::{self, Target};
use biscale::btf::BtfFile;
use biscale::error::{BadInput, Result};
use biscale::numerics::cast::index_u32;
use biscale::render::{Picture, SOFTWARE};
use clap::Args;
use glam::DVec3;
use std::io::BufWriter;
use std::path::PathBuf;

/// Arguments of `biscale btf image`.
#[derive(Args, Debug)]
pub struct ImageArgs {
    /// BTF file
    btf: PathBuf,
    /// File to write: `.png`, or `.exr` with linear values of `B`, 1/sr
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
    /// Which view, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    view: usize,
    /// Which light, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    light: usize,
    /// Periods across and along
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=64))]
    repeat: u16,
    /// Stops to brighten by; without it bright texels become white (.png)
    #[arg(long, value_name = "STOPS", value_parser = options::exposure, allow_negative_numbers = true)]
    exposure: Option<f64>,
    /// Replace an output that exists
    #[arg(long)]
    force: bool,
}

/// Most pixels along a side. Chosen, not measured: 4 GB of memory.
const MOST_PIXELS: usize = 1 << 14;

/// Runs the command.
///
/// # Errors
/// Bad input, and i/o; nothing is written then.
pub fn run(args: &ImageArgs, common: &CommonArgs) -> Result<()> {
    let ending = output::ending(&args.output);
    if ending != "png" && ending != "exr" {
        return Err(output::unknown_ending(&args.output, "use .png or .exr"));
    }
    let target = Target::new(&args.output, args.force, &[&args.btf], |_| false)?;
    let mut btf = BtfFile::open(&args.btf)?;
    if args.light >= btf.lights.len() {
        let what = format!("there is no light {}: the BTF has {}, numbered from 0", args.light, btf.lights.len());
        return Err(BadInput::new(what, "name one of them").in_file(&args.btf).at_field("light").into());
    }
    let [columns, rows] = btf.about.texels;
    let values = btf.view(args.view)?;
    let image = &values[args.light * columns * rows..(args.light + 1) * columns * rows];
    let repeat = usize::from(args.repeat);
    let (width, height) = (columns * repeat, rows * repeat);
    if width.max(height) > MOST_PIXELS {
        let what = format!("{width} x {height} pixels are too many");
        return Err(BadInput::new(what, format!("use at most {MOST_PIXELS} along a side")).at_field("repeat").into());
    }
    let mut picture = Picture::new(index_u32(width), index_u32(height));
    for (at, pixel) in picture.rgb.iter_mut().enumerate() {
        *pixel = image[at / width % rows * columns + at % width % columns];
    }
    picture.alpha.fill(1.0);
    let (wo, wi) = (btf.views[args.view], btf.lights[args.light]);
    let comment = format!("view {} from {}, light {} from {}", args.view, angles(wo), args.light, angles(wi));
    let stops = args.exposure.unwrap_or_else(|| picture.auto_exposure());
    if ending == "exr" {
        target.write_file(|file| picture.write_exr(BufWriter::new(file), false, &comment))?;
    } else {
        let png = output::png::encode([index_u32(width), index_u32(height)], &picture.to_srgb(stops, false), false, SOFTWARE, &comment)?;
        target.write(|out| out.write_all(&png))?;
    }
    output::tell(common, &comment);
    let mean = btf.means[args.view * btf.lights.len() + args.light];
    output::tell(common, &format!("mean {:.4} {:.4} {:.4} 1/sr", mean.mean[0], mean.mean[1], mean.mean[2]));
    if ending == "png" {
        output::tell(common, &format!("exposure {stops:.1} stops"));
    }
    output::tell(common, &format!("wrote {}", args.output.display()));
    Ok(())
}

/// A direction in degrees.
fn angles(w: DVec3) -> String {
    let theta = w.truncate().length().atan2(w.z).to_degrees();
    format!("theta {theta:.1}, phi {:.1} degrees", w.y.atan2(w.x).to_degrees().rem_euclid(360.0))
}
