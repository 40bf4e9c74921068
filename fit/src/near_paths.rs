//! Light between threads as the close-up shows it, place by place of a period: most of it lies where threads stand close, and hardly any on top of them.

use crate::residuals::registration::Windows;
use biscale::brdf::Brdf;
use biscale::direction::Pair;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::material::{SmallScale, Tint};
use biscale::numerics::low_discrepancy::{fraction, hash, sobol_2d};
use biscale::visibility::{Hit, Occlusion, PeriodicBvh, Traced};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Places along a period.
pub const SIZE: usize = 96;
/// Paths of each place, of all viewers together.
const PATHS: usize = 16;

/// What one viewer of the close-up sees of the light between threads.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// By how much of a period its lines of sight move for a unit of height.
    slant: [f64; 2],
    /// Radiance over irradiance in [`SIZE`] x [`SIZE`] places of a period at height 0, rows of x.
    pub(crate) picture: Vec<[f64; 3]>,
}

/// The mean of all viewers, where their periods are laid on top of each other at `height`.
pub fn laid_at(seen: &[Seen], height: f64) -> Vec<[f64; 3]> {
    let mut sum = vec![[0.0; 3]; SIZE * SIZE];
    for Seen { slant, picture } in seen {
        let moved = Windows::new(SIZE, [SIZE; 2], slant.map(|s| -height * s)).of(picture);
        for (sum, v) in sum.iter_mut().zip(moved) {
            (0..3).for_each(|c| sum[c] += v[c] / seen.len() as f64);
        }
    }
    sum
}

/// What the viewers of `pairs` see that was reflected 2 to `bounces + 1` times. Images that tint a surface count as white, as they do in all of a fit.
///
/// # Errors
/// `Interrupted`; a surface that rays cannot be traced to.
pub fn light_between(small: &SmallScale, pairs: &[Pair], (bounces, seed): (u32, u32), control: &Control<'_>) -> Result<Vec<Seen>> {
    let scene = Scene { small, bvh: PeriodicBvh::new(&small.tile)? };
    let period = small.tile.period;
    let above = scene.bvh.highest() + 1e-6 * period.max_element();
    let paths = PATHS.div_ceil(pairs.len().max(1));
    let row = |(k, row): (usize, usize)| {
        control.check()?;
        let pair = pairs[k];
        let at = |column: usize| {
            let mut sum = [0.0; 3];
            for path in 0..paths {
                let own = hash(seed ^ hash((row * SIZE + column) as u32));
                // Viewers look at other parts of a place.
                let path = (k * paths + path) as u32;
                let [u, v] = sobol_2d(path, own).map(fraction);
                let place = period * DVec2::new((column as f64 + u) / SIZE as f64, (row as f64 + v) / SIZE as f64);
                let start = place.extend(0.0) + pair.wo * (above / pair.wo.z);
                if let Traced::Hit(hit) = scene.bvh.trace(start, -pair.wo, None)
                    && hit.front
                {
                    let light = scene.follow(hit, pair, bounces, hash(own ^ hash(path)));
                    (0..3).for_each(|c| sum[c] += light[c] / paths as f64);
                }
            }
            sum
        };
        Ok((0..SIZE).map(at).collect())
    };
    let rows: Result<Vec<Vec<[f64; 3]>>> = (0..pairs.len() * SIZE).into_par_iter().map(|at| row((at / SIZE, at % SIZE))).collect();
    let seen = |(pair, rows): (&Pair, &[Vec<[f64; 3]>])| Seen {
        slant: (pair.wo.truncate() / (pair.wo.z * period)).to_array(),
        picture: rows.concat(),
    };
    Ok(pairs.iter().zip(rows?.chunks(SIZE)).map(seen).collect())
}

struct Scene<'a> {
    small: &'a SmallScale,
    bvh: PeriodicBvh,
}

impl Scene<'_> {
    /// What comes back along a path from its first place on, without the light of that place itself.
    fn follow(&self, mut hit: Hit, pair: Pair, bounces: u32, seed: u32) -> [f64; 3] {
        let mut sum = [0.0; 3];
        let mut throughput = [1.0; 3];
        let mut viewer = pair.wo;
        for event in 0..=bounces {
            let triangle = hit.triangle as usize;
            let [a, b, c] = self.small.tile.corners(triangle);
            let n = (b - a).cross(c - a).normalize_or_zero();
            let (brdf, tint) = self.covering(triangle);
            if event > 0 {
                let light = self.direct(&hit, n, brdf, (pair.wi, viewer));
                (0..3).for_each(|c| sum[c] += throughput[c] * tint[c] * light[c]);
            }
            if event == bounces {
                break;
            }
            let number = |k: u32| fraction(hash(seed ^ hash(3 * event + k)));
            let Some((direction, density)) = brdf.sample(n, viewer, [number(0), number(1), number(2)]) else { break };
            let fr = brdf.eval(n, direction, viewer);
            let cosine = n.dot(direction).max(0.0);
            throughput = std::array::from_fn(|c| throughput[c] * tint[c] * fr[c] * cosine / density);
            // A throughput that is not a number ends the path, too.
            if !throughput.iter().any(|t| *t > 0.0) {
                break;
            }
            match self.bvh.trace(hit.position, direction, Some(hit.triangle)) {
                Traced::Hit(next) if next.front => hit = next,
                _ => break,
            }
            viewer = -direction;
        }
        sum
    }

    /// `fr (n·wi)+` of a place, 0 in the shadow.
    fn direct(&self, hit: &Hit, n: DVec3, brdf: &Brdf, (wi, viewer): (DVec3, DVec3)) -> [f64; 3] {
        let cosine = n.dot(wi);
        if cosine <= 0.0 || self.bvh.occluded(hit.triangle as usize, hit.position, wi) == Occlusion::Blocked {
            return [0.0; 3];
        }
        brdf.eval(n, wi, viewer).map(|fr| fr * cosine)
    }

    fn covering(&self, triangle: usize) -> (&Brdf, [f64; 3]) {
        let surface = &self.small.surfaces[usize::from(self.small.surface_of_triangle[triangle])];
        let tint = match &surface.tint {
            Tint::Uniform(tint) => *tint,
            Tint::Image(_) => [1.0; 3],
        };
        (&surface.brdf, tint)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::filter::{Method, Quality, effective};
    use biscale::material::Material;
    use biscale::toml_reader::Source;

    fn small(geometry: &str) -> SmallScale {
        let surface =
            "[[surface]]\npart = \"*\"\nbrdf = { model = \"cook-torrance\", diffuse = [0.8, 0.5, 0.2], specular = 0.1, alpha = 0.3 }\n";
        let text = format!("format = 1\n[geometry]\n{geometry}\n{surface}");
        Material::parse(&Source { path: "m.toml".into(), text }).unwrap().build().unwrap()
    }

    /// The mean over a period is what the reference method finds of all reflections after the first.
    #[test]
    fn the_mean_of_all_places_is_that_of_the_reference_method() {
        let cancel = std::sync::atomic::AtomicBool::new(false);
        let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
        let direction = |x: f64, y: f64| DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
        let pair = Pair { wi: direction(0.3, -0.4), wo: direction(-0.1, 0.15) };
        for geometry in ["kind = \"weave\"", "kind = \"grooves\"\nprofile = \"v\""] {
            let small = small(geometry);
            let places = laid_at(&light_between(&small, &[pair], (3, 5), &control).unwrap(), 0.1);
            // Of the blue light of the weave 3 % is interreflection: the reference must err by far less than 3 % of that.
            let of = |bounces| {
                let quality = Quality { method: Method::Reference, tolerance: 0.0003, bounces, ..Quality::default() };
                effective(&small, &[pair], &quality, &control).unwrap().values[0].s
            };
            let (whole, direct) = (of(3), of(0));
            for c in 0..3 {
                let mean = places.iter().map(|p| p[c]).sum::<f64>() / places.len() as f64;
                let expected = (whole[c] - direct[c]) / pair.wo.z;
                assert!((mean / expected - 1.0).abs() < 0.03, "{geometry}, channel {c}: {mean} for {expected}");
            }
        }
    }
}
