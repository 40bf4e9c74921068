//! A weave as paper can make it: flat ribbons in place of threads.
//!
//! A strip is as long from crossing to crossing as the thread's centre line in the design, so that, woven at the threads' distances, it
//! takes the same path: at its amplitude where it lies over or under, a cosine between. What changes is the section: a rectangle as
//! wide as the thread and as thick as the paper, upright as the threads' sections are.

use super::bare_tile::bare_tile;
use biscale::error::{BadInput, Result};
use biscale::geometry::Tile;
use biscale::geometry::weave::{Thread, Weave};
use biscale::material::SmallScale;
use glam::{DVec2, DVec3};

/// Straight parts of a bend. Chosen, not measured: its length is right to 1e-3 (see the test).
const STEPS: u32 = 24;
/// Paper of no thickness is this thick, of the narrowest strip: both of its sides are there.
const LEAST_THICKNESS: f64 = 1e-3;

/// Points (along, z) of a strip's centre line over one period, from the first crossing to its repetition.
fn centre_line(crossed: &[Thread], over: impl Fn(usize) -> bool, amplitude: f64, period: f64) -> Vec<DVec2> {
    let n = crossed.len();
    let z = |k: usize| if over(k % n) { amplitude } else { -amplitude };
    let place = |k: usize| crossed[k % n].centre + period * (k / n) as f64;
    let mut line = vec![DVec2::new(place(0), z(0))];
    for k in 0..n {
        let (start, end) = (place(k), place(k + 1));
        if over(k) != over((k + 1) % n) {
            line.extend((1..STEPS).map(|s| {
                let t = f64::from(s) / f64::from(STEPS);
                DVec2::new(start + t * (end - start), z(k) * (std::f64::consts::PI * t).cos())
            }));
        }
        line.push(DVec2::new(end, z(k + 1)));
    }
    line
}

/// The surface of a weave of paper strips of a thickness, in the design's unit, covered like the design's threads.
///
/// # Errors
/// A part of the weave that has no surface.
pub fn ribbons(surface: &SmallScale, weave: &Weave, thickness: f64) -> Result<SmallScale> {
    let narrowest = weave.warp.iter().chain(&weave.weft).map(|t| t.width).fold(f64::INFINITY, f64::min);
    let thickness = thickness.max(LEAST_THICKNESS * narrowest);
    if thickness >= weave.crimp {
        let problem = format!("paper of {thickness:.3} is thicker than the crimp of {:.3} (in the design's unit)", weave.crimp);
        return Err(BadInput::new(problem, "take thinner paper or a larger `scale`").at_field("paper_thickness").into());
    }
    let tile = &surface.tile;
    let mut out = bare_tile(tile.parts.clone(), tile.period);
    let warp_amplitude = weave.crimp_share * weave.crimp;
    for (i, thread) in weave.warp.iter().enumerate() {
        let line = centre_line(&weave.weft, |k| weave.draft.over(i, k), warp_amplitude, weave.period.y);
        sweep(&mut out, thread, thickness, &line, DVec3::new, false);
    }
    for (j, thread) in weave.weft.iter().enumerate() {
        let line = centre_line(&weave.warp, |k| !weave.draft.over(k, j), weave.crimp - warp_amplitude, weave.period.x);
        sweep(&mut out, thread, thickness, &line, |across, along, z| DVec3::new(along, across, z), true);
    }
    let mut surface_of_triangle = Vec::with_capacity(out.triangles.len());
    for &part in &out.part_of_triangle {
        let like = tile.part_of_triangle.iter().position(|&p| p == part);
        let like = like.ok_or_else(|| {
            BadInput::new(format!("the part {} of the weave has no thread", tile.parts[usize::from(part)]), "leave `preview` out")
        })?;
        surface_of_triangle.push(surface.surface_of_triangle[like]);
    }
    Ok(SmallScale { tile: out, surfaces: surface.surfaces.clone(), surface_of_triangle, bounces: surface.bounces })
}

/// Sweeps an upright rectangle along a centre line.
fn sweep(out: &mut Tile, thread: &Thread, thickness: f64, line: &[DVec2], place: impl Fn(f64, f64, f64) -> DVec3, flip: bool) {
    let (w, h) = (0.5 * thread.width, 0.5 * thickness);
    // From above, turning from x to z.
    let section = [(w, -h), (w, h), (-w, h), (-w, -h)];
    let first = u32::try_from(out.vertices.len()).expect("a weave's crossings are limited");
    for p in line {
        out.vertices.extend(section.map(|(a, b)| place(thread.centre + a, p.x, p.y + b)));
    }
    for k in 0..u32::try_from(line.len()).expect("few") - 1 {
        for j in 0..4 {
            let next = (j + 1) % 4;
            let [a, b, c, d] = [first + 4 * k + j, first + 4 * k + 4 + j, first + 4 * k + 4 + next, first + 4 * k + next];
            let quad = if flip { [[a, d, c], [a, c, b]] } else { [[a, b, c], [a, c, d]] };
            out.triangles.extend(quad);
            out.part_of_triangle.extend([thread.part; 2]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ribbons_have_the_strips_length_and_face_outwards() {
        let thread = |centre: f64, part| Thread { centre, width: 0.8, height: 0.3, part };
        let line = centre_line(&[thread(0.5, 0), thread(1.5, 0)], |k| k == 0, 0.2, 2.0);
        let length: f64 = line.windows(2).map(|w| w[0].distance(w[1])).sum();
        assert!((length - 2.0 * crate::unfold::bend_length(0.2, 1.0)).abs() < 1e-3, "{length}");
        let mut tile = bare_tile(vec!["a".into()], DVec2::new(2.0, 2.0));
        for flip in [false, true] {
            tile.vertices.clear();
            tile.triangles.clear();
            let place = |a: f64, l: f64, z: f64| if flip { DVec3::new(l, a, z) } else { DVec3::new(a, l, z) };
            sweep(&mut tile, &thread(0.5, 0), 0.1, &line, place, flip);
            // Without its ends a prism; with them its volume by the divergence theorem, along the path's own direction: area times width.
            let up: f64 = (0..tile.triangles.len())
                .map(|t| {
                    let [a, b, c] = tile.corners(t);
                    0.5 * (b - a).truncate().perp_dot((c - a).truncate()) * (a.z + b.z + c.z) / 3.0
                })
                .sum();
            assert!((up - 0.8 * 0.1 * 2.0).abs() < 1e-9, "volume {up}");
        }
    }
}
