//! The shoot file of a sorted folder: what was seen stands beside each photograph, for a person to correct.

use super::folder::name;
use super::look::{Seen, Subject};
use super::missing::Missing;
use super::roles::{LIGHTS, Roles, View};
use crate::kit::Kit;
use crate::sheet::Target;
use std::path::Path;

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string()
}

/// Text in a comment: one line.
fn plain(text: &str) -> String {
    text.replace(char::is_control, " ")
}

/// Writes the file.
pub(super) fn text(folder: &Path, roles: &Roles, kit: &Kit, notes: &[String], missing: &[Missing]) -> String {
    let title = folder.file_name().map_or_else(|| "shoot".to_owned(), |n| n.to_string_lossy().into_owned());
    let mut out = format!(
        "# Made by `biscale capture {}` from what the photographs show: correct what is wrong, then run it with this file.\n# `biscale new shoot -` shows every key.\n\
         format = 1\nname = {}\n",
        plain(&folder.display().to_string()),
        quoted(&title)
    );
    for m in missing {
        let word = if m.required { "Missing" } else { "Better with" };
        out.push_str(&format!("# {word}: {}: {}.\n", plain(&m.what), plain(&m.how)));
    }
    out.push_str(&board(kit));
    out.push_str(&sample(kit));
    if !roles.boards.is_empty() {
        let names: Vec<String> = roles.boards.iter().map(|b| format!("  {}", quoted(&b.name()))).collect();
        out.push_str(&format!("\n[[photo]]\nrole = \"board\"\nfiles = [\n{},\n]\n", names.join(",\n")));
    }
    for flat in &roles.flats {
        out.push_str(&entry("flat", &[flat], "an even surface out of focus", ""));
    }
    for checker in &roles.checkers {
        out.push_str(&entry("checker", &[checker], "24 patches", ""));
    }
    for ball in &roles.balls {
        out.push_str(&entry("light", &[&ball.seen], &format!("a mirror ball; {}", ball.why), &light(ball.light)));
    }
    if let Some(close_up) = roles.close_ups.first() {
        out.push_str(&entry("close-up", &[close_up], &shown(close_up), ""));
    }
    for view in &roles.distant {
        out.push_str(&of_view("distant", view, 0));
    }
    for view in &roles.validation {
        let text = of_view("validation", view, 1);
        if roles.knows_light(LIGHTS[1]) {
            out.push_str(&text);
        } else {
            let lines: Vec<String> = text.trim_start().lines().map(|l| format!("# {l}")).collect();
            out.push_str(&format!(
                "\n# The direction of its lamp is not known: add it, and take the marks off.\n{}\n# [[light]]\n# name = \"{}\"\n# direction = [0.0, 0.0, 1.0]\n",
                lines.join("\n"),
                LIGHTS[1]
            ));
        }
    }
    if !notes.is_empty() {
        out.push_str("\n# Not used, or doubtful:\n");
        notes.iter().for_each(|note| out.push_str(&format!("# {}\n", plain(note))));
    }
    out
}

fn board(kit: &Kit) -> String {
    let b = &kit.board;
    let from = if kit.board_told { "as its sidecar says" } else { "no sidecar tells it: that of `biscale new board`" };
    format!(
        "\n[board]                      # {from}; measure the print\nkind = \"charuco\"\ncolumns = {}\nrows = {}\nsquare_mm = {:?}\nmarker_mm = {:?}\ndictionary = {}\nfirst_id = {}\n",
        b.columns,
        b.rows,
        b.square_mm,
        b.marker_mm,
        quoted(&b.dictionary),
        b.first_id
    )
}

fn sample(kit: &Kit) -> String {
    let Some((file, sheet)) = &kit.sheet else {
        return "\n[sample]                     # what it is on is not known\nshape = \"plane\"\nwidth_mm = 100.0\nheight_mm = 100.0\n"
            .into();
    };
    let what = match sheet.target {
        Target::Plane { width, height } => format!("a plane of {width} x {height} mm"),
        Target::Cylinder { radius, height } => format!("a cylinder of radius {radius} mm, {height} mm high"),
        Target::Cone {} | Target::Box {} => "an object".to_owned(),
    };
    format!(
        "\n[sample]                     # {what}\nsheet = {}\n# offset_mm = 0.5            # thickness of the sample: height of its surface over the paper of the markers\nsurface = \"weave\"\n",
        quoted(&name(file))
    )
}

fn light(place: usize) -> String {
    if place == 0 { String::new() } else { format!("light = \"{}\"\n", LIGHTS[place]) }
}

fn of_view(role: &str, view: &View, place: usize) -> String {
    let files: Vec<&Seen> = view.files.iter().collect();
    entry(role, &files, &format!("{}; {}", shown(files[0]), view.why), &light(place))
}

/// What is seen in a photograph.
fn shown(seen: &Seen) -> String {
    match &seen.subject {
        Subject::Sheet(view) => format!("{} markers of the sheet, {:.2} pixels a mm", view.middles.len(), view.px_per_mm),
        Subject::Repeats(what) => format!("{what}; no marker: write mm_per_px"),
        Subject::Board(corners) => format!("{corners} corners of the board"),
        Subject::Even => "an even surface".into(),
        Subject::Checker => "a checker".into(),
        Subject::Nothing(why) => why.clone(),
    }
}

fn entry(role: &str, files: &[&Seen], comment: &str, more: &str) -> String {
    let names: Vec<String> = files.iter().map(|f| quoted(&f.name())).collect();
    let taken = files[0].metadata.taken.as_deref().map_or(String::new(), |t| format!("; taken {}", t.trim_end_matches('.')));
    let turned = match files[0].metadata.orientation {
        Some(turn @ 2..=8) => format!("; Exif orientation {turn}: its pixels are taken as the sensor has them"),
        _ => String::new(),
    };
    let files =
        if names.len() == 1 { format!("file = {}", names[0]) } else { format!("files = [{}]   # brackets of one view", names.join(", ")) };
    format!("\n# {}\n[[photo]]\nrole = \"{role}\"\n{files}\n{more}", plain(&format!("{comment}{taken}{turned}")))
}
