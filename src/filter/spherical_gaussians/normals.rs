//! The normals of a surface as a von Mises-Fisher mixture (Iwasaki et al. 2012, eq. 6), and groups of its lobes.
//!
//! Lobes that see the same need one amplitude a pair, so that normals along an arc, as threads and rods have them, can be a row of lobes without more numbers.
//! What they see is told by their *signature*: the visible share of their area from some of the queried directions. Within a group a lobe counts by its *openness*, the
//! share of its projected area facing the queried directions that they see: the ground under rods is hardly open, their tops are, and normals may be the same.

use crate::facets::NO_TRIANGLE;
use crate::filter::plan::{LobeCount, MAX_CHOSEN_LOBES};
use crate::filter::visible_facets::VisibleFacets;
use crate::numerics::cast::narrow;
use crate::numerics::clustering::{Weighted, k_means};
use crate::numerics::low_discrepancy::hash;
use crate::sg::{Lobe, Mixture, MixtureLobe, Order, WeightedDirection, distinct};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Facets whose normals are enough to fit lobes to: a few for each of the most lobes that a plan may have.
const FITTED_FACETS: usize = 4096;
/// Directions by which openness is told: it is a mean, and single directions do not count.
const OPEN_DIRECTIONS: usize = 256;
/// Directions of a signature, one of each stratum of like elevation.
const SIGNATURE: usize = 24;
/// Sharpness of the sharpest BRDF whose peaks count when lobes are grouped: sharper normals look alike to it. That of a GGX lobe of alpha .05.
const GLOSSY: f64 = 800.0;
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
        let visibility = LobeVisibility::new(&mixture, seen, directions, &fitted);
        let open_area: Vec<f64> = mixture.lobes.iter().zip(&visibility.openness).map(|(lobe, open)| lobe.share * open).collect();
        let (labels, groups) = if groups < mixture.lobes.len() {
            // A lobe of area `a` whose visible share is off by `d` errs by `(a d)²` times its integral of squares, which is about its sharpness.
            let weight = |lobe: &MixtureLobe| lobe.share * lobe.share * (lobe.sharpness * GLOSSY / (lobe.sharpness + GLOSSY));
            let point = |(lobe, signature): (&MixtureLobe, &[f64; SIGNATURE])| Weighted { point: *signature, weight: weight(lobe) };
            k_means(&mixture.lobes.iter().zip(&visibility.signatures).map(point).collect::<Vec<_>>(), groups)
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

/// What lobes see.
struct LobeVisibility {
    /// Share of the projected area facing the queried directions that they see.
    openness: Vec<f64>,
    /// Visible share of the lobe's area from each direction of the signature; 0 for directions that a shorter list lacks.
    signatures: Vec<[f64; SIGNATURE]>,
}

impl LobeVisibility {
    /// From some facets, each counted by what the lobe has of it.
    fn new(mixture: &Mixture, seen: &VisibleFacets, directions: &[DVec3], fitted: &[usize]) -> Self {
        let facets = &seen.facets;
        let step = directions.len().div_ceil(OPEN_DIRECTIONS).max(1);
        let looked: Vec<(Vec3, &[u64])> =
            directions.iter().enumerate().step_by(step).map(|(d, w)| (w.as_vec3(), seen.bits.row(d))).collect();
        let signature = signature_directions(directions);
        let count = mixture.lobes.len();
        let (mut visible, mut facing, mut area) = (vec![0.0; count], vec![0.0; count], vec![0.0; count]);
        let mut signatures = vec![[0.0; SIGNATURE]; count];
        let mut shares = vec![0.0; count];
        for &f in fitted {
            let normal = facets.normal_of(f);
            let is_seen = |bits: &[u64]| bits[f / 64] >> (f % 64) & 1 == 1;
            let (mut sees, mut faces) = (0.0, 0.0);
            for (w, bits) in &looked {
                let cosine = f64::from(normal.dot(*w).max(0.0));
                faces += cosine;
                if is_seen(bits) {
                    sees += cosine;
                }
            }
            mixture.responsibilities(normal.as_dvec3(), &mut shares);
            let weight = f64::from(facets.weight[f]);
            for (lobe, share) in shares.iter().enumerate().filter(|(_, share)| **share > 0.0) {
                visible[lobe] += share * weight * sees;
                facing[lobe] += share * weight * faces;
                area[lobe] += share * weight;
                for (k, d) in signature.iter().enumerate() {
                    if is_seen(seen.bits.row(*d)) {
                        signatures[lobe][k] += share * weight;
                    }
                }
            }
        }
        let openness =
            visible.iter().zip(facing).map(|(v, f)| if f > 0.0 { (v / f).max(LEAST_OPENNESS) } else { LEAST_OPENNESS }).collect();
        for (signature, area) in signatures.iter_mut().zip(area) {
            signature.iter_mut().for_each(|s| *s /= area.max(f64::MIN_POSITIVE));
        }
        Self { openness, signatures }
    }
}

/// Places of some of the directions: one of each stratum of like elevation, by chance, since grids repeat their azimuths.
fn signature_directions(directions: &[DVec3]) -> Vec<usize> {
    let mut rising: Vec<usize> = (0..directions.len()).collect();
    rising.sort_by(|&a, &b| directions[a].z.total_cmp(&directions[b].z).then(a.cmp(&b)));
    let strata = rising.chunks(directions.len().div_ceil(SIGNATURE).max(1));
    (0_u32..).zip(strata).map(|(k, stratum)| stratum[hash(k) as usize % stratum.len()]).collect()
}
