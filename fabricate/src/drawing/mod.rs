//! Pages: pieces with their colours, lines and numbers, and what every page says.

mod assembly;
mod assembly_view;
mod back;
mod cutter;
mod footer;
mod labels;
mod look;
mod page;
mod piece;
mod piece_image;
mod registration;
mod sheets;
mod strips;

pub use assembly::{assembly_pages, order};
pub use cutter::{only, perforated};
pub use footer::{BAR, Footer, footer};
pub use look::Look;
pub use page::{
    BLACK, BOLD_WIDTH, DECIMALS, GREY, HALO_WIDTH, Item, LAYERS, LINE_WIDTH, Layer, Mark, Page, PieceImage, Style, THIN_WIDTH, WHITE,
    number, srgb, text_width,
};
pub use registration::SILHOUETTE_INSET;
pub use sheets::{Sheets, sheets};
pub use strips::strip_pages;
