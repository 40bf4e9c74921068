//! A page as PNG, by way of its SVG.

use super::svg::MARK;
use super::svg_tree::{failed, fonts, tree};
use crate::drawing::Page;
use biscale::error::Result;
use biscale::numerics::cast::{narrow, truncate_u32};
use resvg::tiny_skia::{Pixmap, Transform};

/// A page as pixels, so many to the millimetre.
///
/// # Errors
/// [`biscale::error::Error::Numeric`] if it cannot be drawn.
pub fn png(page: &Page, per_mm: f64) -> Result<Vec<u8>> {
    let tree = tree(page, &fonts())?;
    let pixels = |mm: f64| truncate_u32((mm * per_mm).round());
    let mut canvas = Pixmap::new(pixels(page.size.x), pixels(page.size.y)).ok_or_else(|| failed(&"the page has no size"))?;
    canvas.fill(resvg::tiny_skia::Color::WHITE);
    resvg::render(&tree, Transform::from_scale(narrow(per_mm), narrow(per_mm)), &mut canvas.as_mut());
    encode(&canvas, per_mm)
}

/// The pixels as a PNG file that names this program, so that it is recognised as its output, with the size of a pixel (`pHYs`), so that
/// it prints to scale.
fn encode(pixels: &Pixmap, per_mm: f64) -> Result<Vec<u8>> {
    let per_metre = truncate_u32((per_mm * 1e3).round());
    let mut out = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut out, pixels.width(), pixels.height());
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_pixel_dims(Some(::png::PixelDimensions { xppu: per_metre, yppu: per_metre, unit: ::png::Unit::Meter }));
    encoder.add_text_chunk("Software".to_owned(), MARK.to_owned()).map_err(|e| failed(&e))?;
    // The page is opaque: premultiplied colours are the colours.
    let rgb: Vec<u8> = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    let mut writer = encoder.write_header().map_err(|e| failed(&e))?;
    writer.write_image_data(&rgb).and_then(|()| writer.finish()).map_err(|e| failed(&e))?;
    Ok(out)
}
