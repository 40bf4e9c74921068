//! Lobes of normals and amplitudes of a list of pairs, kept while BRDFs change: facets and what they see are forgotten.

use super::amplitudes::AmplitudeLayout;
use super::brdf_lobes::MeasuredSums;
use super::method::{Run, lobes_of};
use super::mode_query::ModeQuery;
use super::surface::{SurfaceBrdf, SurfaceLobes};
use crate::direction::Pair;
use crate::error::{BadInput, Result};
use crate::filter::control::Control;
use crate::filter::plan::SphericalGaussianPlan;
use crate::filter::quality::Quality;
use crate::filter::query::{Query, QueryEntry};
use crate::material::{SmallScale, Surface, Tint};
use crate::sg::Lobe;

/// The geometry of a material as lobes and amplitudes, for a list of pairs.
pub struct PreparedLobes {
    pub(super) plan: SphericalGaussianPlan,
    pub(super) query: Query,
    /// Visible area over the footprint, one a direction of the query.
    areas: Vec<f64>,
    pub(super) surfaces: Vec<OneSurface>,
    /// Sums of measured BRDFs so far.
    pub(super) measured: MeasuredSums,
}

/// What is kept of a surface.
pub(super) struct OneSurface {
    /// Lobes of its normals.
    pub densities: Vec<Lobe>,
    /// What the numbers of a row mean.
    pub layout: AmplitudeLayout,
    /// A row for each pair of the query.
    pub rows: Vec<f32>,
}

/// An effective value from lobes. Its error is not measured: that is of one geometry under one BRDF, and
/// [`effective`](crate::filter::effective()) tells it by the same plan.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LobeValue {
    /// `S`, by channel.
    pub s: [f64; 3],
    /// Visible area over the footprint, from the viewer.
    pub av: f64,
}

impl LobeValue {
    /// The cosine-weighted effective BRDF, 1/sr; 0 where nothing is visible.
    pub fn fbar(&self) -> [f64; 3] {
        if self.av > 0.0 { self.s.map(|s| s / self.av) } else { [0.0; 3] }
    }
}

/// Prepares the geometry of `small` for edits of its BRDFs: what [`effective`](crate::filter::effective()) does by the plan `plan` up to the amplitudes. Colours that vary over a surface
/// are part of the amplitudes, uniform ones are not.
///
/// ```
/// use biscale::brdf::{Brdf, Distribution};
/// use biscale::filter::prepare_lobes;
/// use biscale::{Control, Material, Pair};
/// use glam::DVec3;
///
/// # let text = include_str!("../../../samples/pyramids.toml").to_owned();
/// let mut surface = Material::parse(&biscale::toml_reader::Source { path: "pyramids.toml".into(), text })?.build()?;
/// let pair = Pair { wi: DVec3::new(0.6, 0.0, 0.8), wo: DVec3::Z };
/// let plan = "sg:improved:facets=4096:lobes=128:modes=8".parse()?;
/// let prepared = prepare_lobes(&surface, &[pair], &plan, 0, &Control::quiet())?;
/// // The same geometry under a sharper metal.
/// surface.surfaces[0].brdf = Brdf::CookTorrance { diffuse: [0.0; 3], specular: [0.9, 0.7, 0.4], alpha: 0.1, distribution: Distribution::Ggx, f0: None };
/// let value = prepared.evaluate(&surface.surfaces, &Control::quiet())?[0];
/// assert!(value.fbar()[0] > value.fbar()[2] && value.fbar()[2] > 0.0);
/// # Ok::<(), biscale::Error>(())
/// ```
///
/// # Errors
/// Those of [`effective`](crate::filter::effective()).
pub fn prepare_lobes(
    small: &SmallScale,
    pairs: &[Pair],
    plan: &SphericalGaussianPlan,
    seed: u64,
    control: &Control<'_>,
) -> Result<PreparedLobes> {
    let quality = Quality { seed, ..Quality::default() };
    let mode_query = ModeQuery::new(pairs, small.is_reciprocal());
    let query = &mode_query.query;
    let mut run = Run::new(small, pairs.len(), &quality, control);
    let seen = run.see(plan, query)?;
    let tasks = query.tasks();
    let mut surfaces = Vec::with_capacity(small.surfaces.len());
    for surface in 0..small.surfaces.len() {
        control.check()?;
        let (normals, finder) = lobes_of(small, surface, &seen, &mode_query, plan);
        let rows = finder.rows(&seen, query, &tasks);
        surfaces.push(OneSurface { densities: normals.densities, layout: finder.layout, rows });
        (control.progress)("amplitudes", (surface + 1) as f64 / small.surfaces.len() as f64);
    }
    Ok(PreparedLobes { plan: *plan, areas: seen.areas.clone(), query: mode_query.query, surfaces, measured: MeasuredSums::default() })
}

impl PreparedLobes {
    /// Values of the pairs, in their order, under `surfaces`: those of the material that was prepared, with other BRDFs. The same bits as
    /// [`effective`](crate::filter::effective()) has by the plan.
    ///
    /// # Errors
    /// Another number of surfaces; colours that vary over a surface and did not when it was prepared, or the other way round; a BRDF that is not reciprocal where all were;
    /// an interruption.
    pub fn evaluate(&self, surfaces: &[Surface], control: &Control<'_>) -> Result<Vec<LobeValue>> {
        self.check(surfaces)?;
        let mut sums = vec![[0.0; 3]; self.query.pairs.len()];
        for (prepared, surface) in self.surfaces.iter().zip(surfaces) {
            control.check()?;
            let lobes = SurfaceLobes { plan: &self.plan, densities: &prepared.densities, layout: &prepared.layout };
            let brdf = SurfaceBrdf::new(surface, self.plan.brdf, &self.measured);
            lobes.integrate(&brdf, &self.query, 0..sums.len(), &prepared.rows, &mut sums);
        }
        Ok(self.values(&sums))
    }

    /// The values of the list from the sums of the query's pairs.
    pub(super) fn values(&self, sums: &[[f64; 3]]) -> Vec<LobeValue> {
        let of_entry = |e: QueryEntry| LobeValue { s: sums[e.pair as usize].map(|s| s.max(0.0)), av: self.areas[e.viewer as usize] };
        self.query.entries.iter().map(|entry| entry.map_or_else(LobeValue::default, of_entry)).collect()
    }

    /// Whether the amplitudes hold for these surfaces.
    pub(super) fn check(&self, surfaces: &[Surface]) -> Result<()> {
        let wrong = |problem: String, remedy: &str| Err(BadInput::new(problem, remedy).at_field("surface").into());
        if surfaces.len() != self.surfaces.len() {
            return wrong(format!("{} surfaces, but {} were prepared", surfaces.len(), self.surfaces.len()), "prepare the material anew");
        }
        for (k, (surface, prepared)) in surfaces.iter().zip(&self.surfaces).enumerate() {
            let varies = !matches!(surface.tint, Tint::Uniform(_));
            if varies != (prepared.layout.channels > 1) {
                let now = if varies { "varies, and was" } else { "is uniform, and was not" };
                return wrong(format!("the tint of surface {} {now} uniform when it was prepared", k + 1), "prepare the material anew");
            }
            if self.query.symmetric && !surface.brdf.is_reciprocal() {
                let problem = format!("surface {} has a BRDF that is not reciprocal; all were when the material was prepared", k + 1);
                return wrong(problem, "prepare the material with it");
            }
        }
        Ok(())
    }

    /// Bytes of lobes, modes and amplitudes.
    pub fn bytes(&self) -> usize {
        let of = |s: &OneSurface| size_of_val(&s.densities[..]) + s.layout.bytes() + size_of_val(&s.rows[..]);
        self.surfaces.iter().map(of).sum()
    }
}
