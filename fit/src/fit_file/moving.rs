//! What moves in a material: numbers that the search moves, colours that are solved for, as tables of a fit file.

use crate::fit_file::assignment::{Assignment, assign};
use crate::fit_file::default_moves;
use crate::fit_file::material_text::MaterialText;
use crate::fit_file::variant;
use biscale::brdf::Brdf;
use biscale::error::{BadInput, Result};
use biscale::filter::{Slot, SlotColour};
use biscale::material::{Material, MaterialValues, NumberKey};
use biscale::toml_reader::{Range, Source, TableReader, range};

/// Any number of a material.
const NUMBER: Range = range(-1e9, 1e9);
/// Most numbers of sides that are tried.
const MAX_SIDES: usize = 4;

/// A number of the material that may move.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// As the file names it.
    pub key: String,
    /// The number of the material that it names.
    pub number: NumberKey,
    /// Where the search may begin.
    pub start: f64,
    /// Bounds; equal ones hold it.
    pub bounds: [f64; 2],
    /// Whether it moves by factors and not by steps.
    pub log: bool,
    /// Mean and standard deviation of what is known of it.
    pub prior: Option<[f64; 2]>,
    /// Numbers that are always equal to it.
    pub same: Vec<NumberKey>,
    /// A number that makes the sum of both this.
    pub rest: Option<(NumberKey, f64)>,
}

/// A colour that is found.
#[derive(Clone, Debug, PartialEq)]
pub struct Colour {
    /// As the file names it.
    pub key: String,
    /// The number of the material that it names.
    pub number: NumberKey,
    /// What it colours.
    pub slot: Slot,
    /// Whether it has the same value in all channels.
    pub grey: bool,
    /// Bounds of each channel.
    pub bounds: [f64; 2],
}

impl Parameter {
    /// Where a value lies between the bounds, 0 to 1.
    pub fn to_unit(&self, value: f64) -> f64 {
        let [low, high] = self.bounds;
        if high <= low {
            return 0.5;
        }
        let share = if self.log { (value / low).ln() / (high / low).ln() } else { (value - low) / (high - low) };
        share.clamp(0.0, 1.0)
    }

    /// The value at a share of the way between the bounds, 0 to 1.
    pub fn at(&self, unit: f64) -> f64 {
        let [low, high] = self.bounds;
        let u = unit.clamp(0.0, 1.0);
        let value = if self.log { low * (high / low).powf(u) } else { low + u * (high - low) };
        value.clamp(low, high)
    }

    /// What the value sets in the material.
    pub fn assignments(&self, value: f64) -> impl Iterator<Item = Assignment> {
        let equal = std::iter::once(self.number).chain(self.same.iter().copied());
        let rest = self.rest.map(|(number, sum)| Assignment::Number(number, sum - value));
        equal.map(move |number| Assignment::Number(number, value)).chain(rest)
    }

    /// All numbers of the material that it sets.
    pub fn numbers(&self) -> impl Iterator<Item = NumberKey> + '_ {
        std::iter::once(self.number).chain(self.same.iter().copied()).chain(self.rest.map(|(number, _)| number))
    }

    /// Whether it may move.
    pub fn is_free(&self) -> bool {
        self.bounds[1] > self.bounds[0]
    }
}

/// The `[[parameter]]` and `[[colour]]` tables of a table.
pub fn read_moves(table: &TableReader<'_>, values: &MaterialValues, text: &mut MaterialText) -> Result<(Vec<Parameter>, Vec<Colour>)> {
    let parameters = table.tables("parameter")?.into_iter().map(|t| Parameter::read(t, values, text)).collect::<Result<_>>()?;
    let colours = table.tables("colour")?.into_iter().map(|t| Colour::read(t, values)).collect::<Result<_>>()?;
    Ok((parameters, colours))
}

/// All that photographs may tell of a material, within bounds about its own numbers.
///
/// # Errors
/// A number of the material outside of the bounds of its kind.
pub fn default_moves(
    source: &Source,
    values: &MaterialValues,
    material: &Material,
    text: &mut MaterialText,
) -> Result<(Vec<Parameter>, Vec<Colour>)> {
    let tables = Source { path: source.path.clone(), text: default_moves::tables(values, material, text)? };
    let root = tables.parse()?;
    read_moves(&TableReader::new(&tables, "", root.get_ref(), 0), values, text)
}

/// Adds what moves by default, but for what already moves.
pub(super) fn add_others(parameters: &mut Vec<Parameter>, colours: &mut Vec<Colour>, others: Vec<Parameter>, other_colours: Vec<Colour>) {
    let moved: Vec<NumberKey> = parameters.iter().flat_map(Parameter::numbers).chain(colours.iter().map(|c| c.number)).collect();
    parameters.extend(others.into_iter().filter(|p| !p.numbers().any(|n| moved.contains(&n))));
    colours.extend(other_colours.into_iter().filter(|c| !moved.contains(&c.number)));
}

/// The numbers of sides that threads are tried with.
pub(super) fn sides(top: &TableReader<'_>, material: &Material, parameters: &[Parameter]) -> Result<Vec<u32>> {
    let moves = parameters.iter().any(|p| p.is_free() && matches!(p.number, NumberKey::Geometry(_)));
    let Some(given) = top.integers("sides", 4, 256, MAX_SIDES)? else { return Ok(variant::default_sides(&material.geometry, moves)) };
    let Some(own) = variant::own_sides(&material.geometry) else {
        return Err(top.error_at("sides", "only threads and rods have sides", "remove it"));
    };
    // A number that the start material does not have comes first only if its own is not asked for.
    let mut sides: Vec<u32> = given.iter().copied().filter(|&s| s == own).take(1).collect();
    sides.extend(given.iter().filter(|&&s| s != own));
    Ok(sides)
}

impl Parameter {
    pub(super) fn read(table: TableReader<'_>, values: &MaterialValues, text: &mut MaterialText) -> Result<Self> {
        let key = table.str("key")?.ok_or_else(|| table.missing("key", "\"geometry.depth\""))?.to_owned();
        let bad = |field: &'static str| move |bad: BadInput, table: &TableReader<'_>| table.error_at(field, bad.problem, bad.remedy);
        let number = values.number_key(&key).map_err(|b| bad("key")(b, &table))?;
        let bounds = table.array::<2>("bounds", NUMBER)?.ok_or_else(|| table.missing("bounds", "[0.1, 1.0]"))?;
        if bounds[1] < bounds[0] {
            return Err(table.error_at("bounds", format!("the lower bound {} lies above the upper {}", bounds[0], bounds[1]), "swap them"));
        }
        let log = table.bool("log")?.unwrap_or(false);
        if log && bounds[0] <= 0.0 {
            return Err(table.error_at(
                "bounds",
                "a number that moves by factors must stay over 0",
                "raise the lower bound, or remove `log`",
            ));
        }
        let written = text.number(number);
        let start = table.f64("start", NUMBER)?.or(written).unwrap_or(0.5 * (bounds[0] + bounds[1]));
        if start < bounds[0] || start > bounds[1] {
            let problem = format!("it starts at {start}, outside of its bounds {} to {}", bounds[0], bounds[1]);
            return Err(table.error_at("bounds", problem, "widen them, or write another `start`"));
        }
        let prior = table.array::<2>("prior", NUMBER)?;
        if prior.is_some_and(|p| p[1] <= 0.0) {
            return Err(table.error_at("prior", "its standard deviation is not over 0", "write [mean, standard deviation]"));
        }
        let same = table.strings("same")?.unwrap_or_default();
        let same = same.into_iter().map(|k| values.number_key(k).map_err(|b| bad("same")(b, &table))).collect::<Result<Vec<_>>>()?;
        let rest = match table.table("rest")? {
            None => None,
            Some(rest) => {
                let key = rest.str("key")?.ok_or_else(|| rest.missing("key", "\"geometry.warp_gap\""))?;
                let number = values.number_key(key).map_err(|b| bad("key")(b, &rest))?;
                let sum = rest.f64("sum", NUMBER)?.ok_or_else(|| rest.missing("sum", "0.5"))?;
                rest.finish()?;
                Some((number, sum))
            }
        };
        let parameter = Self { key, number, start, bounds, log, prior, same, rest };
        // The material must take the start.
        let mut trial = values.clone();
        let start_written: Vec<Assignment> = parameter.assignments(start).collect();
        let taken = assign(&mut trial, &start_written).map_err(|bad| bad.at_field(&*parameter.key).into()).and_then(|()| trial.material());
        if let Err(error) = taken {
            return Err(table.error_at(
                "key",
                format!("with {start} there the material is refused: {error}"),
                "see `docs/geometry.md` and `docs/brdf.md`",
            ));
        }
        table.finish()?;
        Ok(parameter)
    }
}

impl Colour {
    pub(super) fn read(table: TableReader<'_>, values: &MaterialValues) -> Result<Self> {
        let key = table.str("key")?.ok_or_else(|| table.missing("key", "\"surface.*.brdf.diffuse\""))?.to_owned();
        let number = values.number_key(&key).map_err(|bad| table.error_at("key", bad.problem, bad.remedy))?;
        let none = |what: &str| {
            let remedy = "write `albedo`, `diffuse` or `specular` of a model that has it, or the `tint` of a measured BRDF";
            table.error_at("key", format!("\"{key}\" is no colour that light is proportional to: {what}"), remedy)
        };
        let (surface, colour) = match number {
            NumberKey::Brdf { surface, key } => {
                let brdf = &values.surfaces[surface].brdf;
                match (key, brdf) {
                    ("albedo", Brdf::Lambert { .. }) => (surface, SlotColour::Diffuse),
                    ("diffuse", Brdf::BlinnPhong { .. } | Brdf::CookTorrance { .. } | Brdf::Ward { .. }) => (surface, SlotColour::Diffuse),
                    ("specular", Brdf::BlinnPhong { .. } | Brdf::CookTorrance { .. } | Brdf::Ward { .. }) => {
                        (surface, SlotColour::Specular)
                    }
                    _ => return Err(none("its model has no such colour")),
                }
            }
            NumberKey::Tint { surface } if matches!(values.surfaces[surface].brdf, Brdf::Measured(_)) => (surface, SlotColour::Tint),
            NumberKey::Tint { .. } => return Err(none("the colours of this model say the same")),
            NumberKey::Geometry(_) => return Err(none("it is a number of the geometry")),
        };
        let grey = table.bool("grey")?.unwrap_or(colour == SlotColour::Specular);
        let bounds = table.array::<2>("bounds", range(0.0, 1.0))?.unwrap_or([0.0, 1.0]);
        if bounds[1] < bounds[0] {
            return Err(table.error_at("bounds", "the lower bound lies above the upper", "swap them"));
        }
        table.finish()?;
        Ok(Self { key, number, slot: Slot { surface, colour }, grey, bounds })
    }
}
