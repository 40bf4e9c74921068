//! Texts that other programs wrote: their encodings and line ends.
//!
//! Our own files are UTF-8 ([`toml_reader`](crate::toml_reader)). Meshes, drafts and lists come from programs of forty years: a byte-order mark before the
//! first word, UTF-16, Windows-1252, and lines that end with a carriage return alone.

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE, WINDOWS_1252};
use std::borrow::Cow;

/// The text of a file, without byte-order marks (files that were put together have some within) and with `\n` at the ends of lines, which keep their numbers.
///
/// UTF-16 is known by its mark, or by zeros at every second byte; what is neither that nor UTF-8 is Windows-1252, in which each byte is a character: names that
/// differ stay different.
///
/// ```
/// use biscale::text_file::decode;
///
/// assert_eq!(decode(b"\xef\xbb\xbfv 0 0 0\r\nf 1\r"), "v 0 0 0\nf 1\n");
/// assert_eq!(decode(b"ply\n\xef\xbb\xbf0 0 0\n"), "ply\n0 0 0\n");
/// assert_eq!(decode(b"caf\xe9"), "café");
/// ```
pub fn decode(bytes: &[u8]) -> Cow<'_, str> {
    let text = match wide(bytes) {
        // Takes the mark off, too.
        Some(encoding) => encoding.decode_with_bom_removal(bytes).0,
        None => {
            let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
            std::str::from_utf8(bytes).map_or_else(|_| WINDOWS_1252.decode_without_bom_handling(bytes).0, Cow::Borrowed)
        }
    };
    let text = if text.contains('\u{feff}') { Cow::Owned(text.replace('\u{feff}', "")) } else { text };
    if text.contains('\r') { Cow::Owned(text.replace("\r\n", "\n").replace('\r', "\n")) } else { text }
}

/// The encoding of a text of two bytes a character, by its mark or by the zeros of its Latin letters.
pub(crate) fn wide(bytes: &[u8]) -> Option<&'static Encoding> {
    match bytes {
        [0xff, 0xfe, ..] => Some(UTF_16LE),
        [0xfe, 0xff, ..] => Some(UTF_16BE),
        _ => {
            let start = &bytes[..bytes.len().min(64) & !1];
            let letters = |zero: usize| !start.is_empty() && start.chunks_exact(2).all(|pair| pair[zero] == 0 && pair[1 - zero] != 0);
            if letters(1) {
                Some(UTF_16LE)
            } else if letters(0) {
                Some(UTF_16BE)
            } else {
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A text of two bytes a character.
    fn utf_16(text: &str, little: bool) -> Vec<u8> {
        text.encode_utf16().flat_map(|unit| if little { unit.to_le_bytes() } else { unit.to_be_bytes() }).collect()
    }

    #[test]
    fn a_text_is_the_same_in_every_encoding_and_with_every_line_end() {
        let text = "solid caf\u{e9}\nfacet\n\nend\n";
        let latin: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect();
        let mut files = vec![text.as_bytes().to_vec(), latin];
        files.extend([true, false].map(|little| utf_16(text, little)));
        files.extend([true, false].map(|little| utf_16(&format!("\u{feff}{text}"), little)));
        files.push(format!("\u{feff}{text}").into_bytes());
        for file in &files {
            assert_eq!(decode(file), text, "{file:?}");
        }
        for end in ["\r", "\r\n"] {
            let changed = text.replace('\n', end);
            assert_eq!(decode(changed.as_bytes()), text, "{changed:?}");
            assert_eq!(decode(&utf_16(&changed, true)), text, "{changed:?}");
        }
    }

    #[test]
    fn nothing_is_lost_and_nothing_panics() {
        assert_eq!(decode(b""), "");
        assert_eq!(decode(b"\xef\xbb\xbf"), "");
        assert_eq!(decode(b"\xff\xfe"), "");
        // Odd bytes at the end of UTF-16, and bytes that are no text at all.
        assert_eq!(decode(b"\xff\xfea\0b"), "a\u{fffd}");
        let all: Vec<u8> = (0..=255).collect();
        assert_eq!(decode(&all).chars().count(), 256);
        // Different bytes of the upper half are different characters.
        let upper: std::collections::BTreeSet<String> = (128..=255_u8).map(|b| decode(&[b'a', b]).into_owned()).collect();
        assert_eq!(upper.len(), 128);
    }
}
