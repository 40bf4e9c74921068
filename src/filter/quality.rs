//! What a caller wants: method, tolerance, budget, seed.

use super::plan::{Plan, Variant};
use super::tolerance::DEFAULT_TOLERANCE;
use crate::error::{BadInput, Error, Result};
use crate::material::Material;
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
    /// Reflections after the first (`reference` only), 0 for direct light; none is as many as the material says: see [`Quality::bounces_of`].
    pub bounces: Option<u32>,
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
            bounces: None,
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
    /// Reflections after the first of a material whose file says `of_material`: those of the plan, or those asked for, or else the material's own. A plan of a
    /// method other than `reference` is one of direct light: it repeats what it was printed for, whatever the file says.
    pub fn bounces_of(&self, of_material: u32) -> u32 {
        match &self.plan {
            Some(Plan::Reference(plan)) => plan.bounces,
            Some(_) => self.bounces.unwrap_or(0),
            None => self.bounces.unwrap_or(of_material),
        }
    }

    /// The method that runs for a material, whose file says that its look includes so many reflections after the first ([`SmallScale::bounces`](crate::SmallScale::bounces)).
    /// Where the program chooses: that of the plan, or `reference` for reflections after the first, or else `direct`.
    ///
    /// # Errors
    /// [`Error::BadInput`] for a plan of another method, and for reflections where a method other than `reference` is asked for: they compute direct light only;
    /// [`Error::Unsupported`] for a budget of `lowrank` or `sg`, which keep none.
    pub fn method_to_run(&self, of_material: u32) -> Result<MethodToRun> {
        let bounces = self.bounces_of(of_material);
        let method = match (self.method, &self.plan) {
            (Method::Auto, Some(Plan::Reference(_))) | (Method::Reference, _) => MethodToRun::Reference,
            (Method::Auto, Some(Plan::LowRank(_))) | (Method::LowRank, _) => MethodToRun::LowRank,
            (Method::Auto, Some(Plan::SphericalGaussian(_))) | (Method::SphericalGaussian, _) => MethodToRun::SphericalGaussian,
            (Method::Auto, None) if bounces > 0 => MethodToRun::Reference,
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
        if bounces > 0 && method != MethodToRun::Reference {
            return Err(direct_light_only(name, bounces, self.bounces.is_some()).into());
        }
        Ok(method)
    }

    /// [`Quality::method_to_run`] for a material, whose file an error names where it is what asks for reflections after the first.
    ///
    /// # Errors
    /// Those of [`Quality::method_to_run`].
    pub fn method_for(&self, material: &Material) -> Result<MethodToRun> {
        self.method_to_run(material.bounces).map_err(|error| match error {
            // Of input nothing else can be bad without a plan.
            Error::BadInput(bad) if self.plan.is_none() && self.bounces.is_none() => bad.in_file(&material.file).into(),
            error => error,
        })
    }

    /// The variant of a method that runs: the one asked for, or `lowrank` as published and `sg` as improved.
    pub fn variant_of(&self, method: Method) -> Variant {
        self.variant.unwrap_or(if method == Method::SphericalGaussian { Variant::Improved } else { Variant::Paper })
    }
}

/// Reflections after the first of a method that computes direct light only, asked for by the caller or by the material.
fn direct_light_only(method: &str, bounces: u32, is_asked: bool) -> BadInput {
    if is_asked {
        let problem = format!("{bounces} reflections after the first are asked of `method {method}`");
        return BadInput::new(problem, "it computes direct light only; ask for 0, or for `method reference`").at_field("bounces");
    }
    let problem =
        format!("the material says `bounces = {bounces}`: so many reflections after the first are more than `method {method}` computes");
    BadInput::new(problem, "it computes direct light only; ask for that with `bounces 0`, or for `method reference`")
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
        Quality { method, bounces: Some(bounces), plan: plan.map(|text| text.parse().unwrap()), ..Quality::default() }
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
            assert_eq!(quality.method_to_run(0).unwrap(), runs, "{quality:?}");
        }
    }

    #[test]
    fn what_a_method_would_refuse_is_refused_before_it_runs() {
        let budget = |method| Quality { budget: Some(1.0), ..quality(method, 0, None) };
        for method in [Method::LowRank, Method::SphericalGaussian] {
            assert!(matches!(budget(method).method_to_run(0), Err(Error::Unsupported { .. })), "{method:?}");
        }
        for method in [Method::Auto, Method::Direct, Method::Reference] {
            assert!(budget(method).method_to_run(0).is_ok(), "{method:?}");
        }
        for (method, plan) in [
            (Method::LowRank, "direct:2048x1"),
            (Method::SphericalGaussian, "direct:2048x1"),
            (Method::Reference, "direct:2048x1"),
            (Method::Direct, "reference:bounces=0:first=8"),
        ] {
            let error = quality(method, 0, Some(plan)).method_to_run(0).unwrap_err().to_string();
            assert!(error.contains("plan: ") && error.contains(plan), "{error}");
        }
    }

    #[test]
    fn direct_refuses_interreflections() {
        for (method, plan) in [(Method::Direct, None), (Method::Auto, Some("direct:2048x1"))] {
            let message = quality(method, 2, plan).method_to_run(0).unwrap_err().to_string();
            assert!(message.contains("bounces: 2 reflections"), "{message}");
        }
    }

    #[test]
    fn a_material_s_bounces_hold_where_neither_the_caller_nor_a_plan_says_another_number() {
        use Method::{Auto, Direct, LowRank, Reference, SphericalGaussian};
        let unsaid = |method, plan| Quality { bounces: None, ..quality(method, 0, plan) };
        for (quality, of_material, used, runs) in [
            (unsaid(Auto, None), 0, 0, MethodToRun::PredictedDirect),
            (unsaid(Auto, None), 3, 3, MethodToRun::Reference),
            (unsaid(Reference, None), 3, 3, MethodToRun::Reference),
            (quality(Auto, 2, None), 3, 2, MethodToRun::Reference),
            (quality(Auto, 0, None), 3, 0, MethodToRun::PredictedDirect),
            (quality(LowRank, 0, None), 3, 0, MethodToRun::LowRank),
            // A plan repeats what it was printed for.
            (unsaid(Auto, Some("reference:bounces=1:first=8")), 3, 1, MethodToRun::Reference),
            (unsaid(Auto, Some("direct:2048x1")), 3, 0, MethodToRun::Direct),
        ] {
            assert_eq!(quality.bounces_of(of_material), used, "{quality:?}");
            assert_eq!(quality.method_to_run(of_material).unwrap(), runs, "{quality:?}");
        }
        for method in [Direct, LowRank, SphericalGaussian] {
            let message = unsaid(method, None).method_to_run(3).unwrap_err().to_string();
            assert!(message.contains("the material says `bounces = 3`") && message.contains("`bounces 0`"), "{message}");
        }
    }
}
