//! What a cloth of a given draft and shape looks like, up to how its threads reflect: the reference a folded repeat is compared with.
//!
//! Threads are those of `biscale::geometry::weave`: sections are upright ellipses, centre lines go from crossing to crossing by a
//! cosine. Of each bin it is known which thread is on top, and the normal there. What light and threads make of it is not known, so for
//! each of warp and weft the colour is fitted by least squares as a polynomial
//!
//! ```text
//! c0 + c1 nx + c2 ny + c3 nx^2 + c4 ny^2 + c5 z + c6 z^2
//! ```
//!
//! of the normal and the height: exact for Lambert's law under any number of lights, and near enough for highlights and for light that
//! does not reach the depth. What lies between the threads is one colour. The residual tells one draft from another.

use super::fold::Fold;
use super::grid::Repeat;

/// Regressors of a thread.
const TERMS: usize = 7;

/// What bounds the model where it is singular.
struct ModelParams {
    /// Least `sqrt(1 - e^2)` in the slope across a thread, `-flatness e / sqrt(1 - e^2)`, which is infinite at the edge. Chosen: it bounds the outermost 2 % of
    /// a thread's half width, less than a pixel.
    least_root: f64,
    /// Share of a regressor's square that others must leave of it. Chosen: with less the coefficient is rounding, since sums are over values of single
    /// precision.
    determined: f64,
    /// Mean square of a regressor below which it is not there.
    present: f64,
}

const PARAMS: ModelParams = ModelParams { least_root: 0.2, determined: 1e-6, present: 1e-9 };

/// Sum of squared deviations below which a fold has no variation; keeps a division from 0.
const NO_VARIATION: f64 = 1e-12;
/// Entries of a [`Table`] a crossing: its own label and those of its four neighbours.
const NEIGHBOURHOODS: usize = 1 << AROUND.len();

/// Shape of the cloth; thread widths are shares of the pitch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ClothShape {
    /// Thread coordinates of the middle of warp 0 and weft 0.
    pub middle: [f64; 2],
    /// Widths of warp and weft over their pitch.
    pub fill: [f64; 2],
    /// Height of a section over its width, both directions.
    pub flatness: f64,
    /// Amplitude of the centre lines over the mean height of the sections.
    pub bend: f64,
    /// Aspect: pitch of the weft over that of the warp.
    pub aspect: f64,
}

/// How well a draft and a shape explain a fold.
#[derive(Clone, Debug)]
pub(super) struct ModelFit {
    /// Sum of squared residuals over the sum of squared deviations from the mean.
    pub residual: f64,
    /// Shares of the area where warp, weft and neither are on top.
    pub shares: [f64; 3],
}

/// What is on top in a bin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Top {
    /// 0 warp, 1 weft, 2 neither.
    pub what: usize,
    /// Place across the thread, -1 to 1.
    pub off: f64,
    /// Regressors of a thread.
    pub terms: [f64; TERMS],
}

impl ClothShape {
    /// What is on top at a place relative to the nearest crossing, in threads, each coordinate -0.5 to 0.5; `bits` are the labels of
    /// the crossing and its neighbours as in [`around`].
    fn top(&self, ds: f64, dt: f64, bits: usize) -> Top {
        let widths = [self.fill[0], self.fill[1] * self.aspect];
        let heights = widths.map(|w| w * self.flatness);
        let amplitude = 0.25 * (heights[0] + heights[1]) * self.bend;
        // Height, slopes across and along, and place across of the thread of a direction.
        let surface = |direction: usize, across: f64, along: f64| -> Option<[f64; 4]> {
            let pitch = [1.0, self.aspect];
            let off = across * pitch[direction] / (0.5 * widths[direction]);
            if off.abs() >= 1.0 {
                return None;
            }
            let neighbour = [[4, 3], [2, 1]][direction][usize::from(along < 0.0)];
            let side = |bit: usize| if (bits >> bit & 1 == 1) == (direction == 0) { amplitude } else { -amplitude };
            let (here, there) = (side(0), side(neighbour));
            let (mut z, mut slope) = (here, 0.0);
            if here != there {
                // 3 x^2 - 2 x^3 for (1 - cos(pi x)) / 2, and its derivative: they differ by at most 0.01.
                let x = along.abs();
                z = here * (1.0 - 2.0 * x * x * (3.0 - 2.0 * x));
                slope = -12.0 * here * x * (1.0 - x) * along.signum() / pitch[1 - direction];
            }
            let root = (1.0 - off * off).sqrt();
            z += 0.5 * heights[direction] * root;
            // Near its edge a section stands upright; the slope is bounded where a pixel could not resolve it.
            let across_slope = -self.flatness * off / root.max(PARAMS.least_root);
            Some([z, across_slope, slope, off])
        };
        let (what, [z, across, along, off]) = match (surface(0, ds, dt), surface(1, dt, ds)) {
            (Some(a), Some(b)) if a[0] >= b[0] => (0, a),
            (Some(a), None) => (0, a),
            (_, Some(b)) => (1, b),
            (None, None) => return Top { what: 2, off: 0.0, terms: [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0] },
        };
        let (zx, zy) = if what == 0 { (across, along) } else { (along, across) };
        let scale = 1.0 / (1.0 + zx * zx + zy * zy).sqrt();
        let (nx, ny) = (-zx * scale, -zy * scale);
        let z = z / (amplitude + 0.25 * (heights[0] + heights[1])).max(1e-9);
        Top { what, off, terms: [1.0, nx, ny, nx * nx, ny * ny, z, z * z] }
    }

    /// The nearest crossing of thread coordinates, and the place relative to it.
    fn nearest(&self, s: f64, t: f64) -> (i64, i64, f64, f64) {
        let (s, t) = (s - self.middle[0], t - self.middle[1]);
        let (i, j) = (s.round(), t.round());
        (i as i64, j as i64, s - i, t - j)
    }

    /// What is on top in every bin of a fold.
    pub fn tops<'a>(&'a self, fold: &'a Fold, labels: &'a [bool]) -> impl Iterator<Item = Top> + 'a {
        let repeat = fold.repeat;
        let bits = around(repeat, labels);
        (0..fold.colour.len()).map(move |bin| {
            let (s, t) = place(fold, bin);
            let (i, j, ds, dt) = self.nearest(s, t);
            self.top(ds, dt, bits[repeat.place(i, j)])
        })
    }

    /// How well this shape with these labels explains a fold.
    pub fn fit(&self, fold: &Fold, labels: &[bool]) -> ModelFit {
        let mut blocks = [Block::default(), Block::default(), Block::default()];
        for ((top, colour), &count) in self.tops(fold, labels).zip(&fold.colour).zip(&fold.count) {
            if count > 0.0 {
                blocks[top.what].add(&top.terms, colour.map(f64::from), f64::from(count));
            }
        }
        fit_of(&blocks)
    }
}

/// Points that a blurred bin is the mean of.
const POINTS: f64 = 9.0;
/// Regressors of both threads and of what lies between.
const ALL: usize = 2 * TERMS + 1;

impl ClothShape {
    /// How well this shape explains a fold that a lens and its pixels have blurred: standard deviations in threads along x and y.
    ///
    /// Each bin is the mean of 3 x 3 points, which spread like the blur.
    pub fn fit_blurred(&self, fold: &Fold, labels: &[bool], blur: [f64; 2]) -> f64 {
        let repeat = fold.repeat;
        // Three points at -d, 0 and d have variance 2 d^2 / 3.
        let reach = blur.map(|b| b * 1.5_f64.sqrt());
        let bits = around(repeat, labels);
        let mut matrix = [[0.0; ALL]; ALL];
        let mut rhs = [[0.0; 3]; ALL];
        let (mut squares, mut weight, mut mean) = (0.0, 0.0, [0.0; 3]);
        for (bin, (&colour, &count)) in fold.colour.iter().zip(&fold.count).enumerate() {
            if count <= 0.0 {
                continue;
            }
            let (s, t) = place(fold, bin);
            let mut terms = [0.0; ALL];
            for point in 0..3 * 3 {
                let (dx, dy) = (f64::from(point % 3 - 1) * reach[0], f64::from(point / 3 - 1) * reach[1]);
                let (i, j, ds, dt) = self.nearest(s + dx, t + dy);
                let top = self.top(ds, dt, bits[repeat.place(i, j)]);
                if top.what == 2 {
                    terms[ALL - 1] += 1.0 / POINTS;
                } else {
                    (0..TERMS).for_each(|k| terms[top.what * TERMS + k] += top.terms[k] / POINTS);
                }
            }
            let n = f64::from(count);
            for a in 0..ALL {
                if terms[a] == 0.0 {
                    continue;
                }
                let scaled = terms[a] * n;
                for b in 0..=a {
                    matrix[a][b] += scaled * terms[b];
                }
                (0..3).for_each(|c| rhs[a][c] += scaled * f64::from(colour[c]));
            }
            squares += n * colour.iter().map(|&v| f64::from(v) * f64::from(v)).sum::<f64>();
            (0..3).for_each(|c| mean[c] += n * f64::from(colour[c]));
            weight += n;
        }
        let deviation = squares - mean.iter().map(|m| m * m).sum::<f64>() / weight;
        left_over(&matrix, &rhs, squares, weight, ALL) / deviation.max(NO_VARIATION)
    }
}

/// What each crossing of a fold adds to the normal equations, for each way its own and its four neighbours' labels can be: with it a
/// draft is rated by adding up, without looking at the fold again.
pub(super) struct Table {
    repeat: Repeat,
    /// [`NEIGHBOURHOODS`] entries a crossing, by the bits of the labels: its own, left, right, below, above.
    entries: Vec<[Block; 3]>,
}

/// The crossing itself and its neighbours, in the order of the bits of a [`Table`].
const AROUND: [(i64, i64); 5] = [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)];

impl Table {
    /// The table of one shape.
    pub fn new(shape: &ClothShape, fold: &Fold) -> Self {
        let repeat = fold.repeat;
        let mut entries = vec![<[Block; 3]>::default(); NEIGHBOURHOODS * repeat.crossings()];
        for (bin, (&colour, &count)) in fold.colour.iter().zip(&fold.count).enumerate() {
            if count <= 0.0 {
                continue;
            }
            let (s, t) = place(fold, bin);
            let (i, j, ds, dt) = shape.nearest(s, t);
            let first = NEIGHBOURHOODS * repeat.place(i, j);
            for labels in 0..NEIGHBOURHOODS {
                let top = shape.top(ds, dt, labels);
                entries[first + labels][top.what].add(&top.terms, colour.map(f64::from), f64::from(count));
            }
        }
        Self { repeat, entries }
    }

    /// The residual that labels leave.
    pub fn residual(&self, labels: &[bool]) -> f64 {
        let mut blocks = <[Block; 3]>::default();
        for (crossing, bits) in around(self.repeat, labels).into_iter().enumerate() {
            let entry = &self.entries[NEIGHBOURHOODS * crossing + bits];
            blocks.iter_mut().zip(entry).for_each(|(b, e)| b.merge(e));
        }
        fit_of(&blocks).residual
    }
}

/// For each different crossing the labels of itself, left, right, below, above, as bits from the lowest.
fn around(repeat: Repeat, labels: &[bool]) -> Vec<usize> {
    let bits = |crossing: usize| {
        let (i, j) = (crossing as i64 % repeat.columns, crossing as i64 / repeat.columns);
        let bit = |(bit, &(di, dj)): (usize, &(i64, i64))| usize::from(labels[repeat.place(i + di, j + dj)]) << bit;
        AROUND.iter().enumerate().map(bit).sum()
    };
    (0..labels.len()).map(bits).collect()
}

/// Thread coordinates of the middle of a bin.
fn place(fold: &Fold, bin: usize) -> (f64, f64) {
    let (bx, by, crossing) = (bin % fold.kx, bin / fold.kx % fold.ky, bin / (fold.kx * fold.ky));
    let (i, j) = (crossing as i64 % fold.repeat.columns, crossing as i64 / fold.repeat.columns);
    (i as f64 + (bx as f64 + 0.5) / fold.kx as f64, j as f64 + (by as f64 + 0.5) / fold.ky as f64)
}

fn fit_of(blocks: &[Block; 3]) -> ModelFit {
    let total: f64 = blocks.iter().map(|b| b.weight).sum();
    let mean = [0, 1, 2].map(|c| blocks.iter().map(|b| b.rhs[0][c]).sum::<f64>() / total);
    let squares: f64 = blocks.iter().map(|b| b.squares).sum();
    let deviation = squares - total * mean.iter().map(|m| m * m).sum::<f64>();
    let left: f64 = blocks.iter().enumerate().map(|(k, b)| b.residual(if k == 2 { 1 } else { TERMS })).sum();
    ModelFit { residual: (left / deviation.max(NO_VARIATION)).max(0.0), shares: [0, 1, 2].map(|k| blocks[k].weight / total) }
}

/// Normal equations of one part: warp, weft, or what lies between.
#[derive(Clone, Debug, Default)]
struct Block {
    matrix: [[f64; TERMS]; TERMS],
    rhs: [[f64; 3]; TERMS],
    squares: f64,
    weight: f64,
}

impl Block {
    fn add(&mut self, terms: &[f64; TERMS], colour: [f64; 3], weight: f64) {
        for a in 0..TERMS {
            let scaled = terms[a] * weight;
            for b in 0..=a {
                self.matrix[a][b] += scaled * terms[b];
            }
            for c in 0..3 {
                self.rhs[a][c] += scaled * colour[c];
            }
        }
        self.squares += weight * colour.iter().map(|v| v * v).sum::<f64>();
        self.weight += weight;
    }

    fn merge(&mut self, other: &Self) {
        for a in 0..TERMS {
            for b in 0..=a {
                self.matrix[a][b] += other.matrix[a][b];
            }
            (0..3).for_each(|c| self.rhs[a][c] += other.rhs[a][c]);
        }
        self.squares += other.squares;
        self.weight += other.weight;
    }

    /// Sum of squares that the first `terms` regressors leave.
    fn residual(&self, terms: usize) -> f64 {
        if self.weight <= 0.0 {
            return 0.0;
        }
        left_over(&self.matrix, &self.rhs, self.squares, self.weight, terms)
    }
}

/// Sum of squares that the first `terms` regressors leave, by Cholesky's decomposition of their normal equations; a regressor that others
/// determine is left out.
fn left_over<const N: usize>(matrix: &[[f64; N]; N], rhs: &[[f64; 3]; N], squares: f64, weight: f64, terms: usize) -> f64 {
    let mut factor = [[0.0; N]; N];
    let mut explained = 0.0;
    let mut y = [[0.0; 3]; N];
    for a in 0..terms {
        for b in 0..a {
            let dot: f64 = (0..b).map(|k| factor[a][k] * factor[b][k]).sum();
            factor[a][b] = if factor[b][b] > 0.0 { (matrix[a][b] - dot) / factor[b][b] } else { 0.0 };
        }
        let rest = matrix[a][a] - (0..a).map(|k| factor[a][k] * factor[a][k]).sum::<f64>();
        if rest > PARAMS.determined * matrix[a][a] + PARAMS.present * weight {
            factor[a][a] = rest.sqrt();
            for c in 0..3 {
                let dot: f64 = (0..a).map(|k| factor[a][k] * y[k][c]).sum();
                y[a][c] = (rhs[a][c] - dot) / factor[a][a];
                explained += y[a][c] * y[a][c];
            }
        }
    }
    (squares - explained).max(0.0)
}
