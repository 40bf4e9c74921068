//! What arrives at the sites of a scene, and what leaves them for all viewers.

use super::super::mapping::Footprint;
use super::super::world::{SurfacePoint, World};
use super::half_vectors::texel_sharpness;
use super::material::MaterialResponse;
use super::octahedron::{hemisphere_place, hemisphere_texels, within_texel};
use super::prefilter::PrefilteredMaps;
use super::sites::{Site, SiteWeights, Sites};
use crate::error::Result;
use crate::filter::Control;
use crate::numerics::cast::{narrow, truncate_usize};
use glam::{DVec3, Vec2, Vec3, Vec4};
use rayon::prelude::*;

/// Rays that would follow a texel with all of a site's light, were there no limit, and most rays along a side of a texel: a small bright light is then a mosaic of parts
/// whose shadows have soft edges. Chosen: a light of a few texels, with most of the energy, gets 16 rays each.
const RAYS_OF_ALL: f32 = 256.0;
const MOST_PARTS: f32 = 4.0;
/// A share of 1 as it is kept.
const WHOLE: f32 = 255.0;

/// Light at the sites of a scene.
pub struct LightField {
    /// For each site, its material's nodes: radiance times `cos_o`, without that of the lobes.
    outgoing: Vec<Vec4>,
    /// Where the nodes of each site begin.
    starts: Vec<usize>,
    /// For each site with lobes the share of light that comes through from the texels of its hemisphere, unless all does.
    shares: Vec<Option<Box<[u8]>>>,
}

impl LightField {
    /// Follows a ray from each site through each texel of its hemisphere, and more through those that hold much of the light.
    ///
    /// # Errors
    /// `Interrupted`.
    pub fn new(
        world: &World<'_>,
        sites: &Sites,
        responses: &[MaterialResponse],
        maps: &PrefilteredMaps,
        control: &Control<'_>,
    ) -> Result<Self> {
        let texels: Vec<Vec<(DVec3, f64)>> = responses.iter().map(|r| hemisphere_texels(r.fineness.side)).collect();
        let site = |&Site { ref place, material }: &Site| {
            if control.check().is_err() {
                return Default::default();
            }
            let (incident, shares) = arriving(world, place, maps, &texels[material], responses[material].fineness.side);
            let kept = !responses[material].lobes.is_empty() && shares.iter().any(|s| *s < 1.0);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "shares are in 0..1")]
            let bytes = || shares.iter().map(|s| (s * WHOLE).round() as u8).collect();
            (responses[material].outgoing(&incident), kept.then(bytes))
        };
        type OfSite = (Vec<Vec4>, Option<Box<[u8]>>);
        let all: Vec<OfSite> = sites.all.par_iter().map(site).collect();
        control.check()?;
        let mut field = Self { outgoing: Vec::new(), starts: Vec::new(), shares: Vec::new() };
        for (outgoing, shares) in all {
            field.starts.push(field.outgoing.len());
            field.outgoing.extend(outgoing);
            field.shares.push(shares);
        }
        Ok(field)
    }

    /// Radiance times `cos_o` around a place, for the viewer between three nodes.
    #[inline]
    pub fn outgoing(&self, around: &SiteWeights, nodes: [usize; 3], weights: [f32; 3]) -> Vec4 {
        let mut sum = Vec4::ZERO;
        for (&site, &share) in around.sites.iter().zip(&around.weights) {
            if share > 0.0 {
                let row = &self.outgoing[self.starts[site as usize]..];
                sum += share * (weights[0] * row[nodes[0]] + weights[1] * row[nodes[1]] + weights[2] * row[nodes[2]]);
            }
        }
        sum
    }

    /// The share of light that comes through around a place from a direction of the tile's upper hemisphere.
    #[inline]
    pub fn share(&self, around: &SiteWeights, direction: Vec3, side: usize) -> f32 {
        let mut sum = 0.0;
        for (&site, &weight) in around.sites.iter().zip(&around.weights) {
            sum += weight * self.shares[site as usize].as_ref().map_or(1.0, |shares| bilinear(shares, direction, side));
        }
        sum
    }

    /// Whether all light comes through around a place.
    #[inline]
    pub fn is_open(&self, around: &SiteWeights) -> bool {
        around.sites.iter().all(|&site| self.shares[site as usize].is_none())
    }

    /// Bytes of all tables.
    pub fn bytes(&self) -> usize {
        size_of_val(self.outgoing.as_slice()) + self.shares.iter().flatten().map(|s| s.len()).sum::<usize>()
    }
}

/// Radiance that arrives at a site from each texel of its hemisphere, and the share of light that comes through there.
fn arriving(
    world: &World<'_>,
    place: &SurfacePoint,
    maps: &PrefilteredMaps,
    texels: &[(DVec3, f64)],
    side: usize,
) -> (Vec<Vec4>, Vec<f32>) {
    let from = |direction: DVec3, solid_angle: f64| {
        let to_light = (place.frame * direction).normalize();
        (to_light, maps.look_up(to_light.as_vec3(), narrow(texel_sharpness(solid_angle))))
    };
    let unshadowed: Vec<(DVec3, Vec4)> = texels.iter().map(|&(direction, solid_angle)| from(direction, solid_angle)).collect();
    let energy = |(radiance, solid_angle): (Vec4, f64)| radiance.truncate().element_sum() * narrow(solid_angle);
    let all: f32 = unshadowed.iter().zip(texels).map(|(u, t)| energy((u.1, t.1))).sum();
    let share = |to_light: DVec3| narrow(world.transmittance(place, Footprint::POINT, to_light, f64::INFINITY));
    let texel = |index: usize| {
        let ((to_light, radiance), solid_angle) = (unshadowed[index], texels[index].1);
        let parts = (RAYS_OF_ALL * energy((radiance, solid_angle)) / all.max(f32::MIN_POSITIVE)).sqrt().ceil().clamp(1.0, MOST_PARTS);
        if parts <= 1.0 {
            let share = share(to_light);
            return (share * radiance, share);
        }
        let parts = truncate_usize(parts.into());
        let count = (parts * parts) as f32;
        let (mut sum, mut through) = (Vec4::ZERO, 0.0);
        for direction in within_texel(side, index, parts) {
            let (to_light, radiance) = from(direction, solid_angle / f64::from(count));
            let share = share(to_light);
            sum += share / count * radiance;
            through += share / count;
        }
        (sum, through)
    };
    (0..texels.len()).map(texel).unzip()
}

#[inline]
fn bilinear(shares: &[u8], direction: Vec3, side: usize) -> f32 {
    let last = (side - 1) as f32;
    let at = ((hemisphere_place(direction) + 1.0) * (0.5 * side as f32) - 0.5).clamp(Vec2::ZERO, Vec2::splat(last));
    let corner = at.floor().min(Vec2::splat(last - 1.0));
    let part = at - corner;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "whole numbers from 0 to the side")]
    let first = corner.y as usize * side + corner.x as usize;
    let row = |at: usize| f32::from(shares[at]) * (1.0 - part.x) + f32::from(shares[at + 1]) * part.x;
    (row(first) * (1.0 - part.y) + row(first + side) * part.y) / WHOLE
}
