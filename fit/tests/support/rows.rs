//! The objective where a fit ended and where the photographs were made: which rows pull away from the truth.

#![allow(clippy::print_stdout, reason = "figures, for those who ask for them with --nocapture")]

use super::{Faults, with_control};
use biscale::error::Result;
use biscale::filter::Control;
use biscale::material::SmallScale;
use biscale::render::World;
use biscale_fit::fit_file::spec::Spec;
use biscale_fit::fit_file::variant::{Variants, own_sides};
use biscale_fit::photograph::close_up::{BOX, CloseUp};
use biscale_fit::photograph::direction_bins::{DirectionBins, scene_of, sights};
use biscale_fit::photograph::image::Role;
use biscale_fit::photograph::mean_period::uniform;
use biscale_fit::residuals::equations::{Evaluated, Origin};
use biscale_fit::residuals::input::{Interreflection, ModelInput, Sampling};
use biscale_fit::residuals::interreflection::{NearScene, trace_interreflection};
use biscale_fit::residuals::model::Model;
use biscale_fit::residuals::near_interreflection::PathOptions;
use biscale_fit::residuals::unknowns::{Shot, UnknownKind, Variable};
use biscale_fit::run::{FINE, Outcome, POLISH_SAMPLES};
use biscale_fit::search::descent::{Evaluate, descend};
use biscale_fit::search::optimise::Limits;
use std::collections::BTreeMap;

/// What each unknown was when the photographs were made, by its name; `None` for what is no number of the material.
pub fn truths<'a>(names: impl Iterator<Item = &'a str>, truth: &str) -> Vec<Option<f64>> {
    let root: toml_edit::DocumentMut = truth.parse().unwrap();
    let number = |item: &toml_edit::Item, channel: usize| {
        item.as_array().map_or_else(|| item.as_float(), |a| a.get(channel).and_then(toml_edit::Value::as_float))
    };
    let of = |name: &str| {
        let (key, channel) =
            name.split_once(' ').map_or((name, 0), |(k, c)| (k, ["red", "green", "blue"].iter().position(|n| *n == c).unwrap_or(9)));
        let path: Vec<&str> = key.split('.').collect();
        match path[..] {
            ["geometry", key] => root["geometry"].get(key).and_then(|item| number(item, 0)),
            ["surface", part, "brdf", key] => {
                let surfaces = root["surface"].as_array_of_tables().unwrap();
                let surface = surfaces.iter().find(|s| s["part"].as_str() == Some(part))?;
                number(&toml_edit::Item::Value(surface["brdf"].as_inline_table().unwrap()[key].clone()), channel)
            }
            _ => None,
        }
    };
    names.map(of).collect()
}

/// Which of the unknowns are dominant colours: channels of at least .6 of the brightest one of a diffuse colour.
pub fn dominant(names: &[&str], truths: &[Option<f64>]) -> Vec<bool> {
    let is_diffuse = |name: &str| name.contains("diffuse ") || name.contains("albedo ");
    let part = |name: &str| name.split(".brdf").next().unwrap().to_owned();
    let brightest = |of: String| {
        let own = names.iter().zip(truths).filter(|(n, _)| is_diffuse(n) && part(n) == of);
        own.filter_map(|(_, t)| *t).fold(0.0, f64::max)
    };
    names.iter().zip(truths).map(|(n, t)| is_diffuse(n) && t.is_some_and(|t| t >= 0.6 * brightest(part(n)))).collect()
}

/// Sums of Huber's squares by kind of row, and the mean of the residuals, at two points of the same model.
fn rows(model: &Model<'_>, evaluated: &Evaluated) -> BTreeMap<String, (f64, f64, f64)> {
    let mut sums: BTreeMap<String, (f64, f64, f64)> = BTreeMap::new();
    let mut place = 0;
    for (row, origin) in &evaluated.rows {
        let r = evaluated.residual(row);
        let name = match origin {
            Origin::Bin(p, _, c) => format!("bins {p} {c}"),
            Origin::CloseUp => {
                place += 1;
                if model.mean_period().is_some() { format!("near {}", (place - 1) % 3) } else { format!("near {:02}", place - 1) }
            }
            Origin::Prior => "prior".to_owned(),
        };
        let sum = sums.entry(name).or_default();
        sum.0 += row.weight * r * r;
        sum.1 += row.weight * r;
        sum.2 += row.weight;
    }
    for (k, (r, origin)) in evaluated.fixed.iter().enumerate() {
        let name = if *origin == Origin::CloseUp { format!("cover {k}") } else { format!("prior {k}") };
        sums.insert(name, (r * r, *r, 1.0));
    }
    sums
}

/// The photographs of a fit, looked at as the fit does.
pub struct Looked<'a> {
    pub spec: &'a Spec,
    bins: Vec<DirectionBins>,
    near: CloseUp,
    variants: Variants,
}

impl<'a> Looked<'a> {
    /// `material` tells which kind of the close-up is which surface.
    pub fn new(spec: &'a Spec, material: &SmallScale) -> Self {
        let small = spec.material.build().unwrap();
        let look = |p| sights(&World::opaque(&scene_of(p, &spec.material, &small)), p);
        let bins: Vec<DirectionBins> = spec.of_role(Role::Distant).map(|p| DirectionBins::new(p, &look(p), FINE.bins).unwrap()).collect();
        let colours: Vec<[f64; 3]> = (0..material.surfaces.len())
            .map(|s| {
                let mut sum = [0.0; 3];
                for slot in biscale_fit::residuals::unknowns::slots(&material.surfaces).into_iter().filter(|slot| slot.surface == s) {
                    let c = biscale_fit::residuals::unknowns::colour_of(material, slot);
                    (0..3).for_each(|k| sum[k] += c[k]);
                }
                sum
            })
            .collect();
        let near = spec
            .of_role(Role::CloseUp)
            .next()
            .map(|p| CloseUp::new(p, &look(p), &small, uniform(&spec.material.geometry), &colours))
            .unwrap();
        let variants = Variants::new(&spec.sides, own_sides(&spec.material.geometry), &near.choices, &near.other_choices);
        Self { spec, bins, near, variants }
    }

    fn model(&'a self, choice: usize, values: &[f64], interreflection: Option<&'a Interreflection>, control: &Control<'_>) -> Model<'a> {
        let opaque = !matches!(self.spec.material.geometry, biscale::geometry::Geometry::Weave(_));
        let variant = &self.variants.all[choice];
        let input = ModelInput { spec: self.spec, photographs: &self.bins, close_up: Some(&self.near), variant, interreflection, opaque };
        Model::new(input, Sampling { samples: POLISH_SAMPLES, seed: 99 }, values, control).unwrap()
    }

    /// The interreflection of the true material, if the photographs show it.
    fn interreflection(&self, truth: &str, faults: &Faults, control: &Control<'_>) -> Option<Interreflection> {
        if self.spec.bounces == 0 {
            return None;
        }
        let (point, values, _) = self.truth(truth, faults);
        let small = super::material(truth);
        let state = self.model(0, &values, None, control).state(&point);
        let near = NearScene { close_up: &self.near, light: state.near_light, small: &small };
        let options = PathOptions { bounces: self.spec.bounces, seed: 5 };
        Some(trace_interreflection(&small, &self.bins, &state.lights, Some(near), options, control).unwrap())
    }

    /// Where the photographs were made: the point, its parameters, and the linear unknowns.
    fn truth(&self, truth: &str, faults: &Faults) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let of = |name: &str| truths(std::iter::once(name), truth)[0];
        let values: Vec<f64> = self.spec.parameters.iter().map(|p| of(&p.key).unwrap()).collect();
        let unknowns = biscale_fit::residuals::unknowns::unknowns(self.spec, self.bins.len(), self.near.exposures());
        let point = biscale_fit::residuals::unknowns::variables(self.spec, Some(&self.near))
            .iter()
            .map(|v| match v {
                Variable::Parameter(k) => self.spec.parameters[*k].to_unit(values[*k]),
                // The light stands off by these degrees.
                Variable::Light { shot, axis, .. } => {
                    let off = faults.of(if *shot == Shot::CloseUp { "close-up" } else { "distant" }).light_off_deg;
                    0.5 + 0.5 * off[*axis] / v.at(self.spec, &unknowns, 1.0)
                }
                Variable::Blur => {
                    let [low, high] = [0.0, 1.0].map(|u| v.at(self.spec, &unknowns, u).ln());
                    let ratio = faults.of("close-up").blur.hypot(BOX) / self.near.blur.unwrap().pixels.hypot(BOX);
                    (ratio.ln() - low) / (high - low)
                }
                Variable::Linear(_) => 0.5,
            })
            .collect();
        let linear = unknowns
            .iter()
            .map(|u| if u.kind == UnknownKind::Exposure { 1.0 / faults.exposure } else { of(&u.name).unwrap_or(0.0) })
            .collect();
        (point, values, linear)
    }
}

struct Direct<'a>(&'a Model<'a>, &'a Control<'a>);

impl Evaluate for Direct<'_> {
    fn evaluate(&self, points: &[Vec<f64>], linear: Option<&[f64]>) -> Result<Vec<Option<Evaluated>>> {
        use rayon::prelude::*;
        points.par_iter().map(|p| self.0.evaluate_with(p, linear, self.1)).collect()
    }
}

/// What the photographs say near the truth.
pub struct Probe {
    /// For each dominant colour its name, and by how much it is off with the true geometry and light, and where a descent from there ends.
    pub off: Vec<(String, f64, f64)>,
    /// Objectives: with all that is true, with the true geometry, where the descent ends.
    pub objectives: [f64; 3],
    /// For each number that the search moves its name, what it was, and where the descent ends.
    pub moved: Vec<(String, f64, f64)>,
}

/// Goes down from the truth: what a search that finds the least objective must end near, in seconds and not in minutes.
pub fn probe(looked: &Looked<'_>, truth: &str, faults: &Faults) -> Probe {
    with_control(|control| {
        let (point, values, exact) = looked.truth(truth, faults);
        let likely = looked.variants.likely;
        let interreflection = looked.interreflection(truth, faults, control);
        let at = |choice: usize| {
            let mut model = looked.model(choice, &values, interreflection.as_ref(), control);
            model.settle_height(&point, control).unwrap();
            let here = model.evaluate(&point, control).unwrap().unwrap();
            (model, here)
        };
        let (model, here) = (0..likely).map(at).min_by(|a, b| a.1.objective.total_cmp(&b.1.objective)).unwrap();
        let with_colours = model.evaluate_with(&point, Some(&exact), control).unwrap().unwrap();
        let limits = Limits { step: 0.1, size: 0.004, cost: 0.002, evaluations: 200 };
        let found = descend(&model, &point, limits, &Direct(&model, control)).unwrap();
        let there = model.evaluate(&found.point, control).unwrap().unwrap();
        let names: Vec<&str> = model.unknowns.iter().map(|u| &u.name[..]).collect();
        let true_values = truths(names.iter().copied(), truth);
        let is_dominant = dominant(&names, &true_values);
        let off = |linear: &[f64], k: usize| linear[k] / exact[k] - 1.0;
        let off = (0..names.len()).filter(|&k| is_dominant[k]).map(|k| (names[k].to_owned(), off(&here.linear, k), off(&there.linear, k)));
        if std::env::var("ROWS").is_ok() {
            let near = &looked.near;
            println!("    {:?} {:?} {:?}", near.period.map(|p| p.map(|p| p.length)), near.blur, near.notes);
            println!("    kinds {:?}", near.clusters.iter().map(|k| (k.cover, k.colour)).collect::<Vec<_>>());
            println!("    variant {:?}, height {:?}", model.input.variant, model.registration());
            if let Some(m) = &near.mean_period {
                let mean = |of: &[[f64; 3]]| of.iter().flatten().sum::<f64>() / of.len() as f64 / 3.0;
                println!("    mean period of {:?}: mean {:.4}, scatter {:.4}", m.size, mean(&m.mean), mean(&m.scatter));
            }
            for (v, (a, b)) in model.variables.iter().zip(point.iter().zip(&found.point)) {
                let at = |u: f64| v.at(looked.spec, &model.unknowns, u);
                println!("    {:44} [{:.4}, {:.4}]", v.name(looked.spec, &model.unknowns), at(*a), at(*b));
            }
            show(&model, &[&with_colours, &here, &there]);
        }
        let moved = model.variables.iter().zip(point.iter().zip(&found.point)).map(|(v, (a, b))| {
            let at = |u: f64| v.at(looked.spec, &model.unknowns, u);
            (v.name(looked.spec, &model.unknowns), at(*a), at(*b))
        });
        Probe { off: off.collect(), objectives: [with_colours.objective, here.objective, there.objective], moved: moved.collect() }
    })
}

/// Prints sums of squares and mean residuals by kind of row.
fn show(model: &Model<'_>, of: &[&Evaluated]) {
    let sums: Vec<_> = of.iter().map(|e| rows(model, e)).collect();
    for (k, u) in model.unknowns.iter().enumerate() {
        println!("    {:44} {:.4?}", u.name, of.iter().map(|e| e.linear[k]).collect::<Vec<_>>());
    }
    for name in sums[0].keys() {
        let own: Vec<String> = sums.iter().map(|s| format!("{:8.2} ({:6.2})", s[name].0, s[name].1 / s[name].2)).collect();
        println!("    {name:12} {}", own.join("  "));
    }
}

/// The objective where a fit ended and at the truth, and which rows pull away.
pub fn compare_with_truth(looked: &Looked<'_>, outcome: &Outcome, truth: &str, faults: &Faults) {
    with_control(|control| {
        let (point, values, exact) = looked.truth(truth, faults);
        for s in &outcome.starts {
            let place: Vec<f64> = s.point.iter().map(|p| (p * 100.0).round()).collect();
            println!(
                "    start {} {:?}: {:.3}, {} evaluations {place:?}",
                s.number, looked.variants.all[s.choice], s.objective, s.evaluations
            );
        }
        let interreflection = looked.interreflection(truth, faults, control);
        let mut model = looked.model(outcome.starts[0].choice, &values, interreflection.as_ref(), control);
        model.settle_height(&point, control).unwrap();
        let with_colours = model.evaluate_with(&point, Some(&exact), control).unwrap().unwrap();
        let at_truth = model.evaluate(&point, control).unwrap().unwrap();
        let at_best = model.evaluate(&outcome.best, control).unwrap().unwrap();
        println!("  all true {:.3}, true geometry {:.3}, best {:.3}", with_colours.objective, at_truth.objective, at_best.objective);
        show(&model, &[&with_colours, &at_truth, &at_best]);
    });
}
