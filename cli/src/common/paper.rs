//! Papers by their names.

use biscale::error::{BadInput, Error, Result};
use biscale_fabricate::paper::Paper;
use glam::DVec2;

/// Papers by name, mm, upright.
const PAPERS: [(&str, f64, f64); 7] = [
    ("a4", 210.0, 297.0),
    ("a3", 297.0, 420.0),
    ("letter", 215.9, 279.4),
    ("a2", 420.0, 594.0),
    ("a5", 148.0, 210.0),
    ("legal", 215.9, 355.6),
    ("tabloid", 279.4, 431.8),
];

/// Width and height of other papers, mm.
const SIZES: std::ops::RangeInclusive<f64> = 50.0..=2000.0;

/// Reads `200x300`, `200x300mm` or `12x12in`, in mm.
fn size(text: &str) -> Option<DVec2> {
    let (text, unit) = match text.strip_suffix("in") {
        Some(text) => (text, 25.4),
        None => (text.strip_suffix("mm").unwrap_or(text), 1.0),
    };
    let (w, h) = text.split_once('x')?;
    let side = |t: &str| t.trim().parse::<f64>().ok().map(|v| v * unit).filter(|v| SIZES.contains(v));
    Some(DVec2::new(side(w)?, side(h)?))
}

/// Reads `a4`, `a4-landscape`, `200x300`, `12x12in` or `roll:WIDTH`; `margin` and `inset` in mm.
///
/// # Errors
/// Bad input for anything else.
pub fn parse(page: &str, margin: f64, inset: f64) -> Result<Paper> {
    let bad = |problem: String| {
        let remedy = "write a5, a4, a3, a2, letter, legal or tabloid, with -landscape if it lies, WxH in mm or 12x12in, or roll:WIDTH; 50 to 2000 mm";
        Error::from(BadInput::new(problem, remedy).at_field("page"))
    };
    let text = page.to_ascii_lowercase();
    if let Some(width) = text.strip_prefix("roll:") {
        let width = width.parse::<f64>().ok().filter(|w| (50.0..=2000.0).contains(w));
        let width = width.ok_or_else(|| bad(format!("\"{page}\" is no roll")))?;
        return Ok(Paper { name: "roll", size: DVec2::new(width, 2000.0), roll: true, margin, inset });
    }
    if let Some(size) = size(&text) {
        return Ok(Paper { name: "custom", size, roll: false, margin, inset });
    }
    let (name, lies) = text.strip_suffix("-landscape").map_or((text.as_str(), false), |n| (n, true));
    let Some(&(name, w, h)) = PAPERS.iter().find(|(n, ..)| *n == name) else {
        return Err(bad(format!("\"{page}\" is no paper")));
    };
    let size = if lies { DVec2::new(h, w) } else { DVec2::new(w, h) };
    Ok(Paper { name, size, roll: false, margin, inset })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn papers_are_named_or_measured() {
        let size = |page: &str| parse(page, 10.0, 0.0).map(|p| p.size.to_array()).ok();
        assert_eq!(size("a5"), Some([148.0, 210.0]));
        assert_eq!(size("Legal"), Some([215.9, 355.6]));
        assert_eq!(size("tabloid-landscape"), Some([431.8, 279.4]));
        assert_eq!(size("200x300"), Some([200.0, 300.0]));
        assert_eq!(size("200 x 300mm"), Some([200.0, 300.0]));
        let [w, h] = size("12x12in").unwrap_or_default();
        assert!((w - 304.8).abs() < 1e-9 && (h - 304.8).abs() < 1e-9);
        for bad in ["12x", "x12", "1x1in", "0x300", "nanx300", "3000x300", "b7", "12x12cm"] {
            assert_eq!(size(bad), None, "{bad}");
        }
    }
}
