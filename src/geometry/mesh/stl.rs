//! STL, text or binary. The one part is `default`; normals and attribute bytes are not used.

use super::soup::{NAMELESS, Soup, finite};
use crate::error::BadInput;
use crate::text_file::decode;
use glam::DVec3;

/// Bytes of the header with the count, and of one triangle.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Parses an STL file. It is binary if its size is what its count says (some binary files begin with "solid"), text if it begins with
/// "solid", else binary and wrong.
pub(super) fn parse(bytes: &[u8]) -> Result<Soup, BadInput> {
    let count = bytes.get(80..HEADER).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let full = count.and_then(|n| n.checked_mul(RECORD)).and_then(|n| n.checked_add(HEADER));
    // An even number of bytes, for texts of two a character.
    let start = decode(&bytes[..bytes.len().min(256)]);
    if full != Some(bytes.len()) && start.trim_start().to_ascii_lowercase().starts_with("solid") {
        return text(&decode(bytes));
    }
    match (count, full) {
        (Some(count), Some(full)) if full <= bytes.len() => of_size(&bytes[HEADER..], count),
        (Some(count), _) => {
            let problem = format!("the file is cut short: it announces {count} triangles at byte 80 and has {} bytes", bytes.len());
            Err(BadInput::new(problem, "export it again"))
        }
        (None, _) => Err(BadInput::new(format!("{} bytes are too few for an STL file", bytes.len()), "export it again")),
    }
}

/// Triangles of a file that may hold more of them than it announces: programs that write as they go leave a count of 0.
fn of_size(records: &[u8], count: usize) -> Result<Soup, BadInput> {
    let held = if records.len().is_multiple_of(RECORD) { records.len() / RECORD } else { count };
    let mut soup = binary(records, if count == 0 { held } else { count })?;
    if held > count {
        let use_of_them = if count == 0 { "all are read" } else { "the others are not read" };
        soup.notes.push(format!("the file announces {count} triangles and holds {held}: {use_of_them}"));
    }
    Ok(soup)
}

fn add(soup: &mut Soup, corners: [DVec3; 3]) -> Result<(), BadInput> {
    let too_many = |_| BadInput::new("the mesh has too many vertices", "simplify it");
    let first = u32::try_from(soup.vertices.len()).map_err(too_many)?;
    for corner in corners {
        soup.vertices.push(finite(corner)?);
    }
    let part = soup.part(NAMELESS)?;
    soup.polygon(part, &[first, first + 1, first + 2], None)
}

fn binary(records: &[u8], count: usize) -> Result<Soup, BadInput> {
    let mut soup = Soup::default();
    for (k, record) in records.chunks_exact(RECORD).take(count).enumerate() {
        let float = |at: usize| f64::from(f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]));
        let vector = |at: usize| DVec3::new(float(at), float(at + 4), float(at + 8));
        soup.normals_ignored |= vector(0) != DVec3::ZERO;
        add(&mut soup, [vector(12), vector(24), vector(36)]).map_err(|mut bad| {
            bad.problem = format!("triangle {} at byte {}: {}", k + 1, HEADER + k * RECORD, bad.problem);
            bad
        })?;
    }
    Ok(soup)
}

fn text(text: &str) -> Result<Soup, BadInput> {
    let mut soup = Soup::default();
    let mut corners: Vec<DVec3> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let bad = |problem: String| BadInput::new(problem, "export it again").at_line(number);
        let mut words = line.split_whitespace();
        match words.next().map(str::to_ascii_lowercase).as_deref() {
            Some("facet") => soup.normals_ignored = true,
            Some("vertex") => {
                let numbers: Option<Vec<f64>> = words.map(|w| w.parse().ok()).collect();
                let Some([x, y, z]) = numbers.as_deref() else { return Err(bad(format!("\"{}\" is not a vertex", line.trim()))) };
                corners.push(finite(DVec3::new(*x, *y, *z)).map_err(|b| b.at_line(number))?);
            }
            Some("endloop" | "endfacet") if !corners.is_empty() => {
                let [a, b, c] = corners[..] else { return Err(bad(format!("a facet has {} corners and not 3", corners.len()))) };
                add(&mut soup, [a, b, c]).map_err(|b| b.at_line(number))?;
                corners.clear();
            }
            _ => {}
        }
    }
    if corners.is_empty() { Ok(soup) } else { Err(BadInput::new("the file ends within a facet", "export it again")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mistakes_are_reported_with_their_line_or_byte() {
        for (text, line, part) in [
            ("solid\nfacet\nouter loop\nvertex 0 0\n", 4, "is not a vertex"),
            ("solid\nfacet\nouter loop\nvertex 0 0 inf\n", 4, "not finite"),
            ("solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n", 6, "2 corners"),
        ] {
            let bad = parse(text.as_bytes()).unwrap_err();
            assert!(bad.line == Some(line) && bad.problem.contains(part), "{text:?} gave {bad}");
        }
        let mut binary = vec![0; 80];
        binary.extend(2_000_000_000_u32.to_le_bytes());
        binary.extend([0; 50]);
        assert!(parse(&binary).unwrap_err().problem.contains("announces 2000000000 triangles"));
        binary[80..84].copy_from_slice(&1_u32.to_le_bytes());
        binary[100..104].copy_from_slice(&f32::NAN.to_le_bytes());
        assert!(parse(&binary).unwrap_err().problem.contains("triangle 1 at byte 84"));
        assert!(parse(b"").is_err());
    }

    #[test]
    fn a_count_that_is_not_that_of_the_file_is_told() {
        let mut triangle = vec![0_u8; 12];
        for value in [0_f32, 0., 0., 1., 0., 0., 0., 1., 0.] {
            triangle.extend(value.to_le_bytes());
        }
        triangle.extend([0, 0]);
        let file = |count: u32, held: usize| [&[0_u8; 80][..], &count.to_le_bytes(), &triangle.repeat(held)].concat();
        for (count, held, read, note) in [
            (2, 2, 2, None),
            (0, 3, 3, Some("announces 0 triangles and holds 3: all are read")),
            (1, 3, 1, Some("announces 1 triangles and holds 3: the others are not read")),
        ] {
            let soup = parse(&file(count, held)).unwrap();
            assert_eq!(soup.triangles.len(), read);
            assert!(soup.notes.len() == usize::from(note.is_some()) && note.is_none_or(|n| soup.notes[0].contains(n)), "{:?}", soup.notes);
        }
        assert!(parse(&file(0, 0)).unwrap().triangles.is_empty());
    }

    #[test]
    fn a_binary_file_may_begin_with_the_word_solid() {
        let mut binary = b"solid but binary".to_vec();
        binary.resize(80, 0);
        binary.extend(1_u32.to_le_bytes());
        for value in [0_f32, 0., 0., 0., 0., 0., 1., 0., 0., 0., 1., 0.] {
            binary.extend(value.to_le_bytes());
        }
        binary.extend([0, 0]);
        assert_eq!(parse(&binary).unwrap().triangles.len(), 1);
    }
}
