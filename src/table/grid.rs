//! Directions of the hemisphere as a triangle mesh, and weights between its nodes.
//!
//! **Nodes.** Ring `k = 0..=K` holds `6 k` nodes (ring 0 one, straight up) at azimuths `2 pi j / (6 k)` and at
//! `cos(theta) = c + (1 - c) (1 - (k/K)²)^1.5`, where `c` is [`MIN_COSINE`]. With the exponent 1 each node would stand for the same solid angle (the concentric map
//! of Shirley and Chiu 1997, on a hexagon in place of a square); 1.5 brings the rings closer together towards the horizon,
//! where shadows move fastest and `fbar = S/av` magnifies what is left: on 12 and 24 rings, off the nodes, a diffuse V-groove of 30
//! degrees then errs by .0065 and .0022 (.0090 and .0028 with exponent 1, .0065 and .0023 with 1.25), one of 45 degrees and
//! GGX .3 by .021 and .006 (.035 and .013; .024 and .007), a flat GGX .1 by .054 and .019 (.064 and .017; .058 and .017). Ring `K` is
//! the horizon. There is no pole to interpolate across, every `w` has its opposite azimuth among the
//! nodes, and there are `1 + 3 K (K + 1)` nodes.
//!
//! **Weights.** A direction inside the spherical triangle of nodes `W1 W2 W3` has the weights `b` that solve
//! `b1 W1 + b2 W2 + b3 W3 = w`. They are not negative, continuous across edges, and reproduce the *vector*. Facet by facet
//! `av(wo)` is linear in the vector `wo`, and `S(wi,wo)` of a diffuse facet in each of `wi` and `wo`, as long as visibility does
//! not change: so these weights reproduce `av = cos(theta_o)` of every closed surface and the flat Lambertian exactly,
//! where weights that sum to 1 are wrong by up to 1 % at `K = 8`. (For a constant they are too large by about `1/(8 K²)`.)

use crate::direction::MIN_COSINE;
use crate::numerics::cast::truncate_usize;
use glam::{DMat3, DVec3};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_3, TAU};

/// Three nodes and their weights.
pub type GridWeights = ([usize; 3], [f64; 3]);

/// Nodes of the hemisphere, with the triangles between them.
#[derive(Clone, Debug)]
pub struct HemisphereGrid {
    rings: usize,
    nodes: Vec<DVec3>,
    triangles: Vec<[usize; 3]>,
    /// For each triangle the inverse of the matrix whose columns are its corners.
    inverses: Vec<DMat3>,
    /// For each triangle and corner the triangle across the edge opposite to it; [`OUTSIDE`] at the horizon.
    neighbours: Vec<[usize; 3]>,
}

/// No triangle: the edge lies on the horizon.
const OUTSIDE: usize = usize::MAX;

/// A corner's weight down to this counts as not negative: rounding, at a direction on an edge.
const ON_EDGE: f64 = -1e-12;

/// Most triangles that are walked through; the test sees fewer than 4.
const MAX_STEPS: usize = 32;

/// Exponent `e` of the rings' places: `cos(theta) = c + (1 - c) (1 - (k/K)²)^e`.
const ELEVATION_EXPONENT: f64 = 1.5;

/// Number of nodes of `rings` rings: `1 + 3 K (K + 1)`.
pub const fn node_count(rings: usize) -> usize {
    1 + 3 * rings * (rings + 1)
}

/// Place of node `j` of ring `k`; `j = 6 k` is node 0.
const fn node_index(k: usize, j: usize) -> usize {
    if k == 0 { 0 } else { 1 + 3 * k * (k - 1) + j % (6 * k) }
}

/// The node's direction: unit vector, `z >=` [`MIN_COSINE`].
fn node(rings: usize, k: usize, j: usize) -> DVec3 {
    if k == 0 {
        return DVec3::Z;
    }
    let radius = k as f64 / rings as f64;
    let z = MIN_COSINE + (1.0 - MIN_COSINE) * (1.0 - radius * radius).powf(ELEVATION_EXPONENT);
    let (sin, cos) = (TAU * j as f64 / (6 * k) as f64).sin_cos();
    let rho = ((1.0 - z) * (1.0 + z)).sqrt();
    DVec3::new(rho * cos, rho * sin, z)
}

/// All nodes of `rings` rings, in their order: ring by ring from the pole, by azimuth inside a ring.
pub fn nodes(rings: usize) -> Vec<DVec3> {
    (0..=rings).flat_map(|k| (0..(6 * k).max(1)).map(move |j| node(rings, k, j))).collect()
}

/// Where a direction lies on the lattice of rings: which of the six sextants, ring `k`, place `j` along it, and the fractions
/// `t` to ring `k + 1` and `u` to place `j + 1`, both in `0..=1`.
struct GridPlace {
    sextant: usize,
    k: usize,
    j: usize,
    t: f64,
    u: f64,
}

fn place(rings: usize, w: DVec3) -> GridPlace {
    // 1 - z loses digits near the pole only where the position inside the first ring does not need them.
    let height = ((w.z - MIN_COSINE) / (1.0 - MIN_COSINE)).clamp(0.0, 1.0);
    let x = (1.0 - height.powf(1.0 / ELEVATION_EXPONENT)).sqrt() * rings as f64;
    let turn = w.y.atan2(w.x).rem_euclid(TAU) / FRAC_PI_3;
    let sextant = truncate_usize(turn).min(5);
    let k = truncate_usize(x).min(rings - 1);
    let along = x * (turn - sextant as f64).clamp(0.0, 1.0);
    let j = truncate_usize(along).min(k);
    GridPlace { sextant, k, j, t: (x - k as f64).min(1.0), u: (along - j as f64).min(1.0) }
}

impl GridPlace {
    /// The upper triangle of the lattice cell has two corners on the outer ring, the lower one two on the inner ring.
    fn upper(&self) -> bool {
        self.u <= self.t || self.j == self.k
    }

    fn corners(&self) -> [usize; 3] {
        let inner = |j| node_index(self.k, self.sextant * self.k + j);
        let outer = |j| node_index(self.k + 1, self.sextant * (self.k + 1) + j);
        if self.upper() { [inner(self.j), outer(self.j), outer(self.j + 1)] } else { [inner(self.j), outer(self.j + 1), inner(self.j + 1)] }
    }

    /// Place in [`HemisphereGrid::triangles`]: band `k` has `6 (2 k + 1)` of them.
    fn triangle(&self) -> usize {
        6 * self.k * self.k + self.sextant * (2 * self.k + 1) + 2 * self.j + usize::from(!self.upper())
    }
}

/// Weights that are linear on the lattice of rings, for a direction with `z >= 0`: they sum to 1, are not negative and
/// continuous. Cheaper than [`HemisphereGrid::weights`], for functions that have nothing to do with the vector `w`.
pub fn lattice_weights(rings: usize, w: DVec3) -> GridWeights {
    let place = place(rings, w);
    let (t, u) = (place.t, place.u);
    let weights = if place.upper() { [1.0 - t, (t - u).max(0.0), u.min(t)] } else { [1.0 - u, t, u - t] };
    (place.corners(), weights)
}

impl HemisphereGrid {
    /// A grid of `rings` rings, at least 2.
    pub fn new(rings: usize) -> Self {
        assert!(rings >= 2, "a grid of {rings} rings has no inside");
        let nodes = nodes(rings);
        let mut triangles = Vec::with_capacity(6 * rings * rings);
        for k in 0..rings {
            for sextant in 0..6 {
                for j in 0..=k {
                    let upper = GridPlace { sextant, k, j, t: 1.0, u: 0.0 };
                    debug_assert_eq!(upper.triangle(), triangles.len(), "the order of the triangles is a formula");
                    triangles.push(upper.corners());
                    if j < k {
                        triangles.push(GridPlace { t: 0.0, u: 1.0, ..upper }.corners());
                    }
                }
            }
        }
        let inverses = triangles.iter().map(|t| DMat3::from_cols(nodes[t[0]], nodes[t[1]], nodes[t[2]]).inverse()).collect();
        let edge = |t: &[usize; 3], e: usize| (t[(e + 1) % 3], t[(e + 2) % 3]);
        let across: HashMap<(usize, usize), usize> =
            triangles.iter().enumerate().flat_map(|(i, t)| (0..3).map(move |e| (edge(t, e), i))).collect();
        let opposite = |t: &[usize; 3], e| {
            let (a, b) = edge(t, e);
            across.get(&(b, a)).copied().unwrap_or(OUTSIDE)
        };
        let neighbours = triangles.iter().map(|t| std::array::from_fn(|e| opposite(t, e))).collect();
        Self { rings, nodes, triangles, inverses, neighbours }
    }

    /// Rings beside the pole.
    pub fn rings(&self) -> usize {
        self.rings
    }

    /// Unit directions of the nodes; the last `6 K` lie at [`MIN_COSINE`].
    pub fn nodes(&self) -> &[DVec3] {
        &self.nodes
    }

    /// Nodes around the unit direction `w` with `w.z >=` [`MIN_COSINE`], and the weights that reproduce its vector.
    pub fn weights(&self, w: DVec3) -> GridWeights {
        let (triangle, weights) = self.locate(w);
        (self.triangles[triangle], weights)
    }

    /// The nodes at the corners of each triangle between the nodes.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
    }

    /// As [`Self::weights`], with the place of the three nodes in [`Self::triangles`].
    pub fn locate(&self, w: DVec3) -> (usize, [f64; 3]) {
        // The lattice cell is nearly always right; the sides of the spherical triangle bend a little away from its own.
        let mut triangle = place(self.rings, w).triangle();
        let mut steps = 0;
        loop {
            let weights = (self.inverses[triangle] * w).to_array();
            let least = (0..3).min_by(|&a, &b| weights[a].total_cmp(&weights[b])).expect("three corners");
            let next = self.neighbours[triangle][least];
            // Between two nodes on the horizon the great circle rises above it by 1e-4 of the node's distance: such a
            // direction lies outside, and takes the edge's weights.
            if weights[least] >= ON_EDGE || next == OUTSIDE || steps == MAX_STEPS {
                return (triangle, weights.map(|b| b.max(0.0)));
            }
            triangle = next;
            steps += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions spread over the hemisphere down to the horizon (a Fibonacci spiral).
    fn spread(n: usize) -> impl Iterator<Item = DVec3> {
        (0..n).map(move |i| {
            let z = (1.0 - (i as f64 + 0.5) / n as f64).max(MIN_COSINE);
            let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
            let rho = (1.0 - z * z).sqrt();
            DVec3::new(rho * cos, rho * sin, z)
        })
    }

    #[test]
    fn every_node_has_its_own_place_and_its_opposite_azimuth() {
        for rings in [2, 3, 8, 17] {
            let grid = HemisphereGrid::new(rings);
            assert_eq!(grid.nodes().len(), node_count(rings));
            for &w in grid.nodes() {
                let nearest = |v: DVec3| grid.nodes().iter().map(|n| n.distance(v)).fold(f64::INFINITY, f64::min);
                assert!((w.length() - 1.0).abs() < 1e-15 && w.z >= MIN_COSINE, "{w}");
                assert!(nearest(DVec3::new(-w.x, -w.y, w.z)) < 1e-14, "no mirror direction of {w}");
            }
        }
    }

    #[test]
    fn weights_reproduce_the_vector_everywhere_and_are_not_negative() {
        for rings in [2, 5, 16, 36] {
            let grid = HemisphereGrid::new(rings);
            for w in spread(5000) {
                let (nodes, weights) = grid.weights(w);
                let sum = (0..3).fold(DVec3::ZERO, |s, c| s + weights[c] * grid.nodes()[nodes[c]]);
                assert!(weights.iter().all(|&b| (0.0..1.5).contains(&b)), "{weights:?} at {w}");
                // On the horizon itself the edge is 1e-4 (1/cos - 1) too high at most.
                let allowed = if w.z > 2.0 * MIN_COSINE { 1e-12 } else { 2e-5 };
                assert!(sum.distance(w) < allowed * rings as f64, "{sum} for {w} with {rings} rings");
            }
        }
    }

    #[test]
    fn weights_at_a_node_are_the_node_alone() {
        let grid = HemisphereGrid::new(9);
        for (i, &w) in grid.nodes().iter().enumerate() {
            for (nodes, weights) in [grid.weights(w), lattice_weights(9, w)] {
                let own: f64 = (0..3).filter(|&c| nodes[c] == i).map(|c| weights[c]).sum();
                let rest: f64 = (0..3).filter(|&c| nodes[c] != i).map(|c| weights[c]).sum();
                assert!((own - 1.0).abs() < 1e-6 && rest < 1e-6, "node {i}: {own}, the rest {rest}");
            }
        }
    }

    #[test]
    fn lattice_weights_are_continuous_and_sum_to_one() {
        let rings = 7;
        let function = |w: DVec3| {
            let (nodes, weights) = lattice_weights(rings, w);
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-12 && weights.iter().all(|&b| b >= 0.0), "{weights:?} at {w}");
            // Any function of the node: here a rough one, so that a jump would show.
            (0..3).map(|c| weights[c] * ((nodes[c] * 7919) % 101) as f64).sum::<f64>()
        };
        for w in spread(4000) {
            let near = (w + DVec3::new(1e-9, -2e-9, 0.0)).normalize();
            assert!((function(w) - function(near)).abs() < 1e-4, "a jump at {w}");
        }
    }

    #[test]
    fn lattice_triangles_get_smaller_towards_the_horizon_and_not_too_small() {
        // A band between r1 and r2 covers z(r1) - z(r2) of 2 pi, in 6 (2 k + 1) triangles: count spread directions.
        let rings = 6;
        let n = 200_000;
        let mut count = vec![0.0; 6 * rings * rings];
        for w in spread(n) {
            count[place(rings, w).triangle()] += 1.0;
        }
        for k in 0..rings {
            let band = &count[6 * k * k..6 * (k + 1) * (k + 1)];
            let z = |k: usize| (1.0 - (k * k) as f64 / (rings * rings) as f64).powf(ELEVATION_EXPONENT);
            let expected = n as f64 * (z(k) - z(k + 1)) / band.len() as f64;
            // Of the two triangles of a cell the one with its side on the inner ring is the smaller.
            assert!(band.iter().all(|c| (c / expected - 1.0).abs() < 0.3), "ring {k}: {band:?}, expected {expected}");
            let mean = band.iter().sum::<f64>() / band.len() as f64;
            assert!((mean / expected - 1.0).abs() < 0.01, "ring {k}: {mean}, expected {expected}");
        }
    }
}
