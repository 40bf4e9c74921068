//! The lines where periods begin.

use super::clip::clip_segment;
use super::plan::{PagePart, SheetPlan};
use super::target::{Target, WrapFit};
use crate::drawing::{BLACK, Item, Layer, Mark, Page, Style};
use glam::DVec2;

/// A line of the sheet in the target's frame: where a period begins, or a fold.
pub(super) enum SheetLine {
    Period { ends: [DVec2; 2], number: u32 },
    Fold([DVec2; 2]),
}

/// The numbered lines where the periods begin, and a box's folds.
pub(super) fn lines(target: Target, fit: WrapFit, extent: DVec2) -> Vec<SheetLine> {
    // The line at the seam is the first one again.
    let number = |k: u32| if target.closes() { k % fit.around.max(1) + 1 } else { k + 1 };
    let share = |k: u32| f64::from(k) / f64::from(fit.around);
    let ends = |k: u32| match target {
        Target::Cone { .. } => {
            let direction = DVec2::from_angle(extent.x / extent.y * share(k));
            [0.15 * extent.y * direction, extent.y * direction]
        }
        _ => [0.0, extent.y].map(|y| DVec2::new(extent.x * share(k), y)),
    };
    let mut out: Vec<SheetLine> = (0..=fit.around).map(|k| SheetLine::Period { ends: ends(k), number: number(k) }).collect();
    if let Target::Box { width, depth, .. } = target {
        let folds = [width, width + depth, 2.0 * width + depth, 2.0 * (width + depth)];
        out.extend(folds.map(|x| SheetLine::Fold([0.0, extent.y].map(|y| DVec2::new(x, y)))));
    }
    out
}

/// Draws the part of the lines that a page holds; numbers are smaller where the lines are `pitch` mm apart and closer.
pub(super) fn draw_lines(page: &mut Page, plan: &SheetPlan, lines: &[SheetLine], part: &PagePart, pitch: f64) {
    for line in lines {
        let (SheetLine::Period { ends, .. } | SheetLine::Fold(ends)) = line;
        let Some([a, b]) = clip_segment(ends.map(|p| plan.at(p)), part.area).map(|ends| ends.map(|p| p + part.shift)) else { continue };
        let SheetLine::Period { number, .. } = line else {
            page.line(Layer::Score, Style::Mountain, &[a, b], false);
            continue;
        };
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Line { points: vec![a, b], closed: false, style: Style::Thin },
            data: vec![("period", number.to_string())],
        });
        let size = (0.45 * pitch).clamp(0.8, 2.5);
        // Beside the line, at both of its ends.
        let aside = (b - a).normalize_or(DVec2::Y).perp();
        let aside = if aside.x + 1e-9 * aside.y < 0.0 { -aside } else { aside };
        for t in [0.04, 0.96] {
            let at = a.lerp(b, t) + 0.6 * size * aside;
            page.add(
                Layer::Print,
                Mark::Text { at, size, angle: 0.0, text: number.to_string(), colour: BLACK, anchor: 0.5, underlined: false },
            );
        }
    }
}
