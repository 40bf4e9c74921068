//! The pieces of a net, ready to be drawn: outlines, tabs, folds, and which edge is glued to which.

use super::alike::alike;
use super::net::Net;
use super::piece::Piece;
use rustc_hash::FxHashMap;

/// Pieces of paper that together make the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Pattern {
    /// The pieces, largest first, copies one after another.
    pub pieces: Vec<Piece>,
    /// Edges of the surface that are glued, with their numbers, from 1. Copies of a piece have the same numbers.
    pub glued: Vec<(u32, usize)>,
    /// Folds below this angle, radians, are flat to the eye: neither scored nor labelled. They keep their angles for who refolds the pattern.
    pub flat_angle: f64,
}

/// [`Pattern::flat_angle`] by default, degrees. Chosen, not measured: paper bends so far by itself.
pub const FLAT_ANGLE_DEG: f64 = 1.0;

impl Pattern {
    /// Gathers the pieces of a net.
    pub fn new(net: &Net<'_, '_>) -> Self {
        let mesh = net.problem.mesh;
        let mut place: FxHashMap<u32, usize> = FxHashMap::default();
        let mut lists: Vec<Vec<u32>> = Vec::new();
        for (f, &piece) in (0_u32..).zip(&net.piece) {
            let k = *place.entry(piece).or_insert_with(|| {
                lists.push(Vec::new());
                lists.len() - 1
            });
            lists[k].push(f);
        }
        lists.sort_by(|a, b| b.len().cmp(&a.len()).then(a[0].cmp(&b[0])));
        let mut number: FxHashMap<u32, usize> = FxHashMap::default();
        let mut glued = Vec::new();
        // Numbers rise along the pieces, so that a person finds them.
        for &f in lists.iter().flatten() {
            for (edge, _) in mesh.neighbours(f) {
                if !net.joined[edge as usize] {
                    number.entry(edge).or_insert_with(|| {
                        glued.push((edge, glued.len() + 1));
                        glued.len()
                    });
                }
            }
        }
        let pieces = lists.iter().map(|facets| Piece::new(net, facets, &number)).collect();
        let mut out = Self { pieces, glued, flat_angle: FLAT_ANGLE_DEG.to_radians() };
        for (k, piece) in out.pieces.iter_mut().enumerate() {
            (piece.name, piece.copy, piece.copies) = (k + 1, 1, 1);
        }
        out.name_and_compare();
        out
    }

    /// Names the pieces by their places, but for copies, and finds those of one shape.
    pub(super) fn name_and_compare(&mut self) {
        let mut name = 0;
        for piece in &mut self.pieces {
            name += usize::from(piece.copy == 1);
            piece.name = name;
        }
        // The first pieces of each shape, by what is cheap to compare.
        let mut first: FxHashMap<[usize; 3], Vec<usize>> = FxHashMap::default();
        for k in 0..self.pieces.len() {
            let piece = &self.pieces[k];
            let list = first.entry([piece.facets.len(), piece.folds.len(), piece.tabs.len()]).or_default();
            let like = if piece.copy > 1 { Some(self.pieces[k - 1].like) } else { None };
            let like = like.or_else(|| list.iter().copied().find(|&j| alike(&self.pieces[j], piece)));
            self.pieces[k].like = like.unwrap_or_else(|| {
                list.push(k);
                k
            });
        }
    }

    /// How many pieces are like this one, itself included.
    pub fn alike(&self, piece: usize) -> usize {
        self.pieces.iter().filter(|p| p.like == self.pieces[piece].like).count()
    }
}
