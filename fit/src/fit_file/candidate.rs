//! Candidates: other materials than the start material that the photographs may show, each with what moves in it.

use crate::fit_file::material_text::MaterialText;
use crate::fit_file::moving::{Colour, Parameter, default_moves, read_moves, sides};
use crate::fit_file::structure::{Reflectance, Structure, build};
use crate::fit_file::variant;
use biscale::error::Result;
use biscale::geometry::Geometry;
use biscale::material::{Material, MaterialValues, NumberKey};
use biscale::toml_reader::{Source, TableReader};
use std::path::PathBuf;

/// Most candidates, the start material among them. Chosen, not measured: all structures with both reflectances, and as many files again.
pub const MAX_CANDIDATES: usize = 32;

/// A material that the photographs may show.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Its name.
    pub name: String,
    /// Its file, as text: what was found is written into it at last.
    pub text: MaterialText,
    /// The same, typed.
    pub values: MaterialValues,
    /// Where that stands, or the start material that it was made of.
    pub material_file: PathBuf,
    /// The material as it starts.
    pub material: Material,
    /// What may move.
    pub parameters: Vec<Parameter>,
    /// Colours to be found.
    pub colours: Vec<Colour>,
    /// Numbers of sides of a thread's section that are tried, its own first; none if that one is held.
    pub sides: Vec<u32>,
}

impl Candidate {
    /// A `[[candidate]]` table; without tables of its own all moves that photographs may tell.
    fn read(table: TableReader<'_>) -> Result<Self> {
        let file = table.path("material")?.ok_or_else(|| table.missing("material", "\"other.toml\""))?;
        let source = Source::read(&file)?;
        let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = table.str("name")?.map_or(stem, str::to_owned);
        let values = MaterialValues::parse(&source)?;
        let material = values.material()?;
        material.build()?;
        let mut text = MaterialText::new(&source)?;
        let (mut parameters, mut colours) = read_moves(&table, &values, &mut text)?;
        if parameters.is_empty() && colours.is_empty() {
            (parameters, colours) = default_moves(&source, &values, &material, &mut text)?;
        }
        let sides = sides(&table, &material, &parameters)?;
        table.finish()?;
        Ok(Self { name, text, values, material_file: file, material, parameters, colours, sides })
    }

    /// The start material in another structure or with another reflectance. Numbers of its geometry that the fit file moves move as there, if it has them.
    fn made(source: &Source, own: &Self, structure: Option<Structure>, reflectance: Option<Reflectance>) -> Result<Self> {
        let made = build(source, &own.material, structure, reflectance)?;
        let values = MaterialValues::parse(&made)?;
        let material = values.material()?;
        material.build()?;
        let mut text = MaterialText::new(&made)?;
        let (mut parameters, mut colours) = default_moves(&made, &values, &material, &mut text)?;
        if is_same_kind(&material.geometry, &own.material.geometry) {
            let is_geometry = |p: &Parameter| matches!(p.number, NumberKey::Geometry(_));
            let mut kept: Vec<Parameter> = own.parameters.iter().filter(|p| is_geometry(p)).cloned().collect();
            kept.extend(parameters.into_iter().filter(|p| !is_geometry(p)));
            parameters = kept;
        }
        if made.text == own.text.text() || Reflectance::of(&material.surfaces) == Reflectance::of(&own.material.surfaces) {
            // The same surfaces: what the fit file says of their colours and roughness holds.
            let same = material.surfaces.len() == own.material.surfaces.len()
                && material.surfaces.iter().zip(&own.material.surfaces).all(|(a, b)| a.part == b.part && a.brdf.model() == b.brdf.model());
            if same {
                parameters.retain(|p| matches!(p.number, NumberKey::Geometry(_)));
                parameters.extend(own.parameters.iter().filter(|p| !matches!(p.number, NumberKey::Geometry(_))).cloned());
                colours.clone_from(&own.colours);
            }
        }
        let sides = if is_same_kind(&material.geometry, &own.material.geometry) {
            own.sides.clone()
        } else {
            let moves = parameters.iter().any(|p| p.is_free() && matches!(p.number, NumberKey::Geometry(_)));
            variant::default_sides(&material.geometry, moves)
        };
        let name = name_of(&material, &own.name);
        Ok(Self { name, text, values, material_file: own.material_file.clone(), material, parameters, colours, sides })
    }
}

/// Whether two geometries have the same keys.
fn is_same_kind(a: &Geometry, b: &Geometry) -> bool {
    let profile = |g: &Geometry| if let Geometry::Grooves(g) = g { Some(std::mem::discriminant(&g.profile)) } else { None };
    a.kind() == b.kind() && profile(a) == profile(b)
}

/// A name that says what it is.
pub fn name_of(material: &Material, otherwise: &str) -> String {
    let structure = Structure::of(&material.geometry).map_or_else(|| material.geometry.kind().to_owned(), |s| s.name().to_owned());
    let structure = if structure == "mesh" || structure == "height-field" { otherwise.to_owned() } else { structure };
    match Reflectance::of(&material.surfaces) {
        Some(reflectance) => format!("{structure}, {}", reflectance.name()),
        None => structure,
    }
}

/// All candidates of a fit file beside its start material: `structures` with each of the `reflectances`, then the `[[candidate]]` tables.
///
/// # Errors
/// Bad input by field.
pub fn read(top: &TableReader<'_>, own_source: &Source, own: &Candidate) -> Result<Vec<Candidate>> {
    let words = |key: &'static str, all: &[&'static str]| -> Result<Vec<usize>> {
        let given = top.strings(key)?.unwrap_or_default();
        given
            .into_iter()
            .map(|word| {
                all.iter()
                    .position(|w| *w == word)
                    .ok_or_else(|| top.error_at(key, format!("\"{word}\" is none of them"), biscale::toml_reader::suggest(word, all)))
            })
            .collect()
    };
    let some = |indices: Vec<usize>| -> Vec<Option<usize>> {
        if indices.is_empty() { vec![None] } else { indices.into_iter().map(Some).collect() }
    };
    let structures = some(words("structures", &Structure::NAMES)?);
    let reflectances = some(words("reflectances", &Reflectance::NAMES)?);
    let mut names = vec![own.name.clone()];
    let mut found = Vec::new();
    for &structure in &structures {
        for &reflectance in &reflectances {
            if structure.is_none() && reflectance.is_none() {
                continue;
            }
            let made = Candidate::made(own_source, own, structure.map(|k| Structure::ALL[k]), reflectance.map(|k| Reflectance::ALL[k]))?;
            // The start material itself is tried as the fit file says.
            if !names.contains(&made.name) {
                names.push(made.name.clone());
                found.push(made);
            }
        }
    }
    for table in top.tables("candidate")? {
        let at = table.again();
        let candidate = Candidate::read(table)?;
        if names.contains(&candidate.name) {
            return Err(at.error_at("name", format!("two candidates are called \"{}\"", candidate.name), "give one another `name`"));
        }
        names.push(candidate.name.clone());
        found.push(candidate);
    }
    if names.len() > MAX_CANDIDATES {
        return Err(top.error_at(
            "candidate",
            format!("there are {} candidates", names.len()),
            format!("at most {MAX_CANDIDATES} are possible"),
        ));
    }
    Ok(found)
}
