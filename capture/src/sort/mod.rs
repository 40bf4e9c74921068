//! A folder of photographs as a phone leaves it, sorted into a shoot file by what is in them.
//!
//! ```text
//! folder -> files that are photographs, each once -> what each shows -> roles -> shoot file, or what is missing and how to take it
//! ```

mod folder;
mod look;
mod missing;
mod roles;
mod shoot_text;
mod sorted;

pub use folder::{Gathered, gather};
pub use look::{Seen, SheetView, Subject};
pub use missing::Missing;
pub use roles::{Ball, Roles, View};
pub use sorted::Sorted;

use crate::kit::Kit;
use biscale::error::Result;
use biscale::filter::Control;
use std::path::Path;

/// Sorts the photographs of a folder.
///
/// What cannot be used is told in [`Sorted::notes`], what a capture lacks in [`Sorted::missing`].
///
/// # Errors
/// I/o, an interruption, and what `OpenCV` says of something unforeseen.
pub fn sort(folder: &Path, threads: u16, control: &Control<'_>) -> Result<Sorted> {
    crate::vision::set_threads(threads)?;
    let gathered = gather(folder)?;
    let kit = Kit::read(&gathered.sidecars)?;
    let mut seen = Vec::new();
    let mut notes = gathered.notes.clone();
    for (k, file) in gathered.photographs.iter().enumerate() {
        (control.progress)("looking at the photographs", k as f64 / gathered.photographs.len() as f64);
        control.check()?;
        match look::look(file, &kit)? {
            Ok(one) => seen.push(one),
            Err(why) => notes.push(why),
        }
    }
    let seen = look::without_copies(seen, &mut notes);
    let roles = roles::assign(seen, &kit, &mut notes);
    let missing = missing::missing(&roles, &kit, &gathered);
    Ok(Sorted { text: shoot_text::text(folder, &roles, &kit, &notes, &missing), notes, missing, assume_srgb: roles.need_srgb(), roles })
}
