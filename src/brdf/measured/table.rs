//! A measured BRDF: which data it holds, and how they are looked up.

use super::adaptive::Adaptive;
use super::half_angle::{self, Halfway};
use super::network::{Network, Plain};
use super::real::{Real, dot};
use crate::error::{BadInput, Result};
use crate::formats::{merl, rgl};
use crate::numerics::stable_bytes::StableBytes;
use crate::simd::{self, LANES, Lanes};
use glam::{DVec3, Vec3};
use std::path::Path;
use std::sync::Arc;

/// Smallest cosine between a facet's normal and the light by which a stored `fr cos` is divided, so that `fr` stays finite.
pub const MIN_FACET_COSINE: f64 = 1e-6;

/// A measured BRDF of a facet, isotropic, linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Where it came from: the file, or the name of the fit.
    pub label: String,
    /// What the file says of itself; empty if it says nothing.
    pub description: String,
    /// Factor of the table.
    pub scale: f64,
    table: Arc<Table>,
    /// Roughness of the lobe that importance sampling uses.
    lobe_alpha: f64,
}

/// Whether both directions are above the facet.
#[inline(always)]
fn above<F: Real>(n: [F; 3], i: [F; 3], o: [F; 3]) -> bool {
    dot(n, i) > F::of(0.0) && dot(n, o) > F::of(0.0)
}

/// `fr` from `fr cos` of a facet with cosine `cos` to the light.
#[inline(always)]
fn over_cosine<F: Real>(value: F, cos: F) -> F {
    value / cos.max(F::of(MIN_FACET_COSINE))
}

/// One look-up of [`LANES`] facets.
struct Lookup<'a> {
    measured: &'a Measured,
    normals: &'a [Lanes; 3],
    i: [f32; 3],
    o: [f32; 3],
}

impl pulp::WithSimd for Lookup<'_> {
    type Output = [Lanes; 3];

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> [Lanes; 3] {
        let Self { measured, normals, i, o } = self;
        let normal = |l: usize| [normals[0][l], normals[1][l], normals[2][l]];
        let mut values = match &*measured.table {
            Table::Fit(network) => network.eval_lanes(simd, normals, i, o),
            Table::Merl(table) => half_angle::lookup(table, &Halfway::new(i, o), normals),
            Table::Rgl(table) => {
                let mut values = table.lookup(normals, i, o);
                for value in &mut values {
                    for l in 0..LANES {
                        value[l] = over_cosine(value[l], dot(normal(l), i));
                    }
                }
                values
            }
        };
        let scale = f32::of(measured.scale);
        for value in &mut values {
            for l in 0..LANES {
                value[l] = if above(normal(l), i, o) { value[l] * scale } else { 0.0 };
            }
        }
        values
    }
}

#[derive(Clone, Debug, PartialEq)]
enum Table {
    Merl(merl::Merl),
    Rgl(Adaptive),
    Fit(Box<Network>),
}

impl Measured {
    /// Reads a MERL `.binary` or an RGL `.bsdf` file, by its ending. `scale` multiplies its values.
    ///
    /// # Errors
    /// [`crate::Error::BadInput`] for another ending, a missing or a damaged file; [`crate::Error::Unsupported`] for
    /// anisotropic and for spectral RGL files; [`crate::Error::Io`].
    pub fn read(path: &Path, scale: f64) -> Result<Self> {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let (description, table) = match ending.as_str() {
            "binary" => (String::new(), Table::Merl(merl::read(path)?)),
            "bsdf" => {
                let file = rgl::read(path)?;
                let table = Table::Rgl(Adaptive::new(&file, path)?);
                (file.description, table)
            }
            _ => {
                let problem = format!("the ending \"{ending}\" is not one of a measured BRDF");
                return Err(BadInput::new(problem, "name a MERL .binary or an RGL .bsdf file").in_file(path).into());
            }
        };
        Ok(Self::new(path.display().to_string(), description, scale, table))
    }

    /// The built-in neural fit of a MERL material; [`fit_names`](super::fit_names) lists them. `scale` multiplies its values.
    ///
    /// # Errors
    /// An unknown name, with the nearest known ones.
    pub fn fit(name: &str, scale: f64) -> Result<Self, BadInput> {
        let table = Table::Fit(Box::new(Network::named(name)?));
        Ok(Self::new(name.to_owned(), String::new(), scale, table))
    }

    /// See [`Brdf::write`](super::super::Brdf::write).
    pub(in super::super) fn write(&self, out: &mut StableBytes<'_>) {
        out.reals(&[self.scale]);
        match &*self.table {
            Table::Merl(merl) => {
                out.tag(1);
                out.list(&merl.rgb, |out, rgb| out.singles(rgb));
            }
            Table::Rgl(table) => {
                out.tag(2);
                table.write(out);
            }
            Table::Fit(network) => {
                out.tag(3);
                network.write(out);
            }
        }
    }

    fn new(label: String, description: String, scale: f64, table: Table) -> Self {
        Self { label, description, scale, table: Arc::new(table), lobe_alpha: 1.0 }.with_scale(scale)
    }

    /// The same table with another factor.
    #[must_use]
    pub fn with_scale(mut self, scale: f64) -> Self {
        self.scale = scale;
        self.lobe_alpha = self.estimate_lobe();
        self
    }

    /// Whether this is a neural fit and not a measurement.
    pub fn is_fit(&self) -> bool {
        matches!(*self.table, Table::Fit(_))
    }

    /// Whether the data are looked up by half and difference angles in which a pair and its reverse are one.
    pub fn is_reciprocal(&self) -> bool {
        !matches!(*self.table, Table::Rgl(_))
    }

    /// Roughness of a GGX lobe about as wide as the measured one, or 1 where there is none: for importance sampling.
    pub fn lobe_alpha(&self) -> f64 {
        self.lobe_alpha
    }

    /// `fr`, in 1/sr, of a facet with unit normal `n` for unit directions to the light and to the viewer; 0 when one of them
    /// is not above the facet. Finite and never negative.
    pub fn eval(&self, n: DVec3, wi: DVec3, wo: DVec3) -> [f64; 3] {
        let (n, i, o) = (n.to_array(), wi.to_array(), wo.to_array());
        if !above(n, i, o) {
            return [0.0; 3];
        }
        let values = match &*self.table {
            Table::Merl(table) => half_angle::lookup(table, &Halfway::new(i, o), &n.map(|x| [x])).map(|[v]| v),
            Table::Rgl(table) => table.lookup(&n.map(|x| [x]), i, o).map(|[v]| over_cosine(v, dot(n, i))),
            Table::Fit(network) => simd::run(Plain { network, angles: Halfway::new(i, o).about(n) }),
        };
        values.map(|v| v * self.scale)
    }

    /// [`Measured::eval`] in `f32` for [`LANES`] facets at once, by channel; `normals` are unit, by component. For hot loops: no allocation, no call
    /// into the mathematical library.
    ///
    /// Differs from `eval` of the same `f32` vectors by less than 1e-4 of (value + .01/sr), and by 5e-6 in the mean square, but for
    /// directions that rounding moves across a jump of the data (the plane of incidence of the fits, the normal itself).
    /// `cargo bench --bench measured` tells its time.
    pub fn eval_lanes(&self, normals: &[Lanes; 3], wi: Vec3, wo: Vec3) -> [Lanes; 3] {
        pulp::Arch::new().dispatch(Lookup { measured: self, normals, i: wi.to_array(), o: wo.to_array() })
    }

    /// Width of the lobe about the half vector, from the angle at which it falls to half its height: GGX falls to half at
    /// `tan² = alpha² (√2 - 1)`.
    fn estimate_lobe(&self) -> f64 {
        /// Angle between each direction and the half vector: off the normal, where some tables have gaps.
        const THETA_D: f64 = 0.35;
        const STEPS: u32 = 400;
        // The half vector tilts across the plane of the two directions, so that both rise and fall together.
        let at = |tilt: f64| {
            let h = DVec3::new(0.0, tilt.sin(), tilt.cos()) * THETA_D.cos();
            let side = DVec3::X * THETA_D.sin();
            self.eval(DVec3::Z, h + side, h - side).iter().sum::<f64>()
        };
        let tilts: Vec<f64> = (0..STEPS).map(|k| (f64::from(k) / f64::from(STEPS)).powi(2) * 1.3).collect();
        let values: Vec<f64> = tilts.iter().map(|&t| at(t)).collect();
        let (peak, floor) = values.iter().fold((0.0_f64, f64::INFINITY), |(p, f), &v| (p.max(v), f.min(v)));
        if peak < 3.0 * floor {
            return 1.0; // no lobe to speak of: nearly diffuse
        }
        // The last angle above half height: a lobe may peak off its centre.
        let half = values.iter().rposition(|&v| v - floor > 0.5 * (peak - floor)).unwrap_or(0);
        (tilts[(half + 1).min(tilts.len() - 1)].tan() / (2.0_f64.sqrt() - 1.0).sqrt()).clamp(0.005, 1.0)
    }
}

#[cfg(test)]
#[path = "table_tests.rs"]
mod tests;
