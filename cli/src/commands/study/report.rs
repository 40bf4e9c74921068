//! `report.md`: what a study says, in tables.

use super::axes::{percent, seconds, significant};
use super::pictures::StudyPicture;
use super::plan::StudyPlan;
use super::points::{Point, best_other, competing};
use super::record::{DONE, Record, TRUTH};
use biscale::numerics::cast::truncate_usize;
use biscale::study::{Asked, Family, Series, Truth};
use std::fmt::Write as _;

/// What a report is made of.
pub struct Study<'a> {
    pub plan: &'a StudyPlan,
    pub records: &'a [Record],
    pub truths: &'a [(Asked, Truth)],
}

/// Which pictures there are.
#[derive(Clone, Debug, Default)]
pub struct ReportPictures {
    pub placement: bool,
    pub ranks: bool,
    pub rendered: Vec<StudyPicture>,
}

/// PSNR of the paper's five scenes: its Table 4.
const PAPER_PSNR: [(&str, f64); 5] = [("plate", 17.36), ("teapot", 19.27), ("pillow", 20.01), ("cup", 18.86), ("skirt", 22.66)];

impl Study<'_> {
    /// The report.
    pub fn markdown(&self, points: &[Point], pictures: &ReportPictures) -> String {
        let mut out = String::new();
        self.head(&mut out);
        let _ = writeln!(out, "\n![error against CPU time](pareto.png)\n");
        let _ = writeln!(
            out,
            "Each mark is a setting: the root of its mean squared error and the median of its CPU time over the seeds. A hollow mark is a \
             bound: there the reference is not exact enough to tell the error from its own. The dashed line joins the settings that none \
             beats in both."
        );
        for (asked, _) in self.truths {
            frontier(&mut out, points, *asked);
        }
        self.kept(&mut out, points);
        against_best(&mut out, points);
        let _ = writeln!(
            out,
            "\n## What each setting buys\n\nOne thing is changed at a time. *Error* and *CPU* are followed by their ratio to the line above."
        );
        for series in self.plan.ladder.iter().filter(|s| s.steps.iter().any(|(_, work)| work.family().competes())) {
            steps(&mut out, series, points);
        }
        if pictures.placement {
            self.placement(&mut out, points);
        }
        ranks(&mut out, points, pictures.ranks);
        self.interreflections(&mut out, points);
        self.psnr(&mut out, points);
        rendered(&mut out, &pictures.rendered);
        not_done(&mut out, points);
        out
    }

    fn head(&self, out: &mut String) {
        let plan = self.plan;
        let _ = writeln!(out, "# {}: error against time\n", escape(&plan.material.name));
        let _ = writeln!(
            out,
            "The same pairs of directions were asked of every method at every setting. *Error* is the relative RMS error of the \
             cosine-weighted effective BRDF over all pairs and channels, against `reference` (fresh rays for every pair), whose own error is \
             taken off in squares. *CPU* is the time of all threads, *wall* that of the clock, of one call in a fresh process with the \
             material loaded; *memory* is the largest resident size of that process. What is computed once a BRDF and kept (`lowrank paper`) is \
             stated apart. Medians and root mean squares over {}. `study.csv` has every run.\n",
            if plan.seeds == 1 { format!("one seed, {}", plan.seed) } else { format!("{} seeds from {}", plan.seeds, plan.seed) }
        );
        let threads = if plan.threads == 0 { std::thread::available_parallelism().map_or(0, usize::from) } else { plan.threads.into() };
        let _ = writeln!(out, "- surface: {} triangles, {} surfaces", plan.small.tile.triangles.len(), plan.small.surfaces.len());
        for (asked, question) in &plan.asked {
            let what = match asked {
                Asked::List => "the list (`pairs.csv`)".to_owned(),
                Asked::Table => format!("the table: all pairs of {} directions", plan.table[0]),
            };
            let _ = writeln!(out, "- {what}: {} pairs, {} of them judged", question.pairs.len(), question.judged);
        }
        for (asked, truth) in self.truths {
            let made = self.records.iter().find(|r| r.question == asked.name() && r.setting == TRUTH);
            let how = made.map_or(String::new(), |r| format!(", {} CPU; plan `{}`", r.cpu_s.map_or("?".to_owned(), seconds), r.plan));
            let _ = writeln!(out, "- reference of the {}: standard error {}{how}", asked.name(), percent(truth.relative_rms()));
        }
        let _ = writeln!(out, "- threads: {threads}; program: biscale {}", env!("CARGO_PKG_VERSION"));
    }

    /// Tolerances that were asked for, and what came of them.
    fn kept(&self, out: &mut String, points: &[Point]) {
        let asked: Vec<(&Point, f64)> = points.iter().filter(|p| p.is_done()).filter_map(|p| Some((p, tolerance(p)?))).collect();
        if asked.is_empty() {
            return;
        }
        let _ = writeln!(
            out,
            "\n## Tolerances\n\n| question | setting | asked | estimated | error | error / asked |\n|---|---|---|---|---|---|"
        );
        for (p, tolerance) in asked {
            let estimated = p.estimated.map_or("-".to_owned(), percent);
            let ratio = format!("{}{:.2}", if p.is_resolved() { "" } else { "< " }, p.shown_error() / tolerance);
            let _ = writeln!(out, "| {} | `{}` | {} | {estimated} | {} | {ratio} |", p.asked.name(), p.work, percent(tolerance), error(p));
        }
    }

    /// What placement and precision buy at equal counts.
    fn placement(&self, out: &mut String, points: &[Point]) {
        let _ = writeln!(
            out,
            "\n## Placement and precision at equal counts\n\n![error against facets](placement.png)\n\nError and CPU time of the same sums. \
             These sums are not made to be fast: `f32` and `f64` may be compared with each other, and not with the methods above.\n"
        );
        let of = |p: &Point| -> Option<(u32, String)> {
            let biscale::study::Work::Points { placement, precision, facets } = p.work else { return None };
            Some((facets, format!("{}, {}", placement.name(), precision.name())))
        };
        let mut columns: Vec<String> = Vec::new();
        let mut rows: Vec<u32> = Vec::new();
        for (facets, column) in points.iter().filter_map(of) {
            if !columns.contains(&column) {
                columns.push(column);
            }
            if !rows.contains(&facets) {
                rows.push(facets);
            }
        }
        rows.sort_unstable();
        let _ = writeln!(out, "| facets | {} |\n|---|{}", columns.join(" | "), "---|".repeat(columns.len()));
        for facets in rows {
            let cell = |column: &String| {
                let found = points.iter().find(|p| of(p).is_some_and(|(n, c)| n == facets && c == *column));
                found.filter(|p| p.is_done()).map_or("-".to_owned(), |p| format!("{}; {}", error(p), seconds(p.cpu_s)))
            };
            let cells: Vec<String> = columns.iter().map(cell).collect();
            let _ = writeln!(out, "| {facets} | {} |", cells.join(" | "));
        }
        if let Some(note) = points.iter().find(|p| !p.message.is_empty() && of(p).is_some_and(|(_, c)| c.contains("f32"))) {
            let _ = writeln!(out, "\nWith {} facets the {}.", note.facets, note.message);
        }
    }

    fn interreflections(&self, out: &mut String, points: &[Point]) {
        let with: Vec<&Point> = points.iter().filter(|p| p.is_done() && p.work.family() == Family::Interreflections).collect();
        if with.is_empty() {
            return;
        }
        let _ = writeln!(
            out,
            "\n## Interreflections\n\nThe truth of this study is direct light only. With reflections after the first the values are those of \
             another model: this is how far apart the models are, not an error of either.\n\n| setting | difference | mean difference | PSNR | CPU |\n|---|---|---|---|---|"
        );
        for p in with {
            let psnr = p.psnr_db.map_or("-".to_owned(), |db| format!("{db:.1} dB"));
            let _ = writeln!(out, "| `{}` | {} | {:+.2} % | {psnr} | {} |", p.work, error(p), 100.0 * p.bias, seconds(p.cpu_s));
        }
    }

    /// PSNR in the cosine-weighted BRDF, after Table 4 of the paper.
    fn psnr(&self, out: &mut String, points: &[Point]) {
        let paper: Vec<String> = PAPER_PSNR.iter().map(|(scene, db)| format!("{scene} {db}")).collect();
        let _ = writeln!(
            out,
            "\n## PSNR in the cosine-weighted BRDF\n\nAfter Table 4 of Wu et al. (2011), which gives, in dB: {}. The peak is the largest value of \
             the reference; its noise is in the difference, and bounds what can be measured. *p95* is the 95th percentile of the relative \
             error over the values above 1 % of the peak, *bias* the mean relative one.\n\n| question | setting | PSNR | p95 | bias | CPU |\n|---|---|---|---|---|---|",
            paper.join(", ")
        );
        let mut shown: Vec<&Point> = points.iter().filter(|p| p.is_done() && p.work.family().competes()).collect();
        shown.sort_by(|a, b| (a.asked.name(), a.work.family()).cmp(&(b.asked.name(), b.work.family())).then(a.cpu_s.total_cmp(&b.cpu_s)));
        for p in shown {
            let db = p.psnr_db.map_or("-".to_owned(), |db| format!("{db:.1} dB"));
            let cost = seconds(p.cpu_s);
            let _ = writeln!(out, "| {} | `{}` | {db} | {} | {:+.2} % | {cost} |", p.asked.name(), p.work, percent(p.p95), 100.0 * p.bias);
        }
    }
}

/// The tolerance that a setting asks to be kept.
fn tolerance(point: &Point) -> Option<f64> {
    match point.work {
        biscale::study::Work::Effective { tolerance, plan: None, bounces: 0, .. } => Some(tolerance),
        _ => None,
    }
}

/// The error, or its bound.
fn error(point: &Point) -> String {
    if point.is_resolved() { percent(point.error) } else { format!("< {}", percent(point.at_most)) }
}

fn frontier(out: &mut String, points: &[Point], asked: Asked) {
    let (shown, best) = competing(points, asked);
    let _ = writeln!(
        out,
        "\n## Frontier of the {}\n\n| CPU | wall | memory | error | estimated | PSNR | setting |\n|---|---|---|---|---|---|---|",
        asked.name()
    );
    for k in best {
        let p = shown[k];
        let memory = p.peak_mib.map_or("-".to_owned(), |mib| format!("{mib:.0} MiB"));
        let estimated = p.estimated.map_or("-".to_owned(), percent);
        let psnr = p.psnr_db.map_or("-".to_owned(), |db| format!("{db:.1} dB"));
        let _ = writeln!(
            out,
            "| {} | {} | {memory} | {} | {estimated} | {psnr} | `{}` |",
            seconds(p.cpu_s),
            seconds(p.wall_s),
            error(p),
            p.work
        );
    }
}

/// What the program's own choice costs beside the best other one for the error that it reached.
fn against_best(out: &mut String, points: &[Point]) {
    let auto: Vec<&Point> = points.iter().filter(|p| p.is_done() && p.work.family() == Family::Auto).collect();
    if auto.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "\n## `auto` beside the best other choice\n\n*Best* is the CPU time of the frontier of all other settings at the error that `auto` reached, \
         between two settings by a power law; the best of many runs is a lucky one. `-`: no other setting is as exact, or the reference cannot tell.\n\n\
         | question | setting | error | CPU | best | CPU / best |\n|---|---|---|---|---|---|"
    );
    for p in auto {
        let best = p.is_resolved().then(|| best_other(points, p.asked, p.error)).flatten();
        let ratio = best.map_or("-".to_owned(), |best| format!("{:.2}", p.cpu_s / best));
        let best = best.map_or("-".to_owned(), seconds);
        let _ = writeln!(out, "| {} | `{}` | {} | {} | {best} | {ratio} |", p.asked.name(), p.work, error(p), seconds(p.cpu_s));
    }
}

fn steps(out: &mut String, series: &Series, points: &[Point]) {
    let done = |work: &biscale::study::Work| points.iter().any(|p| p.asked == series.asked && p.work == *work && p.is_done());
    if !series.steps.iter().any(|(_, work)| done(work)) {
        return;
    }
    let _ = writeln!(out, "\n### {}, {}\n\n{}.\n", escape(&series.title), series.asked.name(), series.about);
    let _ = writeln!(
        out,
        "| {} | error | | estimated | CPU | | wall | memory | facets | clusters | directions |\n|---|---|---|---|---|---|---|---|---|---|---|",
        series.varied
    );
    let mut before: Option<&Point> = None;
    for (label, work) in &series.steps {
        let Some(p) = points.iter().find(|p| p.asked == series.asked && p.work == *work) else { continue };
        if !p.is_done() {
            let _ = writeln!(out, "| {label} | {}: {} | | | | | | | | | |", p.status, escape(&p.message));
            continue;
        }
        let ratio = |of: fn(&Point) -> f64| before.map_or(String::new(), |b| format!("x {:.2}", of(p) / of(b)));
        let error_ratio = if p.is_resolved() { ratio(|p| p.shown_error()) } else { String::new() };
        let memory = p.peak_mib.map_or("-".to_owned(), |mib| format!("{mib:.0} MiB"));
        let _ = writeln!(
            out,
            "| {label} | {} | {error_ratio} | {} | {} | {} | {} | {memory} | {} | {} | {} |",
            error(p),
            p.estimated.map_or("-".to_owned(), percent),
            seconds(p.cpu_s),
            ratio(|p| p.cpu_s),
            seconds(p.wall_s),
            p.facets,
            p.clusters,
            p.directions
        );
        before = Some(p);
    }
}

/// Sizes, ranks and energies of the low-rank method's matrices, after Table 3 and Fig. 11 of the paper.
fn ranks(out: &mut String, points: &[Point], chart: bool) {
    let all: Vec<&Point> = points.iter().filter(|p| !p.low_rank.is_empty()).collect();
    // The matrices of the largest question; where only facets differ they have the same sizes.
    let Some(asked) = all.iter().map(|p| p.asked).max() else { return };
    let mut with: Vec<&Point> = Vec::new();
    let sizes = |p: &Point| -> Vec<_> { p.low_rank.iter().map(|f| (f.n_rank, f.m_size, f.m_rank)).collect() };
    for p in all.into_iter().filter(|p| p.asked == asked) {
        if !with.iter().any(|shown| sizes(shown) == sizes(p)) {
            with.push(p);
        }
    }
    let _ = writeln!(
        out,
        "\n## Ranks and the energy kept\n\nAfter Table 3 and Fig. 11 of Wu et al. (2011). `N` is the bidirectional visible normal distribution, `M` the turned \
         BRDFs of one surface; *kept* is the share of the power of the centred matrix. In `paper` the rows are pairs of map cells and `M` is computed \
         once a BRDF (*precomputation*, CPU, not in the other costs); in `improved` they are the wanted pairs, three rows of `M` each. Of settings with the same ranks the first is \
         shown.\n"
    );
    if chart {
        let _ = writeln!(out, "![power lost against rank](ranks.png)\n");
    }
    let _ = writeln!(
        out,
        "| question | setting | surface | N | rank | kept | M | whole M | compressed | rate | rank | kept | precomputation | error |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    let size = |[rows, columns]: [usize; 2]| format!("{rows} x {columns}");
    let megabytes = |bytes: f64| format!("{} MB", significant(bytes / 1e6));
    for p in with {
        for (k, f) in p.low_rank.iter().enumerate() {
            let whole = 8.0 * f.m_size[0] as f64 * f.m_size[1] as f64;
            let once = if k == 0 { p.precomputed_s.map_or(String::new(), seconds) } else { String::new() };
            let _ = writeln!(
                out,
                "| {} | `{}` | {} | {} | {} | {} | {} | {} | {} | {:.0} : 1 | {} | {} | {once} | {} |",
                p.asked.name(),
                p.work,
                f.surface + 1,
                size(f.n_size),
                f.n_rank,
                share(f.n_energy),
                size(f.m_size),
                megabytes(whole),
                megabytes(f.m_bytes as f64),
                whole / (f.m_bytes as f64).max(1.0),
                f.m_rank,
                share(f.m_energy),
                if k == 0 { error(p) } else { String::new() }
            );
        }
    }
}

/// A share near 1: as many digits as what is lacking needs.
fn share(kept: f64) -> String {
    const ALL_BUT: f64 = 1e-6;
    if 1.0 - kept < ALL_BUT {
        return "> 99.9999 %".to_owned();
    }
    let decimals = truncate_usize((-(1.0 - kept).max(ALL_BUT).log10()).clamp(1.0, 6.0));
    format!("{:.decimals$} %", 100.0 * kept)
}

/// Pictures and their differences, after Fig. 11 and 12 of the paper.
fn rendered(out: &mut String, pictures: &[StudyPicture]) {
    if pictures.is_empty() {
        return;
    }
    let _ = writeln!(
        out,
        "\n## Pictures\n\nA sphere and a ring in the material, in two directional lights (`pictures/*.toml`), after Fig. 11 and 12 of Wu et al. (2011): a picture, \
         another one, and three times their difference, colour-coded. *Stated* is the error that `render` states for itself. PSNR and relative RMS are \
         those of linear values, FLIP (Andersson et al. 2020) of what a screen is sent. Against `interreflections` stands `reference` without them: there the difference is \
         between two models.\n\n| picture | stated | wall | against | PSNR | relative RMS | FLIP |\n|---|---|---|---|---|---|---|"
    );
    for p in pictures {
        let or = |text: Option<String>| text.unwrap_or("-".to_owned());
        if let Some(problem) = &p.problem {
            let _ = writeln!(out, "| {} {} | {} | | | | | |", p.scene, p.name, escape(problem));
            continue;
        }
        // Equal pictures have no finite PSNR.
        let equal = (p.relative_rms == Some(0.0)).then(|| "equal".to_owned());
        let psnr = or(p.psnr_db.map(|db| format!("{db:.1} dB")).or(equal));
        let [stated, rms] = [p.stated, p.relative_rms].map(|x| or(x.map(percent)));
        let (wall, flip) = (or(p.seconds.map(seconds)), or(p.flip.map(|f| format!("{f:.4}"))));
        let _ = writeln!(out, "| {} {} | {stated} | {wall} | {} | {psnr} | {rms} | {flip} |", p.scene, p.name, p.against);
    }
    for p in pictures {
        if let Some(panels) = &p.panels {
            let _ = writeln!(out, "\n{}, {} against {}:\n\n![{} and {}]({panels})", p.scene, p.name, p.against, p.against, p.name);
        }
    }
}

/// Settings that have no answer, and why.
fn not_done(out: &mut String, points: &[Point]) {
    let failed: Vec<&Point> = points.iter().filter(|p| p.status != DONE).collect();
    if failed.is_empty() {
        return;
    }
    let _ = writeln!(out, "\n## Not done\n\n| question | setting | how it ended | what it said |\n|---|---|---|---|");
    for p in failed {
        let _ = writeln!(out, "| {} | `{}` | {} | {} |", p.asked.name(), p.work, p.status, escape(&p.message));
    }
}

/// Text that Markdown takes as it is.
fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '|' | '*' | '_' | '<' | '`' | '\\' | '[' | '#' => out.extend(['\\', c]),
            '\n' | '\r' => out.push(' '),
            c => out.push(c),
        }
    }
    out
}
