//! The plan of a run of the method `reference`: rays of the first round, doublings of the later ones.

use crate::error::BadInput;
use std::fmt;
use std::str::FromStr;

/// Independent sequences of rays of a pair, whose spread gives its standard error: of `R` normal numbers the standard deviation is known to
/// `1 / sqrt(2 (R - 1))`, at 16 to 18 %.
pub const BATCHES: usize = 16;
/// Most rays from the viewer for one pair. What a tolerance needs beyond them is said in a note. Chosen, not measured: seconds a pair.
pub const MAX_RAYS: u32 = 1 << 22;

/// All that fixes the bits of a run of `reference` beside its seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ReferencePlan {
    /// Reflections after the first.
    pub bounces: u32,
    /// Rays of each batch in the first round.
    pub first: u32,
    /// Doublings of each later round.
    pub doublings: Vec<u32>,
}

impl FromStr for ReferencePlan {
    type Err = BadInput;

    /// Reads what `Display` writes.
    fn from_str(text: &str) -> Result<Self, BadInput> {
        let bad = || Self::no_plan(text);
        let mut fields = text.split(':');
        let mut field = |name: &str| fields.next().and_then(|f| f.strip_prefix(name)).ok_or_else(bad);
        field("reference")?;
        let bounces = field("bounces=")?.parse().map_err(|_| bad())?;
        let first = field("first=")?.parse().map_err(|_| bad())?;
        let doublings = match fields.next().map(|f| f.strip_prefix("doublings=").ok_or_else(bad)).transpose()? {
            None => Vec::new(),
            Some(list) => list.split(',').map(|n| n.parse().map_err(|_| bad())).collect::<Result<_, _>>()?,
        };
        if fields.next().is_some() || first == 0 || first > MAX_RAYS / BATCHES as u32 {
            return Err(bad());
        }
        Ok(Self { bounces, first, doublings })
    }
}

impl ReferencePlan {
    /// The error for a text that is none.
    pub(super) fn no_plan(text: &str) -> BadInput {
        let remedy = "give a plan that this method printed, such as `reference:bounces=0:first=128:doublings=64,30`";
        BadInput::new(format!("`{text}` is not a plan of the method `reference`"), remedy).at_field("plan")
    }
}

impl fmt::Display for ReferencePlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "reference:bounces={}:first={}", self.bounces, self.first)?;
        for (k, n) in self.doublings.iter().enumerate() {
            write!(f, "{}{n}", if k == 0 { ":doublings=" } else { "," })?;
        }
        Ok(())
    }
}
