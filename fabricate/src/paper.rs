//! The paper: its size, its border, and what is left for pieces.

use biscale::error::BadInput;
use glam::DVec2;

/// The paper.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paper {
    /// Name as the user gives it.
    pub name: &'static str,
    /// Width and height of a page, mm; the height of a roll is what is needed.
    pub size: DVec2,
    /// Whether the height is what is needed.
    pub roll: bool,
    /// Nothing is drawn this near to the border, mm.
    pub margin: f64,
    /// Taken from the area of the pieces on each side by registration marks, mm.
    pub inset: f64,
}

/// Height of the strip below the pieces with the scale bar and the legend, mm: its lines stand at 2, 5.6, 9.4 and 13.2 mm.
pub const FOOTER: f64 = 16.0;

/// How far colour reaches over an edge that is cut, and onto a tab, mm. Chosen, not measured: printers and scissors are off by less.
pub const BLEED: f64 = 1.0;

/// What colours and lines take beyond the outlines, mm: at a right corner [`BLEED`] to both sides, 1.41, and half of a line.
pub const BLEED_ROOM: f64 = 1.5;

impl Paper {
    /// Lower left corner and size of the area for pieces, mm, y upwards; of a roll its height is 2 m.
    pub fn area(&self) -> [DVec2; 2] {
        let border = DVec2::splat(self.margin + self.inset + BLEED_ROOM);
        [border + DVec2::new(0.0, FOOTER), self.size - 2.0 * border - DVec2::new(0.0, FOOTER)]
    }

    /// Checks that something can be laid on it.
    ///
    /// # Errors
    /// A margin that leaves less than 20 mm, or less than the scale bar's 100 mm across.
    pub fn check(&self) -> Result<(), BadInput> {
        let [_, size] = self.area();
        if size.min_element() < 20.0 || self.size.x - 2.0 * self.margin < 110.0 {
            let problem =
                format!("the page of {} x {} mm with its margin leaves {:.0} x {:.0} mm", self.size.x, self.size.y, size.x, size.y);
            return Err(
                BadInput::new(problem, "take a larger page or a smaller margin: 110 mm across and 20 mm up are needed").at_field("page")
            );
        }
        Ok(())
    }
}
