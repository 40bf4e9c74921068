//! TIFF of whole numbers whose bits are no byte, two or four: 12 of cameras and scanners, 10, 14, 24 and the like.
//!
//! The decoder knows bytes. A file of such samples is handed to it as one of bytes, as many a row as the samples fill, and these are taken apart here. TIFF 6.0,
//! section 4 and page 29: samples follow each other from the highest bit on, and each row (of a strip or a tile) begins with a byte; samples of whole
//! bytes are in the order of the file's numbers.

use crate::numerics::cast::narrow;

/// Tags of TIFF 6.0 that say how samples lie.
mod tag {
    pub const WIDTH: u16 = 256;
    pub const BITS: u16 = 258;
    pub const COMPRESSION: u16 = 259;
    pub const INTERPRETATION: u16 = 262;
    pub const FILL_ORDER: u16 = 266;
    pub const SAMPLES: u16 = 277;
    pub const PLANAR: u16 = 284;
    pub const PREDICTOR: u16 = 317;
    pub const TILE_WIDTH: u16 = 322;
    pub const EXTRA: u16 = 338;
    pub const FORMAT: u16 = 339;
}

/// Compressions that give bytes back: none, LZW, deflate in both numbers, `PackBits`, Zstandard.
const OF_BYTES: [u32; 6] = [1, 5, 8, 32946, 32773, 50000];

/// A TIFF as one of bytes.
pub(super) struct PackedTiff {
    /// The file with a header of bytes.
    pub bytes: Vec<u8>,
    /// Pixels across.
    pub width: usize,
    /// Samples of a pixel, 1 or 3.
    pub samples: usize,
    bits: u32,
    signed: bool,
    little: bool,
}

/// A directory of a TIFF: 12 bytes an entry.
struct Directory<'a> {
    bytes: &'a [u8],
    little: bool,
    first: usize,
    entries: usize,
}

impl Directory<'_> {
    fn number<const N: usize>(&self, at: usize) -> Option<u32> {
        let mut number = [0; 4];
        let raw = self.bytes.get(at..at.checked_add(N)?)?;
        for (k, byte) in raw.iter().enumerate() {
            number[if self.little { k } else { N - 1 - k }] = *byte;
        }
        Some(u32::from_le_bytes(number))
    }

    fn entry(&self, tag: u16) -> Option<usize> {
        (0..self.entries).map(|k| self.first + 12 * k).find(|&at| self.number::<2>(at) == Some(tag.into()))
    }

    /// The number of a tag, if all of its numbers are that one.
    fn value(&self, tag: u16) -> Option<u32> {
        let at = self.entry(tag)?;
        let count = self.number::<4>(at + 4)? as usize;
        let long = match self.number::<2>(at + 2)? {
            3 => false,
            4 => true,
            _ => return None,
        };
        let size = if long { 4 } else { 2 };
        let from = if count * size <= 4 { at + 8 } else { self.number::<4>(at + 8)? as usize };
        let all: Option<Vec<u32>> =
            (0..count.min(8)).map(|k| if long { self.number::<4>(from + 4 * k) } else { self.number::<2>(from + 2 * k) }).collect();
        let all = all?;
        all.first().copied().filter(|first| all.iter().all(|value| value == first))
    }
}

/// The file as one of bytes, if its samples are whole numbers of other sizes and lie so that they can be taken apart.
pub(super) fn packed(bytes: &[u8]) -> Option<PackedTiff> {
    let little = bytes.starts_with(b"II*\0");
    if !little && !bytes.starts_with(b"MM\0*") {
        return None;
    }
    let mut directory = Directory { bytes, little, first: 0, entries: 0 };
    let start = directory.number::<4>(4)? as usize;
    directory.entries = directory.number::<2>(start)? as usize;
    directory.first = start.checked_add(2)?;
    let or = |tag: u16, default: u32| if directory.entry(tag).is_some() { directory.value(tag) } else { Some(default) };
    let (bits, samples) = (or(tag::BITS, 1)?, or(tag::SAMPLES, 1)?);
    let ordinary = matches!(bits, 1 | 2 | 4 | 8 | 16 | 32 | 64) || !(3..=31).contains(&bits);
    let signed = match or(tag::FORMAT, 1)? {
        1 => false,
        2 => true,
        _ => return None,
    };
    let plain = OF_BYTES.contains(&or(tag::COMPRESSION, 1)?)
        && or(tag::FILL_ORDER, 1)? == 1
        && or(tag::PREDICTOR, 1)? == 1
        && (samples == 1 || or(tag::PLANAR, 1)? == 1)
        && directory.entry(tag::EXTRA).is_none()
        // Grey, white or black as 0, and RGB.
        && matches!((samples, directory.value(tag::INTERPRETATION)?), (1, 0 | 1) | (3, 2));
    if ordinary || !plain {
        return None;
    }
    let in_bytes = |pixels: u32| u32::try_from((u64::from(pixels) * u64::from(samples) * u64::from(bits)).div_ceil(8)).ok();
    let width = directory.value(tag::WIDTH)?;
    let mut patched = bytes.to_vec();
    let mut set = |tag: u16, value: u32| -> Option<()> {
        let Some(at) = directory.entry(tag) else { return Some(()) };
        let long: [u8; 2] = if little { 4_u16.to_le_bytes() } else { 4_u16.to_be_bytes() };
        let numbers = [1, value].map(|number: u32| if little { number.to_le_bytes() } else { number.to_be_bytes() });
        // A file may end within its last entry.
        patched.get_mut(at + 2..at + 12)?.copy_from_slice(&[&long[..], &numbers[0], &numbers[1]].concat());
        Some(())
    };
    set(tag::WIDTH, in_bytes(width)?)?;
    if directory.entry(tag::TILE_WIDTH).is_some() {
        set(tag::TILE_WIDTH, in_bytes(directory.value(tag::TILE_WIDTH)?)?)?;
    }
    // White as 0 is turned round by the decoder for bytes as for anything: a complement of bits is one of numbers.
    let interpretation = if samples == 3 { 1 } else { directory.value(tag::INTERPRETATION)? };
    for (tag, value) in [(tag::BITS, 8), (tag::SAMPLES, 1), (tag::FORMAT, 1), (tag::INTERPRETATION, interpretation)] {
        set(tag, value)?;
    }
    Some(PackedTiff { bytes: patched, width: width as usize, samples: samples as usize, bits, signed, little })
}

impl PackedTiff {
    /// Bytes of a row.
    pub fn row_bytes(&self) -> usize {
        (self.width * self.samples * self.bits as usize).div_ceil(8)
    }

    /// All samples, over the largest that they can be; the mark of no data is NaN.
    pub fn unpacked(&self, raw: &[u8], rows: usize, no_data: Option<f64>) -> Vec<f32> {
        let in_row = self.width * self.samples;
        let largest = f64::from((1_u32 << (self.bits - u32::from(self.signed))) - 1);
        let number = |row: &[u8], k: usize| -> f64 {
            let first = k * self.bits as usize;
            let mut value: u32 = 0;
            if self.little && self.bits.is_multiple_of(8) {
                for (byte, of) in (0..).zip(&row[first / 8..first / 8 + self.bits as usize / 8]) {
                    value |= u32::from(*of) << (8 * byte);
                }
            } else {
                for bit in first..first + self.bits as usize {
                    value = value << 1 | u32::from(row[bit / 8] >> (7 - bit % 8) & 1);
                }
            }
            let negative = self.signed && value >> (self.bits - 1) == 1;
            f64::from(value) - if negative { f64::from(1_u32 << (self.bits - 1)) * 2.0 } else { 0.0 }
        };
        let mut all = Vec::with_capacity(in_row * rows);
        for row in raw.chunks_exact(self.row_bytes().max(1)).take(rows) {
            all.extend((0..in_row).map(|k| {
                let value = number(row, k);
                if Some(value) == no_data { f32::NAN } else { narrow(value / largest) }
            }));
        }
        all
    }
}
