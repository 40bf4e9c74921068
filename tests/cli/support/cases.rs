//! A table of wrong inputs: each must end with its exit status and one message, and leave nothing.

use super::{Folder, MATERIAL, PAIRS, PLANE};

/// What is wrong with the folder, before the command runs.
pub enum Wrong {
    /// A piece of the material file, and what stands there instead.
    Material(&'static str, &'static str),
    /// A piece of the mesh, and what stands there instead.
    Mesh(&'static str, &'static str),
    /// A piece of the pairs, and what stands there instead.
    Pairs(&'static str, &'static str),
    /// The material file's `[geometry]` table, and what follows it. It begins in line 2.
    Geometry(&'static str),
    /// As `Geometry`, and a file with this content.
    Files(String, &'static str, Vec<u8>),
    /// A file with this content.
    File(&'static str, &'static [u8]),
    /// A file that is not there.
    NoFile(&'static str),
    /// A folder of this name, in the place of any file.
    Folder(&'static str),
    /// Only the arguments, which stand in the place of `eval m.toml --pairs p.csv -o out.csv`.
    Arguments(&'static [&'static str]),
    /// These arguments after `eval m.toml --pairs p.csv -o out.csv`.
    Also(&'static [&'static str]),
}
/// A material file with this geometry, which begins in line 2; a surface covers what is left.
fn around(geometry: &str) -> String {
    format!("format = 1\n[geometry]\n{geometry}\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = 0.5 }}\n")
}

/// Runs `wrong` and checks that it ends with `status` and one message that has all `words`, and that it leaves nothing.
/// Returns what is not so.
fn try_case(what: &str, wrong: &Wrong, status: i32, words: &[&str]) -> Result<(), String> {
    let folder = Folder::new();
    let change = |name: &str, good: &str, from: &str, to: &str| {
        assert!(good.contains(from), "{what}: the good file has no {from:?}");
        folder.write(name, good.replacen(from, to, 1));
    };
    let mut arguments = vec!["eval", "m.toml", "--pairs", "p.csv", "-o", "out.csv"];
    let mut check_too = false;
    match wrong {
        Wrong::Material(from, to) => {
            change("m.toml", MATERIAL, from, to);
            check_too = true;
        }
        Wrong::Mesh(from, to) => {
            change("plane.obj", PLANE, from, to);
            check_too = true;
        }
        Wrong::Pairs(from, to) => change("p.csv", PAIRS, from, to),
        Wrong::Geometry(table) => {
            folder.write("m.toml", around(table));
            check_too = true;
        }
        Wrong::Files(table, name, content) => {
            folder.write("m.toml", around(table));
            folder.write(name, content);
            check_too = true;
        }
        Wrong::File(name, content) => folder.write(name, content),
        Wrong::NoFile(name) => std::fs::remove_file(folder.path(name)).unwrap(),
        Wrong::Folder(name) => {
            let _ = std::fs::remove_file(folder.path(name));
            std::fs::create_dir(folder.path(name)).unwrap();
        }
        Wrong::Arguments(all) => arguments = all.to_vec(),
        Wrong::Also(more) => arguments.extend(*more),
    }
    let before = folder.snapshot();
    let mut runs = vec![arguments];
    if check_too {
        runs.push(vec!["check", "m.toml"]);
    }
    for arguments in runs {
        let said = folder.run(&arguments);
        let shown = format!("{what} ({}):\n{}", arguments.join(" "), said.stderr);
        if said.status != status {
            return Err(format!("exit status {} and not {status}: {shown}", said.status));
        }
        if let Some(word) = words.iter().find(|w| !said.stderr.contains(**w)) {
            return Err(format!("no {word:?}: {shown}"));
        }
        if said.stderr.contains("panicked") || !said.stderr.starts_with("error: ") {
            return Err(format!("not one message: {shown}"));
        }
        // Messages about arguments come with the way to the help; all others are one line.
        if !said.stderr.contains("--help") && said.stderr.lines().count() != 1 {
            return Err(format!("more than one line: {shown}"));
        }
        if !said.stdout.is_empty() {
            return Err(format!("something on standard output: {shown}{}", said.stdout));
        }
        if folder.snapshot() != before {
            return Err(format!("the folder changed: {shown}"));
        }
    }
    Ok(())
}

/// Tries all rows and tells of all that fail.
pub fn try_all(rows: &[(&str, Wrong, i32, &[&str])]) {
    let failures: Vec<String> =
        rows.iter().filter_map(|(what, wrong, status, words)| try_case(what, wrong, *status, words).err()).collect();
    assert!(failures.is_empty(), "{} of {} cases:\n\n{}", failures.len(), rows.len(), failures.join("\n"));
}
