//! A piece with colours that change within its facets, as dots: clipped to its facets, over its cut edges and onto its tabs.

use super::page::{PieceImage, srgb};
use crate::design::Texture;
use crate::mesh::Mesh;
use crate::paper::BLEED;
use crate::polygon::{bounds, contains, distance_to_segment};
use crate::unfold::Piece;
use biscale::error::{Error, Result};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Dots to the millimetre, 254 to the inch: finer than office printers show colours.
pub const PER_MM: f64 = 10.0;

/// Most dots of one piece; of a larger one they are coarser. Chosen, not measured: 160 MB of memory, an a3 page at [`PER_MM`] has 12 million.
const MOST_DOTS: f64 = 4e7;

/// How far inside a facet the colour beyond its border is taken, mm: a fifth of a dot.
const INSIDE: f64 = 0.02;

/// Which facet a dot belongs to.
struct Dots {
    low: DVec2,
    per_mm: f64,
    width: usize,
    height: usize,
    /// Place of the facet in the piece, plus 1; 0 for none. Row 0 is the lowest.
    owner: Vec<u32>,
    /// Distance from the edge whose colour reaches here, mm.
    off: Vec<f32>,
}

impl Dots {
    fn new(piece: &Piece) -> Self {
        let points = piece.facets.iter().flat_map(|(_, p)| p).chain(piece.tabs.iter().flat_map(|t| &t.corners));
        let [low, high] = bounds(points.copied());
        let (low, high) = (low - BLEED, high + BLEED);
        let area = (high - low).x * (high - low).y;
        let per_mm = PER_MM.min((MOST_DOTS / area).sqrt());
        let low = (low * per_mm).floor() / per_mm;
        let count = ((high - low) * per_mm).ceil().max(DVec2::ONE);
        let (width, height) = (count.x as usize, count.y as usize);
        Self { low, per_mm, width, height, owner: vec![0; width * height], off: vec![f32::INFINITY; width * height] }
    }

    fn centre(&self, x: usize, y: usize) -> DVec2 {
        self.low + DVec2::new(x as f64 + 0.5, y as f64 + 0.5) / self.per_mm
    }

    /// Visits the dots whose middles lie in a polygon; the share of a row between its borders is found once a row.
    fn inside(&mut self, polygon: &[DVec2], mut visit: impl FnMut(&mut Self, usize, DVec2)) {
        let [low, high] = bounds(polygon.iter().copied());
        let row = |y: f64, most: usize| ((y.max(0.0)) as usize).min(most);
        let (first, last) =
            (row((low.y - self.low.y) * self.per_mm, self.height), row((high.y - self.low.y) * self.per_mm + 1.0, self.height));
        for y in first..last {
            let at = self.centre(0, y).y;
            let mut crossings: Vec<f64> = (0..polygon.len())
                .filter_map(|k| {
                    let (a, b) = (polygon[k], polygon[(k + 1) % polygon.len()]);
                    ((a.y > at) != (b.y > at)).then(|| a.x + (at - a.y) / (b.y - a.y) * (b.x - a.x))
                })
                .collect();
            crossings.sort_unstable_by(f64::total_cmp);
            for pair in crossings.chunks_exact(2) {
                // Middles from the first crossing to before the second one.
                let column = |x: f64| ((x - self.low.x) * self.per_mm - 0.5).ceil().max(0.0) as usize;
                for x in column(pair[0])..column(pair[1]).min(self.width) {
                    let p = self.centre(x, y);
                    visit(self, y * self.width + x, p);
                }
            }
        }
    }
}

/// A facet on the page, and how its points lie in space.
struct Lift<'p> {
    polygon: &'p [DVec2],
    origin: [DVec2; 2],
    corner: DVec3,
    axes: [DVec3; 2],
    normal: DVec3,
}

impl<'p> Lift<'p> {
    fn new(mesh: &Mesh, facet: u32, polygon: &'p [DVec2]) -> Self {
        let n = polygon.len();
        let length = |k: usize| polygon[k].distance_squared(polygon[(k + 1) % n]);
        let k = (0..n).max_by(|&a, &b| length(a).total_cmp(&length(b))).expect("a facet has corners");
        let f = facet as usize;
        let along = (mesh.corner(f, (k + 1) % n) - mesh.corner(f, k)).normalize_or_zero();
        let normal = mesh.facets[f].normal;
        Self {
            polygon,
            origin: [polygon[k], (polygon[(k + 1) % n] - polygon[k]).normalize_or(DVec2::X)],
            corner: mesh.corner(f, k),
            axes: [along, normal.cross(along)],
            normal,
        }
    }

    fn colour(&self, texture: &Texture<'_>, p: DVec2) -> [f64; 3] {
        // Beyond the facet its border goes on.
        let n = self.polygon.len();
        let p = if contains(self.polygon, p) {
            p
        } else {
            let nearest = |k: usize| {
                let (a, b) = (self.polygon[k], self.polygon[(k + 1) % n]);
                a + ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0) * (b - a)
            };
            let border = (0..n).map(nearest).min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p))).expect("corners");
            // A hair inside: on the border itself an image that repeats may show its other side.
            border + INSIDE * (border - p).normalize_or_zero()
        };
        let [o, x] = self.origin;
        let r = p - o;
        texture.at(self.corner + x.dot(r) * self.axes[0] + x.perp_dot(r) * self.axes[1], self.normal)
    }
}

/// Paints a piece where it lies on its page.
///
/// # Errors
/// [`Error::Numeric`] if the picture cannot be written.
pub fn paint(mesh: &Mesh, piece: &Piece, texture: &Texture<'_>) -> Result<PieceImage> {
    let mut dots = Dots::new(piece);
    let place: FxHashMap<u32, u32> = piece.facets.iter().zip(1..).map(|((f, _), k)| (*f, k)).collect();
    // From below: over the cut edges, tabs, the facets themselves.
    for (f, polygon) in &piece.facets {
        let n = polygon.len();
        for k in 0..n {
            let edge = mesh.facets[*f as usize].edges[k];
            if piece.folds.iter().any(|fold| fold.edge == edge) {
                continue;
            }
            let (a, b) = (polygon[k], polygon[(k + 1) % n]);
            let along = (b - a).normalize_or_zero();
            let out = -along.perp() * BLEED;
            let owner = place[f];
            dots.inside(&[a - along * BLEED, b + along * BLEED, b + along * BLEED + out, a - along * BLEED + out], |dots, at, p| {
                let off = distance_to_segment(p, a, b) as f32;
                if off < dots.off[at] {
                    (dots.off[at], dots.owner[at]) = (off, owner);
                }
            });
        }
    }
    for tab in &piece.tabs {
        let (a, b, owner) = (tab.corners[0], tab.corners[1], place[&tab.facet]);
        dots.inside(&tab.corners, |dots, at, p| dots.owner[at] = if distance_to_segment(p, a, b) <= BLEED { owner } else { 0 });
    }
    for (k, (_, polygon)) in piece.facets.iter().enumerate() {
        let owner = u32::try_from(k + 1).expect("at most MAX_FACETS");
        dots.inside(polygon, |dots, at, _| dots.owner[at] = owner);
    }
    let lifts: Vec<Lift<'_>> = piece.facets.iter().map(|(f, p)| Lift::new(mesh, *f, p)).collect();
    let n = texture.samples();
    let colour = |owner: u32, x: usize, y: usize| -> [u8; 4] {
        if owner == 0 {
            return [255, 255, 255, 0];
        }
        let lift = &lifts[owner as usize - 1];
        let mut sum = [0.0; 3];
        for j in 0..n * n {
            let part = DVec2::new(f64::from(j % n), f64::from(j / n)) + 0.5;
            let p = dots.low + (DVec2::new(x as f64, y as f64) + part / f64::from(n)) / dots.per_mm;
            let here = lift.colour(texture, p);
            (0..3).for_each(|c| sum[c] += here[c] / f64::from(n * n));
        }
        let [r, g, b] = srgb(sum);
        [r, g, b, 255]
    };
    // A file begins with its upper row.
    let rows: Vec<Vec<u8>> = (0..dots.height)
        .into_par_iter()
        .map(|row| {
            let y = dots.height - 1 - row;
            (0..dots.width).flat_map(|x| colour(dots.owner[y * dots.width + x], x, y)).collect()
        })
        .collect();
    let size = DVec2::new(dots.width as f64, dots.height as f64) / dots.per_mm;
    Ok(PieceImage { low: dots.low, size, png: encode(&rows.concat(), dots.width, dots.height)? })
}

fn encode(rgba: &[u8], width: usize, height: usize) -> Result<Vec<u8>> {
    let failed = |e: &dyn std::fmt::Display| Error::Numeric(format!("cannot write the colours of a piece: {e}; please report this"));
    let side = |x: usize| u32::try_from(x).map_err(|e| failed(&e));
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, side(width)?, side(height)?);
    encoder.set_color(png::ColorType::Rgba);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().map_err(|e| failed(&e))?;
    writer.write_image_data(rgba).and_then(|()| writer.finish()).map_err(|e| failed(&e))?;
    Ok(out)
}
