//! The SVG of a page as a tree, for the formats that are drawn from it.

use super::svg;
use crate::drawing::Page;
use biscale::error::{Error, Result};
use resvg::usvg;
use std::sync::Arc;

pub(super) fn failed(e: &dyn std::fmt::Display) -> Error {
    Error::Numeric(format!("cannot draw the page: {e}; please report this"))
}

/// The page as a tree, with the embedded font only: the same on every machine.
pub(super) fn tree(page: &Page, fonts: &Arc<usvg::fontdb::Database>) -> Result<usvg::Tree> {
    // At 25.4 dots an inch one mm is one pixel of the tree.
    let options = usvg::Options { fontdb: fonts.clone(), font_family: "DejaVu Sans".to_owned(), dpi: 25.4, ..usvg::Options::default() };
    usvg::Tree::from_str(&svg::document(page, None, ""), &options).map_err(|e| failed(&e))
}

pub(super) fn fonts() -> Arc<usvg::fontdb::Database> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    Arc::new(fonts)
}
