//! The close-up's equations: its mean period, place by place, or else the cover, the light and the tones of each kind of its pixels, against those of a
//! period of the surface.

use crate::fit_file::variant::{SIDES_KEY, own_sides};
use crate::near_paths;
use crate::photograph::close_up::{CloseUp, Kind};
use crate::photograph::mean_period::MeanPeriod;
use crate::residuals::equations::{Origin, Row, huber};
use crate::residuals::model::{Model, Sorting};
use crate::residuals::registration::{self, Windows};
use crate::residuals::tile_view::{Part, TileView};
use crate::residuals::unknowns::{UnknownKind, colour_of};
use biscale::error::{Error, Result};
use biscale::filter::Control;
use biscale::filter::common_random_numbers::{Slot, SlotColour};
use biscale::geometry::Geometry;
use biscale::material::{MaterialValues, SmallScale};

/// Relative standard deviation of the light of a kind of pixels in the close-up: direct light only, and with reflections in between.
const LIGHT: [f64; 2] = [0.015, 0.025];
/// The same of its tones; neighbours tell nearly the same.
const TONE: [f64; 2] = [0.025, 0.035];
const TONE_WEIGHT: f64 = 0.5;
/// What all places of the mean period count together: the model errors of neighbours, and of three channels, are alike.
const PERIOD_WEIGHT: f64 = 160.0;
/// Rays along a period of the first look, which tells how high the edges lie.
const FIRST_LOOK: usize = 32;
/// Heights that are tried at first, and how often the step between them is halved.
const HEIGHTS: usize = 6;
const HALVINGS: usize = 5;
/// Standard deviation of what light between threads adds to a place, as a share of all of its light: where it is known from a state of the material nearby, and where it is not yet.
const TRACED: f64 = 0.02;
const UNTRACED: f64 = 0.1;
/// Sides of a thread from which on it is round.
const ROUND: u32 = 24;
/// Standard deviation of a cover.
const COVER: f64 = 0.015;

impl Model<'_> {
    /// One period as the close-up shows it, by as many rays as the model has samples; `None` without a close-up.
    pub(crate) fn near_view(&self, small: &SmallScale, control: &Control<'_>) -> Result<Option<TileView>> {
        let Some(close_up) = self.close_up.filter(|c| c.pair.is_some()) else { return Ok(None) };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a root of a count")]
        let size = f64::from(self.samples).sqrt().ceil() as usize;
        let blur = close_up.blur_in_periods(small.tile.period.to_array());
        self.view(close_up, small, self.height(), blur, size, control).map(Some)
    }

    fn view(
        &self,
        close_up: &CloseUp,
        small: &SmallScale,
        height: f64,
        blur: [f64; 2],
        size: usize,
        control: &Control<'_>,
    ) -> Result<TileView> {
        let round = matches!(self.spec.material.geometry, Geometry::Weave(_));
        TileView::new(small, &self.slots, (&close_up.pairs, height), blur, (size, round), self.seed, control)
    }

    /// The surface as it is seen from near, if it is another one: see [`Self::rounded_values`]. `None` as well where threads of so many sides
    /// make no surface, of too many triangles, say: the one of few sides stands in for it.
    ///
    /// # Errors
    /// Failures that are no matter of the numbers.
    pub(crate) fn rounded(&self, values: &MaterialValues) -> Result<Option<SmallScale>> {
        let Some(rounded) = self.rounded_values(values) else { return Ok(None) };
        match rounded.and_then(|values| values.material()?.build()) {
            Ok(small) => Ok(Some(small)),
            Err(Error::BadInput(_)) => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// A material as it is seen from near, if it is another one: threads are round there, however few sides this variant gives them for what is seen from afar.
    fn rounded_values(&self, values: &MaterialValues) -> Option<Result<MaterialValues>> {
        self.mean_period()?;
        let sides = self.variant.sides.or_else(|| own_sides(&self.spec.material.geometry))?;
        if sides >= ROUND || !matches!(self.spec.material.geometry, Geometry::Weave(_)) {
            return None;
        }
        let mut values = values.clone();
        Some(values.geometry.set_whole(SIDES_KEY, ROUND).map_err(Error::from).map(|()| values))
    }

    /// The mean height of the edges that the close-up would show of a surface: where its periods lie on top of each other, about.
    pub(crate) fn height_of_edges(&self, small: &SmallScale, control: &Control<'_>) -> Result<f64> {
        let Some(close_up) = self.close_up.filter(|_| self.mean_period().is_some()) else { return Ok(0.0) };
        let view = self.view(close_up, small, 0.0, [0.0; 2], FIRST_LOOK, control)?;
        Ok(view.height_of_edges(&self.colours_of_kinds(close_up, &view, small)))
    }

    /// What each slot's share is multiplied by, as far as the colours of the kinds tell.
    fn colours_of_kinds(&self, close_up: &CloseUp, view: &TileView, small: &SmallScale) -> Vec<[f64; 3]> {
        let apart = close_up.tells_surfaces_apart(small.surfaces.len());
        let colour = |(k, slot): (usize, &Slot)| {
            let share = view.mean_share(k, slot.surface);
            match self.variant.kinds.iter().position(|s| *s == slot.surface) {
                _ if slot.colour == SlotColour::Specular => [0.0; 3],
                Some(kind) if apart && share > 0.0 => close_up.kinds[kind].colour.map(|v| v / share),
                _ => [1.0; 3],
            }
        };
        self.slots.iter().enumerate().map(colour).collect()
    }

    /// Finds the height at which the periods of the close-up were laid on top of each other: the one at which the model's mean period is most like that of the photograph.
    /// It is a matter of the photograph, and the same for all states of the material; but none tells it before the material is nearly known. What the material explains worse than
    /// its noise counts less by as much from then on. Returns how often the objective was evaluated.
    ///
    /// # Errors
    /// Those of the model.
    pub fn settle_height(&mut self, point: &[f64], control: &Control<'_>) -> Result<usize> {
        if self.mean_period().is_none() {
            return Ok(0);
        }
        let state = self.state(point);
        let Some((values, small)) = self.surface(&state)? else { return Ok(0) };
        let near = self.rounded(&values)?;
        let Some([low, high]) = self.near_view(near.as_ref().unwrap_or(&small), control)?.and_then(|v| v.heights()) else {
            return Ok(0);
        };
        let mut step = (high - low) / HEIGHTS as f64;
        let mut tried: Vec<(f64, f64)> = Vec::new();
        let mut places: Vec<f64> = (0..=HEIGHTS).map(|k| low + step * k as f64).collect();
        for _ in 0..HALVINGS {
            for height in places {
                self.lay_at(height);
                tried.push((self.objective(point, control)?, height));
            }
            tried.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
            step *= 0.5;
            places = vec![tried[0].1 - step, tried[0].1 + step];
        }
        self.lay_at(tried[0].1);
        self.doubt = 1.0;
        if let Some(found) = self.evaluate(point, control)? {
            let near = || found.rows.iter().filter(|(_, origin)| *origin == Origin::CloseUp).map(|(row, _)| row);
            let (sum, count) = near().fold((0.0, 0.0), |(s, n), row| (s + row.weight * huber(found.residual(row)), n + row.weight));
            self.doubt = (sum / f64::max(count, f64::MIN_POSITIVE)).max(1.0).sqrt();
        }
        Ok(tried.len() + 1)
    }

    /// Light, tones and cover of the kinds of the close-up.
    pub(crate) fn close_up_rows(
        &self,
        close_up: &CloseUp,
        view: &TileView,
        small: &SmallScale,
        sorting: Sorting<'_>,
        (rows, fixed): (&mut Vec<(Row, Origin)>, &mut Vec<f64>),
    ) {
        let apart = close_up.tells_surfaces_apart(small.surfaces.len());
        let between = usize::from(self.indirect.is_some());
        let guess = match sorting {
            Sorting::Laid(shift, exposure) => {
                if let Some(mean) = self.mean_period() {
                    self.period_rows((close_up, mean), view, small, (shift, exposure), rows);
                }
                return;
            }
            Sorting::None => return self.whole_light_rows(close_up, view, small, rows),
            Sorting::BySurface => None,
            Sorting::ByColour(guess) => Some(guess),
        };
        let radiance = self.radiance(close_up, small, guess);
        let parts = view.sorted(&radiance, apart.then_some(&self.variant.kinds[..]), guess.is_some());
        for (k, (kind, part)) in close_up.kinds.iter().zip(&parts).enumerate() {
            let extra = |c: usize| match self.indirect {
                Some(indirect) => close_up.irradiance[c] * if apart { indirect.kinds[k][c] } else { indirect.close_up[c] },
                None => 0.0,
            };
            if apart {
                fixed.push((part.cover - kind.cover) / COVER);
            }
            if !close_up.exposure_known {
                continue;
            }
            for c in 0..3 {
                let (terms, known) = self.terms(|slot| close_up.irradiance[c] * part.light[slot][c], c, small);
                let sigma = LIGHT[between] * spread(kind.light, c);
                rows.push((Row { terms, known: known + extra(c), value: kind.light[c], sigma, weight: 1.0 }, Origin::CloseUp));
            }
            let light = |c: usize| (close_up.irradiance[c], extra(c) / kind.cover.max(0.05));
            self.tone_rows(kind, part, light, small, rows);
        }
    }

    /// The mean period of the close-up, where the model's own can be compared with it.
    pub fn mean_period(&self) -> Option<&MeanPeriod> {
        self.close_up?.mean_period.as_ref()
    }

    /// The shifts at which the model's period may lie on that of the close-up, as far as the colours of the kinds tell.
    pub(crate) fn laid(&self, view: &TileView, small: &SmallScale) -> Vec<[f64; 2]> {
        let (Some(close_up), Some(mean)) = (self.close_up, self.mean_period()) else { return Vec::new() };
        let radiance = self.colours_of_kinds(close_up, view, small);
        registration::coarse(&view.picture(&radiance), view.size, mean)
    }

    /// The same, where the colours are these, from a shift that is nearly right.
    pub(crate) fn laid_better(&self, view: &TileView, small: &SmallScale, linear: &[f64], shift: [f64; 2]) -> [f64; 2] {
        let (Some(close_up), Some(mean)) = (self.close_up, self.mean_period()) else { return shift };
        let mut picture = view.picture(&self.radiance(close_up, small, Some(linear)));
        let exposure = self.exposure(linear);
        if !self.between.is_empty() {
            let places = Windows::new(near_paths::SIZE, [view.size; 2], [0.0; 2]).of(&self.between);
            for (pixel, extra) in picture.iter_mut().zip(places) {
                (0..3).for_each(|c| pixel[c] += close_up.irradiance[c] * extra[c]);
            }
        }
        picture.iter_mut().flatten().for_each(|v| *v /= exposure);
        registration::refined(&picture, view.size, mean, &mean.sigma, shift)
    }

    /// What the share of each slot is multiplied by in the close-up.
    fn radiance(&self, close_up: &CloseUp, small: &SmallScale, guess: Option<&[f64]>) -> Vec<[f64; 3]> {
        let of = |slot: &Slot| {
            let colour = |c: usize| match (self.unknown(*slot, c), guess) {
                (Some(k), Some(guess)) => guess[k],
                _ => colour_of(small, *slot)[c],
            };
            std::array::from_fn(|c| close_up.irradiance[c] * colour(c))
        };
        self.slots.iter().map(of).collect()
    }

    /// The mean period, place by place.
    fn period_rows(
        &self,
        (close_up, mean): (&CloseUp, &MeanPeriod),
        view: &TileView,
        small: &SmallScale,
        (shift, exposure): ([f64; 2], f64),
        rows: &mut Vec<(Row, Origin)>,
    ) {
        let windows = Windows::new(view.size, mean.size, shift);
        let shares: Vec<Vec<[f64; 3]>> = view.shares.iter().map(|s| windows.of(s)).collect();
        let extra = if self.between.is_empty() { Vec::new() } else { Windows::new(near_paths::SIZE, mean.size, shift).of(&self.between) };
        let scales = self.unknowns.iter().position(|u| u.kind == UnknownKind::Exposure);
        let weight = PERIOD_WEIGHT / (3 * mean.mean.len()) as f64;
        let between = match (self.spec.bounces > 0, self.indirect.is_some()) {
            (false, _) => 0.0,
            (true, true) => TRACED,
            (true, false) => UNTRACED,
        };
        for (place, (&value, &sigma)) in mean.mean.iter().zip(&mean.sigma).enumerate() {
            for c in 0..3 {
                let (mut terms, known) = self.terms(|slot| close_up.irradiance[c] * shares[slot][place][c], c, small);
                let known = known + extra.get(place).map_or(0.0, |e| close_up.irradiance[c] * e[c]);
                let weight = if mean.count[place] > 0.0 { weight } else { 0.0 };
                let sigma = exposure * self.doubt * sigma[c].hypot(between * value[c]);
                // What is seen is known up to the exposure, which then belongs on the left.
                let value = match scales {
                    Some(k) => {
                        terms.push((k, -value[c]));
                        0.0
                    }
                    None => value[c],
                };
                rows.push((Row { terms, known, value, sigma, weight }, Origin::CloseUp));
            }
        }
    }

    /// The light of all kinds together.
    fn whole_light_rows(&self, close_up: &CloseUp, view: &TileView, small: &SmallScale, rows: &mut Vec<(Row, Origin)>) {
        if !close_up.exposure_known {
            return;
        }
        let whole = view.whole_light();
        for c in 0..3 {
            let (terms, known) = self.terms(|slot| close_up.irradiance[c] * whole[slot][c], c, small);
            let extra = self.indirect.map_or(0.0, |indirect| close_up.irradiance[c] * indirect.close_up[c]);
            let light: [f64; 3] = std::array::from_fn(|c| close_up.kinds.iter().map(|k| k.light[c]).sum());
            let sigma = LIGHT[usize::from(self.indirect.is_some())] * spread(light, c);
            rows.push((Row { terms, known: known + extra, value: light[c], sigma, weight: 1.0 }, Origin::CloseUp));
        }
    }

    /// The tones of a kind; `light` gives the irradiance and what is added in a channel.
    fn tone_rows(&self, kind: &Kind, part: &Part, light: impl Fn(usize) -> (f64, f64), small: &SmallScale, rows: &mut Vec<(Row, Origin)>) {
        let sigma = TONE[usize::from(self.indirect.is_some())];
        for (b, tone) in kind.tones.iter().enumerate() {
            for c in 0..3 {
                let (irradiance, extra) = light(c);
                let (terms, known) = self.terms(|slot| irradiance * part.tones[slot][b][c], c, small);
                let sigma = sigma * spread(*tone, c);
                rows.push((Row { terms, known: known + extra, value: tone[c], sigma, weight: TONE_WEIGHT }, Origin::CloseUp));
            }
        }
    }
}

/// The size that a channel's standard deviation is a share of: one that is nearly dark is not known to a share of itself.
fn spread(colour: [f64; 3], channel: usize) -> f64 {
    let whole = colour.iter().copied().fold(0.0, f64::max);
    colour[channel].hypot(0.3 * whole).max(1e-9)
}
