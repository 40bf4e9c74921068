//! The normals of a surface as a von Mises-Fisher mixture (Iwasaki et al. 2012, eq. 6), and groups of its lobes.
//!
//! Lobes that lie close together, and are as open as each other, see nearly the same. A pair needs one amplitude for a group of them, so that normals along an arc,
//! as threads and rods have them, can be a row of lobes without more numbers a pair. The *openness* of a facet is the share of the projected area facing the
//! queried directions that they see: the ground under rods is hardly open, their tops are, and both may have the same normals.

use crate::facets::NO_TRIANGLE;
use crate::filter::plan::{LobeCount, MAX_CHOSEN_LOBES};
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::cast::narrow;
use crate::numerics::clustering::{Weighted, k_means};
use crate::sg::{Lobe, Mixture, MixtureLobe, Order, WeightedDirection, distinct};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Facets whose normals are enough to fit lobes to: a few for each of the most lobes that a plan may have.
const FITTED_FACETS: usize = 4096;
/// Directions by which openness is told: it is a mean, and single directions do not count.
const OPEN_DIRECTIONS: usize = 256;
/// Groups are clusters of axes that are as long as the openness and this: of lobes that hardly see anything, too, the axes count.
const LEAST_RADIUS: f64 = 0.5;
/// Least openness: lobes that nothing sees still belong to a group.
const LEAST_OPENNESS: f64 = 1e-6;

/// Lobes of the normals of one surface.
#[derive(Clone, Debug, Default)]
pub struct NormalLobes {
    /// The mixture; its shares are of the surface's area.
    pub mixture: Mixture,
    /// Its lobes, as densities in 1/sr, with the group of each and its share of the group's area.
    pub lobes: Vec<GroupedLobe>,
    /// Groups.
    pub groups: usize,
    /// Whether each distinct normal has a lobe, so that more cannot be had.
    pub complete: bool,
}

/// A lobe of a group.
#[derive(Clone, Copy, Debug)]
pub struct GroupedLobe {
    /// With an integral of 1.
    pub density: Lobe,
    /// The group.
    pub group: usize,
    /// Share of the group's area, counted by how open it is.
    pub share: f32,
}

impl NormalLobes {
    /// `lobes` lobes of the facets `range`, or as many as they have distinct normals, in at most `groups` groups; `directions` are those that the bits are of.
    pub fn new(seen: &VisibleFacets, directions: &[DVec3], range: Range<usize>, lobes: LobeCount, groups: usize) -> Self {
        let facets = &seen.facets;
        let own: Vec<usize> = range.filter(|&f| facets.triangle[f] != NO_TRIANGLE).collect();
        let fitted: Vec<usize> = own.iter().copied().step_by(own.len().div_ceil(FITTED_FACETS).max(1)).collect();
        let direction = |&f: &usize| WeightedDirection { direction: facets.normal_of(f).as_dvec3(), weight: f64::from(facets.weight[f]) };
        let normals = distinct(&fitted.iter().map(direction).collect::<Vec<_>>());
        let order = match lobes {
            LobeCount::Fixed(lobes) => Order::Fixed(lobes),
            LobeCount::Criterion => Order::Criterion { most: MAX_CHOSEN_LOBES },
        };
        let mixture = Mixture::fit(&normals, order);
        let openness = openness(&mixture, seen, directions, &fitted);
        let open_area: Vec<f64> = mixture.lobes.iter().zip(&openness).map(|(lobe, open)| lobe.share * open).collect();
        let (labels, groups) = if groups < mixture.lobes.len() {
            let points = mixture.lobes.iter().zip(&openness).zip(&open_area);
            let point = |((lobe, open), weight): ((&MixtureLobe, &f64), &f64)| Weighted {
                point: (lobe.axis * (LEAST_RADIUS + open)).to_array(),
                weight: *weight,
            };
            k_means(&points.map(point).collect::<Vec<_>>(), groups)
        } else {
            ((0..mixture.lobes.len()).map(Some).collect(), mixture.lobes.len())
        };
        let mut of_group = vec![0.0; groups];
        for (open_area, group) in open_area.iter().zip(labels.iter().flatten()) {
            of_group[*group] += open_area;
        }
        let grouped = |((lobe, open_area), group): ((&MixtureLobe, &f64), &usize)| GroupedLobe {
            density: Lobe::density(lobe.axis.as_vec3().normalize_or(Vec3::Z), narrow(lobe.sharpness)),
            group: *group,
            share: narrow(open_area / of_group[*group]),
        };
        let lobes = mixture.lobes.iter().zip(&open_area).zip(labels.iter().flatten()).map(grouped).collect();
        Self { complete: mixture.lobes.len() >= normals.len(), mixture, lobes, groups }
    }
}

/// The openness of each lobe: the mean of some facets', each counted by what the lobe has of it.
fn openness(mixture: &Mixture, seen: &VisibleFacets, directions: &[DVec3], fitted: &[usize]) -> Vec<f64> {
    let facets = &seen.facets;
    let step = directions.len().div_ceil(OPEN_DIRECTIONS).max(1);
    let looked: Vec<(Vec3, &[u64])> = directions.iter().enumerate().step_by(step).map(|(d, w)| (w.as_vec3(), seen.bits.row(d))).collect();
    let (mut visible, mut facing) = (vec![0.0; mixture.lobes.len()], vec![0.0; mixture.lobes.len()]);
    let mut shares = vec![0.0; mixture.lobes.len()];
    for &f in fitted {
        let normal = facets.normal_of(f);
        let (mut sees, mut faces) = (0.0, 0.0);
        for (w, bits) in &looked {
            let cosine = f64::from(normal.dot(*w).max(0.0));
            faces += cosine;
            if bits[f / 64] >> (f % 64) & 1 == 1 {
                sees += cosine;
            }
        }
        mixture.responsibilities(normal.as_dvec3(), &mut shares);
        let weight = f64::from(facets.weight[f]);
        for ((visible, facing), share) in visible.iter_mut().zip(&mut facing).zip(&shares) {
            *visible += share * weight * sees;
            *facing += share * weight * faces;
        }
    }
    visible.iter().zip(facing).map(|(v, f)| if f > 0.0 { (v / f).max(LEAST_OPENNESS) } else { LEAST_OPENNESS }).collect()
}
