//! A material or a mesh file, repeated and scaled to triangles in mm.

use super::colours::colours;
use crate::mesh::Triangles;
use biscale::error::{BadInput, Error, Result};
use biscale::geometry::mesh::read_plain;
use biscale::geometry::weave::Weave;
use biscale::geometry::{Geometry, Tile};
use biscale::material::{Material, SmallScale, Tint, UNITS};
use glam::{DVec2, DVec3};
use std::path::Path;

/// Endings of plain meshes.
pub const MESH_ENDINGS: [&str; 3] = ["obj", "ply", "stl"];

/// Most triangles of a repeated tile that are looked at: a sheet that a person folds has thousands at most. Chosen, not measured.
pub const MAX_TRIANGLES: usize = 2_000_000;

/// What is made where neither size nor periods are given, mm. Chosen, not measured: fits a4 upright with its margins and tabs.
pub const DEFAULT_SIZE: DVec2 = DVec2::new(120.0, 80.0);

/// What the user says about the size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extent {
    /// This many mm, rounded to whole periods, at least one.
    Size(DVec2),
    /// This many periods.
    Periods([u32; 2]),
}

/// A material, or a plain mesh.
#[derive(Clone, Debug)]
pub enum Source {
    /// A material file and its surface.
    Material(Box<(Material, SmallScale)>),
    /// A mesh file.
    Mesh(Triangles, Vec<String>),
}

impl Source {
    /// Reads a material file, or a mesh by its ending.
    ///
    /// # Errors
    /// Those of the readers.
    pub fn load(path: &Path) -> Result<Self> {
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        if MESH_ENDINGS.contains(&ending.as_str()) {
            let mesh = read_plain(path)?;
            if mesh.triangles.is_empty() {
                return Err(BadInput::new("the file has no faces", "export a surface, not points or lines").in_file(path).into());
            }
            return Ok(Self::Mesh(Triangles::white(mesh.vertices, mesh.triangles), mesh.notes));
        }
        let material = Material::load(path)?;
        let surface = material.build()?;
        Ok(Self::Material(Box::new((material, surface))))
    }

    /// The name for titles.
    pub fn name(&self, path: &Path) -> String {
        match self {
            Self::Material(m) => m.0.name.clone(),
            Self::Mesh(..) => path.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        }
    }

    /// The weave, if it is one: it is made of strips.
    pub fn weave(&self) -> Option<&Weave> {
        match self {
            Self::Material(m) => match &m.0.geometry {
                Geometry::Weave(weave) => Some(weave),
                _ => None,
            },
            Self::Mesh(..) => None,
        }
    }

    /// Millimetres of one unit of the source.
    pub fn unit_mm(&self) -> f64 {
        match self {
            Self::Material(m) => UNITS.iter().find(|(unit, _)| *unit == m.0.unit).map_or(1.0, |(_, mm)| *mm),
            Self::Mesh(..) => 1.0,
        }
    }

    /// One period, printed, mm; of a mesh its size in x and y.
    pub fn period(&self, scale: f64) -> DVec2 {
        match self {
            Self::Material(m) => m.1.tile.period * self.unit_mm() * scale,
            Self::Mesh(soup, _) => {
                let low = soup.vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
                let high = soup.vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
                (high - low).truncate() * scale
            }
        }
    }

    /// Whole periods for an extent.
    ///
    /// # Errors
    /// More than one period of a mesh; periods of 0; more triangles than [`MAX_TRIANGLES`].
    pub fn periods(&self, extent: Option<Extent>, scale: f64) -> Result<[u32; 2]> {
        if matches!(self, Self::Mesh(..)) {
            return match extent {
                None => Ok([1, 1]),
                Some(_) => {
                    let bad =
                        BadInput::new("a mesh file has no period to repeat", "leave `size` and `periods` out, or write a material file");
                    Err(bad.at_field("size").into())
                }
            };
        }
        let period = self.period(scale);
        let periods = match extent {
            Some(Extent::Periods(n)) => n,
            Some(Extent::Size(size)) => (size / period).round().max(DVec2::ONE).min(DVec2::splat(1e9)).to_array().map(|x| x as u32),
            None => (DEFAULT_SIZE / period).round().max(DVec2::ONE).min(DVec2::splat(1e9)).to_array().map(|x| x as u32),
        };
        if periods.contains(&0) {
            return Err(BadInput::new("0 periods make no sheet", "write at least 1x1").at_field("periods").into());
        }
        if let Self::Material(m) = self {
            let triangles = m.1.tile.triangles.len() as f64 * f64::from(periods[0]) * f64::from(periods[1]);
            if triangles > MAX_TRIANGLES as f64 {
                let problem = format!("{} x {} periods have {triangles:.0} triangles, more than {MAX_TRIANGLES}", periods[0], periods[1]);
                let remedy = "make the sheet smaller with `size` or `periods`, or the design larger with `scale`";
                return Err(BadInput::new(problem, remedy).into());
            }
        }
        Ok(periods)
    }

    /// The surface in mm: `periods` of the tile side by side, or the mesh, times `scale`.
    pub fn triangles(&self, scale: f64, periods: [u32; 2]) -> Triangles {
        match self {
            Self::Mesh(soup, _) => {
                let mut soup = soup.clone();
                soup.vertices.iter_mut().for_each(|v| *v *= scale);
                soup
            }
            Self::Material(m) => repeat(&m.1, scale * self.unit_mm(), periods),
        }
    }

    /// The colours of the design, linear RGB, each once.
    pub fn colours(&self) -> Vec<[f64; 3]> {
        let Self::Material(m) = self else { return vec![[1.0; 3]] };
        let mut out: Vec<[f64; 3]> = Vec::new();
        for colour in colours(&m.1) {
            if out.len() < 16 && !out.contains(&colour) {
                out.push(colour);
            }
        }
        out
    }

    /// Whether some tint is an image.
    pub fn has_image(&self) -> bool {
        let Self::Material(m) = self else { return false };
        m.1.surfaces.iter().any(|s| matches!(s.tint, Tint::Image(_)))
    }

    /// The colour of a part of the design, linear RGB.
    pub fn colour_of_part(&self, part: u16) -> [f64; 3] {
        let Self::Material(m) = self else { return [1.0; 3] };
        let first = m.1.tile.part_of_triangle.iter().position(|&p| p == part);
        first.map_or([1.0; 3], |t| colours(&m.1)[t])
    }

    /// What the user should know about the source.
    pub fn notes(&self) -> Vec<String> {
        match self {
            Self::Material(m) => m.1.tile.notes.clone(),
            Self::Mesh(_, notes) => notes.clone(),
        }
    }
}

fn repeat(surface: &SmallScale, scale: f64, [nx, ny]: [u32; 2]) -> Triangles {
    let tile: &Tile = &surface.tile;
    let colours = colours(surface);
    let mut out = Triangles::default();
    for j in 0..ny {
        for i in 0..nx {
            let shift = (tile.period * DVec2::new(f64::from(i), f64::from(j))).extend(0.0);
            let first = u32::try_from(out.vertices.len()).expect("periods() keeps the number of vertices below 2^32");
            out.vertices.extend(tile.vertices.iter().map(|&v| (v + shift) * scale));
            out.triangles.extend(tile.triangles.iter().map(|t| t.map(|c| c + first)));
            out.colours.extend(&colours);
        }
    }
    out
}

/// Checks a scale.
///
/// # Errors
/// One that is no positive number.
pub fn check_scale(scale: f64) -> Result<f64> {
    if scale.is_finite() && scale > 0.0 {
        Ok(scale)
    } else {
        Err(Error::from(BadInput::new(format!("the scale is {scale}"), "write a number above 0, such as 2").at_field("scale")))
    }
}
