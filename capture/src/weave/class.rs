//! The names of drafts.

use super::grid::gcd;
use biscale::geometry::weave::Draft;
use serde::Serialize;
use std::fmt;

/// Which way the lines of a twill climb, seen with y up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TwillDirection {
    /// To the right, as the bar of a Z.
    Z,
    /// To the left, as the bar of an S.
    S,
}

/// Class of a weave.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "name", rename_all = "kebab-case")]
pub enum Class {
    /// One over, one under, each weft moved by one warp.
    Plain,
    /// Each warp passes over `over` wefts and under `under`, each weft moved by one warp.
    Twill {
        /// Wefts that a warp passes over.
        over: u32,
        /// Wefts that a warp passes under.
        under: u32,
        /// Which way its lines climb.
        direction: TwillDirection,
    },
    /// One crossing of each thread in a repeat, scattered.
    Satin {
        /// Threads of a repeat.
        ends: u32,
        /// Warps by which the next weft is moved.
        step: u32,
        /// Whether the warp lies on top but for one crossing a thread.
        warp_faced: bool,
    },
    /// Plain weave of groups of `warps` warps and `wefts` wefts: baskets (panama) and ribs.
    Basket {
        /// Warps that go together.
        warps: u32,
        /// Wefts that go together.
        wefts: u32,
    },
    /// Any other draft.
    Other,
}

impl Class {
    /// The class of one repeat of a draft, wherever in the repeat it begins.
    pub fn of(draft: &Draft) -> Self {
        let (columns, rows) = (draft.column_period(|_, _| true), draft.row_period(|_, _| true));
        let draft = draft.cropped(columns, rows);
        let row_runs: Vec<usize> = runs(&(0..columns).map(|i| draft.over(i, 0)).collect::<Vec<_>>());
        let column_runs: Vec<usize> = runs(&(0..rows).map(|j| draft.over(0, j)).collect::<Vec<_>>());
        // Groups: all rows are the first or its complement, and runs are equal.
        if let ([a, b], [c, d]) = (&row_runs[..], &column_runs[..])
            && a == b
            && c == d
            && (0..rows).all(|j| (0..columns).all(|i| draft.over(i, j) == (draft.over(i, 0) == (draft.over(0, j) == draft.over(0, 0)))))
        {
            return if (*a, *c) == (1, 1) { Self::Plain } else { Self::Basket { warps: *a as u32, wefts: *c as u32 } };
        }
        if columns != rows || row_runs.len() != 2 {
            return Self::Other;
        }
        let over = (0..columns).filter(|&i| draft.over(i, 0)).count();
        let moved_by = |step: usize| (1..rows).all(|j| (0..columns).all(|i| draft.over((i + step * j) % columns, j) == draft.over(i, 0)));
        let Some(step) = (1..columns).find(|&step| moved_by(step)) else { return Self::Other };
        let under = columns - over;
        let (n, over_, under_) = (columns as u32, over as u32, under as u32);
        if step == 1 {
            Self::Twill { over: over_, under: under_, direction: TwillDirection::Z }
        } else if step + 1 == columns {
            Self::Twill { over: over_, under: under_, direction: TwillDirection::S }
        } else if over.min(under) == 1 && gcd(step as i64, columns as i64) == 1 {
            Self::Satin { ends: n, step: step as u32, warp_faced: over > under }
        } else {
            Self::Other
        }
    }
}

/// Lengths of the runs of a periodic sequence; one if it never changes.
fn runs(values: &[bool]) -> Vec<usize> {
    let n = values.len();
    let Some(start) = (0..n).find(|&k| values[k] != values[(k + n - 1) % n]) else { return vec![n] };
    let mut lengths = Vec::new();
    for k in 0..n {
        let k = (start + k) % n;
        if values[k] == values[(k + n - 1) % n] {
            *lengths.last_mut().expect("the start is a change") += 1;
        } else {
            lengths.push(1);
        }
    }
    lengths
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Plain => write!(f, "plain"),
            Self::Twill { over, under, direction } => {
                write!(f, "twill {over}/{under} {}", if direction == TwillDirection::Z { "Z" } else { "S" })
            }
            Self::Satin { ends, step, warp_faced } => write!(f, "satin {ends}/{step} {}-faced", if warp_faced { "warp" } else { "weft" }),
            Self::Basket { warps, wefts } => write!(f, "basket {warps}/{wefts}"),
            Self::Other => write!(f, "other"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The class of a draft of which several repeats are seen from some thread on.
    fn seen(draft: &Draft, from: usize) -> Class {
        Class::of(&Draft::from_fn(2 * draft.columns, draft.rows, |i, j| {
            draft.over((i + from) % draft.columns, (j + 2 * from) % draft.rows)
        }))
    }

    #[test]
    fn drafts_are_named_wherever_they_begin() {
        for from in 0..5 {
            assert_eq!(seen(&Draft::shifted(1, 1, 1), from), Class::Plain);
            for (over, under) in [(2, 1), (1, 2), (2, 2), (3, 1), (1, 3), (3, 3), (4, 2)] {
                let z = Class::Twill { over, under, direction: TwillDirection::Z };
                let s = Class::Twill { over, under, direction: TwillDirection::S };
                assert_eq!(seen(&Draft::shifted(over, under, 1), from), z);
                assert_eq!(seen(&Draft::shifted(over, under, over + under - 1), from), s);
            }
            for (over, under, step) in [(4, 1, 2), (1, 4, 3), (7, 1, 3), (1, 7, 5), (1, 6, 2)] {
                let satin = Class::Satin { ends: over + under, step, warp_faced: over > under };
                assert_eq!(seen(&Draft::shifted(over, under, step), from), satin);
            }
            assert_eq!(seen(&Draft::shifted(2, 2, 2), from), Class::Basket { warps: 2, wefts: 1 });
            let basket = Draft::from_fn(6, 4, |i, j| (i / 3 + j / 2) % 2 == 0);
            assert_eq!(seen(&basket, from), Class::Basket { warps: 3, wefts: 2 });
            // A pointed twill, and a twill of two lines.
            let pointed = Draft::from_fn(6, 4, |i, j| Draft::shifted(2, 2, 1).over([0, 1, 2, 3, 2, 1][i], j));
            assert_eq!(seen(&pointed, from), Class::Other);
            let fancy = Draft::from_fn(6, 6, |i, j| [true, true, false, true, false, false][(i + 5 * j) % 6]);
            assert_eq!(seen(&fancy, from), Class::Other);
        }
    }
}
