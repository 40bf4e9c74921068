//! Shapes as cells of a grid, and where one has place among others: all places of a row at once, as bits of words.

use super::turns::turned;
use glam::DVec2;

/// Size of a cell, mm. Chosen, not measured: a finer one packs closer and takes longer.
pub(super) const CELL: f64 = 1.0;

/// Rows of bits.
#[derive(Clone, Debug, Default)]
pub(super) struct Bits {
    pub(super) words: usize,
    pub(super) rows: Vec<u64>,
}

impl Bits {
    fn row(&self, y: usize) -> &[u64] {
        self.rows.get(y * self.words..(y + 1) * self.words).unwrap_or(&[])
    }

    fn set(&mut self, y: usize, from: usize, to: usize) {
        for x in from..to {
            self.rows[y * self.words + x / 64] |= 1 << (x % 64);
        }
    }
}

/// Cells of a shape: for each row its runs, from and to, in cells from the lower left corner of the shape's box less [`Shape::border`].
#[derive(Clone, Debug)]
pub(super) struct Shape {
    runs: Vec<Vec<[usize; 2]>>,
    /// Cells that the shape reaches beyond its box on each side.
    pub(super) border: usize,
    /// How many cells it takes.
    pub(super) cells: usize,
    /// Rows with the longest runs first: they find soonest that there is no place.
    order: Vec<usize>,
}

/// Half of the diagonal of a cell: how far a point is from the middle of its cell at most.
const HALF_DIAGONAL: f64 = CELL * std::f64::consts::FRAC_1_SQRT_2;

impl Shape {
    /// The cells whose middles lie in a closed outline turned by `x` and shifted by `-low`, or so near to it that two shapes which share no
    /// cell are at least `gap` apart: any point between two nearer ones lies in a cell of both.
    pub(super) fn new(outline: &[DVec2], x: DVec2, low: DVec2, size: DVec2, gap: f64) -> Self {
        let reach = 0.5 * gap + HALF_DIAGONAL;
        let border = (reach / CELL).ceil() as usize;
        let [w, h] = [size.x, size.y].map(|s| (s / CELL).ceil() as usize + 2 * border);
        let shift = DVec2::splat(border as f64 * CELL) - low;
        let points: Vec<DVec2> = outline.iter().map(|p| turned(*p, x) + shift).collect();
        let mut bits = Bits { words: w.div_ceil(64), rows: vec![0; w.div_ceil(64) * h] };
        // The first cell whose middle lies at or after a coordinate.
        let cell = |v: f64| (v / CELL - 0.5).ceil().max(0.0) as usize;
        let mut crossings: Vec<Vec<f64>> = vec![Vec::new(); h];
        let n = points.len();
        for k in 0..n {
            let (a, b) = (points[k], points[(k + 1) % n]);
            let [first, last] = [a.y.min(b.y), a.y.max(b.y)].map(|y| cell(y).min(h));
            for (y, list) in crossings.iter_mut().enumerate().take(last).skip(first) {
                let middle = (y as f64 + 0.5) * CELL;
                list.push(a.x + (middle - a.y) / (b.y - a.y) * (b.x - a.x));
            }
            for y in cell(a.y.min(b.y) - reach)..cell(a.y.max(b.y) + reach).min(h) {
                if let Some([from, to]) = near(a, b, (y as f64 + 0.5) * CELL, reach) {
                    bits.set(y, cell(from).min(w), (cell(to) + 1).min(w));
                }
            }
        }
        for (y, list) in crossings.iter_mut().enumerate() {
            list.sort_by(f64::total_cmp);
            for pair in list.chunks_exact(2) {
                bits.set(y, cell(pair[0]).min(w), cell(pair[1]).min(w));
            }
        }
        Self::of_bits(&bits, w, h, border)
    }

    fn of_bits(bits: &Bits, w: usize, h: usize, border: usize) -> Self {
        let mut runs = vec![Vec::new(); h];
        let mut cells = 0;
        for (y, list) in runs.iter_mut().enumerate() {
            let row = bits.row(y);
            let on = |x: usize| x < w && row[x / 64] >> (x % 64) & 1 == 1;
            let mut x = 0;
            while x < w {
                let from = x;
                while on(x) {
                    x += 1;
                }
                if x > from {
                    list.push([from, x]);
                    cells += x - from;
                }
                x += 1;
            }
        }
        let longest = |y: &usize| runs[*y].iter().map(|[from, to]| to - from).max().unwrap_or(0);
        let mut order: Vec<usize> = (0..h).filter(|&y| !runs[y].is_empty()).collect();
        order.sort_by_key(|y| (std::cmp::Reverse(longest(y)), *y));
        Self { runs, border, cells, order }
    }

    /// Marks the shape's cells as taken, its lowest left cell at a place; rows are added as needed.
    pub(super) fn take(&self, taken: &mut Bits, [x, y]: [usize; 2]) {
        let rows = (y + self.runs.len()) * taken.words;
        if taken.rows.len() < rows {
            taken.rows.resize(rows, 0);
        }
        for (dy, runs) in self.runs.iter().enumerate() {
            for [from, to] in runs {
                taken.set(y + dy, x + from, x + to);
            }
        }
    }

    /// The leftmost place of the lowest row where no cell is taken, for the shape's lowest left cell in columns up to `most[0]` and rows up
    /// to `most[1]`.
    pub(super) fn place(&self, taken: &Bits, most: [usize; 2]) -> Option<[usize; 2]> {
        let words = most[0] / 64 + 1;
        let beyond = !0_u64 << 1 << (most[0] % 64);
        let mut blocked = vec![0; words];
        let mut smeared = vec![0; taken.words];
        (0..=most[1]).find_map(|y| {
            blocked.fill(0);
            blocked[words - 1] = beyond;
            for &dy in &self.order {
                let row = taken.row(y + dy);
                if row.iter().all(|&w| w == 0) {
                    continue;
                }
                for &[from, to] in &self.runs[dy] {
                    smear(row, to - from, &mut smeared);
                    for (k, word) in blocked.iter_mut().enumerate() {
                        *word |= shifted(&smeared, k, from);
                    }
                }
                if blocked.iter().all(|&w| w == !0) {
                    return None;
                }
            }
            blocked.iter().position(|&w| w != !0).map(|k| [64 * k + blocked[k].trailing_ones() as usize, y])
        })
    }
}

/// Word `k` of bits shifted down by `by`.
fn shifted(bits: &[u64], k: usize, by: usize) -> u64 {
    let (word, bit) = (k + by / 64, by % 64);
    let at = |j: usize| bits.get(j).copied().unwrap_or(0);
    if bit == 0 { at(word) } else { at(word) >> bit | at(word + 1) << (64 - bit) }
}

/// Sets each bit that has a set bit among the `length` from it on.
fn smear(row: &[u64], length: usize, out: &mut [u64]) {
    out.copy_from_slice(row);
    let mut done = 1;
    while done < length {
        let step = done.min(length - done);
        for k in 0..out.len() {
            // Upwards: the words that are read are not yet changed.
            out[k] |= shifted(out, k, step);
        }
        done += step;
    }
}

/// The coordinates along a row at height `y` within `reach` of a segment.
fn near(a: DVec2, b: DVec2, y: f64, reach: f64) -> Option<[f64; 2]> {
    let mut span = [f64::INFINITY, f64::NEG_INFINITY];
    let mut add = |x: f64| span = [span[0].min(x), span[1].max(x)];
    for p in [a, b] {
        let dy = y - p.y;
        if dy.abs() <= reach {
            let dx = (reach * reach - dy * dy).sqrt();
            add(p.x - dx);
            add(p.x + dx);
        }
    }
    // The rectangle along the segment; the points of each of its sides at that height.
    let side = (b - a).normalize_or_zero().perp() * reach;
    let corners = [a - side, b - side, b + side, a + side];
    for k in 0..4 {
        let (p, q) = (corners[k], corners[(k + 1) % 4]);
        if (p.y <= y) != (q.y <= y) {
            add(p.x + (y - p.y) / (q.y - p.y) * (q.x - p.x));
        }
    }
    (span[0] <= span[1]).then_some(span)
}
