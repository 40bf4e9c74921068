//! From a small-scale surface to effective BRDF values, by any method and with an error on every value.
//!
//! All methods are reached through [`effective`]. What a caller wants is in [`Quality`]; what it lends (a clock, a way to
//! report progress and to be stopped) in [`Control`], so that no stage reads a global.

mod auto;
mod cluster_sums;
pub mod common_random_numbers;
pub(crate) mod demand;
mod direct;
mod estimate;
mod importance;
#[cfg(test)]
mod kernel_tests;
pub(crate) mod lobes;
pub mod low_rank;
mod plan;
pub mod prepared;
mod reference;
pub(crate) mod sums;

use crate::direction::Pair;
use crate::error::{BadInput, Error, Result};
use crate::material::SmallScale;
use std::sync::atomic::{AtomicBool, Ordering};

/// How to compute effective values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The program chooses.
    Auto,
    /// Facets shared by all pairs, visibility for exactly the wanted directions, direct sums.
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
    /// A plan to repeat exactly, as an earlier [`Summary::plan`] printed it.
    pub plan: Option<String>,
    /// Which form of the low-rank method.
    pub variant: low_rank::Variant,
    /// Where the low-rank method keeps what it computes once a BRDF, if anywhere.
    pub cache: Option<low_rank::cache::Cache>,
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            method: Method::Auto,
            tolerance: 0.005,
            budget: None,
            seed: 0,
            bounces: 0,
            plan: None,
            variant: low_rank::Variant::Paper,
            cache: None,
        }
    }
}

impl Quality {
    /// The method that runs: what `Auto` chooses, which is the plan's method, or `reference` for reflections after the first,
    /// or else `direct`.
    ///
    /// # Errors
    /// [`Error::BadInput`] for reflections that `direct` is asked for: it computes direct light only.
    pub fn method_to_run(&self) -> Result<Method> {
        let method = match (self.method, self.plan.as_deref().and_then(|p| p.split(':').next())) {
            (Method::Auto, Some("reference")) => Method::Reference,
            (Method::Auto, Some("lowrank")) => Method::LowRank,
            (Method::Auto, None) if self.bounces > 0 => Method::Reference,
            (Method::Auto, _) => Method::Direct,
            (asked, _) => asked,
        };
        let name = match method {
            Method::Direct => "direct",
            Method::LowRank => "lowrank",
            _ => return Ok(method),
        };
        if self.bounces > 0 {
            let problem = format!("{} reflections after the first are asked of the method `{name}`", self.bounces);
            let remedy = "it computes direct light only; ask for 0, or for the method `reference`";
            return Err(BadInput::new(problem, remedy).at_field("bounces").into());
        }
        Ok(method)
    }
}

/// What the caller lends.
#[derive(Clone, Copy)]
pub struct Control<'a> {
    /// Set to make the computation stop with [`Error::Interrupted`] soon.
    pub cancel: &'a AtomicBool,
    /// Told the name of the stage and the share of all work done so far, in `0..=1`; may be called from any thread.
    pub progress: &'a (dyn Fn(&str, f64) + Sync),
    /// Seconds since any fixed moment.
    pub clock: &'a (dyn Fn() -> f64 + Sync),
}

impl Control<'static> {
    /// Lends nothing: not to be stopped, nobody is told of progress, and the clock stands still, so that stages take no time and a
    /// [`Quality::budget`] is never used up.
    pub fn quiet() -> Self {
        static NEVER: AtomicBool = AtomicBool::new(false);
        Self { cancel: &NEVER, progress: &|_, _| {}, clock: &|| 0.0 }
    }
}

impl Control<'_> {
    /// Stops with [`Error::Interrupted`] when the caller has asked for it.
    pub fn check(&self) -> Result<()> {
        if self.cancel.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(()) }
    }
}

/// The effective BRDF at one pair.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Value {
    /// Symmetric kernel `S`, 1/sr.
    pub s: [f64; 3],
    /// Standard error of `s`.
    pub s_se: [f64; 3],
    /// Cosine-weighted effective BRDF, 1/sr; 0 where `av` is.
    pub fbar: [f64; 3],
    /// Standard error of `fbar`.
    pub se: [f64; 3],
    /// Effective BRDF `fbar / cos(theta_i)`, 1/sr.
    pub fhat: [f64; 3],
    /// Visible projected area over the footprint, `1/A ∫ (n·wo)+ V(wo) dA`.
    pub av: f64,
}

/// How the values were made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Summary {
    /// The method that ran: `direct`, `lowrank`, `lowrank improved`, `reference`.
    pub method: &'static str,
    /// Everything that fixes the bits beside the seed; [`Quality::plan`] takes it.
    pub plan: String,
    /// Facets (`direct`), or rays from the viewer per pair (`reference`).
    pub facets: usize,
    /// Normal clusters of the sums; equals `facets` where each facet stands for itself.
    pub clusters: usize,
    /// Distinct directions.
    pub directions: usize,
    /// Name and milliseconds of each stage.
    pub stages: Vec<(&'static str, f64)>,
    /// Estimated relative RMS error of `fbar` over all pairs and channels (absolute if all are 0).
    pub relative_rms: f64,
    /// What the matrices of each surface were (`lowrank`).
    pub low_rank: Vec<LowRankFacts>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// The matrices of one surface in the low-rank method: their sizes, rows and columns, and what was kept of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LowRankFacts {
    /// Place of the surface.
    pub surface: usize,
    /// Of `N`, the bidirectional visible normal distribution.
    pub n_size: [usize; 2],
    /// Vectors kept of `N`.
    pub n_rank: usize,
    /// Share of its power that they keep, its mean aside.
    pub n_energy: f64,
    /// Of `M`, the turned BRDFs.
    pub m_size: [usize; 2],
    /// Vectors kept of `M`.
    pub m_rank: usize,
    /// Share of its power that they keep, its mean aside.
    pub m_energy: f64,
    /// Bytes of what is kept of `M`.
    pub m_bytes: usize,
}

impl LowRankFacts {
    /// Takes in those of further rows: sizes add up, ranks and energies are the worst.
    fn unite(&mut self, other: &Self) {
        self.n_size[0] += other.n_size[0];
        self.m_size[0] += other.m_size[0];
        self.n_rank = self.n_rank.max(other.n_rank);
        self.m_rank = self.m_rank.max(other.m_rank);
        self.n_energy = self.n_energy.min(other.n_energy);
        self.m_energy = self.m_energy.min(other.m_energy);
        self.m_bytes += other.m_bytes;
    }
}

/// Effective values of a list of pairs.
#[derive(Clone, Debug, PartialEq)]
pub struct Effective {
    /// One value a pair, in the order of the pairs.
    pub values: Vec<Value>,
    /// How they were made.
    pub summary: Summary,
}

/// Effective BRDF values of `surface` at `pairs`.
///
/// A direction below the horizon gives 0; one within [`crate::direction::MIN_COSINE`] of it is evaluated there. The same
/// surface, pairs and quality give the same bits at any thread count, unless `quality.budget` is set.
///
/// # Errors
/// [`Error::Unsupported`] for a method that this build lacks, [`Error::Interrupted`] when `control` asks to stop,
/// [`Error::BadInput`] for a plan that is none.
///
/// ```
/// use biscale::{Control, Material, Method, Pair, Quality, effective};
/// use glam::DVec3;
///
/// # let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
/// let surface = Material::load(path.as_ref())?.build()?;
/// let pair = Pair { wi: DVec3::new(0.6, 0.0, 0.8), wo: DVec3::new(0.0, 0.6, 0.8) };
/// let swapped = Pair { wi: pair.wo, wo: pair.wi };
/// let quality = Quality { method: Method::Direct, tolerance: 0.1, ..Quality::default() };
/// let result = effective(&surface, &[pair, swapped], &quality, &Control::quiet())?;
/// let [a, b] = result.values[..] else { panic!("one value a pair") };
/// // The kernel S is symmetric; fhat is fbar over the cosine of the light.
/// assert_eq!(a.s, b.s);
/// assert!((a.fhat[0] * 0.8 / a.fbar[0] - 1.0).abs() < 1e-12);
/// # Ok::<(), biscale::Error>(())
/// ```
pub fn effective(surface: &SmallScale, pairs: &[Pair], quality: &Quality, control: &Control<'_>) -> Result<Effective> {
    match quality.method_to_run()? {
        Method::Direct if quality.method == Method::Auto && quality.plan.is_none() => auto::auto(surface, pairs, quality, control),
        Method::Auto | Method::Direct => direct::direct(surface, pairs, quality, control),
        Method::Reference => reference::reference(surface, pairs, quality, control),
        Method::LowRank => low_rank::low_rank(surface, pairs, quality, control),
        Method::SphericalGaussian => Err(Error::Unsupported { what: "this method".into(), remedy: "use `--method direct`".into() }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quality(method: Method, bounces: u32, plan: Option<&str>) -> Quality {
        Quality { method, bounces, plan: plan.map(str::to_owned), ..Quality::default() }
    }

    #[test]
    fn auto_follows_the_plan_and_takes_the_reference_for_interreflections() {
        use Method::{Auto, Direct, Reference};
        for (asked, bounces, plan, runs) in [
            (Auto, 0, None, Direct),
            (Auto, 2, None, Reference),
            (Auto, 0, Some("direct:2048"), Direct),
            (Auto, 0, Some("reference:bounces=0:first=8"), Reference),
            (Reference, 0, None, Reference),
            (Direct, 0, None, Direct),
        ] {
            let quality = quality(asked, bounces, plan);
            assert_eq!(quality.method_to_run().unwrap(), runs, "{quality:?}");
        }
    }

    #[test]
    fn direct_refuses_interreflections() {
        for (method, plan) in [(Method::Direct, None), (Method::Auto, Some("direct:2048"))] {
            let message = quality(method, 2, plan).method_to_run().unwrap_err().to_string();
            assert!(message.contains("bounces: 2 reflections"), "{message}");
        }
    }
}
