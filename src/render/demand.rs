//! The part of an effective BRDF that one picture needs: the cells of the direction grids that its pixels and lights touch
//! (`numerics.md`, section 3.1).
//!
//! A pair of directions lies in a cell: the product of two triangles of a [`HemisphereGrid`], with nine pairs of nodes at its
//! corners. Values stand at the corners of touched cells only; between them the weights of the two triangles multiply, as in a baked
//! [table](crate::table). How fine the grid must be is measured, not guessed: [`PROBES`] of the picture's own pairs, drawn
//! evenly from its pixels and lights, are computed at their exact directions, and the grid is refined until what it interpolates
//! there agrees. Drawn so, the relative RMS error is weighted by the pixels that use a pair.
//!
//! What stands at a node pair is `fbar · cos(theta_o)` for an opaque surface: `S`, with the noise that it shares with
//! `av = cos(theta_o)` divided out (`numerics.md`, section 1). Where a surface has gaps it is `S` itself. A picture's radiance is the
//! interpolated number times irradiance over `cos(theta_o)`.

use crate::direction::{MIN_COSINE, Pair};
use crate::error::{Error, Result};
use crate::filter::{Control, Quality, Summary, Value, effective};
use crate::material::SmallScale;
use crate::table::{Guide, GuideLobes, HemisphereGrid, lattice_weights, node_count, value_count};
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Pairs of the picture at which the error is measured.
pub const PROBES: usize = 256;
/// Rings of the first grid that is tried.
const FIRST_RINGS: usize = 8;
/// Most rings: 6,913 directions.
pub const MAX_RINGS: usize = 48;
/// Share of the squared tolerance that the facets may use.
const FACET_SHARE: f64 = 0.5;
/// A finer grid is made a little finer than the law `1 / rings²` says.
const MARGIN: f64 = 1.05;
/// Largest cosine of the directions that stand for the nodes on the horizon.
const HORIZON_COSINE: f64 = 0.02;
/// Pairs of one call of the filter.
const CHUNK: usize = 1 << 20;

/// How a material's values are made: found on the probes, used for the whole picture.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Rings of the grid.
    pub rings: usize,
    /// What is divided out before interpolation, if that helps.
    guide: Option<Guide>,
    /// How the probes were computed; its plan repeats it for the rest.
    pub summary: Summary,
    /// Relative RMS error of the values at the nodes.
    pub facets: f64,
    /// Relative RMS error of the interpolation.
    pub interpolation: f64,
    /// Whether no ray passes the surface.
    opaque: bool,
}

/// Values at the corners of the cells that a picture touches.
pub struct Table {
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
}

/// Where a direction lies in the grid.
#[derive(Clone, Copy, Debug)]
pub struct Located {
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
fn above(w: Vec3) -> DVec3 {
    let w = w.as_dvec3();
    DVec3::new(w.x, w.y, w.z.max(MIN_COSINE)).normalize()
}

/// Where a direction over the horizon lies in a grid.
pub fn locate(grid: &HemisphereGrid, w: Vec3) -> Located {
    let w = above(w);
    let (triangle, weights) = grid.locate(DVec3::new(w.x, w.y, w.z.max(MIN_COSINE)));
    #[expect(clippy::cast_possible_truncation, reason = "weights are f32 in hot loops")]
    let weights = weights.map(|v| v as f32);
    Located { triangle: u32::try_from(triangle).expect("grids have few triangles"), weights }
}

/// The directions at which the values of the nodes are computed, and the factor from there to the node.
///
/// What reaches a surface, and what leaves it, goes to 0 with the cosine: so does `S`, in each of its directions. At the nodes on the
/// horizon, whose cosine is 1e-4, rays would pass thousands of periods to tell a number of that size. It is found a little higher up, below
/// the last ring but one, and scaled.
fn stand_ins(grid: &HemisphereGrid) -> Vec<(DVec3, f64)> {
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

/// Values of pairs, from any source: pairs, how to compute them, and the share of the whole work that this call is.
type Values<'a> = dyn FnMut(&[Pair], &Quality, Range<f64>) -> Result<crate::filter::Effective> + 'a;

/// The filter as a source of values.
fn filtered<'a>(
    small: &'a SmallScale,
    control: &'a Control<'_>,
) -> impl FnMut(&[Pair], &Quality, Range<f64>) -> Result<crate::filter::Effective> + 'a {
    move |pairs, quality, share| {
        let progress = |stage: &str, done: f64| (control.progress)(stage, share.start + done.clamp(0.0, 1.0) * (share.end - share.start));
        effective(small, pairs, quality, &Control { progress: &progress, ..*control })
    }
}

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

/// Values of all pairs of nodes of a full table with as many rings as this one.
pub fn full_table(small: &SmallScale, rings: usize) -> usize {
    value_count(rings, small.is_reciprocal())
}

impl Plan {
    /// Finds how fine the grid must be for `probes`, pairs of the picture in the tile's frame, at least one.
    ///
    /// # Errors
    /// Those of [`effective`].
    pub fn find(small: &SmallScale, opaque: bool, probes: &[(Vec3, Vec3)], quality: &Quality, control: &Control<'_>) -> Result<Self> {
        Self::find_with(small, opaque, probes, quality, &mut filtered(small, control))
    }

    fn find_with(small: &SmallScale, opaque: bool, probes: &[(Vec3, Vec3)], quality: &Quality, values: &mut Values<'_>) -> Result<Self> {
        let pairs: Vec<Pair> = probes.iter().map(|&(wi, wo)| Pair { wi: above(wi), wo: above(wo) }).collect();
        let facet_quality = Quality { tolerance: quality.tolerance * FACET_SHARE.sqrt(), ..quality.clone() };
        let exact = values(&pairs, &facet_quality, 0.0..0.2)?;
        // Radiance over irradiance.
        let ratio = |(v, p): (&Value, &Pair)| if opaque { v.fbar } else { v.s.map(|s| s / p.wo.z) };
        let wanted: Vec<[f64; 3]> = exact.values.iter().zip(&pairs).map(ratio).collect();
        let energy: f64 = wanted.iter().flatten().map(|v| v * v).sum();
        let relative = |squares: f64| if energy > 0.0 { (squares / energy).sqrt() } else { (squares / wanted.len() as f64).sqrt() };
        let facets = if opaque {
            exact.summary.relative_rms
        } else {
            relative(exact.values.iter().zip(&pairs).flat_map(|(v, p)| v.s_se.map(|e| (e / p.wo.z).powi(2))).sum())
        };
        // Where the facets alone miss the tolerance, a bias of half their error adds no more than an eighth to it.
        let allowed = (quality.tolerance * quality.tolerance - facets * facets).max(facets * facets / 4.0).sqrt();
        let directions: Vec<(DVec3, DVec3)> = pairs.iter().map(|p| (p.wi, p.wo)).collect();
        let mean = |c: usize| exact.values.iter().map(|v| v.s[c]).sum::<f64>() / exact.values.len() as f64;
        let guide = GuideLobes::of(small).map(|l| l.guide(std::array::from_fn(mean), &directions));
        let mut plan = Self { rings: FIRST_RINGS, guide: None, summary: exact.summary, facets, interpolation: 0.0, opaque };
        let mut done = 0.2;
        loop {
            let share = done..0.5 * (1.0 + done);
            done = share.end;
            let grid = HemisphereGrid::new(plan.rings);
            let located: Vec<[Located; 2]> = probes.iter().map(|&(wi, wo)| [locate(&grid, wi), locate(&grid, wo)]).collect();
            let mut keys: Vec<u64> = located.iter().map(|[i, o]| key(i.triangle, o.triangle)).collect();
            keys.sort_unstable();
            keys.dedup();
            let table = Table::fill(small, &plan, keys, quality, &mut |pairs, quality, _| values(pairs, quality, share.clone()))?;
            let error = |table: &Table| {
                let squares = located.iter().zip(&pairs).zip(&wanted).map(|(([i, o], pair), wanted)| {
                    let cell = table.cell(key(i.triangle, o.triangle)).expect("the probes' own cells");
                    let guide = table.guide_place(pair.wi.as_vec3(), pair.wo.as_vec3());
                    let got = table.value(cell, i.weights, o.weights, guide.as_ref());
                    (0..3).map(|c| (f64::from(got[c]) / pair.wo.z - wanted[c]).powi(2)).sum::<f64>()
                });
                relative(squares.sum())
            };
            plan.interpolation = error(&table);
            plan.guide = None;
            if let Some(guide) = &guide {
                let guided = error(&table.guided(guide));
                if guided < plan.interpolation {
                    plan.interpolation = guided;
                    plan.guide = Some(guide.clone());
                }
            }
            if plan.interpolation <= allowed || plan.rings >= MAX_RINGS {
                return Ok(plan);
            }
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between rings and the limit")]
            let finer = (MARGIN * plan.rings as f64 * (plan.interpolation / allowed).sqrt()).ceil().min(MAX_RINGS as f64) as usize;
            plan.rings = finer.clamp(plan.rings + 1, MAX_RINGS);
            // The table without the guide is what both are made of.
            plan.guide = None;
        }
    }

    /// The whole relative RMS error.
    pub fn relative_rms(&self) -> f64 {
        self.facets.hypot(self.interpolation)
    }

    /// Directions of its grid.
    pub fn nodes(&self) -> usize {
        node_count(self.rings)
    }

    /// Whether a guide is used.
    pub fn is_guided(&self) -> bool {
        self.guide.is_some()
    }

    /// The values that the cells of these sorted, distinct keys need.
    ///
    /// # Errors
    /// Those of [`effective`].
    pub fn table(&self, small: &SmallScale, keys: Vec<u64>, quality: &Quality, control: &Control<'_>) -> Result<Table> {
        let table = Table::fill(small, self, keys, quality, &mut filtered(small, control))?;
        Ok(match &self.guide {
            Some(guide) => table.guided(guide),
            None => table,
        })
    }
}

impl Table {
    /// Computes the corners of cells.
    fn fill(small: &SmallScale, plan: &Plan, keys: Vec<u64>, quality: &Quality, values: &mut Values<'_>) -> Result<Self> {
        let grid = HemisphereGrid::new(plan.rings);
        let triangles = grid.triangles();
        #[expect(clippy::cast_possible_truncation, reason = "halves of a key; nodes are few")]
        let corners = |key: u64| {
            let (viewer, light) = (triangles[(key >> 32) as usize], triangles[(key & 0xffff_ffff) as usize]);
            let pair = |k: usize| u64::from(viewer[k / 3] as u32) << 32 | u64::from(light[k % 3] as u32);
            std::array::from_fn::<u64, 9, _>(pair)
        };
        let mut wanted: Vec<u64> = keys.par_iter().flat_map_iter(|&key| corners(key)).collect();
        wanted.par_sort_unstable();
        wanted.dedup();
        let halves = |pair: u64| [(pair & 0xffff_ffff) as u32, (pair >> 32) as u32];
        let place: FxHashMap<u64, u32> = (0_u32..).zip(&wanted).map(|(at, &pair)| (pair, at)).collect();
        let corners: Vec<[u32; 9]> = keys.par_iter().map(|&key| corners(key).map(|pair| place[&pair])).collect();
        let ordered: Vec<[u32; 2]> = wanted.iter().map(|&p| halves(p)).collect();
        let pairs = distinct(&ordered, small.is_reciprocal());
        let repeated = Quality { plan: Some(plan.summary.plan.clone()), ..quality.clone() };
        let mut filled = Vec::with_capacity(ordered.len());
        let nodes = stand_ins(&grid);
        for chunk in ordered.chunks(CHUNK) {
            let begun = filled.len() as f64 / ordered.len() as f64;
            let list: Vec<Pair> = chunk.iter().map(|&[i, o]| Pair { wi: nodes[i as usize].0, wo: nodes[o as usize].0 }).collect();
            let result = values(&list, &repeated, begun..begun + chunk.len() as f64 / ordered.len() as f64)?;
            for ((value, pair), &[i, o]) in result.values.iter().zip(&list).zip(chunk) {
                let factor = nodes[i as usize].1 * nodes[o as usize].1;
                let [r, g, b] = if plan.opaque { value.fbar.map(|v| factor * v * pair.wo.z) } else { value.s.map(|v| factor * v) };
                if !(r.is_finite() && g.is_finite() && b.is_finite()) {
                    return Err(Error::Numeric("an effective value is not finite; please report this".to_owned()));
                }
                filled.push(glam::DVec4::new(r, g, b, 0.0).as_vec4());
            }
        }
        Ok(Self { grid, guide: None, cells: keys, corners, values: filled, pairs })
    }

    /// The same with a guide divided out.
    fn guided(&self, guide: &Guide) -> Self {
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
        #[expect(clippy::cast_possible_truncation, reason = "nodes are few; weights are f32 in hot loops")]
        Some(GuidePlace { nodes: nodes.map(|n| n as u32), weights: weights.map(|w| w as f32) })
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
