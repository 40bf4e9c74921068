//! The close-up's equations: the cover, the light and the tones of each kind of its pixels, against those of a period of the surface.

use crate::close_up::{CloseUp, Kind};
use crate::model::{Model, Origin, Row, Sorting};
use crate::tile_view::{Part, TileView};
use crate::unknowns::colour_of;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::geometry::Geometry;
use biscale::material::SmallScale;

/// Relative standard deviation of the light of a kind of pixels in the close-up: direct light only, and with reflections in between.
const LIGHT: [f64; 2] = [0.015, 0.025];
/// The same of its tones; neighbours tell nearly the same.
const TONE: [f64; 2] = [0.025, 0.035];
const TONE_WEIGHT: f64 = 0.5;
/// Standard deviation of a cover.
const COVER: f64 = 0.015;

impl Model<'_> {
    /// One period as the close-up shows it, by as many rays as the model has samples; `None` without a close-up.
    pub(crate) fn near_view(&self, small: &SmallScale, control: &Control<'_>) -> Result<Option<TileView>> {
        let Some((close_up, pair)) = self.close_up.and_then(|c| Some((c, c.pair?))) else { return Ok(None) };
        let blur = close_up.blur_in_periods(small.tile.period.to_array());
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a root of a count")]
        let size = f64::from(self.samples).sqrt().ceil() as usize;
        let round = matches!(self.spec.material.geometry, Geometry::Weave(_));
        TileView::new(small, &self.slots, pair, blur, (size, round), self.seed, control).map(Some)
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
            Sorting::None => return self.whole_light_rows(close_up, view, small, rows),
            Sorting::BySurface => None,
            Sorting::ByColour(guess) => Some(guess),
        };
        let radiance: Vec<[f64; 3]> = (self.slots.iter())
            .map(|slot| {
                let colour = |c: usize| match (self.unknown(*slot, c), guess) {
                    (Some(k), Some(guess)) => guess[k],
                    _ => colour_of(small, *slot)[c],
                };
                std::array::from_fn(|c| close_up.irradiance[c] * colour(c))
            })
            .collect();
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
