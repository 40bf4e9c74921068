//! The plots of a study: error against CPU time with the Pareto frontier, and error against facets by their placement.

use super::axes::{GREY, INK, Look, Panel, Shape, TEXT, count, mark, percent, seconds};
use super::folder::MARK;
use super::points::{Point, competing};
use crate::common::figure::{Anchor, Stroke, Svg, stroke};
use biscale::filter::LowRankFacts;
use biscale::study::{Asked, Family, Placement, Precision, Series, Truth, Work};

const PANEL: [f64; 2] = [470.0, 400.0];
const LEFT: f64 = 66.0;
const TOP: f64 = 76.0;
const BETWEEN: f64 = 88.0;
const FOOT: f64 = 56.0;
/// Where the legend begins, under the panels.
const LEGEND_TOP: f64 = TOP + PANEL[1] + FOOT;
const LEGEND_ROW: f64 = 20.0;
const LEGEND_COLUMN: f64 = 215.0;
const FRONTIER: &str = "#222222";

/// Marks of a family. Colours can be told apart with any kind of sight, and the shapes without colours.
fn look(family: Family) -> Look {
    let (colour, shape) = match family {
        Family::Auto => ("#000000", Shape::Star),
        Family::DirectTolerance => ("#0072b2", Shape::Circle),
        Family::DirectFacets => ("#56b4e9", Shape::Square),
        Family::DirectWeighted => ("#009e73", Shape::Diamond),
        Family::DirectClusters => ("#7a7a7a", Shape::Cross),
        Family::LowRankPaper => ("#d55e00", Shape::Up),
        Family::LowRankImproved => ("#cc79a7", Shape::Down),
        Family::SphericalGaussianPaper => ("#8a6d00", Shape::Up),
        Family::SphericalGaussianImproved => ("#8a6d00", Shape::Cross),
        Family::Reference => ("#e6a700", Shape::Circle),
        Family::Interreflections | Family::Points => (GREY, Shape::Square),
    };
    Look { colour, shape }
}

/// Title of a question's panel.
fn title(asked: Asked, table_directions: u64) -> String {
    match asked {
        Asked::List => "a list of pairs".to_owned(),
        Asked::Table => format!("all pairs of {table_directions} directions"),
    }
}

/// Error against CPU time, a panel a question.
pub fn pareto(name: &str, table_directions: u64, points: &[Point], truths: &[(Asked, Truth)]) -> Svg {
    let families: Vec<Family> =
        Family::ALL.into_iter().filter(|f| f.competes() && points.iter().any(|p| p.is_done() && p.work.family() == *f)).collect();
    let columns = if truths.len() > 1 { 4 } else { 2 };
    // Two more entries: the frontier and the bound.
    let rows = (families.len() + 2).div_ceil(columns);
    let width = LEFT + truths.len() as f64 * (PANEL[0] + BETWEEN) - BETWEEN + 24.0;
    let mut svg = Svg::made_by(MARK, width, LEGEND_TOP + rows as f64 * LEGEND_ROW + 22.0);
    svg.text([LEFT, 28.0], 17.0, Anchor::Start, INK, &format!("{name}: error against CPU time"));
    for (k, (asked, truth)) in truths.iter().enumerate() {
        let (shown, best) = competing(points, *asked);
        let places: Vec<[f64; 2]> = shown.iter().map(|p| [p.cpu_s, p.shown_error()]).collect();
        let panel = Panel::new([LEFT + k as f64 * (PANEL[0] + BETWEEN), TOP], PANEL, &places);
        let labels = ["CPU time of all threads", "relative RMS error"];
        panel.frame(&mut svg, &title(*asked, table_directions), labels, [seconds, percent]);
        panel.level(&mut svg, truth.relative_rms(), "standard error of the reference");
        let frontier: Vec<[f64; 2]> = best.iter().map(|&k| places[k]).collect();
        panel.curve(&mut svg, &frontier, Stroke { colour: FRONTIER, width: 1.3, dashes: "6 4" });
        for (point, &place) in shown.iter().zip(&places) {
            if let Some(at) = panel.place(place) {
                mark(&mut svg, at, look(point.work.family()), !point.is_resolved());
            }
        }
    }
    for (k, family) in families.iter().enumerate() {
        let [x, y] = legend_place(k, columns);
        mark(&mut svg, [x, y - 4.0], look(*family), false);
        svg.text([x + 14.0, y], TEXT, Anchor::Start, INK, family.name());
    }
    let [x, y] = legend_place(families.len(), columns);
    svg.line([x - 8.0, y - 4.0], [x + 10.0, y - 4.0], Stroke { colour: FRONTIER, width: 1.3, dashes: "6 4" });
    svg.text([x + 14.0, y], TEXT, Anchor::Start, INK, "Pareto frontier");
    let [x, y] = legend_place(families.len() + 1, columns);
    mark(&mut svg, [x, y - 4.0], Look { colour: GREY, shape: Shape::Circle }, true);
    svg.text([x + 14.0, y], TEXT, Anchor::Start, INK, "hollow: at most");
    svg
}

fn legend_place(k: usize, columns: usize) -> [f64; 2] {
    [LEFT + 10.0 + (k % columns) as f64 * LEGEND_COLUMN, LEGEND_TOP + (k / columns) as f64 * LEGEND_ROW + 14.0]
}

/// Power that the cuts of the low-rank method lose against the ranks that are left, a curve a matrix; `None` without such runs.
pub fn ranks(name: &str, ladder: &[Series], points: &[Point]) -> Option<Svg> {
    const CURVES: [(&str, Family, bool, Look); 4] = [
        ("N, paper", Family::LowRankPaper, true, Look { colour: "#d55e00", shape: Shape::Up }),
        ("M, paper", Family::LowRankPaper, false, Look { colour: "#e6a700", shape: Shape::Square }),
        ("N, improved", Family::LowRankImproved, true, Look { colour: "#0072b2", shape: Shape::Down }),
        ("M, improved", Family::LowRankImproved, false, Look { colour: "#56b4e9", shape: Shape::Circle }),
    ];
    let energies: Vec<&Series> = ladder.iter().filter(|s| s.asked == Asked::Table && s.title.contains("energy")).collect();
    let of_energies = |p: &&Point| energies.iter().any(|s| s.steps.iter().any(|(_, work)| *work == p.work)) && p.asked == Asked::Table;
    // Of the power this is left out: less is rounding.
    const LEAST: f64 = 1e-6;
    // A curve a surface.
    let curves = |family: Family, of_n: bool| -> Vec<Vec<[f64; 2]>> {
        let of: Vec<&Point> = points.iter().filter(of_energies).filter(|p| p.work.family() == family).collect();
        let surfaces = of.iter().map(|p| p.low_rank.len()).max().unwrap_or_default();
        let place = |f: &LowRankFacts| {
            let (rank, kept) = if of_n { (f.n_rank, f.n_energy) } else { (f.m_rank, f.m_energy) };
            [rank as f64, (1.0 - kept).max(LEAST)]
        };
        (0..surfaces).map(|s| of.iter().filter_map(|p| p.low_rank.get(s)).map(place).collect()).collect()
    };
    let curves = CURVES.map(|(label, family, of_n, look)| (label, look, curves(family, of_n)));
    let all: Vec<[f64; 2]> = curves.iter().flat_map(|c| c.2.iter().flatten()).copied().collect();
    if all.iter().filter(|p| p[0] > 0.0 && p[1] > 0.0).count() < 2 {
        return None;
    }
    let axes = ["vectors kept", "power that is cut, at least 0.0001 %"];
    let OnePanel { mut svg, panel } =
        OnePanel::new(&all, &format!("{name}: power lost against rank"), "all pairs, a curve a surface", axes);
    for (k, (label, look, curves)) in curves.iter().enumerate() {
        for curve in curves {
            let mut curve = curve.clone();
            curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
            panel.curve(&mut svg, &curve, stroke(look.colour, 1.4));
            for at in curve.iter().filter_map(|&p| panel.place(p)) {
                mark(&mut svg, at, *look, false);
            }
        }
        legend_entry(&mut svg, 118.0 * k as f64, *look, label);
    }
    Some(svg)
}

/// A chart of one panel, with a row of a legend under it.
struct OnePanel {
    svg: Svg,
    panel: Panel,
}

impl OnePanel {
    /// Of counts along x and shares along y, wide enough for `points`; `axes` names x and y.
    fn new(points: &[[f64; 2]], title: &str, heading: &str, axes: [&str; 2]) -> Self {
        let mut svg = Svg::made_by(MARK, LEFT + PANEL[0] + 24.0, LEGEND_TOP + LEGEND_ROW + 22.0);
        svg.text([LEFT, 28.0], 17.0, Anchor::Start, INK, title);
        let panel = Panel::new([LEFT, TOP], PANEL, points);
        panel.frame(&mut svg, heading, axes, [count, percent]);
        Self { svg, panel }
    }
}

/// An entry of the legend of one row, `right` of its left end.
fn legend_entry(svg: &mut Svg, right: f64, look: Look, label: &str) {
    let (x, y) = (LEFT + 10.0 + right, LEGEND_TOP + 14.0);
    mark(svg, [x, y - 4.0], look, false);
    svg.text([x + 14.0, y], TEXT, Anchor::Start, INK, label);
}

/// Error against facets, a curve a placement; `None` without such runs.
pub fn placement(name: &str, points: &[Point]) -> Option<Svg> {
    const CURVES: [(Placement, Look); 3] = [
        (Placement::Random, Look { colour: "#d55e00", shape: Shape::Up }),
        (Placement::Stratified, Look { colour: "#0072b2", shape: Shape::Square }),
        (Placement::LowDiscrepancy, Look { colour: "#009e73", shape: Shape::Circle }),
    ];
    let curve = |wanted: Placement| -> Vec<(&Point, [f64; 2])> {
        let of = |p: &'_ Point| match p.work {
            Work::Points { placement, precision: Precision::F64, facets } if placement == wanted && p.is_done() => Some(f64::from(facets)),
            _ => None,
        };
        points.iter().filter_map(|p| Some((p, [of(p)?, p.shown_error()]))).collect()
    };
    let curves = CURVES.map(|(placement, look)| (placement, look, curve(placement)));
    let all: Vec<[f64; 2]> = curves.iter().flat_map(|c| c.2.iter().map(|p| p.1)).collect();
    if all.is_empty() {
        return None;
    }
    let heading = "the same sums, facets placed in three ways";
    let OnePanel { mut svg, panel } =
        OnePanel::new(&all, &format!("{name}: error against facets"), heading, ["facets", "relative RMS error"]);
    for (k, (placement, look, points)) in curves.iter().enumerate() {
        let places: Vec<[f64; 2]> = points.iter().map(|p| p.1).collect();
        panel.curve(&mut svg, &places, stroke(look.colour, 1.4));
        for (point, place) in points {
            if let Some(at) = panel.place(*place) {
                mark(&mut svg, at, *look, !point.is_resolved());
            }
        }
        legend_entry(&mut svg, 150.0 * k as f64, *look, placement.name());
    }
    Some(svg)
}
