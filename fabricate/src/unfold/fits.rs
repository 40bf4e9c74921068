//! Whether facets fit the paper.

use super::net::Sheet;
use super::tab_shapes::TabStyle;
use crate::mesh::Mesh;
use crate::paper::Paper;
use crate::polygon::bounds;
use biscale::error::BadInput;
use biscale::numerics::convex_hull::convex_hull;
use glam::DVec2;

/// Longest piece on a roll, mm. Chosen, not measured: longer than a table.
pub const ROLL_LENGTH: f64 = 2000.0;

/// The room for facets on a page: its area less the tabs around.
pub fn room(paper: Paper, tabs: TabStyle) -> Sheet {
    let [_, area] = paper.area();
    let long = if paper.roll { ROLL_LENGTH } else { area.y };
    Sheet { size: DVec2::new(area.x - 2.0 * tabs.width, long - 2.0 * tabs.width) }
}

/// Checks that every facet fits the paper on its own.
///
/// # Errors
/// The first facet that does not.
pub(super) fn check_fit(mesh: &Mesh, sheet: Sheet) -> Result<(), BadInput> {
    for (k, facet) in mesh.facets.iter().enumerate() {
        let around = convex_hull(facet.flat.clone());
        let fits = (0..around.len()).any(|j| {
            let along = (around[(j + 1) % around.len()] - around[j]).normalize_or(DVec2::X);
            let span = |axis: DVec2| {
                let (l, h) = around.iter().map(|p| axis.dot(*p)).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                h - l
            };
            let (w, h) = (span(along), span(along.perp()));
            w.max(h) <= sheet.size.max_element() && w.min(h) <= sheet.size.min_element()
        });
        if !fits {
            let [low, high] = bounds(facet.flat.iter().copied());
            let size = high - low;
            let problem = format!(
                "facet {} is {:.1} x {:.1} mm and the page holds pieces of {:.0} x {:.0} mm",
                k + 1,
                size.x,
                size.y,
                sheet.size.x,
                sheet.size.y
            );
            return Err(BadInput::new(problem, "take a larger `page`, a smaller `scale`, or cut it with `split`").at_field("page"));
        }
    }
    Ok(())
}
