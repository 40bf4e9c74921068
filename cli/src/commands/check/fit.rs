//! What `biscale check` says of a fit file.

use crate::common::interrupt;
use biscale::error::Result;
use biscale::filter::Control;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::run::{Survey, survey};
use serde::Serialize;
use std::fmt;

/// What a good fit file means.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    kind: &'static str,
    name: String,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    candidates: Vec<String>,
    #[serde(flatten)]
    survey: Survey,
}

impl Report {
    /// Looks at the photographs, and at the close-up's period and colours.
    pub fn of(spec: &Spec) -> Result<Self> {
        let control = Control { cancel: interrupt::flag(), progress: &|_, _| {}, clock: &|| 0.0 };
        let all = biscale_fit::run::candidates(spec);
        let candidates = if all.len() > 1 { all.into_iter().map(|c| c.name).collect() } else { Vec::new() };
        Ok(Self { kind: "fit", name: spec.name.clone(), candidates, survey: survey(spec, &control)? })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "  name      {}", self.name)?;
        for (file, pixels, bins) in &self.survey.distant {
            writeln!(f, "  distant   {file}: {pixels} pixels can be used, in {bins} direction bins")?;
        }
        if let Some(found) = &self.survey.close_up {
            for (axis, period) in ["x", "y"].iter().zip(&found.period) {
                match period {
                    Some(p) => writeln!(f, "  close-up  period {:.5} +/- {:.5} along {axis}", p.length, p.sigma)?,
                    None => writeln!(f, "  close-up  no period along {axis}")?,
                }
            }
            for (k, cluster) in found.clusters.iter().enumerate() {
                let [r, g, b] = cluster.colour;
                writeln!(
                    f,
                    "  close-up  colour {}: coverage {:.1} %, mean radiance [{r:.4}, {g:.4}, {b:.4}]",
                    k + 1,
                    100.0 * cluster.cover
                )?;
            }
        }
        writeln!(f, "  moves     {}", self.survey.variables.join(", "))?;
        writeln!(f, "  solves    {}", self.survey.unknowns.join(", "))?;
        for name in &self.candidates {
            writeln!(f, "  candidate {name}")?;
        }
        for note in &self.survey.notes {
            writeln!(f, "  note      {note}")?;
        }
        Ok(())
    }
}
