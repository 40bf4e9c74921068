//! A material folded from paper: unfolded into pieces, laid on pages, written as a PDF.
//!
//! usage: `cargo run --release -p biscale-fabricate --example fold [-- OUT.pdf]`

#![allow(clippy::print_stdout, reason = "an example prints what it found")]

use biscale::error::{Error, Result};
use biscale_fabricate::design::{FoldRecipe, Source};
use biscale_fabricate::drawing::{Look, assembly_pages, sheets};
use biscale_fabricate::formats::{Content, Format, side_by_side};
use biscale_fabricate::paper::Paper;
use biscale_fabricate::surface::prepare;
use biscale_fabricate::unfold::{Effort, TabStyle, room, unfold};
use glam::DVec2;
use std::path::PathBuf;

fn main() -> Result<()> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../samples/pyramids.toml");
    let out = std::env::args_os().nth(1).map_or_else(|| std::env::temp_dir().join("biscale-example-fold.pdf"), PathBuf::from);
    let source = Source::load(file.as_ref())?;

    // Pyramids of 50 micrometres, 400 times larger: 20 mm. 2 x 2 of them; folds take nothing of thin paper.
    let recipe = FoldRecipe {
        scale: 400.0,
        periods: [2, 2],
        thickness: 0.0,
        fold_radius: 0.0,
        k_factor: 0.0,
        max_facets: None,
        slope_tolerance_deg: None,
        split: None,
    };
    let (mesh, textured) = prepare(&source, &recipe)?;
    let paper = Paper { name: "a4", size: DVec2::new(210.0, 297.0), roll: false, margin: 10.0, inset: 0.0 };
    let tabs = TabStyle { width: 5.0 };
    let (pattern, without_tab) = unfold(&mesh, textured, room(paper, tabs), tabs, Effort::default(), &|_| false)?;
    println!("{} pieces; {without_tab} glued edges have no place for a tab", pattern.pieces.len());

    let title = source.name(file.as_ref());
    let look = Look {
        title: title.clone(),
        colours: true,
        angles: true,
        period: 0.0,
        numbers: true,
        silhouette: false,
        back: false,
        clean_front: false,
    };
    let sheets = sheets(&mesh, &pattern, paper, &look, None, assembly_pages(&mesh, &pattern, paper, &title))?;
    let placed = side_by_side(&pattern, &sheets);
    // What a verifier needs to build the same design again.
    let recipe = serde_json::json!(recipe);
    let content = Content { title: &title, pages: &sheets.pages, mesh: &mesh, pattern: &pattern, placed: &placed, recipe: &recipe };
    for bytes in Format::Pdf.files(&content)? {
        std::fs::write(&out, bytes).map_err(|source| Error::Io { action: "write", path: out.clone(), source })?;
    }
    println!("{} pages, written to {}", sheets.pages.len(), out.display());
    Ok(())
}
