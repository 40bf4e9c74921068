//! `biscale capture FOLDER`: a folder of photographs becomes a shoot file.

use super::args::CaptureArgs;
use crate::common::options::CommonArgs;
use crate::common::output::{self, Target};
use crate::common::progress;
use biscale::error::{BadInput, Result};
use biscale_capture::sort::{Roles, Sorted, sort};
use serde_json::{Value, json};
use std::path::Path;

/// Name of the shoot file in the folder.
const SHOOT: &str = "shoot.toml";

/// Sorts the folder, writes the shoot file and says what comes next.
///
/// # Errors
/// Bad input if photographs are missing, which says how to take them, if the folder has none, or if the shoot file exists; i/o.
pub(super) fn run(args: &CaptureArgs, common: &CommonArgs) -> Result<()> {
    let folder = &args.shoot;
    let file = args.output.clone().unwrap_or_else(|| folder.join(SHOOT));
    let real = |path: &Path| std::fs::canonicalize(path).ok();
    let beside = file.parent().and_then(real) == real(folder);
    if file.extension().is_none_or(|e| e != "toml") || !beside {
        let problem = format!("{} is a folder of photographs: they are sorted into a shoot file in it first", folder.display());
        let remedy =
            format!("leave `output` out; then look {} over, and write `biscale capture {}/{SHOOT} -o captured`", SHOOT, folder.display());
        return Err(BadInput::new(problem, remedy).at_field("output").into());
    }
    // A person edits this file: it is never recognised as ours to overwrite.
    let target = Target::new(&file, args.force, &[], |_| false)?;
    let sorted = progress::with_control(common, |control| sort(folder, common.threads, control))?;
    let complete = sorted.is_complete();
    if !complete && !args.incomplete {
        output::tell(common, &told(&sorted));
        return Err(refusal(&sorted, folder).into());
    }
    target.write(|out| out.write_all(sorted.text.as_bytes()))?;
    let srgb = if sorted.assume_srgb { " --assume-srgb" } else { "" };
    let next = format!("biscale capture {} -o {}{srgb}", quoted(&file), quoted(&folder.join("captured")));
    if common.json {
        return output::print_json(&json!({
            "shoot": file.display().to_string(),
            "complete": complete,
            "photographs": photographs(&sorted.roles),
            "missing": sorted.missing.iter().map(|m| json!({ "what": m.what, "how": m.how, "required": m.required })).collect::<Vec<_>>(),
            "notes": sorted.notes,
            "next": next,
        }));
    }
    let curve = if sorted.assume_srgb {
        "\nThe photographs of the sample have a tone curve (JPEG), which --assume-srgb undoes about: raw files, converted by `dcraw -4 -T -o 0 -t 0`, measure better."
    } else {
        ""
    };
    let text = format!("{}\nwrote {}: look it over{curve}\nnext: {next}", told(&sorted), file.display());
    output::tell(common, &text);
    Ok(())
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    if text.chars().all(|c| c.is_alphanumeric() || "/._-".contains(c)) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// What is missing, and how to take it.
fn refusal(sorted: &Sorted, folder: &Path) -> BadInput {
    let required: Vec<_> = sorted.missing.iter().filter(|m| m.required).collect();
    let what: Vec<&str> = required.iter().map(|m| &*m.what).collect();
    let how: Vec<String> = required.iter().map(|m| format!("\n  {}: {}", m.what, m.how)).collect();
    let problem = format!("this is missing in {}: {}", folder.display(), what.join("; "));
    BadInput::new(problem, format!("add it (or write the shoot file all the same with `incomplete`):{}", how.concat())).at_field("FOLDER")
}

/// The files of each role.
fn photographs(roles: &Roles) -> Value {
    let names = |seen: &[biscale_capture::sort::Seen]| seen.iter().map(|s| s.name()).collect::<Vec<_>>();
    let views = |views: &[biscale_capture::sort::View]| views.iter().map(|v| names(&v.files)).collect::<Vec<_>>();
    json!({
        "board": names(&roles.boards),
        "flat": names(&roles.flats),
        "checker": names(&roles.checkers),
        "light": roles.balls.iter().map(|b| b.seen.name()).collect::<Vec<_>>(),
        "close-up": names(&roles.close_ups),
        "distant": views(&roles.distant),
        "validation": views(&roles.validation),
        "unused": names(&roles.unknown),
    })
}

/// The roles, what is not used, and what would help, line by line.
fn told(sorted: &Sorted) -> String {
    let roles = &sorted.roles;
    let mut lines = Vec::new();
    let mut line = |role: &str, names: Vec<String>| {
        if !names.is_empty() {
            lines.push(format!("{role:<11} {}", names.join(", ")));
        }
    };
    let names = |seen: &[biscale_capture::sort::Seen]| seen.iter().map(|s| s.name()).collect::<Vec<_>>();
    let boards = names(&roles.boards);
    match &boards[..] {
        [first, .., last] => line("board", vec![format!("{} views, {first} to {last}", boards.len())]),
        _ => line("board", boards),
    }
    line("flat", names(&roles.flats));
    line("checker", names(&roles.checkers));
    line("light", roles.balls.iter().map(|b| format!("{} ({})", b.seen.name(), b.why)).collect());
    line("close-up", names(&roles.close_ups).into_iter().take(1).collect());
    for (role, views) in [("distant", &roles.distant), ("validation", &roles.validation)] {
        line(role, views.iter().map(|v| format!("{} ({})", names(&v.files).join(" + "), v.why)).collect());
    }
    lines.extend(sorted.notes.iter().map(|note| format!("note: {note}")));
    lines.extend(sorted.missing.iter().filter(|m| !m.required).map(|m| format!("better with {}: {}", m.what, m.how)));
    lines.join("\n")
}
