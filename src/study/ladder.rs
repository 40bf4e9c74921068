//! The settings that are tried, one series for each thing that can be set.
//!
//! A series changes one thing and leaves the rest: its steps show what that thing buys. A setting that several series share is run once.

use super::point_sums::{Placement, Precision};
use super::question::Asked;
use super::work::Work;
use crate::filter::{CLUSTER_WIDTHS, DirectPlan, LobeCount, LowRankPlan, MapSides, Method, Plan, SphericalGaussianPlan};

/// Settings that differ in one thing.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The question they are asked.
    pub asked: Asked,
    /// What they share.
    pub title: String,
    /// What is changed: the head of a column.
    pub varied: &'static str,
    /// What the user should know about it.
    pub about: &'static str,
    /// The value of what is changed, and the setting.
    pub steps: Vec<(String, Work)>,
}

/// Tolerances that methods are asked to keep.
const TOLERANCES: [f64; 7] = [0.1, 0.05, 0.03, 0.01, 0.005, 0.003, 0.001];
/// Tolerance of the runs with interreflections.
const BOUNCES_TOLERANCE: f64 = 0.01;
/// Reflections after the first that are tried.
const BOUNCES: [u32; 4] = [0, 1, 2, 4];

/// The truth that all runs are compared with: `reference`, until a tolerance is met or the wall seconds are over.
pub fn truth(tolerance: f64, budget: f64) -> Work {
    Work::Effective { method: Method::Reference, tolerance, budget: Some(budget), bounces: 0, plan: None }
}

/// All series; with `quick` fewer steps, none of which takes long.
pub fn ladder(quick: bool) -> Vec<Series> {
    let mut all = Vec::new();
    for asked in Asked::ALL {
        all.extend(tolerances(asked, quick));
        all.extend(direct(asked, quick));
        all.extend(low_rank(asked, quick));
        all.extend(spherical_gaussians(asked, quick));
    }
    all.extend(points(quick));
    all.push(interreflections(quick));
    all
}

/// Every `n`-th of a list for a quick ladder, all of it else.
fn thinned<T: Copy>(list: &[T], quick: bool, n: usize) -> Vec<T> {
    list.iter().copied().step_by(if quick { n } else { 1 }).collect()
}

fn tolerances(asked: Asked, quick: bool) -> Vec<Series> {
    let series = |method, title: &str, about, tolerances: &[f64]| Series {
        asked,
        title: title.to_owned(),
        varied: "tolerance",
        about,
        steps: tolerances.iter().map(|&t| (t.to_string(), Work::to_tolerance(method, t))).collect(),
    };
    let usual: Vec<f64> = thinned(&TOLERANCES, quick, 3);
    // Fresh rays for each pair of a table take minutes.
    let of_reference: &[f64] = if asked == Asked::Table {
        &[]
    } else if quick {
        &[0.1, 0.01]
    } else {
        &[0.1, 0.03, 0.01, 0.003]
    };
    let of_low_rank: &[f64] = if quick { &[0.03] } else { &[0.1, 0.03, 0.01] };
    vec![
        series(
            Method::Direct,
            "direct to a tolerance",
            "the number of facets is chosen so that the estimated error keeps the tolerance",
            &usual,
        ),
        series(Method::Auto, "auto to a tolerance", "the program chooses", &usual),
        series(Method::Reference, "reference to a tolerance", "fresh rays for every pair", of_reference),
        series(
            Method::LowRank,
            "lowrank improved to a tolerance",
            "facets and normals are chosen so that the estimated error keeps the tolerance",
            of_low_rank,
        ),
        series(
            Method::SphericalGaussian,
            "sg improved to a tolerance",
            "facets and lobes are chosen so that the estimated error keeps the tolerance",
            of_low_rank,
        ),
    ]
    .into_iter()
    .filter(|s| !s.steps.is_empty())
    .collect()
}

fn direct(asked: Asked, quick: bool) -> Vec<Series> {
    let plan = |facets: u32, more: fn(DirectPlan) -> DirectPlan| {
        (facets.to_string(), Work::by_plan(Plan::Direct(more(DirectPlan::samples_by_area(facets)))))
    };
    let series = |title: &str, varied, about, steps| Series { asked, title: title.to_owned(), varied, about, steps };
    let facets: &[u32] = match asked {
        Asked::List => &[64, 256, 1024, 4096, 16_384, 65_536, 262_144],
        Asked::Table => &[256, 1024, 4096, 16_384, 65_536],
    };
    let facets = if quick { &facets[..4] } else { facets };
    let weighted: &[u32] = if quick { &[1024, 4096] } else { &[1024, 4096, 16_384, 65_536] };
    let mut all = vec![
        series(
            "direct: facets spread by area",
            "facets",
            "each facet stands for the same area",
            facets.iter().map(|&n| plan(n, |plan| plan)).collect(),
        ),
        series(
            "direct: facets where they are worth most",
            "facets",
            "a pilot run of 8,192 facets, which the cost includes, says where facets are worth most",
            weighted.iter().map(|&n| plan(n, |plan| DirectPlan { weighted: true, ..plan })).collect(),
        ),
    ];
    if asked == Asked::Table {
        // Short lists group equal normals only: their clusters cannot be narrowed.
        const CLUSTERED: u32 = 16_384;
        let narrowed = |narrowed: usize| Plan::Direct(DirectPlan { narrowed, ..DirectPlan::samples_by_area(CLUSTERED) });
        let steps = CLUSTER_WIDTHS.iter().enumerate().map(|(k, width)| (width.to_string(), Work::by_plan(narrowed(k)))).collect();
        all.push(series(
            "direct: clusters of normals, 16,384 facets",
            "width",
            "facets of nearly one normal are summed as one; the width is a share of the widest that is used, 0 are equal normals only",
            steps,
        ));
    }
    all
}

/// Plan of the paper's method: facets, side of the map of directions of the visibility, largest sides of the maps of `M`, kept shares of the
/// power of `N` and of `M`.
fn paper(facets: u32, directions: u32, rates: [u32; 2], energy: [f64; 2]) -> Work {
    let rates = MapSides { directions: rates[0] as usize, normals: rates[1] as usize };
    Work::by_plan(Plan::LowRank(LowRankPlan::Paper { facets: facets as usize, directions: directions as usize, rates, energy }))
}

/// Plan of the improved method: facets, side of the map of normals, kept shares of the power of `N` and of `M`.
fn improved(facets: u32, normals: u32, energy: [f64; 2]) -> Work {
    Work::by_plan(Plan::LowRank(LowRankPlan::Improved { facets: facets as usize, normals: normals as usize, energy }))
}

/// Facets where the method of the paper varies something else.
const FACETS: u32 = 4096;
/// Side of its map of directions there.
const DIRECTIONS: u32 = 13;
/// Largest sides of the maps that M is sampled by there. The paper clamps to 48 x 64, which for narrow lobes takes many minutes a BRDF; what it buys is a
/// series of its own.
const RATES: [u32; 2] = [24, 32];
/// Shares of the power of N and M that its cuts leave there.
const ENERGY: [f64; 2] = [0.995, 0.98];
/// Side of the map of normals where the improved method varies something else.
const NORMALS: u32 = 32;
/// Facets there.
const IMPROVED_FACETS: u32 = 8192;
/// Shares of the power of N and M that its cuts leave there.
const IMPROVED_ENERGY: [f64; 2] = [0.9999, 0.9999];

/// The low-rank method at all settings; in a quick ladder, and for a list of pairs, at numbers of facets only.
fn low_rank(asked: Asked, quick: bool) -> Vec<Series> {
    let mut all = low_rank_facets(asked, quick);
    if !quick && asked != Asked::List {
        all.extend(low_rank_compression(asked));
    }
    all
}

fn low_rank_facets(asked: Asked, quick: bool) -> Vec<Series> {
    let series = |title: &str, about, steps| Series { asked, title: title.to_owned(), varied: "facets", about, steps };
    vec![
        series(
            "lowrank paper: facets",
            "the paper samples 500 to 12,000",
            thinned(&[512, 2048, FACETS, 12_288], quick, 4)
                .into_iter()
                .map(|n| (n.to_string(), paper(n, DIRECTIONS, RATES, ENERGY)))
                .collect(),
        ),
        series(
            "lowrank improved: facets",
            "visibility for the wanted directions themselves",
            thinned(&[1024, 4096, IMPROVED_FACETS, 32_768], quick, 4)
                .into_iter()
                .map(|n| (n.to_string(), improved(n, NORMALS, IMPROVED_ENERGY)))
                .collect(),
        ),
    ]
}

/// What decides how far the matrices are compressed.
fn low_rank_compression(asked: Asked) -> Vec<Series> {
    let series = |title: &str, varied, about, steps: Vec<(String, Work)>| Series { asked, title: title.to_owned(), varied, about, steps };
    let number = |n: u32, work| (n.to_string(), work);
    let energies: [[f64; 2]; 5] = [[0.9, 0.9], [0.98, 0.95], ENERGY, [0.999, 0.995], IMPROVED_ENERGY];
    let shares = |[n, m]: [f64; 2], work| (format!("{n}, {m}"), work);
    vec![
        series(
            "lowrank paper: directions of the visibility",
            "side",
            "side of the map of directions; 12 has 112 directions, 13 has 137, the paper uses 88 to 132",
            [8, DIRECTIONS, 18, 24].into_iter().map(|n| number(n, paper(FACETS, n, RATES, ENERGY))).collect(),
        ),
        series(
            "lowrank paper: sampling rates of M",
            "sides",
            "largest sides of the maps of directions and of normals; a BRDF takes no larger ones than it needs; the paper's are 48 x 64",
            [[16, 20], RATES, [34, 45], [48, 64]]
                .into_iter()
                .map(|[d, n]| (format!("{d} x {n}"), paper(FACETS, DIRECTIONS, [d, n], ENERGY)))
                .collect(),
        ),
        series(
            "lowrank paper: energy kept, and with it the ranks",
            "of N, M",
            "shares of the power of N and M that the cut leaves; the paper keeps 99.5 and 98 %",
            energies.into_iter().map(|e| shares(e, paper(FACETS, DIRECTIONS, RATES, e))).collect(),
        ),
        series(
            "lowrank improved: map of normals",
            "side",
            "side of the map of normals, whose cells are summed by their mean normal",
            [16, NORMALS, 64].into_iter().map(|n| number(n, improved(IMPROVED_FACETS, n, IMPROVED_ENERGY))).collect(),
        ),
        series(
            "lowrank improved: energy kept, and with it the ranks",
            "of N, M",
            "shares of the power of N and M that the cut leaves",
            energies.into_iter().map(|e| shares(e, improved(IMPROVED_FACETS, NORMALS, e))).collect(),
        ),
    ]
}

fn spherical_gaussians(asked: Asked, quick: bool) -> Vec<Series> {
    const FACETS: usize = 8192;
    let series = |title: &str, about, first: SphericalGaussianPlan, lobes: &[usize]| Series {
        asked,
        title: title.to_owned(),
        varied: "lobes",
        about,
        steps: lobes
            .iter()
            .map(|&lobes| {
                (lobes.to_string(), {
                    let plan = SphericalGaussianPlan { facets: FACETS, lobes: LobeCount::Fixed(lobes), ..first };
                    Work::by_plan(Plan::SphericalGaussian(plan))
                })
            })
            .collect(),
    };
    let paper: &[usize] = if quick { &[8] } else { &[1, 4, 8, 16] };
    let improved: &[usize] = if quick { &[4, 16] } else { &[1, 4, 8, 16, 64] };
    vec![
        series(
            "sg paper: lobes of the normals",
            "amplitudes by least squares, one lobe a BRDF; the paper takes 4 to 8",
            SphericalGaussianPlan::PAPER,
            paper,
        ),
        series(
            "sg improved: lobes of the normals",
            "amplitudes by responsibilities, a sum of lobes a BRDF",
            SphericalGaussianPlan::FIRST,
            improved,
        ),
    ]
}

fn points(quick: bool) -> Vec<Series> {
    let facets: &[u32] = if quick { &[256, 2048] } else { &[256, 1024, 4096, 16_384] };
    let series = |placement: Placement, precision: Precision| Series {
        asked: Asked::List,
        title: format!("plain sums: {} facets, {}", placement.name(), precision.name()),
        varied: "facets",
        about: "the same sums for each way to place facets, so that only their places and the numbers differ; not made to be fast",
        steps: facets.iter().map(|&n| (n.to_string(), Work::Points { placement, precision, facets: n })).collect(),
    };
    let mut all: Vec<Series> = Placement::ALL.into_iter().map(|placement| series(placement, Precision::F64)).collect();
    all.push(series(Placement::LowDiscrepancy, Precision::F32));
    all
}

fn interreflections(quick: bool) -> Series {
    let work = |bounces| Work::Effective { method: Method::Reference, tolerance: BOUNCES_TOLERANCE, budget: None, bounces, plan: None };
    Series {
        asked: Asked::List,
        title: format!("reference: reflections after the first, tolerance {BOUNCES_TOLERANCE}"),
        varied: "bounces",
        about: "the truth of this study is direct light: from 1 bounce on the error is the difference of two models, not of two computations",
        steps: thinned(&BOUNCES, quick, 3).into_iter().map(|n| (n.to_string(), work(n))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::work::Family;
    use super::*;

    #[test]
    fn every_setting_reads_as_it_is_written() {
        for series in ladder(false).into_iter().chain(ladder(true)) {
            for (_, work) in series.steps {
                assert_eq!(Work::parse(&work.to_string()).unwrap(), work);
            }
        }
        let truth = truth(0.001, 12.5);
        assert_eq!(Work::parse(&truth.to_string()).unwrap(), truth);
        for text in [
            "",
            "direct",
            "nothing:5",
            "points:random:f64",
            "points:random:f16:64",
            "points:random:f64:0",
            "direct:tolerance=-1",
            "auto:tolerance=.1:x=2",
        ] {
            assert!(Work::parse(text).unwrap_err().to_string().contains(text), "{text}");
        }
    }

    #[test]
    fn a_quick_ladder_is_a_short_one_that_tries_every_method() {
        let works = |quick| -> Vec<Work> { ladder(quick).into_iter().flat_map(|s| s.steps).map(|s| s.1).collect() };
        let (quick, whole) = (works(true), works(false));
        assert!(quick.len() * 2 < whole.len(), "{} of {}", quick.len(), whole.len());
        for family in Family::ALL.into_iter().filter(|f| *f != Family::DirectClusters) {
            assert!(quick.iter().any(|w| w.family() == family), "{family:?}");
        }
        assert!(Family::ALL.into_iter().all(|f| whole.iter().any(|w| w.family() == f)));
    }

    #[test]
    fn a_series_changes_one_thing_and_has_no_step_twice() {
        for series in ladder(false) {
            let mut names: Vec<String> = series.steps.iter().map(|s| s.1.to_string()).collect();
            let count = names.len();
            names.sort_unstable();
            names.dedup();
            assert!(count == names.len() && count > 0, "{}", series.title);
        }
    }
}
