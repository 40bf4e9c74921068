//! The texts of a piece: its name, the numbers of its glued edges, the angles of its folds.

use super::drawn::Shape;
use super::page::{Kind, Page};
use super::read_pattern::{ReadFacet, ReadPattern};
use super::sides::Sides;
use crate::mesh::Mesh;
use crate::polygon::{contains, distance_to_segment};
use crate::sheet_recipe::SheetRecipe;
use glam::DVec2;
use std::collections::BTreeSet;

/// How far a text along an edge may be from it beyond half of its size, mm.
const BESIDE: f64 = 0.8;
/// How long a line that leads to a text may be, mm.
const LONGEST: f64 = 40.0;

/// What texts of a page are compared with.
pub(super) struct Texts<'a> {
    pub(super) seen: &'a ReadPattern,
    pub(super) design: &'a Mesh,
    pub(super) sides: &'a Sides,
    pub(super) sheet: &'a SheetRecipe,
    pub(super) without_name: BTreeSet<[u32; 2]>,
    pub(super) without_number: BTreeSet<[u32; 2]>,
    pub(super) without_angle: BTreeSet<u32>,
    /// Whether folds carry their angles.
    pub(super) angles: bool,
}

impl Texts<'_> {
    /// The name of a piece: `3`, `3 (x4)`, `3 (like 1, x2)`, `piece 3`.
    pub(super) fn name(&self, page: &mut Page<'_>, piece: [u32; 2], facets: &[&ReadFacet]) {
        let what = format!("the name of piece {}", piece[0]);
        let claim = format!("name {} {}", piece[0], piece[1]);
        let mark = if self.without_name.contains(&piece) { page.maybe(&claim, &what) } else { page.one(&claim, &what) };
        let Some(mark) = mark else { return };
        let Some((words, at, size)) = page.text(mark, &what) else { return };
        let plain = words.strip_prefix("piece ").unwrap_or(words);
        let (number, rest) = plain.split_once(' ').unwrap_or((plain, ""));
        let copies = self.seen.facets.iter().filter(|f| f.piece[0] == piece[0]).map(|f| f.piece[1]).collect::<BTreeSet<_>>().len();
        let fine = rest.is_empty() || (copies > 1 && rest == format!("(x{copies})")) || (copies == 1 && self.alike(rest, piece[0]));
        if number != piece[0].to_string() || !fine {
            page.wrong("says something else", format!("{what}: \"{words}\""));
        }
        let inside = facets.iter().any(|f| contains(&f.polygon.iter().map(|&p| page.at(p)).collect::<Vec<_>>(), at));
        let mut borders: Vec<[DVec2; 2]> = facets.iter().flat_map(|f| sides_of(page, &f.polygon)).collect();
        let own = |facet: u32| facets.iter().any(|f| f.facet == facet);
        borders.extend(self.seen.tabs.iter().filter(|t| own(t.facet)).flat_map(|t| sides_of(page, &t.polygon)));
        self.led(page, &claim, &what, inside, &borders, at, size, words);
    }

    /// `(like 3, x4)`: an earlier piece, or itself, and at least two.
    fn alike(&self, rest: &str, piece: u32) -> bool {
        let numbers = rest.strip_prefix("(like ").and_then(|r| r.strip_suffix(')')).and_then(|r| r.split_once(", x"));
        let Some((Ok(like), Ok(count))) = numbers.map(|(a, b)| (a.parse::<u32>(), b.parse::<usize>())) else { return false };
        let facets = |name: u32| self.seen.facets.iter().filter(|f| f.piece[0] == name).count();
        let pieces = self.seen.facets.iter().filter(|f| f.piece[1] == 1).map(|f| f.piece[0]).collect::<BTreeSet<_>>();
        like <= piece && facets(like) == facets(piece) && (2..=pieces.len()).contains(&count)
    }

    /// A text is where it should be, or a line leads to it from there.
    #[allow(clippy::too_many_arguments, reason = "one place where all texts are compared")]
    fn led(&self, page: &mut Page<'_>, claim: &str, what: &str, there: bool, from: &[[DVec2; 2]], at: DVec2, size: f64, words: &str) {
        let leader = page.maybe(&format!("{claim} leader"), what);
        page.all(&format!("{claim} bed"));
        let Some(leader) = leader else {
            if !there {
                page.wrong("not beside what it tells of", what);
            }
            return;
        };
        let points = leader.points();
        page.line(leader, &points.clone(), Kind::Thin, "print", what);
        let [a, b] = points[..] else { return };
        let reach = 0.5 * size * (1.0 + words.chars().count() as f64);
        let near = |p: DVec2| from.iter().any(|&[c, d]| distance_to_segment(p, c, d) < 0.05);
        if !near(a) || b.distance(at) > reach || a.distance(b) > LONGEST {
            page.wrong("not beside what it tells of", what);
        }
    }

    /// The number of a glued edge on the side of a facet.
    pub(super) fn number(&self, page: &mut Page<'_>, edge: u32, facet: &ReadFacet, number: Option<&str>) {
        let what = format!("the number of edge {edge} on facet {} of piece {}", facet.facet, facet.piece[0]);
        let claim = format!("number-of {edge} {}", facet.facet);
        let excused = self.without_number.contains(&[edge, facet.facet]);
        let mark = if excused { page.maybe(&claim, &what) } else { page.one(&claim, &what) };
        let Some(mark) = mark else { return };
        let Some((words, at, size)) = page.text(mark, &what) else { return };
        let mate = self.design.other(edge, facet.facet).and_then(|s| self.sides.place.get(&s.facet)).map(|&k| self.seen.facets[k].piece);
        let wanted = match (mate, number) {
            (Some(mate), Some(number)) if mate != facet.piece => format!("{}:{number}", mate[0]),
            (_, number) => number.unwrap_or_default().to_owned(),
        };
        if words != wanted {
            page.wrong("says something else", format!("{what}: \"{words}\" and not \"{wanted}\""));
        }
        let tab = self.seen.tabs.iter().find(|t| t.edge == edge && t.facet == facet.facet);
        let region: Vec<DVec2> = tab.map_or(&facet.polygon, |t| &t.polygon).iter().map(|&p| page.at(p)).collect();
        let k = self.design.facets[facet.facet as usize].edges.iter().position(|&e| e == edge).unwrap_or(0);
        let ends = [facet.polygon[k], facet.polygon[(k + 1) % facet.polygon.len()]].map(|p| page.at(p));
        let there = contains(&region, at) && distance_to_segment(at, ends[0], ends[1]) < 0.5 * size + BESIDE;
        let from: Vec<[DVec2; 2]> = if tab.is_some() { polygon_sides(&region) } else { vec![ends] };
        self.led(page, &claim, &what, there, &from, at, size, words);
    }

    /// The angle of a fold.
    pub(super) fn angle(&self, page: &mut Page<'_>, edge: u32, angle_deg: f64, facets: [&ReadFacet; 2], ends: [DVec2; 2]) {
        let what = format!("the angle of the fold at edge {edge}");
        let claim = format!("angle-of {edge}");
        let mark = if !self.angles || self.without_angle.contains(&edge) { page.maybe(&claim, &what) } else { page.one(&claim, &what) };
        let Some(mark) = mark else { return };
        let Some((words, at, size)) = page.text(mark, &what) else { return };
        let told = words.strip_suffix('°').and_then(|w| w.parse::<f64>().ok());
        if told.is_none_or(|told| (told - angle_deg.abs()).abs() > 0.5 + 1e-6) {
            page.wrong("says something else", format!("{what}: \"{words}\" and not {:.0}°", angle_deg.abs()));
        }
        let inside = facets.iter().any(|f| contains(&f.polygon.iter().map(|&p| page.at(p)).collect::<Vec<_>>(), at));
        let there = inside && distance_to_segment(at, ends[0], ends[1]) < 0.5 * size + BESIDE;
        self.led(page, &claim, &what, there, &[ends], at, size, words);
    }

    /// The number of a period on the facet that begins it.
    pub(super) fn row(&self, page: &mut Page<'_>, facet: &ReadFacet) {
        let what = format!("the period of facet {}", facet.facet);
        let claim = format!("row-of {}", facet.facet);
        page.all(&format!("{claim} bed"));
        let Some(mark) = page.maybe(&claim, &what) else { return };
        let Some((words, at, _)) = page.text(mark, &what) else { return };
        let corners = &self.design.facets[facet.facet as usize].corners;
        let middle = corners.iter().map(|&c| self.design.vertices[c as usize].x).sum::<f64>() / corners.len() as f64;
        let low = self.design.vertices.iter().map(|v| v.x).fold(f64::INFINITY, f64::min);
        let row = ((middle - low) / self.sheet.period_mm).floor() + 1.0;
        let inside = contains(&facet.polygon.iter().map(|&p| page.at(p)).collect::<Vec<_>>(), at);
        if words != format!("#{row}") || !inside {
            page.wrong("says something else", format!("{what}: \"{words}\" and not \"#{row}\""));
        }
    }

    /// Bounds of a piece's picture.
    pub(super) fn image(&self, page: &mut Page<'_>, piece: [u32; 2], facets: &[&ReadFacet]) {
        let what = format!("the colours of piece {}", piece[0]);
        let Some(mark) = page.one(&format!("image {} {}", piece[0], piece[1]), &what) else { return };
        page.in_layer(mark, "print", &what);
        let Shape::Image { corners, .. } = &mark.shape else {
            page.wrong("drawn as no picture", &what);
            return;
        };
        if facets.iter().flat_map(|f| &f.polygon).any(|&p| !contains(corners, page.at(p))) {
            page.wrong("drawn elsewhere", &what);
        }
    }
}

fn sides_of(page: &Page<'_>, polygon: &[DVec2]) -> Vec<[DVec2; 2]> {
    polygon_sides(&polygon.iter().map(|&p| page.at(p)).collect::<Vec<_>>())
}

fn polygon_sides(polygon: &[DVec2]) -> Vec<[DVec2; 2]> {
    (0..polygon.len()).map(|k| [polygon[k], polygon[(k + 1) % polygon.len()]]).collect()
}
