//! Samples that keep their places while the surface under them changes.
//!
//! A search for parameters compares values of nearly the same surfaces. Samples that were drawn anew for each would add their own noise to
//! every comparison. Here each keeps its triangle and its place in it, and stands for the area that the triangle has now: the sums
//! are then as smooth in the parameters as the bits of visibility allow.

use super::density::Density;
use super::samples::{Facets, NO_TRIANGLE, Runs, sample};
use super::surface::Surface;
use crate::geometry::Tile;
use crate::material::SmallScale;
use crate::numerics::cast::narrow;
use glam::{DVec2, DVec3};

/// Samples of one surface, by triangle and place in it.
#[derive(Clone, Debug)]
pub struct CommonSamples {
    /// The surface that they were drawn on.
    surface: Surface,
    surface_of_triangle: Vec<u16>,
    facets: Facets,
    /// Place of each facet in its triangle.
    barycentric: Vec<[f64; 3]>,
}

impl CommonSamples {
    /// Draws `samples` samples, a power of two from 64, in proportion to area.
    pub fn new(small: &SmallScale, samples: u32, seed: u32) -> Self {
        Self::with_importance(small, samples, seed, &[1.0])
    }

    /// The same, in proportion to area times `importance`: one positive number for each of as many stretches of equal area, in the order of
    /// [`Facets::along`].
    pub fn with_importance(small: &SmallScale, samples: u32, seed: u32, importance: &[f64]) -> Self {
        let surface = Surface::new(small, None);
        let density = Density::uniform(&surface).weighted(importance);
        let facets = sample(small, &surface, &density, Runs::of_block(0, samples, 0, 1), seed);
        let place = |(&t, &p): (&u32, &DVec3)| if t == NO_TRIANGLE { [0.0; 3] } else { barycentric(surface.corners(t as usize), p) };
        let barycentric = facets.triangle.iter().zip(&facets.position).map(place).collect();
        Self { surface, surface_of_triangle: small.surface_of_triangle.clone(), facets, barycentric }
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.facets.samples
    }

    /// Whether `small` has the triangles of the surface that they were drawn on, of the same parts, in whatever shape.
    pub fn fits(&self, small: &SmallScale) -> bool {
        small.surface_of_triangle == self.surface_of_triangle
    }

    /// The surface as it is now, and the facets in their places on it; `None` if it has other triangles than the one that they were drawn
    /// on: more or fewer, or of other parts.
    pub fn on(&self, small: &SmallScale) -> Option<(Surface, Facets)> {
        if !self.fits(small) {
            return None;
        }
        let surface = self.surface.reshaped(&small.tile);
        let mut facets = self.facets.clone();
        let (before, now) = (self.surface.footprint(), surface.footprint());
        for (f, bary) in self.barycentric.iter().enumerate() {
            if facets.triangle[f] == NO_TRIANGLE {
                continue;
            }
            let t = facets.triangle[f] as usize;
            let corners = surface.corners(t);
            facets.position[f] = corners[0] * bary[0] + corners[1] * bary[1] + corners[2] * bary[2];
            for (component, value) in facets.normal.iter_mut().zip(surface.normals[t].to_array()) {
                component[f] = narrow(value);
            }
            let stretched = surface.areas[t] / now / (self.surface.areas[t] / before);
            facets.weight[f] = narrow(f64::from(facets.weight[f]) * stretched);
        }
        Some((surface, facets))
    }
}

/// Place of a point in a triangle, within it also where rounding says otherwise.
fn barycentric([a, b, c]: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let n = (b - a).cross(c - a);
    let share = |from: DVec3, to: DVec3| ((from - p).cross(to - p).dot(n) / n.length_squared()).clamp(0.0, 1.0);
    let w = [share(b, c), share(c, a), share(a, b)];
    let sum = w[0] + w[1] + w[2];
    if sum > 0.0 { w.map(|w| w / sum) } else { [1.0 / 3.0; 3] }
}

impl Surface {
    /// The same triangles in the same order, in the shape that they have in `tile`.
    fn reshaped(&self, tile: &Tile) -> Self {
        let unit = tile.period.max_element();
        let vertices: Vec<DVec3> = tile.vertices.iter().map(|v| *v / unit).collect();
        let triangles: Vec<[u32; 3]> = self.tile_triangle.iter().map(|&t| tile.triangles[t as usize]).collect();
        let (mut normals, mut areas, mut tops) = (Vec::new(), Vec::new(), Vec::new());
        let (mut low, mut high, mut corner) = (f64::INFINITY, f64::NEG_INFINITY, DVec2::INFINITY);
        for t in &triangles {
            let [a, b, c] = t.map(|v| vertices[v as usize]);
            let cross = (b - a).cross(c - a);
            let length = cross.length();
            normals.push(if length > 0.0 { cross / length } else { DVec3::ZERO });
            areas.push(0.5 * length);
            tops.push(a.z.max(b.z).max(c.z));
            low = low.min(a.z.min(b.z).min(c.z));
            high = high.max(a.z.max(b.z).max(c.z));
            corner = corner.min(a.truncate().min(b.truncate()).min(c.truncate()));
        }
        let mut top_down: Vec<u32> = (0_u32..).take(triangles.len()).collect();
        top_down.sort_by(|&a, &b| tops[b as usize].total_cmp(&tops[a as usize]));
        let period = tile.period / unit;
        Self {
            unit,
            period,
            vertices,
            triangles,
            tile_triangle: self.tile_triangle.clone(),
            surface: self.surface.clone(),
            group: self.group.clone(),
            groups: self.groups.clone(),
            normals,
            areas,
            top_down,
            base: ((corner / period).floor() * period).extend(low),
            height: (high - low).max(0.0),
            closed: self.closed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::Material;
    use crate::toml_reader::Source;

    fn weave(width: f64) -> SmallScale {
        let text = format!(
            "format = 1\n[geometry]\nkind = \"weave\"\nwarp_width = {width}\nwarp_gap = {}\nwarp_height = 0.14\nweft_width = 0.34\n\
             weft_gap = 0.16\nweft_height = 0.12\ncrimp = 0.15\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\n",
            0.5 - width
        );
        Material::parse(&Source { path: "weave.toml".into(), text }).unwrap().build().unwrap()
    }

    #[test]
    fn on_their_own_surface_the_samples_are_where_they_were_drawn() {
        let small = weave(0.42);
        let common = CommonSamples::new(&small, 1024, 7);
        let (surface, facets) = common.on(&small).unwrap();
        assert_eq!(surface.triangles, common.surface.triangles);
        assert_eq!(facets.weight, common.facets.weight);
        for (a, b) in facets.position.iter().zip(&common.facets.position) {
            assert!(a.distance(*b) < 1e-9, "{a} and {b}");
        }
    }

    #[test]
    fn on_a_changed_surface_they_stand_for_its_area() {
        let common = CommonSamples::new(&weave(0.42), 4096, 7);
        let small = weave(0.40);
        let (surface, facets) = common.on(&small).unwrap();
        let sampled = facets.weight.iter().map(|&w| f64::from(w)).sum::<f64>() / common.samples() as f64;
        let area = surface.areas.iter().sum::<f64>() / surface.footprint();
        assert!((sampled / area - 1.0).abs() < 2e-3, "{sampled} and {area}");
    }

    #[test]
    fn other_triangles_are_told() {
        let common = CommonSamples::new(&weave(0.42), 64, 0);
        let mut small = weave(0.42);
        small.surface_of_triangle.pop();
        assert!(common.on(&small).is_none());
    }
}
