//! FOLD 1.2 (Demaine, Ku, Lang): the crease pattern with all pieces side by side, and the folded form in `file_frames`.
//!
//! Written as the specification says: `edges_faces` names the face to the left of the edge first, `null` where there is none, faces run
//! counter-clockwise, valley angles are positive. What a verifier needs beyond it stands in keys with the prefix `biscale:`.

use crate::mesh::{Mesh, Side};
use crate::unfold::{Pattern, Piece};
use glam::DVec2;
use rustc_hash::FxHashMap;
use serde_json::{Value, json};

/// `file_creator` of every file of this program.
pub const CREATOR: &str = "biscale fold";

/// The pattern as FOLD; `pieces` are those of the pattern, moved to where they shall lie.
pub fn fold(mesh: &Mesh, pattern: &Pattern, pieces: &[Piece], title: &str, recipe: &Value) -> Value {
    let mut lists = FoldLists { number: pattern.glued.iter().copied().collect(), ..FoldLists::default() };
    for piece in pieces {
        lists.add(mesh, piece);
    }
    let folded: Vec<[f64; 3]> = lists.solid.iter().map(|&v| mesh.vertices[v as usize].to_array()).collect();
    json!({
        "file_spec": 1.2,
        "file_creator": CREATOR,
        "file_title": title,
        "file_classes": ["singleModel"],
        "frame_classes": ["creasePattern"],
        "frame_attributes": ["2D", "manifold", "orientable"],
        "frame_unit": "mm",
        "vertices_coords": lists.flat.iter().map(|p| p.to_array()).collect::<Vec<_>>(),
        "edges_vertices": lists.edges.iter().map(|e| e.ends).collect::<Vec<_>>(),
        "edges_faces": lists.edges.iter().map(|e| e.faces).collect::<Vec<_>>(),
        "edges_assignment": lists.edges.iter().map(FoldEdge::assignment).collect::<Vec<_>>(),
        "edges_foldAngle": lists.edges.iter().map(FoldEdge::degrees).collect::<Vec<_>>(),
        "faces_vertices": lists.faces,
        "faces_biscale:facet": lists.facets,
        "faces_biscale:piece": lists.names,
        "faces_biscale:copy": lists.copies,
        "edges_biscale:edge": lists.edges.iter().map(|e| e.edge).collect::<Vec<_>>(),
        "edges_biscale:number": lists.edges.iter().map(|e| e.number).collect::<Vec<_>>(),
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

/// The lists of a FOLD file while pieces are added.
#[derive(Default)]
struct FoldLists {
    /// Numbers of glued edges.
    number: FxHashMap<u32, usize>,
    /// Positions on the plane, and for each the vertex of the surface.
    flat: Vec<DVec2>,
    solid: Vec<u32>,
    /// For each face its corners, the facet of the surface, and the name and copy of its piece.
    faces: Vec<Vec<usize>>,
    facets: Vec<u32>,
    names: Vec<usize>,
    copies: Vec<usize>,
    edges: Vec<FoldEdge>,
}

/// An edge of a FOLD file.
struct FoldEdge {
    ends: [usize; 2],
    faces: [Option<usize>; 2],
    /// Fold angle, radians; none where the paper ends.
    angle: Option<f64>,
    /// The edge of the surface, and its number where it is glued, else 0.
    edge: u32,
    number: usize,
}

impl FoldEdge {
    fn assignment(&self) -> &'static str {
        match self.angle {
            None => "B",
            Some(0.0) => "F",
            Some(a) if a > 0.0 => "V",
            Some(_) => "M",
        }
    }

    fn degrees(&self) -> Option<f64> {
        self.angle.map(|a| if a == 0.0 { 0.0 } else { a.to_degrees() })
    }
}

impl FoldLists {
    fn add(&mut self, mesh: &Mesh, piece: &Piece) {
        let joined: FxHashMap<u32, f64> = piece.folds.iter().map(|f| (f.edge, f.angle)).collect();
        let corners = Corners::new(mesh, piece, &joined);
        let mut place: FxHashMap<usize, usize> = FxHashMap::default();
        let mut edge_place: FxHashMap<u32, usize> = FxHashMap::default();
        for (k, (f, polygon)) in piece.facets.iter().enumerate() {
            let face = self.faces.len();
            let facet = &mesh.facets[*f as usize];
            let own: Vec<usize> = (0..polygon.len())
                .map(|c| {
                    *place.entry(corners.root(k, c)).or_insert_with(|| {
                        self.flat.push(polygon[c]);
                        self.solid.push(facet.corners[c]);
                        self.flat.len() - 1
                    })
                })
                .collect();
            for (c, &edge) in facet.edges.iter().enumerate() {
                let angle = joined.get(&edge).copied();
                if let (Some(_), Some(&known)) = (angle, edge_place.get(&edge)) {
                    self.edges[known].faces[1] = Some(face);
                    continue;
                }
                if angle.is_some() {
                    edge_place.insert(edge, self.edges.len());
                }
                let number = self.number.get(&edge).copied().unwrap_or(0);
                self.edges.push(FoldEdge { ends: [own[c], own[(c + 1) % own.len()]], faces: [Some(face), None], angle, edge, number });
            }
            self.faces.push(own);
            self.facets.push(*f);
            self.names.push(piece.name);
            self.copies.push(piece.copy);
        }
    }
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
                let Some(Side { facet: neighbour, place: j }) = joined.get(edge).and_then(|_| mesh.other(*edge, *f)) else { continue };
                let other = place[&neighbour];
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
