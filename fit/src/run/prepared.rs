//! What does not change while a search runs: photographs as tables, the close-up, how it may be read.

use super::options::{COARSE, FINE};
use crate::fit_file::spec::Spec;
use crate::fit_file::variant::{Variants, own_sides};
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::{DirectionBins, scene_of, sights};
use crate::photograph::image::{Photograph, Role};
use crate::photograph::mean_period;
use crate::photograph::sight::Sight;
use crate::residuals::unknowns::{self, Variable};
use biscale::error::Result;
use biscale::filter::Control;
use biscale::filter::Slot;
use biscale::geometry::{Geometry, Tile};
use biscale::material::{Material, SmallScale};
use biscale::render::{Opacity, World};
use serde::Serialize;

/// What does not change while the search runs.
pub(super) struct Prepared<'a> {
    pub(super) spec: &'a Spec,
    pub(super) distant: Vec<&'a Photograph>,
    pub(super) coarse: Vec<DirectionBins>,
    pub(super) fine: Vec<DirectionBins>,
    pub(super) close_up: Option<CloseUp>,
    pub(super) opaque: bool,
    pub(super) start: SmallScale,
    pub(super) notes: Vec<String>,
}

/// Where the photographs of a fit file can be used, without a search: what `check` says.
#[derive(Clone, Debug, Serialize)]
pub struct Survey {
    /// For each distant photograph its file, the pixels that can be used, and the bins of the fine model.
    pub distant: Vec<(String, usize, usize)>,
    /// What the close-up says.
    pub close_up: Option<CloseUp>,
    /// Names of what the search moves.
    pub variables: Vec<String>,
    /// Names of what is solved for.
    pub unknowns: Vec<String>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Looks at all that a fit file names.
///
/// # Errors
/// Bad input; `Interrupted`.
pub fn survey(spec: &Spec, control: &Control<'_>) -> Result<Survey> {
    let prepared = Prepared::new(spec, control)?;
    let tile = &prepared.start.tile;
    let heights = tile.vertices.iter().fold([0.0_f64; 2], |[low, high], v| [low.min(v.z), high.max(v.z)]);
    let unknowns = unknowns::unknowns(spec, prepared.distant.len(), prepared.close_up.as_ref().and_then(CloseUp::exposures));
    Ok(Survey {
        distant: prepared.distant.iter().zip(&prepared.fine).map(|(p, c)| (p.file.display().to_string(), c.pixels, c.bins.len())).collect(),
        variables: prepared.variables().iter().map(|v| v.name(spec, &unknowns)).collect(),
        unknowns: unknowns.into_iter().map(|u| u.name).collect(),
        close_up: prepared.close_up.map(|found| found.at_any_height(heights, tile.period.to_array())),
        notes: prepared.notes,
    })
}

impl<'a> Prepared<'a> {
    pub(super) fn new(spec: &'a Spec, control: &Control<'_>) -> Result<Self> {
        Self::with(spec, None, control)
    }

    /// Of another material before the same photographs: their direction bins are those of `binned`.
    pub(super) fn with(spec: &'a Spec, binned: Option<&Prepared<'_>>, control: &Control<'_>) -> Result<Self> {
        let start = spec.material.build()?;
        let opaque = is_opaque(&spec.material, &start.tile, control)?;
        let mut notes = spec.notes.clone();
        for photograph in &spec.photographs {
            let name = photograph.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            notes.extend(photograph.image.notes.iter().map(|n| format!("{name}: {n}")));
            if !photograph.exposure_known && photograph.role != Role::CloseUp {
                notes.push(format!("{name}: its irradiance is not known and was taken as given: all colours share an unknown factor"));
            }
        }
        let distant: Vec<&Photograph> = spec.of_role(Role::Distant).collect();
        let (mut coarse, mut fine) = binned.map_or_else(Default::default, |b| (b.coarse.clone(), b.fine.clone()));
        for photograph in distant.iter().filter(|_| binned.is_none()) {
            let sights = sights_of(photograph, spec, &start);
            coarse.push(DirectionBins::new(photograph, &sights, (COARSE.bins / distant.len()).max(8))?);
            fine.push(DirectionBins::new(photograph, &sights, (FINE.bins / distant.len()).max(8))?);
            control.check()?;
        }
        let colours: Vec<[f64; 3]> = (0..start.surfaces.len()).map(|s| surface_colour(&start, s)).collect();
        let mut close_up = spec
            .of_role(Role::CloseUp)
            .next()
            .map(|p| CloseUp::new(p, &sights_of(p, spec, &start), &start, mean_period::uniform(&spec.material.geometry), &colours));
        if let Some(found) = &mut close_up {
            // Neither irradiance is exact.
            found.exposure_sigma =
                found.exposure_sigma.filter(|_| distant[0].exposure_known).map(|s| s.hypot(distant[0].irradiance_sigma()));
        }
        match &close_up {
            Some(found) => notes.extend(found.notes.iter().map(|n| format!("close-up: {n}"))),
            None => notes.push(
                "there is no close-up: from afar cover times colour is all that shows, and single colours are not to be trusted".to_owned(),
            ),
        }
        Ok(Self { spec, distant, coarse, fine, close_up, opaque, start, notes })
    }

    /// What the search moves.
    pub(super) fn variables(&self) -> Vec<Variable> {
        unknowns::variables(self.spec, self.close_up.as_ref())
    }

    /// How the photographs may be read.
    pub(super) fn variants(&self) -> Variants {
        let own = || vec![(0..self.start.surfaces.len()).collect()];
        let found = self.close_up.as_ref().filter(|c| !c.choices.is_empty());
        let likely = found.map_or_else(own, |c| c.choices.clone());
        let rest = found.map_or_else(Vec::new, |c| c.other_choices.clone());
        Variants::new(&self.spec.sides, own_sides(&self.spec.material.geometry), &likely, &rest)
    }
}

/// The pixels of a photograph that show its object, covered with the start material.
pub(super) fn sights_of(photograph: &Photograph, spec: &Spec, start: &SmallScale) -> Vec<Sight> {
    let scene = scene_of(photograph, &spec.material, start);
    sights(&World::opaque(&scene), photograph)
}

/// Whether no light passes the surface. Cloth always counts as open: its gaps may close and open while it moves.
fn is_opaque(material: &Material, tile: &Tile, control: &Control<'_>) -> Result<bool> {
    if matches!(material.geometry, Geometry::Weave(_)) {
        return Ok(false);
    }
    Ok(Opacity::of(tile, control)?.is_opaque())
}

/// What one surface looks like on the whole: its colours added up.
fn surface_colour(small: &SmallScale, surface: usize) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &colour in Slot::of(&small.surfaces[surface].brdf) {
        let c = unknowns::colour_of(small, Slot { surface, colour });
        (0..3).for_each(|k| sum[k] += c[k]);
    }
    sum
}
