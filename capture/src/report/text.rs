//! Numbers, colours and words as the report writes them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use biscale::formats::capture::Severity;
use biscale::numerics::cast::truncate_usize;
use biscale::numerics::colour::linear_to_srgb;

/// A severity as word, which is its class in the style sheet as well.
pub(super) fn word(severity: Severity) -> &'static str {
    match severity {
        Severity::Ok => "ok",
        Severity::Warn => "warn",
        Severity::Fail => "fail",
    }
}

/// A number and its noun.
pub(super) fn counted(n: usize, one: &str, many: &str) -> String {
    format!("{n} {}", if n == 1 { one } else { many })
}

/// A number with four significant digits.
pub(super) fn digits(v: f64) -> String {
    /// Decades that are written without an exponent.
    const PLAIN: std::ops::Range<f64> = -4.0..6.0;
    if v == 0.0 {
        return "0".into();
    }
    let size = v.abs().log10().floor();
    if !PLAIN.contains(&size) {
        return format!("{v:.3e}");
    }
    let decimals = truncate_usize((3.0 - size).max(0.0));
    let text = format!("{v:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A linear colour in CSS.
pub(super) fn css(rgb: [f64; 3]) -> String {
    let c = rgb.map(|v| (255.0 * linear_to_srgb(v)).round());
    format!("rgb({},{},{})", c[0], c[1], c[2])
}

/// A JPEG as address of an image.
pub(super) fn jpeg_address(jpeg: &[u8]) -> String {
    format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_four_digits() {
        for (v, text) in [(0.0, "0"), (535.915_7, "535.9"), (-0.266_37, "-0.2664"), (1e-9, "1.000e-9"), (12_345.6, "12346"), (2.0, "2")] {
            assert_eq!(digits(v), text);
        }
    }
}
