//! The plan of a run of the method `sg`: its variant, facets, lobes, and how these are fitted and integrated.

use super::low_rank::{MAX_FACETS, MIN_FACETS};
use super::variant::Variant;
use crate::error::BadInput;
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Facets that a run may have.
const FACETS: RangeInclusive<usize> = MIN_FACETS..=MAX_FACETS;
/// Most lobes of the normals of a surface: a woven tile of 2,760 distinct normals, whose polished threads show each of them, has one for each.
pub const MAX_LOBES: usize = 4096;
/// Most lobes that the information criterion chooses: each power of two up to it is fitted.
pub const MAX_CHOSEN_LOBES: usize = 128;
/// Factors between the sharpnesses of a BRDF's lobes.
const SPACINGS: RangeInclusive<f64> = 1.5..=100.0;

/// How the amplitudes of the lobes of the normals follow from what a pair sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AmplitudeFit {
    /// Each lobe has the area of the facets that it is responsible for: never negative, and no area is lost.
    Responsibilities,
    /// Least squares against the visible normals (Iwasaki et al. 2012, eq. 8).
    LeastSquares,
    /// The same with amplitudes of at least 0.
    NonNegative,
}

/// How many lobes the normals of a surface have, at most one for each distinct normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LobeCount {
    /// So many.
    Fixed(usize),
    /// As many as the Bayesian information criterion asks for, of the powers of two up to [`MAX_CHOSEN_LOBES`].
    Criterion,
}

/// The lobes that a small-scale BRDF is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BrdfLobes {
    /// One, with the value and curvature of the BRDF's peak (Wang et al. 2009).
    Single,
    /// A sum of some whose sharpnesses grow by this factor.
    Spaced(f64),
}

/// The integral of the product of a lobe of the normals and one of the BRDF.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ProductIntegral {
    /// Itself (eq. 10).
    Exact,
    /// Its closure in one lobe (eq. 15).
    Closure,
}

/// All that fixes the bits of a run of `sg` beside its seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SphericalGaussianPlan {
    /// How facets are placed, and where the factors of a BRDF that are no lobe are taken.
    pub variant: Variant,
    /// Facets.
    pub facets: usize,
    /// Lobes of the normals of a surface.
    pub lobes: LobeCount,
    /// Amplitudes of a surface that are stored for each pair: modes of the visibility of its lobes, or one a lobe if these are no more. By least squares each lobe
    /// has its own.
    pub modes: usize,
    /// How their amplitudes follow from visibility.
    pub amplitudes: AmplitudeFit,
    /// Lobes of a BRDF.
    pub brdf: BrdfLobes,
    /// The integral of two lobes.
    pub integral: ProductIntegral,
}

impl fmt::Display for SphericalGaussianPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let variant = match self.variant {
            Variant::Paper => "paper",
            Variant::Improved => "improved",
        };
        let amplitudes = match self.amplitudes {
            AmplitudeFit::Responsibilities => "responsibilities",
            AmplitudeFit::LeastSquares => "least-squares",
            AmplitudeFit::NonNegative => "non-negative",
        };
        let integral = match self.integral {
            ProductIntegral::Exact => "exact",
            ProductIntegral::Closure => "closure",
        };
        write!(f, "sg:{variant}:facets={}:lobes=", self.facets)?;
        match self.lobes {
            LobeCount::Fixed(lobes) => write!(f, "{lobes}")?,
            LobeCount::Criterion => f.write_str("criterion")?,
        }
        write!(f, ":modes={}:amplitudes={amplitudes}:brdf=", self.modes)?;
        match self.brdf {
            BrdfLobes::Single => f.write_str("single")?,
            BrdfLobes::Spaced(factor) => write!(f, "{factor}")?,
        }
        write!(f, ":integral={integral}")
    }
}

impl SphericalGaussianPlan {
    /// As Iwasaki et al. (2012) have it: up to 8 lobes (Fig. 4), least squares, one lobe a BRDF. They do not say how many facets.
    pub const PAPER: Self = Self {
        variant: Variant::Paper,
        facets: 8192,
        lobes: LobeCount::Fixed(8),
        modes: 8,
        amplitudes: AmplitudeFit::LeastSquares,
        brdf: BrdfLobes::Single,
        integral: ProductIntegral::Exact,
    };
    /// Where a search for a tolerance starts.
    pub const FIRST: Self = Self {
        variant: Variant::Improved,
        facets: 2048,
        lobes: LobeCount::Fixed(32),
        modes: 8,
        amplitudes: AmplitudeFit::Responsibilities,
        brdf: BrdfLobes::Spaced(2.0),
        integral: ProductIntegral::Exact,
    };

    /// The error for a text that is none.
    pub(super) fn no_plan(text: &str) -> BadInput {
        Self::bad(format!("\"{text}\" is not a plan of the method sg"))
    }

    fn bad(problem: String) -> BadInput {
        BadInput::new(problem, format!("write one as a summary prints it, such as \"{}\"", Self::FIRST)).at_field("plan")
    }
}

impl FromStr for SphericalGaussianPlan {
    type Err = BadInput;

    /// Reads what `Display` writes. Keys may come in any order; those that are left out are as in [`SphericalGaussianPlan::PAPER`] or
    /// [`SphericalGaussianPlan::FIRST`].
    fn from_str(text: &str) -> Result<Self, BadInput> {
        let mut words = text.split(':');
        let mut plan = match (words.next(), words.next()) {
            (Some("sg"), Some("paper")) => Self::PAPER,
            (Some("sg"), Some("improved")) => Self::FIRST,
            _ => return Err(Self::no_plan(text)),
        };
        for word in words {
            let unreadable = || Self::bad(format!("\"{word}\" in \"{text}\" is not part of such a plan, or out of range"));
            let whole = |value: &str, range: RangeInclusive<usize>| {
                value.parse::<usize>().ok().filter(|v| range.contains(v)).ok_or_else(unreadable)
            };
            match word.split_once('=').ok_or_else(unreadable)? {
                ("facets", value) => {
                    plan.facets = whole(value, FACETS)?;
                    if !plan.facets.is_power_of_two() {
                        return Err(unreadable());
                    }
                }
                ("lobes", "criterion") => plan.lobes = LobeCount::Criterion,
                ("lobes", value) => plan.lobes = LobeCount::Fixed(whole(value, 1..=MAX_LOBES)?),
                ("modes", value) => plan.modes = whole(value, 1..=MAX_LOBES)?,
                ("amplitudes", "responsibilities") => plan.amplitudes = AmplitudeFit::Responsibilities,
                ("amplitudes", "least-squares") => plan.amplitudes = AmplitudeFit::LeastSquares,
                ("amplitudes", "non-negative") => plan.amplitudes = AmplitudeFit::NonNegative,
                ("brdf", "single") => plan.brdf = BrdfLobes::Single,
                ("brdf", value) => {
                    let factor = value.parse::<f64>().ok().filter(|v| SPACINGS.contains(v)).ok_or_else(unreadable)?;
                    plan.brdf = BrdfLobes::Spaced(factor);
                }
                ("integral", "exact") => plan.integral = ProductIntegral::Exact,
                ("integral", "closure") => plan.integral = ProductIntegral::Closure,
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
        for plan in [SphericalGaussianPlan::PAPER, SphericalGaussianPlan::FIRST] {
            assert_eq!(plan.to_string().parse::<SphericalGaussianPlan>().unwrap(), plan, "{plan}");
        }
        let chosen = "sg:improved:lobes=criterion".parse::<SphericalGaussianPlan>().unwrap();
        assert_eq!(chosen.to_string().parse::<SphericalGaussianPlan>().unwrap(), chosen);
        let other = "sg:improved:integral=closure:lobes=3:brdf=single".parse::<SphericalGaussianPlan>().unwrap();
        assert_eq!(other.to_string(), "sg:improved:facets=2048:lobes=3:modes=8:amplitudes=responsibilities:brdf=single:integral=closure");
    }

    #[test]
    fn what_is_no_plan_is_refused_with_an_example() {
        for text in [
            "",
            "sg",
            "sg:fast",
            "lowrank:paper",
            "sg:paper:facets",
            "sg:paper:facets=100",
            "sg:paper:facets=0",
            "sg:paper:lobes=0",
            "sg:paper:lobes=4097",
            "sg:paper:amplitudes=best",
            "sg:improved:brdf=1",
            "sg:improved:brdf=nan",
            "sg:improved:integral=",
            "sg:improved:",
        ] {
            let error = text.parse::<SphericalGaussianPlan>().unwrap_err().to_string();
            assert!(error.starts_with("plan: ") && error.contains(text) && error.contains("sg:improved:facets"), "{error}");
        }
    }
}
