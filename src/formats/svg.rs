//! SVG as text: elements with escaped attributes, streamed into one string.
//!
//! The writer knows XML and nothing of what is drawn: a drawing of paper and a plot call the same few methods. It cannot write markup that
//! is not well formed: names are part of the program, every value and every text is escaped, and what was opened is closed.
//!
//! ```
//! use biscale::formats::svg::{NAMESPACE, SvgWriter};
//!
//! let mut svg = SvgWriter::new();
//! svg.element("svg").attribute("xmlns", NAMESPACE).attribute("viewBox", "0 0 9 9").open();
//! svg.element("text").attribute("x", 4.5).text("3 < 4");
//! assert_eq!(svg.finish(), "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\">\n<text x=\"4.5\">3 &lt; 4</text>\n</svg>\n");
//! ```

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::fmt::{Display, Write};

/// The namespace of SVG, for the `xmlns` of a file's root.
pub const NAMESPACE: &str = "http://www.w3.org/2000/svg";

/// An SVG in the making; one element a line.
#[derive(Clone, Debug, Default)]
pub struct SvgWriter {
    out: String,
    /// Names of the elements that are open, the outermost first.
    open: Vec<&'static str>,
}

/// An element whose attributes are being written; it ends with one of [`Element::close`], [`Element::text`], [`Element::child`],
/// [`Element::open`].
#[must_use = "an element must be closed or opened"]
#[derive(Debug)]
pub struct Element<'w> {
    writer: &'w mut SvgWriter,
    name: &'static str,
}

impl SvgWriter {
    /// Nothing yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Begins an element.
    pub fn element(&mut self, name: &'static str) -> Element<'_> {
        self.out.push('<');
        self.out.push_str(name);
        Element { writer: self, name }
    }

    /// Adds a comment; it must not hold `--`.
    pub fn comment(&mut self, text: &'static str) {
        debug_assert!(!text.contains("--"), "{text}");
        let _ = writeln!(self.out, "<!-- {text} -->");
    }

    /// Ends the innermost element that is open.
    pub fn end(&mut self) {
        let name = self.open.pop();
        debug_assert!(name.is_some(), "no element is open");
        let _ = writeln!(self.out, "</{}>", name.unwrap_or_default());
    }

    /// Ends all elements that are open; the text.
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.end();
        }
        self.out
    }
}

impl Element<'_> {
    /// Adds an attribute.
    pub fn attribute(self, name: &str, value: impl Display) -> Self {
        let out = &mut self.writer.out;
        let _ = write!(out, " {name}=\"");
        let _ = write!(Escaping(out), "{value}");
        out.push('"');
        self
    }

    /// Adds an attribute if it has a value.
    pub fn optional(self, name: &str, value: Option<impl Display>) -> Self {
        match value {
            Some(value) => self.attribute(name, value),
            None => self,
        }
    }

    /// Ends an element without content.
    pub fn close(self) {
        self.writer.out.push_str("/>\n");
    }

    /// Ends an element whose content is a text.
    pub fn text(self, text: &str) {
        let out = &mut self.writer.out;
        out.push('>');
        let _ = Escaping(out).write_str(text);
        let _ = writeln!(out, "</{}>", self.name);
    }

    /// Ends an element whose content is one element on the same line, which `write` begins and closes.
    pub fn child(self, write: impl FnOnce(&mut SvgWriter)) {
        self.writer.out.push('>');
        write(self.writer);
        debug_assert!(self.writer.out.ends_with('\n'), "the child is not closed");
        self.writer.out.pop();
        let _ = writeln!(self.writer.out, "</{}>", self.name);
    }

    /// Opens the element: what follows is inside of it until [`SvgWriter::end`].
    pub fn open(self) {
        self.writer.out.push_str(">\n");
        self.writer.open.push(self.name);
    }
}

/// Writes into a text of XML.
struct Escaping<'s>(&'s mut String);

impl Write for Escaping<'_> {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        for c in text.chars() {
            match c {
                '&' => self.0.push_str("&amp;"),
                '<' => self.0.push_str("&lt;"),
                '>' => self.0.push_str("&gt;"),
                '"' => self.0.push_str("&quot;"),
                // XML 1.0 has no place for other control characters, not even escaped (section 2.2).
                c if c.is_control() => self.0.push(' '),
                c => self.0.push(c),
            }
        }
        Ok(())
    }
}

/// A number with up to so many decimals, as short as possible; never `-0`.
pub fn decimal(x: f64, decimals: usize) -> String {
    let text = format!("{x:.decimals$}");
    let text = if decimals == 0 { &text } else { text.trim_end_matches('0').trim_end_matches('.') };
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// The attribute `points` of a polygon, coordinates with up to so many decimals.
pub fn polygon_points(points: impl IntoIterator<Item = [f64; 2]>, decimals: usize) -> String {
    let points: Vec<String> = points.into_iter().map(|[x, y]| format!("{},{}", decimal(x, decimals), decimal(y, decimals))).collect();
    points.join(" ")
}

/// The attribute `d` of a path of straight lines, coordinates with up to so many decimals.
pub fn path_data(points: impl IntoIterator<Item = [f64; 2]>, closed: bool, decimals: usize) -> String {
    let mut out = String::new();
    for (k, [x, y]) in points.into_iter().enumerate() {
        let command = if k == 0 { 'M' } else { 'L' };
        let _ = write!(out, "{command}{} {}", decimal(x, decimals), decimal(y, decimals));
    }
    if closed {
        out.push('Z');
    }
    out
}

/// An sRGB colour as `#rrggbb`.
pub fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The address under which a PNG file stands within a text.
pub fn png_url(png: &[u8]) -> String {
    format!("data:image/png;base64,{}", STANDARD.encode(png))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_nest_and_all_of_them_are_closed() {
        let mut svg = SvgWriter::new();
        svg.element("svg").open();
        svg.comment("by a test");
        svg.element("g").attribute("id", "a").open();
        svg.element("clipPath").attribute("id", "c").child(|svg| svg.element("path").attribute("d", "M0 0").close());
        svg.element("rect").optional("x", Some(1)).optional("y", None::<f64>).close();
        let text = svg.finish();
        let lines = [
            "<svg>",
            "<!-- by a test -->",
            "<g id=\"a\">",
            "<clipPath id=\"c\"><path d=\"M0 0\"/></clipPath>",
            "<rect x=\"1\"/>",
            "</g>",
            "</svg>",
        ];
        assert_eq!(text, lines.join("\n") + "\n");
    }

    #[test]
    fn texts_and_values_cannot_break_the_markup() {
        let mut svg = SvgWriter::new();
        svg.element("text").attribute("data-name", "a\" onload=\"<&").text("<&\"\u{0}\u{1b}>溝");
        assert_eq!(svg.finish(), "<text data-name=\"a&quot; onload=&quot;&lt;&amp;\">&lt;&amp;&quot;  &gt;溝</text>\n");
    }

    #[test]
    fn numbers_are_as_short_as_their_decimals_allow() {
        for (x, decimals, text) in
            [(1.0, 2, "1"), (-0.001, 2, "0"), (0.126, 2, "0.13"), (100.0, 0, "100"), (-0.4, 0, "0"), (1e-8, 8, "0.00000001")]
        {
            assert_eq!(decimal(x, decimals), text);
        }
        assert_eq!(polygon_points([[0.5, 1.0], [2.0, 3.25]], 1), "0.5,1 2,3.2");
        assert_eq!(path_data([[0.5, 1.0], [2.0, 3.0]], true, 1), "M0.5 1L2 3Z");
        assert_eq!((hex([255, 0, 10]).as_str(), png_url(b"foob").as_str()), ("#ff000a", "data:image/png;base64,Zm9vYg=="));
    }
}
