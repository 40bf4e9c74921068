//! `kind = "rods"`: straight rods that stand or lean on flat ground, like the pile of velvet.
//!
//! Rods are prisms on a regular polygon with flat caps; they may reach over the edge of the cell. The ground lies at z = 0. A
//! rod's foot is sunk just so far that none of it shows.

use super::builder::TileBuilder;
use super::params::{Param, Unit, number, scaled, whole};
use super::tile::Tile;
use super::values::GeometryValues;
use crate::error::Result;
use crate::numerics::random::Random;
use crate::toml_reader::range;
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::TAU;

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    number("period", Unit::Length, 1.0, range(1e-6, 1e6), "Width of the square cell"),
    whole("count", 60, 1, 100_000, "Rods in a cell"),
    scaled("radius", "period", 0.03, range(1e-9, 1e6), "Radius of a rod, to the edges of the prism"),
    scaled("length", "period", 0.4, range(1e-9, 1e9), "Length of a rod"),
    number("length_spread", Unit::One, 0.25, range(0.0, 0.99), "Rods are up to this share longer or shorter"),
    number("lean_deg", Unit::Degrees, 0.0, range(0.0, 85.0), "Angle between the rods and the upright"),
    number("lean_azimuth_deg", Unit::Degrees, 0.0, range(-360.0, 360.0), "Direction they lean to: 0 is +x, 90 is +y"),
    number("spread_deg", Unit::Degrees, 20.0, range(0.0, 85.0), "Largest angle between a rod and that direction"),
    number("randomness", Unit::One, 1.0, range(0.0, 1.0), "Places of the rods: 0 on a regular grid, 1 anywhere"),
    whole("seed", 1, 0, u32::MAX, "Another number gives another arrangement"),
    whole("segments", 12, 3, 256, "Sides of a rod's prism"),
];

/// Parts of this kind, with what they are.
pub const PARTS: &[(&str, &str)] = &[("rods", "sides and caps of the rods"), ("ground", "what they stand on")];

/// How far below the ground the highest point of a rod's foot lies, in radii.
const SUNK: f64 = 0.01;

/// Rods on flat ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Rods {
    /// Width of the square cell.
    pub period: f64,
    /// Rods in a cell.
    pub count: u32,
    /// Radius to the edges of the prism.
    pub radius: f64,
    /// Mean length.
    pub length: f64,
    /// Rods are up to this share longer or shorter.
    pub length_spread: f64,
    /// Angle between their mean direction and z, radians.
    pub lean: f64,
    /// Azimuth of the mean direction, radians from +x to +y.
    pub lean_azimuth: f64,
    /// Largest angle between a rod and the mean direction, radians.
    pub spread: f64,
    /// Places: 0 on a regular grid, 1 uniform.
    pub randomness: f64,
    /// Seed of places, directions and lengths.
    pub seed: u32,
    /// Sides of a rod's prism.
    pub segments: u32,
}

impl Rods {
    pub(super) fn read(values: &GeometryValues) -> Result<Self> {
        let whole = |key| values.whole(key).expect("has a default");
        let (lean, spread) = (values.number("lean_deg"), values.number("spread_deg"));
        if lean + spread > 85.0 {
            let key = if values.has("spread_deg") { "spread_deg" } else { "lean_deg" };
            let problem = format!("lean_deg {lean} and spread_deg {spread} lay rods down to {} degrees", lean + spread);
            return Err(values.error_at(key, problem, "their sum may be 85 at most"));
        }
        Ok(Self {
            period: values.number("period"),
            count: whole("count"),
            radius: values.number("radius"),
            length: values.number("length"),
            length_spread: values.number("length_spread"),
            lean: lean.to_radians(),
            lean_azimuth: values.number("lean_azimuth_deg").to_radians(),
            spread: spread.to_radians(),
            randomness: values.number("randomness"),
            seed: whole("seed"),
            segments: whole("segments"),
        })
    }

    /// Foot, direction (unit) and length of each rod.
    pub fn axes(&self) -> Vec<(DVec3, DVec3, f64)> {
        let mut random = Random::new(u64::from(self.seed));
        let (lean_sin, lean_cos) = libm::sincos(self.lean);
        let (azimuth_sin, azimuth_cos) = libm::sincos(self.lean_azimuth);
        // Turns z to the mean direction about the horizontal axis across it.
        let to_lean = DMat3::from_cols(
            DVec3::new(lean_cos * azimuth_cos, lean_cos * azimuth_sin, -lean_sin),
            DVec3::new(-azimuth_sin, azimuth_cos, 0.0),
            DVec3::new(lean_sin * azimuth_cos, lean_sin * azimuth_sin, lean_cos),
        );
        // The regular grid: the fewest columns of a nearly square one, filled row by row and each row evenly.
        let columns = (1..).find(|c| c * c >= self.count).expect("the count is finite");
        let rows = self.count.div_ceil(columns);
        let mut axes = Vec::with_capacity(self.count as usize);
        for k in 0..self.count {
            let row = k / columns;
            let in_row = columns.min(self.count - row * columns);
            let grid = DVec2::new((f64::from(k % columns) + 0.5) / f64::from(in_row), (f64::from(row) + 0.5) / f64::from(rows));
            // All five are drawn for every rod, so that changing one parameter moves nothing else.
            let [x, y, tilt, turn, stretch]: [f64; 5] = std::array::from_fn(|_| random.unit());
            let shift = self.randomness * (DVec2::new(x, y) - grid);
            let (tilt_sin, tilt_cos) = libm::sincos(self.spread * tilt.sqrt());
            let (turn_sin, turn_cos) = libm::sincos(TAU * turn);
            let axis = (to_lean * DVec3::new(tilt_sin * turn_cos, tilt_sin * turn_sin, tilt_cos)).normalize();
            let length = self.length * (1.0 + self.length_spread * (2.0 * stretch - 1.0));
            let sink = self.radius * (DVec2::new(axis.x, axis.y).length() + SUNK);
            axes.push((((grid + shift) * self.period).extend(-sink), axis, length));
        }
        axes
    }

    pub(super) fn build(&self) -> Result<Tile> {
        let n = self.segments;
        TileBuilder::check_size(f64::from(self.count) * f64::from(3 * n - 2), "use fewer rods or segments")?;
        let mut builder = TileBuilder::new(DVec2::splat(self.period), ["rods", "ground"]);
        for (foot, axis, length) in self.axes() {
            let (u, v) = axis.any_orthonormal_pair();
            let ring = |builder: &mut TileBuilder, centre: DVec3| -> Vec<u32> {
                let point = |k: u32| {
                    let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(n));
                    centre + self.radius * (cos * u + sin * v)
                };
                (0..n).map(|k| builder.vertex(point(k))).collect()
            };
            let (low, high) = (ring(&mut builder, foot), ring(&mut builder, foot + axis * length));
            for k in 0..low.len() {
                let next = (k + 1) % low.len();
                builder.quad(0, [low[k], low[next], high[next], high[k]]);
            }
            for k in 1..high.len() - 1 {
                builder.triangle(0, [high[0], high[k], high[k + 1]]);
            }
        }
        let p = self.period;
        let ground = [(0.0, 0.0), (p, 0.0), (p, p), (0.0, p)].map(|(x, y)| builder.vertex(DVec3::new(x, y, 0.0)));
        builder.quad(1, ground);
        builder.finish()
    }
}
