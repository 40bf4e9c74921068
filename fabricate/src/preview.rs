//! What crafting changes: the effective BRDF of the design against that of the design as paper can take it.
//!
//! Paper does not bend around a radius smaller than its own: ridges become as round as a ball that rolls below the surface, valleys as
//! round as one that rolls above it. On a grid of heights these are the opening and the closing with a ball (Matheron and Serra's
//! mathematical morphology). The printed side is the outside, so a mountain is rounded by the fold's radius and the paper's thickness, a
//! valley by the radius alone. The comparison is made with the design sampled on the same grid, so that it tells rounding from sampling.

use crate::ribbons::ribbons;
use biscale::direction::Pair;
use biscale::error::{BadInput, Error, Result};
use biscale::filter::{Control, Quality, effective};
use biscale::geometry::weave::Weave;
use biscale::geometry::{HeightGrid, Tile};
use biscale::material::SmallScale;
use glam::{DVec2, DVec3};
use serde::Serialize;

/// Nodes along each side of the sampled period.
const NODES: usize = 96;
/// The same, for places that wrap around.
const WRAP: i64 = 96;
/// Triangles of a tile up to which each point looks through all of them.
const MAX_DENSE: usize = 20_000;
/// Relative error to which both are computed.
const TOLERANCE: f64 = 0.02;

/// What the paper's surface is.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "crafted", rename_all = "lowercase")]
pub enum Crafted {
    /// A height field with rounded folds.
    Rounded {
        /// Radius of ridges and valleys, printed mm.
        radius_mm: [f64; 2],
    },
    /// Flat strips in place of a weave's threads.
    Strips {
        /// Thickness of the paper, mm.
        thickness_mm: f64,
    },
}

impl Crafted {
    /// In words, before "change the effective BRDF by".
    pub fn text(&self) -> String {
        match self {
            Self::Rounded { radius_mm: [ridge, valley] } => format!("ridges of radius {ridge:.2} mm and valleys of {valley:.2} mm"),
            Self::Strips { thickness_mm } => format!("flat strips {thickness_mm:.2} mm thick in place of threads"),
        }
    }
}

/// The comparison.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Preview {
    /// What paper does to the surface.
    #[serde(flatten)]
    pub crafted: Crafted,
    /// RMS of the difference of the cosine-weighted BRDF over the RMS of the design's, over all pairs and channels.
    pub relative_rms: f64,
    /// The same between the design and its samples without rounding: what the sampling itself changes; 0 of strips, which are not sampled.
    pub sampling_rms: f64,
    /// Estimated relative error of the values themselves.
    pub error: f64,
    /// Pairs of directions compared.
    pub pairs: usize,
    /// Where the light stands and the viewer looks, degrees from upright in the plane x-z, and the ratio of the rounded surface's
    /// luminance to the design's there.
    pub along: Vec<(f64, f64, f64)>,
}

/// Compares `surface`, printed `printed_mm` for one of its units, with itself folded from paper.
///
/// # Errors
/// A surface that is no height field; those of the filter.
pub fn preview(
    surface: &SmallScale,
    printed_mm: f64,
    radius_mm: f64,
    thickness_mm: f64,
    seed: u64,
    control: &Control<'_>,
) -> Result<Preview> {
    let (ridge, valley) = ((radius_mm + thickness_mm) / printed_mm, radius_mm / printed_mm);
    let sampled = sample(&surface.tile)?;
    let rounded = morph(&morph(&sampled, surface.tile.period, ridge, false), surface.tile.period, valley, true);
    let plain = on_grid(surface, &sampled)?;
    let crafted = on_grid(surface, &rounded)?;
    let crafted_as = Crafted::Rounded { radius_mm: [radius_mm + thickness_mm, radius_mm] };
    compare(crafted_as, surface, Some(&plain), &crafted, seed, control)
}

/// Compares a weave with itself of paper strips.
///
/// # Errors
/// Paper thicker than the crimp; those of the filter.
pub fn preview_strips(
    surface: &SmallScale,
    weave: &Weave,
    printed_mm: f64,
    thickness_mm: f64,
    seed: u64,
    control: &Control<'_>,
) -> Result<Preview> {
    let crafted = ribbons(surface, weave, thickness_mm / printed_mm)?;
    compare(Crafted::Strips { thickness_mm }, surface, None, &crafted, seed, control)
}

/// Computes both, and the design as it is sampled where the crafted surface is.
fn compare(
    crafted_as: Crafted,
    surface: &SmallScale,
    plain: Option<&SmallScale>,
    crafted: &SmallScale,
    seed: u64,
    control: &Control<'_>,
) -> Result<Preview> {
    let pairs = pairs();
    let quality = Quality { tolerance: TOLERANCE, seed, ..Quality::default() };
    let run = |s: &SmallScale| effective(s, &pairs, &quality, control);
    let (design, crafted) = (run(surface)?, run(crafted)?);
    let plain = plain.map_or_else(|| Ok(design.clone()), run)?;
    let rms = |a: &biscale::filter::Effective, b: &biscale::filter::Effective| {
        let sum = |f: &dyn Fn(usize, usize) -> f64| (0..pairs.len()).flat_map(|k| (0..3).map(move |c| f(k, c).powi(2))).sum::<f64>();
        let size = sum(&|k, c| b.values[k].fbar[c]);
        if size > 0.0 { (sum(&|k, c| a.values[k].fbar[c] - b.values[k].fbar[c]) / size).sqrt() } else { 0.0 }
    };
    let luminance = |v: &[f64; 3]| 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2];
    let along = ANGLES
        .iter()
        .filter_map(|&to| {
            let k = pairs.iter().position(|p| *p == pair(LIGHT, to))?;
            let (a, b) = (luminance(&crafted.values[k].fbar), luminance(&plain.values[k].fbar));
            (b > 0.0).then_some((LIGHT, to, a / b))
        })
        .collect();
    Ok(Preview {
        crafted: crafted_as,
        relative_rms: rms(&crafted, &plain),
        sampling_rms: rms(&plain, &design),
        error: design.summary.relative_rms.max(crafted.summary.relative_rms),
        pairs: pairs.len(),
        along,
    })
}

/// Degrees from upright; the light of the table.
const ANGLES: [f64; 7] = [-60.0, -40.0, -20.0, 0.0, 20.0, 40.0, 60.0];
const LIGHT: f64 = 20.0;

fn direction(theta: f64, phi: f64) -> DVec3 {
    let ((s, c), (sp, cp)) = (theta.to_radians().sin_cos(), phi.to_radians().sin_cos());
    DVec3::new(s * cp, s * sp, c)
}

fn pair(ti: f64, to: f64) -> Pair {
    Pair { wi: direction(ti, 0.0), wo: direction(to, 0.0) }
}

/// Lights and viewers in the plane x-z, and across it.
fn pairs() -> Vec<Pair> {
    let mut out = Vec::new();
    for ti in [0.0, LIGHT, 45.0] {
        for to in ANGLES {
            out.push(pair(ti, to));
            out.push(Pair { wi: direction(ti, 90.0), wo: direction(to, 45.0) });
        }
    }
    out
}

/// Heights of the highest surface over each node, one period.
fn sample(tile: &Tile) -> Result<Vec<f64>> {
    let cell = tile.period / NODES as f64;
    let mut heights = vec![f64::NEG_INFINITY; NODES * NODES];
    for t in 0..tile.triangles.len() {
        let [a, b, c] = tile.corners(t);
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area < -1e-9 * tile.footprint() {
            return Err(overhang());
        }
        if area <= 0.0 {
            continue;
        }
        let low = (a.min(b).min(c).truncate() / cell).floor();
        let high = (a.max(b).max(c).truncate() / cell).ceil();
        let (x0, x1, y0, y1) = (low.x as i64, high.x as i64, low.y as i64, high.y as i64);
        for j in y0..=y1 {
            for i in x0..=x1 {
                let p = DVec2::new(i as f64, j as f64) * cell;
                let (u, v) = ((b.truncate() - p).perp_dot(c.truncate() - p) / area, (c.truncate() - p).perp_dot(a.truncate() - p) / area);
                let w = 1.0 - u - v;
                if u >= -1e-9 && v >= -1e-9 && w >= -1e-9 {
                    let wrapped = |k: i64| k.rem_euclid(WRAP) as usize;
                    let slot = &mut heights[wrapped(j) * NODES + wrapped(i)];
                    *slot = slot.max(u * a.z + v * b.z + w * c.z);
                }
            }
        }
    }
    if heights.iter().any(|h| !h.is_finite()) {
        return Err(overhang());
    }
    Ok(heights)
}

fn overhang() -> Error {
    let remedy =
        "leave --preview out: folds are rounded by a ball that rolls over and under the surface, which needs one height at every place";
    BadInput::new("the surface overhangs or has gaps, so that it is no height over the plane", remedy).at_field("--preview").into()
}

/// Opening (`closing` false) or closing with a ball, on the periodic grid.
fn morph(heights: &[f64], period: DVec2, radius: f64, closing: bool) -> Vec<f64> {
    let cell = period / NODES as f64;
    if radius < cell.min_element() {
        return heights.to_vec();
    }
    // No farther than half a period: a larger ball sees the same surface again.
    let reach = ((DVec2::splat(radius) / cell).floor()).min(DVec2::splat(NODES as f64 / 2.0));
    let mut ball: Vec<(i64, i64, f64)> = Vec::new();
    for j in -(reach.y as i64)..=reach.y as i64 {
        for i in -(reach.x as i64)..=reach.x as i64 {
            let r2 = (DVec2::new(i as f64, j as f64) * cell).length_squared();
            if r2 <= radius * radius {
                ball.push((i, j, (radius * radius - r2).sqrt()));
            }
        }
    }
    let at = |i: i64, j: i64| (j.rem_euclid(WRAP) as usize) * NODES + i.rem_euclid(WRAP) as usize;
    let dilate = |h: &[f64], sign: f64| -> Vec<f64> {
        (0..WRAP * WRAP)
            .map(|k| {
                let (x, y) = (k % WRAP, k / WRAP);
                sign * ball.iter().map(|&(i, j, b)| sign * h[at(x + i, y + j)] + b).fold(f64::NEG_INFINITY, f64::max)
            })
            .collect()
    };
    let (first, second) = if closing { (1.0, -1.0) } else { (-1.0, 1.0) };
    dilate(&dilate(heights, first), second)
}

/// The surface with these heights, covered as the original is below.
fn on_grid(surface: &SmallScale, heights: &[f64]) -> Result<SmallScale> {
    let tile = &surface.tile;
    let cell = tile.period / NODES as f64;
    let mut out = Tile {
        vertices: Vec::new(),
        triangles: Vec::new(),
        part_of_triangle: Vec::new(),
        parts: tile.parts.clone(),
        uv: None,
        period: tile.period,
        grid: Some(HeightGrid { columns: NODES, rows: NODES, heights: heights.to_vec() }),
        notes: Vec::new(),
    };
    for j in 0..=NODES {
        for i in 0..=NODES {
            out.vertices.push((DVec2::new(i as f64, j as f64) * cell).extend(heights[j % NODES * NODES + i % NODES]));
        }
    }
    if tile.triangles.len() > MAX_DENSE {
        let problem = format!("the tile has {} triangles", tile.triangles.len());
        return Err(BadInput::new(problem, "preview one of at most 20,000: lower its resolution").at_field("--preview").into());
    }
    let mut surface_of_triangle = Vec::new();
    let mut uv = Vec::new();
    for j in 0..NODES {
        for i in 0..NODES {
            let k = u32::try_from(j * (NODES + 1) + i).expect("few");
            let m = u32::try_from(NODES + 1).expect("few");
            for corners in [[k, k + 1, k + m + 1], [k, k + m + 1, k + m]] {
                let middle = corners.iter().map(|&c| out.vertices[c as usize].truncate()).sum::<DVec2>() / 3.0;
                let below = below(tile, middle);
                out.triangles.push(corners);
                out.part_of_triangle.push(tile.part_of_triangle[below]);
                surface_of_triangle.push(surface.surface_of_triangle[below]);
                uv.push(corners.map(|c| out.vertices[c as usize].truncate() / tile.period));
            }
        }
    }
    out.uv = tile.uv.as_ref().map(|_| uv);
    Ok(SmallScale { tile: out, surfaces: surface.surfaces.clone(), surface_of_triangle })
}

/// The highest triangle over a point of the period.
fn below(tile: &Tile, p: DVec2) -> usize {
    let mut best = (f64::NEG_INFINITY, 0);
    for t in 0..tile.triangles.len() {
        let [a, b, c] = tile.corners(t);
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        if area <= 0.0 {
            continue;
        }
        for shift in
            [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE, -DVec2::X, -DVec2::Y, -DVec2::ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)]
        {
            let q = p + shift * tile.period;
            let (u, v) = ((b.truncate() - q).perp_dot(c.truncate() - q) / area, (c.truncate() - q).perp_dot(a.truncate() - q) / area);
            let z = u * a.z + v * b.z + (1.0 - u - v) * c.z;
            if u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 && z > best.0 {
                best = (z, t);
            }
        }
    }
    best.1
}
