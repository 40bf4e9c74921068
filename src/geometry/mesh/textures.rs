//! Images that a mesh file names for its surface. They are not read: what covers a surface is said by the material file; but nobody should miss them without a word.

use crate::bounded_file::{MAX_TEXT_BYTES, read_bounded};
use crate::text_file::decode;
use std::collections::BTreeSet;
use std::path::Path;

/// Images that are named in one note.
const NAMED: usize = 3;

/// Libraries that are looked at.
const LIBRARIES: usize = 64;

/// The images that material libraries (MTL) beside a mesh name; of libraries that cannot be read none.
pub(super) fn of_libraries(folder: &Path, libraries: &[String]) -> Vec<String> {
    let mut images = Vec::new();
    let distinct: BTreeSet<&String> = libraries.iter().collect();
    for library in distinct.into_iter().take(LIBRARIES) {
        let path = folder.join(library.replace('\\', "/"));
        let Ok(bytes) = (if path.is_file() { read_bounded(&path, MAX_TEXT_BYTES, "") } else { continue }) else { continue };
        images.extend(decode(&bytes).lines().filter_map(image));
        images.sort_unstable();
        images.dedup();
    }
    images
}

/// The image that a line of a material library names: the last word, behind options.
fn image(line: &str) -> Option<String> {
    let mut words = line.split_whitespace();
    let key = words.next()?.to_ascii_lowercase();
    let is_map = key.starts_with("map_") || ["bump", "disp", "norm", "decal", "refl"].contains(&&*key);
    words.last().filter(|_| is_map).map(str::to_owned)
}

/// What the user should know of images that are not used.
pub(super) fn note(mut images: Vec<String>) -> Option<String> {
    images.sort_unstable();
    images.dedup();
    let first = images.iter().take(NAMED).map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
    let more = images.len().saturating_sub(NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    (!images.is_empty()).then(|| format!("the file's textures are not used: {first}{more}; name an image as the `tint` of a [[surface]]"))
}

#[cfg(test)]
mod tests {
    use super::super::file::read_plain;
    use super::*;

    #[test]
    fn textures_of_obj_and_ply_files_are_noted_and_colours_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nmtllib colours.mtl none.mtl\nmtllib my textures.mtl\nusemtl a\nf 1 2 3\n";
        std::fs::write(folder.path().join("a.obj"), obj).unwrap();
        std::fs::write(folder.path().join("colours.mtl"), "newmtl a\nKd 1 0 0\n# map_Kd no.png\n").unwrap();
        let notes = || read_plain(&folder.path().join("a.obj")).unwrap().notes;
        assert_eq!(notes(), Vec::<String>::new());
        std::fs::write(folder.path().join("my textures.mtl"), "newmtl a\n\tmap_Kd -s 2 2 1 wood.png\nmap_Kd wood.png\nbump grain.tif\n")
            .unwrap();
        assert_eq!(
            notes(),
            ["the file's textures are not used: \"grain.tif\", \"wood.png\"; name an image as the `tint` of a [[surface]]"]
        );
        let ply = "ply\nformat ascii 1.0\ncomment made by hand\ncomment TextureFile skin.png\nelement vertex 3\nproperty float x\nproperty float y\n\
                   property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        std::fs::write(folder.path().join("a.ply"), ply).unwrap();
        let notes = read_plain(&folder.path().join("a.ply")).unwrap().notes;
        assert!(notes.len() == 1 && notes[0].contains("\"skin.png\""), "{notes:?}");
        assert!(note((0..5).map(|k| format!("{k}.png")).collect()).unwrap().contains("\"2.png\" and 2 more"));
    }
}
