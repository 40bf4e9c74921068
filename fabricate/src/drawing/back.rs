//! The back of a page.

use super::page::{BLACK, Item, Layer, Mark, Page, Style};
use glam::DVec2;

/// The page as seen through the paper: folds change sides, texts are turned so that they are read, colours are left out.
pub(super) fn mirrored(page: &Page) -> Page {
    let m = |p: DVec2| DVec2::new(page.size.x - p.x, p.y);
    let items = page.items.iter().filter_map(|item| {
        let mark = match &item.mark {
            Mark::Line { style: Style::Halo | Style::CutHalo | Style::Hidden, .. } => return None,
            Mark::Line { points, closed, style } => Mark::Line {
                points: points.iter().map(|&p| m(p)).collect(),
                closed: *closed,
                style: match style {
                    Style::Mountain => Style::Valley,
                    Style::Valley => Style::Mountain,
                    other => *other,
                },
            },
            Mark::Text { at, size, angle, text, colour: _, anchor, underlined } => Mark::Text {
                at: m(*at),
                size: *size,
                angle: -angle,
                text: text.clone(),
                colour: BLACK,
                anchor: *anchor,
                underlined: *underlined,
            },
            Mark::Polygon { .. } | Mark::Image(_) => return None,
        };
        Some(Item { layer: Layer::Print, mark, data: [&item.data[..], &[("back", String::new())]].concat() })
    });
    Page { size: page.size, items: items.collect() }
}
