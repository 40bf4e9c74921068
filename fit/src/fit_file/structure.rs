//! Other structures and reflectances than a start material's own, with its lengths and colours: what a model choice begins from.

use biscale::brdf::Brdf;
use biscale::error::{BadInput, Error, Result};
use biscale::geometry::weave::Draft;
use biscale::geometry::{Geometry, Grooves, Profile};
use biscale::material::{Material, Surface};
use biscale::toml_reader::Source;
use toml_edit::{DocumentMut, InlineTable, Item, TableLike, Value};

/// Structures that can be tried by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Structure {
    /// Plain weave.
    Plain,
    /// Twill over two and under two whose lines climb to the right.
    Twill,
    /// The same, climbing to the left.
    TwillS,
    /// Satin of five, the warp on top.
    Satin,
    /// The same, the weft on top.
    Sateen,
    /// Grooves with floor, sides and tops.
    Grooves,
    /// V-shaped grooves: a left side and a right one.
    VGrooves,
    /// Rods that stand on a ground.
    Rods,
}

/// Reflectances that can be tried by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reflectance {
    /// Diffuse light alone.
    Lambert,
    /// A highlight beside it (Cook and Torrance's model); its specular colour may be 0.
    Gloss,
}

/// Specular colour and roughness that a search of a highlight begins from. Chosen, not measured: those of the templates of `biscale new`, a little rougher.
const FIRST_GLOSS: [f64; 2] = [0.1, 0.25];
/// Widths of threads over their distance where the start material has none. Chosen, not measured.
const FIRST_WIDTH: f64 = 0.84;

impl Structure {
    /// All of them.
    pub const ALL: [Self; 8] =
        [Self::Plain, Self::Twill, Self::TwillS, Self::Satin, Self::Sateen, Self::Grooves, Self::VGrooves, Self::Rods];
    /// The weaves.
    pub const WEAVES: [Self; 5] = [Self::Plain, Self::Twill, Self::TwillS, Self::Satin, Self::Sateen];
    /// Their names in fit files.
    pub const NAMES: [&str; 8] = ["plain", "twill", "twill-s", "satin", "sateen", "grooves", "v-grooves", "rods"];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// Over, under and shift of a weave.
    fn shifts(self) -> Option<[u32; 3]> {
        match self {
            Self::Plain => Some([1, 1, 1]),
            Self::Twill => Some([2, 2, 1]),
            Self::TwillS => Some([2, 2, 3]),
            Self::Satin => Some([4, 1, 2]),
            Self::Sateen => Some([1, 4, 2]),
            Self::Grooves | Self::VGrooves | Self::Rods => None,
        }
    }

    /// The structure of a geometry, if it is one of these.
    pub fn of(geometry: &Geometry) -> Option<Self> {
        match geometry {
            Geometry::Weave(weave) => Self::WEAVES
                .into_iter()
                .find(|s| s.shifts().is_some_and(|[over, under, shift]| is_shifted(&weave.draft, &Draft::shifted(over, under, shift)))),
            Geometry::Grooves(Grooves { profile: Profile::Flat { .. }, .. }) => Some(Self::Grooves),
            Geometry::Grooves(Grooves { profile: Profile::V, .. }) => Some(Self::VGrooves),
            Geometry::Rods(_) => Some(Self::Rods),
            _ => None,
        }
    }
}

impl Reflectance {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Lambert, Self::Gloss];
    /// Their names in fit files.
    pub const NAMES: [&str; 2] = ["lambert", "gloss"];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize]
    }

    /// The reflectance of all surfaces, if it is one of these.
    pub fn of(surfaces: &[Surface]) -> Option<Self> {
        if surfaces.iter().all(|s| matches!(s.brdf, Brdf::Lambert { .. })) {
            Some(Self::Lambert)
        } else if surfaces.iter().any(|s| matches!(s.brdf, Brdf::Measured(_))) {
            None
        } else {
            Some(Self::Gloss)
        }
    }

    fn brdf(self, colour: [f64; 3]) -> InlineTable {
        let mut table = InlineTable::new();
        let colour: Value = colour.into_iter().map(|c| (c * 1e6).round() / 1e6).collect();
        match self {
            Self::Lambert => {
                table.insert("model", "lambert".into());
                table.insert("albedo", colour);
            }
            Self::Gloss => {
                table.insert("model", "cook-torrance".into());
                table.insert("diffuse", colour);
                table.insert("specular", FIRST_GLOSS[0].into());
                table.insert("alpha", FIRST_GLOSS[1].into());
            }
        }
        table
    }
}

/// Whether a draft is another one, begun at some of its threads and repeated.
fn is_shifted(a: &Draft, b: &Draft) -> bool {
    let same = |di: usize, dj: usize| {
        (0..a.rows.max(b.rows)).all(|j| {
            (0..a.columns.max(b.columns)).all(|i| a.over(i % a.columns, j % a.rows) == b.over((i + di) % b.columns, (j + dj) % b.rows))
        })
    };
    let whole = |m: usize, n: usize| m.max(n).is_multiple_of(m.min(n));
    whole(a.columns, b.columns) && whole(a.rows, b.rows) && (0..b.rows).any(|dj| (0..b.columns).any(|di| same(di, dj)))
}

/// What the diffuse light of a surface is proportional to.
fn diffuse(surface: &Surface) -> Option<[f64; 3]> {
    match surface.brdf {
        Brdf::Lambert { albedo } => Some(albedo),
        Brdf::BlinnPhong { diffuse, .. } | Brdf::CookTorrance { diffuse, .. } | Brdf::Ward { diffuse, .. } => Some(diffuse),
        Brdf::Measured(_) => None,
    }
}

/// A start material of another structure or reflectance, as the text of a file beside `source`; what is `None` stays.
///
/// # Errors
/// Bad input, where the start material has no colours or lengths that another one could begin from.
pub fn build(source: &Source, own: &Material, structure: Option<Structure>, reflectance: Option<Reflectance>) -> Result<Source> {
    let refused = |problem: &str, remedy: &str| Error::from(BadInput::new(problem, remedy).in_file(&source.path));
    let colours: Option<Vec<[f64; 3]>> = own.surfaces.iter().map(diffuse).collect();
    let colours = colours.filter(|c| !c.is_empty()).ok_or_else(|| {
        refused(
            "other structures and reflectances begin from colours, and a measured BRDF has none",
            "name a [[candidate]] with a material of its own",
        )
    })?;
    let structure = structure.filter(|s| Structure::of(&own.geometry) != Some(*s));
    let mut document = source.text.parse::<DocumentMut>().map_err(|_| refused("not valid TOML", "see https://toml.io for the syntax"))?;
    match (structure, &own.geometry) {
        (None, _) => {}
        (Some(structure), Geometry::Weave(_)) if structure.shifts().is_some() => {
            let table = document.get_mut("geometry").and_then(Item::as_table_like_mut);
            let table = table.filter(|t| !t.contains_key("wif"));
            let table = table.ok_or_else(|| {
                refused("a weave after a WIF file has no other structures", "name a [[candidate]] with a material of its own")
            })?;
            set_weave(table, structure);
        }
        (Some(structure), geometry) => {
            let period = period(geometry).ok_or_else(|| {
                refused(
                    "this kind of geometry has no lengths that another structure could begin from",
                    "name a [[candidate]] with a material of its own",
                )
            })?;
            let kept = reflectance.or_else(|| Reflectance::of(&own.surfaces)).unwrap_or(Reflectance::Lambert);
            let text = new_text(own, structure, period, &colours, kept);
            return Ok(Source { path: source.path.clone(), text });
        }
    }
    if let Some(reflectance) = reflectance.filter(|r| Reflectance::of(&own.surfaces) != Some(*r)) {
        set_reflectance(&mut document, reflectance, &colours);
    }
    Ok(Source { path: source.path.clone(), text: document.to_string() })
}

/// Another draft for threads that stay as they are.
fn set_weave(table: &mut dyn TableLike, structure: Structure) {
    for key in ["draft", "weave", "over", "under", "shift"] {
        table.remove(key);
    }
    let [over, under, shift] = structure.shifts().unwrap_or([1; 3]);
    let weave = match structure {
        Structure::Plain => "plain",
        Structure::Twill | Structure::TwillS => "twill",
        _ => "satin",
    };
    table.insert("weave", Item::Value(weave.into()));
    if structure != Structure::Plain {
        for (key, count) in [("over", over), ("under", under), ("shift", shift)] {
            table.insert(key, Item::Value(i64::from(count).into()));
        }
    }
}

/// Another BRDF for each surface, of the same colour.
fn set_reflectance(document: &mut DocumentMut, reflectance: Reflectance, colours: &[[f64; 3]]) {
    let set = |table: &mut dyn TableLike, colour: [f64; 3]| {
        table.insert("brdf", Item::Value(Value::InlineTable(reflectance.brdf(colour))));
    };
    match document.get_mut("surface") {
        Some(Item::ArrayOfTables(tables)) => tables.iter_mut().zip(colours).for_each(|(t, &c)| set(t, c)),
        Some(Item::Value(Value::Array(tables))) => {
            tables.iter_mut().filter_map(Value::as_inline_table_mut).zip(colours).for_each(|(t, &c)| set(t, c));
        }
        _ => {}
    }
}

/// The period that another structure begins from: that of grooves and cells, the distance of a weave's warp threads.
fn period(geometry: &Geometry) -> Option<f64> {
    match geometry {
        Geometry::Weave(weave) => Some(weave.period.x / weave.draft.columns as f64),
        Geometry::Grooves(grooves) => Some(grooves.period),
        Geometry::Rods(rods) => Some(rods.period),
        _ => None,
    }
}

/// A material of a structure that has nothing in common with the start material but a period and colours.
fn new_text(own: &Material, structure: Structure, period: f64, colours: &[[f64; 3]], reflectance: Reflectance) -> String {
    let from_weave = matches!(own.geometry, Geometry::Weave(_));
    let number = |share: f64, of: f64| (share * of * 1e6).round() / 1e6;
    let (geometry, parts): (String, &[&str]) = match structure {
        Structure::Grooves => {
            let [depth, floor, top] = [0.3, 0.3, 0.3].map(|s| number(s, period));
            let text = format!(
                "kind = \"grooves\"\nprofile = \"flat\"\nperiod = {period:?}\ndepth = {depth:?}\nfloor_width = {floor:?}\ntop_width = {top:?}\n"
            );
            (text, &["floor", "sides", "tops"])
        }
        Structure::VGrooves => {
            (format!("kind = \"grooves\"\nprofile = \"v\"\nperiod = {period:?}\ndepth = {:?}\n", number(0.3, period)), &["left", "right"])
        }
        Structure::Rods => {
            let [radius, length] = [0.03, 0.4].map(|s| number(s, period));
            (format!("kind = \"rods\"\nperiod = {period:?}\nradius = {radius:?}\nlength = {length:?}\n"), &["rods", "ground"])
        }
        _ => {
            // Of grooves and cells a repeat of plain weave is one.
            let pitch = if from_weave { period } else { 0.5 * period };
            let (width, gap) = (number(FIRST_WIDTH, pitch), number(1.0 - FIRST_WIDTH, pitch));
            let height = number(0.3, pitch);
            let mut table = toml_edit::Table::new();
            set_weave(&mut table, structure);
            let lengths = format!(
                "warp_width = {width:?}\nwarp_gap = {gap:?}\nwarp_height = {height:?}\nweft_width = {width:?}\nweft_gap = {gap:?}\nweft_height = {height:?}\n"
            );
            (format!("kind = \"weave\"\n{table}{lengths}"), &["warp", "weft"])
        }
    };
    let surfaces: String = parts
        .iter()
        .enumerate()
        .map(|(k, part)| {
            let colour = colours[k * colours.len() / parts.len()];
            format!("\n[[surface]]\npart = \"{part}\"\nbrdf = {}\n", Value::InlineTable(reflectance.brdf(colour)))
        })
        .collect();
    let name = Value::from(own.name.as_str()).to_string();
    format!(
        "# Made from {} by its period and colours.\nformat = 1\nname = {}\nunit = \"{}\"\n\n[geometry]\n{geometry}{surfaces}",
        own.name.replace(char::is_control, " "),
        name.trim(),
        own.unit
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use biscale::geometry;
    use biscale::material::MaterialValues;

    #[test]
    fn every_structure_and_reflectance_is_made_of_every_template_and_is_what_it_is_called() {
        for kind in ["weave", "grooves", "rods"] {
            let source = Source { path: "m.toml".into(), text: geometry::template(kind).unwrap() };
            let own = MaterialValues::parse(&source).unwrap().material().unwrap();
            for structure in Structure::ALL {
                for reflectance in Reflectance::ALL {
                    let made = build(&source, &own, Some(structure), Some(reflectance)).unwrap();
                    let material = Material::parse(&made).unwrap_or_else(|e| panic!("{kind} to {structure:?}: {e}\n{}", made.text));
                    material.build().unwrap();
                    assert_eq!(Structure::of(&material.geometry), Some(structure), "{}", made.text);
                    assert_eq!(Reflectance::of(&material.surfaces), Some(reflectance), "{}", made.text);
                }
            }
        }
    }

    #[test]
    fn a_weave_keeps_its_threads_and_comments_and_a_measured_brdf_is_refused() {
        let text = geometry::template("weave").unwrap();
        let source = Source { path: "m.toml".into(), text: text.clone() };
        let own = Material::parse(&source).unwrap();
        let made = build(&source, &own, Some(Structure::TwillS), None).unwrap().text;
        assert!(made.contains("warp_width = 0.42") && made.contains("# Width of the warp threads") && made.contains("shift = 3"), "{made}");
        assert_eq!(build(&source, &own, Some(Structure::Plain), Some(Reflectance::Lambert)).unwrap().text, text);
        let measured = "format = 1\n[geometry]\nkind = \"weave\"\n[[surface]]\npart = \"*\"\nbrdf = { model = \"measured\", name = \"gold-metallic-paint\" }\n";
        let source = Source { path: "m.toml".into(), text: measured.into() };
        let own = Material::parse(&source).unwrap();
        let refused = build(&source, &own, None, Some(Reflectance::Gloss)).unwrap_err().to_string();
        assert!(refused.contains("measured"), "{refused}");
    }
}
