//! What is wrong with a printed page, in words.

use std::collections::BTreeMap;

/// Findings by kind: of each kind the first few are told.
#[derive(Clone, Debug, Default)]
pub(super) struct Findings(BTreeMap<&'static str, Vec<String>>);

/// How many findings of a kind are told.
const TOLD: usize = 3;

impl Findings {
    /// Adds one: `what` is wrong (its kind), at which place.
    pub(super) fn add(&mut self, kind: &'static str, place: impl Into<String>) {
        self.0.entry(kind).or_default().push(place.into());
    }

    /// The lines to be told.
    pub(super) fn lines(&self) -> Vec<String> {
        self.0
            .iter()
            .map(|(kind, places)| {
                let told = places[..places.len().min(TOLD)].join("; ");
                let more = if places.len() > TOLD { format!("; and {} more", places.len() - TOLD) } else { String::new() };
                format!("{kind}: {told}{more}")
            })
            .collect()
    }
}
