//! The result of an analysis, and how it is put together.

use super::class::Class;
use super::cloth::{self, Cloth};
use super::colour;
use super::finding::{Code, Finding};
use super::orientation::Edges;
use super::relief::{self, Relief};
use super::scale::{self, Scale};
use super::{Options, Photo, autocorrelation, labels};
use biscale::error::Result;
use biscale::geometry::weave::draft::Draft;
use glam::{DMat2, DVec2};
use serde::Serialize;

/// A value with its standard error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Standard error, in the same unit.
    pub error: f64,
}

/// What is known of the threads of one direction. Lengths are in the unit of the [`Analysis`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Axis {
    /// Distance from thread to thread, across them, by the peaks of the spectrum.
    pub pitch: Measured,
    /// The same by the peaks of the autocorrelation, if those could be located.
    pub pitch_by_autocorrelation: Option<Measured>,
    /// Width of a thread as it is seen from above.
    pub width: Measured,
    /// Distance from a thread to the next.
    pub gap: f64,
    /// Pixels of the photograph from thread to thread.
    pub pixels: f64,
    /// Counter-clockwise turn of the threads from the picture's axis, in degrees, by the spectrum.
    pub turn_deg: Measured,
    /// Mean linear colour of the threads where they lie on top.
    pub colour: [f64; 3],
    /// Pixels of the analysed cut that the colour is the mean of.
    pub colour_pixels: f64,
}

/// A woven surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Weave {
    /// Threads nearer to the vertical.
    pub warp: Axis,
    /// Threads nearer to the horizontal.
    pub weft: Axis,
    /// One repeat, row 0 the lowest: where the warp lies over.
    pub draft: Draft,
    /// Its name.
    pub class: Class,
    /// How much better the draft explains the photograph than the next best: 0 not at all, towards 1 it leaves nothing; 1 if the draft was given.
    pub confidence: f64,
    /// Share of the photograph's variation that the draft does not explain.
    pub unexplained: f64,
    /// Size of one repeat of the draft along weft and warp.
    pub repeat: [f64; 2],
    /// Shares of the area where warp, weft and neither are on top.
    pub cover: [f64; 3],
    /// Difference of the two thread colours, Delta E 1976.
    pub colour_difference: f64,
    /// Height of the threads over their width, as the shading suggests: a guess.
    pub flatness: f64,
}

/// What a photograph says.
#[derive(Clone, Debug, PartialEq)]
pub struct Analysis {
    /// Millimetres per pixel; without it lengths are in pixels.
    pub mm_per_pixel: Option<f64>,
    /// Counter-clockwise turn of the surface in degrees, by the lattice of its spectrum.
    pub turn_deg: Option<f64>,
    /// The same by the structure tensor of the edges near it: a check, since shadows and the ends of floats have edges too.
    pub edge_turn_deg: Option<f64>,
    /// The cloth, if there is one.
    pub weave: Option<Weave>,
    /// Grooves or pyramids, if it is no cloth.
    pub relief: Option<Relief>,
    /// What is wrong; empty if nothing is.
    pub findings: Vec<Finding>,
}

impl Analysis {
    /// All of it for `close_up.weave` of a capture file; the draft as texts, one a weft, the lowest first.
    pub fn to_json(&self) -> serde_json::Value {
        let weave = self.weave.as_ref().map(|w| {
            let text = |row: &[bool]| row.iter().map(|&over| if over { '1' } else { '0' }).collect::<String>();
            let draft: Vec<String> = w.draft.warp_over.chunks(w.draft.columns).map(text).collect();
            serde_json::json!({
                "class": w.class, "class_name": w.class.to_string(), "confidence": w.confidence, "unexplained": w.unexplained,
                "draft": draft, "warp": w.warp, "weft": w.weft, "repeat": w.repeat, "cover": w.cover,
                "colour_difference": w.colour_difference, "flatness": w.flatness,
            })
        });
        serde_json::json!({
            "unit": if self.mm_per_pixel.is_some() { "mm" } else { "px" }, "turn_deg": self.turn_deg,
            "edge_turn_deg": self.edge_turn_deg, "weave": weave, "relief": self.relief, "findings": self.findings,
        })
    }
}

/// Fewest pixels from thread to thread for which a draft is trusted.
pub const MIN_PIXELS_A_THREAD: f64 = 8.0;
/// Most of the variation of a photograph that a cloth may leave unexplained.
pub const MAX_UNEXPLAINED: f64 = 0.5;
/// The next best draft must leave at least this much more unexplained: confidence is 1 - best / next best.
pub const MIN_CONFIDENCE: f64 = 0.05;

pub(super) fn analyse(photo: &Photo<'_>, options: &Options) -> Result<Analysis> {
    let mut result =
        Analysis { mm_per_pixel: photo.mm_per_pixel, turn_deg: None, edge_turn_deg: None, weave: None, relief: None, findings: Vec::new() };
    let scale = match scale::find(photo) {
        Ok(scale) => scale,
        Err((measured, threshold)) => {
            let message = "nothing in the photograph repeats: take a sharper one, nearer, with more of the surface in it".to_owned();
            result.findings.push(Finding { code: Code::NoPeriod, message, measured, threshold });
            return Ok(result);
        }
    };
    let edges = Edges::of(&scale.field);
    let found = cloth::find(&scale, &edges, options.draft.as_ref());
    let Some(cloth) = found.filter(|c| !c.guesses.is_empty()) else {
        // It repeats along one direction, or so that no threads can lie in it.
        if options.draft.is_some() {
            let message = "the photograph repeats, but not as a cloth of the given draft does".to_owned();
            result.findings.push(Finding { code: Code::AmbiguousWeave, message, measured: 1.0, threshold: MAX_UNEXPLAINED });
            return Ok(result);
        }
        if scale.lattice.basis.len() == 1 {
            let measured = relief::repeating(&scale);
            if measured < relief::MIN_REPEATING {
                let message = format!(
                    "brightness changes across one direction, but only {:.0} % of that repeats, as at an edge or a shadow: show more of the surface",
                    100.0 * measured
                );
                result.findings.push(Finding { code: Code::NoPeriod, message, measured, threshold: relief::MIN_REPEATING });
                return Ok(result);
            }
        }
        let relief = relief::describe(photo, &scale);
        result.turn_deg = Some(relief.turn_deg);
        result.relief = Some(relief);
        return Ok(result);
    };
    let turns = cloth.grid.turns();
    result.turn_deg = Some(0.5 * (turns[0] + turns[1]).to_degrees());
    result.edge_turn_deg = Some(edges.sharpen(0.5 * (turns[0] + turns[1])).to_degrees());
    let weave = describe(photo, &scale, &cloth, options.draft.as_ref());
    let fewest = weave.warp.pixels.min(weave.weft.pixels);
    if fewest < MIN_PIXELS_A_THREAD {
        let message = format!(
            "threads are {fewest:.1} pixels apart: what is on top is a guess; photograph from nearer, {MIN_PIXELS_A_THREAD} pixels a thread or more"
        );
        result.findings.push(Finding { code: Code::Undersampled, message, measured: fewest, threshold: MIN_PIXELS_A_THREAD });
    }
    if weave.unexplained > MAX_UNEXPLAINED {
        let message = format!("no draft explains more than {:.0} % of what the photograph shows", 100.0 * (1.0 - weave.unexplained));
        let (measured, threshold) = (weave.unexplained, MAX_UNEXPLAINED);
        result.findings.push(Finding { code: Code::AmbiguousWeave, message, measured, threshold });
    } else if weave.confidence < MIN_CONFIDENCE {
        let message =
            format!("another draft explains the photograph nearly as well as {}: give the draft, or a photograph from nearer", weave.class);
        let (measured, threshold) = (weave.confidence, MIN_CONFIDENCE);
        result.findings.push(Finding { code: Code::AmbiguousWeave, message, measured, threshold });
    }
    result.weave = Some(weave);
    Ok(result)
}

/// Turns what was found into numbers with units.
fn describe(photo: &Photo<'_>, scale: &Scale, cloth: &Cloth, given: Option<&Draft>) -> Weave {
    let (grid, best) = (&cloth.grid, &cloth.guesses[0]);
    let pixels = scale.field.factor as f64;
    let unit = photo.mm_per_pixel.unwrap_or(1.0) * pixels;
    let draft = given.cloned().unwrap_or_else(|| labels::draft_of(grid.repeat, &best.labels));
    let confidence = match (given, cloth.guesses.get(1)) {
        (Some(_), _) | (None, None) => 1.0,
        (None, Some(second)) => 1.0 - best.cost(grid.repeat) / second.cost(grid.repeat).max(1e-12),
    };
    // The vectors after which the cloth repeats are dual to the lattice of its spectrum.
    let basis = &scale.lattice.basis;
    let dual = DMat2::from_cols(basis[0], basis[1]).transpose().inverse();
    let by_shifts = autocorrelation::repeats(&scale.spectrum, &[dual.col(0), dual.col(1)]).map(|(vectors, error)| {
        let back = DMat2::from_cols(vectors[0], vectors[1]).transpose().inverse();
        let at = |[m, n]: [i64; 2]| (back.col(0) * m as f64 + back.col(1) * n as f64).length();
        let share = error / vectors.iter().map(|v| v.length()).fold(f64::INFINITY, f64::min);
        grid.whole.map(|whole| {
            let pitch = 1.0 / at(whole);
            Measured { value: pitch * unit, error: pitch * unit * share }
        })
    });
    let (colours, colour_difference) = thread_colours(scale, cloth);
    let axis = |k: usize| {
        let f: DVec2 = [grid.u, grid.v][k];
        let [m, n] = grid.whole[k].map(|w| w as f64);
        let error = scale.lattice.error_of(m, n);
        let pitch = 1.0 / f.length();
        let (fill, fill_error) = cloth.fill(k);
        let width = fill * pitch;
        Axis {
            pitch: Measured { value: pitch * unit, error: pitch * pitch * error * unit },
            pitch_by_autocorrelation: by_shifts.map(|b| b[k]),
            width: Measured { value: width * unit, error: fill_error * pitch * unit },
            gap: (pitch - width).max(0.0) * unit,
            pixels: pitch * pixels,
            turn_deg: Measured { value: grid.turns()[k].to_degrees(), error: (error * pitch).to_degrees() },
            colour: colours[k].0,
            colour_pixels: colours[k].1,
        }
    };
    let (warp, weft) = (axis(0), axis(1));
    Weave {
        repeat: [warp.pitch.value * draft.columns as f64, weft.pitch.value * draft.rows as f64],
        class: Class::of(&draft),
        draft,
        confidence,
        unexplained: best.fit.residual,
        cover: best.fit.shares,
        colour_difference,
        flatness: best.shape.flatness,
        warp,
        weft,
    }
}

/// Mean colours of warp and weft where they are on top, with how many pixels, and their difference.
///
/// The tops of the threads are grouped into two colours by k-means in Lab. If the groups are the threads, each thread takes its group's
/// mean, free of what the other shows at its edges; if not, the threads have one colour, and each takes its own mean.
fn thread_colours(scale: &Scale, cloth: &Cloth) -> ([([f64; 3], f64); 2], f64) {
    /// Share of a thread's half width that counts as its top.
    const TOP: f64 = 0.7;
    /// Share of the tops that must lie in their thread's group.
    const AGREEMENT: f64 = 0.8;
    let best = &cloth.guesses[0];
    let field = &scale.field;
    let (mut mean, mut count) = ([0.0; 3], 0.0);
    for (rgb, _) in field.rgb.iter().zip(&field.valid).filter(|p| *p.1) {
        (0..3).for_each(|c| mean[c] += f64::from(rgb[c]));
        count += 1.0;
    }
    let mean = mean.map(|m| m / f64::max(count, 1.0));
    let white = mean.iter().fold(1e-9_f64, |a, &b| a.max(b)) * 2.0;
    let mut tops: Vec<(usize, [f64; 3], f64)> = Vec::new();
    for (bin, top) in best.shape.tops(&cloth.fold, &best.labels).enumerate() {
        if top.what < 2 && top.off.abs() < TOP && cloth.fold.count[bin] > 0.0 {
            let colour = cloth.fold.colour[bin];
            tops.push((top.what, [0, 1, 2].map(|c| f64::from(colour[c]) * mean[c]), f64::from(cloth.fold.count[bin])));
        }
    }
    let groups = colour::k_means(&tops.iter().map(|t| (t.1, t.2)).collect::<Vec<_>>(), 2, white);
    let group_of = |linear: [f64; 3]| {
        let lab = colour::lab(linear.map(|v| v / white));
        (0..groups.len()).min_by(|&a, &b| colour::delta_e(groups[a].lab, lab).total_cmp(&colour::delta_e(groups[b].lab, lab))).unwrap_or(0)
    };
    // Weights of each thread's tops in each group.
    let mut shared = [[0.0_f64; 2]; 2];
    let grouped: Vec<usize> = tops.iter().map(|t| group_of(t.1)).collect();
    tops.iter().zip(&grouped).for_each(|(t, &g)| shared[t.0][g] += t.2);
    let straight = shared[0][0] + shared[1][1];
    let crossed = shared[0][1] + shared[1][0];
    let total = straight + crossed;
    let apart = straight.max(crossed) > AGREEMENT * total;
    let own = |thread: usize| if straight >= crossed { thread } else { 1 - thread };
    let colours = [0, 1].map(|thread| {
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for (t, &g) in tops.iter().zip(&grouped) {
            if t.0 == thread && (!apart || g == own(thread)) {
                (0..3).for_each(|c| sum[c] += t.1[c] * t.2);
                weight += t.2;
            }
        }
        (sum.map(|s| s / f64::max(weight, 1e-9)), weight)
    });
    let labs = colours.map(|c| colour::lab(c.0.map(|v| v / white)));
    (colours, colour::delta_e(labs[0], labs[1]))
}
