//! Faces of a file that are turned against their neighbours: front and back look different, so one of them shows a hole.

use super::super::tile::Tile;
use super::face_groups::FaceGroups;
use glam::DVec3;

/// Turns the faces of each group that hangs together as those are turned that have the larger part of its area, and notes it, and what cannot be told.
/// Returns the triangles that were turned.
pub(super) fn turn_alike(tile: &mut Tile) -> Vec<usize> {
    let found = FaceGroups::new(&tile.triangles);
    let area = |t: usize| {
        let [a, b, c] = tile.corners(t);
        (b - a).cross(c - a).length()
    };
    let turned = found.minority(area);
    for &t in &turned {
        tile.triangles[t].swap(1, 2);
        if let Some(uv) = &mut tile.uv {
            uv[t].swap(1, 2);
        }
    }
    if let Some(&first) = turned.first() {
        let [a, b, c] = tile.corners(first);
        let (count, place) = (turned.len(), place((a + b + c) / 3.0));
        let faces = if count == 1 { "1 face that was" } else { &format!("{count} faces that were") };
        tile.notes.push(format!("turned {faces} turned against the others, the first around {place}"));
    }
    let middle = |[a, b]: [u32; 2]| place(0.5 * (tile.vertices[a as usize] + tile.vertices[b as usize]));
    let mut notes = Vec::new();
    if let Some((_, edge)) = found.one_sided.first() {
        let place = middle(*edge);
        notes.push(format!("the surface has one side only, as a Möbius strip: its faces around {place} cannot be turned alike, and are as the file has them"));
    }
    if let Some(&edge) = found.crowded.first() {
        let (count, place) = (found.crowded.len(), middle(edge));
        let edges = if count == 1 { "1 edge has" } else { &format!("{count} edges have") };
        notes.push(format!(
            "{edges} three faces or more, the first around {place}: which of them belong together is not told, and they are used as they are turned"
        ));
    }
    tile.notes.extend(notes);
    turned
}

fn place(v: DVec3) -> String {
    let digits = |x: f64| format!("{x:.3e}").parse::<f64>().unwrap_or(x);
    format!("({}, {}, {})", digits(v.x), digits(v.y), digits(v.z))
}

#[cfg(test)]
mod tests {
    use super::super::file::{load, load_coloured};
    use super::super::orientation::Up;
    use crate::geometry::Tile;
    use glam::DVec2;

    const TENT: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 0 .3\nv .5 1 .3\n";

    fn read(text: &str) -> Tile {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        std::fs::write(&path, text).unwrap();
        load(&path, DVec2::ONE, 1.0, Up::Z, false).unwrap()
    }

    #[test]
    fn a_face_turned_against_the_others_is_turned_with_its_texture_and_colours() {
        let coloured = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 1 1 0 0 0 1\nv 0 1 0 1 1 0\nv 2 0 0 0 1 1\n";
        let uv = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .5 0\n";
        let right = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 2/2 5/5 3/3\n";
        let wrong = "f 1/1 2/2 3/3\nf 1/1 4/4 3/3\nf 2/2 5/5 3/3\n";
        let folder = tempfile::tempdir().unwrap();
        let [right, wrong] = [("right.obj", right), ("wrong.obj", wrong)].map(|(name, faces)| {
            let path = folder.path().join(name);
            std::fs::write(&path, [coloured, uv, faces].concat()).unwrap();
            load_coloured(&path).unwrap()
        });
        // Corners, texture coordinates and colours of each triangle belong together, wherever it begins.
        let corners = |(tile, colours): &(Tile, Option<Vec<[glam::DVec3; 3]>>), t: usize| {
            let (uv, colours) = (tile.uv.as_ref().unwrap()[t], colours.as_ref().unwrap()[t]);
            let mut all: Vec<_> = (0..3).map(|k| (tile.corners(t)[k].to_array(), uv[k].to_array(), colours[k].to_array())).collect();
            let first = (0..3).min_by(|&a, &b| all[a].partial_cmp(&all[b]).unwrap()).unwrap();
            all.rotate_left(first);
            all
        };
        for t in 0..3 {
            assert_eq!(corners(&wrong, t), corners(&right, t), "triangle {t}");
        }
        assert!(right.0.notes.is_empty(), "{:?}", right.0.notes);
        assert_eq!(wrong.0.notes.len(), 1);
        assert!(
            wrong.0.notes[0].contains("turned 1 face that was turned against the others, the first around (0.3333, 0.6667, 0)"),
            "{:?}",
            wrong.0.notes
        );
    }

    #[test]
    fn a_slope_of_a_tent_is_turned_and_a_tent_that_is_all_inside_out_is_noted_only() {
        let right = read(&format!("{TENT}f 1 5 6 4\nf 5 2 3 6\n"));
        let wrong = read(&format!("{TENT}f 1 5 6 4\nf 5 6 3 2\n"));
        let up = |tile: &Tile| {
            (0..tile.triangles.len()).all(|t| {
                let [a, b, c] = tile.corners(t);
                (b - a).cross(c - a).z > 0.0
            })
        };
        assert!(right.notes.is_empty() && up(&right));
        assert!(wrong.notes.len() == 1 && wrong.notes[0].starts_with("turned 2 faces") && up(&wrong), "{:?}", wrong.notes);
        let inside_out = read(&format!("{TENT}f 4 6 5 1\nf 6 3 2 5\n"));
        assert!(inside_out.notes.iter().all(|note| !note.starts_with("turned")), "{:?}", inside_out.notes);
    }

    #[test]
    fn edges_of_three_faces_and_surfaces_of_one_side_are_noted_and_kept() {
        let fin = read(&format!("{TENT}v .5 0 1\nv .5 1 1\nf 1 5 6 4\nf 5 2 3 6\nf 5 7 8 6\n"));
        assert_eq!(fin.triangles.len(), 6);
        assert!(
            fin.notes.len() == 1 && fin.notes[0].contains("1 edge has three faces or more, the first around (0.5, 0.5, 0.3)"),
            "{:?}",
            fin.notes
        );
    }
}
