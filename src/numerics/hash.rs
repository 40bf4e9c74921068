//! FNV-1a, 64 bits: the checksum that files of this program hold.
//!
//! Fowler, Noll and Vo, "The FNV Non-Cryptographic Hash Algorithm" (IETF draft-eastlake-fnv). It tells damage and change, the same on every
//! machine and in every version; it does not protect from intent. What names a cached result is a `blake3` hash instead.

/// Offset basis of 64 bits, from the draft.
const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
/// Prime of 64 bits, `2^40 + 2^8 + 0xb3`, from the draft.
const PRIME: u64 = 0x0100_0000_01b3;

/// A hash of the bytes so far.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv1a(u64);

impl Default for Fnv1a {
    fn default() -> Self {
        Self(OFFSET_BASIS)
    }
}

impl Fnv1a {
    /// Adds bytes: the same as adding them one by one.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0 = bytes.iter().fold(self.0, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME));
    }

    /// The hash of all bytes that were added.
    pub fn value(self) -> u64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gives_the_published_values() {
        // Test vectors of the draft (appendix C), 64-bit FNV-1a.
        for (text, expected) in [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)] {
            let mut hash = Fnv1a::default();
            hash.add(text.as_bytes());
            assert_eq!(hash.value(), expected, "{text:?}");
        }
    }
}
