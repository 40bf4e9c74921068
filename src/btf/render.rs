//! Images of a tile from many sides in many lights: a tolerance in, texels with standard errors out.

use super::cover::{Cover, cover};
use super::reference_plane::ReferencePlane;
use super::seen::{Scene, Seen, Sum};
use crate::error::Result;
use crate::facets::REPLICATES;
use crate::filter::{Control, FacetSampler, surface_lobes};
use crate::material::SmallScale;
use crate::numerics::cast::{narrow, truncate_usize};
use crate::visibility::{Bits, PeriodicBvh};
use glam::DVec3;
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Samples of the surface for each texel that a pilot begins with. Chosen, not measured: two for each replicate.
const FIRST_SAMPLES: usize = 16;
/// Most samples. Chosen, not measured: they and their visibility bits for 162 directions are about 600 MB by the size of their arrays.
const MOST_SAMPLES: usize = 1 << 23;
/// Most samples for each texel: sums of a replicate's in f32 stay right to 1e-4.
const MOST_OF_TEXEL: usize = 1 << 17;
/// Views and lights of each that the pilot looks at.
const PILOT: [usize; 2] = [6, 16];
/// Share of the tolerance that the pilot must keep, since the other pairs may be worse. Chosen, not measured.
const PILOT_SHARE: f64 = 0.9;
/// Rays along each side of a texel that is partly covered, times the root of the tolerance. Chosen, not measured: their error falls with the power 1.5 of it, and few texels
/// have edges.
const COVER_RAYS: f64 = 1.6;

/// A view and the lights that it is asked in, unit vectors above the horizon.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewLights {
    /// To the viewer.
    pub wo: DVec3,
    /// To the lights.
    pub lights: Vec<DVec3>,
}

/// What is asked of a tile.
#[derive(Clone, Copy, Debug)]
pub struct BtfQuestion<'a> {
    /// Texels.
    pub plane: ReferencePlane,
    /// Views, each with its lights.
    pub views: &'a [ViewLights],
    /// Largest standard error of all texels together, root mean square over root mean square.
    pub tolerance: f64,
    /// Seed of the samples.
    pub seed: u32,
}

/// Mean of an image over its texels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ImageMean {
    /// Mean of `B`, 1/sr.
    pub mean: [f64; 3],
    /// Its standard error.
    pub error: [f64; 3],
}

/// The images of one view.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewImages {
    /// `B`, 1/sr: light after light, each texel after texel, row 0 that of the largest y.
    pub value: Vec<[f32; 3]>,
    /// Standard errors of it.
    pub error: Vec<[f32; 3]>,
    /// By texel the share that shows front faces, and that shows anything.
    pub cover: Vec<[f32; 2]>,
    /// By light.
    pub means: Vec<ImageMean>,
    /// Texels of which no sample was seen although they are covered; they have what a neighbour shows, and an error as large as that.
    pub filled: usize,
    /// Variances of all texels and lights together by the spread of the replicates, and by that of their halves.
    pub(super) variances: [f64; 2],
}

/// What was done.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BtfSummary {
    /// Samples of the surface.
    pub samples: usize,
    /// Standard errors of all texels, root mean square over that of the values; absolute where all values are 0.
    pub relative_rms: f64,
    /// See [`ViewImages::filled`], of all views.
    pub filled: usize,
    /// Rays that were followed through as many periods as rays are, and counted as free.
    pub given_up: usize,
}

/// Sums of squares over texels and pairs.
#[derive(Clone, Copy, Debug, Default)]
struct Squares {
    errors: f64,
    values: f64,
    /// Variances of the texels by the spread of the eight replicates, and by that of their two halves.
    by_eighths: f64,
    by_halves: f64,
}

impl Squares {
    fn add(&mut self, images: &ViewImages) {
        let sum = |of: &[[f32; 3]]| of.iter().flatten().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>();
        self.errors += sum(&images.error);
        self.values += sum(&images.value);
        self.by_eighths += images.variances[0];
        self.by_halves += images.variances[1];
    }

    fn relative_rms(self) -> f64 {
        if self.values > 0.0 { (self.errors / self.values).sqrt() } else { self.errors.sqrt() }
    }

    /// What standard errors by the spread of the replicates are multiplied by. A block of the sequence is spread better over the surface than eight of an eighth of
    /// its length: where variances fall as `N^-a`, the spread of `k` parts of `N` samples tells `k^(a - 1)` times the variance of all. So the halves tell
    /// `2^(a - 1)` and the eighths `8^(a - 1)` times it (`docs/numerics.md`, section 3.6).
    fn correction(self) -> f64 {
        if self.by_eighths > 0.0 && self.by_halves > 0.0 {
            (self.by_halves / self.by_eighths).powf(0.75).clamp(LEAST_CORRECTION, 1.0)
        } else {
            1.0
        }
    }
}

/// Least correction. Chosen, not measured: texels that hold few samples gain less than others.
const LEAST_CORRECTION: f64 = 0.3;

/// Renders a BTF in direct light, view after view: each is handed to `sink` when it is done, in order.
///
/// The number of samples is the least power of two with which some of the pairs keep the tolerance; the summary has the error of all of them. The same tile,
/// question and seed give the same bits at any number of threads.
///
/// # Errors
/// `Interrupted`; a surface that rays cannot be traced to; what `sink` says.
pub fn render(
    small: &SmallScale,
    question: BtfQuestion<'_>,
    control: &Control<'_>,
    sink: &mut dyn FnMut(usize, ViewImages) -> Result<()>,
) -> Result<BtfSummary> {
    let rendering = Rendering {
        small,
        question,
        sampler: FacetSampler::new(small, None, question.seed, control),
        rays: PeriodicBvh::new(&small.tile)?,
        control,
    };
    let (samples, correction) = control.part(0.0..0.2, |control| rendering.samples(control))?;
    control.part(0.2..1.0, |control| rendering.all((samples, correction), question.views, control, sink)).map(|(summary, _)| summary)
}

struct Rendering<'a> {
    small: &'a SmallScale,
    question: BtfQuestion<'a>,
    sampler: FacetSampler<'a>,
    rays: PeriodicBvh,
    control: &'a Control<'a>,
}

impl Rendering<'_> {
    /// How many samples keep the tolerance in some of the pairs, or the most, and the [`Squares::correction`] with so many.
    fn samples(&self, control: &Control<'_>) -> Result<(usize, f64)> {
        let views: Vec<ViewLights> = spread(self.question.views, PILOT[0])
            .map(|view| ViewLights { wo: view.wo, lights: spread(&view.lights, PILOT[1]).copied().collect() })
            .collect();
        let texels = self.question.plane.count().next_power_of_two();
        let most = MOST_SAMPLES.min(MOST_OF_TEXEL * texels);
        let mut samples = (FIRST_SAMPLES * texels).clamp(1 << 12, most);
        loop {
            (control.progress)("samples", 0.0);
            let quiet = Control { progress: &|_, _| {}, ..*control };
            let (found, squares) = self.all((samples, 1.0), &views, &quiet, &mut |_, _| Ok(()))?;
            let correction = squares.correction();
            let of_samples = (1.0 - correction * correction) * squares.by_eighths;
            let relative_rms = found.relative_rms * (1.0 - (of_samples / squares.errors.max(f64::MIN_POSITIVE)).min(1.0)).sqrt();
            let over = relative_rms / (PILOT_SHARE * self.question.tolerance);
            if over <= 1.0 || samples == most {
                return Ok((samples, correction));
            }
            // Errors of tiles fall as the samples to the power of -.75 or so (`docs/btf.md`): rather too few and looked at again than twice too many.
            let more = (samples as f64 * over.powf(4.0 / 3.0)).min(most as f64);
            // Four times as many at once at most: the first look has texels that few samples fell into, whose errors say little.
            let now = samples.ilog2() as usize;
            samples = 1 << truncate_usize(more.log2()).clamp(now + 1, now + 2).min(most.ilog2() as usize);
        }
    }

    /// The images of `views`, standard errors by the spread of the replicates times `correction`.
    fn all(
        &self,
        (samples, correction): (usize, f64),
        views: &[ViewLights],
        control: &Control<'_>,
        sink: &mut dyn FnMut(usize, ViewImages) -> Result<()>,
    ) -> Result<(BtfSummary, Squares)> {
        let facets = self.sampler.low_discrepancy(samples);
        let (directions, place) = distinct(views);
        let bits = self.sampler.see(&facets, &directions)?;
        let lobes = surface_lobes(&self.small.surfaces);
        let surface = &self.sampler.surface;
        let scene = Scene { facets: &facets, groups: &surface.groups, lobes: &lobes, plane: &self.question.plane, unit: surface.unit };
        let mut squares = Squares::default();
        let mut summary = BtfSummary { samples, ..BtfSummary::default() };
        for (v, view) in views.iter().enumerate() {
            control.check()?;
            (control.progress)("images", v as f64 / views.len() as f64);
            let images = self.view(scene, view, (&bits, &place), correction)?;
            squares.add(&images);
            summary.filled += images.filled;
            sink(v, images)?;
        }
        Ok((BtfSummary { relative_rms: squares.relative_rms(), given_up: self.sampler.given_up(), ..summary }, squares))
    }

    fn view(
        &self,
        scene: Scene<'_>,
        view: &ViewLights,
        (bits, place): (&Bits, &FxHashMap<[u64; 3], usize>),
        correction: f64,
    ) -> Result<ViewImages> {
        let wo = view.wo;
        let row = |w: DVec3| bits.row(place[&key(w)]);
        let seen = Seen::new(scene, wo, row(wo));
        let side = truncate_usize((COVER_RAYS / self.question.tolerance.sqrt()).clamp(4.0, 64.0));
        let check = || self.control.check();
        let is_seen = |texel: usize| seen.area[texel * REPLICATES..(texel + 1) * REPLICATES].iter().any(|&a| a > 0.0);
        let covers = cover(&self.rays, scene.plane, wo, (side, self.question.seed), &is_seen, &check)?;
        let texels = Texels::new(scene.plane, &seen.area, covers);
        let one = |sums: &mut Vec<Sum>, &wi: &DVec3| {
            sums.fill([0.0; 4]);
            seen.add_light(scene, wo, (wi, row(wi)), sums);
            texels.image(sums, correction)
        };
        let blank = || vec![[0.0; 4]; scene.plane.count() * REPLICATES];
        let images: Vec<Image> = view.lights.par_iter().map_init(blank, one).collect();
        check()?;
        let mut found = ViewImages {
            cover: texels.covers.iter().map(|c| [narrow(c.front), narrow(c.any)]).collect(),
            filled: texels.filled,
            ..ViewImages::default()
        };
        for image in images {
            found.value.extend(image.value);
            found.error.extend(image.error);
            found.means.push(image.mean);
            (0..2).for_each(|k| found.variances[k] += image.variances[k]);
        }
        steady(&mut found.means);
        Ok(found)
    }
}

/// The spread of eight replicates tells a standard error to a quarter only: each is taken together, half and half, with what all lights say of it, the same share of
/// the mean.
fn steady(means: &mut [ImageMean]) {
    let squares = |of: fn(&ImageMean) -> [f64; 3]| means.iter().flat_map(of).map(|v| v * v).sum::<f64>();
    let all = squares(|m| m.mean);
    if all > 0.0 {
        let share = squares(|m| m.error) / all;
        for m in means {
            (0..3).for_each(|c| m.error[c] = (0.5 * (m.error[c].powi(2) + share * m.mean[c].powi(2))).sqrt());
        }
    }
}

/// About `count` elements of a list, at equal distances, the first and the last among them.
fn spread<T>(of: &[T], count: usize) -> impl Iterator<Item = &T> {
    let count = count.min(of.len());
    (0..count).map(move |k| &of[k * (of.len() - 1) / (count - 1).max(1)])
}

fn key(w: DVec3) -> [u64; 3] {
    w.to_array().map(f64::to_bits)
}

/// The directions of views and lights, each once, and their places.
fn distinct(views: &[ViewLights]) -> (Vec<DVec3>, FxHashMap<[u64; 3], usize>) {
    let (mut directions, mut place) = (Vec::new(), FxHashMap::default());
    for w in views.iter().flat_map(|view| std::iter::once(view.wo).chain(view.lights.iter().copied())) {
        place.entry(key(w)).or_insert_with(|| {
            directions.push(w);
            directions.len() - 1
        });
    }
    (directions, place)
}

/// The texels of a view, whatever the light.
struct Texels<'a> {
    area: &'a [f32],
    covers: Vec<Cover>,
    /// The texel whose facets stand for those of each texel: itself, where any is seen.
    stand_in: Vec<usize>,
    filled: usize,
}

/// One image.
struct Image {
    value: Vec<[f32; 3]>,
    error: Vec<[f32; 3]>,
    mean: ImageMean,
    /// See [`ViewImages::variances`].
    variances: [f64; 2],
}

impl<'a> Texels<'a> {
    fn new(plane: &ReferencePlane, area: &'a [f32], covers: Vec<Cover>) -> Self {
        let is_seen = |texel: usize| area[texel * REPLICATES..(texel + 1) * REPLICATES].iter().any(|&a| a > 0.0);
        let is_empty = !(0..plane.count()).any(is_seen);
        // What shows nothing needs none; where nothing at all was seen there is none.
        let one = |t: usize| if is_empty || is_seen(t) || covers[t].front <= 0.0 { t } else { nearest(plane, t, &is_seen).unwrap_or(t) };
        let stand_in: Vec<usize> = (0..plane.count()).into_par_iter().map(one).collect();
        let filled = (0..plane.count()).filter(|&t| covers[t].front > 0.0 && !is_seen(t)).count();
        Self { area, covers, stand_in, filled }
    }

    /// Light over area of each texel, times its cover. The ratio leaves out by how much the number of samples that fell into a texel differs from what it should be.
    fn image(&self, sums: &[Sum], correction: f64) -> Image {
        let count = self.covers.len();
        let (mut value, mut error) = (vec![[0.0; 3]; count], vec![[0.0; 3]; count]);
        let (mut mean, mut of_replicates, mut of_cover) = ([0.0; 3], [[0.0; 3]; REPLICATES], [0.0; 3]);
        let mut variances = [0.0; 2];
        // What the whole image shows of what was seen: nothing else is known of a texel that one sample fell into, or none.
        let area: f64 = self.area.iter().map(|&a| f64::from(a)).sum();
        let usual: [f64; 3] = std::array::from_fn(|c| sums.iter().map(|s| f64::from(s[c])).sum::<f64>() / area.max(f64::MIN_POSITIVE));
        for texel in 0..count {
            let from = self.stand_in[texel] * REPLICATES;
            let (area, light) = (&self.area[from..from + REPLICATES], &sums[from..from + REPLICATES]);
            let whole: f64 = area.iter().map(|&a| f64::from(a)).sum();
            if whole <= 0.0 {
                continue;
            }
            let Cover { front, error: of_front, .. } = self.covers[texel];
            // Replicates of which nothing fell into the texel deviate by nothing: those that did tell its spread.
            let parts = area.iter().filter(|&&a| a > 0.0).count();
            let is_told = self.stand_in[texel] == texel && parts > 1;
            let unbiased = parts as f64 / (parts.max(2) - 1) as f64;
            for c in 0..3 {
                let ratio = light.iter().map(|s| f64::from(s[c])).sum::<f64>() / whole;
                let (mut squares, mut halves) = (0.0, [0.0; 2]);
                for r in 0..REPLICATES {
                    let off = (f64::from(light[r][c]) - ratio * f64::from(area[r])) / whole;
                    squares += off * off;
                    halves[2 * r / REPLICATES] += off;
                    of_replicates[r][c] += front * off;
                }
                variances[0] += front * front * unbiased * squares;
                variances[1] += front * front * 2.0 * (halves[0] * halves[0] + halves[1] * halves[1]);
                let spread = if is_told { correction * (unbiased * squares).sqrt() } else { ratio.max(usual[c]) };
                value[texel][c] = narrow(front * ratio);
                error[texel][c] = narrow((front * spread).hypot(of_front * ratio));
                mean[c] += front * ratio;
                of_cover[c] += (of_front * ratio).powi(2);
            }
        }
        let share = 1.0 / count as f64;
        let spread = |c: usize| (UNBIASED * of_replicates.iter().map(|r| r[c] * r[c]).sum::<f64>() + of_cover[c]).sqrt();
        Image {
            value,
            error,
            variances,
            mean: ImageMean { mean: mean.map(|m| share * m), error: std::array::from_fn(|c| share * spread(c)) },
        }
    }
}

/// What the sum of the squared deviations of the replicates' sums is multiplied by to be the variance of the sum of all.
const UNBIASED: f64 = REPLICATES as f64 / (REPLICATES as f64 - 1.0);

/// The nearest texel for which something holds, along rows and columns of the periodic image, if there is one.
fn nearest(plane: &ReferencePlane, texel: usize, holds: &dyn Fn(usize) -> bool) -> Option<usize> {
    let [columns, rows] = plane.texels;
    let (row, column) = (texel / columns, texel % columns);
    (1..columns.max(rows)).find_map(|d| {
        let ring = (0..=2 * d).flat_map(|k| [(0, k), (2 * d, k), (k, 0), (k, 2 * d)]);
        let wrap = |at: usize, step: usize, n: usize| (at + step + n * (d / n + 1) - d) % n;
        ring.map(|(y, x)| wrap(row, y, rows) * columns + wrap(column, x, columns)).find(|&t| holds(t))
    })
}
