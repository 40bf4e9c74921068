//! Facets of a surface and what they see, kept for a list of pairs: all that stays the same when only its materials change.

use super::cluster_sums::{ClusterViews, Clustered, ClusteredLobe};
use super::demand::Demand;
use super::estimate::{self, PairSums, Spread};
use super::lobes::{self, Lobe};
use super::sums::{self, Views};
use super::{Control, Effective, Quality, Value, direct};
use crate::clusters::Cluster;
use crate::direction::Pair;
use crate::error::{Error, Result};
use crate::facets::{self, Clustering, Density, Facets, Group, Runs, SETS, Surface};
use crate::material::{self, SmallScale, Tint};
use crate::simd::{self, Kernel};
use crate::visibility::{Bits, Horizon, Occlusion, PeriodicBvh, raster};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Samples of a batch: their bits and positions are what is held at once.
pub(super) const BATCH: u32 = 1 << 16;
/// What a triangle and a facet cost when they are projected along a direction, measured in nanoseconds; only ratios of costs matter.
pub(super) const PROJECTED_TRIANGLE: f64 = 40.0;
pub(super) const PROJECTED_FACET: f64 = 15.0;
/// Pairs whose sums are held at once when a long list is evaluated: 192 bytes each.
const GROUP_PAIRS: usize = 1 << 17;

/// What turns samples into facets that know what they see.
pub(super) struct Tracer<'a> {
    small: &'a SmallScale,
    /// The surface in the form that sampling and visibility use.
    pub surface: Surface,
    rays: OnceLock<Result<PeriodicBvh>>,
    /// For height fields.
    horizon: Option<Horizon>,
    /// Where samples go.
    pub density: Density,
    /// Seed of the samples.
    pub seed: u32,
    control: Control<'a>,
    /// Rays that were followed through as many periods as rays are, and counted as free.
    lost: AtomicUsize,
}

/// Facets, and the bits of some directions.
pub(super) struct Batch {
    /// The facets.
    pub facets: Facets,
    /// One row a direction.
    pub bits: Bits,
    /// Seconds that sampling and visibility took.
    pub seconds: [f64; 2],
}

impl<'a> Tracer<'a> {
    /// For a surface, with samples spread by area, its triangles clustered if that is wanted.
    pub fn new(small: &'a SmallScale, clustering: Option<&Clustering>, seed: u32, control: &Control<'a>) -> Self {
        let surface = Surface::new(small, clustering);
        let density = Density::uniform(&surface);
        Self {
            small,
            surface,
            rays: OnceLock::new(),
            horizon: Horizon::new(&small.tile),
            density,
            seed,
            control: *control,
            lost: AtomicUsize::new(0),
        }
    }

    /// For a surface in the form that sampling uses, and not clustered.
    pub fn of(small: &'a SmallScale, surface: Surface, control: &Control<'a>) -> Self {
        let density = Density::uniform(&surface);
        let horizon = Horizon::new(&small.tile);
        Self { small, surface, rays: OnceLock::new(), horizon, density, seed: 0, control: *control, lost: AtomicUsize::new(0) }
    }

    /// Whether the triangles are clustered by normal.
    pub fn is_clustered(&self) -> bool {
        self.surface.groups.iter().any(|g| g.cluster.is_some())
    }

    /// Reports the share of a stage that is done.
    fn report(&self, stage: &str, share: f64) {
        (self.control.progress)(stage, share);
    }

    /// Rays so far that were lost among the periods and counted as free.
    pub fn lost(&self) -> usize {
        self.lost.load(Ordering::Relaxed)
    }

    /// Facets of some samples, and what they see of `directions`.
    pub fn batch(&self, runs: Runs, directions: &[DVec3]) -> Result<Batch> {
        self.control.check()?;
        let clock = self.control.clock;
        let start = clock();
        let facets = facets::sample(self.small, &self.surface, &self.density, runs, self.seed);
        let sampled = clock();
        let bits = self.see(&facets, directions)?;
        Ok(Batch { facets, bits, seconds: [sampled - start, clock() - sampled] })
    }

    /// Visibility: by horizon angles where few azimuths have many directions; else by projection, or by rays where the projection spans
    /// too many periods. All three are exact.
    pub fn see(&self, facets: &Facets, directions: &[DVec3]) -> Result<Bits> {
        let words = facets.triangle.len() / 64;
        let mut bits = Bits { words, rows: vec![0; words * directions.len()] };
        let azimuths = by_azimuth(directions);
        if let Some(horizon) = &self.horizon
            && self.horizon_pays(facets.samples, azimuths.len(), directions.len())
        {
            self.see_horizons(horizon, facets, directions, &azimuths, &mut bits)?;
            return Ok(bits);
        }
        let far = |w: DVec3| raster::reach(&self.surface, w) > raster::MAX_REACH;
        if directions.iter().any(|&w| far(w))
            && let Err(error) = self.rays.get_or_init(|| PeriodicBvh::new(&self.small.tile))
        {
            return Err(Error::Numeric(error.to_string()));
        }
        // Some directions one after the other, so that they share the buffers.
        let rows = bits.rows.par_chunks_mut(words.max(1)).zip(directions).with_min_len(8);
        rows.for_each_init(raster::Scratch::default, |scratch, (row, &direction)| {
            if self.control.check().is_err() {
                return;
            }
            match self.rays.get() {
                Some(Ok(rays)) if far(direction) => self.trace(rays, facets, direction, row),
                _ => raster::visible(&self.surface, facets, direction, scratch, row),
            }
        });
        self.control.check()?;
        Ok(bits)
    }

    /// Whether horizon angles cost less than projections.
    fn horizon_pays(&self, samples: usize, azimuths: usize, directions: usize) -> bool {
        const ANGLE: f64 = 500.0;
        let projection = directions as f64 * (self.surface.triangles.len() as f64 * PROJECTED_TRIANGLE + samples as f64 * PROJECTED_FACET);
        azimuths as f64 * samples as f64 * ANGLE < projection
    }

    /// Visibility of all directions of each azimuth from one horizon angle a facet.
    fn see_horizons(
        &self,
        horizon: &Horizon,
        facets: &Facets,
        directions: &[DVec3],
        azimuths: &[(DVec2, Vec<usize>)],
        bits: &mut Bits,
    ) -> Result<()> {
        let words = bits.words;
        let rows: Vec<Vec<(usize, Vec<u64>)>> = azimuths
            .par_iter()
            .map(|(azimuth, members)| {
                let mut rows: Vec<(usize, Vec<u64>)> = members.iter().map(|&d| (d, vec![0; words])).collect();
                if self.control.check().is_err() {
                    return rows;
                }
                for (f, (&triangle, &position)) in facets.triangle.iter().zip(&facets.position).enumerate() {
                    if triangle == facets::NO_TRIANGLE {
                        continue;
                    }
                    let slope = horizon.slope(position * self.surface.unit, (azimuth.x, azimuth.y));
                    let normal = self.surface.normals[triangle as usize];
                    for (d, row) in &mut rows {
                        let w = directions[*d];
                        let seen = normal.dot(w) > 0.0 && w.z > slope * w.truncate().length();
                        row[f / 64] |= u64::from(seen) << (f % 64);
                    }
                }
                rows
            })
            .collect();
        self.control.check()?;
        for (d, row) in rows.into_iter().flatten() {
            bits.rows[d * words..(d + 1) * words].copy_from_slice(&row);
        }
        Ok(())
    }

    /// Visibility of the facets in one direction by rays.
    fn trace(&self, rays: &PeriodicBvh, facets: &Facets, direction: DVec3, row: &mut [u64]) {
        let surface = &self.surface;
        for (f, (&triangle, &position)) in facets.triangle.iter().zip(&facets.position).enumerate() {
            if triangle != facets::NO_TRIANGLE && surface.normals[triangle as usize].dot(direction) > 0.0 {
                let seen = match rays.occluded(surface.tile_triangle[triangle as usize] as usize, position * surface.unit, direction) {
                    Occlusion::Blocked => false,
                    Occlusion::Free => true,
                    Occlusion::GaveUp => {
                        self.lost.fetch_add(1, Ordering::Relaxed);
                        true
                    }
                };
                row[f / 64] |= u64::from(seen) << (f % 64);
            }
        }
    }
}

/// Distinct azimuths, each with the places of its directions. Straight up goes with the azimuth of x.
fn by_azimuth(directions: &[DVec3]) -> Vec<(DVec2, Vec<usize>)> {
    /// Azimuths that agree to this many radians are one: far less than a facet's f32 position tells.
    const SAME: f64 = 1e-9;
    let mut places: HashMap<[i64; 2], usize> = HashMap::new();
    let mut azimuths: Vec<(DVec2, Vec<usize>)> = Vec::new();
    for (d, w) in directions.iter().enumerate() {
        let azimuth = w.truncate().try_normalize().unwrap_or(DVec2::X);
        #[expect(clippy::cast_possible_truncation, reason = "at most 1e9")]
        let key = azimuth.to_array().map(|x| (x / SAME).round() as i64);
        let place = *places.entry(key).or_insert_with(|| {
            azimuths.push((azimuth, Vec::new()));
            azimuths.len() - 1
        });
        azimuths[place].1.push(d);
    }
    azimuths
}

/// Lobes of each surface, tinted.
pub(super) fn surface_lobes(surfaces: &[material::Surface]) -> Vec<Vec<Lobe<'_>>> {
    let of = |s: &'_ material::Surface| if let Tint::Uniform(tint) = s.tint { tint } else { [1.0; 3] };
    surfaces.iter().map(|s| lobes::lobes(&s.brdf, of(s))).collect()
}

/// Those of `directions`, with sums of visible `areas`, that a triangle faces and yet a whole set of samples shows nothing of: so few samples
/// see them that a spread of the sets does not tell the error.
pub(super) fn barely_seen(surface: &Surface, directions: &[DVec3], areas: &[[f64; SETS]]) -> Vec<DVec3> {
    let faced = |w: DVec3| surface.normals.iter().any(|n| n.dot(w) > 0.0);
    directions.iter().zip(areas).filter(|(w, sets)| sets.contains(&0.0) && faced(**w)).map(|(w, _)| *w).collect()
}

/// Adds the sums over a batch of visible area, one element a direction.
pub(super) fn add_areas(batch: &Batch, directions: &[DVec3], areas: &mut [[f64; SETS]]) {
    areas.par_iter_mut().zip(directions).enumerate().for_each(|(d, (area, &direction))| {
        for (sum, new) in area.iter_mut().zip(sums::visible_area(&batch.facets, direction, batch.bits.row(d))) {
            *sum += new;
        }
    });
}

/// How a batch is summed.
pub(super) struct Materials<'a> {
    /// Groups of the facets.
    pub groups: &'a [Group],
    /// Lobes of each surface.
    pub lobes: &'a [Vec<Lobe<'a>>],
    /// For each surface its lobes under its clusters, if there are clusters.
    clustered: Option<Vec<Vec<ClusteredLobe<'a>>>>,
}

impl<'a> Materials<'a> {
    /// For groups under the lobes of each surface; by clusters if the groups are some and `by_clusters` says so.
    pub fn new(groups: &'a [Group], lobes: &'a [Vec<Lobe<'a>>], by_clusters: bool) -> Self {
        let of = |s: usize| -> Vec<&Cluster> {
            groups.iter().filter(|g| usize::from(g.surface) == s).filter_map(|g| g.cluster.as_ref()).collect()
        };
        let clustered = (by_clusters && groups.iter().any(|g| g.cluster.is_some())).then(|| {
            let surface = |(s, lobes): (usize, &'a Vec<Lobe<'a>>)| {
                let clusters = of(s);
                lobes.iter().map(|lobe| ClusteredLobe::new(lobe, &clusters)).collect()
            };
            lobes.iter().enumerate().map(surface).collect()
        });
        Self { groups, lobes, clustered }
    }
}

/// Adds the sums over a batch of the pairs of `tasks`, a run of [`Demand::tasks`], one element a pair.
pub(super) fn add_pairs(batch: &Batch, demand: &Demand, tasks: &[Range<usize>], materials: &Materials<'_>, mut sums: &mut [PairSums]) {
    let mut slices = Vec::with_capacity(tasks.len());
    for task in tasks {
        let (slice, rest) = sums.split_at_mut(task.len());
        slices.push(slice);
        sums = rest;
    }
    let (facets, bits) = (&batch.facets, &batch.bits);
    let work = slices.into_par_iter().zip(tasks);
    let Some(clustered) = &materials.clustered else {
        work.for_each_init(Views::default, |views, (slice, task)| {
            sums::add_pairs(facets, bits, demand, task.clone(), materials.groups, materials.lobes, views, slice);
        });
        return;
    };
    // Clusters come with samples spread by area: every facet stands for the same.
    let weight = facets.weight.iter().copied().fold(0.0, f32::max).into();
    let words = |g: usize| facets.ranges[g].start / 64..facets.ranges[g].end / 64;
    let of = |s: usize| (0..materials.groups.len()).filter(|&g| usize::from(materials.groups[g].surface) == s).map(words).collect();
    let ranges: Vec<Vec<Range<usize>>> = (0..clustered.len()).map(of).collect();
    work.for_each_init(ClusterViews::default, |views, (slice, task)| {
        let (directions, pairs) = sums::of_task(bits, demand, task.clone());
        for (lobes, ranges) in clustered.iter().zip(&ranges) {
            Clustered { ranges, lobes, weight }.add(&directions, &pairs, views, slice);
        }
    });
}

/// Facets that know what they see, for a list of pairs. After an edit of materials only [`Prepared::evaluate`] must run again.
pub struct Prepared<'a> {
    pairs: &'a [Pair],
    demand: Demand,
    batches: Vec<Batch>,
    areas: Vec<[f64; SETS]>,
    groups: Vec<Group>,
    samples: u32,
}

/// Computes the values of a surface by the direct method, as [`super::effective`] does, and keeps the facets that they need and what these
/// see: a bit a facet and direction, and about 60 bytes a facet.
///
/// # Errors
/// Those of [`super::effective`].
pub fn prepare<'a>(small: &SmallScale, pairs: &'a [Pair], quality: &Quality, control: &Control<'_>) -> Result<(Prepared<'a>, Effective)> {
    let direct::Traced { effective, tracer, samples, .. } = direct::traced(small, pairs, quality, control, direct::Start::UNKNOWN)?;
    Ok((Prepared::new(&tracer, pairs, Demand::new(pairs, small.is_reciprocal()), samples)?, effective))
}

impl<'a> Prepared<'a> {
    /// The first `samples` samples of `tracer` and what they see; `demand` is that of `pairs`.
    pub(super) fn new(tracer: &Tracer<'_>, pairs: &'a [Pair], demand: Demand, samples: u32) -> Result<Self> {
        let parts = samples.div_ceil(BATCH);
        let mut batches = Vec::with_capacity(parts as usize);
        for part in 0..parts {
            batches.push(tracer.batch(Runs::of_block(0, samples, part, parts), &demand.directions)?);
            tracer.report("visibility", f64::from(part + 1) / f64::from(parts));
        }
        let mut areas = vec![[0.0; SETS]; demand.directions.len()];
        for batch in &batches {
            add_areas(batch, &demand.directions, &mut areas);
        }
        Ok(Self { pairs, demand, batches, areas, groups: tracer.surface.groups.clone(), samples })
    }

    /// Gives the demand back, for another number of samples.
    pub(super) fn into_demand(self) -> Demand {
        self.demand
    }

    /// Directions for which [`barely_seen`] holds, on the surface that the samples lie on.
    pub(super) fn barely_seen(&self, surface: &Surface) -> Vec<DVec3> {
        barely_seen(surface, &self.demand.directions, &self.areas)
    }

    /// Seconds that sampling and visibility took.
    pub(super) fn seconds(&self) -> [f64; 2] {
        self.batches.iter().fold([0.0; 2], |s, b| [s[0] + b.seconds[0], s[1] + b.seconds[1]])
    }

    /// Values of the pairs, in their order, with corrected standard errors, and their relative RMS error, under `surfaces`: those of the
    /// small-scale surface, with other BRDFs or uniform tints.
    ///
    /// # Errors
    /// [`Error::Interrupted`] when `control` asks to stop.
    pub fn evaluate(&self, surfaces: &[material::Surface], control: &Control<'_>) -> Result<(Vec<Value>, f64)> {
        let lobes = surface_lobes(surfaces);
        let materials = Materials::new(&self.groups, &lobes, true);
        // An edit may bring a table that is not reciprocal; directions and what they see stay.
        let both_ways = (self.demand.symmetric && !material::are_reciprocal(surfaces)).then(|| Demand::new(self.pairs, false));
        let demand = both_ways.as_ref().unwrap_or(&self.demand);
        let tasks = demand.tasks();
        // By pair, so that a group of pairs fills in its values and is forgotten.
        let order = &demand.order;
        let pair_of = |k: u32| demand.wanted[k as usize].expect("ordered places are wanted").pair as usize;
        let mut values = vec![Value::default(); self.pairs.len()];
        let mut spread = Spread::default();
        let (mut next_task, mut next_place) = (0, 0);
        while next_task < tasks.len() {
            control.check()?;
            let first = tasks[next_task].start;
            let end = next_task + tasks[next_task..].partition_point(|t| t.end <= first + GROUP_PAIRS).max(1);
            let group = &tasks[next_task..end];
            let last = group[group.len() - 1].end;
            let mut sums = vec![[[0.0; 3]; SETS]; last - first];
            for batch in &self.batches {
                add_pairs(batch, demand, group, &materials, &mut sums);
            }
            let place = next_place + order[next_place..].partition_point(|&k| pair_of(k) < last);
            let filled = Filled { demand, list: self.pairs, sums: &sums, first, areas: &self.areas, samples: self.samples };
            filled.write(&order[next_place..place], &mut values, &mut spread);
            next_place = place;
            (control.progress)("sums", last as f64 / demand.pairs.len() as f64);
            next_task = end;
        }
        correct(&mut values, &spread);
        Ok((values, spread.relative_rms()))
    }
}

/// Sums of some pairs, complete.
pub(super) struct Filled<'a> {
    /// What the list needs.
    pub demand: &'a Demand,
    /// The list.
    pub list: &'a [Pair],
    /// Sums of the pairs from `first` on.
    pub sums: &'a [PairSums],
    /// Place of the first pair in [`Demand::pairs`].
    pub first: usize,
    /// Sums of visible area, one a direction.
    pub areas: &'a [[f64; SETS]],
    /// Samples that were summed over.
    pub samples: u32,
}

impl Filled<'_> {
    /// Writes the values at the places `order` of the list, and adds to their spread.
    pub fn write(&self, order: &[u32], values: &mut [Value], spread: &mut Spread) {
        /// Values worked out at once; the same at any number of threads, as the sums of their spreads must be.
        const CHUNK: usize = 2048;
        let chunks: Vec<(Vec<Value>, Spread)> = order.par_chunks(CHUNK).map(|order| simd::run(Evaluate { filled: self, order })).collect();
        for (order, (chunk, of_chunk)) in order.chunks(CHUNK).zip(chunks) {
            for (&k, value) in order.iter().zip(chunk) {
                values[k as usize] = value;
            }
            *spread = spread.and(of_chunk);
        }
    }
}

struct Evaluate<'a> {
    filled: &'a Filled<'a>,
    order: &'a [u32],
}

impl Kernel for Evaluate<'_> {
    type Output = (Vec<Value>, Spread);

    #[inline(always)]
    fn run(self) -> (Vec<Value>, Spread) {
        let Filled { demand, list, sums, first, areas, samples } = *self.filled;
        let mut spread = Spread::default();
        let mut values = Vec::with_capacity(self.order.len());
        for &k in self.order {
            let wanted = demand.wanted[k as usize].expect("ordered places are wanted");
            let area = &areas[wanted.viewer as usize];
            values.push(estimate::value(&sums[wanted.pair as usize - first], area, samples, list[k as usize].wi.z, &mut spread));
        }
        (values, spread)
    }
}

/// Applies [`Spread::correction`] to the standard errors of values.
pub(super) fn correct(values: &mut [Value], spread: &Spread) {
    let factor = spread.correction();
    for value in values {
        for c in 0..3 {
            value.se[c] *= factor;
            value.s_se[c] *= factor;
        }
    }
}
