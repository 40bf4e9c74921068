//! The amplitudes of a surface for each pair (Iwasaki et al. 2012, eq. 7): a few numbers, from which the visible area of each lobe of the normals follows.
//!
//! One number a lobe, or, where lobes are more than amplitudes, one for each of the leading modes of their visible areas.

use super::least_squares::LeastSquares;
use super::lobe_areas::{LobeArea, LobeFacets, PairAreas};
use super::mode_query::ModeQuery;
use super::modes::VisibilityModes;
use super::normals::NormalLobes;
use crate::filter::plan::AmplitudeFit;
use crate::filter::query::Query;
use crate::filter::sums::{of_task, split_by_task};
use crate::filter::visible_facets::VisibleFacets;
use crate::simd::{self, Lanes};
use rayon::prelude::*;
use std::ops::Range;

/// What the numbers of a row mean.
pub struct AmplitudeLayout {
    /// Lobes of the normals.
    lobes: usize,
    /// Channels that differ.
    pub channels: usize,
    /// Modes, where lobes are more than amplitudes.
    modes: Option<VisibilityModes>,
}

impl AmplitudeLayout {
    /// Numbers of a pair: for each channel the visible projected area of the surface, then the amplitudes.
    pub fn row(&self) -> usize {
        self.channels * (1 + self.count())
    }

    /// Amplitudes of a pair and channel.
    pub fn count(&self) -> usize {
        self.modes.as_ref().map_or(self.lobes, |modes| modes.count)
    }

    /// Bytes of the modes.
    pub fn bytes(&self) -> usize {
        self.modes.as_ref().map_or(0, VisibilityModes::bytes)
    }

    /// The visible area of each lobe, from the amplitudes of a pair and channel; `room` is what they are written to where they are not the amplitudes.
    #[inline(always)]
    pub fn lobe_areas<'r>(&self, amplitudes: &'r [f32], room: &'r mut Vec<f32>) -> &'r [f32] {
        let Some(modes) = &self.modes else { return amplitudes };
        room.resize(self.lobes, 0.0);
        modes.expand(amplitudes, room);
        room
    }
}

/// Finds the amplitudes of a surface.
pub struct AmplitudeFinder<'a> {
    facets: LobeFacets<'a>,
    /// What turns sums over facets to amplitudes, by least squares.
    least_squares: Option<LeastSquares>,
    /// What they mean.
    pub layout: AmplitudeLayout,
}

impl<'a> AmplitudeFinder<'a> {
    /// `count` for each pair, or one for each lobe if they are no more; by least squares always one a lobe.
    pub fn new(
        seen: &'a VisibleFacets,
        range: Range<usize>,
        lobes: &NormalLobes,
        query: &ModeQuery,
        fit: AmplitudeFit,
        count: usize,
        tinted: bool,
    ) -> Self {
        let facets = LobeFacets::new(seen, range, lobes, fit, tinted);
        let by_responsibilities = fit == AmplitudeFit::Responsibilities;
        let least_squares = (!by_responsibilities && facets.lobes() > 0).then(|| LeastSquares::new(&lobes.densities, fit));
        let modes = (by_responsibilities && count < facets.lobes()).then(|| {
            let areas: Vec<f32> = facets.areas.iter().map(|a| a.iter().copied().fold(0.0, f32::max)).collect();
            VisibilityModes::new(&lobes.densities, &areas, &sample(&facets, seen, query), count)
        });
        let layout = AmplitudeLayout { lobes: facets.lobes(), channels: facets.channels(), modes };
        Self { facets, least_squares, layout }
    }

    /// Rows for the pairs of `tasks`, a run of [`Query::tasks`].
    pub fn rows(&self, seen: &VisibleFacets, query: &Query, tasks: &[Range<usize>]) -> Vec<f32> {
        let pairs = tasks.iter().map(ExactSizeIterator::len).sum::<usize>();
        let width = self.layout.row();
        let mut rows = vec![0.0; width * pairs];
        if self.facets.lobes() == 0 {
            return rows;
        }
        let lanes = self.facets.view_len();
        split_by_task(&mut rows, tasks, width).into_par_iter().zip(tasks).for_each_init(Room::default, |room, (rows, task)| {
            let (directions, pairs) = of_task(&seen.bits, query, task.clone());
            room.views.clear();
            for (direction, bits) in directions {
                self.facets.view(direction, bits, &mut room.views);
            }
            room.areas.resize(self.facets.lobes(), LobeArea::default());
            for (row, pair) in rows.chunks_exact_mut(width).zip(pairs) {
                let views = [pair.i, pair.o].map(|d| &room.views[d * lanes..(d + 1) * lanes]);
                simd::run(PairAreas { facets: &self.facets, views, areas: &mut room.areas });
                let mut channels: Vec<&mut [f32]> = row.chunks_exact_mut(1 + self.layout.count()).collect();
                for (c, channel) in channels.iter_mut().enumerate() {
                    self.write_channel(&room.areas, c, channel);
                }
                if let Some(modes) = &self.layout.modes {
                    let mut amplitudes: Vec<&mut [f32]> = channels.into_iter().map(|channel| &mut channel[1..]).collect();
                    modes.amplitudes([pair.wi, pair.wo], &room.areas, &mut amplitudes);
                }
            }
        });
        rows
    }

    /// Writes the visible projected area and, where each lobe has its own amplitude, these.
    fn write_channel(&self, areas: &[LobeArea], c: usize, channel: &mut [f32]) {
        let (projected, amplitudes) = channel.split_at_mut(1);
        if let Some(least_squares) = &self.least_squares {
            let b: Vec<f64> = areas.iter().map(|a| f64::from(a.projected[c])).collect();
            least_squares.solve(&b, amplitudes);
            projected[0] = amplitudes.iter().sum();
            return;
        }
        projected[0] = areas.iter().map(|a| a.projected[c]).sum();
        if self.layout.modes.is_none() {
            amplitudes.iter_mut().zip(areas).for_each(|(amplitude, area)| *amplitude = area.visible[c]);
        }
    }
}

/// Room for the work of a thread.
#[derive(Default)]
struct Room {
    views: Vec<Lanes>,
    areas: Vec<LobeArea>,
}

/// Visible areas of the lobes for the pairs that modes are learnt from, a row a pair and channel.
fn sample(facets: &LobeFacets<'_>, seen: &VisibleFacets, modes: &ModeQuery) -> Vec<Vec<f32>> {
    let query = &modes.query;
    let of_pair = |pair: &[u32; 2]| {
        let mut views = Vec::new();
        for d in pair.map(|d| d as usize) {
            facets.view(query.directions[d], seen.bits.row(d), &mut views);
        }
        let (light, viewer) = views.split_at(facets.view_len());
        let mut areas = vec![LobeArea::default(); facets.lobes()];
        simd::run(PairAreas { facets, views: [light, viewer], areas: &mut areas });
        (0..facets.channels()).map(|c| areas.iter().map(|a| a.visible[c]).collect()).collect::<Vec<Vec<f32>>>()
    };
    modes.learnt_from.par_iter().flat_map_iter(of_pair).collect()
}
