//! Falloff and noise, from the photographs of an even surface.

use super::calibration::share;
use super::session::Session;
use crate::checks::{CheckCode, Reading, UNEVEN};
use crate::flat::Falloff;
use crate::linear::LinearPhoto;
use crate::noise;
use crate::report::PhotoView;
use crate::shoot::{FlatMethod, Role};
use biscale::error::Result;
use biscale::formats::capture::{FlatField, Severity};
use glam::DVec2;

impl Session<'_> {
    /// Falloff and noise of every lens that an even surface was photographed with.
    pub(super) fn flat_fields(&mut self) -> Result<()> {
        let shoot = self.shoot;
        // Of each group the first photograph, and its name.
        let mut first: Vec<Option<(LinearPhoto, String)>> = Vec::new();
        for spec in shoot.of_role(Role::Flat) {
            for k in 0..spec.files.len() {
                let shot = self.shot_of(spec, k..k + 1)?;
                self.step("flat field")?;
                let Some(shot) = shot else { continue };
                let mut view = PhotoView::new(&shot.name, Role::Flat.name(), &shot.linear.picture, Some(&shot.linear.saturated), false);
                view.row("saturated", format!("{:.2} %", 100.0 * share(&shot.linear.saturated)));
                self.report.views.push(view);
                first.resize_with(self.groups.len(), || None);
                match &first[shot.group] {
                    None => first[shot.group] = Some((shot.linear, shot.name)),
                    Some((one, _)) if self.groups[shot.group].sensor.is_none() => {
                        self.groups[shot.group].sensor = noise::measure(one, &shot.linear);
                    }
                    Some(_) => {}
                }
            }
        }
        for (group, flat) in first.into_iter().enumerate() {
            if let Some((photo, name)) = flat {
                self.flat_field(group, &photo, &name);
            }
        }
        Ok(())
    }

    /// The falloff of a group by a photograph of an even surface.
    fn flat_field(&mut self, group: usize, photo: &LinearPhoto, name: &str) {
        let middle = 0.5 * DVec2::new((photo.picture.width - 1) as f64, (photo.picture.height - 1) as f64);
        let centre = self.groups[group].lens.map_or(middle, |l| l.centre);
        let Some(flat) = Falloff::fit(photo, centre, self.shoot.camera.flat) else {
            let message = "the flat field is saturated, dark or uneven all over: take it again at about half of the scale";
            self.checks.add(CheckCode::UnevenLight, Severity::Fail, Some(name), message);
            return;
        };
        let bad = "the light of the flat field falls off from one side to the other: turn the surface by half a turn and take the mean, or light it more evenly";
        self.checks.limit(
            CheckCode::UnevenLight,
            Reading::of(name, flat.tilt, "relative, over the picture"),
            UNEVEN,
            "the flat field is even",
            bad,
        );
        self.groups[group].flat = Some(flat);
    }

    /// The falloff of a group as it is written.
    pub(super) fn written_flat(&self, group: usize) -> Option<FlatField> {
        let flat = self.groups.get(group)?.flat.as_ref()?;
        Some(FlatField {
            method: if flat.method == FlatMethod::Divide { "divide" } else { "radial" }.into(),
            radial: flat.radial,
            darkest: flat.darkest,
            residual: flat.residual,
        })
    }
}
