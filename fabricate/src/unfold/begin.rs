//! Where the search begins: pieces are joined across one edge after the other, as long as nothing overlaps.

use super::effort::Stop;
use super::net::{Move, Net, Problem};
use biscale::numerics::random::Random;
use glam::DVec3;

/// In which order edges are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    /// Long edges with flat folds first.
    Flat,
    /// Edges across the direction of some edge: strips. A slit between two rows of facets that are nearly flat opens too little for a tab
    /// there, strips have none.
    Strips,
    /// Edges across a random direction (Schlickenrieder 1997, "Nets of polyhedra": steepest edge).
    Steepest,
}

/// The orders that runs take in turn.
const ORDERS: [Order; 3] = [Order::Flat, Order::Strips, Order::Steepest];

/// Fold angle, as a share of pi, that weighs as much as the mean length of an edge; a mountain weighs half of what a valley does, since the
/// paper on both sides of a valley is more often in the way. Chosen, not measured.
const LENGTH: f64 = 0.05;
const MOUNTAIN: f64 = 0.5;
/// Edges this much along the strips (cosine) are between two strips. Chosen, not measured.
const ALONG_STRIP: f64 = 0.8;
/// Noise of the weights: decides among edges that are alike. Chosen, not measured.
const NOISE: f64 = 0.02;

/// Weights of the edges for one run: larger is joined earlier.
fn weights(problem: &Problem<'_>, run: u32, random: &mut Random) -> Vec<f64> {
    let mesh = problem.mesh;
    let vector = |e: usize| {
        let [a, b] = mesh.edges[e].ends.map(|v| mesh.vertices[v as usize]);
        b - a
    };
    let mean = (0..mesh.edges.len()).map(|e| mesh.length(e)).sum::<f64>() / mesh.edges.len() as f64;
    let order = ORDERS[run as usize % ORDERS.len()];
    let axis = match order {
        Order::Flat => DVec3::ZERO,
        Order::Strips => vector(random.below(mesh.edges.len())).normalize_or_zero(),
        Order::Steepest => {
            let z = 2.0 * random.unit() - 1.0;
            let (sin, cos) = (random.unit() * std::f64::consts::TAU).sin_cos();
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * cos, r * sin, z)
        }
    };
    let weight = |e: usize| {
        let along = vector(e).normalize_or_zero().dot(axis).abs();
        match order {
            Order::Flat => {
                let fold = mesh.edges[e].angle / std::f64::consts::PI;
                LENGTH * mesh.length(e) / mean - if fold < 0.0 { -MOUNTAIN * fold } else { fold }
            }
            Order::Strips if along > ALONG_STRIP => -1.0,
            Order::Strips | Order::Steepest => 1.0 - along,
        }
    };
    (0..mesh.edges.len()).map(|e| weight(e) + NOISE * random.unit()).collect()
}

/// Joins the pieces of a net, single facets at first, in the order of one run.
pub(super) fn begin(net: &mut Net<'_, '_>, run: u32, random: &mut Random, stop: &Stop<'_>) {
    let problem = net.problem;
    let weights = weights(problem, run, random);
    let mut order: Vec<u32> = (0_u32..).zip(&problem.mesh.edges).filter(|(_, e)| e.sides[1].is_some()).map(|(e, _)| e).collect();
    order.sort_by(|&a, &b| weights[b as usize].total_cmp(&weights[a as usize]).then(a.cmp(&b)));
    for e in order {
        // What is left when time is up stays as it is.
        if stop(0.0) {
            return;
        }
        join(net, e);
    }
}

/// Joins the two pieces at an edge there: the smaller one moves, if it can lie so.
fn join(net: &mut Net<'_, '_>, across: u32) {
    let [Some(f), Some(g)] = net.problem.mesh.edges[across as usize].sides else { return };
    let (p, q) = (net.piece[f.facet as usize], net.piece[g.facet as usize]);
    let moving = usize::from(net.size[q as usize] <= net.size[p as usize]);
    if p != q {
        net.try_move(Move { across, moving, cut: None, limit: usize::MAX });
    }
}
