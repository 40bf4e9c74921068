//! A page as SVG: one user unit is 1 mm, layers are groups that Inkscape and cutters know.

use crate::drawing::{HALO_WIDTH, LAYERS, LINE_WIDTH, Layer, Mark, Page, Style, number};
use base64::Engine as _;
use glam::DVec2;
use std::fmt::Write as _;

/// The first comment of every SVG of this program: how an output is recognised.
pub const MARK: &str = "made by biscale fold";

/// Names of fonts in the order of choice; the first is embedded in PDF and PNG.
const FONT: &str = "'DejaVu Sans', Verdana, Arial, sans-serif";

/// Text for XML.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // XML has no place for other control characters, not even escaped.
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

/// Attributes of a line's style.
fn stroke(style: Style) -> String {
    let (colour, width, dashes) = match style {
        Style::Hidden => return "fill=\"none\" stroke=\"none\"".to_owned(),
        Style::Cut => ("#000000", LINE_WIDTH, ""),
        Style::Mountain => ("#c03030", LINE_WIDTH, "3 0.9 0.5 0.9"),
        Style::Valley => ("#3050c0", LINE_WIDTH, "1.6 1.1"),
        Style::Halo => ("#ffffff", HALO_WIDTH, ""),
        Style::CutHalo => ("#ffffff", HALO_WIDTH, "0.6 1.8"),
        Style::Thin => ("#808080", 0.15, ""),
        Style::Bold => ("#000000", 0.4, ""),
    };
    let dashes = if dashes.is_empty() { String::new() } else { format!(" stroke-dasharray=\"{dashes}\"") };
    format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dashes}")
}

/// The page as an SVG document. `dpi` scales `width` and `height` to pixels for programs that do not know mm; `recipe` is JSON that
/// a reader finds in `<metadata>`.
pub fn document(page: &Page, dpi: Option<f64>, recipe: &str) -> String {
    let (w, h) = (page.size.x, page.size.y);
    let flip = |p: DVec2| (number(p.x), number(h - p.y));
    let mut out = String::new();
    let (width, height) = match dpi {
        None => (format!("{}mm", number(w)), format!("{}mm", number(h))),
        Some(dpi) => (number(w / 25.4 * dpi), number(h / 25.4 * dpi)),
    };
    let _ = writeln!(
        out,
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" \
         xmlns:xlink=\"http://www.w3.org/1999/xlink\" \
         width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {} {}\">",
        number(w),
        number(h)
    );
    let _ = writeln!(out, "<!-- {MARK} -->");
    if !recipe.is_empty() {
        let _ = writeln!(out, "<metadata>{}</metadata>", escape(recipe));
    }
    let _ = writeln!(out, "<rect width=\"{}\" height=\"{}\" fill=\"#ffffff\"/>", number(w), number(h));
    for (layer, name) in LAYERS {
        let _ = writeln!(out, "<g id=\"{name}\" inkscape:groupmode=\"layer\" inkscape:label=\"{name}\">");
        for item in page.items.iter().filter(|i| i.layer == layer) {
            let data: String = item.data.iter().map(|(k, v)| format!(" data-{k}=\"{}\"", escape(v))).collect();
            match &item.mark {
                Mark::Polygon { points, fill: [r, g, b] } => {
                    let points: Vec<String> = points
                        .iter()
                        .map(|&p| {
                            let (x, y) = flip(p);
                            format!("{x},{y}")
                        })
                        .collect();
                    // A hair of the same colour closes the seams that antialiasing leaves between neighbours.
                    let hair = match layer {
                        Layer::Print if [*r, *g, *b] != [255; 3] => {
                            format!(" stroke=\"#{r:02x}{g:02x}{b:02x}\" stroke-width=\"0.12\" stroke-linejoin=\"round\"")
                        }
                        _ => String::new(),
                    };
                    let _ = writeln!(out, "<polygon{data} points=\"{}\" fill=\"#{r:02x}{g:02x}{b:02x}\"{hair}/>", points.join(" "));
                }
                Mark::Line { points, closed, style } => {
                    let mut d = String::new();
                    for (k, &p) in points.iter().enumerate() {
                        let (x, y) = flip(p);
                        let _ = write!(d, "{}{x} {y}", if k == 0 { 'M' } else { 'L' });
                    }
                    let _ = writeln!(out, "<path{data} d=\"{d}{}\" {}/>", if *closed { "Z" } else { "" }, stroke(*style));
                }
                Mark::Image(image) => {
                    let (x, y) = flip(image.low + DVec2::new(0.0, image.size.y));
                    let (w, h) = (number(image.size.x), number(image.size.y));
                    let bytes = base64::engine::general_purpose::STANDARD.encode(&image.png);
                    let _ = writeln!(
                        out,
                        "<image{data} x=\"{x}\" y=\"{y}\" width=\"{w}\" height=\"{h}\" preserveAspectRatio=\"none\" \
                         xlink:href=\"data:image/png;base64,{bytes}\"/>"
                    );
                }
                Mark::Text { at, size, angle, text, colour: [r, g, b], anchor } => {
                    // The baseline lies .36 of the size below the middle of digits and capitals.
                    let base = *at - 0.36 * size * DVec2::from_angle(*angle).perp();
                    let (x, y) = flip(base);
                    let turn = if *angle == 0.0 {
                        String::new()
                    } else {
                        format!(" transform=\"rotate({} {x} {y})\"", number(-angle.to_degrees()))
                    };
                    let anchor = ["start", "middle", "end"][if *anchor < 0.25 { 0 } else { 1 + usize::from(*anchor > 0.75) }];
                    let _ = writeln!(
                        out,
                        "<text{data} x=\"{x}\" y=\"{y}\"{turn} font-family=\"{FONT}\" font-size=\"{}\" text-anchor=\"{anchor}\" fill=\"#{r:02x}{g:02x}{b:02x}\">{}</text>",
                        number(*size),
                        escape(text)
                    );
                }
            }
        }
        out.push_str("</g>\n");
    }
    out.push_str("</svg>\n");
    out
}
