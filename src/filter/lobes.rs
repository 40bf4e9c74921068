//! The lobes of the small-scale BRDFs, split into what depends on one direction and what depends on both.
//!
//! `fr (n·i)(n·o)` of every analytic model is `colour(pair) · masking(n·i) · masking(n·o) · shape(n·h)`: a sum over facets needs `masking` once a
//! facet and direction and `shape` once a facet and pair, and colours and Fresnel's factor, which depends on `i·h` alone, once a
//! pair. [`Masking`] and [`Shape`] work on [`LANES`] facets in f32; `crate::brdf::Brdf::eval` is their plain twin.

use crate::brdf::{Brdf, Colour, Distribution, Measured};
use crate::numerics::cast::narrow;
use crate::simd::{LANES, Lanes};
use glam::{DVec3, Vec3};
use std::f64::consts::PI;

/// One lobe of a BRDF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lobe<'a> {
    /// Colour of the lobe, with the surface's tint.
    pub colour: Colour,
    /// Reflectance at normal incidence of Schlick's factor; without it the factor is 1.
    pub f0: Option<Colour>,
    /// What depends on one direction.
    pub masking: Masking,
    /// What depends on the half vector.
    pub shape: Shape,
    /// A table, which does not split: its values replace `masking` and `shape`.
    pub table: Option<&'a Measured>,
}

/// What depends on one direction, by its cosine with the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Masking {
    /// The cosine.
    Cosine,
    /// Its square root (Ward).
    Root,
    /// Smith's G1 for GGX, by `alpha²`.
    Ggx(f32),
    /// Smith's G1 for Beckmann, by `alpha`.
    Beckmann(f32),
}

/// What depends on the half vector `h`, up to the constant that `colour` holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// 1.
    Constant,
    /// `1 / (cos² alpha² + sin²)²`, by `alpha²`.
    Ggx(f32),
    /// `exp(-tan² / alpha²) / cos⁴`, by `1 / alpha²`.
    Beckmann(f32),
    /// `exp(-tan² / alpha²)`, by `1 / alpha²`.
    Ward(f32),
    /// `cos^e`, by `e`.
    Power(f32),
}

/// The lobes of a BRDF under a tint. Lobes that are black are left out: nothing is summed for them.
pub fn lobes(brdf: &Brdf, tint: Colour) -> Vec<Lobe<'_>> {
    let tinted = |colour: &Colour, factor: f64| std::array::from_fn(|c| colour[c] * tint[c] * factor);
    let lobe = |colour, masking, shape| Lobe { colour, f0: None, masking, shape, table: None };
    let diffuse = |colour: &Colour| lobe(tinted(colour, 1.0 / PI), Masking::Cosine, Shape::Constant);
    let mut lobes = match brdf {
        Brdf::Lambert { albedo } => vec![diffuse(albedo)],
        Brdf::BlinnPhong { diffuse: d, specular, exponent } => {
            vec![diffuse(d), lobe(tinted(specular, (exponent + 2.0) / (2.0 * PI)), Masking::Cosine, Shape::Power(narrow(*exponent)))]
        }
        Brdf::CookTorrance { diffuse: d, specular, alpha, distribution, f0 } => {
            let a2 = alpha * alpha;
            let specular = match distribution {
                Distribution::Ggx => lobe(tinted(specular, a2 / (4.0 * PI)), Masking::Ggx(narrow(a2)), Shape::Ggx(narrow(a2))),
                Distribution::Beckmann => {
                    lobe(tinted(specular, 1.0 / (4.0 * PI * a2)), Masking::Beckmann(narrow(*alpha)), Shape::Beckmann(narrow(1.0 / a2)))
                }
            };
            vec![diffuse(d), Lobe { f0: *f0, ..specular }]
        }
        Brdf::Ward { diffuse: d, specular, alpha } => {
            let a2 = alpha * alpha;
            vec![diffuse(d), lobe(tinted(specular, 1.0 / (4.0 * PI * a2)), Masking::Root, Shape::Ward(narrow(1.0 / a2)))]
        }
        Brdf::Measured(measured) => vec![Lobe { table: Some(measured), ..lobe(tint, Masking::Cosine, Shape::Constant) }],
    };
    lobes.retain(|lobe| lobe.colour != [0.0; 3]);
    lobes
}

impl Lobe<'_> {
    /// Colour of the lobe for a pair whose half vector has cosine `i_dot_h` with the light: `|wi + wo| / 2`, which has the same bits both ways round.
    pub fn colour_at(&self, i_dot_h: f64) -> Colour {
        let grazing = (1.0 - i_dot_h).clamp(0.0, 1.0).powi(5);
        std::array::from_fn(|c| self.colour[c] * self.f0.map_or(1.0, |f| f[c] + (1.0 - f[c]) * grazing))
    }

    /// `fr (n·i)+ (n·o)+` without the colour for some normals whose cosines with the directions are `cosines`, at least 0, to the light and to
    /// the viewer. Of a table, the mean of its channels.
    #[inline(always)]
    pub fn at_normals(&self, normals: &[Lanes; 3], cosines: [&Lanes; 2], [wi, wo]: [DVec3; 2], half: &Half) -> Lanes {
        let mut value = [0.0; LANES];
        if self.table.is_some() {
            let seen = (0..LANES).any(|l| cosines[0][l] > 0.0 && cosines[1][l] > 0.0);
            if seen {
                let [r, g, b] = self.table_values(normals, wi, wo);
                for l in 0..LANES {
                    let mean = (r[l] + g[l] + b[l]) / 3.0;
                    value[l] = if cosines[0][l] > 0.0 && cosines[1][l] > 0.0 { mean } else { 0.0 };
                }
            }
            return value;
        }
        let (sin2, cos2) = half_angles(normals, &[*half]);
        let [shape] = self.shape.eval(&sin2, &cos2);
        let (masking_i, masking_o) = (self.masking.eval(cosines[0]), self.masking.eval(cosines[1]));
        for l in 0..LANES {
            value[l] = if cosines[0][l] > 0.0 && cosines[1][l] > 0.0 { masking_i[l] * masking_o[l] * shape[l] } else { 0.0 };
        }
        value
    }

    /// `fr (n·i)+ (n·o)+` of a table for some normals, by channel; 0 for a lobe that is no table.
    #[inline(always)]
    pub fn table_values(&self, normals: &[Lanes; 3], wi: DVec3, wo: DVec3) -> [Lanes; 3] {
        let Some(measured) = self.table else { return [[0.0; LANES]; 3] };
        let (wi, wo) = (wi.as_vec3(), wo.as_vec3());
        let mut values = measured.eval_lanes(normals, wi, wo);
        let (cos_i, cos_o) = (cosines(normals, wi), cosines(normals, wo));
        for value in &mut values {
            for l in 0..LANES {
                value[l] *= cos_i[l].max(0.0) * cos_o[l].max(0.0);
            }
        }
        values
    }
}

/// `n·w` of some normals.
#[inline(always)]
pub fn cosines(normals: &[Lanes; 3], w: Vec3) -> Lanes {
    let mut out = [0.0; LANES];
    for l in 0..LANES {
        out[l] = normals[0][l] * w.x + normals[1][l] * w.y + normals[2][l] * w.z;
    }
    out
}

/// `sin²` and `cos²` of the angles between normals and the half vectors of `N` pairs from `n - h`, which does not cancel.
#[inline(always)]
pub fn half_angles<const N: usize>(normals: &[Lanes; 3], half: &[Half; N]) -> ([Lanes; N], [Lanes; N]) {
    let (mut sin2, mut cos2) = ([[0.0; LANES]; N], [[0.0; LANES]; N]);
    for l in 0..LANES {
        for p in 0..N {
            let h = half[p].h;
            let d = [normals[0][l] - h[0], normals[1][l] - h[1], normals[2][l] - h[2]];
            let d2 = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).min(2.0);
            sin2[p][l] = d2 * (1.0 - 0.25 * d2);
            cos2[p][l] = (1.0 - 0.5 * d2) * (1.0 - 0.5 * d2);
        }
    }
    (sin2, cos2)
}

impl Masking {
    /// The factor of facets whose cosines with the direction are `cosine`, all in `0..=1`.
    #[inline(always)]
    pub fn eval(self, cosine: &Lanes) -> Lanes {
        let mut out = *cosine;
        match self {
            Self::Cosine => {}
            Self::Root => out.iter_mut().for_each(|c| *c = c.sqrt()),
            Self::Ggx(a2) => out.iter_mut().for_each(|c| {
                // 2 / (1 + sqrt(1 + alpha² tan²)), times cos / cos
                let root = (*c * *c + a2 * (1.0 - *c * *c).max(0.0)).sqrt();
                *c = 2.0 * *c / (*c + root).max(f32::MIN_POSITIVE);
            }),
            Self::Beckmann(alpha) => out.iter_mut().for_each(|c| {
                let k = *c / (alpha * (1.0 - *c * *c).max(1e-12).sqrt());
                let rational = (3.535 * k + 2.181 * k * k) / (1.0 + 2.276 * k + 2.577 * k * k);
                *c = if k < 1.6 { rational } else { 1.0 };
            }),
        }
        out
    }
}

/// The half vector of a pair, as the shapes need it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Half {
    /// The unit half vector.
    pub h: [f32; 3],
    /// `1 / |wi + wo|`: `n·h = (n·wi + n·wo)` times this.
    pub inverse_length: f32,
}

impl Half {
    /// Of two directions that are not opposite.
    pub fn new(wi: DVec3, wo: DVec3) -> Self {
        let sum = wi + wo;
        let inverse = 1.0 / sum.length().max(1e-12);
        Self { h: (sum * inverse).to_array().map(narrow), inverse_length: narrow(inverse) }
    }
}

/// Lobes narrower than this take `sin²` from `n - h`: `1 - (n·h)²` in f32 is off by 1e-7, which must be small against `alpha²`.
const NARROW: f32 = 0.03;

impl Shape {
    /// Whether `sin²` of the half angle must come from `n - h`.
    pub fn is_narrow(self) -> bool {
        match self {
            Self::Constant => false,
            Self::Ggx(a2) => a2 < NARROW * NARROW,
            Self::Beckmann(inverse_a2) | Self::Ward(inverse_a2) => inverse_a2 > 1.0 / (NARROW * NARROW),
            Self::Power(e) => e > 2.0 / (NARROW * NARROW),
        }
    }

    /// The factor of facets whose normals have `sin²` and `cos²` with the half vectors of `N` pairs.
    #[inline(always)]
    pub fn eval<const N: usize>(self, sin2: &[Lanes; N], cos2: &[Lanes; N]) -> [Lanes; N] {
        let mut out = [[1.0; LANES]; N];
        match self {
            Self::Constant => {}
            Self::Ggx(a2) => {
                for l in 0..LANES {
                    for p in 0..N {
                        out[p][l] = cos2[p][l] * a2 + sin2[p][l];
                    }
                }
                out = reciprocals(&out);
                for l in 0..LANES {
                    for p in 0..N {
                        out[p][l] *= out[p][l];
                    }
                }
            }
            Self::Beckmann(inverse_a2) => {
                let inverse_cos2 = reciprocals(&above(cos2, 1e-8));
                for l in 0..LANES {
                    for p in 0..N {
                        let x = sin2[p][l] * inverse_cos2[p][l] * inverse_a2;
                        // Where `exp` ends at 2^-80, 1/cos⁴ would bring it back to life.
                        let value = exp(-x) * inverse_cos2[p][l] * inverse_cos2[p][l];
                        out[p][l] = if x < END_OF_EXP { value } else { 0.0 };
                    }
                }
            }
            Self::Ward(inverse_a2) => {
                let inverse_cos2 = reciprocals(&above(cos2, 1e-8));
                for l in 0..LANES {
                    for p in 0..N {
                        out[p][l] = exp(-(sin2[p][l] * inverse_cos2[p][l]) * inverse_a2);
                    }
                }
            }
            Self::Power(e) => {
                for l in 0..LANES {
                    for p in 0..N {
                        out[p][l] = exp(0.5 * e * ln_1m(sin2[p][l]));
                    }
                }
            }
        }
        out
    }
}

#[inline(always)]
fn above<const N: usize>(x: &[Lanes; N], least: f32) -> [Lanes; N] {
    let mut out = *x;
    for l in 0..LANES {
        for p in 0..N {
            out[p][l] = out[p][l].max(least);
        }
    }
    out
}

/// `1 / x`. One division for two would be faster by a tenth, but a pair's last bits would depend on its neighbour.
#[inline(always)]
fn reciprocals<const N: usize>(x: &[Lanes; N]) -> [Lanes; N] {
    let mut out = *x;
    for l in 0..LANES {
        for p in 0..N {
            out[p][l] = 1.0 / x[p][l];
        }
    }
    out
}

/// `-x` from which on [`exp`] gives 2^-80.
const END_OF_EXP: f32 = 55.0;

/// `e^x` for `x <= 0`, relative error below 3e-7; 2^-80 from there down: subnormal numbers would be ten times slower.
#[inline(always)]
pub fn exp(x: f32) -> f32 {
    /// Added to a number of at most 2^22, leaves it rounded in the lowest bits of the sum.
    const ROUND: f32 = 12_582_912.0;
    let y = (x * std::f32::consts::LOG2_E).max(-80.0);
    let shifted = y + ROUND;
    let f = y - (shifted - ROUND);
    // 2^f on -1/2..1/2 (Cephes' exp2f).
    let p =
        ((((1.535_336_2e-4 * f + 1.339_887_4e-3) * f + 9.618_437e-3) * f + 5.550_332_6e-2) * f + 0.240_226_46) * f + std::f32::consts::LN_2;
    f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23)) * (p * f + 1.0)
}

/// `ln(1 - s)` for `s` in `0..1`, accurate to a few units in the last place also where `s` is tiny; -80 from `s = 1` on.
#[inline(always)]
fn ln_1m(s: f32) -> f32 {
    let y = (1.0 - s).max(1e-30);
    // What the rounding of 1 - s lost (Hewlett-Packard's log1p).
    let lost = ((1.0 - y) - s) / y;
    let bits = y.to_bits();
    // y = m 2^k with m in sqrt(1/2)..sqrt(2)
    let k = bits.wrapping_sub(0x3f35_04f3).cast_signed() >> 23;
    let m = f32::from_bits(bits.wrapping_sub((k << 23).cast_unsigned()));
    let z = (m - 1.0) / (m + 1.0);
    let z2 = z * z;
    let ln_m = 2.0 * z * (1.0 + z2 * (0.333_333_34 + z2 * (0.2 + z2 * (0.142_857_15 + z2 * 0.117_0))));
    ln_m + k as f32 * std::f32::consts::LN_2 + lost
}
