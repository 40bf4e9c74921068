//! `kind = "grooves"`: straight grooves along y, one to a period.
//!
//! Ridges lie at z = 0 and bottoms at z = -depth. A groove begins at x = 0 with its ridge: for V and sawtooth the ridge is an
//! edge at x = 0, the flat-bottomed profile has its top on `0..top_width`. The surface is the same at every y; the period in y
//! is that in x.

use super::builder::TileBuilder;
use super::params::{Param, Unit, choice, derived, number, scaled};
use super::tile::Tile;
use super::values::GeometryValues;
use crate::error::Result;
use crate::toml_reader::range;
use glam::{DVec2, DVec3};

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    choice("profile", "flat", &["flat", "v", "sawtooth"], "Cross section: flat-bottomed, V, or sawtooth"),
    number("period", Unit::Length, 1.0, range(1e-6, 1e6), "Distance from groove to groove, along x"),
    scaled("depth", "period", 0.5, range(0.0, 1e9), "Height of the ridges above the bottom"),
    scaled("floor_width", "period", 0.3, range(0.0, 1e6), "Width of the floor (profile \"flat\" only)"),
    scaled("top_width", "period", 0.3, range(0.0, 1e6), "Width of the flat ridge tops (profile \"flat\" only)"),
    derived("steep_angle_deg", Unit::Degrees, ("90.0", 90.0), range(1e-3, 90.0), "Slope of the steep side (profile \"sawtooth\" only)"),
];

/// Parts of this kind, with what they are.
pub const PARTS: &[(&str, &str)] = &[
    ("floor", "the floor (profile \"flat\")"),
    ("sides", "both sides (profile \"flat\")"),
    ("tops", "the ridge tops (profile \"flat\" with a top_width)"),
];

/// Straight grooves along y.
#[derive(Clone, Debug, PartialEq)]
pub struct Grooves {
    /// Cross section.
    pub profile: Profile,
    /// Distance from groove to groove.
    pub period: f64,
    /// Height of the ridges above the bottom, from 0.
    pub depth: f64,
}

/// Cross section of a groove.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// Parts `floor`, `sides` and `tops`.
    Flat {
        /// Width of the floor.
        floor_width: f64,
        /// Width of the ridge tops; with the floor at most the period.
        top_width: f64,
    },
    /// Parts `left` (faces +x) and `right` (faces -x).
    V,
    /// Parts `gentle` (faces -x, rises from the bottom to the ridge at x = period) and `steep` (faces +x).
    Sawtooth {
        /// Horizontal extent of the steep side, at most half the period.
        steep_width: f64,
    },
}

impl Grooves {
    pub(super) fn read(values: &GeometryValues) -> Result<Self> {
        let period = values.number("period");
        let depth = values.number("depth");
        let profile = values.choice("profile");
        let only = |key: &'static str, wanted: &str| {
            let remedy = format!("remove it, or write `profile = \"{wanted}\"`");
            if values.has(key) && profile != Some(wanted) {
                Err(values.error_at(key, "this profile has no such key", remedy))
            } else {
                Ok(())
            }
        };
        only("floor_width", "flat")?;
        only("top_width", "flat")?;
        only("steep_angle_deg", "sawtooth")?;
        let profile = match profile {
            Some("v") => Profile::V,
            Some("sawtooth") => {
                let angle = values.optional("steep_angle_deg").unwrap_or(90.0);
                // tan(90 degrees) is 1.6e16 in binary: a step is a step.
                let steep_width = if angle == 90.0 { 0.0 } else { depth / libm::tan(angle.to_radians()) };
                if steep_width > 0.5 * period {
                    let least = libm::atan2(depth, 0.5 * period).to_degrees();
                    let problem = format!("at {angle} degrees the steep side is {steep_width} wide, more than half the period");
                    return Err(values.error_at("steep_angle_deg", problem, format!("write an angle of at least {least:.3}")));
                }
                Profile::Sawtooth { steep_width }
            }
            _ => {
                let (floor_width, top_width) = (values.number("floor_width"), values.number("top_width"));
                // Defaults that add up to the period exactly must not fail by rounding.
                if floor_width + top_width > period * (1.0 + 4.0 * f64::EPSILON) {
                    let key = if values.has("floor_width") { "floor_width" } else { "top_width" };
                    let problem = format!("floor_width {floor_width} and top_width {top_width} are wider than the period {period}");
                    return Err(values.error_at(key, problem, "make one smaller; what they leave is shared by the two sides"));
                }
                Profile::Flat { floor_width, top_width }
            }
        };
        Ok(Self { profile, period, depth })
    }

    pub(super) fn build(&self) -> Result<Tile> {
        let (p, bottom) = (self.period, -self.depth);
        // The cross section as a polyline, x never falling; each point with the part of the segment that ends in it.
        let (parts, points): (&[&str], Vec<(f64, f64, u16)>) = match self.profile {
            Profile::V => (&["left", "right"], vec![(0.0, 0.0, 0), (0.5 * p, bottom, 0), (p, 0.0, 1)]),
            Profile::Sawtooth { steep_width } => (&["steep", "gentle"], vec![(0.0, 0.0, 0), (steep_width, bottom, 0), (p, 0.0, 1)]),
            Profile::Flat { floor_width, top_width } => {
                let side = (0.5 * (p - floor_width - top_width)).max(0.0);
                let foot = (top_width + side).min(p);
                let points = vec![(0.0, 0.0, 1), (top_width, 0.0, 2), (foot, bottom, 1), (p - side, bottom, 0), (p, 0.0, 1)];
                (&["floor", "sides", "tops"], points)
            }
        };
        let mut builder = TileBuilder::new(DVec2::splat(p), parts.iter().copied());
        for pair in points.windows(2) {
            let [(x0, z0, _), (x1, z1, part)] = [pair[0], pair[1]];
            if (x0, z0) == (x1, z1) {
                continue;
            }
            let corners = [(x0, 0.0, z0), (x1, 0.0, z1), (x1, p, z1), (x0, p, z0)];
            let corners = corners.map(|(x, y, z)| builder.vertex(DVec3::new(x, y, z)));
            builder.quad(part, corners);
        }
        builder.finish()
    }
}
