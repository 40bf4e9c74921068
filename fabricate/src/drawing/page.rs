//! Pages as lists of marks in mm: the one model that all printable outputs are written from.
//!
//! y points up and the origin is the page's lower left corner; writers of formats with y down turn it.

use biscale::formats::svg::decimal;
use biscale::numerics::colour::srgb_byte;
use glam::DVec2;

/// What a mark is for; machines that cut read some layers and not others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Layer {
    /// Colours and texts.
    Print,
    /// Lines to cut.
    Cut,
    /// Lines to fold.
    Score,
    /// Marks that a machine or a camera looks for.
    Registration,
}

/// The layers, from below.
pub const LAYERS: [(Layer, &str); 4] =
    [(Layer::Print, "print"), (Layer::Score, "score"), (Layer::Cut, "cut"), (Layer::Registration, "registration")];

/// How a line looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// To be cut: black.
    Cut,
    /// Mountain fold: dash and dot.
    Mountain,
    /// Valley fold: dashes.
    Valley,
    /// White under a fold line on dark colours.
    Halo,
    /// White dashes under a cut line there.
    CutHalo,
    /// An edge that is flat to the eye: not drawn, there for readers.
    Hidden,
    /// A line of a picture, grey.
    Thin,
    /// A registration mark, black.
    Bold,
}

/// One mark.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A filled polygon.
    Polygon {
        /// Corners.
        points: Vec<DVec2>,
        /// sRGB.
        fill: [u8; 3],
    },
    /// A line through points.
    Line {
        /// The points.
        points: Vec<DVec2>,
        /// Whether it returns to the first point.
        closed: bool,
        /// Its look and meaning.
        style: Style,
    },
    /// The colours of a piece, as dots.
    Image(PieceImage),
    /// A text whose middle lies at a point.
    Text {
        /// The middle.
        at: DVec2,
        /// Height of a capital letter is .73 of this, mm.
        size: f64,
        /// Direction of the line of text, radians.
        angle: f64,
        /// The text.
        text: String,
        /// sRGB.
        colour: [u8; 3],
        /// Where `at` lies: 0 the start, 0.5 the middle, 1 the end.
        anchor: f64,
        /// Whether a line stands under it: of numbers that read as others upside down.
        underlined: bool,
    },
}

/// Dots over a rectangle.
#[derive(Clone, Debug, PartialEq)]
pub struct PieceImage {
    /// Lower left corner, mm.
    pub low: DVec2,
    /// Width and height, mm.
    pub size: DVec2,
    /// The dots as a PNG file; where the piece is not they are transparent.
    pub png: Vec<u8>,
}

/// A mark in its layer, with what a reader wants to know of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// The layer.
    pub layer: Layer,
    /// The mark.
    pub mark: Mark,
    /// Attributes, such as `("facet", "12")`; SVG writes them as `data-facet="12"`.
    pub data: Vec<(&'static str, String)>,
}

/// A page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Page {
    /// Width and height, mm.
    pub size: DVec2,
    /// What is on it; later marks of a layer lie on earlier ones.
    pub items: Vec<Item>,
}

/// Black.
pub const BLACK: [u8; 3] = [0; 3];

/// White.
pub const WHITE: [u8; 3] = [255; 3];
/// Grey of small texts.
pub const GREY: [u8; 3] = [110; 3];

/// Width of lines that are cut or folded, mm. Chosen, not measured: two dots at 300 dpi are .17.
pub const LINE_WIDTH: f64 = 0.2;

/// Width of a line of a picture, mm: thinner than what is cut. Chosen, not measured.
pub const THIN_WIDTH: f64 = 0.15;
/// Width of a registration mark, mm: twice that of a line. Chosen, not measured.
pub const BOLD_WIDTH: f64 = 0.4;
/// Width of the white under lines on dark colours, mm: .1 on both sides.
pub const HALO_WIDTH: f64 = 0.4;

impl Page {
    /// Adds a mark without attributes.
    pub fn add(&mut self, layer: Layer, mark: Mark) {
        self.items.push(Item { layer, mark, data: Vec::new() });
    }

    /// Adds a line.
    pub fn line(&mut self, layer: Layer, style: Style, points: &[DVec2], closed: bool) {
        self.add(layer, Mark::Line { points: points.to_vec(), closed, style });
    }

    /// Adds a filled polygon to the print layer.
    pub fn polygon(&mut self, points: &[DVec2], fill: [u8; 3]) {
        self.add(Layer::Print, Mark::Polygon { points: points.to_vec(), fill });
    }

    /// Adds a horizontal text that starts at a point of its middle line.
    pub fn text(&mut self, at: DVec2, size: f64, text: impl Into<String>) {
        self.add(Layer::Print, Mark::Text { at, size, angle: 0.0, text: text.into(), colour: BLACK, anchor: 0.0, underlined: false });
    }
}

/// Width of a text, mm, about: `DejaVu` Sans has digits of .636 and letters of .6 of its size.
pub fn text_width(text: &str, size: f64) -> f64 {
    0.65 * size * text.chars().count() as f64
}

/// Linear light as sRGB bytes.
pub fn srgb(linear: [f64; 3]) -> [u8; 3] {
    linear.map(srgb_byte)
}

/// Decimals of coordinates, mm: a refolded surface adds up the rounding of many, and is compared to 1e-4 mm.
pub const DECIMALS: usize = 8;

/// A number as the files have it, with up to [`DECIMALS`] decimals.
pub fn number(x: f64) -> String {
    decimal(x, DECIMALS)
}
