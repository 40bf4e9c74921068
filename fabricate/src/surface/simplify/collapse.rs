//! Any surface with fewer facets: its least important edges shrink to points, one after another.
//!
//! What an edge costs is the sum of the squared distances of the new point from the planes that met at its ends, by area, and from planes
//! upright on the border there (Garland and Heckbert 1997, "Surface simplification using quadric error metrics"). An edge shrinks only if
//! the surface stays a surface of the same kind (the link condition of Dey, Edelsbrunner, Guha and Nekhayev 1999, "Topology preserving edge
//! contraction"), no triangle turns over, and none becomes a needle, which no person can fold. Libraries at hand do not promise the first:
//! meshoptimizer (issue 699) and Fast-Quadric-Mesh-Simplification (issue 41) may leave three facets at an edge.

use super::goal::Goal;
use super::quadric::Quadric;
use super::slopes::Slopes;
use crate::mesh::{Adjacency, Triangles, WELD_SHARE, close_t_junctions};
use biscale::error::BadInput;
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Weight of the planes upright on the border, of the squared length of its edge: the outline of the sheet is kept. Chosen, not measured;
/// Garland and Heckbert (1997, section 6) ask for a large one.
const BORDER: f64 = 30.0;

/// Cost of length, of the squared length times the area around: decides among edges of flat places, whose other cost is 0. Chosen, not
/// measured: small beside any real distance.
const LENGTH: f64 = 1e-6;

/// Cosine of the largest angle that one shrinking edge may turn a triangle by: 73 degrees. Chosen, not measured; at 0 and below triangles
/// turn over.
const TURN: f64 = 0.3;

/// Least shape of a triangle that one may leave where it was better before: 1 is equilateral, 0 a needle. Chosen, not
/// measured: needles cannot be folded, see [`crate::surface::TOO_NARROW`].
const SHAPE: f64 = 0.15;

/// A triangle below [`SHAPE`] may lose a tenth of its shape at once, and never become as thin as a needle. Chosen, not measured.
const WORSE: f64 = 0.9;
const NEEDLE: f64 = 1e-4;
/// Shape below which a triangle has no area and faces nowhere: rounding.
const NO_AREA: f64 = 1e-9;

/// `4 sqrt(3)` times the area over the sum of the squared sides.
fn shape([a, b, c]: [DVec3; 3]) -> f64 {
    let sides = a.distance_squared(b) + b.distance_squared(c) + c.distance_squared(a);
    2.0 * 3.0_f64.sqrt() * (b - a).cross(c - a).length() / sides.max(f64::MIN_POSITIVE)
}

/// An edge that waits to shrink, the cheapest first.
struct CollapseCandidate {
    cost: f64,
    ends: [u32; 2],
    stamps: [u32; 2],
    to: DVec3,
}

impl PartialEq for CollapseCandidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for CollapseCandidate {}
impl PartialOrd for CollapseCandidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for CollapseCandidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.ends.cmp(&self.ends)).then(other.stamps.cmp(&self.stamps))
    }
}

/// The surface while it shrinks.
#[derive(Clone)]
struct Shrinking {
    at: Vec<DVec3>,
    faces: Vec<Option<[u32; 3]>>,
    around: Vec<Vec<u32>>,
    forms: Vec<Quadric>,
    /// Changes with the corner: what waits with an older one is out of date.
    stamp: Vec<u32>,
    alive: usize,
}

impl Shrinking {
    fn new(soup: &Triangles) -> Self {
        let mut around = vec![Vec::new(); soup.vertices.len()];
        let mut forms = vec![Quadric::ZERO; soup.vertices.len()];
        let mut sides: FxHashMap<(u32, u32), (u32, DVec3)> = FxHashMap::default();
        for (t, k) in soup.triangles.iter().zip(0_u32..) {
            let [a, b, c] = t.map(|v| soup.vertices[v as usize]);
            let normal = (b - a).cross(c - a);
            let form = Quadric::plane(normal.normalize_or_zero(), a, normal.length() / 6.0);
            for (j, &v) in t.iter().enumerate() {
                around[v as usize].push(k);
                forms[v as usize] = forms[v as usize].plus(form);
                let w = t[(j + 1) % 3];
                sides.entry((v.min(w), v.max(w))).and_modify(|s| s.0 += 1).or_insert((1, normal.normalize_or_zero()));
            }
        }
        let mut borders: Vec<_> = sides.into_iter().filter(|(_, (n, _))| *n == 1).map(|(e, (_, n))| (e, n)).collect();
        borders.sort_unstable_by_key(|(e, _)| *e);
        for ((a, b), normal) in borders {
            let (p, q) = (soup.vertices[a as usize], soup.vertices[b as usize]);
            let upright = (q - p).cross(normal).normalize_or_zero();
            let form = Quadric::plane(upright, p, BORDER * p.distance_squared(q));
            for v in [a, b] {
                forms[v as usize] = forms[v as usize].plus(form);
            }
        }
        Self {
            at: soup.vertices.clone(),
            faces: soup.triangles.iter().copied().map(Some).collect(),
            around,
            forms,
            stamp: vec![0; soup.vertices.len()],
            alive: soup.triangles.len(),
        }
    }

    fn faces_at(&self, v: u32) -> impl Iterator<Item = (u32, [u32; 3])> + '_ {
        self.around[v as usize].iter().filter_map(|&k| self.faces[k as usize].map(|f| (k, f)))
    }

    /// Neighbours of a corner, each with the number of triangles at the edge to it.
    fn neighbours(&self, v: u32) -> Vec<(u32, u32)> {
        let mut out: Vec<(u32, u32)> = Vec::new();
        for (_, face) in self.faces_at(v) {
            for w in face.into_iter().filter(|w| *w != v) {
                match out.iter_mut().find(|(x, _)| *x == w) {
                    Some((_, n)) => *n += 1,
                    None => out.push((w, 1)),
                }
            }
        }
        out
    }

    fn candidate(&self, a: u32, b: u32) -> CollapseCandidate {
        let (p, q) = (self.at[a as usize], self.at[b as usize]);
        let form = self.forms[a as usize].plus(self.forms[b as usize]);
        // The lowest point may lie far off where the surface is nearly flat.
        let near = |x: &DVec3| x.is_finite() && x.distance(0.5 * (p + q)) <= 2.0 * p.distance(q);
        let choices = [Some(0.5 * (p + q)), Some(p), Some(q), form.least().filter(near)];
        let to = choices.into_iter().flatten().min_by(|x, y| form.at(*x).total_cmp(&form.at(*y))).expect("three at least");
        let weight = form.a.col(0).x + form.a.col(1).y + form.a.col(2).z;
        let cost = form.at(to) + LENGTH * weight * p.distance_squared(q);
        CollapseCandidate { cost, ends: [a.min(b), a.max(b)], stamps: [self.stamp[a.min(b) as usize], self.stamp[a.max(b) as usize]], to }
    }

    /// Whether the surface stays one of the same kind, without turned triangles and new needles.
    fn may_shrink(&self, [a, b]: [u32; 2], to: DVec3) -> bool {
        let (of_a, of_b) = (self.neighbours(a), self.neighbours(b));
        let at_edge = of_a.iter().find(|(v, _)| *v == b).map_or(0, |(_, n)| *n);
        let on_border = |list: &[(u32, u32)]| list.iter().any(|(_, n)| *n == 1);
        let common = of_a.iter().filter(|(v, _)| of_b.iter().any(|(w, _)| w == v)).count();
        if at_edge == 0 || common != at_edge as usize || (at_edge == 2 && on_border(&of_a) && on_border(&of_b)) {
            return false;
        }
        // A triangle that would come to lie on another one: two edges opposite of the ends are one.
        let opposite = |v: u32, other: u32| {
            let list = self.faces_at(v).filter(move |(_, f)| !f.contains(&other)).map(move |(_, f)| {
                let mut rest = f.into_iter().filter(|w| *w != v);
                let (x, y) = (rest.next().unwrap_or(v), rest.next().unwrap_or(v));
                [x.min(y), x.max(y)]
            });
            list.collect::<Vec<_>>()
        };
        let (over_a, over_b) = (opposite(a, b), opposite(b, a));
        if over_a.iter().any(|e| over_b.contains(e)) || over_a.is_empty() && over_b.is_empty() {
            return false;
        }
        [(a, b), (b, a)].into_iter().all(|(v, other)| {
            self.faces_at(v).filter(|(_, f)| !f.contains(&other)).all(|(_, f)| {
                let before = f.map(|w| self.at[w as usize]);
                let after = f.map(|w| if w == v { to } else { self.at[w as usize] });
                let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
                let better = shape(after);
                // One without area faces nowhere.
                (normal(before).dot(normal(after)) > TURN || shape(before) < NO_AREA)
                    && better >= SHAPE.min(WORSE * shape(before))
                    && better > NEEDLE
            })
        })
    }

    fn shrink(&mut self, [a, b]: [u32; 2], to: DVec3) {
        let moved: Vec<(u32, [u32; 3])> = self.faces_at(b).collect();
        for (k, face) in moved {
            if face.contains(&a) {
                self.faces[k as usize] = None;
                self.alive -= 1;
            } else {
                self.faces[k as usize] = Some(face.map(|v| if v == b { a } else { v }));
                self.around[a as usize].push(k);
            }
        }
        let faces = &self.faces;
        self.around[a as usize].retain(|&k| faces[k as usize].is_some());
        self.around[b as usize] = Vec::new();
        self.at[a as usize] = to;
        self.forms[a as usize] = self.forms[a as usize].plus(self.forms[b as usize]);
        self.stamp[a as usize] += 1;
        self.stamp[b as usize] += 1;
    }

    /// Shrinks edges until so many triangles are left, or no edge may.
    fn run(&mut self, wanted: usize) {
        let mut heap: BinaryHeap<CollapseCandidate> = BinaryHeap::new();
        for v in 0..u32::try_from(self.at.len()).expect("fewer than 2^32") {
            heap.extend(self.neighbours(v).into_iter().filter(|(w, _)| v < *w).map(|(w, _)| self.candidate(v, w)));
        }
        // Edges that may not shrink now may do so when something near has changed.
        while self.alive > wanted {
            let Some(next) = heap.pop() else { break };
            let [a, b] = next.ends;
            if next.stamps != [self.stamp[a as usize], self.stamp[b as usize]] || !self.may_shrink(next.ends, next.to) {
                continue;
            }
            self.shrink(next.ends, next.to);
            for (w, _) in self.neighbours(a) {
                heap.push(self.candidate(a, w));
                // What was refused two steps away may be allowed now.
                self.stamp[w as usize] += 1;
            }
            for (w, _) in self.neighbours(a) {
                heap.extend(self.neighbours(w).into_iter().map(|(x, _)| self.candidate(w, x)));
            }
        }
    }

    fn triangles(&self) -> Triangles {
        let mut place = vec![u32::MAX; self.at.len()];
        let mut out = Triangles::default();
        for face in self.faces.iter().flatten() {
            out.triangles.push(face.map(|v| {
                if place[v as usize] == u32::MAX {
                    place[v as usize] = u32::try_from(out.vertices.len()).expect("fewer than before");
                    out.vertices.push(self.at[v as usize]);
                }
                place[v as usize]
            }));
        }
        out
    }
}

/// Share of the triangles that is left from one look at the slopes to the next. Chosen, not measured: the last interval is halved anyway.
const LOOK: f64 = 0.8;

/// Halvings of the last interval: the number of facets is found to 20 % / 2^5 = .6 %.
const HALVINGS: u32 = 5;

/// The reduced surface and its slope error, radians. Its colours are all those of the first triangle.
pub fn reduce(soup: Triangles, goal: Goal) -> Result<(Triangles, f64), BadInput> {
    let size = soup.size();
    let colour = soup.colours.first().copied().unwrap_or([1.0; 3]);
    let soup = close_t_junctions(soup, WELD_SHARE * size);
    let corners: Vec<Vec<u32>> = soup.triangles.iter().map(|t| t.to_vec()).collect();
    Adjacency::new(&soup.vertices, &corners)?;
    let mut surface = Shrinking::new(&soup);
    let slopes = Slopes::new(&soup);
    let mut best = match goal.slope {
        None => {
            surface.run(goal.facets);
            surface.triangles()
        }
        Some(limit) => {
            let mut good = surface.clone();
            let mut bad = 0;
            loop {
                let before = surface.alive;
                surface.run((before as f64 * LOOK) as usize);
                if surface.alive == before {
                    break;
                }
                if slopes.error(&surface.triangles()) > limit {
                    bad = surface.alive;
                    break;
                }
                good = surface.clone();
            }
            for _ in 0..HALVINGS {
                let middle = usize::midpoint(good.alive, bad);
                if bad == 0 || good.alive <= bad + 2 {
                    break;
                }
                let mut tried = good.clone();
                tried.run(middle);
                if slopes.error(&tried.triangles()) > limit {
                    bad = tried.alive;
                } else if tried.alive < good.alive {
                    good = tried;
                } else {
                    break;
                }
            }
            // More facets than are wanted: what comes out tells that its slopes are too far off.
            good.run(goal.facets.max(good.alive.min(goal.facets)));
            good.triangles()
        }
    };
    best.colours = vec![colour; best.triangles.len()];
    let slope = slopes.error(&best);
    Ok((best, slope))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, Tolerance};

    /// A torus of `n` by `m` cells, radii 30 and 10.
    fn torus(n: u32, m: u32) -> Triangles {
        let mut vertices = Vec::new();
        for i in 0..n {
            for j in 0..m {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(m));
                let ((s, c), (t, d)) = ((u * std::f64::consts::TAU).sin_cos(), (v * std::f64::consts::TAU).sin_cos());
                let r = 30.0 + 10.0 * d;
                vertices.push(DVec3::new(r * c, r * s, 10.0 * t));
            }
        }
        let at = |i: u32, j: u32| (i % n) * m + j % m;
        let cells = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
        let triangles =
            cells.flat_map(|(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]).collect();
        Triangles::white(vertices, triangles)
    }

    fn mesh(soup: Triangles) -> Mesh {
        let tolerance = Tolerance::of_size(soup.size());
        Mesh::new(soup, tolerance).unwrap()
    }

    #[test]
    fn a_torus_stays_a_torus_down_to_a_few_facets() {
        for wanted in [1000, 300, 60] {
            let (out, slope) = reduce(torus(60, 24), Goal { facets: wanted, slope: None }).unwrap();
            let (v, f) = (out.vertices.len(), out.triangles.len());
            assert!(f <= wanted && f + 2 >= wanted, "{f}");
            // Closed: three edges for two triangles; Euler's characteristic of a torus is 0.
            assert_eq!(2 * v, f, "{v} corners and {f} triangles");
            let volume = out.volume();
            let exact = 2.0 * std::f64::consts::PI.powi(2) * 30.0 * 100.0;
            assert!(wanted < 100 || (volume / exact - 1.0).abs() < 0.06, "{wanted}: {volume} for {exact}");
            assert_eq!(mesh(out).border_loops(), 0);
            assert!(slope < 0.7, "{slope}");
        }
    }

    #[test]
    fn an_open_flat_sheet_keeps_its_outline_and_becomes_two_triangles() {
        let mut soup = Triangles::default();
        for j in 0..=10 {
            for i in 0..=10 {
                soup.vertices.push(DVec3::new(f64::from(i), f64::from(j), 0.0));
            }
        }
        for j in 0..10 {
            for i in 0..10 {
                let k = j * 11 + i;
                soup.triangles.extend([[k, k + 1, k + 12], [k, k + 12, k + 11]]);
            }
        }
        soup.colours = vec![[1.0; 3]; 200];
        let (out, slope) = reduce(soup, Goal { facets: 2, slope: None }).unwrap();
        assert_eq!(out.triangles.len(), 2);
        assert!(slope < 1e-7);
        let area: f64 = mesh(out).facets.iter().map(|f| crate::polygon::area(&f.flat)).sum();
        assert!((area - 100.0).abs() < 1e-9, "{area}");
    }

    #[test]
    fn a_slope_tolerance_takes_no_more_facets_than_it_needs() {
        let few = |degrees: f64| {
            let (out, slope) = reduce(torus(60, 24), Goal { facets: 20_000, slope: Some(degrees.to_radians()) }).unwrap();
            assert!(slope <= degrees.to_radians(), "{}", slope.to_degrees());
            out.triangles.len()
        };
        let (fine, coarse) = (few(5.0), few(15.0));
        assert!(fine < 2880 && coarse < fine / 2, "{fine} {coarse}");
    }

    #[test]
    fn three_facets_at_an_edge_are_refused() {
        let vertices = [[0., 0., 0.], [20., 0., 0.], [0., 20., 0.], [0., -20., 0.], [0., 0., 20.]].map(DVec3::from).to_vec();
        let soup = Triangles::white(vertices, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert!(reduce(soup, Goal { facets: 2, slope: None }).unwrap_err().to_string().contains("three facets"));
    }
}
