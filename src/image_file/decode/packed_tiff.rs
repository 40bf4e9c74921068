//! TIFF of whole numbers whose bits are no byte, two or four: 12 of cameras and scanners, 10, 14, 24 and the like.
//!
//! The decoder knows bytes. A file of such samples is handed to it as one of bytes, as many a row as the samples fill, and these are taken apart here. TIFF 6.0,
//! section 4 and page 29: samples follow each other from the highest bit on, and each row (of a strip or a tile) begins with a byte; samples of whole
//! bytes are in the order of the file's numbers.

use crate::numerics::cast::narrow;

/// Tags of TIFF 6.0 that say how samples lie.
mod tag {
    pub const WIDTH: u16 = 256;
    pub const HEIGHT: u16 = 257;
    pub const BITS: u16 = 258;
    pub const COMPRESSION: u16 = 259;
    pub const INTERPRETATION: u16 = 262;
    pub const FILL_ORDER: u16 = 266;
    pub const SAMPLES: u16 = 277;
    pub const ROWS: u16 = 278;
    pub const PLANAR: u16 = 284;
    pub const PREDICTOR: u16 = 317;
    pub const TILE_WIDTH: u16 = 322;
    pub const TILE_HEIGHT: u16 = 323;
    /// A tag that says nothing of samples (`TargetPrinter`).
    pub const UNUSED: u16 = 337;
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
    /// Samples of a pixel: 1 to 4, the last of two and of four is alpha.
    pub samples: usize,
    /// Whether the only sample is a place in the palette.
    pub is_palette: bool,
    pub bits: u32,
    signed: bool,
    little: bool,
    /// Whether the samples lie channel after channel; the file of bytes has as many times more rows then.
    planar: bool,
    /// Pixels after which differences begin anew, if samples are differences of neighbours: the width of a tile, or of the image.
    differences_over: Option<usize>,
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
    let (planar, predictor) = (samples > 1 && or(tag::PLANAR, 1)? == 2, or(tag::PREDICTOR, 1)?);
    let interpretation = directory.value(tag::INTERPRETATION)?;
    let plain = OF_BYTES.contains(&or(tag::COMPRESSION, 1)?) && or(tag::FILL_ORDER, 1)? == 1 && matches!(predictor, 1 | 2);
    // Grey, white or black as 0, RGB, each with alpha or without, and places in a palette.
    let known = match (samples, interpretation, or(tag::EXTRA, 0)?) {
        (1, 0 | 1, 0) | (3, 2, 0) | (2, 0 | 1, 1 | 2) | (4, 2, 1 | 2) => true,
        (1, 3, 0) => !signed && bits <= 16,
        _ => false,
    };
    if ordinary || !plain || !known {
        return None;
    }
    let (width, tile) = (directory.value(tag::WIDTH)?, or(tag::TILE_WIDTH, 0)?);
    let in_plane = if planar { 1 } else { samples };
    let in_bytes = |pixels: u32| u32::try_from((u64::from(pixels) * u64::from(in_plane) * u64::from(bits)).div_ceil(8)).ok();
    let mut patch = Patch { bytes: bytes.to_vec(), directory: &directory };
    patch.set(tag::WIDTH, in_bytes(width)?)?;
    if tile > 0 {
        patch.set(tag::TILE_WIDTH, in_bytes(tile)?)?;
    }
    if planar {
        patch.stack_planes(samples)?;
    }
    patch.rename(tag::EXTRA, tag::UNUSED)?;
    // White as 0 is turned round by the decoder for bytes as for anything: a complement of bits is one of numbers.
    let grey = if interpretation == 0 { 0 } else { 1 };
    for (tag, value) in
        [(tag::BITS, 8), (tag::SAMPLES, 1), (tag::FORMAT, 1), (tag::INTERPRETATION, grey), (tag::PLANAR, 1), (tag::PREDICTOR, 1)]
    {
        patch.set(tag, value)?;
    }
    let differences_over = (predictor == 2).then_some(if tile > 0 { tile } else { width } as usize);
    let (width, samples, is_palette) = (width as usize, samples as usize, interpretation == 3);
    Some(PackedTiff { bytes: patch.bytes, width, samples, is_palette, bits, signed, little, planar, differences_over })
}

/// A file whose directory is written over.
struct Patch<'a> {
    bytes: Vec<u8>,
    directory: &'a Directory<'a>,
}

impl Patch<'_> {
    /// Gives a tag that the file has one number. A file may end within its last entry.
    fn set(&mut self, tag: u16, value: u32) -> Option<()> {
        let Some(at) = self.directory.entry(tag) else { return Some(()) };
        let little = self.directory.little;
        let long: [u8; 2] = if little { 4_u16.to_le_bytes() } else { 4_u16.to_be_bytes() };
        let numbers = [1, value].map(|number: u32| if little { number.to_le_bytes() } else { number.to_be_bytes() });
        self.bytes.get_mut(at + 2..at + 12)?.copy_from_slice(&[&long[..], &numbers[0], &numbers[1]].concat());
        Some(())
    }

    /// Makes one tag another one.
    fn rename(&mut self, tag: u16, other: u16) -> Option<()> {
        let Some(at) = self.directory.entry(tag) else { return Some(()) };
        let other = if self.directory.little { other.to_le_bytes() } else { other.to_be_bytes() };
        self.bytes.get_mut(at..at + 2)?.copy_from_slice(&other);
        Some(())
    }

    /// Puts the planes of the samples below each other. `None` where the last strip or tile of a plane is not a whole one.
    fn stack_planes(&mut self, samples: u32) -> Option<()> {
        let height = self.directory.value(tag::HEIGHT)?;
        let tile = self.directory.entry(tag::TILE_HEIGHT).is_some();
        let (rows, tag) = if tile {
            (self.directory.value(tag::TILE_HEIGHT)?, tag::TILE_HEIGHT)
        } else {
            let rows = if self.directory.entry(tag::ROWS).is_some() { self.directory.value(tag::ROWS)? } else { height };
            (rows.min(height), tag::ROWS)
        };
        if rows == 0 || height % rows != 0 || self.directory.entry(tag).is_none() {
            return None;
        }
        self.set(tag, rows)?;
        self.set(tag::HEIGHT, height.checked_mul(samples)?)
    }
}

impl PackedTiff {
    /// Samples in a row of the file of bytes.
    fn in_row(&self) -> usize {
        if self.planar { self.width } else { self.width * self.samples }
    }

    /// Bytes of a row.
    pub fn row_bytes(&self) -> usize {
        (self.in_row() * self.bits as usize).div_ceil(8)
    }

    /// Rows of the image, of those of the file of bytes.
    pub fn rows(&self, of_bytes: usize) -> usize {
        if self.planar { of_bytes / self.samples } else { of_bytes }
    }

    /// All samples, those of a pixel side by side, over the largest that they can be; the mark of no data is NaN.
    pub fn unpacked(&self, raw: &[u8], no_data: Option<f64>) -> Vec<f32> {
        let largest = f64::from((1_u32 << (self.bits - u32::from(self.signed))) - 1);
        let value = |number: u32| {
            let negative = self.signed && number >> (self.bits - 1) == 1;
            let value = f64::from(number) - if negative { f64::from(1_u32 << (self.bits - 1)) * 2.0 } else { 0.0 };
            if Some(value) == no_data { f32::NAN } else { narrow(value / largest) }
        };
        let numbers: Vec<u32> = raw.chunks_exact(self.row_bytes().max(1)).flat_map(|row| self.row(row)).collect();
        if !self.planar {
            return numbers.into_iter().map(value).collect();
        }
        let pixels = numbers.len() / self.samples;
        (0..pixels).flat_map(|pixel| (0..self.samples).map(move |c| c * pixels + pixel)).map(|at| value(numbers[at])).collect()
    }

    /// The numbers of a row, as they were before differences were taken (TIFF 6.0, section 14).
    fn row(&self, row: &[u8]) -> Vec<u32> {
        let mut numbers: Vec<u32> = (0..self.in_row()).map(|k| self.number(row, k)).collect();
        if let Some(pixels) = self.differences_over {
            let step = if self.planar { 1 } else { self.samples };
            let mask = (1_u32 << self.bits) - 1;
            for run in numbers.chunks_mut(pixels * step) {
                for k in step..run.len() {
                    run[k] = run[k].wrapping_add(run[k - step]) & mask;
                }
            }
        }
        numbers
    }

    fn number(&self, row: &[u8], k: usize) -> u32 {
        let first = k * self.bits as usize;
        if self.little && self.bits.is_multiple_of(8) {
            let bytes = row[first / 8..first / 8 + self.bits as usize / 8].iter();
            return (0..).zip(bytes).fold(0, |value, (byte, of)| value | u32::from(*of) << (8 * byte));
        }
        (first..first + self.bits as usize).fold(0, |value, bit| value << 1 | u32::from(row[bit / 8] >> (7 - bit % 8) & 1))
    }
}
