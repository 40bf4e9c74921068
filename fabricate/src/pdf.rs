//! Pages as PDF and PNG, both by way of their SVG.

use crate::drawing::Page;
use crate::svg;
use biscale::error::{Error, Result};
use krilla::geom::Size;
use krilla::metadata::Metadata;
use krilla::page::PageSettings;
use krilla_svg::{SurfaceExt, SvgSettings};
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg;
use std::sync::Arc;

fn failed(e: &dyn std::fmt::Display) -> Error {
    Error::Numeric(format!("cannot draw the page: {e}; please report this"))
}

/// The page as a tree, with the embedded font only: the same on every machine.
fn tree(page: &Page, fonts: &Arc<usvg::fontdb::Database>) -> Result<usvg::Tree> {
    // At 25.4 dots an inch one mm is one pixel of the tree.
    let options = usvg::Options { fontdb: fonts.clone(), font_family: "DejaVu Sans".to_owned(), dpi: 25.4, ..usvg::Options::default() };
    usvg::Tree::from_str(&svg::document(page, None, ""), &options).map_err(|e| failed(&e))
}

fn fonts() -> Arc<usvg::fontdb::Database> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    Arc::new(fonts)
}

/// PDF points to the millimetre.
const POINTS: f64 = 72.0 / 25.4;

/// All pages as one PDF of vectors, its font embedded.
///
/// # Errors
/// [`Error::Numeric`] if it cannot be drawn, which is a fault of this program.
#[expect(clippy::cast_possible_truncation, reason = "PDF holds 32-bit numbers")]
pub fn pdf(pages: &[Page], title: &str) -> Result<Vec<u8>> {
    let fonts = fonts();
    let mut document = krilla::Document::new();
    document.set_metadata(Metadata::new().title(title.to_owned()).creator(svg::MARK.to_owned()));
    for page in pages {
        let tree = tree(page, &fonts)?;
        let (w, h) = ((page.size.x * POINTS) as f32, (page.size.y * POINTS) as f32);
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

/// A page as pixels, so many to the millimetre.
///
/// # Errors
/// [`Error::Numeric`] if it cannot be drawn.
pub fn png(page: &Page, per_mm: f64) -> Result<Vec<u8>> {
    let tree = tree(page, &fonts())?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand pixels")]
    let pixels = |mm: f64| (mm * per_mm).round() as u32;
    let mut canvas = Pixmap::new(pixels(page.size.x), pixels(page.size.y)).ok_or_else(|| failed(&"the page has no size"))?;
    canvas.fill(resvg::tiny_skia::Color::WHITE);
    #[expect(clippy::cast_possible_truncation, reason = "a scale of a few")]
    resvg::render(&tree, Transform::from_scale(per_mm as f32, per_mm as f32), &mut canvas.as_mut());
    encode(&canvas)
}

/// The pixels as a PNG file that names this program, so that it is recognised as its output.
fn encode(pixels: &Pixmap) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.add_text_chunk("Software".to_owned(), svg::MARK.to_owned()).map_err(|e| failed(&e))?;
    // The page is opaque: premultiplied colours are the colours.
    let rgb: Vec<u8> = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    let mut writer = encoder.write_header().map_err(|e| failed(&e))?;
    writer.write_image_data(&rgb).and_then(|()| writer.finish()).map_err(|e| failed(&e))?;
    Ok(out)
}
