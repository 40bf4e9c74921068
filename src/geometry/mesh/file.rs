//! Mesh files by the endings of their names: .obj, .ply, .stl.

use super::super::tile::Tile;
use super::orientation::Up;
use super::soup::Soup;
use super::{obj, orientation, ply, stl, textures, turning};
use crate::bounded_file::{MAX_DATA_BYTES, read_bounded};
use crate::error::{BadInput, Result};
use glam::{DVec2, DVec3};
use std::path::Path;

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
    let bytes = read_bounded(file, MAX_DATA_BYTES, "simplify the mesh")?;
    let Soup { vertices, triangles, part_of_triangle, parts, notes, .. } = parse(file, &bytes).map_err(|bad| bad.in_file(file))?;
    Ok(PlainMesh { vertices, triangles, part_of_triangle, parts, notes })
}

/// Reads a mesh as a tile of this period, in the file's lengths, turns and scales it; `flip` turns its faces over.
pub(crate) fn load(file: &Path, period: DVec2, scale: f64, up: Up, flip: bool) -> Result<Tile> {
    let bytes = read_bounded(file, MAX_DATA_BYTES, "simplify the mesh")?;
    let mut soup = parse(file, &bytes).map_err(|bad| bad.in_file(file))?;
    soup.vertices.iter_mut().for_each(|v| *v = up.turn(*v));
    if flip {
        soup.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        soup.uv.iter_mut().for_each(|uv| uv.swap(1, 2));
    }
    let mut tile = soup.into_tile(period, scale).map_err(|bad| bad.in_file(file))?;
    turning::turn_alike(&mut tile);
    tile.notes.extend(orientation::notes(&tile, scale, up));
    Ok(tile)
}

/// A mesh as [`load`] gives it, in the file's lengths, and the linear colours of the corners of its triangles where every vertex has one.
pub(crate) fn load_coloured(file: &Path) -> Result<(Tile, Option<Vec<[DVec3; 3]>>)> {
    let bytes = read_bounded(file, MAX_DATA_BYTES, "simplify the mesh")?;
    let mut soup = parse(file, &bytes).map_err(|bad| bad.in_file(file))?;
    let colours = (!soup.colours.is_empty() && soup.colours.len() == soup.vertices.len()).then(|| std::mem::take(&mut soup.colours));
    let colours: Option<Vec<[DVec3; 3]>> = colours.map(|of| soup.triangles.iter().map(|t| t.map(|v| of[v as usize])).collect());
    let (mut tile, places) = soup.into_tile_of_triangles(DVec2::ONE, 1.0).map_err(|bad| bad.in_file(file))?;
    let mut colours: Option<Vec<[DVec3; 3]>> = colours.map(|all| places.iter().map(|&t| all[t]).collect());
    for t in turning::turn_alike(&mut tile) {
        colours.iter_mut().for_each(|of| of[t].swap(1, 2));
    }
    Ok((tile, colours))
}

/// Reads a mesh by the ending of its file's name.
fn parse(path: &Path, bytes: &[u8]) -> Result<Soup, BadInput> {
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    let soup = match &*ending {
        "obj" => obj::parse(bytes),
        "ply" => ply::parse(bytes),
        "stl" => stl::parse(bytes),
        _ => Err(BadInput::new(format!("the ending \"{ending}\" is not known for a mesh"), "use .obj, .ply or .stl")),
    };
    let mut soup = soup?.finish();
    let images = textures::of_libraries(path.parent().unwrap_or(Path::new("")), &soup.libraries);
    let images = images.into_iter().chain(std::mem::take(&mut soup.textures)).collect();
    soup.notes.extend(textures::note(images));
    Ok(soup)
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
    fn encodings_and_line_ends_of_texts_do_not_change_the_mesh() {
        let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl felt\nf 1 2 3\n";
        let marked = |text: &str| [b"\xef\xbb\xbf", text.as_bytes()].concat();
        let wide = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        for (name, text) in [("a.obj", obj), ("a.ply", PLY), ("a.stl", STL)] {
            let plain = parse(Path::new(name), text.as_bytes()).unwrap();
            let (mac, dos) = (text.replace('\n', "\r"), text.replace('\n', "\r\n"));
            for bytes in [marked(text), marked(&mac), mac.into_bytes(), dos.into_bytes(), wide(text), wide(&format!("\u{feff}{text}"))] {
                let soup = parse(Path::new(name), &bytes).unwrap_or_else(|bad| panic!("{name}, {bytes:?}: {bad}"));
                assert_eq!((&soup.vertices, &soup.triangles, &soup.parts), (&plain.vertices, &plain.triangles, &plain.parts), "{name}");
            }
        }
        // The header of a binary file may end its lines any way.
        for end in ["\r", "\r\n"] {
            let binary = binary_ply();
            let header = binary.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
            let text = String::from_utf8(binary[..header].to_vec()).unwrap().replace('\n', end);
            let soup = parse(Path::new("a.ply"), &[text.as_bytes(), &binary[header..]].concat()).unwrap();
            assert_eq!(soup.vertices[1], DVec3::X, "{end:?}");
        }
    }

    #[test]
    fn colours_of_vertices_are_kept_if_every_vertex_has_one_and_follow_their_triangles() {
        let folder = tempfile::tempdir().unwrap();
        let colours = |name: &str, text: &str| {
            let file = folder.path().join(name);
            std::fs::write(&file, text).unwrap();
            load_coloured(&file).unwrap().1
        };
        let (red, green, blue) = (DVec3::X, DVec3::Y, DVec3::Z);
        // The first face has no area and is dropped; the fourth vertex merges with the first, and keeps its own colour.
        let obj = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nv 0 0 0 0 1 0\nf 1 2 2\nf 1 2 3\nf 4 3 2\n";
        assert_eq!(colours("a.obj", obj), Some(vec![[red, green, blue], [green, blue, green]]));
        // Without a colour, with a weight, with what is no number: a mesh all the same.
        for other in ["v 0 1 0", "v 0 1 0 1", "v 0 1 0 0 0 blue"] {
            assert_eq!(colours("a.obj", &obj.replace("v 0 1 0 0 0 1", other)), None, "{other}");
        }
        let ply = PLY.replace("property float z\n", "property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n");
        let ply = ply.replace("0 0 0\n1 0 0\n0 1 0\n", "0 0 0 255 0 0\n1 0 0 0 188 0\n0 1 0 0 0 0\n");
        let [first, second, third] = colours("a.ply", &ply).unwrap()[0];
        // 188 of 255 is .5029 in linear light.
        assert!(first == red && (second - 0.502_886 * green).length() < 1e-6 && third == DVec3::ZERO, "{first}, {second}, {third}");
        let floats = ply.replace("uchar red", "float red").replace("uchar green", "float green").replace("uchar blue", "float blue");
        assert_eq!(colours("a.ply", &floats).unwrap()[0][1], 188.0 * green);
        assert_eq!(colours("a.ply", PLY), None);
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
