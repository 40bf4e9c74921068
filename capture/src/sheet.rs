//! The sidecar that `biscale fold --on` writes beside a wrap sheet: where its markers and patches are.

use crate::dictionary::Dictionary;
use biscale::bounded_file::read_bounded;
use biscale::error::{BadInput, Error, Result};
use glam::DVec2;
use serde::Deserialize;
use std::path::Path;

/// A wrap sheet; lengths in mm, places on the page from its lower left corner, y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheet {
    /// What it is wrapped around.
    pub target: Target,
    /// Paper thickness.
    pub thickness: f64,
    /// Length of the wrapped area around (or across) and along, without the seam.
    pub extent: DVec2,
    /// Lower left corner of the placed area on the page.
    pub origin: DVec2,
    /// Width of the placed area on the page, seam included.
    pub placed: DVec2,
    /// Whether the wrapped area is turned by a quarter on the page.
    pub turned: bool,
    /// Markers of the dictionary.
    pub markers: Vec<SheetMarker>,
    /// Their dictionary.
    pub dictionary: Dictionary,
    /// Colour patches.
    pub patches: Vec<SheetPatch>,
}

/// A shape that a camera can be registered to.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Target {
    /// A rectangle.
    Plane {
        /// Across.
        width: f64,
        /// Along.
        height: f64,
    },
    /// A cylinder.
    Cylinder {
        /// Radius of the bare cylinder.
        radius: f64,
        /// Height of the wrapped part.
        height: f64,
    },
    /// The side of a cone; not supported here.
    Cone {},
    /// A box; not supported here.
    Box {},
}

/// A marker on the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct SheetMarker {
    /// Number in the dictionary.
    pub id: i32,
    /// Corners from its own upper left clockwise.
    pub corners_mm: [[f64; 2]; 4],
}

/// A colour patch on the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct SheetPatch {
    /// `design`, `grey` or `white`.
    pub kind: String,
    /// Its place among its kind.
    pub index: usize,
    /// What was sent to the printer.
    pub linear_rgb: [f64; 3],
    /// Lower left and upper right corner.
    pub rectangle_mm: [[f64; 2]; 2],
}

#[derive(Deserialize)]
struct Sidecar {
    recipe: Option<SidecarRecipe>,
    wrap: Option<Wrap>,
}

#[derive(Deserialize)]
struct SidecarRecipe {
    #[serde(default)]
    thickness: f64,
}

#[derive(Deserialize)]
struct Wrap {
    target: Target,
    fit: SidecarFit,
    dictionary: String,
    origin_mm: [f64; 2],
    turned: bool,
    joined_size_mm: [f64; 2],
    markers: Vec<PageMarker>,
    patches: Vec<PagePatch>,
    /// What each page holds, of a sheet that is glued together of several.
    #[serde(default)]
    pages: Vec<serde::de::IgnoredAny>,
}

/// A marker as the sidecar has it: on its page, and on the joined sheet.
#[derive(Deserialize)]
struct PageMarker {
    #[serde(flatten)]
    marker: SheetMarker,
    joined_mm: Option<[[f64; 2]; 4]>,
}

/// A patch as the sidecar has it.
#[derive(Deserialize)]
struct PagePatch {
    #[serde(flatten)]
    patch: SheetPatch,
    #[serde(default = "first")]
    page: usize,
    /// Whether it is still on the sheet when that is cut out.
    #[serde(default)]
    kept: bool,
}

fn first() -> usize {
    1
}

impl Wrap {
    /// Markers, origin and patches in one frame: that of the page, or, of several pages, that of the joined sheet from the lower left corner of
    /// its wrapped area. The patches are those of the first page then, shifted as it is.
    fn placed(self) -> Option<(Vec<SheetMarker>, DVec2, Vec<SheetPatch>)> {
        let origin = DVec2::from(self.origin_mm);
        let of_first = self.patches.into_iter().filter(|p| p.page == 1 && p.kept).map(|p| p.patch);
        if self.pages.len() < 2 {
            return Some((self.markers.into_iter().map(|m| m.marker).collect(), origin, of_first.collect()));
        }
        let joined = |m: PageMarker| Some(SheetMarker { corners_mm: m.joined_mm?, ..m.marker });
        let shifted = |p: SheetPatch| SheetPatch { rectangle_mm: p.rectangle_mm.map(|c| (DVec2::from(c) - origin).to_array()), ..p };
        Some((self.markers.into_iter().map(joined).collect::<Option<_>>()?, DVec2::ZERO, of_first.map(shifted).collect()))
    }
}

#[derive(Deserialize)]
struct SidecarFit {
    around: f64,
    pitch_mm: f64,
}

/// Most bytes of a sidecar.
const MAX_BYTES: u64 = 1 << 26;

impl Sheet {
    /// Reads a sidecar.
    ///
    /// # Errors
    /// Bad input for anything that is no sidecar of a wrap sheet around a plane or a cylinder.
    pub fn read(path: &Path) -> Result<Self> {
        let remedy = "name the .json beside a folding pattern that was made for an object";
        let bad = |problem: String| Error::from(BadInput::new(problem, remedy).in_file(path));
        let bytes = read_bounded(path, MAX_BYTES, remedy)?;
        let sidecar: Sidecar = serde_json::from_slice(&bytes).map_err(|e| bad(format!("this is no sidecar of a sheet: {e}")))?;
        let wrap = sidecar.wrap.ok_or_else(|| bad("this sheet was not made for an object: it has no markers".into()))?;
        let thickness = sidecar.recipe.map_or(0.0, |r| r.thickness);
        let extent = match wrap.target {
            Target::Plane { width, height } => DVec2::new(width, height),
            Target::Cylinder { height, .. } => DVec2::new(wrap.fit.pitch_mm * wrap.fit.around, height),
            Target::Cone {} | Target::Box {} => {
                return Err(bad("a photograph of a cone or a box cannot be registered".into()));
            }
        };
        let (turned, placed) = (wrap.turned, DVec2::from(wrap.joined_size_mm));
        let target = wrap.target;
        let Some(dictionary) = Dictionary::named(&wrap.dictionary) else {
            return Err(bad(format!("its markers are of a dictionary \"{}\", which OpenCV has not", wrap.dictionary)));
        };
        let Some((markers, origin, patches)) = wrap.placed() else {
            return Err(bad("its markers lack their places on the joined sheet".into()));
        };
        let finite = |v: DVec2| v.is_finite() && v.min_element() > 0.0;
        let numbers = markers.iter().flat_map(|m| m.corners_mm.as_flattened()).all(|v| v.is_finite());
        if !finite(extent) || !finite(placed) || !thickness.is_finite() || !numbers || markers.is_empty() {
            return Err(bad("its lengths or markers are missing or not finite".into()));
        }
        Ok(Self { target, thickness, extent, origin, placed, turned, markers, dictionary, patches })
    }

    /// Where a place of the page lies from the lower left corner of the wrapped area: around (or across) and along it.
    pub fn unrolled(&self, page: DVec2) -> DVec2 {
        let p = page - self.origin;
        if self.turned { DVec2::new(p.y, self.placed.x - p.x) } else { p }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale_fabricate::paper::Paper;
    use biscale_fabricate::wrap::{Target as Object, Wrap, wrap};
    use serde_json::json;

    /// A wrap sheet on paper of a size, and as it is read from its sidecar.
    fn sheet(object: &str, size: DVec2) -> (Wrap, Sheet) {
        let object = Object::parse(object).unwrap();
        let fit = object.fit(DVec2::splat(4.0), 0.1);
        let paper = Paper { name: "p", size, roll: false, margin: 10.0, inset: 0.0 };
        let made = wrap(object, fit, 0.1, &[[0.5; 3]], paper, "t").unwrap();
        let sidecar = json!({
            "recipe": { "thickness": 0.1 },
            "wrap": {
                "target": object, "fit": fit, "dictionary": "DICT_5X5_100", "origin_mm": made.parts[0].origin_mm,
                "turned": made.turned, "joined_size_mm": made.size.to_array(),
                "pages": made.parts, "markers": made.markers, "patches": made.patches,
            },
        });
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.json");
        std::fs::write(&path, sidecar.to_string()).unwrap();
        let read = Sheet::read(&path).unwrap();
        (made, read)
    }

    #[test]
    fn a_sheet_of_several_pages_is_read_as_it_is_glued_together() {
        for (object, size, several) in [
            ("cylinder:radius=60,height=120", DVec2::new(210.0, 297.0), true),
            ("plane:width=300,height=260", DVec2::new(210.0, 297.0), true),
            ("cylinder:radius=60,height=120", DVec2::new(594.0, 420.0), false),
        ] {
            let (made, read) = sheet(object, size);
            assert_eq!(made.pages.len() > 1, several, "{object}");
            assert!((read.placed - made.size).length() < 1e-9 && read.turned == made.turned, "{object}: {:?} {:?}", read.placed, made.size);
            assert_eq!(read.markers.len(), made.markers.len());
            let whole = if read.turned { DVec2::new(made.size.y, made.size.x) } else { made.size };
            for corner in read.markers.iter().flat_map(|m| m.corners_mm) {
                let p = read.unrolled(corner.into());
                let outside = (-p).max(p - whole).max_element();
                assert!(outside > 1.9 && outside < 16.1, "{object}: a marker's corner at {p}");
            }
            // Only what is left when the sheet is cut.
            assert_eq!(read.patches.iter().filter(|p| p.kind == "white").count(), usize::from(made.margins[1] > 0.0), "{object}");
        }
    }
}
