//! The direct method: facets shared by all pairs, visibility for exactly the wanted directions, direct sums.
//!
//! Facets are added in blocks that double their number until the estimated error meets the tolerance; sums made so far are kept.

use super::demand::Demand;
use super::lobes::{self, Lobe};
use super::sums::{self, PairSums};
use super::{Control, Effective, Quality, Summary, Value};
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::{self, Density, Facets, Runs, SETS, Surface};
use crate::material::{SmallScale, Tint};
use crate::visibility::{Bits, raster};
use rayon::prelude::*;

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
struct Accumulated {
    samples: u32,
    pairs: Vec<PairSums>,
    area: Vec<[f64; SETS]>,
}

/// Halves of the sets, side by side, become the first four sets; the other four come from `new`.
fn merge<T: Copy>(old: &[T; SETS], new: &[T; SETS], add: impl Fn(T, T) -> T) -> [T; SETS] {
    std::array::from_fn(|r| if r < SETS / 2 { add(old[2 * r], old[2 * r + 1]) } else { add(new[2 * r - SETS], new[2 * r - SETS + 1]) })
}

pub(super) fn direct(small: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    let start = (control.clock)();
    let surface = Surface::new(small);
    let demand = Demand::new(pairs, true);
    let lobes: Vec<Vec<Lobe<'_>>> = small
        .surfaces
        .iter()
        .map(|s| match &s.tint {
            Tint::Uniform(tint) => lobes::lobes(&s.brdf, *tint),
            Tint::Image(_) => lobes::lobes(&s.brdf, [1.0; 3]),
        })
        .collect();
    let density = Density::new(&surface, |_| 1.0);
    let seed = facets::hash((quality.seed ^ quality.seed >> 32) as u32);
    let tasks = demand.tasks();
    let mut stages = [("prepare", (control.clock)() - start), ("facets", 0.0), ("visibility", 0.0), ("sums", 0.0)];
    let mut total: Option<Accumulated> = None;
    loop {
        let done = total.as_ref().map_or(0, |t| t.samples);
        let block = if done == 0 { 0..MIN_SAMPLES } else { done..2 * done };
        let mut new = Accumulated {
            samples: block.end,
            pairs: vec![[[0.0; 3]; SETS]; demand.pairs.len()],
            area: vec![[0.0; SETS]; demand.directions.len()],
        };
        // A batch takes the same share of each of the eight sub-blocks, so that each stays a set.
        let batches = (block.end - block.start).div_ceil(BATCH);
        for part in 0..batches {
            control.check()?;
            let t0 = (control.clock)();
            let batch =
                facets::sample(small, &surface, &density, Runs::of_block(block.start, block.end - block.start, part, batches), seed);
            let t1 = (control.clock)();
            let bits = see(&surface, &batch, &demand);
            let t2 = (control.clock)();
            add(&batch, &bits, &demand, &tasks, &lobes, &mut new);
            let t3 = (control.clock)();
            for (stage, seconds) in stages[1..].iter_mut().zip([t1 - t0, t2 - t1, t3 - t2]) {
                stage.1 += seconds;
            }
        }
        let merged = match total {
            None => new,
            Some(old) => {
                let add3 = |a: [f64; 3], b: [f64; 3]| [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
                Accumulated {
                    samples: new.samples,
                    pairs: old.pairs.iter().zip(&new.pairs).map(|(a, b)| merge(a, b, add3)).collect(),
                    area: old.area.iter().zip(&new.area).map(|(a, b)| merge(a, b, |x, y| x + y)).collect(),
                }
            }
        };
        let result = finish(&merged, &demand, pairs);
        if SAFETY * result.1 <= quality.tolerance || 2 * merged.samples > MAX_SAMPLES {
            let summary = Summary {
                method: "direct",
                plan: format!("direct:{}", merged.samples),
                facets: merged.samples as usize,
                clusters: merged.samples as usize,
                directions: demand.directions.len(),
                stages: stages.iter().map(|&(name, seconds)| (name, 1e3 * seconds)).collect(),
                relative_rms: result.1,
                notes: Vec::new(),
            };
            return Ok(Effective { values: result.0, summary });
        }
        total = Some(merged);
    }
}

fn see(surface: &Surface, facets: &Facets, demand: &Demand) -> Bits {
    let words = facets.triangle.len() / 64;
    let mut rows = vec![0; words * demand.directions.len()];
    rows.par_chunks_mut(words).zip(&demand.directions).for_each_init(raster::Scratch::default, |scratch, (row, &direction)| {
        raster::visible(surface, facets, direction, scratch, row);
    });
    Bits { words, rows }
}

fn add(facets: &Facets, bits: &Bits, demand: &Demand, tasks: &[std::ops::Range<usize>], lobes: &[Vec<Lobe<'_>>], out: &mut Accumulated) {
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
    if spread[0] <= 0.0 || spread[1] <= 0.0 {
        return 1.0;
    }
    let k = (spread[1] / spread[0]).clamp(0.25, 1.0);
    k.powf(1.5)
}
