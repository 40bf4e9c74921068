//! Facets of some samples, and what they see: the visibility of exactly the directions of a query.

use super::control::Control;
use crate::error::{Error, Result};
use crate::facets::{self, Clustering, Density, Facets, Runs, Surface};
use crate::material::SmallScale;
use crate::visibility::Horizon;
use crate::visibility::{Bits, raster};
use crate::visibility::{Occlusion, PeriodicBvh};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Samples of a batch: their bits and positions are what is held at once. Chosen, not measured: a bit a direction, 8 KiB each.
pub(super) const BATCH: u32 = 1 << 16;

/// What visibility costs, in nanoseconds; only ratios matter. The projections were measured when they were written, by no command that is kept; of the
/// horizon angle no measurement is recorded.
struct VisibilityCosts {
    /// To project a triangle along a direction.
    projected_triangle: f64,
    /// To look up a facet in the projection.
    projected_facet: f64,
    /// The horizon angle of a facet in an azimuth.
    horizon_angle: f64,
}

const COSTS: VisibilityCosts = VisibilityCosts { projected_triangle: 40.0, projected_facet: 15.0, horizon_angle: 500.0 };

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
    /// For a surface, with samples spread by area, its triangles clustered if `clustering` says how.
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

    /// Samples whose facets cost as much in a projection as all triangles do.
    pub fn samples_worth_a_projection(&self) -> u32 {
        let triangles = u32::try_from(self.surface.triangles.len()).unwrap_or(u32::MAX);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturates")]
        let samples = (f64::from(triangles) * COSTS.projected_triangle / COSTS.projected_facet) as u32;
        samples
    }

    /// Whether to project all triangles `rounds` times costs more than to look up so many samples.
    pub fn costs_more_than_samples(&self, rounds: f64, samples: u32) -> bool {
        rounds * self.surface.triangles.len() as f64 * COSTS.projected_triangle > f64::from(samples) * COSTS.projected_facet
    }

    /// Reports the share of a stage that is done.
    pub fn report(&self, stage: &str, share: f64) {
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
        let (triangles, facets) = (self.surface.triangles.len() as f64, samples as f64);
        let projection = directions as f64 * (triangles * COSTS.projected_triangle + facets * COSTS.projected_facet);
        azimuths as f64 * samples as f64 * COSTS.horizon_angle < projection
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
