//! The plan of a direct run: written into its summary, read again to repeat its bits.

use crate::error::{BadInput, Result};
use crate::facets::SETS;
use std::fmt;

/// Most samples.
pub const MAX_SAMPLES: u32 = 1 << 22;
/// Widths of clusters that are tried, the bias of the wider ones being too large, down to equal normals.
pub const WIDTHS: [f64; 4] = [1.0, 0.7, 0.5, 0.0];

/// All that fixes the bits of a run beside its seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// Samples to start with.
    pub start: u32,
    /// How often their number is doubled.
    pub doublings: u32,
    /// Whether they go where a pilot run finds them worth most.
    pub weighted: bool,
    /// Whether that pilot run is on a part of a list that is not long: on the whole list it finds other places.
    pub by_part: bool,
    /// How often clusters were made narrower, because the bias of wider ones would take too much of the tolerance: see [`WIDTHS`].
    pub narrowed: usize,
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mark = |set: bool, word: &'static str| if set { word } else { "" };
        write!(f, "direct:{}x{}", self.start, 1_u32 << self.doublings)?;
        write!(f, "{}{}", mark(self.weighted, ":weighted"), mark(self.weighted && self.by_part, "-by-part"))?;
        if self.narrowed > 0 { write!(f, ":narrowed{}", self.narrowed) } else { Ok(()) }
    }
}

impl Plan {
    /// Reads what `Display` writes.
    ///
    /// # Errors
    /// [`BadInput`] for a text that is none, or samples out of range.
    pub fn parse(text: &str) -> Result<Self, BadInput> {
        let bad = || {
            BadInput::new(format!("\"{text}\" is not a plan"), "write one as a summary prints it, such as \"direct:8192x4:weighted\"")
                .at_field("--plan")
        };
        let rest = text.strip_prefix("direct:").ok_or_else(bad)?;
        let (rest, narrowed) = match rest.split_once(":narrowed") {
            Some((left, number)) => (left, number.parse().ok().filter(|n| (1..WIDTHS.len()).contains(n)).ok_or_else(bad)?),
            None => (rest, 0),
        };
        let (rest, by_part) = match rest.strip_suffix(":weighted-by-part") {
            Some(_) => (&rest[..rest.len() - "-by-part".len()], true),
            None => (rest, false),
        };
        let (numbers, weighted) = rest.strip_suffix(":weighted").map_or((rest, false), |numbers| (numbers, true));
        let (start, factor) = numbers.split_once('x').ok_or_else(bad)?;
        let number = |word: &str| word.parse::<u32>().ok().filter(|n| n.is_power_of_two()).ok_or_else(bad);
        let (start, factor) = (number(start)?, number(factor)?);
        let most = u64::from(MAX_SAMPLES);
        if start < SETS as u32 * 8 || u64::from(start) * u64::from(factor) > most {
            return Err(BadInput::new(
                format!("the plan \"{text}\" asks for {} samples", u64::from(start) * u64::from(factor)),
                format!("write from 64 to {most}"),
            )
            .at_field("--plan"));
        }
        Ok(Self { start, doublings: factor.trailing_zeros(), weighted, by_part, narrowed })
    }

    /// Samples that the run ends with.
    pub fn samples(self) -> u32 {
        self.start << self.doublings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_reads_as_it_is_written() {
        for (weighted, by_part, narrowed) in
            [(false, false, 0), (true, false, 0), (true, true, 0), (false, false, 1), (true, false, WIDTHS.len() - 1)]
        {
            let plan = Plan { start: 8192, doublings: 3, weighted, by_part, narrowed };
            assert_eq!(Plan::parse(&plan.to_string()).unwrap(), plan);
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
            let error = Plan::parse(text).unwrap_err().to_string();
            assert!(error.contains("--plan") && error.contains(text), "{error}");
        }
    }
}
