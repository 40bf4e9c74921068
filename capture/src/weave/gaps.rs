//! Widths and places of threads by the holes between them.
//!
//! Where two warps and two wefts leave a hole, the line through it along the wefts crosses no weft: along it only warps and holes alternate, whichever
//! is over elsewhere, and whatever light and shadow do on the threads. At its edge a round thread turns away from light and camera; its brightness grows as the
//! root of the distance from the edge. Blurred by a normal curve, that is steepest inside of the edge; where the edge itself is, the slope is 0.842 of
//! that, however strong the blur. A flat thread's brightness is a step, whose edge is where the slope is steepest; threads lie between the two, most of them
//! nearer to the round one.

use super::fold::Fold;
use biscale::numerics::cast::truncate_i64;

/// A hole and its sides, along x and y. Lengths are shares of the pitch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gaps {
    /// Thread coordinates of the middles of warp and weft.
    pub middle: [f64; 2],
    /// Widths of warp and weft.
    pub fill: [f64; 2],
    /// Distance from the steepest place to the edge of a round thread, mean of both sides: how blurred they are.
    pub blur: [f64; 2],
}

/// How a hole's sides are located. Lengths are shares of the pitch.
struct GapParams {
    /// Distance from the hole's darkest place within which its sides lie. Chosen: holes are up to 0.8 of the pitch wide.
    reach: f64,
    /// Distance beyond a side at which the light on the thread is taken. Chosen.
    beside: f64,
    /// Light on the thread over that in the hole, at least. Chosen on drawn cloths: at lower contrast shadows are taken for holes (90 % of the widths within
    /// 28 % then, `docs/weave-analysis.md`).
    contrast: f64,
    /// Slope at the edge of a round thread over the steepest slope. Derived: brightness is 0 before the edge and grows as a root behind it; blurred by any
    /// normal curve, the slope at the edge is 0.842 of the largest.
    at_edge: f64,
    /// Where the edge is taken to be between that of a round (0) and of a flat thread (1). From drawn cloths of seeds 7 and 8, whose sections are ellipses and
    /// flatter ones.
    flat: f64,
    /// Range of a width.
    fill: [f64; 2],
}

const PARAMS: GapParams = GapParams { reach: 0.4, beside: 0.1, contrast: 2.0, at_edge: 0.842, flat: 0.25, fill: [0.3, 1.0] };

/// The hole that all crossings of a fold have in the mean; nothing if there is none that is dark.
pub(super) fn find(fold: &Fold) -> Option<Gaps> {
    let cell: Vec<f64> = fold.mean_cell().iter().map(|c| c.iter().sum::<f64>()).collect();
    let (nx, ny) = (fold.kx as i64, fold.ky as i64);
    let at = |x: i64, y: i64| cell[(y.rem_euclid(ny) * nx + x.rem_euclid(nx)) as usize];
    let around = |x: i64, y: i64| (-1..=1).flat_map(|j| (-1..=1).map(move |i| (i, j))).map(|(i, j)| at(x + i, y + j)).sum::<f64>();
    let (x0, y0) = (0..nx * ny).map(|k| (k % nx, k / nx)).min_by(|a, b| around(a.0, a.1).total_cmp(&around(b.0, b.1)))?;
    let across = |k: i64| (-1..=1).map(|l| at(x0 + k, y0 + l)).sum::<f64>();
    let along = |k: i64| (-1..=1).map(|l| at(x0 + l, y0 + k)).sum::<f64>();
    let sides = [[side(&|k| across(-k), fold.kx)?, side(&across, fold.kx)?], [side(&|k| along(-k), fold.ky)?, side(&along, fold.ky)?]];
    // The hole's middle, from the middle of its darkest bin; the thread's is half a pitch on.
    let middle =
        |k: usize, bin: i64, n: i64| ((bin as f64 + 0.5) / n as f64 + 0.5 * (sides[k][1].edge - sides[k][0].edge) + 0.5).rem_euclid(1.0);
    Some(Gaps {
        middle: [middle(0, x0, nx), middle(1, y0, ny)],
        fill: sides.map(|[a, b]| (1.0 - a.edge - b.edge - PARAMS.flat * (a.blur + b.blur)).clamp(PARAMS.fill[0], PARAMS.fill[1])),
        blur: sides.map(|[a, b]| 0.5 * (a.blur + b.blur)),
    })
}

/// One side of a hole: the distance of a round thread's edge from the hole's darkest place and from where the light rises most, in threads.
#[derive(Clone, Copy)]
struct Side {
    edge: f64,
    blur: f64,
}

/// Where a profile that begins in a hole reaches the thread.
fn side(profile: &dyn Fn(i64) -> f64, bins: usize) -> Option<Side> {
    let (reach, beside) = (truncate_i64(PARAMS.reach * bins as f64), truncate_i64((PARAMS.beside * bins as f64).ceil()));
    let rise = |k: i64| profile(k + 1) - profile(k);
    let k = (0..reach).max_by(|a, b| rise(*a).total_cmp(&rise(*b)))?;
    let contrast = profile(k + 1 + beside) / profile(0).max(1e-6);
    if !(contrast > PARAMS.contrast) || k + 1 == reach {
        return None;
    }
    let (a, b, c) = (rise(k - 1), rise(k), rise(k + 1));
    let bend = a - 2.0 * b + c;
    let shift = if bend < 0.0 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    let steepest = k as f64 + 0.5 + shift;
    // Outwards to where the slope has fallen to what it is at the edge.
    let level = PARAMS.at_edge * (b - 0.25 * (a - c) * shift);
    let outside = (-reach..=k).rev().find(|&m| rise(m) < level)?;
    let share = (level - rise(outside)) / (rise(outside + 1) - rise(outside)).max(1e-12);
    let edge = (outside as f64 + 0.5 + share.clamp(0.0, 1.0)).min(steepest);
    Some(Side { edge: edge / bins as f64, blur: (steepest - edge) / bins as f64 })
}
