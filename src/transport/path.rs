//! One path over the periodic surface, lit by one direction.

use super::scene::TransportScene;
use super::sequence::PathSequence;
use crate::brdf::Colour;
use crate::direction::Pair;
use crate::visibility::{Hit, Occlusion, Traced};
use glam::DVec3;
use std::f64::consts::FRAC_1_PI;
use std::ops::RangeInclusive;

/// Surface events from which on a path may end at random, without bias; most light has left by then. Chosen, not measured: sooner, short paths
/// get noisy; later, bright concave surfaces are followed for long.
const SURE_EVENTS: u32 = 4;

/// Where a ray from the viewer ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ViewRay {
    /// At a front face, with the light of the path from there on.
    Front(PathLight),
    /// At a back face, which is black, or nowhere.
    Dark,
    /// Nowhere yet, after [`MAX_PERIODS`](crate::visibility::MAX_PERIODS) periods: it was given up.
    GaveUp,
}

/// What a path brings back: radiance over the irradiance of a plane that faces the light, 1/sr.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathLight {
    /// The light of the events that count, `fr (n·wi)+ V(wi)` for a path of one event.
    pub colour: Colour,
    /// The part of it that came along rays that were given up and count as free.
    pub doubtful: Colour,
    /// What radiance would have been multiplied by that came along the ray between two events where the path was given up; 0 if none was.
    pub lost: Colour,
    /// The brightest that a ray of the path saw: the direct light of one of its events that count, not yet reflected by those before.
    pub brightest: Colour,
}

/// What a ray counts with that was given up, in one channel, where the brightest that other rays saw is `brightest`, radiance over irradiance, 1/sr: as
/// much. Where they saw no light at all, white diffuse paper that faces the light: what is lost must not count as nothing.
pub fn lost_radiance(brightest: f64) -> f64 {
    if brightest > 0.0 { brightest } else { FRAC_1_PI }
}

impl TransportScene<'_> {
    /// Follows path `index` of a sequence from `origin`, on or above the highest point of the surface, away from the viewer `pair.wo`; `pair.wi`
    /// lights it. The light of the surface events `events` counts, from 1 on: `1..=1` is direct light, `2..=b+1` the interreflection of `b`
    /// bounces. After the last of them the path ends; a back face absorbs it.
    pub fn path(&self, origin: DVec3, pair: Pair, events: RangeInclusive<u32>, sequence: PathSequence, index: u32) -> ViewRay {
        match self.first_hit(origin, -pair.wo) {
            Traced::Hit(hit) if hit.front => ViewRay::Front(self.follow(hit, pair, &events, sequence, index)),
            Traced::Hit(_) | Traced::Left => ViewRay::Dark,
            Traced::GaveUp => ViewRay::GaveUp,
        }
    }

    /// The light that comes back along a path from its first event on.
    fn follow(&self, first: Hit, pair: Pair, events: &RangeInclusive<u32>, sequence: PathSequence, index: u32) -> PathLight {
        let Pair { wi, wo: mut viewer } = pair;
        let mut sum = PathLight::default();
        let mut throughput = [1.0; 3];
        let mut point = self.point(first);
        for event in 1.. {
            if events.contains(&event) {
                let (fr, occlusion) = self.direct_light(&point, wi, viewer);
                for c in 0..3 {
                    let seen = point.tint[c] * fr[c];
                    let light = throughput[c] * point.tint[c] * fr[c];
                    sum.colour[c] += light;
                    sum.brightest[c] = sum.brightest[c].max(seen);
                    if occlusion == Occlusion::GaveUp {
                        sum.doubtful[c] += light;
                    }
                }
            }
            if event >= *events.end() {
                break;
            }
            let numbers = sequence.event(index, event);
            let Some((direction, density)) = point.brdf.sample(point.normal, viewer, numbers.direction) else { break };
            let fr = point.brdf.eval(point.normal, direction, viewer);
            let cos = point.normal.dot(direction).max(0.0);
            throughput = std::array::from_fn(|c| throughput[c] * point.tint[c] * fr[c] * cos / density);
            let largest = throughput.into_iter().fold(0.0, f64::max);
            let survival = if event < SURE_EVENTS { 1.0 } else { largest.min(1.0) };
            // Not `<=`: a throughput that is not a number ends the path, too.
            if !(largest > 0.0 && numbers.survival < survival) {
                break;
            }
            throughput = throughput.map(|t| t / survival);
            match self.next_hit(&point, direction) {
                Traced::Hit(next) if next.front => point = self.point(next),
                Traced::Hit(_) | Traced::Left => break,
                Traced::GaveUp => {
                    sum.lost = throughput;
                    break;
                }
            }
            viewer = -direction;
        }
        sum
    }
}

#[cfg(test)]
#[path = "path_tests.rs"]
mod tests;
