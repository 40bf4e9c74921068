//! `kind = "mesh"`: triangles from an OBJ, PLY or STL file, periodic in x and y.
//!
//! A file's own normals are not used: interpolated ones break `av = cos(theta_o)` and energy. Its vertices may reach over the period.
//! The readers never trust a count in a file: nothing is allocated that the file's size does not back.

mod obj;
mod ply;
mod polygon;
mod stl;

use super::Tile;
use super::builder::MAX_TRIANGLES;
use super::params::{Param, Unit, Value, number};
use super::values::GeometryValues;
use crate::error::{BadInput, Error, Result};
use crate::toml_reader::range;
use glam::{DVec2, DVec3};
use std::path::{Path, PathBuf};

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    Param {
        key: "file",
        value: Value::File { example: "surface.obj", required: true },
        help: "The mesh, .obj, .ply or .stl: z up, counter-clockwise seen from outside. PUT YOUR FILE'S NAME HERE",
    },
    Param {
        key: "period",
        value: Value::Pair { unit: Unit::Length, default: None, example: [1.0, 1.0], range: range(1e-6, 1e6) },
        help: "Size of one period in the mesh file's own lengths; required",
    },
    number("scale", Unit::One, 1.0, range(1e-9, 1e9), "Factor from the mesh file's lengths to `unit`"),
];

/// Parts of this kind, with what they are.
pub const PARTS: &[(&str, &str)] = &[("*", "all parts; OBJ files name them by usemtl, else by g; others have one, \"default\"")];

/// Name of the part where a file names none.
const NAMELESS: &str = "default";

/// Triangles from a file, periodic in x and y.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// OBJ, PLY or STL file.
    pub file: PathBuf,
    /// Period in the file's units.
    pub period: DVec2,
    /// Factor from the file's units to the material's.
    pub scale: f64,
}

impl Mesh {
    pub(super) fn read(values: &GeometryValues) -> Result<Self> {
        let file = values.path("file")?.expect("file is required").to_path_buf();
        let period = values.pair("period").ok_or_else(|| values.missing("period", "[1.0, 1.0]"))?;
        Ok(Self { file, period: period.into(), scale: values.number("scale") })
    }

    pub(super) fn build(&self) -> Result<Tile> {
        load(&self.file, self.period, self.scale)
    }
}

/// Triangles of a mesh file as they stand there: not cleaned, no period.
#[derive(Clone, Debug, PartialEq)]
pub struct PlainMesh {
    /// Positions in the file's own lengths, finite.
    pub vertices: Vec<DVec3>,
    /// Places in `vertices`.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle its place in `parts`.
    pub part_of_triangle: Vec<u16>,
    /// Names of the parts.
    pub parts: Vec<String>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Reads a mesh file (.obj, .ply, .stl) for what needs it as it is: a folding pattern names mistakes that [`Tile::clean`] repairs.
///
/// # Errors
/// Bad input with the file's name and, for text, the line.
pub fn read_plain(file: &Path) -> Result<PlainMesh> {
    let bytes = std::fs::read(file).map_err(|e| Error::reading(file, e))?;
    let Soup { vertices, triangles, part_of_triangle, parts, notes, .. } = parse(file, &bytes).map_err(|bad| bad.in_file(file))?;
    Ok(PlainMesh { vertices, triangles, part_of_triangle, parts, notes })
}

/// Reads a mesh as a tile of this period, in the file's lengths, and scales it.
pub(crate) fn load(file: &Path, period: DVec2, scale: f64) -> Result<Tile> {
    let bytes = std::fs::read(file).map_err(|e| Error::reading(file, e))?;
    let soup = parse(file, &bytes).map_err(|bad| bad.in_file(file))?;
    let tile = soup.into_tile(period, scale).map_err(|bad| bad.in_file(file))?;
    Ok(tile)
}

/// Reads a mesh by the ending of its file's name.
fn parse(path: &Path, bytes: &[u8]) -> Result<Soup, BadInput> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    match &*ending {
        "obj" => obj::parse(bytes),
        "ply" => ply::parse(bytes),
        "stl" => stl::parse(bytes),
        _ => Err(BadInput::new(format!("the ending \"{ending}\" is not known for a mesh"), "use .obj, .ply or .stl")),
    }
}

/// What a reader found, in the file's own lengths.
#[derive(Debug, Default)]
struct Soup {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    part_of_triangle: Vec<u16>,
    parts: Vec<String>,
    /// One entry a triangle, NaN where the file gives none.
    uv: Vec<[DVec2; 3]>,
    normals_ignored: bool,
    notes: Vec<String>,
}

impl Soup {
    /// Place of a part's name, added if it is new.
    fn part(&mut self, name: &str) -> Result<u16, BadInput> {
        let place = self.parts.iter().position(|p| p == name).unwrap_or_else(|| {
            self.parts.push(name.to_owned());
            self.parts.len() - 1
        });
        u16::try_from(place).map_err(|_| BadInput::new("the file has more than 65,536 parts", "use fewer materials or groups"))
    }

    /// Adds a polygon of 3 or more existing vertices, cut into triangles.
    fn polygon(&mut self, part: u16, corners: &[u32], uv: Option<&[DVec2]>) -> Result<(), BadInput> {
        let points: Vec<DVec3> = corners.iter().map(|&c| self.vertices[c as usize]).collect();
        for triangle in polygon::triangulate(&points)? {
            self.triangles.push(triangle.map(|k| corners[k]));
            self.part_of_triangle.push(part);
            self.uv.push(triangle.map(|k| uv.map_or(DVec2::NAN, |uv| uv[k])));
        }
        if self.triangles.len() > MAX_TRIANGLES {
            return Err(BadInput::new(format!("the mesh has more than {MAX_TRIANGLES} triangles"), "simplify it"));
        }
        Ok(())
    }

    fn into_tile(mut self, period: DVec2, scale: f64) -> Result<Tile, BadInput> {
        if self.triangles.is_empty() {
            return Err(BadInput::new("the file has no faces", "export a surface, not points or lines"));
        }
        if self.normals_ignored {
            self.notes.push("the file's own normals are not used: each triangle has its geometric normal".into());
        }
        let without = self.uv.iter().filter(|uv| uv.iter().any(|c| !c.is_finite())).count();
        if without > 0 && without < self.uv.len() {
            self.notes.push(format!("the texture coordinates are not used: {without} of {} triangles have none", self.uv.len()));
        }
        let uv = if without == 0 { Some(self.uv) } else { None };
        let vertices = self.vertices.into_iter().map(|v| v * scale).collect();
        let (triangles, part_of_triangle, parts, notes) = (self.triangles, self.part_of_triangle, self.parts, self.notes);
        Tile { vertices, triangles, part_of_triangle, parts, uv, period: period * scale, grid: None, notes }.clean()
    }
}

/// Three finite coordinates, or what is wrong with them.
fn finite(position: DVec3) -> Result<DVec3, BadInput> {
    if position.is_finite() {
        Ok(position)
    } else {
        let problem = format!("the vertex ({}, {}, {}) is not finite", position.x, position.y, position.z);
        Err(BadInput::new(problem, "coordinates must be finite numbers"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const OBJ: &str =
        "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 0 0 1\nusemtl a\nf 1/1/1 2/2/1 3/3/1\nf -4//1 -2//1 -1//1\n";
    const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                       property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    const STL: &str = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n";

    /// A binary PLY of one triangle.
    fn binary_ply() -> Vec<u8> {
        let mut bytes = PLY[..PLY.find("0 0 0").unwrap()].replace("ascii", "binary_little_endian").into_bytes();
        for value in [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.push(3);
        for index in [0_i32, 1, 2] {
            bytes.extend(index.to_le_bytes());
        }
        bytes
    }

    /// A binary STL of one triangle.
    fn binary_stl() -> Vec<u8> {
        let mut bytes = vec![0_u8; 80];
        bytes.extend(1_u32.to_le_bytes());
        for value in [0_f32, 0., 1., 0., 0., 0., 1., 0., 0., 0., 1., 0.] {
            bytes.extend(value.to_le_bytes());
        }
        bytes.extend([0, 0]);
        bytes
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn no_reader_panics_on_random_bytes(bytes in prop::collection::vec(any::<u8>(), 0..400), header in 0_usize..3) {
            let heads: [&[u8]; 3] = [b"", b"ply\nformat binary_big_endian 1.0\n", b"solid "];
            let bytes = [heads[header], &bytes].concat();
            for name in ["a.obj", "a.ply", "a.stl"] {
                let _ = parse(Path::new(name), &bytes).and_then(|soup| soup.into_tile(DVec2::ONE, 1.0));
            }
        }

        #[test]
        fn no_reader_panics_on_damaged_files(
            which in 0_usize..5,
            damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
            cut in any::<prop::sample::Index>(),
            whole in any::<bool>(),
        ) {
            let (name, mut bytes) = [
                ("a.obj", OBJ.as_bytes().to_vec()),
                ("a.ply", PLY.as_bytes().to_vec()),
                ("a.stl", STL.as_bytes().to_vec()),
                ("a.ply", binary_ply()),
                ("a.stl", binary_stl()),
            ][which].clone();
            for (place, byte) in damage {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            if !whole {
                bytes.truncate(cut.index(bytes.len()));
            }
            let _ = parse(Path::new(name), &bytes).and_then(|soup| soup.into_tile(DVec2::ONE, 1.0));
        }
    }

    #[test]
    fn the_same_triangle_comes_out_of_every_format() {
        let files: [(&str, Vec<u8>); 5] = [
            ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n".to_vec()),
            ("a.ply", PLY.into()),
            ("a.stl", STL.into()),
            ("b.PLY", binary_ply()),
            ("b.STL", binary_stl()),
        ];
        for (name, bytes) in files {
            let tile = parse(Path::new(name), &bytes).unwrap().into_tile(DVec2::ONE, 2.0).unwrap();
            assert_eq!(tile.vertices, [DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.0, 2.0, 0.0)], "{name}");
            assert_eq!(
                (tile.triangles, tile.parts, tile.period),
                (vec![[0, 1, 2]], vec!["default".to_owned()], DVec2::splat(2.0)),
                "{name}"
            );
        }
    }

    #[test]
    fn texture_coordinates_are_kept_only_if_every_triangle_has_them() {
        let partly = parse(Path::new("a.obj"), OBJ.as_bytes()).unwrap().into_tile(DVec2::ONE, 1.0).unwrap();
        assert_eq!(partly.uv, None);
        assert!(partly.notes.iter().any(|n| n.contains("1 of 2 triangles have none")), "{:?}", partly.notes);
        assert!(partly.notes.iter().any(|n| n.contains("own normals are not used")), "{:?}", partly.notes);
        let fully = OBJ.replace("f -4//1 -2//1 -1//1\n", "");
        let fully = parse(Path::new("a.obj"), fully.as_bytes()).unwrap().into_tile(DVec2::ONE, 1.0).unwrap();
        assert_eq!(fully.uv, Some(vec![[DVec2::ZERO, DVec2::X, DVec2::ONE]]));
    }
}
