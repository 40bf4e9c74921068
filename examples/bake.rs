//! A material's whole effective BRDF as a table: baked, stored, loaded, evaluated between its nodes.
//!
//! usage: `cargo run --release --example bake [-- OUT.exr]`

#![allow(clippy::print_stdout, reason = "an example prints what it found")]

use biscale::table::{BakeRecipe, EffectiveTable, bake};
use biscale::{Control, Material, Pair, Quality, Result, effective};
use glam::DVec3;
use std::path::PathBuf;

fn main() -> Result<()> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/pyramids.toml");
    let out = std::env::args_os().nth(1).map_or_else(|| std::env::temp_dir().join("biscale-example-bake.exr"), PathBuf::from);
    let material = Material::load(file.as_ref())?;
    let surface = material.build()?;

    // As many directions as an error of 10 % over the hemisphere needs. The table keeps the text of its material.
    let quality = Quality { tolerance: 0.1, ..Quality::default() };
    let text = std::fs::read_to_string(file).expect("it was read before");
    let recipe = BakeRecipe { name: &material.name, material: &text, quality: quality.clone(), rings: None };
    let table = bake(&surface, &recipe, &Control::quiet())?;
    println!("{} values, error {:.1} %", table.values(), 100.0 * table.about.error.relative_rms);

    table.save(&out)?;
    let loaded = EffectiveTable::load(&out)?;
    println!("stored in {}", out.display());

    // Between its nodes the table answers in a microsecond; the filter itself says how far off that is.
    let pair = Pair { wi: DVec3::new(0.5, 0.2, 0.8).normalize(), wo: DVec3::new(-0.3, 0.1, 0.9).normalize() };
    let interpolated = loaded.eval(pair.wi, pair.wo).fbar;
    let exact = effective(&surface, &[pair], &Quality { tolerance: 0.01, ..quality }, &Control::quiet())?.values[0].fbar;
    println!("fbar from the table {interpolated:.3?}, computed {exact:.3?} 1/sr");
    Ok(())
}
