//! What a state and its linear unknowns are in the material and in the photographs.

use crate::fit_file::assignment::Assignment;
use crate::fit_file::spec::Spec;
use crate::fit_file::variant::Variant;
use crate::residuals::input::assignments;
use crate::residuals::state::State;
use crate::residuals::unknowns::{Unknown, UnknownKind};

/// What a state and the colours that go with it set in the start material.
pub(super) fn found(spec: &Spec, variant: &Variant, state: &State, unknowns: &[Unknown], linear: &[f64]) -> Vec<Assignment> {
    let mut all = assignments(spec, variant, &state.values);
    for (k, colour) in spec.colours.iter().enumerate() {
        let mut found = [0.0; 3];
        for (unknown, &value) in unknowns.iter().zip(linear) {
            match unknown.kind {
                UnknownKind::Colour(j, None) if j == k => found = [value; 3],
                UnknownKind::Colour(j, Some(c)) if j == k => found[c] = value,
                _ => {}
            }
        }
        all.push(Assignment::Colour(colour.number, found));
    }
    all
}
