//! What a page of SVG shows: every mark as it is drawn, in mm, with transforms, styles and visibility resolved.
//!
//! Other readers of the file (printers, cutters) do not look at attributes with the prefix `data-`: this is what they see. The attributes come
//! along as what the mark claims to be.

use biscale::error::BadInput;
use glam::DVec2;
use resvg::usvg::{self, Node, Paint, Tree, tiny_skia_path::PathSegment};
use roxmltree::Document;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Marks on a page from below, mm, y up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrawnPage {
    /// Width and height as the file says them, mm.
    pub size: DVec2,
    /// The marks, each over those before it.
    pub marks: Vec<Drawn>,
    /// What no plain page has: masks, filters, curves, transparency.
    pub odd: Vec<String>,
}

/// A mark that can be seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// The group that it is in: `print`, `score`, `cut`, `registration`; empty outside of all.
    pub layer: String,
    /// Its attributes with the prefix `data-`, without it.
    pub data: BTreeMap<String, String>,
    /// What is seen.
    pub shape: Shape,
}

/// What is seen of a mark.
#[derive(Clone, Debug, PartialEq)]
pub enum Shape {
    /// A filled polygon, perhaps with a line around it.
    Fill {
        /// The corners.
        polygon: Vec<DVec2>,
        /// sRGB.
        colour: [u8; 3],
        /// The line around it.
        line: Option<Look>,
    },
    /// Lines.
    Line {
        /// The points of each, and whether it is closed.
        paths: Vec<(Vec<DVec2>, bool)>,
        /// Its look.
        look: Look,
    },
    /// A text.
    Text {
        /// Its words.
        words: String,
        /// Size of its type, mm; the least where there are several.
        size: f64,
        /// sRGB.
        colour: [u8; 3],
        /// Whether a line stands under it.
        underlined: bool,
        /// Its box.
        corners: [DVec2; 4],
    },
    /// Dots.
    Image {
        /// The corners of the picture.
        corners: [DVec2; 4],
        /// The file.
        png: Arc<Vec<u8>>,
    },
}

/// How a line is drawn, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct Look {
    /// sRGB.
    pub colour: [u8; 3],
    /// Width, mm.
    pub width: f64,
    /// Lengths of dashes and gaps, mm; none of a whole line.
    pub dashes: Vec<f64>,
}

impl Drawn {
    /// An attribute.
    pub fn get(&self, name: &str) -> Option<&str> {
        self.data.get(name).map(String::as_str)
    }

    /// All points of the mark.
    pub fn points(&self) -> Vec<DVec2> {
        match &self.shape {
            Shape::Fill { polygon, .. } => polygon.clone(),
            Shape::Line { paths, .. } => paths.iter().flat_map(|(p, _)| p.iter().copied()).collect(),
            Shape::Text { corners, .. } | Shape::Image { corners, .. } => corners.to_vec(),
        }
    }

    /// Half the width of the line around or along the mark, mm.
    pub fn half_width(&self) -> f64 {
        match &self.shape {
            Shape::Fill { line: Some(look), .. } | Shape::Line { look, .. } => 0.5 * look.width,
            _ => 0.0,
        }
    }
}

/// Pixels to the inch at which a millimetre is a unit.
const MM_DPI: f32 = 25.4;

/// Pixels to the inch of CSS, where nothing else is said.
const CSS_DPI: f64 = 96.0;

/// Whether the page says its size in lengths, and not in pixels or not at all.
fn has_unit(text: &str) -> bool {
    let length =
        |value: Option<&str>| value.is_some_and(|v| ["mm", "cm", "in", "pt", "pc", "Q"].iter().any(|unit| v.trim().ends_with(unit)));
    Document::parse(text).is_ok_and(|d| length(d.root_element().attribute("width")) && length(d.root_element().attribute("height")))
}

/// Names of the layers.
const LAYERS: [&str; 4] = ["print", "score", "cut", "registration"];

/// Reads what a page shows; `dpi` if its size is in pixels at so many to the inch.
///
/// # Errors
/// Text that is no SVG.
pub fn read_drawn(text: &str, dpi: Option<f64>) -> Result<DrawnPage, BadInput> {
    let (named, data) = with_names(text)?;
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    let options = usvg::Options { fontdb: Arc::new(fonts), font_family: "DejaVu Sans".to_owned(), dpi: MM_DPI, ..usvg::Options::default() };
    let tree = Tree::from_str(&named, &options)
        .map_err(|e| BadInput::new(format!("this is no SVG: {e}"), "name an SVG that `biscale fold` wrote"))?;
    // Units of the tree to mm: a size without a unit counts pixels, of which CSS has 96 to the inch.
    let unit = dpi.map_or_else(|| if has_unit(text) { 1.0 } else { 25.4 / CSS_DPI }, |dpi| 25.4 / dpi);
    let size = DVec2::new(f64::from(tree.size().width()), f64::from(tree.size().height())) * unit;
    let mut reader = Reader { data, unit, page: DrawnPage { size, ..DrawnPage::default() } };
    reader.group(tree.root(), "");
    Ok(reader.page)
}

/// The `data-` attributes of elements, by `id`.
type Attributes = FxHashMap<String, BTreeMap<String, String>>;

/// The text with an `id` on every element that has none, and the `data-` attributes by id.
fn with_names(text: &str) -> Result<(String, Attributes), BadInput> {
    let document =
        Document::parse(text).map_err(|e| BadInput::new(format!("this is no XML: {e}"), "name an SVG that `biscale fold` wrote"))?;
    let mut named = String::with_capacity(text.len() * 2);
    let mut data = FxHashMap::default();
    let mut done = 0;
    for (k, node) in document.descendants().filter(roxmltree::Node::is_element).enumerate() {
        let id = node.attribute("id").map_or_else(|| format!("mark-{k}"), str::to_owned);
        let own: BTreeMap<String, String> =
            node.attributes().filter_map(|a| Some((a.name().strip_prefix("data-")?.to_owned(), a.value().to_owned()))).collect();
        if node.attribute("id").is_none() {
            let start = node.range().start;
            let tag = text[start + 1..].find(|c: char| c.is_whitespace() || c == '>' || c == '/').unwrap_or(0);
            named.push_str(&text[done..start + 1 + tag]);
            named.push_str(&format!(" id=\"{id}\""));
            done = start + 1 + tag;
        }
        data.insert(id, own);
    }
    named.push_str(&text[done..]);
    Ok((named, data))
}

struct Reader {
    data: Attributes,
    unit: f64,
    page: DrawnPage,
}

impl Reader {
    fn group(&mut self, group: &usvg::Group, layer: &str) {
        let layer = if LAYERS.contains(&group.id()) { group.id() } else { layer };
        if group.opacity().get() < 1.0 {
            self.page.odd.push(format!("a group of the layer \"{layer}\" is transparent"));
        }
        if group.clip_path().is_some()
            || group.mask().is_some()
            || !group.filters().is_empty()
            || group.blend_mode() != usvg::BlendMode::Normal
        {
            self.page.odd.push(format!("a group of the layer \"{layer}\" is clipped, masked, filtered or blended"));
        }
        for child in group.children() {
            match child {
                Node::Group(inner) => self.group(inner, layer),
                Node::Path(path) => self.path(path, layer),
                Node::Text(text) => self.text(text, layer),
                Node::Image(image) => self.image(image, group.id(), layer),
            }
        }
    }

    /// A point of the tree on the page.
    fn place(&self, transform: usvg::Transform, x: f32, y: f32) -> DVec2 {
        let [x, y] = [x, y].map(f64::from);
        let t = [transform.sx, transform.kx, transform.tx, transform.ky, transform.sy, transform.ty].map(f64::from);
        let p = DVec2::new(t[0] * x + t[1] * y + t[2], t[3] * x + t[4] * y + t[5]) * self.unit;
        DVec2::new(p.x, self.page.size.y - p.y)
    }

    fn corners(&self, transform: usvg::Transform, r: usvg::Rect) -> [DVec2; 4] {
        [(r.left(), r.bottom()), (r.right(), r.bottom()), (r.right(), r.top()), (r.left(), r.top())]
            .map(|(x, y)| self.place(transform, x, y))
    }

    fn push(&mut self, id: &str, layer: &str, shape: Shape) {
        let data = self.data.get(id).cloned().unwrap_or_default();
        self.page.marks.push(Drawn { layer: layer.to_owned(), data, shape });
    }

    /// The colour of a paint that covers, if it does.
    fn colour(&mut self, paint: &Paint, opacity: f32) -> Option<[u8; 3]> {
        match paint {
            Paint::Color(c) if opacity >= 1.0 => Some([c.red, c.green, c.blue]),
            Paint::Color(_) if opacity <= 0.0 => None,
            Paint::Color(_) => {
                self.page.odd.push("a mark is transparent".to_owned());
                None
            }
            _ => {
                self.page.odd.push("a mark has a gradient or a pattern".to_owned());
                None
            }
        }
    }

    fn look(&mut self, stroke: Option<&usvg::Stroke>, transform: usvg::Transform) -> Option<Look> {
        let stroke = stroke?;
        let colour = self.colour(stroke.paint(), stroke.opacity().get())?;
        let (x, y) = transform.get_scale();
        let scale = f64::from(x * y).abs().sqrt() * self.unit;
        let dashes = stroke.dasharray().unwrap_or_default().iter().map(|&d| f64::from(d) * scale).collect();
        Some(Look { colour, width: f64::from(stroke.width().get()) * scale, dashes })
    }

    fn path(&mut self, path: &usvg::Path, layer: &str) {
        if !path.is_visible() {
            return;
        }
        let transform = path.abs_transform();
        let mut paths: Vec<(Vec<DVec2>, bool)> = Vec::new();
        for segment in path.data().segments() {
            let mut add = |x: f32, y: f32| {
                let p = self.place(transform, x, y);
                if let Some((points, _)) = paths.last_mut() {
                    points.push(p);
                }
            };
            match segment {
                PathSegment::MoveTo(p) => paths.push((vec![self.place(transform, p.x, p.y)], false)),
                PathSegment::LineTo(p) => add(p.x, p.y),
                PathSegment::QuadTo(_, p) | PathSegment::CubicTo(_, _, p) => {
                    add(p.x, p.y);
                    self.page.odd.push("a line is curved".to_owned());
                }
                PathSegment::Close => {
                    if let Some(last) = paths.last_mut() {
                        last.1 = true;
                    }
                }
            }
        }
        let fill = path.fill().and_then(|f| self.colour(f.paint(), f.opacity().get()));
        let line = self.look(path.stroke(), transform);
        match (fill, line) {
            (Some(colour), line) => {
                let polygon = paths.into_iter().flat_map(|(p, _)| p).collect();
                self.push(path.id(), layer, Shape::Fill { polygon, colour, line });
            }
            (None, Some(look)) => self.push(path.id(), layer, Shape::Line { paths, look }),
            (None, None) => {}
        }
    }

    fn text(&mut self, text: &usvg::Text, layer: &str) {
        let transform = text.abs_transform();
        let mut words = String::new();
        let mut spans = Vec::new();
        for chunk in text.chunks() {
            words.push_str(chunk.text());
            spans.extend(chunk.spans());
        }
        let Some(span) = spans.first().filter(|_| spans.iter().all(|s| s.is_visible())) else { return };
        let Some(colour) = span.fill().and_then(|f| self.colour(f.paint(), f.opacity().get())) else { return };
        let (x, y) = transform.get_scale();
        let size =
            spans.iter().map(|s| f64::from(s.font_size().get())).fold(f64::INFINITY, f64::min) * f64::from(x * y).abs().sqrt() * self.unit;
        if transform.sx * transform.sy - transform.kx * transform.ky <= 0.0 {
            self.page.odd.push(format!("the text \"{words}\" is mirrored"));
        }
        let corners = self.corners(transform, text.bounding_box());
        let underlined = span.decoration().underline().is_some();
        self.push(text.id(), layer, Shape::Text { words: words.trim().to_owned(), size, colour, underlined, corners });
    }

    /// A picture; the tree gives its name to the group around it.
    fn image(&mut self, image: &usvg::Image, around: &str, layer: &str) {
        if !image.is_visible() {
            return;
        }
        let usvg::ImageKind::PNG(png) = image.kind() else {
            self.page.odd.push("a picture is no PNG".to_owned());
            return;
        };
        let s = image.size();
        let Some(own) = usvg::Rect::from_xywh(0.0, 0.0, s.width(), s.height()) else { return };
        let corners = self.corners(image.abs_transform(), own);
        let png = png.clone();
        let id = if image.id().is_empty() { around } else { image.id() };
        self.push(id, layer, Shape::Image { corners, png });
    }
}
