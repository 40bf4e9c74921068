//! What was found, and whether it is good enough.

use serde::Serialize;

/// What was found; lengths in mm.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct VerifyReport {
    /// Facets of the design.
    pub facets: usize,
    /// Pieces in the file.
    pub pieces: usize,
    /// Facets of the design that are not in the file exactly once, and polygons turned the wrong way.
    pub missing_or_double: usize,
    /// Largest difference of an edge's length from the design's, of that length.
    pub edge_length_error: f64,
    /// Largest difference of a fold's angle from the design's, degrees.
    pub fold_angle_error_deg: f64,
    /// Largest distance of a refolded corner from the design's, each piece moved as a whole to where it fits best.
    pub position_error_mm: f64,
    /// Largest gap between the two sides of a glued edge.
    pub glue_gap_mm: f64,
    /// Largest distance of a corner in the file's own folded form from the design's; none if the file has no such form.
    pub folded_form_error_mm: Option<f64>,
    /// Pairs of facets or tabs that overlap by more than `OVERLAP`.
    pub overlaps: usize,
    /// Area of the largest such overlap, mm².
    pub largest_overlap_mm2: f64,
    /// Crossings of cut lines with themselves and each other.
    pub crossings: usize,
    /// Relative difference between the area inside the cut lines and that of facets and tabs; none if the file has no cut lines.
    pub outline_area_error: Option<f64>,
    /// How far anything reaches into the margin.
    pub margin_violation_mm: f64,
    /// Glued edges with a number, and those whose number is not the same on both sides or stands at edges that do not belong together.
    pub numbered: usize,
    /// Of these, how many are wrong.
    pub wrong_numbers: usize,
    /// Least width of a facet.
    pub narrowest_facet_mm: f64,
    /// What is wrong with what is drawn, in words.
    pub printed: Vec<String>,
    /// What is wrong, in words; nothing if all is well.
    pub failures: Vec<String>,
}

/// Overlap of two polygons that counts, mm²: that of a hair of 0.01 mm over 10 mm is 0.1.
pub const OVERLAP: f64 = 1e-4;

/// Edge lengths must agree to this share.
pub const EDGE_LENGTH: f64 = 1e-6;

/// What rounding to the files' 8 decimals may change a length by, mm: it is no error, however short an edge is.
pub const LENGTH_DIGITS: f64 = 3e-8;

/// Refolded corners must lie where the design has them, mm.
pub const POSITION: f64 = 1e-4;

/// Fold angles must agree, degrees.
pub const ANGLE_DEG: f64 = 1e-4;

/// How far something may reach into the margin, mm: rounding of the files' 8 decimals.
pub(super) const MARGIN: f64 = 1e-6;
/// The area inside the cut lines must agree with that of facets and tabs to this share.
const OUTLINE_AREA: f64 = 1e-6;

/// Whether an error is above a limit, or no number.
fn exceeds(error: f64, limit: f64) -> bool {
    error.is_nan() || error > limit
}

impl VerifyReport {
    pub(super) fn judge(&mut self) {
        let mut failures = Vec::new();
        let mut check = |bad: bool, text: String| {
            if bad {
                failures.push(text);
            }
        };
        check(self.missing_or_double > 0, format!("{} facets are missing, double or turned", self.missing_or_double));
        check(exceeds(self.edge_length_error, EDGE_LENGTH), format!("an edge's length is off by {:e} of it", self.edge_length_error));
        check(exceeds(self.fold_angle_error_deg, ANGLE_DEG), format!("a fold is off by {:e} degrees", self.fold_angle_error_deg));
        check(exceeds(self.position_error_mm, POSITION), format!("a refolded corner is off by {:e} mm", self.position_error_mm));
        check(exceeds(self.glue_gap_mm, 2.0 * POSITION), format!("a glued edge gapes by {:e} mm", self.glue_gap_mm));
        check(self.folded_form_error_mm.is_some_and(|e| exceeds(e, POSITION)), "the folded form in the file is not the design".to_owned());
        check(self.overlaps > 0, format!("{} overlaps, the largest of {:.4} mm2", self.overlaps, self.largest_overlap_mm2));
        check(self.crossings > 0, format!("cut lines cross {} times", self.crossings));
        check(
            self.outline_area_error.is_some_and(|e| exceeds(e, OUTLINE_AREA)),
            "the cut lines do not hold the facets and tabs exactly".to_owned(),
        );
        check(self.wrong_numbers > 0, format!("{} numbers at glued edges are wrong", self.wrong_numbers));
        check(self.margin_violation_mm > MARGIN, format!("something reaches {:.3} mm into the margin", self.margin_violation_mm));
        failures.extend(self.printed.iter().cloned());
        self.failures = failures;
    }

    /// The report in a few lines.
    pub fn lines(&self) -> String {
        let optional = |x: Option<f64>| x.map_or("none in the file".to_owned(), |x| format!("{x:.2e}"));
        format!(
            "{} facets in {} pieces; {} missing or double\nlargest edge length error: {:.2e} of the length\n\
             largest fold angle error: {:.2e} degrees\nlargest position error after folding: {:.2e} mm\nlargest gap at glued edges: {:.2e} mm\n\
             folded form in the file: {} mm off\noverlaps: {}; crossings of cut lines: {}; area inside the cut lines: {} off\n\
             reaches into the margin: {:.3} mm\nnumbers at glued edges: {}, {} wrong\nnarrowest facet: {:.2} mm",
            self.facets,
            self.pieces,
            self.missing_or_double,
            self.edge_length_error,
            self.fold_angle_error_deg,
            self.position_error_mm,
            self.glue_gap_mm,
            optional(self.folded_form_error_mm),
            self.overlaps,
            self.crossings,
            optional(self.outline_area_error),
            self.margin_violation_mm.max(0.0),
            self.numbered,
            self.wrong_numbers,
            self.narrowest_facet_mm
        )
    }
}
