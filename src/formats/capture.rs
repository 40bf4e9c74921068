//! `capture.json`: what `biscale capture` measured in photographs, and what `biscale fit` reads.
//!
//! The types stand here so that a reader needs no `OpenCV`. Meanings, units and frames are documented in `docs/capture-format.md`. Lengths
//! are mm, angles degrees (keys end in `_deg`), colours linear RGB with sRGB primaries.

use crate::error::{BadInput, Error, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the file that this program writes and reads.
pub const FORMAT: u32 = 1;
/// First words of `creator` in a file of this program.
pub const CREATOR: &str = "biscale capture";
/// Name of the file in its folder.
pub const FILE_NAME: &str = "capture.json";
/// Most bytes of a file.
const MAX_BYTES: u64 = 1 << 26;

/// The whole file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Capture {
    /// `biscale capture` and its version.
    pub creator: String,
    /// [`FORMAT`].
    pub format: u32,
    /// Name of the shoot.
    pub name: String,
    /// The shoot file that was read.
    pub shoot: String,
    /// False where a check failed: a number here may be wrong or missing.
    pub usable: bool,
    /// The camera of all linear photographs that have none of their own.
    pub camera: Option<Camera>,
    /// What was photographed.
    pub sample: Sample,
    /// The lights, by name.
    pub lights: Vec<Light>,
    /// Linear photographs, in the order of the shoot file.
    pub photographs: Vec<Photograph>,
    /// Colour correction, if a checker was photographed.
    pub colour: Option<Colour>,
    /// Relative light falloff towards the corners that was divided out.
    pub flat_field: Option<FlatField>,
    /// What was found in the close-up.
    pub close_up: Option<CloseUp>,
    /// Material file with the guess from the close-up, in this folder.
    pub material: Option<String>,
    /// Every check that was made.
    pub checks: Vec<Check>,
}

/// A pinhole: the written photographs are undistorted. A pixel's centre has whole coordinates, (0, 0) in the upper left pixel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Camera {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Focal length across, px.
    pub fx: f64,
    /// Focal length down, px.
    pub fy: f64,
    /// Principal point, px.
    pub cx: f64,
    /// Principal point, px.
    pub cy: f64,
    /// Radial and tangential distortion of the camera itself (`k1, k2, p1, p2, k3`), which was removed.
    pub distortion: [f64; 5],
    /// Standard deviations of `fx, fy, cx, cy, k1, k2, p1, p2, k3`; of a camera that was given: none.
    pub sigma: Option<[f64; 9]>,
    /// `calibrated` or `given`.
    pub source: String,
    /// Reprojection error, RMS over all points, px.
    pub rms_px: Option<f64>,
    /// Views that took part.
    pub views: u32,
    /// Files of views that were dropped.
    pub dropped: Vec<String>,
    /// Share of a 10 x 10 grid over the picture that corners fell into.
    pub coverage: Option<f64>,
}

/// The shape of the sample; its frame is described in `docs/capture-format.md`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Sample {
    /// Flat, in z = 0, the origin in its middle, x to the right, y up.
    Plane {
        /// Along x, mm.
        width_mm: f64,
        /// Along y, mm.
        height_mm: f64,
    },
    /// The side of a cylinder around z, the origin in the middle of its axis.
    Cylinder {
        /// Of the outer surface, mm.
        radius_mm: f64,
        /// Along z, mm.
        height_mm: f64,
        /// Part that is covered, counter-clockwise from +x seen from +z, degrees.
        arc_deg: [f64; 2],
    },
}

/// One light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Light {
    /// Name that photographs refer to.
    pub name: String,
    /// Unit vector towards the light in the sample's frame.
    pub direction: [f64; 3],
    /// Standard deviation of the direction, degrees.
    pub sigma_deg: f64,
    /// Place of a lamp at a finite distance, in the sample's frame, mm; `direction` is that from the origin. None of one that counts as far away.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_mm: Option<[f64; 3]>,
    /// Irradiance on a plane facing the light, in the photographs' units; where a checker in the sample's plane tells it.
    pub irradiance_rgb: Option<[f64; 3]>,
    /// What the direction was found from.
    pub sources: Vec<LightSource>,
    /// Largest angle between two sources, degrees.
    pub disagreement_deg: Option<f64>,
}

/// One estimate of a light's direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LightSource {
    /// `mirror-ball`, `stick` or `given`.
    pub kind: String,
    /// The photograph, if one.
    pub photograph: Option<String>,
    /// Unit vector towards the light in the sample's frame.
    pub direction: [f64; 3],
    /// Standard deviation, degrees.
    pub sigma_deg: f64,
}

/// From the sample's frame to the camera's: `X_camera = rotation X_sample + translation`; the camera looks along z, x right, y down.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Rows of the rotation.
    pub rotation: [[f64; 3]; 3],
    /// Translation, mm.
    pub translation_mm: [f64; 3],
    /// Standard deviation of the rotation, degrees, about the camera's axes.
    pub sigma_deg: [f64; 3],
    /// Standard deviation of the translation, mm.
    pub sigma_mm: [f64; 3],
    /// Reprojection error, RMS, px.
    pub rms_px: f64,
    /// Points that it rests on.
    pub points: u32,
}

/// A linear photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Photograph {
    /// `OpenEXR` file in this folder: undistorted, linear RGB in 32-bit floats.
    pub file: String,
    /// Its camera, where that is not the one of all: taken through another lens, or at another size.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<Camera>,
    /// Grey PNG of the same size: 255 use it, 0 do not (off the sample, saturated, outside of the picture).
    pub mask: String,
    /// The photographs that it was made from.
    pub sources: Vec<String>,
    /// `close-up`, `distant` or `validation`.
    pub role: String,
    /// How exposure was taken out; `None` where the files do not say.
    pub exposure: Option<Exposure>,
    /// Noise of a value `v`: variance `a + b v`, a row a channel.
    pub noise: Noise,
    /// Where the sample is.
    pub pose: Option<Pose>,
    /// Name of the light.
    pub light: Option<String>,
    /// Share of the sample's pixels that are saturated.
    pub saturated: f64,
}

/// Exposure of a photograph: written values are those of the sensor (0 to 1) over `seconds * gain * aperture area`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exposure {
    /// Shutter times of all brackets.
    pub seconds: Vec<f64>,
    /// ISO over 100.
    pub gain: f64,
    /// F-number.
    pub f_number: Option<f64>,
    /// What a sensor value of 0..1 was divided by, beside flat field and colour.
    pub divisor: f64,
}

/// Variance `a + b v` of a value `v` of a written photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Read noise and quantisation, by channel.
    pub a: [f64; 3],
    /// Shot noise, by channel.
    pub b: [f64; 3],
    /// `measured`, `given` or `assumed`.
    pub source: String,
}

/// Linear colour correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Colour {
    /// Rows of the matrix that camera RGB was multiplied by; with it a white surface at the checker's place has the value 1.
    pub matrix: [[f64; 3]; 3],
    /// `checker` or `sheet`.
    pub source: String,
    /// CIE Delta E 2000 of each patch after correction.
    pub delta_e: Vec<f64>,
    /// Their mean.
    pub mean_delta_e: f64,
    /// The light that the checker was under.
    pub light: Option<String>,
}

/// Falloff of light towards the corners.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FlatField {
    /// `divide` or `radial`.
    pub method: String,
    /// `V(r) = 1 + b r^2 + c r^4 + d r^6`, `r` = 1 at the farthest corner from the principal point.
    pub radial: [f64; 3],
    /// Smallest value of the fit in the picture.
    pub darkest: f64,
    /// RMS of what the radial fit leaves.
    pub residual: f64,
}

/// The close-up, rectified.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloseUp {
    /// Rectified linear `OpenEXR` in this folder, row 0 at the largest y.
    pub file: String,
    /// Size of a pixel, mm; none where the close-up shows no markers.
    pub mm_per_px: Option<f64>,
    /// The lower left corner in the sample's frame (on a cylinder: along the arc and along the axis), mm.
    pub origin_mm: [f64; 2],
    /// What the weave analysis found; its schema is that of `docs/weave-analysis.md`.
    pub weave: Option<serde_json::Value>,
}

/// Weight of a check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Within its threshold.
    Ok,
    /// Worth knowing.
    Warn,
    /// The result is not to be trusted.
    Fail,
}

/// One check.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Name from the catalogue of `docs/capture.md`.
    pub code: String,
    /// Its weight.
    pub severity: Severity,
    /// What was found and what to do about it.
    pub message: String,
    /// What was measured.
    pub measured: Option<f64>,
    /// What it was compared with.
    pub threshold: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// The photograph, if it is about one.
    pub photograph: Option<String>,
}

impl Capture {
    /// Reads `capture.json` of a folder (or the file itself).
    ///
    /// # Errors
    /// A missing or wrong file, another format.
    ///
    /// ```
    /// use biscale::formats::capture::Capture;
    ///
    /// // A file that is none is refused by its place.
    /// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
    /// let error = Capture::read(path.as_ref()).unwrap_err();
    /// assert!(error.to_string().contains("pyramids.toml"), "{error}");
    /// ```
    pub fn read(path: &Path) -> Result<Self> {
        let file = if path.is_dir() { path.join(FILE_NAME) } else { path.to_path_buf() };
        let bytes = crate::bounded_file::read_bounded(&file, MAX_BYTES, "name the folder that `biscale capture` wrote")?;
        let bad = |problem: String| Error::from(BadInput::new(problem, "name the folder that `biscale capture` wrote").in_file(&file));
        let value: serde_json::Value = serde_json::from_slice(&bytes).map_err(|e| bad(format!("this is not JSON: {e}")))?;
        match value.get("format").and_then(serde_json::Value::as_u64) {
            Some(f) if f == u64::from(FORMAT) => {}
            Some(other) => return Err(bad(format!("format {other} is not known; this version reads {FORMAT}"))),
            None => return Err(bad("there is no `format`".into())),
        }
        serde_json::from_value(value).map_err(|e| bad(format!("this is not a capture.json: {e}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_and_other_files_are_refused() {
        let capture = Capture {
            creator: format!("{CREATOR} 0"),
            format: FORMAT,
            name: "n".into(),
            shoot: "s.toml".into(),
            usable: true,
            camera: None,
            sample: Sample::Cylinder { radius_mm: 15.0, height_mm: 100.0, arc_deg: [0.0, 360.0] },
            lights: Vec::new(),
            photographs: Vec::new(),
            colour: None,
            flat_field: None,
            close_up: None,
            material: None,
            checks: Vec::new(),
        };
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(FILE_NAME);
        std::fs::write(&file, serde_json::to_vec(&capture).unwrap()).unwrap();
        assert_eq!(Capture::read(folder.path()).unwrap(), capture);
        assert_eq!(Capture::read(&file).unwrap(), capture);
        for (text, word) in
            [("{}", "no `format`"), ("[", "not JSON"), ("{\"format\": 2}", "format 2"), ("{\"format\": 1}", "not a capture.json")]
        {
            std::fs::write(&file, text).unwrap();
            let message = Capture::read(folder.path()).unwrap_err().to_string();
            assert!(message.contains(word) && message.contains("biscale capture"), "{text}: {message}");
        }
    }
}
