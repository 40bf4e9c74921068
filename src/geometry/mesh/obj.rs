//! Wavefront OBJ: vertices, with linear colours if there are (`v x y z r g b`), texture coordinates, faces; `usemtl` names the part where there is one, else `g`.

use super::soup::{NAMELESS, Soup, finite};
use crate::error::BadInput;
use crate::text_file::decode;
use glam::{DVec2, DVec3};

/// Parses the text of an OBJ file.
pub(super) fn parse(bytes: &[u8]) -> Result<Soup, BadInput> {
    let text = decode(bytes);
    let mut state = State::default();
    let mut joined = String::new();
    for (number, line) in (1..).zip(text.lines()) {
        // Blanks after the mark of a line that goes on are common.
        if let Some(start) = line.trim_end().strip_suffix('\\') {
            joined.push_str(start);
            joined.push(' ');
            continue;
        }
        let whole = if joined.is_empty() { line.to_owned() } else { std::mem::take(&mut joined) + line };
        state.line(&whole).map_err(|bad| bad.at_line(number))?;
    }
    if state.ignored > 0 {
        state.soup.notes.push(format!("{} points, lines or free-form elements are not used", state.ignored));
    }
    if state.textures_lacking > 0 {
        let faces = state.textures_lacking;
        state
            .soup
            .notes
            .push(format!("{faces} faces name texture coordinates (vt), of which the file has none before them: they are not used"));
    }
    Ok(state.soup)
}

#[derive(Default)]
struct State {
    soup: Soup,
    textures: Vec<DVec2>,
    group: Option<String>,
    material: Option<String>,
    ignored: usize,
    /// Faces that name texture coordinates where there are none.
    textures_lacking: usize,
}

impl State {
    fn line(&mut self, line: &str) -> Result<(), BadInput> {
        let line = line.split('#').next().unwrap_or_default().trim();
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        let name = || (!rest.is_empty()).then(|| rest.to_owned());
        match word {
            "v" => {
                let [x, y, z] = numbers::<3>(rest)?;
                self.soup.vertices.push(finite(DVec3::new(x, y, z))?);
                // Six numbers are a place and a colour, a common extension; a fourth alone is a weight.
                if rest.split_whitespace().count() == 6
                    && let Ok([.., r, g, b]) = numbers::<6>(rest)
                {
                    self.soup.colours.push(DVec3::new(r, g, b));
                }
            }
            "vt" => {
                // One number is a texture along a line; v is then 0.
                let v = rest.split_whitespace().nth(1).map_or(Ok(0.0), number)?;
                self.textures.push(DVec2::new(numbers::<1>(rest)?[0], v));
            }
            "vn" => self.soup.normals_ignored = true,
            "g" => self.group = name(),
            "usemtl" => self.material = name(),
            // Several names, or one with spaces in it.
            "mtllib" => {
                self.soup.libraries.push(rest.to_owned());
                self.soup.libraries.extend(rest.split_whitespace().filter(|word| *word != rest).map(str::to_owned));
            }
            "f" => self.face(rest)?,
            "p" | "l" | "curv" | "curv2" | "surf" => self.ignored += 1,
            _ => {}
        }
        Ok(())
    }

    fn face(&mut self, rest: &str) -> Result<(), BadInput> {
        let (mut corners, mut uv) = (Vec::new(), Vec::new());
        let mut lacking = false;
        for word in rest.split_whitespace() {
            let mut indices = word.split('/');
            corners.push(index(indices.next().unwrap_or_default(), self.soup.vertices.len(), "vertex")?);
            match indices.next() {
                Some("") | None => {}
                Some(_) if self.textures.is_empty() => lacking = true,
                Some(texture) => uv.push(self.textures[index(texture, self.textures.len(), "texture coordinate")? as usize]),
            }
        }
        self.textures_lacking += usize::from(lacking);
        let name = self.material.as_deref().or(self.group.as_deref()).unwrap_or(NAMELESS).to_owned();
        let part = self.soup.part(&name)?;
        self.soup.polygon(part, &corners, (uv.len() == corners.len()).then_some(&uv))
    }
}

fn number(word: &str) -> Result<f64, BadInput> {
    word.parse().map_err(|_| BadInput::new(format!("\"{word}\" is not a number"), "write the mesh again"))
}

/// The first `N` numbers of a line.
fn numbers<const N: usize>(rest: &str) -> Result<[f64; N], BadInput> {
    let mut values = [0.0; N];
    let mut words = rest.split_whitespace();
    for value in &mut values {
        let word = words.next().ok_or_else(|| BadInput::new(format!("\"{rest}\" has fewer than {N} numbers"), "write the mesh again"))?;
        *value = number(word)?;
    }
    Ok(values)
}

/// An index from 1, or back from the end if negative, as one from 0.
fn index(word: &str, count: usize, what: &str) -> Result<u32, BadInput> {
    let remedy = if count == 0 {
        format!("none stands before this line: each {what} must stand before the faces that use it")
    } else {
        format!("use 1 to {count}, or -{count} to -1, as defined so far")
    };
    let bad = |problem: String| BadInput::new(problem, remedy.clone());
    let index: i64 = word.parse().map_err(|_| bad(format!("\"{word}\" is not the index of a {what}")))?;
    let end = i64::try_from(count).unwrap_or(i64::MAX);
    let place = if index > 0 { index - 1 } else { end.saturating_add(index) };
    let exists = index != 0 && place >= 0 && place < end;
    u32::try_from(place).ok().filter(|_| exists).ok_or_else(|| bad(format!("there is no {what} {index}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usemtl_names_the_part_and_else_the_group() {
        let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1 2 3\ng hat brim\nf 2 4 3\nusemtl felt # soft\ng other\nf 1 \\ \n 2\\\n -1\n";
        let soup = parse(text.as_bytes()).unwrap();
        assert_eq!(soup.parts, ["default", "hat brim", "felt"]);
        assert_eq!(soup.part_of_triangle, [0, 1, 2]);
        assert_eq!(soup.triangles[2], [0, 1, 3]);
    }

    #[test]
    fn faces_before_the_vertices_are_told_what_to_do() {
        let bad = parse(b"f 1 2 3\nv 0 0 0\nv 1 0 0\nv 0 1 0\n").unwrap_err();
        assert!(bad.line == Some(1) && bad.to_string().contains("must stand before the faces"), "{bad}");
    }

    #[test]
    fn texture_coordinates_that_do_not_exist_are_dropped_with_a_note() {
        let soup = parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nf 1/1 2/2 3/3\nf 2 4 3\n").unwrap();
        assert_eq!((soup.triangles.len(), soup.notes.len()), (2, 1));
        assert!(soup.notes[0].starts_with("1 faces name texture coordinates"), "{:?}", soup.notes);
    }

    #[test]
    fn parts_whose_names_differ_in_one_letter_of_an_old_encoding_stay_two() {
        let soup = parse(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl caf\xe9\nf 1 2 3\nusemtl caf\xe8\nf 3 2 1\n").unwrap();
        assert_eq!(soup.parts, ["caf\u{e9}", "caf\u{e8}"]);
    }

    #[test]
    fn mistakes_are_reported_with_their_line() {
        for (text, line, part) in [
            ("v 0 0 0\nv 1 0\n", 2, "fewer than 3"),
            ("v 0 0 zero\n", 1, "zero"),
            ("v 0 0 nan\n", 1, "not finite"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 4, "no vertex 4"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", 4, "no vertex -4"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", 4, "no vertex 0"),
            ("v 0 0 0\nv 1 0 0\n\nf 1 2\n", 4, "2 corners"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/2 3/1\n", 5, "no texture coordinate 2"),
            ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf a b c\n", 4, "\"a\""),
        ] {
            let bad = parse(text.as_bytes()).unwrap_err();
            assert!(bad.line == Some(line) && bad.problem.contains(part), "{text:?} gave {bad}");
        }
    }
}
