//! What the filter answers: values, each with its error, and how they were made.

use super::plan::Plan;

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
    /// Everything that fixes the bits beside the seed; [`Quality::plan`](super::Quality::plan) takes it. None for values that no method made.
    pub plan: Option<Plan>,
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
    /// How it was done, for who knows the method.
    pub details: Vec<String>,
}

impl Summary {
    /// Reflections after the first that the values include: those of the plan.
    pub fn bounces(&self) -> u32 {
        match &self.plan {
            Some(Plan::Reference(plan)) => plan.bounces,
            _ => 0,
        }
    }

    /// The plan as it is printed; empty for values that no method made.
    pub fn plan_text(&self) -> String {
        self.plan.as_ref().map(ToString::to_string).unwrap_or_default()
    }
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
    pub(super) fn unite(&mut self, other: &Self) {
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
