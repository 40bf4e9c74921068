//! Shapes that a glue tab can take.
//!
//! A tab stands on the outline of one facet and is glued under its neighbour. So it must lie inside the neighbour when folded over,
//! and in the net it must meet nothing else. The first is decided here, once for both sides of every edge; the second by the search,
//! which tries the shapes from the best to the least.

use crate::mesh::{Mesh, Side};
use crate::polygon::{Convex, contains};
use glam::DVec2;

/// What tabs should be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TabStyle {
    /// Width of a tab, mm: how far it reaches under its neighbour. Less where the neighbour is small; 0 for no tabs at all.
    pub width: f64,
}

impl Default for TabStyle {
    fn default() -> Self {
        // Chosen, not measured: what fingers hold.
        Self { width: 5.0 }
    }
}

/// Shapes in the order in which they are tried: share of the width, angles in degrees at the start and the end of the edge.
///
/// Chosen, not measured: from what is glued best to what fits the narrowest place, blunt on the side where there is one.
const SHAPES: [(f64, f64, f64); 11] = [
    (1.0, 60.0, 60.0),
    (1.0, 45.0, 45.0),
    (0.7, 45.0, 45.0),
    (0.7, 60.0, 25.0),
    (0.7, 25.0, 60.0),
    (0.5, 25.0, 25.0),
    (0.5, 60.0, 12.0),
    (0.5, 12.0, 60.0),
    (0.35, 10.0, 10.0),
    (0.35, 60.0, 6.0),
    (0.35, 6.0, 60.0),
];

/// Share of the neighbour's width that a tab may take: less than what would meet the neighbour's own tabs. Chosen, not measured.
const DEPTH: f64 = 0.55;
/// Share of the neighbour's corner that a tab's corner may take: paper is cut by hand. Chosen, not measured.
const CORNER: f64 = 0.8;
/// Narrowest corner, radians: below it, 2.9 degrees, the tab's end is a whisker. Chosen, not measured.
const LEAST_ANGLE: f64 = 0.05;

/// The tab shapes of a mesh, by edge and side, each in the frame of the facet that it stands on.
#[derive(Clone, Debug)]
pub struct TabShapes {
    shapes: Vec<[Vec<Convex>; 2]>,
}

impl TabShapes {
    /// All shapes of all inner edges.
    pub fn new(mesh: &Mesh, style: TabStyle) -> Self {
        let of_edge = |edge: &crate::mesh::Edge| {
            let [Some(first), Some(second)] = edge.sides else { return [Vec::new(), Vec::new()] };
            [on_side(mesh, style, first, second), on_side(mesh, style, second, first)]
        };
        Self { shapes: mesh.edges.iter().map(of_edge).collect() }
    }

    /// The shapes of the tab on one side (0 or 1) of an edge, best first.
    pub fn of(&self, edge: u32, side: usize) -> &[Convex] {
        &self.shapes[edge as usize][side]
    }
}

/// The shapes of a tab on the side `stands` that is glued under the facet at the side `under`, best first.
fn on_side(mesh: &Mesh, style: TabStyle, stands: Side, under: Side) -> Vec<Convex> {
    if style.width <= 0.0 {
        return Vec::new();
    }
    let own = &mesh.facets[stands.facet as usize].flat;
    let (a, b) = (own[stands.place as usize], own[(stands.place as usize + 1) % own.len()]);
    let along = (b - a).normalize_or_zero();
    let outward = -along.perp();
    let length = a.distance(b);
    let neighbour = &mesh.facets[under.facet as usize].flat;
    let (m, j) = (neighbour.len(), under.place as usize);
    // The neighbour runs the edge from b to a.
    let (nb, na) = (neighbour[j], neighbour[(j + 1) % m]);
    let n_along = (nb - na).normalize_or_zero();
    let inward = -n_along.perp();
    let corner = |before: DVec2, at: DVec2, after: DVec2| {
        let angle = (after - at).angle_to(before - at);
        if angle <= 0.0 { angle + std::f64::consts::TAU } else { angle }
    };
    let at_b = corner(neighbour[(j + m - 1) % m], nb, na);
    let at_a = corner(nb, na, neighbour[(j + 2) % m]);
    let reach = neighbour.iter().map(|&p| inward.dot(p - na)).fold(0.0, f64::max);
    let full = style.width.min(DEPTH * reach);
    let mut out: Vec<Convex> = Vec::new();
    for (share, start, end) in SHAPES {
        let angle = |wanted: f64, limit: f64| wanted.to_radians().min(CORNER * limit).max(LEAST_ANGLE);
        let (alpha, beta) = (angle(start, at_a), angle(end, at_b));
        let mut height = share * full;
        // Two legs that meet below the height make a triangle.
        let (cot_a, cot_b) = (1.0 / alpha.tan(), 1.0 / beta.tan());
        for _ in 0..4 {
            let peak = length / (cot_a + cot_b);
            let h = height.min(peak);
            let (left, right) = (cot_a * h, length - cot_b * h);
            let inside = [(left, h), (right, h)].iter().all(|&(x, y)| contains(neighbour, na + x * n_along + y * inward));
            if inside {
                let tip = |x: f64| a + x * along + h * outward;
                let shape = if right - left <= 1e-3 * length {
                    Convex::new(&[b, a, tip(0.5 * (left + right))])
                } else {
                    Convex::new(&[b, a, tip(left), tip(right)])
                };
                if !out.contains(&shape) {
                    out.push(shape);
                }
                break;
            }
            height *= 0.6;
        }
    }
    out
}
