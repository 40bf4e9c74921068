//! FOLD 1.2 (Demaine, Ku, Lang): the crease pattern with all pieces side by side, and the folded form in `file_frames`.
//!
//! Written as the specification says: `edges_faces` names the face to the left of the edge first, `null` where there is none, faces run
//! counter-clockwise, valley angles are positive. What a verifier needs beyond it stands in keys with the prefix `biscale:`.

use crate::mesh::Mesh;
use crate::unfold::{Pattern, Piece};
use glam::DVec2;
use rustc_hash::FxHashMap;
use serde_json::{Value, json};

/// `file_creator` of every file of this program.
pub const CREATOR: &str = "biscale fold";

/// The pattern as FOLD; `pieces` are those of the pattern, moved to where they shall lie.
pub fn fold(mesh: &Mesh, pattern: &Pattern, pieces: &[Piece], title: &str, recipe: &Value) -> Value {
    let mut flat: Vec<DVec2> = Vec::new();
    let mut solid: Vec<u32> = Vec::new();
    let (mut faces, mut facet_ids, mut piece_ids, mut copy_ids) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut edges, mut assignment, mut angles, mut edges_faces) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut edge_ids, mut numbers) = (Vec::new(), Vec::new());
    let number: FxHashMap<u32, usize> = pattern.glued.iter().copied().collect();
    for piece in pieces {
        let joined: FxHashMap<u32, f64> = piece.folds.iter().map(|f| (f.edge, f.angle)).collect();
        let corners = Corners::new(mesh, piece, &joined);
        let first = flat.len();
        let mut place: FxHashMap<usize, usize> = FxHashMap::default();
        let mut edge_place: FxHashMap<u32, usize> = FxHashMap::default();
        for (k, (f, polygon)) in piece.facets.iter().enumerate() {
            let face = faces.len();
            let facet = &mesh.facets[*f as usize];
            let own: Vec<usize> = (0..polygon.len())
                .map(|c| {
                    *place.entry(corners.root(k, c)).or_insert_with(|| {
                        flat.push(polygon[c]);
                        solid.push(facet.corners[c]);
                        flat.len() - 1
                    })
                })
                .collect();
            for (c, &edge) in facet.edges.iter().enumerate() {
                let ends = [own[c], own[(c + 1) % own.len()]];
                if let (Some(angle), Some(&known)) = (joined.get(&edge), edge_place.get(&edge)) {
                    let _ = angle;
                    let sides: &mut [Value; 2] = &mut edges_faces[known];
                    sides[1] = json!(face);
                    continue;
                }
                if joined.contains_key(&edge) {
                    edge_place.insert(edge, edges.len());
                }
                edges.push(ends);
                edges_faces.push([json!(face), Value::Null]);
                let (letter, angle) = match joined.get(&edge) {
                    None => ("B", Value::Null),
                    Some(a) if *a == 0.0 => ("F", json!(0.0)),
                    Some(a) => (if *a > 0.0 { "V" } else { "M" }, json!(a.to_degrees())),
                };
                assignment.push(letter);
                angles.push(angle);
                edge_ids.push(edge);
                numbers.push(number.get(&edge).copied().unwrap_or(0));
            }
            faces.push(own);
            facet_ids.push(*f);
            piece_ids.push(piece.name);
            copy_ids.push(piece.copy);
        }
        debug_assert!(flat.len() > first, "a piece has facets");
    }
    let folded: Vec<[f64; 3]> = solid.iter().map(|&v| mesh.vertices[v as usize].to_array()).collect();
    json!({
        "file_spec": 1.2,
        "file_creator": CREATOR,
        "file_title": title,
        "file_classes": ["singleModel"],
        "frame_classes": ["creasePattern"],
        "frame_attributes": ["2D", "manifold", "orientable"],
        "frame_unit": "mm",
        "vertices_coords": flat.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
        "edges_vertices": edges,
        "edges_faces": edges_faces,
        "edges_assignment": assignment,
        "edges_foldAngle": angles,
        "faces_vertices": faces,
        "faces_biscale:facet": facet_ids,
        "faces_biscale:piece": piece_ids,
        "faces_biscale:copy": copy_ids,
        "edges_biscale:edge": edge_ids,
        "edges_biscale:number": numbers,
        "biscale:recipe": recipe,
        "file_frames": [{
            "frame_parent": 0,
            "frame_inherit": true,
            "frame_classes": ["foldedForm"],
            "frame_attributes": ["3D", "manifold", "orientable"],
            "vertices_coords": folded,
        }],
    })
}

/// Which corners of a piece's facets are one vertex: those at the ends of joined edges.
struct Corners {
    first: Vec<usize>,
    parent: Vec<usize>,
}

impl Corners {
    fn new(mesh: &Mesh, piece: &Piece, joined: &FxHashMap<u32, f64>) -> Self {
        let mut first = Vec::new();
        let mut total = 0;
        let mut place: FxHashMap<u32, usize> = FxHashMap::default();
        for (k, (f, polygon)) in piece.facets.iter().enumerate() {
            first.push(total);
            place.insert(*f, k);
            total += polygon.len();
        }
        let mut corners = Self { first, parent: (0..total).collect() };
        for (k, (f, polygon)) in piece.facets.iter().enumerate() {
            for (c, edge) in mesh.facets[*f as usize].edges.iter().enumerate() {
                let Some((g, j)) = joined.get(edge).and_then(|_| mesh.other(*edge, *f)) else { continue };
                let other = place[&g];
                let m = piece.facets[other].1.len();
                // The neighbour runs the edge the other way.
                corners.join(k, c, other, (j as usize + 1) % m);
                corners.join(k, (c + 1) % polygon.len(), other, j as usize);
            }
        }
        corners
    }

    fn root(&self, facet: usize, corner: usize) -> usize {
        let mut k = self.first[facet] + corner;
        while self.parent[k] != k {
            k = self.parent[k];
        }
        k
    }

    fn join(&mut self, facet: usize, corner: usize, other: usize, other_corner: usize) {
        let (a, b) = (self.root(facet, corner), self.root(other, other_corner));
        self.parent[a.max(b)] = a.min(b);
    }
}
