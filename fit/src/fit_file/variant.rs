//! What differs between searches beside numbers that move smoothly: which surface each cluster of the close-up is, and how many flat sides threads have.
//!
//! Real threads are round; those of a computed photograph may have few sides, and what a flat side sends into one direction differs from what
//! a round one does by several per cent. Neither is a matter of bounds: starts are dealt out to all variants, and the photographs choose.

use crate::fit_file::assignment::Assignment;
use biscale::geometry::Geometry;

/// Sides of a thread's section that are tried where the fit file names none: few enough that they show one by one, and so many that they do not.
pub const SIDES: [u32; 2] = [8, 32];
/// Key of the number of sides in the `[geometry]` table.
pub const SIDES_KEY: &str = "segments";
/// Numbers of sides whose ratio is below this are alike.
const ALIKE: f64 = 1.4;

/// One way to read the photographs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Variant {
    /// Which surface each cluster of the close-up is.
    pub clusters: Vec<usize>,
    /// Sides of a thread's section; `None` for those of the start material.
    pub sides: Option<u32>,
}

impl Variant {
    /// What it sets in the material.
    pub fn assignment(&self) -> Option<Assignment> {
        self.sides.map(|sides| Assignment::Whole(SIDES_KEY, sides))
    }
}

/// The number of sides that a geometry's threads or rods have.
pub fn own_sides(geometry: &Geometry) -> Option<u32> {
    match geometry {
        Geometry::Weave(weave) => Some(weave.segments),
        Geometry::Rods(rods) => Some(rods.segments),
        _ => None,
    }
}

/// The numbers of sides that are tried by default: the start material's own, and [`SIDES`] where they are others; none where nothing of the geometry moves.
pub fn default_sides(geometry: &Geometry, moves: bool) -> Vec<u32> {
    let Geometry::Weave(weave) = geometry else { return Vec::new() };
    if !moves {
        return Vec::new();
    }
    let alike = |a: u32, b: u32| f64::from(a.max(b)) < ALIKE * f64::from(a.min(b));
    let own = weave.segments;
    std::iter::once(own).chain(SIDES.into_iter().filter(|&s| !alike(s, own) && (s == SIDES[0] || own < s))).collect()
}

/// All ways to read the photographs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variants {
    /// The likeliest first.
    pub all: Vec<Variant>,
    /// How many of them the start material's colours do not rule out.
    pub likely: usize,
}

impl Variants {
    /// For readings of the close-up that are likely and for the rest of them: all numbers of `sides` with the first reading, then with the
    /// next. `own` is the number of the start material, which need not be set.
    pub fn new(sides: &[u32], own: Option<u32>, likely: &[Vec<usize>], rest: &[Vec<usize>]) -> Self {
        let sides: Vec<Option<u32>> =
            if sides.is_empty() { vec![None] } else { sides.iter().map(|&s| Some(s).filter(|_| own != Some(s))).collect() };
        let one = |clusters: &Vec<usize>| sides.iter().map(|&sides| Variant { clusters: clusters.clone(), sides }).collect::<Vec<_>>();
        Self { all: likely.iter().chain(rest).flat_map(one).collect(), likely: likely.len() * sides.len() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::material::Material;
    use biscale::toml_reader::Source;

    fn weave(segments: u32) -> Geometry {
        let text = format!(
            "format = 1\n[geometry]\nkind = \"weave\"\nsegments = {segments}\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\n"
        );
        Material::parse(&Source { path: "m.toml".into(), text }).unwrap().geometry
    }

    #[test]
    fn a_threads_own_sides_come_first_and_those_that_are_alike_are_not_tried_twice() {
        for (own, tried) in
            [(16, vec![16, 8, 32]), (8, vec![8, 32]), (10, vec![10, 32]), (24, vec![24, 8]), (48, vec![48, 8]), (4, vec![4, 8, 32])]
        {
            assert_eq!(default_sides(&weave(own), true), tried);
        }
        assert!(default_sides(&weave(16), false).is_empty());
    }
}
