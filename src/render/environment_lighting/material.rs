//! A material's response, as fine as its error asks for.
//!
//! That is measured: viewers at random, under the environment turned at random, are computed at the exact directions of [`PROBE_LIGHTS`] lights that stand for it,
//! and the grids are refined until what the response makes of the same lights agrees. So the error is that of what a picture shows, without shadows of other objects. It is an upper
//! estimate: lights are harder to follow than the map that they stand for.

use super::super::environment::Environment;
use super::half_vectors::{HalfVectorLobe, density, half_vector_lobes, incident_lobes, texel_sharpness};
use super::response::{Fineness, Row, Rows};
use crate::direction::Pair;
use crate::error::Result;
use crate::filter::{Control, Quality, Summary, effective};
use crate::material::SmallScale;
use crate::numerics::cast::narrow;
use crate::numerics::low_discrepancy::{fraction, sobol_2d, sobol_3d};
use crate::table::HemisphereGrid;
use glam::{DMat3, DQuat, DVec3, Vec4};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::f64::consts::TAU;

/// Turns of the environment, and viewers under each, at which the error is measured. Viewers of a turn share the directions of their lights, whose visibility is what
/// costs.
const TURNS: u32 = 4;
const VIEWERS: u32 = 12;
/// Lights that stand for the environment there; those below the horizon are in none of the pairs.
const PROBE_LIGHTS: u32 = 512;
/// Share of the tolerance that the values themselves may use.
const VALUES_SHARE: f64 = 0.5;
/// How fine a response may be, coarsest first.
const LADDER: [Fineness; 5] = [
    Fineness { rings: 4, side: 8 },
    Fineness { rings: 6, side: 12 },
    Fineness { rings: 8, side: 16 },
    Fineness { rings: 12, side: 24 },
    Fineness { rings: 16, side: 32 },
];

/// A material's response, and how it was found.
pub struct MaterialResponse {
    /// Directions to the viewer.
    pub grid: HemisphereGrid,
    /// How fine it is.
    pub fineness: Fineness,
    /// For each texel and node `T`.
    pub transfer: Vec<Vec4>,
    /// Lobes that are kept.
    pub lobes: Vec<HalfVectorLobe>,
    /// For each node and lobe `E`.
    pub energies: Vec<Vec4>,
    /// How the values were made.
    pub summary: Summary,
    /// Relative RMS error of the values, and of radiance at the probes.
    pub error: [f64; 2],
    /// Pairs of directions that were computed.
    pub pairs: usize,
}

/// A viewer under an environment.
struct Probe {
    wo: DVec3,
    /// Directions and irradiances of lights, below the horizon, too.
    lights: Vec<(DVec3, Vec4)>,
    /// Radiance times `cos_o`.
    truth: Vec4,
}

fn probes(environment: &Environment, seed: u64) -> Vec<Probe> {
    let lights = environment.lights(PROBE_LIGHTS, seed);
    let probe = |index: u32| {
        let [a, b, c] = sobol_3d(index / VIEWERS, 1).map(fraction);
        // A uniform rotation (Shoemake 1992), and a viewer by projected solid angle: as the pixels of a ball.
        let (r, s) = ((1.0 - a).sqrt(), a.sqrt());
        let turn = DMat3::from_quat(DQuat::from_xyzw(r * (TAU * b).sin(), r * (TAU * b).cos(), s * (TAU * c).sin(), s * (TAU * c).cos()));
        let [u, v] = sobol_2d(index, 2).map(fraction);
        let (sin, cos) = (TAU * v).sin_cos();
        let wo = DVec3::new(u.sqrt() * cos, u.sqrt() * sin, (1.0 - u).sqrt());
        let light = |&(w, e): &(DVec3, [f64; 3])| (turn * w, DVec3::from(e).as_vec3().extend(0.0));
        Probe { wo, lights: lights.iter().map(light).collect(), truth: Vec4::ZERO }
    };
    (0..TURNS * VIEWERS).map(probe).collect()
}

impl MaterialResponse {
    /// Finds the response of a material to an environment, within the relative RMS error `quality.tolerance` where the finest grids allow.
    ///
    /// # Errors
    /// Those of [`effective`].
    pub fn new(small: &SmallScale, opaque: bool, environment: &Environment, quality: &Quality, control: &Control<'_>) -> Result<Self> {
        let mut probes = probes(environment, quality.seed);
        let pairs: Vec<Pair> =
            probes.iter().flat_map(|p| p.lights.iter().filter(|l| l.0.z > 0.0).map(|l| Pair { wi: l.0, wo: p.wo })).collect();
        let exact = effective(small, &pairs, &Quality { tolerance: VALUES_SHARE * quality.tolerance, ..quality.clone() }, control)?;
        let mut values = exact.values.iter();
        for probe in &mut probes {
            let wo = probe.wo;
            let number = |(_, e): &(DVec3, Vec4)| {
                let value = values.next()?;
                let n = if opaque { value.fbar.map(|f| f * wo.z) } else { value.s };
                Some(DVec3::from(n).as_vec3().extend(0.0) * *e)
            };
            probe.truth = probe.lights.iter().filter(|l| l.0.z > 0.0).filter_map(number).sum();
        }
        let repeated = Quality { plan: exact.summary.plan.clone(), ..quality.clone() };
        let directions: Vec<(DVec3, DVec3)> = pairs.iter().map(|p| (p.wi, p.wo)).collect();
        let (lobes, sharp) = half_vector_lobes(small, &directions);
        let mut last = None;
        let mut counted = pairs.len();
        for fineness in LADDER {
            let rows = Rows::new(fineness, (&lobes, sharp), opaque);
            let [whole, with_lobes] = error(&rows, &probes, &mut |pairs| {
                counted += pairs.len();
                effective(small, pairs, &repeated, control)
            })?;
            let keep = sharp > 0 && with_lobes < whole;
            let error = if keep { with_lobes } else { whole };
            last = Some((fineness, keep, error));
            if error.hypot(exact.summary.relative_rms) <= quality.tolerance {
                break;
            }
        }
        let (fineness, keep, error) = last.expect("the ladder has a rung");
        let rows = Rows::new(fineness, (&lobes, if keep { sharp } else { 0 }), opaque);
        let nodes: Vec<usize> = (0..rows.grid.nodes().len()).collect();
        let all = rows.of(&nodes, &mut |pairs| {
            counted += pairs.len();
            effective(small, pairs, &repeated, control)
        })?;
        let texel = |at: usize| {
            let row = &all[at % nodes.len()];
            (if keep { &row.rest } else { &row.whole })[at / nodes.len()]
        };
        Ok(Self {
            transfer: (0..rows.texels().len() * nodes.len()).map(texel).collect(),
            energies: all.iter().flat_map(|row| row.lobes.iter().copied()).collect(),
            lobes: lobes[..if keep { sharp } else { 0 }].to_vec(),
            grid: rows.grid,
            fineness,
            error: [exact.summary.relative_rms, error],
            pairs: counted,
            summary: exact.summary,
        })
    }

    /// Radiance times `cos_o` at all nodes, of incident radiance at all texels; without that of the lobes.
    pub fn outgoing(&self, incident: &[Vec4]) -> Vec<Vec4> {
        let nodes = self.grid.nodes().len();
        let mut sums = vec![Vec4::ZERO; nodes];
        for (light, row) in incident.iter().zip(self.transfer.chunks_exact(nodes)) {
            if *light != Vec4::ZERO {
                for (sum, n) in sums.iter_mut().zip(row) {
                    *sum += *n * *light;
                }
            }
        }
        sums
    }
}

/// Relative RMS error of radiance at the probes, without lobes and with them.
fn error(rows: &Rows<'_>, probes: &[Probe], values: &mut super::response::Values<'_>) -> Result<[f64; 2]> {
    let places: Vec<_> = probes.iter().map(|p| rows.grid.weights(p.wo)).collect();
    let mut nodes: Vec<usize> = places.iter().flat_map(|p| p.0).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let found: FxHashMap<usize, Row> = nodes.iter().copied().zip(rows.of(&nodes, values)?).collect();
    let of_probe = |(probe, (nodes, weights)): (&Probe, &([usize; 3], [f64; 3]))| {
        let incident = |&(w, solid_angle): &(DVec3, f64)| -> Vec4 {
            let sharpness = texel_sharpness(solid_angle);
            probe.lights.iter().map(|(wi, e)| density(w.as_vec3(), sharpness, wi.as_vec3()) * *e).sum()
        };
        let incident: Vec<Vec4> = rows.texels().iter().map(incident).collect();
        let mean = |lobe: &HalfVectorLobe| {
            let mut mean = Vec4::ZERO;
            incident_lobes(lobe.axis.as_vec3(), narrow(lobe.sharpness), probe.wo.as_vec3(), |axis, sharpness, share| {
                mean += probe.lights.iter().map(|(wi, e)| share * density(axis, sharpness.into(), wi.as_vec3()) * *e).sum::<Vec4>();
            });
            mean
        };
        let means: Vec<Vec4> = rows.kept().iter().map(mean).collect();
        let dot = |a: &[Vec4], b: &[Vec4]| a.iter().zip(b).map(|(a, b)| *a * *b).sum::<Vec4>();
        let [mut whole, mut with_lobes] = [Vec4::ZERO; 2];
        for (node, weight) in nodes.iter().zip(weights) {
            let row = &found[node];
            whole += narrow(*weight) * dot(&row.whole, &incident);
            with_lobes += narrow(*weight) * (dot(&row.rest, &incident) + dot(&row.lobes, &means));
        }
        // Radiance, not times cos_o: what a pixel shows.
        let scale = narrow(probe.wo.z.recip());
        [whole - probe.truth, with_lobes - probe.truth, probe.truth].map(|v| f64::from((scale * v).length_squared()))
    };
    let sums: Vec<[f64; 3]> = probes.par_iter().zip(&places).map(of_probe).collect();
    let sum = |k: usize| sums.iter().map(|s| s[k]).sum::<f64>();
    let energy = sum(2).max(f64::MIN_POSITIVE);
    Ok([(sum(0) / energy).sqrt(), (sum(1) / energy).sqrt()])
}
