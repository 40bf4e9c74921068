//! Markers that a camera finds: `OpenCV`'s predefined dictionary `DICT_5X5_100`.
//!
//! The bits are kept here as data, so that printing needs no `OpenCV`: a marker is a black frame around 5 x 5 cells, row by row from the
//! upper left, 1 white. From `OpenCV` 4.10, `modules/objdetect/src/aruco/predefined_dictionaries.hpp` (Apache-2.0).

/// Cells along a side, the frame included.
pub const CELLS: usize = 7;

/// The 25 bits of each marker, the first cell in bit 24.
pub const DICT_5X5_100: [u32; 100] = [
    0x145b2bc, 0x01c06e6, 0x1af0edd, 0x10395f7, 0x1aeb524, 0x1d4082d, 0x0d3d7ec, 0x0e2146b, 0x10d6132, 0x1313fa5, 0x13cee03, 0x1a2dac0,
    0x1e62b11, 0x05e7166, 0x1fcfca8, 0x051e37f, 0x097a758, 0x0bea26f, 0x0f64dc4, 0x1061de8, 0x12dda75, 0x150e440, 0x16b0ca1, 0x0ba12de,
    0x19cd023, 0x1a59972, 0x1c3ce8b, 0x0224246, 0x03b9672, 0x024223b, 0x027376e, 0x0368873, 0x040d0ce, 0x04aaac8, 0x04643ba, 0x07a6fea,
    0x0998aac, 0x082d101, 0x09aad1d, 0x0863c72, 0x0ad2825, 0x0a52f9e, 0x0d849f7, 0x0c309d9, 0x0da7e31, 0x0e9627a, 0x0e9b997, 0x0f94806,
    0x0f59125, 0x0f6b7d7, 0x11b58e4, 0x11ad279, 0x11e380b, 0x1169445, 0x12ffb4a, 0x158cb8d, 0x15987f0, 0x1422fdf, 0x14e1227, 0x156df22,
    0x173dbf1, 0x164c93c, 0x17cbb86, 0x1880a87, 0x19147dd, 0x184eb8a, 0x18d85ad, 0x1b2cda9, 0x1babd73, 0x1e9d432, 0x1e76528, 0x0f5740a,
    0x1b11a53, 0x018ce65, 0x02ab219, 0x098e981, 0x0a8061c, 0x141a158, 0x185314c, 0x196d12c, 0x1fad3a2, 0x00922b5, 0x019bce0, 0x00b547c,
    0x002c76f, 0x0132289, 0x012d2a7, 0x00c4b43, 0x0067bc5, 0x00faa0d, 0x01f1f54, 0x038e879, 0x0323b23, 0x02c3647, 0x02da51b, 0x02e9d8d,
    0x027c562, 0x03efdf5, 0x0521ee0, 0x0448efd,
];

/// Whether a cell of a marker is white; `row` and `column` from 0 at the upper left of the frame.
pub fn is_white(id: usize, row: usize, column: usize) -> bool {
    let inside = 1..CELLS - 1;
    inside.contains(&row) && inside.contains(&column) && DICT_5X5_100[id] >> (24 - ((row - 1) * 5 + column - 1)) & 1 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same marker turned by a quarter.
    fn turned(bits: u32) -> u32 {
        (0..25).fold(0, |out, k| {
            let (row, column) = (k / 5, k % 5);
            out | (bits >> (24 - ((4 - column) * 5 + row)) & 1) << (24 - k)
        })
    }

    #[test]
    fn markers_differ_from_each_other_and_from_their_own_turns() {
        // What OpenCV says of the dictionary: 3 wrong bits can be corrected, so any two differ in 7 or more, in every turn.
        let turns = |bits: u32| {
            let mut all = vec![bits];
            for k in 0..3 {
                all.push(turned(all[k]));
            }
            all
        };
        for (i, &a) in DICT_5X5_100.iter().enumerate() {
            assert!(a < 1 << 25, "marker {i}");
            for turn in &turns(a)[1..] {
                assert!((a ^ turn).count_ones() >= 7, "marker {i} looks like itself turned");
            }
            for (j, &b) in DICT_5X5_100.iter().enumerate().skip(i + 1) {
                for turn in turns(b) {
                    assert!((a ^ turn).count_ones() >= 7, "markers {i} and {j}: {}", (a ^ turn).count_ones());
                }
            }
        }
    }
}
