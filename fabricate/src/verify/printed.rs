//! The pages as they are drawn, compared with what the design and the places of its facets ask for.

use super::assembly;
use super::cut_lines;
use super::drawn::Shape;
use super::findings::Findings;
use super::footer;
use super::page::{DRAWN, Page, facet_colour};
use super::read_pattern::{ReadFacet, ReadPattern, ReadTab};
use super::sides::Sides;
use super::texts::Texts;
use crate::mesh::Mesh;
use crate::polygon::{contains, distance_to_segment};
use crate::sheet_recipe::SheetRecipe;
use glam::DVec2;
use rustc_hash::FxHashMap;
use std::collections::{BTreeMap, BTreeSet};

/// So many kinds of folds, or fewer, are told in the footer where they are not told at the folds.
const FEW_KINDS: usize = 4;

/// What is wrong with what is drawn, in words.
pub(super) fn check(seen: &ReadPattern, design: &Mesh, sides: &Sides) -> Vec<String> {
    let sheet: SheetRecipe = match seen.recipe.get("sheet").map(|s| serde_json::from_value(s.clone())) {
        Some(Ok(sheet)) => sheet,
        _ => return vec!["the file does not say what its sheets show: write the pattern again".to_owned()],
    };
    let mut findings = Findings::default();
    if seen.drawn.len() != sheet.pages() {
        findings.add("pages", format!("there are {} and should be {}", seen.drawn.len(), sheet.pages()));
    }
    let pieces = Pieces::new(seen, design, sides, &sheet);
    pieces.tabs(&mut findings);
    let kinds = pieces.kinds();
    let told = (!sheet.angles && !kinds.is_empty() && kinds.len() <= FEW_KINDS).then_some(&kinds);
    let sides_of_sheet = 1 + usize::from(sheet.back);
    let (first, last) = (sheet.wrap_pages, sheet.wrap_pages + sheet.piece_pages * sides_of_sheet);
    let total = sheet.pages() - sheet.wrap_pages;
    for (k, drawn) in seen.drawn.iter().enumerate() {
        size(&mut findings, k + 1, drawn.size, &sheet, k >= last);
        if k < first {
            continue;
        }
        let back = sheet.back && k < last && (k - first) % 2 == 1;
        let mut page = Page::new(k + 1, drawn, back, &mut findings);
        if k < last {
            pieces.page(&mut page, k - usize::from(back));
            footer::check(&mut page, &sheet, total, told);
        } else {
            assembly::check(&mut page, seen, design, sides, k == last);
        }
        page.finish(sheet.margin_mm);
    }
    let listed = assembly::listed(&seen.drawn[last.min(seen.drawn.len())..]);
    assembly::order(&mut findings, seen, design, sides, &listed);
    findings.lines()
}

fn size(findings: &mut Findings, number: usize, size: DVec2, sheet: &SheetRecipe, assembly: bool) {
    let [w, h] = sheet.page_mm;
    let height = if h > 0.0 || assembly { (size.y - if h > 0.0 { h } else { size.y }).abs() } else { 0.0 };
    if (size.x - w).abs() > DRAWN || height > DRAWN {
        findings.add("page size", format!("page {number} is {:.2} x {:.2} mm and should be {w} x {h} mm", size.x, size.y));
    }
}

/// The pieces and what they should show.
struct Pieces<'a> {
    seen: &'a ReadPattern,
    design: &'a Mesh,
    sides: &'a Sides,
    sheet: &'a SheetRecipe,
    texts: Texts<'a>,
    /// Tabs by edge and facet.
    tab: FxHashMap<[u32; 2], &'a ReadTab>,
    numbers: FxHashMap<u32, &'a str>,
    /// Facets of each piece, by page.
    of_page: BTreeMap<usize, BTreeMap<[u32; 2], Vec<&'a ReadFacet>>>,
}

impl<'a> Pieces<'a> {
    fn new(seen: &'a ReadPattern, design: &'a Mesh, sides: &'a Sides, sheet: &'a SheetRecipe) -> Self {
        let mut of_page: BTreeMap<usize, BTreeMap<[u32; 2], Vec<&ReadFacet>>> = BTreeMap::new();
        for facet in &seen.facets {
            of_page.entry(facet.page).or_default().entry(facet.piece).or_default().push(facet);
        }
        let texts = Texts {
            seen,
            design,
            sides,
            sheet,
            without_name: sheet.without_name.iter().copied().collect(),
            without_number: sheet.without_number.iter().copied().collect(),
            without_angle: sheet.without_angle.iter().copied().collect(),
            angles: sheet.angles,
        };
        let tab = seen.tabs.iter().map(|t| ([t.edge, t.facet], t)).collect();
        let numbers = seen.numbers.iter().map(|(e, _, n)| (*e, n.as_str())).collect();
        Self { seen, design, sides, sheet, texts, tab, numbers, of_page }
    }

    /// The angle of an edge of the design, and whether its line is drawn.
    fn angle(&self, edge: u32) -> (f64, bool) {
        let angle = self.design.edges[edge as usize].angle;
        (angle, angle.to_degrees().abs() >= self.sheet.flat_angle_deg)
    }

    /// Whole degrees of all folds that are drawn, mountains negative.
    fn kinds(&self) -> BTreeSet<i64> {
        let folds = (0..self.design.edges.len()).filter(|&e| self.sides.joined[e]).filter_map(|e| u32::try_from(e).ok());
        folds.map(|e| self.angle(e)).filter(|a| a.1).map(|a| a.0.to_degrees().round() as i64).collect()
    }

    /// Every glued edge has one tab, which lies under the facet beyond.
    fn tabs(&self, findings: &mut Findings) {
        let without: BTreeSet<u32> = self.sheet.without_tab.iter().copied().collect();
        let mut count: FxHashMap<u32, usize> = FxHashMap::default();
        self.seen.tabs.iter().for_each(|t| *count.entry(t.edge).or_default() += 1);
        for (e, edge) in (0_u32..).zip(&self.design.edges) {
            let glued = edge.sides[1].is_some() && !self.sides.joined[e as usize];
            let tabs = count.get(&e).copied().unwrap_or(0);
            let wanted = usize::from(glued && !without.contains(&e));
            if tabs != wanted {
                findings.add("tabs", format!("edge {e} has {tabs} tabs and should have {wanted}"));
            }
        }
        for tab in &self.seen.tabs {
            if !self.under(tab) {
                findings.add("tabs", format!("the tab of edge {} does not lie under the facet beyond it", tab.edge));
            }
        }
    }

    /// Whether a tab, folded over its edge, lies within the facet beyond.
    fn under(&self, tab: &ReadTab) -> bool {
        let Some(other) = self.design.other(tab.edge, tab.facet) else { return false };
        let Some(&k) = self.sides.place.get(&other.facet) else { return false };
        let polygon = &self.seen.facets[k].polygon;
        let n = polygon.len();
        // The neighbour runs the edge the other way: from its corner lies the tab's own second one.
        let (c, d) = (polygon[other.place as usize], polygon[(other.place as usize + 1) % n]);
        let &[a, b, ..] = &tab.polygon[..] else { return false };
        let own = (b - a).normalize_or_zero();
        let beyond = (d - c).normalize_or_zero();
        let inside = |p: &DVec2| {
            let (x, y) = (own.dot(*p - a), own.perp_dot(*p - a));
            let q = c + x * beyond + y * beyond.perp();
            contains(polygon, q) || (0..n).any(|k| distance_to_segment(q, polygon[k], polygon[(k + 1) % n]) < DRAWN)
        };
        (a.distance(b) - c.distance(d)).abs() < DRAWN && tab.polygon.iter().all(inside)
    }

    /// What a page with pieces should show; `front` is the page with its facets, from 0.
    fn page(&self, page: &mut Page<'_>, front: usize) {
        for (&piece, facets) in self.of_page.get(&front).into_iter().flatten() {
            if !page.back {
                self.fills(page, piece, facets);
            }
            cut_lines::check(page, self.seen, self.design, self.sides, piece);
            // A clean front has no texts and no folds.
            if self.sheet.clean_front && !page.back {
                continue;
            }
            self.texts.name(page, piece, facets);
            for facet in facets {
                self.texts.row(page, facet);
                self.edges(page, facet);
            }
        }
        for mark in page.all("halo") {
            let white = matches!(&mark.shape, Shape::Line { look, .. } if look.colour == [255; 3] && look.width <= 0.4 + 1e-3);
            if !white || mark.layer != "print" || !self.sheet.colours {
                page.wrong("drawn as another kind of line", "white under a line");
            }
        }
    }

    /// Colours of facets, of tabs and over the edges that are cut.
    fn fills(&self, page: &mut Page<'_>, piece: [u32; 2], facets: &[&ReadFacet]) {
        for facet in facets {
            let colour = facet_colour(self.design, facet.facet, self.sheet.colours);
            let what = format!("facet {}", facet.facet);
            if let Some(mark) = page.one(&what, &what) {
                page.fill(mark, &facet.polygon, colour, &what);
            }
            let n = facet.polygon.len();
            for (k, &edge) in self.design.facets[facet.facet as usize].edges.iter().enumerate() {
                if self.sides.joined[edge as usize] {
                    continue;
                }
                let ends = [facet.polygon[k], facet.polygon[(k + 1) % n]];
                let tab = self.tab.get(&[edge, facet.facet]);
                if let Some(tab) = tab {
                    let what = format!("the tab of edge {edge}");
                    if let Some(mark) = page.one(&format!("tab-of {edge} {}", facet.facet), &what) {
                        page.fill(mark, &tab.polygon, [255; 3], &what);
                    }
                }
                if self.sheet.colours {
                    self.bleed(page, [edge, facet.facet], ends, colour, tab.copied());
                }
            }
        }
        if self.sheet.textured {
            self.texts.image(page, piece, facets);
        }
    }

    /// Colour reaches over an edge that is cut, and onto its tab.
    fn bleed(&self, page: &mut Page<'_>, [edge, facet]: [u32; 2], [a, b]: [DVec2; 2], colour: [u8; 3], tab: Option<&ReadTab>) {
        let along = (b - a).normalize_or_zero();
        let what = format!("the colour beyond edge {edge} of facet {facet}");
        let reach = |mark: &super::drawn::Drawn| {
            mark.points().iter().all(|p| {
                let (x, y) = (along.dot(*p - a), -along.perp_dot(*p - a));
                (-1.0 - DRAWN..=a.distance(b) + 1.0 + DRAWN).contains(&x) && (-DRAWN..=1.0 + DRAWN).contains(&y)
            })
        };
        if let Some(mark) = page.one(&format!("bleed {edge} {facet}"), &what) {
            page.fill(mark, &mark.points(), colour, &what);
            if !reach(mark) || mark.points().len() != 4 {
                page.wrong("drawn elsewhere", &what);
            }
        }
        if let Some(tab) = tab
            && let Some(mark) = page.one(&format!("tab-colour {edge} {facet}"), &what)
        {
            page.fill(mark, &mark.points(), colour, &what);
            let n = tab.polygon.len();
            let near = |p: &DVec2| {
                contains(&tab.polygon, *p) || (0..n).any(|k| distance_to_segment(*p, tab.polygon[k], tab.polygon[(k + 1) % n]) < DRAWN)
            };
            if !reach(mark) || !mark.points().iter().all(near) {
                page.wrong("drawn elsewhere", &what);
            }
        }
    }

    /// Folds, tabs and numbers at the edges of a facet.
    fn edges(&self, page: &mut Page<'_>, facet: &ReadFacet) {
        let n = facet.polygon.len();
        for (k, &edge) in self.design.facets[facet.facet as usize].edges.iter().enumerate() {
            let ends = [facet.polygon[k], facet.polygon[(k + 1) % n]].map(|p| page.at(p));
            let [Some(first), Some(second)] = self.design.edges[edge as usize].sides else { continue };
            let (angle, visible) = self.angle(edge);
            if self.sides.joined[edge as usize] {
                if first.facet != facet.facet || !visible {
                    continue;
                }
                let what = format!("the fold between facets {} and {} of piece {}", first.facet, second.facet, facet.piece[0]);
                if let Some(mark) = page.one(&format!("edge {edge}"), &what) {
                    let (kind, layer) = (page.fold(angle), page.layer("score"));
                    page.line(mark, &ends, kind, layer, &what);
                }
                let other = &self.seen.facets[self.sides.place[&second.facet]];
                self.texts.angle(page, edge, angle.to_degrees(), [facet, other], ends);
                continue;
            }
            if self.tab.contains_key(&[edge, facet.facet]) {
                let what = format!("the fold of the tab at edge {edge} of piece {}", facet.piece[0]);
                if let Some(mark) = page.one(&format!("tab {edge} {}", facet.facet), &what) {
                    // A tab at a flat edge may be drawn either way.
                    let own = page.fold(angle);
                    let flat = !visible
                        && matches!(&mark.shape, Shape::Line { look, .. } if page.fold(-1.0).fits(look) || page.fold(1.0).fits(look));
                    let kind = if flat {
                        [page.fold(-1.0), page.fold(1.0)]
                            .into_iter()
                            .find(|k| matches!(&mark.shape, Shape::Line { look, .. } if k.fits(look)))
                            .unwrap_or(own)
                    } else {
                        own
                    };
                    let layer = page.layer("score");
                    page.line(mark, &ends, kind, layer, &what);
                }
            }
            if self.sheet.numbers {
                self.texts.number(page, edge, facet, self.numbers.get(&edge).copied());
            }
        }
    }
}
