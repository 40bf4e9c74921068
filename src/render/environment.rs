//! Light from all around: an environment map, importance-sampled into directional lights (Wu et al. 2011, sections 3.6 and 6).
//!
//! The map is a panorama of equal angles: its top row looks to +z, its centre to +y, and what lies right of the centre to +x, as
//! seen from inside. Each light takes a direction with a density in proportion to luminance times solid angle (Pharr, Jakob and
//! Humphreys, *Physically Based Rendering*, section 12.5), and carries `radiance / (density · N)`: the sum over the lights has the
//! integral over the sphere as its mean. The directions follow a scrambled Sobol' sequence, so that N of them spread evenly.

use crate::error::{BadInput, Result};
use crate::image_file::{self, Raster};
use crate::numerics::cast::truncate_usize;
use crate::numerics::colour::luminance;
use crate::numerics::low_discrepancy::{fraction, sobol_2d};
use crate::numerics::seed::fold;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// "envi": the stream of the environment's directions; any other number would do.
const SALT: u32 = 0x656e_7669;

/// Radiance from all directions.
#[derive(Clone, Debug)]
pub struct Environment {
    raster: Raster,
    /// Turn about z, counter-clockwise seen from above, radians.
    rotation: f64,
    scale: f64,
    /// For each row the sums of luminance · solid angle up to each column, and 0 first.
    columns: Vec<Vec<f64>>,
    /// The same sums of whole rows.
    rows: Vec<f64>,
    /// What the user should know of the file.
    pub note: Option<String>,
}

impl Environment {
    /// Reads a `.hdr` or `.exr` panorama and turns it by `rotation` radians about z.
    ///
    /// # Errors
    /// Those of the reader; a map that is black.
    pub fn load(file: &Path, rotation: f64, scale: f64) -> Result<Self> {
        let (raster, note) = image_file::read_radiance(file)?;
        let environment = Self { note, ..Self::new(raster, rotation, scale) };
        if environment.total() <= 0.0 {
            return Err(BadInput::new("the environment map is black", "use one with light in it").in_file(file).into());
        }
        Ok(environment)
    }

    fn new(raster: Raster, rotation: f64, scale: f64) -> Self {
        let (width, height) = (raster.width, raster.height);
        let edge = |row: usize| (PI * row as f64 / height as f64).cos();
        let mut rows = vec![0.0];
        let mut columns = Vec::with_capacity(height);
        for row in 0..height {
            let solid_angle = TAU / width as f64 * (edge(row) - edge(row + 1));
            let mut sum = 0.0;
            let mut sums = vec![0.0];
            for column in 0..width {
                let at = row * width + column;
                sum += solid_angle * luminance(std::array::from_fn(|c| raster.channels[c][at].into()));
                sums.push(sum);
            }
            rows.push(rows[row] + sum);
            columns.push(sums);
        }
        Self { raster, rotation, scale, columns, rows, note: None }
    }

    /// Luminance integrated over the sphere, before `scale`.
    fn total(&self) -> f64 {
        self.rows[self.rows.len() - 1]
    }

    /// Pixels across and down.
    pub(super) fn size(&self) -> [usize; 2] {
        [self.raster.width, self.raster.height]
    }

    /// Turn about z, counter-clockwise seen from above, radians.
    pub(super) fn rotation(&self) -> f64 {
        self.rotation
    }

    /// Radiance of a pixel.
    pub(super) fn pixel(&self, column: usize, row: usize) -> [f64; 3] {
        let at = row * self.raster.width + column;
        std::array::from_fn(|c| self.scale * f64::from(self.raster.channels[c][at]))
    }

    /// Radiance from the unit direction `w`: that of the map's pixel.
    pub fn radiance(&self, w: DVec3) -> [f64; 3] {
        let across = (w.x.atan2(w.y) + self.rotation) / TAU + 0.5;
        let down = w.z.clamp(-1.0, 1.0).acos() / PI;
        let place = |x: f64, size: usize| truncate_usize(x * size as f64).min(size - 1);
        self.pixel(place(across - across.floor(), self.raster.width), place(down, self.raster.height))
    }

    /// `count` directional lights: unit directions to them, and their irradiance on a plane that faces them.
    pub fn lights(&self, count: u32, seed: u64) -> Vec<(DVec3, [f64; 3])> {
        let seed = fold(seed ^ u64::from(SALT));
        let (width, height) = (self.raster.width as f64, self.raster.height as f64);
        (0..count)
            .map(|index| {
                let [u, v] = sobol_2d(index, seed).map(fraction);
                let (row, down) = find(&self.rows, u);
                let (column, right) = find(&self.columns[row], v);
                let z = DVec2::new(row as f64, row as f64 + 1.0).map(|r| (PI * r / height).cos());
                let z = z.x + down * (z.y - z.x);
                let azimuth = TAU * ((column as f64 + right) / width - 0.5) - self.rotation;
                let across = (1.0 - z * z).max(0.0).sqrt();
                let radiance = self.pixel(column, row);
                // Density: luminance over its integral.
                let weight = self.scale * self.total() / (luminance(radiance) * f64::from(count));
                (DVec3::new(across * azimuth.sin(), across * azimuth.cos(), z), radiance.map(|r| r * weight))
            })
            .collect()
    }
}

/// Where the share `at` of some cumulative sums, the first of them 0, falls: between which, and how far.
fn find(sums: &[f64], at: f64) -> (usize, f64) {
    let wanted = at * sums[sums.len() - 1];
    let k = sums.partition_point(|&s| s <= wanted).clamp(1, sums.len() - 1) - 1;
    let size = sums[k + 1] - sums[k];
    (k, if size > 0.0 { ((wanted - sums[k]) / size).clamp(0.0, 1.0) } else { 0.5 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: usize, height: usize, value: impl Fn(usize, usize) -> [f32; 3]) -> Environment {
        let mut channels = vec![Vec::new(), Vec::new(), Vec::new()];
        for row in 0..height {
            for column in 0..width {
                for (channel, v) in channels.iter_mut().zip(value(column, row)) {
                    channel.push(v);
                }
            }
        }
        Environment::new(Raster { width, height, channels, alpha: None, integer: false }, 0.0, 1.0)
    }

    #[test]
    fn the_top_is_up_the_centre_ahead_and_the_right_half_to_the_right() {
        let environment = map(8, 4, |column, row| [column as f32, row as f32, 0.0]);
        let ahead_right = environment.radiance(DVec3::new(0.01, 1.0, 0.01).normalize());
        assert_eq!(ahead_right, [4.0, 1.0, 0.0]);
        let right = environment.radiance(DVec3::new(1.0, 0.01, -0.01).normalize());
        assert_eq!(right, [5.0, 2.0, 0.0]);
        assert_eq!(environment.radiance(DVec3::new(0.0, 0.01, 1.0).normalize())[1], 0.0);
    }

    #[test]
    fn a_rotation_moves_the_picture_counter_clockwise_seen_from_above() {
        let mut environment = map(8, 4, |column, _| [if column == 4 { 1.0 } else { 0.0 }, 0.0, 0.0]);
        environment.rotation = PI / 2.0;
        // What lay ahead (+y) lies to the left (-x) now.
        assert_eq!(environment.radiance(DVec3::new(-1.0, 0.05, 0.0).normalize())[0], 1.0);
        for (direction, _) in environment.lights(16, 0) {
            assert!(direction.x < -0.2 && environment.radiance(direction)[0] == 1.0, "{direction}");
        }
    }

    #[test]
    fn a_white_map_gives_equal_lights_whose_irradiance_sums_to_that_of_the_sphere() {
        let environment = map(64, 32, |_, _| [1.0; 3]);
        let lights = environment.lights(1024, 7);
        let facing_up: f64 = lights.iter().map(|(w, e)| w.z.max(0.0) * e[1]).sum();
        assert!((facing_up / PI - 1.0).abs() < 2e-3, "{facing_up}");
        assert!(lights.iter().all(|(w, e)| (e[0] - 4.0 * PI / 1024.0).abs() < 1e-4 && (w.length() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn lights_estimate_the_irradiance_of_a_map_with_a_sun() {
        let value = |column: usize, row: usize| if (column, row) == (20, 5) { [900.0, 700.0, 300.0] } else { [0.3, 0.4, 0.9] };
        let environment = map(64, 32, value);
        // The sum over all pixels, by their centres.
        let mut exact = [0.0; 3];
        let mut squares = [0.0; 3];
        for row in 0..32 {
            for column in 0..64 {
                let theta = PI * (row as f64 + 0.5) / 32.0;
                let solid_angle = TAU / 64.0 * ((PI * row as f64 / 32.0).cos() - (PI * (row as f64 + 1.0) / 32.0).cos());
                for c in 0..3 {
                    exact[c] += solid_angle * theta.cos().max(0.0) * environment.pixel(column, row)[c];
                }
            }
        }
        let runs = 32;
        let mut means = [0.0; 3];
        for seed in 0..runs {
            let lights = environment.lights(64, seed);
            for c in 0..3 {
                let sum: f64 = lights.iter().map(|(w, e)| w.z.max(0.0) * e[c]).sum();
                means[c] += sum / runs as f64;
                squares[c] += (sum - exact[c]).powi(2) / runs as f64;
            }
        }
        for c in 0..3 {
            let error = (squares[c] / runs as f64).sqrt();
            assert!((means[c] - exact[c]).abs() < 4.0 * error + 1e-3 * exact[c], "{means:?} and not {exact:?}");
        }
    }
}
