//! Linear photographs, with the camera, the light and the shape that they show.

use crate::photograph::params::PARAMS;
use biscale::error::{BadInput, Result};
use biscale::image_file::{self, Raster};
use biscale::render::{Camera, Light, Object};
use glam::{DMat3, DVec3};
use std::path::{Path, PathBuf};

/// Standard deviation of a light's direction where nothing says it, degrees.
pub const LIGHT_SIGMA_DEG: f64 = 1.5;

/// Relative standard deviation of an irradiance where nothing says it. Chosen, not measured: a lamp that stands 2 % nearer than noted is 4 %
/// brighter, and a reference card that is tilted by 10 degrees 1.5 % darker.
pub const IRRADIANCE_SIGMA: f64 = 0.05;

/// What a photograph is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// From afar: what the parameters are fitted to.
    Distant,
    /// From near: its statistics are.
    CloseUp,
    /// From afar under another light: held out.
    Validation,
}

/// A photograph.
#[derive(Clone, Debug)]
pub struct Photograph {
    /// Its file.
    pub file: PathBuf,
    /// What it is for.
    pub role: Role,
    /// Its pixels.
    pub image: Image,
    /// Who looked.
    pub camera: Pinhole,
    /// What shone.
    pub light: Light,
    /// Standard deviations of the light's azimuth and elevation, degrees; 0 holds it.
    pub light_sigma_deg: f64,
    /// Whether the irradiance is known, or only assumed: then colours are known up to a common factor.
    pub exposure_known: bool,
    /// Relative standard deviation of its irradiance, if somebody says it: see [`Self::irradiance_sigma`].
    pub stated_irradiance_sigma: Option<f64>,
    /// What was photographed, without its material.
    pub object: Object,
    /// Noise of a pixel: variance `a + b v`, by channel.
    pub noise: Option<[[f64; 3]; 2]>,
}

/// Linear radiance, rows from the top. A pixel that must not be used is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// The pixels.
    pub rgb: Vec<[f32; 3]>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// A pinhole camera whose axis need not pass the middle of the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    /// Where it stands.
    pub origin: DVec3,
    /// Unit vectors right, up and forward.
    pub axes: DMat3,
    /// Focal lengths across and down, pixels.
    pub focal: [f64; 2],
    /// Where the axis meets the picture, pixels from its upper left corner.
    pub centre: [f64; 2],
}

impl Photograph {
    /// Its file, without the folder.
    pub fn name(&self) -> String {
        self.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Relative standard deviation of its irradiance, where that is known.
    pub fn irradiance_sigma(&self) -> f64 {
        self.stated_irradiance_sigma.unwrap_or(IRRADIANCE_SIGMA)
    }
}

impl Pinhole {
    /// A scene's camera.
    pub fn of(camera: &Camera) -> Self {
        let (w, h) = (f64::from(camera.width), f64::from(camera.height));
        let focal = 0.5 * w / camera.half_width;
        Self { origin: camera.origin, axes: camera.axes, focal: [focal; 2], centre: [0.5 * w, 0.5 * h] }
    }

    /// The unit direction through a point of the picture, pixels from its upper left corner.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let (across, down) = ((x - self.centre[0]) / self.focal[0], (y - self.centre[1]) / self.focal[1]);
        (self.axes * DVec3::new(across, -down, 1.0)).normalize()
    }
}

impl Image {
    /// Reads a linear photograph, `.exr` or a `.tif` of floats, and its mask, a grey image of the same size that is bright where pixels may
    /// be used. Holes, negative colours and clipped pixels are left out, with a note.
    ///
    /// # Errors
    /// Bad input names the file.
    pub fn load(file: &Path, mask: Option<&Path>) -> Result<Self> {
        let Raster { width, height, channels, integer, .. } = image_file::read_with_holes(file)?;
        if integer {
            let remedy = "give the linear radiance, as .exr; `biscale capture` makes it of photographs";
            return Err(BadInput::new("this image holds whole numbers, which are not linear in radiance", remedy).in_file(file).into());
        }
        let size = |n: usize| u32::try_from(n).expect("images are limited");
        let rgb = (0..width * height).map(|k| std::array::from_fn(|c| channels[c][k])).collect();
        let mut image = Self { width: size(width), height: size(height), rgb, notes: Vec::new() };
        let holes = image.leave_out(|p| p.iter().any(|v| !v.is_finite()));
        image.note(holes, "hold no finite number");
        if let Some(mask) = mask {
            let raster = image_file::read(mask)?;
            if (raster.width, raster.height) != (width, height) {
                let problem = format!("the mask has {} x {} pixels, the photograph {width} x {height}", raster.width, raster.height);
                return Err(BadInput::new(problem, "make one of the same size").in_file(mask).into());
            }
            for (pixel, &m) in image.rgb.iter_mut().zip(&raster.channels[0]) {
                if m < 0.5 {
                    *pixel = [f32::NAN; 3];
                }
            }
        }
        image.leave_out_clipped();
        Ok(image)
    }

    fn note(&mut self, count: usize, what: &str) {
        if count > 0 {
            let share = 100.0 * count as f64 / self.rgb.len() as f64;
            self.notes.push(format!("{count} pixels ({share:.1} %) {what} and are left out"));
        }
    }

    fn leave_out(&mut self, bad: impl Fn(&[f32; 3]) -> bool) -> usize {
        let mut count = 0;
        for pixel in self.rgb.iter_mut().filter(|p| bad(p)) {
            *pixel = [f32::NAN; 3];
            count += 1;
        }
        count
    }

    /// A sensor that is full says the same largest value again and again. So does a flat surface in a picture without noise; but there other
    /// values repeat as well.
    fn leave_out_clipped(&mut self) {
        let valid = self.rgb.iter().filter(|p| !p[0].is_nan()).count();
        let limit: [f32; 3] = std::array::from_fn(|c| {
            let top = self.rgb.iter().map(|p| p[c]).filter(|v| !v.is_nan()).fold(0.0, f32::max);
            let at_top = self.rgb.iter().filter(|p| p[c] == top).count();
            if top <= 0.0 || at_top <= 4 || at_top as f64 <= PARAMS.clipped_share * valid as f64 {
                return f32::INFINITY;
            }
            let mut others: Vec<f32> = self.rgb.iter().map(|p| p[c]).filter(|&v| v > 0.0 && v < top).collect();
            others.sort_by(f32::total_cmp);
            let repeated = others.chunk_by(|a, b| a == b).map(<[f32]>::len).max().unwrap_or(0);
            if at_top > PARAMS.clipped_repeats * repeated { PARAMS.nearly_clipped * top } else { f32::INFINITY }
        });
        let clipped = self.leave_out(|p| (0..3).any(|c| p[c] >= limit[c]));
        self.note(clipped, "are clipped");
    }

    /// Pixels that may be used.
    pub fn used(&self) -> usize {
        self.rgb.iter().filter(|p| !p[0].is_nan()).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::render::Picture;

    fn write(folder: &Path, f: impl Fn(usize) -> [f32; 3]) -> PathBuf {
        let mut picture = Picture::new(20, 10);
        for (k, pixel) in picture.rgb.iter_mut().enumerate() {
            *pixel = f(k);
        }
        let file = folder.join("p.exr");
        picture.write_exr(std::io::BufWriter::new(std::fs::File::create(&file).unwrap()), false, "").unwrap();
        file
    }

    #[test]
    fn holes_and_clipped_pixels_are_left_out_and_told() {
        let folder = tempfile::tempdir().unwrap();
        let file = write(folder.path(), |k| match k {
            3 => [f32::NAN, 0.1, 0.1],
            50..60 => [0.1, 1.0, 0.1],
            60 => [0.1, 0.995, 0.1],
            _ => [k as f32 * 1e-3, 0.2 + k as f32 * 1e-3, 0.3 + k as f32 * 1e-4],
        });
        let image = Image::load(&file, None).unwrap();
        assert_eq!(image.used(), 200 - 12, "{:?}", image.notes);
        assert!(image.notes.iter().any(|n| n.contains("1 pixels") && n.contains("finite")), "{:?}", image.notes);
        assert!(image.notes.iter().any(|n| n.contains("11 pixels") && n.contains("clipped")), "{:?}", image.notes);
    }

    #[test]
    fn flat_colours_without_noise_are_not_clipped() {
        let folder = tempfile::tempdir().unwrap();
        let file = write(folder.path(), |k| if k % 3 == 0 { [0.5, 0.2, 0.1] } else { [0.1, 0.3, 0.05] });
        let image = Image::load(&file, None).unwrap();
        assert!(image.used() == 200 && image.notes.is_empty(), "{:?}", image.notes);
    }

    #[test]
    fn the_camera_of_a_scene_looks_the_same_way() {
        let camera = Camera {
            origin: DVec3::new(1.0, -5.0, 2.0),
            axes: DMat3::from_cols(DVec3::X, DVec3::Z, DVec3::Y),
            half_width: 0.3,
            width: 40,
            height: 30,
            samples: 1,
        };
        for (x, y) in [(0.0, 0.0), (20.0, 15.0), (33.5, 4.25)] {
            assert!(Pinhole::of(&camera).direction(x, y).distance(camera.direction(x, y)) < 1e-14);
        }
    }
}
