//! FOLD files of other programs: those that are sound are read, those that are not are refused.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

use biscale_fabricate::verify::FoldFrame;
use serde_json::{Value, json};
use std::path::Path;

#[test]
fn the_samples_of_the_format_are_read() {
    // Vertices, edges and faces, counted with another program.
    for (name, vertices, edges, faces) in
        [("simple", 6, 9, 4), ("diagonal-cp", 4, 5, 2), ("diagonal-folded", 4, 5, 2), ("squaretwist", 16, 24, 9), ("box", 39, 80, 42)]
    {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../tests/data/folds/{name}.fold"));
        let file: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let frame = FoldFrame::read(&file, None).unwrap_or_else(|e| panic!("{name}: {e}"));
        let own = (frame.vertices.len(), frame.edges.len(), frame.faces.len());
        assert_eq!(own, (vertices, edges, faces), "{name}");
    }
}

#[test]
fn what_breaks_the_format_is_refused() {
    let good = json!({
        "vertices_coords": [[0, 0], [1, 0], [1, 1], [0, 1]],
        "edges_vertices": [[0, 1], [1, 2], [2, 3], [3, 0], [0, 2]],
        "edges_assignment": ["B", "B", "B", "B", "V"],
        "edges_foldAngle": [0, 0, 0, 0, 90],
        "edges_faces": [[0, null], [0, null], [1, null], [1, null], [1, 0]],
        "faces_vertices": [[0, 1, 2], [0, 2, 3]],
    });
    assert!(FoldFrame::read(&good, None).is_ok());
    for (name, key, value) in [
        ("an edge to nowhere", "edges_vertices", json!([[0, 9]])),
        ("a face of two corners", "faces_vertices", json!([[0, 1]])),
        ("a negative corner", "faces_vertices", json!([[0, 1, -2]])),
        ("a letter that is none", "edges_assignment", json!(["B", "B", "B", "B", "X"])),
        ("a valley that is a mountain", "edges_foldAngle", json!([0, 0, 0, 0, -90])),
        ("too few angles", "edges_foldAngle", json!([0])),
        ("a face that is not there", "edges_faces", json!([[0], [0], [1], [1], [1, 7]])),
        ("a position of one number", "vertices_coords", json!([[0], [1, 0], [1, 1], [0, 1]])),
        ("no list", "faces_vertices", json!(3)),
    ] {
        let mut bad = good.clone();
        bad[key] = value;
        assert!(FoldFrame::read(&bad, None).is_err(), "{name}");
    }
}
