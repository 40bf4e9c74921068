//! The table in memory, and what it says between its nodes.

use super::grid::{HemisphereGrid, node_count};
use super::guide::Guide;
use crate::direction::above_horizon;
use crate::filter::Value;
use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Most values (pairs of nodes) in a table: at 24 bytes each it takes 192 MB.
pub const MAX_VALUES: usize = 8_000_000;

/// An effective BRDF at all pairs of a hemisphere's directions, with its errors and how it was made.
#[derive(Clone, Debug)]
pub struct EffectiveTable {
    pub(super) grid: HemisphereGrid,
    /// Whether `S(wi,wo) = S(wo,wi)`: then only pairs with `wi <= wo` in the order of the nodes are stored.
    pub(super) reciprocal: bool,
    /// `S` red, green, blue, then their standard errors, 1/sr: one value a stored pair, at [`value_index`].
    pub(super) planes: [Vec<f32>; 6],
    /// `av` of each node.
    pub(super) av: Vec<f32>,
    pub(super) guide: Option<Guide>,
    /// How the table was made.
    pub about: TableOrigin,
}

/// How a table was made.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TableOrigin {
    /// The program and its version.
    pub program: String,
    /// Name of the material.
    pub name: String,
    /// The material file's text.
    pub material: String,
    /// The method that ran.
    pub method: String,
    /// Everything that fixes the bits beside the seed.
    pub plan: String,
    /// Seed of everything random.
    pub seed: u64,
    /// Reflections after the first.
    pub bounces: u32,
    /// Relative RMS error that was asked for.
    pub tolerance: f64,
    /// Facets (`direct`), or rays from the viewer per pair (`reference`).
    pub facets: usize,
    /// What the error is.
    pub error: TableError,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Relative RMS error of a table's `fbar` between its nodes (absolute where all values are 0).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TableError {
    /// The whole error: root of the sum of the squares of the two parts.
    pub relative_rms: f64,
    /// The part of the values at the nodes: facets, clusters.
    pub facets: f64,
    /// The part of the interpolation, measured at `probes` pairs off the nodes, uniform in projected solid angle.
    pub interpolation: f64,
    /// Pairs it was measured at.
    pub probes: usize,
}

/// Number of stored values of a table.
pub const fn value_count(rings: usize, reciprocal: bool) -> usize {
    let nodes = node_count(rings);
    if reciprocal { nodes * (nodes + 1) / 2 } else { nodes * nodes }
}

/// Most rings of a table within [`MAX_VALUES`]: 36 of a reciprocal one, 30 of any other.
pub const fn max_rings(reciprocal: bool) -> usize {
    let mut rings = 2;
    while value_count(rings + 1, reciprocal) <= MAX_VALUES {
        rings += 1;
    }
    rings
}

/// Place of the pair of nodes `wi`, `wo` in each plane of a table of `nodes` nodes: rows of `wo`; of a reciprocal table the
/// triangle `wi <= wo`, row by row, where the two may stand in any order.
pub(super) const fn value_index(nodes: usize, reciprocal: bool, wi: usize, wo: usize) -> usize {
    if !reciprocal {
        wo * nodes + wi
    } else if wi <= wo {
        wo * (wo + 1) / 2 + wi
    } else {
        wi * (wi + 1) / 2 + wo
    }
}

impl EffectiveTable {
    /// The directions of the table.
    pub fn grid(&self) -> &HemisphereGrid {
        &self.grid
    }

    /// Number of stored pairs of directions.
    pub fn values(&self) -> usize {
        self.planes[0].len()
    }

    /// Whether `S(wi,wo) = S(wo,wi)`; not so where a measured small-scale BRDF is not reciprocal.
    pub fn is_reciprocal(&self) -> bool {
        self.reciprocal
    }

    /// The function of the half vector that values are divided by before interpolation, if one helps.
    pub fn guide(&self) -> Option<&Guide> {
        self.guide.as_ref()
    }

    /// The value at two unit directions, between the nodes.
    ///
    /// A direction below the horizon gives 0; one within [`crate::direction::MIN_COSINE`] of it is evaluated there. The
    /// standard errors are those of the nodes, weighted as if all had the same noise (they share their facets); that of
    /// `fbar` leaves out the noise that `S` and `av` share, and is mostly too large. The error of the interpolation is not
    /// in them: it stands in [`TableOrigin::error`].
    pub fn eval(&self, wi: DVec3, wo: DVec3) -> Value {
        let Some(wo) = above_horizon(wo) else { return Value::default() };
        let (to_nodes, to_weights) = self.grid.weights(wo);
        let av = (0..3).map(|k| to_weights[k] * f64::from(self.av[to_nodes[k]])).sum();
        let Some(wi) = above_horizon(wi) else { return Value { av, ..Value::default() } };
        let (ti_nodes, ti_weights) = self.grid.weights(wi);
        let mut sum = [0.0; 6];
        // Summed over (light, viewer), or over (viewer, light) when that is the pair's canonical order: a reciprocal
        // table is then symmetric to the last bit.
        let swap = self.reciprocal && wi.to_array() > wo.to_array();
        for outer in 0..3 {
            for inner in 0..3 {
                let (i, o) = if swap { (inner, outer) } else { (outer, inner) };
                let weight = ti_weights[i] * to_weights[o];
                if weight == 0.0 {
                    continue;
                }
                let (ni, no) = (ti_nodes[i], to_nodes[o]);
                let at = value_index(self.grid.nodes().len(), self.reciprocal, ni, no);
                let divisor = self.guide.as_ref().map_or([1.0; 3], |g| g.at(self.grid.nodes()[ni], self.grid.nodes()[no]));
                for (c, sum) in sum.iter_mut().enumerate() {
                    *sum += weight * f64::from(self.planes[c][at]) / divisor[c % 3];
                }
            }
        }
        let factor = self.guide.as_ref().map_or([1.0; 3], |g| g.at(wi, wo));
        let s: [f64; 3] = std::array::from_fn(|c| sum[c] * factor[c]);
        let s_se: [f64; 3] = std::array::from_fn(|c| sum[c + 3] * factor[c]);
        let over_av = |v: [f64; 3]| if av > 0.0 { v.map(|v| v / av) } else { [0.0; 3] };
        let fbar = over_av(s);
        Value { s, s_se, fbar, se: over_av(s_se), fhat: fbar.map(|v| v / wi.z), av }
    }
}

#[cfg(test)]
#[path = "effective_table_tests.rs"]
pub(super) mod tests;
