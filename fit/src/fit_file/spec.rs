//! Fit files: TOML in, a [`Spec`] out, with all that it names loaded and checked. The format is documented in `docs/fit.md`.

use crate::fit_file::candidate::{self, Candidate};
use crate::fit_file::capture;
use crate::fit_file::material_text::MaterialText;
pub use crate::fit_file::moving::{Colour, Parameter};
use crate::fit_file::moving::{add_others, default_moves, read_moves, sides};
use crate::photograph::image::{Image, LIGHT_SIGMA_DEG, Photograph, Pinhole, Role};
use biscale::error::Result;
use biscale::material::{Material, MaterialValues, NumberKey};
use biscale::render::{Camera, Light, Object};
use biscale::toml_reader::{Range, Source, TableReader, range};
use std::path::{Path, PathBuf};

/// Reflections after the first where the fit file says nothing: photographs of real surfaces show them. Chosen, not measured: between white
/// threads the fifth reflection is below the tolerance that they are traced to.
pub const USUAL_BOUNCES: u32 = 4;
/// Relative standard deviations of an irradiance.
const IRRADIANCE_SIGMAS: Range = range(0.0, 10.0);
/// Most parameters that a search moves.
pub const MAX_PARAMETERS: usize = 32;
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
    /// Other materials that the photographs may show.
    pub candidates: Vec<Candidate>,
    /// What the user should know.
    pub notes: Vec<String>,
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
        let (mut parameters, mut colours) = read_moves(&top, &values, &mut text)?;
        if top.choice("moves", &["all"])?.is_some() {
            let (others, other_colours) = default_moves(&material_source, &values, &material, &mut text)?;
            add_others(&mut parameters, &mut colours, others, other_colours);
        }
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
        let mut spec = Self {
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
            candidates: Vec::new(),
            notes,
        };
        spec.check(&top)?;
        spec.candidates = candidate::read(&top, &material_source, &spec.own())?;
        for candidate in &spec.candidates {
            spec.check_moves(candidate, &top)?;
        }
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
        self.check_moves(&self.own(), top)
    }

    /// Nothing of a material is moved twice.
    fn check_moves(&self, asked: &Candidate, top: &TableReader<'_>) -> Result<()> {
        if asked.parameters.len() > MAX_PARAMETERS {
            let problem = format!("there are {} parameters", asked.parameters.len());
            return Err(top.error_at("parameter", problem, format!("at most {MAX_PARAMETERS} are possible")));
        }
        let mut moved: Vec<(&str, NumberKey)> = asked.parameters.iter().map(|p| (&*p.key, p.number)).collect();
        moved.extend(
            asked.parameters.iter().flat_map(|p| p.same.iter().copied().chain(p.rest.map(|r| r.0)).map(|number| (&*p.key, number))),
        );
        moved.extend(asked.colours.iter().map(|c| (&*c.key, c.number)));
        for (k, (key, number)) in moved.iter().enumerate() {
            if moved[..k].iter().any(|(_, n)| n == number) {
                return Err(top.error_at("parameter", format!("what \"{key}\" moves is moved twice"), "keep one of the two"));
            }
        }
        Ok(())
    }

    /// The start material as a candidate.
    pub fn own(&self) -> Candidate {
        Candidate {
            name: candidate::name_of(&self.material, &self.name),
            text: self.text.clone(),
            values: self.values.clone(),
            material_file: self.material_file.clone(),
            material: self.material.clone(),
            parameters: self.parameters.clone(),
            colours: self.colours.clone(),
            sides: self.sides.clone(),
        }
    }

    /// The same question, asked of one candidate alone.
    #[must_use]
    pub fn of(&self, candidate: &Candidate) -> Self {
        let Candidate { name: _, text, values, material_file, material, parameters, colours, sides } = candidate.clone();
        Self { text, values, material_file, material, parameters, colours, sides, candidates: Vec::new(), ..self.clone() }
    }

    /// Photographs of a role.
    pub fn of_role(&self, role: Role) -> impl Iterator<Item = &Photograph> {
        self.photographs.iter().filter(move |p| p.role == role)
    }
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
