//! The effective BRDF of a material at a few pairs of directions.
//!
//! usage: `cargo run --release --example evaluate [-- MATERIAL.toml]`

#![allow(clippy::print_stdout, reason = "an example prints what it found")]

use biscale::{Control, Material, Pair, Quality, Result, effective};
use glam::DVec3;
use std::path::PathBuf;

fn main() -> Result<()> {
    let sample = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/velvet-rods.toml");
    let file = std::env::args_os().nth(1).map_or(PathBuf::from(sample), PathBuf::from);

    // Reading checks every key; building makes one period of the surface as triangles.
    let material = Material::load(&file)?;
    let surface = material.build()?;
    println!("{}: {} triangles", material.name, surface.tile.triangles.len());

    // Light at 30 degrees from the normal; the viewer goes from there to the other side, in the same plane.
    let in_plane = |deg: f64| DVec3::new(deg.to_radians().sin(), 0.0, deg.to_radians().cos());
    let viewers: Vec<f64> = (-4..=4).map(|k| 20.0 * f64::from(k)).collect();
    let pairs: Vec<Pair> = viewers.iter().map(|&deg| Pair { wi: in_plane(30.0), wo: in_plane(deg) }).collect();

    // A relative RMS error of 3 % over all pairs; the method is left to the program.
    let quality = Quality { tolerance: 0.03, ..Quality::default() };
    let result = effective(&surface, &pairs, &quality, &Control::quiet())?;
    println!("viewer deg   fbar R    G    B (1/sr)    standard error of R");
    for (deg, value) in viewers.iter().zip(&result.values) {
        let [r, g, b] = value.fbar;
        println!("{deg:10}   {r:.4}  {g:.4}  {b:.4}   {:.4}", value.se[0]);
    }
    println!(
        "method {}, {} facets, estimated error {:.2} %",
        result.summary.method,
        result.summary.facets,
        100.0 * result.summary.relative_rms
    );
    Ok(())
}
