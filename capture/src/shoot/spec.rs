//! What a shoot file says, as types.

use crate::board::Board;
use crate::lens::Lens;
use crate::sheet::Sheet;
use glam::{DVec2, DVec3};
use std::path::PathBuf;

/// A whole shoot file.
#[derive(Clone, Debug)]
pub struct Shoot {
    /// The file.
    pub file: PathBuf,
    /// Its name.
    pub name: String,
    /// What is known of the camera.
    pub camera: CameraSpec,
    /// The calibration board.
    pub board: Option<Board>,
    /// What is photographed.
    pub sample: SampleSpec,
    /// The normal of the colour checker in the sample's frame, if it is known.
    pub checker_normal: Option<DVec3>,
    /// Lights with a direction that is given.
    pub lights: Vec<LightSpec>,
    /// The photographs.
    pub photos: Vec<PhotoSpec>,
}

/// What is known of the camera.
#[derive(Clone, Debug)]
pub struct CameraSpec {
    /// Focal lengths, principal point and distortion, in place of a calibration.
    pub given: Option<GivenLens>,
    /// Sensor value without light, of the full scale of 1.
    pub black: f64,
    /// Value from which on a pixel counts as saturated; without it [`SATURATION`] of the full scale, and for floats, which have none, never.
    pub saturation: Option<f64>,
    /// The user says that the values are linear, whatever the file says.
    pub linear: bool,
    /// Electrons of a full pixel at ISO 100.
    pub full_well_e: Option<f64>,
    /// Read noise, electrons.
    pub read_noise_e: Option<f64>,
    /// How the flat field is used.
    pub flat: FlatMethod,
}

impl Default for CameraSpec {
    /// One of which nothing is known.
    fn default() -> Self {
        Self { given: None, black: 0.0, saturation: None, linear: false, full_well_e: None, read_noise_e: None, flat: FlatMethod::Radial }
    }
}

/// Share of the full scale from which on a pixel counts as saturated.
pub const SATURATION: f64 = 0.98;

/// A lens that is given; sizes come from the photographs.
#[derive(Clone, Copy, Debug)]
pub struct GivenLens {
    pub(super) focal: DVec2,
    pub(super) focal_over_width: Option<f64>,
    pub(super) centre: Option<DVec2>,
    pub(super) distortion: [f64; 5],
}

impl GivenLens {
    /// The lens for photographs of a size.
    pub fn lens(&self, width: usize, height: usize) -> Lens {
        let middle = 0.5 * DVec2::new((width - 1) as f64, (height - 1) as f64);
        let focal = self.focal_over_width.map_or(self.focal, |f| DVec2::splat(f * width as f64));
        Lens { width, height, focal, centre: self.centre.unwrap_or(middle), distortion: self.distortion }
    }
}

/// How the flat field is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlatMethod {
    /// Divide by the photograph, smoothed.
    Divide,
    /// Divide by the radial polynomial that fits it.
    Radial,
}

/// What is photographed, and how it is found.
#[derive(Clone, Debug)]
pub struct SampleSpec {
    /// Its shape; lengths in mm.
    pub shape: Shape,
    /// What registers it.
    pub on: Registration,
    /// Height of its surface over the markers, mm.
    pub offset: f64,
    /// What is expected in the close-up.
    pub kind: SurfaceKind,
}

/// A shape of the sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// Flat: width and height.
    Plane(DVec2),
    /// Side of a cylinder.
    Cylinder {
        /// Radius of the outer surface.
        radius: f64,
        /// Along the axis.
        height: f64,
        /// Covered part, degrees from +x.
        arc_deg: [f64; 2],
    },
}

/// Where markers are.
#[derive(Clone, Debug)]
pub enum Registration {
    /// On the sheet that the sample is glued onto.
    Sheet(Box<Sheet>),
    /// The sample lies on the calibration board, its middle at this place.
    Board(DVec2),
    /// Nothing: every photograph says where the camera stands.
    None,
}

/// What is expected in the close-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfaceKind {
    /// Threads.
    Weave,
    /// Parallel grooves or pyramids.
    Relief,
    /// Nothing is looked for.
    Other,
}

/// A light with a known direction.
#[derive(Clone, Debug)]
pub struct LightSpec {
    /// Its name.
    pub name: String,
    /// Unit vector towards it from the origin, in the sample's frame.
    pub direction: DVec3,
    /// Its place, mm, of a lamp that is near.
    pub position: Option<DVec3>,
    /// How well it is known, degrees.
    pub sigma_deg: f64,
}

/// What a photograph is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A view of the calibration board.
    Board,
    /// An even surface in even light.
    Flat,
    /// A colour checker of 24 patches.
    Checker,
    /// A mirror ball, or a stick and its shadow.
    Light,
    /// Near enough to see the small-scale surface.
    CloseUp,
    /// Far enough to see its average.
    Distant,
    /// The same as `Distant`, kept back to test a fit.
    Validation,
}

/// The names of roles in files.
pub const ROLES: [(&str, Role); 7] = [
    ("board", Role::Board),
    ("flat", Role::Flat),
    ("checker", Role::Checker),
    ("light", Role::Light),
    ("close-up", Role::CloseUp),
    ("distant", Role::Distant),
    ("validation", Role::Validation),
];

impl Role {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        ROLES.iter().find(|r| r.1 == self).map_or("", |r| r.0)
    }

    /// Whether a linear photograph is written of it.
    pub fn is_sample(self) -> bool {
        matches!(self, Self::CloseUp | Self::Distant | Self::Validation)
    }
}

/// One entry of the list.
#[derive(Clone, Debug)]
pub struct PhotoSpec {
    /// Its line in the shoot file.
    pub line: usize,
    /// What it is for.
    pub role: Role,
    /// The file, or the brackets of one view.
    pub files: Vec<PathBuf>,
    /// Shutter times, s; empty: what the files say.
    pub seconds: Vec<f64>,
    /// Sensitivity, ISO.
    pub iso: Option<f64>,
    /// F-number.
    pub f_number: Option<f64>,
    /// Name of the light.
    pub light: String,
    /// Name of the lens (or of its focus), where size and Exif do not tell it apart from others: board views of the same name calibrate it.
    pub lens: Option<String>,
    /// Corners of the checker, px: outer corners of the patches 1, 6, 24 and 19 (dark skin, bluish green, black, white).
    pub checker_px: Option<[DVec2; 4]>,
    /// The mirror ball's outline in the picture: middle and radius, px.
    pub ball_px: Option<[f64; 3]>,
    /// Highlight on the ball, px.
    pub highlight_px: Option<DVec2>,
    /// A stick that stands upright on the board or sheet.
    pub stick: Option<Stick>,
    /// Size of a pixel of a close-up without markers, mm.
    pub mm_per_px: Option<f64>,
    /// Where the camera stands in the sample's frame, what it looks at and what is up in its picture, where no marker tells.
    pub view: Option<[DVec3; 3]>,
}

/// A stick that throws a shadow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stick {
    /// Its foot in the sample's frame, mm.
    pub foot: DVec2,
    /// Its height over the plane of the foot, mm.
    pub height: f64,
    /// Its radius, mm: its shadow is longer by that.
    pub radius: f64,
    /// Tip of its shadow in the picture, px.
    pub shadow_px: Option<DVec2>,
}

impl Shoot {
    /// The photographs of a role.
    pub fn of_role(&self, role: Role) -> impl Iterator<Item = &PhotoSpec> {
        self.photos.iter().filter(move |p| p.role == role)
    }
}
