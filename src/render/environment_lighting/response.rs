//! How a material answers light from all around, as numbers that sum incident light to radiance.
//!
//! ```text
//! L(wo) cos_o = Σ_d T(d, wo) L_d + Σ_j E_j(wo) P_j(wo)
//! ```
//!
//! `L_d` is the radiance that arrives in texel `d` of the upper hemisphere. `P_j` is the mean radiance under lobe `j`, a lobe of half vectors that the viewer turns about
//! (`half_vectors`), and `E_j` the share of light that it reflects. `T` is what the lobes leave of `n = fbar cos_o` (`S`, where the tile has gaps; see
//! [`query_table`](super::super::query_table)), integrated over the texel: whatever the lobes are, the two sums have the integral of `n` over all directions, so that a
//! lobe which fits badly costs sharpness and no light. Without sharp lobes `T` is all.
//!
//! The numbers stand at the nodes of a [`HemisphereGrid`] of viewers and are interpolated between them.

use super::super::query_table::stand_ins;
use super::half_vectors::HalfVectorLobe;
use super::octahedron::hemisphere_texels;
use crate::direction::Pair;
use crate::error::{Error, Result};
use crate::filter::{Effective, Value};
use crate::numerics::cast::truncate_usize;
use crate::numerics::non_negative::non_negative_least_squares;
use crate::table::HemisphereGrid;
use glam::{DVec2, DVec3, DVec4, Vec4};
use rayon::prelude::*;

/// How fine a response is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fineness {
    /// Rings of the grid of viewers.
    pub rings: usize,
    /// Texels along a side of the hemisphere.
    pub side: usize,
}

/// The numbers of one viewer.
#[derive(Clone, Debug)]
pub struct Row {
    /// `T` of each texel if no lobe is kept.
    pub whole: Vec<Vec4>,
    /// `T` of each texel beside the lobes; empty without any.
    pub rest: Vec<Vec4>,
    /// `E` of each lobe.
    pub lobes: Vec<Vec4>,
}

/// Source of effective values.
pub type Values<'a> = dyn FnMut(&[Pair]) -> Result<Effective> + 'a;

/// What rows are made of.
pub struct Rows<'a> {
    /// The viewers.
    pub grid: HemisphereGrid,
    stand_ins: Vec<(DVec3, f64)>,
    texels: Vec<(DVec3, f64)>,
    side: usize,
    /// All lobes of the fit, the ones that are kept first.
    lobes: &'a [HalfVectorLobe],
    kept: usize,
    opaque: bool,
}

impl<'a> Rows<'a> {
    /// For a material with these lobes, of which the first `kept` are kept.
    pub fn new(fineness: Fineness, (lobes, kept): (&'a [HalfVectorLobe], usize), opaque: bool) -> Self {
        let grid = HemisphereGrid::new(fineness.rings);
        let stand_ins = stand_ins(&grid);
        Self { grid, stand_ins, texels: hemisphere_texels(fineness.side), side: fineness.side, lobes, kept, opaque }
    }

    /// The lobes that are kept.
    pub fn kept(&self) -> &[HalfVectorLobe] {
        &self.lobes[..self.kept]
    }

    /// The texels: middles and solid angles.
    pub fn texels(&self) -> &[(DVec3, f64)] {
        &self.texels
    }

    /// The rows of some nodes.
    ///
    /// # Errors
    /// Those of `values`.
    pub fn of(&self, nodes: &[usize], values: &mut Values<'_>) -> Result<Vec<Row>> {
        let directions: Vec<Vec<DVec3>> = nodes.iter().map(|&node| self.directions(self.stand_ins[node].0)).collect();
        let pairs: Vec<Pair> = nodes
            .iter()
            .zip(&directions)
            .flat_map(|(&node, directions)| directions.iter().map(move |&wi| Pair { wi, wo: self.stand_ins[node].0 }))
            .collect();
        let result = values(&pairs)?;
        let mut starts = vec![0];
        directions.iter().for_each(|d| starts.push(starts[starts.len() - 1] + d.len()));
        let row = |at: usize| self.row(nodes[at], &directions[at], &result.values[starts[at]..starts[at + 1]]);
        (0..nodes.len()).into_par_iter().map(row).collect()
    }

    /// Where a viewer's values are computed: the middles of the texels, and where its lobes are.
    fn directions(&self, wo: DVec3) -> Vec<DVec3> {
        let draws = self.lobes[..self.kept].iter().flat_map(|l| l.draws(wo));
        self.texels.iter().map(|t| t.0).chain(draws).collect()
    }

    fn row(&self, node: usize, directions: &[DVec3], values: &[Value]) -> Result<Row> {
        let (wo, factor) = self.stand_ins[node];
        let number = |v: &Value| DVec3::from(if self.opaque { v.fbar.map(|f| factor * f * wo.z) } else { v.s.map(|s| factor * s) });
        let numbers: Vec<DVec3> = values.iter().map(number).collect();
        if numbers.iter().any(|n| !n.is_finite()) {
            return Err(Error::Numeric("an effective value is not finite; please report this".to_owned()));
        }
        let texel = |(n, t): (&DVec3, &(DVec3, f64))| (t.1 * *n).extend(0.0).as_vec4();
        let whole = numbers.iter().zip(&self.texels).map(texel).collect();
        if self.kept == 0 {
            return Ok(Row { whole, rest: Vec::new(), lobes: Vec::new() });
        }
        let sampled = Sampled::new(self, wo, directions);
        let amplitudes = sampled.amplitudes(&numbers);
        let mut rest = vec![DVec4::ZERO; self.texels.len()];
        for (s, n) in numbers.iter().enumerate() {
            let lobes: DVec3 = (0..self.kept).map(|j| amplitudes[j] * sampled.columns[j][s]).sum();
            rest[sampled.texel[s]] += (sampled.weights[s] * (*n - lobes)).extend(0.0);
        }
        let energy = |j: usize| (amplitudes[j] * self.lobes[j].incident_integral(wo)).extend(0.0).as_vec4();
        Ok(Row { whole, rest: rest.iter().map(|v| v.as_vec4()).collect(), lobes: (0..self.kept).map(energy).collect() })
    }

    fn texel_of(&self, w: DVec3) -> usize {
        let place = super::octahedron::hemisphere_place(w.as_vec3()).as_dvec2();
        let at = (0.5 * (place + 1.0) * self.side as f64).clamp(DVec2::ZERO, DVec2::splat((self.side - 1) as f64));
        truncate_usize(at.y) * self.side + truncate_usize(at.x)
    }
}

/// A viewer's directions as quadrature: with the balance heuristic (Veach and Guibas 1995) between one direction a texel and those drawn from lobes.
struct Sampled {
    /// Solid angle that each direction stands for.
    weights: Vec<f64>,
    texel: Vec<usize>,
    /// Value of each lobe, and of a cosine, at each direction.
    columns: Vec<Vec<f64>>,
}

impl Sampled {
    fn new(rows: &Rows<'_>, wo: DVec3, directions: &[DVec3]) -> Self {
        let halves: Vec<DVec3> = directions.iter().map(|wi| (*wi + wo).normalize()).collect();
        let middles = rows.texels.len();
        let texel: Vec<usize> = directions.iter().enumerate().map(|(at, w)| if at < middles { at } else { rows.texel_of(*w) }).collect();
        let weight = |(h, &texel): (&DVec3, &usize)| {
            let drawn: f64 = rows.lobes[..rows.kept].iter().map(|l| l.draws_density(wo, *h)).sum();
            1.0 / (1.0 / rows.texels[texel].1 + drawn)
        };
        let weights = halves.iter().zip(&texel).map(weight).collect();
        let mut columns: Vec<Vec<f64>> = rows.lobes.iter().map(|l| halves.iter().map(|h| l.eval(*h)).collect()).collect();
        columns.push(directions.iter().map(|w| w.z).collect());
        Self { weights, texel, columns }
    }

    /// Amplitudes of all columns: non-negative least squares over solid angle, a channel at a time.
    fn amplitudes(&self, numbers: &[DVec3]) -> Vec<DVec3> {
        let count = self.columns.len();
        let dot =
            |a: &[f64], b: &dyn Fn(usize) -> f64| a.iter().zip(&self.weights).enumerate().map(|(s, (a, w))| w * a * b(s)).sum::<f64>();
        let matrix: Vec<f64> = (0..count * count).map(|k| dot(&self.columns[k / count], &|s| self.columns[k % count][s])).collect();
        let mut amplitudes = vec![DVec3::ZERO; count];
        for channel in 0..3 {
            let right: Vec<f64> = self.columns.iter().map(|c| dot(c, &|s| numbers[s][channel])).collect();
            for (amplitude, a) in amplitudes.iter_mut().zip(non_negative_least_squares(&matrix, &right)) {
                amplitude[channel] = a;
            }
        }
        amplitudes
    }
}
