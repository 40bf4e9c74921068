//! Where samples go.

use super::surface::Surface;

/// Where samples go: a density along the surface, laid out as one line by cumulative area.
#[derive(Clone, Debug)]
pub struct Density {
    /// Share of the area of the triangles before each one, and 1 at the end.
    area: Vec<f64>,
    /// Area of the surface over the footprint.
    pub(super) total: f64,
    /// Share of the samples that go to the stretches before each one, and 1 at the end; all stretches have the same area.
    share: Vec<f64>,
}

impl Density {
    /// Samples in proportion to area.
    pub fn uniform(surface: &Surface) -> Self {
        let total: f64 = surface.areas.iter().sum();
        let mut sum = 0.0;
        let mut area = vec![0.0];
        area.extend(surface.areas.iter().map(|a| {
            sum += a;
            sum / total
        }));
        Self { area, total: total / surface.footprint(), share: vec![0.0, 1.0] }
    }

    /// Samples in proportion to area times `importance`, one positive number for each of as many stretches of equal area.
    #[must_use]
    pub fn weighted(&self, importance: &[f64]) -> Self {
        let total: f64 = importance.iter().sum();
        let mut sum = 0.0;
        let mut share = vec![0.0];
        share.extend(importance.iter().map(|i| {
            sum += i;
            sum / total
        }));
        Self { share, ..self.clone() }
    }

    /// Where the share `at` of the samples ends: the triangle, how far into its area, and what area over the footprint a sample there
    /// stands for, times the number of samples; and how far along the whole area this is.
    pub(super) fn locate(&self, at: f64) -> (usize, f64, f64, f64) {
        let stretch = |cumulative: &[f64], at: f64| {
            let k = cumulative.partition_point(|&c| c <= at).clamp(1, cumulative.len() - 1) - 1;
            (k, ((at - cumulative[k]) / (cumulative[k + 1] - cumulative[k])).clamp(0.0, 1.0))
        };
        let (k, along) = stretch(&self.share, at);
        let stretches = (self.share.len() - 1) as f64;
        let weight = self.total / (stretches * (self.share[k + 1] - self.share[k]));
        let place = (k as f64 + along) / stretches;
        let (triangle, along) = stretch(&self.area, place);
        (triangle, along, weight, place)
    }
}
