//! The method, from a surface and pairs to values with errors, and the search for a tolerance.

use super::amplitudes::AmplitudeFinder;
use super::brdf_lobes::MeasuredSums;
use super::mode_query::ModeQuery;
use super::modes::SAMPLE_PAIRS;
use super::normals::NormalLobes;
use super::surface::{SurfaceBrdf, SurfaceLobes};
use crate::direction::Pair;
use crate::error::Result;
use crate::facets::Facets;
use crate::filter::control::{Control, RisingShare};
use crate::filter::facet_sampler::FacetSampler;
use crate::filter::plan::{BrdfLobes, LobeCount, MAX_LOBES, Plan, SphericalGaussianPlan, Variant};
use crate::filter::probes::{ApproximationErrors, Probes, RawValue, values_with_error};
use crate::filter::quality::{Method, Quality};
use crate::filter::query::{Query, QueryEntry};
use crate::filter::tolerance::{MEASURED_SAFETY, SAFETY, measured_keeps, needed};
use crate::filter::value::{Effective, Summary, Value};
use crate::filter::visible_facets::VisibleFacets;
use crate::material::{SmallScale, Tint};
use crate::numerics::cast::index_u32;
use crate::numerics::seed;
use crate::numerics::words::percent;
use crate::visibility::MAX_PERIODS;
use std::ops::Range;

/// Share of the tolerance that the facets may take, and that the lobes may: `.6² + .75² = .92`. Facets are cheap, lobes are not.
const FACET_SHARE: f64 = 0.6;
const BIAS_SHARE: f64 = 0.75;
/// How often settings are looked for again where the measured error is not within the tolerance.
const ROUNDS: usize = 2;
/// Looks for settings that are expected still to come, for the progress. Chosen, not measured.
const STEPS_TO_COME: f64 = 4.0;
/// Pairs whose amplitudes are held at once.
const PAIRS_AT_ONCE: usize = 1 << 16;

/// A stage, for its seconds.
#[derive(Clone, Copy)]
enum Stage {
    Facets,
    Visibility,
    Lobes,
    Amplitudes,
    Integrals,
}

const STAGES: [&str; 5] = ["facets", "visibility", "lobes", "amplitudes", "integrals"];

/// Effective values by spherical Gaussians.
pub(in crate::filter) fn spherical_gaussians(
    small: &SmallScale,
    pairs: &[Pair],
    quality: &Quality,
    control: &Control<'_>,
) -> Result<Effective> {
    let given = quality.plan.as_ref().map(Plan::as_spherical_gaussian).transpose()?;
    let variant = quality.variant_of(Method::SphericalGaussian);
    let mut run = Run::new(small, pairs.len(), quality, control);
    let query = ModeQuery::new(pairs, small.is_reciprocal());
    let (plan, raw, errors) = match (given, variant) {
        (Some(plan), _) => run.with_errors(plan, pairs, &query)?,
        (None, Variant::Paper) => run.with_errors(SphericalGaussianPlan::PAPER, pairs, &query)?,
        (None, Variant::Improved) => run.within_tolerance(pairs, &query)?,
    };
    if given.is_none() && !measured_keeps(errors.total, quality.tolerance) {
        let why = match variant {
            Variant::Paper => "the published method has fixed settings; `variant improved` or `method direct` look for those that keep it",
            Variant::Improved => "more lobes than it is allowed would; `method direct` does",
        };
        run.notes.push(format!("the tolerance of {} is not met: {why}", percent(quality.tolerance)));
    }
    (control.progress)("sums", 1.0);
    Ok(run.result(&plan, pairs, &raw, errors))
}

/// A run of the method.
pub(super) struct Run<'a> {
    small: &'a SmallScale,
    quality: &'a Quality,
    control: &'a Control<'a>,
    sampler: FacetSampler<'a>,
    /// Seconds of each [`Stage`].
    seconds: [f64; STAGES.len()],
    /// Sums of measured BRDFs so far.
    measured: MeasuredSums,
    /// Share of the work that is done, and pairs of the whole list.
    done: RisingShare,
    pairs: f64,
    notes: Vec<String>,
    details: Vec<String>,
}

/// Values before their errors are known, and what they are made of.
struct RawValues {
    pairs: Vec<RawValue>,
    directions: usize,
    /// Lobes of the normals of all surfaces, and amplitudes of a pair.
    lobes: usize,
    amplitudes: usize,
    /// Whether all distinct normals have a lobe.
    complete: bool,
    /// Of each surface: the number of its BRDF's lobes, and the relative RMS error of their sum.
    brdf: Vec<(usize, f64)>,
    /// Bytes of the lobes and of the amplitudes of all pairs.
    bytes: usize,
}

impl<'a> Run<'a> {
    /// For a list of `pairs` pairs.
    pub(super) fn new(small: &'a SmallScale, pairs: usize, quality: &'a Quality, control: &'a Control<'a>) -> Self {
        let sampler = FacetSampler::new(small, None, seed::fold(quality.seed), control);
        Self {
            small,
            quality,
            control,
            sampler,
            seconds: [0.0; STAGES.len()],
            measured: MeasuredSums::default(),
            done: RisingShare::default(),
            pairs: pairs as f64,
            notes: Vec::new(),
            details: Vec::new(),
        }
    }

    /// What `work` gives; the time it takes goes to a stage.
    fn timed<T>(&mut self, stage: Stage, work: impl FnOnce(&mut Self) -> T) -> T {
        let began = (self.control.clock)();
        let result = work(self);
        self.seconds[stage as usize] += (self.control.clock)() - began;
        result
    }

    /// The facets of a plan.
    fn facets(&mut self, plan: &SphericalGaussianPlan) -> Facets {
        self.timed(Stage::Facets, |run| match plan.variant {
            Variant::Paper => run.sampler.random(plan.facets),
            Variant::Improved => run.sampler.low_discrepancy(plan.facets),
        })
    }

    /// Values of a list by a plan, with their errors.
    fn with_errors(
        &mut self,
        plan: SphericalGaussianPlan,
        list: &[Pair],
        query: &ModeQuery,
    ) -> Result<(SphericalGaussianPlan, RawValues, ApproximationErrors)> {
        let seen = self.see(&plan, &query.query)?;
        let raw = self.values_of(&plan, query, &seen)?;
        let probes = Probes::by_value(self.small, list, &raw.pairs);
        let (exact, facets) = self.exact(&plan, &probes)?;
        let bias = probes.relative_difference(&exact, &raw.pairs);
        let total =
            self.timed(Stage::Visibility, |run| probes.measure(run.small, run.sampler.seed, run.control, plan.facets, &raw.pairs))?;
        Ok((plan, raw, ApproximationErrors { facets, bias, total }))
    }

    /// The plan for the tolerance, and what it gives. Where the measured error is not within it, settings are looked for once more: on probes that the sizes of
    /// the values choose, with as many more facets as these err.
    fn within_tolerance(&mut self, list: &[Pair], query: &ModeQuery) -> Result<(SphericalGaussianPlan, RawValues, ApproximationErrors)> {
        let tolerance = self.quality.tolerance;
        let (mut plan, mut exhausted) = self.adapt(&Probes::new(self.small, list), query, SphericalGaussianPlan::FIRST)?;
        let mut round = 0;
        loop {
            let (_, raw, errors) = self.with_errors(plan, list, query)?;
            // More facets are in vain where no settings were left that bring the bias down: that of a BRDF's lobes stays.
            let in_vain = exhausted && errors.bias > tolerance;
            if round == ROUNDS || in_vain || measured_keeps(errors.total, tolerance) {
                return Ok((plan, raw, errors));
            }
            let of_facets = (errors.total.powi(2) - errors.bias.powi(2)).max(0.0).sqrt();
            let facets = needed(index_u32(plan.facets), MEASURED_SAFETY * of_facets / (FACET_SHARE * tolerance)) as usize;
            let first = SphericalGaussianPlan { facets: facets.min(query.most_facets()), ..plan };
            let next = self.adapt(&Probes::by_value(self.small, list, &raw.pairs), query, first)?;
            if next.0 == plan {
                return Ok((plan, raw, errors));
            }
            (plan, exhausted) = next;
            round += 1;
        }
    }

    /// The facets of a plan, and what they see of a query's directions.
    pub(super) fn see(&mut self, plan: &SphericalGaussianPlan, query: &Query) -> Result<VisibleFacets> {
        self.control.check()?;
        let facets = self.facets(plan);
        self.timed(Stage::Visibility, |run| VisibleFacets::new(&run.sampler, facets, &query.directions))
    }

    /// Values of a query by a plan, of whose facets it is known what they see.
    fn values_of(&mut self, plan: &SphericalGaussianPlan, mode_query: &ModeQuery, seen: &VisibleFacets) -> Result<RawValues> {
        let query = &mode_query.query;
        let amount = query.pairs.len() as f64;
        let (from, to) = self.done.step(amount, self.pairs.max(amount) + STEPS_TO_COME * amount.min(self.pairs), false);
        let mut values = vec![[0.0; 3]; query.pairs.len()];
        let (mut lobes, mut amplitudes, mut complete, mut brdf, mut bytes) = (0, 0, true, Vec::new(), 0);
        for surface in 0..self.small.surfaces.len() {
            let (normals, finder) = self.timed(Stage::Lobes, |run| lobes_of(run.small, surface, seen, mode_query, plan));
            lobes += normals.densities.len();
            amplitudes += finder.layout.count() * finder.layout.channels;
            complete &= normals.complete && finder.layout.count() >= normals.densities.len();
            let covered = self.timed(Stage::Integrals, |run| SurfaceBrdf::new(&run.small.surfaces[surface], plan.brdf, &run.measured));
            brdf.push((covered.lobes(), covered.error()));
            let of_surface = SurfaceLobes { plan, densities: &normals.densities, layout: &finder.layout };
            let surfaces = self.small.surfaces.len();
            let part = |k: usize| from + (to - from) * k as f64 / surfaces as f64;
            bytes += self.add_surface(&of_surface, &finder, &covered, seen, query, (part(surface)..part(surface + 1), &mut values))?;
        }
        let at = |entry: &Option<QueryEntry>| match entry {
            Some(e) => (values[e.pair as usize].map(|s| s.max(0.0)), seen.areas[e.viewer as usize]),
            None => ([0.0; 3], 0.0),
        };
        Ok(RawValues {
            pairs: query.entries.iter().map(at).collect(),
            directions: query.directions.len(),
            lobes,
            amplitudes,
            complete,
            brdf,
            bytes,
        })
    }

    /// Adds `S` of one surface to that of each pair; the bytes of its lobes and amplitudes.
    fn add_surface(
        &mut self,
        lobes: &SurfaceLobes<'_>,
        finder: &AmplitudeFinder<'_>,
        brdf: &SurfaceBrdf<'_>,
        seen: &VisibleFacets,
        query: &Query,
        (share, values): (Range<f64>, &mut [[f64; 3]]),
    ) -> Result<usize> {
        let tasks = query.tasks();
        let mut bytes = size_of_val(lobes.densities) + lobes.layout.bytes();
        let mut next = 0;
        while next < tasks.len() {
            self.control.check()?;
            let first = tasks[next].start;
            let end = next + tasks[next..].partition_point(|t| t.end <= first + PAIRS_AT_ONCE).max(1);
            let pairs = first..tasks[end - 1].end;
            let rows = self.timed(Stage::Amplitudes, |_| finder.rows(seen, query, &tasks[next..end]));
            bytes += size_of_val(&rows[..]);
            self.timed(Stage::Integrals, |_| lobes.integrate(brdf, query, pairs.clone(), &rows, &mut values[pairs.clone()]));
            (self.control.progress)("sums", share.start + (share.end - share.start) * pairs.end as f64 / query.pairs.len() as f64);
            next = end;
        }
        Ok(bytes)
    }

    /// Values of the probes by sums over a plan's facets one by one, and the relative RMS error that their spread tells.
    fn exact(&mut self, plan: &SphericalGaussianPlan, probes: &Probes) -> Result<(Vec<Value>, f64)> {
        let facets = self.facets(plan);
        self.timed(Stage::Visibility, |run| probes.exact(run.small, &run.sampler, facets))
    }

    /// The plan for the tolerance, from `plan` on: facets until their error on the probes is small enough, then lobes until the bias is; and whether there are no
    /// more of these though it is not.
    fn adapt(&mut self, probes: &Probes, list: &ModeQuery, mut plan: SphericalGaussianPlan) -> Result<(SphericalGaussianPlan, bool)> {
        let tolerance = self.quality.tolerance;
        let (count, exact, _) = Probes::facets_within(FACET_SHARE * tolerance, [plan.facets, list.most_facets()], |facets| {
            self.exact(&SphericalGaussianPlan { facets, ..plan }, probes)
        })?;
        plan.facets = count;
        let alone = probes.alone();
        let query = list.with_its_modes(probes.pairs());
        let seen = self.see(&plan, &query.query)?;
        let of = |run: &mut Self, plan: &SphericalGaussianPlan| -> Result<(f64, bool)> {
            let raw = run.values_of(plan, &query, &seen)?;
            Ok((alone.relative_difference(&exact, &raw.pairs), raw.complete))
        };
        let (mut bias, mut complete) = of(self, &plan)?;
        let LobeCount::Fixed(mut lobes) = plan.lobes else { unreachable!("a search starts from a number") };
        loop {
            let enough = SAFETY * bias <= BIAS_SHARE * tolerance;
            // Once every normal has a lobe and an amplitude, more are asked for in vain.
            if enough || complete {
                return Ok((plan, !enough));
            }
            // Whatever helps more: a finer density, or a finer visibility. Each round doubles one of them, so the search ends.
            let doubled = (2 * lobes).min(MAX_LOBES);
            let finer = (doubled > lobes).then_some(SphericalGaussianPlan { lobes: LobeCount::Fixed(doubled), ..plan });
            let modes = (2 * plan.modes).min(lobes);
            // Modes are learnt from so many pairs; as many amplitudes as lobes need none.
            let more = (modes > plan.modes && (modes <= SAMPLE_PAIRS || modes == lobes)).then_some(SphericalGaussianPlan { modes, ..plan });
            let of_finer = finer.map(|plan| of(self, &plan)).transpose()?;
            let of_more = more.map(|plan| of(self, &plan)).transpose()?;
            match (finer.zip(of_finer), more.zip(of_more)) {
                (None, None) => return Ok((plan, true)),
                (Some((_, finer)), Some((next, more))) if more.0 < finer.0 => (plan, (bias, complete)) = (next, more),
                (Some((next, found)), _) => {
                    (plan, (bias, complete)) = (next, found);
                    lobes = doubled;
                }
                (None, Some((next, found))) => (plan, (bias, complete)) = (next, found),
            }
        }
    }

    /// The values and their summary.
    fn result(mut self, plan: &SphericalGaussianPlan, pairs: &[Pair], raw: &RawValues, errors: ApproximationErrors) -> Effective {
        self.details.push(format!("relative RMS error of the facets {}, of lobes {}", percent(errors.facets), percent(errors.bias)));
        for (surface, (count, error)) in raw.brdf.iter().enumerate().filter(|(_, (count, _))| *count > 0) {
            let error = match plan.brdf {
                BrdfLobes::Single => String::new(),
                BrdfLobes::Spaced(_) => format!(", within {:.1} % of it", 100.0 * error),
            };
            self.details.push(format!(
                "surface {}: its BRDF is a sum of {count} spherical Gaussian{}{error}",
                surface + 1,
                if *count == 1 { "" } else { "s" }
            ));
        }
        self.details.push(format!(
            "{} lobes of normals, {} amplitudes a pair; {:.2} MB for both",
            raw.lobes,
            raw.amplitudes,
            raw.bytes as f64 / 1e6
        ));
        let given_up = self.sampler.given_up();
        let mut error = errors.total;
        if given_up > 0 {
            // As in the direct method: their share is an error of every value.
            error = error.hypot(given_up as f64 / (plan.facets as f64 * raw.directions as f64));
            self.details
                .push(format!("{given_up} rays passed {MAX_PERIODS} periods without an answer and count as free; the errors include them"));
        }
        let summary = Summary {
            method: match plan.variant {
                Variant::Paper => "sg",
                Variant::Improved => "sg improved",
            },
            plan: Some(Plan::SphericalGaussian(*plan)),
            facets: plan.facets,
            clusters: raw.lobes,
            directions: raw.directions,
            stages: STAGES.into_iter().zip(self.seconds.map(|s| 1e3 * s)).collect(),
            relative_rms: error,
            low_rank: Vec::new(),
            notes: self.notes,
            details: self.details,
        };
        Effective { values: values_with_error(pairs, &raw.pairs, error), summary }
    }
}

/// The lobes of a surface's normals, and what finds their amplitudes.
pub(super) fn lobes_of<'r>(
    small: &SmallScale,
    surface: usize,
    seen: &'r VisibleFacets,
    query: &ModeQuery,
    plan: &SphericalGaussianPlan,
) -> (NormalLobes, AmplitudeFinder<'r>) {
    let range = seen.facets.ranges[surface].clone();
    let normals = NormalLobes::new(seen, range.clone(), plan.lobes);
    let tinted = !matches!(small.surfaces[surface].tint, Tint::Uniform(_));
    let finder = AmplitudeFinder::new(seen, range, &normals, query, plan.amplitudes, plan.modes, tinted);
    (normals, finder)
}
