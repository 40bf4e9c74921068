//! One period of the model as the close-up sees it, and where the close-up's mean period is registered on it.

use crate::fit_file::variant::{SIDES_KEY, own_sides};
use crate::photograph::close_up::CloseUp;
use crate::photograph::mean_period::MeanPeriod;
use crate::residuals::close_up::{CloseUpResiduals, Comparison, NearInterreflection};
use crate::residuals::colour_basis::ColourBasis;
use crate::residuals::input::{Interreflection, ModelInput, Sampling};
use crate::residuals::near_interreflection;
use crate::residuals::params::PARAMS;
use crate::residuals::registration::{self, Windows};
use crate::residuals::state::State;
use crate::residuals::tile_view::{TileView, ViewParams};
use crate::residuals::unknowns::Shot;
use biscale::error::{Error, Result};
use biscale::filter::Control;
use biscale::filter::{Slot, SlotColour};
use biscale::geometry::Geometry;
use biscale::material::{MaterialValues, SmallScale};

/// The part of a model that stands beside the close-up.
pub(crate) struct NearModel<'a> {
    pub(crate) close_up: &'a CloseUp,
    input: ModelInput<'a>,
    sampling: Sampling,
    slots: Vec<Slot>,
    /// What the standard deviations of the mean period are multiplied by: how badly the material explains it, at least 1.
    pub(crate) doubt: f64,
    /// Height at which the periods of the close-up were registered.
    height: f64,
    /// Interreflection texel by texel of the period, at that height.
    interreflection: Vec<[f64; 3]>,
}

impl<'a> NearModel<'a> {
    /// `None` without a close-up.
    pub(crate) fn new(input: ModelInput<'a>, sampling: Sampling, slots: Vec<Slot>) -> Option<Self> {
        let close_up = input.close_up?;
        let mut near = Self { close_up, input, sampling, slots, doubt: 1.0, height: 0.0, interreflection: Vec::new() };
        near.register_at(0.0);
        Some(near)
    }

    /// The mean period of the close-up, where the model's own can be compared with it.
    pub(crate) fn mean_period(&self) -> Option<&'a MeanPeriod> {
        self.close_up.mean_period.as_ref()
    }

    /// Height at which the periods of the close-up were registered.
    pub(crate) fn height(&self) -> f64 {
        self.height
    }

    /// Registers the periods of the close-up at a height.
    pub(crate) fn register_at(&mut self, height: f64) {
        self.height = height;
        self.interreflection = match self.input.interreflection {
            Some(found) if !found.near.is_empty() => near_interreflection::registered_at(&found.near, height),
            _ => Vec::new(),
        };
    }

    /// One period as the close-up shows it under the light and with the blur of a state, by as many rays as the model has samples; `None` where
    /// the close-up shows nothing.
    pub(crate) fn view(&self, small: &SmallScale, state: &State, control: &Control<'_>) -> Result<Option<TileView>> {
        if self.close_up.middle.is_none() {
            return Ok(None);
        }
        let size = root_above(self.sampling.samples);
        let blur = self.close_up.blur_in_periods(small.tile.period.to_array()).map(|blur| state.blur * blur);
        let params = ViewParams { size, round: self.is_weave(), blur, height: self.height, seed: self.sampling.seed };
        TileView::new(small, &self.slots, &self.close_up.pairs(state.near_light), &params, control).map(Some)
    }

    fn is_weave(&self) -> bool {
        matches!(self.input.spec.material.geometry, Geometry::Weave(_))
    }

    /// The surface as it is seen from near, if it is another one: see [`Self::rounded_values`]. `None` as well where threads of so many sides
    /// make no surface, of too many triangles, say: the one of few sides stands in for it.
    ///
    /// # Errors
    /// Failures that are no matter of the numbers.
    pub(crate) fn rounded(&self, values: &MaterialValues) -> Result<Option<SmallScale>> {
        let Some(rounded) = self.rounded_values(values) else { return Ok(None) };
        surface_of(rounded.and_then(|values| values.material()?.build()))
    }

    /// A material as it is seen from near, if it is another one: threads are round there, however few sides this variant gives them for what
    /// is seen from afar.
    fn rounded_values(&self, values: &MaterialValues) -> Option<Result<MaterialValues>> {
        self.mean_period()?;
        let sides = self.input.variant.sides.or_else(|| own_sides(&self.input.spec.material.geometry))?;
        if sides >= PARAMS.round_sides || !self.is_weave() {
            return None;
        }
        let mut values = values.clone();
        Some(values.geometry.set_whole(SIDES_KEY, PARAMS.round_sides).map_err(Error::from).map(|()| values))
    }

    /// The mean height of the edges that the close-up would show of a surface: where its periods are registered, about.
    pub(crate) fn height_of_edges(&self, small: &SmallScale, control: &Control<'_>) -> Result<f64> {
        if self.mean_period().is_none() {
            return Ok(0.0);
        }
        let params = ViewParams { size: PARAMS.edge_rays, round: self.is_weave(), blur: [0.0; 2], height: 0.0, seed: self.sampling.seed };
        let view = TileView::new(small, &self.slots, &self.close_up.pairs([0.0; 2]), &params, control)?;
        Ok(view.height_of_edges(&self.colours_of_clusters(&view, small.surfaces.len())))
    }

    /// What each slot's basis reflectance is multiplied by, as far as the colours of the clusters tell.
    fn colours_of_clusters(&self, view: &TileView, surfaces: usize) -> Vec<[f64; 3]> {
        let apart = self.close_up.tells_surfaces_apart(surfaces);
        let colour = |(k, slot): (usize, &Slot)| {
            let share = view.mean_basis(k, slot.surface);
            match self.input.variant.clusters.iter().position(|s| *s == slot.surface) {
                _ if slot.colour == SlotColour::Specular => [0.0; 3],
                Some(cluster) if apart && share > 0.0 => self.close_up.clusters[cluster].colour.map(|v| v / share),
                _ => [1.0; 3],
            }
        };
        self.slots.iter().enumerate().map(colour).collect()
    }

    /// The shifts at which the model's period may be registered with that of the close-up, as far as the colours of the clusters tell.
    pub(crate) fn coarse_shifts(&self, view: &TileView, surfaces: usize) -> Vec<[f64; 2]> {
        let Some(mean) = self.mean_period() else { return Vec::new() };
        registration::coarse(&view.picture(&self.colours_of_clusters(view, surfaces)), view.size, mean)
    }

    /// The same, where the linear unknowns are these, from a shift that is nearly right.
    pub(crate) fn refined_shift(&self, view: &TileView, basis: &ColourBasis<'_>, linear: &[f64], shift: [f64; 2]) -> [f64; 2] {
        let Some(mean) = self.mean_period() else { return shift };
        let irradiance = self.close_up.irradiance;
        let mut picture = view.picture(&basis.radiance(irradiance, Some(linear)));
        let exposure = basis.exposure(linear);
        if !self.interreflection.is_empty() {
            let texels = Windows::new(near_interreflection::SIZE, [view.size; 2], [0.0; 2]).of(&self.interreflection);
            for (pixel, interreflection) in picture.iter_mut().zip(texels) {
                (0..3).for_each(|c| pixel[c] += irradiance[c] * interreflection[c]);
            }
        }
        let stray_light = basis.stray_light(Shot::CloseUp, linear);
        picture.iter_mut().for_each(|pixel| (0..3).for_each(|c| pixel[c] = (pixel[c] + stray_light[c]) / exposure));
        registration::refined(&picture, view.size, mean, &mean.sigma, shift)
    }

    /// The residuals of a state of which this is the view.
    pub(crate) fn residuals<'b>(&'b self, view: &'b TileView, comparison: Comparison<'b>) -> CloseUpResiduals<'b> {
        let interreflection: Option<&Interreflection> = self.input.interreflection;
        let sigma = match (self.input.spec.bounces > 0, interreflection.is_some()) {
            (false, _) => 0.0,
            (true, true) => PARAMS.traced,
            (true, false) => PARAMS.untraced,
        };
        CloseUpResiduals {
            close_up: self.close_up,
            view,
            comparison,
            surfaces: &self.input.variant.clusters,
            interreflection: NearInterreflection {
                traced: interreflection.is_some(),
                whole: interreflection.map_or([0.0; 3], |i| i.close_up),
                clusters: interreflection.map_or(&[], |i| &i.clusters),
                texels: &self.interreflection,
                sigma,
            },
            doubt: self.doubt,
        }
    }
}

/// The least whole number whose square is not below a count.
fn root_above(count: u32) -> usize {
    let root = (count as usize).isqrt();
    if root * root == count as usize { root } else { root + 1 }
}

/// What was built of the numbers of a state; `None` if they make no surface.
pub(crate) fn surface_of<T>(built: Result<T>) -> Result<Option<T>> {
    match built {
        Ok(built) => Ok(Some(built)),
        Err(Error::BadInput(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::error::BadInput;

    #[test]
    fn only_bad_numbers_make_no_surface() {
        assert!(matches!(surface_of(Ok(5)), Ok(Some(5))));
        assert!(matches!(surface_of::<u32>(Err(BadInput::new("too wide", "make it narrower").into())), Ok(None)));
        assert!(matches!(surface_of::<u32>(Err(Error::Interrupted)), Err(Error::Interrupted)));
        assert!(matches!(surface_of::<u32>(Err(Error::Numeric("no".into()))), Err(Error::Numeric(_))));
    }

    #[test]
    fn a_view_has_at_least_as_many_rays_as_samples() {
        for (samples, size) in [(1024, 32), (4096, 64), (8192, 91), (1, 1), (2, 2)] {
            assert_eq!(root_above(samples), size);
        }
    }
}
