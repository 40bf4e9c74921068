//! `biscale new board`: what a capture needs in print, with a sidecar that tells where everything is.

use crate::common::options::CommonArgs;
use crate::common::output::{self, Target as Output};
use crate::common::paper;
use crate::common::wrap_sidecar::wrap_json;
use biscale::error::{BadInput, Error, Result};
use biscale_capture::kit::PrintedBoard;
use biscale_fabricate::formats::{CREATOR, Content, Format};
use biscale_fabricate::mesh::Mesh;
use biscale_fabricate::unfold::Pattern;
use biscale_fabricate::wrap::{BoardDesign, Target, board_page, wrap};
use clap::Args;
use glam::DVec2;
use serde_json::json;
use std::path::Path;

/// What the sheet goes around if nothing is said: it fits on one page of A4 or US letter.
const ON: &str = "cylinder:radius=30,height=60";
/// The paper, and the border without anything, mm.
const PAGE: (&str, f64) = ("a4", 10.0);
/// Thickness of the paper, mm: 80 g/m².
const THICKNESS: f64 = 0.1;

/// How it is printed.
#[derive(Args, Debug)]
#[command(next_help_heading = "Board")]
pub(super) struct BoardArgs {
    /// What the sheet for the sample is put on: cylinder:radius=30,height=60 (if nothing is said), or plane:width=100,height=80; in mm, measured on the object
    #[arg(long, value_name = "SHAPE")]
    on: Option<String>,
    /// Paper of the board and the sheet: a4 (if nothing is said), letter, a3, each also as a4-landscape ..., or roll:WIDTH in mm
    #[arg(long, value_name = "PAPER")]
    page: Option<String>,
}

impl BoardArgs {
    /// The first option that is given.
    pub(super) fn given(&self) -> Option<&'static str> {
        self.on.as_ref().map(|_| "on").or(self.page.as_ref().map(|_| "page"))
    }
}

/// Writes the PDF and its sidecar.
///
/// # Errors
/// Bad input: a shape or a paper that is none, an output that is no PDF or exists; i/o.
pub(super) fn run(args: &BoardArgs, file: &Path, force: bool, common: &CommonArgs) -> Result<()> {
    if file.extension().is_none_or(|e| !e.eq_ignore_ascii_case("pdf")) {
        return Err(BadInput::new("the board is printed from a PDF", "name a file that ends in .pdf").in_file(file).into());
    }
    let beside = file.with_extension("json");
    let (pdf, sidecar) = (Output::new(file, force, &[], |_| false)?, Output::new(&beside, force, &[], |_| false)?);
    let paper = paper::parse(args.page.as_deref().unwrap_or(PAGE.0), PAGE.1, 0.0)?;
    paper.check()?;
    let board = PrintedBoard::standard();
    let design = BoardDesign {
        columns: board.columns as usize,
        rows: board.rows as usize,
        square: board.square_mm,
        marker: board.marker_mm,
        first_id: board.first_id as usize,
    };
    let title = format!("biscale: calibration board, {} x {} squares of {} mm", board.columns, board.rows, board.square_mm);
    let mut pages = vec![board_page(design, paper, &title)?];
    let target = Target::parse(args.on.as_deref().unwrap_or(ON))?;
    if matches!(target, Target::Cone { .. } | Target::Box { .. }) {
        return Err(BadInput::new("a photograph of a cone or a box cannot be registered", "write a cylinder or a plane")
            .at_field("on")
            .into());
    }
    // One period all around: no lines but that at the seam.
    let fit = target.fit(DVec2::splat(f64::INFINITY), THICKNESS);
    let sheet = wrap(target, fit, THICKNESS, &[], paper, &format!("biscale: sample on {}", args.on.as_deref().unwrap_or(ON)))?;
    let first = i32::try_from(board.first_id).unwrap_or(i32::MAX);
    if sheet.markers.iter().any(|m| i32::try_from(m.id).is_ok_and(|id| id >= first)) {
        let problem = format!("the sheet has {} markers, and those from {first} on are the board's", sheet.markers.len());
        return Err(BadInput::new(problem, "take a smaller object").at_field("on").into());
    }
    let told = wrap_json(target, fit, &sheet);
    pages.extend(sheet.pages);
    let nothing = (Mesh { vertices: vec![], facets: vec![], edges: vec![], notes: vec![] }, Pattern::default());
    let recipe = json!({ "thickness": THICKNESS });
    let content = Content { title: &title, pages: &pages, mesh: &nothing.0, pattern: &nothing.1, placed: &[], recipe: &recipe };
    let bytes = Format::Pdf.files(&content)?.concat();
    let beside_text = json!({ "creator": CREATOR, "format": 1, "recipe": recipe, "board": board, "wrap": told });
    let text = serde_json::to_vec_pretty(&beside_text).map_err(|e| Error::Numeric(format!("cannot write the sidecar: {e}")))?;
    pdf.write(|out| out.write_all(&bytes))?;
    sidecar.write(|out| out.write_all(&text))?;
    if common.json {
        return output::print_json(
            &json!({ "kind": "board", "file": file.display().to_string(), "sidecar": beside.display().to_string(), "pages": pages.len() }),
        );
    }
    output::tell(
        common,
        &format!(
            "wrote {} ({} pages) and {}\nprint it at 100 % (\"actual size\"), and measure the bar of 100 mm; glue the board onto something flat, and the sample onto the sheet\n\
             photograph the board from more than 10 sides, the sample from near and from afar, and a mirror ball beside it (docs/capture.md); copy the photographs and {} \
             into one folder; then `biscale capture FOLDER`",
            file.display(),
            pages.len(),
            beside.display(),
            beside.display()
        ),
    );
    Ok(())
}
