//! A picture as SVG: lines, curves, text, one embedded image; and the same as PNG.
//!
//! Coordinates are in pixels of the picture, x to the right, y down. The font is embedded in this program and used for the PNG;
//! an SVG names it, and substitutes that other machines have.

use biscale::error::{Error, Result};
use biscale::formats::svg::{Element, NAMESPACE, SvgWriter, decimal, path_data, png_url, polygon_points};
use biscale::numerics::cast::truncate_u32;
use resvg::tiny_skia::{Pixmap, PixmapPaint, Transform};
use resvg::usvg;
use std::sync::Arc;

/// The first comment of every SVG of `biscale plot`: how an output is recognised.
pub const MARK: &str = "made by biscale plot";

const FONT: &str = "'DejaVu Sans', Verdana, Arial, sans-serif";

/// Decimals of coordinates, pixels: far below what is seen.
const DECIMALS: usize = 2;

/// A picture that grows by drawing on it; later strokes lie on earlier ones.
#[derive(Clone, Debug)]
pub struct Svg {
    pub width: f64,
    pub height: f64,
    writer: SvgWriter,
}

/// Where a text stands from its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// How a line looks.
#[derive(Clone, Copy, Debug)]
pub struct Stroke<'a> {
    pub colour: &'a str,
    pub width: f64,
    /// As `stroke-dasharray`, empty for none.
    pub dashes: &'a str,
}

/// A whole line of a colour.
pub fn stroke(colour: &str, width: f64) -> Stroke<'_> {
    Stroke { colour, width, dashes: "" }
}

impl Stroke<'_> {
    fn of<'w>(&self, element: Element<'w>) -> Element<'w> {
        element
            .attribute("stroke", self.colour)
            .attribute("stroke-width", number(self.width))
            .optional("stroke-dasharray", (!self.dashes.is_empty()).then_some(self.dashes))
    }
}

fn number(x: f64) -> String {
    decimal(x, DECIMALS)
}

/// The upper half of a circle, as the attribute `d` of a path.
fn half_circle([x, y]: [f64; 2], radius: f64) -> String {
    let (left, right, r, y) = (number(x - radius), number(x + radius), number(radius), number(y));
    format!("M{left} {y}A{r} {r} 0 0 1 {right} {y}")
}

impl Svg {
    /// A white picture of `biscale plot`.
    pub fn new(width: f64, height: f64) -> Self {
        Self::made_by(MARK, width, height)
    }

    /// A white picture whose first comment is `mark`.
    pub fn made_by(mark: &'static str, width: f64, height: f64) -> Self {
        let mut writer = SvgWriter::new();
        let (w, h) = (number(width), number(height));
        writer
            .element("svg")
            .attribute("xmlns", NAMESPACE)
            .attribute("width", &w)
            .attribute("height", &h)
            .attribute("viewBox", format_args!("0 0 {w} {h}"))
            .open();
        writer.comment(mark);
        writer.element("rect").attribute("width", w).attribute("height", h).attribute("fill", "white").close();
        Self { width, height, writer }
    }

    /// A straight line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2], stroke: Stroke<'_>) {
        self.path(&[from, to], stroke);
    }

    /// A line through points.
    pub fn path(&mut self, points: &[[f64; 2]], stroke: Stroke<'_>) {
        self.clipped_path(points, stroke, None);
    }

    /// A line through points, inside the clip region of this name if one is given.
    pub fn clipped_path(&mut self, points: &[[f64; 2]], stroke: Stroke<'_>, clip: Option<&str>) {
        let path = self
            .writer
            .element("path")
            .attribute("d", path_data(points.iter().copied(), false, DECIMALS))
            .attribute("fill", "none")
            .attribute("stroke-linejoin", "round")
            .attribute("stroke-linecap", "round");
        stroke.of(path).optional("clip-path", clip.map(|name| format!("url(#{name})"))).close();
    }

    fn begin_polygon(&mut self, points: &[[f64; 2]], fill: &str) -> Element<'_> {
        self.writer.element("polygon").attribute("points", polygon_points(points.iter().copied(), DECIMALS)).attribute("fill", fill)
    }

    /// A filled polygon without an outline.
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: &str) {
        self.begin_polygon(points, fill).close();
    }

    /// A filled polygon with an outline.
    pub fn outlined_polygon(&mut self, points: &[[f64; 2]], fill: &str, stroke: Stroke<'_>) {
        stroke.of(self.begin_polygon(points, fill).attribute("stroke-linejoin", "round")).close();
    }

    /// A rectangle with an outline.
    pub fn rectangle(&mut self, corner: [f64; 2], size: [f64; 2], fill: &str, outline: &str) {
        let ([x, y], [w, h]) = (corner.map(number), size.map(number));
        let rectangle = self.writer.element("rect").attribute("x", x).attribute("y", y).attribute("width", w).attribute("height", h);
        rectangle.attribute("fill", fill).attribute("stroke", outline).attribute("stroke-width", "0.8").close();
    }

    /// The upper half of a circle.
    pub fn half_circle(&mut self, centre: [f64; 2], radius: f64, stroke: Stroke<'_>) {
        let path = self.writer.element("path").attribute("d", half_circle(centre, radius)).attribute("fill", "none");
        stroke.of(path).close();
    }

    /// Names the half disc of [`Self::half_circle`] as a clip region.
    pub fn clip_half_disc(&mut self, name: &str, centre: [f64; 2], radius: f64) {
        let disc = half_circle(centre, radius) + "Z";
        self.writer.element("clipPath").attribute("id", name).child(|svg| svg.element("path").attribute("d", disc).close());
    }

    /// Text of a size in pixels; its baseline is at the point.
    pub fn text(&mut self, at: [f64; 2], size: f64, anchor: Anchor, colour: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let [x, y] = at.map(number);
        self.writer
            .element("text")
            .attribute("x", x)
            .attribute("y", y)
            .attribute("font-family", FONT)
            .attribute("font-size", number(size))
            .attribute("text-anchor", anchor)
            .attribute("fill", colour)
            .text(text);
    }

    /// The picture as text; with `image` (a PNG) below everything, as wide as the picture and of this height.
    pub fn finish(&self, image: Option<(&[u8], f64)>) -> String {
        let mut writer = self.writer.clone();
        if let Some((png, height)) = image {
            let image = writer.element("image").attribute("width", number(self.width)).attribute("height", number(height));
            image.attribute("href", png_url(png)).close();
        }
        writer.finish()
    }

    /// The picture as pixels, `scale` a pixel of the picture, with `image` at the top if one is given (of that scale already).
    ///
    /// # Errors
    /// [`Error::Numeric`] if the picture cannot be drawn, which is a fault of this program.
    pub fn rasterise(&self, scale: f32, image: Option<&Pixmap>) -> Result<Pixmap> {
        let failed = |e: &dyn std::fmt::Display| Error::Numeric(format!("cannot draw the picture: {e}; please report this"));
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        let options = usvg::Options { fontdb: Arc::new(fonts), font_family: "DejaVu Sans".to_owned(), ..usvg::Options::default() };
        let tree = usvg::Tree::from_str(&self.finish(None), &options).map_err(|e| failed(&e))?;
        let pixels = |length: f64| truncate_u32((length * f64::from(scale)).round());
        let mut canvas = Pixmap::new(pixels(self.width), pixels(self.height)).ok_or_else(|| failed(&"it is empty"))?;
        resvg::render(&tree, Transform::from_scale(scale, scale), &mut canvas.as_mut());
        if let Some(image) = image {
            canvas.draw_pixmap(0, 0, image.as_ref(), &PixmapPaint::default(), Transform::identity(), None);
        }
        Ok(canvas)
    }
}

/// The pixels as a PNG file that names this program, so that it is recognised as its output.
///
/// # Errors
/// [`Error::Numeric`] if the picture cannot be encoded, which is a fault of this program.
pub fn png(pixels: &Pixmap) -> Result<Vec<u8>> {
    let failed = |e: png::EncodingError| Error::Numeric(format!("cannot encode the picture: {e}; please report this"));
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.add_text_chunk("Software".to_owned(), MARK.to_owned()).map_err(failed)?;
    // The pictures are opaque: premultiplied colours are the colours.
    let rgb: Vec<u8> = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&rgb).and_then(|()| writer.finish()).map_err(failed)?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_of_users_cannot_break_the_file() {
        let mut svg = Svg::new(100.0, 50.0);
        svg.text([0.0, 0.0], 10.0, Anchor::Start, "black", "<&\"\u{0}\u{1b}>溝");
        let text = svg.finish(None);
        assert!(text.contains("&lt;&amp;&quot;  &gt;溝"), "{text}");
        assert!(svg.rasterise(1.0, None).is_ok());
    }

    #[test]
    fn text_shows_without_any_font_of_the_machine() {
        let blank = Svg::new(100.0, 30.0);
        let mut written = blank.clone();
        written.text([5.0, 20.0], 14.0, Anchor::Start, "black", "30° ω");
        let dark = |svg: &Svg| svg.rasterise(1.0, None).unwrap().pixels().iter().filter(|p| p.red() < 128).count();
        assert_eq!(dark(&blank), 0);
        assert!(dark(&written) > 50, "{}", dark(&written));
    }
}
