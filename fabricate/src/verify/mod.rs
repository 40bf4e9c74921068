//! Is a written pattern right? Reads the file again, folds it up in space and compares it with the design, and what is drawn with what should be.
//!
//! Nothing here uses the unfolder, its tabs, its layout or its drawing: what a reader of the file can see is all there is. The design is
//! built again from the material, with the recipe that the file keeps. What a file claims in its attributes (this polygon is facet 7) is compared
//! with the design; what a printer or cutter sees (`drawn`) is compared with that, both ways: what should be there is, and nothing else.

mod assembly;
mod best_fit;
mod cut_lines;
mod drawn;
mod findings;
mod footer;
mod numbers;
mod overlaps;
mod page;
mod printed;
mod read_fold;
mod read_pattern;
mod read_svg;
mod refold;
mod report;
mod sides;
mod strips;
mod strips_drawn;
mod texts;

pub use drawn::{Drawn, DrawnPage, Look, Shape};
pub use read_fold::{FoldFrame, read_fold};
pub use read_pattern::{ReadFacet, ReadFold, ReadPattern, ReadTab};
pub use read_svg::read_svg;
pub use report::{ANGLE_DEG, EDGE_LENGTH, LENGTH_DIGITS, OVERLAP, POSITION, VerifyReport};
pub use strips::verify_strips;

use crate::mesh::Mesh;
use biscale::error::BadInput;
use overlaps::{outlines, overlaps};
use refold::{lengths, links, refold};
use sides::Sides;

/// Compares what was read with the design.
///
/// # Errors
/// A file whose facets are not those of the design at all.
pub fn verify(seen: &ReadPattern, design: &Mesh, margin: f64) -> Result<VerifyReport, BadInput> {
    let mut report = VerifyReport { facets: design.facets.len(), ..VerifyReport::default() };
    let mut count = vec![0_usize; design.facets.len()];
    for facet in &seen.facets {
        let known = design.facets.get(facet.facet as usize).filter(|f| f.corners.len() == facet.polygon.len());
        if known.is_none() {
            let problem = format!("facet {} with {} corners is none of the design's", facet.facet, facet.polygon.len());
            return Err(BadInput::new(problem, "is it the material that the file was made from?").at_field("against"));
        }
        count[facet.facet as usize] += 1;
    }
    report.missing_or_double = count.iter().filter(|&&n| n != 1).count() + seen.turned;
    report.pieces = seen.facets.iter().map(|f| f.piece).collect::<std::collections::BTreeSet<_>>().len();
    lengths(seen, design, &mut report);
    let sides = Sides::new(seen, design);
    let links = links(seen, design, &sides, &mut report);
    refold(seen, design, &links, &mut report);
    (report.numbered, report.wrong_numbers) = numbers::check(seen, design);
    overlaps(seen, &mut report);
    outlines(seen, &mut report);
    report.margin_violation_mm = seen.margin_violation(margin).into_iter().fold(report.margin_violation_mm, f64::max);
    report.printed.extend(seen.wrong.iter().cloned());
    report.printed.extend(sides.pieces(seen, design));
    if report.missing_or_double == 0 {
        report.printed.extend(if seen.joined.is_some() { sides.named(seen, design) } else { printed::check(seen, design, &sides) });
    }
    report.judge();
    Ok(report)
}
