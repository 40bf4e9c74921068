//! Papers by their names.

use biscale::error::{BadInput, Error, Result};
use biscale_fabricate::paper::Paper;
use glam::DVec2;

/// Papers by name, mm, upright.
const PAPERS: [(&str, f64, f64); 4] = [("a4", 210.0, 297.0), ("a3", 297.0, 420.0), ("letter", 215.9, 279.4), ("a2", 420.0, 594.0)];

/// Reads `a4`, `a4-landscape` or `roll:WIDTH`; `margin` and `inset` in mm.
///
/// # Errors
/// Bad input for anything else.
pub fn parse(page: &str, margin: f64, inset: f64) -> Result<Paper> {
    let bad = |problem: String| {
        let remedy = "write a4, a3, a2 or letter, with -landscape if it lies, or roll:WIDTH in mm from 50 to 2000";
        Error::from(BadInput::new(problem, remedy).at_field("page"))
    };
    let text = page.to_ascii_lowercase();
    if let Some(width) = text.strip_prefix("roll:") {
        let width = width.parse::<f64>().ok().filter(|w| (50.0..=2000.0).contains(w));
        let width = width.ok_or_else(|| bad(format!("\"{page}\" is no roll")))?;
        return Ok(Paper { name: "roll", size: DVec2::new(width, 2000.0), roll: true, margin, inset });
    }
    let (name, lies) = text.strip_suffix("-landscape").map_or((text.as_str(), false), |n| (n, true));
    let Some(&(name, w, h)) = PAPERS.iter().find(|(n, ..)| *n == name) else {
        return Err(bad(format!("\"{page}\" is no paper")));
    };
    let size = if lies { DVec2::new(h, w) } else { DVec2::new(w, h) };
    Ok(Paper { name, size, roll: false, margin, inset })
}
