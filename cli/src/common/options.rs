//! Options that several commands share, and what they mean to the library.

use super::flags::Flags;
use super::lowrank_cache;
use super::output::ColourChoice;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::{Method, Plan, Quality, Variant};
use clap::{Args, ValueEnum};
use std::time::Duration;

/// Options of every command.
#[derive(Args, Clone, Debug, Default)]
pub struct CommonArgs {
    /// Print one JSON object on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Print no progress, summaries or notes; errors stay, and of what is judged the verdict in one line
    #[arg(long, short, global = true)]
    pub quiet: bool,
    /// Also tell how it was done: what was expected, chosen and left out on the way
    #[arg(long, short, global = true, conflicts_with = "quiet")]
    pub verbose: bool,
    /// When errors are coloured
    #[arg(long, global = true, value_name = "WHEN", value_enum, default_value_t = ColourChoice::Auto)]
    pub color: ColourChoice,
    /// Threads to compute with, 0 for all cores; the result does not depend on it
    #[arg(long, global = true, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u16).range(0..=1024), allow_negative_numbers = true)]
    pub threads: u16,
    /// Flags of the running command, for what is said about fields
    #[arg(skip)]
    pub flags: Flags,
}

/// How well, and how, to compute effective values.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Quality")]
pub struct QualityArgs {
    /// Method to compute with
    #[arg(long, value_enum, default_value_t = MethodArg::Auto)]
    pub method: MethodArg,
    /// Which form of a published method (lowrank: paper if not said; sg: improved)
    #[arg(long, value_enum)]
    pub variant: Option<VariantArg>,
    /// Neither use nor keep precomputed BRDFs (lowrank); see `biscale cache`
    #[arg(long)]
    pub no_cache: bool,
    /// Relative RMS error to stay within, from 0.000001 to 1
    #[arg(long, value_name = "ERROR", default_value_t = Quality::default().tolerance, value_parser = tolerance, allow_negative_numbers = true)]
    pub tolerance: f64,
    /// Wall time to stay within, such as 100ms, 2s or 1m; then the tolerance is a wish
    #[arg(long, value_name = "TIME", value_parser = time, conflicts_with = "plan", allow_hyphen_values = true)]
    pub budget: Option<Duration>,
    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true)]
    pub seed: u64,
    /// Reflections after the first; 0 is direct light only [default: what the material says, or 0]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=1000), allow_negative_numbers = true)]
    pub bounces: Option<u32>,
    /// Where to compute
    #[arg(long, value_enum, default_value_t = Device::Auto)]
    pub device: Device,
    /// Repeat the bits of an earlier run: the plan that its summary printed
    #[arg(long, value_name = "PLAN")]
    pub plan: Option<String>,
}

/// `--method`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// The program chooses
    Auto,
    /// Facets shared by all pairs, summed directly
    Direct,
    /// Low-rank matrices (Wu et al. 2011)
    Lowrank,
    /// Spherical Gaussians (Iwasaki et al. 2012)
    Sg,
    /// Fresh rays for every pair, with interreflections if asked
    Reference,
}

/// `--variant`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum VariantArg {
    /// As published
    Paper,
    /// With this project's changes
    Improved,
}

/// `--device`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Device {
    /// The program chooses
    Auto,
    /// The processor
    Cpu,
    /// The graphics card; not built yet
    Gpu,
}

impl QualityArgs {
    /// What the library is asked for.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for the graphics card; [`Error::BadInput`] for a plan that is none.
    pub fn quality(&self) -> Result<Quality> {
        if self.device == Device::Gpu {
            return Err(Error::Unsupported {
                what: "`device gpu`".into(),
                remedy: "it is not built yet; use `device auto` or `device cpu`".into(),
            });
        }
        if self.plan.as_ref().is_some_and(|p| p.trim().is_empty()) {
            return Err(BadInput::new("the plan is empty", "copy it from the summary of an earlier run").at_field("plan").into());
        }
        let method = match self.method {
            MethodArg::Auto => Method::Auto,
            MethodArg::Direct => Method::Direct,
            MethodArg::Lowrank => Method::LowRank,
            MethodArg::Sg => Method::SphericalGaussian,
            MethodArg::Reference => Method::Reference,
        };
        Ok(Quality {
            method,
            tolerance: self.tolerance,
            budget: self.budget.map(|b| b.as_secs_f64()),
            seed: self.seed,
            bounces: self.bounces,
            plan: self.plan.as_deref().map(str::parse::<Plan>).transpose()?,
            variant: self.variant.map(|variant| match variant {
                VariantArg::Paper => Variant::Paper,
                VariantArg::Improved => Variant::Improved,
            }),
            cache: if self.no_cache { None } else { lowrank_cache::user_cache() },
        })
    }

    /// How a run with so many reflections after the first takes less, where it takes long, in half a sentence. Errors fall as the samples to the power of -.75
    /// (`cargo bench --bench accuracy`).
    pub fn advice(&self, bounces: u32) -> &'static str {
        match self.method {
            _ if bounces > 0 => "a looser `--tolerance` takes less, and so does direct light alone, with `--bounces 0`",
            MethodArg::Lowrank => {
                "the published settings do not depend on the tolerance: `--method direct` does not need them, `biscale cache` keeps them"
            }
            MethodArg::Sg | MethodArg::Reference => "a looser `--tolerance`, or `--method direct`, may take less",
            MethodArg::Auto | MethodArg::Direct => "twice the `--tolerance` takes about two fifths of the time",
        }
    }

    /// What the user should know about options that this run does not use.
    pub fn notes(&self) -> Vec<String> {
        if self.variant.is_some() && !matches!(self.method, MethodArg::Lowrank | MethodArg::Sg) {
            vec!["`variant` is an option of `method lowrank` and `method sg`; this run does not use it".to_owned()]
        } else {
            Vec::new()
        }
    }
}

/// Reads `--tolerance`.
pub fn tolerance(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(v) if (1e-6..=1.0).contains(&v) => Ok(v),
        Ok(_) => Err("out of range; write a number from 0.000001 to 1, such as 0.005 for half a percent".to_owned()),
        Err(_) => Err("not a number; write a number from 0.000001 to 1, such as 0.005 for half a percent".to_owned()),
    }
}

/// Reads `--exposure`.
pub fn exposure(text: &str) -> Result<f64, String> {
    text.trim().parse().ok().filter(|v| (-64.0..=64.0).contains(v)).ok_or_else(|| "write stops from -64 to 64, such as 1.5".to_owned())
}

/// Units of `--budget` with their size in seconds, longest names first where one ends another.
const TIME_UNITS: [(&str, f64); 4] = [("ms", 1e-3), ("s", 1.0), ("m", 60.0), ("h", 3600.0)];

/// Reads `--budget`: a number and a unit.
pub fn time(text: &str) -> Result<Duration, String> {
    let remedy = "write a number and one of ms, s, m, h, such as 100ms, 2s or 1m";
    let text = text.trim();
    let Some((number, size)) = TIME_UNITS.iter().find_map(|(unit, size)| Some((text.strip_suffix(unit)?, size))) else {
        return Err(if text.parse::<f64>().is_ok() { format!("the unit is missing; {remedy}") } else { format!("not a time; {remedy}") });
    };
    match number.trim_end().parse::<f64>() {
        Ok(v) if (1e-3..=1e6).contains(&(v * size)) => Ok(Duration::from_secs_f64(v * size)),
        Ok(_) => Err(format!("out of range (1ms to 277h); {remedy}")),
        Err(_) => Err(format!("not a time; {remedy}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_with_their_units() {
        for (text, seconds) in [("100ms", 0.1), ("2s", 2.0), ("1m", 60.0), ("1.5 h", 5400.0), ("1e3ms", 1.0)] {
            assert_eq!(time(text), Ok(Duration::from_secs_f64(seconds)), "{text}");
        }
    }

    #[test]
    fn a_time_without_unit_number_or_sense_is_refused_with_an_example() {
        for text in ["", "2", "s", "ms", "-1s", "0s", "nans", "infs", "1e300h", "2 weeks", "1ms2"] {
            let message = time(text).unwrap_err();
            assert!(message.contains("100ms"), "{text:?}: {message}");
        }
    }

    #[test]
    fn a_tolerance_that_cannot_be_kept_is_refused() {
        for text in ["0", "-1", "nan", "inf", "1e-9", "2", "0,5", ""] {
            assert!(tolerance(text).is_err(), "{text:?}");
        }
        assert_eq!(tolerance("0.002"), Ok(0.002));
    }
}
