//! Height maps of GelSight and TrueMap programs: "Binary `TrueMap` Data File v2.0".
//!
//! ```text
//! "Binary TrueMap Data File v2.0\r\n" NUL    32 bytes
//! comment NUL                                any length
//! columns, rows                              u32 each, little-endian
//! length along x and y, offset in x and y    f32 each, mm
//! heights                                    columns x rows f32, mm, row by row from the top
//! ```

use crate::error::BadInput;
use crate::image_file::MAX_PIXELS;
use crate::numerics::cast::narrow;

const MAGIC: &[u8] = b"Binary TrueMap Data File v2.0\r\n\0";
/// Bytes between the comment and the heights.
const FIXED: usize = 24;

/// A height map with its size.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// Nodes along x.
    pub columns: usize,
    /// Nodes along y.
    pub rows: usize,
    /// Extent along x and y, mm.
    pub size: [f64; 2],
    /// Heights in mm, the top row first.
    pub heights: Vec<f64>,
}

/// Parses a `.tmd` file.
pub(super) fn parse(bytes: &[u8]) -> Result<HeightMap, BadInput> {
    let Some(rest) = bytes.strip_prefix(MAGIC) else {
        return Err(BadInput::new("the file does not begin with \"Binary TrueMap Data File v2.0\"", "export the scan as TMD version 2"));
    };
    let at = |place: usize| format!("at byte {}", bytes.len() - rest.len() + place);
    let comment = rest.iter().position(|&b| b == 0).ok_or_else(|| BadInput::new("the comment does not end", "export the scan again"))?;
    let fixed = rest.get(comment + 1..comment + 1 + FIXED);
    let fixed = fixed.ok_or_else(|| BadInput::new(format!("the file is cut short {}", at(comment + 1)), "export the scan again"))?;
    let word = |k: usize| [fixed[4 * k], fixed[4 * k + 1], fixed[4 * k + 2], fixed[4 * k + 3]];
    let (columns, rows) = (u32::from_le_bytes(word(0)), u32::from_le_bytes(word(1)));
    let nodes = u64::from(columns) * u64::from(rows);
    if nodes == 0 || nodes > MAX_PIXELS {
        let problem = format!("the map is {columns} x {rows} {}", at(comment + 1));
        return Err(BadInput::new(problem, format!("use 1 to {MAX_PIXELS} nodes")));
    }
    let size = [2, 3].map(|k| f64::from(f32::from_le_bytes(word(k))));
    if !size.iter().all(|s| s.is_finite() && *s > 0.0) {
        let problem = format!("the map is {} x {} mm {}", size[0], size[1], at(comment + 9));
        return Err(BadInput::new(problem, "both lengths must be positive"));
    }
    let data = &rest[comment + 1 + FIXED..];
    if (data.len() as u64) < 4 * nodes {
        let problem = format!("{columns} x {rows} heights need {} bytes, but {} follow {}", 4 * nodes, data.len(), at(comment + 1 + FIXED));
        return Err(BadInput::new(problem, "the file is cut short: copy it again"));
    }
    let (columns, rows) = (columns as usize, rows as usize);
    let mut heights = Vec::with_capacity(columns * rows);
    for (k, h) in data.chunks_exact(4).take(columns * rows).enumerate() {
        let height = f64::from(f32::from_le_bytes([h[0], h[1], h[2], h[3]]));
        if !height.is_finite() {
            let problem =
                format!("the height in column {}, row {} is {height} ({})", k % columns, k / columns, at(comment + 1 + FIXED + 4 * k));
            return Err(BadInput::new(problem, "fill such holes before use"));
        }
        heights.push(height);
    }
    Ok(HeightMap { columns, rows, size, heights })
}

/// A `.tmd` file of a height map, with an empty comment.
pub fn write(map: &HeightMap) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.push(0);
    for count in [map.columns, map.rows] {
        bytes.extend(u32::try_from(count).expect("a map has at most MAX_PIXELS nodes").to_le_bytes());
    }
    // The format stores f32.
    for value in [map.size[0], map.size[1], 0.0, 0.0].iter().chain(&map.heights) {
        bytes.extend(narrow(*value).to_le_bytes());
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn small() -> HeightMap {
        HeightMap { columns: 3, rows: 2, size: [0.75, 0.5], heights: vec![0.0, 1.0, 2.0, -1.0, 0.5, 0.25] }
    }

    #[test]
    fn what_is_written_is_read_back() {
        assert_eq!(parse(&write(&small())).unwrap(), small());
    }

    #[test]
    fn mistakes_are_reported_with_their_byte() {
        let good = write(&small());
        let damaged = |place: usize, with: &[u8]| {
            let mut bytes = good.clone();
            bytes[place..place + with.len()].copy_from_slice(with);
            parse(&bytes).unwrap_err().problem
        };
        assert!(damaged(0, b"Text").contains("does not begin"));
        assert!(damaged(33, &[0; 4]).contains("0 x 2 at byte 33"));
        assert!(damaged(33, &[0xff; 8]).contains("4294967295"));
        assert!(damaged(33, &[4]).contains("need 32 bytes, but 24 follow at byte 57"));
        assert!(damaged(41, &f32::NAN.to_le_bytes()).contains("at byte 41"));
        assert!(damaged(61, &f32::INFINITY.to_le_bytes()).contains("column 1, row 0 is inf (at byte 61)"));
        for cut in [10, 32, 40, 57, good.len() - 1] {
            assert!(parse(&good[..cut]).is_err(), "cut at {cut}");
        }
    }

    proptest! {
        #[test]
        fn damaged_files_never_panic(place in 0_usize..57, byte: u8, cut in 0_usize..82) {
            let mut bytes = write(&small());
            bytes[place] = byte;
            bytes.truncate(cut.max(33));
            let _ = parse(&bytes);
        }
    }
}
