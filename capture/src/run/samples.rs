//! Photographs of the sample: registered, checked, written.

use super::calibration::share;
use super::read::Shot;
use super::{Session, name_of, write};
use crate::board::{Board, Kind};
use crate::checks::{CLIPPED, Code, PARTIAL, POSE, SCALE, UNDEREXPOSED_FAIL, UNDEREXPOSED_WARN, UNEVEN};
use crate::edge_pose;
use crate::edges::Grey;
use crate::lens::{Lens, Pose};
use crate::noise;
use crate::photo::{Picture, Samples};
use crate::pose::{self, Found, Sighting};
use crate::report::{Mark, View};
use crate::resample::{self, Rectified};
use crate::sheet::{Sheet, Target};
use crate::shoot::{PhotoSpec, Registration, Role, Shape, Shoot};
use crate::vision::{Gray, Luminance, board, percentile, pnp};
use biscale::error::Result;
use biscale::formats::capture::{self, CloseUp, Light, Photograph, Severity};
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// The guess from the close-up.
const MATERIAL: &str = "guess.toml";

/// What came of the sample's photographs.
#[derive(Default)]
pub(super) struct Made {
    pub photographs: Vec<Photograph>,
    pub close_up: Option<CloseUp>,
    pub material: Option<String>,
}

/// A photograph with its place.
struct Registered {
    found: Found,
    lens: Lens,
    marks: Vec<Mark>,
}

/// A place on a sheet's page in the sample's frame, and the outward normal there.
fn on_sheet(shoot: &Shoot, sheet: &Sheet, page: DVec2, scale: f64) -> (DVec3, DVec3) {
    let p = scale * sheet.unrolled(page);
    match (shoot.sample.shape, sheet.target) {
        (Shape::Cylinder { height, .. }, Target::Cylinder { radius, .. }) => {
            // The sheet's lengths are those at its outer side.
            let outer = radius + sheet.thickness;
            let (sin, cos) = (p.x / outer).sin_cos();
            let normal = DVec3::new(cos, sin, 0.0);
            // The sample's own height may be less than the sheet's: both have one middle.
            let _ = height;
            (outer * normal + DVec3::Z * (p.y - 0.5 * scale * sheet.extent.y), normal)
        }
        _ => ((p - 0.5 * scale * sheet.extent).extend(-shoot.sample.offset), DVec3::Z),
    }
}

/// Where a place of the sheet's page is in the camera's frame, if its front is seen.
pub(super) fn visible(shoot: &Shoot, sheet: &Sheet, page: DVec2, pose: &Pose) -> Option<DVec3> {
    let (point, normal) = on_sheet(shoot, sheet, page, 1.0);
    let view = pose.eye() - point;
    (normal.dot(view.normalize()) > 0.3).then(|| pose.to_camera(point))
}

impl Session<'_> {
    /// All photographs of the sample.
    pub(super) fn samples(&mut self, lights: &[Light]) -> Result<Made> {
        let shoot = self.shoot;
        let mut made = Made::default();
        for role in [Role::CloseUp, Role::Distant, Role::Validation] {
            for (k, spec) in shoot.of_role(role).enumerate() {
                let stem = if k == 0 { role.name().to_owned() } else { format!("{}-{}", role.name(), k + 1) };
                if let Some(shot) = self.shot(spec)? {
                    self.one_sample(spec, shot, &stem, lights, &mut made)?;
                }
                self.step("photographs")?;
            }
        }
        // In the order of the shoot file.
        let place = |p: &Photograph| shoot.photos.iter().position(|s| p.sources.first() == s.files.first().map(|f| name_of(f)).as_ref());
        made.photographs.sort_by_key(place);
        Ok(made)
    }

    fn one_sample(&mut self, spec: &PhotoSpec, mut shot: Shot, stem: &str, lights: &[Light], made: &mut Made) -> Result<()> {
        let name = shot.name.clone();
        if let Some(flat) = &self.flat {
            flat.divide(&mut shot.linear.picture);
        }
        let mut view = View::new(&name, spec.role.name(), &shot.linear.picture, Some(&shot.linear.saturated), false);
        let registered = self.register(spec, &name, &shot.linear.picture, true)?;
        self.light_of_sample(spec, &name, lights);
        let shape = shoot_shape(self.shoot);
        if let Some(r) = &registered {
            view.marks.extend(r.marks.iter().cloned());
            view.marks.push(Mark::Outline(resample::outline(&shape, &r.found.pose, &r.lens), "sample"));
            describe_pose(&mut view, &r.found);
        }
        let size = (shot.linear.picture.width, shot.linear.picture.height);
        let lens = registered.as_ref().map(|r| r.lens).or(self.lens);
        let mask = match (&registered, lens) {
            (Some(r), Some(lens)) => resample::sample_mask(&shape, &r.found.pose, &lens.pinhole(), 1),
            _ => vec![true; size.0 * size.1],
        };
        let clipped = self.exposure_checks(&name, &shot, &mask);
        view.row("saturated", format!("{:.3} % of the sample", 100.0 * clipped));
        let matrix = self.matrix().map(|c| c.matrix);
        if let Some(m) = matrix {
            multiply(&mut shot.linear.picture, m);
        }
        let sensor = self.sensor.unwrap_or_else(|| noise::of_camera(&self.shoot.camera, shot.gain, shot.samples));
        let noise = sensor.written(shot.linear.divisor, shot.brackets, matrix);
        if spec.role == Role::CloseUp && made.close_up.is_none() {
            made.close_up = self.close_up(spec, &shot, &name, stem, registered.as_ref(), &mut view, &mut made.material)?;
        }
        let Shot { linear, exposure, .. } = shot;
        let undistorted = match lens {
            Some(lens) => resample::undistort(linear.picture, &linear.saturated, &lens),
            None => resample::Masked { good: linear.saturated.iter().map(|s| !s).collect(), picture: linear.picture },
        };
        let file = format!("{stem}.exr");
        let mask_file = format!("{stem}-mask.png");
        let keep: Vec<bool> = mask.iter().zip(&undistorted.good).map(|(a, b)| *a && *b).collect();
        view.row("pixels to use", format!("{}", keep.iter().filter(|k| **k).count()));
        write::mask(&keep, size, &self.folder.join(&mask_file))?;
        write::exr(undistorted.picture, &self.folder.join(&file), &name)?;
        self.report.views.push(view);
        made.photographs.push(Photograph {
            file,
            mask: mask_file,
            sources: spec.files.iter().map(|f| name_of(f)).collect(),
            role: spec.role.name().into(),
            exposure,
            noise,
            pose: registered.map(|r| pose_of_found(&r.found)),
            light: lights.iter().any(|l| l.name == spec.light).then(|| spec.light.clone()),
            saturated: clipped,
        });
        Ok(())
    }

    /// A light must be known for what a fit reads.
    fn light_of_sample(&mut self, spec: &PhotoSpec, name: &str, lights: &[Light]) {
        if lights.iter().any(|l| l.name == spec.light) {
            return;
        }
        let severity = if spec.role == Role::CloseUp { Severity::Warn } else { Severity::Fail };
        let message = format!(
            "the direction of its light \"{}\" is not known: photograph a mirror ball or a stick under it, or give it as [[light]]",
            spec.light
        );
        self.checks.add(Code::LightNotFound, severity, Some(name), message);
    }

    /// Saturation and exposure, of the sample's pixels (the mask is that of the undistorted picture: near enough). Returns the saturated share.
    fn exposure_checks(&mut self, name: &str, shot: &Shot, mask: &[bool]) -> f64 {
        let of_sample: Vec<bool> = shot.linear.saturated.iter().zip(mask).filter(|(_, m)| **m).map(|(s, _)| *s).collect();
        if of_sample.is_empty() {
            return 0.0;
        }
        let clipped = share(&of_sample);
        let bad = "pixels of the sample are saturated and masked out: expose less, or add a shorter bracket";
        self.checks.limit(Code::Clipped, Some(name), clipped, CLIPPED, "share of the sample", "nearly nothing is saturated", bad);
        if shot.samples != Samples::Float {
            let [r, g, b] = &shot.linear.picture.planes;
            let step = (of_sample.len() / 200_000).max(1);
            let values = mask.iter().enumerate().filter(|(_, m)| **m).map(|(i, _)| r[i].max(g[i]).max(b[i])).step_by(step).collect();
            // The sensor's value in the longest bracket.
            let bright = f64::from(percentile(values, 0.95)) * shot.linear.divisor;
            let severity = if bright < UNDEREXPOSED_FAIL {
                Severity::Fail
            } else if bright < UNDEREXPOSED_WARN {
                Severity::Warn
            } else {
                Severity::Ok
            };
            let threshold = if severity == Severity::Fail { UNDEREXPOSED_FAIL } else { UNDEREXPOSED_WARN };
            let message = if severity == Severity::Ok {
                "well exposed"
            } else {
                "the sample is dark: noise and steps of the scale count; expose more"
            };
            self.checks.valued(Code::Underexposed, severity, Some(name), bright, threshold, "of the scale (95th percentile)", message);
        }
        clipped
    }

    /// Where the sample is, for those who need no more.
    pub(super) fn pose_of(&mut self, spec: &PhotoSpec, shot: &Shot) -> Result<Option<(Pose, Lens)>> {
        let registered = self.register(spec, &shot.name, &shot.linear.picture, false)?;
        Ok(registered.map(|r| (r.found.pose, r.lens)))
    }

    /// Finds the sample by its markers, or takes the view that is given; with checks of the markers if `thorough`.
    fn register(&mut self, spec: &PhotoSpec, name: &str, picture: &Picture, thorough: bool) -> Result<Option<Registered>> {
        let shoot = self.shoot;
        // A close-up may do without.
        let severity = if spec.role == Role::CloseUp { Severity::Warn } else { Severity::Fail };
        let Some(lens) = self.lens else {
            if !matches!(shoot.sample.on, Registration::None) || spec.view.is_some() {
                let message = "the camera is not known: photograph a board, or write `focal_px` under [camera]";
                self.checks.add(Code::CalibrationError, severity, Some(name), message);
            }
            return Ok(None);
        };
        if let Some([eye, target, up]) = spec.view {
            let pose = Pose::looking_at(eye, target, up);
            let found = Found { pose, sigma_turn: DVec3::ZERO, sigma_shift: DVec3::ZERO, rms_px: 0.0, used: Vec::new() };
            return Ok(Some(Registered { found, lens, marks: Vec::new() }));
        }
        let gray = Gray::of(picture, false);
        let layout;
        let layout = match (&shoot.sample.on, &shoot.board) {
            (Registration::Sheet(sheet), _) => {
                layout = Board::of_sheet(sheet);
                &layout
            }
            (Registration::Board(_), Some(board)) => board,
            _ => {
                if spec.role != Role::CloseUp {
                    let message = "nothing tells where the camera stood: name the `sheet` that the sample lies on, its place on the board (`board_mm`), or `eye` of the photograph";
                    self.checks.add(Code::BoardNotFound, severity, Some(name), message);
                }
                return Ok(None);
            }
        };
        let seen = board::detect(&gray, layout)?;
        if seen.corners.len() < pose::FEWEST {
            self.nothing_found(name, &gray, layout.dictionary.as_ref(), "a marker of the sample's sheet or board", severity)?;
            return Ok(None);
        }
        let place = |p: DVec2, scale: f64| match &shoot.sample.on {
            Registration::Sheet(sheet) => on_sheet(shoot, sheet, p, scale),
            Registration::Board(centre) => ((p - *centre).extend(-shoot.sample.offset), DVec3::Z),
            Registration::None => (DVec3::ZERO, DVec3::Z),
        };
        let sightings: Vec<Sighting> = seen.corners.iter().map(|c| Sighting { point: place(c.0, 1.0).0, pixel: c.1 }).collect();
        let Some(found) = pnp::pose(&sightings, &lens)? else {
            self.checks.add(Code::PoseError, severity, Some(name), "no place of the camera explains the markers");
            return Ok(None);
        };
        // The corners of a chessboard need no help; those of markers are biased.
        let found = if let (Kind::Markers, Some(dictionary)) = (layout.kind, &layout.dictionary) {
            let sides: Vec<[DVec2; 4]> = seen.markers.iter().filter_map(|m| board::marker_places(layout, m.0)).collect();
            let cells = dictionary.cells() as f64;
            edge_pose::refine(&found, &sightings, &lens, &Luminance(picture), &sides, cells, &|p| place(p, 1.0))
        } else {
            found
        };
        let mut marks: Vec<Mark> = seen.markers.iter().map(|m| Mark::Outline(m.1.to_vec(), "marker")).collect();
        marks.extend(seen.corners.iter().map(|c| Mark::Cross(c.1)));
        let bad = "markers are not where the shape says: is the sheet flat on its shape, and radius and distortion right?";
        // A share of the corners that had to be left out counts as well.
        let left_out = share(&found.used.iter().map(|u| !u).collect::<Vec<_>>());
        let measured = if left_out > 0.4 { f64::INFINITY } else { found.rms_px };
        let severity =
            self.checks.limit(Code::PoseError, Some(name), measured, POSE, "px (RMS)", "the markers are where the shape says", bad);
        if thorough && severity < Severity::Fail {
            let sides: Vec<[DVec2; 4]> = seen.markers.iter().map(|m| m.1).collect();
            self.sharpness(name, &Luminance(picture), &sides, layout.dictionary.as_ref());
            self.scale_of_cylinder(name, &seen, &found, &lens, &place);
            self.partial(name, layout, &seen, &found.pose, &lens, &place);
            self.even_light(name, layout, &seen, picture, &found.pose, &lens, &place);
        }
        Ok(Some(Registered { found, lens, marks }))
    }

    /// On a cylinder of known radius the size of the print is seen.
    fn scale_of_cylinder(
        &mut self,
        name: &str,
        seen: &board::Found,
        found: &Found,
        lens: &Lens,
        place: &dyn Fn(DVec2, f64) -> (DVec3, DVec3),
    ) {
        if !matches!(self.shoot.sample.shape, Shape::Cylinder { .. }) {
            return;
        }
        let used: Vec<(DVec2, DVec2)> = seen.corners.iter().zip(&found.used).filter(|(_, u)| **u).map(|(c, _)| *c).collect();
        let pixels: Vec<DVec2> = used.iter().map(|c| c.1).collect();
        let at = |k: f64| used.iter().map(|c| place(c.0, k).0).collect();
        if let Some((scale, sigma)) = pose::relative_scale(&found.pose, &pixels, lens, &at) {
            // Only what the markers can tell.
            if sigma < 0.01 {
                let bad = "the printed sheet is not as large as its sidecar says, for a cylinder of this radius: print at 100 %, measure the radius";
                let off = ((scale - 1.0).abs() - 2.0 * sigma).max(0.0);
                self.checks.limit(
                    Code::ScaleMismatch,
                    Some(name),
                    off,
                    SCALE,
                    "relative",
                    "the sheet has the size that its sidecar says",
                    bad,
                );
            }
        }
    }

    /// How many of the markers that should be seen are found.
    fn partial(
        &mut self,
        name: &str,
        layout: &Board,
        seen: &board::Found,
        pose: &Pose,
        lens: &Lens,
        place: &dyn Fn(DVec2, f64) -> (DVec3, DVec3),
    ) {
        if layout.markers.is_empty() {
            return;
        }
        let eye = pose.eye();
        let shown = |corners: &[DVec2; 4]| {
            let pixels: Vec<DVec2> = corners
                .iter()
                .filter_map(|c| {
                    let (point, normal) = place(*c, 1.0);
                    let faces = normal.dot((eye - point).normalize()) > 0.5;
                    let pixel = lens.project(pose.to_camera(point)).filter(|_| faces)?;
                    let inside = pixel.x > 3.0 && pixel.y > 3.0 && pixel.x < lens.width as f64 - 4.0 && pixel.y < lens.height as f64 - 4.0;
                    inside.then_some(pixel)
                })
                .collect();
            // Smaller ones cannot be read.
            pixels.len() == 4 && pixels[0].distance(pixels[2]) > 28.0
        };
        let expected = layout.markers.iter().filter(|m| shown(&m.1)).count().max(seen.markers.len());
        let found = seen.markers.len() as f64 / expected.max(1) as f64;
        let (severity, message) = if found < PARTIAL {
            (Severity::Warn, "most markers are hidden, in glare or unreadable")
        } else {
            (Severity::Ok, "the markers in view are found")
        };
        self.checks.valued(Code::BoardPartial, severity, Some(name), found, PARTIAL, "share of the markers in view", message);
    }

    /// The white around the markers of a flat sheet tells how even the light is.
    #[expect(clippy::too_many_arguments, reason = "what a registered photograph consists of")]
    fn even_light(
        &mut self,
        name: &str,
        layout: &Board,
        seen: &board::Found,
        picture: &Picture,
        pose: &Pose,
        lens: &Lens,
        place: &dyn Fn(DVec2, f64) -> (DVec3, DVec3),
    ) {
        if !matches!(self.shoot.sample.shape, Shape::Plane(_)) {
            return;
        }
        // Half way into the white around a marker.
        let white = match layout.kind {
            Kind::Charuco { square, marker, .. } => 0.25 * (square - marker),
            _ => 1.0,
        };
        let luminance = Luminance(picture);
        let mut values = Vec::new();
        for m in &seen.markers {
            let Some(corners) = board::marker_places(layout, m.0) else { continue };
            let middle = corners.iter().sum::<DVec2>() / 4.0;
            let around = (0..4).filter_map(|k| {
                let side = 0.5 * (corners[k] + corners[(k + 1) % 4]);
                let out = (side - middle).normalize();
                let pixel = |d: f64| lens.project(pose.to_camera(place(side + d * out, 1.0).0));
                let (a, b) = (pixel(0.0)?, pixel(white)?);
                // The blur of the edge must not reach it.
                (a.distance(b) >= 3.0).then(|| luminance.value(b))?
            });
            let mut around: Vec<f64> = around.collect();
            if around.len() >= 3 {
                around.sort_by(f64::total_cmp);
                values.push(around[around.len() / 2]);
            }
        }
        if values.len() < 4 {
            return;
        }
        let (low, high) = values.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
        let bad = "the paper around the markers is not lit evenly: move the lamp away, or photograph a flat field under it";
        self.checks.limit(
            Code::UnevenLight,
            Some(name),
            high / low - 1.0,
            UNEVEN,
            "brightest over darkest paper, less 1",
            "the paper is lit evenly",
            bad,
        );
    }

    /// The close-up straight on, and what is seen in it.
    #[expect(clippy::too_many_arguments, reason = "what one photograph consists of")]
    fn close_up(
        &mut self,
        spec: &PhotoSpec,
        shot: &Shot,
        name: &str,
        stem: &str,
        registered: Option<&Registered>,
        view: &mut View,
        material: &mut Option<String>,
    ) -> Result<Option<CloseUp>> {
        let (linear, shape) = (&shot.linear, shoot_shape(self.shoot));
        let rectified = match registered {
            Some(r) => {
                let Some(out) = resample::rectify(&linear.picture, &linear.saturated, &r.lens, &r.found.pose, &shape) else {
                    self.checks.add(
                        Code::NoScale,
                        Severity::Fail,
                        Some(name),
                        "the close-up does not show the sample where its markers say it is",
                    );
                    return Ok(None);
                };
                view.row("pixel on the sample", format!("{:.5} mm", out.mm_per_px));
                Some(out)
            }
            None => None,
        };
        let (picture, good, mm_per_px, origin) = match rectified {
            Some(Rectified { masked, mm_per_px, origin }) => (masked.picture, masked.good, Some(mm_per_px), origin),
            None => {
                if spec.mm_per_px.is_none() {
                    let message =
                        "nothing tells how large the close-up is: periods are in pixels; let it show a marker, or write `mm_per_px`";
                    self.checks.add(Code::NoScale, Severity::Warn, Some(name), message);
                }
                let good = linear.saturated.iter().map(|s| !s).collect();
                (linear.picture.clone(), good, spec.mm_per_px, DVec2::ZERO)
            }
        };
        let file = format!("{stem}-rectified.exr");
        self.report.close_up(&picture, mm_per_px);
        let small = self.small_scale(&picture, &good, mm_per_px, name)?;
        if let Some(text) = small.material {
            write::bytes(text.as_bytes(), &self.folder.join(MATERIAL))?;
            *material = Some(MATERIAL.to_owned());
        }
        write::exr(picture, &self.folder.join(&file), name)?;
        Ok(Some(CloseUp { file, mm_per_px, origin_mm: origin.to_array(), weave: small.described }))
    }
}

fn shoot_shape(shoot: &Shoot) -> Shape {
    shoot.sample.shape
}

fn multiply(picture: &mut Picture, m: DMat3) {
    let rows = m.transpose().to_cols_array_2d();
    #[expect(clippy::cast_possible_truncation, reason = "samples are f32")]
    let rows = rows.map(|r| r.map(|v| v as f32));
    let [r, g, b] = &mut picture.planes;
    r.par_iter_mut().zip(g).zip(b).for_each(|((r, g), b)| {
        let v = [*r, *g, *b];
        let of = |row: [f32; 3]| row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
        (*r, *g, *b) = (of(rows[0]), of(rows[1]), of(rows[2]));
    });
}

fn describe_pose(view: &mut View, found: &Found) {
    let (t, s) = (found.pose.translation, found.sigma_shift);
    let turn = found.sigma_turn.map(f64::to_degrees);
    view.row(
        "sample's origin",
        format!("({:.2}, {:.2}, {:.2}) +/- ({:.3}, {:.3}, {:.3}) mm from the camera", t.x, t.y, t.z, s.x, s.y, s.z),
    );
    view.row("rotation", format!("+/- ({:.3}, {:.3}, {:.3}) degrees", turn.x, turn.y, turn.z));
    if !found.used.is_empty() {
        view.row(
            "markers' corners",
            format!("{} of {} used, {:.3} px RMS", found.used.iter().filter(|u| **u).count(), found.used.len(), found.rms_px),
        );
    }
}

fn pose_of_found(found: &Found) -> capture::Pose {
    capture::Pose {
        rotation: found.pose.rotation.transpose().to_cols_array_2d(),
        translation_mm: found.pose.translation.into(),
        sigma_deg: found.sigma_turn.map(f64::to_degrees).into(),
        sigma_mm: found.sigma_shift.into(),
        rms_px: found.rms_px,
        points: u32::try_from(found.used.iter().filter(|u| **u).count()).unwrap_or(u32::MAX),
    }
}
