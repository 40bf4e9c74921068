//! What every page says below its pieces: the bar, the legend, the title, and the marks of a cutter.

use super::drawn::Shape;
use super::page::{DRAWN, Kind, Page};
use crate::polygon::bounds;
use crate::sheet_recipe::SheetRecipe;
use glam::DVec2;
use std::collections::BTreeSet;

/// Length of the bar, mm.
const BAR: f64 = 100.0;

/// What the legend says of each kind of line.
const LEGEND: [(&str, Kind, &str); 3] =
    [("cut", Kind::Cut, "cut"), ("mountain", Kind::Mountain, "mountain: fold away"), ("valley", Kind::Valley, "valley: fold towards you")];

/// What the note over the bar may say.
const NOTES: [&str; 2] =
    ["100 mm: print at 100 % (\"actual size\", no fitting), then measure this bar", "100 mm: print at 100 %, then measure this bar"];

/// Compares the footer of a page with pieces; `kinds` are its fold angles in whole degrees, mountains negative, if the footer tells them.
pub(super) fn check(page: &mut Page<'_>, sheet: &SheetRecipe, total: usize, kinds: Option<&BTreeSet<i64>>) {
    bar(page);
    legend(page);
    if let Some(mark) = page.one("note", "the note at the bar")
        && let Some((words, ..)) = page.text(mark, "the note at the bar")
    {
        let kind = |a: &i64| format!("{} {}°", if (*a < 0) == page.back { "valley" } else { "mountain" }, a.abs());
        let angles =
            kinds.map(|kinds| format!("  -  fold angles: {}", kinds.iter().map(kind).collect::<Vec<_>>().join(", "))).unwrap_or_default();
        // Runs of spaces are one in SVG.
        let plain = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        if !NOTES.iter().any(|note| plain(words) == plain(&format!("{note}{angles}"))) {
            page.wrong("says something else", format!("the note at the bar: \"{words}\""));
        }
    }
    if let Some(mark) = page.one("title", "the title")
        && let Some((words, ..)) = page.text(mark, "the title")
    {
        let side = match (sheet.back, page.back) {
            (false, _) => "",
            (true, false) => " (front)",
            (true, true) => " (back)",
        };
        if !words.ends_with(&format!("page {} of {total}{side}", page.number - sheet.wrap_pages)) {
            page.wrong("says something else", format!("the title: \"{words}\""));
        }
    }
    if sheet.registration && !page.back {
        registration(page, sheet);
    }
}

fn bar(page: &mut Page<'_>) {
    let Some(mark) = page.one("bar", "the bar of 100 mm") else { return };
    let points = mark.points();
    page.line(mark, &points.clone(), Kind::Bold, "print", "the bar of 100 mm");
    let [low, high] = bounds(points);
    if (high.x - low.x - BAR).abs() > DRAWN || high.y - low.y > DRAWN {
        page.wrong("not true to scale", format!("the bar of 100 mm is {:.2} mm long", high.distance(low)));
    }
    for k in 0..=10 {
        let what = format!("tick {k} of the bar");
        let Some(tick) = page.one(&format!("tick {k}"), &what) else { continue };
        let points = tick.points();
        page.line(tick, &points.clone(), Kind::Bold, "print", &what);
        // The outer ticks end with the bar.
        let x = low.x + (10.0 * f64::from(k)).clamp(0.2, BAR - 0.2);
        if points.iter().any(|p| (p.x - x).abs() > DRAWN || p.y < low.y - DRAWN || p.y > low.y + 2.0) {
            page.wrong("drawn elsewhere", what);
        }
    }
}

fn legend(page: &mut Page<'_>) {
    for (name, kind, says) in LEGEND {
        let what = format!("the legend of {name}");
        let (line, text) = (page.one(&format!("legend {name}"), &what), page.one(&format!("legend-text {name}"), &what));
        let (Some(line), Some(mark)) = (line, text) else { continue };
        let points = line.points();
        page.line(line, &points.clone(), kind, "print", &what);
        let Some((words, middle, _)) = page.text(mark, &what) else { continue };
        let [low, high] = bounds(points);
        let [text_low, _] = bounds(mark.points());
        let beside = text_low.x > high.x && text_low.x < high.x + 3.0 && (middle.y - low.y).abs() < 1.0 && high.x - low.x > 5.0;
        if words != says || !beside {
            page.wrong("says something else", format!("{what}: \"{words}\""));
        }
    }
}

/// Silhouette's square of 5 mm and two corners of 20 mm.
fn registration(page: &mut Page<'_>, sheet: &SheetRecipe) {
    let (size, m) = (page.drawn.size, sheet.margin_mm);
    let (low, high) = (DVec2::splat(m + 0.25), size - m - 0.25);
    let wanted = [
        vec![
            DVec2::new(m, size.y - m - 5.0),
            DVec2::new(m + 5.0, size.y - m - 5.0),
            DVec2::new(m + 5.0, size.y - m),
            DVec2::new(m, size.y - m),
        ],
        vec![high - DVec2::new(20.0, 0.0), high, high - DVec2::new(0.0, 20.0)],
        vec![low + DVec2::new(20.0, 0.0), low, low + DVec2::new(0.0, 20.0)],
    ];
    let marks = page.all("registration");
    let same = |a: &[DVec2], b: &[DVec2]| a.len() == b.len() && a.iter().zip(b).all(|(p, q)| p.distance(*q) < DRAWN);
    for mark in &marks {
        page.in_layer(mark, "registration", "a registration mark");
        let plain = match &mark.shape {
            Shape::Fill { colour, line, .. } => *colour == [0; 3] && line.is_none(),
            Shape::Line { look, .. } => Kind::Bold.fits(look),
            _ => false,
        };
        if !plain {
            page.wrong("drawn as something else", "a registration mark");
        }
    }
    if marks.len() != 3 || !wanted.iter().all(|w| marks.iter().any(|mark| same(&mark.points(), w))) {
        page.wrong("drawn elsewhere", "the registration marks");
    }
}
