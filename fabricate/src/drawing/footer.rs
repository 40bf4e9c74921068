//! What every page says below its pieces.

use super::labels::LEAST_TYPE;
use super::page::{BLACK, Item, Layer, Mark, Page, Style, text_width};
use crate::paper::Paper;
use glam::DVec2;

/// Length of the bar that is to be measured after printing, mm.
pub const BAR: f64 = 100.0;

/// What stands over the bar, the shorter one where there is little room.
const NOTES: [&str; 2] =
    ["100 mm: print at 100 % (\"actual size\", no fitting), then measure this bar", "100 mm: print at 100 %, then measure this bar"];

/// What a page says below its pieces.
#[derive(Clone, Copy, Debug, Default)]
pub struct Footer<'t> {
    /// Title of the page.
    pub title: &'t str,
    /// Fold angles, if they are told here.
    pub angles: Option<&'t str>,
    /// Whether it tells how lines look.
    pub legend: bool,
}

/// The lines of the legend: how they look, their kind, what they mean.
const LEGEND: [(Style, &str, &str); 3] = [
    (Style::Cut, "cut", "cut"),
    (Style::Mountain, "mountain", "mountain: fold away"),
    (Style::Valley, "valley", "valley: fold towards you"),
];

/// Draws the bar of 100 mm, the legend and the title below the pieces.
pub fn footer(page: &mut Page, paper: Paper, footer: Footer<'_>) {
    let corner = DVec2::splat(paper.margin + paper.inset);
    let at = |x: f64, y: f64| corner + DVec2::new(x, y);
    let mut line = |style, points: &[DVec2], data| {
        page.items.push(Item { layer: Layer::Print, mark: Mark::Line { points: points.to_vec(), closed: false, style }, data: vec![data] });
    };
    line(Style::Bold, &[at(0.2, 2.0), at(0.2 + BAR, 2.0)], ("bar", format!("{BAR}")));
    for k in 0..=10 {
        // The outer ticks end with the bar: it measures 100 mm from ink to ink.
        let x = 0.2 + (10.0 * f64::from(k)).clamp(0.2, BAR - 0.2);
        let height = if k % 5 == 0 { 1.8 } else { 1.0 };
        line(Style::Bold, &[at(x, 2.0), at(x, 2.0 + height)], ("tick", k.to_string()));
    }
    let width = page.size.x - 2.0 * corner.x - 0.4;
    let mut notes = NOTES.map(|note| footer.angles.map_or(note.to_owned(), |angles| format!("{note}  -  {angles}")));
    let note = usize::from(text_width(&notes[0], LEAST_TYPE) > width);
    text(page, at(0.2, 5.6), 2.4, width, std::mem::take(&mut notes[note]), ("note", String::new()));
    if footer.legend {
        let y = 9.4;
        let words: f64 = LEGEND.iter().map(|l| text_width(l.2, 1.0)).sum();
        let size = ((width - 3.0 * 15.0) / words).min(2.4);
        let mut x = 0.2;
        for (style, kind, what) in LEGEND {
            let data = vec![("legend", kind.to_owned())];
            let points = vec![at(x, y), at(x + 10.0, y)];
            page.items.push(Item { layer: Layer::Print, mark: Mark::Line { points, closed: false, style }, data });
            text(page, at(x + 11.0, y), size, width, what.to_owned(), ("legend-text", kind.to_owned()));
            x += 15.0 + text_width(what, size);
        }
    }
    // A name that is too long for the page loses its end.
    let most = (width / text_width("0", LEAST_TYPE)) as usize;
    let title = if footer.title.chars().count() > most {
        let (name, rest) = footer.title.rsplit_once("  -  ").unwrap_or((footer.title, ""));
        let kept: String = name.chars().take(most.saturating_sub(rest.chars().count() + 6)).collect();
        format!("{kept}…  -  {rest}")
    } else {
        footer.title.to_owned()
    };
    text(page, at(0.2, 13.2), 3.0, width, title, ("title", String::new()));
}

/// A text that starts at a point of its middle line, smaller where the room is less.
pub(super) fn text(page: &mut Page, at: DVec2, size: f64, room: f64, text: String, data: (&'static str, String)) {
    let size = size.min(room / text_width(&text, 1.0).max(1e-9));
    let mark = Mark::Text { at, size, angle: 0.0, text, colour: BLACK, anchor: 0.0, underlined: false };
    page.items.push(Item { layer: Layer::Print, mark, data: vec![data] });
}
