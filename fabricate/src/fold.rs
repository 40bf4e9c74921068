//! From a source to a pattern: the steps in their order, and the checks between them.

use crate::bend::Bend;
use crate::copies::Copies;
use crate::design::{Recipe, Source};
use crate::layout::Paper;
use crate::mesh::{Mesh, Tolerance};
use crate::pattern::Pattern;
use crate::simplify;
use crate::split::split;
use crate::unfold::net::{Net, Problem, Sheet};
use crate::unfold::search::{Effort, Stop, search};
use crate::unfold::tabs::{TabShapes, TabStyle};
use biscale::error::{BadInput, Result};
use glam::DVec2;

/// Facets narrower than this are warned of, mm.
pub const NARROW: f64 = 5.0;
/// Facets narrower than this are refused, mm, unless the user insists.
pub const TOO_NARROW: f64 = 2.0;

/// The surface that is folded: the design in mm, reduced, narrowed by what folds take and split as the recipe says.
/// Also tells whether its colours change within facets: then a [`crate::texture::Texture`] tells them.
///
/// # Errors
/// Those of [`Mesh::new`] and of the steps; no file is named, the caller adds it.
pub fn surface(source: &Source, recipe: &Recipe) -> Result<(Mesh, bool), BadInput> {
    let soup = source.triangles(recipe.scale, recipe.periods);
    if let Some(k) = soup.vertices.iter().position(|v| !v.is_finite()) {
        let v = soup.vertices[k];
        return Err(BadInput::new(
            format!("vertex {} is ({}, {}, {}) mm", k + 1, v.x, v.y, v.z),
            "choose a scale that gives finite lengths",
        ));
    }
    let size = soup.size();
    if size.is_nan() || size <= 1e-3 {
        let problem = format!("the surface is {size:e} mm large");
        return Err(BadInput::new(problem, "make it larger with --scale").at_field("--scale"));
    }
    if size > 1e5 {
        let problem = format!("the surface is {:.0} m large", size / 1e3);
        return Err(BadInput::new(problem, "make it smaller with --scale").at_field("--scale"));
    }
    let several = soup.colours.iter().any(|c| *c != soup.colours[0]);
    let (mut soup, mut notes) = simplify::reduce(soup, recipe)?;
    let textured = source.has_image() || (several && !notes.is_empty());
    if textured {
        // Colours are looked up on the design; they do not part facets that lie in one plane.
        soup.colours.fill([1.0; 3]);
    }
    let mut mesh = Mesh::new(soup, Tolerance::of_size(size))?;
    notes.append(&mut mesh.notes);
    if recipe.thickness > 0.0 {
        mesh = Bend { thickness: recipe.thickness, radius: recipe.fold_radius, k: recipe.k_factor }.apply(mesh)?;
        notes.append(&mut mesh.notes);
    }
    if let Some([w, h]) = recipe.split {
        let before = mesh.facets.len();
        mesh = split(mesh, DVec2::new(w, h))?;
        if mesh.facets.len() > before {
            notes.push(format!("split facets that are larger than the page: {} became {}", before, mesh.facets.len()));
        }
    }
    mesh.notes = notes;
    Ok((mesh, textured))
}

/// What a person can fold: refuses facets below [`TOO_NARROW`] unless `force`, and warns of those below [`NARROW`].
///
/// # Errors
/// A facet that is too narrow.
pub fn check_widths(mesh: &Mesh, scale: f64, force: bool) -> Result<Option<String>, BadInput> {
    let (least, facet) = mesh.narrowest();
    if least >= NARROW {
        return Ok(None);
    }
    let wanted = scale * NARROW / least;
    let narrow = mesh.facets.iter().filter(|f| crate::mesh::width(&f.flat) < NARROW).count();
    let said = format!("facet {} is {least:.2} mm narrow; {narrow} of {} are below {NARROW} mm", facet + 1, mesh.facets.len());
    if least < TOO_NARROW && !force {
        let remedy = format!("choose --scale {wanted:.3} or larger, reduce it with --max-facets, or insist with --force");
        return Err(BadInput::new(said, remedy).at_field("--scale"));
    }
    Ok(Some(said))
}

/// Checks that every facet fits the paper on its own.
///
/// # Errors
/// The first facet that does not.
pub fn check_fit(mesh: &Mesh, sheet: Sheet) -> Result<(), BadInput> {
    for (k, facet) in mesh.facets.iter().enumerate() {
        let hull = crate::layout::hull(facet.flat.iter().copied());
        let fits = (0..hull.len()).any(|j| {
            let along = (hull[(j + 1) % hull.len()] - hull[j]).normalize_or(DVec2::X);
            let span = |axis: DVec2| {
                let (l, h) = hull.iter().map(|p| axis.dot(*p)).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
                h - l
            };
            let (w, h) = (span(along), span(along.perp()));
            w.max(h) <= sheet.size.max_element() && w.min(h) <= sheet.size.min_element()
        });
        if !fits {
            let size = facet.flat.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
            let size = size.1 - size.0;
            let problem = format!(
                "facet {} is {:.1} x {:.1} mm and the page holds pieces of {:.0} x {:.0} mm",
                k + 1,
                size.x,
                size.y,
                sheet.size.x,
                sheet.size.y
            );
            return Err(BadInput::new(problem, "take a larger page, a smaller scale, or cut it with --split").at_field("--page"));
        }
    }
    Ok(())
}

/// The room for facets on a page: its area less the tabs around.
pub fn room(paper: Paper, tabs: TabStyle) -> Sheet {
    let [_, area] = paper.area();
    let long = if paper.roll { ROLL_LENGTH } else { area.y };
    Sheet { size: DVec2::new(area.x - 2.0 * tabs.width, long - 2.0 * tabs.width) }
}

/// Longest piece on a roll, mm.
pub const ROLL_LENGTH: f64 = 2000.0;

/// Unfolds a mesh; parts that are alike are unfolded once, unless they are `textured`: then each copy is painted in its own way.
/// Also tells how many glued edges have no place for a tab.
///
/// # Errors
/// A facet larger than the page.
pub fn unfold(
    mesh: &Mesh,
    textured: bool,
    sheet: Sheet,
    tabs: TabStyle,
    effort: Effort,
    stop: &Stop<'_>,
) -> Result<(Pattern, usize), BadInput> {
    check_fit(mesh, sheet)?;
    let copies = if textured { Copies::none(mesh) } else { Copies::find(mesh) };
    let problem = Problem::new(&copies.once, TabShapes::new(&copies.once, tabs), sheet);
    let net: Net<'_, '_> = search(&problem, effort, stop);
    let bare = net.without_tab().map(|e| copies.count(e)).sum();
    Ok((copies.expand(mesh, Pattern::new(&net)), bare))
}
