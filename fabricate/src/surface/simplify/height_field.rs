//! A height field as a triangulation of few of its points.
//!
//! Points are added one after another where the surface of those so far is farthest off (greedy insertion; Garland and Heckbert 1995,
//! "Fast polygonal approximation of terrains"), until the number of facets or the slope error is reached.

use super::goal::Goal;
use crate::mesh::Triangles;
use crate::polygon::area;
use biscale::error::BadInput;
use biscale::numerics::convex_hull::convex_hull;
use glam::{DVec2, DVec3};
use spade::{DelaunayTriangulation, FloatTriangulation, HasPosition, Point2, Triangulation};

/// A point of a height field.
#[derive(Clone, Copy, Debug)]
struct Node {
    at: DVec3,
    colour: [f64; 3],
}

impl HasPosition for Node {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        Point2::new(self.at.x, self.at.y)
    }
}

/// Most rounds of refinement; each adds points all over the surface, and more of them than the one before. Chosen, not
/// measured: 400 rounds add more points than the most facets that are taken.
const ROUNDS: usize = 400;
/// Heights that differ by less are one, mm: rounding.
const SAME_HEIGHT: f64 = 1e-9;

/// A surface that is a height over a convex part of the plane.
pub struct Field<'s> {
    soup: &'s Triangles,
    nodes: Vec<Node>,
    hull: Vec<DVec2>,
}

impl<'s> Field<'s> {
    /// Looks at a surface whose corners are welded; `None` if it is no such height field: it stands upright, overhangs, has holes, or its
    /// border is not convex.
    pub fn new(soup: &'s Triangles) -> Option<Self> {
        let rises = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| soup.vertices[v as usize]);
            (b - a).cross(c - a).z > 1e-12
        };
        if !soup.triangles.iter().all(rises) || covered_twice(soup) {
            return None;
        }
        let mut colour = vec![[0.0; 3]; soup.vertices.len()];
        let mut used = vec![false; soup.vertices.len()];
        for (t, c) in soup.triangles.iter().zip(&soup.colours) {
            for &v in t {
                (colour[v as usize], used[v as usize]) = (*c, true);
            }
        }
        let nodes: Vec<Node> =
            (0..soup.vertices.len()).filter(|&v| used[v]).map(|v| Node { at: soup.vertices[v], colour: colour[v] }).collect();
        let projected = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| soup.vertices[v as usize].truncate());
            0.5 * (b - a).perp_dot(c - a)
        };
        let covered: f64 = soup.triangles.iter().map(projected).sum();
        let hull = convex_hull(nodes.iter().map(|n| n.at.truncate()).collect());
        let hull_area = area(&hull);
        ((hull_area - covered).abs() <= 1e-3 * hull_area).then_some(Self { soup, nodes, hull })
    }

    /// The reduced surface and its slope error, radians.
    pub fn reduce(&self, goal: Goal) -> Result<(Triangles, f64), BadInput> {
        let mut chosen = vec![false; self.nodes.len()];
        let mut triangulation: DelaunayTriangulation<Node> = DelaunayTriangulation::new();
        for &corner in &self.hull {
            let k = (0..self.nodes.len()).find(|&k| self.nodes[k].at.truncate() == corner).expect("the hull is made of nodes");
            chosen[k] = true;
            insert(&mut triangulation, self.nodes[k])?;
        }
        let slopes = original_slopes(self.soup);
        for round in 0..ROUNDS {
            let facets = triangulation.num_inner_faces();
            if goal.slope.is_some_and(|limit| slope_rms(&triangulation, &slopes) <= limit) {
                break;
            }
            // Every new point makes two facets, or one at the border.
            let room = goal.facets.saturating_sub(facets + 2) / 2 + usize::from(facets + 2 <= goal.facets);
            if room == 0 || !self.refine(&mut triangulation, &mut chosen, room.min(1 + round / 4 + facets / 16))? {
                break;
            }
        }
        let slope = slope_rms(&triangulation, &slopes);
        Ok((triangles(&triangulation), slope))
    }

    /// Adds the points that are farthest off, at most so many; whether there were any.
    ///
    /// They lie apart from each other: one insertion changes what is off near it.
    fn refine(&self, triangulation: &mut DelaunayTriangulation<Node>, chosen: &mut [bool], most: usize) -> Result<bool, BadInput> {
        let nodes = &self.nodes;
        let mut off: Vec<(f64, usize)> = (0..nodes.len())
            .filter(|&k| !chosen[k])
            .map(|k| ((height(triangulation, nodes[k].at.truncate()) - nodes[k].at.z).abs(), k))
            .filter(|(d, _)| *d > SAME_HEIGHT)
            .collect();
        off.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        let apart = (area(&self.hull) / (triangulation.num_inner_faces() as f64 + 1.0)).sqrt();
        let mut taken: Vec<DVec2> = Vec::new();
        for &(_, k) in &off {
            let p = nodes[k].at.truncate();
            if taken.iter().all(|q| q.distance(p) > apart) {
                insert(triangulation, nodes[k])?;
                chosen[k] = true;
                taken.push(p);
                if taken.len() >= most {
                    break;
                }
            }
        }
        Ok(!off.is_empty())
    }
}

fn insert(triangulation: &mut DelaunayTriangulation<Node>, node: Node) -> Result<(), BadInput> {
    let bad = |e| BadInput::new(format!("a point cannot be triangulated: {e}"), "check the mesh's coordinates");
    triangulation.insert(node).map(|_| ()).map_err(bad)
}

fn triangles(triangulation: &DelaunayTriangulation<Node>) -> Triangles {
    let mut out = Triangles::default();
    let mut place = vec![0_u32; triangulation.num_vertices()];
    for v in triangulation.vertices() {
        place[v.fix().index()] = u32::try_from(out.vertices.len()).expect("few");
        out.vertices.push(v.data().at);
    }
    for face in triangulation.inner_faces() {
        let corners = face.vertices();
        out.triangles.push(corners.map(|v| place[v.fix().index()]));
        out.colours.push(std::array::from_fn(|c| corners.iter().map(|v| v.data().colour[c]).sum::<f64>() / 3.0));
    }
    out
}

/// Whether triangles overlap in projection: their areas add up to more than what they cover, which a border walk would miss.
fn covered_twice(soup: &Triangles) -> bool {
    let mut seen = std::collections::BTreeMap::new();
    for t in &soup.triangles {
        for k in 0..3 {
            *seen.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1;
        }
    }
    // One side once each: a surface in one layer has every directed edge once.
    seen.values().any(|&n| n > 1)
}

/// Height of the triangulation over a point.
fn height(triangulation: &DelaunayTriangulation<Node>, p: DVec2) -> f64 {
    triangulation.barycentric().interpolate(|v| v.data().at.z, Point2::new(p.x, p.y)).unwrap_or(0.0)
}

/// Centre, area and normal of every original triangle.
fn original_slopes(soup: &Triangles) -> Vec<(DVec2, f64, DVec3)> {
    soup.triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| soup.vertices[v as usize]);
            let n = (b - a).cross(c - a);
            ((a + b + c).truncate() / 3.0, 0.5 * n.length(), n.normalize_or_zero())
        })
        .collect()
}

/// Root mean square of the angle between the original normals and the reduced ones, by area, radians.
fn slope_rms(triangulation: &DelaunayTriangulation<Node>, slopes: &[(DVec2, f64, DVec3)]) -> f64 {
    use spade::PositionInTriangulation::OnFace;
    let (mut sum, mut area) = (0.0, 0.0);
    for &(p, weight, normal) in slopes {
        let face = match triangulation.locate(Point2::new(p.x, p.y)) {
            OnFace(face) => Some(triangulation.face(face)),
            spade::PositionInTriangulation::OnEdge(edge) => triangulation.directed_edge(edge).face().as_inner(),
            _ => None,
        };
        let Some(face) = face else { continue };
        let [a, b, c] = face.vertices().map(|v| v.data().at);
        let n = (b - a).cross(c - a).normalize_or_zero();
        sum += weight * n.dot(normal).clamp(-1.0, 1.0).acos().powi(2);
        area += weight;
    }
    if area > 0.0 { (sum / area).sqrt() } else { 0.0 }
}
