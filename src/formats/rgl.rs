//! RGL `.bsdf`: BRDFs measured at EPFL, tables over an adaptive parameterisation (Dupuy and Jakob 2018).
//!
//! A "tensor file", little endian: the 12 bytes `tensor_file\0`, version bytes 1 and 0, `u32` number of fields; for each field
//! `u16` length of its name, the name, `u16` number of dimensions, `u8` type of its elements, `u64` offset of its data from the
//! start of the file, and as many `u64` sizes; the data in C order. Layout and meaning are those of the readers in Mitsuba 3 and
//! pbrt-v4 (plugins `measured`). Fields that are not listed in [`Rgl`] are checked for their place in the file and ignored.
//!
//! This reader loads every kind: isotropic and anisotropic, RGB and spectral. What a facet can use is decided in `brdf`.

use crate::bounded_file::read_bounded;
use crate::error::{BadInput, Error, Result};
use std::path::Path;

/// Largest file that is read: the largest published ones (anisotropic, spectral) have under 150 MB.
pub const MAX_FILE_BYTES: u64 = 1 << 30;
/// Largest magnitude of an entry, so that products of a few of them stay within `f32`.
pub const MAX_ENTRY: f32 = 1e9;

/// Most fields that a directory may announce; published files have eleven.
const MAX_FIELDS: u32 = 256;
const MAGIC: &[u8] = b"tensor_file\0";
/// Element types, with their size in bytes: u8, i8, u16, i16, u32, i32, u64, i64, f16, f32, f64 are 1 to 11.
const TYPE_BYTES: [u64; 12] = [0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8];
const U8: u8 = 1;
const F32: u8 = 10;

/// A tensor of numbers in C order (last axis fastest); the product of `shape` is the length of `values`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tensor {
    /// Size along each axis.
    pub shape: Vec<usize>,
    /// The numbers, finite.
    pub values: Vec<f32>,
}

/// What a file measures along its colour axis.
#[derive(Clone, Debug, PartialEq)]
pub enum Channels {
    /// Linear sRGB: three.
    Rgb,
    /// Spectral bands at these wavelengths, in nm.
    Spectral(Vec<f32>),
}

/// A file as it is stored. `P` azimuths and `T` elevations of the direction that *the renderer's camera* sees (our `wo`).
#[derive(Clone, Debug, PartialEq)]
pub struct Rgl {
    /// What was measured, in the words of the file.
    pub description: String,
    /// Azimuths, ascending, radians, `[P]`; one or two for an isotropic material.
    pub phi_i: Vec<f32>,
    /// Elevations from the normal, ascending, radians in `0..=π/2`, `[T]`.
    pub theta_i: Vec<f32>,
    /// Microfacet distribution over the unit square, from 0, `[rows, columns]`.
    pub ndf: Tensor,
    /// Projected area of the microfacets over the unit square, positive, `[rows, columns]`.
    pub sigma: Tensor,
    /// Density of visible normals, the warp of the tables, from 0, `[P, T, rows, columns]`.
    pub vndf: Tensor,
    /// Density for sampling, `[P, T, rows, columns]`.
    pub luminance: Tensor,
    /// The measurement, `[P, T, C, rows, columns]`; may dip below 0 where a colour lies outside the gamut.
    pub values: Tensor,
    /// What the `C` channels are.
    pub channels: Channels,
    /// Whether `values` are to be multiplied by `ndf / (4 sigma)`.
    pub jacobian: bool,
}

impl Rgl {
    /// Whether the material looks the same when turned about its normal: at most two azimuths, as other readers decide.
    pub fn isotropic(&self) -> bool {
        self.phi_i.len() <= 2
    }
}

/// Reads a file.
///
/// # Errors
/// [`crate::Error::BadInput`] as [`parse`] says and for a missing file; [`crate::Error::Io`].
///
/// ```
/// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/brdf/paper_white_rgb.bsdf");
/// let file = biscale::formats::rgl::read(path.as_ref())?;
/// assert!(file.description.contains("paper"), "{}", file.description);
/// # Ok::<(), biscale::Error>(())
/// ```
pub fn read(path: &Path) -> Result<Rgl> {
    let bytes = read_bounded(path, MAX_FILE_BYTES, "no RGL file is larger than 1 GiB: this is something else")?;
    parse(&bytes).map_err(|bad| Error::from(bad.in_file(path)))
}

/// Reads the bytes of a file.
///
/// # Errors
/// Anything but a tensor file whose fields lie inside it and have the types, shapes and ranges that [`Rgl`] states.
pub fn parse(bytes: &[u8]) -> Result<Rgl, BadInput> {
    let fields = Fields::parse(bytes)?;
    let theta_i = fields.axis("theta_i")?;
    let phi_i = fields.axis("phi_i")?;
    let quarter = std::f32::consts::FRAC_PI_2 + 1e-4;
    if theta_i[0] < 0.0 || theta_i[theta_i.len() - 1] > quarter {
        let problem = format!("the elevations run from {} to {}", theta_i[0], theta_i[theta_i.len() - 1]);
        return Err(BadInput::new(problem, "they lie within 0 and pi/2").at_field("theta_i"));
    }
    let (p, t) = (phi_i.len(), theta_i.len());
    let ndf = fields.tensor("ndf", &[None, None], 0.0)?;
    let sigma = fields.tensor("sigma", &[None, None], 1e-9)?;
    let vndf = fields.tensor("vndf", &[Some(p), Some(t), None, None], 0.0)?;
    let luminance = fields.tensor("luminance", &[Some(p), Some(t), None, None], 0.0)?;
    let (channels, values) = if fields.has("rgb") {
        (Channels::Rgb, fields.tensor("rgb", &[Some(p), Some(t), Some(3), None, None], -MAX_ENTRY)?)
    } else if fields.has("spectra") {
        let wavelengths = fields.axis("wavelengths")?;
        let shape = [Some(p), Some(t), Some(wavelengths.len()), None, None];
        (Channels::Spectral(wavelengths), fields.tensor("spectra", &shape, -MAX_ENTRY)?)
    } else {
        return Err(BadInput::new("the file has neither a field `rgb` nor `spectra`", "an RGL .bsdf file has one of them"));
    };
    let slice = vndf.shape[2] * vndf.shape[3];
    if let Some(empty) = vndf.values.chunks_exact(slice).position(|s| s.iter().all(|&v| v == 0.0)) {
        let problem = format!("the density for azimuth {} and elevation {} is 0 everywhere", empty / t, empty % t);
        return Err(BadInput::new(problem, "each slice of vndf has a positive sum").at_field("vndf"));
    }
    let jacobian = match fields.bytes("jacobian")? {
        [0] => false,
        [1] => true,
        other => {
            return Err(
                BadInput::new(format!("the field holds {:?}", &other[..other.len().min(4)]), "it is one byte, 0 or 1").at_field("jacobian")
            );
        }
    };
    let description = String::from_utf8_lossy(fields.bytes("description")?).into_owned();
    Ok(Rgl { description, phi_i, theta_i, ndf, sigma, vndf, luminance, values, channels, jacobian })
}

/// One entry of the file's directory.
struct Field<'a> {
    name: &'a str,
    dtype: u8,
    shape: Vec<u64>,
    /// From the start of the data to the end of the file; the whole data if the element type is known.
    data: &'a [u8],
}

/// The file's directory: every field's data lies inside the file.
struct Fields<'a>(Vec<Field<'a>>);

/// Reads numbers from the front of a slice.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], BadInput> {
        let (front, rest) = self
            .0
            .split_at_checked(count)
            .ok_or_else(|| BadInput::new("the file ends inside its directory of fields", "it is cut short: copy or download it again"))?;
        self.0 = rest;
        Ok(front)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], BadInput> {
        Ok(self.take(N)?.try_into().expect("as long as asked for"))
    }
}

impl<'a> Fields<'a> {
    fn parse(bytes: &'a [u8]) -> Result<Self, BadInput> {
        let Some(rest) = bytes.strip_prefix(MAGIC) else {
            return Err(BadInput::new("this is not an RGL tensor file", "such a file starts with the text `tensor_file`"));
        };
        let mut cursor = Cursor(rest);
        let version: [u8; 2] = cursor.array()?;
        if version != [1, 0] {
            return Err(BadInput::new(format!("the version is {}.{}", version[0], version[1]), "this program reads version 1.0"));
        }
        let count = u32::from_le_bytes(cursor.array()?);
        if count > MAX_FIELDS {
            return Err(BadInput::new(format!("its directory announces {count} fields"), format!("at most {MAX_FIELDS} are believed")));
        }
        let mut fields: Vec<Field<'a>> = Vec::new();
        for _ in 0..count {
            let length = u16::from_le_bytes(cursor.array()?);
            let name = std::str::from_utf8(cursor.take(usize::from(length))?)
                .map_err(|_| BadInput::new(format!("the name of field {} is not text", fields.len() + 1), "the file is damaged"))?;
            let at = |problem: String, remedy: &str| BadInput::new(problem, remedy).at_field(name);
            let dimensions = u16::from_le_bytes(cursor.array()?);
            let [dtype] = cursor.array()?;
            let offset = u64::from_le_bytes(cursor.array()?);
            let mut shape = Vec::new();
            for _ in 0..dimensions {
                shape.push(u64::from_le_bytes(cursor.array()?));
            }
            if fields.iter().any(|f| f.name == name) {
                return Err(at("the field is there twice".into(), "the file is damaged"));
            }
            let outside =
                || at(format!("its data, {shape:?} from byte {offset}, do not lie inside the file"), "the file is cut short or damaged");
            let start = usize::try_from(offset).ok().filter(|&s| s <= bytes.len()).ok_or_else(outside)?;
            let mut data = &bytes[start..];
            if let Some(&size) = TYPE_BYTES.get(usize::from(dtype)).filter(|&&s| s > 0) {
                let length = shape.iter().try_fold(size, |n, &s| n.checked_mul(s)).and_then(|n| usize::try_from(n).ok());
                data = length.and_then(|n| data.get(..n)).ok_or_else(outside)?;
            }
            fields.push(Field { name, dtype, shape, data });
        }
        Ok(Self(fields))
    }

    fn has(&self, name: &str) -> bool {
        self.0.iter().any(|f| f.name == name)
    }

    fn field(&self, name: &str, dtype: u8) -> Result<&Field<'a>, BadInput> {
        let field = self.0.iter().find(|f| f.name == name).ok_or_else(|| {
            let names = self.0.iter().map(|f| f.name).collect::<Vec<_>>().join(", ");
            BadInput::new(format!("the file has no field `{name}`"), format!("an RGL .bsdf file has one; here are: {names}"))
        })?;
        if field.dtype != dtype {
            let kind = if dtype == F32 { "32-bit floats (type 10)" } else { "bytes (type 1)" };
            return Err(BadInput::new(format!("its elements have type {}", field.dtype), format!("they are {kind}")).at_field(name));
        }
        Ok(field)
    }

    fn bytes(&self, name: &str) -> Result<&'a [u8], BadInput> {
        Ok(self.field(name, U8)?.data)
    }

    /// A tensor of floats of the given shape (`None`: two or more), each from `min` to [`MAX_ENTRY`].
    fn tensor(&self, name: &str, shape: &[Option<usize>], min: f32) -> Result<Tensor, BadInput> {
        let field = self.field(name, F32)?;
        let matches = |(&have, &want): (&u64, &Option<usize>)| want.map_or(have >= 2, |w| have == w as u64);
        if field.shape.len() != shape.len() || !field.shape.iter().zip(shape).all(matches) {
            let wanted: Vec<String> = shape.iter().map(|s| s.map_or("2 or more".into(), |s| s.to_string())).collect();
            let problem = format!("its shape is {:?}", field.shape);
            return Err(BadInput::new(problem, format!("it is [{}]", wanted.join(", "))).at_field(name));
        }
        let values = floats(field.data);
        if let Some(place) = values.iter().position(|v| !(*v >= min && *v <= MAX_ENTRY)) {
            let problem = format!("element {place} is {:?}", values[place]);
            return Err(BadInput::new(problem, format!("each is a number from {min:?} to {MAX_ENTRY:e}")).at_field(name));
        }
        let shape = field.shape.iter().map(|&s| usize::try_from(s).expect("its data are in memory")).collect();
        Ok(Tensor { shape, values })
    }

    /// At least one ascending number.
    fn axis(&self, name: &str) -> Result<Vec<f32>, BadInput> {
        let field = self.field(name, F32)?;
        let values = floats(field.data);
        let ascending = values.windows(2).all(|w| w[0] < w[1]) && values.iter().all(|v| v.abs() <= MAX_ENTRY);
        if field.shape.len() != 1 || values.is_empty() || !ascending {
            let problem = format!("it has shape {:?} and starts with {:?}", field.shape, &values[..values.len().min(4)]);
            return Err(BadInput::new(problem, "it is a list of one or more ascending numbers").at_field(name));
        }
        Ok(values)
    }
}

fn floats(data: &[u8]) -> Vec<f32> {
    data.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

#[cfg(test)]
mod tests {
    use super::super::test_files::RglFile;
    use super::*;
    use proptest::prelude::*;

    fn good() -> RglFile {
        RglFile::isotropic(&[0.0, 0.7, 1.5], 3, |t, y, x| (t + y + x) as f32, |t, c, y, x| (t * 1000 + c * 100 + y * 10 + x) as f32)
    }

    fn problem(file: &RglFile) -> String {
        parse(&file.finish()).expect_err("a wrong file was read").to_string()
    }

    #[test]
    fn a_file_is_read_with_its_axes_in_order() {
        let file = parse(&good().finish()).unwrap();
        assert_eq!(file.description, "made by hand");
        assert_eq!(file.theta_i, [0.0, 0.7, 1.5]);
        assert_eq!(file.values.shape, [1, 3, 3, 3, 3]);
        assert_eq!(file.values.values[((2 * 3 + 1) * 3 + 2) * 3], 2120.0);
        assert!(file.isotropic() && file.jacobian && file.channels == Channels::Rgb);
    }

    #[test]
    fn anisotropic_and_spectral_files_load() {
        let mut file = good();
        file.floats("phi_i", &[3], &[-1.0, 0.0, 1.0]);
        file.floats("vndf", &[3, 3, 2, 2], &[1.0; 36]);
        file.floats("luminance", &[3, 3, 2, 2], &[1.0; 36]);
        file.drop("rgb");
        file.floats("wavelengths", &[4], &[400.0, 500.0, 600.0, 700.0]);
        file.floats("spectra", &[3, 3, 4, 2, 2], &[-0.5; 144]);
        let file = parse(&file.finish()).unwrap();
        assert!(!file.isotropic());
        assert_eq!(file.channels, Channels::Spectral(vec![400.0, 500.0, 600.0, 700.0]));
    }

    #[test]
    fn fields_of_other_names_and_types_are_ignored() {
        let mut file = good();
        file.put("version", 5, &[2], vec![1, 0, 0, 0, 0, 0, 0, 0]);
        file.put("valid", 1, &[4], vec![0; 4]);
        file.put("something", 77, &[u64::MAX, u64::MAX], vec![1, 2, 3]);
        assert!(parse(&file.finish()).is_ok());
    }

    #[test]
    fn wrong_fields_are_refused_with_their_name() {
        let with = |change: &dyn Fn(&mut RglFile)| {
            let mut file = good();
            change(&mut file);
            problem(&file)
        };
        let nan = f32::NAN;
        for (message, words) in [
            (with(&|f| f.drop("vndf")), "no field `vndf`"),
            (with(&|f| f.drop("rgb")), "neither a field `rgb` nor `spectra`"),
            (with(&|f| f.put("sigma", 5, &[2, 2], vec![0; 16])), "sigma: its elements have type 5"),
            (with(&|f| f.put("rgb", 11, &[1, 3, 3, 1, 1], vec![0; 72])), "rgb: its elements have type 11"),
            (with(&|f| f.floats("rgb", &[1, 2, 3, 2, 2], &[0.0; 24])), "rgb: its shape is [1, 2, 3, 2, 2]; it is [1, 3, 3, 2 or more"),
            (with(&|f| f.floats("rgb", &[1, 3, 4, 2, 2], &[0.0; 48])), "rgb: its shape"),
            (with(&|f| f.floats("ndf", &[1, 4], &[0.0; 4])), "ndf: its shape is [1, 4]"),
            (with(&|f| f.floats("ndf", &[0, 4], &[])), "ndf: its shape is [0, 4]"),
            (with(&|f| f.floats("ndf", &[4], &[0.0; 4])), "ndf: its shape is [4]"),
            (with(&|f| f.floats("ndf", &[2, 2], &[1.0, nan, 1.0, 1.0])), "ndf: element 1 is NaN"),
            (with(&|f| f.floats("ndf", &[2, 2], &[1.0, 1.0, 1e30, 1.0])), "ndf: element 2 is 1e30; each is a number from 0.0 to 1e9"),
            (with(&|f| f.floats("sigma", &[2, 2], &[1.0, 1.0, 1.0, 0.0])), "sigma: element 3 is 0"),
            (with(&|f| f.floats("vndf", &[1, 3, 2, 2], &[-1.0; 12])), "vndf: element 0 is -1"),
            (
                with(&|f| f.floats("vndf", &[1, 3, 2, 2], &[1., 1., 1., 1., 0., 0., 0., 0., 1., 1., 1., 1.])),
                "vndf: the density for azimuth 0 and elevation 1",
            ),
            (with(&|f| f.floats("theta_i", &[3], &[0.0, 0.9, 0.7])), "theta_i: it has shape [3]"),
            (with(&|f| f.floats("theta_i", &[0], &[])), "theta_i: it has shape [0]"),
            (with(&|f| f.floats("theta_i", &[3], &[0.0, nan, 1.0])), "theta_i: it has shape"),
            (with(&|f| f.floats("theta_i", &[3], &[0.0, 0.7, 2.0])), "theta_i: the elevations run from 0 to 2"),
            (with(&|f| f.floats("phi_i", &[1, 1], &[0.0])), "phi_i: it has shape [1, 1]"),
            (with(&|f| f.bytes("jacobian", &[2])), "jacobian: the field holds [2]"),
            (with(&|f| f.bytes("jacobian", &[])), "jacobian: the field holds []"),
            (with(&|f| f.fields.push(("ndf".into(), 1, vec![0], vec![]))), "ndf: the field is there twice"),
            (with(&|f| f.put("extra", 10, &[u64::MAX, 2], vec![])), "extra: its data"),
            (with(&|f| f.put("extra", 10, &[1 << 40], vec![])), "extra: its data"),
            (with(&|f| f.fields = vec![("a".into(), 1, vec![0], vec![]); 300]), "announces 300 fields"),
        ] {
            assert!(message.contains(words), "wanted \"{words}\", got: {message}");
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_refused() {
        let bytes = good().finish();
        for length in 0..bytes.len() {
            assert!(parse(&bytes[..length]).is_err(), "{length} of {} bytes", bytes.len());
        }
    }

    #[test]
    fn other_files_are_refused_at_their_first_bytes() {
        assert!(parse(b"").unwrap_err().to_string().contains("not an RGL tensor file"));
        assert!(parse(b"\x89PNG\r\n").unwrap_err().to_string().contains("not an RGL tensor file"));
        assert!(parse(b"tensor_file\0\x02\x00\0\0\0\0").unwrap_err().to_string().contains("the version is 2.0"));
        assert!(parse(b"tensor_file\0\x01\x00\xff\xff\xff\xff").unwrap_err().to_string().contains("4294967295 fields"));
    }

    proptest! {
        #[test]
        fn any_bytes_after_the_magic_are_read_or_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400), fields in 0..20_u32) {
            let mut file = b"tensor_file\0\x01\x00".to_vec();
            file.extend(fields.to_le_bytes());
            file.extend(bytes);
            prop_assert!(parse(&file).is_err());
        }
    }
}
