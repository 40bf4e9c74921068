//! What is drawn.

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Title in the footer of every page.
    pub title: String,
    /// Fill facets with their colours.
    pub colours: bool,
    /// Print fold angles beside the folds where they have place.
    pub angles: bool,
    /// Length of a period along x, mm: the first facet of each period carries its number, as the lines of a wrap sheet do. 0 for none.
    pub period: f64,
    /// Print edge numbers.
    pub numbers: bool,
    /// Silhouette's three registration marks on every page.
    pub silhouette: bool,
    /// A mirrored page after each for the back of the paper.
    pub back: bool,
    /// Fold lines and texts on the back only: the front shows colours and the lines to cut. Needs `back`.
    pub clean_front: bool,
}
