//! A photograph in the report, with what was found drawn over it.

use super::text::{jpeg_address, word};
use crate::photo::PlanarImage;
use biscale::formats::capture::{Check, Severity};
use biscale::numerics::colour::{byte, linear_to_srgb};
use biscale::numerics::statistics::rank;
use glam::DVec2;
use maud::{Markup, html};

/// Largest side of a picture in the report, px.
const SIDE: usize = 900;
/// Quality of its JPEG, of 100.
const QUALITY: u8 = 85;
/// Share of the pixels of a linear photograph that are shown without being cut off at white.
const SHOWN_SHARE: f64 = 0.99;
/// Colour of saturated pixels: magenta, which no sample has.
const SATURATED: [u8; 3] = [255, 0, 200];
/// Width of a photograph over half of the size of a cross.
const TICKS: f64 = 200.0;

/// Something drawn over a photograph, px.
#[derive(Clone, Debug)]
pub enum Mark {
    /// A closed line of a kind (`marker`, `sample`, `patch`).
    Outline(Vec<DVec2>, &'static str),
    /// A point.
    Cross(DVec2),
    /// A circle of a kind.
    Circle(DVec2, f64, &'static str),
}

/// One photograph of the report.
#[derive(Clone, Debug)]
pub struct PhotoView {
    /// Its file.
    pub title: String,
    /// Its role.
    pub role: &'static str,
    /// What is drawn over it.
    pub marks: Vec<Mark>,
    size: (usize, usize),
    jpeg: Vec<u8>,
    rows: Vec<(String, String)>,
}

impl PhotoView {
    /// The view of a photograph; saturated pixels are tinted. `encoded` values are shown as they are, others are scaled and encoded by the curve of sRGB.
    pub fn new(title: &str, role: &'static str, picture: &PlanarImage, saturated: Option<&[bool]>, encoded: bool) -> Self {
        Self {
            title: title.to_owned(),
            role,
            marks: Vec::new(),
            size: (picture.width, picture.height),
            jpeg: thumbnail(picture, saturated, encoded),
            rows: Vec::new(),
        }
    }

    /// Adds a line of numbers.
    pub fn row(&mut self, name: &str, value: String) {
        self.rows.push((name.to_owned(), value));
    }
}

/// A smaller picture as JPEG: means of blocks, saturated ones in magenta.
pub(super) fn thumbnail(picture: &PlanarImage, saturated: Option<&[bool]>, encoded: bool) -> Vec<u8> {
    let block = picture.width.max(picture.height).div_ceil(SIDE).max(1);
    let (width, height) = ((picture.width / block).max(1), (picture.height / block).max(1));
    let mut means = vec![[0.0_f32; 3]; width * height];
    let mut over = vec![false; width * height];
    for (i, mean) in means.iter_mut().enumerate() {
        let (x, y) = ((i % width) * block, (i / width) * block);
        let mut count = 0.0;
        for row in y..(y + block).min(picture.height) {
            for column in x..(x + block).min(picture.width) {
                for (m, v) in mean.iter_mut().zip(picture.at(column, row)) {
                    *m += v;
                }
                count += 1.0;
                over[i] |= saturated.is_some_and(|s| s[row * picture.width + column]);
            }
        }
        *mean = mean.map(|m| m / count);
    }
    let mut bright: Vec<f32> = means.iter().map(|m| m[0].max(m[1]).max(m[2])).collect();
    let white = rank(&mut bright, SHOWN_SHARE).unwrap_or(0.0).max(1e-12);
    let shown = |v: f32| byte(if encoded { f64::from(v) } else { linear_to_srgb(f64::from(v / white)) });
    let pixels: Vec<u8> = means.iter().zip(&over).flat_map(|(m, over)| if *over { SATURATED } else { m.map(shown) }).collect();
    let mut out = Vec::new();
    let (width, height) = (u32::try_from(width).unwrap_or(1), u32::try_from(height).unwrap_or(1));
    let encoder = image::codecs::jpeg::JpegEncoder::new_with_quality(&mut out, QUALITY);
    // Writing into memory fails for no picture of this size.
    let _ = image::ImageEncoder::write_image(encoder, &pixels, width, height, image::ExtendedColorType::Rgb8);
    out
}

/// The photograph in the page, with its marks, numbers and what failed.
pub(super) fn figure(view: &PhotoView, checks: &[Check], large: bool) -> Markup {
    let (w, h) = view.size;
    let tick = w as f64 / TICKS;
    let failed = checks.iter().filter(|c| c.photograph.as_deref() == Some(&view.title) && c.severity > Severity::Ok);
    html! {
        figure class=[large.then_some("large")] {
            svg viewBox={ "0 0 " (w) " " (h) } {
                image href=(jpeg_address(&view.jpeg)) width=(w) height=(h) preserveAspectRatio="none" {}
                @for mark in &view.marks { (drawn(mark, tick)) }
            }
            figcaption {
                b { (view.title) }
                @for (name, value) in &view.rows { br; (name) ": " (value) }
                @for c in failed { br; span class=(word(c.severity)) { (c.code) } " " (c.message) }
            }
        }
    }
}

/// A mark in the picture; `tick` is half of the size of a cross.
fn drawn(mark: &Mark, tick: f64) -> Markup {
    // A pixel's centre has whole coordinates; the picture's corner is half a pixel away.
    let at = |p: DVec2| (p.x + 0.5, p.y + 0.5);
    let short = |v: f64| format!("{v:.1}");
    match mark {
        Mark::Outline(points, kind) => {
            let points: String = points.iter().map(|p| format!("{:.1},{:.1} ", at(*p).0, at(*p).1)).collect();
            html! { polygon class=(kind) points=(points) {} }
        }
        Mark::Cross(p) => {
            let (x, y) = at(*p);
            let (left, top, whole) = (x - tick, y - tick, 2.0 * tick);
            html! { path class="cross" d=(format!("M{left:.1} {y:.1}h{whole:.1}M{x:.1} {top:.1}v{whole:.1}")) {} }
        }
        Mark::Circle(p, r, kind) => {
            let (x, y) = at(*p);
            html! { circle class=(kind) cx=(short(x)) cy=(short(y)) r=(short(*r)) {} }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_small_and_show_what_is_saturated() {
        let picture = PlanarImage::new(4000, 10);
        let mut saturated = vec![false; 40_000];
        saturated[0] = true;
        let jpeg = thumbnail(&picture, Some(&saturated), false);
        let small = image::load_from_memory(&jpeg).unwrap().into_rgb8();
        assert!(small.width() <= SIDE as u32);
        let p = small.get_pixel(0, 0);
        assert!(p[0] > 120 && p[1] < 120, "{p:?}");
    }
}
