//! FOLD files: any that is sound, and what this program's own say beyond it.

use super::read_pattern::{ReadFacet, ReadFold, ReadPattern, signed_area};
use biscale::error::BadInput;
use glam::{DVec2, DVec3};
use rustc_hash::FxHashSet;
use serde_json::Value;

fn bad(problem: impl Into<String>) -> BadInput {
    BadInput::new(problem, "see the FOLD specification, version 1.2")
}

/// A FOLD frame with its references checked.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FoldFrame {
    /// Positions; z is 0 where the file has two numbers.
    pub vertices: Vec<DVec3>,
    /// Ends of the edges.
    pub edges: Vec<[usize; 2]>,
    /// B, M, V, F, U, C or J for each edge.
    pub assignment: Vec<char>,
    /// Fold angles, degrees, where given.
    pub angles: Vec<Option<f64>>,
    /// Faces behind each edge, where given.
    pub edges_faces: Vec<Vec<Option<usize>>>,
    /// Corners of the faces.
    pub faces: Vec<Vec<usize>>,
}

fn list<'v>(value: &'v Value, key: &str) -> Result<&'v [Value], BadInput> {
    match value.get(key) {
        None | Some(Value::Null) => Ok(&[]),
        Some(Value::Array(list)) => Ok(list),
        Some(_) => Err(bad(format!("{key} is no list"))),
    }
}

fn index(value: &Value, count: usize, what: &str) -> Result<usize, BadInput> {
    let k = value.as_u64().and_then(|k| usize::try_from(k).ok()).filter(|k| *k < count);
    k.ok_or_else(|| bad(format!("{what}: {value} is none of {count}")))
}

impl FoldFrame {
    /// Reads the top-level frame of a FOLD file, or `frame` of its `file_frames`, which may inherit.
    ///
    /// # Errors
    /// What breaks the format: references that do not exist, lists of different lengths, angles against the assignment.
    pub fn read(file: &Value, frame: Option<usize>) -> Result<Self, BadInput> {
        let own = match frame {
            None => file,
            Some(k) => list(file, "file_frames")?.get(k).ok_or_else(|| bad(format!("there is no frame {k}")))?,
        };
        let inherits = frame.is_some() && own.get("frame_inherit") == Some(&Value::Bool(true));
        let get = |key: &str| -> Result<&[Value], BadInput> {
            let here = list(own, key)?;
            if here.is_empty() && inherits { list(file, key) } else { Ok(here) }
        };
        let coordinate = |v: &Value| -> Result<DVec3, BadInput> {
            let numbers: Vec<f64> = v.as_array().into_iter().flatten().filter_map(Value::as_f64).filter(|x| x.is_finite()).collect();
            match numbers[..] {
                [x, y] => Ok(DVec3::new(x, y, 0.0)),
                [x, y, z] => Ok(DVec3::new(x, y, z)),
                _ => Err(bad(format!("vertices_coords: {v} is no position"))),
            }
        };
        let vertices = get("vertices_coords")?.iter().map(coordinate).collect::<Result<Vec<_>, _>>()?;
        let faces_list = get("faces_vertices")?;
        let mut out = Self { vertices, ..Self::default() };
        let n = out.vertices.len();
        for edge in get("edges_vertices")? {
            let ends = edge.as_array().map(Vec::as_slice).unwrap_or_default();
            let [a, b] = ends else { return Err(bad(format!("edges_vertices: {edge} has not two ends"))) };
            out.edges.push([index(a, n, "edges_vertices")?, index(b, n, "edges_vertices")?]);
        }
        for letter in get("edges_assignment")? {
            let c = letter.as_str().filter(|s| s.len() == 1 && "BMVFUCJbmvfucj".contains(*s)).and_then(|s| s.chars().next());
            out.assignment.push(c.ok_or_else(|| bad(format!("edges_assignment: {letter} is not known")))?.to_ascii_uppercase());
        }
        out.angles = get("edges_foldAngle")?.iter().map(Value::as_f64).collect();
        for face in faces_list {
            let corners = face.as_array().map(Vec::as_slice).unwrap_or_default();
            if corners.len() < 3 {
                return Err(bad(format!("faces_vertices: {face} has fewer than three corners")));
            }
            out.faces.push(corners.iter().map(|c| index(c, n, "faces_vertices")).collect::<Result<_, _>>()?);
        }
        for sides in get("edges_faces")? {
            let sides = sides.as_array().ok_or_else(|| bad("edges_faces: an entry is no list"))?;
            let side = |v: &Value| if v.is_null() { Ok(None) } else { index(v, faces_list.len(), "edges_faces").map(Some) };
            out.edges_faces.push(sides.iter().map(side).collect::<Result<_, _>>()?);
        }
        out.check_lists()?;
        Ok(out)
    }

    /// Refuses lists of different lengths, and angles against the assignment.
    fn check_lists(&self) -> Result<(), BadInput> {
        for (name, length) in
            [("edges_assignment", self.assignment.len()), ("edges_foldAngle", self.angles.len()), ("edges_faces", self.edges_faces.len())]
        {
            if length != 0 && length != self.edges.len() {
                return Err(bad(format!("{name} has {length} entries for {} edges", self.edges.len())));
            }
        }
        for (k, (letter, angle)) in self.assignment.iter().zip(&self.angles).enumerate() {
            let fits = match (letter, angle) {
                (_, None) => true,
                ('V', Some(a)) => *a >= 0.0,
                ('M', Some(a)) => *a <= 0.0,
                ('F' | 'J', Some(a)) => *a == 0.0,
                _ => true,
            };
            if !fits {
                return Err(bad(format!("edge {k} is {letter} and its angle is {}", angle.unwrap_or(0.0))));
            }
        }
        Ok(())
    }
}

/// Reads a FOLD file of this program's.
///
/// # Errors
/// Text that is no FOLD, or one without the facets of a design.
pub fn read_fold(text: &str) -> Result<ReadPattern, BadInput> {
    let file: Value = serde_json::from_str(text).map_err(|e| BadInput::new(format!("this is no JSON: {e}"), "name a FOLD file"))?;
    let frame = FoldFrame::read(&file, None)?;
    let own = |key: &str| -> Result<Vec<u32>, BadInput> {
        let numbers =
            list(&file, key)?.iter().map(|v| v.as_u64().and_then(|v| u32::try_from(v).ok()).ok_or_else(|| bad(format!("{key}: {v}"))));
        let numbers = numbers.collect::<Result<Vec<_>, _>>()?;
        if numbers.len() == frame.faces.len() && !numbers.is_empty() {
            Ok(numbers)
        } else {
            Err(BadInput::new(format!("{key} does not name every face"), "name a FOLD file that `biscale fold` wrote"))
        }
    };
    let (facets, pieces) = (own("faces_biscale:facet")?, own("faces_biscale:piece")?);
    let copies = own("faces_biscale:copy")?;
    let mut seen = ReadPattern { recipe: file.get("biscale:recipe").cloned().unwrap_or(Value::Null), ..ReadPattern::default() };
    let flat = |v: usize| frame.vertices[v].truncate();
    for (k, face) in frame.faces.iter().enumerate() {
        let polygon: Vec<DVec2> = face.iter().map(|&v| flat(v)).collect();
        seen.turned += usize::from(signed_area(&polygon) <= 0.0);
        seen.facets.push(ReadFacet { page: 0, piece: [pieces[k], copies[k]], facet: facets[k], polygon });
    }
    let (edges, numbers) = (list(&file, "edges_biscale:edge")?, list(&file, "edges_biscale:number")?);
    let known = |e: &Value| e.as_u64().and_then(|e| u32::try_from(e).ok()).ok_or_else(|| bad(format!("edges_biscale:edge: {e}")));
    let edges = edges.iter().map(known).collect::<Result<Vec<u32>, _>>()?;
    if edges.len() != frame.edges.len() || frame.edges_faces.len() != frame.edges.len() || frame.angles.len() != frame.edges.len() {
        seen.wrong.push("edges_biscale:edge, edges_faces or edges_foldAngle does not name every edge".to_owned());
        return Ok(seen);
    }
    for (k, ends) in frame.edges.iter().enumerate() {
        if let (Some('M' | 'V'), Some(Some(angle))) = (frame.assignment.get(k), frame.angles.get(k)) {
            seen.folds.push(ReadFold { page: 0, ends: ends.map(flat), edge: edges[k], angle: angle.to_radians() });
        }
    }
    if file.get("frame_unit") != Some(&Value::from("mm")) {
        seen.wrong.push(format!("frame_unit is {} and not \"mm\"", file.get("frame_unit").unwrap_or(&Value::Null)));
    }
    let sides = read_sides(&frame, &edges, &facets);
    seen.joined = Some(sides.joined);
    seen.sides = sides.of_edge;
    seen.wrong.extend(sides.wrong);
    for (k, (&edge, number)) in edges.iter().zip(numbers).enumerate() {
        let number = number.as_u64().ok_or_else(|| bad(format!("edges_biscale:number: {number}")))?;
        if let (Some([Some(face), ..]), true) = (frame.edges_faces.get(k).map(Vec::as_slice), number > 0) {
            seen.numbers.push((edge, facets[*face], number.to_string()));
        }
    }
    if !list(&file, "file_frames")?.is_empty() {
        let folded = FoldFrame::read(&file, Some(0))?;
        if folded.faces.iter().map(Vec::len).ne(frame.faces.iter().map(Vec::len)) {
            return Err(bad("the folded form has other faces than the crease pattern"));
        }
        seen.folded = Some(folded.faces.iter().map(|f| f.iter().map(|&v| folded.vertices[v]).collect()).collect());
    }
    Ok(seen)
}

/// What a FOLD file says of the sides of its edges.
struct FoldSides {
    /// Edges of the design between two faces.
    joined: FxHashSet<u32>,
    /// Edge, facet and the corner of it where the edge begins.
    of_edge: Vec<(u32, u32, usize)>,
    wrong: Vec<String>,
}

/// Compares `edges_faces` and `edges_assignment` with `faces_vertices`: the first face runs an edge as it stands, the second one backwards, every
/// side of a face is that of one edge, and what has one face is a border.
fn read_sides(frame: &FoldFrame, edges: &[u32], facets: &[u32]) -> FoldSides {
    let mut out = FoldSides { joined: FxHashSet::default(), of_edge: Vec::new(), wrong: Vec::new() };
    let mut used: FxHashSet<(usize, usize)> = FxHashSet::default();
    for (k, ends) in frame.edges.iter().enumerate() {
        let faces: Vec<Option<usize>> = (0..2).map(|s| frame.edges_faces[k].get(s).copied().flatten()).collect();
        if frame.edges_faces[k].len() > 2 || faces[0].is_none() {
            out.wrong.push(format!("edges_faces: edge {k} has not one face or two"));
        }
        for (s, face) in faces.iter().enumerate() {
            let Some(face) = *face else { continue };
            let corners = &frame.faces[face];
            let [a, b] = if s == 0 { *ends } else { [ends[1], ends[0]] };
            let side = (0..corners.len()).find(|&c| corners[c] == a && corners[(c + 1) % corners.len()] == b);
            match side {
                Some(c) if used.insert((face, c)) => out.of_edge.push((edges[k], facets[face], c)),
                _ => out.wrong.push(format!("edges_faces: face {face} does not run along edge {k}, or runs along another one there")),
            }
        }
        let two = faces[0].is_some() && faces[1].is_some();
        if two {
            out.joined.insert(edges[k]);
        }
        if two == matches!(frame.assignment.get(k), Some('B') | None) {
            out.wrong.push(format!(
                "edges_assignment: edge {k} is {} and has {} faces",
                frame.assignment.get(k).unwrap_or(&'?'),
                1 + usize::from(two)
            ));
        }
    }
    let sides: usize = frame.faces.iter().map(Vec::len).sum();
    if used.len() < sides {
        out.wrong.push(format!("edges_faces: {} sides of faces belong to no edge", sides - used.len()));
    }
    out
}
