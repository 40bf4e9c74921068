//! Which pieces are one shape with the same folds.

use super::net::Pose;
use super::piece::Piece;
use glam::DVec2;
use rustc_hash::FxHashMap;

/// Lengths that differ by less are one shape to scissors, mm: what the verifier allows a refolded corner. Chosen, not measured.
const SAME_SHAPE: f64 = 1e-4;

/// Whether two pieces are one shape with the same folds and tabs: some motion brings every facet, fold and tab of one onto one of the other.
pub(super) fn alike(a: &Piece, b: &Piece) -> bool {
    let length = |p: &Piece| p.outline.iter().map(|o| (0..o.len()).map(|k| o[k].distance(o[(k + 1) % o.len()])).sum::<f64>()).sum::<f64>();
    if (length(a) - length(b)).abs() > SAME_SHAPE * 10.0 {
        return false;
    }
    let (_, first) = &a.facets[0];
    let marks_of_b = Marks::new(b);
    let own = Marks::list(a);
    b.facets.iter().filter(|(_, q)| q.len() == first.len()).any(|(_, q)| {
        (0..q.len()).any(|turn| {
            let ends = [q[turn], q[(turn + 1) % q.len()]];
            if (ends[0].distance(ends[1]) - first[0].distance(first[1])).abs() > SAME_SHAPE {
                return false;
            }
            let pose = Pose::mapping([first[0], first[1]], ends);
            own.iter().all(|&(at, what)| marks_of_b.has(pose.apply(at), what))
        })
    })
}

/// Points of a piece with what they are: corners of facets and tabs, middles of folds with their angles.
struct Marks(FxHashMap<[i64; 2], Vec<(DVec2, f64)>>);

impl Marks {
    /// Marks of corners: beyond all angles.
    const CORNER: f64 = 10.0;
    const TAB: f64 = 20.0;

    fn list(piece: &Piece) -> Vec<(DVec2, f64)> {
        let corners = piece.facets.iter().flat_map(|(_, p)| p).map(|&p| (p, Self::CORNER));
        let tabs = piece.tabs.iter().flat_map(|t| &t.corners).map(|&p| (p, Self::TAB));
        let folds = piece.folds.iter().map(|f| (0.5 * (f.ends[0] + f.ends[1]), f.angle));
        corners.chain(tabs).chain(folds).collect()
    }

    fn cell(p: DVec2) -> [i64; 2] {
        (p / 1e-2).floor().to_array().map(|x| x as i64)
    }

    fn new(piece: &Piece) -> Self {
        let mut out: FxHashMap<[i64; 2], Vec<(DVec2, f64)>> = FxHashMap::default();
        for (at, what) in Self::list(piece) {
            out.entry(Self::cell(at)).or_default().push((at, what));
        }
        Self(out)
    }

    fn has(&self, p: DVec2, what: f64) -> bool {
        let [x, y] = Self::cell(p);
        let mut near = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [x + dx, y + dy])).flat_map(|c| self.0.get(&c).into_iter().flatten());
        near.any(|&(q, w)| p.distance(q) <= SAME_SHAPE && (w - what).abs() <= 1e-6)
    }
}
