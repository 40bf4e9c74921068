//! At which scale, and in windows of which size, a photograph shows its repetition best.

use super::field::Field;
use super::input::RectifiedPhoto;
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

/// Longest side of a cut in reduced pixels: what bounds time and memory.
const SIDE: usize = 1024;
/// A photograph is not reduced below this side.
const MIN_SIDE: usize = 48;
/// Most peaks that are looked at.
const PEAKS: usize = 160;
/// A finer scale is taken if its lattice explains peaks at least this well compared with the best.
const GOOD_SHARE: f64 = 0.5;
/// Threads wider than this many pixels are looked at in a coarser scale, where more of them are seen.
const LARGE: f64 = 40.0;
/// Windows are not made smaller than this.
const MIN_WINDOW: usize = 96;

/// The scale where a lattice explains the photograph's peaks, or nothing if there is none: then the best score, and the least that counts.
pub(super) fn find(photo: &RectifiedPhoto<'_>) -> Result<Scale, (f64, f64)> {
    let mut scales: Vec<Scale> = Vec::new();
    let mut factor = 1;
    while let Some(field) = Field::cut(photo, factor, SIDE, MIN_SIDE) {
        scales.extend(best_window(field));
        // A sensor's mosaic repeats after two pixels and adds peaks that are of no surface: where nothing is found, means of 2 x 2 may show it.
        let found = scales.iter().any(|s| s.lattice.score >= MIN_SCORE);
        if photo.width.max(photo.height) / factor <= SIDE && (found || factor > 1) {
            break;
        }
        factor *= 2;
    }
    let best = scales.iter().map(|s| s.lattice.score).fold(0.0, f64::max);
    if best < MIN_SCORE {
        return Err((best, MIN_SCORE));
    }
    let good = |s: &Scale| s.lattice.score >= GOOD_SHARE * best && s.lattice.score >= MIN_SCORE;
    let mut chosen = scales.iter().position(good).unwrap_or(0);
    // The shortest vector bounds the longest repeat; threads are about as far apart as the finest strong peaks say.
    while chosen + 1 < scales.len() && good(&scales[chosen + 1]) && scales[chosen].spacing() > LARGE {
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

/// Logarithm of how much better than chance a lattice must explain the peaks.
pub(super) const MIN_SCORE: f64 = 12.0;

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
    (power(&on_line) >= LINE_SHARE * power(peaks)).then(|| Lattice::of(&on_line, bin)).flatten().filter(|l| l.basis.len() == 1)
}

/// Share of the peaks' power along one line that makes grooves; the threads across give even a satin far more than the rest.
const LINE_SHARE: f64 = 0.998;

/// The windows in which a lattice explains the peaks best.
fn best_window(field: Field) -> Option<Scale> {
    let whole = field.width.min(field.height);
    let mut best: Option<(Spectrum, Vec<Peak>, Lattice)> = None;
    let mut side = whole.max(MIN_SIDE);
    loop {
        let spectrum = Spectrum::of(&field, if side == whole { usize::MAX } else { side });
        let peaks = spectrum.peaks(PEAKS);
        if let Some(lattice) = Lattice::of(&peaks, spectrum.bin())
            && best.as_ref().is_none_or(|b| lattice.score > 1.15 * b.2.score)
        {
            best = Some((spectrum, peaks, lattice));
        }
        side /= 2;
        if side < MIN_WINDOW {
            break;
        }
    }
    best.map(|(spectrum, peaks, lattice)| Scale { field, spectrum, peaks, lattice })
}
