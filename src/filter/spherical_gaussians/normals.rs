//! The normals of a surface as a von Mises-Fisher mixture (Iwasaki et al. 2012, eq. 6).

use crate::facets::NO_TRIANGLE;
use crate::filter::plan::{LobeCount, MAX_CHOSEN_LOBES};
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::cast::narrow;
use crate::sg::{Lobe, Mixture, MixtureLobe, Order, WeightedDirection, distinct};
use glam::Vec3;
use std::ops::Range;

/// Facets whose normals lobes are fitted to: at least so many,
const FITTED_FACETS: usize = 4096;
/// and so many for each lobe. Chosen, not measured.
const FACETS_PER_LOBE: usize = 8;

/// Lobes of the normals of one surface.
#[derive(Clone, Debug, Default)]
pub struct NormalLobes {
    /// The mixture; its shares are of the surface's area.
    pub mixture: Mixture,
    /// Its lobes as densities, 1/sr.
    pub densities: Vec<Lobe>,
    /// Whether each distinct normal has a lobe, so that more cannot be had.
    pub complete: bool,
}

impl NormalLobes {
    /// `lobes` lobes of the facets `range`, or as many as they have distinct normals.
    pub fn new(seen: &VisibleFacets, range: Range<usize>, lobes: LobeCount) -> Self {
        let facets = &seen.facets;
        let own: Vec<usize> = range.filter(|&f| facets.triangle[f] != NO_TRIANGLE).collect();
        let enough = if let LobeCount::Fixed(lobes) = lobes { FITTED_FACETS.max(FACETS_PER_LOBE * lobes) } else { FITTED_FACETS };
        let fitted = own.iter().step_by(own.len().div_ceil(enough).max(1));
        let direction = |&f: &usize| WeightedDirection { direction: facets.normal_of(f).as_dvec3(), weight: f64::from(facets.weight[f]) };
        let normals = distinct(&fitted.map(direction).collect::<Vec<_>>());
        let order = match lobes {
            LobeCount::Fixed(lobes) => Order::Fixed(lobes),
            LobeCount::Criterion => Order::Criterion { most: MAX_CHOSEN_LOBES },
        };
        let mixture = Mixture::fit(&normals, order);
        let density = |lobe: &MixtureLobe| Lobe::density(lobe.axis.as_vec3().normalize_or(Vec3::Z), narrow(lobe.sharpness));
        Self { complete: mixture.lobes.len() >= normals.len(), densities: mixture.lobes.iter().map(density).collect(), mixture }
    }
}
