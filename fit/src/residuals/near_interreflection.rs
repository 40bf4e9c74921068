//! Interreflection as the close-up shows it, texel by texel of a period: most of it lies where threads stand close, and hardly any on top of them.
//!
//! The paths are those of [`biscale::transport`], as of the method `reference`, without the light of their first event.

use crate::residuals::registration::Windows;
use biscale::direction::Pair;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::material::SmallScale;
use biscale::numerics::cast::index_u32;
use biscale::transport::{PathLight, PathSequence, TransportScene, ViewRay, lost_radiance};
use glam::DVec2;
use rayon::prelude::*;

/// Texels along a period.
pub const SIZE: usize = 96;
/// Paths of each texel, of all viewers together. Chosen, not measured: the blur of the close-up takes the mean over many texels.
const PATHS: usize = 16;
/// How far above the highest point rays start, over the period: more than rounding moves it.
const START_ABOVE: f64 = 1e-6;

/// How paths are followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PathOptions {
    /// Reflections after the first.
    pub bounces: u32,
    /// Another seed gives other paths.
    pub seed: u64,
}

/// The interreflection that one viewer of the close-up sees.
#[derive(Clone, Debug, PartialEq)]
pub struct InterreflectionView {
    /// By how much of a period its lines of sight move for a unit of height.
    slant: [f64; 2],
    /// Radiance over irradiance in [`SIZE`] x [`SIZE`] texels of a period at height 0, rows of x.
    pub(crate) picture: Vec<[f64; 3]>,
    /// The share of this light that could be otherwise because rays were given up.
    pub(crate) given_up_share: f64,
}

/// Sums over the paths of a texel, or of several.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct PathSums {
    /// Light that came back.
    colour: [f64; 3],
    /// The part of it, all channels, that came along rays that were given up and count as free.
    doubtful: f64,
    /// Paths that met a front face.
    front: u32,
    /// Paths that were given up before they met anything.
    lost: u32,
    /// What radiance would have been multiplied by that came along rays between two events which were given up and count as free.
    lost_bounces: [f64; 3],
    /// The brightest that a ray saw after the first event.
    brightest: [f64; 3],
}

impl PathSums {
    fn add_path(&mut self, ray: ViewRay) {
        match ray {
            ViewRay::Front(path) => {
                let doubtful = path.doubtful.iter().sum();
                let PathLight { colour, lost: lost_bounces, brightest, .. } = path;
                self.add(&Self { colour, doubtful, front: 1, lost: 0, lost_bounces, brightest });
            }
            ViewRay::Dark => {}
            ViewRay::GaveUp => self.lost += 1,
        }
    }

    fn add(&mut self, other: &Self) {
        for c in 0..3 {
            self.colour[c] += other.colour[c];
            self.lost_bounces[c] += other.lost_bounces[c];
            self.brightest[c] = self.brightest[c].max(other.brightest[c]);
        }
        self.doubtful += other.doubtful;
        self.front += other.front;
        self.lost += other.lost;
    }

    /// The share of the light that could be otherwise because rays were given up, in 0..=1. What is in doubt could be dark, a ray between two events
    /// could have seen the brightest that another one saw, and a path that met nothing could have brought what the mean path brings, as in the errors of
    /// the method `reference`.
    fn given_up_share(&self) -> f64 {
        let light: f64 = self.colour.iter().sum();
        let of_bounces: f64 = (0..3).map(|c| lost_radiance(self.brightest[c]) * self.lost_bounces[c]).sum();
        let of_viewer = light * f64::from(self.lost) / f64::from(self.front.max(1));
        let change = self.doubtful + of_bounces + of_viewer;
        if light > 0.0 {
            (change / light).min(1.0)
        } else {
            // Nothing was seen: all of it is in doubt as soon as one ray is.
            f64::from(u8::from(change > 0.0 || self.lost > 0))
        }
    }
}

/// The mean of all viewers, where their periods are registered at `height`.
pub fn registered_at(views: &[InterreflectionView], height: f64) -> Vec<[f64; 3]> {
    let mut sum = vec![[0.0; 3]; SIZE * SIZE];
    for InterreflectionView { slant, picture, .. } in views {
        let moved = Windows::new(SIZE, [SIZE; 2], slant.map(|s| -height * s)).of(picture);
        for (sum, v) in sum.iter_mut().zip(moved) {
            (0..3).for_each(|c| sum[c] += v[c] / views.len() as f64);
        }
    }
    sum
}

/// What the viewers of `pairs` see that was reflected 2 to `bounces + 1` times.
///
/// # Errors
/// `Interrupted`; a surface that rays cannot be traced to.
pub fn interreflection_views(
    small: &SmallScale,
    pairs: &[Pair],
    options: PathOptions,
    control: &Control<'_>,
) -> Result<Vec<InterreflectionView>> {
    let tracer = TexelTracer { scene: TransportScene::new(small)?, options, paths: PATHS.div_ceil(pairs.len().max(1)) };
    let row = |at: usize| {
        control.check()?;
        let (viewer, row) = (at / SIZE, at % SIZE);
        Ok((0..SIZE).map(|column| tracer.texel(pairs[viewer], viewer, [column, row])).collect())
    };
    let rows: Vec<Vec<PathSums>> = (0..pairs.len() * SIZE).into_par_iter().map(row).collect::<Result<_>>()?;
    let view = |(pair, rows): (&Pair, &[Vec<PathSums>])| {
        let mut whole = PathSums::default();
        rows.iter().flatten().for_each(|texel| whole.add(texel));
        InterreflectionView {
            slant: (pair.wo.truncate() / (pair.wo.z * small.tile.period)).to_array(),
            picture: rows.iter().flatten().map(|texel| texel.colour.map(|v| v / tracer.paths as f64)).collect(),
            given_up_share: whole.given_up_share(),
        }
    };
    Ok(pairs.iter().zip(rows.chunks(SIZE)).map(view).collect())
}

/// Follows the paths of texels.
struct TexelTracer<'a> {
    scene: TransportScene<'a>,
    options: PathOptions,
    /// Paths of each viewer.
    paths: usize,
}

impl TexelTracer<'_> {
    /// The paths of one viewer through a texel, whose column and row are given.
    fn texel(&self, pair: Pair, viewer: usize, texel: [usize; 2]) -> PathSums {
        let period = self.scene.surface().tile.period;
        let above = self.scene.highest() + START_ABOVE * period.max_element();
        let sequence = self.sequence(texel);
        let mut sums = PathSums::default();
        for index in self.indices(viewer) {
            let start = period * texel_point(sequence, index, texel);
            let origin = start.extend(0.0) + pair.wo * (above / pair.wo.z);
            sums.add_path(self.scene.path(origin, pair, 2..=self.options.bounces.saturating_add(1), sequence, index));
        }
        sums
    }

    /// One sequence serves all viewers of a texel: together they look at all of its parts.
    fn sequence(&self, [column, row]: [usize; 2]) -> PathSequence {
        PathSequence::new(self.options.seed, &[index_u32(row * SIZE + column)])
    }

    /// A viewer's part of it.
    fn indices(&self, viewer: usize) -> std::ops::Range<u32> {
        index_u32(viewer * self.paths)..index_u32((viewer + 1) * self.paths)
    }
}

/// Where path `index` passes height 0 within a texel, in periods.
fn texel_point(sequence: PathSequence, index: u32, [column, row]: [usize; 2]) -> DVec2 {
    (DVec2::new(column as f64, row as f64) + DVec2::from(sequence.start(index))) / SIZE as f64
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use biscale::filter::{Method, Quality, effective};
    use biscale::geometry::Tile;
    use biscale::material::{Material, Tint, TintImage};
    use biscale::numerics::cast::truncate_usize;
    use biscale::toml_reader::Source;
    use glam::DVec3;
    use std::collections::HashSet;
    use std::sync::Arc;

    const OPTIONS: PathOptions = PathOptions { bounces: 3, seed: 5 };
    const GROOVES: &str = "kind = \"grooves\"\nprofile = \"v\"";

    fn small(geometry: &str) -> SmallScale {
        let surface =
            "[[surface]]\npart = \"*\"\nbrdf = { model = \"cook-torrance\", diffuse = [0.8, 0.5, 0.2], specular = 0.1, alpha = 0.3 }\n";
        let text = format!("format = 1\n[geometry]\n{geometry}\n{surface}");
        Material::parse(&Source { path: "m.toml".into(), text }).unwrap().build().unwrap()
    }

    fn oblique() -> Pair {
        let direction = |x: f64, y: f64| DVec3::new(x, y, (1.0 - x * x - y * y).sqrt());
        Pair { wi: direction(0.3, -0.4), wo: direction(-0.1, 0.15) }
    }

    fn views(small: &SmallScale, pairs: &[Pair]) -> Vec<InterreflectionView> {
        interreflection_views(small, pairs, OPTIONS, &Control::quiet()).unwrap()
    }

    fn mean(picture: &[[f64; 3]], channel: usize) -> f64 {
        picture.iter().map(|v| v[channel]).sum::<f64>() / picture.len() as f64
    }

    /// The mean over a period is what the reference method finds of all reflections after the first.
    #[test]
    fn the_mean_of_all_texels_is_that_of_the_reference_method() {
        let pair = oblique();
        for geometry in ["kind = \"weave\"", GROOVES] {
            let small = small(geometry);
            let texels = registered_at(&views(&small, &[pair]), 0.1);
            // Of the blue light of the weave 3 % is interreflection: the reference must err by far less than 3 % of that.
            let of = |bounces| {
                let quality = Quality { method: Method::Reference, tolerance: 0.0003, bounces: Some(bounces), ..Quality::default() };
                effective(&small, &[pair], &quality, &Control::quiet()).unwrap().values[0].s
            };
            let (whole, direct) = (of(3), of(0));
            for c in 0..3 {
                let (mean, expected) = (mean(&texels, c), (whole[c] - direct[c]) / pair.wo.z);
                assert!((mean / expected - 1.0).abs() < 0.03, "{geometry}, channel {c}: {mean} for {expected}");
            }
        }
    }

    #[test]
    fn an_image_that_tints_a_surface_tints_its_interreflection() {
        let pair = oblique();
        let mut tinted = small(GROOVES);
        let white = views(&tinted, &[pair]);
        let uv = |p: DVec3| (p.truncate() / tinted.tile.period) * 0.999 + 0.0005;
        tinted.tile.uv = Some((0..tinted.tile.triangles.len()).map(|t| tinted.tile.corners(t).map(uv)).collect());
        // Half of the red, and no green, is left at each event.
        let image = TintImage { width: 1, height: 1, pixels: vec![[0.5, 0.0, 1.0]] };
        tinted.surfaces[0].tint = Tint::Image(Arc::new(image));
        let seen = views(&tinted, &[pair]);
        let ratio = |c: usize| mean(&seen[0].picture, c) / mean(&white[0].picture, c);
        // Two events leave a fourth, three an eighth; no more than a few percent of the paths end elsewhere by the lottery.
        assert!(ratio(0) > 0.15 && ratio(0) < 0.27 && ratio(1) == 0.0 && (ratio(2) - 1.0).abs() < 0.05, "{} {}", ratio(0), ratio(2));
    }

    #[test]
    fn the_paths_of_all_viewers_of_a_texel_are_stratified_together() {
        let small = small(GROOVES);
        for viewers in [1, 4, 16] {
            let tracer = TexelTracer { scene: TransportScene::new(&small).unwrap(), options: OPTIONS, paths: PATHS / viewers };
            for texel in [[0, 0], [95, 41]] {
                let sequence = tracer.sequence(texel);
                let point = |index| texel_point(sequence, index, texel) * SIZE as f64 - DVec2::new(texel[0] as f64, texel[1] as f64);
                let points: Vec<DVec2> = (0..viewers).flat_map(|viewer| tracer.indices(viewer)).map(point).collect();
                let sixteenth = |v: f64| truncate_usize(16.0 * v);
                let strata = |key: &dyn Fn(&DVec2) -> usize| points.iter().map(key).collect::<HashSet<_>>().len();
                assert_eq!((strata(&|p| sixteenth(p.x)), strata(&|p| sixteenth(p.y))), (16, 16), "{viewers} viewers, texel {texel:?}");
            }
        }
    }

    #[test]
    fn light_along_rays_that_are_given_up_is_counted() {
        let small = small(GROOVES);
        // Light nearly along the grooves at an elevation of 1e-6: half a million periods to the ridge, and none like the one before.
        let grazing = Pair { wi: DVec3::new(1e-9, 1.0, 1e-6).normalize(), wo: DVec3::Z };
        // One row of texels: such rays take long.
        let share = |pair: Pair| {
            let tracer = TexelTracer { scene: TransportScene::new(&small).unwrap(), options: OPTIONS, paths: 1 };
            let mut sums = PathSums::default();
            (0..SIZE).for_each(|column| sums.add(&tracer.texel(pair, 0, [column, 0])));
            sums.given_up_share()
        };
        let [clear, doubtful] = [oblique(), grazing].map(share);
        assert!(clear == 0.0 && doubtful > 0.5, "{clear} and {doubtful}");
        let lost = PathSums { colour: [3.0, 2.0, 1.0], doubtful: 0.6, front: 8, lost: 2, ..PathSums::default() };
        assert!((lost.given_up_share() - (0.1 + 0.25)).abs() < 1e-15, "{}", lost.given_up_share());
        let dark = PathSums { lost_bounces: [1e-9, 0.0, 0.0], front: 8, ..PathSums::default() };
        let unseen = PathSums { lost: 3, ..PathSums::default() };
        assert_eq!([PathSums::default(), dark, unseen].map(|sums| sums.given_up_share()), [0.0, 1.0, 1.0]);
    }

    /// A Lambertian floor of one unit, and above it, at a distance, a wall of half a unit across it that faces +y.
    pub(crate) fn floor_under_wall(distance: f64) -> SmallScale {
        let mut small = small(GROOVES);
        let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let floor = [at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(1.0, 1.0, 0.0), at(0.0, 1.0, 0.0)];
        let wall = [(1.0, 0.0), (0.0, 0.0), (0.0, 0.5), (1.0, 0.5)].map(|(x, z)| at(x, 0.5, distance + z));
        let triangles = vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]];
        let part_of_triangle = vec![0; triangles.len()];
        small.surface_of_triangle = vec![0; triangles.len()];
        let vertices = [floor, wall].concat();
        small.tile = Tile { vertices, triangles, part_of_triangle, period: DVec2::ONE, grid: None, uv: None, ..small.tile };
        small
    }

    #[test]
    fn bounces_that_are_given_up_count_with_the_brightest_that_another_one_saw() {
        let texels = |distance: f64| {
            let small = floor_under_wall(distance);
            let tracer = TexelTracer { scene: TransportScene::new(&small).unwrap(), options: OPTIONS, paths: 4 };
            let pair = Pair { wi: DVec3::new(0.0, 0.3, 1.0).normalize(), wo: DVec3::Z };
            let mut sums = PathSums::default();
            (0..SIZE).for_each(|column| sums.add(&tracer.texel(pair, 0, [column, column])));
            sums
        };
        // What climbs less than .15 a period is given up on its way to walls 1e4 away.
        let [near, far] = [0.1, 1e4].map(texels);
        let [truth, found] = [near, far].map(|sums| sums.colour.iter().sum::<f64>());
        assert!(near.given_up_share() == 0.0 && found > 0.0 && far.lost == 0 && far.doubtful == 0.0, "{far:?}");
        // In light that is missing: what the near walls send more, of which 384 paths tell a tenth.
        let missing = truth / found - 1.0;
        assert!(missing > 0.01 && far.given_up_share() > 0.8 * missing, "{missing} and {}", far.given_up_share());
    }
}
