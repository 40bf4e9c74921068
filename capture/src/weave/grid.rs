//! Threads on a lattice: which vectors of the lattice count warps and wefts, and after how many threads the cloth repeats.

use super::lattice::Lattice;
use glam::DVec2;

/// Threads counted along two directions, and the lattice of shifts after which the cloth is the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grid {
    /// Warps per pixel: a point `x` lies at warp `u . x`.
    pub u: DVec2,
    /// Wefts per pixel.
    pub v: DVec2,
    /// Whole coordinates of `u` and `v` on the lattice.
    pub whole: [[i64; 2]; 2],
    /// Shifts after which the cloth is the same.
    pub repeat: Repeat,
}

/// A lattice of whole shifts of threads in Hermite's normal form: `(columns, 0)` and `(shift, rows)` generate it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Repeat {
    /// Warps after which every weft repeats.
    pub columns: i64,
    /// Warps by which the cloth is moved after `rows` wefts.
    pub shift: i64,
    /// Wefts.
    pub rows: i64,
}

/// Most different crossings of a repeat.
pub(super) const MAX_CROSSINGS: i64 = 144;
/// A cloth's warp and weft may deviate from a right angle by this much, in degrees.
const MAX_SKEW_DEG: f64 = 7.0;
/// Spread of the edges' direction about the threads', in degrees.
const EDGE_SPREAD_DEG: f64 = 2.0;
/// Spread of the threads' direction about the picture's axes, in degrees.
const TURN_SPREAD_DEG: f64 = 6.0;
/// Threads of fewer pixels are taken for threads only if little else is left.
const FEW_PIXELS: f64 = 8.0;
/// Threads of the two directions differ in pitch by at most this factor, and seldom by more than the second.
const MAX_ASPECT: f64 = 8.0;
const USUAL_ASPECT: f64 = 3.0;

impl Repeat {
    /// Different crossings.
    pub fn crossings(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// Place of a crossing among the different ones.
    pub fn place(&self, i: i64, j: i64) -> usize {
        let times = j.div_euclid(self.rows);
        let column = (i - times * self.shift).rem_euclid(self.columns);
        ((j - times * self.rows) * self.columns + column) as usize
    }

    /// Wefts after which every warp repeats.
    pub fn tall(&self) -> i64 {
        let gcd = |mut a: i64, mut b: i64| {
            while b != 0 {
                (a, b) = (b, a % b);
            }
            a
        };
        self.rows * (self.columns / gcd(self.columns, self.shift.rem_euclid(self.columns)).max(1))
    }
}

impl Grid {
    /// Threads counted by the lattice vectors with these whole coordinates; nothing if there are too many crossings.
    pub fn new(lattice: &Lattice, whole: [[i64; 2]; 2]) -> Option<Self> {
        let [[m1, n1], [m2, n2]] = whole;
        let count = m1 * n2 - m2 * n1;
        if count <= 0 || count > MAX_CROSSINGS {
            return None;
        }
        // b1 = (n2 u - n1 v) / count, b2 = (-m2 u + m1 v) / count: a shift (i, j) is one of the repeat's where both are whole.
        let same = |i: i64, j: i64| (n2 * i - n1 * j).rem_euclid(count) == 0 && (m1 * j - m2 * i).rem_euclid(count) == 0;
        let columns = (1..=count).find(|&i| same(i, 0))?;
        let rows = count / columns;
        let shift = (0..columns).find(|&i| same(i, rows))?;
        let at = |[m, n]: [i64; 2]| lattice.at(m as f64, n as f64);
        Some(Self { u: at(whole[0]), v: at(whole[1]), whole, repeat: Repeat { columns, shift, rows } })
    }

    /// The same with `mx` times as many warps and `my` times as many wefts.
    pub fn finer(&self, lattice: &Lattice, mx: i64, my: i64) -> Option<Self> {
        let [a, b] = self.whole;
        Self::new(lattice, [a.map(|k| k * mx), b.map(|k| k * my)])
    }

    /// A plain cloth on the same threads, of a lattice that has one crossing only: warp and weft of one colour under light along the diagonal look alike.
    pub fn as_plain(self) -> Self {
        Self { repeat: Repeat { columns: 2, shift: 1, rows: 1 }, ..self }
    }

    /// Whether the lattice itself has one crossing only, as in [`Grid::as_plain`].
    pub fn whole_is_one_crossing(&self) -> bool {
        let [[m1, n1], [m2, n2]] = self.whole;
        m1 * n2 - m2 * n1 == 1
    }

    /// Pixels from thread to thread, measured across the threads: warp, weft.
    pub fn pitch(&self) -> DVec2 {
        DVec2::new(1.0 / self.u.length(), 1.0 / self.v.length())
    }

    /// Counter-clockwise turns of the warp's and the weft's normal from x and y, in radians.
    pub fn turns(&self) -> [f64; 2] {
        [self.u.y.atan2(self.u.x), (-self.v.x).atan2(self.v.y)]
    }

    /// All ways to count threads by a lattice of two vectors, each with its cost, cheapest first.
    ///
    /// `max_turn` bounds the turn of both from the picture's axes; `turn` is that of most edges (radians).
    pub fn candidates(lattice: &Lattice, turn: f64, max_turn: f64) -> Vec<(f64, Self)> {
        if lattice.basis.len() < 2 {
            return Vec::new();
        }
        let mut along_x: Vec<([i64; 2], f64)> = Vec::new();
        let mut along_y: Vec<([i64; 2], f64)> = Vec::new();
        const REACH: i64 = 24;
        for m in -REACH..=REACH {
            for n in -REACH..=REACH {
                if gcd(m, n) != 1 {
                    continue;
                }
                let f = lattice.at(m as f64, n as f64);
                // Threads finer than two pixels cannot be told from coarser ones.
                if f.length() > 0.5 {
                    continue;
                }
                let near = |angle: f64| angle.abs() <= max_turn;
                let (ax, ay) = (f.y.atan2(f.x), (-f.x).atan2(f.y));
                if near(ax) {
                    along_x.push(([m, n], ax));
                }
                if near(ay) {
                    along_y.push(([m, n], ay));
                }
            }
        }
        let mut found: Vec<(f64, Self)> = Vec::new();
        for &(a, ax) in &along_x {
            for &(b, ay) in &along_y {
                if (ax - ay).abs() > MAX_SKEW_DEG.to_radians() {
                    continue;
                }
                let Some(grid) = Self::new(lattice, [a, b]) else { continue };
                let pitch = grid.pitch();
                let aspect = pitch.max_element() / pitch.min_element();
                if aspect > MAX_ASPECT {
                    continue;
                }
                // Threads lie along most edges; where they are too fine for edges, about along the picture. Many crossings cost,
                // since any direction can be reached with many; so do threads of few pixels, which are told from others by little,
                // and threads of unlike pitch.
                let middle = (0.5 * (ax + ay)).to_degrees();
                let off = (middle - turn.to_degrees()) / EDGE_SPREAD_DEG;
                let tilt = middle / TURN_SPREAD_DEG;
                let skew = (ax - ay).to_degrees() / EDGE_SPREAD_DEG;
                let cost = (off * off).min(4.0 + tilt * tilt)
                    + skew * skew
                    + 2.0 * (grid.repeat.crossings() as f64).ln()
                    + 2.0 * (FEW_PIXELS / pitch.min_element()).ln().max(0.0)
                    + 3.0 * (aspect / USUAL_ASPECT).ln().max(0.0);
                found.push((cost, grid));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }
}

pub(super) fn gcd(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}
