//! Which of the three answers to "is this facet seen from there" is given: rays at grazing angles, projection elsewhere, horizon angles where
//! they cost less.

use super::bits::Bits;
use super::grazing::is_grazing;
use super::horizon::Horizon;
use super::raster;
use super::rays::{Occlusion, PeriodicBvh};
use crate::error::{Error, Result};
use crate::facets::{self, Facets, Surface};
use crate::material::SmallScale;
use crate::numerics::cast::truncate_i64;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What visibility costs, in nanoseconds; only ratios matter, and only to speed. Assumed: no command that measured them is kept.
pub(crate) struct VisibilityCosts {
    /// To project a triangle along a direction.
    pub projected_triangle: f64,
    /// To look up a facet in the projection.
    pub projected_facet: f64,
    /// The horizon angle of a facet in an azimuth.
    pub horizon_angle: f64,
}

pub(crate) const COSTS: VisibilityCosts = VisibilityCosts { projected_triangle: 40.0, projected_facet: 15.0, horizon_angle: 500.0 };

/// What a surface needs to tell what its facets see; made as it is needed.
pub(crate) struct Visibility<'a> {
    small: &'a SmallScale,
    rays: OnceLock<Result<PeriodicBvh>>,
    /// For height fields.
    horizon: Option<Horizon>,
    /// Rays that were followed through as many periods as rays are, and counted as free.
    given_up: AtomicUsize,
}

impl<'a> Visibility<'a> {
    /// Of a surface.
    pub fn new(small: &'a SmallScale) -> Self {
        Self { small, rays: OnceLock::new(), horizon: Horizon::new(&small.tile), given_up: AtomicUsize::new(0) }
    }

    /// Rays so far that were given up among the periods and counted as free.
    pub fn given_up(&self) -> usize {
        self.given_up.load(Ordering::Relaxed)
    }

    /// One bit a facet and direction. Facets that stand for no sample see nothing.
    ///
    /// # Errors
    /// What `check` says, which is asked now and then; a surface that rays cannot be traced to.
    pub fn see(&self, surface: &Surface, facets: &Facets, directions: &[DVec3], check: &(dyn Fn() -> Result<()> + Sync)) -> Result<Bits> {
        let words = facets.triangle.len() / 64;
        let mut bits = Bits { words, rows: vec![0; words * directions.len()] };
        let azimuths = by_azimuth(directions);
        if let Some(horizon) = &self.horizon
            && horizon_pays(surface.triangles.len(), facets.samples, azimuths.len(), directions.len())
        {
            see_horizons(horizon, surface, facets, &azimuths, directions, &mut bits, check)?;
            return Ok(bits);
        }
        if directions.iter().any(|&w| is_grazing(surface, w))
            && let Err(error) = self.rays.get_or_init(|| PeriodicBvh::new(&self.small.tile))
        {
            return Err(Error::Numeric(error.to_string()));
        }
        // Some directions one after the other, so that they share the buffers.
        let rows = bits.rows.par_chunks_mut(words.max(1)).zip(directions).with_min_len(8);
        rows.for_each_init(raster::Scratch::default, |scratch, (row, &direction)| {
            if check().is_err() {
                return;
            }
            match self.rays.get() {
                Some(Ok(rays)) if is_grazing(surface, direction) => self.trace(rays, surface, facets, direction, row),
                _ => raster::visible(surface, facets, direction, scratch, row),
            }
        });
        check()?;
        Ok(bits)
    }

    /// Visibility of the facets in one direction by rays.
    fn trace(&self, rays: &PeriodicBvh, surface: &Surface, facets: &Facets, direction: DVec3, row: &mut [u64]) {
        for (f, (&triangle, &position)) in facets.triangle.iter().zip(&facets.position).enumerate() {
            if triangle != facets::NO_TRIANGLE && surface.normals[triangle as usize].dot(direction) > 0.0 {
                let seen = match rays.occluded(surface.tile_triangle[triangle as usize] as usize, position * surface.unit, direction) {
                    Occlusion::Blocked => false,
                    Occlusion::Free => true,
                    Occlusion::GaveUp => {
                        self.given_up.fetch_add(1, Ordering::Relaxed);
                        true
                    }
                };
                row[f / 64] |= u64::from(seen) << (f % 64);
            }
        }
    }
}

/// Whether horizon angles cost less than projections.
fn horizon_pays(triangles: usize, samples: usize, azimuths: usize, directions: usize) -> bool {
    let (triangles, facets) = (triangles as f64, samples as f64);
    let projection = directions as f64 * (triangles * COSTS.projected_triangle + facets * COSTS.projected_facet);
    azimuths as f64 * samples as f64 * COSTS.horizon_angle < projection
}

/// Visibility of all directions of each azimuth from one horizon angle a facet.
fn see_horizons(
    horizon: &Horizon,
    surface: &Surface,
    facets: &Facets,
    azimuths: &[(DVec2, Vec<usize>)],
    directions: &[DVec3],
    bits: &mut Bits,
    check: &(dyn Fn() -> Result<()> + Sync),
) -> Result<()> {
    let words = bits.words;
    let rows: Vec<Vec<(usize, Vec<u64>)>> = azimuths
        .par_iter()
        .map(|(azimuth, members)| {
            let mut rows: Vec<(usize, Vec<u64>)> = members.iter().map(|&d| (d, vec![0; words])).collect();
            if check().is_err() {
                return rows;
            }
            for (f, (&triangle, &position)) in facets.triangle.iter().zip(&facets.position).enumerate() {
                if triangle == facets::NO_TRIANGLE {
                    continue;
                }
                let slope = horizon.slope(position * surface.unit, (azimuth.x, azimuth.y));
                let normal = surface.normals[triangle as usize];
                for (d, row) in &mut rows {
                    let w = directions[*d];
                    let seen = normal.dot(w) > 0.0 && w.z > slope * w.truncate().length();
                    row[f / 64] |= u64::from(seen) << (f % 64);
                }
            }
            rows
        })
        .collect();
    check()?;
    for (d, row) in rows.into_iter().flatten() {
        bits.rows[d * words..(d + 1) * words].copy_from_slice(&row);
    }
    Ok(())
}

/// Distinct azimuths, each with the places of its directions. Straight up goes with the azimuth of x.
fn by_azimuth(directions: &[DVec3]) -> Vec<(DVec2, Vec<usize>)> {
    /// Azimuths that agree to this many radians are one: far less than a facet's f32 position tells.
    const SAME: f64 = 1e-9;
    let mut places: HashMap<[i64; 2], usize> = HashMap::new();
    let mut azimuths: Vec<(DVec2, Vec<usize>)> = Vec::new();
    for (d, w) in directions.iter().enumerate() {
        let azimuth = w.truncate().try_normalize().unwrap_or(DVec2::X);
        let key = azimuth.to_array().map(|x| truncate_i64((x / SAME).round()));
        let place = *places.entry(key).or_insert_with(|| {
            azimuths.push((azimuth, Vec::new()));
            azimuths.len() - 1
        });
        azimuths[place].1.push(d);
    }
    azimuths
}
