//! The camera of a scene.

use super::fields::{POSITION, required, unit_vector};
use crate::error::Result;
use crate::toml_reader::{TableReader, range};
use glam::{DMat3, DVec3};

/// Most pixels across or down.
const MAX_SIDE: u32 = 8192;
/// Most pixels of a picture.
const MAX_PIXELS: u32 = 1 << 24;
/// Most samples of a pixel.
const MAX_SAMPLES: u32 = 1024;

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Where it stands.
    pub origin: DVec3,
    /// Unit vectors right, up and forward.
    pub axes: DMat3,
    /// Tangent of half the angle of view across x.
    pub half_width: f64,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Samples of a pixel.
    pub samples: u32,
}

impl Camera {
    /// Reads a `[camera]` table.
    ///
    /// # Errors
    /// Bad input.
    pub fn read(table: TableReader<'_>) -> Result<Self> {
        let point = |key| table.array::<3>(key, POSITION).map(|v| v.map(DVec3::from));
        let origin = required(&table, "origin", point("origin")?, "[0.0, -5.0, 0.0]")?;
        let target = required(&table, "target", point("target")?, "[0.0, 0.0, 0.0]")?;
        let up = unit_vector(&table, "up")?.unwrap_or(DVec3::Z);
        let fov = required(&table, "fov_deg", table.f64("fov_deg", range(0.001, 170.0))?, "30.0")?;
        let width = required(&table, "width", table.integer("width", 1, MAX_SIDE)?, "384")?;
        let height = required(&table, "height", table.integer("height", 1, MAX_SIDE)?, "384")?;
        if width * height > MAX_PIXELS {
            let problem = format!("the picture has {width} x {height} pixels");
            return Err(table.error_at("width", problem, format!("at most {MAX_PIXELS} in all are possible")));
        }
        let samples = table.integer("samples", 1, MAX_SAMPLES)?.unwrap_or(4);
        let Some(forward) = (target - origin).try_normalize() else {
            return Err(table.error_at("target", "the camera looks at the place where it stands", "move target or origin"));
        };
        let Some(right) = forward.cross(up).try_normalize().filter(|_| forward.cross(up).length() > 1e-6) else {
            return Err(table.error_at("up", "the camera looks along its own up", "write another direction"));
        };
        table.finish()?;
        let axes = DMat3::from_cols(right, right.cross(forward), forward);
        Ok(Self { origin, axes, half_width: (0.5 * fov.to_radians()).tan(), width, height, samples })
    }

    /// The unit direction through the place `x`, `y` of the picture in pixels from its upper left corner.
    pub fn direction(&self, x: f64, y: f64) -> DVec3 {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let across = (2.0 * x / width - 1.0) * self.half_width;
        let up = (1.0 - 2.0 * y / height) * self.half_width * height / width;
        (self.axes * DVec3::new(across, up, 1.0)).normalize()
    }

    /// How the direction through the place `x`, `y` changes by a pixel to the right, and by one down.
    pub fn differentials(&self, x: f64, y: f64) -> [DVec3; 2] {
        let (width, height) = (f64::from(self.width), f64::from(self.height));
        let pixel = 2.0 * self.half_width / width;
        let across = (2.0 * x / width - 1.0) * self.half_width;
        let up = (1.0 - 2.0 * y / height) * self.half_width * height / width;
        let through = DVec3::new(across, up, 1.0);
        let (length, direction) = (through.length(), self.axes * through.normalize());
        [pixel * self.axes.x_axis, -pixel * self.axes.y_axis].map(|step| (step - direction.dot(step) * direction) / length)
    }

    /// Width of a pixel at a distance along the camera's axis.
    pub fn pixel_width(&self, distance: f64) -> f64 {
        2.0 * self.half_width * distance / f64::from(self.width)
    }
}
