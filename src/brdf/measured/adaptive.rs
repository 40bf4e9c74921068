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

use super::real::{Real, cell, combine, cross, dot, half_vector};
use crate::error::{BadInput, Error, Result};
use crate::formats::rgl::{Channels, Rgl, Tensor};
use crate::numerics::cast::index_u32;
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
    /// The measurement, by theta, row, column; the fourth number is 0.
    rgb: Vec<[f32; 4]>,
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
        out.list(&self.rgb, |out, rgb| out.singles(&rgb[..3]));
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
                let of = |c: usize| file.values.values[(slice * 3 + c) * nodes + node];
                [of(0), of(1), of(2), 0.0]
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

    /// `fr (n·i)` in 1/sr, by channel, for `N` unit normals and unit vectors `i` to the light and `o` to the viewer, both above the facets.
    ///
    /// Places first and values after them: arithmetic of many normals becomes vector code, reading a table does not.
    #[inline(always)]
    pub fn lookup<F: Real, const N: usize>(&self, normals: &[[F; N]; 3], i: [F; 3], o: [F; 3]) -> [[F; N]; 3] {
        let (zero, one) = (F::of(0.0), F::of(1.0));
        let (half, _) = half_vector(i, o);
        let (mut theta_o, mut u_o, mut u) = ([zero; N], [zero; N], [[zero; N]; 2]);
        for l in 0..N {
            let n = [normals[0][l], normals[1][l], normals[2][l]];
            let (theta_m, tangent_m) = tilt(n, half.unwrap_or(n));
            let (theta, tangent_o) = tilt(n, o);
            let turn = dot(n, cross(tangent_o, tangent_m)).atan2(dot(tangent_o, tangent_m));
            (theta_o[l], u_o[l]) = (theta, unit_theta(theta));
            (u[0][l], u[1][l]) = (unit_theta(theta_m), (turn + F::of(PI)) * F::of(1.0 / (2.0 * PI)));
        }
        let slices = self.elevations(&theta_o);
        let s = self.warp_inverse(&u, &slices);
        let (x, y) = (cells(&s[0], self.size[0]), cells(&s[1], self.size[1]));
        let mut out = [[zero; N]; 3];
        for l in 0..N {
            let ((x, fx), (y, fy)) = (x.at(l), y.at(l));
            let mut sum = F::from_four([0.0; 4]);
            for (slice, wt) in slices.both(l) {
                for (row, wy) in [(y, one - fy), (y + 1, fy)] {
                    let [a, b] = pair(&self.rgb, (slice * self.size[1] + row) * self.size[0] + x);
                    sum = sum + F::from_four(a) * (wt * wy * (one - fx)) + F::from_four(b) * (wt * wy * fx);
                }
            }
            let [r, g, b, _] = F::to_four(sum);
            (out[0][l], out[1][l], out[2][l]) = (r, g, b);
        }
        if let Some((ndf, sigma)) = &self.jacobian {
            let (density, area) = (bilinear(ndf, &u), linear(sigma, &u_o));
            for l in 0..N {
                let factor = density[l] / (F::of(4.0) * area[l]);
                for channel in &mut out {
                    channel[l] = channel[l] * factor;
                }
            }
        }
        for channel in &mut out {
            for value in channel {
                *value = value.max(zero);
            }
        }
        out
    }

    /// The last elevation at or below each `theta`, and how far the way to the next is.
    #[inline(always)]
    fn elevations<F: Real, const N: usize>(&self, theta: &[F; N]) -> Slices<F, N> {
        let (zero, one) = (F::of(0.0), F::of(1.0));
        // All of them, because a search mispredicts its branches. The way to each node is cut to 0..=1, so that they add up to the place.
        let mut place = [zero; N];
        for pair in self.theta.windows(2) {
            let (low, scale) = (F::from(pair[0]), one / (F::from(pair[1]) - F::from(pair[0])));
            for l in 0..N {
                place[l] = place[l] + ((theta[l] - low) * scale).max(zero).min(one);
            }
        }
        let mut cells = Cells([0; N], [zero; N]);
        for l in 0..N {
            (cells.0[l], cells.1[l]) = cell(place[l], self.theta.len().max(2));
        }
        Slices(cells, self.theta.len() - 1)
    }

    /// Where the cumulative distribution of visible normals carries `u`: both are in the unit square.
    #[inline(always)]
    fn warp_inverse<F: Real, const N: usize>(&self, u: &[[F; N]; 2], slices: &Slices<F, N>) -> [[F; N]; 2] {
        let (zero, one, half) = (F::of(0.0), F::of(1.0), F::of(0.5));
        let [columns, rows] = self.warp_size;
        let (x, y) = (cells(&u[0], columns), cells(&u[1], rows));
        // Density and integral up to it, at both ends of the cell, on the line through u; the same of the two rows.
        let (mut along, mut across) = ([[zero; N]; 4], [[zero; N]; 4]);
        for l in 0..N {
            let ((x, _), (y, fy)) = (x.at(l), y.at(l));
            let (mut cell_sum, mut row_sum) = (F::from_four([0.0; 4]), F::from_four([0.0; 4]));
            for (slice, wt) in slices.both(l) {
                let row = slice * rows + y;
                for (row, w) in [(row, wt * (one - fy)), (row + 1, wt * fy)] {
                    cell_sum = cell_sum + F::from_four(flat(pair(&self.warp, row * columns + x))) * w;
                }
                row_sum = row_sum + F::from_four(flat(pair(&self.rows, row))) * wt;
            }
            let (cell_sum, row_sum) = (F::to_four(cell_sum), F::to_four(row_sum));
            for k in 0..4 {
                (along[k][l], across[k][l]) = (cell_sum[k], row_sum[k]);
            }
        }
        let mut s = [[zero; N]; 2];
        for l in 0..N {
            let (fx, fy) = (x.1[l], y.1[l]);
            let (d0, before, d1) = (along[0][l], along[1][l], along[2][l]);
            let (r0, below, r1) = (across[0][l], across[1][l], across[2][l]);
            let part = before + fx * (d0 + half * fx * (d1 - d0));
            let whole = r0 + fy * (r1 - r0);
            // A line of zero density has no distribution: the uniform one.
            let some = whole > zero;
            s[0][l] = F::select(some, part / F::select(some, whole, one), u[0][l]);
            s[1][l] = below + fy * (r0 + half * fy * (r1 - r0));
        }
        s
    }
}

/// Cells of a grid, and how far into them.
#[derive(Clone, Copy)]
struct Cells<F, const N: usize>([u32; N], [F; N]);

impl<F: Real, const N: usize> Cells<F, N> {
    #[inline(always)]
    fn at(&self, l: usize) -> (usize, F) {
        (self.0[l] as usize, self.1[l])
    }
}

/// Elevations between which values lie, and the last of them.
struct Slices<F, const N: usize>(Cells<F, N>, usize);

impl<F: Real, const N: usize> Slices<F, N> {
    /// Both elevations, with their weights; where there is one alone it is both.
    #[inline(always)]
    fn both(&self, l: usize) -> [(usize, F); 2] {
        let (slice, part) = self.0.at(l);
        [(slice, F::of(1.0) - part), ((slice + 1).min(self.1), part)]
    }
}

/// The [`cell`] of each of `N` positions in the unit interval.
#[inline(always)]
fn cells<F: Real, const N: usize>(at: &[F; N], nodes: usize) -> Cells<F, N> {
    let mut cells = Cells([0; N], [F::of(0.0); N]);
    for l in 0..N {
        (cells.0[l], cells.1[l]) = cell(at[l] * F::count(index_u32(nodes - 1)), nodes);
    }
    cells
}

/// Two neighbours of a table.
#[inline(always)]
fn pair<T: Copy>(values: &[T], at: usize) -> [T; 2] {
    [values[at], values[at + 1]]
}

#[inline(always)]
fn flat([a, b]: [[f32; 2]; 2]) -> [f32; 4] {
    [a[0], a[1], b[0], b[1]]
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

/// Values of a row of nodes at positions in the unit interval.
#[inline(always)]
fn linear<F: Real, const N: usize>(row: &[f32], at: &[F; N]) -> [F; N] {
    let x = cells(at, row.len());
    let mut values = [F::of(0.0); N];
    for l in 0..N {
        let (x, fx) = x.at(l);
        let [a, b] = pair(row, x);
        values[l] = F::from(a) * (F::of(1.0) - fx) + F::from(b) * fx;
    }
    values
}

/// Values of a grid at positions in the unit square.
#[inline(always)]
fn bilinear<F: Real, const N: usize>(grid: &Tensor, u: &[[F; N]; 2]) -> [F; N] {
    let [rows, columns] = [grid.shape[0], grid.shape[1]];
    let (x, y) = (cells(&u[0], columns), cells(&u[1], rows));
    let mut values = [F::of(0.0); N];
    for l in 0..N {
        let ((x, fx), (y, fy)) = (x.at(l), y.at(l));
        for (row, wy) in [(y, F::of(1.0) - fy), (y + 1, fy)] {
            let [a, b] = pair(&grid.values, row * columns + x);
            values[l] = values[l] + (F::from(a) * (F::of(1.0) - fx) + F::from(b) * fx) * wy;
        }
    }
    values
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
