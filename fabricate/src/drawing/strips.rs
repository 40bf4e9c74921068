//! Strips of a weave on pages.

use super::footer::{Footer, footer};
use super::labels::LEAST_TYPE;
use super::look::Look;
use super::page::{BLACK, Item, Layer, Mark, Page, Style, WHITE, number, srgb, text_width};
use crate::layout::shelves;
use crate::paper::{BLEED, Paper};
use crate::surface::{NARROW, TOO_NARROW};
use crate::unfold::{Crossing, END, Strip};
use biscale::error::BadInput;
use glam::DVec2;

/// Draws strips on pages.
///
/// # Errors
/// A strip longer than the page; one too narrow to be cut, unless `force`.
pub fn strip_pages(strips: &[Strip], paper: Paper, look: &Look, force: bool) -> Result<Vec<Page>, BadInput> {
    paper.check()?;
    if let Some(narrow) = strips.iter().find(|s| s.size.y < TOO_NARROW && !force) {
        let problem = format!("{} is {:.2} mm wide", narrow.name, narrow.size.y);
        let remedy = format!("choose `scale` larger by {:.1} or more, or insist with `force`", NARROW / narrow.size.y);
        return Err(BadInput::new(problem, remedy).at_field("scale"));
    }
    let rectangle = |s: &Strip| vec![DVec2::ZERO, DVec2::new(s.size.x, 0.0), s.size, DVec2::new(0.0, s.size.y)];
    let [corner, area] = paper.area();
    let (places, count) = shelves(&strips.iter().map(rectangle).collect::<Vec<_>>(), area, paper.roll)?;
    let mut pages = vec![Page { size: paper.size, items: Vec::new() }; count];
    if paper.roll {
        let top = strips
            .iter()
            .zip(&places)
            .map(|(s, p)| rectangle(s).iter().map(|q| (q.x * p.x + q.y * p.x.perp() + p.shift).y).fold(0.0, f64::max));
        pages[0].size.y = (top.fold(0.0, f64::max) + corner.y + paper.margin + paper.inset).ceil();
    }
    for (strip, place) in strips.iter().zip(&places) {
        let at = |x: f64, y: f64| corner + place.shift + x * place.x + y * place.x.perp();
        draw(&mut pages[place.page], strip, look, place.x.to_angle(), at);
    }
    let total = count;
    for (k, page) in pages.iter_mut().enumerate() {
        let title = format!("{}  -  page {} of {total}: strips to weave; \"u\" goes under", look.title, k + 1);
        footer(page, paper, Footer { title: &title, ..Footer::default() });
    }
    Ok(pages)
}

fn draw(page: &mut Page, strip: &Strip, look: &Look, angle: f64, at: impl Fn(f64, f64) -> DVec2) {
    let (l, w) = (strip.size.x, strip.size.y);
    let corners = |x0: f64, y0: f64, x1: f64, y1: f64| vec![at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)];
    let fill = if look.colours { srgb(strip.colour) } else { WHITE };
    if look.colours {
        page.polygon(&corners(END - BLEED, -BLEED, l - END + BLEED, w + BLEED), fill);
        page.polygon(&corners(0.0, 0.0, END, w), WHITE);
        page.polygon(&corners(l - END, 0.0, l, w), WHITE);
    }
    page.items.push(Item {
        layer: Layer::Print,
        mark: Mark::Polygon { points: corners(0.0, 0.0, l, w), fill: WHITE },
        data: vec![("strip", strip.name.replace(' ', "-")), ("at", number(strip.at))],
    });
    if look.colours {
        page.polygon(&corners(END, 0.0, l - END, w), fill);
    }
    for (k, &Crossing { middle, across, over, at: there }) in strip.crossings.iter().enumerate() {
        // Where it goes under, the marks are hidden once it is woven; where it lies over nothing is drawn on it.
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Polygon {
                points: corners(middle - 0.5 * across, 0.0, middle + 0.5 * across, w),
                fill: if over { fill } else { WHITE },
            },
            data: vec![
                ("crossing", (k + 1).to_string()),
                ("of", strip.name.replace(' ', "-")),
                ("over", u8::from(over).to_string()),
                ("at", number(there)),
            ],
        });
        if !over {
            for x in [middle - 0.5 * across, middle + 0.5 * across] {
                page.line(Layer::Print, Style::Thin, &[at(x, 0.0), at(x, w)], false);
            }
            let size = (0.7 * w).min(0.8 * across).clamp(LEAST_TYPE, 4.0);
            let mark = Mark::Text { at: at(middle, 0.5 * w), size, angle, text: "u".into(), colour: BLACK, anchor: 0.5, underlined: false };
            let data = vec![("under", (k + 1).to_string()), ("of-strip", strip.name.replace(' ', "-"))];
            page.items.push(Item { layer: Layer::Print, mark, data });
        }
    }
    page.items.push(Item {
        layer: Layer::Cut,
        mark: Mark::Line { points: corners(0.0, 0.0, l, w), closed: true, style: Style::Cut },
        data: vec![("piece", strip.name.replace(' ', "-")), ("loop", "0".into())],
    });
    // Digits of the least size are 1.3 mm high: they fit on a strip of 1.5 mm.
    let size = (0.6 * w).min((END - 1.0) / text_width(&strip.name, 1.0)).clamp(LEAST_TYPE, 3.0);
    for x in [0.5 * END, l - 0.5 * END] {
        let mark = Mark::Text { at: at(x, 0.5 * w), size, angle, text: strip.name.clone(), colour: BLACK, anchor: 0.5, underlined: false };
        page.items.push(Item { layer: Layer::Print, mark, data: vec![("strip-name", strip.name.replace(' ', "-"))] });
    }
}
