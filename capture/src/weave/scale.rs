//! At which scale, and in windows of which size, a photograph shows its repetition best.

use super::field::Field;
use super::input::{MIN_SIDE, RectifiedPhoto};
use super::lattice::Lattice;
use super::spectrum::{Peak, Spectrum};
use glam::DVec2;

/// A photograph at the scale where it repeats best.
pub(super) struct Scale {
    /// The cut that was looked at.
    pub field: Field,
    /// Its spectrum, in the windows that served best.
    pub spectrum: Spectrum,
    /// The peaks that the lattice was fitted to.
    pub peaks: Vec<Peak>,
    /// What they lie on.
    pub lattice: Lattice,
}

/// How the scale is chosen. Chosen on drawn cloths (see [`super`]) where no reason is given.
struct ScaleParams {
    /// Longest side of a cut in reduced pixels: what bounds time and memory.
    side: usize,
    /// Smallest side of a reduced photograph: the photograph's own bound.
    least_side: usize,
    /// Most peaks that are looked at.
    peaks: usize,
    /// Logarithm of how much better than chance a lattice must explain the peaks.
    least_score: f64,
    /// Score over the best one from which on a finer scale is taken.
    good_share: f64,
    /// Distance of threads, in pixels, above which a coarser scale is looked at, where more of them are seen.
    large: f64,
    /// Smallest window, in pixels.
    least_window: usize,
    /// A smaller window must have a score this many times as large.
    window_gain: f64,
    /// Share of the peaks' power along one line that makes grooves; the threads across give even a satin far more than the rest.
    line_share: f64,
}

const PARAMS: ScaleParams = ScaleParams {
    side: 1024,
    least_side: MIN_SIDE,
    peaks: 160,
    least_score: 12.0,
    good_share: 0.5,
    large: 40.0,
    least_window: 96,
    window_gain: 1.15,
    line_share: 0.998,
};

/// The scale where a lattice explains the photograph's peaks, or nothing if there is none: then the best score, and the least that counts.
pub(super) fn find(photo: &RectifiedPhoto<'_>) -> Result<Scale, (f64, f64)> {
    let mut scales: Vec<Scale> = Vec::new();
    let mut factor = 1;
    while let Some(field) = Field::cut(photo, factor, PARAMS.side, PARAMS.least_side) {
        scales.extend(best_window(field));
        // A sensor's mosaic repeats after two pixels and adds peaks that are of no surface: where nothing is found, means of 2 x 2 may show it.
        let found = scales.iter().any(|s| s.lattice.score >= PARAMS.least_score);
        if photo.width.max(photo.height) / factor <= PARAMS.side && (found || factor > 1) {
            break;
        }
        factor *= 2;
    }
    let best = scales.iter().map(|s| s.lattice.score).fold(0.0, f64::max);
    if best < PARAMS.least_score {
        return Err((best, PARAMS.least_score));
    }
    let good = |s: &Scale| s.lattice.score >= PARAMS.good_share * best && s.lattice.score >= PARAMS.least_score;
    let mut chosen = scales.iter().position(good).unwrap_or(0);
    // The shortest vector bounds the longest repeat; threads are about as far apart as the finest strong peaks say.
    while chosen + 1 < scales.len() && good(&scales[chosen + 1]) && scales[chosen].spacing() > PARAMS.large {
        chosen += 1;
    }
    let mut scale = scales.swap_remove(chosen);
    if let Some(grooves) = along_one_line(&scale.peaks, scale.spectrum.bin()) {
        scale.lattice = grooves;
        return Ok(scale);
    }
    scale.lattice = scale.lattice.completed(&scale.peaks, scale.spectrum.bin());
    Ok(scale)
}

impl Scale {
    /// About the distance of the threads: the cell of the strongest peaks' mean frequency.
    fn spacing(&self) -> f64 {
        let (sum, weight) =
            self.peaks.iter().fold((0.0, 0.0), |(s, w), p| (s + p.frequency.length() * p.contrast.ln(), w + p.contrast.ln()));
        weight / sum.max(1e-9)
    }
}

/// The lattice of a surface that repeats along one direction, if nearly all power lies along one line.
///
/// Sharp edges have frequencies that the pixels cannot show, which come back as weak peaks elsewhere: they make no second direction.
fn along_one_line(peaks: &[Peak], bin: DVec2) -> Option<Lattice> {
    let strongest = peaks.iter().max_by(|a, b| a.power.total_cmp(&b.power))?;
    let along = (strongest.frequency / bin).normalize();
    let on_line: Vec<Peak> = peaks.iter().copied().filter(|p| (p.frequency / bin).perp_dot(along).abs() < 1.0).collect();
    let power = |list: &[Peak]| list.iter().map(|p| p.power).sum::<f64>();
    (power(&on_line) >= PARAMS.line_share * power(peaks)).then(|| Lattice::of(&on_line, bin)).flatten().filter(|l| l.basis.len() == 1)
}

/// The windows in which a lattice explains the peaks best.
fn best_window(field: Field) -> Option<Scale> {
    let whole = field.width.min(field.height);
    let mut best: Option<(Spectrum, Vec<Peak>, Lattice)> = None;
    let mut side = whole.max(PARAMS.least_side);
    loop {
        let spectrum = Spectrum::of(&field, if side == whole { usize::MAX } else { side });
        let peaks = spectrum.peaks(PARAMS.peaks);
        if let Some(lattice) = Lattice::of(&peaks, spectrum.bin())
            && best.as_ref().is_none_or(|b| lattice.score > PARAMS.window_gain * b.2.score)
        {
            best = Some((spectrum, peaks, lattice));
        }
        side /= 2;
        if side < PARAMS.least_window {
            break;
        }
    }
    best.map(|(spectrum, peaks, lattice)| Scale { field, spectrum, peaks, lattice })
}
