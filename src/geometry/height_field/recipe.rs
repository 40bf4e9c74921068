//! What a material file says of a height field, and the tile that is made of it.

use super::super::builder::TileBuilder;
use super::super::params::{Param, Unit, Value, choice, derived, whole};
use super::super::tile::Tile;
use super::super::values::GeometryValues;
use super::grid::Grid;
use super::tmd;
use crate::bounded_file::{MAX_DATA_BYTES, read_bounded};
use crate::error::{BadInput, Error, Result};
use crate::image_file;
use crate::toml_reader::range;
use glam::DVec2;
use std::path::PathBuf;

/// A grid of a larger [`Grid::coarseness`] is noted: about that of white noise blurred by one and a half pixels. Chosen, not measured.
const COARSE: f64 = 0.8;

/// Largest height over the longer side of the map: there numbers of double precision are 1e-7 of that side apart. Heights above the sea are far below.
const MAX_MAGNITUDE: f64 = 1e9;

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    Param {
        key: "file",
        value: Value::File { example: "heights.png", required: true },
        help: "Heights: .png, .tif, .exr, or .tmd (GelSight). PUT YOUR FILE'S NAME HERE",
    },
    derived("pixel", Unit::Length, ("from a .tmd, else required", 0.01), range(1e-9, 1e6), "Distance from node to node of the file")
        .shown(),
    derived("width", Unit::Length, ("pixel times the columns", 1.0), range(1e-6, 1e6), "Width of the whole file, in place of pixel"),
    derived("height", Unit::Length, ("1.0 for floats and .tmd, else required", 0.1), range(-1e9, 1e9), HEIGHT_HELP).shown(),
    Param { key: "detrend", value: Value::Flag { default: false }, help: "Remove the least-squares plane: scans are never level" },
    choice("edge", "none", &["none", "blend", "mirror"], EDGE_HELP),
    derived(
        "blend",
        Unit::One,
        ("0.1", 0.1),
        range(0.01, 0.5),
        "For edge = \"blend\": share of the width and of the height that is blended",
    ),
    whole("resolution", 512, 1, 2000, "Most nodes along the longer side of the file; more are averaged to it"),
];

const HEIGHT_HELP: &str = "Height of white over black (8 and 16 bit); for floats and .tmd a factor on the file's heights";
const EDGE_HELP: &str = "How the file becomes periodic: as it is; opposite edges blended; or mirrored, which doubles the period";

/// Parts of this kind, with what they are.
pub const PARTS: &[(&str, &str)] = &[("surface", "all of it")];

/// Heights from a file.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightField {
    /// PNG, TIFF, EXR or TMD file.
    pub file: PathBuf,
    /// Distance from node to node of the file, or width of the whole file; from the file if neither is given.
    pub scale: Scale,
    /// Height of white over black, or factor on the file's heights.
    pub height: Option<f64>,
    /// Whether the least-squares plane is removed.
    pub detrend: bool,
    /// How the heights become periodic.
    pub edge: Edge,
    /// Most nodes along the longer side of the file.
    pub resolution: u32,
    /// Millimetres in the material's unit, for files that know their size.
    pub unit_mm: f64,
}

/// Horizontal scale of a height field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// As the file says.
    File,
    /// Distance from node to node.
    Pixel(f64),
    /// Width of the whole file.
    Width(f64),
}

/// How heights become periodic.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Edge {
    /// As they are.
    None,
    /// Opposite edges are blended over this share of each side, which shortens the period by it.
    Blend(f64),
    /// Mirrored in x and in y, which doubles the period.
    Mirror,
}

impl HeightField {
    pub(in crate::geometry) fn read(values: &GeometryValues, unit_mm: f64) -> Result<Self> {
        let file = values.path("file")?.expect("file is required").to_path_buf();
        let scale = match (values.optional("pixel"), values.optional("width")) {
            (Some(_), Some(_)) => return Err(values.error_at("width", "pixel and width are given together", "keep one of them")),
            (Some(pixel), None) => Scale::Pixel(pixel),
            (None, Some(width)) => Scale::Width(width),
            (None, None) => Scale::File,
        };
        let edge = values.choice("edge");
        if values.has("blend") && edge != Some("blend") {
            return Err(values.error_at("blend", "this edge is not blended", "remove it, or write `edge = \"blend\"`"));
        }
        let edge = match edge {
            Some("blend") => Edge::Blend(values.optional("blend").unwrap_or(0.1)),
            Some("mirror") => Edge::Mirror,
            _ => Edge::None,
        };
        let resolution = values.whole("resolution").expect("resolution has a default");
        Ok(Self { file, scale, height: values.optional("height"), detrend: values.flag("detrend"), edge, resolution, unit_mm })
    }

    /// The file's heights in the material's unit, before anything is done to them.
    fn load(&self) -> Result<Grid> {
        let bad = |problem: &str, field: &str, remedy: &str| -> Error {
            BadInput::new(problem, remedy).in_file(&self.file).at_field(format!("geometry.{field}")).into()
        };
        let is_tmd = self.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("tmd"));
        let (columns, rows, mut heights, own_pixel) = if is_tmd {
            let bytes = read_bounded(&self.file, MAX_DATA_BYTES, "write fewer heights")?;
            let map = tmd::parse(&bytes).map_err(|e| e.in_file(&self.file))?;
            let pixel = DVec2::from(map.size) / DVec2::new(map.columns as f64, map.rows as f64) / self.unit_mm;
            let factor = self.height.unwrap_or(1.0) / self.unit_mm;
            (map.columns, map.rows, map.heights.iter().map(|h| h * factor).collect(), Some(pixel))
        } else {
            let raster = image_file::read_heights(&self.file)?;
            let [first, others @ ..] = &raster.channels[..] else { unreachable!("an image has a channel") };
            if others.iter().any(|c| c != first) {
                return Err(bad("the image is coloured: a colour is no height", "file", "write it as one grey channel"));
            }
            let height = match self.height {
                Some(height) => height,
                None if raster.integer => {
                    return Err(bad("8- and 16-bit images do not say how high they are", "height", "add `height = ` white over black"));
                }
                None => 1.0,
            };
            (raster.width, raster.height, first.iter().map(|&v| f64::from(v) * height).collect::<Vec<f64>>(), None)
        };
        let pixel = match self.scale {
            Scale::Pixel(pixel) => DVec2::splat(pixel),
            Scale::Width(width) => DVec2::splat(width / columns as f64),
            Scale::File => own_pixel.ok_or_else(|| bad("an image does not say how wide it is", "pixel", "add `pixel = ` or `width = `"))?,
        };
        // The file's first row is its upper edge, at the largest y.
        let mut rows_up = Vec::with_capacity(heights.len());
        heights.chunks(columns).rev().for_each(|row| rows_up.extend_from_slice(row));
        heights = rows_up;
        let period = pixel * DVec2::new(columns as f64, rows as f64);
        Ok(Grid { columns, rows, heights, period })
    }

    /// Refuses heights that are so large that their differences are rounding: see [`MAX_MAGNITUDE`].
    fn check_magnitude(&self, grid: &Grid) -> Result<()> {
        let most = MAX_MAGNITUDE * grid.period.max_element();
        let Some(place) = grid.heights.iter().position(|h| h.is_nan() || h.abs() > most) else { return Ok(()) };
        // Rows were turned round.
        let (column, row) = (place % grid.columns, grid.rows - 1 - place / grid.columns);
        let height = grid.heights[place];
        let problem =
            format!("the height in column {column}, row {row} is {height:e}, and the map is {} x {}", grid.period.x, grid.period.y);
        let remedy = "check that heights and widths are given in the same unit, and that this is no mark of a hole";
        Err(BadInput::new(problem, remedy).in_file(&self.file).at_field("geometry.height").into())
    }

    pub(in crate::geometry) fn build(&self) -> Result<Tile> {
        let mut notes = Vec::new();
        let mut grid = self.load()?;
        self.check_magnitude(&grid)?;
        if self.detrend {
            let slope = grid.remove_plane();
            notes.push(format!("removed a plane that rises by {:.3e} along x and {:.3e} along y", slope.x, slope.y));
        }
        let longest = grid.columns.max(grid.rows);
        if longest > self.resolution as usize {
            let (columns, rows) = (grid.columns, grid.rows);
            grid = grid.reduced(self.resolution as usize);
            notes.push(format!("{columns} x {rows} heights averaged to {} x {}", grid.columns, grid.rows));
        }
        let size = |g: &Grid| 2.0 * g.columns as f64 * g.rows as f64;
        let factor = if self.edge == Edge::Mirror { 4.0 } else { 1.0 };
        TileBuilder::check_size(size(&grid) * factor, "write a smaller `resolution`")?;
        notes.push(match self.edge {
            Edge::None => {
                let (jump, inside) = (grid.seam(), grid.roughness());
                format!("edges as they are: heights jump by up to {:.3e} (rms {:.3e}) there, by rms {inside:.3e} inside", jump.0, jump.1)
            }
            Edge::Blend(share) => {
                let (largest, rms) = grid.blend(share);
                format!("edges blended: the heights blended differ by up to {largest:.3e} (rms {rms:.3e})")
            }
            Edge::Mirror => {
                grid = grid.mirrored();
                "edges mirrored: no seam, and twice the period".to_owned()
            }
        });
        let period = grid.period;
        if !(period.min_element() >= 1e-6 && period.max_element() <= 1e6) {
            let problem = format!("the period is {} x {}", period.x, period.y);
            let bad = BadInput::new(problem, "choose a pixel size that gives 1e-6 to 1e6").in_file(&self.file).at_field("geometry.pixel");
            return Err(bad.into());
        }
        let coarseness = grid.coarseness();
        if coarseness > COARSE {
            notes.push(format!(
                "the image is coarse: from pixel to pixel slopes change by {:.0} % of their size (rms), and what lies between pixels decides how the \
                 surface looks; use a finer image, or blur this one by two pixels",
                100.0 * coarseness
            ));
        }
        let tile = grid.into_tile(notes);
        Ok(tile.clean().map_err(|bad| bad.in_file(&self.file))?)
    }
}
