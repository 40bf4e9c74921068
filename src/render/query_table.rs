//! The part of an effective BRDF that one picture needs: the cells of the direction grids that its pixels and lights touch
//! (`numerics.md`, section 3.1).
//!
//! A pair of directions lies in a cell: the product of two triangles of a [`HemisphereGrid`], with nine pairs of nodes at its
//! corners. Values stand at the corners of touched cells only; between them the weights of the two triangles multiply, as in a baked
//! [table](crate::table). How fine the grid must be is measured, not guessed (`query_plan`).
//!
//! What stands at a node pair is `fbar · cos(theta_o)` for an opaque surface: `S`, with the noise that it shares with
//! `av = cos(theta_o)` divided out (`numerics.md`, section 1). Where a surface has gaps it is `S` itself. A picture's radiance is the
//! interpolated number times irradiance over `cos(theta_o)`.

use crate::direction::{MIN_COSINE, Pair};
use crate::error::{Error, Result};
use crate::filter::{Effective, Quality, Summary};
use crate::material::SmallScale;
use crate::numerics::cast::{index_u32, narrow};
use crate::table::{Guide, HemisphereGrid, lattice_weights};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Largest cosine of the directions that stand for the nodes on the horizon.
const HORIZON_COSINE: f64 = 0.02;
/// Pairs of one call of the filter.
const CHUNK: usize = 1 << 20;

/// Values at the corners of the cells that a picture touches.
pub struct QueryTable {
    grid: HemisphereGrid,
    guide: Option<(usize, Vec<Vec4>)>,
    /// Keys of the cells, sorted.
    cells: Vec<u64>,
    /// For each cell its nine corners' places in `values`: three of the light for each of the viewer.
    corners: Vec<[u32; 9]>,
    /// Red, green, blue over the guide, and 0.
    values: Vec<Vec4>,
    /// Distinct pairs of nodes that had to be computed: a pair and its reverse are one where the surface is reciprocal.
    pub pairs: usize,
    /// Relative RMS error of the values where it may differ from that of the probes, else 0.
    pub relative_rms: f64,
}

/// Where a direction lies in the grid.
#[derive(Clone, Copy, Debug)]
pub struct GridPlace {
    /// Place of its triangle.
    pub triangle: u32,
    /// Weights of the corners.
    pub weights: [f32; 3],
}

/// Where a half vector lies among the nodes of a guide.
#[derive(Clone, Copy, Debug)]
pub struct GuidePlace {
    nodes: [u32; 3],
    weights: [f32; 3],
}

/// A unit direction of single precision, over the horizon.
pub(super) fn above(w: Vec3) -> DVec3 {
    let w = w.as_dvec3();
    DVec3::new(w.x, w.y, w.z.max(MIN_COSINE)).normalize()
}

/// Where a direction over the horizon lies in a grid.
pub fn locate(grid: &HemisphereGrid, w: Vec3) -> GridPlace {
    let w = above(w);
    let (triangle, weights) = grid.locate(DVec3::new(w.x, w.y, w.z.max(MIN_COSINE)));
    GridPlace { triangle: index_u32(triangle), weights: weights.map(narrow) }
}

/// The directions at which the values of the nodes are computed, and the factor from there to the node.
///
/// What reaches a surface, and what leaves it, goes to 0 with the cosine: so does `S`, in each of its directions. At the nodes on the
/// horizon, whose cosine is 1e-4, rays would pass thousands of periods to tell a number of that size. It is found a little higher up, below
/// the last ring but one, and scaled.
pub(super) fn stand_ins(grid: &HemisphereGrid) -> Vec<(DVec3, f64)> {
    let above = grid.nodes().iter().map(|n| n.z).filter(|&z| z > 2.0 * MIN_COSINE).fold(1.0, f64::min);
    let z = HORIZON_COSINE.min(0.5 * above);
    let lifted = |n: &DVec3| {
        let flat = n.truncate().normalize_or_zero() * (1.0 - z * z).sqrt();
        if n.z < z { (flat.extend(z), n.z / z) } else { (*n, 1.0) }
    };
    grid.nodes().iter().map(lifted).collect()
}

/// The key of a cell.
pub fn key(light: u32, viewer: u32) -> u64 {
    u64::from(viewer) << 32 | u64::from(light)
}

/// The nine pairs of nodes at the corners of a cell, as viewer's and light's node in one number: three of the light for each of the viewer.
fn corners(grid: &HemisphereGrid, key: u64) -> [u64; 9] {
    let triangles = grid.triangles();
    let [light, viewer] = halves(key).map(|triangle| triangles[triangle as usize]);
    std::array::from_fn(|k| u64::from(index_u32(viewer[k / 3])) << 32 | u64::from(index_u32(light[k % 3])))
}

/// Light's and viewer's part of a key.
fn halves(pair: u64) -> [u32; 2] {
    [(pair & 0xffff_ffff) as u32, (pair >> 32) as u32]
}

/// Values of pairs, from any source: pairs, how to compute them, and the share of the whole work that this call is.
pub(super) type Values<'a> = dyn FnMut(&[Pair], &Quality, Range<f64>) -> Result<Effective> + 'a;

/// Number of distinct unordered pairs of nodes in lists of ordered ones; of ordered ones where the surface is not reciprocal.
fn distinct(pairs: &[[u32; 2]], reciprocal: bool) -> usize {
    if !reciprocal {
        return pairs.len();
    }
    let mut sorted: Vec<[u32; 2]> = pairs.iter().map(|&[i, o]| [i.min(o), i.max(o)]).collect();
    sorted.par_sort_unstable();
    sorted.dedup();
    sorted.len()
}

/// What the values of a table are computed of.
pub(super) struct Source<'a> {
    pub small: &'a SmallScale,
    /// Whether no ray passes the surface.
    pub opaque: bool,
    /// How the probes were computed; its plan repeats it for all pairs.
    pub summary: &'a Summary,
}

impl Source<'_> {
    /// Appends the values of some pairs of nodes, `[light, viewer]`.
    ///
    /// Returns their relative RMS error where the same plan may have another one than on the probes: modes of visibility are learnt from the pairs themselves.
    fn fill(
        &self,
        ordered: &[[u32; 2]],
        nodes: &[(DVec3, f64)],
        values: &mut dyn FnMut(&[Pair]) -> Result<Effective>,
        filled: &mut Vec<Vec4>,
    ) -> Result<f64> {
        let list: Vec<Pair> = ordered.iter().map(|&[i, o]| Pair { wi: nodes[i as usize].0, wo: nodes[o as usize].0 }).collect();
        let result = values(&list)?;
        for ((value, pair), &[i, o]) in result.values.iter().zip(&list).zip(ordered) {
            let factor = nodes[i as usize].1 * nodes[o as usize].1;
            let [r, g, b] = if self.opaque { value.fbar.map(|v| factor * v * pair.wo.z) } else { value.s.map(|v| factor * v) };
            if !(r.is_finite() && g.is_finite() && b.is_finite()) {
                return Err(Error::Numeric("an effective value is not finite; please report this".to_owned()));
            }
            filled.push(glam::DVec4::new(r, g, b, 0.0).as_vec4());
        }
        Ok(if result.summary.method == "sg" { result.summary.relative_rms } else { 0.0 })
    }
}

impl QueryTable {
    /// Computes the corners of the cells of these sorted, distinct keys.
    pub(super) fn fill(source: &Source<'_>, rings: usize, keys: Vec<u64>, quality: &Quality, values: &mut Values<'_>) -> Result<Self> {
        let grid = HemisphereGrid::new(rings);
        let mut queried: Vec<u64> = keys.par_iter().flat_map_iter(|&key| corners(&grid, key)).collect();
        queried.par_sort_unstable();
        queried.dedup();
        let place: FxHashMap<u64, u32> = (0_u32..).zip(&queried).map(|(at, &pair)| (pair, at)).collect();
        let corners: Vec<[u32; 9]> = keys.par_iter().map(|&key| corners(&grid, key).map(|pair| place[&pair])).collect();
        let ordered: Vec<[u32; 2]> = queried.iter().map(|&pair| halves(pair)).collect();
        let pairs = distinct(&ordered, source.small.is_reciprocal());
        let repeated = Quality { plan: source.summary.plan.clone(), ..quality.clone() };
        let nodes = stand_ins(&grid);
        let mut filled = Vec::with_capacity(ordered.len());
        let mut relative_rms = 0.0_f64;
        for chunk in ordered.chunks(CHUNK) {
            let begun = filled.len() as f64 / ordered.len() as f64;
            let share = begun..begun + chunk.len() as f64 / ordered.len() as f64;
            let of_chunk = source.fill(chunk, &nodes, &mut |list| values(list, &repeated, share.clone()), &mut filled)?;
            relative_rms = relative_rms.max(of_chunk);
        }
        Ok(Self { grid, guide: None, cells: keys, corners, values: filled, pairs, relative_rms })
    }

    /// The same with a guide divided out.
    pub(super) fn guided(&self, guide: &Guide) -> Self {
        let mut values = self.values.clone();
        // Each value's nodes, through the cells that use it.
        let mut done = vec![false; values.len()];
        let nodes = stand_ins(&self.grid);
        for (&key, corners) in self.cells.iter().zip(&self.corners) {
            let (viewer, light) = (self.grid.triangles()[(key >> 32) as usize], self.grid.triangles()[(key & 0xffff_ffff) as usize]);
            for (k, &at) in corners.iter().enumerate() {
                if !std::mem::replace(&mut done[at as usize], true) {
                    let divisor = guide.at(nodes[light[k % 3]].0, nodes[viewer[k / 3]].0);
                    values[at as usize] /= DVec3::from(divisor).as_vec3().extend(1.0);
                }
            }
        }
        let factors = (0..guide.values[0].len()).map(|n| Vec4::new(guide.values[0][n], guide.values[1][n], guide.values[2][n], 0.0));
        Self {
            grid: self.grid.clone(),
            guide: Some((guide.rings, factors.collect())),
            cells: self.cells.clone(),
            corners: self.corners.clone(),
            values,
            pairs: self.pairs,
            relative_rms: self.relative_rms,
        }
    }

    /// The directions of the table.
    pub fn grid(&self) -> &HemisphereGrid {
        &self.grid
    }

    /// Whether a guide is divided out.
    pub fn is_guided(&self) -> bool {
        self.guide.is_some()
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.cells.len()
    }

    /// Place of the cell with this key.
    pub fn cell(&self, key: u64) -> Option<u32> {
        self.cells.binary_search(&key).ok().map(|at| u32::try_from(at).expect("cells are counted in u32"))
    }

    /// Where the half vector of two directions lies in the guide, if there is one.
    pub fn guide_place(&self, wi: Vec3, wo: Vec3) -> Option<GuidePlace> {
        let (rings, _) = self.guide.as_ref()?;
        let half = above(wi) + above(wo);
        let (nodes, weights) = lattice_weights(*rings, half.normalize());
        Some(GuidePlace { nodes: nodes.map(index_u32), weights: weights.map(narrow) })
    }

    /// The number that stands in a cell between its corners: what a picture multiplies with irradiance over `cos(theta_o)`.
    #[inline]
    pub fn value(&self, cell: u32, light: [f32; 3], viewer: [f32; 3], guide: Option<&GuidePlace>) -> Vec4 {
        let corners = &self.corners[cell as usize];
        let mut sum = Vec4::ZERO;
        for o in 0..3 {
            let row = self.values[corners[3 * o] as usize] * light[0]
                + self.values[corners[3 * o + 1] as usize] * light[1]
                + self.values[corners[3 * o + 2] as usize] * light[2];
            sum += row * viewer[o];
        }
        match (&self.guide, guide) {
            (Some((_, nodes)), Some(at)) => {
                let factor = nodes[at.nodes[0] as usize] * at.weights[0]
                    + nodes[at.nodes[1] as usize] * at.weights[1]
                    + nodes[at.nodes[2] as usize] * at.weights[2];
                sum * factor
            }
            _ => sum,
        }
    }
}
