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
    // Rounded up to three decimals: what is told passes.
    let wanted = |width: f64| (1e3 * scale * width / least).ceil() / 1e3;
    let narrow = mesh.facets.iter().filter(|f| width(&f.flat) < NARROW).count();
    let said = format!("facet {} is {least:.2} mm narrow; {narrow} of {} are below {NARROW} mm", facet + 1, mesh.facets.len());
    if least < TOO_NARROW && !force {
        let (passes, easy) = (wanted(TOO_NARROW), wanted(NARROW));
        let remedy = format!(
            "choose `scale {passes:.3}` or larger ({easy:.3} folds with ease), reduce it with `max_facets`, or insist with `force`"
        );
        return Err(BadInput::new(said, remedy).at_field("scale"));
    }
    Ok(Some(said))
}
