//! Numbers as bytes that are the same on every machine and with every compiler: what hashes that are kept in files are taken of.
//!
//! Whole numbers are 64 bits, reals the bits of IEEE 754, both little-endian; a list begins with its length, and a variant of an enum with a tag that its
//! owner chooses and never gives to another one. So no two different values have the same bytes, and renaming a field in the program changes none.

/// Takes bytes, a few at a time: a hash, or a buffer.
pub struct StableBytes<'a> {
    add: &'a mut dyn FnMut(&[u8]),
}

impl<'a> StableBytes<'a> {
    /// Hands all bytes to `add`, in order.
    pub fn new(add: &'a mut dyn FnMut(&[u8])) -> Self {
        Self { add }
    }

    /// A variant of an enum.
    pub fn tag(&mut self, tag: u8) {
        (self.add)(&[tag]);
    }

    /// A whole number.
    pub fn whole(&mut self, value: u64) {
        (self.add)(&value.to_le_bytes());
    }

    /// Numbers whose count their owner knows: a colour, a position.
    pub fn reals(&mut self, values: &[f64]) {
        values.iter().for_each(|v| (self.add)(&v.to_le_bytes()));
    }

    /// The same in single precision.
    pub fn singles(&mut self, values: &[f32]) {
        values.iter().for_each(|v| (self.add)(&v.to_le_bytes()));
    }

    /// A list: its length, and each item by `item`.
    pub fn list<T>(&mut self, items: &[T], mut item: impl FnMut(&mut Self, &T)) {
        self.whole(items.len() as u64);
        items.iter().for_each(|x| item(self, x));
    }

    /// What may be missing: whether it is there, and then itself.
    pub fn option<T>(&mut self, value: Option<T>, item: impl FnOnce(&mut Self, T)) {
        self.tag(value.is_some().into());
        if let Some(value) = value {
            item(self, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(write: impl FnOnce(&mut StableBytes<'_>)) -> Vec<u8> {
        let mut all = Vec::new();
        write(&mut StableBytes::new(&mut |bytes| all.extend_from_slice(bytes)));
        all
    }

    #[test]
    fn bytes_are_those_of_the_definition() {
        assert_eq!(bytes(|b| b.tag(7)), [7]);
        assert_eq!(bytes(|b| b.whole(258)), [2, 1, 0, 0, 0, 0, 0, 0]);
        // IEEE 754: -2 is sign 1, exponent 1024 of 11 bits, fraction 0.
        assert_eq!(bytes(|b| b.reals(&[-2.0])), [0, 0, 0, 0, 0, 0, 0, 0xc0]);
        assert_eq!(bytes(|b| b.singles(&[-2.0])), [0, 0, 0, 0xc0]);
    }

    #[test]
    fn lists_and_what_is_missing_cannot_be_mistaken_for_each_other() {
        let lists = |a: &[u64], b: &[u64]| bytes(|out| [a, b].iter().for_each(|l| out.list(l, |out, x| out.whole(*x))));
        assert_ne!(lists(&[1], &[]), lists(&[], &[1]));
        assert_ne!(bytes(|b| b.option(None, |b, x| b.whole(x))), bytes(|b| b.option(Some(0), |b, x| b.whole(x))));
    }
}
