//! Surfaces that other programs were measured on.

use biscale::numerics::random::Random;
use biscale_fabricate::mesh::Triangles;
use glam::DVec3;

/// Pyramids of four sides on `n` x `n` cells, without a bottom.
pub fn pyramids(n: u32, cell: f64, height: f64) -> Triangles {
    let mut soup = Triangles::default();
    for j in 0..n {
        for i in 0..n {
            let at = |x: f64, y: f64, z: f64| DVec3::new((f64::from(i) + x) * cell, (f64::from(j) + y) * cell, z);
            let corners = [at(0., 0., 0.), at(1., 0., 0.), at(1., 1., 0.), at(0., 1., 0.), at(0.5, 0.5, height)];
            let k = soup.vertices.len() as u32;
            soup.vertices.extend(corners);
            soup.triangles.extend([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]].map(|t: [u32; 3]| t.map(|c| c + k)));
        }
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    soup
}

/// V-grooves along y, `n` of them over `m` cells each.
pub fn grooves(n: u32, m: u32, cell: f64, depth: f64) -> Triangles {
    let mut soup = Triangles::default();
    for j in 0..=m {
        for i in 0..=2 * n {
            let z = if i % 2 == 0 { 0.0 } else { -depth };
            soup.vertices.push(DVec3::new(0.5 * f64::from(i) * cell, f64::from(j) * cell, z));
        }
    }
    for j in 0..m {
        for i in 0..2 * n {
            let k = j * (2 * n + 1) + i;
            let above = k + 2 * n + 1;
            soup.triangles.extend([[k, k + 1, above + 1], [k, above + 1, above]]);
        }
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    soup
}

/// A random height field of `n` x `n` cells, heights from 0 to `amplitude`.
pub fn heights(n: usize, cell: f64, amplitude: f64, seed: u64) -> Triangles {
    let mut random = Random::new(seed);
    let mut soup = Triangles::default();
    for j in 0..=n {
        for i in 0..=n {
            soup.vertices.push(DVec3::new(i as f64 * cell, j as f64 * cell, amplitude * random.unit()));
        }
    }
    for j in 0..n {
        for i in 0..n {
            let k = (j * (n + 1) + i) as u32;
            let m = (n + 1) as u32;
            soup.triangles.extend([[k, k + 1, k + m + 1], [k, k + m + 1, k + m]]);
        }
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    soup
}

/// A binary STL file.
pub fn stl(path: &str, scale: f64) -> Triangles {
    let bytes = std::fs::read(path).unwrap();
    let mut soup = Triangles::default();
    for record in bytes[84..].chunks_exact(50) {
        let k = soup.vertices.len() as u32;
        for c in 0..3 {
            let at = |j: usize| f64::from(f32::from_le_bytes(record[12 + c * 12 + j * 4..][..4].try_into().unwrap()));
            soup.vertices.push(DVec3::new(at(0), at(1), at(2)) * scale);
        }
        soup.triangles.push([k, k + 1, k + 2]);
    }
    soup.colours = vec![[1.0; 3]; soup.triangles.len()];
    soup
}
