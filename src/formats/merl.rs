//! MERL `.binary`: a measured isotropic BRDF over half and difference angles.
//!
//! Three little-endian `i32` (90, 90, 180), then `f64[3][90][90][180]`: channel, θh, θd, φd. Nodes lie at
//! `theta_h = (i/90)² π/2`, `theta_d = j/90 π/2`, `phi_d = k/180 π`; a stored value times 1/1500, 1.15/1500 or 1.66/1500 (red,
//! green, blue) is the BRDF in 1/sr; negative values mark angles that were not measured (Matusik et al. 2003 and the reader
//! that is published with their data).

use crate::bounded_file::read_bounded;
use crate::error::{BadInput, Error, Result};
use std::path::Path;

/// Nodes along θh.
pub const THETA_H: usize = 90;
/// Nodes along θd.
pub const THETA_D: usize = 90;
/// Nodes along φd, which is periodic with π.
pub const PHI_D: usize = 180;
/// Bytes of a file: three `i32` and three tables of `f64`.
pub const FILE_BYTES: usize = 12 + 3 * THETA_H * THETA_D * PHI_D * 8;
/// Factors from stored values to 1/sr.
pub const SCALE: [f64; 3] = [1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0];
/// Largest value in 1/sr that is believed: a mirror blurred by 0.001 degrees reaches it, and `f32` holds its products.
pub const MAX_VALUE: f64 = 1e9;

/// A table of BRDF values.
#[derive(Clone, Debug, PartialEq)]
pub struct Merl {
    /// Linear RGB in 1/sr, [`THETA_H`] x [`THETA_D`] x [`PHI_D`], φd fastest; finite, and 0 where the file is negative.
    pub rgb: Vec<[f32; 3]>,
    /// Share of the entries that were negative.
    pub negative: f64,
}

/// Reads a file.
///
/// # Errors
/// [`crate::Error::BadInput`] as [`parse`] says and for a missing file; [`crate::Error::Io`].
///
/// ```
/// // A file of another kind is refused by what is wrong with it.
/// let path = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/brdf/paper_white_rgb.bsdf");
/// let error = biscale::formats::merl::read(path.as_ref()).unwrap_err();
/// assert!(error.to_string().contains("a MERL table has 34992012 bytes") || error.to_string().contains("90, 90, 180"), "{error}");
/// ```
pub fn read(path: &Path) -> Result<Merl> {
    let bytes = read_bounded(path, FILE_BYTES as u64, &format!("a MERL table has {FILE_BYTES} bytes"))?;
    parse(&bytes).map_err(|bad| Error::from(bad.in_file(path)))
}

/// Reads the bytes of a file.
///
/// # Errors
/// Other dimensions than 90 x 90 x 180, another length than [`FILE_BYTES`], an entry that is not finite or beyond [`MAX_VALUE`].
pub fn parse(bytes: &[u8]) -> Result<Merl, BadInput> {
    let dims: Vec<i32> = bytes.chunks_exact(4).take(3).map(|b| i32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
    let wanted = "a MERL .binary table starts with the three 32-bit numbers 90, 90, 180";
    if dims != [90, 90, 180] {
        let problem = match dims[..] {
            [a, b, c] => format!("the dimensions are {a} x {b} x {c}"),
            _ => format!("the file has only {} bytes", bytes.len()),
        };
        return Err(BadInput::new(problem, wanted).at_field("dimensions"));
    }
    if bytes.len() != FILE_BYTES {
        let kind = if bytes.len() < FILE_BYTES { "cut short" } else { "too long" };
        return Err(BadInput::new(
            format!("the file is {kind}: it has {} bytes", bytes.len()),
            format!("a MERL table has {FILE_BYTES} bytes; copy or download it again"),
        ));
    }
    let nodes = THETA_H * THETA_D * PHI_D;
    let mut rgb = vec![[0.0_f32; 3]; nodes];
    let mut negative = 0_usize;
    for (place, entry) in bytes[12..].chunks_exact(8).enumerate() {
        let (channel, node) = (place / nodes, place % nodes);
        let stored = f64::from_le_bytes(entry.try_into().expect("chunks of eight"));
        let value = stored * SCALE[channel];
        if value.is_nan() || value.abs() > MAX_VALUE {
            let (h, d, p) = (node / (THETA_D * PHI_D), node / PHI_D % THETA_D, node % PHI_D);
            return Err(BadInput::new(
                format!("the value is {stored}"),
                format!("a BRDF value is finite and at most {MAX_VALUE:e} per steradian"),
            )
            .at_field(format!("{} at theta_h {h}, theta_d {d}, phi_d {p}", ["red", "green", "blue"][channel])));
        }
        if value < 0.0 {
            negative += 1;
        } else {
            rgb[node][channel] = value as f32;
        }
    }
    Ok(Merl { rgb, negative: negative as f64 / (3 * nodes) as f64 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A table whose every entry is `value` before scaling.
    fn constant(value: f64) -> Vec<u8> {
        let mut bytes: Vec<u8> = [90_i32, 90, 180].iter().flat_map(|d| d.to_le_bytes()).collect();
        bytes.extend(std::iter::repeat_n(value.to_le_bytes(), 3 * THETA_H * THETA_D * PHI_D).flatten());
        bytes
    }

    fn problem(bytes: &[u8]) -> String {
        parse(bytes).expect_err("a wrong table was read").to_string()
    }

    #[test]
    fn channels_are_scaled_and_negative_entries_become_zero() {
        let mut bytes = constant(1500.0);
        let nodes = THETA_H * THETA_D * PHI_D;
        bytes[12 + 8 * (nodes + 7)..][..8].copy_from_slice(&(-1.0_f64).to_le_bytes());
        let table = parse(&bytes).unwrap();
        assert_eq!(table.rgb[6], [1.0, 1.15, 1.66]);
        assert_eq!(table.rgb[7], [1.0, 0.0, 1.66]);
        assert_eq!(table.negative, 1.0 / (3 * nodes) as f64);
    }

    #[test]
    fn wrong_tables_are_refused_with_the_reason() {
        let good = constant(1.0);
        assert!(problem(&[]).contains("only 0 bytes"));
        assert!(problem(&good[..11]).contains("only 11 bytes"));
        assert!(problem(&good[..good.len() - 1]).contains("cut short"));
        assert!(problem(&[&good[..], &[0]].concat()).contains("too long"));
        for dims in [[0, 0, 0], [90, 90, 360], [-90, -90, 180], [i32::MAX; 3]] {
            let mut bytes = good.clone();
            for (k, d) in dims.iter().enumerate() {
                bytes[4 * k..4 * k + 4].copy_from_slice(&i32::to_le_bytes(*d));
            }
            assert!(problem(&bytes).contains("the dimensions are"), "{dims:?}");
        }
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300] {
            let mut bytes = good.clone();
            let node = (3 * THETA_D + 4) * PHI_D + 5;
            bytes[12 + 8 * node..][..8].copy_from_slice(&value.to_le_bytes());
            assert!(problem(&bytes).contains("red at theta_h 3, theta_d 4, phi_d 5"), "{value}");
        }
    }

    #[test]
    fn a_missing_file_and_a_longer_one_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.binary");
        assert!(read(&path).expect_err("there is none").to_string().contains("x.binary: there is no such file"));
        std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
        assert!(read(&path).expect_err("a terabyte").to_string().contains("1099511627776 bytes"));
        #[cfg(unix)]
        assert!(read(Path::new("/dev/zero")).expect_err("an endless file").to_string().contains("the file has over 34992012 bytes"));
    }

    proptest! {
        #[test]
        fn any_short_bytes_are_refused_without_a_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300), header in any::<bool>()) {
            let head: Vec<u8> = [90_i32, 90, 180].iter().flat_map(|d| d.to_le_bytes()).collect();
            let bytes = if header { [head, bytes].concat() } else { bytes };
            prop_assert!(parse(&bytes).is_err());
        }
    }
}
