//! What one ray from the viewer brings back: paths over the periodic surface, lit by one direction.

use crate::brdf::{Brdf, Colour};
use crate::error::Result;
use crate::material::{SmallScale, Tint};
use crate::numerics::cast::index_u32;
use crate::numerics::low_discrepancy::{fraction, hash, sobol_2d, sobol_3d};
use crate::numerics::seed::fold_with;
use crate::visibility::{Hit, Occlusion, PeriodicBvh, Traced};
use glam::{DVec2, DVec3};

/// Surface events after which paths may end at random, without bias; most light has left by then.
const SURE_EVENTS: u32 = 4;

/// A surface with what rays need to know of it.
pub(super) struct Scene<'a> {
    small: &'a SmallScale,
    bvh: PeriodicBvh,
    /// Unit normals of the triangles.
    normals: Vec<DVec3>,
}

/// Sums over rays from the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sums {
    /// Light that came back, `fr (n·wi)+ V(wi)` for a path of one event.
    pub colour: Colour,
    /// The part of `colour` that came along rays that were given up and count as free.
    pub doubtful: Colour,
    /// Least and most light of a ray that met a front face.
    pub range: [Colour; 2],
    /// Rays that met a front face.
    pub front: u32,
    /// Rays that were given up and count as missing.
    pub lost: u32,
}

impl Default for Sums {
    fn default() -> Self {
        Self { colour: [0.0; 3], doubtful: [0.0; 3], range: [[f64::INFINITY; 3], [0.0; 3]], front: 0, lost: 0 }
    }
}

/// What a path brings back, and the part of it that is in doubt as in [`Sums`].
#[derive(Clone, Copy, Debug, Default)]
struct Light {
    colour: Colour,
    doubtful: Colour,
}

/// One randomised sequence of rays from the viewer: a scrambled Sobol' sequence, and others for the bounces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sequence {
    seed: u32,
}

impl Sequence {
    /// The sequence of a batch of a pair; all are independent.
    pub(super) fn new(seed: u64, pair: usize, batch: usize) -> Self {
        Self { seed: fold_with(seed, &[index_u32(pair), index_u32(batch)]) }
    }

    /// Numbers for event `event` of path `index`: three that are stratified over the paths, and one at random.
    ///
    /// Each event has a sequence of its own, in an order shuffled so that aligned blocks of paths take aligned blocks of it
    /// ("padding", Burley 2020, "Practical Hash-based Owen Scrambling", section 5): stratification stays, correlation goes.
    fn numbers(self, index: u32, event: u32) -> ([f64; 3], f64) {
        let seed = hash(self.seed ^ hash(event));
        // The shuffle is an Owen scramble of the index itself, from its highest bit down. Scrambled from its lowest bit it would be a scramble of
        // the radical inverse, which is what the first dimension of every event is made of: one event's number would tell the next one's.
        let order = if event == 0 { index } else { sobol_2d(index.reverse_bits(), !seed)[0] };
        (sobol_3d(order, seed).map(fraction), fraction(hash(index ^ hash(seed.rotate_left(16)))))
    }
}

impl<'a> Scene<'a> {
    pub(super) fn new(small: &'a SmallScale) -> Result<Self> {
        let normal = |t: usize| {
            let [a, b, c] = small.tile.corners(t);
            (b - a).cross(c - a).normalize_or_zero()
        };
        Ok(Self { small, bvh: PeriodicBvh::new(&small.tile)?, normals: (0..small.tile.triangles.len()).map(normal).collect() })
    }

    /// Adds path `index` of a sequence to `sums`. It starts at a place on the plane over one period, and has at most
    /// `bounces + 1` surface events. A back face absorbs it.
    pub(super) fn add_path(&self, wi: DVec3, wo: DVec3, bounces: u32, sequence: Sequence, index: u32, sums: &mut Sums) {
        let ([x, y, _], _) = sequence.numbers(index, 0);
        let origin = (self.small.tile.period * DVec2::new(x, y)).extend(self.bvh.highest());
        match self.bvh.trace(origin, -wo, None) {
            Traced::Hit(hit) if hit.front => {
                let path = self.follow(hit, wi, wo, bounces, sequence, index);
                sums.front += 1;
                for c in 0..3 {
                    sums.colour[c] += path.colour[c];
                    sums.doubtful[c] += path.doubtful[c];
                    sums.range[0][c] = sums.range[0][c].min(path.colour[c]);
                    sums.range[1][c] = sums.range[1][c].max(path.colour[c]);
                }
            }
            Traced::Hit(_) | Traced::Left => {}
            Traced::GaveUp => sums.lost += 1,
        }
    }

    /// The light that comes back along a path from its first place on.
    fn follow(&self, mut hit: Hit, wi: DVec3, mut viewer: DVec3, bounces: u32, sequence: Sequence, index: u32) -> Light {
        let mut sum = Light::default();
        let mut throughput = [1.0; 3];
        for event in 1.. {
            let (brdf, tint) = self.covering(&hit);
            let n = self.normals[hit.triangle as usize];
            let (fr, occlusion) = self.direct_light(&hit, n, brdf, wi, viewer);
            for c in 0..3 {
                let light = throughput[c] * tint[c] * fr[c];
                sum.colour[c] += light;
                if occlusion == Occlusion::GaveUp {
                    sum.doubtful[c] += light;
                }
            }
            if event > bounces {
                break;
            }
            let (u, lottery) = sequence.numbers(index, event);
            let Some((direction, density)) = brdf.sample(n, viewer, u) else { break };
            let fr = brdf.eval(n, direction, viewer);
            let cos = n.dot(direction).max(0.0);
            throughput = std::array::from_fn(|c| throughput[c] * tint[c] * fr[c] * cos / density);
            let largest = throughput.into_iter().fold(0.0, f64::max);
            let survival = if event < SURE_EVENTS { 1.0 } else { largest.min(1.0) };
            // Not `<=`: a throughput that is not a number ends the path, too.
            if !(largest > 0.0 && lottery < survival) {
                break;
            }
            throughput = throughput.map(|t| t / survival);
            match self.bvh.trace(hit.position, direction, Some(hit.triangle)) {
                Traced::Hit(next) if next.front => hit = next,
                Traced::Hit(_) | Traced::Left | Traced::GaveUp => break,
            }
            viewer = -direction;
        }
        sum
    }

    /// `fr (n·wi)+` of a place, 0 in the shadow, and whether it lies there.
    fn direct_light(&self, hit: &Hit, n: DVec3, brdf: &Brdf, wi: DVec3, wo: DVec3) -> (Colour, Occlusion) {
        let cos = n.dot(wi);
        if cos <= 0.0 || n.dot(wo) <= 0.0 {
            return ([0.0; 3], Occlusion::Blocked);
        }
        match self.bvh.occluded(hit.triangle as usize, hit.position, wi) {
            Occlusion::Blocked => ([0.0; 3], Occlusion::Blocked),
            seen => (brdf.eval(n, wi, wo).map(|fr| fr * cos), seen),
        }
    }

    /// What covers a place.
    fn covering(&self, hit: &Hit) -> (&Brdf, Colour) {
        let triangle = hit.triangle as usize;
        let surface = &self.small.surfaces[usize::from(self.small.surface_of_triangle[triangle])];
        let tint = match &surface.tint {
            Tint::Uniform(tint) => *tint,
            Tint::Image(image) => {
                let [a, b, c] = self.small.tile.uv.as_ref().expect("Material::build refuses an image without uv")[triangle];
                let at = a + hit.barycentric.x * (b - a) + hit.barycentric.y * (c - a);
                image.lookup(at).map(f64::from)
            }
        };
        (&surface.brdf, tint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::cast::truncate_usize;

    /// Place of a number among 16 equal steps of `0..1`.
    fn sixteenth(x: f64) -> usize {
        truncate_usize(16.0 * x)
    }

    #[test]
    fn numbers_of_one_event_do_not_tell_those_of_another() {
        // 4,096 paths in the 256 cells of two numbers of two events: 16 a cell, if these are independent. A cell's count is Poisson's or more even;
        // 40 would be 6 standard deviations off.
        for (seed, events) in [(0, [0, 1]), (1, [1, 2]), (2, [0, 5])] {
            let sequence = Sequence::new(seed, 3, 1);
            let paths: Vec<[[f64; 3]; 2]> = (0..4096).map(|index| events.map(|event| sequence.numbers(index, event).0)).collect();
            for (a, b) in (0..9).map(|k| (k / 3, k % 3)) {
                let mut cells = [0_u32; 256];
                paths.iter().for_each(|[first, second]| cells[16 * sixteenth(first[a]) + sixteenth(second[b])] += 1);
                let (fewest, most) = (cells.iter().min(), cells.iter().max());
                assert!(fewest > Some(&0) && most < Some(&40), "events {events:?}, numbers {a} and {b}: {fewest:?} to {most:?} a cell");
            }
        }
    }

    #[test]
    fn aligned_blocks_of_paths_are_stratified_at_every_event() {
        let sequence = Sequence::new(7, 0, 2);
        for event in [0, 1, 6] {
            for block in (0..1024_u32).step_by(16) {
                let mut strata: Vec<usize> = (block..block + 16).map(|index| sixteenth(sequence.numbers(index, event).0[0])).collect();
                strata.sort_unstable();
                assert_eq!(strata, (0..16).collect::<Vec<_>>(), "event {event}, paths from {block}");
            }
        }
    }
}
