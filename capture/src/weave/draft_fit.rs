//! A draft with the shape that fits it, and by what drafts are compared.

use super::class::Class;
use super::grid::Repeat;
use super::model::{ClothShape, ModelFit};
use biscale::geometry::weave::Draft;

/// A draft with the shape that fits it best.
#[derive(Clone, Debug)]
pub(super) struct DraftFit {
    /// For each different crossing whether the warp lies over.
    pub labels: Vec<bool>,
    /// Shape of the cloth.
    pub shape: ClothShape,
    /// How well both explain the fold.
    pub fit: ModelFit,
    /// Standard errors of the widths, as shares of the pitch.
    pub fill_error: [f64; 2],
}

/// Width of threads over their pitch where nothing tells it, in the middle of those of the drawn cloths (0.65 to 0.97): where fits begin.
pub(super) const USUAL_FILL: f64 = 0.85;

/// What makes a cloth unlikely. Chosen on drawn cloths (see [`super`]).
///
/// Without it a wrong draft explains a photograph by a shape that cannot be woven; with penalties several times as strong a right draft of unusual threads
/// loses to a wrong one.
struct LikelihoodParams {
    /// Bend of threads that touch. Contact at a crossing displaces each centre line by a quarter of the sum of both heights, which is a bend of 1; 0.05 is
    /// added.
    bend: f64,
    /// Spread of the logarithm of the bend.
    bend_spread: f64,
    /// Share that one spread of bend adds to the residual.
    bend_weight: f64,
    /// Height of a thread over its width, in the middle of those that are woven.
    flatness: f64,
    /// Spread of the logarithm of the flatness.
    flatness_spread: f64,
    /// Share that one spread of flatness adds to the residual.
    flatness_weight: f64,
    /// Factor on the residual of a draft of no known class: of the drafts of a repeat only few are woven, so one that is not must leave a third less.
    unnamed_price: f64,
}

const PARAMS: LikelihoodParams = LikelihoodParams {
    bend: 1.05,
    bend_spread: 0.3,
    bend_weight: 0.03,
    flatness: 0.4,
    flatness_spread: 0.5,
    flatness_weight: 0.01,
    unnamed_price: 1.5,
};

impl DraftFit {
    /// What is compared between drafts: the residual, times the penalties of an unlikely shape and of a draft without a name.
    pub fn cost(&self, repeat: Repeat) -> f64 {
        self.fit.residual * shape_penalty(&self.shape) * draft_penalty(repeat, &self.labels)
    }
}

/// Factor on the residual of a shape: 1 for a likely one.
///
/// Threads that cross touch each other, so the bend follows from the sections: less would let them run through each other, more would leave air between
/// them.
pub(super) fn shape_penalty(shape: &ClothShape) -> f64 {
    let off = |value: f64, usual: f64, spread: f64| ((value / usual).ln() / spread).powi(2);
    1.0 + PARAMS.bend_weight * off(shape.bend, PARAMS.bend, PARAMS.bend_spread)
        + PARAMS.flatness_weight * off(shape.flatness, PARAMS.flatness, PARAMS.flatness_spread)
}

/// Factor on the residual of a draft: 1 for one of a known class.
pub(super) fn draft_penalty(repeat: Repeat, labels: &[bool]) -> f64 {
    if Class::of(&draft_of(repeat, labels)) == Class::Other { PARAMS.unnamed_price } else { 1.0 }
}

/// The draft of labels, over the rectangle after which it repeats.
pub(super) fn draft_of(repeat: Repeat, labels: &[bool]) -> Draft {
    let over = |i: usize, j: usize| labels[repeat.place(i as i64, j as i64)];
    let draft = Draft::from_fn(repeat.columns as usize, repeat.tall() as usize, over);
    let (columns, rows) = (draft.column_period(|_, _| true), draft.row_period(|_, _| true));
    draft.cropped(columns, rows)
}

/// The first of all translations of the labels.
pub(super) fn canonical(repeat: Repeat, labels: &[bool]) -> Vec<bool> {
    let translated = |di: i64, dj: i64| -> Vec<bool> {
        (0..labels.len() as i64).map(|k| labels[repeat.place(k % repeat.columns + di, k / repeat.columns + dj)]).collect()
    };
    (0..labels.len() as i64).map(|k| translated(k % repeat.columns, k / repeat.columns)).min().unwrap_or_default()
}
