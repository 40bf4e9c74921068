//! From the camera's colours to linear Rec. 709: a 3 x 3 matrix from a checker of 24 patches.

use biscale::numerics::colour::{RGB_TO_XYZ, WHITE_D50, lab, xyz_of_lab};
use biscale::numerics::least_squares::{LeastSquaresParams, minimise};
use biscale::numerics::linear_algebra;
use biscale::numerics::outcome::Outcome;
use glam::{DMat3, DVec3};

/// CIE L*a*b* (D50, 2 degrees) of the 24 patches of the `ColorChecker` Classic as measured by its maker in 2005, row by row from dark skin to black.
pub const CHECKER_LAB_D50: [[f64; 3]; 24] = [
    [37.986, 13.555, 14.059],
    [65.711, 18.130, 17.810],
    [49.927, -4.880, -21.925],
    [43.139, -13.095, 21.905],
    [55.112, 8.844, -25.399],
    [70.719, -33.397, -0.199],
    [62.661, 36.067, 57.096],
    [40.020, 10.410, -45.964],
    [51.124, 48.239, 16.248],
    [30.325, 22.976, -21.587],
    [72.532, -23.709, 57.255],
    [71.941, 19.363, 67.857],
    [28.778, 14.179, -50.297],
    [55.261, -38.342, 31.370],
    [42.101, 53.378, 28.190],
    [81.733, 4.039, 79.819],
    [51.935, 49.986, -14.574],
    [51.038, -28.631, -28.638],
    [96.539, -0.425, 1.186],
    [81.257, -0.638, -0.335],
    [66.766, -0.734, -0.504],
    [50.867, -0.153, -0.270],
    [35.656, -0.421, -1.231],
    [20.461, -0.079, -0.973],
];

/// Columns of patches.
pub const COLUMNS: usize = 6;
/// The six greys, from white to black.
pub const GREYS: std::ops::Range<usize> = 18..24;

/// Bradford's adaptation from D50 to D65 (Lindbloom), by rows.
const D50_TO_D65: [[f64; 3]; 3] =
    [[0.955_576_6, -0.023_039_3, 0.063_163_6], [-0.028_289_5, 1.009_941_6, 0.021_007_7], [0.012_298_2, -0.020_483_0, 1.329_909_8]];
/// A matrix from its rows.
pub fn by_rows(rows: [[f64; 3]; 3]) -> DMat3 {
    DMat3::from_cols_array_2d(&rows).transpose()
}

/// Reflectance of the patches in linear Rec. 709 under D65.
pub fn checker_rgb() -> [[f64; 3]; 24] {
    let to_rgb = by_rows(RGB_TO_XYZ).inverse() * by_rows(D50_TO_D65);
    CHECKER_LAB_D50.map(|lab| (to_rgb * DVec3::from(xyz_of_lab(lab, WHITE_D50))).into())
}

/// CIE Delta E 2000 of two colours in L*a*b* (Sharma, Wu and Dalal 2005).
pub fn delta_e_2000(a: [f64; 3], b: [f64; 3]) -> f64 {
    let mean_chroma = 0.5 * (a[1].hypot(a[2]) + b[1].hypot(b[2]));
    let c7 = mean_chroma.powi(7);
    let g = 0.5 * (1.0 - (c7 / (c7 + 25.0_f64.powi(7))).sqrt());
    let turn = |v: [f64; 3]| {
        let a = (1.0 + g) * v[1];
        let hue = if a == 0.0 && v[2] == 0.0 { 0.0 } else { v[2].atan2(a).to_degrees().rem_euclid(360.0) };
        (a.hypot(v[2]), hue)
    };
    let ((c1, h1), (c2, h2)) = (turn(a), turn(b));
    let grey = c1 * c2 == 0.0;
    let dh = match h2 - h1 {
        _ if grey => 0.0,
        d if d > 180.0 => d - 360.0,
        d if d < -180.0 => d + 360.0,
        d => d,
    };
    let big_dh = 2.0 * (c1 * c2).sqrt() * (0.5 * dh).to_radians().sin();
    let (l, c) = (0.5 * (a[0] + b[0]), 0.5 * (c1 + c2));
    let h = match h1 + h2 {
        sum if grey => sum,
        sum if (h1 - h2).abs() <= 180.0 => 0.5 * sum,
        sum if sum < 360.0 => 0.5 * (sum + 360.0),
        sum => 0.5 * (sum - 360.0),
    };
    let cos = |x: f64| x.to_radians().cos();
    let t = 1.0 - 0.17 * cos(h - 30.0) + 0.24 * cos(2.0 * h) + 0.32 * cos(3.0 * h + 6.0) - 0.20 * cos(4.0 * h - 63.0);
    let l50 = (l - 50.0).powi(2);
    let (sl, sc, sh) = (1.0 + 0.015 * l50 / (20.0 + l50).sqrt(), 1.0 + 0.045 * c, 1.0 + 0.015 * c * t);
    let rc = 2.0 * (c.powi(7) / (c.powi(7) + 25.0_f64.powi(7))).sqrt();
    let rt = -rc * (2.0 * 30.0 * (-((h - 275.0) / 25.0).powi(2)).exp()).to_radians().sin();
    let (x, y, z) = ((b[0] - a[0]) / sl, (c2 - c1) / sc, big_dh / sh);
    (x * x + y * y + z * z + rt * y * z).max(0.0).sqrt()
}

/// A colour correction and how well it does.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    /// Camera to linear Rec. 709; white becomes 1.
    pub matrix: DMat3,
    /// Delta E 2000 of each patch.
    pub delta_e: Vec<f64>,
    /// How the search for the matrix ended.
    pub outcome: Outcome,
}

impl Correction {
    /// Their mean.
    pub fn mean_delta_e(&self) -> f64 {
        self.delta_e.iter().sum::<f64>() / self.delta_e.len().max(1) as f64
    }

    /// The largest.
    pub fn worst_delta_e(&self) -> f64 {
        self.delta_e.iter().copied().fold(0.0, f64::max)
    }
}

/// The matrix that takes `measured` patches to `reference`: least squares first, then the smallest differences in L*a*b*.
///
/// `None` if the patches do not determine one, or hold what is no number.
pub fn fit(measured: &[[f64; 3]], reference: &[[f64; 3]]) -> Option<Correction> {
    fit_with(measured, reference, LeastSquaresParams::default())
}

fn fit_with(measured: &[[f64; 3]], reference: &[[f64; 3]], search: LeastSquaresParams) -> Option<Correction> {
    let rows: Vec<Vec<f64>> = measured.iter().map(|m| m.to_vec()).collect();
    let mut start = Vec::new();
    for c in 0..3 {
        let values: Vec<f64> = reference.iter().map(|r| r[c]).collect();
        start.extend(linear_algebra::least_squares(&rows, &values)?);
    }
    let targets: Vec<DVec3> = reference.iter().map(|r| DVec3::from(lab(*r))).collect();
    let matrix_of = |p: &[f64]| DMat3::from_cols_array(&std::array::from_fn(|k| p[k])).transpose();
    let residuals = |p: &[f64]| {
        let matrix = matrix_of(p);
        measured.iter().zip(&targets).flat_map(|(m, w)| (DVec3::from(lab((matrix * DVec3::from(*m)).into())) - w).to_array()).collect()
    };
    let scale: Vec<f64> = start.iter().map(|v| v.abs().max(1e-3 * start.iter().fold(0.0, |a: f64, b| a.max(b.abs())))).collect();
    let fit = minimise(&start, &scale, &residuals, search).finite()?;
    let matrix = matrix_of(&fit.parameters);
    let delta_e = measured.iter().zip(&targets).map(|(m, w)| delta_e_2000(lab((matrix * DVec3::from(*m)).into()), (*w).into())).collect();
    matrix.is_finite().then_some(Correction { matrix, delta_e, outcome: fit.outcome })
}

/// Exponent `g` of `value = light^g` by the greys of a checker: the slope of their logarithms. `None` if a value is not positive.
pub fn grey_exponent(measured: &[[f64; 3]]) -> Option<f64> {
    let reference = checker_rgb();
    let points: Option<Vec<(f64, f64)>> = GREYS
        .map(|k| {
            let (m, r) = (measured.get(k)?[1], reference[k][1]);
            (m > 0.0).then(|| (r.ln(), m.ln()))
        })
        .collect();
    let points = points?;
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let (xy, xx) = points.iter().fold((0.0, 0.0), |(a, b), p| (a + (p.0 - mx) * (p.1 - my), b + (p.0 - mx).powi(2)));
    Some(xy / xx)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn delta_e_is_that_of_the_published_test_data() {
        // Sharma, Wu and Dalal 2005, table 1: pairs 1, 4, 7, 9, 13, 17, 20, 25, 34.
        for (a, b, expected) in [
            ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
            ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0000),
            ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
            ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0009], 7.1792),
            ([50.0, -0.0010, 2.4900], [50.0, 0.0009, -2.4900], 4.8045),
            ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
            ([50.0, 2.5, 0.0], [58.0, 24.0, 15.0], 19.4535),
            ([60.2574, -34.0099, 36.2677], [60.4626, -34.1751, 39.4387], 1.2644),
            ([2.0776, 0.0795, -1.1350], [0.9033, -0.0636, -0.5514], 0.9082),
        ] {
            let found = delta_e_2000(a, b);
            assert!((found - expected).abs() < 1e-4, "{a:?} {b:?}: {found} for {expected}");
            assert!((delta_e_2000(b, a) - expected).abs() < 1e-4);
        }
    }

    #[test]
    fn the_checker_s_colours_on_a_screen_are_those_of_others() {
        // What BabelColor computes of the same measurements (Bradford, 8 bits): cyan is outside of sRGB.
        let byte = |v: f64| 255.0 * biscale::numerics::colour::linear_to_srgb(v);
        let rgb = checker_rgb().map(|c| c.map(byte));
        let table = [
            (0, [116.0, 81.0, 67.0]),
            (1, [199.0, 147.0, 129.0]),
            (7, [68.0, 91.0, 170.0]),
            (12, [35.0, 63.0, 147.0]),
            (14, [180.0, 49.0, 57.0]),
            (17, [0.0, 136.0, 170.0]),
            (18, [245.0, 245.0, 243.0]),
            (21, [122.0, 122.0, 121.0]),
        ];
        for (k, expected) in table {
            assert!((0..3).all(|c| (rgb[k][c] - expected[c]).abs() < 2.5), "patch {k}: {:?} for {expected:?}", rgb[k]);
        }
        assert!(delta_e_2000(lab([1.0; 3]), [100.0, 0.0, 0.0]) < 0.02);
    }

    #[test]
    fn a_linear_camera_is_undone_and_a_curved_one_is_told() {
        let reference = checker_rgb();
        let camera = by_rows([[0.5, 0.2, 0.05], [0.15, 0.6, 0.1], [0.02, 0.2, 0.5]]);
        let measured = reference.map(|r| (camera * DVec3::from(r)).to_array());
        let correction = fit(&measured, &reference).unwrap();
        assert!(correction.worst_delta_e() < 1e-3, "{:?}", correction.delta_e);
        assert!((correction.matrix * camera).abs_diff_eq(DMat3::IDENTITY, 1e-5));
        assert!((grey_exponent(&measured).unwrap() - 1.0).abs() < 0.02);
        let curved = measured.map(|m| m.map(|v| v.powf(1.0 / 2.2)));
        assert!((grey_exponent(&curved).unwrap() - 1.0 / 2.2).abs() < 0.02);
        assert!(fit(&curved, &reference).unwrap().worst_delta_e() > 6.0);
        assert!(fit(&[[0.1; 3]; 24], &reference).is_none(), "grey patches only");
        assert!(grey_exponent(&[[0.0; 3]; 24]).is_none());
        // Linear least squares do not end where the differences in L*a*b* are smallest: one step is not enough.
        let with = |steps| fit_with(&curved, &reference, LeastSquaresParams { steps, ..LeastSquaresParams::default() }).unwrap().outcome;
        assert_eq!((with(1), with(60)), (Outcome::Exhausted, Outcome::Converged));
    }
}
