//! Fewer facets for surfaces that no person would fold: dense height fields, as a triangulation of few of their points.

use crate::design::Recipe;
use crate::mesh::{MAX_FACETS, Triangles};
use biscale::error::BadInput;
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

/// Share of the original points that are looked at in every round of refinement.
const ROUNDS: usize = 400;

/// Reduces a surface if the recipe says so.
///
/// Points are added one after another where the surface of those so far is farthest off (greedy insertion; Garland and Heckbert 1995,
/// "Fast polygonal approximation of terrains"), until the number of facets or the slope error is reached.
///
/// # Errors
/// A surface that is no height field; too many facets after all.
pub fn reduce(soup: Triangles, recipe: &Recipe) -> Result<(Triangles, Vec<String>), BadInput> {
    if recipe.max_facets.is_none() && recipe.slope_tolerance_deg.is_none() {
        return Ok((soup, Vec::new()));
    }
    let wanted = recipe.max_facets.unwrap_or(MAX_FACETS).min(MAX_FACETS);
    if wanted < 2 {
        return Err(BadInput::new(format!("{wanted} facets make no surface"), "write at least 2").at_field("--max-facets"));
    }
    if recipe.slope_tolerance_deg.is_none() && soup.triangles.len() <= wanted {
        return Ok((soup, Vec::new()));
    }
    let steep = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| soup.vertices[v as usize]);
        (b - a).cross(c - a).z <= 1e-12
    };
    let standing = soup.triangles.iter().filter(|t| steep(t)).count();
    if standing > 0 {
        let problem =
            format!("{standing} of {} triangles stand upright or overhang: this is no height field to reduce", soup.triangles.len());
        return Err(
            BadInput::new(problem, "reduce it in a mesh program, or leave --max-facets and --slope-tolerance out").at_field("--max-facets")
        );
    }
    let mut welded = soup.clone();
    welded.weld(1e-7 * soup.size());
    if covered_twice(&welded) {
        let remedy = "reduce it in a mesh program, or leave --max-facets and --slope-tolerance out";
        return Err(BadInput::new("the surface lies over itself: this is no height field to reduce", remedy).at_field("--max-facets"));
    }
    let mut colour = vec![[0.0; 3]; welded.vertices.len()];
    for (t, c) in welded.triangles.iter().zip(&welded.colours) {
        for &v in t {
            colour[v as usize] = *c;
        }
    }
    let mut used = vec![false; welded.vertices.len()];
    welded.triangles.iter().flatten().for_each(|&v| used[v as usize] = true);
    let nodes: Vec<Node> =
        (0..welded.vertices.len()).filter(|&v| used[v]).map(|v| Node { at: welded.vertices[v], colour: colour[v] }).collect();
    let area_before: f64 = welded
        .triangles
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|v| welded.vertices[v as usize].truncate());
            0.5 * (b - a).perp_dot(c - a)
        })
        .sum();
    let hull = crate::layout::hull(nodes.iter().map(|n| n.at.truncate()));
    let hull_area = crate::polygon::area(&hull);
    if (hull_area - area_before).abs() > 1e-3 * hull_area {
        let problem = "the height field has holes or a border that is not convex";
        return Err(BadInput::new(problem, "reduce it in a mesh program").at_field("--max-facets"));
    }
    let mut chosen = vec![false; nodes.len()];
    let mut triangulation: DelaunayTriangulation<Node> = DelaunayTriangulation::new();
    let insert = |triangulation: &mut DelaunayTriangulation<Node>, k: usize| -> Result<(), BadInput> {
        triangulation
            .insert(nodes[k])
            .map(|_| ())
            .map_err(|e| BadInput::new(format!("a point cannot be triangulated: {e}"), "check the mesh's coordinates"))
    };
    for corner in hull {
        let k = (0..nodes.len()).find(|&k| nodes[k].at.truncate() == corner).expect("the hull is made of nodes");
        chosen[k] = true;
        insert(&mut triangulation, k)?;
    }
    let slopes = original_slopes(&welded);
    let mut slope_error = f64::INFINITY;
    for round in 0..ROUNDS {
        let facets = triangulation.num_inner_faces();
        if let Some(limit) = recipe.slope_tolerance_deg {
            slope_error = slope_rms(&triangulation, &slopes);
            if slope_error <= limit.to_radians() {
                break;
            }
        }
        // Every new point makes two facets, or one at the border.
        let room = wanted.saturating_sub(facets + 2) / 2 + usize::from(facets + 2 <= wanted);
        if room == 0 {
            break;
        }
        let mut off: Vec<(f64, usize)> = (0..nodes.len())
            .filter(|&k| !chosen[k])
            .map(|k| ((height(&triangulation, nodes[k].at.truncate()) - nodes[k].at.z).abs(), k))
            .filter(|(d, _)| *d > 1e-9)
            .collect();
        if off.is_empty() {
            break;
        }
        off.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        // A few at a time, apart from each other: one insertion changes what is off near it.
        let take = room.min(1 + round / 4 + facets / 16);
        let apart = (hull_area / (facets as f64 + 1.0)).sqrt();
        let mut taken: Vec<DVec2> = Vec::new();
        for (_, k) in off {
            let p = nodes[k].at.truncate();
            if taken.iter().all(|q| q.distance(p) > apart) {
                insert(&mut triangulation, k)?;
                chosen[k] = true;
                taken.push(p);
                if taken.len() >= take {
                    break;
                }
            }
        }
    }
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
    slope_error = if slope_error.is_finite() { slope_error } else { slope_rms(&triangulation, &slopes) };
    if let Some(limit) = recipe.slope_tolerance_deg {
        slope_error = slope_rms(&triangulation, &slopes);
        if slope_error > limit.to_radians() {
            let problem = format!(
                "with {} facets the slopes are off by {:.2} degrees (RMS), more than {limit}",
                out.triangles.len(),
                slope_error.to_degrees()
            );
            return Err(
                BadInput::new(problem, "allow more with --slope-tolerance, or more facets with --max-facets").at_field("--slope-tolerance")
            );
        }
    }
    let note = format!(
        "reduced {} triangles to {}: their normals are off by {:.2} degrees (RMS, by area)",
        soup.triangles.len(),
        out.triangles.len(),
        slope_error.to_degrees()
    );
    Ok((out, vec![note]))
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
