//! The small-scale surface in the form that sampling and visibility work on.

use crate::clusters::{Cluster, clusters};
use crate::material::SmallScale;
use crate::numerics::cast::truncate_u32;
use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;
use std::cmp::Ordering;

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
    pub(super) fn barycentric(&self, triangle: usize, along: f64, across: f64) -> [f64; 3] {
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
    let spread = |x: f64| {
        let mut v = truncate_u32((x * 1024.0).clamp(0.0, 1023.0));
        v = (v | v << 16) & 0x0300_00FF;
        v = (v | v << 8) & 0x0300_F00F;
        v = (v | v << 4) & 0x030C_30C3;
        (v | v << 2) & 0x0924_9249
    };
    spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2
}
