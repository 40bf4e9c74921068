//! The plan of a low-rank run: written into its summary, read again to repeat its bits.

use super::Variant;
use super::rates::{LARGEST, Sides};
use crate::error::{BadInput, Result};
use std::fmt;
use std::ops::RangeInclusive;

/// Facets that a run may have.
const FACETS: RangeInclusive<usize> = 64..=MAX_FACETS;
/// Most facets.
pub const MAX_FACETS: usize = 1 << 17;
/// Sides of the map of visibility directions.
const DIRECTIONS: RangeInclusive<usize> = 2..=64;
/// Sides of maps of normals.
const NORMALS: RangeInclusive<usize> = 2..=MAX_NORMALS;
/// Largest side of a map of normals.
pub const MAX_NORMALS: usize = 512;

/// All that fixes the bits of a run beside its seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Plan {
    /// As published.
    Paper {
        /// Facets.
        facets: usize,
        /// Side of the map of directions for which visibility is found: 12 has 112 cells, 13 has 137.
        directions: usize,
        /// Sides of the largest maps that `M` may have.
        rates: Sides,
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

impl fmt::Display for Plan {
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

impl Plan {
    /// What Wu et al. (2011, sections 5 and 6) used: of 500 to 12,000 facets and 88 to 132 directions numbers in between, 99.5 % of the power
    /// of `N`, 98 % of that of `M`.
    pub const PAPER: Self = Self::Paper { facets: 4096, directions: 13, rates: LARGEST, energy: [0.995, 0.98] };

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

    /// Reads what `Display` writes. Keys may come in any order; those that are left out are as in [`Plan::PAPER`], or, improved, as in
    /// [`Plan::first`] of the default tolerance.
    ///
    /// # Errors
    /// [`BadInput`] for a text that is none, or a number out of range.
    pub fn parse(text: &str) -> Result<Self, BadInput> {
        let bad = |problem: String| {
            let remedy = format!("write one as a summary prints it, such as \"{}\"", Self::PAPER);
            BadInput::new(problem, remedy).at_field("--plan")
        };
        let mut words = text.split(':');
        let mut plan = match (words.next(), words.next()) {
            (Some("lowrank"), Some("paper")) => Self::PAPER,
            (Some("lowrank"), Some("improved")) => Self::first(crate::filter::Quality::default().tolerance),
            _ => return Err(bad(format!("\"{text}\" is not a plan of the method lowrank"))),
        };
        for word in words {
            let unreadable = || bad(format!("\"{word}\" in \"{text}\" is not part of such a plan, or out of range"));
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
                    *rates = Sides {
                        directions: whole(directions, &(2..=LARGEST.directions))?,
                        normals: whole(normals, &(2..=LARGEST.normals))?,
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
        for plan in [Plan::PAPER, Plan::first(0.005), Plan::first(1.0), Plan::first(1e-6)] {
            assert_eq!(Plan::parse(&plan.to_string()).unwrap(), plan, "{plan}");
        }
        let few = Plan::parse("lowrank:paper:energy=0.5,1:facets=500").unwrap();
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
            let error = Plan::parse(text).unwrap_err().to_string();
            assert!(error.contains("--plan") && error.contains(text) && error.contains("lowrank:paper:facets"), "{error}");
        }
    }
}
