//! Photographs of the sample: registered, checked, written.

use super::calibration::share;
use super::read::Shot;
use super::register::{Falloffs, Registered};
use super::session::{Session, name_of};
use super::write;
use crate::checks::{CLIPPED, CheckCode, Reading, UNDEREXPOSED_FAIL, UNDEREXPOSED_WARN};
use crate::lens::Lens;
use crate::linear::LinearPhoto;
use crate::noise;
use crate::photo::{PlanarImage, Samples};
use crate::pose::PoseEstimate;
use crate::report::{Mark, PhotoView};
use crate::resample;
use crate::shoot::{PhotoSpec, Role};
use biscale::error::Result;
use biscale::formats::capture::{self, CloseUp, Light, Photograph, Severity};
use biscale::numerics::cast::narrow;
use biscale::numerics::statistics::rank;
use glam::{DMat3, DVec2};
use rayon::prelude::*;

/// The mask ends this many pixels inside of the sample's outline: an interpolated pixel mixes its neighbours.
const MASK_BORDER_PX: usize = 1;
/// Pixels that the exposure check looks at, at most: enough for a percentile, and quick in a photograph of 50 megapixels.
const EXPOSURE_SAMPLES: usize = 200_000;
/// Percentile of the sample's values that tells its exposure ([`UNDEREXPOSED_WARN`]): highlights above it are few.
const BRIGHT_PERCENTILE: f64 = 0.95;
/// The material file that is written from a close-up.
const MATERIAL: &str = "guess.toml";

/// What came of the sample's photographs.
#[derive(Default)]
pub(super) struct SampleResults {
    pub photographs: Vec<Photograph>,
    pub close_up: Option<CloseUp>,
    pub material: Option<String>,
}

impl Session<'_> {
    /// All photographs of the sample.
    pub(super) fn samples(&mut self, lights: &[Light]) -> Result<SampleResults> {
        let shoot = self.shoot;
        let mut results = SampleResults::default();
        for role in [Role::CloseUp, Role::Distant, Role::Validation] {
            for (k, spec) in shoot.of_role(role).enumerate() {
                let stem = if k == 0 { role.name().to_owned() } else { format!("{}-{}", role.name(), k + 1) };
                if let Some(shot) = self.shot(spec)? {
                    self.one_sample(spec, shot, &stem, lights, &mut results)?;
                }
                self.step("photographs")?;
            }
        }
        // In the order of the shoot file.
        let place = |p: &Photograph| shoot.photos.iter().position(|s| p.sources.first() == s.files.first().map(|f| name_of(f)).as_ref());
        results.photographs.sort_by_key(place);
        Ok(results)
    }

    /// Registers, checks, corrects and writes one photograph of the sample.
    fn one_sample(&mut self, spec: &PhotoSpec, shot: Shot, stem: &str, lights: &[Light], results: &mut SampleResults) -> Result<()> {
        let name = shot.name.clone();
        let (mut shot, registered) = self.place(spec, shot, Falloffs::Divided, true)?;
        let mut view = PhotoView::new(&name, spec.role.name(), &shot.linear.picture, Some(&shot.linear.saturated), false);
        self.light_of_sample(spec, &name, lights);
        let shape = self.shoot.sample.shape;
        if let Some(r) = &registered {
            view.marks.extend(r.marks.iter().cloned());
            view.marks.push(Mark::Outline(resample::outline(&shape, &r.found.pose, &r.lens), "sample"));
            describe_pose(&mut view, &r.found);
        }
        let lens = registered.as_ref().map(|r| r.lens).or(self.groups[shot.group].lens);
        let mask = match (&registered, lens) {
            (Some(r), Some(lens)) => resample::sample_mask(&shape, &r.found.pose, &lens.pinhole(), MASK_BORDER_PX),
            _ => vec![true; shot.linear.picture.width * shot.linear.picture.height],
        };
        let clipped = self.exposure_checks(&name, &shot, &mask);
        view.row("saturated", format!("{:.3} % of the sample", 100.0 * clipped));
        let matrix = self.matrix().map(|c| c.matrix);
        if let Some(m) = matrix {
            multiply(&mut shot.linear.picture, m);
        }
        let sensor = self.groups[shot.group].sensor.unwrap_or_else(|| noise::of_camera(&self.shoot.camera, shot.gain, shot.samples));
        let noise = sensor.written(shot.linear.divisor, shot.brackets, matrix);
        if spec.role == Role::CloseUp && results.close_up.is_none() {
            (results.close_up, results.material) = self.close_up(spec, &shot, stem, registered.as_ref(), &mut view)?;
        }
        let camera = self.groups[shot.group].camera.clone();
        let Shot { linear, exposure, .. } = shot;
        let (file, mask_file) = self.write_undistorted(linear, lens, &mask, stem, &mut view)?;
        self.report.views.push(view);
        results.photographs.push(Photograph {
            file,
            camera,
            mask: mask_file,
            sources: spec.files.iter().map(|f| name_of(f)).collect(),
            role: spec.role.name().into(),
            exposure,
            noise,
            pose: registered.map(|r| written_pose(&r.found)),
            light: lights.iter().any(|l| l.name == spec.light).then(|| spec.light.clone()),
            saturated: clipped,
        });
        Ok(())
    }

    /// Writes a photograph without distortion and the mask of its usable pixels; returns the names of both files.
    fn write_undistorted(
        &self,
        photo: LinearPhoto,
        lens: Option<Lens>,
        mask: &[bool],
        stem: &str,
        view: &mut PhotoView,
    ) -> Result<(String, String)> {
        let size = (photo.picture.width, photo.picture.height);
        let undistorted = match lens {
            Some(lens) => resample::undistort(photo.picture, &photo.saturated, &lens),
            None => resample::Masked { good: photo.saturated.iter().map(|s| !s).collect(), picture: photo.picture },
        };
        let (file, mask_file) = (format!("{stem}.exr"), format!("{stem}-mask.png"));
        let keep: Vec<bool> = mask.iter().zip(&undistorted.good).map(|(a, b)| *a && *b).collect();
        view.row("pixels to use", format!("{}", keep.iter().filter(|k| **k).count()));
        write::mask(&keep, size, &self.folder.join(&mask_file))?;
        write::exr(undistorted.picture, &self.folder.join(&file), &view.title)?;
        Ok((file, mask_file))
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
        self.checks.add(CheckCode::LightNotFound, severity, Some(name), message);
    }

    /// Saturation and exposure, of the sample's pixels (the mask is that of the undistorted picture: near enough). Returns the saturated share.
    fn exposure_checks(&mut self, name: &str, shot: &Shot, mask: &[bool]) -> f64 {
        let of_sample: Vec<bool> = shot.linear.saturated.iter().zip(mask).filter(|(_, m)| **m).map(|(s, _)| *s).collect();
        if of_sample.is_empty() {
            return 0.0;
        }
        let clipped = share(&of_sample);
        let bad = "pixels of the sample are saturated and masked out: expose less, or add a shorter bracket";
        self.checks.limit(
            CheckCode::Clipped,
            Reading::of(name, clipped, "share of the sample"),
            CLIPPED,
            "nearly nothing is saturated",
            bad,
        );
        if shot.samples != Samples::Float {
            let [r, g, b] = &shot.linear.picture.planes;
            let step = (of_sample.len() / EXPOSURE_SAMPLES).max(1);
            let mut values: Vec<f32> =
                mask.iter().enumerate().filter(|(_, m)| **m).map(|(i, _)| r[i].max(g[i]).max(b[i])).step_by(step).collect();
            // The sensor's value in the longest bracket.
            let bright = f64::from(rank(&mut values, BRIGHT_PERCENTILE).unwrap_or(0.0)) * shot.linear.divisor;
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
            self.checks.valued(
                CheckCode::Underexposed,
                severity,
                Reading::of(name, bright, "of the scale (95th percentile)"),
                threshold,
                message,
            );
        }
        clipped
    }

    /// Rectifies, analyses and writes a close-up; returns what is known of it, and the name of the material file if one was written.
    fn close_up(
        &mut self,
        spec: &PhotoSpec,
        shot: &Shot,
        stem: &str,
        registered: Option<&Registered>,
        view: &mut PhotoView,
    ) -> Result<(Option<CloseUp>, Option<String>)> {
        let (linear, name) = (&shot.linear, &shot.name);
        let (picture, good, mm_per_px, origin) = if let Some(r) = registered {
            let shape = self.shoot.sample.shape;
            let Some(out) = resample::rectify(&linear.picture, &linear.saturated, &r.lens, &r.found.pose, &shape) else {
                let message = "the close-up does not show the sample where its markers say it is";
                self.checks.add(CheckCode::NoScale, Severity::Fail, Some(name), message);
                return Ok((None, None));
            };
            view.row("pixel on the sample", format!("{:.5} mm", out.mm_per_px));
            (out.masked.picture, out.masked.good, Some(out.mm_per_px), out.origin)
        } else {
            if spec.mm_per_px.is_none() {
                let message = "nothing tells how large the close-up is: periods are in pixels; let it show a marker, or write `mm_per_px`";
                self.checks.add(CheckCode::NoScale, Severity::Warn, Some(name), message);
            }
            let good = linear.saturated.iter().map(|s| !s).collect();
            (linear.picture.clone(), good, spec.mm_per_px, DVec2::ZERO)
        };
        let file = format!("{stem}-rectified.exr");
        self.report.close_up(&picture, mm_per_px);
        let small = self.small_scale(&picture, &good, mm_per_px, name)?;
        let material = match small.material {
            Some(text) => {
                write::bytes(text.as_bytes(), &self.folder.join(MATERIAL))?;
                Some(MATERIAL.to_owned())
            }
            None => None,
        };
        write::exr(picture, &self.folder.join(&file), name)?;
        Ok((Some(CloseUp { file, mm_per_px, origin_mm: origin.to_array(), weave: small.described }), material))
    }
}

fn multiply(picture: &mut PlanarImage, m: DMat3) {
    let rows = m.transpose().to_cols_array_2d();
    let rows = rows.map(|r| r.map(narrow));
    let [r, g, b] = &mut picture.planes;
    r.par_iter_mut().zip(g).zip(b).for_each(|((r, g), b)| {
        let v = [*r, *g, *b];
        let of = |row: [f32; 3]| row[0] * v[0] + row[1] * v[1] + row[2] * v[2];
        (*r, *g, *b) = (of(rows[0]), of(rows[1]), of(rows[2]));
    });
}

fn describe_pose(view: &mut PhotoView, found: &PoseEstimate) {
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

fn written_pose(found: &PoseEstimate) -> capture::Pose {
    capture::Pose {
        rotation: found.pose.rotation.transpose().to_cols_array_2d(),
        translation_mm: found.pose.translation.into(),
        sigma_deg: found.sigma_turn.map(f64::to_degrees).into(),
        sigma_mm: found.sigma_shift.into(),
        rms_px: found.rms_px,
        points: u32::try_from(found.used.iter().filter(|u| **u).count()).unwrap_or(u32::MAX),
    }
}
