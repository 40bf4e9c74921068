//! Interreflection: what is reflected more than once, as the photographs show it and direct light does not.
//!
//! It is found by tracing paths for one state of the material, and added to the model as it is while the search moves on; then it is found again.

use crate::photograph::close_up::{CloseUp, ColourCluster};
use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::input::Interreflection;
use crate::residuals::near_interreflection::{self, InterreflectionView, PathOptions, interreflection_views};
use crate::residuals::params::PARAMS;
use crate::residuals::tile_view::smooth_colours;
use biscale::direction::Pair;
use biscale::error::Result;
use biscale::filter::{Control, Method, Quality, effective};
use biscale::material::SmallScale;
use biscale::numerics::cast::truncate_i64;
use biscale::visibility::MAX_PERIODS;
use glam::DVec3;

/// A close-up, and the surface as it is seen from near: threads are round there.
#[derive(Clone, Copy)]
pub struct NearScene<'a> {
    /// The photograph.
    pub close_up: &'a CloseUp,
    /// Degrees of azimuth and elevation that its light is turned by.
    pub light: [f64; 2],
    /// The surface.
    pub small: &'a SmallScale,
}

/// How a close-up is compared, and so traced.
enum NearComparison<'a> {
    /// Not at all: it shows nothing, or there is none.
    None,
    /// Its mean period, texel by texel.
    ByTexel(NearScene<'a>),
    /// Its colour clusters, seen as in the middle of the picture.
    ByCluster(&'a CloseUp, Pair),
}

/// Pairs whose directions are near one another; one pair stands for all of a group, since interreflection changes slowly with directions.
struct PairGroups {
    /// The group of each pair.
    group: Vec<usize>,
    /// The mean directions of each group.
    middles: Vec<Pair>,
}

/// The interreflection of a material in the bins of the distant photographs, whose lights are turned by `lights`, and in the close-up.
///
/// # Errors
/// Those of the filter.
pub fn trace_interreflection(
    small: &SmallScale,
    photographs: &[DirectionBins],
    lights: &[[f64; 2]],
    near: Option<NearScene<'_>>,
    options: PathOptions,
    control: &Control<'_>,
) -> Result<Interreflection> {
    let mut pairs: Vec<Pair> = photographs.iter().zip(lights).flat_map(|(bins, light)| bins.pairs(*light)).collect();
    let near = NearComparison::of(near);
    if let NearComparison::ByCluster(_, pair) = near {
        pairs.push(pair);
    }
    let groups = PairGroups::of(&pairs);
    let (mean, mut notes) = mean_interreflection(small, &groups.middles, options, control)?;
    let mut of_pairs = groups.group.iter().map(|&g| mean[g]);
    let mut found = Interreflection { bins: of_bins(photographs, &mut of_pairs), ..Interreflection::default() };
    match near {
        NearComparison::None => {}
        NearComparison::ByTexel(scene) => {
            found.near = near_views(scene, options, control)?;
            notes.extend(given_up_note(&found.near));
        }
        NearComparison::ByCluster(close_up, pair) => {
            // The pair of the close-up is the last one. S over the cosine is radiance over irradiance.
            let inverse_cosine = 1.0 / pair.wo.z;
            found.close_up = of_pairs.next().unwrap_or_default().map(|v| v * inverse_cosine);
            found.clusters = of_clusters(close_up, found.close_up);
        }
    }
    found.notes = notes;
    Ok(found)
}

impl<'a> NearComparison<'a> {
    /// What is compared texel by texel is traced texel by texel.
    fn of(near: Option<NearScene<'a>>) -> Self {
        match near {
            Some(scene) if scene.close_up.mean_period.is_some() => {
                if scene.close_up.parts.is_empty() {
                    Self::None
                } else {
                    Self::ByTexel(scene)
                }
            }
            Some(NearScene { close_up, light, .. }) => {
                close_up.middle.map_or(Self::None, |middle| Self::ByCluster(close_up, middle.pair(light)))
            }
            None => Self::None,
        }
    }
}

impl PairGroups {
    /// Groups by a grid of [`PARAMS`]`.interreflection_step`.
    fn of(pairs: &[Pair]) -> Self {
        let key = |p: &Pair| [p.wi.x, p.wi.y, p.wo.x, p.wo.y].map(|v| truncate_i64((v / PARAMS.interreflection_step).round()));
        let mut keys: Vec<[i64; 4]> = pairs.iter().map(key).collect();
        keys.sort_unstable();
        keys.dedup();
        let group: Vec<usize> = pairs.iter().map(|p| keys.binary_search(&key(p)).expect("collected above")).collect();
        let mut sums = vec![(DVec3::ZERO, DVec3::ZERO); keys.len()];
        for (pair, &g) in pairs.iter().zip(&group) {
            sums[g].0 += pair.wi;
            sums[g].1 += pair.wo;
        }
        let middles = sums.iter().map(|(wi, wo)| Pair { wi: wi.normalize(), wo: wo.normalize() }).collect();
        Self { group, middles }
    }
}

/// The part of `S` of each pair that was reflected more than once, and what a user should know of it.
fn mean_interreflection(
    small: &SmallScale,
    pairs: &[Pair],
    PathOptions { bounces, seed }: PathOptions,
    control: &Control<'_>,
) -> Result<(Vec<[f64; 3]>, Vec<String>)> {
    let tolerance = PARAMS.interreflection_tolerance;
    let quality = |bounces| Quality { method: Method::Reference, tolerance, seed, bounces: Some(bounces), ..Quality::default() };
    let whole = effective(small, pairs, &quality(bounces), control)?;
    let direct = effective(small, pairs, &quality(0), control)?;
    let difference = whole.values.iter().zip(&direct.values).map(|(w, d)| std::array::from_fn(|c| (w.s[c] - d.s[c]).max(0.0)));
    let notes = if whole.summary.relative_rms > tolerance { whole.summary.notes } else { Vec::new() };
    Ok((difference.collect(), notes.into_iter().map(|note| format!("interreflection: {note}")).collect()))
}

/// The interreflection of each bin as radiance over irradiance, from the values of `S` of their pairs, photograph after photograph.
fn of_bins(photographs: &[DirectionBins], of_pairs: &mut impl Iterator<Item = [f64; 3]>) -> Vec<Vec<[f64; 3]>> {
    let of_photograph = |bins: &DirectionBins| {
        let values = bins.bins.iter().zip(of_pairs.by_ref());
        values.map(|(bin, s)| s.map(|v| v * bin.inverse_cosine)).collect()
    };
    photographs.iter().map(of_photograph).collect()
}

/// Each cluster gets as much of the whole as of all light: what shines on it is what its neighbours send.
fn of_clusters(close_up: &CloseUp, whole: [f64; 3]) -> Vec<[f64; 3]> {
    let light: [f64; 3] = std::array::from_fn(|c| close_up.clusters.iter().map(|k| k.light[c]).sum());
    let share = |k: &ColourCluster| std::array::from_fn(|c| if light[c] > 0.0 { whole[c] * k.light[c] / light[c] } else { 0.0 });
    close_up.clusters.iter().map(share).collect()
}

/// What the viewers of the close-up see, blurred as the camera blurs.
fn near_views(
    NearScene { close_up, light, small }: NearScene<'_>,
    options: PathOptions,
    control: &Control<'_>,
) -> Result<Vec<InterreflectionView>> {
    let mut views = interreflection_views(small, &close_up.pairs(light), options, control)?;
    let blur = close_up.blur_in_periods(small.tile.period.to_array());
    views.iter_mut().for_each(|view| smooth_colours(&mut view.picture, near_interreflection::SIZE, blur));
    Ok(views)
}

/// What a user should know of rays that were given up, if they could change more than the tolerance that the other photographs are traced to.
fn given_up_note(views: &[InterreflectionView]) -> Option<String> {
    let most = views.iter().map(|view| view.given_up_share).fold(0.0, f64::max);
    (most > PARAMS.interreflection_tolerance).then(|| {
        format!(
            "interreflection: up to {:.0} % of what the close-up shows of it could be otherwise: rays passed {MAX_PERIODS} periods and count as free",
            100.0 * most.min(1.0)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::photograph::close_up::Directions;
    use crate::photograph::mean_period::MeanPeriod;
    use crate::residuals::colour_basis::tests::Grooves;
    use crate::residuals::near_interreflection::tests::floor_under_wall;

    const OPTIONS: PathOptions = PathOptions { bounces: 2, seed: 5 };

    fn traced(close_up: &CloseUp) -> Interreflection {
        let grooves = Grooves::new();
        let near = NearScene { close_up, light: [0.0; 2], small: &grooves.small };
        trace_interreflection(&grooves.small, &[], &[], Some(near), OPTIONS, &Control::quiet()).unwrap()
    }

    /// A close-up from straight above.
    fn lit_by(wi: DVec3) -> CloseUp {
        let middle = Directions { wi: wi.normalize(), turn: [DVec3::ZERO; 2], wo: DVec3::Z };
        CloseUp { middle: Some(middle), parts: vec![middle], mean_period: Some(MeanPeriod::default()), ..CloseUp::default() }
    }

    #[test]
    fn rays_that_are_given_up_are_told_where_their_light_counts() {
        let mut found = traced(&lit_by(DVec3::new(0.2, 0.1, 1.0)));
        assert!(found.near.len() == 1 && found.notes.is_empty(), "{:?}", found.notes);
        // What such rays change is counted where they are traced: `near_interreflection`.
        found.near[0].given_up_share = 0.5 * PARAMS.interreflection_tolerance;
        assert_eq!(given_up_note(&found.near), None);
        found.near[0].given_up_share = 0.25;
        let note = given_up_note(&found.near).unwrap();
        assert!(note.contains("25 %") && note.contains("65536 periods"), "{note}");
    }

    #[test]
    fn distant_interreflection_that_misses_its_tolerance_is_told() {
        let close_up = CloseUp { mean_period: None, ..lit_by(DVec3::new(0.0, 0.3, 1.0)) };
        let notes = |distance: f64| {
            let small = floor_under_wall(distance);
            let near = NearScene { close_up: &close_up, light: [0.0; 2], small: &small };
            trace_interreflection(&small, &[], &[], Some(near), OPTIONS, &Control::quiet()).unwrap().notes
        };
        assert!(notes(0.1).is_empty(), "{:?}", notes(0.1));
        // On the way to walls 1e4 above the floor 2 % of its rays are given up, with all that they could have brought.
        let far = notes(1e4).join("; ");
        assert!(far.contains("interreflection: rays of 1 pairs passed 65536 periods"), "{far}");
        assert!(far.contains("interreflection: the tolerance of 1.0 % is not met: rays that are given up"), "{far}");
    }

    #[test]
    fn clusters_share_what_the_middle_of_the_picture_shows() {
        let cluster = |light| ColourCluster { cover: 0.5, light: [light; 3], colour: [0.0; 3], tones: Vec::new() };
        let close_up = CloseUp { mean_period: None, clusters: vec![cluster(0.3), cluster(0.1)], ..lit_by(DVec3::Z) };
        let found = traced(&close_up);
        assert!(found.near.is_empty() && found.close_up.iter().all(|v| *v > 0.0), "{found:?}");
        for c in 0..3 {
            let [bright, dark] = [0, 1].map(|k| found.clusters[k][c] / found.close_up[c]);
            assert!((bright - 0.75).abs() < 1e-12 && (dark - 0.25).abs() < 1e-12, "{bright} and {dark}");
        }
    }

    #[test]
    fn pairs_in_one_cell_of_the_grid_are_one_group() {
        let pair = |x: f64| Pair { wi: DVec3::new(x, 0.0, 1.0).normalize(), wo: DVec3::Z };
        let groups = PairGroups::of(&[pair(0.5), pair(0.0), pair(0.02)]);
        assert_eq!((groups.group, groups.middles.len()), (vec![1, 0, 0], 2));
        assert!((groups.middles[0].wi.x - 0.01).abs() < 1e-4, "{:?}", groups.middles[0]);
    }
}
