//! The result of an analysis, and its JSON.

use super::class::Class;
use super::finding::Finding;
use super::measured::Measured;
use super::relief::Relief;
use biscale::geometry::weave::Draft;
use serde::Serialize;

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
    /// One that found nothing yet.
    pub(super) fn nothing(mm_per_pixel: Option<f64>) -> Self {
        Self { mm_per_pixel, turn_deg: None, edge_turn_deg: None, weave: None, relief: None, findings: Vec::new() }
    }

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
