//! What other programs read: Origami Simulator's SVG, and DXF R12 for cutters.

use crate::drawing::{Layer, Mark, Page, Style};
use crate::mesh::Mesh;
use crate::pattern::Piece;
use crate::svg;
use glam::DVec2;
use std::fmt::Write as _;

/// Shortest edge in Origami Simulator's units: shorter ones make its solver stiff.
const SHORTEST: f64 = 10.0;

/// One piece as Origami Simulator reads it: border black, mountain red and valley blue with the angle over 180 degrees as opacity,
/// triangles of flat facets yellow.
pub fn origami_simulator(mesh: &Mesh, piece: &Piece) -> String {
    // Tabs are left out: they fold under their neighbours, which the simulator does not know.
    let mut lines: Vec<([DVec2; 2], &str, f64)> = Vec::new();
    for (f, polygon) in &piece.facets {
        let n = polygon.len();
        for (k, edge) in mesh.facets[*f as usize].edges.iter().enumerate() {
            if !piece.folds.iter().any(|fold| fold.edge == *edge) {
                lines.push(([polygon[k], polygon[(k + 1) % n]], "#000000", 1.0));
            }
        }
        let fill = &mesh.facets[*f as usize].fill;
        for (t, triangle) in fill.iter().enumerate() {
            for k in 0..3 {
                let (a, b) = (triangle[k] as usize, triangle[(k + 1) % 3] as usize);
                let border = (a + 1) % n == b || (b + 1) % n == a;
                let first = !fill[..t].iter().any(|u| (0..3).any(|j| u[j] as usize == b && u[(j + 1) % 3] as usize == a));
                if !border && first {
                    lines.push(([polygon[a], polygon[b]], "#ffff00", 1.0));
                }
            }
        }
    }
    for fold in &piece.folds {
        let share = (fold.angle.abs() / std::f64::consts::PI).min(1.0);
        let colour = if fold.angle == 0.0 {
            "#ffff00"
        } else if fold.angle < 0.0 {
            "#ff0000"
        } else {
            "#0000ff"
        };
        lines.push((fold.ends, colour, if fold.angle == 0.0 { 1.0 } else { share }));
    }
    let shortest = lines.iter().map(|(e, ..)| e[0].distance(e[1])).fold(f64::INFINITY, f64::min);
    let scale = (SHORTEST / shortest).max(1.0);
    let low = lines.iter().flat_map(|(e, ..)| e).copied().fold(DVec2::INFINITY, DVec2::min);
    let high = lines.iter().flat_map(|(e, ..)| e).copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    let size = (high - low) * scale;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\">\n<!-- {} -->\n",
        svg::number(size.x),
        svg::number(size.y),
        svg::MARK
    );
    for ([a, b], colour, opacity) in lines {
        let at = |p: DVec2| DVec2::new((p.x - low.x) * scale, (high.y - p.y) * scale);
        let (a, b) = (at(a), at(b));
        let _ = writeln!(
            out,
            "<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" stroke=\"{colour}\" stroke-opacity=\"{}\" stroke-width=\"1\"/>",
            svg::number(a.x),
            svg::number(a.y),
            svg::number(b.x),
            svg::number(b.y),
            svg::number(opacity)
        );
    }
    out.push_str("</svg>\n");
    out
}

/// Layers of the DXF with their colours by number.
const DXF_LAYERS: [(&str, u8); 4] = [("CUT", 7), ("SCORE_M", 1), ("SCORE_V", 5), ("REG", 3)];

/// The lines of a page as DXF R12, mm, y up.
pub fn dxf(page: &Page) -> String {
    let mut out = String::from("999\n");
    let _ = writeln!(out, "{}", svg::MARK);
    let pair = |out: &mut String, code: u32, value: &str| {
        let _ = writeln!(out, "{code}\n{value}");
    };
    pair(&mut out, 0, "SECTION");
    pair(&mut out, 2, "HEADER");
    pair(&mut out, 9, "$ACADVER");
    pair(&mut out, 1, "AC1009");
    for (name, p) in [("$EXTMIN", DVec2::ZERO), ("$EXTMAX", page.size)] {
        pair(&mut out, 9, name);
        pair(&mut out, 10, &svg::number(p.x));
        pair(&mut out, 20, &svg::number(p.y));
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
            pair(&mut out, 10, &svg::number(p.x));
            pair(&mut out, 20, &svg::number(p.y));
        }
        pair(&mut out, 0, "SEQEND");
        pair(&mut out, 8, layer);
    }
    pair(&mut out, 0, "ENDSEC");
    pair(&mut out, 0, "EOF");
    out
}
