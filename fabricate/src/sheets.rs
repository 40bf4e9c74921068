//! The pages: pieces with colours, lines and numbers, and what every page says.

use crate::drawing::{BLACK, GREY, Item, Layer, Mark, Page, Style, srgb};
use crate::labels::{Label, Labels, NAME, NUMBER};
use crate::layout::{Paper, Place, shelves};
use crate::mesh::Mesh;
use crate::paint::{Picture, paint};
use crate::pattern::{Pattern, Piece};
use crate::texture::Texture;
use biscale::error::Result;
use glam::DVec2;
use std::collections::BTreeMap;

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// Title in the footer of every page.
    pub title: String,
    /// Fill facets with their colours.
    pub colours: bool,
    /// Print fold angles beside the folds where they have place.
    pub angles: bool,
    /// Length of a period along x, mm: the first facet of each period carries its number, as the lines of a wrap sheet do. 0 for none.
    pub period: f64,
    /// Print edge numbers.
    pub numbers: bool,
    /// Silhouette's three registration marks on every page.
    pub silhouette: bool,
    /// A mirrored page after each for the back of the paper.
    pub back: bool,
}

/// How far colour reaches over an edge that is cut, and onto a tab, mm.
pub const BLEED: f64 = 1.0;
/// Length of the bar that is to be measured after printing, mm.
pub const BAR: f64 = 100.0;

/// The pieces of a pattern on pages.
#[derive(Clone, Debug, PartialEq)]
pub struct Sheets {
    /// The pages.
    pub pages: Vec<Page>,
    /// Where each piece lies.
    pub places: Vec<Place>,
    /// Numbers that found no place beside their edge.
    pub missed: usize,
}

/// Lays out and draws a pattern. With a `texture` the facets get its colours in place of their own.
///
/// # Errors
/// A piece that fits no page; a page too small for anything; colours that cannot be written.
pub fn sheets(mesh: &Mesh, pattern: &Pattern, paper: Paper, look: &Look, texture: Option<&Texture<'_>>) -> Result<Sheets> {
    paper.check()?;
    let outlines: Vec<Vec<DVec2>> = pattern.pieces.iter().map(|p| p.outline.concat()).collect();
    let [corner, area] = paper.area();
    let (places, count) = shelves(&outlines, area, paper.roll)?;
    let mut pages = vec![Page { size: paper.size, items: Vec::new() }; count];
    let mut placed: Vec<Piece> = Vec::new();
    for (piece, place) in pattern.pieces.iter().zip(&places) {
        placed.push(piece.moved(place.x, place.shift + corner));
    }
    if paper.roll {
        let top = placed.iter().flat_map(|p| p.outline.iter().flatten()).map(|p| p.y).fold(0.0, f64::max);
        pages[0].size.y = (top + paper.margin + paper.inset).ceil();
    }
    // Colours of all pieces lie below all lines.
    if look.colours {
        for (piece, place) in placed.iter().zip(&places) {
            bleed(&mut pages[place.page], mesh, piece);
        }
    }
    let kinds = fold_kinds(&placed);
    let look = &Look {
        angles: look.angles && (kinds.len() > FEW_KINDS || placed.iter().map(|p| p.folds.len()).sum::<usize>() <= FEW_FOLDS),
        ..look.clone()
    };
    let angles = (!look.angles && kinds.len() <= FEW_KINDS && !kinds.is_empty()).then(|| angles_text(&kinds));
    let rows = if look.numbers { rows(mesh, look.period) } else { BTreeMap::new() };
    let mut missed = 0;
    for (k, (piece, place)) in placed.iter().zip(&places).enumerate() {
        let picture = match texture.filter(|_| look.colours) {
            Some(texture) => Some(paint(mesh, piece, texture)?),
            None => None,
        };
        missed += draw_piece(&mut pages[place.page], mesh, pattern, k, piece, look, &rows, picture);
    }
    let backs: Vec<Page> = if look.back { pages.iter().map(mirrored).collect() } else { Vec::new() };
    // The page that tells how to put the pieces together follows.
    let total = count + backs.len() + 1;
    let mut all = Vec::with_capacity(count + backs.len());
    let mut backs = backs.into_iter();
    for page in pages {
        all.push(page);
        all.extend(backs.next());
    }
    for (k, page) in all.iter_mut().enumerate() {
        let back = look.back && k % 2 == 1;
        let legend = if back { "back" } else { "front" };
        footer(
            page,
            paper,
            angles.as_deref(),
            &format!("{}  -  page {} of {total}{}", look.title, k + 1, if look.back { format!(" ({legend})") } else { String::new() }),
            !back,
        );
        if look.silhouette && !back {
            silhouette(page, paper);
        }
    }
    let places = places.into_iter().map(|p| Place { page: p.page * (1 + usize::from(look.back)), shift: p.shift + corner, ..p }).collect();
    Ok(Sheets { pages: all, places, missed })
}

/// For each period along x the facet that begins it, at the lowest y, with the text `#1` and so on.
fn rows(mesh: &Mesh, period: f64) -> BTreeMap<u32, String> {
    let low = mesh.vertices.iter().map(|v| v.x).fold(f64::INFINITY, f64::min);
    let size = mesh.vertices.iter().map(|v| v.x - low).fold(0.0, f64::max);
    if !(period > 0.0 && size > 1.5 * period) {
        return BTreeMap::new();
    }
    let mut first: BTreeMap<u64, (f64, f64, u32)> = BTreeMap::new();
    for (k, facet) in (0_u32..).zip(&mesh.facets) {
        let middle = facet.corners.iter().map(|&c| mesh.vertices[c as usize]).sum::<glam::DVec3>() / facet.corners.len() as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand periods")]
        let row = ((middle.x - low) / period).floor() as u64;
        let place = (middle.y, middle.x, k);
        let best = first.entry(row).or_insert(place);
        if (place.0, place.1) < (best.0, best.1) {
            *best = place;
        }
    }
    first.into_iter().map(|(row, (_, _, k))| (k, format!("#{}", row + 1))).collect()
}

/// So many kinds of folds are told once, in the footer, where there are more than so many folds.
const FEW_KINDS: usize = 4;
const FEW_FOLDS: usize = 40;

/// Folds below this angle, radians, are not to be seen on paper.
pub const FLAT: f64 = 2e-3;

/// The fold angles in whole degrees, mountains negative, each once.
fn fold_kinds(pieces: &[Piece]) -> std::collections::BTreeSet<i32> {
    #[expect(clippy::cast_possible_truncation, reason = "at most 180")]
    let whole = |angle: f64| angle.to_degrees().round() as i32;
    pieces.iter().flat_map(|p| &p.folds).filter(|f| f.angle.abs() >= FLAT).map(|f| whole(f.angle)).collect()
}

/// `mountain 45°, valley 63°`.
fn angles_text(kinds: &std::collections::BTreeSet<i32>) -> String {
    let list: Vec<String> = kinds.iter().map(|&a| format!("{} {}°", if a < 0 { "mountain" } else { "valley" }, a.abs())).collect();
    format!("fold angles: {}", list.join(", "))
}

fn facet_fill(mesh: &Mesh, facet: u32, look: &Look) -> [u8; 3] {
    if look.colours { srgb(mesh.facets[facet as usize].colour) } else { [255; 3] }
}

/// Colour over the edges that are cut: scissors and printers are a little off.
fn bleed(page: &mut Page, mesh: &Mesh, piece: &Piece) {
    for (f, polygon) in &piece.facets {
        let fill = srgb(mesh.facets[*f as usize].colour);
        let n = polygon.len();
        for k in 0..n {
            let (a, b) = (polygon[k], polygon[(k + 1) % n]);
            let edge = mesh.facets[*f as usize].edges[k];
            if piece.folds.iter().any(|fold| fold.edge == edge) {
                continue;
            }
            let along = (b - a).normalize_or_zero();
            let out = -along.perp() * BLEED;
            page.polygon(&[b + along * BLEED, a - along * BLEED, a - along * BLEED + out, b + along * BLEED + out], fill);
        }
    }
}

#[expect(clippy::too_many_arguments, reason = "what a piece is and how it is drawn; one caller")]
fn draw_piece(
    page: &mut Page,
    mesh: &Mesh,
    pattern: &Pattern,
    k: usize,
    piece: &Piece,
    look: &Look,
    rows: &BTreeMap<u32, String>,
    picture: Option<Picture>,
) -> usize {
    let mut of_piece = vec![("piece", piece.name.to_string())];
    if piece.copies > 1 {
        of_piece.push(("copy", piece.copy.to_string()));
    }
    let data = |more: &[(&'static str, String)]| [&of_piece[..], more].concat();
    for tab in &piece.tabs {
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Polygon { points: tab.corners.clone(), fill: [255; 3] },
            data: data(&[("tab-of", tab.edge.to_string())]),
        });
        if look.colours {
            // Colour reaches onto the tab as far as over the outline, or as far as the tab does.
            let c = &tab.corners;
            let depth = crate::polygon::distance_to_segment(c[2], c[0], c[1]);
            let t = (BLEED / depth.max(1e-9)).min(1.0);
            let strip = match c.len() {
                4 => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[3], t)],
                _ => vec![c[0], c[1], c[1].lerp(c[2], t), c[0].lerp(c[2], t)],
            };
            page.polygon(&strip, srgb(mesh.facets[tab.facet as usize].colour));
        }
    }
    for (f, polygon) in &piece.facets {
        page.items.push(Item {
            layer: Layer::Print,
            mark: Mark::Polygon { points: polygon.clone(), fill: facet_fill(mesh, *f, look) },
            data: data(&[("facet", f.to_string())]),
        });
    }
    // Black, red and blue do not show on dark colours: lines get a white bed there, cut lines one of dashes, which leaves little white.
    let textured = picture.is_some();
    if let Some(picture) = picture {
        page.items.push(Item { layer: Layer::Print, mark: Mark::Picture(picture), data: data(&[]) });
    }
    if look.colours && (textured || piece.facets.iter().any(|(f, _)| is_dark(facet_fill(mesh, *f, look)))) {
        for fold in piece.folds.iter().filter(|f| f.angle.abs() >= FLAT) {
            page.line(Layer::Print, Style::Halo, &fold.ends, false);
        }
        for outline in &piece.outline {
            page.line(Layer::Print, Style::CutHalo, outline, true);
        }
    }
    for fold in &piece.folds {
        // Flat inside a piece is no line to fold: nothing is drawn, but a reader learns the angle.
        if fold.angle == 0.0 {
            continue;
        }
        let style = if fold.angle.abs() < FLAT {
            Style::Hidden
        } else if fold.angle < 0.0 {
            Style::Mountain
        } else {
            Style::Valley
        };
        page.items.push(Item {
            layer: Layer::Score,
            mark: Mark::Line { points: fold.ends.to_vec(), closed: false, style },
            data: data(&[("edge", fold.edge.to_string()), ("angle", format!("{:.9}", fold.angle.to_degrees()))]),
        });
    }
    for tab in &piece.tabs {
        // The tab goes under its neighbour: it folds as the surface does there, and then some.
        let angle = mesh.edges[tab.edge as usize].angle;
        page.items.push(Item {
            layer: Layer::Score,
            mark: Mark::Line {
                points: vec![tab.corners[0], tab.corners[1]],
                closed: false,
                style: if angle <= 0.0 { Style::Mountain } else { Style::Valley },
            },
            data: data(&[("tab", tab.edge.to_string()), ("angle", format!("{:.9}", angle.to_degrees()))]),
        });
    }
    for (j, outline) in piece.outline.iter().enumerate() {
        page.items.push(Item {
            layer: Layer::Cut,
            mark: Mark::Line { points: outline.clone(), closed: true, style: Style::Cut },
            data: data(&[("loop", j.to_string())]),
        });
    }
    let labels = labels(mesh, pattern, k, piece, look, rows);
    for label in &labels.placed {
        if textured {
            // A white bed here too: the colours under a text may be any.
            page.polygon(label.rectangle().points(), [255; 3]);
        }
        let of = label.number_of.map(|(edge, facet)| data(&[("number-of", edge.to_string()), ("on", facet.to_string())]));
        page.items.push(Item { layer: Layer::Print, mark: text(label, mesh, piece, look, textured), data: of.unwrap_or_default() });
    }
    labels.missed
}

/// Whether black is hard to see on a colour.
fn is_dark(colour: [u8; 3]) -> bool {
    colour.iter().map(|&v| u32::from(v)).sum::<u32>() < 300
}

fn text(label: &Label, mesh: &Mesh, piece: &Piece, look: &Look, textured: bool) -> Mark {
    // White on dark facets.
    let under = piece.facets.iter().find(|(_, p)| crate::polygon::contains(p, label.at)).map(|(f, _)| facet_fill(mesh, *f, look));
    let dark = !textured && under.is_some_and(is_dark);
    let colour = if dark {
        [235; 3]
    } else if label.size > NUMBER[0] {
        BLACK
    } else {
        GREY
    };
    Mark::Text { at: label.at, size: label.size, angle: label.angle, text: label.text.clone(), colour, anchor: 0.5 }
}

/// The texts of one piece: its name, the numbers of its edges, the angles of its folds.
fn labels(mesh: &Mesh, pattern: &Pattern, k: usize, piece: &Piece, look: &Look, rows: &BTreeMap<u32, String>) -> Labels {
    let mut labels = Labels::default();
    let (alike, number) = (pattern.alike(k), piece.name.to_string());
    // Copies may take each other's place; pieces that are only cut and folded alike have numbers of their own.
    let name = if piece.copies > 1 {
        format!("{number} (x{})", piece.copies)
    } else if alike > 1 {
        format!("{number} (like {}, x{alike})", pattern.pieces[piece.like].name)
    } else {
        number.clone()
    };
    let mut largest: Vec<&(u32, Vec<DVec2>)> = piece.facets.iter().collect();
    largest.sort_by(|a, b| crate::polygon::area(&b.1).total_cmp(&crate::polygon::area(&a.1)));
    // In full where it fits, else the number alone.
    let _ = largest.iter().take(8).any(|(_, p)| labels.within(p, &name, NAME))
        || largest.iter().take(8).any(|(_, p)| labels.within(p, &number, NAME));
    for (f, polygon) in &piece.facets {
        if let Some(row) = rows.get(f).filter(|_| piece.copies == 1) {
            // A number that finds no place is told by its neighbours.
            labels.within(polygon, row, [2.6, 1.0]);
        }
    }
    let facet = |f: u32| piece.facets.iter().find(|(g, _)| *g == f).map(|(_, p)| p.as_slice()).unwrap_or_default();
    if look.numbers {
        for tab in &piece.tabs {
            let number = piece.glue.iter().find(|g| g.edge == tab.edge && g.facet == tab.facet).map_or(0, |g| g.number);
            labels.number([tab.corners[0], tab.corners[1]], &tab.corners, number, (tab.edge, tab.facet));
        }
        for glue in piece.glue.iter().filter(|g| !g.tab) {
            labels.number(glue.ends, facet(glue.facet), glue.number, (glue.edge, glue.facet));
        }
    }
    if look.angles {
        for fold in piece.folds.iter().filter(|f| f.angle.abs() >= FLAT) {
            let text = format!("{:.0}°", fold.angle.abs().to_degrees());
            let (f, _) = mesh.edges[fold.edge as usize].sides[0].expect("a fold has two facets");
            let before = labels.missed;
            labels.along(fold.ends, facet(f), &text, [1.6, 0.9]);
            // An angle that finds no place is told by the model's shape; a number that finds none is missed.
            labels.missed = before;
        }
    }
    labels
}

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

/// The marks that Silhouette's cutters look for: a square of 5 mm at the upper left, two corners of 20 mm lines .5 mm thick.
fn silhouette(page: &mut Page, paper: Paper) {
    let m = paper.margin;
    let (w, h) = (page.size.x, page.size.y);
    let square = [DVec2::new(m, h - m - 5.0), DVec2::new(m + 5.0, h - m - 5.0), DVec2::new(m + 5.0, h - m), DVec2::new(m, h - m)];
    page.add(Layer::Registration, Mark::Polygon { points: square.to_vec(), fill: BLACK });
    let corner = |at: DVec2, x: f64, y: f64| [at + DVec2::new(x, 0.0), at, at + DVec2::new(0.0, y)];
    page.line(
        Layer::Registration,
        Style::Bold,
        &corner(DVec2::new(w - m - 0.25, h - m - 0.25), -SILHOUETTE_LENGTH, -SILHOUETTE_LENGTH),
        false,
    );
    page.line(Layer::Registration, Style::Bold, &corner(DVec2::new(m + 0.25, m + 0.25), SILHOUETTE_LENGTH, SILHOUETTE_LENGTH), false);
}

/// Length of the lines of registration marks, mm.
const SILHOUETTE_LENGTH: f64 = 20.0;
/// What registration marks take from the area on each side, mm.
pub const SILHOUETTE_INSET: f64 = 11.0;

/// The page as seen through the paper: folds change sides, colours and texts are left out but for the pieces' names.
fn mirrored(page: &Page) -> Page {
    let m = |p: DVec2| DVec2::new(page.size.x - p.x, p.y);
    let items = page.items.iter().filter_map(|item| {
        let mark = match &item.mark {
            Mark::Line { points, closed, style } => Mark::Line {
                points: points.iter().map(|&p| m(p)).collect(),
                closed: *closed,
                style: match style {
                    Style::Mountain => Style::Valley,
                    Style::Valley => Style::Mountain,
                    other => *other,
                },
            },
            Mark::Text { at, size, angle, text, colour: _, anchor } => {
                Mark::Text { at: m(*at), size: *size, angle: -angle, text: text.clone(), colour: GREY, anchor: *anchor }
            }
            Mark::Polygon { .. } | Mark::Picture(_) => return None,
        };
        Some(Item { layer: Layer::Print, mark, data: Vec::new() })
    });
    Page { size: page.size, items: items.collect() }
}
