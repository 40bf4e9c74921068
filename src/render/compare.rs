//! How far two pictures are apart.

/// Differences of two pictures of the same size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Peak signal-to-noise ratio, dB: `20 log10(peak / RMS difference)`; infinite for equal pictures, black ones too; NaN where they differ and the peak is 0.
    pub psnr: f64,
    /// `sqrt(sum (a - b)² / sum a²)` over all pixels and channels; absolute where `a` is black.
    pub relative_rms: f64,
    /// RMS difference.
    pub rms: f64,
    /// Largest difference of a channel.
    pub largest: f64,
    /// What the PSNR takes for the peak.
    pub peak: f64,
}

/// The differences of `b` from `a`, whose peak is `peak`, or its own largest value.
pub fn difference(a: &[[f32; 3]], b: &[[f32; 3]], peak: Option<f64>) -> Difference {
    difference_of(a.iter().copied().zip(b.iter().copied()), peak)
}

/// As [`difference`], of pixels one by one.
pub fn difference_of(pixels: impl Iterator<Item = ([f32; 3], [f32; 3])>, peak: Option<f64>) -> Difference {
    let (mut squares, mut energy, mut largest, mut own_peak) = (0.0, 0.0, 0.0_f64, 0.0_f64);
    let mut count: u64 = 0;
    for (a, b) in pixels {
        for (a, b) in a.into_iter().zip(b) {
            let (a, b) = (f64::from(a), f64::from(b));
            squares += (a - b) * (a - b);
            energy += a * a;
            largest = largest.max((a - b).abs());
            own_peak = own_peak.max(a);
        }
        count += 3;
    }
    let peak = peak.unwrap_or(own_peak);
    let rms = (squares / count.max(1) as f64).sqrt();
    let relative_rms = if energy > 0.0 { (squares / energy).sqrt() } else { rms };
    let psnr = match (rms > 0.0, peak > 0.0) {
        (false, _) => f64::INFINITY,
        (true, false) => f64::NAN,
        (true, true) => 20.0 * (peak / rms).log10(),
    };
    Difference { psnr, relative_rms, rms, largest, peak }
}

/// The colour, sRGB-encoded in 0..1, that stands for a share in 0..1: black over blue, magenta and orange to light yellow (a fit of the
/// map "inferno" of van der Walt and Smith 2015 by polynomials of degree 6, within .01).
pub fn colour_code(share: f64) -> [f64; 3] {
    const COEFFICIENTS: [[f64; 7]; 3] = [
        [0.000_218_940_369_1, 0.106_513_419_5, 11.602_493_08, -41.703_996_13, 77.162_935_7, -71.319_428_24, 25.131_126_22],
        [0.001_651_004_631, 0.563_956_436_8, -3.972_853_966, 17.436_398_88, -33.402_358_94, 32.626_064_26, -12.242_668_95],
        [-0.019_480_898_44, 3.932_712_388, -15.942_394_11, 44.354_145_2, -81.807_309_26, 73.209_519_86, -23.070_325],
    ];
    let t = share.clamp(0.0, 1.0);
    COEFFICIENTS.map(|c| c.iter().rev().fold(0.0, |sum, c| sum * t + c).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_differ_by_nothing() {
        let a = [[0.5, 0.25, 1.0]; 4];
        let d = difference(&a, &a, None);
        assert_eq!((d.psnr, d.relative_rms, d.largest, d.peak), (f64::INFINITY, 0.0, 0.0, 1.0));
    }

    #[test]
    fn black_pictures_are_equal_and_nothing_is_measured_by_a_peak_of_0() {
        let (black, grey) = ([[0.0; 3]; 4], [[0.5; 3]; 4]);
        let d = difference(&black, &black, None);
        assert_eq!((d.psnr, d.relative_rms, d.rms, d.peak), (f64::INFINITY, 0.0, 0.0, 0.0));
        let d = difference(&black, &grey, None);
        assert!(d.psnr.is_nan() && d.relative_rms == 0.5 && d.largest == 0.5, "{d:?}");
        assert!((difference(&black, &grey, Some(1.0)).psnr - 6.0206).abs() < 1e-4);
    }

    #[test]
    fn a_difference_of_a_tenth_of_the_peak_is_20_db() {
        let (a, b) = ([[2.0; 3]; 5], [[1.8_f32; 3]; 5]);
        let d = difference(&a, &b, None);
        assert!((d.psnr - 20.0).abs() < 1e-5 && (d.relative_rms - 0.1).abs() < 1e-6 && (d.rms - 0.2).abs() < 1e-6, "{d:?}");
        assert!((difference(&a, &b, Some(20.0)).psnr - 40.0).abs() < 1e-5);
    }

    #[test]
    fn the_colour_code_gets_brighter_from_black_to_yellow() {
        let light = |t: f64| crate::numerics::colour::luminance(colour_code(t));
        assert!(light(0.0) < 0.01 && light(1.0) > 0.9, "{} to {}", light(0.0), light(1.0));
        assert!((1..=100).all(|k| light(f64::from(k) / 100.0) > light(f64::from(k - 1) / 100.0)));
    }
}
