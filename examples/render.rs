//! A picture of a scene: the materials of its objects are computed for the directions that the picture needs.
//!
//! usage: `cargo run --release --example render [-- OUT.exr]`

#![allow(clippy::print_stdout, reason = "an example prints what it found")]

use biscale::render::{Scene, render};
use biscale::{Control, Error, Quality, Result};
use std::fs::File;
use std::path::PathBuf;

fn main() -> Result<()> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/samples/scenes/ball.toml");
    let out = std::env::args_os().nth(1).map_or_else(|| std::env::temp_dir().join("biscale-example-render.exr"), PathBuf::from);
    let mut scene = Scene::load(file.as_ref())?;
    // Small and quick: fields of a scene can be changed before it is rendered.
    (scene.camera.width, scene.camera.height, scene.camera.samples) = (64, 64, 1);

    let rendered = render(&scene, &Quality { tolerance: 0.1, ..Quality::default() }, &Control::quiet())?;
    for (material, report) in scene.materials.iter().zip(&rendered.materials) {
        let Some(report) = report else { continue };
        let error = 100.0 * report.relative_rms();
        println!("{}: {} pairs of directions, error {error:.1} %", material.material.name, report.pairs);
    }
    let written = File::create(&out).and_then(|file| rendered.picture.write_exr(file, false, "the example `render`"));
    written.map_err(|source| Error::Io { action: "write", path: out.clone(), source })?;
    println!("{} lights, written to {}", rendered.lights, out.display());
    Ok(())
}
