//! The plan of a run of the method `lowrank`: its variant, facets, maps and cuts.

use super::variant::Variant;
use crate::error::BadInput;
use crate::filter::tolerance::DEFAULT_TOLERANCE;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Facets that a run may have.
const FACETS: RangeInclusive<usize> = MIN_FACETS..=MAX_FACETS;
/// Fewest facets.
pub const MIN_FACETS: usize = 64;
/// Most facets.
pub const MAX_FACETS: usize = 1 << 18;
/// Sides of the map of visibility directions.
const DIRECTIONS: RangeInclusive<usize> = 2..=64;
/// Sides of maps of normals.
const NORMALS: RangeInclusive<usize> = 2..=MAX_NORMALS;
/// Largest side of a map of normals.
pub const MAX_NORMALS: usize = 512;

/// Pixels of a side of the map of directions and of that of normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MapSides {
    /// Map of a hemisphere: rows are pairs of its cells.
    pub directions: usize,
    /// Map of the sphere: columns are its cells.
    pub normals: usize,
}

/// Sides of the largest maps: about 1,800 directions, whose pairs are 1.6 million rows, and 6,400 normals. The paper clamps `M` to 1.7 million
/// rows and 6,400 columns (section 5).
pub const LARGEST_MAPS: MapSides = MapSides { directions: 48, normals: 64 };

/// All that fixes the bits of a run of `lowrank` beside its seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LowRankPlan {
    /// As published.
    Paper {
        /// Facets.
        facets: usize,
        /// Side of the map of directions for which visibility is found: 12 has 112 cells, 13 has 137.
        directions: usize,
        /// Sides of the largest maps that `M` may have.
        rates: MapSides,
        /// Shares of the power of `N` and of `M` that are kept.
        energy: [f64; 2],
    },
    /// With this project's changes.
    Improved {
        /// Facets, a power of two.
        facets: usize,
        /// Side of the map of normals whose cells are united.
        normals: usize,
        /// Shares of the power of `N` and of `M` that are kept.
        energy: [f64; 2],
    },
}

impl fmt::Display for LowRankPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [n, m] = self.energy();
        match self {
            Self::Paper { facets, directions, rates, .. } => write!(
                f,
                "lowrank:paper:facets={facets}:directions={directions}:rates={}x{}:energy={n},{m}",
                rates.directions, rates.normals
            ),
            Self::Improved { facets, normals, .. } => write!(f, "lowrank:improved:facets={facets}:normals={normals}:energy={n},{m}"),
        }
    }
}

impl LowRankPlan {
    /// What Wu et al. (2011, sections 5 and 6) used: of 500 to 12,000 facets and 88 to 132 directions numbers in between, 99.5 % of the power
    /// of `N`, 98 % of that of `M`.
    pub const PAPER: Self = Self::Paper { facets: 4096, directions: 13, rates: LARGEST_MAPS, energy: [0.995, 0.98] };

    /// Where a search for a tolerance starts: cuts that take an eighth of it each.
    pub fn first(tolerance: f64) -> Self {
        let kept = 1.0 - (tolerance / 8.0).powi(2);
        Self::Improved { facets: 2048, normals: 16, energy: [kept; 2] }
    }

    /// The variant that it is a plan of.
    pub fn variant(&self) -> Variant {
        match self {
            Self::Paper { .. } => Variant::Paper,
            Self::Improved { .. } => Variant::Improved,
        }
    }

    /// Facets.
    pub fn facets(&self) -> usize {
        let (Self::Paper { facets, .. } | Self::Improved { facets, .. }) = self;
        *facets
    }

    /// Shares of the power of `N` and of `M` that are kept.
    pub fn energy(&self) -> [f64; 2] {
        let (Self::Paper { energy, .. } | Self::Improved { energy, .. }) = self;
        *energy
    }

    /// The error for a text that is none.
    pub(super) fn no_plan(text: &str) -> BadInput {
        Self::bad(format!("\"{text}\" is not a plan of the method lowrank"))
    }

    fn bad(problem: String) -> BadInput {
        BadInput::new(problem, format!("write one as a summary prints it, such as \"{}\"", Self::PAPER)).at_field("plan")
    }
}

impl FromStr for LowRankPlan {
    type Err = BadInput;

    /// Reads what `Display` writes. Keys may come in any order; those that are left out are as in [`LowRankPlan::PAPER`], or, improved, as in
    /// [`LowRankPlan::first`] of the default tolerance.
    fn from_str(text: &str) -> Result<Self, BadInput> {
        let mut words = text.split(':');
        let mut plan = match (words.next(), words.next()) {
            (Some("lowrank"), Some("paper")) => Self::PAPER,
            (Some("lowrank"), Some("improved")) => Self::first(DEFAULT_TOLERANCE),
            _ => return Err(Self::no_plan(text)),
        };
        for word in words {
            let unreadable = || Self::bad(format!("\"{word}\" in \"{text}\" is not part of such a plan, or out of range"));
            let (key, value) = word.split_once('=').ok_or_else(unreadable)?;
            let whole = |value: &str, range: &RangeInclusive<usize>| {
                value.parse::<usize>().ok().filter(|v| range.contains(v)).ok_or_else(unreadable)
            };
            match (key, &mut plan) {
                ("facets", Self::Paper { facets, .. }) => *facets = whole(value, &FACETS)?,
                ("facets", Self::Improved { facets, .. }) => {
                    *facets = whole(value, &FACETS)?;
                    if !facets.is_power_of_two() {
                        return Err(unreadable());
                    }
                }
                ("directions", Self::Paper { directions, .. }) => *directions = whole(value, &DIRECTIONS)?,
                ("normals", Self::Improved { normals, .. }) => *normals = whole(value, &NORMALS)?,
                ("rates", Self::Paper { rates, .. }) => {
                    let (directions, normals) = value.split_once('x').ok_or_else(unreadable)?;
                    *rates = MapSides {
                        directions: whole(directions, &(2..=LARGEST_MAPS.directions))?,
                        normals: whole(normals, &(2..=LARGEST_MAPS.normals))?,
                    };
                }
                ("energy", Self::Paper { energy, .. } | Self::Improved { energy, .. }) => {
                    let (n, m) = value.split_once(',').ok_or_else(unreadable)?;
                    let share = |value: &str| value.parse::<f64>().ok().filter(|v| (0.0..=1.0).contains(v)).ok_or_else(unreadable);
                    *energy = [share(n)?, share(m)?];
                }
                _ => return Err(unreadable()),
            }
        }
        Ok(plan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_reads_as_it_is_written() {
        for plan in [LowRankPlan::PAPER, LowRankPlan::first(0.005), LowRankPlan::first(1.0), LowRankPlan::first(1e-6)] {
            assert_eq!(plan.to_string().parse::<LowRankPlan>().unwrap(), plan, "{plan}");
        }
        let few = "lowrank:paper:energy=0.5,1:facets=500".parse::<LowRankPlan>().unwrap();
        assert_eq!(few.to_string(), "lowrank:paper:facets=500:directions=13:rates=48x64:energy=0.5,1");
    }

    #[test]
    fn what_is_no_plan_is_refused_with_an_example() {
        for text in [
            "",
            "lowrank",
            "lowrank:fast",
            "direct:2048x1",
            "lowrank:paper:facets",
            "lowrank:paper:facets=0",
            "lowrank:paper:facets=99999999999999999999",
            "lowrank:paper:directions=1",
            "lowrank:paper:normals=8",
            "lowrank:paper:rates=49x64",
            "lowrank:paper:rates=48",
            "lowrank:paper:energy=1",
            "lowrank:paper:energy=1,1.1",
            "lowrank:paper:energy=nan,1",
            "lowrank:improved:facets=2049",
            "lowrank:improved:directions=12",
            "lowrank:improved:normals=513",
            "lowrank:improved:",
        ] {
            let error = text.parse::<LowRankPlan>().unwrap_err().to_string();
            assert!(error.starts_with("plan: ") && error.contains(text) && error.contains("lowrank:paper:facets"), "{error}");
        }
    }
}
