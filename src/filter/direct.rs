//! The direct method: facets shared by all pairs, visibility for exactly the wanted directions, direct sums.
//!
//! Facets are added in blocks that double their number until the estimated error meets the tolerance; sums made so far are kept.

use super::demand::Demand;
use super::importance::{self, Known};
use super::lobes::{self, Lobe};
use super::sums::{self, PairSums};
use super::{Control, Effective, Quality, Summary, Value};
use crate::brdf::Brdf;
use crate::direction::Pair;
use crate::error::{Error, Result};
use crate::facets::{self, Density, Facets, Runs, SETS, Surface};
use crate::low_discrepancy::hash;
use crate::material::{SmallScale, Tint};
use crate::visibility::rays::{Occlusion, PeriodicBvh};
use crate::visibility::{Bits, raster};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::OnceLock;

/// Fewest samples: below this the spread of eight sets says little.
pub const MIN_SAMPLES: u32 = 2048;
/// Most samples.
pub const MAX_SAMPLES: u32 = 1 << 22;
/// Samples traced and summed at once: their bits and positions are all that is held.
const BATCH: u32 = 1 << 16;
/// To keep a tolerance, stop when this times the estimate is within it: an estimate is within 1.5 of its own true error in
/// most runs only (`numerics.md`, section 3.6).
const SAFETY: f64 = 1.5;

/// Sums so far: for each pair, and for each direction, a value a set.
#[derive(Default)]
struct Accumulated {
    samples: u32,
    pairs: Vec<PairSums>,
    area: Vec<[f64; SETS]>,
}

/// Halves of the sets, side by side, become the first four sets; the other four come from `new`.
fn merge<T: Copy>(old: &[T; SETS], new: &[T; SETS], add: impl Fn(T, T) -> T) -> [T; SETS] {
    std::array::from_fn(|r| if r < SETS / 2 { add(old[2 * r], old[2 * r + 1]) } else { add(new[2 * r - SETS], new[2 * r - SETS + 1]) })
}

/// Samples after which, if many more are needed, they go where a pilot run of as many finds them worth most.
const PILOT_SAMPLES: u32 = 8192;
/// Stretches of the surface that the pilot run tells apart.
const STRETCHES: usize = 1024;

/// All that a run holds.
struct Run<'a> {
    small: &'a SmallScale,
    surface: Surface,
    rays: OnceLock<Result<PeriodicBvh>>,
    demand: Demand,
    tasks: Vec<Range<usize>>,
    lobes: Vec<Vec<Lobe<'a>>>,
    density: Density,
    seed: u32,
    control: Control<'a>,
    /// Seconds of each stage.
    seconds: [f64; 4],
}

/// Names of the stages.
const STAGES: [&str; 4] = ["prepare", "facets", "visibility", "sums"];

pub(super) fn direct(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    let start = (control.clock)();
    let surface = Surface::new(small);
    // Tables need not be reciprocal; every model is.
    let symmetric = !small.surfaces.iter().any(|s| matches!(s.brdf, Brdf::Measured(_)));
    let demand = Demand::new(pairs, symmetric);
    let lobes = small.surfaces.iter().map(|s| {
        let tint = if let Tint::Uniform(tint) = s.tint { tint } else { [1.0; 3] };
        lobes::lobes(&s.brdf, tint)
    });
    let mut run = Run {
        small,
        rays: OnceLock::new(),
        lobes: lobes.collect(),
        density: Density::uniform(&surface),
        tasks: demand.tasks(),
        seed: hash(hash(quality.seed as u32) ^ (quality.seed >> 32) as u32),
        control: *control,
        seconds: [0.0; 4],
        demand,
        surface,
    };
    run.seconds[0] = (control.clock)() - start;
    let mut step = Step::Fresh(MIN_SAMPLES);
    let mut weighted = false;
    let mut total = Accumulated::default();
    loop {
        let pilot;
        (total, pilot) = match step {
            Step::Fresh(samples) => run.block(0, samples)?,
            Step::Double => {
                let (new, _) = run.block(total.samples, total.samples)?;
                (total.merge(&new), None)
            }
        };
        let (values, relative_rms) = finish(&total, &run.demand, pairs);
        let wanted = needed(total.samples, SAFETY * relative_rms / quality.tolerance);
        if SAFETY * relative_rms <= quality.tolerance || total.samples == MAX_SAMPLES {
            let summary = Summary {
                method: "direct",
                plan: format!("direct:{}", total.samples),
                facets: total.samples as usize,
                clusters: total.samples as usize,
                directions: run.demand.directions.len(),
                stages: STAGES.iter().zip(run.seconds).map(|(&name, seconds)| (name, 1e3 * seconds)).collect(),
                relative_rms,
                notes: Vec::new(),
            };
            return Ok(Effective { values, summary });
        }
        step = if weighted || wanted <= 2 * total.samples {
            Step::Double
        } else if total.samples < PILOT_SAMPLES {
            Step::Fresh(wanted.min(PILOT_SAMPLES))
        } else {
            let (facets, bits) = pilot.expect("a pilot run fits one batch");
            run.weigh(&facets, &bits, &values);
            weighted = true;
            // Weighted samples are worth two to four others.
            Step::Fresh((wanted / 4).max(PILOT_SAMPLES))
        };
    }
}

/// What to do next.
enum Step {
    /// Start again with this many samples.
    Fresh(u32),
    /// Add as many as there are.
    Double,
}

/// Samples, a power of two, that bring an error down by `factor`: it falls with the samples to about this power (measured, .63 to .8).
fn needed(samples: u32, factor: f64) -> u32 {
    const RATE: f64 = 0.75;
    let wanted = f64::from(samples) * factor.max(1.0).powf(1.0 / RATE);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
    let wanted = wanted.clamp(1.0, f64::from(MAX_SAMPLES)) as u32;
    wanted.next_power_of_two()
}

impl Run<'_> {
    /// Sums of the samples `start..start + length`; and facets and bits, if they fit one batch.
    fn block(&mut self, start: u32, length: u32) -> Result<(Accumulated, Option<(Facets, Bits)>)> {
        let mut sums = Accumulated {
            samples: start + length,
            pairs: vec![[[0.0; 3]; SETS]; self.demand.pairs.len()],
            area: vec![[0.0; SETS]; self.demand.directions.len()],
        };
        let batches = length.div_ceil(BATCH);
        let mut last = None;
        for part in 0..batches {
            let (facets, bits) = self.batch(Runs::of_block(start, length, part, batches))?;
            let before = (self.control.clock)();
            add(&facets, &bits, &self.demand, &self.tasks, &self.lobes, &mut sums);
            self.seconds[3] += (self.control.clock)() - before;
            last = Some((facets, bits));
        }
        Ok((sums, last.filter(|_| batches == 1)))
    }

    /// Facets and what they see.
    fn batch(&mut self, runs: Runs) -> Result<(Facets, Bits)> {
        self.control.check()?;
        let clock = self.control.clock;
        let start = clock();
        let facets = facets::sample(self.small, &self.surface, &self.density, runs, self.seed);
        let sampled = clock();
        let bits = self.see(&facets)?;
        self.seconds[1] += sampled - start;
        self.seconds[2] += clock() - sampled;
        Ok((facets, bits))
    }

    /// Chooses where further samples go, by a pilot run over `facets` whose values were `values`.
    fn weigh(&mut self, facets: &Facets, bits: &Bits, values: &[Value]) {
        let known = |k: usize| Known { q: values[k].fbar.iter().sum::<f64>() / 3.0, a: values[k].av };
        let importance = importance::importance(facets, bits, &self.demand, &self.lobes, known, STRETCHES);
        self.density = self.density.weighted(&importance);
    }

    /// Visibility of the facets in all directions: by projection, or by rays where the projection spans too many periods.
    fn see(&self, facets: &Facets) -> Result<Bits> {
        let words = facets.triangle.len() / 64;
        let mut rows = vec![0; words * self.demand.directions.len()];
        let far = |w: DVec3| raster::reach(&self.surface, w) > raster::MAX_REACH;
        if self.demand.directions.iter().any(|&w| far(w)) {
            if let Err(error) = self.rays.get_or_init(|| PeriodicBvh::new(&self.small.tile)) {
                return Err(Error::Numeric(error.to_string()));
            }
        }
        rows.par_chunks_mut(words.max(1)).zip(&self.demand.directions).for_each_init(
            raster::Scratch::default,
            |scratch, (row, &direction)| {
                if self.control.check().is_err() {
                    return;
                }
                match self.rays.get() {
                    Some(Ok(rays)) if far(direction) => trace(&self.surface, rays, facets, direction, row),
                    _ => raster::visible(&self.surface, facets, direction, scratch, row),
                }
            },
        );
        self.control.check()?;
        Ok(Bits { words, rows })
    }
}

/// Visibility of the facets in one direction by rays.
fn trace(surface: &Surface, rays: &PeriodicBvh, facets: &Facets, direction: DVec3, row: &mut [u64]) {
    for (f, (&triangle, &position)) in facets.triangle.iter().zip(&facets.position).enumerate() {
        if triangle != facets::NO_TRIANGLE && surface.normals[triangle as usize].dot(direction) > 0.0 {
            let origin = position * surface.unit;
            let seen = rays.occluded(surface.tile_triangle[triangle as usize] as usize, origin, direction) != Occlusion::Blocked;
            row[f / 64] |= u64::from(seen) << (f % 64);
        }
    }
}

impl Accumulated {
    /// Sums of these samples and of as many new ones.
    fn merge(&self, new: &Self) -> Self {
        let add = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
        Self {
            samples: new.samples,
            pairs: self.pairs.iter().zip(&new.pairs).map(|(a, b)| merge(a, b, add)).collect(),
            area: self.area.iter().zip(&new.area).map(|(a, b)| merge(a, b, |x, y| x + y)).collect(),
        }
    }
}

fn add(facets: &Facets, bits: &Bits, demand: &Demand, tasks: &[Range<usize>], lobes: &[Vec<Lobe<'_>>], out: &mut Accumulated) {
    out.area.par_iter_mut().zip(&demand.directions).enumerate().for_each(|(d, (area, &direction))| {
        for (sum, new) in area.iter_mut().zip(sums::visible_area(facets, direction, bits.row(d))) {
            *sum += new;
        }
    });
    let mut rest = &mut out.pairs[..];
    let mut slices = Vec::with_capacity(tasks.len());
    for task in tasks {
        let (slice, after) = rest.split_at_mut(task.len());
        slices.push(slice);
        rest = after;
    }
    slices.into_par_iter().zip(tasks).for_each(|(slice, task)| sums::add_pairs(facets, bits, demand, task.clone(), lobes, slice));
}

/// Values with standard errors, and the relative RMS error.
fn finish(sums: &Accumulated, demand: &Demand, pairs: &[Pair]) -> (Vec<Value>, f64) {
    let n = f64::from(sums.samples);
    let set = |v: f64| v * SETS as f64 / n;
    let mut spread = [0.0; 3];
    let mut energy = 0.0;
    let values: Vec<Value> = demand
        .wanted
        .iter()
        .zip(pairs)
        .map(|(wanted, pair)| {
            let Some(wanted) = wanted else { return Value::default() };
            let s = sums.pairs[wanted.pair as usize];
            let a = sums.area[wanted.viewer as usize].map(set);
            let mean_a = a.iter().sum::<f64>() / SETS as f64;
            let mut value = Value { av: mean_a, ..Value::default() };
            let cos = pair.wi.z.max(crate::direction::MIN_COSINE);
            for c in 0..3 {
                let s: [f64; SETS] = std::array::from_fn(|r| set(s[r][c]));
                let mean_s = s.iter().sum::<f64>() / SETS as f64;
                let q = if mean_a > 0.0 { mean_s / mean_a } else { 0.0 };
                let d: [f64; SETS] = std::array::from_fn(|r| s[r] - q * a[r]);
                let variances = [spread_of(&d, 1), spread_of(&d, 2), spread_of(&d, 4)];
                if mean_a > 0.0 {
                    for (sum, v) in spread.iter_mut().zip(variances) {
                        *sum += v / (mean_a * mean_a);
                    }
                    value.se[c] = variances[0].sqrt() / mean_a;
                }
                energy += q * q;
                value.s[c] = mean_s;
                value.fbar[c] = q;
                value.fhat[c] = q / cos;
                value.s_se[c] = spread_of(&s, 1).sqrt();
            }
            value
        })
        .collect();
    let factor = falls(spread);
    let mut values = values;
    for v in &mut values {
        v.se = v.se.map(|x| x * factor);
        v.s_se = v.s_se.map(|x| x * factor);
    }
    let rms = spread[0].sqrt() * factor;
    (values, if energy > 0.0 { rms / energy.sqrt() } else { rms })
}

/// Variance of the mean of the sets, from the spread of groups of `size` of them.
fn spread_of(d: &[f64; SETS], size: usize) -> f64 {
    let groups = SETS / size;
    let mean = d.iter().sum::<f64>() / SETS as f64;
    let squares: f64 = d.chunks_exact(size).map(|g| (g.iter().sum::<f64>() / size as f64 - mean).powi(2)).sum();
    squares / (groups * (groups - 1)) as f64
}

/// How much smaller the error is than eight independent sets would make it.
fn falls(spread: [f64; 3]) -> f64 {
    if spread.iter().any(|&s| s <= 0.0) {
        return 1.0;
    }
    // A line through the logarithms at 8, 4 and 2 groups, weighted by their degrees of freedom, continued to the whole.
    let y = spread.map(f64::ln);
    let w = [7.0, 3.0, 1.0];
    let total: f64 = w.iter().sum();
    let mean_x = (w[1] + 2.0 * w[2]) / total;
    let mean_y = (w[0] * y[0] + w[1] * y[1] + w[2] * y[2]) / total;
    let (mut xy, mut xx) = (0.0, 0.0);
    for k in 0..3 {
        xy += w[k] * (k as f64 - mean_x) * (y[k] - mean_y);
        xx += w[k] * (k as f64 - mean_x).powi(2);
    }
    let slope = (xy / xx).clamp(-std::f64::consts::LN_2, 0.0);
    (1.5 * slope).exp()
}
