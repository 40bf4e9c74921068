//! A plan of any method.

use super::direct::DirectPlan;
use super::low_rank::LowRankPlan;
use super::reference::ReferencePlan;
use super::spherical_gaussian::SphericalGaussianPlan;
use crate::error::BadInput;
use std::fmt;
use std::str::FromStr;

/// All that fixes the bits of a run beside its seed: a plan of the method that it names.
#[derive(Clone, Debug, PartialEq)]
pub enum Plan {
    /// `direct:...`
    Direct(DirectPlan),
    /// `reference:...`
    Reference(ReferencePlan),
    /// `lowrank:...`
    LowRank(LowRankPlan),
    /// `sg:...`
    SphericalGaussian(SphericalGaussianPlan),
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Direct(plan) => plan.fmt(f),
            Self::Reference(plan) => plan.fmt(f),
            Self::LowRank(plan) => plan.fmt(f),
            Self::SphericalGaussian(plan) => plan.fmt(f),
        }
    }
}

impl FromStr for Plan {
    type Err = BadInput;

    /// Reads what `Display` writes.
    fn from_str(text: &str) -> Result<Self, BadInput> {
        match text.split(':').next() {
            Some("reference") => text.parse().map(Self::Reference),
            Some("lowrank") => text.parse().map(Self::LowRank),
            Some("sg") => text.parse().map(Self::SphericalGaussian),
            // What names no method is refused with the example of the method that `auto` takes.
            _ => text.parse().map(Self::Direct),
        }
    }
}

impl Plan {
    /// The plan of the method `direct`, or what is wrong with asking that method for this plan.
    pub(in crate::filter) fn as_direct(&self) -> Result<DirectPlan, BadInput> {
        if let Self::Direct(plan) = self { Ok(*plan) } else { Err(DirectPlan::no_plan(&self.to_string())) }
    }

    /// The same for `reference`.
    pub(in crate::filter) fn as_reference(&self) -> Result<ReferencePlan, BadInput> {
        if let Self::Reference(plan) = self { Ok(plan.clone()) } else { Err(ReferencePlan::no_plan(&self.to_string())) }
    }

    /// The same for `lowrank`.
    pub(in crate::filter) fn as_low_rank(&self) -> Result<LowRankPlan, BadInput> {
        if let Self::LowRank(plan) = self { Ok(*plan) } else { Err(LowRankPlan::no_plan(&self.to_string())) }
    }

    /// The same for `sg`.
    pub(in crate::filter) fn as_spherical_gaussian(&self) -> Result<SphericalGaussianPlan, BadInput> {
        if let Self::SphericalGaussian(plan) = self { Ok(*plan) } else { Err(SphericalGaussianPlan::no_plan(&self.to_string())) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_parses_as_it_is_printed_and_knows_its_method() {
        for text in [
            "direct:2048x1",
            "direct:8192x4:weighted",
            "direct:8192x1:weighted-by-part:narrowed2",
            "reference:bounces=2:first=128",
            "reference:bounces=0:first=8:doublings=64,30",
            "lowrank:paper:facets=500:directions=8:rates=8x12:energy=0.995,0.98",
            "lowrank:improved:facets=2048:normals=16:energy=0.9,1",
            "sg:paper:facets=512:lobes=4:modes=4:amplitudes=non-negative:brdf=single:integral=closure",
        ] {
            let plan: Plan = text.parse().unwrap();
            assert_eq!(plan.to_string(), text);
            let own =
                [plan.as_direct().is_ok(), plan.as_reference().is_ok(), plan.as_low_rank().is_ok(), plan.as_spherical_gaussian().is_ok()];
            assert_eq!(own, ["direct", "reference", "lowrank", "sg:"].map(|method| text.starts_with(method)), "{text}");
        }
    }

    #[test]
    fn what_is_no_plan_is_refused_at_its_field_with_an_example() {
        for text in ["", "fast", "direct:0", "sg:fast", "reference:", "lowrank:fast"] {
            let error = text.parse::<Plan>().unwrap_err();
            assert!(error.field.as_deref() == Some("plan") && error.to_string().contains(text) && error.remedy.contains(':'), "{error}");
        }
    }
}
