//! Pages as PDF, by way of their SVG.

use super::svg::MARK;
use super::svg_tree::{failed, fonts, tree};
use crate::drawing::Page;
use biscale::error::Result;
use biscale::numerics::cast::narrow;
use krilla::geom::Size;
use krilla::metadata::Metadata;
use krilla::page::PageSettings;
use krilla_svg::{SurfaceExt, SvgSettings};

/// PDF points to the millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// All pages as one PDF of vectors, its font embedded.
///
/// # Errors
/// [`biscale::error::Error::Numeric`] if it cannot be drawn, which is a fault of this program.
pub fn pdf(pages: &[Page], title: &str) -> Result<Vec<u8>> {
    let fonts = fonts();
    let mut document = krilla::Document::new();
    document.set_metadata(Metadata::new().title(title.to_owned()).creator(MARK.to_owned()));
    for page in pages {
        let tree = tree(page, &fonts)?;
        let (w, h) = (narrow(page.size.x * POINTS), narrow(page.size.y * POINTS));
        let settings = PageSettings::from_wh(w, h).ok_or_else(|| failed(&"the page has no size"))?;
        let mut sheet = document.start_page_with(settings);
        let mut surface = sheet.surface();
        let size = Size::from_wh(w, h).ok_or_else(|| failed(&"the page has no size"))?;
        surface.draw_svg(&tree, size, SvgSettings::default()).ok_or_else(|| failed(&"its contents cannot be drawn"))?;
        surface.finish();
        sheet.finish();
    }
    document.finish().map_err(|e| failed(&format!("{e:?}")))
}
