//! The surface that is folded: the design reduced to few facets, narrowed by what folds take, cut to the page.

mod bend;
mod simplify;
mod split;
mod widths;

pub use bend::Bend;
pub use simplify::MAX_REDUCED;
pub use widths::{NARROW, TOO_NARROW, check_widths};

use crate::design::{FoldRecipe, Source};
use crate::mesh::{Mesh, Tolerance, repair};
use biscale::error::BadInput;
use glam::DVec2;
use split::split;

/// The surface that is folded: the design in mm, reduced, narrowed by what folds take and split as the recipe says.
/// Also tells whether its colours change within facets: then a [`crate::design::Texture`] tells them.
///
/// # Errors
/// Those of [`Mesh::new`] and of the steps; no file is named, the caller adds it.
pub fn prepare(source: &Source, recipe: &FoldRecipe) -> Result<(Mesh, bool), BadInput> {
    let mut soup = source.triangles(recipe.scale, recipe.periods);
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
        return Err(BadInput::new(problem, "make it larger with `scale`").at_field("scale"));
    }
    if size > 1e5 {
        let problem = format!("the surface is {:.0} m large", size / 1e3);
        return Err(BadInput::new(problem, "make it smaller with `scale`").at_field("scale"));
    }
    let several = soup.colours.iter().any(|c| *c != soup.colours[0]);
    soup.weld(Tolerance::of_size(size).weld);
    let repaired = repair(&mut soup)?;
    let (mut soup, mut notes) = simplify::reduce(soup, recipe)?;
    let textured = source.has_image() || (several && !notes.is_empty());
    if textured {
        // Colours are looked up on the design; they do not part facets that lie in one plane.
        soup.colours.fill([1.0; 3]);
    }
    let mut mesh = Mesh::new(soup, Tolerance::of_size(size))?;
    notes.splice(0..0, repaired);
    notes.append(&mut mesh.notes);
    notes.extend(mesh.crossings_note());
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
