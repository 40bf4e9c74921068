//! `biscale list`: what is built in.

use crate::common::figure::{self, Anchor, Svg};
use crate::common::options::CommonArgs;
use crate::common::output::{self, Target};
use crate::common::progress;
use biscale::brdf::{Brdf, Measured, fit_names};
use biscale::error::Result;
use biscale::filter::Control;
use biscale::numerics::colour::srgb_byte;
use clap::{Args, ValueEnum};
use glam::DVec3;
use rayon::prelude::*;
use resvg::tiny_skia::{Pixmap, PremultipliedColorU8};
use serde::Serialize;
use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;

/// Arguments of `biscale list`.
#[derive(Args, Debug)]
#[command(after_help = "A material names one so: brdf = { model = \"measured\", name = \"gold-metallic-paint\" }")]
pub struct ListArgs {
    /// What to list
    what: What,
    /// A picture to write, of a ball in each
    #[arg(long, short, value_name = "BALLS.png")]
    output: Option<PathBuf>,
    /// Replace a picture that exists and was not made by this program
    #[arg(long)]
    force: bool,
}

/// What can be listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    /// Built-in BRDFs: fits of the materials of the MERL database
    Brdfs,
}

/// Angle of incidence at which the share of reflected light is told, degrees.
const INCIDENCE_DEG: f64 = 30.0;
/// Columns of the picture, pixels of a cell, and of a ball across.
const COLUMNS: usize = 8;
const CELL: [f64; 2] = [150.0, 118.0];
const BALL: u32 = 92;
/// Samples of a pixel along each side.
const OVERSAMPLED: u32 = 2;

/// A built-in BRDF.
#[derive(Debug, Serialize)]
struct Entry {
    name: &'static str,
    /// Share of the light from 30 degrees that is reflected, linear RGB.
    albedo: [f64; 3],
}

/// Runs the command.
///
/// # Errors
/// Bad input for the picture's name, i/o.
pub fn run(args: &ListArgs, common: &CommonArgs) -> Result<()> {
    let What::Brdfs = args.what;
    let target = match &args.output {
        Some(path) if output::ending(path) != "png" => return Err(output::unknown_ending(path, "name a file that ends in .png")),
        Some(path) => Some(Target::new(path, args.force, &[], |file| output::has_mark(file, figure::MARK))?),
        None => None,
    };
    let brdfs = fit_names().map(|name| Ok((name, Brdf::Measured(Arc::new(Measured::fit(name, 1.0)?))))).collect::<Result<Vec<_>>>()?;
    let entries: Vec<Entry> = brdfs.par_iter().map(|(name, brdf)| Entry::new(name, brdf)).collect();
    if let Some(target) = &target {
        let picture = progress::with_control(common, |control| balls(&brdfs, control))?;
        let png = figure::png(&picture)?;
        target.write(|out| out.write_all(&png))?;
    }
    if common.json {
        return output::print_json(&serde_json::json!({ "brdfs": entries, "picture": args.output }));
    }
    let mut text = String::new();
    for Entry { name, albedo: [r, g, b] } in &entries {
        text += &format!("{name:28} reflects {r:.2} {g:.2} {b:.2}\n");
    }
    output::print(&text)?;
    if let Some(target) = &target {
        output::tell(common, &format!("wrote {}", target.path().display()));
    }
    Ok(())
}

impl Entry {
    fn new(name: &'static str, brdf: &Brdf) -> Self {
        let (sin, cos) = INCIDENCE_DEG.to_radians().sin_cos();
        let wi = DVec3::new(sin, 0.0, cos);
        // Viewers uniform in projected solid angle: their mean times pi is the share of the light.
        let mut albedo = [0.0; 3];
        const SIDE: u32 = 64;
        for k in 0..SIDE * SIDE {
            let [u, v] = [k / SIDE, k % SIDE].map(|k| (f64::from(k) + 0.5) / f64::from(SIDE));
            let (y, x) = (2.0 * PI * v).sin_cos();
            let fr = brdf.eval(DVec3::Z, wi, DVec3::new(u.sqrt() * x, u.sqrt() * y, (1.0 - u).sqrt()));
            (0..3).for_each(|c| albedo[c] += PI * fr[c] / f64::from(SIDE * SIDE));
        }
        Self { name, albedo }
    }
}

/// A ball in each BRDF with its name.
fn balls(brdfs: &[(&str, Brdf)], control: &Control<'_>) -> Result<Pixmap> {
    let rows = brdfs.len().div_ceil(COLUMNS);
    let mut svg = Svg::new(COLUMNS as f64 * CELL[0], rows as f64 * CELL[1] + 6.0);
    let corner = |k: usize| [(k % COLUMNS) as f64 * CELL[0], (k / COLUMNS) as f64 * CELL[1]];
    for (k, (name, _)) in brdfs.iter().enumerate() {
        let [x, y] = corner(k);
        svg.text([x + 0.5 * CELL[0], y + f64::from(BALL) + 18.0], 10.5, Anchor::Middle, "#222222", name);
    }
    let mut canvas = svg.rasterise(1.0, None)?;
    for (k, (_, brdf)) in brdfs.iter().enumerate() {
        control.check()?;
        let [x, y] = corner(k);
        let ball = ball(brdf);
        for (at, colour) in (0_u32..).zip(ball) {
            let Some([r, g, b]) = colour else { continue };
            let place = |offset: f64, pixel: u32| biscale::numerics::cast::truncate_usize(offset) + pixel as usize;
            let (column, row) = (place(x + 0.5 * (CELL[0] - f64::from(BALL)), at % BALL), place(y + 4.0, at / BALL));
            let width = canvas.width() as usize;
            canvas.pixels_mut()[row * width + column] = PremultipliedColorU8::from_rgba(r, g, b, 255).expect("opaque colours are valid");
        }
        (control.progress)("balls", (k + 1) as f64 / brdfs.len() as f64);
    }
    Ok(canvas)
}

/// The lights of the balls, from a viewer at +z with y up: a lamp, a weaker one on the other side, and a dome of few directions.
fn lights() -> Vec<(DVec3, f64)> {
    let mut lights = vec![(DVec3::new(-0.55, 0.6, 0.75).normalize(), 3.2), (DVec3::new(0.8, -0.1, 0.35).normalize(), 0.8)];
    lights.extend((0..12).map(|k| {
        let z = 1.0 - (f64::from(k) + 0.5) / 6.0;
        let (sin, cos) = (2.399_963 * f64::from(k)).sin_cos();
        let across = (1.0 - z * z).sqrt();
        (DVec3::new(across * cos, across * sin, z), 0.3)
    }));
    lights
}

/// Pixels of a ball, row by row from the top; none outside of it.
fn ball(brdf: &Brdf) -> Vec<Option<[u8; 3]>> {
    let lights = lights();
    let radiance = |n: DVec3| -> [f64; 3] {
        let mut sum = [0.0; 3];
        for &(wi, irradiance) in &lights {
            let fr = brdf.eval(n, wi, DVec3::Z);
            (0..3).for_each(|c| sum[c] += fr[c] * n.dot(wi).max(0.0) * irradiance);
        }
        sum
    };
    (0..BALL * BALL)
        .into_par_iter()
        .map(|at| {
            let (mut sum, mut hits) = ([0.0; 3], 0_u32);
            for sample in 0..OVERSAMPLED * OVERSAMPLED {
                let place = |pixel: u32, part: u32| {
                    2.0 * (f64::from(pixel) + (f64::from(part) + 0.5) / f64::from(OVERSAMPLED)) / f64::from(BALL) - 1.0
                };
                let (x, y) = (place(at % BALL, sample % OVERSAMPLED), -place(at / BALL, sample / OVERSAMPLED));
                let rest = 1.0 - x * x - y * y;
                if rest > 0.0 {
                    let found = radiance(DVec3::new(x, y, rest.sqrt()));
                    (0..3).for_each(|c| sum[c] += found[c].min(1.0));
                    hits += 1;
                }
            }
            // What the ball leaves of a pixel is the white ground.
            let all = f64::from(OVERSAMPLED * OVERSAMPLED);
            (hits > 0).then(|| sum.map(|s| srgb_byte((s + all - f64::from(hits)) / all)))
        })
        .collect()
}
