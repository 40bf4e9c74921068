//! Whether a mesh lies in its period as a surface does: z up, front faces up, as wide as the period.

use super::super::tile::Tile;
use glam::{DVec3, Vec3Swizzles};

/// An axis of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// x; y and z lie across.
    X,
    /// y; x and -z lie across.
    Y,
    /// z; x and y lie across.
    Z,
}

impl Up {
    /// A place of the file, turned so that its axis points up; nothing is mirrored.
    pub fn turn(self, v: DVec3) -> DVec3 {
        match self {
            Self::X => v.yzx(),
            Self::Y => DVec3::new(v.x, -v.z, v.y),
            Self::Z => v,
        }
    }

    /// The name of the file's axis that a turned axis was, x or y.
    fn was(self, along_x: bool) -> &'static str {
        match (self, along_x) {
            (Self::X, true) => "y",
            (Self::X, false) | (Self::Y, false) => "z",
            (Self::Y, true) | (Self::Z, true) => "x",
            (Self::Z, false) => "y",
        }
    }
}

/// A mesh whose faces cover less of the period than this, seen from above, is noted. Chosen, not measured: threads with gaps cover about half.
const LITTLE: f64 = 0.3;

/// What is odd about the place of a mesh in its period, each with a remedy.
pub(super) fn notes(tile: &Tile, scale: f64, up_axis: Up) -> Vec<String> {
    let mut notes = Vec::new();
    // Vector areas: their components are what is seen along the axes.
    let areas = |k: usize| {
        let [a, b, c] = tile.corners(k);
        0.5 * (b - a).cross(c - a)
    };
    let (mut up, mut down) = (DVec3::ZERO, DVec3::ZERO);
    for area in (0..tile.triangles.len()).map(areas) {
        up += area.max(DVec3::ZERO);
        down += (-area).max(DVec3::ZERO);
    }
    let cover = up.z.max(down.z) / tile.footprint();
    let (low, high) = tile.vertices.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
    let size = (high - low) / scale;
    let period = tile.period / scale;
    // A sheet has all of its area on one side of its plane, a closed body none.
    let net = (up - down).abs();
    let side = scale * scale * DVec3::new(size.y * size.z, size.x * size.z, size.x * size.y);
    let lies = [(up_axis.was(true), net.x, side.x), (up_axis.was(false), net.y, side.y)]
        .into_iter()
        .filter(|(_, net_area, side)| *net_area > (0.5 * side).max(2.0 * net.z));
    let percent = shown(100.0 * cover);
    if let Some((axis, ..)) = lies.max_by(|a, b| a.1.total_cmp(&b.1)) {
        notes.push(format!(
            "the mesh lies on its side: from above it covers at most {percent} % of the period; its {axis} axis seems to point up: write `up = \"{axis}\"`"
        ));
    } else if cover < LITTLE {
        notes.push(format!(
            "seen from above the mesh covers at most {percent} % of the period: it is {} x {} x {} large, and a period {} x {}; \
             write `period = [{0}, {1}]` if that is one period of it",
            shown(size.x),
            shown(size.y),
            shown(size.z),
            shown(period.x),
            shown(period.y)
        ));
    }
    // Of a closed body both are equal.
    if down.z > 1.01 * up.z {
        let percent = shown(100.0 * down.z / (up.z + down.z));
        notes.push(format!(
            "seen from above {percent} % of the faces show their backs, which are black: write `flip = true` if the mesh is inside out"
        ));
    }
    notes
}

/// Three digits.
fn shown(value: f64) -> String {
    format!("{value:.2e}").parse::<f64>().unwrap_or(value).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::file::load;
    use super::*;
    use glam::DVec2;

    /// A tent over a period of 1 x 1, its ridge along y.
    const TENT: [[f64; 3]; 6] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.0, 0.3], [0.5, 1.0, 0.3]];

    /// The tent's notes, written in a file with its vertices moved and its faces as they are or turned over.
    fn notes(place: impl Fn(DVec3) -> DVec3, reversed: bool, up: Up, flip: bool) -> Vec<String> {
        let folder = tempfile::tempdir().unwrap();
        let mut text = String::new();
        for v in TENT.map(|v| place(v.into())) {
            text += &format!("v {} {} {}\n", v.x, v.y, v.z);
        }
        text += if reversed { "f 4 6 5 1\nf 6 3 2 5\n" } else { "f 1 5 6 4\nf 5 2 3 6\n" };
        let path = folder.path().join("tent.obj");
        std::fs::write(&path, text).unwrap();
        load(&path, DVec2::ONE, 1.0, up, flip).unwrap().notes
    }

    #[test]
    fn a_tent_in_its_period_is_not_noted() {
        assert!(notes(|v| v, false, Up::Z, false).is_empty());
        // Turned and turned back, turned over twice.
        assert!(notes(|v| DVec3::new(v.x, v.z, -v.y), false, Up::Y, false).is_empty());
        assert!(notes(|v| v, true, Up::Z, true).is_empty());
    }

    #[test]
    fn a_mesh_that_is_too_small_turned_or_inside_out_is_noted_with_its_remedy() {
        for (got, words) in [
            (notes(|v| 1e-3 * v, false, Up::Z, false), ["0.0001 % of the period", "write `period = [0.001, 0.001]`"]),
            (notes(|v| v, true, Up::Z, false), ["100 % of the faces show their backs", "`flip = true`"]),
            // Up along y, with the other two across in cyclic order, and mirrored.
            (notes(|v| v.yzx(), false, Up::Z, false), ["lies on its side", "`up = \"y\"`"]),
            (notes(|v| DVec3::new(v.x, v.z, -v.y), false, Up::Z, false), ["lies on its side", "`up = \"y\"`"]),
            (notes(|v| v.zxy(), false, Up::Z, false), ["lies on its side", "`up = \"x\"`"]),
            // Turned where it should not be.
            (notes(|v| v, false, Up::Y, false), ["lies on its side", "`up = \"z\"`"]),
            (notes(|v| v, false, Up::X, false), ["lies on its side", "`up = \"z\"`"]),
            (notes(|v| v.yzx(), false, Up::X, false), ["lies on its side", "`up = \"y\"`"]),
        ] {
            assert!(got.len() == 1 && words.iter().all(|word| got[0].contains(word)), "{words:?}: {got:?}");
        }
    }
}
