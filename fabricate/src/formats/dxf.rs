//! The lines of a page as DXF R12, for cutters.

use super::svg::MARK;
use crate::drawing::{Layer, Mark, Page, Style, number};
use glam::DVec2;
use std::fmt::Write as _;

/// Layers of the DXF with their colours by number in the palette of `AutoCAD`: black or white, red, blue, green.
const DXF_LAYERS: [(&str, u8); 4] = [("CUT", 7), ("SCORE_M", 1), ("SCORE_V", 5), ("REG", 3)];

/// The lines of a page as DXF R12, mm, y up.
pub fn dxf(page: &Page) -> String {
    let mut out = String::from("999\n");
    let _ = writeln!(out, "{}", MARK);
    let pair = |out: &mut String, code: u32, value: &str| {
        let _ = writeln!(out, "{code}\n{value}");
    };
    pair(&mut out, 0, "SECTION");
    pair(&mut out, 2, "HEADER");
    pair(&mut out, 9, "$ACADVER");
    pair(&mut out, 1, "AC1009");
    for (name, p) in [("$EXTMIN", DVec2::ZERO), ("$EXTMAX", page.size)] {
        pair(&mut out, 9, name);
        pair(&mut out, 10, &number(p.x));
        pair(&mut out, 20, &number(p.y));
    }
    pair(&mut out, 0, "ENDSEC");
    pair(&mut out, 0, "SECTION");
    pair(&mut out, 2, "TABLES");
    pair(&mut out, 0, "TABLE");
    pair(&mut out, 2, "LAYER");
    pair(&mut out, 70, &DXF_LAYERS.len().to_string());
    for (name, colour) in DXF_LAYERS {
        pair(&mut out, 0, "LAYER");
        pair(&mut out, 2, name);
        pair(&mut out, 70, "0");
        pair(&mut out, 62, &colour.to_string());
        pair(&mut out, 6, "CONTINUOUS");
    }
    pair(&mut out, 0, "ENDTAB");
    pair(&mut out, 0, "ENDSEC");
    pair(&mut out, 0, "SECTION");
    pair(&mut out, 2, "ENTITIES");
    for item in &page.items {
        let (points, closed, layer) = match (&item.mark, item.layer) {
            (Mark::Line { points, closed, .. }, Layer::Cut) => (points, *closed, "CUT"),
            (Mark::Line { points, closed, style: Style::Mountain }, Layer::Score) => (points, *closed, "SCORE_M"),
            (Mark::Line { style: Style::Hidden, .. }, _) => continue,
            (Mark::Line { points, closed, .. }, Layer::Score) => (points, *closed, "SCORE_V"),
            (Mark::Line { points, closed, .. }, Layer::Registration) => (points, *closed, "REG"),
            (Mark::Polygon { points, .. }, Layer::Registration) => (points, true, "REG"),
            _ => continue,
        };
        pair(&mut out, 0, "POLYLINE");
        pair(&mut out, 8, layer);
        pair(&mut out, 66, "1");
        pair(&mut out, 70, if closed { "1" } else { "0" });
        for p in points {
            pair(&mut out, 0, "VERTEX");
            pair(&mut out, 8, layer);
            pair(&mut out, 10, &number(p.x));
            pair(&mut out, 20, &number(p.y));
        }
        pair(&mut out, 0, "SEQEND");
        pair(&mut out, 8, layer);
    }
    pair(&mut out, 0, "ENDSEC");
    pair(&mut out, 0, "EOF");
    out
}
