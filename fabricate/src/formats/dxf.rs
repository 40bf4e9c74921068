//! The lines of a page as DXF R12, for cutters.

use super::svg::MARK;
use crate::drawing::{Layer, Mark, Page, Style, number};
use glam::DVec2;
use std::fmt::Write as _;

/// Layers of the DXF with their colours by number in the palette of `AutoCAD`: black or white, red, blue, green, grey.
const DXF_LAYERS: [(&str, u8); 5] = [("CUT", 7), ("SCORE_M", 1), ("SCORE_V", 5), ("REG", 3), ("TEXT", 8)];

/// `$INSUNITS` of millimetres. R12 has no such variable; programs that know it read it, others pass over it.
const MILLIMETRES: &str = "4";

/// Height of capitals of the font of DXF, of the size of type here.
const CAPITALS: f64 = 0.73;

/// The lines of a page as DXF R12, mm, y up.
pub fn dxf(page: &Page) -> String {
    let mut out = String::from("999\n");
    let _ = writeln!(out, "{}", MARK);
    pair(&mut out, 0, "SECTION");
    pair(&mut out, 2, "HEADER");
    pair(&mut out, 9, "$ACADVER");
    pair(&mut out, 1, "AC1009");
    pair(&mut out, 9, "$INSUNITS");
    pair(&mut out, 70, MILLIMETRES);
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
            (Mark::Text { .. }, _) => {
                text(&mut out, &item.mark);
                continue;
            }
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

fn pair(out: &mut String, code: u32, value: &str) {
    let _ = writeln!(out, "{code}\n{value}");
}

/// A text around its middle, or from its start; `%%d` is the sign of degrees, `%%u` a line under it.
fn text(out: &mut String, mark: &Mark) {
    let Mark::Text { at, size, angle, text, anchor, underlined, .. } = mark else { return };
    let plain: String = text.replace('%', "%%%").replace('\u{b0}', "%%d").chars().map(|c| if c.is_ascii() { c } else { '?' }).collect();
    pair(out, 0, "TEXT");
    pair(out, 8, "TEXT");
    for (codes, p) in [([10, 20], at), ([11, 21], at)] {
        pair(out, codes[0], &number(p.x));
        pair(out, codes[1], &number(p.y));
    }
    pair(out, 40, &number(CAPITALS * size));
    pair(out, 1, &if *underlined { format!("%%u{plain}") } else { plain });
    pair(out, 50, &number(angle.to_degrees()));
    // Alignment: left, middle or right; halfway up.
    pair(
        out,
        72,
        if *anchor < 0.25 {
            "0"
        } else if *anchor > 0.75 {
            "2"
        } else {
            "1"
        },
    );
    pair(out, 73, "2");
}
