//! Facets: the points at which a small-scale surface is sampled.
//!
//! Sample `t` of an Owen-scrambled Sobol' sequence in two dimensions goes to the point of the surface that the first coordinate finds along
//! the cumulative area of the triangles in a coherent order, and, inside the triangle, along its longer side; the second coordinate
//! chooses the point across. Three properties of the sequence are used:
//!
//! - every aligned block of 2^k samples is stratified over the whole surface, so that more samples can be added to those
//!   already there, and errors fall faster than at random;
//! - the eight sub-blocks of a block are such samples themselves. They are the *sets* whose spread gives the standard error
//!   (`numerics.md`, section 3.6), and halves and quarters of them tell how fast the error falls;
//! - sorted along the first coordinate, the p-th samples of the eight sets lie in the same stretch of the surface. They are
//!   stored side by side: lane `l` of the sums belongs to set `l mod 8`, and neighbouring lanes see nearly the same.

pub mod common_random_numbers;
mod random;

pub use random::random;

use crate::clusters::{Cluster, clusters};
use crate::material::{SmallScale, Tint};
use crate::numerics::low_discrepancy::{fraction, sobol_2d};
use glam::{DVec2, DVec3, Vec3};
use rustc_hash::FxHashMap;
use std::cmp::Ordering;
use std::ops::Range;

/// Sets of facets whose spread gives the standard error.
pub const SETS: usize = 8;
/// The facets of one surface start at a multiple of this and are filled up to one: a word of visibility bits.
pub const ALIGNMENT: usize = 64;
/// Triangle of a facet that only fills up.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// A tile in units of its larger period, its triangles in a coherent order: what sampling and visibility work on.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Larger period, in the tile's units.
    pub unit: f64,
    /// Period in x and y; the larger is 1.
    pub period: DVec2,
    /// Positions.
    pub vertices: Vec<DVec3>,
    /// Triangles, sorted by surface, coarse normal and position.
    pub triangles: Vec<[u32; 3]>,
    /// Place of each triangle in the tile.
    pub tile_triangle: Vec<u32>,
    /// For each triangle the surface that covers it.
    pub surface: Vec<u16>,
    /// For each triangle its group.
    pub group: Vec<u32>,
    /// The groups that the triangles are sorted by.
    pub groups: Vec<Group>,
    /// Unit normals.
    pub normals: Vec<DVec3>,
    /// Areas.
    pub areas: Vec<f64>,
    /// Places of the triangles, those that reach highest first.
    pub top_down: Vec<u32>,
    /// A lattice point in x and y near the triangles, and their lowest z: positions from here keep their digits in f32.
    pub base: DVec3,
    /// Highest less lowest z.
    pub height: f64,
    /// Whether the surface has no boundary: each edge has its reverse, in this tile or the next.
    pub closed: bool,
}

/// Triangles whose facets are stored together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Group {
    /// What covers them.
    pub surface: u16,
    /// The cluster that they are, or `None` for all triangles of a surface.
    pub cluster: Option<Cluster>,
}

/// How triangles are clustered: the largest spread of slopes in a cluster of each surface, and the most clusters.
#[derive(Clone, Debug, PartialEq)]
pub struct Clustering {
    /// Standard deviation of slopes, one a surface.
    pub spread: Vec<f64>,
    /// Most clusters of all surfaces; if more are needed, there are none.
    pub most: usize,
}

/// Facets, structure of arrays. All arrays have the same length, a multiple of [`ALIGNMENT`].
#[derive(Clone, Debug, Default)]
pub struct Facets {
    /// Position, in units of the larger period.
    pub position: Vec<DVec3>,
    /// Place of the triangle in [`Surface::triangles`], or [`NO_TRIANGLE`].
    pub triangle: Vec<u32>,
    /// Components of the unit normal.
    pub normal: [Vec<f32>; 3],
    /// Area over the footprint `A` that the facet stands for, times the number of samples of its block; 0 where it only fills up.
    pub weight: Vec<f32>,
    /// How far along the surface's area the facet lies, in 0..1.
    pub along: Vec<f32>,
    /// Components of the tint, where a surface has an image of them.
    pub tint: Option<[Vec<f32>; 3]>,
    /// For each group its facets.
    pub ranges: Vec<Range<usize>>,
    /// Samples, without those that only fill up.
    pub samples: usize,
}

impl Surface {
    /// Scales and sorts the triangles of a tile, and clusters them by normal if that is wanted and takes few enough clusters.
    pub fn new(small: &SmallScale, clustering: Option<&Clustering>) -> Self {
        let tile = &small.tile;
        let unit = tile.period.max_element();
        let vertices: Vec<DVec3> = tile.vertices.iter().map(|v| *v / unit).collect();
        let normal_and_area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            let cross = (b - a).cross(c - a);
            let length = cross.length();
            (if length > 0.0 { cross / length } else { DVec3::ZERO }, 0.5 * length)
        };
        let low = vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let extent = (vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max) - low).max_element().max(f64::MIN_POSITIVE);
        let (normals, areas): (Vec<DVec3>, Vec<f64>) = tile.triangles.iter().map(normal_and_area).unzip();
        let found = clustering.and_then(|c| clusters(&normals, &areas, &small.surface_of_triangle, &c.spread, c.most));
        let (groups, group) = match found {
            Some((clusters, group)) => (clusters.into_iter().map(|c| Group { surface: c.surface, cluster: Some(c) }).collect(), group),
            None => {
                let groups = (0..).take(small.surfaces.len()).map(|surface| Group { surface, cluster: None }).collect();
                (groups, small.surface_of_triangle.iter().map(|&s| u32::from(s)).collect())
            }
        };
        let mut order: Vec<(u64, u32)> = (0_u32..)
            .zip(&tile.triangles)
            .map(|(i, t)| {
                let centre = (t.iter().map(|&v| vertices[v as usize]).sum::<DVec3>() / 3.0 - low) / extent;
                let key = u64::from(group[i as usize]) << 35 | u64::from(normal_bin(normals[i as usize])) << 30;
                (key | u64::from(morton(centre)), i)
            })
            .collect();
        order.sort_unstable();
        let sorted = |i: &(u64, u32)| tile.triangles[i.1 as usize];
        let triangles: Vec<[u32; 3]> = order.iter().map(sorted).collect();
        let top = |t: &[u32; 3]| t.iter().fold(f64::NEG_INFINITY, |top, &v| top.max(vertices[v as usize].z));
        let tops: Vec<f64> = triangles.iter().map(top).collect();
        let mut top_down: Vec<u32> = (0_u32..).take(triangles.len()).collect();
        top_down.sort_by(|&a, &b| tops[b as usize].total_cmp(&tops[a as usize]));
        let used = || triangles.iter().flatten().map(|&v| vertices[v as usize].z);
        let height = used().fold(f64::NEG_INFINITY, f64::max) - used().fold(f64::INFINITY, f64::min);
        Self {
            unit,
            period: tile.period / unit,
            top_down,
            base: (low.truncate() / (tile.period / unit)).floor().extend(0.0) * (tile.period / unit).extend(0.0) + DVec3::Z * low.z,
            height: height.max(0.0),
            closed: is_closed(&vertices, &triangles, tile.period / unit),
            group: order.iter().map(|o| group[o.1 as usize]).collect(),
            groups,
            surface: order.iter().map(|o| small.surface_of_triangle[o.1 as usize]).collect(),
            tile_triangle: order.iter().map(|o| o.1).collect(),
            vertices,
            normals: order.iter().map(|o| normals[o.1 as usize]).collect(),
            areas: order.iter().map(|o| areas[o.1 as usize]).collect(),
            triangles,
        }
    }

    /// Footprint `A` in units of the larger period.
    pub fn footprint(&self) -> f64 {
        self.period.x * self.period.y
    }

    /// Corners of a triangle.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Area-preserving map from the unit square to a triangle: `along` cuts strips parallel to its shortest edge, so that neighbours in
    /// `along` are neighbours on the surface; `across` runs along the strip.
    fn barycentric(&self, triangle: usize, along: f64, across: f64) -> [f64; 3] {
        let corners = self.corners(triangle);
        let opposite = |k: usize| (corners[(k + 1) % 3] - corners[(k + 2) % 3]).length_squared();
        let tip = (0..3).min_by(|&a, &b| opposite(a).total_cmp(&opposite(b))).expect("three corners");
        let r = along.sqrt();
        let mut barycentric = [0.0; 3];
        barycentric[tip] = 1.0 - r;
        barycentric[(tip + 1) % 3] = r * (1.0 - across);
        barycentric[(tip + 2) % 3] = r * across;
        barycentric
    }
}

/// Whether each edge of the periodic surface is met by as many edges in the reverse direction.
fn is_closed(vertices: &[DVec3], triangles: &[[u32; 3]], period: DVec2) -> bool {
    /// Positions that agree to this share of the larger period are one.
    const WELD: f64 = 1e-6;
    let cells = (period / WELD).round();
    let key = |v: &DVec3| {
        let xy = (DVec2::new(v.x, v.y) / period * cells).round();
        let wrapped = xy - (xy / cells).floor() * cells;
        [wrapped.x, wrapped.y, (v.z / WELD).round()].map(|x| x + 0.0).map(f64::to_bits)
    };
    let mut places: FxHashMap<[u64; 3], u32> = FxHashMap::default();
    let ids: Vec<u32> = vertices
        .iter()
        .map(|v| {
            let next = u32::try_from(places.len()).expect("vertices are counted in u32");
            *places.entry(key(v)).or_insert(next)
        })
        .collect();
    let mut balance: FxHashMap<[u32; 2], i32> = FxHashMap::default();
    for t in triangles {
        for k in 0..3 {
            let (a, b) = (ids[t[k] as usize], ids[t[(k + 1) % 3] as usize]);
            match a.cmp(&b) {
                Ordering::Less => *balance.entry([a, b]).or_default() += 1,
                Ordering::Greater => *balance.entry([b, a]).or_default() -= 1,
                Ordering::Equal => {}
            }
        }
    }
    balance.values().all(|&b| b == 0)
}

/// One of 24 coarse bins of normals: octant of the sphere, and the component that dominates.
fn normal_bin(n: DVec3) -> u32 {
    let octant = u32::from(n.x < 0.0) | u32::from(n.y < 0.0) << 1 | u32::from(n.z < 0.0) << 2;
    let a = n.abs();
    let dominant = if a.z >= a.x && a.z >= a.y {
        0
    } else if a.x >= a.y {
        1
    } else {
        2
    };
    octant * 3 + dominant
}

/// Morton code, 10 bits a component, of a point of the unit cube.
fn morton(p: DVec3) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to 10 bits")]
    let spread = |x: f64| {
        let mut v = (x * 1024.0).clamp(0.0, 1023.0) as u32;
        v = (v | v << 16) & 0x0300_00FF;
        v = (v | v << 8) & 0x0300_F00F;
        v = (v | v << 4) & 0x030C_30C3;
        (v | v << 2) & 0x0924_9249
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}

/// Where samples go: a density along the surface, laid out as one line by cumulative area.
#[derive(Clone, Debug)]
pub struct Density {
    /// Share of the area of the triangles before each one, and 1 at the end.
    area: Vec<f64>,
    /// Area of the surface over the footprint.
    total: f64,
    /// Share of the samples that go to the stretches before each one, and 1 at the end; all stretches have the same area.
    share: Vec<f64>,
}

impl Density {
    /// Samples in proportion to area.
    pub fn uniform(surface: &Surface) -> Self {
        let total: f64 = surface.areas.iter().sum();
        let mut sum = 0.0;
        let mut area = vec![0.0];
        area.extend(surface.areas.iter().map(|a| {
            sum += a;
            sum / total
        }));
        Self { area, total: total / surface.footprint(), share: vec![0.0, 1.0] }
    }

    /// Samples in proportion to area times `importance`, one positive number for each of as many stretches of equal area.
    #[must_use]
    pub fn weighted(&self, importance: &[f64]) -> Self {
        let total: f64 = importance.iter().sum();
        let mut sum = 0.0;
        let mut share = vec![0.0];
        share.extend(importance.iter().map(|i| {
            sum += i;
            sum / total
        }));
        Self { share, ..self.clone() }
    }

    /// Where the share `at` of the samples ends: the triangle, how far into its area, and what area over the footprint a sample there
    /// stands for, times the number of samples; and how far along the whole area this is.
    fn locate(&self, at: f64) -> (usize, f64, f64, f64) {
        let stretch = |cumulative: &[f64], at: f64| {
            let k = cumulative.partition_point(|&c| c <= at).clamp(1, cumulative.len() - 1) - 1;
            (k, ((at - cumulative[k]) / (cumulative[k + 1] - cumulative[k])).clamp(0.0, 1.0))
        };
        let (k, along) = stretch(&self.share, at);
        let stretches = (self.share.len() - 1) as f64;
        let weight = self.total / (stretches * (self.share[k + 1] - self.share[k]));
        let place = (k as f64 + along) / stretches;
        let (triangle, along) = stretch(&self.area, place);
        (triangle, along, weight, place)
    }
}

/// Samples to make facets of: for each set a run of the sequence. `rows`, the length of all runs, is a power of two, and each start is a
/// multiple of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Runs {
    /// First sample of each set.
    pub starts: [u32; SETS],
    /// Samples of each set.
    pub rows: u32,
}

impl Runs {
    /// Part `part` of `parts` of the samples `start..start + length`, the eighths of which are the sets.
    pub fn of_block(start: u32, length: u32, part: u32, parts: u32) -> Self {
        let (set, rows) = (length / SETS as u32, length / SETS as u32 / parts);
        let mut starts = [start + part * rows; SETS];
        for (r, s) in (0..).zip(&mut starts) {
            *s += r * set;
        }
        Self { starts, rows }
    }
}

/// Facets of some samples of the sequence `seed`.
pub fn sample(small: &SmallScale, surface: &Surface, density: &Density, runs: Runs, seed: u32) -> Facets {
    let rows = runs.rows as usize;
    let samples = rows * SETS;
    // One row a stretch of the surface, one column a set.
    let mut table = vec![Sample { triangle: NO_TRIANGLE, barycentric: [0.0; 3], weight: 0.0, place: 0.0 }; samples];
    for (set, start) in runs.starts.into_iter().enumerate() {
        for t in start..start + runs.rows {
            let [first, second] = sobol_2d(t, seed);
            let row = ((u64::from(first) * rows as u64) >> 32) as usize;
            let (triangle, along, weight, place) = density.locate(fraction(first));
            let barycentric = surface.barycentric(triangle, along, fraction(second));
            let slot = &mut table[row * SETS + set];
            debug_assert_eq!(slot.triangle, NO_TRIANGLE, "two samples of a set in one stratum");
            #[expect(clippy::cast_possible_truncation, reason = "triangles are counted in u32")]
            let triangle = triangle as u32;
            *slot = Sample { triangle, barycentric, weight, place };
        }
    }
    let holds = |row: &[Sample], g: u32| row.iter().any(|f| surface.group[f.triangle as usize] == g);
    let mut facets = Facets { samples, ..Facets::default() };
    let tinted = small.surfaces.iter().any(|s| matches!(s.tint, Tint::Image(_)));
    facets.tint = tinted.then(Default::default);
    let mut next = 0;
    for g in (0..).take(surface.groups.len()) {
        let start = facets.triangle.len();
        // A row at the seam of two groups is looked at for both.
        while next > 0 && holds(&table[(next - 1) * SETS..next * SETS], g) {
            next -= 1;
        }
        while next < rows && holds(&table[next * SETS..(next + 1) * SETS], g) {
            for sample in &table[next * SETS..(next + 1) * SETS] {
                let mine = surface.group[sample.triangle as usize] == g;
                facets.push(small, surface, mine.then_some(sample));
            }
            next += 1;
        }
        while !facets.triangle.len().is_multiple_of(ALIGNMENT) {
            facets.push(small, surface, None);
        }
        facets.ranges.push(start..facets.triangle.len());
    }
    facets
}

/// Facets at places that a caller chose: how far along the area of `density`, and across the triangle found there, each in 0..1. Their sets
/// mean nothing.
pub(crate) fn at_places(small: &SmallScale, surface: &Surface, density: &Density, places: &[[f64; 2]]) -> Facets {
    let mut samples: Vec<Sample> = places
        .iter()
        .map(|&[first, second]| {
            let (triangle, along, weight, place) = density.locate(first);
            let barycentric = surface.barycentric(triangle, along, second);
            #[expect(clippy::cast_possible_truncation, reason = "triangles are counted in u32")]
            let triangle = triangle as u32;
            Sample { triangle, barycentric, weight, place }
        })
        .collect();
    samples.sort_by(|a, b| a.place.total_cmp(&b.place));
    let mut facets = Facets { samples: samples.len(), ..Facets::default() };
    facets.tint = small.surfaces.iter().any(|s| matches!(s.tint, Tint::Image(_))).then(Default::default);
    let mut rest = &samples[..];
    for g in (0..).take(surface.groups.len()) {
        let start = facets.triangle.len();
        // Triangles are sorted by group.
        let (mine, others) = rest.split_at(rest.partition_point(|s| surface.group[s.triangle as usize] <= g));
        for sample in mine {
            facets.push(small, surface, Some(sample));
        }
        while !facets.triangle.len().is_multiple_of(ALIGNMENT) {
            facets.push(small, surface, None);
        }
        facets.ranges.push(start..facets.triangle.len());
        rest = others;
    }
    facets
}

impl Facets {
    /// Normal of a facet.
    pub fn normal_of(&self, facet: usize) -> Vec3 {
        Vec3::new(self.normal[0][facet], self.normal[1][facet], self.normal[2][facet])
    }
}

/// One sample of the surface.
#[derive(Clone, Copy)]
struct Sample {
    triangle: u32,
    barycentric: [f64; 3],
    /// Area over the footprint that it stands for, times the number of samples.
    weight: f64,
    /// How far along the whole area it lies.
    place: f64,
}

impl Facets {
    fn push(&mut self, small: &SmallScale, surface: &Surface, sample: Option<&Sample>) {
        let (mut position, mut normal, mut weight, mut tint) = (DVec3::ZERO, DVec3::Z, 0.0, [0.0; 3]);
        if let Some(sample) = sample {
            let t = sample.triangle as usize;
            let bary = sample.barycentric;
            let corners = surface.corners(t);
            position = corners[0] * bary[0] + corners[1] * bary[1] + corners[2] * bary[2];
            normal = surface.normals[t];
            weight = sample.weight;
            tint = match &small.surfaces[usize::from(surface.surface[t])].tint {
                // Uniform tints are part of the lobes' colours.
                Tint::Uniform(_) => [1.0; 3],
                Tint::Image(image) => {
                    let uv =
                        small.tile.uv.as_ref().expect("Material::build refuses an image without uv")[surface.tile_triangle[t] as usize];
                    image.lookup(uv[0] * bary[0] + uv[1] * bary[1] + uv[2] * bary[2])
                }
            };
        }
        self.triangle.push(sample.map_or(NO_TRIANGLE, |s| s.triangle));
        self.position.push(position);
        #[expect(clippy::cast_possible_truncation, reason = "the sums are in f32")]
        {
            for (component, value) in self.normal.iter_mut().zip(normal.to_array()) {
                component.push(value as f32);
            }
            self.weight.push(weight as f32);
            self.along.push(sample.map_or(0.0, |s| s.place) as f32);
        }
        if let Some(components) = &mut self.tint {
            for (component, value) in components.iter_mut().zip(tint) {
                component.push(value);
            }
        }
    }
}
