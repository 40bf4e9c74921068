//! Pages: pieces with their colours, lines and numbers, and what every page says.

mod assembly;
mod back;
mod footer;
mod labels;
mod look;
mod page;
mod piece;
mod piece_image;
mod registration;
mod sheets;
mod strips;

pub use assembly::{assembly_page, order};
pub use footer::{BAR, footer};
pub use look::Look;
pub use page::{
    BLACK, BOLD_WIDTH, DECIMALS, GREY, HALO_WIDTH, Item, LAYERS, LINE_WIDTH, Layer, Mark, Page, PieceImage, Style, THIN_WIDTH, WHITE,
    number, srgb, text_width,
};
pub use registration::SILHOUETTE_INSET;
pub use sheets::{Sheets, sheets};
pub use strips::strip_pages;
