//! One setting: which method runs, and how far it goes.

use super::point_sums::{Placement, Precision};
use crate::error::BadInput;
use crate::filter::{LowRankPlan, Method, Plan, Variant};
use std::fmt;

/// One setting: what is run. Shown as its name, which [`Work::parse`] reads.
#[derive(Clone, Debug, PartialEq)]
pub enum Work {
    /// A method of [`crate::filter::effective`].
    Effective {
        /// The method.
        method: Method,
        /// Relative RMS error to stay within, unless there is a plan.
        tolerance: f64,
        /// Wall seconds to stay within.
        budget: Option<f64>,
        /// Reflections after the first.
        bounces: u32,
        /// Plan to follow.
        plan: Option<Plan>,
    },
    /// Plain sums over facets placed in some way: a library question, and no method of the program.
    Points {
        /// Where the facets are.
        placement: Placement,
        /// Numbers that are summed.
        precision: Precision,
        /// How many facets.
        facets: u32,
    },
}

/// Runs that share a colour in a plot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Family {
    /// `auto` to a tolerance.
    Auto,
    /// `direct` to a tolerance.
    DirectTolerance,
    /// `direct` with a number of facets, spread by area.
    DirectFacets,
    /// `direct` with a number of facets, put where they are worth most.
    DirectWeighted,
    /// `direct` with narrower clusters of normals.
    DirectClusters,
    /// `lowrank` as published.
    LowRankPaper,
    /// `lowrank` as improved.
    LowRankImproved,
    /// `sg` as published.
    SphericalGaussianPaper,
    /// `sg` as improved.
    SphericalGaussianImproved,
    /// `reference`, direct light.
    Reference,
    /// `reference` with interreflections: another model.
    Interreflections,
    /// Plain sums.
    Points,
}

impl Family {
    /// All, in the order of legends.
    pub const ALL: [Self; 12] = [
        Self::Auto,
        Self::DirectTolerance,
        Self::DirectFacets,
        Self::DirectWeighted,
        Self::DirectClusters,
        Self::LowRankPaper,
        Self::LowRankImproved,
        Self::SphericalGaussianPaper,
        Self::SphericalGaussianImproved,
        Self::Reference,
        Self::Interreflections,
        Self::Points,
    ];

    /// As files and legends call it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::DirectTolerance => "direct to a tolerance",
            Self::DirectFacets => "direct, facets by area",
            Self::DirectWeighted => "direct, facets by worth",
            Self::DirectClusters => "direct, narrower clusters",
            Self::LowRankPaper => "lowrank paper",
            Self::LowRankImproved => "lowrank improved",
            Self::SphericalGaussianPaper => "sg paper",
            Self::SphericalGaussianImproved => "sg improved",
            Self::Reference => "reference",
            Self::Interreflections => "interreflections",
            Self::Points => "plain sums",
        }
    }

    /// The method, by its name in `methods`.
    pub fn method(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::DirectTolerance | Self::DirectFacets | Self::DirectWeighted | Self::DirectClusters => "direct",
            Self::LowRankPaper | Self::LowRankImproved => "lowrank",
            Self::SphericalGaussianPaper | Self::SphericalGaussianImproved => "sg",
            Self::Reference | Self::Interreflections => "reference",
            Self::Points => "points",
        }
    }

    /// Whether its runs compete: they answer the question as it was asked, and are made to be fast.
    pub fn competes(self) -> bool {
        !matches!(self, Self::Interreflections | Self::Points)
    }
}

/// Names of the methods.
const METHODS: [(&str, Method); 5] = [
    ("auto", Method::Auto),
    ("direct", Method::Direct),
    ("lowrank", Method::LowRank),
    ("sg", Method::SphericalGaussian),
    ("reference", Method::Reference),
];

impl Work {
    /// A method to a tolerance.
    pub fn to_tolerance(method: Method, tolerance: f64) -> Self {
        Self::Effective { method, tolerance, budget: None, bounces: 0, plan: None }
    }

    /// A method by a plan of it.
    pub(super) fn by_plan(plan: Plan) -> Self {
        let method = match plan {
            Plan::Direct(_) => Method::Direct,
            Plan::Reference(_) => Method::Reference,
            Plan::LowRank(_) => Method::LowRank,
            Plan::SphericalGaussian(_) => Method::SphericalGaussian,
        };
        Self::Effective { method, tolerance: 1.0, budget: None, bounces: 0, plan: Some(plan) }
    }

    /// What it is shown as.
    pub fn family(&self) -> Family {
        match self {
            Self::Points { .. } => Family::Points,
            Self::Effective { bounces, .. } if *bounces > 0 => Family::Interreflections,
            Self::Effective { method, plan, .. } => match (method, plan) {
                (Method::Auto, _) => Family::Auto,
                (Method::Direct, Some(Plan::Direct(plan))) if plan.weighted => Family::DirectWeighted,
                (Method::Direct, Some(Plan::Direct(plan))) if plan.narrowed > 0 => Family::DirectClusters,
                (Method::Direct, None) => Family::DirectTolerance,
                (Method::Direct, _) => Family::DirectFacets,
                (Method::LowRank, Some(Plan::LowRank(LowRankPlan::Paper { .. }))) => Family::LowRankPaper,
                (Method::LowRank, _) => Family::LowRankImproved,
                (Method::SphericalGaussian, Some(Plan::SphericalGaussian(plan))) if plan.variant == Variant::Paper => {
                    Family::SphericalGaussianPaper
                }
                (Method::SphericalGaussian, _) => Family::SphericalGaussianImproved,
                (Method::Reference, _) => Family::Reference,
            },
        }
    }

    /// Reads what `Display` writes.
    ///
    /// # Errors
    /// [`BadInput`] for a text that names no setting.
    pub fn parse(text: &str) -> Result<Self, BadInput> {
        let bad = || BadInput::new(format!("\"{text}\" is no setting"), "write one as study.csv names it, such as \"direct:4096x1\"");
        let (first, rest) = text.split_once(':').ok_or_else(bad)?;
        if first == "points" {
            let [placement, precision, facets] = rest.split(':').collect::<Vec<_>>()[..] else { return Err(bad()) };
            let placement = Placement::ALL.into_iter().find(|p| p.name() == placement).ok_or_else(bad)?;
            let precision = Precision::ALL.into_iter().find(|p| p.name() == precision).ok_or_else(bad)?;
            let facets = facets.parse().ok().filter(|n| (1..=1 << 22).contains(n)).ok_or_else(bad)?;
            return Ok(Self::Points { placement, precision, facets });
        }
        let method = METHODS.into_iter().find(|m| m.0 == first).ok_or_else(bad)?.1;
        if !rest.starts_with("tolerance=") {
            return text.parse().map(Self::by_plan);
        }
        let (mut tolerance, mut budget, mut bounces) = (None, None, 0);
        for field in rest.split(':') {
            let (key, value) = field.split_once('=').ok_or_else(bad)?;
            let number = || value.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0).ok_or_else(bad);
            match key {
                "tolerance" => tolerance = Some(number()?),
                "budget" => budget = Some(number()?),
                "bounces" => bounces = value.parse().map_err(|_| bad())?,
                _ => return Err(bad()),
            }
        }
        Ok(Self::Effective { method, tolerance: tolerance.ok_or_else(bad)?, budget, bounces, plan: None })
    }
}

impl fmt::Display for Work {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Effective { plan: Some(plan), .. } => write!(f, "{plan}"),
            Self::Effective { method, tolerance, budget, bounces, plan: None } => {
                let name = METHODS.iter().find(|m| m.1 == *method).expect("all methods have names").0;
                write!(f, "{name}:tolerance={tolerance}")?;
                if let Some(budget) = budget {
                    write!(f, ":budget={budget}")?;
                }
                if *bounces > 0 { write!(f, ":bounces={bounces}") } else { Ok(()) }
            }
            Self::Points { placement, precision, facets } => write!(f, "points:{}:{}:{facets}", placement.name(), precision.name()),
        }
    }
}
