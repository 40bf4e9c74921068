//! What a caller wants: method, tolerance, budget, seed.

use super::plan::{Plan, Variant};
use super::tolerance::DEFAULT_TOLERANCE;
use crate::error::{BadInput, Error, Result};
use std::path::PathBuf;

/// How to compute effective values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The program chooses.
    Auto,
    /// Facets shared by all pairs, visibility for exactly the directions of the query, direct sums.
    Direct,
    /// Low-rank matrices after Wu et al. 2011.
    LowRank,
    /// Spherical Gaussians after Iwasaki et al. 2012.
    SphericalGaussian,
    /// Fresh rays for every pair, optionally with interreflections.
    Reference,
}

/// What the caller wants.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// Method to use.
    pub method: Method,
    /// Relative RMS error of `fbar` over all pairs and channels to stay within.
    pub tolerance: f64,
    /// Wall seconds to stay within, if any; then `tolerance` is a wish.
    pub budget: Option<f64>,
    /// Seed of everything random.
    pub seed: u64,
    /// Reflections after the first (`reference` only); 0 is direct light.
    pub bounces: u32,
    /// A plan to repeat exactly: an earlier [`Summary::plan`](super::Summary::plan).
    pub plan: Option<Plan>,
    /// Which form of the methods that were published; none is what [`Quality::variant_of`] says.
    pub variant: Option<Variant>,
    /// Where the low-rank method keeps what it computes once a BRDF, if anywhere.
    pub cache: Option<MatrixCache>,
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            tolerance: DEFAULT_TOLERANCE,
            budget: None,
            seed: 0,
            bounces: 0,
            plan: None,
            variant: None,
            cache: None,
        }
    }
}

/// The method that runs, once `Auto` and the plan have been looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MethodToRun {
    /// `direct` with the number of samples to start with predicted, or `reference` where the samples do not show what directions see.
    PredictedDirect,
    /// `direct`, as it was asked for or planned.
    Direct,
    /// Low-rank matrices.
    LowRank,
    /// Spherical Gaussians.
    SphericalGaussian,
    /// Fresh rays for every pair.
    Reference,
}

impl Quality {
    /// The method that runs. Where the program chooses: that of the plan, or `reference` for reflections after the first, or else `direct`.
    ///
    /// # Errors
    /// [`Error::BadInput`] for a plan of another method, and for reflections that a method other than `reference` is asked for: they compute direct light only;
    /// [`Error::Unsupported`] for a budget of `lowrank` or `sg`, which keep none.
    pub fn method_to_run(&self) -> Result<MethodToRun> {
        let method = match (self.method, &self.plan) {
            (Method::Auto, Some(Plan::Reference(_))) | (Method::Reference, _) => MethodToRun::Reference,
            (Method::Auto, Some(Plan::LowRank(_))) | (Method::LowRank, _) => MethodToRun::LowRank,
            (Method::Auto, Some(Plan::SphericalGaussian(_))) | (Method::SphericalGaussian, _) => MethodToRun::SphericalGaussian,
            (Method::Auto, None) if self.bounces > 0 => MethodToRun::Reference,
            (Method::Auto, None) => MethodToRun::PredictedDirect,
            (Method::Auto, Some(Plan::Direct(_))) | (Method::Direct, _) => MethodToRun::Direct,
        };
        let (name, keeps_a_budget) = match method {
            MethodToRun::Direct | MethodToRun::PredictedDirect => ("direct", true),
            MethodToRun::LowRank => ("lowrank", false),
            MethodToRun::SphericalGaussian => ("sg", false),
            MethodToRun::Reference => ("reference", true),
        };
        if let Some(plan) = &self.plan {
            match method {
                MethodToRun::Direct | MethodToRun::PredictedDirect => plan.as_direct().map(drop),
                MethodToRun::LowRank => plan.as_low_rank().map(drop),
                MethodToRun::SphericalGaussian => plan.as_spherical_gaussian().map(drop),
                MethodToRun::Reference => plan.as_reference().map(drop),
            }?;
        }
        if self.budget.is_some() && !keeps_a_budget {
            let what = format!("a budget with `method {name}`");
            return Err(Error::Unsupported { what, remedy: "leave it out, or ask for `method direct`, which keeps one".to_owned() });
        }
        if self.bounces > 0 && method != MethodToRun::Reference {
            let problem = format!("{} reflections after the first are asked of `method {name}`", self.bounces);
            let remedy = "it computes direct light only; ask for 0, or for `method reference`";
            return Err(BadInput::new(problem, remedy).at_field("bounces").into());
        }
        Ok(method)
    }

    /// The variant of a method that runs: the one asked for, or `lowrank` as published and `sg` as improved.
    pub fn variant_of(&self, method: Method) -> Variant {
        self.variant.unwrap_or(if method == Method::SphericalGaussian { Variant::Improved } else { Variant::Paper })
    }
}

/// A folder of compressed matrices of the low-rank method: see [`super::low_rank`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MatrixCache {
    /// The folder; made when the first file is.
    pub folder: PathBuf,
    /// Most bytes of all files: the least recently used ones go first.
    pub max_bytes: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quality(method: Method, bounces: u32, plan: Option<&str>) -> Quality {
        Quality { method, bounces, plan: plan.map(|text| text.parse().unwrap()), ..Quality::default() }
    }

    #[test]
    fn auto_follows_the_plan_and_takes_the_reference_for_interreflections() {
        use Method::{Auto, Direct, Reference};
        use MethodToRun as Runs;
        for (asked, bounces, plan, runs) in [
            (Auto, 0, None, Runs::PredictedDirect),
            (Auto, 2, None, Runs::Reference),
            (Auto, 0, Some("direct:2048x1"), Runs::Direct),
            (Auto, 0, Some("reference:bounces=0:first=8"), Runs::Reference),
            (Reference, 0, None, Runs::Reference),
            (Direct, 0, None, Runs::Direct),
        ] {
            let quality = quality(asked, bounces, plan);
            assert_eq!(quality.method_to_run().unwrap(), runs, "{quality:?}");
        }
    }

    #[test]
    fn what_a_method_would_refuse_is_refused_before_it_runs() {
        let budget = |method| Quality { budget: Some(1.0), ..quality(method, 0, None) };
        for method in [Method::LowRank, Method::SphericalGaussian] {
            assert!(matches!(budget(method).method_to_run(), Err(Error::Unsupported { .. })), "{method:?}");
        }
        for method in [Method::Auto, Method::Direct, Method::Reference] {
            assert!(budget(method).method_to_run().is_ok(), "{method:?}");
        }
        for (method, plan) in [
            (Method::LowRank, "direct:2048x1"),
            (Method::SphericalGaussian, "direct:2048x1"),
            (Method::Reference, "direct:2048x1"),
            (Method::Direct, "reference:bounces=0:first=8"),
        ] {
            let error = quality(method, 0, Some(plan)).method_to_run().unwrap_err().to_string();
            assert!(error.contains("plan: ") && error.contains(plan), "{error}");
        }
    }

    #[test]
    fn direct_refuses_interreflections() {
        for (method, plan) in [(Method::Direct, None), (Method::Auto, Some("direct:2048x1"))] {
            let message = quality(method, 2, plan).method_to_run().unwrap_err().to_string();
            assert!(message.contains("bounces: 2 reflections"), "{message}");
        }
    }
}
