//! The sidecar that `biscale fold --on` writes beside a wrap sheet: where its markers and patches are.

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
    pub markers: Vec<Marker>,
    /// Name of the dictionary.
    pub dictionary: String,
    /// Colour patches.
    pub patches: Vec<Patch>,
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
        /// Of the bare cylinder.
        radius: f64,
        /// Of the wrapped part.
        height: f64,
    },
    /// The side of a cone; not supported here.
    Cone {},
    /// A box; not supported here.
    Box {},
}

/// A marker on the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Marker {
    /// Number in the dictionary.
    pub id: i32,
    /// Corners from its own upper left clockwise.
    pub corners_mm: [[f64; 2]; 4],
}

/// A colour patch on the page.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Patch {
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
    recipe: Option<Recipe>,
    wrap: Option<Wrap>,
}

#[derive(Deserialize)]
struct Recipe {
    #[serde(default)]
    thickness: f64,
}

#[derive(Deserialize)]
struct Wrap {
    target: Target,
    fit: Fit,
    dictionary: String,
    seam_mm: f64,
    origin_mm: [f64; 2],
    markers: Vec<Marker>,
    patches: Vec<Patch>,
}

#[derive(Deserialize)]
struct Fit {
    around: f64,
    pitch_mm: f64,
}

/// Most bytes of a sidecar.
const MAX_BYTES: u64 = 1 << 26;
/// What the markers' own rectangle is larger than the placed area: a marker of 14 mm and 2 mm of white on each side, less the outer white.
const FRAME: f64 = 2.0 * (14.0 + 2.0);

impl Sheet {
    /// Reads a sidecar.
    ///
    /// # Errors
    /// Bad input for anything that is no sidecar of a wrap sheet around a plane or a cylinder.
    pub fn read(path: &Path) -> Result<Self> {
        let remedy = "name the .json that `biscale fold MATERIAL -o SHEET.pdf --on ...` wrote";
        let bad = |problem: String| Error::from(BadInput::new(problem, remedy).in_file(path));
        let length = std::fs::metadata(path).map_err(|e| Error::reading(path, e))?.len();
        if length > MAX_BYTES {
            return Err(bad(format!("the file has {length} bytes")));
        }
        let bytes = std::fs::read(path).map_err(|e| Error::reading(path, e))?;
        let sidecar: Sidecar = serde_json::from_slice(&bytes).map_err(|e| bad(format!("this is no sidecar of a sheet: {e}")))?;
        let wrap = sidecar.wrap.ok_or_else(|| bad("this sheet was not made for an object (`--on`): it has no markers".into()))?;
        let thickness = sidecar.recipe.map_or(0.0, |r| r.thickness);
        let (extent, seam) = match wrap.target {
            Target::Plane { width, height } => (DVec2::new(width, height), 0.0),
            Target::Cylinder { height, .. } => (DVec2::new(wrap.fit.pitch_mm * wrap.fit.around, height), wrap.seam_mm),
            Target::Cone {} | Target::Box {} => {
                return Err(bad("a photograph of a cone or a box cannot be registered".into()));
            }
        };
        let finite = |v: DVec2| v.is_finite() && v.min_element() > 0.0;
        let numbers = wrap.markers.iter().flat_map(|m| m.corners_mm.as_flattened()).all(|v| v.is_finite());
        if !finite(extent) || !thickness.is_finite() || !numbers || wrap.markers.is_empty() {
            return Err(bad("its lengths or markers are missing or not finite".into()));
        }
        let corners = || wrap.markers.iter().flat_map(|m| m.corners_mm.iter().map(|&c| DVec2::from(c)));
        let (low, high) = corners().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        let placed = high - low - FRAME;
        let upright = extent + DVec2::new(seam, 0.0);
        // Which of the two it is, by what fits better: the sidecar does not say.
        let turned = placed.distance(upright) > placed.distance(DVec2::new(upright.y, upright.x));
        Ok(Self {
            target: wrap.target,
            thickness,
            extent,
            origin: wrap.origin_mm.into(),
            placed,
            turned,
            markers: wrap.markers,
            dictionary: wrap.dictionary,
            patches: wrap.patches,
        })
    }

    /// Where a place of the page lies from the lower left corner of the wrapped area: around (or across) and along it.
    pub fn unrolled(&self, page: DVec2) -> DVec2 {
        let p = page - self.origin;
        if self.turned { DVec2::new(p.y, self.placed.x - p.x) } else { p }
    }
}
