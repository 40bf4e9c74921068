//! Residuals of the distant photographs: for each direction bin and channel, measured radiance against the model's.
//!
//! ```text
//! L = E_i (sum_k S_k c_k / cos(theta_o) + I) + V
//! ```
//!
//! `S_k` is the basis reflectance of slot `k` and `c_k` its colour, `E_i` the irradiance on a plane that faces the light, `I` the
//! interreflection as radiance over irradiance, `V` the stray-light offset of the photograph.

use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::block::ResidualBlock;
use crate::residuals::colour_basis::ColourBasis;
use crate::residuals::equations::{Equations, Origin, Row};
use crate::residuals::unknowns::{Shot, UnknownKind};
use biscale::filter::BasisReflectance;

/// The distant photographs beside a state of the material.
#[derive(Clone, Copy, Debug)]
pub struct Distant<'a> {
    /// Direction bins of each photograph.
    pub photographs: &'a [DirectionBins],
    /// Basis reflectances of the bins' pairs, photograph after photograph.
    pub basis_reflectance: &'a BasisReflectance,
    /// Whether the surface has no gaps.
    pub opaque: bool,
    /// For each photograph and bin the interreflection as radiance over irradiance, if it was traced.
    pub interreflection: Option<&'a [Vec<[f64; 3]>]>,
}

impl ResidualBlock for Distant<'_> {
    fn add_to(&self, basis: &ColourBasis<'_>, equations: &mut Equations) {
        let BasisReflectance { s, av } = self.basis_reflectance;
        let mut first = 0;
        for (p, photograph) in self.photographs.iter().enumerate() {
            for (k, bin) in photograph.bins.iter().enumerate() {
                let at = first + k;
                // Over a surface without gaps the area that samples show stands for the cosine: they share their noise.
                let factor = if self.opaque && av[at] > 0.0 { bin.wo.z / av[at] } else { 1.0 } * bin.inverse_cosine;
                for c in 0..3 {
                    let scale = bin.irradiance[c] * factor;
                    let (mut terms, mut known) = basis.terms(|slot| scale * s[slot][at][c], c);
                    if let Some(interreflection) = self.interreflection {
                        known += bin.irradiance[c] * interreflection[p][k][c];
                    }
                    if let Some(offset) = basis.position(UnknownKind::StrayLight(Shot::Distant(p), c)) {
                        terms.push((offset, 1.0));
                    }
                    let row = Row { terms, known, value: bin.mean[c], sigma: bin.sigma[c], weight: bin.weight };
                    equations.rows.push((row, Origin::Bin(p, k, c)));
                }
            }
            first += photograph.bins.len();
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::photograph::direction_bins::DirectionBin;
    use crate::residuals::colour_basis::tests::Grooves;
    use crate::residuals::unknowns::Unknown;
    use glam::DVec3;

    pub fn bin(mean: f64) -> DirectionBin {
        DirectionBin {
            wi: DVec3::Z,
            wo: DVec3::new(0.6, 0.0, 0.8),
            turn: [DVec3::ZERO; 2],
            inverse_cosine: 1.25,
            irradiance: [2.0, 3.0, 4.0],
            count: 9,
            mean: [mean; 3],
            sigma: [0.1; 3],
            weight: 0.5,
        }
    }

    /// Two photographs, of one bin and of two; the basis reflectance of slot `k` in bin `b` is `k + 1 + b / 10`.
    fn rows(opaque: bool, interreflection: Option<&[Vec<[f64; 3]>]>) -> Vec<(Row, Origin)> {
        let mut grooves = Grooves::new();
        grooves.unknowns.push(Unknown { name: "offset".into(), kind: UnknownKind::StrayLight(Shot::Distant(1), 2), bounds: [0.0, 1.0] });
        let photographs = [vec![bin(0.7)], vec![bin(0.8), bin(0.9)]].map(|bins| DirectionBins { bins, ..DirectionBins::default() });
        let s = (0..2).map(|k| (0..3).map(|b| [f64::from(k) + 1.0 + 0.1 * f64::from(b); 3]).collect()).collect();
        let basis_reflectance = BasisReflectance { s, av: vec![0.5, 0.0, 0.4] };
        let block = Distant { photographs: &photographs, basis_reflectance: &basis_reflectance, opaque, interreflection };
        let mut equations = Equations::default();
        block.add_to(&grooves.basis(), &mut equations);
        assert!(equations.fixed.is_empty());
        equations.rows
    }

    #[test]
    fn a_row_is_a_channel_of_a_bin_with_its_stray_light() {
        let rows = rows(false, None);
        assert_eq!(rows.len(), 9);
        let (row, origin) = &rows[8];
        assert_eq!(*origin, Origin::Bin(1, 1, 2));
        // Irradiance 4 over the cosine .8; the offset is unknown 3.
        assert_eq!(row.terms.len(), 2);
        assert!((row.terms[0].1 - 5.0 * 2.2).abs() < 1e-12 && row.terms[1] == (3, 1.0), "{row:?}");
        assert!((row.known - 5.0 * 1.2 * 0.1).abs() < 1e-12, "{row:?}");
        assert_eq!((row.value, row.sigma, row.weight), (0.9, 0.1, 0.5));
        assert_eq!(rows[2].0.terms.len(), 1, "the first photograph has no offset");
    }

    #[test]
    fn opaque_surfaces_divide_by_the_area_that_samples_show_where_they_show_any() {
        let (open, opaque) = (rows(false, None), rows(true, None));
        let ratio = |k: usize| opaque[k].0.terms[0].1 / open[k].0.terms[0].1;
        assert!((ratio(0) - 0.8 / 0.5).abs() < 1e-12 && ratio(3) == 1.0 && (ratio(6) - 0.8 / 0.4).abs() < 1e-12);
    }

    #[test]
    fn interreflection_is_added_times_the_irradiance() {
        let interreflection = [vec![[0.0; 3]], vec![[0.0; 3], [0.1, 0.2, 0.3]]];
        let (without, with) = (rows(false, None), rows(false, Some(&interreflection)));
        for c in 0..3 {
            let added = with[6 + c].0.known - without[6 + c].0.known;
            assert!((added - [0.2, 0.6, 1.2][c]).abs() < 1e-12, "{added}");
        }
    }
}
