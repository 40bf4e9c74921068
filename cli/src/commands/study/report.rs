//! `report.html`: what a study says, in tables and plots. One file that needs no other.

use super::axes::{percent, seconds};
use super::folder::{Folder, MARK};
use super::pictures::StudyPicture;
use super::plan::StudyPlan;
use super::points::{Point, best_other, competing};
use super::record::{DONE, Record, TRUTH};
use super::report_parts::{cell, code, decibel, error, memory, or_dash, plot, ranks, rendered, table};
use crate::common;
use crate::common::figure::Svg;
use biscale::error::Result;
use biscale::study::{Asked, Family, Series, Truth, Work};
use maud::{Markup, html};

/// What a report is made of.
pub struct Study<'a> {
    pub plan: &'a StudyPlan,
    pub records: &'a [Record],
    pub truths: &'a [(Asked, Truth)],
    pub points: &'a [Point],
}

/// The plots and pictures of a report.
pub struct ReportPictures {
    /// Error against CPU time.
    pub pareto: Svg,
    /// Error against facets by their placement, and power lost against rank, where there is any.
    pub placement: Option<Svg>,
    pub ranks: Option<Svg>,
    /// Pictures in the material.
    pub rendered: Vec<StudyPicture>,
}

/// PSNR of the paper's five scenes: its Table 4.
const PAPER_PSNR: [(&str, f64); 5] = [("plate", 17.36), ("teapot", 19.27), ("pillow", 20.01), ("cup", 18.86), ("skirt", 22.66)];

/// Tables are wider than text.
const STYLE: &str = "p,ul{max-width:62em}body{max-width:90em}td,th{white-space:nowrap;font-variant-numeric:tabular-nums;vertical-align:top}\
td:last-child{white-space:normal}svg,img{max-width:100%;height:auto}";

impl Study<'_> {
    /// The report; comparisons of pictures are read from `folder`.
    ///
    /// # Errors
    /// I/o.
    pub fn html(&self, pictures: &ReportPictures, folder: &Folder) -> Result<String> {
        let title = format!("{}: error against time", self.plan.material.name);
        let rendered = rendered(&pictures.rendered, folder)?;
        let body = html! {
            h1 { (title) }
            (self.head())
            (plot(&pictures.pareto))
            p {
                "Each mark is a setting: the root of its mean squared error and the median of its CPU time over the seeds. A hollow mark is a \
                 bound: there the reference is not exact enough to tell the error from its own. The dashed line joins the settings that none \
                 beats in both."
            }
            @for (asked, _) in self.truths { (frontier(self.points, *asked)) }
            (self.kept())
            (against_best(self.points))
            h2 { "What each setting buys" }
            p { "One thing is changed at a time. " i { "Error" } " and " i { "CPU" } " are followed by their ratio to the line above." }
            @for series in &self.plan.ladder {
                @if series.steps.iter().any(|(_, work)| work.family().competes()) { (steps(series, self.points)) }
            }
            @if let Some(chart) = &pictures.placement { (self.placement(chart)) }
            (ranks(self.points, pictures.ranks.as_ref()))
            (self.interreflections())
            (self.psnr())
            (rendered)
            (not_done(self.points))
        };
        Ok(common::page::page(MARK, &title, STYLE, &body))
    }

    fn head(&self) -> Markup {
        let plan = self.plan;
        let threads = if plan.threads == 0 { std::thread::available_parallelism().map_or(0, usize::from) } else { plan.threads.into() };
        let seeds = if plan.seeds == 1 { format!("one seed, {}", plan.seed) } else { format!("{} seeds from {}", plan.seeds, plan.seed) };
        html! {
            p {
                "The same pairs of directions were asked of every method at every setting. " i { "Error" } " is the relative RMS error of the \
                 cosine-weighted effective BRDF over all pairs and channels, against " code { "reference" } " (fresh rays for every pair), whose own \
                 error is taken off in squares. " i { "CPU" } " is the time of all threads, " i { "wall" } " that of the clock, of one call in a fresh \
                 process with the material loaded; " i { "memory" } " is the largest resident size of that process. What is computed once a BRDF and \
                 kept (" code { "lowrank paper" } ") is stated apart. Medians and root mean squares over " (seeds) ". " code { "study.csv" } " has every run."
            }
            ul {
                li { "surface: " (plan.small.tile.triangles.len()) " triangles, " (plan.small.surfaces.len()) " surfaces" }
                @if plan.small.bounces > 0 { li { "light: " (plan.direct_light()) } }
                @for (asked, question) in &plan.asked {
                    li {
                        @match asked {
                            Asked::List => { "the list (" code { "pairs.csv" } ")" },
                            Asked::Table => { "the table: all pairs of " (plan.table[0]) " directions" },
                        }
                        ": " (question.pairs.len()) " pairs, " (question.judged) " of them judged"
                    }
                }
                @for (asked, truth) in self.truths {
                    li {
                        "reference of the " (asked.name()) ": standard error " (percent(truth.relative_rms()))
                        @if let Some(made) = self.records.iter().find(|r| r.question == asked.name() && r.setting == TRUTH) {
                            ", " (made.cpu_s.map_or("?".to_owned(), seconds)) " CPU; plan " code { (made.plan) }
                        }
                    }
                }
                li { "threads: " (threads) "; program: biscale " (env!("CARGO_PKG_VERSION")) }
            }
        }
    }

    /// Tolerances that were asked for, and what came of them.
    fn kept(&self) -> Markup {
        let asked: Vec<(&Point, f64)> = self.points.iter().filter(|p| p.is_done()).filter_map(|p| Some((p, tolerance(p)?))).collect();
        if asked.is_empty() {
            return html! {};
        }
        let row = |(p, tolerance): (&Point, f64)| {
            let ratio = format!("{}{:.2}", if p.is_resolved() { "" } else { "< " }, p.shown_error() / tolerance);
            let (asked, estimated) = (cell(percent(tolerance)), or_dash(p.estimated.map(percent)));
            [cell(p.asked.name()), code(&p.work), asked, estimated, cell(error(p)), cell(ratio)]
        };
        html! {
            h2 { "Tolerances" }
            (table(["question", "setting", "asked", "estimated", "error", "error / asked"], asked.into_iter().map(row)))
        }
    }

    /// What placement and precision buy at equal counts.
    fn placement(&self, chart: &Svg) -> Markup {
        let of = |p: &Point| -> Option<(u32, String)> {
            let Work::Points { placement, precision, facets } = p.work else { return None };
            Some((facets, format!("{}, {}", placement.name(), precision.name())))
        };
        let mut columns: Vec<String> = Vec::new();
        let mut rows: Vec<u32> = Vec::new();
        for (facets, column) in self.points.iter().filter_map(of) {
            if !columns.contains(&column) {
                columns.push(column);
            }
            if !rows.contains(&facets) {
                rows.push(facets);
            }
        }
        rows.sort_unstable();
        let found = |facets: u32, column: &String| {
            let found = self.points.iter().find(|p| of(p).is_some_and(|(n, c)| n == facets && c == *column));
            found.filter(|p| p.is_done()).map_or("-".to_owned(), |p| format!("{}; {}", error(p), seconds(p.cpu_s)))
        };
        let note = self.points.iter().find(|p| !p.message.is_empty() && of(p).is_some_and(|(_, c)| c.contains("f32")));
        html! {
            h2 { "Placement and precision at equal counts" }
            (plot(chart))
            p {
                "Error and CPU time of the same sums. These sums are not made to be fast: " code { "f32" } " and " code { "f64" }
                " may be compared with each other, and not with the methods above."
            }
            table {
                tr { th { "facets" } @for column in &columns { th { (column) } } }
                @for facets in rows { tr { td { (facets) } @for column in &columns { td { (found(facets, column)) } } } }
            }
            @if let Some(note) = note { p { "With " (note.facets) " facets the " (note.message) "." } }
        }
    }

    fn interreflections(&self) -> Markup {
        let with: Vec<&Point> = self.points.iter().filter(|p| p.is_done() && p.work.family() == Family::Interreflections).collect();
        if with.is_empty() {
            return html! {};
        }
        let row = |p: &Point| {
            [code(&p.work), cell(error(p)), cell(format!("{:+.2} %", 100.0 * p.bias)), decibel(p.psnr_db), cell(seconds(p.cpu_s))]
        };
        html! {
            h2 { "Interreflections" }
            p {
                "The truth of this study is direct light only. With reflections after the first the values are those of another model: this is how far \
                 apart the models are, not an error of either."
            }
            (table(["setting", "difference", "mean difference", "PSNR", "CPU"], with.into_iter().map(row)))
        }
    }

    /// PSNR in the cosine-weighted BRDF, after Table 4 of the paper.
    fn psnr(&self) -> Markup {
        let paper: Vec<String> = PAPER_PSNR.iter().map(|(scene, db)| format!("{scene} {db}")).collect();
        let mut shown: Vec<&Point> = self.points.iter().filter(|p| p.is_done() && p.work.family().competes()).collect();
        shown.sort_by(|a, b| (a.asked.name(), a.work.family()).cmp(&(b.asked.name(), b.work.family())).then(a.cpu_s.total_cmp(&b.cpu_s)));
        let row = |p: &Point| {
            let bias = cell(format!("{:+.2} %", 100.0 * p.bias));
            [cell(p.asked.name()), code(&p.work), decibel(p.psnr_db), cell(percent(p.p95)), bias, cell(seconds(p.cpu_s))]
        };
        html! {
            h2 { "PSNR in the cosine-weighted BRDF" }
            p {
                "After Table 4 of Wu et al. (2011), which gives, in dB: " (paper.join(", ")) ". The peak is the largest value of the reference; its noise is in \
                 the difference, and bounds what can be measured. " i { "p95" } " is the 95th percentile of the relative error over the values above 1 % of \
                 the peak, " i { "bias" } " the mean relative one."
            }
            (table(["question", "setting", "PSNR", "p95", "bias", "CPU"], shown.into_iter().map(row)))
        }
    }
}

/// The tolerance that a setting asks to be kept.
fn tolerance(point: &Point) -> Option<f64> {
    match point.work {
        Work::Effective { tolerance, plan: None, bounces: 0, .. } => Some(tolerance),
        _ => None,
    }
}

fn frontier(points: &[Point], asked: Asked) -> Markup {
    let (shown, best) = competing(points, asked);
    let row = |k: usize| {
        let p = shown[k];
        let times = [p.cpu_s, p.wall_s].map(|s| cell(seconds(s)));
        let [cpu, wall] = times;
        [cpu, wall, memory(p), cell(error(p)), or_dash(p.estimated.map(percent)), decibel(p.psnr_db), code(&p.work)]
    };
    html! {
        h2 { "Frontier of the " (asked.name()) }
        (table(["CPU", "wall", "memory", "error", "estimated", "PSNR", "setting"], best.into_iter().map(row)))
    }
}

/// What the program's own choice costs beside the best other one for the error that it reached.
fn against_best(points: &[Point]) -> Markup {
    let auto: Vec<&Point> = points.iter().filter(|p| p.is_done() && p.work.family() == Family::Auto).collect();
    if auto.is_empty() {
        return html! {};
    }
    let row = |p: &Point| {
        let best = p.is_resolved().then(|| best_other(points, p.asked, p.error)).flatten();
        let ratio = or_dash(best.map(|best| format!("{:.2}", p.cpu_s / best)));
        [cell(p.asked.name()), code(&p.work), cell(error(p)), cell(seconds(p.cpu_s)), or_dash(best.map(seconds)), ratio]
    };
    html! {
        h2 { code { "auto" } " beside the best other choice" }
        p {
            i { "Best" } " is the CPU time of the frontier of all other settings at the error that " code { "auto" } " reached, between two settings by a \
             power law; the best of many runs is a lucky one. A dash: no other setting is as exact, or the reference cannot tell."
        }
        (table(["question", "setting", "error", "CPU", "best", "CPU / best"], auto.into_iter().map(row)))
    }
}

fn steps(series: &Series, points: &[Point]) -> Markup {
    let found: Vec<(&String, &Point)> = series
        .steps
        .iter()
        .filter_map(|(label, work)| Some((label, points.iter().find(|p| p.asked == series.asked && p.work == *work)?)))
        .collect();
    if !found.iter().any(|(_, p)| p.is_done()) {
        return html! {};
    }
    let mut before: Option<&Point> = None;
    let rows: Vec<[Markup; 11]> = found
        .into_iter()
        .map(|(label, p)| {
            if !p.is_done() {
                let mut row = [(); 11].map(|()| cell(""));
                row[0] = cell(label);
                row[1] = cell(&p.status);
                row[10] = cell(&p.message);
                return row;
            }
            let ratio = |of: fn(&Point) -> f64| cell(before.map_or(String::new(), |b| format!("x {:.2}", of(p) / of(b))));
            let error_ratio = if p.is_resolved() { ratio(Point::shown_error) } else { cell("") };
            let cpu_ratio = ratio(|p| p.cpu_s);
            before = Some(p);
            let [cpu, wall] = [p.cpu_s, p.wall_s].map(|s| cell(seconds(s)));
            let [facets, clusters, directions] = [p.facets, p.clusters, p.directions].map(cell);
            let estimated = or_dash(p.estimated.map(percent));
            [cell(label), cell(error(p)), error_ratio, estimated, cpu, cpu_ratio, wall, memory(p), facets, clusters, directions]
        })
        .collect();
    let headings = [series.varied, "error", "", "estimated", "CPU", "", "wall", "memory", "facets", "clusters", "directions"];
    html! {
        h3 { (series.title) ", " (series.asked.name()) }
        p { (series.about) "." }
        (table(headings, rows))
    }
}

/// Settings that have no answer, and why.
fn not_done(points: &[Point]) -> Markup {
    let failed: Vec<&Point> = points.iter().filter(|p| p.status != DONE).collect();
    if failed.is_empty() {
        return html! {};
    }
    let row = |p: &Point| [cell(p.asked.name()), code(&p.work), cell(&p.status), cell(&p.message)];
    html! {
        h2 { "Not done" }
        (table(["question", "setting", "how it ended", "what it said"], failed.into_iter().map(row)))
    }
}
