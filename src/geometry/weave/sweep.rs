//! The surface of cloth: an upright ellipse swept along each thread's centre line.

use super::super::builder::TileBuilder;
use super::super::tile::Tile;
use super::cloth::{Thread, Weave};
use crate::error::Result;
use glam::DVec3;
use std::f64::consts::{PI, TAU};

impl Weave {
    pub(in crate::geometry) fn build(&self) -> Result<Tile> {
        let side_of = |over: bool| if over { 1.0 } else { -1.0 };
        let warp_lines: Vec<Vec<f64>> =
            (0..self.warp.len()).map(|i| (0..self.weft.len()).map(|j| side_of(self.draft.over(i, j))).collect()).collect();
        let weft_lines: Vec<Vec<f64>> =
            (0..self.weft.len()).map(|j| (0..self.warp.len()).map(|i| -side_of(self.draft.over(i, j))).collect()).collect();
        let pieces = |sides: &Vec<f64>| -> f64 {
            let bends = (0..sides.len()).filter(|&k| sides[k] != sides[(k + 1) % sides.len()]).count();
            (sides.len() - bends) as f64 + bends as f64 * f64::from(self.steps)
        };
        let total: f64 = warp_lines.iter().chain(&weft_lines).map(pieces).sum();
        TileBuilder::check_size(2.0 * f64::from(self.segments) * total, "use fewer segments or steps, or a smaller draft")?;
        let mut builder = TileBuilder::new(self.period, self.parts.iter().cloned());
        self.notes.iter().for_each(|note| builder.note(note.clone()));
        let warp_amplitude = self.crimp_share * self.crimp;
        for (thread, sides) in self.warp.iter().zip(&warp_lines) {
            let line = self.centre_line(&self.weft, sides, warp_amplitude, self.period.y);
            // Along y the section turns from +x to +z: y × z = x is outward.
            self.tube(&mut builder, thread, &line, DVec3::new, false);
        }
        for (thread, sides) in self.weft.iter().zip(&weft_lines) {
            let line = self.centre_line(&self.warp, sides, self.crimp - warp_amplitude, self.period.x);
            self.tube(&mut builder, thread, &line, |across, along, z| DVec3::new(along, across, z), true);
        }
        builder.finish()
    }

    /// Points (along, z) of a centre line over one period, from the first crossing to its repetition.
    fn centre_line(&self, crossed: &[Thread], sides: &[f64], amplitude: f64, period: f64) -> Vec<(f64, f64)> {
        let n = crossed.len();
        let mut line = vec![(crossed[0].centre, amplitude * sides[0])];
        for k in 0..n {
            let (start, from) = (crossed[k].centre, sides[k]);
            let (end, to) = if k + 1 < n { (crossed[k + 1].centre, sides[k + 1]) } else { (crossed[0].centre + period, sides[0]) };
            if from != to {
                for step in 1..self.steps {
                    let t = f64::from(step) / f64::from(self.steps);
                    line.push((start + t * (end - start), amplitude * from * libm::cos(PI * t)));
                }
            }
            line.push((end, amplitude * to));
        }
        line
    }

    /// Sweeps an upright ellipse along a centre line.
    fn tube(&self, builder: &mut TileBuilder, thread: &Thread, line: &[(f64, f64)], place: impl Fn(f64, f64, f64) -> DVec3, flip: bool) {
        let section: Vec<(f64, f64)> = (0..self.segments)
            .map(|k| {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(self.segments));
                (0.5 * thread.width * cos, 0.5 * thread.height * sin)
            })
            .collect();
        let mut last: Option<Vec<u32>> = None;
        for &(along, z) in line {
            let ring: Vec<u32> = section.iter().map(|(a, b)| builder.vertex(place(thread.centre + a, along, z + b))).collect();
            if let Some(last) = &last {
                for k in 0..ring.len() {
                    let next = (k + 1) % ring.len();
                    let [a, b, c, d] = [last[k], ring[k], ring[next], last[next]];
                    builder.quad(thread.part, if flip { [a, d, c, b] } else { [a, b, c, d] });
                }
            }
            last = Some(ring);
        }
    }
}
