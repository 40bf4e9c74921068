//! The directions of the lights.

use super::read::Shot;
use super::register::{Falloffs, Registered};
use super::session::Session;
use crate::checks::{CheckCode, LIGHT, Reading, UNEVEN};
use crate::edges::GreyImage;
use crate::lens::{Lens, Pose};
use crate::light::{self, DirectionEstimate};
use crate::report::{Mark, PhotoView};
use crate::shoot::{PhotoSpec, Role, Shape, Stick};
use crate::vision::{GreyImage8, Luminance, circle};
use biscale::error::Result;
use biscale::formats::capture::{Light, LightSource, Severity};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// How balls and shadows are judged. Chosen, not measured.
struct LightParams {
    /// Distance from a ball's outline within which edges belong to it, px.
    rim_px: f64,
    /// Radius of a highlight whose place the shoot file gives, where a ball is sought around it, px.
    given_spot_px: f64,
    /// Standard deviation of the middle of a highlight: px, and a part of its radius.
    spot_sigma: (f64, f64),
    /// Places around a stick's foot, of 180, that must be in the picture for its paper to be told.
    fewest_around: usize,
    /// Reach of the search for a shadow in heights of the stick: the light is 5 degrees over the ground then.
    shadow_reach: f64,
    /// Standard deviation of a shadow's tip, px.
    shadow_sigma_px: f64,
}

const PARAMS: LightParams =
    LightParams { rim_px: 1.0, given_spot_px: 2.0, spot_sigma: (0.25, 0.1), fewest_around: 60, shadow_reach: 12.0, shadow_sigma_px: 1.5 };

impl Session<'_> {
    /// All lights that the shoot file names, or that a photograph shows.
    pub(super) fn lights(&mut self) -> Result<Vec<Light>> {
        let shoot = self.shoot;
        let mut sources: BTreeMap<String, Vec<LightSource>> = BTreeMap::new();
        for given in &shoot.lights {
            sources.entry(given.name.clone()).or_default().push(LightSource {
                kind: "given".into(),
                photograph: None,
                direction: given.direction.into(),
                sigma_deg: given.sigma_deg,
            });
        }
        for spec in shoot.of_role(Role::Light) {
            if let Some(shot) = self.shot(spec)?
                && let Some(source) = self.light_of(spec, shot)?
            {
                sources.entry(spec.light.clone()).or_default().push(source);
            }
            self.step("lights")?;
        }
        Ok(sources.into_iter().filter_map(|(name, sources)| self.together(name, sources)).collect())
    }

    fn together(&mut self, name: String, sources: Vec<LightSource>) -> Option<Light> {
        let estimates: Vec<DirectionEstimate> =
            sources.iter().map(|s| DirectionEstimate { direction: s.direction.into(), sigma: s.sigma_deg.to_radians() }).collect();
        let (best, apart) = light::combine(&estimates)?;
        let apart = (sources.len() > 1).then(|| apart.to_degrees());
        if let Some(apart) = apart {
            let bad = "two sources disagree on the light's direction: was the lamp moved, is it too near, or a mark in the wrong place?";
            self.checks.limit(
                CheckCode::LightInconsistent,
                Reading::of_shoot(apart, "degrees"),
                LIGHT,
                "all sources agree on the light's direction",
                bad,
            );
            if let Some(check) = self.checks.0.last_mut() {
                check.message = format!("light \"{name}\": {}", check.message);
            }
        }
        let position = self.shoot.lights.iter().find(|l| l.name == name).and_then(|l| l.position);
        if let Some(place) = position {
            self.near_lamp(&name, place.length());
        }
        Some(Light {
            name,
            direction: best.direction.into(),
            position_mm: position.map(Into::into),
            sigma_deg: best.sigma.to_degrees(),
            irradiance_rgb: None,
            sources,
            disagreement_deg: apart,
        })
    }

    /// Tells how uneven the light of a lamp at this distance from the origin is over the sample.
    fn near_lamp(&mut self, name: &str, distance: f64) {
        let reach = match self.shoot.sample.shape {
            Shape::Plane(size) => 0.5 * size.length(),
            Shape::Cylinder { radius, height, .. } => radius.hypot(0.5 * height),
        };
        // Of all points within that reach: nearest to farthest, and seen from the lamp.
        let nearest = (distance - reach).max(0.0);
        let uneven = ((distance + reach) / nearest).powi(2) - 1.0;
        let turn = (reach / distance).min(1.0).asin().to_degrees();
        let bad = format!(
            "light \"{name}\": its lamp is {distance:.0} mm away, so that its light differs by up to this over the sample, and its direction by up to {turn:.1} degrees; a fit \
             reckons with that as far as the place is known: move the lamp away, or measure where it stands"
        );
        let reading = Reading::of_shoot(uneven, "nearest over farthest place, less 1");
        self.checks.limit(CheckCode::UnevenLight, reading, UNEVEN, &format!("light \"{name}\": its lamp is far enough away"), &bad);
    }

    /// What one photograph of a ball or stick tells.
    fn light_of(&mut self, spec: &PhotoSpec, shot: Shot) -> Result<Option<LightSource>> {
        let name = shot.name.clone();
        let (shot, registered) = self.place(spec, shot, Falloffs::Kept, false)?;
        let shot = &shot;
        let mut view = PhotoView::new(&name, Role::Light.name(), &shot.linear.picture, Some(&shot.linear.saturated), false);
        let Some(Registered { found, lens, .. }) = registered else {
            self.report.views.push(view);
            let message =
                "where the camera stood is not known: the board or sheet of the sample must be seen together with the ball or stick";
            self.checks.add(CheckCode::LightNotFound, Severity::Fail, Some(&name), message);
            return Ok(None);
        };
        let pose = found.pose;
        let (kind, found) = match spec.stick {
            Some(stick) => ("stick", self.stick(&stick, shot, &pose, &lens, &mut view)),
            None => ("mirror-ball", self.ball(spec, shot, &pose, &lens, &mut view)?),
        };
        let out = match found {
            Ok(estimate) => {
                let d = estimate.direction;
                view.row("direction", format!("({:.4}, {:.4}, {:.4})", d.x, d.y, d.z));
                view.row("standard deviation", format!("{:.2} degrees", estimate.sigma.to_degrees()));
                Some(LightSource { kind: kind.into(), photograph: Some(name), direction: d.into(), sigma_deg: estimate.sigma.to_degrees() })
            }
            Err(message) => {
                self.checks.add(CheckCode::LightNotFound, Severity::Fail, Some(&name), message);
                None
            }
        };
        self.report.views.push(view);
        Ok(out)
    }

    fn ball(
        &self,
        spec: &PhotoSpec,
        shot: &Shot,
        pose: &Pose,
        lens: &Lens,
        view: &mut PhotoView,
    ) -> Result<Result<DirectionEstimate, String>> {
        let luminance = Luminance(&shot.linear.picture);
        let candidates = match spec.ball_px {
            Some(circle) => vec![circle],
            None => {
                let grey = GreyImage8::of(&shot.linear.picture, false);
                let spots = match spec.highlight_px {
                    Some(spot) => vec![(spot, PARAMS.given_spot_px)],
                    None => circle::spots(&shot.linear.picture),
                };
                let around: Result<Vec<Vec<[f64; 3]>>> = spots.into_iter().map(|(spot, size)| circle::around(&grey, spot, size)).collect();
                around?.concat()
            }
        };
        // The likeliest ball is the one of whose rim most is seen.
        let mut best: Option<(f64, light::BallOutline, [f64; 3], DVec2, f64)> = None;
        for candidate in candidates {
            let rays: Vec<Vec<DVec3>> =
                circle::outline(&luminance, candidate).iter().map(|e| e.iter().filter_map(|p| lens.ray(*p)).collect()).collect();
            let pixel = 1.0 / (0.5 * (lens.focal.x + lens.focal.y));
            let Some(outline) = light::ball_outline(&rays, PARAMS.rim_px * pixel) else { continue };
            let spot = spec.highlight_px.map(|p| (p, 1.0)).or_else(|| circle::highlight(&luminance, candidate));
            let Some((spot, size)) = spot else { continue };
            let misfit = 1.0 / outline.rays as f64;
            // Half of the rim must be seen; edges anywhere are no rim.
            if 2 * outline.rays >= circle::RAYS as usize && best.as_ref().is_none_or(|b| misfit < b.0) {
                best = Some((misfit, outline, candidate, spot, size));
            }
        }
        let Some((_, outline, candidate, spot, size)) = best else {
            return Ok(Err(
                "no ball with a highlight is seen: give its outline as `ball_px = [x, y, radius]` and the highlight as `highlight_px`"
                    .into(),
            ));
        };
        view.marks.push(Mark::Circle(DVec2::new(candidate[0], candidate[1]), candidate[2], "ball"));
        view.marks.push(Mark::Cross(spot));
        let Some(ray) = lens.ray(spot) else { return Ok(Err("the highlight lies where the lens cannot see".into())) };
        // The middle of a spot is known to a small part of its size.
        let sigma = (PARAMS.spot_sigma.0 + PARAMS.spot_sigma.1 * size) / (0.5 * (lens.focal.x + lens.focal.y));
        Ok(match light::mirror_ball(&outline, ray, sigma) {
            Some(e) => Ok(DirectionEstimate { direction: (pose.rotation.transpose() * e.direction).normalize(), sigma: e.sigma }),
            None => Err("the highlight does not lie on the ball: correct `ball_px` or `highlight_px`".into()),
        })
    }

    fn stick(&self, stick: &Stick, shot: &Shot, pose: &Pose, lens: &Lens, view: &mut PhotoView) -> Result<DirectionEstimate, String> {
        // The stick stands on what carries the markers.
        let ground = -self.shoot.sample.offset;
        let foot = stick.foot.extend(ground);
        let tip = stick.foot.extend(ground + stick.height);
        let on_ground = |p: DVec2| lens.project(pose.to_camera(p.extend(ground)));
        let luminance = Luminance(&shot.linear.picture);
        let eye = pose.eye();
        let shadow = match stick.shadow_px {
            Some(pixel) => {
                let ray = lens.ray(pixel).ok_or("the tip of the shadow lies where the lens cannot see")?;
                light::on_plane(eye, pose.rotation.transpose() * ray, ground)
                    .map(|p| p.truncate())
                    .ok_or("the tip of the shadow does not lie on the ground")?
            }
            None => {
                // Light in the surroundings of the foot: most of it is paper.
                let value = |p: DVec2| luminance.value(on_ground(p)?);
                let ring = (0..180).map(|k| value(stick.foot + stick.height * DVec2::from_angle(f64::from(k).to_radians() * 2.0)));
                let mut around: Vec<f64> = ring.flatten().collect();
                if around.len() < PARAMS.fewest_around {
                    return Err("the surroundings of the stick are not in the picture: give the tip of the shadow as `shadow_px`".into());
                }
                let k = around.len() * 3 / 4;
                let paper = *around.select_nth_unstable_by(k, f64::total_cmp).1;
                let depth = pose.to_camera(foot).z;
                let step = (0.5 * depth / lens.focal.x).clamp(1e-3, stick.height);
                // The stick hides what is behind it, seen from the camera.
                let hidden = light::on_plane(eye, tip - eye, ground).map_or(DVec2::ZERO, |p| p.truncate() - stick.foot);
                let look = |p: DVec2| value(p).map(|v| v / paper);
                light::shadow_tip(stick.foot, hidden, PARAMS.shadow_reach * stick.height, step, &look)
                    .ok_or("no shadow of the stick is seen: let it fall on white paper, or give its tip as `shadow_px`")?
            }
        };
        // The end of the shadow is that of the far rim of its top.
        let away = (shadow - stick.foot).normalize_or_zero();
        let middle = shadow - stick.radius * away;
        for p in [stick.foot, shadow] {
            view.marks.extend(on_ground(p).map(Mark::Cross));
        }
        view.marks.extend(lens.project(pose.to_camera(tip)).map(Mark::Cross));
        // At the distance of the ground.
        let sigma = PARAMS.shadow_sigma_px * pose.to_camera(shadow.extend(ground)).z / lens.focal.x;
        light::stick(tip, middle.extend(ground), sigma).ok_or_else(|| "the shadow says that the light is below the ground".to_owned())
    }
}
