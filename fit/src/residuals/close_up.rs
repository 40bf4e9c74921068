//! Residuals of the close-up: its mean period place by place, or else the cover, the light and the tones of each of its colour clusters,
//! against one period of the model.

use crate::photograph::close_up::{CloseUp, ColourCluster};
use crate::photograph::mean_period::MeanPeriod;
use crate::residuals::block::ResidualBlock;
use crate::residuals::colour_basis::ColourBasis;
use crate::residuals::equations::{Equations, Origin, Row};
use crate::residuals::near_interreflection;
use crate::residuals::params::PARAMS;
use crate::residuals::registration::Windows;
use crate::residuals::tile_view::{ClusterView, TileView};
use crate::residuals::unknowns::{Shot, UnknownKind};

/// Least standard deviation of a channel's light: that of a photograph that is black all over.
const LEAST_SPREAD: f64 = 1e-9;

/// What of the close-up is compared.
#[derive(Clone, Copy, Debug)]
pub enum Comparison<'a> {
    /// The light of all pixels together: nothing is known of the colours yet that they could be clustered by.
    WholeLight,
    /// Its colour clusters, where the model's pixels belong to the surface that each shows most of.
    ClustersBySurface,
    /// Its colour clusters, where the model's pixels are clustered as well, with these linear unknowns.
    ClustersByColour(&'a [f64]),
    /// Its mean period, which begins at `shift` periods of the model's.
    MeanPeriod {
        /// Along x and y, in periods.
        shift: [f64; 2],
        /// The linear unknowns of the solution before, if there is one: see [`CloseUpResiduals::exposed`].
        before: Option<&'a [f64]>,
    },
}

/// Interreflections in the close-up, as far as they are known.
#[derive(Clone, Copy, Debug)]
pub struct NearInterreflection<'a> {
    /// Whether they were traced for a state of the material nearby.
    pub traced: bool,
    /// Of all pixels together, radiance over irradiance.
    pub whole: [f64; 3],
    /// The part of each colour cluster.
    pub clusters: &'a [[f64; 3]],
    /// Texel by texel of the model's period; empty where it was not traced so.
    pub texels: &'a [[f64; 3]],
    /// Standard deviation of it at a place, over all light there.
    pub sigma: f64,
}

/// The close-up beside a state of the material.
#[derive(Clone, Copy, Debug)]
pub struct CloseUpResiduals<'a> {
    /// The photograph.
    pub close_up: &'a CloseUp,
    /// One period of the model.
    pub view: &'a TileView,
    /// What is compared.
    pub comparison: Comparison<'a>,
    /// Which surface each colour cluster is.
    pub surfaces: &'a [usize],
    /// Light that was reflected more than once.
    pub interreflection: NearInterreflection<'a>,
    /// What the standard deviations of the mean period are multiplied by, at least 1.
    pub doubt: f64,
}

impl ResidualBlock for CloseUpResiduals<'_> {
    fn add_to(&self, basis: &ColourBasis<'_>, equations: &mut Equations) {
        match self.comparison {
            Comparison::WholeLight => self.add_whole_light(basis, equations),
            Comparison::ClustersBySurface => self.add_clusters(None, basis, equations),
            Comparison::ClustersByColour(guess) => self.add_clusters(Some(guess), basis, equations),
            Comparison::MeanPeriod { shift, before } => {
                if let Some(mean) = &self.close_up.mean_period {
                    self.add_mean_period(mean, (shift, before), basis, equations);
                }
            }
        }
    }
}

impl CloseUpResiduals<'_> {
    /// The light of all pixels together.
    fn add_whole_light(&self, basis: &ColourBasis<'_>, equations: &mut Equations) {
        let close_up = self.close_up;
        if !close_up.exposure_known {
            return;
        }
        let whole = self.view.whole_light();
        let light: [f64; 3] = std::array::from_fn(|c| close_up.clusters.iter().map(|k| k.light[c]).sum());
        for c in 0..3 {
            let (terms, known) = basis.terms(|slot| close_up.irradiance[c] * whole[slot][c], c);
            let known = known + close_up.irradiance[c] * self.interreflection.whole[c];
            let sigma = self.sigma(PARAMS.cluster_light) * spread(light, c);
            let row = Row { terms, known, value: light[c], sigma, weight: 1.0 };
            equations.rows.push((self.exposed(row, (c, 1.0), None, basis), Origin::CloseUp));
        }
    }

    /// Cover, light and tones of each colour cluster.
    fn add_clusters(&self, guess: Option<&[f64]>, basis: &ColourBasis<'_>, equations: &mut Equations) {
        let close_up = self.close_up;
        let apart = close_up.tells_surfaces_apart(basis.small.surfaces.len());
        let radiance = basis.radiance(close_up.irradiance, guess);
        let parts = self.view.clustered(&radiance, apart.then_some(self.surfaces), guess.is_some());
        for (k, (cluster, part)) in close_up.clusters.iter().zip(&parts).enumerate() {
            if apart {
                equations.fixed.push(((part.cover - cluster.cover) / PARAMS.cover, Origin::CloseUp));
            }
            if !close_up.exposure_known {
                continue;
            }
            let part_of = if apart { self.interreflection.clusters.get(k) } else { None };
            let share = part_of.unwrap_or(&self.interreflection.whole);
            let interreflection: [f64; 3] = std::array::from_fn(|c| close_up.irradiance[c] * share[c]);
            for c in 0..3 {
                let (terms, known) = basis.terms(|slot| close_up.irradiance[c] * part.light[slot][c], c);
                let sigma = self.sigma(PARAMS.cluster_light) * spread(cluster.light, c);
                let row = Row { terms, known: known + interreflection[c], value: cluster.light[c], sigma, weight: 1.0 };
                // Light is a sum over the cluster's pixels, over the number of all.
                equations.rows.push((self.exposed(row, (c, cluster.cover), guess, basis), Origin::CloseUp));
            }
            let radiance = interreflection.map(|i| i / cluster.cover.max(PARAMS.least_cover));
            self.add_tones((cluster, part, radiance), guess, basis, equations);
        }
    }

    /// The tones of a colour cluster, to whose radiance `interreflection` is added.
    fn add_tones(
        &self,
        (cluster, part, interreflection): (&ColourCluster, &ClusterView, [f64; 3]),
        guess: Option<&[f64]>,
        basis: &ColourBasis<'_>,
        equations: &mut Equations,
    ) {
        for (b, tone) in cluster.tones.iter().enumerate() {
            for c in 0..3 {
                let (terms, known) = basis.terms(|slot| self.close_up.irradiance[c] * part.tones[slot][b][c], c);
                let sigma = self.sigma(PARAMS.cluster_tone) * spread(*tone, c);
                let row = Row { terms, known: known + interreflection[c], value: tone[c], sigma, weight: PARAMS.tone_weight };
                equations.rows.push((self.exposed(row, (c, 1.0), guess, basis), Origin::CloseUp));
            }
        }
    }

    /// The mean period, place by place.
    fn add_mean_period(
        &self,
        mean: &MeanPeriod,
        (shift, before): ([f64; 2], Option<&[f64]>),
        basis: &ColourBasis<'_>,
        equations: &mut Equations,
    ) {
        let irradiance = self.close_up.irradiance;
        let windows = Windows::new(self.view.size, mean.size, shift);
        let shares: Vec<Vec<[f64; 3]>> = self.view.basis.iter().map(|s| windows.of(s)).collect();
        let texels = self.interreflection.texels;
        let interreflection =
            if texels.is_empty() { Vec::new() } else { Windows::new(near_interreflection::SIZE, mean.size, shift).of(texels) };
        let weight = PARAMS.mean_period_weight / (3 * mean.mean.len()) as f64;
        for (place, (&value, &sigma)) in mean.mean.iter().zip(&mean.sigma).enumerate() {
            for c in 0..3 {
                let (terms, known) = basis.terms(|slot| irradiance[c] * shares[slot][place][c], c);
                let known = known + interreflection.get(place).map_or(0.0, |i| irradiance[c] * i[c]);
                let weight = if mean.count[place] > 0.0 { weight } else { 0.0 };
                let sigma = self.doubt * sigma[c].hypot(self.interreflection.sigma * value[c]);
                let row = Row { terms, known, value: value[c], sigma, weight };
                equations.rows.push((self.exposed(row, (c, 1.0), before, basis), Origin::CloseUp));
            }
        }
    }

    /// A row of the model's light `M`, with the stray light `V` of the close-up, of which it has a share of a channel, and its exposure `e`: what is
    /// seen is `(M + V) / e`. About the solution `before` that is linear in all of them, `(M + V) / e0 - (M0 + V0) (e - e0) / e0²`. Where there
    /// is none yet an exposure that is known stays as it is, and one that is not is found from `M + V = e value`: with that alone a close-up that
    /// the material explains badly would be explained best by no light at all.
    fn exposed(&self, mut row: Row, (channel, share): (usize, f64), before: Option<&[f64]>, basis: &ColourBasis<'_>) -> Row {
        if let Some(offset) = basis.position(UnknownKind::StrayLight(Shot::CloseUp, channel)) {
            row.terms.push((offset, share));
        }
        let Some(exposure) = basis.position(UnknownKind::Exposure) else { return row };
        match before {
            Some(before) => {
                let own = before[exposure];
                let light = row.known + row.terms.iter().map(|&(k, a)| a * before[k]).sum::<f64>();
                row.terms.iter_mut().for_each(|(_, a)| *a /= own);
                row.terms.push((exposure, -light / (own * own)));
                row.known = (row.known + light) / own;
            }
            None if self.close_up.exposure_sigma.is_none() => {
                row.terms.push((exposure, -row.value));
                row.value = 0.0;
            }
            None => {}
        }
        row
    }

    /// The one of two relative standard deviations that holds: in direct light, or with interreflections.
    fn sigma(&self, [direct, traced]: [f64; 2]) -> f64 {
        if self.interreflection.traced { traced } else { direct }
    }
}

/// The size that a channel's standard deviation is a share of.
fn spread(colour: [f64; 3], channel: usize) -> f64 {
    let whole = colour.iter().copied().fold(0.0, f64::max);
    colour[channel].hypot(PARAMS.dark_channel * whole).max(LEAST_SPREAD)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residuals::colour_basis::tests::Grooves;
    use crate::residuals::equations::solve;
    use crate::residuals::tile_view::ViewParams;
    use crate::residuals::unknowns::Unknown;
    use biscale::direction::Pair;
    use biscale::filter::Control;
    use glam::DVec3;

    const SIZE: [usize; 2] = [12, 1];
    const SHIFT: [f64; 2] = [0.3, 0.0];
    const NONE: NearInterreflection<'_> = NearInterreflection { traced: false, whole: [0.0; 3], clusters: &[], texels: &[], sigma: 0.0 };

    fn view(grooves: &Grooves) -> TileView {
        let cancel = std::sync::atomic::AtomicBool::new(false);
        let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
        let pair = Pair { wi: DVec3::new(0.1, 0.3, 0.9).normalize(), wo: DVec3::Z };
        let params = ViewParams { size: 48, round: false, blur: [0.0; 2], height: 0.0, seed: 3 };
        TileView::new(&grooves.small, &grooves.slots, &[pair], &params, &control).unwrap()
    }

    /// A close-up that shows the grooves themselves, `exposure` times too dark.
    fn close_up(grooves: &Grooves, view: &TileView, exposure: f64) -> CloseUp {
        let irradiance = [2.0, 3.0, 4.0];
        let radiance = grooves.basis().radiance(irradiance, None);
        let seen = Windows::new(view.size, SIZE, SHIFT).of(&view.picture(&radiance));
        let mean: Vec<[f64; 3]> = seen.iter().map(|v| v.map(|v| v / exposure)).collect();
        let count = (0..mean.len()).map(|k| if k == 5 { 0.0 } else { 7.0 }).collect();
        let sigma = vec![[0.02; 3]; mean.len()];
        let mean_period = Some(MeanPeriod { size: SIZE, mean, count, sigma, ..MeanPeriod::default() });
        CloseUp { irradiance, exposure_known: exposure == 1.0, mean_period, ..CloseUp::default() }
    }

    fn equations(grooves: &Grooves, close_up: &CloseUp, view: &TileView, comparison: Comparison<'_>) -> Equations {
        let block = CloseUpResiduals { close_up, view, comparison, surfaces: &[0, 1], interreflection: NONE, doubt: 1.5 };
        let mut equations = Equations::default();
        block.add_to(&grooves.basis(), &mut equations);
        equations
    }

    #[test]
    fn a_mean_period_of_the_model_itself_gives_the_colours_back_where_it_is_registered_right() {
        let grooves = Grooves::new();
        let view = view(&grooves);
        let close_up = close_up(&grooves, &view, 1.0);
        let solved = |shift| {
            let found = equations(&grooves, &close_up, &view, Comparison::MeanPeriod { shift, before: None });
            assert!(found.rows.len() == 36 && found.fixed.is_empty());
            assert!((found.rows[0].0.sigma - 1.5 * 0.02).abs() < 1e-15 && found.rows[15].0.weight == 0.0);
            solve(found, &[0.0; 3], &[1.0; 3])
        };
        let right = solved(SHIFT);
        for (found, truth) in right.linear.iter().zip([0.1, 0.2, 0.5]) {
            assert!((found - truth).abs() < 1e-6, "{:?}", right.linear);
        }
        assert!(right.objective < 1e-12 && solved([0.4, 0.0]).objective > 1e3 * right.objective.max(1e-12));
    }

    #[test]
    fn an_exposure_that_is_not_known_is_found_with_the_colours() {
        let mut grooves = Grooves::new();
        let view = view(&grooves);
        grooves.unknowns.push(Unknown { name: "exposure".into(), kind: UnknownKind::Exposure, bounds: [1e-2, 1e2] });
        let close_up = close_up(&grooves, &view, 1.7);
        let found = equations(&grooves, &close_up, &view, Comparison::MeanPeriod { shift: SHIFT, before: None });
        let found = solve(found, &[0.0, 0.0, 0.0, 1e-2], &[1.0, 1.0, 1.0, 1e2]);
        assert!((found.linear[3] - 1.7).abs() < 1e-5 && (found.linear[2] - 0.5).abs() < 1e-5, "{:?}", found.linear);
    }

    #[test]
    fn an_exposure_is_found_about_a_solution_and_never_as_no_light_at_all() {
        let mut grooves = Grooves::new();
        let view = view(&grooves);
        grooves.unknowns.push(Unknown { name: "exposure".into(), kind: UnknownKind::Exposure, bounds: [1e-2, 1e2] });
        let solved = |close_up: &CloseUp| {
            let mut linear = vec![0.1, 0.2, 0.5, 1.0];
            for _ in 0..4 {
                let comparison = Comparison::MeanPeriod { shift: SHIFT, before: Some(&linear) };
                let mut found = equations(&grooves, close_up, &view, comparison);
                // Distant photographs hold the colours.
                let held =
                    |(k, value): (usize, f64)| (Row { terms: vec![(k, 1.0)], known: 0.0, value, sigma: 0.01, weight: 1.0 }, Origin::Prior);
                found.rows.extend([0.1, 0.2, 0.5].into_iter().enumerate().map(held));
                linear = solve(found, &[0.0, 0.0, 0.0, 1e-2], &[1.0, 1.0, 1.0, 1e2]).linear;
            }
            linear
        };
        let right = solved(&close_up(&grooves, &view, 1.7));
        assert!((right[3] - 1.7).abs() < 1e-3 && (right[2] - 0.5).abs() < 1e-3, "{right:?}");
        // One of something else, of the same mean light.
        let mut other = close_up(&grooves, &view, 1.0);
        let mean = other.mean_period.as_mut().unwrap();
        mean.mean.reverse();
        let found = solved(&other);
        assert!((0.5..2.0).contains(&found[3]), "{found:?}");
    }

    #[test]
    fn clusters_have_covers_light_and_tones_and_no_light_where_the_exposure_is_not_known() {
        let grooves = Grooves::new();
        let view = view(&grooves);
        let mut close_up = close_up(&grooves, &view, 1.0);
        let radiance = grooves.basis().radiance(close_up.irradiance, None);
        let parts = view.clustered(&radiance, Some(&[0, 1]), false);
        // Each cluster as the model's own surface shows it.
        let radiance_of = |shares: &[[f64; 3]]| std::array::from_fn(|c| (0..2).map(|k| radiance[k][c] * shares[k][c]).sum());
        let cluster = |part: &ClusterView| ColourCluster {
            cover: part.cover,
            light: radiance_of(&part.light),
            colour: [0.0; 3],
            tones: (0..part.tones[0].len()).map(|b| radiance_of(&part.tones.iter().map(|t| t[b]).collect::<Vec<_>>())).collect(),
        };
        close_up.clusters = parts.iter().map(cluster).collect();
        let found = equations(&grooves, &close_up, &view, Comparison::ClustersBySurface);
        assert_eq!(
            (found.fixed.clone(), found.rows.len()),
            (vec![(0.0, Origin::CloseUp); 2], 2 * 3 * (1 + close_up.clusters[0].tones.len()))
        );
        let solved = solve(found, &[0.0; 3], &[1.0; 3]);
        assert!((solved.linear[2] - 0.5).abs() < 1e-6 && solved.objective < 1e-12, "{:?}", solved.linear);
        let whole = solve(equations(&grooves, &close_up, &view, Comparison::WholeLight), &[0.0; 3], &[1.0; 3]);
        assert!((whole.linear[2] - 0.5).abs() < 1e-6, "{:?}", whole.linear);
        close_up.exposure_known = false;
        let covers = equations(&grooves, &close_up, &view, Comparison::ClustersBySurface);
        assert!(covers.rows.is_empty() && covers.fixed.len() == 2);
    }
}
