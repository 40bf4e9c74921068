//! A piece as Origami Simulator reads it.

use super::svg::MARK;
use crate::drawing::number;
use crate::mesh::Mesh;
use crate::polygon::{bounds, distance_to_segment};
use crate::unfold::{Fold, Piece};
use biscale::formats::svg::{NAMESPACE, SvgWriter};
use glam::DVec2;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

/// Shortest edge in Origami Simulator's units: shorter ones make its solver stiff. Chosen, not measured.
const SHORTEST: f64 = 10.0;

/// Least distance of a vertex from an edge that it is no end of, in the same units: Origami Simulator merges vertices within 3 units of each other, and
/// splits an edge at one as near (`vertTol` of its pattern import).
const APART: f64 = 3.2;

/// A line of the crease pattern, with its meaning in colour and opacity.
struct CreaseLine {
    ends: [DVec2; 2],
    colour: &'static str,
    opacity: f64,
}

/// Colours by which Origami Simulator tells its lines apart.
const BORDER: &str = "#000000";
const MOUNTAIN: &str = "#ff0000";
const VALLEY: &str = "#0000ff";
const FACET: &str = "#ffff00";

/// One piece as Origami Simulator reads it: border black, mountain red and valley blue with the angle over 180 degrees as opacity,
/// triangles of flat facets yellow.
pub fn origami_simulator(mesh: &Mesh, piece: &Piece) -> String {
    // Tabs are left out: they fold under their neighbours, which the simulator does not know.
    let mut lines: Vec<CreaseLine> = Vec::new();
    for (f, polygon) in &piece.facets {
        lines.extend(lines_of_facet(mesh, piece, *f, polygon));
    }
    lines.extend(piece.folds.iter().map(line_of_fold));
    let scale = scale(&lines);
    let low = lines.iter().flat_map(|l| l.ends).fold(DVec2::INFINITY, DVec2::min);
    let high = lines.iter().flat_map(|l| l.ends).fold(DVec2::NEG_INFINITY, DVec2::max);
    let size = (high - low) * scale;
    let mut svg = SvgWriter::new();
    svg.element("svg").attribute("xmlns", NAMESPACE).attribute("viewBox", format_args!("0 0 {} {}", number(size.x), number(size.y))).open();
    svg.comment(MARK);
    if scale > 1.0 {
        let words = format!("{} units are 1 mm, since Origami Simulator merges what lies within 3 units", number(scale));
        svg.element("desc").text(&words);
    }
    for line in lines {
        let at = |p: DVec2| [(p.x - low.x) * scale, (high.y - p.y) * scale].map(number);
        let [[x1, y1], [x2, y2]] = line.ends.map(at);
        svg.element("line")
            .attribute("x1", x1)
            .attribute("y1", y1)
            .attribute("x2", x2)
            .attribute("y2", y2)
            .attribute("stroke", line.colour)
            .attribute("stroke-opacity", number(line.opacity))
            .attribute("stroke-width", "1")
            .close();
    }
    svg.finish()
}

/// The sides of a facet that are no folds, and the sides between its triangles, each once.
fn lines_of_facet(mesh: &Mesh, piece: &Piece, facet: u32, polygon: &[DVec2]) -> Vec<CreaseLine> {
    let mut out = Vec::new();
    let n = polygon.len();
    for (k, edge) in mesh.facets[facet as usize].edges.iter().enumerate() {
        if !piece.folds.iter().any(|fold| fold.edge == *edge) {
            out.push(CreaseLine { ends: [polygon[k], polygon[(k + 1) % n]], colour: BORDER, opacity: 1.0 });
        }
    }
    let fill = &mesh.facets[facet as usize].fill;
    for (t, triangle) in fill.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (triangle[k] as usize, triangle[(k + 1) % 3] as usize);
            let border = (a + 1) % n == b || (b + 1) % n == a;
            let first = !fill[..t].iter().any(|u| (0..3).any(|j| u[j] as usize == b && u[(j + 1) % 3] as usize == a));
            if !border && first {
                out.push(CreaseLine { ends: [polygon[a], polygon[b]], colour: FACET, opacity: 1.0 });
            }
        }
    }
    out
}

fn line_of_fold(fold: &Fold) -> CreaseLine {
    let share = (fold.angle.abs() / std::f64::consts::PI).min(1.0);
    let (colour, opacity) = if fold.angle == 0.0 {
        (FACET, 1.0)
    } else if fold.angle < 0.0 {
        (MOUNTAIN, share)
    } else {
        (VALLEY, share)
    };
    CreaseLine { ends: fold.ends, colour, opacity }
}

/// Units to the millimetre: 1 where that keeps vertices and edges apart, else more.
fn scale(lines: &[CreaseLine]) -> f64 {
    let shortest = lines.iter().map(|l| l.ends[0].distance(l.ends[1])).fold(f64::INFINITY, f64::min);
    // Points that are one to a thousandth of the shortest edge are one vertex.
    let same = 1e-3 * shortest;
    let boxed = |(k, l): (usize, &CreaseLine)| {
        let [low, high] = bounds(l.ends);
        GeomWithData::new(Rectangle::from_corners(low.to_array(), high.to_array()), k)
    };
    let tree = RTree::bulk_load(lines.iter().enumerate().map(boxed).collect());
    let mut apart = f64::INFINITY;
    for p in lines.iter().flat_map(|l| l.ends) {
        let reach = (p - APART.max(SHORTEST), p + APART.max(SHORTEST));
        let near = AABB::from_corners(reach.0.to_array(), reach.1.to_array());
        for line in tree.locate_in_envelope_intersecting(&near).map(|l| &lines[l.data]) {
            let [a, b] = line.ends;
            if p.distance(a) > same && p.distance(b) > same {
                apart = apart.min(distance_to_segment(p, a, b));
            }
        }
    }
    (SHORTEST / shortest).max(APART / apart.max(same)).max(1.0)
}
