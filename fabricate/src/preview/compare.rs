//! What crafting changes: the effective BRDF of the design against that of the design as paper can take it.
//!
//! Paper does not bend around a radius smaller than its own: ridges become as round as a ball that rolls below the surface, valleys as
//! round as one that rolls above it. On a grid of heights these are the opening and the closing with a ball (Matheron and Serra's
//! mathematical morphology). The printed side is the outside, so a mountain is rounded by the fold's radius and the paper's thickness, a
//! valley by the radius alone. The comparison is made with the design sampled on the same grid, so that it tells rounding from sampling.

use super::ribbons::ribbons;
use super::rounding::{morph, on_grid, sample};
use biscale::direction::Pair;
use biscale::error::Result;
use biscale::filter::{Control, Quality, effective};
use biscale::geometry::weave::Weave;
use biscale::material::SmallScale;
use biscale::numerics::colour::luminance;
use glam::DVec3;
use serde::Serialize;

/// Relative error to which both are computed. Chosen, not measured: below what rounding changes where it is worth telling.
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
    let along = ANGLES
        .iter()
        .filter_map(|&to| {
            let k = pairs.iter().position(|p| *p == pair(LIGHT, to))?;
            let (a, b) = (luminance(crafted.values[k].fbar), luminance(plain.values[k].fbar));
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

/// Viewers of the table, degrees from upright, and its light.
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
