//! Our own file of a whole effective BRDF: an OpenEXR file that says what it is. `docs/table-format.md` describes it so
//! that a stranger could write a reader.

use super::effective_table::{EffectiveTable, TableOrigin, max_rings};
use super::grid::{HemisphereGrid, node_count};
use super::guide::{Guide, MAX_GUIDE_RINGS};
use crate::error::{BadInput, Error, Result};
use crate::numerics::cast::narrow;
use crate::numerics::hash::Fnv1a;
use exr::block::lines::LineRefMut;
use exr::image::write::samples::{SamplesWriter, WritableSamples};
use exr::math::RoundingMode;
use exr::meta::MetaData;
use exr::meta::attribute::{LevelMode, SampleType};
use exr::meta::header::Header;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Encoding, FlatSamples, Image, ImageAttributes, IntegerBounds, Layer, LayerAttributes, Layers,
    ReadChannels, ReadLayers, Text, Vec2, WritableImage, read,
};
use glam::DVec3;
use serde::{Deserialize, Serialize};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

/// What `format` says in every such file.
pub const FORMAT: &str = "biscale effective BRDF";
/// The version that this build writes, and the newest it reads.
pub const VERSION: u32 = 1;
/// Name of the attribute that holds the description. It stands on each layer: readers lose those of the whole image.
const ATTRIBUTE: &str = "biscale";

/// A layer of the file, with its channels in the order of the planes in memory.
struct LayerLayout {
    name: &'static str,
    channels: &'static [&'static str],
}

/// Layers in the order of the file; the last may be missing.
const LAYERS: [LayerLayout; 3] = [
    LayerLayout { name: "S", channels: &["R", "G", "B", "se.R", "se.G", "se.B"] },
    LayerLayout { name: "directions", channels: &["X", "Y", "Z", "av"] },
    LayerLayout { name: "guide", channels: &["R", "G", "B"] },
];

/// What every version says.
#[derive(Serialize, Deserialize)]
struct Preamble {
    format: String,
    version: u32,
}

/// The description, as it stands in the file (JSON, ASCII).
#[derive(Serialize, Deserialize)]
struct Description {
    #[serde(flatten)]
    preamble: Preamble,
    rings: usize,
    reciprocal: bool,
    /// Rings of the guide; 0 without one.
    guide_rings: usize,
    /// Of all numbers of the file, see [`checksum`].
    checksum: String,
    #[serde(flatten)]
    about: TableOrigin,
}

/// Width and height of each layer.
fn sizes(rings: usize, reciprocal: bool, guide_rings: usize) -> [(usize, usize); 3] {
    let nodes = node_count(rings);
    // The number of nodes is odd, so the triangle of pairs fills rows of `nodes` pixels without a rest.
    let rows = if reciprocal { nodes.div_ceil(2) } else { nodes };
    [(nodes, rows), (nodes, 1), (node_count(guide_rings), 1)]
}

/// Whether the file at `path` begins as an OpenEXR file does. One that cannot be read does not.
pub fn is_openexr(path: &Path) -> bool {
    let mut magic = [0; 4];
    std::fs::File::open(path).and_then(|mut f| f.read_exact(&mut magic)).is_ok() && magic == [0x76, 0x2f, 0x31, 0x01]
}

/// Whether the file at `path` holds an effective BRDF, by its header. One that cannot be read does not.
pub fn is_effective_brdf(path: &Path) -> bool {
    let headers = std::fs::File::open(path).map_err(exr::error::Error::from).and_then(|f| MetaData::read_from_unbuffered(f, false));
    headers.is_ok_and(|meta| describe(&meta.headers, path).is_ok())
}

impl EffectiveTable {
    /// Writes the file to `path`; a half-written one is removed.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn save(&self, path: &Path) -> Result<()> {
        let failed = |source| Error::Io { action: "write", path: path.to_path_buf(), source };
        let file = std::fs::File::create(path).map_err(failed)?;
        let mut file = std::io::BufWriter::new(file);
        self.write(&mut file).and_then(|()| file.flush()).map_err(|source| {
            // The first error is the one to tell.
            let _ = std::fs::remove_file(path);
            failed(source)
        })
    }

    /// Writes the bytes of the file. The same table gives the same bytes.
    ///
    /// # Errors
    /// What `out` says.
    pub fn write(&self, out: impl Write + Seek) -> std::io::Result<()> {
        let guide_planes = || self.guide.iter().flat_map(|g| &g.values);
        let description = Description {
            preamble: Preamble { format: FORMAT.to_owned(), version: VERSION },
            rings: self.grid.rings(),
            reciprocal: self.reciprocal,
            guide_rings: self.guide.as_ref().map_or(0, |g| g.rings),
            checksum: checksum(self.planes.iter().chain([&self.av]).chain(guide_planes())),
            about: self.about.clone(),
        };
        let text = ascii(&serde_json::to_string_pretty(&description).map_err(std::io::Error::other)?);
        let xyz: [Vec<f32>; 3] = std::array::from_fn(|c| self.grid.nodes().iter().map(|n| narrow(n[c])).collect());
        let sizes = sizes(self.grid.rings(), self.reciprocal, description.guide_rings);
        let planes: [Vec<&[f32]>; 3] = [
            self.planes.iter().map(Vec::as_slice).collect(),
            xyz.iter().chain([&self.av]).map(Vec::as_slice).collect(),
            guide_planes().map(Vec::as_slice).collect(),
        ];
        let layers = LAYERS.iter().zip(sizes).zip(planes).filter(|(_, planes)| !planes.is_empty()).map(|((layer, size), planes)| {
            let mut attributes = LayerAttributes::named(exr_text(layer.name));
            attributes.software_name = Some(exr_text(&ascii(&self.about.program)));
            attributes.other.insert(exr_text(ATTRIBUTE), AttributeValue::Text(exr_text(&text)));
            let channels = layer.channels.iter().zip(planes).map(|(name, plane)| AnyChannel::new(exr_text(name), Plane(plane)));
            let channels = AnyChannels::sort(channels.collect());
            Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels)
        });
        let layers: Layers<AnyChannels<Plane<'_>>> = layers.collect();
        let image = Image::from_layers(ImageAttributes::new(IntegerBounds::from_dimensions(sizes[0])), layers);
        image.write().to_buffered(out).map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            other => std::io::Error::other(other),
        })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::BadInput`] for a file that is damaged, of another kind, or of a newer version.
    pub fn load(path: &Path) -> Result<Self> {
        let file = std::fs::File::open(path).map_err(|e| Error::reading(path, e))?;
        Self::read(std::io::BufReader::new(file), path)
    }

    /// Reads the bytes of a file; `path` is for messages.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn read(mut input: impl Read + Seek, path: &Path) -> Result<Self> {
        let rewind = |input: &mut dyn Seek| input.seek(SeekFrom::Start(0)).map(drop).map_err(|e| Error::reading(path, e));
        let broken = |e: exr::error::Error| match e {
            exr::error::Error::Io(e) => Error::reading(path, e),
            other => damaged(path, &format!("it is no readable OpenEXR file: {other}")),
        };
        // The header is checked before any pixel is read: it says how much memory the pixels take.
        let headers = MetaData::read_from_unbuffered(&mut input, false).map_err(broken)?.headers;
        let description = describe(&headers, path)?;
        let guide_rings = description.guide_rings;
        check_layout(&headers, sizes(description.rings, description.reciprocal, guide_rings), guide_rings > 0, path)?;
        rewind(&mut input)?;
        let reader = read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        let image = reader.from_unbuffered(input).map_err(broken)?;
        let mut planes = image.layer_data.into_iter().map(|layer| {
            let name = layer.attributes.layer_name.as_ref().map(ToString::to_string);
            let wanted = LAYERS.iter().find(|l| Some(l.name) == name.as_deref()).expect("the layout was checked");
            let mut found: Vec<(Text, Vec<f32>)> = layer.channel_data.list.into_iter().map(|c| (c.name, samples(c.sample_data))).collect();
            let mut take = |name: &str| {
                let place = found.iter().position(|f| f.0.eq(name)).expect("the layout was checked");
                found.swap_remove(place).1
            };
            wanted.channels.iter().map(|&name| take(name)).collect::<Vec<_>>()
        });
        let mut next = || planes.next().unwrap_or_default();
        let (values, directions, guide) = (next(), next(), next());
        drop(planes);
        let [x, y, z, av]: [Vec<f32>; 4] = directions.try_into().expect("the layout was checked");
        let planes: [Vec<f32>; 6] = values.try_into().expect("the layout was checked");
        let guide: Option<Guide> = <[Vec<f32>; 3]>::try_from(guide).ok().map(|values| Guide { rings: guide_rings, values });
        if description.checksum != checksum(planes.iter().chain([&av]).chain(guide.iter().flat_map(|g| &g.values))) {
            return Err(damaged(path, "the numbers do not match their checksum"));
        }
        let grid = HemisphereGrid::new(description.rings);
        let near = |(i, node): (usize, &DVec3)| node.distance(DVec3::new(x[i].into(), y[i].into(), z[i].into())) < 1e-6;
        if !grid.nodes().iter().enumerate().all(near) {
            return Err(damaged(path, "its directions are not those of its number of rings"));
        }
        if planes.iter().chain([&av]).flatten().any(|v| !v.is_finite() || *v < 0.0) {
            return Err(damaged(path, "a value is negative or not finite"));
        }
        if guide.iter().flat_map(|g| &g.values).flatten().any(|v| !v.is_finite() || *v <= 0.0) {
            return Err(damaged(path, "a value of the guide is not positive"));
        }
        Ok(Self { grid, reciprocal: description.reciprocal, planes, av, guide, about: description.about })
    }
}

/// A plane of numbers that is written from where it lies: a table's copy would take as much memory as the table.
#[derive(Clone, Copy)]
struct Plane<'d>(&'d [f32]);

struct PlaneWriter<'d> {
    samples: &'d [f32],
    width: usize,
}

impl<'s, 'd: 's> WritableSamples<'s> for Plane<'d> {
    type Writer = PlaneWriter<'d>;

    fn sample_type(&self) -> SampleType {
        SampleType::F32
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_samples_writer(&'s self, header: &Header) -> Self::Writer {
        PlaneWriter { samples: self.0, width: header.layer_size.width() }
    }
}

impl SamplesWriter for PlaneWriter<'_> {
    fn extract_line(&self, line: LineRefMut<'_>) {
        let Vec2(x, y) = line.location.position;
        let start = y * self.width + x;
        let samples = &self.samples[start..start + line.location.sample_count];
        line.write_samples_from_slice(samples).expect("the buffer of a line has its length");
    }
}

fn exr_text(ascii: &str) -> Text {
    Text::new_or_panic(ascii)
}

/// JSON with everything outside ASCII as `\u` escapes: texts in OpenEXR files have no encoding. (Only strings can hold such.)
fn ascii(json: &str) -> String {
    let mut out = String::with_capacity(json.len());
    for c in json.chars() {
        if c.is_ascii() {
            out.push(c);
        } else {
            out.extend(c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")));
        }
    }
    out
}

/// FNV-1a, 64 bits, of the little-endian bytes of all numbers, plane after plane: values, `av`, guide. OpenEXR checks only
/// blocks that it could compress.
fn checksum<'p>(planes: impl Iterator<Item = &'p Vec<f32>>) -> String {
    let mut hash = Fnv1a::default();
    planes.flatten().for_each(|v| hash.add(&v.to_le_bytes()));
    format!("fnv1a64:{:016x}", hash.value())
}

fn damaged(path: &Path, problem: &str) -> Error {
    BadInput::new(problem, "bake it again, or copy it again from where it came").in_file(path).into()
}

/// The description in the header.
fn describe(headers: &[Header], path: &Path) -> Result<Description> {
    let foreign = |problem: &str| -> Error {
        BadInput::new(problem, "only files that `biscale bake` wrote hold an effective BRDF").in_file(path).into()
    };
    let attribute = headers.first().and_then(|h| h.own_attributes.other.get(&exr_text(ATTRIBUTE)));
    let Some(AttributeValue::Text(text)) = attribute else { return Err(foreign("this OpenEXR file is no effective BRDF")) };
    let text = text.to_string();
    let preamble: Preamble = serde_json::from_str(&text).map_err(|_| foreign("its description is not readable"))?;
    if preamble.format != FORMAT {
        return Err(foreign(&format!("this file holds \"{}\"", preamble.format)));
    }
    if preamble.version > VERSION || preamble.version == 0 {
        let remedy = format!("this program reads up to version {VERSION}: update it, or bake with this one");
        return Err(BadInput::new(format!("the file has version {}", preamble.version), remedy).in_file(path).at_field("version").into());
    }
    let description: Description = serde_json::from_str(&text).map_err(|e| damaged(path, &format!("its description is wrong: {e}")))?;
    let limit = max_rings(description.reciprocal);
    if !(2..=limit).contains(&description.rings) || description.guide_rings > MAX_GUIDE_RINGS {
        return Err(damaged(path, &format!("{} and {} rings are out of range", description.rings, description.guide_rings)));
    }
    Ok(description)
}

/// Layers, channels and sizes as the description wants them.
fn check_layout(headers: &[Header], sizes: [(usize, usize); 3], guide: bool, path: &Path) -> Result<()> {
    let count = if guide { 3 } else { 2 };
    let fits = |((header, layout), size): ((&Header, &LayerLayout), (usize, usize))| {
        let named = header.own_attributes.layer_name.as_ref().is_some_and(|n| n.eq(layout.name));
        let channels = &header.channels.list;
        let has = |name: &&str| channels.iter().any(|c| c.name.eq(name) && c.sample_type == SampleType::F32 && c.sampling == Vec2(1, 1));
        let all = channels.len() == layout.channels.len() && layout.channels.iter().all(has);
        named && all && header.layer_size == Vec2::from(size) && !header.deep
    };
    if headers.len() == count && headers.iter().zip(&LAYERS).zip(sizes).all(fits) {
        Ok(())
    } else {
        Err(damaged(path, "its layers are not those that its description names"))
    }
}

fn samples(samples: FlatSamples) -> Vec<f32> {
    match samples {
        FlatSamples::F32(samples) => samples,
        FlatSamples::F16(_) | FlatSamples::U32(_) => unreachable!("the layout was checked"),
    }
}

#[cfg(test)]
#[path = "file_tests.rs"]
mod tests;
