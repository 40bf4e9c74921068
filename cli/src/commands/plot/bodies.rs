//! Bodies that stand by themselves, such as the rods of a pile. A block cuts off the tops of those that stand outside and lean in, and nothing would hold
//! these pieces: of such a body the block holds the copies that stand in it.

use biscale::geometry::Tile;
use glam::{DVec2, DVec3};
use std::collections::HashMap;

/// For each triangle of a tile where its body stands, if the body joins none of its own copies.
pub struct Bodies {
    feet: Vec<Option<DVec2>>,
    period: DVec2,
}

impl Bodies {
    /// The bodies of a tile: triangles that share corners.
    pub fn new(tile: &Tile) -> Self {
        let mut of_place: HashMap<[u64; 3], u32> = HashMap::new();
        // Vertices at one place are one.
        let places: Vec<u32> =
            (0_u32..).zip(&tile.vertices).map(|(k, v)| *of_place.entry(v.to_array().map(f64::to_bits)).or_insert(k)).collect();
        let corners = |t: &[u32; 3]| t.map(|v| places[v as usize]);
        let mut parent: Vec<u32> = (0_u32..).take(tile.vertices.len()).collect();
        for triangle in &tile.triangles {
            let [a, b, c] = corners(triangle).map(|v| root(&mut parent, v));
            let least = a.min(b).min(c);
            for v in [a, b, c] {
                parent[v as usize] = least;
            }
        }
        let roots: Vec<u32> = tile.triangles.iter().map(|t| root(&mut parent, corners(t)[0])).collect();
        let mut bodies: HashMap<u32, Body> = HashMap::new();
        for (triangle, root) in tile.triangles.iter().zip(&roots) {
            let body = bodies.entry(*root).or_default();
            triangle.iter().for_each(|&v| body.add(tile.vertices[v as usize]));
        }
        let foot =
            |root: &u32| bodies.get(root).filter(|body| (body.high - body.low).cmplt(tile.period).all()).map(|body| body.lowest.truncate());
        Self { feet: roots.iter().map(foot).collect(), period: tile.period }
    }

    /// Whether the copy of a triangle that has `position` belongs to what stands between `low` and `high`; `centre` is that of the triangle in the tile.
    pub fn stands_in(&self, triangle: usize, centre: DVec3, position: DVec3, [low, high]: [DVec2; 2]) -> bool {
        let Some(foot) = self.feet[triangle] else { return true };
        let copy = ((position - centre).truncate() / self.period).round();
        let foot = foot + copy * self.period;
        foot.cmpge(low).all() && foot.cmple(high).all()
    }
}

/// The extent of a body, and its lowest point.
struct Body {
    low: DVec2,
    high: DVec2,
    lowest: DVec3,
}

impl Default for Body {
    fn default() -> Self {
        Self { low: DVec2::INFINITY, high: DVec2::NEG_INFINITY, lowest: DVec3::INFINITY }
    }
}

impl Body {
    fn add(&mut self, v: DVec3) {
        (self.low, self.high) = (self.low.min(v.truncate()), self.high.max(v.truncate()));
        if v.z < self.lowest.z {
            self.lowest = v;
        }
    }
}

/// The root of a vertex in a forest whose paths are halved on the way.
fn root(parent: &mut [u32], mut v: u32) -> u32 {
    while parent[v as usize] != v {
        parent[v as usize] = parent[parent[v as usize] as usize];
        v = parent[v as usize];
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::material::Material;
    use biscale::toml_reader::Source;

    fn tile(geometry: &str) -> Tile {
        let text =
            format!("format = 1\n[geometry]\n{geometry}\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\n");
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.toml");
        std::fs::write(&path, text).unwrap();
        Material::parse(&Source::read(&path).unwrap()).unwrap().build().unwrap().tile
    }

    #[test]
    fn rods_stand_by_themselves_and_ground_and_threads_do_not() {
        let tile_of_rods = tile("kind = \"rods\"\ncount = 5");
        let bodies = Bodies::new(&tile_of_rods);
        let mut feet: Vec<[u64; 2]> = Vec::new();
        for (foot, part) in bodies.feet.iter().zip(&tile_of_rods.part_of_triangle) {
            assert_eq!(foot.is_some(), tile_of_rods.parts[usize::from(*part)] == "rods");
            feet.extend(foot.map(|f| f.to_array().map(f64::to_bits)));
        }
        feet.sort_unstable();
        feet.dedup();
        assert_eq!(feet.len(), 5, "a foot for each rod, caps included");
        assert!(Bodies::new(&tile("kind = \"weave\"")).feet.iter().all(Option::is_none));
        assert!(Bodies::new(&tile("kind = \"pyramids\"")).feet.iter().all(Option::is_none));
    }

    #[test]
    fn a_copy_belongs_to_the_block_that_it_stands_in() {
        let bodies = Bodies { feet: vec![Some(DVec2::new(0.9, 0.5)), None], period: DVec2::ONE };
        let centre = DVec3::new(1.1, 0.5, 0.3);
        let block = [DVec2::ZERO, DVec2::splat(2.0)];
        // Copies in the first and second period stand in the block, the top that leans in from before it does not.
        for (x, stands) in [(1.12, true), (2.08, true), (0.1, false)] {
            assert_eq!(bodies.stands_in(0, centre, DVec3::new(x, 0.5, 0.3), block), stands, "{x}");
        }
        assert!(bodies.stands_in(1, centre, DVec3::ZERO, block));
    }
}
