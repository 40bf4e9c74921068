//! The matrix `N`: which normals are seen from both directions of a pair (Wu et al. 2011, eq. 11).
//!
//! `N[k][j] = sum over the facets whose normal counts as n_j, of V(wi_k) V(wo_k) dA`, in units of the footprint `A`. A pair and its reverse
//! share a row. With colour weights by facet each normal has three columns, one a channel (section 3.7).

use super::choices::Normals;
use super::map::Map;
use crate::facets::{Facets, NO_TRIANGLE};
use crate::numerics::cast::truncate_usize;
use crate::visibility::Bits;
use glam::DVec3;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Normals that facets of one surface count as.
#[derive(Clone, Debug, PartialEq)]
pub struct Bins {
    /// Unit normal of each.
    pub normals: Vec<DVec3>,
    /// The map's cell of each.
    pub cells: Vec<usize>,
    /// Area over the footprint of the facets of each.
    pub areas: Vec<f64>,
    /// The surface's facets.
    range: Range<usize>,
    /// For each facet of `range` its bin, and the area over the footprint that it stands for: 0 for those that only fill up.
    members: Vec<(u32, f64)>,
}

impl Bins {
    /// Bins of the facets `range`, those of one surface, which start at a word of the visibility bits; `map` covers the sphere. Only normals
    /// that occur have a bin, in the order of the map's cells.
    pub fn new(facets: &Facets, range: Range<usize>, map: &Map, normals: Normals) -> Self {
        let mut nearest: FxHashMap<[u32; 3], usize> = FxHashMap::default();
        let mut cell_of: Vec<Option<usize>> = Vec::with_capacity(range.len());
        let mut used = vec![false; map.directions.len()];
        for f in range.clone() {
            cell_of.push((facets.triangle[f] != NO_TRIANGLE).then(|| {
                let n = facets.normal_of(f);
                // Facets of one triangle have the same bits.
                let cell = *nearest.entry(n.to_array().map(f32::to_bits)).or_insert_with(|| map.nearest(n.as_dvec3()));
                used[cell] = true;
                cell
            }));
        }
        let cells: Vec<usize> = (0..used.len()).filter(|&c| used[c]).collect();
        let (mut areas, mut sums) = (vec![0.0; cells.len()], vec![DVec3::ZERO; cells.len()]);
        let members = range
            .clone()
            .zip(cell_of)
            .map(|(f, cell)| {
                let Some(cell) = cell else { return (0, 0.0) };
                let bin = cells.binary_search(&cell).expect("every cell of a facet is used");
                let area = f64::from(facets.weight[f]) / facets.samples as f64;
                areas[bin] += area;
                sums[bin] += facets.normal_of(f).as_dvec3() * area;
                (u32::try_from(bin).expect("cells are counted in u32"), area)
            })
            .collect();
        let normal = |(&cell, sum): (&usize, &DVec3)| match normals {
            Normals::Nearest => map.directions[cell],
            Normals::Means => sum.try_normalize().unwrap_or(map.directions[cell]),
        };
        Self { normals: cells.iter().zip(&sums).map(normal).collect(), cells, areas, range, members }
    }

    /// Columns of `N`: one a bin, or three where facets have colour weights of their own.
    pub fn columns(&self, facets: &Facets) -> usize {
        self.normals.len() * if facets.tint.is_some() { 3 } else { 1 }
    }

    /// Writes the row of `N` of a pair whose directions have the rows `i` and `o` of `bits`.
    pub fn write_row(&self, facets: &Facets, bits: &Bits, [i, o]: [usize; 2], row: &mut [f64]) {
        row.fill(0.0);
        let words = self.range.start / 64..self.range.end.div_ceil(64);
        let (seen_i, seen_o) = (&bits.row(i)[words.clone()], &bits.row(o)[words]);
        for (word, (a, b)) in seen_i.iter().zip(seen_o).enumerate() {
            let mut seen = a & b;
            while seen != 0 {
                let k = 64 * word + seen.trailing_zeros() as usize;
                seen &= seen - 1;
                let (bin, area) = self.members[k];
                match &facets.tint {
                    None => row[bin as usize] += area,
                    Some(tint) => {
                        for (c, channel) in tint.iter().enumerate() {
                            row[3 * bin as usize + c] += area * f64::from(channel[self.range.start + k]);
                        }
                    }
                }
            }
        }
    }
}

/// How pairs of directions of a grid are counted as rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PairRows {
    /// Directions of the grid.
    pub count: usize,
    /// Whether a pair and its reverse share a row.
    pub reciprocal: bool,
}

impl PairRows {
    /// Rows.
    pub fn rows(self) -> usize {
        if self.reciprocal { self.count * (self.count + 1) / 2 } else { self.count * self.count }
    }

    /// Row of two directions: pairs `a <= b` in the order `(0,0) (0,1) (1,1) (0,2)...`, or all pairs.
    pub fn row_of(self, a: usize, b: usize) -> usize {
        if !self.reciprocal {
            return a * self.count + b;
        }
        let (low, high) = (a.min(b), a.max(b));
        high * (high + 1) / 2 + low
    }

    /// The two directions of a row, as [`PairRows::row_of`] counts them.
    pub fn directions_of(self, row: usize) -> [usize; 2] {
        if !self.reciprocal {
            return [row / self.count, row % self.count];
        }
        // A root of a whole number, which rounding may put on either side.
        let mut high = truncate_usize(((8.0 * row as f64 + 1.0).sqrt() - 1.0) / 2.0);
        while high * (high + 1) / 2 > row {
            high -= 1;
        }
        while (high + 1) * (high + 2) / 2 <= row {
            high += 1;
        }
        [row - high * (high + 1) / 2, high]
    }
}

#[cfg(test)]
mod tests {
    use super::super::choices::Choices;
    use super::*;
    use crate::facets::{Density, Runs, Surface, sample};
    use crate::filter::plan::Variant;
    use crate::material::{Material, SmallScale};
    use crate::numerics::randomized_svd::{Factors, Params, Rows, factor};
    use crate::visibility::raster;
    use std::path::Path;

    /// A tile of the tests with its facets and what they see of a grid.
    struct Seen {
        small: SmallScale,
        facets: Facets,
        bits: Bits,
        map: Map,
    }

    fn seen(tile: &str, variant: Variant) -> Seen {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/data/truth/{tile}.toml"));
        let small = Material::load(&path).unwrap().build().unwrap();
        let surface = Surface::new(&small, None);
        let facets = sample(&small, &surface, &Density::uniform(&surface), Runs::of_block(0, 2048, 0, 1), 3);
        let map = Map::hemisphere(Choices::of(variant).projection, 12);
        let words = facets.triangle.len() / 64;
        let mut bits = Bits { words, rows: vec![0; words * map.directions.len()] };
        for (row, &w) in bits.rows.chunks_mut(words).zip(&map.directions) {
            raster::visible(&surface, &facets, w, &mut raster::Scratch::default(), row);
        }
        Seen { small, facets, bits, map }
    }

    /// Sums over `rows` of N of `f(n, wi, wo)` with N itself or its factors, and facet by facet with their own normals.
    fn sums(seen: &Seen, bins: &Bins, n: &dyn Fn(usize, usize) -> f64) -> (Vec<f64>, Vec<f64>) {
        let brdf = &seen.small.surfaces[0].brdf;
        let f = |n: DVec3, i: DVec3, o: DVec3| brdf.eval(n, i, o)[0] * n.dot(i).max(0.0) * n.dot(o).max(0.0);
        let pairs = PairRows { count: seen.map.directions.len(), reciprocal: true };
        (0..pairs.rows())
            .map(|k| {
                let [a, b] = pairs.directions_of(k);
                let (i, o) = (seen.map.directions[a], seen.map.directions[b]);
                let binned: f64 = bins.normals.iter().enumerate().map(|(j, &normal)| n(k, j) * f(normal, i, o)).sum();
                let mut single = 0.0;
                for facet in (0..seen.facets.triangle.len()).filter(|&x| seen.facets.triangle[x] != NO_TRIANGLE) {
                    if (seen.bits.row(a)[facet / 64] & seen.bits.row(b)[facet / 64]) >> (facet % 64) & 1 == 1 {
                        let area = f64::from(seen.facets.weight[facet]) / seen.facets.samples as f64;
                        single += area * f(seen.facets.normal_of(facet).as_dvec3(), i, o);
                    }
                }
                (binned, single)
            })
            .unzip()
    }

    fn relative_rms(found: &[f64], truth: &[f64]) -> f64 {
        let (mut difference, mut energy) = (0.0, 0.0);
        for (a, b) in found.iter().zip(truth) {
            difference += (a - b) * (a - b);
            energy += b * b;
        }
        f64::sqrt(difference / energy)
    }

    /// Errors of eq. 8 with the whole of N, and of eq. 12 with its factors, against sums facet by facet; and the factors.
    fn errors(tile: &str, variant: Variant) -> (f64, f64, Factors) {
        let (seen, choices) = (seen(tile, variant), Choices::of(variant));
        let bins = Bins::new(&seen.facets, 0..seen.facets.triangle.len(), &Map::sphere(choices.projection, 16), choices.normals);
        let columns = bins.columns(&seen.facets);
        let pairs = PairRows { count: seen.map.directions.len(), reciprocal: true };
        let write = |rows: Range<usize>, out: &mut [f64]| {
            for (k, row) in rows.zip(out.chunks_exact_mut(columns)) {
                bins.write_row(&seen.facets, &seen.bits, pairs.directions_of(k), row);
            }
        };
        let rows = pairs.rows();
        let mut table = vec![0.0; rows * columns];
        write(0..rows, &mut table);
        let params = Params { iteration: choices.iteration, seed: 1, ..Params::default() };
        let factors = factor(&Rows { rows, columns, write: &write }, &params, &|| Ok(())).unwrap();
        let (whole, truth) = sums(&seen, &bins, &|k, j| table[k * columns + j]);
        let (low, _) = sums(&seen, &bins, &|k, j| factors.entry(k, j));
        (relative_rms(&whole, &truth), relative_rms(&low, &truth), factors)
    }

    #[test]
    fn rows_and_pairs_of_directions_are_counted_alike() {
        for reciprocal in [true, false] {
            let pairs = PairRows { count: 100, reciprocal };
            for row in 0..pairs.rows() {
                let [a, b] = pairs.directions_of(row);
                assert!(a < 100 && b < 100 && pairs.row_of(a, b) == row, "row {row}: {a}, {b}");
                assert_eq!(pairs.row_of(b, a) == row, reciprocal || a == b, "row {row}: {a}, {b}");
            }
        }
    }

    #[test]
    fn grooves_have_few_normals_whose_means_are_exact_and_n_has_their_rank() {
        let (whole, low, factors) = errors("vgroove.diffuse", Variant::Improved);
        assert!(whole < 1e-6, "{whole}");
        // 99.5 % of the power of N: at most 7 % of its norm is cut.
        assert!(low < 0.05, "{low}");
        assert!(factors.rank() <= 2, "two normals, rank {}", factors.rank());
        let (whole, _, _) = errors("vgroove.diffuse", Variant::Paper);
        assert!(whole > 1e-3, "nearest normals of a coarse map must show: {whole}");
    }

    #[test]
    fn a_height_field_keeps_its_sums_within_what_bins_and_cuts_cost() {
        let (paper, paper_low, factors) = errors("bumpy.diffuse", Variant::Paper);
        assert!(factors.rank() < 50 && factors.energy >= 0.995, "rank {}, energy {}", factors.rank(), factors.energy);
        let (improved, improved_low, _) = errors("bumpy.diffuse", Variant::Improved);
        // Measured: .0118 and .0133; .0034 and .0037.
        assert!(paper < 0.02 && paper_low < 0.02, "paper: {paper}, low rank {paper_low}");
        assert!(improved < 0.006 && improved_low < 0.006, "improved: {improved}, low rank {improved_low}");
    }
}
