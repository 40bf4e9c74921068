//! The search for a net of few pieces.
//!
//! Four ways to begin, each with its own random numbers. Every second run lays strips: edges that run along the direction of some edge
//! are cut, so that pieces have no slits and their tabs have place. The others add facets to a piece by the steepest edge (towards a
//! random direction; Schlickenrieder 1997, "Nets of polyhedra"), by the flattest fold first (a minimum spanning tree of fold angles), or
//! by priority (long edges with flat folds), some of them shy of slits: nearly flat surfaces open them too little for a tab. A facet
//! that would overlap is left for another piece. Then local search: a part of a piece moves to a neighbouring piece, or to another
//! place in its own; the sum of the squares of the piece sizes may grow, and at a temperature that falls to 0 also shrink, so that
//! small pieces dissolve into large ones. The best of all runs is taken.

use super::net::{Move, Net, Outcome, Problem};
use biscale::numerics::random::Random;
use glam::DVec3;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// How much to search, and from which random numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Seed of everything random.
    pub seed: u64,
    /// Runs from different beginnings.
    pub runs: u32,
    /// Collision tests of all runs together, about: the measure of effort that does not depend on the machine.
    pub work: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { seed: 0, runs: 6, work: 6_000_000 }
    }
}

/// Numbers of the search.
///
/// They were chosen by the pieces that came out, not derived, and not measured one by one; what all of them do together is counted by
/// `cargo bench -p biscale-fabricate --bench pieces` and bounded by `fabricate/tests/pieces.rs`. They decide how many pieces there are,
/// never whether a net is right.
struct SearchParams {
    /// Edges this much along the strips (cosine) are between two strips.
    along_strip: f64,
    /// Noise of the weights of strips, in units of the weights: decides among edges that are alike.
    strip_noise: f64,
    /// Least noise of other weights, and how much more it may be.
    noise: [f64; 2],
    /// How much slits are avoided at the beginning, one of these a run, in units of the weights, which lie between 0 and 1.4.
    slit_shyness: [f64; 3],
    /// Facets beyond which only two runs are made: there beginnings take longer than the search.
    large: usize,
    /// Largest part that an ordinary move takes off, facets: a larger one costs more collision tests than it wins.
    largest_part: usize,
    /// Facets taken at random beside the first, of which the one in the smallest piece is moved: small pieces are to dissolve.
    chosen_of: usize,
    /// Share of moves inside one piece.
    inside: f64,
    /// Facets of a piece up to which it is first tried as a whole, and the share of larger ones for which that is tried too.
    whole: (u32, f64),
    /// Share of moves that take from the smaller piece to the larger one.
    to_larger: f64,
    /// Chance to stop at each facet along the tree when a part is chosen: its mean distance is one over this.
    stop_at: f64,
    /// Starting temperature, in facets of difference between two pieces.
    hot: f64,
}

const PARAMS: SearchParams = SearchParams {
    along_strip: 0.8,
    strip_noise: 0.01,
    noise: [0.05, 0.3],
    slit_shyness: [0.0, 0.5, 2.0],
    large: 2500,
    largest_part: 48,
    chosen_of: 3,
    inside: 0.25,
    whole: (4, 0.2),
    to_larger: 0.75,
    stop_at: 0.6,
    hot: 3.0,
};

/// Asked now and then whether to stop: returns true to stop with what there is.
pub type Stop<'s> = dyn Fn(f64) -> bool + Sync + 's;

/// An edge waiting to be laid, the one of the largest weight first.
struct LayCandidate {
    weight: f64,
    edge: u32,
    moving: usize,
}

impl PartialEq for LayCandidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for LayCandidate {}
impl PartialOrd for LayCandidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for LayCandidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.weight.total_cmp(&other.weight).then(other.edge.cmp(&self.edge))
    }
}

/// Weights of the edges for one way to begin: larger is laid earlier.
fn weights(problem: &Problem<'_>, run: u32, random: &mut Random) -> Vec<f64> {
    let mesh = problem.mesh;
    let longest = (0..mesh.edges.len()).map(|e| mesh.length(e)).fold(0.0, f64::max);
    let steepest = {
        let z = 2.0 * random.unit() - 1.0;
        let (sin, cos) = (random.unit() * std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    };
    let strip = {
        let [a, b] = mesh.edges[random.below(mesh.edges.len())].ends.map(|v| mesh.vertices[v as usize]);
        (b - a).normalize_or_zero()
    };
    let noise = PARAMS.noise[0] + PARAMS.noise[1] * random.unit();
    mesh.edges
        .iter()
        .enumerate()
        .map(|(k, e)| {
            let [a, b] = e.ends.map(|v| mesh.vertices[v as usize]);
            let flat = 1.0 - e.angle.abs() / std::f64::consts::PI;
            if run.is_multiple_of(2) {
                let along = (b - a).normalize_or_zero().dot(strip).abs();
                return if along > PARAMS.along_strip { f64::NEG_INFINITY } else { 1.0 - along + PARAMS.strip_noise * random.unit() };
            }
            let base = match run / 2 % 3 {
                0 => 1.0 - ((b - a).normalize_or_zero().dot(steepest)).abs(),
                1 => flat,
                _ => 0.5 * flat + 0.5 * mesh.length(k) / longest,
            };
            base + noise * random.unit()
        })
        .collect()
}

/// Lays facet after facet onto pieces until none can be added to any.
///
/// A facet waits longer, by `slit` in units of the weights, for every edge that it would share with its piece without being laid there.
fn grow(net: &mut Net<'_, '_>, weights: &[f64], slit: f64, random: &mut Random, stop: &Stop<'_>) {
    let mesh = net.problem.mesh;
    // How many edges a facet would share with facets of the piece beside the one it is laid at: each becomes a slit.
    let slits = |net: &Net<'_, '_>, placed: &[bool], across: u32, g: u32, piece: u32| {
        mesh.neighbours(g).filter(|&(e, h)| e != across && placed[h as usize] && net.piece[h as usize] == piece).count()
    };
    let mut order: Vec<u32> = (0..u32::try_from(mesh.facets.len()).expect("at most MAX_FACETS")).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, random.below(k + 1));
    }
    let mut placed = vec![false; mesh.facets.len()];
    let mut heap = BinaryHeap::new();
    for start in order {
        // What is left when time is up stays in single facets.
        if stop(0.0) {
            return;
        }
        if std::mem::replace(&mut placed[start as usize], true) {
            continue;
        }
        heap.clear();
        let push = |heap: &mut BinaryHeap<LayCandidate>, placed: &[bool], f: u32| {
            for (edge, g) in mesh.neighbours(f) {
                if !placed[g as usize] && weights[edge as usize] > f64::NEG_INFINITY {
                    let moving = usize::from(mesh.edges[edge as usize].sides[1].is_some_and(|second| second.facet == g));
                    heap.push(LayCandidate { weight: weights[edge as usize], edge, moving });
                }
            }
        };
        push(&mut heap, &placed, start);
        while let Some(LayCandidate { edge, moving, weight }) = heap.pop() {
            let g = mesh.edges[edge as usize].sides[moving].expect("inner edge").facet;
            if placed[g as usize] {
                continue;
            }
            let now = weights[edge as usize] - slit * slits(net, &placed, edge, g, net.piece[start as usize]) as f64;
            if now < weight - 1e-9 {
                heap.push(LayCandidate { weight: now, edge, moving });
                continue;
            }
            if let Outcome::Done(_) = net.try_move(Move { across: edge, moving, cut: None, limit: 1 }) {
                placed[g as usize] = true;
                push(&mut heap, &placed, g);
            }
        }
    }
}

/// Distance of the streams of neighbouring seeds: a prime above the number of runs, so that two seeds have no run in common.
const SEED_STRIDE: u64 = 1009;

/// One run: begin, then search for `work` collision tests.
fn run<'p, 'a>(problem: &'p Problem<'a>, effort: Effort, number: u32, least: usize, stop: &Stop<'_>) -> Net<'p, 'a> {
    let mut random = Random::new(effort.seed.wrapping_mul(SEED_STRIDE).wrapping_add(u64::from(number)));
    let mut net = Net::new(problem);
    let weights = weights(problem, number, &mut random);
    let slit = PARAMS.slit_shyness[random.below(PARAMS.slit_shyness.len())];
    grow(&mut net, &weights, slit, &mut random, stop);
    let budget = effort.work / u64::from(effort.runs.max(1));
    let start = net.work;
    let mut best = (net.pieces, snapshot(&net));
    let facets = problem.mesh.facets.len();
    let mut steps = 0_u32;
    loop {
        if best.0 <= least {
            break;
        }
        let spent = net.work - start;
        if spent >= budget {
            break;
        }
        steps += 1;
        if steps.is_multiple_of(256) && stop(spent as f64 / budget as f64) {
            break;
        }
        let heat = 1.0 - spent as f64 / budget as f64;
        let temperature = PARAMS.hot * heat * heat;
        step(&mut net, facets, temperature, &mut random);
        if net.pieces < best.0 {
            best = (net.pieces, snapshot(&net));
        }
    }
    restore(&mut net, best.1);
    net
}

/// What is needed to go back to a net.
type Snapshot = (Vec<bool>, Vec<Option<super::net::TabChoice>>);

fn snapshot(net: &Net<'_, '_>) -> Snapshot {
    (net.tree.clone(), net.tab.clone())
}

fn restore(net: &mut Net<'_, '_>, (tree, tab): Snapshot) {
    net.rebuild(&tree, &tab);
}

/// One random move.
fn step(net: &mut Net<'_, '_>, facets: usize, temperature: f64, random: &mut Random) {
    let problem = net.problem;
    let mesh = problem.mesh;
    // A facet of a small piece, of a few taken at random.
    let mut f = random.below(facets);
    for _ in 0..PARAMS.chosen_of {
        let other = random.below(facets);
        if net.size[net.piece[other] as usize] < net.size[net.piece[f] as usize] {
            f = other;
        }
    }
    let f = u32::try_from(f).expect("at most MAX_FACETS");
    let edges = &mesh.facets[f as usize].edges;
    let first = random.below(edges.len());
    let Some(edge) = (0..edges.len())
        .map(|k| edges[(first + k) % edges.len()])
        .find(|&e| mesh.edges[e as usize].sides[1].is_some() && !net.joined[e as usize])
    else {
        return;
    };
    net.work += 4;
    let g = mesh.other(edge, f).expect("inner edge").facet;
    let (p, q) = (net.piece[g as usize], net.piece[f as usize]);
    let side_of_f = usize::from(mesh.edges[edge as usize].sides[1].is_some_and(|second| second.facet == f));
    if p == q {
        if random.unit() < PARAMS.inside {
            let cut = some_tree_edge(net, f, random);
            let _ = net.try_move(Move { across: edge, moving: side_of_f, cut, limit: PARAMS.largest_part });
        }
        return;
    }
    // Whole pieces first.
    let (small_side, small) = if net.size[q as usize] <= net.size[p as usize] { (side_of_f, q) } else { (1 - side_of_f, p) };
    let whole = Move { across: edge, moving: small_side, cut: None, limit: usize::MAX };
    let tried = net.size[small as usize] <= PARAMS.whole.0 || random.unit() < PARAMS.whole.1;
    if tried && matches!(net.try_move(whole), Outcome::Done(_)) {
        return;
    }
    // A part of one piece to the other.
    let moving = if random.unit() < PARAMS.to_larger { small_side } else { 1 - small_side };
    let mover = mesh.edges[edge as usize].sides[moving].expect("inner edge").facet;
    let Some(cut) = some_tree_edge(net, mover, random) else { return };
    let (a, b) = (f64::from(net.size[net.piece[mover as usize] as usize]), {
        let target = mesh.edges[edge as usize].sides[1 - moving].expect("inner edge").facet;
        f64::from(net.size[net.piece[target as usize] as usize])
    });
    // The sum of squares changes by 2 k (b - a + k) when k facets move from a piece of a to one of b.
    let change = b - a + 1.0;
    if change <= 0.0 && (temperature <= 0.0 || random.unit() >= (change / temperature).exp()) {
        return;
    }
    let _ = net.try_move(Move { across: edge, moving, cut: Some(cut), limit: PARAMS.largest_part });
}

/// A tree edge of a facet, or a few facets further along the tree.
fn some_tree_edge(net: &Net<'_, '_>, facet: u32, random: &mut Random) -> Option<u32> {
    let mesh = net.problem.mesh;
    let mut at = facet;
    let mut last = None;
    loop {
        let edges = &mesh.facets[at as usize].edges;
        let first = random.below(edges.len());
        let next = (0..edges.len()).map(|k| edges[(first + k) % edges.len()]).find(|&e| net.tree[e as usize] && Some(e) != last);
        let Some(edge) = next else { return last };
        last = Some(edge);
        if random.unit() < PARAMS.stop_at {
            return last;
        }
        at = mesh.other(edge, at).expect("tree edges are inner").facet;
    }
}

/// The best net of all runs: fewest glued edges without a tab, fewest pieces, least total length of cuts.
///
/// The runs do not depend on each other or on the number of threads. `stop` is asked now and then with the share of work done;
/// a search that it stops depends on the machine's speed.
pub fn search<'p, 'a>(problem: &'p Problem<'a>, effort: Effort, stop: &Stop<'_>) -> Net<'p, 'a> {
    use rayon::prelude::*;
    let least = problem.mesh.components().len();
    // Beginnings take longer than the search on large meshes.
    let runs = if problem.mesh.facets.len() > PARAMS.large { effort.runs.min(2) } else { effort.runs }.max(1);
    let effort = Effort { runs, ..effort };
    let nets: Vec<Net<'p, 'a>> = (0..runs).into_par_iter().map(|k| run(problem, effort, k, least, stop)).collect();
    let cut_length =
        |net: &Net<'_, '_>| -> f64 { (0..problem.mesh.edges.len()).filter(|&e| !net.joined[e]).map(|e| problem.mesh.length(e)).sum() };
    nets.into_iter()
        .min_by(|a, b| {
            (a.without_tab().count(), a.pieces).cmp(&(b.without_tab().count(), b.pieces)).then(cut_length(a).total_cmp(&cut_length(b)))
        })
        .expect("at least one run")
}
