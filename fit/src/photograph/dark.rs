//! What a photograph says of its stray light: a constant light over all of it, from the lens, the room, or a lamp beside the picture.

use crate::photograph::image::Photograph;
use crate::photograph::params::PARAMS;
use crate::photograph::sight::{LEAST_COSINES, Sight};

/// What of a picture shows no light of its lamp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Dark {
    /// Median radiance of the pixels that face away from the light, if there are enough of them: what comes from elsewhere than from the light.
    pub unlit: Option<[f64; 3]>,
    /// Median radiance of the pixels beside the object, if there are enough of them: stray light lies over them, too, and is not more than
    /// that.
    pub background: Option<[f64; 3]>,
}

impl Dark {
    /// Of a photograph, of which `sights` are all pixels that show its object.
    pub fn of(photograph: &Photograph, sights: &[Sight]) -> Self {
        let rgb = &photograph.image.rgb;
        let faces_away = |s: &&Sight| s.wi.z <= PARAMS.unlit_cosine && s.wo.z >= LEAST_COSINES[1];
        let unlit = sights.iter().filter(faces_away).map(|s| rgb[s.pixel as usize]);
        Self { unlit: median(unlit), background: median(background(photograph, sights).map(|k| rgb[k])) }
    }

    /// Mean and standard deviation of the stray light of a channel, before the pixels of the object say anything of it; `mean` is their mean
    /// radiance. The median of unlit pixels is a camera's that stands a little off as well: it shows what is behind the object along its outline.
    pub fn prior(&self, mean: [f64; 3], channel: usize) -> [f64; 2] {
        let usual = PARAMS.stray_light * mean[channel];
        if let Some(unlit) = self.unlit {
            let [of_mean, of_seen] = PARAMS.stray_light_seen;
            let unlit = unlit.map(|v| v.max(0.0));
            return [unlit[channel], (of_mean * mean[channel]).hypot(of_seen * unlit[channel])];
        }
        match self.background {
            // Anything from nothing to all of what is there: a uniform distribution.
            Some(background) if UNIFORM * background[channel] < usual => {
                let floor = PARAMS.stray_light_seen[0] * mean[channel];
                [0.5 * background[channel].max(0.0), floor.hypot(UNIFORM * background[channel])]
            }
            _ => [0.0, usual],
        }
    }
}

/// Standard deviation of a uniform distribution over a range of 1, `1/sqrt(12)`.
const UNIFORM: f64 = 0.288_675_134_594_812_9;

/// The median of each channel of the pixels that are used, if there are enough.
fn median(pixels: impl Iterator<Item = [f32; 3]>) -> Option<[f64; 3]> {
    let seen: Vec<[f32; 3]> = pixels.filter(|v| !v[0].is_nan()).collect();
    let of = |c: usize| {
        let mut values: Vec<f32> = seen.iter().map(|v| v[c]).collect();
        let (_, value, _) = values.select_nth_unstable_by(seen.len() / 2, f32::total_cmp);
        f64::from(*value)
    };
    (seen.len() >= PARAMS.enough_unlit).then(|| std::array::from_fn(of))
}

/// Pixels that show nothing of the object, and none of whose neighbours do.
fn background(photograph: &Photograph, sights: &[Sight]) -> impl Iterator<Item = usize> {
    let (width, height) = (photograph.image.width as usize, photograph.image.height as usize);
    let mut shows = vec![false; width * height];
    let reach = PARAMS.background_margin;
    for sight in sights {
        let (x, y) = (sight.pixel as usize % width, sight.pixel as usize / width);
        for row in y.saturating_sub(reach)..(y + reach + 1).min(height) {
            shows[row * width + x.saturating_sub(reach)..row * width + (x + reach + 1).min(width)].fill(true);
        }
    }
    // A photograph that shows nothing of its object says nothing of what is beside it.
    let any = !sights.is_empty();
    (0..width * height).filter(move |&k| any && !shows[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unlit_pixels_tell_stray_light_and_a_background_bounds_it() {
        let mean = [1.0, 2.0, 4.0];
        assert_eq!(Dark::default().prior(mean, 1), [0.0, 2.0 * PARAMS.stray_light]);
        let seen = Dark { unlit: Some([0.1; 3]), background: Some([9.0; 3]) };
        let [value, sigma] = seen.prior(mean, 0);
        assert!(value == 0.1 && (sigma - 0.002_f64.hypot(0.04)).abs() < 1e-12, "{sigma}");
        // A black background leaves no room for any; a bright one says nothing.
        let behind = |background: f64| Dark { unlit: None, background: Some([background; 3]) };
        assert_eq!(behind(0.0).prior(mean, 0), [0.0, PARAMS.stray_light_seen[0]]);
        let [value, sigma] = behind(0.03).prior(mean, 0);
        assert!(value == 0.015 && (0.0086..0.0090).contains(&sigma), "{sigma}");
        assert_eq!(behind(0.5).prior(mean, 0), Dark::default().prior(mean, 0));
    }
}
