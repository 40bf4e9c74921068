//! The threads of a cloth as numbers with units: pitch, width, turn, colour, each with its error.

use super::analysis::{Axis, Weave};
use super::autocorrelation;
use super::class::Class;
use super::cloth::Cloth;
use super::draft_fit::draft_of;
use super::input::RectifiedPhoto;
use super::measured::Measured;
use super::scale::Scale;
use biscale::geometry::weave::Draft;
use biscale::numerics::clustering::{Weighted, k_means};
use biscale::numerics::colour::{delta_e_1976, lab};
use glam::{DMat2, DVec2};

/// How the colours of threads are told. Chosen, not measured.
struct ColourParams {
    /// Share of a thread's half width that counts as its top: beyond it the other thread shows, by blur and by shadow.
    top: f64,
    /// Share of the tops that must lie in their thread's cluster: half would be chance.
    agreement: f64,
    /// Value that counts as white, over the mean of the brightest channel: a picture's mean is about half of its highlights.
    white: f64,
    /// Least mean that is divided by.
    least: f64,
}

const PARAMS: ColourParams = ColourParams { top: 0.7, agreement: 0.8, white: 2.0, least: 1e-9 };

/// Turns what was found into numbers with units.
pub(super) fn describe(photo: &RectifiedPhoto<'_>, scale: &Scale, cloth: &Cloth, given: Option<&Draft>) -> Weave {
    let (grid, best) = (&cloth.grid, &cloth.fits[0]);
    let pixels = scale.field.factor as f64;
    let unit = photo.mm_per_pixel.unwrap_or(1.0) * pixels;
    let draft = given.cloned().unwrap_or_else(|| draft_of(grid.repeat, &best.labels));
    let confidence = match (given, cloth.fits.get(1)) {
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
/// The tops of the threads are clustered into two colours by k-means in Lab. If the clusters are the threads, each thread takes its cluster's
/// mean, free of what the other shows at its edges; if not, the threads have one colour, and each takes its own mean.
fn thread_colours(scale: &Scale, cloth: &Cloth) -> ([([f64; 3], f64); 2], f64) {
    let best = &cloth.fits[0];
    let field = &scale.field;
    let (mut mean, mut count) = ([0.0; 3], 0.0);
    for (rgb, _) in field.rgb.iter().zip(&field.valid).filter(|p| *p.1) {
        (0..3).for_each(|c| mean[c] += f64::from(rgb[c]));
        count += 1.0;
    }
    let mean = mean.map(|m| m / f64::max(count, 1.0));
    let white = mean.iter().fold(PARAMS.least, |a, &b| a.max(b)) * PARAMS.white;
    let mut tops: Vec<(usize, [f64; 3], f64)> = Vec::new();
    for (bin, top) in best.shape.tops(&cloth.fold, &best.labels).enumerate() {
        if top.what < 2 && top.off.abs() < PARAMS.top && cloth.fold.count[bin] > 0.0 {
            let colour = cloth.fold.colour[bin];
            tops.push((top.what, [0, 1, 2].map(|c| f64::from(colour[c]) * mean[c]), f64::from(cloth.fold.count[bin])));
        }
    }
    let lab_of = |linear: [f64; 3]| lab(linear.map(|v| (v / white).max(0.0)));
    let points: Vec<Weighted<3>> = tops.iter().map(|t| Weighted { point: lab_of(t.1), weight: t.2 }).collect();
    let clustered: Vec<usize> = k_means(&points, 2).0.into_iter().map(|label| label.unwrap_or(0)).collect();
    // Weights of each thread's tops in each cluster.
    let mut shared = [[0.0_f64; 2]; 2];
    tops.iter().zip(&clustered).for_each(|(t, &g)| shared[t.0][g] += t.2);
    let straight = shared[0][0] + shared[1][1];
    let crossed = shared[0][1] + shared[1][0];
    let total = straight + crossed;
    let apart = straight.max(crossed) > PARAMS.agreement * total;
    let own = |thread: usize| if straight >= crossed { thread } else { 1 - thread };
    let colours = [0, 1].map(|thread| {
        let (mut sum, mut weight) = ([0.0; 3], 0.0);
        for (t, &g) in tops.iter().zip(&clustered) {
            if t.0 == thread && (!apart || g == own(thread)) {
                (0..3).for_each(|c| sum[c] += t.1[c] * t.2);
                weight += t.2;
            }
        }
        (sum.map(|s| s / f64::max(weight, PARAMS.least)), weight)
    });
    let [warp, weft] = colours.map(|c| lab_of(c.0));
    (colours, delta_e_1976(warp, weft))
}
