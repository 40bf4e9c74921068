//! Pictures of a study: a sphere and a ring in the material, by several settings, and how far they are apart (after Fig. 11 and 12 of Wu et
//! al. 2011). Each picture is made by `biscale render`, each comparison by `biscale compare`, in a process of its own.

use super::args::TriedMethod;
use super::child::{self, ChildOutput};
use super::folder::{CACHE, Folder};
use biscale::error::{Error, Result};
use biscale::filter::Control;
use biscale::image_file;
use serde::Serialize;
use serde_json::Value as Json;
use std::f64::consts::TAU;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Where pictures lie in the folder of a study.
const PICTURES: &str = "pictures";
/// Pixels of a side, and of a quick study.
const SIDE: [u32; 2] = [160, 64];
/// Factor of the differences.
const FACTOR: &str = "3";
/// What the 99th percentile of the values is shown as, linear.
const BRIGHT: f64 = 0.8;

/// A way to make a picture.
#[derive(Clone, Copy, Debug)]
struct RenderSetting {
    /// Part of the file's name.
    name: &'static str,
    method: TriedMethod,
    /// For `lowrank`.
    variant: &'static str,
    /// Tolerance, and that of a quick study.
    tolerance: [f64; 2],
    bounces: u32,
    /// The picture that it is compared with.
    against: &'static str,
}

/// What the others are compared with.
const FINE: RenderSetting =
    RenderSetting { name: "direct-fine", method: TriedMethod::Direct, variant: "paper", tolerance: [0.02, 0.05], bounces: 0, against: "" };
const SETTINGS: [RenderSetting; 6] = [
    FINE,
    RenderSetting { name: "direct-rough", tolerance: [0.2, 0.2], against: FINE.name, ..FINE },
    RenderSetting { name: "lowrank-paper", method: TriedMethod::Lowrank, against: FINE.name, ..FINE },
    RenderSetting {
        name: "lowrank-improved",
        method: TriedMethod::Lowrank,
        variant: "improved",
        tolerance: [0.05, 0.1],
        against: FINE.name,
        ..FINE
    },
    RenderSetting { name: "reference", method: TriedMethod::Reference, tolerance: [0.05, 0.1], against: FINE.name, ..FINE },
    RenderSetting {
        name: "interreflections",
        method: TriedMethod::Reference,
        tolerance: [0.05, 0.1],
        bounces: 4,
        against: "reference",
        ..FINE
    },
];

/// One picture, and how far it is from the one that it is compared with.
#[derive(Clone, Debug, Serialize)]
pub struct StudyPicture {
    /// `sphere` or `ring`.
    pub scene: &'static str,
    pub name: &'static str,
    pub against: &'static str,
    /// Wall seconds of all stages.
    pub seconds: Option<f64>,
    /// Relative RMS error that `render` states.
    pub stated: Option<f64>,
    /// The panels, as a path within the study's folder.
    pub panels: Option<String>,
    pub psnr_db: Option<f64>,
    pub relative_rms: Option<f64>,
    pub flip: Option<f64>,
    /// Why there is none.
    pub problem: Option<String>,
}

/// What pictures are made with.
pub struct Studio<'a> {
    pub material: &'a Path,
    pub methods: &'a [TriedMethod],
    pub quick: bool,
    pub seed: u64,
    pub threads: u16,
    pub time_limit: Duration,
}

/// Scenes, by name.
const SCENES: [&str; 2] = ["sphere", "ring"];

/// Files that a new study takes away.
pub fn old_files() -> Vec<String> {
    let of = |scene: &&str| SETTINGS.map(|look| ["exr", "json"].map(|ending| format!("{PICTURES}/{scene}-{}.{ending}", look.name)));
    SCENES.iter().flat_map(of).flatten().collect()
}

impl Studio<'_> {
    /// Makes the pictures that are not there yet, and compares them. `progress` is told the share that is done.
    ///
    /// # Errors
    /// `Interrupted`; i/o. A picture that cannot be made says why.
    pub fn make(&self, folder: &Folder, progress: &dyn Fn(f64), control: &Control<'_>) -> Result<Vec<StudyPicture>> {
        let of_folder = |source| Error::Io { action: "create", path: folder.path(PICTURES), source };
        std::fs::create_dir_all(folder.path(PICTURES)).map_err(of_folder)?;
        folder.write(&format!("{PICTURES}/ring.obj"), ring().as_bytes())?;
        let looks: Vec<&RenderSetting> = SETTINGS.iter().filter(|l| l.name == FINE.name || self.methods.contains(&l.method)).collect();
        let mut pictures = Vec::new();
        for (s, scene) in SCENES.into_iter().enumerate() {
            let Some(text) = self.scene(scene) else { continue };
            folder.write(&format!("{PICTURES}/{scene}.toml"), text.as_bytes())?;
            let mut exposure = None;
            // Rays for every pair of directions take their time: in a quick study for the first scene only.
            let looks = looks.iter().filter(|look| !self.quick || s == 0 || look.method != TriedMethod::Reference);
            for (k, look) in looks.enumerate() {
                progress((s as f64 + k as f64 / SETTINGS.len() as f64) / SCENES.len() as f64);
                let mut picture = self.render(folder, scene, look, control)?;
                if exposure.is_none() && picture.problem.is_none() {
                    exposure = Some(stops(&image(folder, scene, look.name))?);
                }
                let fine = pictures.iter().any(|p: &StudyPicture| p.scene == scene && p.name == look.against && p.problem.is_none());
                if let (Some(stops), true, None) = (exposure, fine, &picture.problem) {
                    compare(folder, &mut picture, stops, self.time_limit, control)?;
                }
                pictures.push(picture);
            }
        }
        Ok(pictures)
    }

    /// The text of a scene; `None` where the material's path cannot be written into it.
    fn scene(&self, scene: &str) -> Option<String> {
        let material = std::fs::canonicalize(self.material).ok()?;
        // Strings of JSON are strings of TOML.
        let material = serde_json::to_string(material.to_str()?).ok()?;
        let side = SIDE[usize::from(self.quick)];
        let object = match scene {
            "sphere" => "kind = \"sphere\"\nradius = 1.0",
            _ => "kind = \"mesh\"\nfile = \"ring.obj\"\nrotate_deg = [38.0, -14.0, 0.0]\ntangents = \"uv\"",
        };
        Some(format!(
            "# Made by `biscale study`: `biscale render` makes its pictures again.\nformat = 1\nname = \"{scene}\"\n\n[camera]\norigin = [0.0, -6.0, 1.6]\n\
             target = [0.0, 0.0, 0.0]\nfov_deg = 22.0\nwidth = {side}\nheight = {side}\n\n[[light]]\ntype = \"directional\"\nto_light = [-1.0, -1.0, 1.2]\n\
             irradiance_rgb = [3.0, 3.0, 3.0]\n\n[[light]]\ntype = \"directional\"\nto_light = [1.4, -0.5, 0.4]\nirradiance_rgb = [0.7, 0.7, 0.7]\n\n\
             [[object]]\n{object}\nmaterial = {material}\n"
        ))
    }

    fn render(&self, folder: &Folder, scene: &'static str, look: &RenderSetting, control: &Control<'_>) -> Result<StudyPicture> {
        let mut picture = StudyPicture {
            scene,
            name: look.name,
            against: look.against,
            seconds: None,
            stated: None,
            panels: None,
            psnr_db: None,
            relative_rms: None,
            flip: None,
            problem: None,
        };
        let notes = format!("{PICTURES}/{scene}-{}.json", look.name);
        let made = std::fs::read(folder.path(&notes)).ok().and_then(|bytes| serde_json::from_slice::<Json>(&bytes).ok());
        let object = match made.filter(|_| image(folder, scene, look.name).is_file()) {
            Some(object) => object,
            None => {
                let tolerance = look.tolerance[usize::from(self.quick)];
                let mut arguments = words(&["render", "--json", "--quiet", "--force", "--method", &look.method.to_string()]);
                arguments.extend(words(&["--variant", look.variant, "--tolerance", &tolerance.to_string()]));
                arguments.extend(words(&["--bounces", &look.bounces.to_string(), "--seed", &self.seed.to_string()]));
                arguments.extend(words(&["--threads", &self.threads.to_string(), "-o"]));
                arguments.extend([image(folder, scene, look.name).into(), folder.path(&format!("{PICTURES}/{scene}.toml")).into()]);
                match said(child::spawn(&arguments, &folder.path(CACHE), self.time_limit, control)?)? {
                    Ok(object) => {
                        folder.write(&notes, object.to_string().as_bytes())?;
                        object
                    }
                    Err(problem) => return Ok(StudyPicture { problem: Some(problem), ..picture }),
                }
            }
        };
        let summary = &object["summary"];
        picture.seconds = summary["milliseconds"].as_object().map(|stages| stages.values().filter_map(Json::as_f64).sum::<f64>() / 1e3);
        picture.stated = summary["materials"][0]["relative_rms_error"].as_f64();
        Ok(picture)
    }
}

fn words(words: &[&str]) -> Vec<OsString> {
    words.iter().map(OsString::from).collect()
}

fn image(folder: &Folder, scene: &str, name: &str) -> PathBuf {
    folder.path(&format!("{PICTURES}/{scene}-{name}.exr"))
}

/// What a child printed as JSON, or why it did not.
///
/// # Errors
/// `Interrupted`.
fn said(said: Option<ChildOutput>) -> Result<Result<Json, String>> {
    let Some(said) = said else { return Ok(Err("longer than --time-limit".to_owned())) };
    let object: Json = serde_json::from_slice(&said.stdout).unwrap_or_default();
    if object["error"]["kind"] == "interrupted" {
        return Err(Error::Interrupted);
    }
    Ok(match object["error"]["message"].as_str() {
        None if said.status.success() => Ok(object),
        None => Err(format!("the run ended with {}", said.status)),
        Some(message) => Err(message.to_owned()),
    })
}

/// Compares a picture with another one, and makes the panels.
fn compare(folder: &Folder, picture: &mut StudyPicture, stops: f64, limit: Duration, control: &Control<'_>) -> Result<()> {
    let panels = format!("{PICTURES}/{}-{}-and-{}.png", picture.scene, picture.against, picture.name);
    let mut arguments = words(&["compare", "--json", "--quiet", "--force", "--factor", FACTOR]);
    arguments.push(format!("--exposure={stops:.3}").into());
    arguments.extend(["-o".into(), folder.path(&panels).into()]);
    arguments.extend([picture.against, picture.name].map(|name| image(folder, picture.scene, name).into()));
    match said(child::spawn(&arguments, &folder.path(CACHE), limit, control)?)? {
        Ok(object) => {
            let summary = &object["summary"];
            picture.panels = Some(panels.clone());
            picture.psnr_db = summary["psnr_db"].as_f64();
            picture.relative_rms = summary["relative_rms"].as_f64();
            picture.flip = summary["flip_mean"].as_f64();
            folder.note(&panels);
        }
        Err(problem) => picture.problem = Some(problem),
    }
    Ok(())
}

/// Stops by which a picture is shown so that its brightest values, a hundredth left aside, are bright.
fn stops(image: &Path) -> Result<f64> {
    let raster = image_file::read(image)?;
    let mut values: Vec<f32> = raster.channels.iter().flatten().copied().filter(|v| *v > 0.0).collect();
    values.sort_by(f32::total_cmp);
    let bright = values.get(values.len() * 99 / 100).copied().unwrap_or(1.0);
    Ok((BRIGHT / f64::from(bright)).log2().clamp(-30.0, 30.0))
}

/// A ring as OBJ: u runs around it, v around its tube.
fn ring() -> String {
    const AROUND: u32 = 96;
    const TUBE: u32 = 48;
    const RADII: [f64; 2] = [0.72, 0.34];
    let mut text = String::from("# a ring, made by `biscale study`\n");
    for i in 0..AROUND {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(AROUND)).sin_cos();
        for j in 0..TUBE {
            let (up, out) = (TAU * f64::from(j) / f64::from(TUBE)).sin_cos();
            let r = RADII[0] + RADII[1] * out;
            let _ = writeln!(text, "v {:.6} {:.6} {:.6}", r * cos, r * sin, RADII[1] * up);
        }
    }
    for i in 0..=AROUND {
        for j in 0..=TUBE {
            let _ = writeln!(text, "vt {:.6} {:.6}", f64::from(i) / f64::from(AROUND), f64::from(j) / f64::from(TUBE));
        }
    }
    let corner = |i: u32, j: u32| format!("{}/{}", i % AROUND * TUBE + j % TUBE + 1, i * (TUBE + 1) + j + 1);
    for i in 0..AROUND {
        for j in 0..TUBE {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            let _ = writeln!(text, "f {a} {b} {c}\nf {a} {c} {d}");
        }
    }
    text
}
