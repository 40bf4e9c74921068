//! How well the photographs tell candidates apart.
//!
//! The evidence of a candidate `M` is that of all photographs, fitted and held-out ones: `p(held out | fitted, M) p(fitted | M)`. The first factor is how well the
//! held-out photograph is predicted, the second one Schwarz' approximation (1978, "Estimating the dimension of a model"):
//!
//! ```text
//! score = sum over groups g of D_g / phi_g  +  k ln n,      D_g = sum over units u of w_u L_u
//! ```
//!
//! about -2 ln of the evidence, lower is better. A group is a photograph. A unit is a direction bin, or a place of the close-up's mean period; `L` is the mean
//! of Huber's squared residuals of its three channels, which leave out the same and count as one; `w` is one over the number of units that share their model error. So
//! `n`, the sum of the weights of fitted units, counts independent residuals and not pixels. `k` counts the free numbers: parameters and colours by channel.
//! Standard deviations of residuals hold the model error of 2 %. Where even the candidate that explains a photograph best leaves more than that,
//! `phi_g` is its mean squared residual, else 1 (the quasi-likelihood of Burnham and Anderson 2002, section 2.5): photographs that none explains tell little.

use crate::residuals::equations::{Evaluated, Origin, huber};

/// Difference of the score from which on one candidate is better than another: 10 is "very strong" evidence in the table of Kass and Raftery 1995 ("Bayes
/// factors", section 3.2, which has twice the natural logarithm, as here).
pub const LEAST_DIFFERENCE: f64 = 10.0;
/// The same in standard errors of the difference, by how much it scatters from unit to unit (Vuong 1989, "Likelihood ratio tests for model selection").
pub const LEAST_ERRORS: f64 = 2.0;

/// What residuals of one unit count: Huber's square, and the weight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Mean of the squared residuals, Huber's.
    pub loss: f64,
    /// How many independent units it is.
    pub weight: f64,
}

/// One photograph beside a candidate.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// Its name.
    pub name: String,
    /// The same units, in the same order, for all candidates that can be compared by it.
    pub units: Vec<Unit>,
    /// Whether the candidate was not fitted to it.
    pub held_out: bool,
}

/// How a candidate explains the photographs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Explained {
    /// By photograph, the same ones in the same order for all candidates.
    pub groups: Vec<Group>,
    /// Squared residuals of what is known beforehand, Huber's.
    pub priors: f64,
    /// Free numbers.
    pub numbers: usize,
}

/// The candidates against each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Of each candidate about -2 ln of its evidence; lower is better, and only differences mean anything.
    pub scores: Vec<f64>,
    /// By photograph that is compared its name and `phi`, what its squared residuals are divided by.
    pub compared: Vec<(String, f64)>,
    /// Photographs that candidates show in ways that cannot be compared.
    pub left_out: Vec<String>,
    /// The candidates, each with its squared residuals by unit over `phi`.
    units: Vec<Vec<Unit>>,
    /// What free numbers cost.
    penalties: Vec<f64>,
}

impl Group {
    fn deviance(&self) -> f64 {
        self.units.iter().map(|u| u.weight * u.loss).sum()
    }

    fn count(&self) -> f64 {
        self.units.iter().map(|u| u.weight).sum()
    }
}

/// The units of the rows of one photograph, three channels each, and of the residuals of it that no unknown changes.
pub fn units(evaluated: &Evaluated, of: impl Fn(Origin) -> bool) -> Vec<Unit> {
    let rows: Vec<_> = evaluated.rows.iter().filter(|(_, origin)| of(*origin)).map(|(row, _)| row).collect();
    let channels = rows.chunks_exact(3).map(|rows| Unit {
        loss: rows.iter().map(|row| huber(evaluated.residual(row))).sum::<f64>() / 3.0,
        weight: rows.iter().map(|row| row.weight).sum::<f64>() / 3.0,
    });
    let fixed = evaluated.fixed.iter().filter(|(_, origin)| of(*origin)).map(|&(r, _)| Unit { loss: huber(r), weight: 1.0 });
    channels.chain(fixed).collect()
}

impl Evidence {
    /// Of candidates that were asked about the same photographs.
    pub fn of(candidates: &[&Explained]) -> Self {
        let count = candidates.first().map_or(0, |c| c.groups.len());
        let mut found = Self {
            scores: candidates.iter().map(|c| c.priors).collect(),
            compared: Vec::new(),
            left_out: Vec::new(),
            units: vec![Vec::new(); candidates.len()],
            penalties: Vec::new(),
        };
        let mut fitted = 0.0;
        for g in 0..count {
            let groups: Vec<&Group> = candidates.iter().map(|c| &c.groups[g]).collect();
            if groups.iter().any(|group| group.units.len() != groups[0].units.len()) {
                found.left_out.push(groups[0].name.clone());
                continue;
            }
            let least = groups.iter().map(|group| group.deviance() / group.count().max(f64::MIN_POSITIVE)).fold(f64::INFINITY, f64::min);
            let phi = if least.is_finite() { least.max(1.0) } else { 1.0 };
            for ((score, units), group) in found.scores.iter_mut().zip(&mut found.units).zip(&groups) {
                *score += group.deviance() / phi;
                units.extend(group.units.iter().map(|u| Unit { loss: u.loss / phi, weight: u.weight }));
            }
            if !groups[0].held_out {
                fitted += groups[0].count();
            }
            found.compared.push((groups[0].name.clone(), phi));
        }
        found.penalties = candidates.iter().map(|c| c.numbers as f64 * f64::max(fitted, 1.0).ln()).collect();
        found.scores.iter_mut().zip(&found.penalties).for_each(|(score, penalty)| *score += penalty);
        found
    }

    /// By how much candidate `a` is better than `b`, and how much of that is enough for it to be no matter of chance.
    ///
    /// What free numbers cost counts against `a` and never for it: that a photograph does not need a highlight does not prove that there is none.
    pub fn lead(&self, a: usize, b: usize) -> (f64, f64) {
        let penalty = (self.penalties[a] - self.penalties[b]).max(0.0);
        let lead = (self.scores[b] - self.penalties[b]) - (self.scores[a] - self.penalties[a]) - penalty;
        let differences = || self.units[a].iter().zip(&self.units[b]).map(|(a, b)| (b.loss - a.loss, a.weight));
        let count: f64 = differences().map(|(_, w)| w).sum();
        let mean = differences().map(|(d, w)| w * d).sum::<f64>() / count.max(f64::MIN_POSITIVE);
        let error = differences().map(|(d, w)| w * (d - mean).powi(2)).sum::<f64>().sqrt();
        (lead, LEAST_DIFFERENCE.max(LEAST_ERRORS * error))
    }

    /// Whether the photographs tell that `a` is better than `b`.
    pub fn is_clear(&self, a: usize, b: usize) -> bool {
        let (lead, enough) = self.lead(a, b);
        lead.is_finite() && lead >= enough || self.scores[a].is_finite() && !self.scores[b].is_finite()
    }

    /// The candidate with the best score.
    pub fn best(&self) -> usize {
        (0..self.scores.len()).min_by(|&a, &b| self.scores[a].total_cmp(&self.scores[b])).unwrap_or(0)
    }

    /// The candidates that none is clearly better than, the best one among them, in the order of their scores. None of them is clearly better than another.
    pub fn tied(&self) -> Vec<usize> {
        let all = || 0..self.scores.len();
        let best = self.best();
        let mut tied: Vec<usize> = all().filter(|&k| k == best || !all().any(|other| self.is_clear(other, k))).collect();
        tied.sort_by(|&a, &b| self.scores[a].total_cmp(&self.scores[b]));
        tied
    }

    /// Of the candidates that cannot be told apart the one with the fewest free numbers, of equal ones the one with the best score.
    pub fn chosen(&self) -> usize {
        let best = self.best();
        self.tied().into_iter().min_by(|&a, &b| self.penalties[a].total_cmp(&self.penalties[b])).unwrap_or(best)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A candidate whose fitted and held-out units have these squared residuals.
    fn explained(fitted: &[f64], held_out: &[f64], numbers: usize) -> Explained {
        let group = |losses: &[f64], held_out| Group {
            name: if held_out { "c.exr" } else { "b.exr" }.into(),
            units: losses.iter().map(|&loss| Unit { loss, weight: 1.0 }).collect(),
            held_out,
        };
        Explained { groups: vec![group(fitted, false), group(held_out, true)], priors: 0.0, numbers }
    }

    #[test]
    fn a_free_number_must_pay_and_one_that_brings_nothing_is_left_out_without_a_claim() {
        let simple = explained(&[0.5; 40], &[0.5; 20], 5);
        let free = explained(&[0.45; 40], &[0.5; 20], 7);
        let evidence = Evidence::of(&[&free, &simple]);
        // Two numbers cost 2 ln 40 = 7.4 and bring 2.
        assert_eq!((evidence.best(), evidence.chosen(), evidence.tied().len()), (1, 1, 2));
        // The same where they cost over 10: nothing says that they are not there.
        let evidence = Evidence::of(&[&Explained { numbers: 12, ..free.clone() }, &simple]);
        assert_eq!((evidence.chosen(), evidence.tied().len()), (1, 2));
        // Where they bring much they are told.
        let needed = explained(&[2.0; 40], &[3.0; 20], 5);
        let evidence = Evidence::of(&[&free, &needed]);
        assert_eq!((evidence.chosen(), evidence.tied()), (0, vec![0]));
        assert!(evidence.is_clear(0, 1) && !evidence.is_clear(1, 0));
    }

    #[test]
    fn what_any_other_is_clearly_better_than_is_not_among_those_that_cannot_be_told_apart() {
        // The third one is not clearly worse than the best one, whose numbers cost more, but than the second one it is.
        let best = explained(&[0.5; 40], &[0.5; 20], 9);
        let middle = explained(&[0.65; 40], &[0.65; 20], 8);
        let third = explained(&[0.85; 40], &[0.85; 20], 8);
        let evidence = Evidence::of(&[&best, &middle, &third]);
        assert!(evidence.is_clear(1, 2) && !evidence.is_clear(0, 1), "{:?} {:?}", evidence.lead(1, 2), evidence.lead(0, 1));
        assert!(!evidence.tied().contains(&2) && evidence.chosen() != 2, "{:?}", evidence.tied());
    }

    #[test]
    fn a_lead_of_few_units_is_chance_and_photographs_that_none_explains_tell_little() {
        let even = explained(&[1.0; 40], &[1.0; 20], 5);
        let mut one = [1.0; 20];
        one[3] = 13.0;
        let other = explained(&[1.0; 40], &one, 5);
        let evidence = Evidence::of(&[&even, &other]);
        let (lead, enough) = evidence.lead(0, 1);
        assert!((lead - 12.0).abs() < 1e-12 && enough > 20.0 && !evidence.is_clear(0, 1), "{lead} {enough}");
        // The same share of it everywhere is told.
        assert!(Evidence::of(&[&even, &explained(&[1.2; 40], &[1.2; 20], 5)]).is_clear(0, 1));
        // Ten times as far off both.
        let evidence = Evidence::of(&[&explained(&[10.0; 40], &[10.0; 20], 5), &explained(&[11.0; 40], &[11.0; 20], 5)]);
        assert!(!evidence.is_clear(0, 1) && evidence.compared.iter().all(|(_, phi)| *phi == 10.0), "{:?}", evidence.compared);
    }

    #[test]
    fn photographs_that_cannot_be_compared_are_left_out_and_a_candidate_without_a_surface_loses() {
        let evidence = Evidence::of(&[&explained(&[1.0; 40], &[1.0; 20], 5), &explained(&[9.0; 39], &[1.0; 20], 5)]);
        assert_eq!((evidence.left_out.as_slice(), evidence.tied().len()), (&["b.exr".to_owned()][..], 2));
        let none = Explained { priors: f64::INFINITY, ..explained(&[1.0; 40], &[1.0; 20], 5) };
        let evidence = Evidence::of(&[&none, &explained(&[9.0; 40], &[1.0; 20], 5)]);
        assert_eq!((evidence.chosen(), evidence.tied().len()), (1, 1));
    }
}
