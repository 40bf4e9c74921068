//! The plan of a run of the method `direct`: samples, where they go, how wide clusters are.

use crate::error::BadInput;
use crate::facets::REPLICATES;
use crate::filter::tolerance::MAX_SAMPLES;
use std::fmt;
use std::str::FromStr;

/// Widths of clusters, as shares of the widest that are allowed ([`crate::clusters::SPREAD_PER_ALPHA`]), in the order in which they are tried while the bias
/// of the wider ones is too large; 0 is equal normals only. Chosen, not measured; the plan counts in places of this list, so it is part of the contract.
pub const CLUSTER_WIDTHS: [f64; 4] = [1.0, 0.7, 0.5, 0.0];

/// Fewest samples of a plan: eight for each of the eight replicates, whose runs of the sequence must be aligned.
const MIN_SAMPLES: u32 = 8 * REPLICATES as u32;

/// All that fixes the bits of a run of `direct` beside its seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DirectPlan {
    /// Samples to start with.
    pub start: u32,
    /// How often their number is doubled.
    pub doublings: u32,
    /// Whether they go where a pilot run finds them worth most.
    pub weighted: bool,
    /// Whether that pilot run is on a part of a list that is not long: on the whole list it finds other places.
    pub by_part: bool,
    /// How often clusters were made narrower, because the bias of wider ones would take too much of the tolerance: see [`CLUSTER_WIDTHS`].
    pub narrowed: usize,
}

impl fmt::Display for DirectPlan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = |set: bool, word: &'static str| if set { word } else { "" };
        write!(f, "direct:{}x{}", self.start, 1_u32 << self.doublings)?;
        write!(f, "{}{}", mark(self.weighted, ":weighted"), mark(self.weighted && self.by_part, "-by-part"))?;
        if self.narrowed > 0 { write!(f, ":narrowed{}", self.narrowed) } else { Ok(()) }
    }
}

impl FromStr for DirectPlan {
    type Err = BadInput;

    /// Reads what `Display` writes. Samples out of range are refused, too.
    fn from_str(text: &str) -> Result<Self, BadInput> {
        let bad = || Self::no_plan(text);
        let rest = text.strip_prefix("direct:").ok_or_else(bad)?;
        let (rest, narrowed) = match rest.split_once(":narrowed") {
            Some((left, number)) => (left, number.parse().ok().filter(|n| (1..CLUSTER_WIDTHS.len()).contains(n)).ok_or_else(bad)?),
            None => (rest, 0),
        };
        let (rest, by_part) = match rest.strip_suffix("-by-part") {
            Some(rest) if rest.ends_with(":weighted") => (rest, true),
            _ => (rest, false),
        };
        let (numbers, weighted) = rest.strip_suffix(":weighted").map_or((rest, false), |numbers| (numbers, true));
        let (start, factor) = numbers.split_once('x').ok_or_else(bad)?;
        let number = |word: &str| word.parse::<u32>().ok().filter(|n| n.is_power_of_two()).ok_or_else(bad);
        let (start, factor) = (number(start)?, number(factor)?);
        let samples = u64::from(start) * u64::from(factor);
        if start < MIN_SAMPLES || samples > u64::from(MAX_SAMPLES) {
            let problem = format!("the plan \"{text}\" asks for {samples} samples");
            return Err(BadInput::new(problem, format!("write from {MIN_SAMPLES} to {MAX_SAMPLES}")).at_field("plan"));
        }
        Ok(Self { start, doublings: factor.trailing_zeros(), weighted, by_part, narrowed })
    }
}

impl DirectPlan {
    /// So many samples by area, in one block.
    pub fn samples_by_area(samples: u32) -> Self {
        Self { start: samples, doublings: 0, weighted: false, by_part: false, narrowed: 0 }
    }

    /// Samples that the run ends with.
    pub fn samples(self) -> u32 {
        self.start << self.doublings
    }

    /// The error for a text that is none.
    pub(super) fn no_plan(text: &str) -> BadInput {
        BadInput::new(format!("\"{text}\" is not a plan"), "write one as a summary prints it, such as \"direct:8192x4:weighted\"")
            .at_field("plan")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_reads_as_it_is_written() {
        for (weighted, by_part, narrowed) in
            [(false, false, 0), (true, false, 0), (true, true, 0), (false, false, 1), (true, false, CLUSTER_WIDTHS.len() - 1)]
        {
            let plan = DirectPlan { start: 8192, doublings: 3, weighted, by_part, narrowed };
            assert_eq!(plan.to_string().parse::<DirectPlan>().unwrap(), plan);
        }
        for text in [
            "",
            "direct",
            "direct:7x1",
            "direct:8192x3",
            "direct:8192x1:heavy",
            "direct:8192x1:narrowed0",
            "direct:8192x1:narrowed4",
            "sg:8192x1",
            "direct:4194304x2",
            "direct:-8x1",
            "direct:99999999999x1",
        ] {
            let error = text.parse::<DirectPlan>().unwrap_err().to_string();
            assert!(error.starts_with("plan: ") && error.contains(text), "{error}");
        }
    }
}
