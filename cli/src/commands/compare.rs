//! `biscale compare`: how far two images are apart.

use crate::common::flip::flip_errors;
use crate::common::options::{self, CommonArgs};
use crate::common::output::{self, Target};
use biscale::error::{BadInput, Result};
use biscale::image_file::{self, Raster};
use biscale::numerics::cast::narrow;
use biscale::numerics::colour::{byte, linear_to_srgb};
use biscale::render::{Difference, colour_code, difference_of};
use clap::Args;
use nv_flip::DEFAULT_PIXELS_PER_DEGREE;
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};

/// Arguments of `biscale compare`.
#[derive(Args, Debug)]
#[command(
    after_help = "Two images of floats (.exr, .hdr, .tiff) are compared as they are, linear, with the largest value of A as peak of the \
                        PSNR. Otherwise images are compared as a screen is sent them: sRGB-encoded, 0..1, peak 1. FLIP (Andersson \
                        et al. 2020) always compares what a screen is sent, in 8 bits."
)]
pub struct CompareArgs {
    /// The image that is right: .exr, .hdr, .png, .tif
    a: PathBuf,
    /// The image that is judged
    b: PathBuf,
    /// Three panels to write: A, B, and their difference, colour-coded
    #[arg(long, short, value_name = "PANELS.png")]
    output: Option<PathBuf>,
    /// Factor of the difference in the third panel
    #[arg(long, value_name = "N", default_value_t = 3.0, value_parser = factor, allow_negative_numbers = true)]
    factor: f64,
    /// Stops by which images of floats are shown, and encoded, brighter
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, value_parser = options::exposure, allow_negative_numbers = true)]
    exposure: f64,
    /// Pixels a degree of the viewer's field, for FLIP
    #[arg(long, value_name = "N", default_value_t = DEFAULT_PIXELS_PER_DEGREE, value_parser = pixels_per_degree, allow_negative_numbers = true)]
    pixels_per_degree: f32,
    /// Replace an output that exists and was not made by this command
    #[arg(long)]
    force: bool,
}

/// What the panels say of who made them.
const SOFTWARE: &str = concat!("biscale compare ", env!("CARGO_PKG_VERSION"));
const MARK: &str = "biscale compare ";
/// White pixels between the panels.
const GAP: usize = 4;

fn factor(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|v| (1e-3..=1e6).contains(v)).ok_or_else(|| "write a number from 0.001 to 1000000".to_owned())
}

fn pixels_per_degree(text: &str) -> Result<f32, String> {
    text.trim().parse().ok().filter(|v| (1.0..=1000.0).contains(v)).ok_or_else(|| "write a number from 1 to 1000".to_owned())
}

/// An image as it is compared and as it is shown.
struct Image {
    raster: Raster,
    /// Stops by which floats are shown brighter, as a factor.
    gain: f64,
    /// sRGB, 8 bits.
    shown: Vec<u8>,
}

impl Image {
    fn new(raster: Raster, exposure: f64) -> Self {
        let mut image = Self { raster, gain: exposure.exp2(), shown: Vec::new() };
        image.shown = (0..image.count()).flat_map(|at| image.pixel(at)).map(|v| byte(image.encoded(v).into())).collect();
        image
    }

    fn count(&self) -> usize {
        self.raster.width * self.raster.height
    }

    fn pixel(&self, at: usize) -> [f32; 3] {
        let channels = &self.raster.channels;
        std::array::from_fn(|c| channels[c.min(channels.len() - 1)][at])
    }

    /// As a screen is sent it.
    fn encoded(&self, v: f32) -> f32 {
        if self.raster.integer { v } else { narrow(linear_to_srgb(self.gain * f64::from(v))) }
    }

    /// The pixels that are compared: they are made as they are needed, since the largest images leave no memory for another copy.
    fn compared(&self, linear: bool) -> impl Iterator<Item = [f32; 3]> {
        (0..self.count()).map(move |at| {
            let pixel = self.pixel(at);
            if linear { pixel } else { pixel.map(|v| self.encoded(v)) }
        })
    }
}

/// Runs the command.
///
/// # Errors
/// Bad input and i/o; nothing is written then.
pub fn run(args: &CompareArgs, common: &CommonArgs) -> Result<()> {
    let target = args.output.as_ref().map(|path| {
        if output::ending(path) != "png" {
            let bad = BadInput::new("the panels are written as PNG only", "name a file that ends in .png");
            return Err(bad.in_file(path).at_field("output").into());
        }
        Target::new(path, args.force, &[&args.a, &args.b], |file| output::has_mark(file, MARK))
    });
    let target = target.transpose()?;
    let (a, b) = (read(&args.a, common)?, read(&args.b, common)?);
    if (a.width, a.height) != (b.width, b.height) {
        let problem = format!("the image is {} x {}, and {} is {} x {}", b.width, b.height, args.a.display(), a.width, a.height);
        return Err(BadInput::new(problem, "compare images of the same size").in_file(&args.b).into());
    }
    let linear = !a.integer && !b.integer;
    let size = [a.width, a.height];
    let (a, b) = (Image::new(a, args.exposure), Image::new(b, args.exposure));
    let pixels = a.compared(linear).zip(b.compared(linear));
    let Difference { psnr, relative_rms, rms, largest, peak } = difference_of(pixels, (!linear).then_some(1.0));
    let flip = flip_errors(size, &a.shown, &b.shown, args.pixels_per_degree);
    let values = if linear { "linear" } else { "sRGB-encoded" };
    let summary = Summary {
        identical: largest == 0.0,
        psnr_db: psnr,
        relative_rms,
        rms,
        largest,
        peak,
        values,
        flip_mean: flip.mean,
        flip_largest: flip.largest,
    };
    if let Some(target) = &target {
        let (panels, size) = panels(&a, &b, size, args.factor);
        let comment = format!("{} | {} | difference times {}: {summary}", name(&args.a), name(&args.b), args.factor);
        let png = output::png::encode(size, &panels, false, SOFTWARE, &comment)?;
        target.write(|out| out.write_all(&png))?;
    }
    if common.json {
        return output::print_json(&Object { output: args.output.as_deref(), summary });
    }
    output::print(&format!("{summary}\n"))
}

/// An image; of a Radiance picture what is odd about it is told.
fn read(path: &Path, common: &CommonArgs) -> Result<Raster> {
    if output::ending(path) != "hdr" {
        return image_file::read(path);
    }
    let (raster, note) = image_file::read_radiance(path)?;
    if let Some(note) = note {
        output::tell(common, &format!("note: {}: {note}", path.display()));
    }
    Ok(raster)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A, B and their difference beside each other, with the size of the whole.
fn panels(a: &Image, b: &Image, [width, height]: [usize; 2], factor: f64) -> (Vec<u8>, [u32; 2]) {
    let mut pixels = Vec::with_capacity(3 * (3 * width + 2 * GAP) * height);
    for row in 0..height {
        let range = 3 * row * width..3 * (row + 1) * width;
        let (a, b) = (&a.shown[range.clone()], &b.shown[range]);
        pixels.extend_from_slice(a);
        pixels.extend([255; 3 * GAP]);
        pixels.extend_from_slice(b);
        pixels.extend([255; 3 * GAP]);
        for (a, b) in a.chunks_exact(3).zip(b.chunks_exact(3)) {
            let off: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a.abs_diff(*b)) / 255.0).sum::<f64>() / 3.0;
            pixels.extend(colour_code(factor * off).map(byte));
        }
    }
    let side = |s: usize| u32::try_from(s).expect("images are limited");
    (pixels, [side(3 * width + 2 * GAP), side(height)])
}

/// The output of `--json`.
#[derive(Serialize)]
struct Object<'a> {
    output: Option<&'a Path>,
    summary: Summary,
}

/// The differences. Shown as a line of text, or serialised (a PSNR that is no number as null).
#[derive(Clone, Copy, Debug, Serialize)]
struct Summary {
    /// Whether no value differs: then the PSNR is infinite.
    identical: bool,
    psnr_db: f64,
    relative_rms: f64,
    rms: f64,
    largest: f64,
    peak: f64,
    values: &'static str,
    flip_mean: f64,
    flip_largest: f32,
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { identical, psnr_db, relative_rms, largest, peak, values, flip_mean, flip_largest, .. } = self;
        let psnr = match psnr_db {
            _ if *identical => "the images are identical, PSNR infinite".to_owned(),
            // A peak of 0 measures nothing.
            psnr if psnr.is_nan() => "PSNR undefined, since A is black".to_owned(),
            psnr => format!("PSNR {psnr:.2} dB"),
        };
        write!(
            f,
            "{psnr} (peak {peak:.4}, {values}), relative RMS {:.3} %, largest difference {largest:.4}, FLIP mean {flip_mean:.4}, largest \
             {flip_largest:.4}",
            100.0 * relative_rms
        )
    }
}
