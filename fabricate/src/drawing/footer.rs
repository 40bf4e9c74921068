//! What every page says below its pieces.

use super::page::{Item, Layer, Mark, Page, Style};
use crate::paper::Paper;
use glam::DVec2;

/// Length of the bar that is to be measured after printing, mm.
pub const BAR: f64 = 100.0;

/// The bar of 100 mm, the legend and the title below the pieces.
pub fn footer(page: &mut Page, paper: Paper, angles: Option<&str>, title: &str, with_legend: bool) {
    let corner = DVec2::splat(paper.margin + paper.inset);
    let at = |x: f64, y: f64| corner + DVec2::new(x, y);
    let bar = [at(0.2, 2.0), at(0.2 + BAR, 2.0)];
    page.items.push(Item {
        layer: Layer::Print,
        mark: Mark::Line { points: bar.to_vec(), closed: false, style: Style::Bold },
        data: vec![("bar", format!("{BAR}"))],
    });
    for k in 0..=10 {
        // The outer ticks end with the bar: it measures 100 mm from ink to ink.
        let x = 0.2 + (10.0 * f64::from(k)).clamp(0.2, BAR - 0.2);
        let height = if k % 5 == 0 { 1.8 } else { 1.0 };
        page.line(Layer::Print, Style::Bold, &[at(x, 2.0), at(x, 2.0 + height)], false);
    }
    let width = page.size.x - 2.0 * corner.x;
    // Texts shrink to the page.
    let fit = |text: &str, size: f64, room: f64| size.min(room / (text.chars().count().max(1) as f64 * 0.65));
    let mut note = "100 mm: print at 100 % (\"actual size\", no fitting), then measure this bar".to_owned();
    if let Some(angles) = angles {
        note = format!("{note}  -  {angles}");
    }
    page.text(at(0.2, 5.6), fit(&note, 2.4, width), note);
    if with_legend {
        let y = 9.4;
        let mut x = 0.2;
        for (style, what) in [(Style::Cut, "cut"), (Style::Mountain, "mountain: fold away"), (Style::Valley, "valley: fold towards you")] {
            page.line(Layer::Print, style, &[at(x, y), at(x + 12.0, y)], false);
            page.text(at(x + 13.5, y), 2.4, what);
            x += 17.0 + 1.5 * what.chars().count() as f64;
        }
    }
    page.text(at(0.2, 13.2), fit(title, 3.0, width), title);
}
