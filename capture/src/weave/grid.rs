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

/// Which ways to count threads are looked at, and what each costs. Chosen on drawn cloths (see [`super`]).
struct GridParams {
    /// Most different crossings of a repeat.
    most_crossings: i64,
    /// Highest order of the lattice's basis that may count threads.
    reach: i64,
    /// Highest frequency of threads, in cycles per pixel: those finer than two pixels cannot be told from coarser ones.
    highest_frequency: f64,
    /// Deviation of warp and weft from a right angle, at most, in degrees.
    most_skew_deg: f64,
    /// Spread of the edges' direction about the threads', in degrees: one of it costs 1.
    edge_spread_deg: f64,
    /// Spread of the threads' direction about the picture's axes, in degrees: one of it costs 1, where edges say nothing.
    turn_spread_deg: f64,
    /// Cost at which edges that run elsewhere are taken to say nothing: two spreads.
    edges_ignored: f64,
    /// Pixels from thread to thread below which threads cost, ...
    few_pixels: f64,
    /// ... and the cost of a factor of e below that.
    few_pixels_cost: f64,
    /// Cost of a factor of e in the crossings of a repeat: any direction can be reached with many.
    crossings_cost: f64,
    /// Factor between the pitches of warp and weft, at most.
    most_aspect: f64,
    /// The factor above which unlike pitches cost, ...
    usual_aspect: f64,
    /// ... and the cost of a factor of e above that.
    aspect_cost: f64,
}

const PARAMS: GridParams = GridParams {
    most_crossings: 144,
    reach: 24,
    highest_frequency: 0.5,
    most_skew_deg: 7.0,
    edge_spread_deg: 2.0,
    turn_spread_deg: 6.0,
    edges_ignored: 4.0,
    few_pixels: 8.0,
    few_pixels_cost: 2.0,
    crossings_cost: 2.0,
    most_aspect: 8.0,
    usual_aspect: 3.0,
    aspect_cost: 3.0,
};

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
        self.rows * (self.columns / gcd(self.columns, self.shift.rem_euclid(self.columns)).max(1))
    }
}

impl Grid {
    /// Threads counted by the lattice vectors with these whole coordinates; nothing if there are too many crossings.
    pub fn new(lattice: &Lattice, whole: [[i64; 2]; 2]) -> Option<Self> {
        let [[m1, n1], [m2, n2]] = whole;
        let count = m1 * n2 - m2 * n1;
        if count <= 0 || count > PARAMS.most_crossings {
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
        for m in -PARAMS.reach..=PARAMS.reach {
            for n in -PARAMS.reach..=PARAMS.reach {
                if gcd(m, n) != 1 {
                    continue;
                }
                let f = lattice.at(m as f64, n as f64);
                if f.length() > PARAMS.highest_frequency {
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
                if (ax - ay).abs() > PARAMS.most_skew_deg.to_radians() {
                    continue;
                }
                let Some(grid) = Self::new(lattice, [a, b]) else { continue };
                let pitch = grid.pitch();
                let aspect = pitch.max_element() / pitch.min_element();
                if aspect > PARAMS.most_aspect {
                    continue;
                }
                let cost = counting_cost(&grid, [ax, ay], turn);
                found.push((cost, grid));
            }
        }
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }
}

/// Cost of a way to count threads whose normals are turned by `turns` from x and y, where most edges are turned by `turn` (radians).
///
/// Threads lie along most edges; where they are too fine for edges, about along the picture. Many crossings cost, since any direction can be reached with
/// many; so do threads of few pixels, which are told from others by little, and threads of unlike pitch.
fn counting_cost(grid: &Grid, [ax, ay]: [f64; 2], turn: f64) -> f64 {
    let pitch = grid.pitch();
    let aspect = pitch.max_element() / pitch.min_element();
    let middle = (0.5 * (ax + ay)).to_degrees();
    let off = (middle - turn.to_degrees()) / PARAMS.edge_spread_deg;
    let tilt = middle / PARAMS.turn_spread_deg;
    let skew = (ax - ay).to_degrees() / PARAMS.edge_spread_deg;
    (off * off).min(PARAMS.edges_ignored + tilt * tilt)
        + skew * skew
        + PARAMS.crossings_cost * (grid.repeat.crossings() as f64).ln()
        + PARAMS.few_pixels_cost * (PARAMS.few_pixels / pitch.min_element()).ln().max(0.0)
        + PARAMS.aspect_cost * (aspect / PARAMS.usual_aspect).ln().max(0.0)
}

/// Greatest common divisor; of 0 and a number that number.
pub(super) fn gcd(a: i64, b: i64) -> i64 {
    let (mut a, mut b) = (a.abs(), b.abs());
    while b != 0 {
        (a, b) = (b, a % b);
    }
    a
}
