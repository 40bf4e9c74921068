//! PLY (Stanford polygon format), text and binary of both byte orders. The one part is `default`; texture coordinates are taken
//! from the vertices (`s t`, `u v` or `texture_u texture_v`), and so are colours (`red green blue`: whole numbers are sRGB-encoded, floats
//! linear); everything else is skipped. Triangle strips (`tristrips`, with -1 between them) are taken apart.

use super::soup::{NAMELESS, Soup, finite};
use crate::error::BadInput;
use crate::numerics::cast::truncate_u32;
use crate::numerics::colour::srgb_to_linear;
use crate::text_file::{decode, wide};
use glam::{DVec2, DVec3};
use std::borrow::Cow;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

#[derive(Debug)]
struct Property {
    name: String,
    value: Scalar,
    /// Type of the length, for a list.
    list: Option<Scalar>,
}

#[derive(Debug)]
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

impl Element {
    /// Index of the first property that is no list and has one of these names.
    fn scalar(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| names.contains(&&*p.name) && p.list.is_none())
    }
}

/// The values of one vertex, face or other element.
struct Item {
    /// The last value of each property; NaN of an empty list.
    scalars: Vec<f64>,
    /// The values of the property that holds the vertices of a face.
    corners: Vec<u32>,
}

/// A face as it stands in the file.
struct Face {
    /// Its line or byte.
    position: usize,
    /// Vertices, counted from 0.
    corners: Vec<u32>,
}

/// Parses a PLY file.
pub(super) fn parse(bytes: &[u8]) -> Result<Soup, BadInput> {
    let bytes = as_text(bytes)?;
    let Header { encoding, elements, start, lines, textures } = Header::read(&bytes)?;
    let mut body = Body { bytes: &bytes, at: start, line: lines, encoding };
    let mut soup = Soup { textures, ..Soup::default() };
    let mut uv: Vec<DVec2> = Vec::new();
    // Faces may stand before the vertices they use: they are joined at the end.
    let mut faces: Vec<Face> = Vec::new();
    for element in &elements {
        body.check_size(element)?;
        match &*element.name {
            "vertex" => read_vertices(&mut body, element, &mut soup, &mut uv)?,
            "face" => read_faces(&mut body, element, Lists::Polygons, &mut faces)?,
            "tristrips" => read_faces(&mut body, element, Lists::Strips, &mut faces)?,
            _ if element.properties.is_empty() => {}
            _ => {
                for _ in 0..element.count {
                    body.begin_item()?;
                    body.item(element, None)?;
                }
            }
        }
    }
    join(&body, faces, &uv, &mut soup)?;
    Ok(soup)
}

fn read_vertices(body: &mut Body<'_>, element: &Element, soup: &mut Soup, uv: &mut Vec<DVec2>) -> Result<(), BadInput> {
    let [Some(x), Some(y), Some(z)] = [["x"], ["y"], ["z"]].map(|name| element.scalar(&name)) else {
        return Err(BadInput::new("the vertices lack x, y or z", "export the mesh with positions"));
    };
    let st = [element.scalar(&["s", "u", "texture_u"]), element.scalar(&["t", "v", "texture_v"])];
    let rgb = [["red"], ["green"], ["blue"]].map(|name| element.scalar(&name));
    soup.normals_ignored |= element.scalar(&["nx"]).is_some();
    for _ in 0..element.count {
        let position = body.begin_item()?;
        let Item { scalars, .. } = body.item(element, None)?;
        soup.vertices.push(finite(DVec3::new(scalars[x], scalars[y], scalars[z])).map_err(|b| body.placed(position, b))?);
        let [s, t] = st.map(|k| k.map_or(f64::NAN, |k| scalars[k]));
        uv.push(DVec2::new(s, t));
        if let [Some(r), Some(g), Some(b)] = rgb {
            soup.colours.push(DVec3::from([r, g, b].map(|k| linear(scalars[k], element.properties[k].value))));
        }
    }
    Ok(())
}

/// A component of a colour as a linear number.
fn linear(value: f64, kind: Scalar) -> f64 {
    match kind {
        Scalar::U8 => srgb_to_linear(value / 255.0),
        Scalar::U16 => srgb_to_linear(value / 65535.0),
        _ => value,
    }
}

/// What the lists of vertices of an element are.
#[derive(Clone, Copy, PartialEq)]
enum Lists {
    Polygons,
    /// Strips of triangles that share edges and turn alternately, with -1 between them.
    Strips,
}

fn read_faces(body: &mut Body<'_>, element: &Element, lists: Lists, faces: &mut Vec<Face>) -> Result<(), BadInput> {
    let indices = element.properties.iter().position(|p| matches!(&*p.name, "vertex_indices" | "vertex_index") && p.list.is_some());
    if indices.is_none() {
        return Err(BadInput::new("the faces lack vertex_indices", "export the mesh with faces"));
    }
    for _ in 0..element.count {
        let position = body.begin_item()?;
        let Item { corners, .. } = body.item(element, indices.map(|k| (k, lists)))?;
        match lists {
            Lists::Polygons => faces.push(Face { position, corners }),
            Lists::Strips => faces.extend(strip_triangles(&corners).map(|corners| Face { position, corners })),
        }
    }
    Ok(())
}

/// In the place of a vertex: a new strip begins.
const RESTART: u32 = u32::MAX;

/// The triangles of strips; those that name a vertex twice only lead to the next one.
fn strip_triangles(corners: &[u32]) -> impl Iterator<Item = Vec<u32>> {
    let triangles = |strip: &[u32]| -> Vec<Vec<u32>> {
        let turned = |(k, t): (usize, &[u32])| if k % 2 == 0 { vec![t[0], t[1], t[2]] } else { vec![t[1], t[0], t[2]] };
        strip.windows(3).enumerate().map(turned).filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect()
    };
    corners.split(|&c| c == RESTART).flat_map(triangles).collect::<Vec<_>>().into_iter()
}

/// Adds the faces to the vertices that they name, with texture coordinates if all vertices have them.
fn join(body: &Body<'_>, faces: Vec<Face>, uv: &[DVec2], soup: &mut Soup) -> Result<(), BadInput> {
    let part = soup.part(NAMELESS)?;
    let has_uv = !uv.is_empty() && uv.iter().all(|c| c.is_finite());
    for Face { position, corners } in faces {
        if let Some(c) = corners.iter().find(|&&c| c as usize >= soup.vertices.len()) {
            let bad = BadInput::new(format!("there is no vertex {c}"), format!("the file has {}, counted from 0", soup.vertices.len()));
            return Err(body.placed(position, bad));
        }
        let textures: Option<Vec<DVec2>> = has_uv.then(|| corners.iter().map(|&c| uv[c as usize]).collect());
        soup.polygon(part, &corners, textures.as_deref()).map_err(|b| body.placed(position, b))?;
    }
    Ok(())
}

/// A value that is a whole number from 0 to 2^32 - 1.
fn whole(value: f64) -> Option<u32> {
    (value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0).then_some(truncate_u32(value))
}

/// The file with its text, if that is all of it, as other readers take it: in UTF-8, with lines that end with `\n`.
fn as_text(bytes: &[u8]) -> Result<Cow<'_, [u8]>, BadInput> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if wide(bytes).is_none() && Header::read(bytes)?.encoding != Encoding::Text {
        return Ok(Cow::Borrowed(bytes));
    }
    Ok(match decode(bytes) {
        Cow::Borrowed(text) => Cow::Borrowed(text.as_bytes()),
        Cow::Owned(text) => Cow::Owned(text.into_bytes()),
    })
}

/// What stands before the data.
struct Header {
    encoding: Encoding,
    elements: Vec<Element>,
    /// Byte where the data begin.
    start: usize,
    /// Lines of the header.
    lines: usize,
    /// Images that comments name, as `MeshLab` writes them.
    textures: Vec<String>,
}

impl Header {
    fn read(bytes: &[u8]) -> Result<Self, BadInput> {
        let mut encoding = None;
        let mut elements: Vec<Element> = Vec::new();
        let mut textures = Vec::new();
        let (mut at, mut number) = (0, 0);
        // As the first line ends, so do the others: a binary number may look like a line end.
        let end: &[u8] = match bytes.iter().position(|b| b"\r\n".contains(b)) {
            Some(first) if bytes[first..].starts_with(b"\r\n") => b"\r\n",
            Some(first) => &bytes[first..=first],
            None => b"\n",
        };
        loop {
            let Some(length) = bytes[at..].windows(end.len()).position(|w| w == end) else {
                return Err(BadInput::new("the header has no end_header", "this is not a whole PLY file").at_line(number + 1));
            };
            let line = decode(&bytes[at..at + length]).into_owned();
            at += length + end.len();
            number += 1;
            let bad = |problem: String| BadInput::new(problem, "see the PLY format, or export it again").at_line(number);
            let words: Vec<&str> = line.split_whitespace().collect();
            match (number, &words[..]) {
                (2.., ["comment", "TextureFile", image @ ..]) if !image.is_empty() => textures.push(image.join(" ")),
                (1, ["ply"]) | (2.., [] | ["comment" | "obj_info", ..]) => {}
                (1, _) => return Err(bad("the file does not begin with \"ply\"".into())),
                (_, ["format", format, ..]) => {
                    encoding = Some(match *format {
                        "ascii" => Encoding::Text,
                        "binary_little_endian" => Encoding::LittleEndian,
                        "binary_big_endian" => Encoding::BigEndian,
                        _ => return Err(bad(format!("the format \"{format}\" is not known"))),
                    });
                }
                (_, ["element", name, count]) => {
                    let count = count.parse().map_err(|_| bad(format!("\"{count}\" is not a count")))?;
                    elements.push(Element { name: (*name).into(), count, properties: Vec::new() });
                }
                (_, ["property", rest @ ..]) => {
                    let element = elements.last_mut().ok_or_else(|| bad("a property stands before the first element".into()))?;
                    let scalar = |word: &str| scalar(word).ok_or_else(|| bad(format!("the type \"{word}\" is not known")));
                    element.properties.push(match rest {
                        ["list", length, value, name] => {
                            Property { name: (*name).into(), value: scalar(value)?, list: Some(scalar(length)?) }
                        }
                        [value, name] => Property { name: (*name).into(), value: scalar(value)?, list: None },
                        _ => return Err(bad(format!("\"{}\" is not a property", line.trim()))),
                    });
                }
                (_, ["end_header"]) => break,
                _ => return Err(bad(format!("\"{}\" is not part of a header", line.trim()))),
            }
        }
        let encoding = encoding.ok_or_else(|| BadInput::new("the header has no format", "see the PLY format"))?;
        Ok(Self { encoding, elements, start: at, lines: number, textures })
    }
}

fn scalar(word: &str) -> Option<Scalar> {
    Some(match word {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}

impl Scalar {
    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

/// The data after the header, read value by value.
struct Body<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
    encoding: Encoding,
}

impl Body<'_> {
    /// Places a mistake: text files by line, binary ones by byte.
    fn placed(&self, place: usize, mut bad: BadInput) -> BadInput {
        if self.encoding == Encoding::Text {
            return bad.at_line(place);
        }
        bad.problem = format!("at byte {place}: {}", bad.problem);
        bad
    }

    fn bad(&self, problem: &str) -> BadInput {
        let place = if self.encoding == Encoding::Text { self.line } else { self.at };
        self.placed(place, BadInput::new(problem, "export the file again"))
    }

    /// Refuses a count that the rest of the file cannot hold: one byte a text item, the fixed sizes of a binary one.
    fn check_size(&self, element: &Element) -> Result<(), BadInput> {
        let binary = |p: &Property| p.list.unwrap_or(p.value).size();
        let least = if self.encoding == Encoding::Text { 1 } else { element.properties.iter().map(binary).sum() };
        let rest = self.bytes.len() - self.at;
        if element.properties.is_empty() || element.count.checked_mul(least).is_some_and(|need| need <= rest) {
            return Ok(());
        }
        Err(self.bad(&format!("{} elements \"{}\" are announced, but only {rest} bytes follow", element.count, element.name)))
    }

    /// Line or byte of the item that begins here.
    fn begin_item(&mut self) -> Result<usize, BadInput> {
        if self.encoding != Encoding::Text {
            return Ok(self.at);
        }
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.line += usize::from(self.bytes[self.at] == b'\n');
            self.at += 1;
        }
        Ok(self.line + 1)
    }

    /// The values of the item that begins here, whose property `indices` holds vertices.
    fn item(&mut self, element: &Element, indices: Option<(usize, Lists)>) -> Result<Item, BadInput> {
        let mut item = Item { scalars: vec![f64::NAN; element.properties.len()], corners: Vec::new() };
        for (k, property) in element.properties.iter().enumerate() {
            let length = match property.list {
                None => 1,
                Some(kind) => whole(self.scalar(kind)?).ok_or_else(|| self.bad("the length of a list is not a whole number"))?,
            };
            for _ in 0..length {
                let value = self.scalar(property.value)?;
                item.scalars[k] = value;
                match indices {
                    Some((place, Lists::Strips)) if place == k && value == -1.0 => item.corners.push(RESTART),
                    Some((place, _)) if place == k => {
                        item.corners.push(whole(value).ok_or_else(|| self.bad(&format!("{value} is not the index of a vertex")))?);
                    }
                    _ => {}
                }
            }
        }
        self.end_item()?;
        Ok(item)
    }

    /// A text item ends with its line.
    fn end_item(&mut self) -> Result<(), BadInput> {
        if self.encoding != Encoding::Text {
            return Ok(());
        }
        while let Some(&byte) = self.bytes.get(self.at) {
            if byte == b'\n' {
                break;
            }
            if !byte.is_ascii_whitespace() {
                self.line += 1;
                return Err(self.bad("this line has more values than the header announces"));
            }
            self.at += 1;
        }
        Ok(())
    }

    fn scalar(&mut self, kind: Scalar) -> Result<f64, BadInput> {
        if self.encoding == Encoding::Text {
            return self.word();
        }
        let size = kind.size();
        let Some(raw) = self.bytes.get(self.at..self.at + size) else { return Err(self.bad("the file is cut short")) };
        let mut le = [0_u8; 8];
        le[..size].copy_from_slice(raw);
        if self.encoding == Encoding::BigEndian {
            le[..size].reverse();
        }
        self.at += size;
        let [a, b, c, d, ..] = le;
        Ok(match kind {
            Scalar::I8 => i8::from_le_bytes([a]).into(),
            Scalar::U8 => a.into(),
            Scalar::I16 => i16::from_le_bytes([a, b]).into(),
            Scalar::U16 => u16::from_le_bytes([a, b]).into(),
            Scalar::I32 => i32::from_le_bytes([a, b, c, d]).into(),
            Scalar::U32 => u32::from_le_bytes([a, b, c, d]).into(),
            Scalar::F32 => f32::from_le_bytes([a, b, c, d]).into(),
            Scalar::F64 => f64::from_le_bytes(le),
        })
    }

    /// The next number of a text line.
    fn word(&mut self) -> Result<f64, BadInput> {
        let rest = &self.bytes[self.at..];
        let blank = rest.iter().take_while(|&&b| b == b' ' || b == b'\t' || b == b'\r').count();
        let length = rest[blank..].iter().take_while(|b| !b.is_ascii_whitespace()).count();
        let word = String::from_utf8_lossy(&rest[blank..blank + length]);
        let number = word.parse::<f64>();
        self.at += blank + length;
        number.map_err(|_| {
            let problem = if word.is_empty() { "a value is missing".to_owned() } else { format!("\"{word}\" is not a number") };
            BadInput::new(problem, "export the file again").at_line(self.line + 1)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "ply\nformat FORMAT 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n\
                        property float nx\nproperty float u\nproperty float v\nelement face 1\nproperty uchar flags\nproperty list uchar ushort vertex_index\nend_header\n";

    fn square(encoding: Encoding) -> Vec<u8> {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let name = match encoding {
            Encoding::Text => "ascii",
            Encoding::LittleEndian => "binary_little_endian",
            Encoding::BigEndian => "binary_big_endian",
        };
        let mut out = HEAD.replace("FORMAT", name).into_bytes();
        if encoding == Encoding::Text {
            for (x, y) in corners {
                out.extend(format!("{x} {y} 0 1 {x} {y}\n").bytes());
            }
            out.extend(b"7 4 0 1 2 3\n");
            return out;
        }
        let big = encoding == Encoding::BigEndian;
        let mut push = |le: &[u8]| if big { out.extend(le.iter().rev()) } else { out.extend(le) };
        for (x, y) in corners {
            [x, y, 0.0_f64].iter().for_each(|v| push(&v.to_le_bytes()));
            [1.0, x as f32, y as f32].iter().for_each(|v: &f32| push(&v.to_le_bytes()));
        }
        push(&[7]);
        push(&[4]);
        (0..4_u16).for_each(|c| push(&c.to_le_bytes()));
        out
    }

    #[test]
    fn text_and_both_byte_orders_give_the_same_surface() {
        for encoding in [Encoding::Text, Encoding::LittleEndian, Encoding::BigEndian] {
            let soup = parse(&square(encoding)).unwrap();
            assert_eq!((soup.vertices[2], &soup.triangles[..]), (DVec3::new(1.0, 1.0, 0.0), &[[0, 1, 2], [0, 2, 3]][..]), "{encoding:?}");
            assert_eq!(soup.uv[1], [DVec2::ZERO, DVec2::ONE, DVec2::Y], "{encoding:?}");
            assert!(soup.normals_ignored);
        }
    }

    #[test]
    fn mistakes_are_reported_with_their_line_or_byte() {
        let good = String::from_utf8(square(Encoding::Text)).unwrap();
        let first_vertex = HEAD.lines().count() + 1;
        for (from, to, line, part) in [
            ("ply\n", "plx\n", 1, "does not begin"),
            ("ascii", "morse", 2, "morse"),
            ("vertex 4", "vertex four", 4, "four"),
            ("double x", "octuple x", 5, "octuple"),
            ("0 0 0 1 0 0\n", "0 0 nan 1 0 0\n", first_vertex, "not finite"),
            ("0 0 0 1 0 0\n", "0 0 0 1 0\n", first_vertex, "missing"),
            ("0 0 0 1 0 0\n", "0 0 0 1 0 0 9\n", first_vertex, "more values"),
            ("7 4 0 1 2 3", "7 4 0 1 2 4", first_vertex + 4, "no vertex 4"),
            ("7 4 0 1 2 3", "7 2 0 1", first_vertex + 4, "2 corners"),
            ("7 4 0 1 2 3", "7 -1", first_vertex + 4, "whole"),
            ("7 4 0 1 2 3", "", first_vertex + 4, ""),
        ] {
            let text = good.replacen(from, to, 1);
            let bad = parse(text.as_bytes()).unwrap_err();
            assert!(bad.problem.contains(part), "{to:?} gave {bad}");
            assert!(part.is_empty() || bad.line.is_some_and(|l| l.abs_diff(line) <= 1), "{to:?} gave {bad}, expected line {line}");
        }
        let binary = square(Encoding::LittleEndian);
        let bad = parse(&binary[..binary.len() - 1]).unwrap_err();
        assert!(bad.problem.contains("at byte") && bad.problem.contains("cut short"), "{bad}");
    }

    #[test]
    fn triangle_strips_are_taken_apart() {
        let head = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\nelement tristrips 1\n\
                    property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n2 0 0\n";
        // A square, and after the restart and a vertex that stands twice a triangle that turns as it is written.
        let soup = parse(format!("{head}10 0 1 2 3 -1 1 4 3 3 3\n").as_bytes()).unwrap();
        assert_eq!(soup.triangles, [[0, 1, 2], [2, 1, 3], [1, 4, 3]]);
        let bad = parse(format!("{head}3 0 1 -2\n").as_bytes()).unwrap_err();
        assert!(bad.problem.contains("-2 is not the index"), "{bad}");
        let bad = parse(format!("{head}3 0 1 7\n").as_bytes()).unwrap_err();
        assert!(bad.problem.contains("no vertex 7"), "{bad}");
    }

    #[test]
    fn a_huge_count_is_refused_before_anything_is_allocated() {
        for count in ["4000000000", "18446744073709551615"] {
            let text = String::from_utf8(square(Encoding::Text)).unwrap().replace("vertex 4", &format!("vertex {count}"));
            assert!(parse(text.as_bytes()).unwrap_err().problem.contains("announced"));
        }
    }
}
