//! What a person can fold: how narrow facets may be.

use crate::mesh::{Mesh, width};
use biscale::error::BadInput;

/// Facets narrower than this are warned of, mm. Chosen, not measured: as wide as the tabs.
pub const NARROW: f64 = 5.0;

/// Facets narrower than this are refused, mm, unless the user insists. Chosen, not measured: what fingers and a ruler still fold.
pub const TOO_NARROW: f64 = 2.0;

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
    let narrow = mesh.facets.iter().filter(|f| width(&f.flat) < NARROW).count();
    let said = format!("facet {} is {least:.2} mm narrow; {narrow} of {} are below {NARROW} mm", facet + 1, mesh.facets.len());
    if least < TOO_NARROW && !force {
        let remedy = format!("choose `scale {wanted:.3}` or larger, reduce it with `max_facets`, or insist with `force`");
        return Err(BadInput::new(said, remedy).at_field("scale"));
    }
    Ok(Some(said))
}
