//! Tables over the adaptive parameterisation of RGL files (Dupuy and Jakob 2018, *An adaptive parameterization for efficient
//! material acquisition and rendering*), evaluated as the readers of Mitsuba 3 and pbrt-v4 do.
//!
//! The tables belong to elevations of one direction, which the renderers call `wi` and which is their camera's: our `wo`. The
//! half vector `m`, with its azimuth relative to that direction, goes to the unit square by
//! `u = (sqrt(2 θm/π), (φm - φo + π)/(2π))`; the cumulative distribution of the density of visible normals (conditional along
//! the first axis, marginal along the second) carries `u` to the place `s` where the measurement is stored:
//!
//! ```text
//! value = table(s) ndf(u) / (4 sigma(u_o)),        fr = value / (n·i)
//! ```
//!
//! The factor is left out where the file's `jacobian` is 0. Interpolation is linear in θo and bilinear in `u` and `s`. The
//! result is clamped at 0: colours outside the sRGB gamut have negative channels in the files.

use super::real::{Real, cell, combine, cross, dot};
use crate::error::{BadInput, Error, Result};
use crate::formats::rgl::{Channels, Rgl, Tensor};
use crate::numerics::stable_bytes::StableBytes;
use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// Largest relative difference that is taken for none where a file must not depend on the absolute azimuth.
const SAME: f32 = 1e-5;

/// An isotropic RGB measurement, ready to be looked up.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Adaptive {
    /// Elevations of `wo` that have tables, radians, ascending.
    theta: Vec<f32>,
    /// Nodes of the warp along its first axis (theta) and its second (phi).
    warp_size: [usize; 2],
    /// Density of visible normals and its integral along the row up to the node, by theta, row, column. Spacing of the nodes
    /// is the unit of length, and each slice integrates to 1.
    warp: Vec<[f32; 2]>,
    /// Integral of the row, and integral of all rows up to it, by theta and row.
    rows: Vec<[f32; 2]>,
    /// Nodes of the measurement along its two axes.
    size: [usize; 2],
    /// The measurement, by theta, row, column.
    rgb: Vec<[f32; 3]>,
    /// `ndf` and one row of `sigma`, if they are to be used.
    jacobian: Option<(Tensor, Vec<f32>)>,
}

impl Adaptive {
    /// See [`Brdf::write`](super::super::Brdf::write).
    pub fn write(&self, out: &mut StableBytes<'_>) {
        let single = |out: &mut StableBytes<'_>, v: &f32| out.singles(&[*v]);
        let sizes = self.warp_size.into_iter().chain(self.size);
        sizes.for_each(|n| out.whole(n as u64));
        out.list(&self.theta, single);
        [&self.warp, &self.rows].into_iter().for_each(|pairs| out.list(pairs, |out, pair| out.singles(pair)));
        out.list(&self.rgb, |out, rgb| out.singles(rgb));
        out.option(self.jacobian.as_ref(), |out, (ndf, sigma)| {
            out.list(&ndf.shape, |out, n| out.whole(*n as u64));
            out.list(&ndf.values, single);
            out.list(sigma, single);
        });
    }

    /// What a facet needs of a file that was read from `path`.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for anisotropic and for spectral files, [`Error::BadInput`] for an isotropic one with tables
    /// that differ by azimuth.
    pub fn new(file: &Rgl, path: &Path) -> Result<Self> {
        let unsupported =
            |what: &str, remedy: &str| Error::Unsupported { what: format!("{}: {what}", path.display()), remedy: remedy.into() };
        if !file.isotropic() {
            let what = format!("an anisotropic measurement ({} azimuths) as the BRDF of a facet", file.phi_i.len());
            return Err(unsupported(
                &what,
                "facets have a normal but no tangent yet; use an isotropic material (its file has one azimuth)",
            ));
        }
        if let Channels::Spectral(wavelengths) = &file.channels {
            let what = format!("a spectral measurement ({} wavelengths)", wavelengths.len());
            return Err(unsupported(&what, "use the RGB file of the same material, whose name ends in _rgb.bsdf"));
        }
        let bad = |field: &str, problem: &str| {
            let remedy = "with at most two azimuths the material is isotropic, so its tables cannot change with the azimuth";
            Error::from(BadInput::new(problem, remedy).in_file(path).at_field(field))
        };
        let (t, azimuths) = (file.theta_i.len(), file.phi_i.len());
        for (name, tensor) in [("vndf", &file.vndf), ("rgb", &file.values)] {
            if azimuths == 2 && !same(&tensor.values[..tensor.values.len() / 2], &tensor.values[tensor.values.len() / 2..]) {
                return Err(bad(name, "its two azimuths differ"));
            }
        }
        let columns = file.sigma.shape[1];
        let sigma = file.sigma.values[..columns].to_vec();
        if !file.sigma.values.chunks_exact(columns).all(|row| same(row, &sigma)) {
            return Err(bad("sigma", "its rows differ"));
        }
        let (rows_w, columns_w) = (file.vndf.shape[2], file.vndf.shape[3]);
        let (mut warp, mut rows) = (Vec::with_capacity(t * rows_w * columns_w), Vec::with_capacity(t * rows_w));
        for slice in file.vndf.values.chunks_exact(rows_w * columns_w).take(t) {
            cumulate(slice, columns_w, &mut warp, &mut rows);
        }
        let (rows_m, columns_m) = (file.values.shape[3], file.values.shape[4]);
        let nodes = rows_m * columns_m;
        let rgb = (0..t * nodes)
            .map(|k| {
                let (slice, node) = (k / nodes, k % nodes);
                std::array::from_fn(|c| file.values.values[(slice * 3 + c) * nodes + node])
            })
            .collect();
        Ok(Self {
            theta: file.theta_i.clone(),
            warp_size: [columns_w, rows_w],
            warp,
            rows,
            size: [columns_m, rows_m],
            rgb,
            jacobian: file.jacobian.then(|| (file.ndf.clone(), sigma)),
        })
    }

    /// `fr (n·i)` in 1/sr for unit vectors, `i` to the light and `o` to the viewer, both above the facet.
    #[inline(always)]
    pub fn lookup<F: Real>(&self, n: [F; 3], i: [F; 3], o: [F; 3]) -> [F; 3] {
        let (zero, one, half) = (F::of(0.0), F::of(1.0), F::of(0.5));
        let sum = combine(i, half, o, half);
        let length = dot(sum, sum).sqrt();
        let m = if length > zero { sum.map(|x| x / length) } else { n };
        let (theta_m, tangent_m) = tilt(n, m);
        let (theta_o, tangent_o) = tilt(n, o);
        let turn = dot(n, cross(tangent_o, tangent_m)).atan2(dot(tangent_o, tangent_m));
        let u = [unit_theta(theta_m), (turn + F::of(PI)) * F::of(1.0 / (2.0 * PI))];
        let (slice, ft) = self.elevation(theta_o);
        let upper = (slice + 1).min(self.theta.len() - 1);
        let slices = [(slice, one - ft), (upper, ft)];
        let s = self.warp_inverse(u, slices);

        let (x, fx) = cell(s[0] * F::count(self.size[0] - 1), self.size[0]);
        let (y, fy) = cell(s[1] * F::count(self.size[1] - 1), self.size[1]);
        let mut out = [zero; 3];
        for (slice, wt) in slices {
            for (row, wy) in [(y, one - fy), (y + 1, fy)] {
                let at = (slice * self.size[1] + row) * self.size[0] + x;
                let (a, b) = (self.rgb[at], self.rgb[at + 1]);
                let (wa, wb) = (wt * wy * (one - fx), wt * wy * fx);
                for c in 0..3 {
                    out[c] = out[c] + F::from(a[c]) * wa + F::from(b[c]) * wb;
                }
            }
        }
        let factor = match &self.jacobian {
            None => one,
            Some((ndf, sigma)) => {
                let (x, fx) = cell(unit_theta(theta_o) * F::count(sigma.len() - 1), sigma.len());
                let area = F::from(sigma[x]) * (one - fx) + F::from(sigma[x + 1]) * fx;
                bilinear(ndf, u) / (F::of(4.0) * area)
            }
        };
        out.map(|v| (v * factor).max(zero))
    }

    /// The last elevation at or below `theta`, and how far the way to the next is.
    #[inline(always)]
    fn elevation<F: Real>(&self, theta: F) -> (usize, F) {
        // All of them, because a search mispredicts its branches.
        let above = self.theta.iter().filter(|&&t| F::from(t) <= theta).count();
        match above {
            0 => (0, F::of(0.0)),
            k if k == self.theta.len() => (k - 1, F::of(0.0)),
            k => {
                let (low, high) = (F::from(self.theta[k - 1]), F::from(self.theta[k]));
                (k - 1, (theta - low) / (high - low))
            }
        }
    }

    /// Where the cumulative distribution of visible normals carries `u`: both are in the unit square.
    #[inline(always)]
    fn warp_inverse<F: Real>(&self, u: [F; 2], slices: [(usize, F); 2]) -> [F; 2] {
        let (zero, one, half) = (F::of(0.0), F::of(1.0), F::of(0.5));
        let [columns, rows] = self.warp_size;
        let (x, fx) = cell(u[0] * F::count(columns - 1), columns);
        let (y, fy) = cell(u[1] * F::count(rows - 1), rows);
        // Density at both ends of the cell and integral up to it, on the line through u; integrals of the two rows.
        let (mut d0, mut d1, mut before) = (zero, zero, zero);
        let (mut r0, mut r1, mut below) = (zero, zero, zero);
        for (slice, wt) in slices {
            let row = slice * rows + y;
            for (row, w) in [(row, wt * (one - fy)), (row + 1, wt * fy)] {
                let at = row * columns + x;
                let (a, b) = (self.warp[at], self.warp[at + 1]);
                d0 = d0 + F::from(a[0]) * w;
                d1 = d1 + F::from(b[0]) * w;
                before = before + F::from(a[1]) * w;
            }
            let (a, b) = (self.rows[row], self.rows[row + 1]);
            r0 = r0 + F::from(a[0]) * wt;
            r1 = r1 + F::from(b[0]) * wt;
            below = below + F::from(a[1]) * wt;
        }
        let along = before + fx * (d0 + half * fx * (d1 - d0));
        let whole = r0 + fy * (r1 - r0);
        // A line of zero density has no distribution: the uniform one.
        let s0 = if whole > zero { along / whole } else { u[0] };
        [s0, below + fy * (r0 + half * fy * (r1 - r0))]
    }
}

/// Angle between unit `n` and `w`, which is above the surface, and the part of `w` that is tangent to the surface.
#[inline(always)]
fn tilt<F: Real>(n: [F; 3], w: [F; 3]) -> (F, [F; 3]) {
    // From w - n, whose small components keep their digits near the normal.
    let step = combine(w, F::of(1.0), n, F::of(-1.0));
    let versine = F::of(0.5) * dot(step, step);
    (versine.arc_versine(), combine(step, F::of(1.0), n, versine))
}

/// Place of a polar angle on the unit square.
#[inline(always)]
fn unit_theta<F: Real>(theta: F) -> F {
    (theta * F::of(1.0 / FRAC_PI_2)).max(F::of(0.0)).sqrt()
}

#[inline(always)]
fn bilinear<F: Real>(grid: &Tensor, u: [F; 2]) -> F {
    let [rows, columns] = [grid.shape[0], grid.shape[1]];
    let (x, fx) = cell(u[0] * F::count(columns - 1), columns);
    let (y, fy) = cell(u[1] * F::count(rows - 1), rows);
    let along = |y: usize| {
        let at = y * columns + x;
        F::from(grid.values[at]) * (F::of(1.0) - fx) + F::from(grid.values[at + 1]) * fx
    };
    along(y) * (F::of(1.0) - fy) + along(y + 1) * fy
}

/// Appends a slice of the density, normalised, with its integrals along and over the rows.
fn cumulate(density: &[f32], columns: usize, warp: &mut Vec<[f32; 2]>, rows: &mut Vec<[f32; 2]>) {
    let trapezia = |row: &[f32]| row.windows(2).map(|w| 0.5 * (f64::from(w[0]) + f64::from(w[1]))).sum::<f64>();
    let totals: Vec<f64> = density.chunks_exact(columns).map(trapezia).collect();
    // Positive: the reader refuses slices that are 0 everywhere.
    let integral: f64 = totals.windows(2).map(|w| 0.5 * (w[0] + w[1])).sum();
    let mut below = 0.0;
    for (y, row) in density.chunks_exact(columns).enumerate() {
        let mut before = 0.0;
        for (x, &d) in row.iter().enumerate() {
            if x > 0 {
                before += 0.5 * (f64::from(row[x - 1]) + f64::from(d));
            }
            warp.push([(f64::from(d) / integral) as f32, (before / integral) as f32]);
        }
        if y > 0 {
            below += 0.5 * (totals[y - 1] + totals[y]);
        }
        rows.push([(totals[y] / integral) as f32, (below / integral) as f32]);
    }
}

fn same(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME * a.abs().max(b.abs()))
}
