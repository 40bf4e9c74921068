//! How a picture lit by its environment was made, and how far it is off.

use super::material::MaterialResponse;

/// How a material's response was found.
#[derive(Clone, Debug, PartialEq)]
pub struct ResponseReport {
    /// The method that ran.
    pub method: &'static str,
    /// Everything that fixes the values' bits beside the seed.
    pub plan: String,
    /// Rings of the grid of viewers.
    pub rings: usize,
    /// Texels along a side of the hemisphere.
    pub side: usize,
    /// Lobes of half vectors.
    pub lobes: usize,
    /// Pairs of directions that were computed.
    pub pairs: usize,
    /// Relative RMS error of the values, and of radiance under the environment turned at random.
    pub error: [f64; 2],
}

/// How far a picture is off: a small one of the same view, against the mean of two in which the environment is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PictureError {
    /// Lights of the two together.
    pub lights: u32,
    /// Pixels with an object that are compared.
    pub pixels: usize,
    /// Relative RMS difference from their mean.
    pub relative_rms: f64,
    /// The mean's own relative RMS error by the drawing of its lights: half the difference of the two.
    pub noise: f64,
}

/// How a picture lit by its environment was made.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentReport {
    /// Places at which arriving light is kept.
    pub sites: usize,
    /// Bytes of the prefiltered maps, and of the light at the sites.
    pub bytes: [usize; 2],
    /// For each material of the scene how its response was found.
    pub responses: Vec<ResponseReport>,
    /// How far the picture is off; none where no pixel of the small picture shows an object.
    pub error: Option<PictureError>,
}

impl ResponseReport {
    pub(super) fn of(response: &MaterialResponse) -> Self {
        Self {
            method: response.summary.method,
            plan: response.summary.plan_text(),
            rings: response.fineness.rings,
            side: response.fineness.side,
            lobes: response.lobes.len(),
            pairs: response.pairs,
            error: response.error,
        }
    }

    /// The whole relative RMS error.
    pub fn relative_rms(&self) -> f64 {
        self.error[0].hypot(self.error[1])
    }
}
