//! Reads a shoot file, every mistake with its line.

use super::spec::{
    CameraSpec, FlatMethod, GivenLens, LightSpec, PhotoSpec, ROLES, Registration, SampleSpec, Shape, Shoot, Stick, SurfaceKind,
};
use crate::board::Board;
use crate::dictionary::{self, Dictionary};
use crate::sheet::{Sheet, Target};
use biscale::error::Result;
use biscale::toml_reader::{Range, Source, TableReader, range};
use glam::{DVec2, DVec3};
use std::path::PathBuf;

/// Lengths, mm.
const LENGTH: Range = range(1e-3, 1e5);
/// Coordinates, mm.
const PLACE: Range = range(-1e5, 1e5);
/// Coordinates, px.
const PIXEL: Range = range(-1e5, 1e5);
/// Shutter times, s.
const SECONDS: Range = range(1e-7, 1e5);
/// Vectors as short as this have no direction.
const NO_LENGTH: f64 = 1e-9;
/// Name of the light where a file names none.
const ONLY_LIGHT: &str = "light";

impl Shoot {
    /// Whether a file is a shoot file: it has photographs.
    pub fn is_shoot(source: &Source) -> bool {
        source.parse().is_ok_and(|t| t.get_ref().contains_key("photo") && !t.get_ref().contains_key("geometry"))
    }

    /// Reads a shoot file; the photographs themselves are only looked for.
    ///
    /// # Errors
    /// Bad input with file, line, field and remedy.
    pub fn parse(source: &Source) -> Result<Self> {
        let table = source.parse()?;
        let top = TableReader::new(source, "", table.get_ref(), 0);
        let name = top.head()?;
        let camera = camera(top.table("camera")?)?;
        let board = top.table("board")?.map(board).transpose()?;
        let sample_table =
            top.table("sample")?.ok_or_else(|| top.missing("sample", "{ shape = \"plane\", width_mm = 100, height_mm = 100 }"))?;
        let sample = sample(sample_table, board.as_ref())?;
        let checker_normal = match top.table("checker")? {
            Some(checker) => {
                let normal = direction(&checker, "normal")?;
                checker.finish()?;
                normal
            }
            None => None,
        };
        let flat = matches!(sample.shape, Shape::Plane(_));
        let lights = top.tables("light")?.into_iter().map(light).collect::<Result<Vec<_>>>()?;
        let photos = top.tables("photo")?.into_iter().map(photo).collect::<Result<Vec<_>>>()?;
        if photos.is_empty() {
            return Err(top.missing("photo", "...` tables headed `[[photo]]"));
        }
        top.finish()?;
        let out = Self {
            file: source.path.clone(),
            name,
            camera,
            board,
            sample,
            checker_normal: checker_normal.or(flat.then_some(DVec3::Z)),
            lights,
            photos,
        };
        Ok(out)
    }
}

fn camera(table: Option<TableReader<'_>>) -> Result<CameraSpec> {
    let default = CameraSpec::default();
    let Some(t) = table else { return Ok(default) };
    let pixels = range(1.0, 1e6);
    let focal_px = match t.f64("focal_px", pixels) {
        Ok(one) => one.map(DVec2::splat),
        Err(e) => t.array::<2>("focal_px", pixels).map_err(|_| e)?.map(DVec2::from),
    };
    let (focal_mm, sensor) = (t.f64("focal_mm", range(0.1, 1e4))?, t.f64("sensor_width_mm", range(0.1, 1e3))?);
    let centre = t.array::<2>("centre_px", PIXEL)?.map(DVec2::from);
    let distortion = t.array::<5>("distortion", range(-100.0, 100.0))?.unwrap_or_default();
    let given = match (focal_px, focal_mm, sensor) {
        (Some(f), _, _) => Some(GivenLens { focal: f, focal_over_width: None, centre, distortion }),
        (None, Some(f), Some(s)) => Some(GivenLens { focal: DVec2::ONE, focal_over_width: Some(f / s), centre, distortion }),
        (None, Some(_), None) => return Err(t.missing("sensor_width_mm", "36.0")),
        (None, None, Some(_)) => return Err(t.missing("focal_mm", "50.0")),
        (None, None, None) if centre.is_some() || t.has("distortion") => return Err(t.missing("focal_px", "3000.0")),
        (None, None, None) => None,
    };
    let out = CameraSpec {
        given,
        black: t.f64("black_level", range(0.0, 0.5))?.unwrap_or(default.black),
        saturation: t.f64("saturation", range(0.01, 1e6))?,
        linear: t.bool("linear")?.unwrap_or(default.linear),
        full_well_e: t.f64("full_well_e", range(10.0, 1e7))?,
        read_noise_e: t.f64("read_noise_e", range(0.0, 1e4))?,
        flat: match t.choice("flat_field", &["radial", "divide"])? {
            Some(1) => FlatMethod::Divide,
            _ => FlatMethod::Radial,
        },
    };
    t.finish()?;
    Ok(out)
}

fn board(t: TableReader<'_>) -> Result<Board> {
    let kinds = ["charuco", "chessboard", "aruco-grid", "sheet"];
    let kind = t.choice("kind", &kinds)?.ok_or_else(|| t.missing("kind", "\"charuco\""))?;
    let count = |key| t.integer(key, 2, 100)?.ok_or_else(|| t.missing(key, "8"));
    let length = |key| t.f64(key, LENGTH)?.ok_or_else(|| t.missing(key, "20.0"));
    let out = match kind {
        0 => {
            let (columns, rows, square, marker) = (count("columns")?, count("rows")?, length("square_mm")?, length("marker_mm")?);
            if marker >= square {
                return Err(t.error_at("marker_mm", "the markers are not smaller than the squares", "measure both on the print"));
            }
            let first = t.choice("first_square", &["black", "white"])?.unwrap_or(0);
            let number = i32::try_from(t.integer("first_id", 0, 1000)?.unwrap_or(0)).unwrap_or(0);
            Board::charuco(columns, rows, square, marker, &of_board(&t)?, first == 0).numbered_from(number)
        }
        1 => Board::chessboard(count("columns")?, count("rows")?, length("square_mm")?),
        2 => {
            let first = t.integer("first_id", 0, 1000)?.unwrap_or(0);
            let first = i32::try_from(first).unwrap_or(0);
            Board::grid(count("columns")?, count("rows")?, length("marker_mm")?, length("gap_mm")?, &of_board(&t)?, first)
        }
        _ => {
            let file = t.path("file")?.ok_or_else(|| t.missing("file", "\"sheet.json\""))?;
            Board::of_sheet(&Sheet::read(&file)?)
        }
    };
    if let Some(dictionary) = &out.dictionary
        && let Some(last) = out.markers.iter().map(|m| m.0).max()
        && usize::try_from(last).is_ok_and(|id| id >= dictionary.count())
    {
        let (name, count) = (dictionary.name(), dictionary.count());
        let problem = format!("the board has marker {last}, but {name} has {count} markers, from 0");
        return Err(t.error(problem, "name the dictionary that the board was made of, and its columns and rows"));
    }
    t.finish()?;
    Ok(out)
}

/// The dictionary of a board: one of `OpenCV`'s by its name, or one's own.
fn of_board(t: &TableReader<'_>) -> Result<Dictionary> {
    let names = dictionary::names();
    match (t.choice("dictionary", &names)?, t.path("dictionary_file")?) {
        (Some(_), Some(_)) => Err(t.error_at(
            "dictionary_file",
            "`dictionary` and `dictionary_file` are both given",
            "keep the one that the board was made of",
        )),
        (None, Some(file)) => Dictionary::read(&file),
        (named, None) => Ok(Dictionary::Predefined(named.map_or(DICTIONARY, |k| names[k]))),
    }
}

/// The dictionary of a board that names none.
const DICTIONARY: &str = "DICT_5X5_100";

fn sample(t: TableReader<'_>, board: Option<&Board>) -> Result<SampleSpec> {
    let sheet = t.path("sheet")?.map(|file| Sheet::read(&file)).transpose()?;
    let offset = t.f64("offset_mm", range(0.0, 1e3))?.unwrap_or(0.0);
    let shape = shape(&t, sheet.as_ref(), offset)?;
    let on = registration(&t, sheet, board, shape)?;
    let kind = match t.choice("surface", &["weave", "relief", "other"])? {
        Some(1) => SurfaceKind::Relief,
        Some(2) => SurfaceKind::Other,
        _ => SurfaceKind::Weave,
    };
    t.finish()?;
    Ok(SampleSpec { shape, on, offset, kind })
}

/// The shape that is written, or that of the sheet.
fn shape(t: &TableReader<'_>, sheet: Option<&Sheet>, offset: f64) -> Result<Shape> {
    let shape = t.choice("shape", &["plane", "cylinder"])?;
    let length = |key| t.f64(key, LENGTH);
    let (width, height, radius) = (length("width_mm")?, length("height_mm")?, length("radius_mm")?);
    let arc_deg = t.array::<2>("arc_deg", range(-720.0, 720.0))?;
    let need = |value: Option<f64>, key| value.ok_or_else(|| t.missing(key, "100.0"));
    let shape = match (shape, sheet.map(|s| (s.target, s))) {
        (None, Some((Target::Plane { .. }, s))) => Shape::Plane(s.extent),
        (None, Some((Target::Cylinder { radius: bare, .. }, s))) => Shape::Cylinder {
            radius: radius.unwrap_or(bare + s.thickness + offset),
            height: height.unwrap_or(s.extent.y),
            arc_deg: arc_deg.unwrap_or([0.0, 360.0]),
        },
        (None, _) => return Err(t.missing("shape", "\"plane\"")),
        (Some(0), _) => Shape::Plane(DVec2::new(need(width, "width_mm")?, need(height, "height_mm")?)),
        (Some(_), _) => Shape::Cylinder {
            radius: need(radius, "radius_mm")?,
            height: need(height, "height_mm")?,
            arc_deg: arc_deg.unwrap_or([0.0, 360.0]),
        },
    };
    if let Shape::Cylinder { arc_deg: [a, b], .. } = shape
        && !(a < b && b - a <= 360.0)
    {
        return Err(t.error_at(
            "arc_deg",
            format!("the arc from {a} to {b} degrees is empty or more than a turn"),
            "write two angles, the smaller first",
        ));
    }
    Ok(shape)
}

/// What registers the sample: its sheet, its place on the board, or nothing.
fn registration(t: &TableReader<'_>, sheet: Option<Sheet>, board: Option<&Board>, shape: Shape) -> Result<Registration> {
    let round = matches!(shape, Shape::Cylinder { .. });
    match (sheet, t.array::<2>("board_mm", PLACE)?.map(DVec2::from), board) {
        (Some(_), Some(_), _) => Err(t.error_at("board_mm", "the sample has a sheet and a place on the board", "keep one of the two")),
        (Some(sheet), None, _) if round != matches!(sheet.target, Target::Cylinder { .. }) => {
            Err(t.error_at("shape", "the sheet was made for another shape", "leave `shape` out: the sheet says it"))
        }
        (Some(sheet), None, _) => Ok(Registration::Sheet(Box::new(sheet))),
        (None, Some(_), None) => Err(t.error_at("board_mm", "there is no [board]", "describe the board, or name a `sheet`")),
        (None, Some(_), Some(_)) if round => {
            let remedy = "use the `sheet` that a folding pattern for a cylinder comes with";
            Err(t.error_at("board_mm", "a cylinder cannot lie on the board", remedy))
        }
        (None, Some(centre), Some(_)) => Ok(Registration::Board(centre)),
        (None, None, _) => Ok(Registration::None),
    }
}

fn direction(t: &TableReader<'_>, key: &'static str) -> Result<Option<DVec3>> {
    let Some(v) = t.array::<3>(key, PLACE)?.map(DVec3::from) else { return Ok(None) };
    if v.length() < NO_LENGTH {
        return Err(t.error_at(key, "the direction has no length", "write a vector such as [0, 0, 1]"));
    }
    Ok(Some(v.normalize()))
}

fn light(t: TableReader<'_>) -> Result<LightSpec> {
    let position = t.array::<3>("position_mm", PLACE)?.map(DVec3::from);
    let towards = match (direction(&t, "direction")?, position) {
        (Some(_), Some(_)) => {
            return Err(t.error_at(
                "position_mm",
                "`direction` and `position_mm` are both given",
                "keep one: the place tells the direction",
            ));
        }
        (Some(direction), None) => direction,
        (None, Some(place)) if place.length() < NO_LENGTH => {
            return Err(t.error_at(
                "position_mm",
                "the lamp stands in the middle of the sample",
                "write where it stands, in the sample's frame",
            ));
        }
        (None, Some(place)) => place.normalize(),
        (None, None) => return Err(t.missing("direction", "[0.5, 0.0, 0.87]")),
    };
    let out = LightSpec {
        name: t.str("name")?.unwrap_or(ONLY_LIGHT).to_owned(),
        direction: towards,
        position,
        sigma_deg: t.f64("sigma_deg", range(1e-6, 90.0))?.unwrap_or(1.5),
    };
    t.finish()?;
    Ok(out)
}

fn photo(t: TableReader<'_>) -> Result<PhotoSpec> {
    let words: Vec<&str> = ROLES.iter().map(|r| r.0).collect();
    let role = ROLES[t.choice("role", &words)?.ok_or_else(|| t.missing("role", "\"distant\""))?].1;
    let files = files(&t)?;
    let seconds = match t.f64("seconds", SECONDS) {
        Ok(one) => one.into_iter().collect(),
        Err(e) => numbers(&t, "seconds", files.len())?.ok_or(e)?,
    };
    if !seconds.is_empty() && seconds.len() != files.len() {
        return Err(t.error_at(
            "seconds",
            format!("{} times for {} files", seconds.len(), files.len()),
            "write one time a file, in brackets",
        ));
    }
    let out = PhotoSpec {
        line: t.line(),
        role,
        files,
        seconds,
        iso: t.f64("iso", range(1.0, 1e7))?,
        f_number: t.f64("f_number", range(0.1, 1e3))?,
        light: t.str("light")?.unwrap_or(ONLY_LIGHT).to_owned(),
        lens: t.str("lens")?.map(str::to_owned),
        checker_px: t.array::<8>("checker_px", PIXEL)?.map(|c| std::array::from_fn(|k| DVec2::new(c[2 * k], c[2 * k + 1]))),
        ball_px: t.array::<3>("ball_px", PIXEL)?,
        highlight_px: t.array::<2>("highlight_px", PIXEL)?.map(DVec2::from),
        stick: stick(&t)?,
        mm_per_px: t.f64("mm_per_px", range(1e-6, 1e3))?,
        view: view(&t)?,
    };
    t.finish()?;
    Ok(out)
}

/// The file of a photograph, or the files of its brackets.
fn files(t: &TableReader<'_>) -> Result<Vec<PathBuf>> {
    let mut files: Vec<PathBuf> = t.path("file")?.into_iter().collect();
    if let Some(names) = t.strings("files")? {
        if !files.is_empty() {
            let remedy = "keep one: `files` are the brackets of one view, or views of the board";
            return Err(t.error_at("files", "`file` and `files` are both given", remedy));
        }
        for name in names {
            let path = t.source().folder().join(name);
            if !path.is_file() {
                return Err(t.error_at("files", format!("there is no file \"{name}\""), "write paths relative to the folder of this file"));
            }
            files.push(path);
        }
    }
    if files.is_empty() { Err(t.missing("file", "\"IMG_0001.tif\"")) } else { Ok(files) }
}

fn stick(t: &TableReader<'_>) -> Result<Option<Stick>> {
    let radius = t.f64("stick_radius_mm", range(0.0, 1e3))?.unwrap_or(0.0);
    match (t.array::<2>("stick_mm", PLACE)?, t.f64("stick_height_mm", LENGTH)?, t.array::<2>("shadow_px", PIXEL)?) {
        (Some(foot), Some(height), shadow) => Ok(Some(Stick { foot: foot.into(), height, radius, shadow_px: shadow.map(DVec2::from) })),
        (Some(_), None, _) => Err(t.missing("stick_height_mm", "30.0")),
        (None, Some(_), _) | (None, None, Some(_)) => Err(t.missing("stick_mm", "[0.0, 0.0]")),
        (None, None, None) => Ok(None),
    }
}

/// Where the camera stands, what it looks at, and what is up.
fn view(t: &TableReader<'_>) -> Result<Option<[DVec3; 3]>> {
    let eye = t.array::<3>("eye", PLACE)?.map(DVec3::from);
    let (target, up) = (t.array::<3>("target", PLACE)?.map_or(DVec3::ZERO, DVec3::from), direction(t, "up")?.unwrap_or(DVec3::Z));
    match eye {
        Some(eye) if (target - eye).cross(up).length() < NO_LENGTH => {
            Err(t.error_at("up", "the camera looks along `up`, or stands at its target", "choose another `up`"))
        }
        Some(eye) => Ok(Some([eye, target, up])),
        None if t.has("target") || t.has("up") => Err(t.missing("eye", "[0.0, 0.0, 500.0]")),
        None => Ok(None),
    }
}

/// `count` positive numbers in brackets; TOML arrays of any length are read for up to nine brackets.
fn numbers(t: &TableReader<'_>, key: &'static str, count: usize) -> Result<Option<Vec<f64>>> {
    let r = SECONDS;
    Ok(match count {
        1 => t.array::<1>(key, r)?.map(Vec::from),
        2 => t.array::<2>(key, r)?.map(Vec::from),
        3 => t.array::<3>(key, r)?.map(Vec::from),
        4 => t.array::<4>(key, r)?.map(Vec::from),
        5 => t.array::<5>(key, r)?.map(Vec::from),
        6 => t.array::<6>(key, r)?.map(Vec::from),
        7 => t.array::<7>(key, r)?.map(Vec::from),
        8 => t.array::<8>(key, r)?.map(Vec::from),
        9 => t.array::<9>(key, r)?.map(Vec::from),
        _ => return Err(t.error_at(key, format!("{count} brackets of one view"), "give at most 9")),
    })
}
