//! What a folder was sorted into.

use super::missing::Missing;
use super::roles::Roles;

/// A folder that was sorted.
#[derive(Clone, Debug)]
pub struct Sorted {
    /// The shoot file.
    pub text: String,
    /// What is told of photographs that are not used, or are doubtful.
    pub notes: Vec<String>,
    /// What a capture lacks.
    pub missing: Vec<Missing>,
    /// Whether a photograph of the sample has a tone curve, so that `capture` needs `--assume-srgb`.
    pub assume_srgb: bool,
    /// The photographs by their roles.
    pub roles: Roles,
}

impl Sorted {
    /// Whether nothing is missing that a capture cannot do without.
    pub fn is_complete(&self) -> bool {
        self.missing.iter().all(|m| !m.required)
    }
}
