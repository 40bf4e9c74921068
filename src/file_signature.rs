//! What a file of another program is, by its first bytes or by its ending: so that whoever names one where a text of ours belongs is told what it is, and what
//! takes it.

use crate::error::BadInput;
use std::path::Path;

/// Bytes that are looked at.
pub const HEAD: u64 = 512;

/// A kind of files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Signature {
    /// What it is, with its article.
    pub what: &'static str,
    /// What takes it.
    pub used: &'static str,
    /// How it begins.
    magic: &'static [&'static [u8]],
    /// Endings of its name, in lower case.
    endings: &'static [&'static str],
}

const MESH: &str = "`biscale fold` takes it as it is; name it as `file` in the `[geometry]` of a material file, with `kind = \"mesh\"`, or in an `[[object]]` of a scene file";
const HEIGHTS: &str =
    "name it as `file` in the `[geometry]` of a material file, with `kind = \"height-field\"`, or compare it by `biscale compare`";
const NOTHING: &str = "no command takes such files";

/// The kinds, those with the longest beginning first.
const SIGNATURES: &[Signature] = &[
    Signature { what: "a PNG image", used: HEIGHTS, magic: &[b"\x89PNG"], endings: &["png"] },
    Signature { what: "a TIFF image", used: HEIGHTS, magic: &[b"II*\0", b"MM\0*", b"II+\0", b"MM\0+"], endings: &["tif", "tiff"] },
    Signature {
        what: "an OpenEXR image",
        used: "`biscale compare` takes it, and `biscale plot` if `bake` wrote it; as heights name it as `file` in the `[geometry]` of a material file, as light \
               in the `[environment]` of a scene file",
        magic: &[b"\x76\x2f\x31\x01"],
        endings: &["exr"],
    },
    Signature {
        what: "a radiance map",
        used: "name it as `file` in the `[environment]` of a scene file",
        magic: &[b"#?RADIANCE", b"#?RGBE"],
        endings: &["hdr", "pic"],
    },
    Signature {
        what: "a JPEG image",
        used: "write it as PNG, TIFF or OpenEXR first",
        magic: &[b"\xff\xd8\xff"],
        endings: &["jpg", "jpeg"],
    },
    Signature { what: "a height map of GelSight or TrueMap", used: HEIGHTS, magic: &[b"Binary TrueMap Data File"], endings: &["tmd"] },
    Signature { what: "a PLY mesh", used: MESH, magic: &[b"ply\n", b"ply\r"], endings: &["ply"] },
    Signature { what: "an STL mesh", used: MESH, magic: &[], endings: &["stl"] },
    Signature { what: "an OBJ mesh", used: MESH, magic: &[], endings: &["obj"] },
    Signature {
        what: "the material library of an OBJ mesh",
        used: "it is not read: cover the mesh's parts by `[[surface]]`s of a material file",
        magic: &[],
        endings: &["mtl"],
    },
    Signature {
        what: "a weaving draft (WIF)",
        used: "name it as `wif` in the `[geometry]` of a material file, with `kind = \"weave\"`",
        magic: &[b"[WIF]", b"[wif]", b"[Wif]"],
        endings: &["wif"],
    },
    Signature { what: "a comma-separated list", used: "`biscale eval --pairs` takes lists of directions", magic: &[], endings: &["csv"] },
    Signature {
        what: "a table of a measured BRDF",
        used: "name it as `file` in a `brdf` of a material file, with `model = \"measured\"`",
        magic: &[b"tensor_file"],
        endings: &["bsdf", "binary"],
    },
    Signature { what: "a PDF document", used: NOTHING, magic: &[b"%PDF"], endings: &["pdf"] },
    Signature { what: "an SVG drawing", used: "`biscale fold --verify` takes it if `fold` wrote it", magic: &[b"<svg"], endings: &["svg"] },
    Signature { what: "an XML or HTML document", used: NOTHING, magic: &[b"<?xml", b"<!DOCTYPE", b"<html"], endings: &["xml", "html"] },
    Signature {
        what: "a JSON document",
        used: "of these `biscale` reads `capture.json`, by the folder that it is in, and patterns by `fold --verify`",
        magic: &[b"{"],
        endings: &["json", "fold"],
    },
    Signature {
        what: "an archive",
        used: "unpack it first",
        magic: &[b"PK\x03\x04", b"\x1f\x8b", b"7z\xbc\xaf"],
        endings: &["zip", "gz", "3mf", "7z"],
    },
    Signature { what: "a binary glTF scene", used: "write its mesh as OBJ, PLY or STL", magic: &[b"glTF"], endings: &["glb", "gltf"] },
    Signature { what: "an FBX scene", used: "write its mesh as OBJ, PLY or STL", magic: &[b"Kaydara FBX"], endings: &["fbx"] },
    Signature { what: "a Blender file", used: "write its mesh as OBJ, PLY or STL", magic: &[b"BLENDER"], endings: &["blend"] },
    Signature { what: "a program", used: NOTHING, magic: &[b"\x7fELF", b"MZ\x90"], endings: &["exe"] },
];

impl Signature {
    /// The kind of a file that begins with `head`. No text of ours begins so.
    ///
    /// ```
    /// use biscale::file_signature::Signature;
    ///
    /// assert_eq!(Signature::of_head(b"\x89PNG\r\n").unwrap().what, "a PNG image");
    /// assert_eq!(Signature::of_head(b"format = 1\n"), None);
    /// ```
    pub fn of_head(head: &[u8]) -> Option<Self> {
        let head = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head).trim_ascii_start();
        SIGNATURES.iter().copied().find(|s| s.magic.iter().any(|m| head.starts_with(m)))
    }

    /// The kind of a file by the ending of its name, for formats that begin as they like.
    pub fn of_name(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?.to_ascii_lowercase();
        SIGNATURES.iter().copied().find(|s| s.endings.contains(&&*ending))
    }

    /// The mistake of naming such a file where a TOML file of ours belongs.
    pub fn is_no_toml(self, path: &Path) -> BadInput {
        BadInput::new(format!("this is {}, and not a TOML file", self.what), self.used).in_file(path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_is_known_by_its_beginning_and_by_its_ending() {
        for signature in SIGNATURES {
            for magic in signature.magic {
                assert_eq!(Signature::of_head(magic).as_ref(), Some(signature), "{magic:?}");
                assert_eq!(Signature::of_head(&[b"\xef\xbb\xbf \n", *magic, b" and more"].concat()).as_ref(), Some(signature), "{magic:?}");
            }
            for ending in signature.endings {
                assert_eq!(Signature::of_name(Path::new(&format!("a.{}", ending.to_uppercase()))).as_ref(), Some(signature), "{ending}");
            }
        }
        for ours in ["format = 1", "# a comment", "[geometry]", "[[surface]]", "\"name\" = 1", "", "v = 0"] {
            assert_eq!(Signature::of_head(ours.as_bytes()), None, "{ours}");
        }
        assert_eq!(Signature::of_name(Path::new("a.toml")), None);
        assert_eq!(Signature::of_name(Path::new("obj")), None);
    }
}
