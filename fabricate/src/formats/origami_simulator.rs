//! A piece as Origami Simulator reads it.

use super::svg::MARK;
use crate::drawing::number;
use crate::mesh::Mesh;
use crate::unfold::Piece;
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
    let mut out =
        format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\">\n<!-- {} -->\n", number(size.x), number(size.y), MARK);
    for ([a, b], colour, opacity) in lines {
        let at = |p: DVec2| DVec2::new((p.x - low.x) * scale, (high.y - p.y) * scale);
        let (a, b) = (at(a), at(b));
        let _ = writeln!(
            out,
            "<line x1=\"{}\" y1=\"{}\" x2=\"{}\" y2=\"{}\" stroke=\"{colour}\" stroke-opacity=\"{}\" stroke-width=\"1\"/>",
            number(a.x),
            number(a.y),
            number(b.x),
            number(b.y),
            number(opacity)
        );
    }
    out.push_str("</svg>\n");
    out
}
