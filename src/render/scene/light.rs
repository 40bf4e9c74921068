//! The lights of a scene.

use super::super::environment::Environment;
use super::fields::{LIGHT, POSITION, required, unit_vector};
use crate::error::Result;
use crate::toml_reader::{TableReader, range};
use glam::DVec3;

/// Most lights of a file, and most directional lights that stand for an environment.
pub(super) const MAX_LIGHTS: u32 = 4096;
/// Lights where a scene names no number, at least: the number of Wu et al. 2011, section 6.
pub const LEAST_LIGHTS: u32 = 32;
/// Kinds of lights.
const KINDS: [&str; 2] = ["directional", "point"];

/// A light of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// From so far away that its rays are parallel.
    Directional {
        /// Unit vector to the light.
        to_light: DVec3,
        /// On a plane that faces it.
        irradiance: [f64; 3],
    },
    /// From one point, equally to all sides.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity: irradiance times squared distance.
        intensity: [f64; 3],
    },
}

/// How an environment lights a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Lighting {
    /// By directional lights that are drawn from it.
    #[default]
    Sampled,
    /// As a whole: see [`EnvironmentLit`](crate::render::EnvironmentLit).
    SphericalGaussians,
}

impl Lighting {
    /// Names in files and on the command line.
    pub const NAMES: [(&str, Self); 2] = [("sampled", Self::Sampled), ("sg", Self::SphericalGaussians)];
}

/// An environment map and how it is used.
#[derive(Clone, Debug)]
pub struct Surroundings {
    /// The map.
    pub map: Environment,
    /// How it lights the scene.
    pub lighting: Lighting,
    /// Directional lights that stand for it where it is sampled; without a number as many as [`light_sampling`](fn@crate::render::light_sampling) finds.
    pub lights: Option<u32>,
    /// Whether it shows as background.
    pub visible: bool,
}

impl Light {
    /// Reads a `[[light]]` table.
    ///
    /// # Errors
    /// Bad input.
    pub fn read(table: TableReader<'_>) -> Result<Self> {
        let kind = required(&table, "type", table.choice("type", &KINDS)?, "\"directional\"")?;
        let light = if KINDS[kind] == "directional" {
            let to_light = required(&table, "to_light", unit_vector(&table, "to_light")?, "[0.0, -1.0, 1.0]")?;
            let irradiance = required(&table, "irradiance_rgb", table.colour("irradiance_rgb", LIGHT)?, "[3.14, 3.14, 3.14]")?;
            Self::Directional { to_light, irradiance }
        } else {
            let position = required(&table, "position", table.array::<3>("position", POSITION)?, "[0.0, -3.0, 3.0]")?.into();
            let intensity = required(&table, "intensity_rgb", table.colour("intensity_rgb", LIGHT)?, "[10.0, 10.0, 10.0]")?;
            Self::Point { position, intensity }
        };
        table.finish()?;
        Ok(light)
    }
}

impl Surroundings {
    pub(super) fn read(table: TableReader<'_>) -> Result<Self> {
        let file = required(&table, "file", table.path("file")?, "\"studio.hdr\"")?;
        let rotation = table.f64("rotation_deg", range(-360.0, 360.0))?.unwrap_or(0.0).to_radians();
        let scale = table.f64("scale", range(1e-9, 1e9))?.unwrap_or(1.0);
        let names = Lighting::NAMES.map(|n| n.0);
        let lighting = table.choice("lighting", &names)?.map_or(Lighting::default(), |k| Lighting::NAMES[k].1);
        let lights = table.integer("lights", 1, MAX_LIGHTS)?;
        let visible = table.bool("visible")?.unwrap_or(false);
        table.finish()?;
        Ok(Self { map: Environment::load(&file, rotation, scale)?, lighting, lights, visible })
    }
}
