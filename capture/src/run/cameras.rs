//! The camera of every lens that the board was photographed through, or the one that is given.

use super::session::{LensGroup, Session, name_of};
use super::turned;
use crate::board::Board;
use crate::checks::{CheckCode, Reading, VIEWS};
use crate::lens::Lens;
use crate::lens_group::{LensKey, Turn};
use crate::photo::Samples;
use crate::pose::Sighting;
use crate::report::{Mark, PhotoView};
use crate::shoot::{PhotoSpec, Role, WIDE_DEG};
use crate::vision::calibrate::{self, BoardView, Calibration, FEWEST_CORNERS};
use crate::vision::{GreyImage8, board};
use biscale::error::Result;
use biscale::formats::capture::{Camera, Photograph, Severity};
use glam::DVec2;
use std::path::PathBuf;

/// Rounds of turning views back and calibrating anew. Chosen: the first turns those that differ from the rest, the second finds nothing.
const ROUNDS: usize = 3;

/// What a photograph of the board shows.
struct View {
    name: String,
    group: usize,
    turn: Turn,
    corners: BoardView,
}

impl Session<'_> {
    /// Calibrates every lens that board views were taken through, or takes the camera that is given.
    pub(super) fn cameras(&mut self) -> Result<()> {
        let shoot = self.shoot;
        let files: Vec<(&PhotoSpec, &PathBuf)> =
            shoot.of_role(Role::Board).flat_map(|spec| spec.files.iter().map(move |file| (spec, file))).collect();
        let Some(layout) = shoot.board.as_ref().filter(|_| !files.is_empty()) else {
            self.given_camera();
            return Ok(());
        };
        let views = self.board_views(&files, layout)?;
        let mut good = 0;
        for group in 0..self.groups.len() {
            let own: Vec<&View> = views.iter().filter(|v| v.group == group).collect();
            if !self.calibrate(group, &own)? {
                let seen = own.iter().filter(|v| v.corners.len() >= FEWEST_CORNERS).count();
                good = good.max(seen);
                if seen > 0 && self.groups.len() > 1 {
                    let message = format!(
                        "{seen} views of the board through one lens ({}) are too few to calibrate it",
                        self.groups[group].key.describe()
                    );
                    self.checks.add(CheckCode::TooFewViews, Severity::Warn, Some(&self.groups[group].first), message);
                }
            }
        }
        if self.groups.iter().all(|g| g.lens.is_none()) {
            if !self.groups.is_empty() {
                let message = format!("{good} views show the board well enough, too few to calibrate the camera; take more than {VIEWS}");
                let reading = Reading::of_shoot(good as f64, "views");
                self.checks.valued(CheckCode::TooFewViews, Severity::Fail, reading, f64::from(VIEWS), &message);
            }
            self.given_camera();
        }
        Ok(())
    }

    /// Calibrates one group; false if its views are too few. Views whose pixels are turned by a half are turned back.
    fn calibrate(&mut self, group: usize, own: &[&View]) -> Result<bool> {
        let names: Vec<String> = own.iter().map(|v| v.name.clone()).collect();
        let turns: Vec<Turn> = own.iter().map(|v| v.turn).collect();
        let mut views: Vec<BoardView> = own.iter().map(|v| v.corners.clone()).collect();
        let (width, height) = self.groups[group].key.size;
        let last = DVec2::new((width - 1) as f64, (height - 1) as f64);
        let Some(mut calibration) = calibrate::calibrate(&views, width, height)? else { return Ok(false) };
        let mut turned = vec![false; views.len()];
        for _ in 0..ROUNDS {
            let wrong = half_turned(&views, &turns, &calibration)?;
            // Which way most are is the frame of the group.
            if wrong.is_empty() || 2 * wrong.len() > views.len() {
                break;
            }
            for &k in &wrong {
                turned[k] = !turned[k];
                views[k].iter_mut().for_each(|c| c.1 = last - c.1);
            }
            let Some(again) = calibrate::calibrate(&views, width, height)? else { break };
            calibration = again;
        }
        for (view, _) in own.iter().zip(&turned).filter(|(v, t)| **t && v.turn == Turn::None) {
            self.checks.add(CheckCode::Turned, Severity::Warn, Some(&view.name), turned::MESSAGE);
        }
        self.calibration_checks(&calibration);
        let dropped = self.dropped_views(&calibration, &names, &views);
        let lens = calibration.lens;
        let used = calibration.used.iter().filter(|u| **u).count();
        let own = &mut self.groups[group];
        own.corners = views.iter().zip(&calibration.used).filter(|(_, u)| **u).flat_map(|(v, _)| v.iter().map(|c| c.1)).collect();
        own.lens = Some(lens);
        own.camera = Some(Camera {
            source: "calibrated".into(),
            sigma: Some(calibration.sigma),
            rms_px: Some(calibration.rms),
            views: u32::try_from(used).unwrap_or(u32::MAX),
            dropped,
            coverage: Some(calibration.coverage),
            ..describe(&lens)
        });
        Ok(true)
    }

    /// The corners that each readable photograph of the board shows.
    fn board_views(&mut self, files: &[(&PhotoSpec, &PathBuf)], layout: &Board) -> Result<Vec<View>> {
        let mut views = Vec::new();
        for (spec, file) in files {
            let name = name_of(file);
            let Some((photo, group, turn)) = self.photo(spec, file)? else {
                self.step("calibrating")?;
                continue;
            };
            let encoded = photo.samples != Samples::Float;
            let grey = GreyImage8::of(&photo.picture, encoded);
            let found = board::detect(&grey, layout)?;
            let mut view = PhotoView::new(&name, Role::Board.name(), &photo.picture, None, encoded);
            view.marks.extend(found.markers.iter().map(|m| Mark::Outline(m.1.to_vec(), "marker")));
            view.marks.extend(found.corners.iter().map(|c| Mark::Cross(c.1)));
            view.row("corners", format!("{} of {}", found.corners.len(), layout.count()));
            self.report.views.push(view);
            self.board_checks(&name, &grey, &found, layout)?;
            views.push(View { name, group, turn, corners: found.corners });
            self.step("calibrating")?;
        }
        Ok(views)
    }

    /// The camera that the shoot file gives, for photographs of the size of the first one of a sample.
    fn given_camera(&mut self) {
        let Some(given) = self.shoot.camera.given else { return };
        if self.groups.is_empty() {
            let spec = self.shoot.photos.iter().find(|p| p.role.is_sample()).or(self.shoot.photos.first());
            let Some((spec, file)) = spec.and_then(|s| Some((s, s.files.first()?))) else { return };
            let Ok(size) = crate::photo::size(file) else { return };
            let key = LensKey { name: spec.lens.clone(), size, ..LensKey::default() };
            self.groups.push(LensGroup { key, first: name_of(file), ..LensGroup::default() });
        }
        let (width, height) = self.groups[0].key.size;
        let lens = given.lens(width, height);
        if lens.field_of_view_deg() > WIDE_DEG {
            let message = "the given focal length means a field of view that few lenses have: is it in pixels of these photographs?";
            let reading = Reading::of_shoot(lens.field_of_view_deg(), "degrees across");
            self.checks.valued(CheckCode::CalibrationError, Severity::Warn, reading, WIDE_DEG, message);
        }
        self.groups[0].lens = Some(lens);
        self.groups[0].camera = Some(describe(&lens));
    }

    /// The camera that most of the work is about, the group that it is of, and the photographs: those through another lens keep their own camera.
    pub(super) fn written_cameras(&mut self, mut photographs: Vec<Photograph>) -> (Option<Camera>, usize, Vec<Photograph>) {
        let of_role = |role: Role| photographs.iter().find(|p| p.role == role.name() && p.camera.is_some());
        let chosen = of_role(Role::Distant).or_else(|| of_role(Role::CloseUp)).or_else(|| of_role(Role::Validation));
        let main = chosen.and_then(|p| p.camera.clone()).or_else(|| self.groups.iter().find_map(|g| g.camera.clone()));
        let group = self.groups.iter().position(|g| g.camera.is_some() && g.camera == main).unwrap_or(0);
        let mut others = Vec::new();
        for photo in &mut photographs {
            if photo.camera == main {
                photo.camera = None;
            } else if photo.camera.is_some() {
                others.push(photo.sources[0].clone());
            }
        }
        if !others.is_empty() {
            let message = format!(
                "{} were taken through another lens or at another size than the distant photograph: how bright they are beside it rests on what the files say of \
                 exposure and aperture",
                others.join(", ")
            );
            self.checks.add(CheckCode::SettingsChanged, Severity::Warn, None, message);
        }
        if let Some(own) = self.groups.get_mut(group) {
            self.report.corners = std::mem::take(&mut own.corners);
        }
        (main, group, photographs)
    }
}

/// Which views a camera explains decisively better when their pixels are turned by a half.
fn half_turned(views: &[BoardView], turns: &[Turn], calibration: &Calibration) -> Result<Vec<usize>> {
    let mut out = Vec::new();
    for (k, view) in views.iter().enumerate() {
        let sightings: Vec<Sighting> = view.iter().map(|c| Sighting { point: c.0.extend(0.0), pixel: c.1 }).collect();
        if turned::by_a_half(&sightings, &calibration.lens, turns[k])?.turned {
            out.push(k);
        }
    }
    Ok(out)
}

/// The same camera for a lens of another size; its standard deviations are of the other.
pub(super) fn with_lens(camera: &Camera, lens: &Lens) -> Camera {
    Camera { source: camera.source.clone(), ..describe(lens) }
}

fn describe(lens: &Lens) -> Camera {
    Camera {
        width: u32::try_from(lens.width).unwrap_or(u32::MAX),
        height: u32::try_from(lens.height).unwrap_or(u32::MAX),
        fx: lens.focal.x,
        fy: lens.focal.y,
        cx: lens.centre.x,
        cy: lens.centre.y,
        distortion: lens.distortion,
        sigma: None,
        source: "given".into(),
        rms_px: None,
        views: 0,
        dropped: Vec::new(),
        coverage: None,
    }
}
