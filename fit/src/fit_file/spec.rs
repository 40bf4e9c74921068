//! Fit files: TOML in, a [`Spec`] out, with all that it names loaded and checked. The format is documented in `docs/fit.md`.

use crate::fit_file::assignment::{Assignment, assign};
use crate::fit_file::capture;
use crate::fit_file::material_text::MaterialText;
use crate::fit_file::variant;
use crate::photograph::image::{Image, LIGHT_SIGMA_DEG, Photograph, Pinhole, Role};
use biscale::brdf::Brdf;
use biscale::error::{BadInput, Result};
use biscale::filter::{Slot, SlotColour};
use biscale::material::{Material, MaterialValues, NumberKey};
use biscale::render::{Camera, Light, Object};
use biscale::toml_reader::{Range, Source, TableReader, range};
use std::path::{Path, PathBuf};

/// Any number of a material.
const NUMBER: Range = range(-1e9, 1e9);
/// Reflections after the first where the fit file says nothing: photographs of real surfaces show them. Chosen, not measured: between white
/// threads the fifth reflection is below the tolerance that they are traced to.
pub const USUAL_BOUNCES: u32 = 4;
/// Relative standard deviations of an irradiance.
const IRRADIANCE_SIGMAS: Range = range(0.0, 10.0);
/// Most parameters that a search moves.
pub const MAX_PARAMETERS: usize = 32;
/// Most numbers of sides that are tried.
const MAX_SIDES: usize = 4;
/// Most photographs.
const MAX_PHOTOGRAPHS: usize = 16;

/// A fit file, read and checked.
#[derive(Clone, Debug)]
pub struct Spec {
    /// The file.
    pub source: Source,
    /// Its name.
    pub name: String,
    /// The material file to start from, as text: what was found is written into it at last.
    pub text: MaterialText,
    /// The same, typed: its numbers move.
    pub values: MaterialValues,
    /// Where it stands.
    pub material_file: PathBuf,
    /// The material as it starts.
    pub material: Material,
    /// What may move.
    pub parameters: Vec<Parameter>,
    /// Colours to be found.
    pub colours: Vec<Colour>,
    /// Photographs by role, in the order of the file.
    pub photographs: Vec<Photograph>,
    /// Whether a constant light over the whole picture may be found.
    pub stray_light: bool,
    /// Reflections after the first that the photographs show.
    pub bounces: u32,
    /// Whether the material's lengths are scaled so that its period is that of the close-up.
    pub scale_to_close_up: bool,
    /// Numbers of sides of a thread's section that are tried, the start material's own first; none if that one is held.
    pub sides: Vec<u32>,
    /// What the user should know.
    pub notes: Vec<String>,
}

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

    /// Whether it may move.
    pub fn is_free(&self) -> bool {
        self.bounds[1] > self.bounds[0]
    }
}

impl Spec {
    /// Whether this text is that of a fit file: something moves, or there are photographs and a material to start from.
    pub fn is_fit(source: &Source) -> bool {
        source.parse().is_ok_and(|root| {
            let table = root.get_ref();
            let has = |key: &str| table.contains_key(key);
            // The photographs of a shoot have no material to start from.
            !has("geometry") && (has("parameter") || has("colour") || (has("material") && (has("photograph") || has("capture"))))
        })
    }

    /// Reads and checks a fit file and all that it names.
    ///
    /// # Errors
    /// Bad input, by file, line and field; those of the material and the photographs.
    pub fn load(path: &Path) -> Result<Self> {
        Self::parse(&Source::read(path)?)
    }

    /// Checks the text of a fit file; paths in it are relative to `source.path`.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn parse(source: &Source) -> Result<Self> {
        let root = source.parse()?;
        let top = TableReader::new(source, "", root.get_ref(), 0);
        let name = top.head()?;
        let material_file = top.path("material")?.ok_or_else(|| top.missing("material", "\"start.toml\""))?;
        let material_source = Source::read(&material_file)?;
        let values = MaterialValues::parse(&material_source)?;
        let material = values.material()?;
        let mut text = MaterialText::new(&material_source)?;
        material.build()?;
        let stray_light = top.bool("veil")?.unwrap_or(true);
        let bounces = top.integer("bounces", 0, 64)?.unwrap_or(USUAL_BOUNCES);
        let scale_to_close_up = top.bool("scale_to_close_up")?.unwrap_or(false);
        let sigma = top.f64("light_sigma_deg", range(0.0, 30.0))?;
        let irradiance_sigma = top.f64("irradiance_sigma", IRRADIANCE_SIGMAS)?;
        let parameters =
            top.tables("parameter")?.into_iter().map(|t| Parameter::read(t, &values, &mut text)).collect::<Result<Vec<_>>>()?;
        let colours = top.tables("colour")?.into_iter().map(|t| Colour::read(t, &values)).collect::<Result<Vec<_>>>()?;
        let sides = sides(&top, &material, &parameters)?;
        let mut notes = Vec::new();
        let mut photographs = Vec::new();
        if let Some(folder) = top.str("capture")? {
            let folder = source.folder().join(folder);
            photographs = capture::photographs(&folder, sigma, &mut notes)?;
            photographs.iter_mut().for_each(|p| p.stated_irradiance_sigma = irradiance_sigma);
        }
        let shared = SharedTables { camera: top.table("camera")?, object: top.table("object")?, sigma, irradiance_sigma };
        for table in top.tables("photograph")? {
            photographs.push(shared.photograph(table)?);
        }
        if let Some(table) = shared.camera {
            Camera::read(table)?;
        }
        if let Some(table) = shared.object {
            Object::read_bare(table)?;
        }
        let spec = Self {
            source: source.clone(),
            name,
            text,
            values,
            material_file,
            material,
            parameters,
            colours,
            photographs,
            stray_light,
            bounces,
            scale_to_close_up,
            sides,
            notes,
        };
        spec.check(&top)?;
        top.finish()?;
        Ok(spec)
    }

    fn check(&self, top: &TableReader<'_>) -> Result<()> {
        let count = |role| self.photographs.iter().filter(|p| p.role == role).count();
        if count(Role::Distant) == 0 {
            let remedy = "add a [[photograph]] with `role = \"distant\"`, or `capture = \"FOLDER\"`";
            return Err(top.error("there is no photograph to fit", remedy));
        }
        if count(Role::CloseUp) > 1 {
            return Err(top.error_at("photograph", "there are two close-ups", "keep one"));
        }
        if self.photographs.len() > MAX_PHOTOGRAPHS {
            let problem = format!("there are {} photographs", self.photographs.len());
            return Err(top.error_at("photograph", problem, format!("at most {MAX_PHOTOGRAPHS} are possible")));
        }
        if self.parameters.len() > MAX_PARAMETERS {
            let problem = format!("there are {} parameters", self.parameters.len());
            return Err(top.error_at("parameter", problem, format!("at most {MAX_PARAMETERS} are possible")));
        }
        let mut moved: Vec<(&str, NumberKey)> = self.parameters.iter().map(|p| (&*p.key, p.number)).collect();
        moved
            .extend(self.parameters.iter().flat_map(|p| p.same.iter().copied().chain(p.rest.map(|r| r.0)).map(|number| (&*p.key, number))));
        moved.extend(self.colours.iter().map(|c| (&*c.key, c.number)));
        for (k, (key, number)) in moved.iter().enumerate() {
            if moved[..k].iter().any(|(_, n)| n == number) {
                return Err(top.error_at("parameter", format!("what \"{key}\" moves is moved twice"), "keep one of the two"));
            }
        }
        Ok(())
    }

    /// Photographs of a role.
    pub fn of_role(&self, role: Role) -> impl Iterator<Item = &Photograph> {
        self.photographs.iter().filter(move |p| p.role == role)
    }
}

/// The numbers of sides that threads are tried with.
fn sides(top: &TableReader<'_>, material: &Material, parameters: &[Parameter]) -> Result<Vec<u32>> {
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

/// What the photographs of a file have in common.
struct SharedTables<'a> {
    camera: Option<TableReader<'a>>,
    object: Option<TableReader<'a>>,
    sigma: Option<f64>,
    irradiance_sigma: Option<f64>,
}

impl<'a> SharedTables<'a> {
    fn photograph(&self, table: TableReader<'a>) -> Result<Photograph> {
        const ROLES: [(&str, Role); 3] = [("distant", Role::Distant), ("close-up", Role::CloseUp), ("validation", Role::Validation)];
        let file = table.path("image")?.ok_or_else(|| table.missing("image", "\"photograph.exr\""))?;
        let role = table.choice("role", &ROLES.map(|r| r.0))?.ok_or_else(|| table.missing("role", "\"distant\""))?;
        let mask = table.path("mask")?;
        let own = |key: &'static str, shared: &Option<TableReader<'a>>| -> Result<TableReader<'a>> {
            match (table.table(key)?, shared) {
                (Some(own), _) => Ok(own),
                (None, Some(shared)) => Ok(shared.again()),
                (None, None) => {
                    let problem = format!("neither this photograph nor the file has a table `{key}`");
                    Err(table.error(problem, format!("add [photograph.{key}] here, or [{key}] for all photographs")))
                }
            }
        };
        let camera = Camera::read(own("camera", &self.camera)?)?;
        let object = Object::read_bare(own("object", &self.object)?)?;
        let light = table.table("light")?.ok_or_else(|| {
            let remedy = "add [photograph.light] with `type`, `to_light` and `irradiance_rgb`";
            table.error("the photograph has no light", remedy)
        })?;
        let light = Light::read(light)?;
        let own_sigma = table.f64("light_sigma_deg", range(0.0, 30.0))?;
        let exposure_known = table.bool("exposure_known")?.unwrap_or(true);
        let stated_irradiance_sigma = table.f64("irradiance_sigma", IRRADIANCE_SIGMAS)?.or(self.irradiance_sigma);
        let a = table.colour("noise_a", range(0.0, 1e9))?;
        let b = table.colour("noise_b", range(0.0, 1e9))?;
        let noise = match (a, b) {
            (None, None) => None,
            (a, b) => Some([a.unwrap_or_default(), b.unwrap_or_default()]),
        };
        let image = Image::load(&file, mask.as_deref())?;
        if (image.width, image.height) != (camera.width, camera.height) {
            let problem =
                format!("the photograph has {} x {} pixels, its camera {} x {}", image.width, image.height, camera.width, camera.height);
            return Err(table.error_at("image", problem, "write the photograph's own width and height"));
        }
        table.finish()?;
        Ok(Photograph {
            file,
            role: ROLES[role].1,
            image,
            camera: Pinhole::of(&camera),
            light,
            light_sigma_deg: own_sigma.or(self.sigma).unwrap_or(LIGHT_SIGMA_DEG),
            exposure_known,
            stated_irradiance_sigma,
            object,
            noise,
        })
    }
}

impl Parameter {
    fn read(table: TableReader<'_>, values: &MaterialValues, text: &mut MaterialText) -> Result<Self> {
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
    fn read(table: TableReader<'_>, values: &MaterialValues) -> Result<Self> {
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
