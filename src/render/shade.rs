//! From places and effective values to radiance: equation 5 of Wu et al. 2011 for each point, summed over its lights.
//!
//! What a point needs of the grids (which cells, with which weights) depends on the view and not on the materials' values; a
//! [`Frame`] keeps it, so that a picture can be shaded again after an edit of a material at the cost of [`Frame::shade`] alone. That is
//! deferred shading, as in the paper (section 3.6).

use super::gather::View;
use super::query_table::{GridPlace, GuidePlace, QueryTable, key, locate};
use super::scene::Light;
use crate::direction::MIN_COSINE;
use crate::numerics::cast::narrow;
use crate::table::HemisphereGrid;
use glam::Vec4;
use rayon::prelude::*;

/// A light that reaches a point, as the shading needs it.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    cell: u32,
    weights: [f32; 3],
    scale: f32,
    light: u16,
}

/// A point, as the shading needs it.
#[derive(Clone, Copy, Debug)]
struct Spot {
    pixel: u32,
    material: u32,
    end: u32,
    weights: [f32; 3],
    /// Share of the pixel, tinted, over `cos(theta_o)`.
    factor: [f32; 3],
}

/// Some rows of a picture with their places in the tables of their materials.
pub struct Frame {
    spots: Vec<Spot>,
    lamps: Vec<Lamp>,
    /// Empty where no table has a guide; else one a lamp.
    guides: Vec<Option<GuidePlace>>,
    behind: Vec<[f32; 3]>,
    first_pixel: u32,
    width: u32,
    /// First spot of each row, and the number of spots.
    rows: Vec<usize>,
}

/// Irradiance of each light on a plane that faces it (of a point light at distance 1).
pub fn colours(lights: &[Light]) -> Vec<Vec4> {
    lights
        .iter()
        .map(|light| {
            let (Light::Directional { irradiance: [r, g, b], .. } | Light::Point { intensity: [r, g, b], .. }) = *light;
            glam::DVec4::new(r, g, b, 0.0).as_vec4()
        })
        .collect()
}

/// The keys of the cells that a view touches, sorted and distinct, for each material by the grid that it uses, if it uses one.
pub fn touched(view: &View, grids: &[Option<HemisphereGrid>]) -> Vec<Vec<u64>> {
    let points: Vec<_> = view.lit_points().collect();
    let parts: Vec<Vec<Vec<u64>>> = points
        .par_chunks(4096)
        .map(|points| {
            let mut keys = vec![Vec::new(); grids.len()];
            for (point, range) in points {
                let material = point.material as usize;
                let Some(grid) = &grids[material] else { continue };
                let viewer = locate(grid, point.wo).triangle;
                keys[material].extend(view.lit[range.clone()].iter().map(|lit| key(locate(grid, lit.wi).triangle, viewer)));
            }
            for keys in &mut keys {
                keys.sort_unstable();
                keys.dedup();
            }
            keys
        })
        .collect();
    let mut all = vec![Vec::new(); grids.len()];
    for part in parts {
        for (all, keys) in all.iter_mut().zip(part) {
            all.extend(keys);
        }
    }
    for keys in &mut all {
        keys.par_sort_unstable();
        keys.dedup();
    }
    all
}

impl Frame {
    /// Finds the places of a view in the tables of its materials; a material without a table must have no lit point.
    pub fn new(view: &View, tables: &[Option<QueryTable>], width: u32) -> Self {
        let points: Vec<_> = view.lit_points().collect();
        let guided = tables.iter().flatten().any(QueryTable::is_guided);
        type Part = (Vec<Spot>, Vec<Lamp>, Vec<Option<GuidePlace>>);
        let parts: Vec<Part> = points
            .par_chunks(1024)
            .map(|points| {
                let (mut spots, mut lamps, mut guides): Part = Default::default();
                for (point, range) in points {
                    let Some(table) = &tables[point.material as usize] else { continue };
                    let viewer = locate(table.grid(), point.wo);
                    for lit in &view.lit[range.clone()] {
                        let GridPlace { triangle, weights } = locate(table.grid(), lit.wi);
                        let cell = table.cell(key(triangle, viewer.triangle)).expect("the table holds every touched cell");
                        lamps.push(Lamp { cell, weights, scale: lit.scale, light: lit.light });
                        if guided {
                            guides.push(table.guide_place(lit.wi, point.wo));
                        }
                    }
                    let factor = point.tint.map(|tint| tint * (point.weight / point.wo.z.max(narrow(MIN_COSINE))));
                    let (pixel, material, end) = (point.pixel, point.material, point.end);
                    spots.push(Spot { pixel, material, end, weights: viewer.weights, factor });
                }
                (spots, lamps, guides)
            })
            .collect();
        let (mut spots, mut lamps, mut guides): Part = Default::default();
        for part in parts {
            spots.extend(part.0);
            lamps.extend(part.1);
            guides.extend(part.2);
        }
        let first_pixel = view.rows.start * width;
        let row = |row: u32| spots.partition_point(|s| s.pixel < row * width);
        let rows = (view.rows.start..=view.rows.end).map(row).collect();
        Self { spots, lamps, guides, behind: view.behind.clone(), first_pixel, width, rows }
    }

    /// Lights at points: what one shading sums.
    pub fn lamps(&self) -> usize {
        self.lamps.len()
    }

    /// Radiance of each pixel of the rows, under lights of these colours.
    pub fn shade(&self, tables: &[Option<QueryTable>], colours: &[Vec4]) -> Vec<[f32; 3]> {
        let mut pixels = self.behind.clone();
        pixels.par_chunks_mut(self.width as usize).zip(self.rows.par_windows(2)).enumerate().for_each(|(row, (pixels, range))| {
            let mut start = range[0].checked_sub(1).map_or(0, |before| self.spots[before].end as usize);
            let offset = self.first_pixel as usize + row * self.width as usize;
            for spot in &self.spots[range[0]..range[1]] {
                let end = spot.end as usize;
                let table = tables[spot.material as usize].as_ref().expect("spots have tables");
                let mut sum = Vec4::ZERO;
                for at in start..end {
                    let lamp = &self.lamps[at];
                    let guide = self.guides.get(at).and_then(Option::as_ref);
                    let colour = colours[usize::from(lamp.light)] * lamp.scale;
                    sum += table.value(lamp.cell, lamp.weights, spot.weights, guide) * colour;
                }
                start = end;
                let pixel = &mut pixels[spot.pixel as usize - offset];
                for c in 0..3 {
                    pixel[c] += sum[c] * spot.factor[c];
                }
            }
        });
        pixels
    }
}
