//! A weave as strips of paper: one for each thread, with marks where it goes under another, to be woven by hand.

use biscale::geometry::weave::{Thread, Weave};
use glam::DVec2;

/// One strip, lying along x from its lower left corner, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Strip {
    /// `warp 3` or `weft 1`, from 1.
    pub name: String,
    /// Whether it is a warp.
    pub warp: bool,
    /// Place among its direction, from 0.
    pub index: usize,
    /// Where it lies in the cloth, across itself, mm.
    pub at: f64,
    /// Length with both ends, and width.
    pub size: DVec2,
    /// Its crossings.
    pub crossings: Vec<Crossing>,
    /// Linear RGB.
    pub colour: [f64; 3],
}

/// Where a strip crosses another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Its middle along the strip, mm.
    pub middle: f64,
    /// Width of the strip across, mm.
    pub across: f64,
    /// Whether this strip lies over.
    pub over: bool,
    /// Where the strip across lies in the cloth, mm.
    pub at: f64,
}

/// What a strip has beyond its last crossing at either end, mm: to hold it by and to glue it down. Chosen, not measured.
pub const END: f64 = 10.0;

/// Length of a path `a cos(pi x / d)` over half a period `d`, by Simpson's rule: the path that the design's threads take from one side
/// to the other.
pub fn bend_length(amplitude: f64, distance: f64) -> f64 {
    const STEPS: u32 = 256;
    let slope = amplitude * std::f64::consts::PI / distance;
    let f = |k: u32| (slope * (std::f64::consts::PI * f64::from(k) / f64::from(STEPS)).sin()).hypot(1.0);
    let sum: f64 = (0..=STEPS)
        .map(|k| {
            f(k) * if k == 0 || k == STEPS {
                1.0
            } else if k % 2 == 1 {
                4.0
            } else {
                2.0
            }
        })
        .sum();
    distance * sum / (3.0 * f64::from(STEPS))
}

/// The strips of so many periods of a weave. `scale` is printed mm for one unit of the weave's lengths; `colour` tells the colour of a
/// part.
pub fn strips(weave: &Weave, scale: f64, [nx, ny]: [u32; 2], colour: impl Fn(u16) -> [f64; 3]) -> Vec<Strip> {
    let warp_amplitude = weave.crimp_share * weave.crimp;
    let mut out = Vec::new();
    let mut direction = |warp: bool, own: &[Thread], crossed: &[Thread], repeats: u32, along: u32, period: f64, amplitude: f64| {
        for r in 0..repeats as usize {
            let shift = r as f64 * if warp { weave.period.x } else { weave.period.y };
            for (i, thread) in own.iter().enumerate() {
                let over = |k: usize| {
                    let k = k % crossed.len();
                    if warp { weave.draft.over(i, k) } else { !weave.draft.over(k, i) }
                };
                let place = |k: usize| crossed[k % crossed.len()].centre + period * (k / crossed.len()) as f64;
                let n = crossed.len() * along as usize;
                let mut at = END + 0.5 * crossed[0].width * scale;
                let mut crossings = Vec::new();
                for k in 0..n {
                    if k > 0 {
                        let d = (place(k) - place(k - 1)) * scale;
                        at += if over(k) == over(k - 1) { d } else { bend_length(amplitude * scale, d) };
                    }
                    crossings.push(Crossing {
                        middle: at,
                        across: crossed[k % crossed.len()].width * scale,
                        over: over(k),
                        at: place(k) * scale,
                    });
                }
                let length = at + 0.5 * crossed[(n - 1) % crossed.len()].width * scale + END;
                let index = r * own.len() + i;
                out.push(Strip {
                    name: format!("{} {}", if warp { "warp" } else { "weft" }, index + 1),
                    warp,
                    index,
                    at: (thread.centre + shift) * scale,
                    size: DVec2::new(length, thread.width * scale),
                    crossings,
                    colour: colour(thread.part),
                });
            }
        }
    };
    direction(true, &weave.warp, &weave.weft, nx, ny, weave.period.y, warp_amplitude);
    direction(false, &weave.weft, &weave.warp, ny, nx, weave.period.x, weave.crimp - warp_amplitude);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_is_as_long_as_its_elliptic_integral() {
        // Straight without amplitude; with a = d / pi the length is d E(-1) 2 / pi, E the complete elliptic integral of the second kind
        // with parameter m = -1: 1.910098894513856 (DLMF 19.2.8).
        assert_eq!(bend_length(0.0, 3.0), 3.0);
        let length = bend_length(2.0 / std::f64::consts::PI, 2.0);
        assert!((length - 2.0 * 1.910_098_894_513_856 * 2.0 / std::f64::consts::PI).abs() < 1e-9, "{length}");
    }
}
