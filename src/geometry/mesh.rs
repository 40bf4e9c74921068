//! `kind = "mesh"`: triangles from a file.

use super::Tile;
use crate::error::{BadInput, Result};
use crate::toml_reader::{Source, TableReader, range};
use glam::{DVec2, DVec3};
use std::path::PathBuf;

/// Triangles from a file, periodic in x and y.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// OBJ file.
    pub file: PathBuf,
    /// Period in the file's units.
    pub period: DVec2,
    /// Factor from the file's units to the material's.
    pub scale: f64,
}

impl Mesh {
    pub(super) fn read(table: &TableReader<'_>) -> Result<Self> {
        let file = table.path("file")?.ok_or_else(|| table.missing("file", "\"surface.obj\""))?;
        let period = table.array::<2>("period", range(1e-6, 1e6))?.ok_or_else(|| table.missing("period", "[1.0, 1.0]"))?;
        let scale = table.f64("scale", range(1e-9, 1e9))?.unwrap_or(1.0);
        Ok(Self { file, period: period.into(), scale })
    }

    pub(super) fn build(&self) -> Result<Tile> {
        let source = Source::read(&self.file)?;
        let mut tile = Tile {
            vertices: Vec::new(),
            triangles: Vec::new(),
            part_of_triangle: Vec::new(),
            parts: Vec::new(),
            uv: None,
            grid: None,
            period: self.period * self.scale,
            notes: Vec::new(),
        };
        let mut part = "default".to_owned();
        for (number, line) in (1..).zip(source.text.lines()) {
            let bad = |problem: String| BadInput::new(problem, "see the OBJ format").in_file(&source.path).at_line(number);
            let mut words = line.split_whitespace();
            match words.next() {
                Some("v") => {
                    let xyz: Vec<f64> = words.take(3).filter_map(|w| w.parse().ok()).collect();
                    let [x, y, z] = xyz[..] else { return Err(bad(format!("`{line}` is not a vertex")).into()) };
                    tile.vertices.push(DVec3::new(x, y, z) * self.scale);
                }
                Some("usemtl" | "g") => words.next().unwrap_or("default").clone_into(&mut part),
                Some("f") => {
                    let index = |w: &str| {
                        w.split('/')
                            .next()
                            .and_then(|i| i.parse::<u32>().ok())
                            .filter(|&i| i >= 1 && i as usize <= tile.vertices.len())
                            .map(|i| i - 1)
                    };
                    let corners: Option<Vec<u32>> = words.map(index).collect();
                    let corners = corners.filter(|c| c.len() >= 3).ok_or_else(|| bad(format!("`{line}` is not a face")))?;
                    let place = tile.parts.iter().position(|p| *p == part).unwrap_or_else(|| {
                        tile.parts.push(part.clone());
                        tile.parts.len() - 1
                    });
                    for k in 1..corners.len() - 1 {
                        tile.triangles.push([corners[0], corners[k], corners[k + 1]]);
                        tile.part_of_triangle.push(u16::try_from(place).map_err(|_| bad("more than 65,536 parts".into()))?);
                    }
                }
                _ => {}
            }
        }
        Ok(tile)
    }
}
