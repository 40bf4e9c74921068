//! A picture as SVG text, written by hand: lines, curves, text, one embedded image; and the same as PNG.
//!
//! Coordinates are in pixels of the picture, x to the right, y down. The font is embedded in this program and used for the PNG;
//! an SVG names it, and substitutes that other machines have.

use biscale::error::{Error, Result};
use biscale_fabricate::formats::svg::escape;
use resvg::tiny_skia::{Pixmap, PixmapPaint, Transform};
use resvg::usvg;
use std::fmt::Write as _;
use std::sync::Arc;

/// The first comment of every SVG of `biscale plot`: how an output is recognised.
pub const MARK: &str = "made by biscale plot";

const FONT: &str = "'DejaVu Sans', Verdana, Arial, sans-serif";

/// A picture that grows by drawing on it; later strokes lie on earlier ones.
#[derive(Clone, Debug)]
pub struct Svg {
    pub width: f64,
    pub height: f64,
    /// The first comment of the file.
    mark: &'static str,
    body: String,
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
    fn attributes(&self) -> String {
        let dashes = if self.dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{}\"", self.dashes) };
        format!("stroke=\"{}\" stroke-width=\"{}\"{dashes}", self.colour, number(self.width))
    }
}

/// Two decimals, as short as possible.
fn number(x: f64) -> String {
    let text = format!("{x:.2}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

impl Svg {
    /// A white picture of `biscale plot`.
    pub fn new(width: f64, height: f64) -> Self {
        Self::made_by(MARK, width, height)
    }

    /// A white picture whose first comment is `mark`.
    pub fn made_by(mark: &'static str, width: f64, height: f64) -> Self {
        Self { width, height, mark, body: format!("<rect width=\"{}\" height=\"{}\" fill=\"white\"/>\n", number(width), number(height)) }
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
        let mut d = String::new();
        for (i, [x, y]) in points.iter().enumerate() {
            let command = if i == 0 { 'M' } else { 'L' };
            let _ = write!(d, "{command}{} {}", number(*x), number(*y));
        }
        let clip = clip.map_or(String::new(), |name| format!(" clip-path=\"url(#{name})\""));
        let _ = writeln!(
            self.body,
            "<path d=\"{d}\" fill=\"none\" stroke-linejoin=\"round\" stroke-linecap=\"round\" {}{clip}/>",
            stroke.attributes()
        );
    }

    /// A filled polygon without an outline.
    pub fn polygon(&mut self, points: &[[f64; 2]], fill: &str) {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{},{}", number(*x), number(*y))).collect();
        let _ = writeln!(self.body, "<polygon points=\"{}\" fill=\"{fill}\"/>", points.join(" "));
    }

    /// A filled polygon with an outline.
    pub fn outlined_polygon(&mut self, points: &[[f64; 2]], fill: &str, stroke: Stroke<'_>) {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{},{}", number(*x), number(*y))).collect();
        let _ = writeln!(
            self.body,
            "<polygon points=\"{}\" fill=\"{fill}\" stroke-linejoin=\"round\" {}/>",
            points.join(" "),
            stroke.attributes()
        );
    }

    /// A rectangle with an outline.
    pub fn rectangle(&mut self, [x, y]: [f64; 2], [w, h]: [f64; 2], fill: &str, outline: &str) {
        let [x, y, w, h] = [x, y, w, h].map(number);
        let _ = writeln!(
            self.body,
            "<rect x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" fill=\"{fill}\" stroke=\"{outline}\" stroke-width=\"0.8\"/>"
        );
    }

    /// The upper half of a circle.
    pub fn half_circle(&mut self, [x, y]: [f64; 2], radius: f64, stroke: Stroke<'_>) {
        let (left, right, r, y) = (number(x - radius), number(x + radius), number(radius), number(y));
        let _ = writeln!(self.body, "<path d=\"M{left} {y}A{r} {r} 0 0 1 {right} {y}\" fill=\"none\" {}/>", stroke.attributes());
    }

    /// Names the half disc of [`Self::half_circle`] as a clip region.
    pub fn clip_half_disc(&mut self, name: &str, [x, y]: [f64; 2], radius: f64) {
        let (left, right, r, y) = (number(x - radius), number(x + radius), number(radius), number(y));
        let _ = writeln!(self.body, "<clipPath id=\"{name}\"><path d=\"M{left} {y}A{r} {r} 0 0 1 {right} {y}Z\"/></clipPath>");
    }

    /// Text of a size in pixels; its baseline is at the point.
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, colour: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let [x, y, size] = [x, y, size].map(number);
        let _ = writeln!(
            self.body,
            "<text x=\"{x}\" y=\"{y}\" font-family=\"{FONT}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{colour}\">{}</text>",
            escape(text)
        );
    }

    /// The picture as text; with `image` (a PNG) below everything, as wide as the picture and of this height.
    pub fn finish(&self, image: Option<(&[u8], f64)>) -> String {
        let (width, height) = (number(self.width), number(self.height));
        let mut out = String::with_capacity(self.body.len() + 1024);
        let _ = writeln!(
            out,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\">"
        );
        let _ = writeln!(out, "<!-- {} -->", self.mark);
        out.push_str(&self.body);
        if let Some((png, image_height)) = image {
            let data = base64(png);
            let _ = writeln!(out, "<image width=\"{width}\" height=\"{}\" href=\"data:image/png;base64,{data}\"/>", number(image_height));
        }
        out.push_str("</svg>\n");
        out
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
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand pixels")]
        let pixels = |length: f64| (length * f64::from(scale)).round() as u32;
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

/// Base 64 with padding (RFC 4648, section 4).
pub fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0_u32, |word, i| word << 8 | u32::from(chunk.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i)) as usize & 63];
            out.push(if i <= chunk.len() { char::from(digit) } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_the_standard() {
        for (bytes, text) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
    }

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
