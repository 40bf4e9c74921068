//! Where the pages of one sheet overlap.

use super::clip::clip_segment;
use super::measures::JOIN;
use super::plan::PagePart;
use crate::drawing::{BLACK, Layer, Mark, Page, Style};
use glam::DVec2;

/// Length of an arm of a cross, mm: less than half of [`JOIN`], so that crosses lie within the overlap.
const CROSS: f64 = 4.0;

/// Where the neighbours' edges come to lie, with crosses that both sheets have.
///
/// `columns` is the number of pages side by side: the page above has a number that is larger by it.
pub(super) fn joins(page: &mut Page, part: &PagePart, columns: usize) {
    let PagePart { number, area: [low, high], shift, outer } = *part;
    for axis in 0..2 {
        let along = if axis == 0 { DVec2::Y } else { DVec2::X };
        let across = DVec2::new(along.y, along.x);
        let (from, to) = (low.dot(along), high.dot(along));
        let mut edge = |at: f64, line: bool| {
            let point = |s: f64| at * across + s * along + shift;
            if line {
                page.line(Layer::Registration, Style::Thin, &[point(from), point(to)], false);
                let (next, turn) = if axis == 0 { (number + 1, std::f64::consts::FRAC_PI_2) } else { (number + columns, 0.0) };
                let text = format!("the edge of sheet {next} comes here");
                let at = point(0.5 * (from + to)) + 0.5 * JOIN * across;
                page.add(Layer::Print, Mark::Text { at, size: 3.0, angle: turn, text, colour: BLACK, anchor: 0.5, underlined: false });
            }
            for k in 0..4 {
                // At places of the joined sheet, so that the halves on both sheets meet.
                let s = from + (to - from) * (0.5 + f64::from(k)) / 4.0;
                for arm in [along, across] {
                    let arm = [point(s) - CROSS * arm, point(s) + CROSS * arm];
                    let inside = clip_segment(arm.map(|p| p - shift), [low, high]);
                    if let Some(ends) = inside {
                        page.line(Layer::Registration, Style::Bold, &ends.map(|p| p + shift), false);
                    }
                }
            }
        };
        if !outer[axis + 2] {
            edge(high.dot(across) - JOIN, true);
        }
        if !outer[axis] {
            edge(low.dot(across), false);
        }
    }
}
