//! A page as SVG: one user unit is 1 mm, layers are groups that Inkscape and cutters know.

use crate::drawing::{
    BOLD_WIDTH, DECIMALS, HALO_WIDTH, Item, LAYERS, LINE_WIDTH, Layer, Mark, Page, PieceImage, Style, THIN_WIDTH, WHITE, number,
};
use biscale::formats::svg::{Element, NAMESPACE, SvgWriter, hex, path_data, png_url, polygon_points};
use glam::DVec2;

/// The first comment of every SVG of this program: how an output is recognised.
pub const MARK: &str = "made by biscale fold";

/// Names of fonts in the order of choice; the first is embedded in PDF and PNG.
const FONT: &str = "'DejaVu Sans', Verdana, Arial, sans-serif";

/// How far the baseline of a text lies below the middle of its digits and capitals, of its size: half of the .73 that `DejaVu` Sans' capitals
/// are high.
const BASELINE: f64 = 0.36;

/// Width of the line in a polygon's own colour that closes the seams which antialiasing leaves between neighbours, mm. Chosen, not
/// measured: half of a dot of a 100 dpi preview.
const SEAM_WIDTH: &str = "0.12";

/// The page as an SVG document. `dpi` scales `width` and `height` to pixels for programs that do not know mm; `recipe` is JSON that
/// a reader finds in `<metadata>`.
pub fn document(page: &Page, dpi: Option<f64>, recipe: &str) -> String {
    let mut svg = SvgWriter::new();
    let (w, h) = (number(page.size.x), number(page.size.y));
    let (width, height) = match dpi {
        None => (format!("{w}mm"), format!("{h}mm")),
        Some(dpi) => (number(page.size.x / 25.4 * dpi), number(page.size.y / 25.4 * dpi)),
    };
    svg.element("svg")
        .attribute("xmlns", NAMESPACE)
        .attribute("xmlns:inkscape", "http://www.inkscape.org/namespaces/inkscape")
        .attribute("xmlns:xlink", "http://www.w3.org/1999/xlink")
        .attribute("width", width)
        .attribute("height", height)
        .attribute("viewBox", format_args!("0 0 {w} {h}"))
        .open();
    svg.comment(MARK);
    if !recipe.is_empty() {
        svg.element("metadata").text(recipe);
    }
    svg.element("rect").attribute("width", w).attribute("height", h).attribute("fill", "#ffffff").close();
    for (layer, name) in LAYERS {
        svg.element("g").attribute("id", name).attribute("inkscape:groupmode", "layer").attribute("inkscape:label", name).open();
        for item in page.items.iter().filter(|i| i.layer == layer) {
            write_item(&mut svg, item, page.size.y);
        }
        svg.end();
    }
    svg.finish()
}

/// One mark of a page of a height: y points down in SVG.
fn write_item(svg: &mut SvgWriter, item: &Item, height: f64) {
    let flip = |p: DVec2| [p.x, height - p.y];
    let begin = |svg, name| begin(svg, name, &item.data);
    match &item.mark {
        Mark::Polygon { points, fill } => {
            let seam = (item.layer == Layer::Print && *fill != WHITE).then_some(*fill);
            let polygon = begin(svg, "polygon")
                .attribute("points", polygon_points(points.iter().map(|&p| flip(p)), DECIMALS))
                .attribute("fill", hex(*fill));
            match seam {
                Some(colour) => stroked(polygon, &hex(colour), SEAM_WIDTH, "").close(),
                None => polygon.close(),
            }
        }
        Mark::Line { points, closed, style } => {
            let path = begin(svg, "path").attribute("d", path_data(points.iter().map(|&p| flip(p)), *closed, DECIMALS));
            styled(path.attribute("fill", "none"), *style).close();
        }
        Mark::Image(image) => write_image(begin(svg, "image"), image, flip(image.low + DVec2::new(0.0, image.size.y))),
        Mark::Text { at, size, angle, text, colour, anchor, underlined } => {
            let [x, y] = flip(*at - BASELINE * size * DVec2::from_angle(*angle).perp()).map(number);
            let turn = (*angle != 0.0).then(|| format!("rotate({} {x} {y})", number(-angle.to_degrees())));
            let anchor = ["start", "middle", "end"][if *anchor < 0.25 { 0 } else { 1 + usize::from(*anchor > 0.75) }];
            begin(svg, "text")
                .attribute("x", &x)
                .attribute("y", &y)
                .optional("transform", turn)
                .attribute("font-family", FONT)
                .attribute("font-size", number(*size))
                .attribute("text-anchor", anchor)
                .attribute("fill", hex(*colour))
                .optional("text-decoration", underlined.then_some("underline"))
                .text(text);
        }
    }
}

/// Begins an element with what a reader wants to know of the mark.
fn begin<'w>(svg: &'w mut SvgWriter, name: &'static str, data: &[(&'static str, String)]) -> Element<'w> {
    data.iter().fold(svg.element(name), |element, (key, value)| element.attribute(&format!("data-{key}"), value))
}

fn write_image(element: Element<'_>, image: &PieceImage, upper_left: [f64; 2]) {
    let [x, y] = upper_left.map(number);
    element
        .attribute("x", x)
        .attribute("y", y)
        .attribute("width", number(image.size.x))
        .attribute("height", number(image.size.y))
        .attribute("preserveAspectRatio", "none")
        .attribute("xlink:href", png_url(&image.png))
        .close();
}

/// Adds the attributes of a line's style.
fn styled(element: Element<'_>, style: Style) -> Element<'_> {
    let (colour, width, dashes) = match style {
        Style::Hidden => return element.attribute("stroke", "none"),
        Style::Cut => ("#000000", LINE_WIDTH, ""),
        Style::Mountain => ("#c03030", LINE_WIDTH, "3 0.9 0.5 0.9"),
        Style::Valley => ("#3050c0", LINE_WIDTH, "1.6 1.1"),
        Style::Halo => ("#ffffff", HALO_WIDTH, ""),
        Style::CutHalo => ("#ffffff", HALO_WIDTH, "0.6 1.8"),
        Style::Thin => ("#808080", THIN_WIDTH, ""),
        Style::Bold => ("#000000", BOLD_WIDTH, ""),
    };
    stroked(element, colour, &width.to_string(), dashes)
}

fn stroked<'w>(element: Element<'w>, colour: &str, width: &str, dashes: &str) -> Element<'w> {
    element
        .attribute("stroke", colour)
        .attribute("stroke-width", width)
        .attribute("stroke-linejoin", "round")
        .optional("stroke-dasharray", (!dashes.is_empty()).then_some(dashes))
}
