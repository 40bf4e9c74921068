//! Pages of SVG, as any program could read them: polygons with `data-facet`, lines with `data-angle`, closed paths in the layer `cut`.

use super::drawn::read_drawn;
use super::read_pattern::{ReadFacet, ReadFold, ReadPattern, ReadTab, signed_area};
use biscale::error::BadInput;
use glam::DVec2;
use roxmltree::{Document, Node};

/// Reads the pages of one pattern.
///
/// # Errors
/// Text that is no SVG of a pattern.
pub fn read_svg(pages: &[String]) -> Result<ReadPattern, BadInput> {
    let mut seen = ReadPattern::default();
    for (page, text) in pages.iter().enumerate() {
        read_page(&mut seen, page, text)?;
    }
    let dpi = seen.recipe.pointer("/sheet/svg_dpi").and_then(serde_json::Value::as_f64);
    seen.drawn = pages.iter().map(|text| read_drawn(text, dpi)).collect::<Result<_, _>>()?;
    if seen.facets.is_empty() && seen.strips.is_empty() {
        return Err(BadInput::new("there is no facet in the file", "name an SVG that `biscale fold` wrote"));
    }
    Ok(seen)
}

fn bad(node: Node<'_, '_>, what: &str) -> BadInput {
    let line = node.document().text_pos_at(node.range().start).row;
    BadInput::new(what.to_owned(), "write the pattern again").at_line(line as usize)
}

fn number(node: Node<'_, '_>, attribute: &str) -> Result<f64, BadInput> {
    let value = node.attribute(attribute).and_then(|v| v.parse::<f64>().ok()).filter(|v| v.is_finite());
    value.ok_or_else(|| bad(node, &format!("the attribute {attribute} is missing or no number")))
}

fn whole(node: Node<'_, '_>, attribute: &str) -> Result<u32, BadInput> {
    node.attribute(attribute).and_then(|p| p.parse().ok()).ok_or_else(|| bad(node, &format!("{attribute} is no whole number")))
}

fn read_page(seen: &mut ReadPattern, page: usize, text: &str) -> Result<(), BadInput> {
    let document =
        Document::parse(text).map_err(|e| BadInput::new(format!("this is no XML: {e}"), "name an SVG that `biscale fold` wrote"))?;
    let root = document.root_element();
    if root.tag_name().name() != "svg" {
        return Err(BadInput::new("this is no SVG", "name an SVG that `biscale fold` wrote"));
    }
    let size = view_box(root)?;
    seen.pages.push(size);
    let mut extent = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for node in root.descendants().filter(Node::is_element) {
        if node.tag_name().name() == "metadata" && seen.recipe.is_null() {
            let text = node.text().unwrap_or_default();
            seen.recipe = serde_json::from_str(text).map_err(|e| bad(node, &format!("the recipe is no JSON: {e}")))?;
        }
        // The back says the same again, but for numbers that are there alone.
        let clean = seen.recipe.pointer("/sheet/clean_front") == Some(&true.into());
        if node.has_attribute("data-back") && !(clean && node.tag_name().name() == "text") {
            continue;
        }
        if node.has_attribute("data-number-of") && node.tag_name().name() == "text" {
            let (edge, facet) = (whole(node, "data-number-of")?, whole(node, "data-on")?);
            // The piece before the colon is compared where the text is.
            let text = node.text().unwrap_or_default().trim();
            let number = text.rsplit_once(':').map_or(text, |(_, number)| number);
            seen.numbers.push((edge, facet, number.to_owned()));
        }
        let Some(points) = points(node)? else { continue };
        let points: Vec<DVec2> = points.into_iter().map(|p| DVec2::new(p.x, size.y - p.y)).collect();
        let half = node.attribute("stroke-width").and_then(|v| v.parse::<f64>().ok()).unwrap_or(0.0) / 2.0;
        for &p in &points {
            extent = [extent[0].min(p - half), extent[1].max(p + half)];
        }
        read_mark(seen, page, node, points)?;
    }
    seen.extents.push(extent);
    Ok(())
}

/// Width and height of the page.
fn view_box(root: Node<'_, '_>) -> Result<DVec2, BadInput> {
    let view: Vec<f64> = root.attribute("viewBox").unwrap_or_default().split_whitespace().filter_map(|v| v.parse().ok()).collect();
    let [x, y, w, h] = view[..] else { return Err(bad(root, "the viewBox is missing or not four numbers")) };
    if (x, y) != (0.0, 0.0) || !(w > 0.0 && h > 0.0 && w.is_finite() && h.is_finite()) {
        return Err(bad(root, "the viewBox does not start at 0 0 or has no size"));
    }
    Ok(DVec2::new(w, h))
}

/// The points of an element that draws something, y down.
fn points(node: Node<'_, '_>) -> Result<Option<Vec<DVec2>>, BadInput> {
    match node.tag_name().name() {
        "polygon" => pairs(node, node.attribute("points").unwrap_or_default()).map(Some),
        "image" => {
            let [x, y, w, h] = [number(node, "x")?, number(node, "y")?, number(node, "width")?, number(node, "height")?];
            Ok(Some(vec![DVec2::new(x, y), DVec2::new(x + w, y + h)]))
        }
        "path" => pairs(node, node.attribute("d").unwrap_or_default()).map(Some),
        _ => Ok(None),
    }
}

/// What an element is by its attributes; its points have y up.
fn read_mark(seen: &mut ReadPattern, page: usize, node: Node<'_, '_>, points: Vec<DVec2>) -> Result<(), BadInput> {
    if let Some(facet) = node.attribute("data-facet") {
        let facet = facet.parse().map_err(|_| bad(node, "data-facet is no whole number"))?;
        let piece = [whole(node, "data-piece")?, if node.has_attribute("data-copy") { whole(node, "data-copy")? } else { 1 }];
        seen.turned += usize::from(signed_area(&points) <= 0.0);
        seen.facets.push(ReadFacet { page, piece, facet, polygon: points });
    } else if let Some(strip) = node.attribute("data-strip") {
        if points.len() != 4 {
            return Err(bad(node, "a strip has not four corners"));
        }
        seen.strip_page.insert(strip.to_owned(), page);
        seen.strips.push((strip.to_owned(), points));
    } else if let (Some(of), Some(over)) = (node.attribute("data-of"), node.attribute("data-over")) {
        seen.crossings.push((of.to_owned(), over == "1", points));
    } else if node.has_attribute("data-tab-of") {
        seen.tabs.push(ReadTab { page, edge: whole(node, "data-tab-of")?, facet: whole(node, "data-on")?, polygon: points });
    } else if node.has_attribute("data-edge") {
        let angle = number(node, "data-angle")?.to_radians();
        let [a, b] = points[..] else { return Err(bad(node, "a fold line has not two points")) };
        seen.folds.push(ReadFold { page, ends: [a, b], edge: whole(node, "data-edge")?, angle });
    } else if node.has_attribute("data-loop") {
        if let Some(Ok(piece)) = node.attribute("data-piece").map(str::parse) {
            let copy = if node.has_attribute("data-copy") { whole(node, "data-copy")? } else { 1 };
            seen.cut_of.push(([piece, copy], points.clone()));
        }
        seen.outlines.push((page, points));
    }
    Ok(())
}

/// Pairs of numbers in a list of points or a path of M, L and Z.
fn pairs(node: Node<'_, '_>, text: &str) -> Result<Vec<DVec2>, BadInput> {
    let cleaned: String = text.chars().map(|c| if matches!(c, 'M' | 'L' | 'Z' | ',') { ' ' } else { c }).collect();
    let numbers: Option<Vec<f64>> = cleaned.split_whitespace().map(|t| t.parse::<f64>().ok().filter(|v| v.is_finite())).collect();
    let numbers = numbers.ok_or_else(|| bad(node, "a coordinate is no number"))?;
    if numbers.len() % 2 == 1 {
        return Err(bad(node, "a coordinate is missing"));
    }
    Ok(numbers.chunks_exact(2).map(|p| DVec2::new(p[0], p[1])).collect())
}
