//! The surface to be folded: triangles in mm, checked, coplanar neighbours merged to facets, edges with their fold angles.
//!
//! A facet is a polygon that stays flat; an edge is where two facets meet, or where the surface ends. What paper cannot do is
//! refused here: three facets at one edge, facets turned against each other, one facet twice, corners that are no numbers.

use biscale::error::BadInput;
use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;

/// Triangles in mm, as a material or a mesh file gives them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Triangles {
    /// Positions, mm.
    pub vertices: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Linear RGB of each triangle, 0 to 1.
    pub colours: Vec<[f64; 3]>,
}

impl Triangles {
    /// Triangles of one colour, white.
    pub fn white(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Self {
        let colours = vec![[1.0; 3]; triangles.len()];
        Self { vertices, triangles, colours }
    }
}

/// A flat polygon of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Facet {
    /// Vertices of the mesh, counter-clockwise seen from outside.
    pub corners: Vec<u32>,
    /// The corners in the facet's own plane, mm, counter-clockwise.
    pub flat: Vec<DVec2>,
    /// Triangles that fill the polygon, as places in `corners`.
    pub fill: Vec<[u32; 3]>,
    /// Edge from corner `k` to corner `k + 1`.
    pub edges: Vec<u32>,
    /// Unit normal, outwards.
    pub normal: DVec3,
    /// Linear RGB, 0 to 1.
    pub colour: [f64; 3],
}

/// Where two facets meet, or the surface ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// Its ends, in the order of the first facet.
    pub ends: [u32; 2],
    /// The facets on both sides and the place of the edge in each; the second is `None` at the surface's border.
    pub sides: [Option<(u32, u32)>; 2],
    /// Fold angle in radians, -pi to pi: positive for a valley, negative for a mountain, seen from outside; 0 is flat.
    pub angle: f64,
}

/// A surface of facets.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Positions, mm.
    pub vertices: Vec<DVec3>,
    /// The facets.
    pub facets: Vec<Facet>,
    /// The edges.
    pub edges: Vec<Edge>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// What is taken as flat and as one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Corners closer than this are one, mm. A millionth of the size of the surface suits files of 32-bit numbers.
    pub weld: f64,
    /// Neighbours whose corners all lie within this distance of one plane are one facet, mm. A tilt of a small facet by this much moves
    /// what hangs on it a hundred times as far; what is flat to the eye only stays an edge, which is not drawn.
    pub flat: f64,
}

/// Most facets that are taken: beyond it no person folds the result, and the search has no bounded time.
pub const MAX_FACETS: usize = 20_000;

/// Corners of a facet lie in its plane to this share of its width: more would tilt what hangs on a needle.
const FLAT_SHARE: f64 = 1e-7;

/// Two facets count as coplanar only below this angle, radians: a sharper fold between tiny facets is a fold all the same.
const FLAT_ANGLE: f64 = 1e-3;

impl Tolerance {
    /// For a surface of this size, mm.
    pub fn of_size(size: f64) -> Self {
        Self { weld: (1e-7 * size).max(1e-9), flat: 1e-6 }
    }
}

impl Triangles {
    /// Largest extent of the bounding box, mm.
    pub fn size(&self) -> f64 {
        let low = self.vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = self.vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        if self.vertices.is_empty() { 0.0 } else { (high - low).max_element() }
    }

    /// Volume between the surface and a plane through its lowest point, mm³; inside it, if it is closed.
    pub fn volume(&self) -> f64 {
        let base = self.triangles.iter().flatten().map(|&v| self.vertices[v as usize].z).fold(f64::INFINITY, f64::min);
        self.triangles.iter().map(|t| under(t.map(|v| self.vertices[v as usize]), base)).sum()
    }

    /// Joins corners that lie within `distance` of each other: the first one wins.
    pub fn weld(&mut self, distance: f64) {
        let cell = |v: DVec3| (v / (2.0 * distance)).floor().to_array().map(|x| x as i64);
        let mut grid: FxHashMap<[i64; 3], Vec<u32>> = FxHashMap::default();
        let mut kept: Vec<DVec3> = Vec::new();
        let mut place = Vec::with_capacity(self.vertices.len());
        for &v in &self.vertices {
            let [low, high] = [cell(v - distance), cell(v + distance)];
            let mut found = None;
            'search: for x in low[0]..=high[0] {
                for y in low[1]..=high[1] {
                    for z in low[2]..=high[2] {
                        let near = grid.get(&[x, y, z]).into_iter().flatten();
                        found = near.copied().find(|&k| kept[k as usize].distance(v) <= distance);
                        if found.is_some() {
                            break 'search;
                        }
                    }
                }
            }
            place.push(found.unwrap_or_else(|| {
                let k = u32::try_from(kept.len()).expect("fewer corners than before");
                kept.push(v);
                grid.entry(cell(v)).or_default().push(k);
                k
            }));
        }
        for corner in self.triangles.iter_mut().flatten() {
            *corner = place[*corner as usize];
        }
        self.vertices = kept;
    }

    /// Refuses what is no surface at all: corners that are no numbers or do not exist, no triangle.
    fn check(&self) -> Result<(), BadInput> {
        if self.triangles.is_empty() {
            return Err(BadInput::new("there is no triangle to fold", "give a surface with at least one"));
        }
        if let Some((k, v)) = self.vertices.iter().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(BadInput::new(format!("vertex {} is ({}, {}, {})", k + 1, v.x, v.y, v.z), "coordinates must be finite numbers"));
        }
        if self.triangles.iter().flatten().any(|&c| c as usize >= self.vertices.len()) {
            return Err(BadInput::new("a triangle has a corner that does not exist", "write the mesh again"));
        }
        if self.colours.len() != self.triangles.len() {
            return Err(BadInput::new("not every triangle has a colour", "give one colour a triangle"));
        }
        Ok(())
    }
}

/// Signed volume of the prism between a triangle and the plane at height `base`.
fn under([a, b, c]: [DVec3; 3], base: f64) -> f64 {
    0.5 * (b - a).truncate().perp_dot((c - a).truncate()) * ((a.z + b.z + c.z) / 3.0 - base)
}

/// A place in space as words.
fn place(v: DVec3) -> String {
    format!("({:.3}, {:.3}, {:.3}) mm", v.x, v.y, v.z)
}

impl Mesh {
    /// Makes facets of triangles.
    ///
    /// # Errors
    /// Corners that are no numbers, triangles without area that cannot be left out, a triangle twice, edges of three facets,
    /// neighbours turned against each other, more than [`MAX_FACETS`].
    pub fn new(soup: Triangles, tolerance: Tolerance) -> Result<Self, BadInput> {
        Self::with_groups(soup, tolerance, None)
    }

    /// As [`Mesh::new`]; triangles of different numbers in `groups` stay different facets.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn with_groups(mut soup: Triangles, tolerance: Tolerance, groups: Option<&[u32]>) -> Result<Self, BadInput> {
        soup.check()?;
        let mut groups = groups.map_or_else(|| vec![0; soup.triangles.len()], <[u32]>::to_vec);
        let mut notes = Vec::new();
        soup.weld(tolerance.weld);
        let before = soup.triangles.len();
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|v| soup.vertices[v as usize]);
            let longest = (b - a).length().max((c - b).length()).max((a - c).length());
            ((b - a).cross(c - a).length(), longest)
        };
        let keep: Vec<bool> = soup
            .triangles
            .iter()
            .map(|t| {
                let (area, longest) = area(t);
                t[0] != t[1] && t[1] != t[2] && t[2] != t[0] && area > longest * tolerance.weld
            })
            .collect();
        let mut k = keep.iter();
        soup.triangles.retain(|_| *k.next().expect("one a triangle"));
        let mut k = keep.iter();
        soup.colours.retain(|_| *k.next().expect("one a triangle"));
        let mut k = keep.iter();
        groups.retain(|_| *k.next().expect("one a triangle"));
        let flat = before - soup.triangles.len();
        if soup.triangles.is_empty() {
            return Err(BadInput::new("no triangle has an area", "give a surface with at least one; is its scale right?"));
        }
        if flat > 0 {
            notes.push(format!("left out {flat} triangles without area"));
        }
        let polygons: Vec<Vec<u32>> = split_t_junctions(&soup, tolerance.weld);
        let neighbours = Adjacency::new(&soup.vertices, &polygons)?;
        let mut groups = merge_coplanar(&soup, &polygons, &neighbours, tolerance, &groups);
        drop_collinear(&soup, &mut groups, tolerance);
        if groups.len() > MAX_FACETS {
            let problem = format!("the surface has {} facets, more than the {MAX_FACETS} that can be unfolded", groups.len());
            return Err(BadInput::new(problem, "reduce it with --max-facets or --slope-tolerance"));
        }
        let facets: Vec<Facet> = groups.into_iter().map(|g| Facet::new(&soup, g)).collect::<Result<_, _>>()?;
        let outlines: Vec<Vec<u32>> = facets.iter().map(|f| f.corners.clone()).collect();
        let Adjacency { edges, of_polygon } = Adjacency::new(&soup.vertices, &outlines)?;
        let mut mesh = Self { vertices: soup.vertices, facets, edges, notes };
        for (facet, edges) in mesh.facets.iter_mut().zip(of_polygon) {
            facet.edges = edges;
        }
        for k in 0..mesh.edges.len() {
            mesh.edges[k].angle = mesh.fold_angle(k);
        }
        mesh.drop_unused();
        Ok(mesh)
    }

    /// Fold angle at an edge, from the normals on both sides.
    fn fold_angle(&self, edge: usize) -> f64 {
        let Edge { ends, sides: [Some((f, _)), Some((g, _))], .. } = self.edges[edge] else { return 0.0 };
        let [a, b] = ends.map(|v| self.vertices[v as usize]);
        let (n, m) = (self.facets[f as usize].normal, self.facets[g as usize].normal);
        let along = (b - a).normalize_or_zero();
        // n x m points along the edge of the first facet where the surface bends away from the viewer: a mountain.
        -n.cross(m).dot(along).atan2(n.dot(m))
    }

    fn drop_unused(&mut self) {
        let mut next = vec![u32::MAX; self.vertices.len()];
        let mut kept = Vec::new();
        let mut renumber = |v: &mut u32| {
            if next[*v as usize] == u32::MAX {
                next[*v as usize] = u32::try_from(kept.len()).expect("fewer than before");
                kept.push(self.vertices[*v as usize]);
            }
            *v = next[*v as usize];
        };
        self.facets.iter_mut().flat_map(|f| f.corners.iter_mut()).for_each(&mut renumber);
        self.edges.iter_mut().flat_map(|e| e.ends.iter_mut()).for_each(&mut renumber);
        self.vertices = kept;
    }

    /// Position of a corner of a facet.
    pub fn corner(&self, facet: usize, corner: usize) -> DVec3 {
        self.vertices[self.facets[facet].corners[corner] as usize]
    }

    /// Length of an edge, mm.
    pub fn length(&self, edge: usize) -> f64 {
        let [a, b] = self.edges[edge].ends.map(|v| self.vertices[v as usize]);
        a.distance(b)
    }

    /// Loops of border edges: 0 for a closed surface.
    pub fn border_loops(&self) -> usize {
        let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for e in self.edges.iter().filter(|e| e.sides[1].is_none()) {
            next.entry(e.ends[0]).or_default().push(e.ends[1]);
        }
        let mut loops = 0;
        while let Some((&start, _)) = next.iter().find(|(_, to)| !to.is_empty()) {
            let mut at = start;
            while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
                at = to;
            }
            loops += 1;
        }
        loops
    }

    /// The connected parts, as lists of facets.
    pub fn components(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.facets.len()];
        let mut parts = Vec::new();
        for start in 0..self.facets.len() {
            if std::mem::replace(&mut seen[start], true) {
                continue;
            }
            let mut part = vec![u32::try_from(start).expect("at most MAX_FACETS")];
            let mut k = 0;
            while k < part.len() {
                for (_, g) in self.neighbours(part[k]) {
                    if !std::mem::replace(&mut seen[g as usize], true) {
                        part.push(g);
                    }
                }
                k += 1;
            }
            parts.push(part);
        }
        parts
    }

    /// Edges of a facet that have another facet behind them, with that facet.
    pub fn neighbours(&self, facet: u32) -> impl Iterator<Item = (u32, u32)> + '_ {
        self.facets[facet as usize].edges.iter().filter_map(move |&e| self.other(e, facet).map(|(g, _)| (e, g)))
    }

    /// What lies on the other side of an edge: the facet, and the edge's place in it.
    pub fn other(&self, edge: u32, facet: u32) -> Option<(u32, u32)> {
        let [a, b] = self.edges[edge as usize].sides;
        match (a, b) {
            (Some((f, _)), other) if f == facet => other,
            (other, Some((g, _))) if g == facet => other,
            _ => None,
        }
    }

    /// Volume between the surface and a plane through its lowest point, mm³; inside it, if it is closed.
    pub fn volume(&self) -> f64 {
        let base = self.vertices.iter().map(|v| v.z).fold(f64::INFINITY, f64::min);
        let of =
            |(f, facet): (usize, &Facet)| facet.fill.iter().map(move |t| under(t.map(|c| self.corner(f, c as usize)), base)).sum::<f64>();
        self.facets.iter().enumerate().map(of).sum()
    }

    /// The smallest height of a facet over one of its edges, mm, and that facet.
    pub fn narrowest(&self) -> (f64, usize) {
        let mut least = (f64::INFINITY, 0);
        for (k, facet) in self.facets.iter().enumerate() {
            let width = width(&facet.flat);
            if width < least.0 {
                least = (width, k);
            }
        }
        least
    }
}

/// Least width of a polygon over its own edges: the distance to the farthest corner, least over the edges.
pub fn width(polygon: &[DVec2]) -> f64 {
    let n = polygon.len();
    let over = |k: usize| {
        let (a, b) = (polygon[k], polygon[(k + 1) % n]);
        let along = (b - a).normalize_or_zero();
        polygon.iter().map(|&p| along.perp_dot(p - a).abs()).fold(0.0, f64::max)
    };
    (0..n).map(over).fold(f64::INFINITY, f64::min)
}

/// Triangles as polygons, with corners of others that lie on their edges put in between: the ends of two cells may differ.
fn split_t_junctions(soup: &Triangles, distance: f64) -> Vec<Vec<u32>> {
    let mut count: FxHashMap<(u32, u32), i32> = FxHashMap::default();
    for t in &soup.triangles {
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            *count.entry((a.min(b), a.max(b))).or_default() += 1;
        }
    }
    let mut open: Vec<(u32, u32)> = count.iter().filter(|(_, n)| **n == 1).map(|(e, _)| *e).collect();
    open.sort_unstable();
    let mut ends: Vec<u32> = open.iter().flat_map(|&(a, b)| [a, b]).collect();
    ends.sort_unstable_by(|&a, &b| soup.vertices[a as usize].x.total_cmp(&soup.vertices[b as usize].x).then(a.cmp(&b)));
    ends.dedup();
    let mut between: FxHashMap<(u32, u32), Vec<u32>> = FxHashMap::default();
    for &(a, b) in &open {
        let (p, q) = (soup.vertices[a as usize], soup.vertices[b as usize]);
        let (low, high) = (p.x.min(q.x) - distance, p.x.max(q.x) + distance);
        let first = ends.partition_point(|&v| soup.vertices[v as usize].x < low);
        let along = q - p;
        let mut on: Vec<(f64, u32)> = Vec::new();
        for &v in ends[first..].iter().take_while(|&&v| soup.vertices[v as usize].x <= high) {
            let r = soup.vertices[v as usize] - p;
            let t = r.dot(along) / along.length_squared();
            if v != a && v != b && t > 0.0 && t < 1.0 && (r - t * along).length() <= distance {
                on.push((t, v));
            }
        }
        on.sort_by(|x, y| x.0.total_cmp(&y.0));
        if !on.is_empty() {
            between.insert((a, b), on.into_iter().map(|(_, v)| v).collect());
        }
    }
    let polygon = |t: &[u32; 3]| {
        let mut corners = Vec::with_capacity(3);
        for k in 0..3 {
            let (a, b) = (t[k], t[(k + 1) % 3]);
            corners.push(a);
            if let Some(on) = between.get(&(a.min(b), a.max(b))) {
                if a < b { corners.extend(on) } else { corners.extend(on.iter().rev()) }
            }
        }
        corners
    };
    soup.triangles.iter().map(polygon).collect()
}

/// Triangles whose corners nowhere lie on the edge of a neighbour: such neighbours are cut there. The soup's corners are welded.
pub(crate) fn close_t_junctions(soup: Triangles, distance: f64) -> Triangles {
    let polygons = split_t_junctions(&soup, distance);
    let mut out = Triangles { vertices: soup.vertices.clone(), ..Triangles::default() };
    for ((corners, &t), &colour) in polygons.iter().zip(&soup.triangles).zip(&soup.colours) {
        let cut = if corners.len() == 3 { vec![t] } else { fan_with_points(&soup, corners, t) };
        let distinct = cut.into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        out.triangles.extend(distinct);
        out.colours.resize(out.triangles.len(), colour);
    }
    out
}

/// Which polygon lies behind which edge.
pub(crate) struct Adjacency {
    edges: Vec<Edge>,
    of_polygon: Vec<Vec<u32>>,
}

impl Adjacency {
    pub(crate) fn new(vertices: &[DVec3], polygons: &[Vec<u32>]) -> Result<Self, BadInput> {
        let mut found: FxHashMap<(u32, u32), u32> = FxHashMap::default();
        let mut edges: Vec<Edge> = Vec::new();
        let mut of_polygon = Vec::with_capacity(polygons.len());
        let mut seen: FxHashMap<Vec<u32>, usize> = FxHashMap::default();
        for (p, corners) in polygons.iter().enumerate() {
            let mut sorted = corners.clone();
            sorted.sort_unstable();
            if let Some(first) = seen.insert(sorted, p) {
                let at = place(vertices[corners[0] as usize]);
                let problem = format!("facet {} lies on facet {} (a corner is at {at})", p + 1, first + 1);
                return Err(BadInput::new(problem, "remove duplicate faces; paper has one layer"));
            }
            let n = corners.len();
            let polygon = u32::try_from(p).expect("fewer than 2^32 triangles");
            let mut own = Vec::with_capacity(n);
            for k in 0..n {
                let (a, b) = (corners[k], corners[(k + 1) % n]);
                let here = Some((polygon, u32::try_from(k).expect("few corners")));
                let middle = || place(0.5 * (vertices[a as usize] + vertices[b as usize]));
                let id = match found.get(&(a.min(b), a.max(b))) {
                    None => {
                        let id = u32::try_from(edges.len()).expect("fewer than 2^32 edges");
                        found.insert((a.min(b), a.max(b)), id);
                        edges.push(Edge { ends: [a, b], sides: [here, None], angle: 0.0 });
                        id
                    }
                    Some(&id) => {
                        let edge = &mut edges[id as usize];
                        if edge.sides[1].is_some() {
                            let problem = format!("three facets meet at the edge around {}", middle());
                            return Err(BadInput::new(problem, "an edge of a paper surface has one or two; cut the mesh there"));
                        }
                        if edge.ends == [a, b] {
                            let problem = format!("two facets with one edge around {} are turned against each other", middle());
                            return Err(BadInput::new(problem, "make the faces' normals consistent (\"recalculate normals\")"));
                        }
                        edge.sides[1] = here;
                        id
                    }
                };
                own.push(id);
            }
            of_polygon.push(own);
        }
        Ok(Self { edges, of_polygon })
    }
}

/// A facet in the making: outline, the triangles in it, colour.
struct Group {
    corners: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    colour: [f64; 3],
}

/// Joins coplanar neighbours of one colour, as long as the result is a polygon without holes.
fn merge_coplanar(soup: &Triangles, polygons: &[Vec<u32>], adjacency: &Adjacency, tolerance: Tolerance, kinds: &[u32]) -> Vec<Group> {
    let normal = |corners: &[u32]| newell(corners.iter().map(|&c| soup.vertices[c as usize])).normalize_or_zero();
    let mut groups: Vec<Option<Group>> = polygons
        .iter()
        .zip(&soup.triangles)
        .zip(&soup.colours)
        .map(|((corners, &t), &colour)| {
            let triangles = if corners.len() == 3 { vec![t] } else { fan_with_points(soup, corners, t) };
            Some(Group { corners: corners.clone(), triangles, colour })
        })
        .collect();
    let mut owner: Vec<u32> = (0..u32::try_from(groups.len()).expect("few")).collect();
    fn root(owner: &mut [u32], mut k: u32) -> u32 {
        while owner[k as usize] != k {
            owner[k as usize] = owner[owner[k as usize] as usize];
            k = owner[k as usize];
        }
        k
    }
    // Again until nothing changes: an edge refused while it would close a ring may be taken later.
    loop {
        let mut changed = false;
        for e in &adjacency.edges {
            let [Some((f, _)), Some((g, _))] = e.sides else { continue };
            let (f, g) = (root(&mut owner, f), root(&mut owner, g));
            // A group keeps the kind of its first triangle, as all of it are of one kind.
            if f == g || kinds[f as usize] != kinds[g as usize] {
                continue;
            }
            let (Some(a), Some(b)) = (&groups[f as usize], &groups[g as usize]) else { continue };
            if a.colour != b.colour || normal(&a.corners).dot(normal(&b.corners)) < FLAT_ANGLE.cos() {
                continue;
            }
            let Some(corners) = join_outlines(&a.corners, &b.corners) else { continue };
            let n = normal(&corners);
            let centre = corners.iter().map(|&c| soup.vertices[c as usize]).sum::<DVec3>() / corners.len() as f64;
            let off = corners.iter().map(|&c| (soup.vertices[c as usize] - centre).dot(n).abs()).fold(0.0, f64::max);
            let reach = corners.iter().map(|&c| soup.vertices[c as usize].distance(centre)).fold(0.0, f64::max);
            let width = newell(corners.iter().map(|&c| soup.vertices[c as usize])).length() / (2.0 * reach);
            if off > tolerance.flat.min(FLAT_SHARE * width) {
                continue;
            }
            let b = groups[g as usize].take().expect("it was there");
            let a = groups[f as usize].as_mut().expect("it was there");
            a.corners = corners;
            a.triangles.extend(b.triangles);
            owner[g as usize] = f;
            changed = true;
        }
        if !changed {
            break;
        }
    }
    groups.into_iter().flatten().collect()
}

/// Takes corners out of the outlines that lie on a straight line there for all facets that have them: what was two edges is one.
fn drop_collinear(soup: &Triangles, groups: &mut [Group], tolerance: Tolerance) {
    let mut around: FxHashMap<u32, Vec<u32>> = FxHashMap::default();
    for group in groups.iter() {
        let n = group.corners.len();
        for k in 0..n {
            let (before, at, after) = (group.corners[(k + n - 1) % n], group.corners[k], group.corners[(k + 1) % n]);
            let list = around.entry(at).or_default();
            for other in [before, after] {
                if !list.contains(&other) {
                    list.push(other);
                }
            }
        }
    }
    let straight = |v: u32| {
        let [a, b] = around[&v][..] else { return false };
        let [a, p, b] = [a, v, b].map(|v| soup.vertices[v as usize]);
        let along = (b - a).normalize_or_zero();
        ((p - a) - along * (p - a).dot(along)).length() <= tolerance.flat && (p - a).dot(b - p) > 0.0
    };
    for group in groups {
        let kept: Vec<u32> = group.corners.iter().copied().filter(|&v| !straight(v)).collect();
        if kept.len() >= 3 {
            group.corners = kept;
        }
    }
}

/// Cuts a triangle whose edges carry further corners into triangles: a fan from one of its corners that sees all of them, or, where
/// several edges have some, from a corner between. All points lie on the border of a triangle, so ears without area are skipped.
fn fan_with_points(soup: &Triangles, corners: &[u32], triangle: [u32; 3]) -> Vec<[u32; 3]> {
    let at = |v: u32| soup.vertices[v as usize];
    let [a, b, c] = triangle.map(at);
    let normal = (b - a).cross(c - a);
    let scale = normal.length();
    let mut rest = corners.to_vec();
    let mut out = Vec::new();
    while rest.len() > 3 {
        let n = rest.len();
        // The largest ear: never one of three points on a line while another exists.
        let area = |k: usize| {
            let [p, q, r] = [rest[(k + n - 1) % n], rest[k], rest[(k + 1) % n]].map(at);
            (q - p).cross(r - p).dot(normal) / scale
        };
        // An ear may be cut only if what stays still has an area: its tip must not be the last corner off a line.
        let best = (0..n).max_by(|&x, &y| area(x).total_cmp(&area(y))).expect("more than three");
        let ear = (0..n)
            .filter(|&k| area(k) > 1e-9 * scale)
            .find(|&k| {
                let left: Vec<u32> = (0..n).filter(|&j| j != k).map(|j| rest[j]).collect();
                newell(left.iter().map(|&v| at(v))).dot(normal) / scale > 1e-9 * scale
            })
            .unwrap_or(best);
        out.push([rest[(ear + n - 1) % n], rest[ear], rest[(ear + 1) % n]]);
        rest.remove(ear);
    }
    out.push([rest[0], rest[1], rest[2]]);
    out
}

/// Twice the area vector of a polygon in space.
fn newell(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let points: Vec<DVec3> = points.collect();
    let origin = points[0];
    (1..points.len() - 1).map(|k| (points[k] - origin).cross(points[k + 1] - origin)).sum()
}

/// The outline of two polygons that share exactly one chain of edges; `None` if they would touch elsewhere too.
fn join_outlines(a: &[u32], b: &[u32]) -> Option<Vec<u32>> {
    let (n, m) = (a.len(), b.len());
    let place_in_b: FxHashMap<u32, usize> = b.iter().enumerate().map(|(k, &v)| (v, k)).collect();
    // shared[k]: the edge of `a` from corner k runs backwards in `b`.
    let shared: Vec<bool> = (0..n).map(|k| place_in_b.get(&a[(k + 1) % n]).is_some_and(|&j| b[(j + 1) % m] == a[k])).collect();
    let count = shared.iter().filter(|&&s| s).count();
    if count == 0 || count == n {
        return None;
    }
    // The chain starts where the previous edge is not shared; there must be one start.
    let starts: Vec<usize> = (0..n).filter(|&k| shared[k] && !shared[(k + n - 1) % n]).collect();
    let [start] = starts[..] else { return None };
    let end = (start + count) % n;
    // Corners of `a` outside the chain must not be corners of `b`.
    let outside_a: Vec<u32> = (0..n - count + 1).map(|k| a[(end + k) % n]).collect();
    if outside_a[1..outside_a.len() - 1].iter().any(|v| place_in_b.contains_key(v)) {
        return None;
    }
    let from = place_in_b[&a[start]];
    let mut joined = outside_a;
    // b runs the chain backwards, from a[end] to a[start]; what follows a[start] in b leads round to a[end].
    for k in 1..m - count {
        joined.push(b[(from + k) % m]);
    }
    Some(joined)
}

impl Facet {
    fn new(soup: &Triangles, group: Group) -> Result<Self, BadInput> {
        let at = |v: u32| soup.vertices[v as usize];
        let Group { corners, triangles, colour } = group;
        let area = newell(corners.iter().map(|&c| at(c)));
        let normal = area.normalize_or_zero();
        let origin = at(corners[0]);
        // The x axis along the longest edge: lengths along it are kept to the last bit.
        let n = corners.len();
        let longest = (0..n)
            .max_by(|&j, &k| {
                let length = |k: usize| at(corners[k]).distance_squared(at(corners[(k + 1) % n]));
                length(j).total_cmp(&length(k)).then(k.cmp(&j))
            })
            .expect("a facet has corners");
        let along = at(corners[(longest + 1) % n]) - at(corners[longest]);
        let x = (along - normal * along.dot(normal)).normalize_or_zero();
        let y = normal.cross(x);
        if normal == DVec3::ZERO || x == DVec3::ZERO {
            return Err(BadInput::new(format!("a facet at {} has no area", place(origin)), "remove it from the mesh"));
        }
        let flat = corners.iter().map(|&c| DVec2::new((at(c) - origin).dot(x), (at(c) - origin).dot(y))).collect();
        let place_of: FxHashMap<u32, u32> = corners.iter().zip(0..).map(|(&v, k)| (v, k)).collect();
        // Corners that were inside the facet are gone from its outline; then it is filled anew.
        let fill: Option<Vec<[u32; 3]>> =
            triangles.iter().map(|t| Some([*place_of.get(&t[0])?, *place_of.get(&t[1])?, *place_of.get(&t[2])?])).collect();
        let mut facet = Self { corners, flat, fill: Vec::new(), edges: Vec::new(), normal, colour };
        facet.fill = match fill {
            Some(fill) => fill,
            None => crate::polygon::triangulate(&facet.flat),
        };
        Ok(facet)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<Mesh, BadInput> {
        let soup = Triangles::white(vertices.iter().map(|&v| v.into()).collect(), triangles.to_vec());
        let tolerance = Tolerance::of_size(soup.size());
        Mesh::new(soup, tolerance)
    }

    #[test]
    fn coplanar_neighbours_are_one_facet_and_corners_on_straight_lines_go() {
        // Two squares side by side, cut into triangles, and a flap folded up by 90 degrees behind them.
        let vertices = [[0., 0., 0.], [1., 0., 0.], [2., 0., 0.], [0., 1., 0.], [1., 1., 0.], [2., 1., 0.], [0., 1., 1.], [2., 1., 1.]];
        let m = mesh(&vertices, &[[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [3, 4, 6], [4, 5, 7], [4, 7, 6]]).unwrap();
        assert_eq!(m.facets.len(), 2);
        assert!(m.facets.iter().all(|f| f.corners.len() == 4), "{:?}", m.facets);
        let folds: Vec<&Edge> = m.edges.iter().filter(|e| e.sides[1].is_some()).collect();
        assert_eq!(folds.len(), 1, "one edge of 2, not two of 1");
        assert!((folds[0].angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "a valley: {}", folds[0].angle);
        assert_eq!((m.border_loops(), m.components().len()), (1, 1));
    }

    #[test]
    fn a_corner_on_the_edge_of_a_neighbour_joins_them() {
        let vertices = [[0., 0., 0.], [2., 0., 0.], [1., 1., 1.], [1., 0., 0.], [0., -1., 1.], [2., -1., 1.]];
        let m = mesh(&vertices, &[[0, 1, 2], [0, 4, 3], [3, 5, 1]]).unwrap();
        assert_eq!(m.components().len(), 1);
        assert_eq!(m.edges.iter().filter(|e| e.sides[1].is_some()).count(), 2);
    }

    #[test]
    fn a_ring_of_coplanar_triangles_does_not_become_a_facet_with_a_hole() {
        let mut vertices = Vec::new();
        for r in [1.0, 2.0] {
            vertices.extend((0..4).map(|k| {
                let (s, c) = (f64::from(k) * std::f64::consts::FRAC_PI_2).sin_cos();
                [r * c, r * s, 0.0]
            }));
        }
        let ring: Vec<[u32; 3]> = (0..4_u32)
            .flat_map(|k| {
                let n = (k + 1) % 4;
                [[k, k + 4, n + 4], [k, n + 4, n]]
            })
            .collect();
        let m = mesh(&vertices, &ring).unwrap();
        assert!(m.facets.len() >= 2, "{} facets", m.facets.len());
        let area: f64 = m.facets.iter().map(|f| crate::polygon::area(&f.flat)).sum();
        assert!((area - (8.0 - 2.0)).abs() < 1e-9, "{area}");
        assert_eq!(m.border_loops(), 2);
    }

    #[test]
    fn volumes_are_those_of_prisms_and_solids() {
        let lifted = Triangles::white(vec![DVec3::ZERO, DVec3::new(2., 0., 0.), DVec3::new(0., 2., 3.)], vec![[0, 1, 2]]);
        assert!((lifted.volume() - 2.0).abs() < 1e-12, "{}", lifted.volume());
    }
}
