//! Interreflections: what is reflected more than once, as the photographs show it and direct light does not.
//!
//! It is found by tracing paths for one state of the material, and added to the model as it is while the search moves on; then it is found again.

use crate::near_paths;
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::input::Indirect;
use crate::residuals::params::PARAMS;
use crate::residuals::tile_view::smooth_colours;
use biscale::direction::Pair;
use biscale::error::Result;
use biscale::filter::{Control, Method, Quality, effective};
use biscale::material::SmallScale;
use biscale::numerics::cast::{halves, truncate_i64};

/// The indirect light of a material in the bins of the distant photographs, whose lights are turned by `lights`, and in the close-up, where the surface is the one beside it: the same with
/// round threads.
///
/// # Errors
/// Those of the filter.
pub fn indirect(
    small: &SmallScale,
    photographs: &[DirectionBins],
    lights: &[[f64; 2]],
    close_up: Option<(&CloseUp, &SmallScale)>,
    (bounces, seed): (u32, u64),
    control: &Control<'_>,
) -> Result<Indirect> {
    let mut pairs: Vec<Pair> = photographs.iter().zip(lights).flat_map(|(bins, light)| bins.pairs(*light)).collect();
    let of_cells = pairs.len();
    // What is compared place by place is traced place by place.
    let (laid, sorted): (Option<_>, Option<_>) = match close_up {
        Some((found, near)) if found.mean_period.is_some() => ((!found.pairs.is_empty()).then_some((found, near)), None),
        other => (None, other.and_then(|(found, _)| Some((found, found.pair?)))),
    };
    if let Some((_, pair)) = sorted {
        pairs.push(pair);
    }
    // It changes slowly with the directions: one pair stands for those around it.
    let key = |p: &Pair| [p.wi.x, p.wi.y, p.wo.x, p.wo.y].map(|v| truncate_i64((v / PARAMS.interreflection_step).round()));
    let mut places: Vec<[i64; 4]> = pairs.iter().map(key).collect();
    places.sort_unstable();
    places.dedup();
    let group: Vec<usize> = pairs.iter().map(|p| places.binary_search(&key(p)).expect("collected above")).collect();
    let mut sums = vec![(glam::DVec3::ZERO, glam::DVec3::ZERO); places.len()];
    for (pair, &g) in pairs.iter().zip(&group) {
        sums[g].0 += pair.wi;
        sums[g].1 += pair.wo;
    }
    let middles: Vec<Pair> = sums.iter().map(|(wi, wo)| Pair { wi: wi.normalize(), wo: wo.normalize() }).collect();
    let quality =
        |bounces| Quality { method: Method::Reference, tolerance: PARAMS.interreflection_tolerance, seed, bounces, ..Quality::default() };
    let whole = effective(small, &middles, &quality(bounces), control)?.values;
    let direct = effective(small, &middles, &quality(0), control)?.values;
    let extra: Vec<[f64; 3]> = whole.iter().zip(&direct).map(|(w, d)| std::array::from_fn(|c| (w.s[c] - d.s[c]).max(0.0))).collect();
    // S over the cosine is radiance over irradiance.
    let of = |at: usize, inverse: f64| extra[group[at]].map(|v| v * inverse);
    let mut first = 0;
    let bins = photographs
        .iter()
        .map(|bins| {
            let found = bins.bins.iter().enumerate().map(|(k, bin)| of(first + k, bin.inverse_cosine)).collect();
            first += bins.bins.len();
            found
        })
        .collect();
    let mut indirect = Indirect { bins, ..Indirect::default() };
    if let Some((close_up, pair)) = sorted {
        indirect.close_up = of(of_cells, 1.0 / pair.wo.z);
        // Each cluster gets as much of it as of all light: what shines on it is what its neighbours send.
        let all: [f64; 3] = std::array::from_fn(|c| close_up.clusters.iter().map(|k| k.light[c]).sum());
        let share = |k: &crate::photograph::close_up::ColourCluster| {
            std::array::from_fn(|c| if all[c] > 0.0 { indirect.close_up[c] * k.light[c] / all[c] } else { 0.0 })
        };
        indirect.clusters = close_up.clusters.iter().map(share).collect();
    }
    if let Some((close_up, near)) = laid {
        let [_, seed] = halves(seed);
        indirect.near = near_paths::light_between(near, &close_up.pairs, (bounces, seed), control)?;
        let blur = close_up.blur_in_periods(near.tile.period.to_array());
        indirect.near.iter_mut().for_each(|seen| smooth_colours(&mut seen.picture, near_paths::SIZE, blur));
    }
    Ok(indirect)
}
