//! Photographs beside the fitted material and their difference, as PNG.

use crate::common::figure::{Anchor, Svg};
use crate::common::output;
use biscale::error::Result;
use biscale::numerics::cast::{narrow, truncate_usize};
use biscale::numerics::colour::{byte, linear_to_srgb, srgb_byte};
use biscale::numerics::statistics::rank;
use biscale::render::colour_code;
use biscale_fit::photograph::image::Photograph;
use biscale_fit::run::{Compared, Outcome};
use biscale_fit::verdict::near::NearComparison;
use std::borrow::Cow;

/// Pixels between two panels.
const GAP: usize = 4;
/// Height of the names above the panels, and the width of a letter in them, about, pixels.
const NAMES: usize = 20;
const LETTER_WIDTH: f64 = 8.0;
/// What is white in the panels: this share of all values lies below.
const WHITE: f64 = 0.995;
/// The factor of differences.
pub const FACTOR: f64 = 3.0;
/// Small photographs are shown with their pixels this wide, about.
const LEAST_WIDTH: usize = 240;
/// And at most so wide.
const MOST_ZOOM: usize = 10;
/// Rows of pixels of a picture that has one.
const STRIP: usize = 8;

/// A photograph beside the fitted material: rows of pixels, linear radiance.
pub struct Pair<'a> {
    /// What is photographed, or its file.
    pub name: String,
    /// Pixels across and down.
    pub size: [usize; 2],
    /// What was photographed.
    pub seen: Cow<'a, [[f32; 3]]>,
    /// The same by the material.
    pub model: Cow<'a, [[f32; 3]]>,
}

impl<'a> Pair<'a> {
    /// A photograph and a picture through the same camera.
    pub fn new(photograph: &'a Photograph, model: &'a [[f32; 3]]) -> Self {
        let Photograph { image, .. } = photograph;
        let size = [image.width as usize, image.height as usize];
        Self { name: photograph.name(), size, seen: Cow::Borrowed(&image.rgb), model: Cow::Borrowed(model) }
    }

    /// A photograph and the fitted material.
    pub fn of(compared: &'a Compared) -> Self {
        Self::new(&compared.photograph, &compared.picture.rgb)
    }

    /// The mean period of the close-up; `None` where colour clusters are compared.
    pub fn of_close_up(near: &NearComparison) -> Option<Self> {
        let [width, height] = near.size?;
        // A surface that does not change along y is a strip that is high enough to be seen.
        let rows = if height == 1 { STRIP } else { 1 };
        let picture = |values: &[[f64; 3]]| -> Vec<[f32; 3]> {
            values.chunks_exact(width).flat_map(|row| std::iter::repeat_n(row, rows)).flatten().map(|v| v.map(narrow)).collect()
        };
        let name = "mean period".to_owned();
        Some(Self { name, size: [width, rows * height], seen: picture(&near.seen).into(), model: picture(&near.model).into() })
    }
}

/// Photographs and pictures of an outcome, in the order of the report.
pub fn of(outcome: &Outcome) -> Vec<Pair<'_>> {
    let all = outcome.compared.iter().chain(outcome.validations.iter().map(|(_, c)| c)).map(Pair::of);
    all.chain(outcome.near.as_ref().and_then(Pair::of_close_up)).collect()
}

/// One row a photograph: photograph, picture, difference, each with its name above. All with the same exposure.
pub fn panels(rows: &[Pair<'_>]) -> Result<Vec<u8>> {
    let mut values: Vec<f32> = rows.iter().flat_map(|p| p.seen.iter().flatten().copied().filter(|v| v.is_finite())).collect();
    let white = rank(&mut values, WHITE).map_or(1.0, |v| f64::from(v).max(1e-12));
    let zoom = |p: &Pair<'_>| LEAST_WIDTH.div_ceil(p.size[0]).clamp(1, MOST_ZOOM);
    let width = rows.iter().map(|p| 3 * zoom(p) * p.size[0] + 2 * GAP).max().unwrap_or(1);
    let height = rows.iter().map(|p| zoom(p) * p.size[1] + NAMES + GAP).sum::<usize>().saturating_sub(GAP).max(1);
    let mut pixels = vec![255_u8; 3 * width * height];
    let mut top = 0;
    for pair in rows {
        let ([w, h], zoom) = (pair.size, zoom(pair));
        let strip = names(&pair.name, 3 * zoom * w + 2 * GAP, zoom * w + GAP)?;
        for (row, of_strip) in pixels[3 * top * width..].chunks_exact_mut(3 * width).zip(strip.chunks_exact(3 * (3 * zoom * w + 2 * GAP))) {
            row[..of_strip.len()].copy_from_slice(of_strip);
        }
        top += NAMES;
        for y in 0..h {
            for x in 0..w {
                let (a, b) = (pair.seen[y * w + x], pair.model[y * w + x]);
                for (panel, colour) in [shown(a, white), shown(b, white), apart(a, b, white)].into_iter().enumerate() {
                    for dy in 0..zoom {
                        let left = panel * (zoom * w + GAP) + zoom * x;
                        let at = 3 * ((top + zoom * y + dy) * width + left);
                        for dx in 0..zoom {
                            pixels[at + 3 * dx..at + 3 * dx + 3].copy_from_slice(&colour);
                        }
                    }
                }
            }
        }
        top += zoom * h + GAP;
    }
    let side = |s: usize| u32::try_from(s).expect("photographs are limited");
    let comment = format!("photograph | fitted material | difference times {FACTOR}");
    output::png::encode([side(width), side(height)], &pixels, false, "made by biscale fit", &comment)
}

/// The names of the panels of a photograph, `width` pixels wide and [`NAMES`] high; panels begin every `step` pixels.
fn names(name: &str, width: usize, step: usize) -> Result<Vec<u8>> {
    let mut svg = Svg::new(width as f64, NAMES as f64);
    for (panel, name) in [name.to_owned(), "fitted material".to_owned(), format!("difference times {FACTOR}")].iter().enumerate() {
        // A long name ends with its panel.
        let letters = truncate_usize(step as f64 / LETTER_WIDTH);
        let name: String = name.chars().take(letters).collect();
        svg.text([(panel * step + 2) as f64, NAMES as f64 - 6.0], 13.0, Anchor::Start, "#222222", &name);
    }
    Ok(svg.rasterise(1.0, None)?.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect())
}

/// What is left out is grey.
const LEFT_OUT: [u8; 3] = [96; 3];

fn shown(rgb: [f32; 3], white: f64) -> [u8; 3] {
    if rgb[0].is_finite() { rgb.map(|v| srgb_byte(f64::from(v) / white)) } else { LEFT_OUT }
}

fn apart(a: [f32; 3], b: [f32; 3], white: f64) -> [u8; 3] {
    if !(a[0].is_finite() && b[0].is_finite()) {
        return LEFT_OUT;
    }
    let screen = |v: f32| linear_to_srgb(f64::from(v) / white);
    let off = (0..3).map(|c| (screen(a[c]) - screen(b[c])).abs()).sum::<f64>() / 3.0;
    colour_code(FACTOR * off).map(byte)
}
