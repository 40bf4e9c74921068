//! The large object that the folded material is put on, and how many periods go around it.

use biscale::error::BadInput;
use biscale::numerics::cast::truncate_u32;
use glam::DVec2;
use serde::Serialize;
use std::f64::consts::TAU;

/// What the material is put on; lengths in mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "shape", rename_all = "lowercase")]
pub enum Target {
    /// A flat rectangle.
    Plane {
        /// Across the first lines.
        width: f64,
        /// Along them.
        height: f64,
    },
    /// A cylinder, wrapped around once.
    Cylinder {
        /// Of the bare cylinder.
        radius: f64,
        /// Of the wrapped part.
        height: f64,
    },
    /// The side of a cone, from its tip.
    Cone {
        /// Of the base circle.
        radius: f64,
        /// From base to tip.
        height: f64,
    },
    /// The four upright sides of a box.
    Box {
        /// One side.
        width: f64,
        /// The other.
        depth: f64,
        /// Upright.
        height: f64,
    },
}

/// How the pattern meets the target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct WrapFit {
    /// Periods around (or across).
    pub around: u32,
    /// Periods along the height.
    pub along: u32,
    /// Distance from line to line on the sheet that results, mm.
    pub pitch_mm: f64,
    /// What it is off from the design's, of that.
    pub residual: f64,
    /// The same along the height.
    pub residual_along: f64,
}

/// Overlap at the seam, mm. Chosen, not measured: as wide as glue sticks and tapes are, see also the join of pages.
pub const SEAM: f64 = 10.0;

impl Target {
    /// Reads `cylinder:radius=40,height=100`, `plane:width=..,height=..`, `cone:radius=..,height=..` or `box:width=..,depth=..,height=..`.
    ///
    /// # Errors
    /// An unknown shape or key, a missing or impossible length.
    pub fn parse(text: &str) -> Result<Self, BadInput> {
        let remedy =
            "write it like cylinder:radius=40,height=100 (or plane:width=,height=; cone:radius=,height=; box:width=,depth=,height=)";
        let bad = |problem: String| BadInput::new(problem, remedy).at_field("on");
        let (shape, rest) = text.split_once(':').unwrap_or((text, ""));
        let keys: &[&str] = match shape {
            "plane" => &["width", "height"],
            "cylinder" | "cone" => &["radius", "height"],
            "box" => &["width", "depth", "height"],
            _ => return Err(bad(format!("the shape \"{shape}\" is not known"))),
        };
        let mut values = vec![None; keys.len()];
        for part in rest.split(',').filter(|p| !p.is_empty()) {
            let (key, value) = part.split_once('=').ok_or_else(|| bad(format!("\"{part}\" is no key=length")))?;
            let k = keys.iter().position(|k| *k == key.trim()).ok_or_else(|| bad(format!("a {shape} has no \"{key}\"")))?;
            let value = value.trim().parse::<f64>().ok().filter(|v| (1.0..=1e4).contains(v));
            let value = value.ok_or_else(|| bad(format!("{part}: the length is not from 1 to 10000 mm")))?;
            if values[k].replace(value).is_some() {
                return Err(bad(format!("{key} stands twice")));
            }
        }
        let get = |k: usize| values[k].ok_or_else(|| bad(format!("{} of the {shape} is missing", keys[k])));
        Ok(match shape {
            "plane" => Self::Plane { width: get(0)?, height: get(1)? },
            "cylinder" => Self::Cylinder { radius: get(0)?, height: get(1)? },
            "cone" => Self::Cone { radius: get(0)?, height: get(1)? },
            _ => Self::Box { width: get(0)?, depth: get(1)?, height: get(2)? },
        })
    }

    /// Length around and along of the sheet in paper of a thickness, mm; of a cone around its base and along its side.
    pub fn extent(&self, thickness: f64) -> DVec2 {
        match *self {
            Self::Plane { width, height } => DVec2::new(width, height),
            Self::Cylinder { radius, height } => DVec2::new(TAU * (radius + thickness), height),
            Self::Cone { radius, height } => DVec2::new(TAU * (radius + thickness), radius.hypot(height)),
            Self::Box { width, depth, height } => DVec2::new(2.0 * (width + depth), height),
        }
    }

    /// How many periods of a pitch go around and along, and what pitch results: `n = round(2 pi (R + t) / pitch)`.
    pub fn fit(&self, period: DVec2, thickness: f64) -> WrapFit {
        let extent = self.extent(thickness);
        let count = (extent / period).round().max(DVec2::ONE).min(DVec2::splat(10_000.0));
        let pitch = extent / count;
        let [around, along] = count.to_array().map(truncate_u32);
        WrapFit { around, along, pitch_mm: pitch.x, residual: pitch.x / period.x - 1.0, residual_along: pitch.y / period.y - 1.0 }
    }

    /// Whether the sheet goes around and meets itself.
    pub fn closes(&self) -> bool {
        !matches!(self, Self::Plane { .. })
    }

    /// The outline of the sheet rolled out, with its seam, in a frame where periods follow each other along x (on a cone around its tip, 0).
    pub fn outline(&self, thickness: f64) -> Vec<DVec2> {
        let extent = self.extent(thickness);
        let seam = if self.closes() { SEAM } else { 0.0 };
        match self {
            Self::Cone { .. } => sector(extent, seam),
            _ => vec![DVec2::ZERO, DVec2::new(extent.x + seam, 0.0), DVec2::new(extent.x + seam, extent.y), DVec2::new(0.0, extent.y)],
        }
    }
}

/// The side of a cone rolled out: a sector whose arc is `extent.x` long at the distance `extent.y`, with a seam.
fn sector(extent: DVec2, seam: f64) -> Vec<DVec2> {
    let (side, angle) = (extent.y, extent.x / extent.y);
    let with_seam = angle + seam / side;
    let steps = 120;
    let mut out = vec![DVec2::ZERO];
    out.extend((0..=steps).map(|k| side * DVec2::from_angle(with_seam * f64::from(k) / f64::from(steps))));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_around_a_cylinder_are_whole_and_their_residual_is_told() {
        let target = Target::parse("cylinder:radius=40,height=100").unwrap();
        let fit = target.fit(DVec2::new(4.0, 4.0), 0.1);
        // 2 pi 40.1 / 4 = 62.99 periods: 63 of 3.99937 mm.
        assert_eq!((fit.around, fit.along), (63, 25));
        assert!((fit.pitch_mm - TAU * 40.1 / 63.0).abs() < 1e-12);
        assert!((fit.residual - (TAU * 40.1 / 252.0 - 1.0)).abs() < 1e-12, "{}", fit.residual);
    }

    #[test]
    fn shapes_that_cannot_be_are_refused_with_an_example() {
        for text in [
            "",
            "ball:radius=3",
            "cylinder",
            "cylinder:radius=40",
            "cylinder:radius=0,height=9",
            "cylinder:radius=nan,height=9",
            "cylinder:radius=40,height=100,depth=3",
            "cylinder:radius=40,radius=3,height=1",
            "box:width=3,depth=4",
            "plane:width=3;height=4",
        ] {
            let message = Target::parse(text).unwrap_err().to_string();
            assert!(message.contains("cylinder:radius=40,height=100"), "{text:?}: {message}");
        }
    }
}
