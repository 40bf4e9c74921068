//! What a capture lacks, and how to take it.

use super::folder::{Gathered, name};
use super::look::Seen;
use super::roles::{LIGHTS, Roles};
use crate::checks::{FEWEST_VIEWS, VIEWS};
use crate::kit::Kit;
use crate::lens_group::LensKey;

/// Something that is not there.
#[derive(Clone, Debug, PartialEq)]
pub struct Missing {
    /// What.
    pub what: String,
    /// How to take it, or what is lost without.
    pub how: String,
    /// Whether nothing can be measured without.
    pub required: bool,
}

const BOARD: &str = "print the board (`biscale new board kit.pdf`), lay it flat, and take more than 10 photographs of it with the lens, the zoom and the size that the \
                     sample is taken with: tilted by up to 45 degrees to all sides, and into all corners of the picture";
const CLOSE_UP: &str =
    "photograph the sample from so near that a thread has 8 pixels or more, sharp, straight on, with a marker of the sheet in the picture";
const DISTANT: &str = "photograph the whole sample with the markers around it, from so far away that single threads are not seen, under one lamp and no other light";
const BALL: &str = "lay a mirror ball (a polished bearing ball or a Christmas ball) beside the sample, and photograph both with the markers around, under the same lamp; \
                    or write the direction as [[light]] into the shoot file";
const VALIDATION: &str =
    "move the lamp by more than 10 degrees and repeat the distant photograph and that of the ball: without it a fit cannot be tested";
const SHEET: &str = "copy the .json that `biscale new board` or `biscale fold --on` wrote beside the sheet into the folder: it says where the markers are, and what they are on";

/// Lists what is missing, what is required first.
pub(super) fn missing(roles: &Roles, kit: &Kit, gathered: &Gathered) -> Vec<Missing> {
    let mut out = Vec::new();
    let mut add = |required: bool, what: String, how: &str| out.push(Missing { what, how: how.to_owned(), required });
    if kit.sheet.is_none() {
        add(true, "the sidecar of the sheet that the sample is on".into(), SHEET);
    }
    if let Some(other) = kit.others.first() {
        let (first, other) = (kit.sheet.as_ref().map_or(String::new(), |s| name(&s.0)), name(other));
        add(
            true,
            "one sheet".into(),
            &format!("{first} and {other} describe a sheet each: leave the one that the sample is on in the folder"),
        );
    }
    match u32::try_from(roles.boards.len()).unwrap_or(u32::MAX) {
        0 => add(true, "views of the calibration board".into(), BOARD),
        n if n < FEWEST_VIEWS => add(true, format!("more views of the calibration board than {n}"), BOARD),
        n if n <= VIEWS => add(false, format!("more views of the calibration board than {n}"), BOARD),
        _ => {}
    }
    if roles.close_ups.is_empty() {
        add(true, "a close-up".into(), CLOSE_UP);
    }
    if roles.distant.is_empty() {
        add(true, "a distant photograph".into(), DISTANT);
    }
    if !roles.distant.is_empty() && !roles.balls.iter().any(|b| b.light == 0) {
        add(true, format!("the direction of the lamp of {}", roles.distant[0].files[0].name()), BALL);
    }
    if !roles.boards.is_empty() {
        let used = roles.close_ups.first().into_iter().chain(roles.distant.iter().chain(&roles.validation).flat_map(|v| &v.files));
        let lacking: Vec<&Seen> = used.filter(|s| roles.boards_for(s) < FEWEST_VIEWS as usize).collect();
        for seen in lacking {
            let lens = LensKey::of(None, seen.size, &seen.metadata).describe();
            let what = format!("views of the calibration board through the lens of {} ({lens})", seen.name());
            add(true, what, &format!("{BOARD}; or take {} with the lens and at the size of the board views", seen.name()));
        }
    }
    if roles.validation.is_empty() {
        add(false, "a validation photograph".into(), VALIDATION);
    } else if !roles.balls.iter().any(|b| b.light == 1) {
        add(false, format!("the direction of the lamp of {} (it is left out)", roles.validation[0].files[0].name()), BALL);
    }
    if roles.flats.is_empty() {
        let how =
            "photograph white paper out of focus, evenly lit, half of the scale, twice: without it corners come out darker than the middle";
        add(false, "a flat field".into(), how);
    }
    if roles.checkers.is_empty() {
        let how =
            "photograph a colour checker where the sample lies: without it colours are those of the sheet's patches, or the camera's own";
        add(false, "a colour checker".into(), how);
    }
    out.sort_by_key(|m| !m.required);
    if let Some((file, how)) = gathered.unread.first() {
        let others = gathered.unread.len() - 1;
        let more = if others > 0 { format!(" and {others} more") } else { String::new() };
        let required = out.iter().any(|m| m.required);
        // What is missing may be among them: to be read first.
        out.insert(0, Missing { what: format!("{}{more} in a format that is read", name(file)), how: how.clone(), required });
    }
    out
}

impl Roles {
    /// Whether the direction of a light is known.
    pub(super) fn knows_light(&self, name: &str) -> bool {
        self.balls.iter().any(|b| LIGHTS[b.light] == name)
    }
}
