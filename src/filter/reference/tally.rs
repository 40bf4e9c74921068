//! Mean and error of a pair from the rays of its batches.

use super::rays::Sums;
use crate::direction::MIN_COSINE;
use crate::filter::plan::BATCHES;
use crate::filter::value::Value;
use crate::transport::lost_radiance;

/// The rays of one pair so far.
#[derive(Clone, Debug)]
pub(super) struct Tally {
    /// Rays of each batch.
    pub rays: u32,
    /// Light of each batch, and its rays that met a front face.
    batches: [([f64; 3], u32); BATCHES],
    /// Over all batches; see [`Sums`].
    doubtful: [f64; 3],
    range: [[f64; 3]; 2],
    brightest: [f64; 3],
    lost: u32,
    lost_bounces: [f64; 3],
}

/// Mean and error of one pair.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Estimate {
    /// Mean light of a ray, its standard error.
    light: [f64; 3],
    light_se: [f64; 3],
    /// Share of the rays that meet a front face.
    pub front: f64,
    pub fbar: [f64; 3],
    se: [f64; 3],
    /// By how much rays that were given up could change `fbar`: part of `se`.
    given_up: [f64; 3],
}

impl Default for Tally {
    fn default() -> Self {
        let Sums { doubtful, range, brightest, lost, lost_bounces, .. } = Sums::default();
        Self { rays: 0, batches: Default::default(), doubtful, range, brightest, lost, lost_bounces }
    }
}

impl Tally {
    /// Takes in sums of further rays of a batch.
    pub fn add(&mut self, batch: usize, sums: &Sums) {
        self.batches[batch].1 += sums.front;
        self.lost += sums.lost;
        for c in 0..3 {
            self.batches[batch].0[c] += sums.colour[c];
            self.doubtful[c] += sums.doubtful[c];
            self.lost_bounces[c] += sums.lost_bounces[c];
            self.brightest[c] = self.brightest[c].max(sums.brightest[c]);
            self.range[0][c] = self.range[0][c].min(sums.range[0][c]);
            self.range[1][c] = self.range[1][c].max(sums.range[1][c]);
        }
    }

    /// Mean and error of the rays so far.
    pub fn estimate(&self) -> Estimate {
        let n = f64::from(self.rays);
        let batches = BATCHES as f64;
        let rays = n * batches;
        let front_rays: u32 = self.batches.iter().map(|b| b.1).sum();
        if front_rays == 0 {
            return self.nothing_seen(rays);
        }
        let front = f64::from(front_rays) / rays;
        let mut estimate = Estimate { front, ..Estimate::default() };
        for c in 0..3 {
            let light = self.batches.iter().map(|b| b.0[c]).sum::<f64>() / rays;
            let q = light / front;
            // Spread of S_r - q a_r around its mean.
            let spread = |q: f64, mean: f64| {
                let squares: f64 = self.batches.iter().map(|b| ((b.0[c] - q * f64::from(b.1)) / n - mean).powi(2)).sum();
                squares / (batches * (batches - 1.0))
            };
            // Stratified rays can agree in all batches and yet be off by a part of a ray each. Sixteen batches that agree leave room
            // for a chance of up to 1/6 (95 %) that one ray of a batch should differ: no mean is known better than to what one ray
            // can change, a third of that.
            let least = if front_rays < rays as u32 { 0.0 } else { self.range[0][c] };
            let step = (self.range[1][c] - self.range[0][c]) / rays;
            let light_step = (self.range[1][c] - least) / rays;
            let change = self.given_up(c, q) / rays;
            estimate.light[c] = light;
            estimate.light_se[c] = (spread(0.0, light) + light_step * light_step + change * change).sqrt();
            estimate.fbar[c] = q;
            estimate.se[c] = (spread(q, 0.0) + step * step + change * change).sqrt() / front;
            estimate.given_up[c] = change / front;
        }
        estimate
    }

    /// Light of a channel that rays which were given up could have added to the sum over all rays, or taken from it. Light along them could be dark.
    /// A ray from the viewer could have met what the others meet on the mean, `mean`. One between two events could have met the brightest direct light
    /// that any ray saw: such rays lie close together, all of them nearly along the surface, and need not see what the mean ray sees.
    fn given_up(&self, channel: usize, mean: f64) -> f64 {
        let of_viewer = lost_radiance(mean) * f64::from(self.lost);
        self.doubtful[channel] + of_viewer + lost_radiance(self.brightest[channel]) * self.lost_bounces[channel]
    }

    /// The estimate where no ray met a front face: values of 0, in doubt if rays from the viewer were given up.
    fn nothing_seen(&self, rays: f64) -> Estimate {
        let in_doubt = if self.lost > 0 { lost_radiance(0.0) } else { 0.0 };
        let light_se = [in_doubt * f64::from(self.lost) / rays; 3];
        // The mean over what the viewer sees is that of the rays that were given up.
        Estimate { light_se, se: [in_doubt; 3], given_up: [in_doubt; 3], ..Estimate::default() }
    }
}

impl Estimate {
    /// Values for the cosines of the light and of the viewer.
    pub fn value(&self, light: f64, viewer: f64) -> Value {
        Value {
            s: self.light.map(|x| x * viewer),
            s_se: self.light_se.map(|x| x * viewer),
            fbar: self.fbar,
            se: self.se,
            fhat: self.fbar.map(|x| x / light.max(MIN_COSINE)),
            av: self.front * viewer,
        }
    }

    /// Squared error of `fbar` that more rays can take away.
    pub fn noise(&self) -> f64 {
        (self.se.iter().map(|x| x * x).sum::<f64>() - self.bias()).max(0.0)
    }

    /// Squared error of `fbar` that they cannot.
    pub fn bias(&self) -> f64 {
        self.given_up.iter().map(|x| x * x).sum()
    }
}
