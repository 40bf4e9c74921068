//! The search for a net of few pieces.
//!
//! A run begins with pieces joined greedily ([`begin`]). Then parts of pieces move to neighbouring pieces, or to another place in their
//! own, by simulated annealing of `sum s / (s + c) + m sum b`: `s` are the sizes of the pieces in facets, `b` the areas of the boxes around
//! them in pages. The first sum is the number of pieces, but for small ones, which count the less the smaller they are: so small pieces
//! dissolve, while facets move freely between large ones, and none is drawn to the largest. (A sum of squares, to be made large, does the
//! contrary: one piece grows over all places, and leaves crumbs that nothing can take any more.) The second sum lets pieces be compact:
//! without it they become branched, and take twice the paper.

use super::begin::begin;
use super::effort::{Effort, Stop};
use super::net::{Change, Move, Net, Outcome, Problem, TabChoice};
use biscale::numerics::random::Random;

/// Facets above which there is one run: a longer one finds more than several. Chosen, not measured.
const LARGE: usize = 1500;
/// Facets up to which the search takes no longer for more of them. Chosen, not measured.
const SMALL: usize = 400;

/// Numbers of the search.
///
/// They decide how many pieces there are, never whether a net is right. `half`, `chosen_of`, `stop_at` and `hot` were chosen by the pieces
/// of fandisk.obj, cheburashka.obj and spot.obj (`cargo bench -p biscale-fabricate --bench pieces` with `MESHES`); the others were chosen,
/// not measured.
struct SearchParams {
    /// Facets at which a piece counts one half.
    half: f64,
    /// Facets taken at random beside the first, of which the one in the smallest piece is moved: small pieces are to dissolve.
    chosen_of: usize,
    /// Largest part that a move takes off, facets: a larger one costs more collision tests than it wins.
    largest_part: usize,
    /// Share of moves inside one piece.
    inside: f64,
    /// Facets of the smaller of two pieces up to which it is first tried as a whole, and the share of larger ones for which that is tried too.
    whole: (u32, f64),
    /// Chance to stop at each facet along the tree when a part is chosen: its mean distance is one over this.
    stop_at: f64,
    /// Starting temperature, in pieces.
    hot: f64,
    /// Facets for each piece that counts as much as one page of boxes around pieces, and how many pieces count so at most: more pieces take
    /// less paper. Measured as the others, and with fuze.obj, cow.obj and bunny.stl.
    paper: (f64, f64),
}

const PARAMS: SearchParams = SearchParams {
    half: 10.0,
    chosen_of: 2,
    largest_part: 48,
    inside: 0.25,
    whole: (4, 0.2),
    stop_at: 0.85,
    hot: 0.5,
    paper: (100.0, 40.0),
};

/// Distance of the streams of neighbouring seeds: a prime above the number of runs, so that two seeds have no run in common.
const SEED_STRIDE: u64 = 1009;

/// Steps between two questions whether to stop.
const STEPS_BETWEEN_STOPS: u32 = 64;

/// One run: begin, then search for `budget` collision tests.
fn run<'p, 'a>(problem: &'p Problem<'a>, seed: u64, number: u32, budget: u64, stop: &Stop<'_>) -> Net<'p, 'a> {
    let mut random = Random::new(seed.wrapping_mul(SEED_STRIDE).wrapping_add(u64::from(number)));
    let mut net = Net::new(problem);
    begin(&mut net, number, &mut random, stop);
    let least = problem.mesh.components().len();
    let start = net.work;
    let mut best = (net.pieces, snapshot(&net));
    let mut steps = 0_u32;
    while net.work - start < budget {
        let share = (net.work - start) as f64 / budget as f64;
        if steps.is_multiple_of(STEPS_BETWEEN_STOPS) {
            let nothing_to_win = net.pieces <= least && net.boxes() <= page_area(problem);
            if nothing_to_win || stop(share) {
                break;
            }
        }
        steps = steps.wrapping_add(1);
        step(&mut net, PARAMS.hot * (1.0 - share), &mut random);
        if net.pieces < best.0 {
            best = (net.pieces, snapshot(&net));
        }
    }
    // Rounding of many moves is gone from a net that is laid out anew.
    let (tree, tab) = snapshot(&net);
    net.rebuild(&tree, &tab);
    if net.pieces > best.0 {
        let last = cost(&net);
        net.rebuild(&best.1.0, &best.1.1);
        if last < cost(&net) {
            net.rebuild(&tree, &tab);
        }
    }
    net
}

/// What is needed to go back to a net.
type Snapshot = (Vec<bool>, Vec<Option<TabChoice>>);

fn snapshot(net: &Net<'_, '_>) -> Snapshot {
    (net.tree.clone(), net.tab.clone())
}

/// Area of a page, mm²; of a roll that of a page as wide, in the format of A4.
fn page_area(problem: &Problem<'_>) -> f64 {
    let (long, short) = (problem.sheet.size.max_element(), problem.sheet.size.min_element());
    short * long.min(std::f64::consts::SQRT_2 * short)
}

/// What 1 mm² of boxes around pieces counts, in pieces.
fn paper(problem: &Problem<'_>) -> f64 {
    let (facets, most) = PARAMS.paper;
    (problem.mesh.facets.len() as f64 / facets).min(most) / page_area(problem)
}

/// What is to be small in the end: pieces, and pages of boxes around them.
fn cost(net: &Net<'_, '_>) -> f64 {
    net.pieces as f64 + paper(net.problem) * net.boxes()
}

/// What a piece of so many facets counts.
fn count(size: u32) -> f64 {
    let size = f64::from(size);
    size / (size + PARAMS.half)
}

/// One random move.
fn step(net: &mut Net<'_, '_>, temperature: f64, random: &mut Random) {
    let mesh = net.problem.mesh;
    net.work += 1;
    // A facet of a small piece, of a few taken at random.
    let mut f = random.below(mesh.facets.len());
    for _ in 0..PARAMS.chosen_of {
        let other = random.below(mesh.facets.len());
        if net.size[net.piece[other] as usize] < net.size[net.piece[f] as usize] {
            f = other;
        }
    }
    let f = u32::try_from(f).expect("at most MAX_FACETS");
    let edges = &mesh.facets[f as usize].edges;
    let first = random.below(edges.len());
    let open = |e: &u32| mesh.edges[*e as usize].sides[1].is_some() && !net.joined[*e as usize];
    let Some(across) = (0..edges.len()).map(|k| edges[(first + k) % edges.len()]).find(open) else { return };
    net.work += 4;
    let g = mesh.other(across, f).expect("inner edge").facet;
    let side_of_f = usize::from(mesh.edges[across as usize].sides[1].is_some_and(|second| second.facet == f));
    let [p, q] = [f, g].map(|facet| net.piece[facet as usize] as usize);
    let paper = paper(net.problem);
    // Metropolis: a change by `d` is taken with probability exp(-d / T), that is where d < -T ln u.
    let allowed = -temperature * (1.0 - random.unit()).ln();
    let wanted = |change: Change| {
        let [from, into] = change.sizes;
        let counts = count(from - change.moved) + count(into + change.moved) - count(from) - count(into);
        counts + paper * change.boxes < allowed
    };
    if p == q {
        if random.unit() < PARAMS.inside {
            let cut = some_tree_edge(net, f, random);
            net.try_move_if(Move { across, moving: side_of_f, cut, limit: PARAMS.largest_part }, wanted);
        }
        return;
    }
    // Whole pieces first.
    let tried = net.size[p].min(net.size[q]) <= PARAMS.whole.0 || random.unit() < PARAMS.whole.1;
    if tried {
        let moving = if net.size[p] <= net.size[q] { side_of_f } else { 1 - side_of_f };
        if matches!(net.try_move_if(Move { across, moving, cut: None, limit: usize::MAX }, wanted), Outcome::Done(_)) {
            return;
        }
    }
    // A part of one piece to the other.
    let (moving, mover) = if random.unit() < 0.5 { (side_of_f, f) } else { (1 - side_of_f, g) };
    let Some(cut) = some_tree_edge(net, mover, random) else { return };
    net.try_move_if(Move { across, moving, cut: Some(cut), limit: PARAMS.largest_part }, wanted);
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

/// The best net of all runs: fewest glued edges without a tab, then pieces and paper.
///
/// The runs do not depend on each other or on the number of threads. `stop` is asked now and then with the share of work done;
/// a search that it stops depends on the machine's speed.
pub fn search<'p, 'a>(problem: &'p Problem<'a>, effort: Effort, stop: &Stop<'_>) -> Net<'p, 'a> {
    use rayon::prelude::*;
    let facets = problem.mesh.facets.len();
    let runs = if facets > LARGE { 1 } else { effort.runs.max(1) };
    let budget = effort.work.saturating_mul(facets.max(SMALL) as u64) / u64::from(runs);
    let nets: Vec<Net<'p, 'a>> = (0..runs).into_par_iter().map(|k| run(problem, effort.seed, k, budget, stop)).collect();
    let worth = |net: &Net<'_, '_>| (net.without_tab().count(), cost(net));
    let better = |a: &Net<'_, '_>, b: &Net<'_, '_>| {
        let (a, b) = (worth(a), worth(b));
        a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
    };
    nets.into_iter().min_by(better).expect("at least one run")
}
