//! Where the sample is in a photograph: found by its markers, or as the shoot file gives it; with checks of the markers.

use super::calibration::share;
use super::read::Shot;
use super::session::Session;
use super::turned;
use crate::board::{Board, BoardKind};
use crate::checks::{CheckCode, PARTIAL, POSE, Reading, SCALE, UNEVEN};
use crate::edge_pose::{self, PrintedMarkers};
use crate::edges::GreyImage;
use crate::lens::{Lens, Pose};
use crate::lens_group::Turn;
use crate::photo::PlanarImage;
use crate::pose::{self, PoseEstimate, RelativeScale, Sighting};
use crate::report::Mark;
use crate::sheet::{Sheet, Target};
use crate::shoot::{PhotoSpec, Registration, Role, Shape, Shoot};
use crate::vision::board::DetectedBoard;
use crate::vision::{GreyImage8, Luminance, board, pnp};
use biscale::error::Result;
use biscale::formats::capture::Severity;
use biscale::numerics::statistics::upper_median;
use glam::{DVec2, DVec3};

/// A photograph whose pose is known.
pub(super) struct Registered {
    /// The pose and its uncertainty.
    pub found: PoseEstimate,
    /// The camera.
    pub lens: Lens,
    /// What the report draws over the photograph.
    pub marks: Vec<Mark>,
}

/// Whether falloff is to be divided out of a photograph.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Falloffs {
    Divided,
    Kept,
}

/// What a look for the sample ends with.
enum Placement {
    Found(Box<Registered>),
    NotFound,
    /// The pixels are turned by a half.
    HalfTurned,
}

/// Which checks of markers are made, and what is visible. All are chosen, not measured.
struct RegistrationParams {
    /// Cosine between normal and view below which a patch of a wrapped sheet counts as hidden: at 0.3 (72 degrees) a patch is foreshortened to a third.
    least_patch_cosine: f64,
    /// Share of the corners that robust fitting may leave out before the pose counts as wrong. Half would be a coin's toss between two poses.
    most_left_out: f64,
    /// Largest standard deviation of the print's relative size for which the size is judged: twice [`SCALE`]'s warning limit.
    scale_sigma: f64,
    /// Cosine between normal and view from which on a marker should be read (60 degrees).
    least_marker_cosine: f64,
    /// Distance from the border of the photograph from which on a marker should be read, px: detection needs the white around it.
    border_px: f64,
    /// Diagonal from which on a marker should be read, px: 28 px are about 3 px a cell of a marker of 7 cells.
    least_diagonal_px: f64,
    /// Fewest pixels from a marker's edge to the place where the paper is measured, so that the blur of the edge ([`crate::checks::BLURRY`]) does not reach it.
    clear_of_edge_px: f64,
    /// Distance from a marker's edge at which the paper of a sheet is measured, mm; a sheet has 2 mm of white around each marker.
    white_mm: f64,
    /// Fewest markers for a statement about even light.
    fewest_whites: usize,
}

const PARAMS: RegistrationParams = RegistrationParams {
    least_patch_cosine: 0.3,
    most_left_out: 0.4,
    scale_sigma: 0.01,
    least_marker_cosine: 0.5,
    border_px: 3.0,
    least_diagonal_px: 28.0,
    clear_of_edge_px: 3.0,
    white_mm: 1.0,
    fewest_whites: 4,
};

/// A point of a sheet's page in the sample's frame, and the outward normal there; `scale` is the size of the print over that of its sidecar.
fn on_sheet(shoot: &Shoot, sheet: &Sheet, page: DVec2, scale: f64) -> (DVec3, DVec3) {
    let p = scale * sheet.unrolled(page);
    match (shoot.sample.shape, sheet.target) {
        (Shape::Cylinder { .. }, Target::Cylinder { radius, .. }) => {
            // The sheet's lengths are those at its outer side.
            let outer = radius + sheet.thickness;
            let (sin, cos) = (p.x / outer).sin_cos();
            let normal = DVec3::new(cos, sin, 0.0);
            // The sample's own height may be less than the sheet's: both have one middle.
            (outer * normal + DVec3::Z * (p.y - 0.5 * scale * sheet.extent.y), normal)
        }
        _ => ((p - 0.5 * scale * sheet.extent).extend(-shoot.sample.offset), DVec3::Z),
    }
}

/// Where a point of the sheet's page is in the camera's frame, if its front is seen.
pub(super) fn visible(shoot: &Shoot, sheet: &Sheet, page: DVec2, pose: &Pose) -> Option<DVec3> {
    let (point, normal) = on_sheet(shoot, sheet, page, 1.0);
    let view = pose.eye() - point;
    (normal.dot(view.normalize()) > PARAMS.least_patch_cosine).then(|| pose.to_camera(point))
}

/// A point of the print that registers the sample, in the sample's frame, and the outward normal there.
fn on_print(shoot: &Shoot, print: DVec2, scale: f64) -> (DVec3, DVec3) {
    match &shoot.sample.on {
        Registration::Sheet(sheet) => on_sheet(shoot, sheet, print, scale),
        Registration::Board(centre) => ((print - *centre).extend(-shoot.sample.offset), DVec3::Z),
        Registration::None => (DVec3::ZERO, DVec3::Z),
    }
}

/// The markers of a registered photograph, as the checks see them.
struct SeenMarkers<'a> {
    name: &'a str,
    layout: &'a Board,
    seen: &'a DetectedBoard,
    found: &'a PoseEstimate,
    lens: &'a Lens,
}

impl Session<'_> {
    /// Divides a photograph by the falloff of its lens, if that is known.
    pub(super) fn divide(&self, shot: &mut Shot) {
        if let Some(flat) = &self.groups[shot.group].flat {
            flat.divide(&mut shot.linear.picture);
        }
    }

    /// Finds where the sample is in a photograph, with checks of the markers if `thorough`; one whose pixels are turned by a half is turned back.
    pub(super) fn place(
        &mut self,
        spec: &PhotoSpec,
        mut shot: Shot,
        falloffs: Falloffs,
        thorough: bool,
    ) -> Result<(Shot, Option<Registered>)> {
        if falloffs == Falloffs::Divided {
            self.divide(&mut shot);
        }
        match self.register(spec, &shot, thorough)? {
            Placement::Found(registered) => return Ok((shot, Some(*registered))),
            Placement::NotFound => return Ok((shot, None)),
            Placement::HalfTurned => {}
        }
        // The falloff was divided out the wrong way round: it is read anew.
        let Some(again) = self.quietly(|s| s.shot(spec))? else { return Ok((shot, None)) };
        let mut shot = again.half_turned();
        if shot.turn == Turn::None {
            self.checks.add(CheckCode::Turned, Severity::Warn, Some(&shot.name), turned::MESSAGE);
        }
        if falloffs == Falloffs::Divided {
            self.divide(&mut shot);
        }
        let placed = self.register(spec, &shot, thorough)?;
        Ok((shot, if let Placement::Found(registered) = placed { Some(*registered) } else { None }))
    }

    /// Finds the sample by its markers, or takes the view that is given; with checks of the markers if `thorough`.
    fn register(&mut self, spec: &PhotoSpec, shot: &Shot, thorough: bool) -> Result<Placement> {
        let (name, picture) = (&*shot.name, &shot.linear.picture);
        let shoot = self.shoot;
        // A close-up may do without.
        let severity = if spec.role == Role::CloseUp { Severity::Warn } else { Severity::Fail };
        let Some(lens) = self.groups[shot.group].lens else {
            if !matches!(shoot.sample.on, Registration::None) || spec.view.is_some() {
                let message = "the camera is not known: photograph a board, or write `focal_px` under [camera]";
                self.checks.add(CheckCode::CalibrationError, severity, Some(name), message);
            }
            return Ok(Placement::NotFound);
        };
        if let Some([eye, target, up]) = spec.view {
            let pose = Pose::looking_at(eye, target, up);
            return Ok(Placement::Found(Box::new(Registered { found: PoseEstimate::given(pose), lens, marks: Vec::new() })));
        }
        let of_sheet;
        let layout = match (&shoot.sample.on, &shoot.board) {
            (Registration::Sheet(sheet), _) => {
                of_sheet = Board::of_sheet(sheet);
                &of_sheet
            }
            (Registration::Board(_), Some(board)) => board,
            _ => {
                if spec.role != Role::CloseUp {
                    let message = "nothing tells where the camera stood: name the `sheet` that the sample lies on, its place on the board (`board_mm`), or `eye` of the photograph";
                    self.checks.add(CheckCode::BoardNotFound, severity, Some(name), message);
                }
                return Ok(Placement::NotFound);
            }
        };
        self.register_by_markers(name, picture, layout, &lens, severity, (shot.turn, thorough))
    }

    /// Finds the markers, then the pose by their corners and by their sides, then checks both. Without markers or pose a check of this severity says so.
    fn register_by_markers(
        &mut self,
        name: &str,
        picture: &PlanarImage,
        layout: &Board,
        lens: &Lens,
        severity: Severity,
        (turn, thorough): (Turn, bool),
    ) -> Result<Placement> {
        let shoot = self.shoot;
        let grey = GreyImage8::of(picture, false);
        let seen = board::detect(&grey, layout)?;
        if seen.corners.len() < pose::FEWEST {
            self.nothing_found(name, &grey, layout.dictionary.as_ref(), "a marker of the sample's sheet or board", severity)?;
            return Ok(Placement::NotFound);
        }
        let sightings: Vec<Sighting> = seen.corners.iter().map(|c| Sighting { point: on_print(shoot, c.0, 1.0).0, pixel: c.1 }).collect();
        let Some(found) = pnp::pose(&sightings, lens)? else {
            self.checks.add(CheckCode::PoseError, severity, Some(name), "no place of the camera explains the markers");
            return Ok(Placement::NotFound);
        };
        let half = turned::by_a_half(&sightings, lens, turn)?;
        if half.turned {
            return Ok(Placement::HalfTurned);
        }
        if !half.certain {
            let off = lens.centre.distance(lens.half_turned().centre);
            let message = format!(
                "which way round its pixels were turned by a quarter its markers hardly tell: if the other way, the lens's centre lies {off:.1} px away"
            );
            self.checks.add(CheckCode::Turned, Severity::Warn, Some(name), message);
        }
        // The corners of a chessboard need no help; those of markers are biased.
        let found = if let (BoardKind::Markers, Some(dictionary)) = (layout.kind, &layout.dictionary) {
            let corners: Vec<[DVec2; 4]> = seen.markers.iter().filter_map(|m| board::marker_places(layout, m.0)).collect();
            let markers = PrintedMarkers { corners: &corners, cells: dictionary.cells() as f64, place: &|p| on_print(shoot, p, 1.0) };
            edge_pose::refine(&found, &sightings, lens, &Luminance(picture), &markers)
        } else {
            found
        };
        let bad = "markers are not where the shape says: is the sheet flat on its shape, and radius and distortion right?";
        // A share of the corners that had to be left out counts as well.
        let left_out = share(&found.used.iter().map(|u| !u).collect::<Vec<_>>());
        let measured = if left_out > PARAMS.most_left_out { f64::INFINITY } else { found.rms_px };
        let reading = Reading::of(name, measured, "px (RMS)");
        let severity = self.checks.limit(CheckCode::PoseError, reading, POSE, "the markers are where the shape says", bad);
        self.checks.search(name, "where the camera stood", found.outcome, "show more of the markers, all around the sample, and in focus");
        if thorough && severity < Severity::Fail {
            let sides: Vec<[DVec2; 4]> = seen.markers.iter().map(|m| m.1).collect();
            self.sharpness(name, &Luminance(picture), &sides, layout.dictionary.as_ref());
            let markers = SeenMarkers { name, layout, seen: &seen, found: &found, lens };
            self.scale_of_cylinder(&markers);
            self.partial(&markers);
            self.even_light(&markers, picture);
        }
        let mut marks: Vec<Mark> = seen.markers.iter().map(|m| Mark::Outline(m.1.to_vec(), "marker")).collect();
        marks.extend(seen.corners.iter().map(|c| Mark::Cross(c.1)));
        Ok(Placement::Found(Box::new(Registered { found, lens: *lens, marks })))
    }

    /// Checks the size of the print, which a cylinder of known radius shows.
    fn scale_of_cylinder(&mut self, markers: &SeenMarkers<'_>) {
        let shoot = self.shoot;
        let SeenMarkers { name, seen, found, lens, .. } = *markers;
        if !matches!(shoot.sample.shape, Shape::Cylinder { .. }) {
            return;
        }
        let used: Vec<(DVec2, DVec2)> = seen.corners.iter().zip(&found.used).filter(|(_, u)| **u).map(|(c, _)| *c).collect();
        let pixels: Vec<DVec2> = used.iter().map(|c| c.1).collect();
        let at = |k: f64| used.iter().map(|c| on_print(shoot, c.0, k).0).collect();
        let Some(RelativeScale { scale, sigma, outcome }) = pose::relative_scale(&found.pose, &pixels, lens, &at) else { return };
        self.checks.search(name, "how large the sheet was printed", outcome, "show markers around more of the cylinder");
        if sigma < PARAMS.scale_sigma {
            let good = "the sheet has the size that its sidecar says";
            let bad =
                "the printed sheet is not as large as its sidecar says, for a cylinder of this radius: print at 100 %, measure the radius";
            let off = ((scale - 1.0).abs() - 2.0 * sigma).max(0.0);
            self.checks.limit(CheckCode::ScaleMismatch, Reading::of(name, off, "relative"), SCALE, good, bad);
        }
    }

    /// Checks how many of the markers that should be read were found.
    fn partial(&mut self, markers: &SeenMarkers<'_>) {
        let shoot = self.shoot;
        let SeenMarkers { name, layout, seen, found, lens } = *markers;
        if layout.markers.is_empty() {
            return;
        }
        let (pose, eye, border) = (&found.pose, found.pose.eye(), PARAMS.border_px);
        let (right, low) = (lens.width as f64 - 1.0 - border, lens.height as f64 - 1.0 - border);
        let shown = |corners: &[DVec2; 4]| {
            let pixels: Vec<DVec2> = corners
                .iter()
                .filter_map(|c| {
                    let (point, normal) = on_print(shoot, *c, 1.0);
                    let faces = normal.dot((eye - point).normalize()) > PARAMS.least_marker_cosine;
                    let pixel = lens.project(pose.to_camera(point)).filter(|_| faces)?;
                    let inside = pixel.x > border && pixel.y > border && pixel.x < right && pixel.y < low;
                    inside.then_some(pixel)
                })
                .collect();
            pixels.len() == 4 && pixels[0].distance(pixels[2]) > PARAMS.least_diagonal_px
        };
        let expected = layout.markers.iter().filter(|m| shown(&m.1)).count().max(seen.markers.len());
        let share = seen.markers.len() as f64 / expected.max(1) as f64;
        let (severity, message) = if share < PARTIAL {
            (Severity::Warn, "most markers are hidden, in glare or unreadable")
        } else {
            (Severity::Ok, "the markers in view are found")
        };
        self.checks.valued(CheckCode::BoardPartial, severity, Reading::of(name, share, "share of the markers in view"), PARTIAL, message);
    }

    /// Checks how even the light is, by the white paper around the markers of a flat sheet.
    fn even_light(&mut self, markers: &SeenMarkers<'_>, picture: &PlanarImage) {
        if !matches!(self.shoot.sample.shape, Shape::Plane(_)) {
            return;
        }
        let values = self.paper_around(markers, &Luminance(picture));
        if values.len() < PARAMS.fewest_whites {
            return;
        }
        let (low, high) = values.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
        let reading = Reading::of(markers.name, high / low - 1.0, "brightest over darkest paper, less 1");
        let bad = "the paper around the markers is not lit evenly: move the lamp away, or photograph a flat field under it";
        self.checks.limit(CheckCode::UnevenLight, reading, UNEVEN, "the paper is lit evenly", bad);
    }

    /// Luminance of the white around each marker: the median of the places beside its sides, of markers with at least three.
    fn paper_around(&self, markers: &SeenMarkers<'_>, luminance: &impl GreyImage) -> Vec<f64> {
        let SeenMarkers { layout, seen, found, lens, .. } = *markers;
        let white = match layout.kind {
            // Half way into the white around a marker.
            BoardKind::Charuco { square, marker, .. } => 0.25 * (square - marker),
            _ => PARAMS.white_mm,
        };
        let mut values = Vec::new();
        for m in &seen.markers {
            let Some(corners) = board::marker_places(layout, m.0) else { continue };
            let middle = corners.iter().sum::<DVec2>() / 4.0;
            let around = (0..4).filter_map(|k| {
                let side = 0.5 * (corners[k] + corners[(k + 1) % 4]);
                let out = (side - middle).normalize();
                let pixel = |d: f64| lens.project(found.pose.to_camera(on_print(self.shoot, side + d * out, 1.0).0));
                let (a, b) = (pixel(0.0)?, pixel(white)?);
                (a.distance(b) >= PARAMS.clear_of_edge_px).then(|| luminance.value(b))?
            });
            let mut around: Vec<f64> = around.collect();
            if around.len() >= 3 {
                values.extend(upper_median(&mut around));
            }
        }
        values
    }
}
