//! Patches of known colours.

use super::measures::PATCH;
use crate::drawing::{Item, Layer, Mark, Page, Style, srgb};
use glam::DVec2;
use serde::Serialize;

/// Steps of the grey wedge, from black to .9: enough to see a tone curve, few enough for a row of [`PATCH`]es on a4. Chosen, not measured.
const GREYS: usize = 6;

/// A colour patch on a page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Patch {
    /// `design`, `grey` or `white`.
    pub kind: &'static str,
    /// Its place among its kind.
    pub index: usize,
    /// The page, from 1.
    pub page: usize,
    /// What was sent to the printer, linear RGB.
    pub linear_rgb: [f64; 3],
    /// Whether it is still on the sheet when that is cut out; else it is photographed by itself.
    pub kept: bool,
    /// Lower left and upper right corner, mm.
    pub rectangle_mm: [[f64; 2]; 2],
}

/// The colours of the design, a grey wedge, and the paper itself; `kept` is what is cut out.
pub(super) fn patches(page: &mut Page, colours: &[[f64; 3]], corner: DVec2, kept: [DVec2; 2], number: usize) -> Vec<Patch> {
    let greys = (0..GREYS).map(|k| ("grey", k, [k as f64 / (GREYS - 1) as f64 * 0.9; 3]));
    let white = std::iter::once(("white", 0, [1.0; 3]));
    let room = (((kept[1].x - corner.x) / (PATCH + 1.0)).floor() as usize).saturating_sub(GREYS + 1);
    let design = colours.iter().take(room).enumerate().map(|(k, c)| ("design", k, *c));
    let mut out = Vec::new();
    for (k, (kind, index, linear_rgb)) in design.chain(greys).chain(white).enumerate() {
        let low = corner + DVec2::new(k as f64 * (PATCH + 1.0), 0.5);
        let high = low + PATCH;
        let points = [low, DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y)];
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Polygon { points: points.to_vec(), fill: srgb(linear_rgb) },
            data: vec![("patch", format!("{kind}-{index}"))],
        });
        // The paper's own white needs a frame to be found.
        if kind == "white" {
            page.line(Layer::Print, Style::Thin, &points, true);
        }
        let kept = low.cmpge(kept[0] - 1e-9).all() && high.cmple(kept[1] + 1e-9).all();
        out.push(Patch { kind, index, page: number, linear_rgb, kept, rectangle_mm: [low.to_array(), high.to_array()] });
    }
    out
}
