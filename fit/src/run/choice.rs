//! Which of several materials the photographs show: all candidates are looked at cheaply, the likely ones again, and those that cannot be told apart searched as
//! a fit is. `docs/fit.md` states the rule for users, [`crate::verdict::evidence`] where it comes from.

use super::deadline::stopped_when;
use super::options::Options;
use super::prepared::Prepared;
use super::screening::{Looked, Looking, held_out};
use crate::fit_file::candidate::Candidate;
use crate::fit_file::spec::Spec;
use crate::verdict::evidence::{Evidence, Explained};
use crate::verdict::gates::MOST_NEAR_ERROR;
use crate::verdict::validate::{MOST_ERROR, limit};
use biscale::error::{Error, Result};
use biscale::filter::Control;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// Candidates that get a second look at least, and the score over that of the best one up to which more do, as a share of it. Chosen, not measured: more cost time, fewer
/// lose a candidate whose own start is far off.
const SECOND_LOOKS: usize = 3;
/// See [`SECOND_LOOKS`].
const FAR_BEHIND: f64 = 1.0;
/// Most candidates that are searched as a fit is. Chosen, not measured: each costs as much as a fit.
const WHOLE_SEARCHES: usize = 3;
/// Share of a time limit that the choice may take.
const CHOICE_SHARE: f64 = 0.5;

/// How closely a candidate was looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Look {
    /// Not at all: it makes no surface, or the time was over.
    None,
    /// From its own start, without what was held out.
    First,
    /// By a short search.
    Second,
    /// By the search of a fit.
    Whole,
}

/// A candidate and what the photographs say of it.
#[derive(Clone, Debug, Serialize)]
pub struct Screened {
    /// Its name.
    pub name: String,
    /// How closely it was looked at: errors of closer looks are smaller.
    pub look: Look,
    /// About -2 ln of its evidence over that of the best one; among those that were looked at again.
    pub behind: Option<f64>,
    /// The same without what speaks for the candidate alone: what its free numbers cost less than those of the best one. This decides.
    pub lead: Option<f64>,
    /// What `lead` must be at least for the candidate to be clearly worse than the best one.
    pub enough: Option<f64>,
    /// Relative RMS difference of the distant photographs.
    pub training: Option<f64>,
    /// The same of the close-up.
    pub close_up: Option<f64>,
    /// The same of each photograph that was held out.
    pub held_out: Vec<f64>,
    /// Free numbers.
    pub numbers: usize,
    /// Why it is not among those that are compared.
    pub ruled_out: Option<String>,
    /// Whether the photographs cannot tell it from the one that was chosen.
    pub tied: bool,
}

/// Which material the photographs show.
#[derive(Clone, Debug, Serialize)]
pub struct Choice {
    /// The start material first, then the candidates of the fit file.
    pub candidates: Vec<Screened>,
    /// The one that was chosen.
    pub chosen: usize,
    /// Photographs that took part, with what their squared residuals were divided by.
    pub compared: Vec<(String, f64)>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// Evaluations of all looks.
    pub evaluations: usize,
    /// Whether all candidates were looked at as closely as they deserve; not where a time limit ended the choice.
    pub complete: bool,
}

impl Choice {
    /// The names of those that cannot be told from the chosen one.
    pub fn tied(&self) -> Vec<&str> {
        self.candidates.iter().filter(|c| c.tied).map(|c| &*c.name).collect()
    }

    /// In one sentence.
    pub fn sentence(&self) -> String {
        let chosen = &self.candidates[self.chosen].name;
        let all = self.candidates.len();
        if !self.complete {
            return format!(
                "\"{chosen}\" so far: the time limit ended the choice before all of the {all} candidates were looked at closely"
            );
        }
        if self.candidates.iter().all(|c| c.ruled_out.is_some()) {
            return format!("none of the {all} candidates can be compared with the photographs: \"{chosen}\" is the start material");
        }
        match &self.tied()[..] {
            [] => format!("of {all} candidates the photographs show \"{chosen}\""),
            tied => {
                let names: Vec<String> = tied.iter().map(|n| format!("\"{n}\"")).collect();
                format!("\"{chosen}\" of {all} candidates; the photographs cannot tell it from {}", names.join(", "))
            }
        }
    }

    /// Why no candidate is to be believed, if none is.
    pub fn failure(&self) -> Option<String> {
        let explains = |c: &Screened| {
            let training = c.training.unwrap_or(f64::INFINITY);
            c.ruled_out.is_none()
                && training <= MOST_ERROR
                && c.close_up.is_none_or(|near| near <= MOST_NEAR_ERROR)
                && c.held_out.iter().all(|&error| error <= limit(training))
        };
        let none = self.complete && !self.candidates.iter().any(explains);
        none.then(|| {
            format!(
                "none of the {} candidates explains the photographs: the structure is another one, or something else is wrong with them",
                self.candidates.len()
            )
        })
    }
}

/// The candidates of a fit file, the start material first.
pub fn candidates(spec: &Spec) -> Vec<Candidate> {
    std::iter::once(spec.own()).chain(spec.candidates.iter().cloned()).collect()
}

/// Chooses between the start material of a fit file and its candidates.
///
/// The same fit file, options and seed give the same choice at any thread count, unless the time limit ends it.
///
/// # Errors
/// Bad input; failures of the filter; `Interrupted`.
pub fn choose(spec: &Spec, options: &Options, control: &Control<'_>) -> Result<Choice> {
    let all = candidates(spec);
    let (began, stop) = ((control.clock)(), AtomicBool::new(false));
    let over = || control.check().is_err() || options.time_limit.is_some_and(|limit| (control.clock)() > began + CHOICE_SHARE * limit);
    let limited = Control { cancel: &stop, progress: control.progress, clock: control.clock };
    let choosing = Choosing { spec, all: &all, options };
    let chosen = stopped_when(&stop, over, || choosing.run(&limited));
    control.check()?;
    chosen
}

/// The candidates while they are looked at.
struct Choosing<'a> {
    spec: &'a Spec,
    all: &'a [Candidate],
    options: &'a Options,
}

impl Choosing<'_> {
    fn run(&self, control: &Control<'_>) -> Result<Choice> {
        let all = self.all;
        let base = Prepared::new(self.spec, &Control { cancel: &AtomicBool::new(false), ..*control })?;
        let mut notes = Vec::new();
        let held_out = held_out(&base, &mut notes);
        let mut looks: Vec<(Look, Option<Looked>)> = vec![(Look::None, None); all.len()];
        let mut is_over = false;
        let mut evaluations = 0;
        let (mut steps, mut refused) = (0, Vec::new());
        let mut look = |k: usize, look: Look, looks: &mut Vec<(Look, Option<Looked>)>| -> Result<bool> {
            steps += 1;
            (control.progress)("candidates", 1.0 - 1.0 / (1.0 + f64::from(steps) / all.len() as f64));
            let spec = self.spec.of(&all[k]);
            let looked = Prepared::with(&spec, Some(&base), control).and_then(|prepared| {
                let looking = Looking { prepared: &prepared, options: self.options, held_out: &held_out, control };
                match look {
                    Look::None | Look::First => looking.first(),
                    Look::Second => looking.second(),
                    Look::Whole => looking.whole(),
                }
            });
            match looked {
                Ok(looked) => {
                    evaluations += looked.as_ref().map_or(0, |l| l.evaluations);
                    // What a closer look does not find is as it was.
                    if looked.is_some() {
                        looks[k] = (look, looked);
                    }
                    Ok(true)
                }
                Err(Error::Interrupted) => Ok(false),
                // What makes no surface is no candidate.
                Err(Error::BadInput(bad)) => {
                    refused.push(format!("{}: {bad}", all[k].name));
                    Ok(true)
                }
                Err(error) => Err(error),
            }
        };
        let mut every = |which: &[usize], stage: Look, looks: &mut Vec<(Look, Option<Looked>)>| -> Result<()> {
            for &k in which {
                is_over = is_over || !look(k, stage, looks)?;
            }
            Ok(())
        };
        every(&(0..all.len()).collect::<Vec<_>>(), Look::First, &mut looks)?;
        let promising = promising(&looks);
        every(&promising, Look::Second, &mut looks)?;
        let compared = |looks: &[(Look, Option<Looked>)], least: Look| -> Vec<usize> {
            (0..looks.len()).filter(|&k| looks[k].0 as usize >= least as usize && rules_out(&looks[k]).is_none()).collect()
        };
        let mut of = compared(&looks, Look::Second);
        if of.is_empty() {
            of = compared(&looks, Look::First);
        }
        let mut judged = Judged::of(&looks, of);
        if judged.tied.len() > 1 {
            let searched: Vec<usize> = self.worth_a_search(&judged);
            every(&searched, Look::Whole, &mut looks)?;
            judged = judged.searched(&searched, &looks);
        }
        if is_over {
            notes.push("the time limit ended the choice: candidates that were not looked at closely may be the better ones".to_owned());
        }
        notes.extend(refused);
        notes.extend(
            judged
                .evidence
                .left_out
                .iter()
                .map(|name| format!("{name}: candidates show it in ways that cannot be compared: it took no part in the choice")),
        );
        let complete = !is_over;
        Ok(Choice { complete, ..choice(all, &looks, &judged, notes, evaluations) })
    }

    /// Of the candidates that cannot be told apart those that are searched as a fit is: the one that would be chosen, and the best others.
    fn worth_a_search(&self, judged: &Judged) -> Vec<usize> {
        let mut searched = vec![judged.chosen];
        searched.extend(judged.tied.iter().copied().filter(|&k| k != judged.chosen).take(WHOLE_SEARCHES - 1));
        searched.sort_unstable();
        searched
    }
}

/// What the evidence says of candidates, by their places among all.
struct Judged {
    /// Those that are compared.
    of: Vec<usize>,
    /// Their evidence, in the same order.
    evidence: Evidence,
    chosen: usize,
    /// Those that cannot be told apart, the chosen one among them, in the order of their scores.
    tied: Vec<usize>,
}

impl Judged {
    fn of(looks: &[(Look, Option<Looked>)], of: Vec<usize>) -> Self {
        let evidence = evidence_of(looks, &of);
        let chosen = of.get(evidence.chosen()).copied().unwrap_or(0);
        let tied = if of.is_empty() { Vec::new() } else { evidence.tied().into_iter().map(|k| of[k]).collect() };
        Self { of, evidence, chosen, tied }
    }

    /// The same once some of those that could not be told apart were searched as a fit is: these are judged anew, among themselves. The others
    /// were not looked at as closely, and are no clearer than before.
    fn searched(self, searched: &[usize], looks: &[(Look, Option<Looked>)]) -> Self {
        let among = Self::of(looks, searched.to_vec());
        let others = self.tied.into_iter().filter(|k| !searched.contains(k));
        let tied = among.tied.iter().copied().chain(others).collect();
        Self { chosen: among.chosen, tied, ..Self::of(looks, self.of) }
    }
}

/// Why a candidate is not compared.
fn rules_out((_, looked): &(Look, Option<Looked>)) -> Option<String> {
    looked.as_ref().map_or_else(|| Some("it makes no surface, or was not looked at".to_owned()), |l| l.other_periods.clone())
}

fn evidence_of(looks: &[(Look, Option<Looked>)], of: &[usize]) -> Evidence {
    let explained: Vec<&Explained> = of.iter().filter_map(|&k| looks[k].1.as_ref().map(|l| &l.explained)).collect();
    Evidence::of(&explained)
}

/// The candidates that are worth a second look.
fn promising(looks: &[(Look, Option<Looked>)]) -> Vec<usize> {
    let of: Vec<usize> = (0..looks.len()).filter(|&k| rules_out(&looks[k]).is_none()).collect();
    let evidence = evidence_of(looks, &of);
    let mut order: Vec<usize> = (0..of.len()).collect();
    order.sort_by(|&a, &b| evidence.scores[a].total_cmp(&evidence.scores[b]));
    let Some(&best) = order.first() else { return Vec::new() };
    let far = evidence.scores[best] * (1.0 + FAR_BEHIND);
    let mut chosen: Vec<usize> =
        order.iter().enumerate().filter(|&(rank, &k)| rank < SECOND_LOOKS || evidence.scores[k] <= far).map(|(_, &k)| of[k]).collect();
    chosen.sort_unstable();
    chosen
}

fn choice(
    all: &[Candidate],
    looks: &[(Look, Option<Looked>)],
    Judged { of, evidence, chosen, tied }: &Judged,
    notes: Vec<String>,
    evaluations: usize,
) -> Choice {
    let chosen = *chosen;
    let one = |(k, candidate): (usize, &Candidate)| {
        let (look, looked) = &looks[k];
        let place = of.iter().position(|&o| o == k);
        let lead = place.map(|p| evidence.lead(evidence.best(), p));
        Screened {
            name: candidate.name.clone(),
            look: *look,
            behind: place.map(|p| evidence.scores[p] - evidence.scores[evidence.best()]).filter(|b| b.is_finite()),
            lead: lead.map(|(lead, _)| lead).filter(|l| l.is_finite()),
            enough: lead.map(|(_, enough)| enough).filter(|e| e.is_finite()),
            training: looked.as_ref().map(|l| l.training),
            close_up: looked.as_ref().and_then(|l| l.close_up),
            held_out: looked.as_ref().map_or_else(Vec::new, |l| l.held_out.clone()),
            numbers: looked.as_ref().map_or(0, |l| l.explained.numbers),
            ruled_out: if place.is_some() {
                None
            } else {
                rules_out(&looks[k]).or_else(|| Some("far behind at the first look, or not looked at closely".to_owned()))
            },
            tied: k != chosen && tied.contains(&k),
        }
    };
    Choice {
        candidates: all.iter().enumerate().map(one).collect(),
        chosen,
        compared: evidence.compared.clone(),
        notes,
        evaluations,
        complete: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn screened(name: &str, training: f64, tied: bool) -> Screened {
        Screened {
            name: name.to_owned(),
            look: Look::Second,
            behind: Some(0.0),
            lead: Some(0.0),
            enough: Some(10.0),
            training: Some(training),
            close_up: Some(0.02),
            held_out: vec![0.02],
            numbers: 10,
            ruled_out: None,
            tied,
        }
    }

    #[test]
    fn a_choice_says_what_it_cannot_tell_when_it_was_ended_and_when_none_explains_the_photographs() {
        let choice = |second: Screened| Choice {
            candidates: vec![screened("plain, lambert", 0.01, false), second],
            chosen: 0,
            compared: Vec::new(),
            notes: Vec::new(),
            evaluations: 7,
            complete: true,
        };
        assert_eq!(choice(screened("twill", 0.2, false)).sentence(), "of 2 candidates the photographs show \"plain, lambert\"");
        let doubtful = choice(screened("plain, gloss", 0.01, true));
        assert!(doubtful.sentence().contains("cannot tell it from \"plain, gloss\"") && doubtful.failure().is_none());
        let ended = Choice { complete: false, ..doubtful };
        assert!(ended.sentence().contains("so far"), "{}", ended.sentence());
        let mut none = choice(screened("twill", 0.2, false));
        none.candidates[0].close_up = Some(0.3);
        assert!(none.failure().is_some_and(|f| f.contains("none of the 2 candidates")));
        // What was not looked at closely proves nothing.
        assert_eq!(Choice { complete: false, ..none }.failure(), None);
    }
}
