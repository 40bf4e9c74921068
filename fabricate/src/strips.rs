//! A weave as strips of paper: one for each thread, with marks where it goes under another, to be woven by hand.

use crate::drawing::{BLACK, GREY, Item, Layer, Mark, Page, Style, srgb, text_width};
use crate::layout::{Paper, shelves};
use crate::sheets::{BLEED, Look, footer};
use crate::svg::number;
use biscale::error::BadInput;
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

/// What a strip has beyond its last crossing at either end, mm: to hold it by and to glue it down.
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

/// Draws strips on pages.
///
/// # Errors
/// A strip longer than the page; one too narrow to be cut, unless `force`.
pub fn pages(strips: &[Strip], paper: Paper, look: &Look, force: bool) -> Result<Vec<Page>, BadInput> {
    paper.check()?;
    if let Some(narrow) = strips.iter().find(|s| s.size.y < crate::fold::TOO_NARROW && !force) {
        let problem = format!("{} is {:.2} mm wide", narrow.name, narrow.size.y);
        let remedy = format!("choose --scale larger by {:.1} or more, or insist with --force", crate::fold::NARROW / narrow.size.y);
        return Err(BadInput::new(problem, remedy).at_field("--scale"));
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
        footer(page, paper, None, &title, false);
    }
    Ok(pages)
}

fn draw(page: &mut Page, strip: &Strip, look: &Look, angle: f64, at: impl Fn(f64, f64) -> DVec2) {
    let (l, w) = (strip.size.x, strip.size.y);
    let corners = |x0: f64, y0: f64, x1: f64, y1: f64| vec![at(x0, y0), at(x1, y0), at(x1, y1), at(x0, y1)];
    let fill = if look.colours { srgb(strip.colour) } else { [255; 3] };
    if look.colours {
        page.polygon(&corners(END - BLEED, -BLEED, l - END + BLEED, w + BLEED), fill);
        page.polygon(&corners(0.0, 0.0, END, w), [255; 3]);
        page.polygon(&corners(l - END, 0.0, l, w), [255; 3]);
    }
    page.items.push(Item {
        layer: Layer::Print,
        mark: Mark::Polygon { points: corners(0.0, 0.0, l, w), fill: [255; 3] },
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
                fill: if over { fill } else { [255; 3] },
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
            let size = (0.7 * w).min(0.8 * across).min(4.0);
            page.add(Layer::Print, Mark::Text { at: at(middle, 0.5 * w), size, angle, text: "u".into(), colour: GREY, anchor: 0.5 });
        }
    }
    page.items.push(Item {
        layer: Layer::Cut,
        mark: Mark::Line { points: corners(0.0, 0.0, l, w), closed: true, style: Style::Cut },
        data: vec![("piece", strip.name.replace(' ', "-")), ("loop", "0".into())],
    });
    let size = (0.6 * w).min((END - 1.0) / text_width(&strip.name, 1.0)).min(3.0);
    for x in [0.5 * END, l - 0.5 * END] {
        page.add(Layer::Print, Mark::Text { at: at(x, 0.5 * w), size, angle, text: strip.name.clone(), colour: BLACK, anchor: 0.5 });
    }
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
