//! Colour: the sRGB curve, luminance, CIE L\*a\*b\*. Linear colours have the Rec. 709 primaries and white D65.

use super::cast::truncate_u8;

/// CIE XYZ of linear Rec. 709, by rows (IEC 61966-2-1, to the digits of Lindbloom's matrix).
pub const RGB_TO_XYZ: [[f64; 3]; 3] =
    [[0.412_456_4, 0.357_576_1, 0.180_437_5], [0.212_672_9, 0.715_152_2, 0.072_175_0], [0.019_333_9, 0.119_192_0, 0.950_304_1]];
/// XYZ of D65 at luminance 1 (ASTM E308, as Lindbloom's matrix takes it).
pub const WHITE_D65: [f64; 3] = [0.950_47, 1.0, 1.088_83];
/// XYZ of D50 at luminance 1 (ASTM E308).
pub const WHITE_D50: [f64; 3] = [0.964_22, 1.0, 0.825_21];

/// Where the curve of L\*a\*b\* becomes a line: `(6 / 29)³` (CIE 15).
const LAB_EPSILON: f64 = 216.0 / 24389.0;
/// Slope of that line: `(29 / 3)³` (CIE 15).
const LAB_KAPPA: f64 = 24389.0 / 27.0;

/// Linear value of an sRGB-encoded one, both in `0..=1` (IEC 61966-2-1).
pub fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.040_45 { encoded / 12.92 } else { libm::pow((encoded + 0.055) / 1.055, 2.4) }
}

/// What a screen is sent for a linear value, both in `0..=1`; values outside are clamped (IEC 61966-2-1).
pub fn linear_to_srgb(linear: f64) -> f64 {
    let v = linear.clamp(0.0, 1.0);
    if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::pow(v, 1.0 / 2.4) - 0.055 }
}

/// The nearest of 256 levels to a share in `0..=1`; values outside are clamped.
pub fn byte(share: f64) -> u8 {
    truncate_u8((share.clamp(0.0, 1.0) * 255.0).round())
}

/// The sRGB byte of a linear value: [`byte`] of [`linear_to_srgb`].
pub fn srgb_byte(linear: f64) -> u8 {
    byte(linear_to_srgb(linear))
}

/// Luminance `Y` of linear RGB with Rec. 709 primaries (ITU-R BT.709, the four digits of the recommendation).
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// CIE L\*a\*b\* (white D65) of linear Rec. 709 whose white is 1 (CIE 15). Components below 0 are continued along the linear part.
pub fn lab(rgb: [f64; 3]) -> [f64; 3] {
    let t: [f64; 3] =
        std::array::from_fn(|k| (RGB_TO_XYZ[k][0] * rgb[0] + RGB_TO_XYZ[k][1] * rgb[1] + RGB_TO_XYZ[k][2] * rgb[2]) / WHITE_D65[k]);
    let [x, y, z] = t.map(|t| if t > LAB_EPSILON { t.cbrt() } else { (LAB_KAPPA * t + 16.0) / 116.0 });
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// CIE XYZ of L\*a\*b\* under a white.
pub fn xyz_of_lab(lab: [f64; 3], white: [f64; 3]) -> [f64; 3] {
    let y = (lab[0] + 16.0) / 116.0;
    let f = [y + lab[1] / 500.0, y, y - lab[2] / 200.0];
    std::array::from_fn(|k| {
        white[k] * if f[k] * f[k] * f[k] > LAB_EPSILON { f[k] * f[k] * f[k] } else { (116.0 * f[k] - 16.0) / LAB_KAPPA }
    })
}

/// Distance of two colours in L\*a\*b\*: ΔE of 1976.
pub fn delta_e_1976(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn srgb_is_the_standard_curve_and_its_inverse() {
        assert_eq!([srgb_to_linear(0.0), srgb_to_linear(1.0)], [0.0, 1.0]);
        // IEC 61966-2-1: the line below .04045, and ((.5 + .055) / 1.055)^2.4.
        for (encoded, linear) in [(0.04, 0.04 / 12.92), (0.5, 0.214_041_140_5)] {
            assert!((srgb_to_linear(encoded) - linear).abs() < 1e-10, "{encoded}");
        }
        for k in 0..=255_u8 {
            assert_eq!(srgb_byte(srgb_to_linear(f64::from(k) / 255.0)), k);
        }
        assert_eq!([srgb_byte(-1.0), srgb_byte(2.0), srgb_byte(f64::NAN)], [0, 255, 0]);
    }

    #[test]
    fn lab_of_known_colours() {
        // The sRGB primaries and white in CIE L*a*b*, D65 (Lindbloom's calculator, two digits).
        for (linear, expected) in [
            ([1.0, 1.0, 1.0], [100.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]),
            ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ] {
            let found = lab(linear);
            assert!(delta_e_1976(found, expected) < 0.05, "{linear:?}: {found:?}, expected {expected:?}");
        }
    }

    #[test]
    fn xyz_is_found_again_from_lab() {
        for rgb in [[0.0; 3], [1e-4, 2e-4, 1e-4], [0.5, 0.1, 0.9], [1.0; 3]] {
            let xyz = xyz_of_lab(lab(rgb), WHITE_D65);
            for k in 0..3 {
                let expected: f64 = (0..3).map(|c| RGB_TO_XYZ[k][c] * rgb[c]).sum();
                assert!((xyz[k] - expected).abs() < 1e-14, "{rgb:?}: {xyz:?}");
            }
        }
    }

    #[test]
    fn luminance_of_white_is_one() {
        assert!((luminance([1.0; 3]) - 1.0).abs() < 1e-15);
    }
}
