//! Polynomial texture maps: each texel is a polynomial of the light's direction (Malzbender, Gelb and Wolters 2001; Bosserhoff and Nicoll (001), section 3.1).
//!
//! `value(lx, ly) = a0 lx² + a1 ly² + a2 lx ly + a3 lx + a4 ly + a5`, where `lx`, `ly` are the light's components along the plane. The least-squares fit of all
//! texels shares one matrix, that of the lights: its singular value decomposition is made once, and each texel is a product of it with the texel's values.

use crate::error::BadInput;
use crate::numerics::cast::narrow;
use crate::numerics::colour::luminance;
use crate::numerics::linear_algebra::{largest_eigenvectors, symmetric_eigenvalues};
use glam::DVec3;
use rayon::prelude::*;

/// Coefficients of a texel, in the order of PTM 1.2 files.
pub const TERMS: usize = 6;
/// Singular values below this share of the largest one are taken for 0: what lights do not tell apart is not told by noise. Chosen, not measured; the 41 lights of a
/// weave have a condition of 5.7.
const LEAST_SINGULAR: f64 = 1e-3;
/// Texels of a block, whose sums stay in registers and the nearest cache.
const BLOCK: usize = 64;

/// What each coefficient is multiplied by under a light.
pub fn terms(light: DVec3) -> [f64; TERMS] {
    let DVec3 { x, y, .. } = light;
    [x * x, y * y, x * y, x, y, 1.0]
}

/// Lights, and how values under them become coefficients.
#[derive(Clone, Debug, PartialEq)]
pub struct LightFit {
    /// By light what coefficients are multiplied by.
    terms: Vec<[f64; TERMS]>,
    /// By light what its value adds to each coefficient: a row of the pseudoinverse.
    weights: Vec<[f64; TERMS]>,
    /// Singular values of the matrix of the lights' terms, the largest first.
    pub singular_values: [f64; TERMS],
    /// How many of them were used.
    pub rank: usize,
}

impl LightFit {
    /// Of lights, unit vectors.
    ///
    /// # Errors
    /// Bad input without lights, or with one that is no direction.
    pub fn new(lights: &[DVec3]) -> Result<Self, BadInput> {
        if lights.is_empty() || lights.iter().any(|l| !l.is_finite()) {
            return Err(BadInput::new("a polynomial needs lights, each with a direction", "name the directions of the lights"));
        }
        let rows: Vec<[f64; TERMS]> = lights.iter().map(|&l| terms(l)).collect();
        let mut gram = vec![0.0; TERMS * TERMS];
        for row in &rows {
            for i in 0..TERMS {
                (0..TERMS).for_each(|j| gram[i * TERMS + j] += row[i] * row[j]);
            }
        }
        let mut values = symmetric_eigenvalues(&gram, TERMS);
        values.reverse();
        let singular_values = std::array::from_fn(|k| values[k].max(0.0).sqrt());
        let rank = singular_values.iter().filter(|s| **s > LEAST_SINGULAR * singular_values[0]).count();
        let vectors = largest_eigenvectors(&gram, TERMS, rank)
            .ok_or_else(|| BadInput::new("the lights' directions make no matrix that can be decomposed", "check them"))?;
        let weight = |row: &[f64; TERMS]| {
            let mut weight = [0.0; TERMS];
            for (vector, value) in vectors.iter().zip(&values) {
                let along: f64 = vector.iter().zip(row).map(|(v, r)| v * r).sum();
                (0..TERMS).for_each(|k| weight[k] += vector[k] * along / value);
            }
            weight
        };
        Ok(Self { weights: rows.iter().map(weight).collect(), terms: rows, singular_values, rank })
    }
}

/// The colours of a polynomial texture map.
#[derive(Clone, Debug, PartialEq)]
pub enum PtmColours {
    /// A polynomial for each channel.
    Rgb(Vec<[[f32; TERMS]; 3]>),
    /// A polynomial for luminance, times the texel's colour.
    Luminance {
        /// Coefficients.
        coefficients: Vec<[f32; TERMS]>,
        /// Colour over luminance.
        colour: Vec<[f32; 3]>,
    },
}

/// A polynomial texture map.
#[derive(Clone, Debug, PartialEq)]
pub struct Ptm {
    /// Texels across and along.
    pub texels: [usize; 2],
    /// Texel after texel, row 0 that of the largest y.
    pub colours: PtmColours,
}

impl Ptm {
    /// The least-squares fit of each channel; `images` is light after light, texel after texel.
    ///
    /// # Panics
    /// If there are not as many values as lights and texels.
    pub fn fit_rgb(fit: &LightFit, texels: [usize; 2], images: &[[f32; 3]]) -> Self {
        let count = texels[0] * texels[1];
        assert_eq!(images.len(), count * fit.weights.len(), "an image for each light");
        let channel = |c: usize| coefficients(fit, count, &|light, texel| images[light * count + texel][c]);
        let [r, g, b] = [0, 1, 2].map(channel);
        Self { texels, colours: PtmColours::Rgb((0..count).map(|t| [r[t], g[t], b[t]]).collect()) }
    }

    /// The least-squares fit of luminance, and for each texel the colour that then fits best: `sum C L / sum L²`.
    ///
    /// # Panics
    /// As [`Self::fit_rgb`].
    pub fn fit_luminance(fit: &LightFit, texels: [usize; 2], images: &[[f32; 3]]) -> Self {
        let count = texels[0] * texels[1];
        assert_eq!(images.len(), count * fit.weights.len(), "an image for each light");
        let coefficients = coefficients(fit, count, &|light, texel| narrow(luminance(images[light * count + texel].map(f64::from))));
        let terms: Vec<[f32; TERMS]> = fit.terms.iter().map(|terms| terms.map(narrow)).collect();
        let colour = coefficients.par_iter().enumerate().map(|(texel, own)| {
            let (mut products, mut squares) = ([0.0_f32; 3], 0.0);
            for (light, terms) in terms.iter().enumerate() {
                let value = dot(own, terms);
                let of = images[light * count + texel];
                (0..3).for_each(|c| products[c] += of[c] * value);
                squares += value * value;
            }
            if squares > 0.0 { products.map(|p| p / squares) } else { [0.0; 3] }
        });
        let colour = colour.collect();
        Self { texels, colours: PtmColours::Luminance { coefficients, colour } }
    }

    /// What is seen under a light; polynomials may be below 0.
    pub fn image(&self, light: DVec3) -> Vec<[f32; 3]> {
        let terms = terms(light).map(narrow);
        match &self.colours {
            PtmColours::Rgb(of) => of.par_iter().map(|channels| channels.map(|own| dot(&own, &terms))).collect(),
            PtmColours::Luminance { coefficients, colour } => {
                coefficients.par_iter().zip(colour).map(|(own, colour)| colour.map(|c| c * dot(own, &terms))).collect()
            }
        }
    }

    /// Relative RMS difference from what it was fitted to: `|X - X~| / |X|`, over all lights, texels and channels.
    pub fn relative_rms(&self, lights: &[DVec3], images: &[[f32; 3]]) -> f64 {
        let count = self.texels[0] * self.texels[1];
        let (mut off, mut all) = (0.0, 0.0);
        for (light, truth) in lights.iter().zip(images.chunks_exact(count)) {
            for (got, truth) in self.image(*light).iter().zip(truth) {
                for c in 0..3 {
                    off += f64::from(got[c] - truth[c]).powi(2);
                    all += f64::from(truth[c]).powi(2);
                }
            }
        }
        if all > 0.0 { (off / all).sqrt() } else { off.sqrt() }
    }
}

fn dot(a: &[f32; TERMS], b: &[f32; TERMS]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Coefficients of `count` texels, whose values under each light are those of `value`.
fn coefficients(fit: &LightFit, count: usize, value: &(dyn Fn(usize, usize) -> f32 + Sync)) -> Vec<[f32; TERMS]> {
    let mut found = vec![[0.0; TERMS]; count];
    found.par_chunks_mut(BLOCK).enumerate().for_each(|(block, found)| {
        let mut sums = [[0.0_f32; BLOCK]; TERMS];
        let mut values = [0.0_f32; BLOCK];
        for (light, weight) in fit.weights.iter().enumerate() {
            (0..found.len()).for_each(|t| values[t] = value(light, block * BLOCK + t));
            for k in 0..TERMS {
                let weight: f32 = narrow(weight[k]);
                (0..BLOCK).for_each(|t| sums[k][t] += weight * values[t]);
            }
        }
        for (t, found) in found.iter_mut().enumerate() {
            *found = std::array::from_fn(|k| sums[k][t]);
        }
    });
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::btf::DirectionSet;

    #[test]
    fn a_polynomial_is_found_again() {
        let lights = DirectionSet::named("ubo81").unwrap().directions;
        let fit = LightFit::new(&lights).unwrap();
        assert_eq!(fit.rank, 6);
        let truth: Vec<[[f32; TERMS]; 3]> =
            (0..150).map(|t| std::array::from_fn(|c| std::array::from_fn(|k| ((t * 7 + c * 5 + k * 3) % 11) as f32 - 4.0))).collect();
        let made = Ptm { texels: [15, 10], colours: PtmColours::Rgb(truth.clone()) };
        let images: Vec<[f32; 3]> = lights.iter().flat_map(|&l| made.image(l)).collect();
        let found = Ptm::fit_rgb(&fit, [15, 10], &images);
        assert!(found.relative_rms(&lights, &images) < 1e-5);
        let PtmColours::Rgb(found) = found.colours else { unreachable!("rgb was asked for") };
        for (found, truth) in found.iter().flatten().flatten().zip(truth.iter().flatten().flatten()) {
            assert!((found - truth).abs() < 1e-3, "{found} {truth}");
        }
    }

    #[test]
    fn what_lights_on_a_line_do_not_tell_is_not_made_up() {
        let lights: Vec<DVec3> = (0..9).map(|k| DVec3::new(0.2 * f64::from(k) - 0.8, 0.0, 0.5).normalize()).collect();
        let fit = LightFit::new(&lights).unwrap();
        // lx², lx and 1.
        assert_eq!(fit.rank, 3);
        let images: Vec<[f32; 3]> = lights.iter().map(|l| [0.5 + 0.25 * l.x as f32, 1.0, 0.0]).collect();
        let found = Ptm::fit_luminance(&fit, [1, 1], &images);
        let PtmColours::Luminance { coefficients, .. } = &found.colours else { unreachable!("luminance was asked for") };
        assert!(coefficients[0].iter().all(|c| c.abs() < 2.0) && coefficients[0][1].abs() < 1e-6, "{coefficients:?}");
        assert!(LightFit::new(&[]).is_err() && LightFit::new(&[DVec3::NAN]).is_err());
    }
}
