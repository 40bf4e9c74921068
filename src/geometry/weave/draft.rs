//! Binary drafts: where a warp thread lies over a weft thread.

/// Most crossings of a draft.
pub const MAX_CROSSINGS: usize = 4_000_000;

/// A binary draft, periodic in both directions.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draft {
    /// Warp threads, along x.
    pub columns: usize,
    /// Weft threads, along y.
    pub rows: usize,
    /// `rows` rows of `columns`: whether the warp lies over.
    pub warp_over: Vec<bool>,
}

impl Draft {
    /// A draft by a rule for warp `i` and weft `j`.
    pub fn from_fn(columns: usize, rows: usize, over: impl Fn(usize, usize) -> bool) -> Self {
        let warp_over = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| over(i, j)).collect();
        Self { columns, rows, warp_over }
    }

    /// Each warp lies over `over` wefts, then under `under`; each weft sees the same, moved by `shift` warps from the one before.
    ///
    /// 1, 1, 1 is plain weave; 2, 2, 1 a twill; 4, 1, 2 a satin.
    pub fn shifted(over: u32, under: u32, shift: u32) -> Self {
        let columns = over + under;
        let rows = columns / gcd(columns, shift);
        // Moving by -shift a weft makes the twill line climb to the right.
        let place = |i: usize, j: usize| (i as u64 + u64::from(columns - shift % columns) * j as u64) % u64::from(columns);
        Self::from_fn(columns as usize, rows as usize, |i, j| place(i, j) < u64::from(over))
    }

    /// Whether warp `i` lies over weft `j`.
    pub fn over(&self, i: usize, j: usize) -> bool {
        self.warp_over[j * self.columns + i]
    }

    /// The first `columns` warps and `rows` wefts.
    #[must_use]
    pub fn cropped(&self, columns: usize, rows: usize) -> Self {
        Self::from_fn(columns, rows, |i, j| self.over(i, j))
    }

    /// The fewest columns after which the draft repeats, where `same` says whether two warps are alike in everything else.
    pub fn column_period(&self, same: impl Fn(usize, usize) -> bool) -> usize {
        smallest_period(self.columns, |a, b| same(a, b) && (0..self.rows).all(|j| self.over(a, j) == self.over(b, j)))
    }

    /// The fewest rows after which the draft repeats, where `same` says whether two wefts are alike in everything else.
    pub fn row_period(&self, same: impl Fn(usize, usize) -> bool) -> usize {
        smallest_period(self.rows, |a, b| same(a, b) && (0..self.columns).all(|i| self.over(i, a) == self.over(i, b)))
    }

    /// Warps, then wefts, that never change sides: nothing holds them.
    pub fn loose(&self) -> (usize, usize) {
        let warps = (0..self.columns).filter(|&i| (1..self.rows).all(|j| self.over(i, j) == self.over(i, 0))).count();
        let wefts = (0..self.rows).filter(|&j| (1..self.columns).all(|i| self.over(i, j) == self.over(0, j))).count();
        (warps, wefts)
    }
}

/// The smallest divisor of `n` by which the sequence repeats.
fn smallest_period(n: usize, same: impl Fn(usize, usize) -> bool) -> usize {
    (1..n).filter(|p| n.is_multiple_of(*p)).find(|&p| (p..n).all(|k| same(k, k - p))).unwrap_or(n)
}

/// Greatest common divisor.
pub(super) fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(draft: &Draft) -> Vec<String> {
        draft.warp_over.chunks(draft.columns).map(|row| row.iter().map(|&o| if o { '1' } else { '0' }).collect()).collect()
    }

    #[test]
    fn plain_twill_and_satin_are_the_known_drafts() {
        assert_eq!(rows(&Draft::shifted(1, 1, 1)), ["10", "01"]);
        assert_eq!(rows(&Draft::shifted(2, 2, 1)), ["1100", "0110", "0011", "1001"]);
        assert_eq!(rows(&Draft::shifted(1, 4, 2)), ["10000", "00100", "00001", "01000", "00010"]);
        assert_eq!(rows(&Draft::shifted(2, 2, 2)), ["1100", "0011"]);
    }

    #[test]
    fn a_repeated_draft_is_cut_to_one_repeat_unless_threads_differ() {
        let twill = Draft::shifted(2, 1, 1);
        let big = Draft::from_fn(12, 9, |i, j| twill.over(i % 3, j % 3));
        assert_eq!((big.column_period(|_, _| true), big.row_period(|_, _| true)), (3, 3));
        assert_eq!(big.cropped(3, 3), twill);
        assert_eq!(big.column_period(|a, b| a % 6 == b % 6), 6, "colours repeat every 6");
    }

    #[test]
    fn threads_that_never_change_sides_are_counted() {
        assert_eq!(Draft::shifted(1, 1, 1).loose(), (0, 0));
        assert_eq!(Draft::from_fn(3, 2, |i, _| i == 1).loose(), (3, 0));
    }
}
