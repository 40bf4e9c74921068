//! A BTF as a file: a `.npz`, the archive of numpy, of arrays that any program reads (`docs/btf.md`).
//!
//! Radiance is 16-bit floats, whose rounding of .05 % (3e-8 1/sr for values below 6e-5) is far below what samples leave; it is written view by view and read the same way, so that a BTF need not fit
//! into memory.

use super::directions::MOST_DIRECTIONS;
use super::reference_plane::ReferencePlane;
use super::render::{BtfSummary, ImageMean, ViewImages};
use crate::bounded_file::MAX_TEXT_BYTES;
use crate::error::{BadInput, Error, Result};
use glam::{DVec2, DVec3};
use half::f16;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// What `about.json` says first.
const FORMAT: &str = "biscale BTF";
/// Version of the format; a reader refuses a larger one.
const VERSION: u32 = 1;
/// Most views, most lights, and most texels along either side.
const MOST: usize = MOST_DIRECTIONS;
/// Most bytes of `about.json`: a material file, which may have as many as a text, may stand in it, each character as six.
const MOST_ABOUT: u64 = 8 * MAX_TEXT_BYTES;

/// What a file says of itself.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BtfAbout {
    /// [`FORMAT`].
    pub format: String,
    /// [`VERSION`].
    pub version: u32,
    /// What wrote it.
    pub program: String,
    /// Name of the material.
    pub name: String,
    /// Text of the material file.
    pub material: String,
    /// Height of the reference plane, in the unit of the tile.
    pub plane_z: f64,
    /// The period, in that unit.
    pub period: [f64; 2],
    /// Texels across and along.
    pub texels: [usize; 2],
    /// What was asked for, and what came out.
    pub tolerance: f64,
    /// Standard errors of all texels, root mean square over that of the values.
    pub relative_rms: f64,
    /// Samples of the surface.
    pub samples: usize,
    /// Seed of them.
    pub seed: u32,
    /// What the user should know.
    pub notes: Vec<String>,
}

impl BtfAbout {
    /// Of images of a plane.
    pub fn new(plane: &ReferencePlane) -> Self {
        Self {
            format: FORMAT.to_owned(),
            version: VERSION,
            program: format!("biscale {}", env!("CARGO_PKG_VERSION")),
            plane_z: plane.z,
            period: plane.period.to_array(),
            texels: plane.texels,
            ..Self::default()
        }
    }

    /// With what a renderer did.
    #[must_use]
    pub fn rendered(self, summary: &BtfSummary, tolerance: f64, seed: u32) -> Self {
        Self { tolerance, seed, relative_rms: summary.relative_rms, samples: summary.samples, ..self }
    }
}

/// Writes a BTF of which all views are lit by the same lights, view after view.
pub struct BtfWriter<W: Write + Seek> {
    zip: ZipWriter<W>,
    views: Vec<DVec3>,
    lights: Vec<DVec3>,
    texels: [usize; 2],
    written: usize,
    means: Vec<f32>,
    errors: Vec<f32>,
    cover: Vec<f16>,
}

impl<W: Write + Seek> BtfWriter<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn new(out: W, texels: [usize; 2], views: &[DVec3], lights: &[DVec3]) -> io::Result<Self> {
        let mut zip = ZipWriter::new(out);
        let [columns, rows] = texels;
        begin_array(&mut zip, "radiance", "<f2", &[views.len(), lights.len(), rows, columns, 3])?;
        Ok(Self {
            zip,
            views: views.to_vec(),
            lights: lights.to_vec(),
            texels,
            written: 0,
            means: Vec::new(),
            errors: Vec::new(),
            cover: Vec::new(),
        })
    }

    /// Adds the images of the next view.
    ///
    /// # Errors
    /// Those of the output; images of another size.
    pub fn push(&mut self, images: &ViewImages) -> io::Result<()> {
        let count = self.texels[0] * self.texels[1];
        let lights = self.lights.len();
        let is_short = images.error.len() != images.value.len() || images.means.len() != lights;
        if is_short || images.value.len() != count * lights || images.cover.len() != count || self.written == self.views.len() {
            return Err(io::Error::other("a view has not as many texels and lights as the file"));
        }
        let mut bytes = Vec::with_capacity(2 * 3 * count);
        for (image, errors) in images.value.chunks_exact(count).zip(images.error.chunks_exact(count)) {
            bytes.clear();
            // What is over the largest number of 16 bits is that: a mirror towards the sun.
            bytes.extend(image.iter().flatten().flat_map(|&v| f16::from_f32(v.min(f16::MAX.to_f32())).to_le_bytes()));
            self.zip.write_all(&bytes)?;
            let squares: f64 = errors.iter().flatten().map(|&e| f64::from(e) * f64::from(e)).sum();
            self.errors.push((squares / (3 * count) as f64).sqrt() as f32);
        }
        let mean = |m: &ImageMean| m.mean.into_iter().chain(m.error).map(|v| v as f32).collect::<Vec<f32>>();
        self.means.extend(images.means.iter().flat_map(mean));
        self.cover.extend(images.cover.iter().flatten().map(|&c| f16::from_f32(c)));
        self.written += 1;
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// Those of the output; views that are missing.
    pub fn finish(mut self, about: &BtfAbout) -> io::Result<()> {
        if self.written != self.views.len() {
            return Err(io::Error::other("a view is missing"));
        }
        let (views, lights, [columns, rows]) = (self.views.len(), self.lights.len(), self.texels);
        begin_array(&mut self.zip, "mean", "<f4", &[views, lights, 2, 3])?;
        write_all(&mut self.zip, self.means.iter().map(|v| v.to_le_bytes()))?;
        begin_array(&mut self.zip, "error", "<f4", &[views, lights])?;
        write_all(&mut self.zip, self.errors.iter().map(|v| v.to_le_bytes()))?;
        begin_array(&mut self.zip, "cover", "<f2", &[views, rows, columns, 2])?;
        write_all(&mut self.zip, self.cover.iter().map(|v| v.to_le_bytes()))?;
        for (name, directions) in [("views", &self.views), ("lights", &self.lights)] {
            begin_array(&mut self.zip, name, "<f8", &[directions.len(), 3])?;
            write_all(&mut self.zip, directions.iter().flat_map(|d| d.to_array()).map(f64::to_le_bytes))?;
        }
        self.zip.start_file("about.json", stored())?;
        self.zip.write_all(&serde_json::to_vec(about)?)?;
        self.zip.finish()?.flush()
    }
}

/// Entries are not compressed, so that each number has its place; `large_file`, since radiance may be more than 4 GiB.
fn stored() -> SimpleFileOptions {
    SimpleFileOptions::default().compression_method(CompressionMethod::Stored).large_file(true)
}

/// Begins an array of numpy (format 1.0 of `.npy`), in rows.
fn begin_array<W: Write + Seek>(zip: &mut ZipWriter<W>, name: &str, kind: &str, shape: &[usize]) -> io::Result<()> {
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header = format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
    // The whole head is a multiple of 64 bytes and ends in a line feed.
    let padding = 63 - (10 + header.len()) % 64;
    header.extend(std::iter::repeat_n(' ', padding));
    header.push('\n');
    zip.start_file(format!("{name}.npy"), stored())?;
    zip.write_all(b"\x93NUMPY\x01\x00")?;
    zip.write_all(&u16::try_from(header.len()).map_err(io::Error::other)?.to_le_bytes())?;
    zip.write_all(header.as_bytes())
}

fn write_all<const N: usize>(out: &mut impl Write, numbers: impl Iterator<Item = [u8; N]>) -> io::Result<()> {
    out.write_all(&numbers.flatten().collect::<Vec<u8>>())
}

/// A BTF in a file; radiance is read as it is asked for.
#[derive(Debug)]
pub struct BtfFile {
    /// What it says of itself.
    pub about: BtfAbout,
    /// To the viewers.
    pub views: Vec<DVec3>,
    /// To the lights, the same for all views.
    pub lights: Vec<DVec3>,
    /// Means of the images, view after view.
    pub means: Vec<ImageMean>,
    /// Standard errors of the texels of each image, root mean square.
    pub errors: Vec<f64>,
    /// By view and texel the share that shows front faces, and that shows anything.
    pub cover: Vec<[f32; 2]>,
    file: File,
    radiance: u64,
    bytes: u64,
}

impl BtfFile {
    /// Opens a file.
    ///
    /// # Errors
    /// Bad input that names the file and what is wrong with it.
    pub fn open(path: &Path) -> Result<Self> {
        Self::read(path).map_err(|error| match error {
            Error::BadInput(bad) => bad.in_file(path).into(),
            error => error,
        })
    }

    fn read(path: &Path) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::reading(path, e))?;
        let length = file.metadata().map_err(|e| Error::reading(path, e))?.len();
        let not_one = |what: &str| Error::from(BadInput::new(format!("this is no BTF of `biscale btf make`: {what}"), "name one"));
        let mut zip = ZipArchive::new(file).map_err(|e| not_one(&e.to_string()))?;
        let mut text = String::new();
        let entry = zip.by_name("about.json").map_err(|_| not_one("it has no about.json"))?;
        entry.take(MOST_ABOUT).read_to_string(&mut text).map_err(|e| not_one(&e.to_string()))?;
        let about: BtfAbout = serde_json::from_str(&text).map_err(|e| not_one(&format!("about.json: {e}")))?;
        if about.format != FORMAT {
            return Err(not_one(&format!("its format is \"{}\"", about.format)));
        }
        if about.version > VERSION {
            let what = format!("version {} of the format is newer than this program", about.version);
            return Err(BadInput::new(what, "use a newer biscale").into());
        }
        let [columns, rows] = about.texels;
        if columns == 0 || rows == 0 {
            return Err(not_one("it has no texels"));
        }
        let directions = |zip: &mut ZipArchive<File>, name: &str| -> Result<Vec<DVec3>> {
            let found = array(zip, name, "<f8", &[None, Some(3)])?;
            let count = found.shape[0];
            let numbers: Vec<f64> = found.bytes(zip)?.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight"))).collect();
            let directions: Vec<DVec3> = numbers.chunks_exact(3).map(DVec3::from_slice).collect();
            if count == 0 || directions.iter().any(|d| !((d.length() - 1.0).abs() < 1e-6 && d.z > 0.0)) {
                return Err(BadInput::new(format!("{name}.npy: not all are unit vectors above the surface"), "write the file anew").into());
            }
            Ok(directions)
        };
        let (views, lights) = (directions(&mut zip, "views")?, directions(&mut zip, "lights")?);
        let (v, l) = (Some(views.len()), Some(lights.len()));
        let floats = |zip: &mut ZipArchive<File>, name: &str, shape: &[Option<usize>]| -> Result<Vec<f64>> {
            let bytes = array(zip, name, "<f4", shape)?.bytes(zip)?;
            Ok(bytes.chunks_exact(4).map(|b| f64::from(f32::from_le_bytes(b.try_into().expect("four")))).collect())
        };
        let mean = |m: &[f64]| ImageMean { mean: [m[0], m[1], m[2]], error: [m[3], m[4], m[5]] };
        let means = floats(&mut zip, "mean", &[v, l, Some(2), Some(3)])?.chunks_exact(6).map(mean).collect();
        let errors = floats(&mut zip, "error", &[v, l])?;
        let cover = array(&mut zip, "cover", "<f2", &[v, Some(rows), Some(columns), Some(2)])?.bytes(&mut zip)?;
        let cover = halves(&cover).collect::<Vec<f32>>().chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        let radiance = array(&mut zip, "radiance", "<f2", &[v, l, Some(rows), Some(columns), Some(3)])?;
        // Sizes are those that the archive says: a file may lie.
        if radiance.start.checked_add(radiance.size).is_none_or(|end| end > length) {
            return Err(not_one("radiance.npy ends too soon"));
        }
        let (place, bytes) = (radiance.start, 2 * 3 * (lights.len() * rows * columns) as u64);
        Ok(Self { about, views, lights, means, errors, cover, file: zip.into_inner(), radiance: place, bytes })
    }

    /// The plane of its texels.
    pub fn plane(&self) -> ReferencePlane {
        let BtfAbout { plane_z, period, texels, .. } = self.about;
        ReferencePlane { z: plane_z, period: DVec2::from_array(period), texels }
    }

    /// `B` of a view: light after light, texel after texel.
    ///
    /// # Errors
    /// Bad input beyond the last view; those of the file.
    pub fn view(&mut self, view: usize) -> Result<Vec<[f32; 3]>> {
        if view >= self.views.len() {
            let what = format!("there is no view {view}: the BTF has {}, numbered from 0", self.views.len());
            return Err(BadInput::new(what, "name one of them").at_field("view").into());
        }
        let mut bytes = vec![0; usize::try_from(self.bytes).map_err(|e| Error::Numeric(e.to_string()))?];
        let read = self.file.seek(SeekFrom::Start(self.radiance + view as u64 * self.bytes)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|e| Error::from(BadInput::new(format!("view {view} cannot be read: {e}"), "write the file anew")))?;
        Ok(halves(&bytes).collect::<Vec<f32>>().chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect())
    }
}

fn halves(bytes: &[u8]) -> impl Iterator<Item = f32> {
    bytes.chunks_exact(2).map(|b| f16::from_le_bytes([b[0], b[1]]).to_f32())
}

/// An array of the archive.
struct Array {
    name: String,
    shape: Vec<usize>,
    /// Where its numbers begin in the file, and how many bytes they are.
    start: u64,
    size: u64,
}

/// The head of an array, which must have this kind and shape.
fn array(zip: &mut ZipArchive<File>, name: &str, kind: &str, shape: &[Option<usize>]) -> Result<Array> {
    let bad = |what: String| Error::from(BadInput::new(format!("{name}.npy: {what}"), "write the file anew with `biscale btf make`"));
    let mut entry = zip.by_name(&format!("{name}.npy")).map_err(|e| bad(e.to_string()))?;
    if entry.compression() != CompressionMethod::Stored {
        return Err(bad("it is compressed".to_owned()));
    }
    let mut head = [0; 10];
    entry.read_exact(&mut head).map_err(|e| bad(e.to_string()))?;
    if &head[..8] != b"\x93NUMPY\x01\x00" {
        return Err(bad("this is no array of numpy's format 1.0".to_owned()));
    }
    let length = u16::from_le_bytes([head[8], head[9]]);
    let mut text = vec![0; usize::from(length)];
    entry.read_exact(&mut text).map_err(|e| bad(e.to_string()))?;
    let text = String::from_utf8_lossy(&text);
    let listed = text.split_once('(').and_then(|(_, rest)| rest.split_once(')')).map_or("", |(inside, _)| inside);
    let found: Vec<usize> = listed.split(',').filter_map(|n| n.trim().parse().ok()).collect();
    let fits = found.len() == shape.len() && found.iter().zip(shape).all(|(n, wanted)| *n <= MOST && wanted.is_none_or(|w| w == *n));
    if !fits || !text.contains(kind) || text.contains("True") {
        return Err(bad(format!("its head is {}", text.trim())));
    }
    let width: usize = kind[2..].parse().map_err(|_| bad("unknown numbers".to_owned()))?;
    let size =
        found.iter().try_fold(width as u64, |size, &n| size.checked_mul(n as u64)).ok_or_else(|| bad("it is too large".to_owned()))?;
    let before = 10 + u64::from(length);
    if entry.size() != before + size {
        return Err(bad(format!("it has {} bytes and should have {}", entry.size(), before + size)));
    }
    let start = entry.data_start().ok_or_else(|| bad("it has no place in the file".to_owned()))? + before;
    Ok(Array { name: name.to_owned(), shape: found, start, size })
}

impl Array {
    fn bytes(&self, zip: &mut ZipArchive<File>) -> Result<Vec<u8>> {
        let bad = |what: String| Error::from(BadInput::new(format!("{}.npy: {what}", self.name), "write the file anew"));
        let mut entry = zip.by_name(&format!("{}.npy", self.name)).map_err(|e| bad(e.to_string()))?;
        let mut bytes = Vec::new();
        // Not as many as the head says at once: a file may lie.
        entry.read_to_end(&mut bytes).map_err(|e| bad(e.to_string()))?;
        let size = usize::try_from(self.size).map_err(|e| bad(e.to_string()))?;
        let from = bytes.len().checked_sub(size).ok_or_else(|| bad("it ends too soon".to_owned()))?;
        Ok(bytes.split_off(from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn images(lights: usize, texels: usize, scale: f32) -> ViewImages {
        ViewImages {
            value: (0..lights * texels).map(|k| [scale * k as f32, 0.5, 1e9]).collect(),
            error: vec![[0.25, 0.0, 0.0]; lights * texels],
            cover: vec![[0.5, 1.0]; texels],
            means: vec![ImageMean { mean: [1.0, 2.0, 3.0], error: [0.1, 0.2, 0.3] }; lights],
            ..ViewImages::default()
        }
    }

    #[test]
    fn a_file_gives_back_what_was_written() {
        let plane = ReferencePlane { z: 0.25, period: DVec2::new(1.0, 2.0), texels: [3, 2] };
        let (views, lights) = ([DVec3::Z, DVec3::new(0.6, 0.0, 0.8)], [DVec3::Z, DVec3::new(0.0, 0.6, 0.8), DVec3::new(0.0, -0.6, 0.8)]);
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.btf.npz");
        let mut writer = BtfWriter::new(File::create(&path).unwrap(), plane.texels, &views, &lights).unwrap();
        assert!(writer.push(&images(3, 5, 1.0)).is_err());
        writer.push(&images(3, 6, 1.0)).unwrap();
        writer.push(&images(3, 6, 2.0)).unwrap();
        assert!(writer.push(&images(3, 6, 2.0)).is_err());
        let about = BtfAbout { name: "silk".into(), seed: 7, ..BtfAbout::new(&plane) };
        writer.finish(&about).unwrap();
        let mut file = BtfFile::open(&path).unwrap();
        assert!(file.about == about && file.plane() == plane && file.views == views && file.lights == lights);
        assert!(file.means.len() == 6 && (file.means[5].error[2] - 0.3).abs() < 1e-6 && file.cover == vec![[0.5, 1.0]; 12]);
        assert!((file.errors[5] - 0.25 / 3_f64.sqrt()).abs() < 1e-6);
        let read = file.view(1).unwrap();
        assert_eq!((read.len(), read[17]), (18, [34.0, 0.5, 65504.0]));
        assert!(file.view(2).unwrap_err().to_string().contains("numbered from 0"));
    }

    #[test]
    fn what_is_no_btf_or_cut_off_is_told_and_nothing_panics() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.btf.npz");
        let mut writer = BtfWriter::new(File::create(&path).unwrap(), [2, 2], &[DVec3::Z], &[DVec3::Z]).unwrap();
        writer.push(&images(1, 4, 1.0)).unwrap();
        writer
            .finish(&BtfAbout { texels: [2, 2], ..BtfAbout::new(&ReferencePlane { z: 0.0, period: DVec2::ONE, texels: [2, 2] }) })
            .unwrap();
        let whole = std::fs::read(&path).unwrap();
        assert!(BtfFile::open(&path).is_ok());
        assert!(BtfFile::open(&folder.path().join("none.npz")).is_err());
        let broken = folder.path().join("b.btf.npz");
        // Every byte otherwise, one at a time: an error, or a BTF with another number in it.
        for k in 0..whole.len() {
            let mut other = whole.clone();
            other[k] ^= 0x55;
            std::fs::write(&broken, &other).unwrap();
            if let Ok(mut file) = BtfFile::open(&broken) {
                let _ = file.view(0);
            }
        }
        for length in (0..whole.len()).step_by(7) {
            std::fs::write(&broken, &whole[..length]).unwrap();
            assert!(BtfFile::open(&broken).is_err(), "{length} of {}", whole.len());
        }
        std::fs::write(&broken, b"PK\x03\x04").unwrap();
        assert!(BtfFile::open(&broken).unwrap_err().to_string().contains("no BTF"));
    }
}
