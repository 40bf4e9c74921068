//! Surfaces of all kinds, and their patterns as files.

#[allow(dead_code, reason = "the benchmark uses more of it")]
#[path = "../../benches/surfaces/mod.rs"]
mod shapes;

use biscale_fabricate::drawing::{Look, assembly_pages, sheets};
use biscale_fabricate::formats::{Content, Format, side_by_side};
use biscale_fabricate::mesh::{Mesh, Tolerance, Triangles};
use biscale_fabricate::paper::Paper;
use biscale_fabricate::unfold::{Effort, TabStyle, room, unfold};
use biscale_fabricate::verify::{VerifyReport, read_fold, read_svg, verify};
use glam::{DVec2, DVec3};
use serde_json::{Value, json};

pub const A4: Paper = Paper { name: "a4", size: DVec2::new(210.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };

/// A pattern as files.
#[derive(Clone)]
pub struct Printed {
    pub mesh: Mesh,
    pub svg: Vec<String>,
    pub fold: Value,
}

pub fn look() -> Look {
    Look {
        title: "test".into(),
        colours: true,
        angles: true,
        period: 0.0,
        numbers: true,
        silhouette: false,
        back: false,
        clean_front: false,
    }
}

/// Unfolds, draws and writes a surface.
pub fn printed(soup: Triangles, look: &Look, paper: Paper, seed: u64) -> Printed {
    let mesh = Mesh::new(soup.clone(), Tolerance::of_size(soup.size())).unwrap();
    let tabs = TabStyle::default();
    let effort = Effort { seed, work: Effort::default().work / 4, ..Effort::default() };
    let (pattern, _) = unfold(&mesh, false, room(paper, tabs), tabs, effort, &|_| false).unwrap();
    let sheets = sheets(&mesh, &pattern, paper, look, None, assembly_pages(&mesh, &pattern, paper, "test")).unwrap();
    let placed = side_by_side(&pattern, &sheets);
    let recipe = json!({ "margin_mm": paper.margin, "sheet": sheets.recipe });
    let content = Content { title: "test", pages: &sheets.pages, mesh: &mesh, pattern: &pattern, placed: &placed, recipe: &recipe };
    let text =
        |format: Format| -> Vec<String> { format.files(&content).unwrap().into_iter().map(|f| String::from_utf8(f).unwrap()).collect() };
    let fold = serde_json::from_str(&text(Format::Fold)[0]).unwrap();
    Printed { svg: text(Format::Svg { dpi: None }), fold, mesh }
}

impl Printed {
    /// What the verifier says of the pages.
    pub fn pages(&self) -> Vec<String> {
        match read_svg(&self.svg).and_then(|seen| verify(&seen, &self.mesh, 10.0)) {
            Ok(VerifyReport { failures, .. }) => failures,
            Err(error) => vec![error.to_string()],
        }
    }

    /// What the verifier says of the FOLD file.
    pub fn data(&self) -> Vec<String> {
        match read_fold(&self.fold.to_string()).and_then(|seen| verify(&seen, &self.mesh, 0.0)) {
            Ok(VerifyReport { failures, .. }) => failures,
            Err(error) => vec![error.to_string()],
        }
    }
}

fn soup(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Triangles {
    let colours = vec![[1.0; 3]; triangles.len()];
    Triangles { vertices, triangles, colours }
}

/// A prism of height `h` over a polygon, counter-clockwise, whose caps are fans from its first corner.
pub fn prism(base: &[[f64; 2]], h: f64) -> Triangles {
    let n = base.len() as u32;
    let vertices = [0.0, h].iter().flat_map(|&z| base.iter().map(move |p| DVec3::new(p[0], p[1], z))).collect();
    let mut triangles = Vec::new();
    for k in 1..n - 1 {
        triangles.push([0, k + 1, k]);
        triangles.push([n, n + k, n + k + 1]);
    }
    for k in 0..n {
        let l = (k + 1) % n;
        triangles.push([k, l, n + l]);
        triangles.push([k, n + l, n + k]);
    }
    soup(vertices, triangles)
}

/// The L-prism some of whose cut edges come to lie on each other in the plane. Its corners begin at the inner one, from which a fan fills it.
pub fn l_prism() -> Triangles {
    prism(&[[20.0, 20.0], [20.0, 40.0], [0.0, 40.0], [0.0, 0.0], [40.0, 0.0], [40.0, 20.0]], 20.0)
}

pub fn regular(n: u32, r: f64) -> Vec<[f64; 2]> {
    (0..n).map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(n)).map(|a| [r * a.cos(), r * a.sin()]).collect()
}

/// A pyramid over a polygon, with its base.
pub fn pyramid(n: u32, r: f64, h: f64) -> Triangles {
    let mut vertices: Vec<DVec3> = regular(n, r).into_iter().map(|p| DVec3::new(p[0], p[1], 0.0)).collect();
    vertices.push(DVec3::new(0.3, 0.2, h));
    let mut triangles: Vec<[u32; 3]> = (1..n - 1).map(|k| [0, k + 1, k]).collect();
    triangles.extend((0..n).map(|k| [k, (k + 1) % n, n]));
    soup(vertices, triangles)
}

/// A bumpy field of `n` x `n` cells, its triangles in three colours if asked for.
pub fn field(n: usize, cell: f64, height: f64, seed: u64, colours: bool) -> Triangles {
    let mut out = shapes::heights(n, cell, height, seed);
    if colours {
        let palette = [[0.8, 0.1, 0.1], [0.02, 0.02, 0.05], [0.2, 0.7, 0.3]];
        out.colours = (0..out.triangles.len()).map(|k| palette[k % 3]).collect();
    }
    out
}

/// A ball of rings with dents: no two facets alike.
pub fn ball(n: u32, r: f64, dent: f64) -> Triangles {
    let m = 2 * n;
    let mut vertices = vec![DVec3::new(0.0, 0.0, r), DVec3::new(0.0, 0.0, -r)];
    for i in 1..n {
        for j in 0..m {
            let (t, p) = (std::f64::consts::PI * f64::from(i) / f64::from(n), std::f64::consts::TAU * f64::from(j) / f64::from(m));
            let r = r + dent * (3.0 * p).sin() * t.sin();
            vertices.push(r * DVec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos()));
        }
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * m + j % m;
    let mut triangles = Vec::new();
    for j in 0..m {
        triangles.push([0, at(1, j), at(1, j + 1)]);
        triangles.push([1, at(n - 1, j + 1), at(n - 1, j)]);
        for i in 1..n - 1 {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    soup(vertices, triangles)
}

/// Boxes that stand apart: parts of one shape.
pub fn boxes(n: u32, a: f64) -> Triangles {
    let mut out = Triangles::default();
    for k in 0..n {
        let one = prism(&[[0.0, 0.0], [a, 0.0], [a, 0.8 * a], [0.0, 0.8 * a]], 0.6 * a);
        let first = out.vertices.len() as u32;
        out.vertices.extend(one.vertices.iter().map(|v| *v + DVec3::new(2.0 * a * f64::from(k), 0.0, 0.0)));
        out.triangles.extend(one.triangles.iter().map(|t| t.map(|c| c + first)));
        out.colours.extend(&one.colours);
    }
    out
}

/// Forty surfaces of all kinds, each with its name.
pub fn forty() -> Vec<(String, Triangles)> {
    let mut out: Vec<(String, Triangles)> = Vec::new();
    for (a, b, c) in [(20.0, 20.0, 20.0), (30.0, 20.0, 10.0), (60.0, 15.0, 40.0), (12.0, 12.0, 12.0)] {
        out.push((format!("box {a} x {b} x {c}"), prism(&[[0.0, 0.0], [a, 0.0], [a, b], [0.0, b]], c)));
    }
    out.push(("L-prism".into(), l_prism()));
    for n in [3, 5, 6, 8, 12] {
        out.push((format!("prism over {n} corners"), prism(&regular(n, 20.0), 25.0)));
    }
    for n in [3, 4, 5, 7, 9] {
        out.push((format!("pyramid over {n} corners"), pyramid(n, 22.0, 30.0)));
    }
    for (seed, height) in [(1, 4.0), (2, 8.0), (3, 2.0), (4, 15.0)] {
        out.push((format!("field {seed}"), field(5, 14.0, height, seed, false)));
        out.push((format!("coloured field {seed}"), field(4, 16.0, height, seed, true)));
    }
    for (n, depth) in [(3, 4.0), (6, 6.0), (9, 3.0)] {
        out.push((format!("{n} grooves"), shapes::grooves(n, 5, 12.0, depth)));
    }
    for (n, r, dent) in [(3, 25.0, 0.0), (4, 30.0, 4.0), (5, 45.0, 8.0), (6, 60.0, 10.0), (8, 60.0, 3.0)] {
        out.push((format!("ball of {n} rings"), ball(n, r, dent)));
    }
    for (n, a) in [(2, 20.0), (4, 14.0), (7, 10.0)] {
        out.push((format!("{n} boxes"), boxes(n, a)));
    }
    for (n, size) in [(3, 8.0), (4, 9.0), (7, 30.0), (10, 12.0)] {
        out.push((format!("antiprism of {n}"), antiprism(n, size)));
    }
    out.push(("an open sheet".into(), field(1, 60.0, 12.0, 7, false)));
    out.push(("one triangle".into(), soup(vec![DVec3::ZERO, DVec3::new(40.0, 0.0, 0.0), DVec3::new(0.0, 30.0, 0.0)], vec![[0, 1, 2]])));
    out
}

/// A band of triangles between two turned polygons, with both caps.
pub fn antiprism(n: u32, r: f64) -> Triangles {
    let turn = std::f64::consts::PI / f64::from(n);
    let ring = |z: f64, shift: f64| {
        (0..n)
            .map(move |k| std::f64::consts::TAU * f64::from(k) / f64::from(n) + shift)
            .map(move |a| DVec3::new(r * a.cos(), r * a.sin(), z))
    };
    let vertices: Vec<DVec3> = ring(0.0, 0.0).chain(ring(0.9 * r, turn)).collect();
    let mut triangles = Vec::new();
    for k in 0..n {
        let l = (k + 1) % n;
        triangles.extend([[k, l, n + k], [l, n + l, n + k]]);
    }
    for k in 1..n - 1 {
        triangles.extend([[0, k + 1, k], [n, n + k, n + k + 1]]);
    }
    soup(vertices, triangles)
}
