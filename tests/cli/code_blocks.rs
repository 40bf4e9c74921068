//! Every code block of the documentation: what is a command is run in a fresh folder, what it prints is compared with what stands there, what is
//! a file is checked, and what cannot be run says why.
//!
//! A comment before a block says what it is, where its language does not:
//!
//! | comment | the block |
//! |---|---|
//! | `<!-- not run: WHY -->` | commands that no test runs |
//! | `<!-- slow -->` | commands that `cargo test -p biscale-cli --test code_blocks -- --ignored` runs |
//! | `<!-- printed -->` | what the commands of the block before it print, but for times |
//! | `<!-- part of a material -->` | lines of a material file |

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use biscale::material::Material;
use biscale::toml_reader::Source;
use std::path::{Path, PathBuf};
use std::process::Command;
use support::project;

/// A fenced block of a page.
#[derive(Clone, Debug)]
struct Block {
    page: String,
    line: usize,
    language: String,
    /// The comment before it, without its marks.
    mark: String,
    text: String,
}

/// What is done with a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Run,
    Slow,
    Printed,
    NotRun,
    Material,
    /// A formula, a drawing, an excerpt of another format; or the help that `tests/cli/commands.rs` compares.
    Text,
}

impl Block {
    fn kind(&self) -> Kind {
        let commands = self.language == "sh" || (self.language.is_empty() && self.text.starts_with("biscale "));
        match (self.mark.as_str(), self.language.as_str()) {
            ("printed", _) => Kind::Printed,
            ("slow", _) if commands => Kind::Slow,
            (mark, _) if commands && mark.strip_prefix("not run: ").is_some_and(|why| !why.trim().is_empty()) => Kind::NotRun,
            ("", _) if commands => Kind::Run,
            ("part of a material" | "", "toml") => Kind::Material,
            ("", "text" | "json" | "yaml" | "csv") => Kind::Text,
            (mark, language) => panic!("{}:{}: nothing is known of a block of {language:?} marked {mark:?}", self.page, self.line),
        }
    }
}

/// The pages of the project that people read.
fn pages() -> Vec<PathBuf> {
    let mut pages = vec![project("README.md"), project("ARCHITECTURE.md"), project("samples/README.md")];
    let docs = std::fs::read_dir(project("docs")).unwrap().map(|entry| entry.unwrap().path());
    pages.extend(docs.filter(|path| path.extension().is_some_and(|e| e == "md")));
    pages.sort();
    pages
}

/// The blocks of a page.
fn blocks(page: &Path) -> Vec<Block> {
    let text = std::fs::read_to_string(page).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    let name = page.file_name().unwrap().to_string_lossy().into_owned();
    let mut blocks = Vec::new();
    let mut at = 0;
    while at < lines.len() {
        let Some(language) = lines[at].strip_prefix("```") else {
            at += 1;
            continue;
        };
        let length =
            lines[at + 1..].iter().position(|l| *l == "```").unwrap_or_else(|| panic!("{name}:{}: a block without an end", at + 1));
        let before = at.checked_sub(1).map_or("", |k| lines[k]);
        let mark = before.strip_prefix("<!-- ").and_then(|m| m.strip_suffix(" -->")).unwrap_or_default();
        blocks.push(Block {
            page: name.clone(),
            line: at + 1,
            language: language.to_owned(),
            mark: mark.to_owned(),
            text: lines[at + 1..at + 1 + length].iter().flat_map(|l| [l, "\n"]).collect(),
        });
        at += length + 2;
    }
    blocks
}

/// A fresh folder with the samples, in which the commands of a page are run one block after another.
fn fresh() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    copy(&project("samples"), &folder.path().join("samples"));
    folder
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let (path, to) = (entry.as_ref().unwrap().path(), to.join(entry.unwrap().file_name()));
        if path.is_dir() { copy(&path, &to) } else { std::fs::copy(&path, &to).map(drop).unwrap() }
    }
}

/// Runs the commands of a block in a folder with a shell that stops at the first that fails; what they say, in their order.
fn run(block: &Block, folder: &Path) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_biscale")).parent().unwrap().to_path_buf();
    let path =
        std::env::join_paths(std::iter::once(program).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()))).unwrap();
    let output = Command::new("sh")
        .args(["-euc", &format!("exec 2>&1\n{}", block.text)])
        .current_dir(folder)
        .env("PATH", path)
        .env("BISCALE_CACHE", folder.join("cache"))
        .output()
        .unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(output.status.success(), "{}:{}: {}\n{said}", block.page, block.line, output.status);
    said
}

/// The lines of a text that do not vary by machine: without progress, times, and errors that are rounding (below 1e-9).
fn lasting(text: &str) -> Vec<String> {
    let varies = |line: &str| line.contains(" % after ") || line.starts_with("milliseconds:");
    let word = |word: &str| {
        let rounding = word.contains('e') && word.parse::<f64>().is_ok_and(|v| v.abs() < 1e-9);
        if rounding { "(rounding)".to_owned() } else { word.to_owned() }
    };
    let line = |line: &str| {
        // A time at the end of a line.
        let line = line.rsplit_once("; ").filter(|(_, end)| end.ends_with(" ms") || end.ends_with(" s")).map_or(line, |(start, _)| start);
        line.trim_end().split(' ').map(word).collect::<Vec<_>>().join(" ")
    };
    text.lines().filter(|l| !varies(l)).map(line).filter(|l| !l.is_empty()).collect()
}

/// Runs the blocks of every page that are of one of these kinds, and compares what stands there as printed.
fn run_all(kinds: &[Kind]) -> usize {
    let mut count = 0;
    for page in pages() {
        let folder = fresh();
        let mut said = None;
        for block in blocks(&page) {
            match block.kind() {
                kind if kinds.contains(&kind) => {
                    said = Some(run(&block, folder.path()));
                    count += 1;
                }
                Kind::Printed => {
                    if let Some(said) = said.take() {
                        assert_eq!(
                            lasting(&said),
                            lasting(&block.text),
                            "{}:{}: what is printed is not what stands there",
                            block.page,
                            block.line
                        );
                    }
                }
                _ => said = None,
            }
        }
    }
    count
}

#[test]
fn every_command_block_runs_in_a_fresh_folder_and_prints_what_stands_there() {
    let all: Vec<Block> = pages().iter().flat_map(|page| blocks(page)).collect();
    let of = |kind| all.iter().filter(|b| b.kind() == kind).count();
    println!("{} blocks run, {} slow ones, {} compared, {} not run", of(Kind::Run), of(Kind::Slow), of(Kind::Printed), of(Kind::NotRun));
    assert!(of(Kind::NotRun) <= 3, "more blocks are marked as not run than were when this was written");
    assert!(of(Kind::Printed) >= 5, "fewer blocks show what is printed than did when this was written");
    assert_eq!(run_all(&[Kind::Run]), of(Kind::Run));
}

#[test]
#[ignore = "minutes: renders, fits and studies"]
fn the_slow_command_blocks_run_too() {
    assert!(run_all(&[Kind::Slow]) > 0);
}

#[test]
fn times_and_rounding_are_not_compared_and_all_else_is() {
    let text = "a: 38 edges; 132 ms\nerror: 3.01e-15 of it\nmilliseconds: load 1\nview: 50 % after 1 s\n\nlargest 1.5e-3 mm\n";
    assert_eq!(lasting(text), ["a: 38 edges", "error: (rounding) of it", "largest 1.5e-3 mm"]);
    assert_eq!(lasting("0.00e0 mm"), ["(rounding) mm"]);
}

/// Whether some `Cargo.toml` of the workspace has a line.
fn in_some_manifest(line: &str) -> bool {
    ["Cargo.toml", "cli/Cargo.toml", "capture/Cargo.toml", "fit/Cargo.toml", "fabricate/Cargo.toml"]
        .iter()
        .any(|file| std::fs::read_to_string(project(file)).unwrap().lines().any(|l| l.trim() == line))
}

/// What the commands of blocks that no test runs name: subcommands, packages, targets of `make`, scripts, benchmarks, examples.
#[test]
fn blocks_that_are_not_run_name_what_there_is() {
    let makefile = std::fs::read_to_string(project("Makefile")).unwrap();
    let mut checked = 0;
    for block in pages().iter().flat_map(|page| blocks(page)).filter(|b| b.kind() == Kind::NotRun) {
        for line in block.text.lines().map(|l| l.split('#').next().unwrap_or_default().trim()).filter(|l| !l.is_empty()) {
            let words: Vec<&str> = line.split_whitespace().collect();
            let after = |option: &str| words.iter().position(|w| *w == option).and_then(|at| words.get(at + 1));
            let is_there = match words[..] {
                ["make", target] => makefile.lines().any(|l| l.starts_with(&format!("{target}:"))),
                ["biscale", command, ..] => {
                    Command::new(env!("CARGO_BIN_EXE_biscale")).args([command, "--help"]).output().unwrap().status.success()
                }
                ["cargo", ..] => {
                    let named = |option: &str| after(option).is_none_or(|name| in_some_manifest(&format!("name = \"{name}\"")));
                    let path = after("--path").is_none_or(|path| project(path).join("Cargo.toml").is_file());
                    named("--package") && named("--bench") && named("--example") && path
                }
                [script, ..] if script.starts_with("scripts/") => project(script).is_file(),
                [example, ..] => {
                    let name = example.strip_prefix("target/release/examples/").unwrap_or_else(|| panic!("{}: {line}", block.page));
                    ["examples", "capture/examples"].iter().any(|folder| project(folder).join(format!("{name}.rs")).is_file())
                }
                [] => true,
            };
            assert!(is_there, "{}:{}: `{line}` names what is not there", block.page, block.line);
            checked += 1;
        }
    }
    assert!(checked >= 4, "{checked}");
}

#[test]
fn every_material_block_is_one() {
    let folder = fresh();
    let all: Vec<Block> = pages().iter().flat_map(|page| blocks(page)).filter(|b| b.kind() == Kind::Material).collect();
    assert!(all.len() >= 2, "{}", all.len());
    for block in all {
        let text = if block.mark == "part of a material" {
            format!("format = 1\n[geometry]\nkind = \"grooves\"\n[[surface]]\npart = \"*\"\n{}", block.text)
        } else {
            block.text.clone()
        };
        let path = folder.path().join("samples").join("block.toml");
        std::fs::write(&path, text).unwrap();
        let checked = Source::read(&path).and_then(|source| Material::parse(&source)).and_then(|material| material.build().map(drop));
        if let Err(error) = checked {
            panic!("{}:{}: {error}", block.page, block.line);
        }
    }
}
