//! Amplitudes by least squares (Iwasaki et al. 2012, eq. 8): those that come nearest to `gamma (n·wi)+ (n·wo)+` over the sphere.
//!
//! `A mu = b` with the lobes' Gram matrix `A` and `b_j` the sum of `gamma (n·wi)+ (n·wo)+ G_j(n) dA` over the facets.

use crate::filter::plan::AmplitudeFit;
use crate::numerics::cast::narrow;
use crate::numerics::linear_algebra::Cholesky;
use crate::numerics::non_negative::non_negative_least_squares;
use crate::sg::Lobe;

/// Share of its diagonal that is added to a Gram matrix: its elements are in f32, and lobes may nearly coincide.
const RIDGE: f64 = 1e-6;

/// Least squares for the amplitudes of lobes.
pub struct LeastSquares {
    /// Gram matrix of the lobes with amplitude 1.
    gram: Vec<f64>,
    /// Its factor, where amplitudes may be negative.
    factor: Option<Cholesky>,
    /// Integrals of the lobes.
    integrals: Vec<f64>,
}

impl LeastSquares {
    /// For lobes with an integral of 1.
    pub fn new(densities: &[Lobe], fit: AmplitudeFit) -> Self {
        let peaks: Vec<Lobe> = densities.iter().map(|lobe| Lobe { amplitude: 1.0, ..*lobe }).collect();
        let mut gram: Vec<f64> = peaks.iter().flat_map(|a| peaks.iter().map(|b| f64::from(a.product_integral(b)))).collect();
        let integrals = densities.iter().map(|lobe| 1.0 / f64::from(lobe.amplitude)).collect();
        let mut ridge = RIDGE;
        (0..peaks.len()).for_each(|k| gram[k * peaks.len() + k] *= 1.0 + ridge);
        if fit == AmplitudeFit::NonNegative {
            return Self { gram, factor: None, integrals };
        }
        // Lobes that coincide as far as f32 tells need more of it; a matrix whose diagonal is large enough has a factor.
        let factor = loop {
            if let Some(factor) = Cholesky::new(&gram, peaks.len()) {
                break factor;
            }
            ridge *= 10.0;
            (0..peaks.len()).for_each(|k| gram[k * peaks.len() + k] *= 1.0 + ridge);
        };
        Self { gram, factor: Some(factor), integrals }
    }

    /// Writes the area that each lobe has, from the sums `b`.
    pub fn solve(&self, b: &[f64], areas: &mut [f32]) {
        let solution = match &self.factor {
            Some(factor) => factor.solve(b),
            None => non_negative_least_squares(&self.gram, b),
        };
        for ((area, x), integral) in areas.iter_mut().zip(solution).zip(&self.integrals) {
            *area = narrow(x * integral);
        }
    }
}
