//! Fewer facets for surfaces that no person would fold.
//!
//! A height field becomes a triangulation of few of its points; any other surface loses its least important edges, one after another. What
//! was changed is told as the slope error: the root mean square, by area, of the angle between the original's normals and those of the
//! result, which is what the appearance of the surface depends on.

mod collapse;
mod goal;
mod height_field;
mod quadric;
mod slopes;

use crate::design::FoldRecipe;
use crate::mesh::{MAX_FACETS, Triangles, WELD_SHARE};
use biscale::error::BadInput;
use goal::Goal;

/// Most triangles that are reduced: more take minutes and gigabytes. Chosen, not measured.
pub const MAX_REDUCED: usize = 3_000_000;

/// Reduces a surface if the recipe says so; tells what was done, if anything.
///
/// # Errors
/// Facets or slopes that cannot be reached; a surface that is not one of paper (see [`crate::mesh::Mesh::new`]).
pub fn reduce(soup: Triangles, recipe: &FoldRecipe) -> Result<(Triangles, Vec<String>), BadInput> {
    if recipe.max_facets.is_none() && recipe.slope_tolerance_deg.is_none() {
        return Ok((soup, Vec::new()));
    }
    let facets = recipe.max_facets.unwrap_or(MAX_FACETS).min(MAX_FACETS);
    if facets < 2 {
        return Err(BadInput::new(format!("{facets} facets make no surface"), "write at least 2").at_field("max_facets"));
    }
    if recipe.slope_tolerance_deg.is_none() && soup.triangles.len() <= facets {
        return Ok((soup, Vec::new()));
    }
    if soup.triangles.len() > MAX_REDUCED {
        let problem = format!("the surface has {} triangles, more than the {MAX_REDUCED} that can be reduced", soup.triangles.len());
        return Err(BadInput::new(problem, "reduce it first in a mesh program, or lower the material's resolution").at_field("max_facets"));
    }
    let before = soup.triangles.len();
    let goal = Goal { facets, slope: recipe.slope_tolerance_deg.map(f64::to_radians) };
    let size = soup.size();
    let mut welded = soup;
    welded.weld(WELD_SHARE * size);
    let keep: Vec<bool> = welded.triangles.iter().map(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]).collect();
    let mut k = keep.iter();
    welded.triangles.retain(|_| *k.next().expect("one a triangle"));
    let mut k = keep.iter();
    welded.colours.retain(|_| *k.next().expect("one a triangle"));
    if welded.triangles.is_empty() {
        return Err(BadInput::new("no triangle has an area", "give a surface with at least one; is its scale right?"));
    }
    let (out, slope, how) = match height_field::Field::new(&welded) {
        Some(field) => {
            let (out, slope) = field.reduce(goal)?;
            (out, slope, "as a height field")
        }
        None => {
            let (out, slope) = collapse::reduce(welded, goal)?;
            (out, slope, "edge by edge")
        }
    };
    if let Some(limit) = recipe.slope_tolerance_deg.filter(|l| slope > l.to_radians()) {
        let problem =
            format!("with {} facets the slopes are off by {:.2} degrees (RMS), more than {limit}", out.triangles.len(), slope.to_degrees());
        return Err(
            BadInput::new(problem, "allow more with `slope_tolerance`, or more facets with `max_facets`").at_field("slope_tolerance")
        );
    }
    if out.triangles.len() > facets {
        let problem = format!("the surface could be reduced {how} to {} facets and not to {facets}", out.triangles.len());
        return Err(BadInput::new(problem, "allow more facets, or reduce it in a mesh program").at_field("max_facets"));
    }
    let note = format!(
        "reduced {before} triangles {how} to {}: their normals are off by {:.2} degrees (RMS, by area)",
        out.triangles.len(),
        slope.to_degrees()
    );
    Ok((out, vec![note]))
}
