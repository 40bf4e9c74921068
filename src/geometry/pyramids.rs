//! `kind = "pyramids"`: one pyramid on a regular n-gon to a cell.
//!
//! The base is a regular n-gon with a horizontal lowest edge, and the cell is its bounding box: a square base fills the cell, others
//! leave ground in the corners. The cell is then stretched along y by `1 / ratio`. `side-1` is the side over the lowest edge
//! (it faces -y); the others follow counter-clockwise. The base lies at z = 0; a negative height makes pits.

use super::builder::TileBuilder;
use super::params::{Param, Unit, Value, number, scaled, whole};
use super::tile::Tile;
use super::values::GeometryValues;
use crate::error::Result;
use crate::toml_reader::range;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    whole("sides", 4, 3, 360, "Number of sides"),
    number("period", Unit::Length, 1.0, range(1e-6, 1e6), "Width of a cell along x"),
    number(
        "ratio",
        Unit::One,
        1.0,
        range(1e-3, 1e3),
        "How much narrower the pyramid is along y than a regular one (above 1), or wider (below 1)",
    ),
    scaled("height", "period", 0.5, range(-1e9, 1e9), "Height of the tip above the base; negative for pits"),
    Param {
        key: "tip",
        value: Value::Pair { unit: Unit::One, default: Some([0.0, 0.0]), example: [0.0, 0.0], range: range(-1.0, 1.0) },
        help: "Offset of the tip from the centre of the base, as shares of the cell",
    },
    number("gap", Unit::One, 0.0, range(0.0, 0.999), "Flat ground between neighbouring bases, as a share of the cell"),
];

/// Parts of this kind, with what they are.
pub const PARTS: &[(&str, &str)] = &[
    ("side-1", "the side over the lowest edge, facing -y"),
    ("side-2", "the next one counter-clockwise; for 4 sides it faces +x"),
    ("side-3", "for 4 sides it faces +y"),
    ("side-4", "for 4 sides it faces -x; more sides follow as side-5 ..."),
    ("ground", "what the base leaves of the cell (a square base without gap leaves none)"),
];

/// One pyramid to a cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Pyramids {
    /// Number of sides, from 3.
    pub sides: u32,
    /// Size of the cell.
    pub period: DVec2,
    /// Height of the tip above the base; negative for pits.
    pub height: f64,
    /// Offset of the tip from the centre of the base, as shares of the cell.
    pub tip: DVec2,
    /// Flat ground between neighbouring bases, as a share of the cell, below 1.
    pub gap: f64,
}

/// Corners of a regular n-gon with a horizontal lowest edge, counter-clockwise from that edge's left end, scaled to fill the unit
/// square exactly.
struct Base {
    corners: Vec<DVec2>,
    /// The polygon's own centre.
    centre: DVec2,
    /// Height over width of its bounding box before the scaling.
    aspect: f64,
}

fn base_polygon(sides: u32) -> Base {
    let step = TAU / f64::from(sides);
    let corner = |k: u32| {
        let (sin, cos) = libm::sincos(step * (f64::from(k) - 0.5));
        DVec2::new(sin, -cos)
    };
    let corners: Vec<DVec2> = (0..sides).map(corner).collect();
    let low = corners.iter().copied().fold(DVec2::INFINITY, DVec2::min);
    let high = corners.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
    // Corners that touch the box by symmetry do so exactly, so that neighbouring cells close.
    let snap = |t: f64| if (t - t.round()).abs() < 1e-12 { t.round() } else { t };
    let unit = |c: DVec2| DVec2::new(snap((c.x - low.x) / (high.x - low.x)), snap((c.y - low.y) / (high.y - low.y)));
    let aspect = snap((high.y - low.y) / (high.x - low.x));
    Base { corners: corners.into_iter().map(unit).collect(), centre: DVec2::new(0.5, unit(DVec2::ZERO).y), aspect }
}

impl Pyramids {
    pub(super) fn read(values: &GeometryValues) -> Self {
        let sides = values.whole("sides").expect("sides has a default");
        let period = values.number("period");
        let period = DVec2::new(period, period * base_polygon(sides).aspect / values.number("ratio"));
        let tip = values.pair("tip").expect("tip has a default").into();
        Self { sides, period, height: values.number("height"), tip, gap: values.number("gap") }
    }

    /// The base in the unit square, with the gap around it.
    fn base(&self) -> Base {
        let inset = |unit: DVec2| if self.gap == 0.0 { unit } else { DVec2::splat(0.5 * self.gap) + unit * (1.0 - self.gap) };
        let Base { corners, centre, aspect } = base_polygon(self.sides);
        Base { corners: corners.into_iter().map(inset).collect(), centre: inset(centre), aspect }
    }

    /// Where the tip lies.
    pub fn apex(&self) -> DVec3 {
        ((self.base().centre + self.tip) * self.period).extend(self.height)
    }

    pub(super) fn build(&self) -> Result<Tile> {
        let ground = u16::try_from(self.sides).expect("at most 360 sides");
        let names = (1..=self.sides).map(|k| format!("side-{k}")).chain(["ground".to_owned()]);
        let mut builder = TileBuilder::new(self.period, names);
        let place = |unit: DVec2| (unit * self.period).extend(0.0);
        let (base, tip) = (self.base().corners, self.apex());
        let next = |k: usize| (k + 1) % base.len();
        for (part, k) in (0_u16..).zip(0..base.len()) {
            builder.triangle_at(part, [place(base[k]), place(base[next(k)]), tip]);
        }
        // The ring of ground between the polygon and the cell's rectangle. Each edge is joined to the corner of the cell in the
        // quadrant that it faces; where two neighbouring edges face different corners, their common end is joined to that side.
        let corners = [DVec2::new(0.0, 0.0), DVec2::new(1.0, 0.0), DVec2::new(1.0, 1.0), DVec2::new(0.0, 1.0)];
        let faced = |k: usize| {
            let edge = base[next(k)] - base[k];
            match (edge.y > 0.0, edge.x < 0.0) {
                (false, false) => 0,
                (true, false) => 1,
                (true, true) => 2,
                (false, true) => 3,
            }
        };
        let mut ring: Vec<[DVec2; 3]> = Vec::new();
        for k in 0..base.len() {
            let (mut corner, last) = (faced(k), faced(next(k)));
            ring.push([base[next(k)], base[k], corners[corner]]);
            while corner != last {
                let following = (corner + 1) % 4;
                ring.push([corners[corner], corners[following], base[next(k)]]);
                corner = following;
            }
        }
        for triangle in ring {
            let [a, b, c] = triangle;
            // Where the base touches the cell there is no ground; the coordinates are exact there.
            if (b - a).perp_dot(c - a) > 0.0 {
                builder.triangle_at(ground, triangle.map(place));
            }
        }
        builder.finish()
    }
}
