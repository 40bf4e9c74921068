//! What the repository cites of itself exists: files that comments and pages name, their numbered sections, links and anchors.
//!
//! A citation is
//! - the name of a file (`docs/fit.md`, `numerics.md`, `filter/direct.rs`, `scripts/setup.sh`) in a page, a script or a comment;
//! - a numbered section of a page: a name followed by "section 3.6", or "section 3.6 of" followed by a name;
//! - a relative link in Markdown, with or without an anchor.
//!
//! A name is looked for beside the file that cites it, in the folders above that one, and in `docs/`.

#![allow(clippy::unwrap_used, reason = "a test stops where something cannot be read")]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Folders that hold nothing of the repository's own.
const SKIPPED: [&str; 3] = ["target", "demo", "node_modules"];
/// Endings of files whose text is read.
const READ: [&str; 5] = ["rs", "md", "sh", "py", "toml"];
/// Endings of names that are citations wherever they stand.
const CITED: [&str; 4] = ["md", "rs", "sh", "py"];
/// Folders of the repository: in a page each path into one of them is a citation.
const ROOMS: [&str; 10] = ["src/", "cli/", "fabricate/", "capture/", "fit/", "tests/", "benches/", "samples/", "scripts/", "docs/"];
/// Names that are no citations: of files that commands write, and those that stand for any file of their kind.
const ANY: [&str; 6] = ["report.md", "mod.rs", "lib.rs", "main.rs", "x.rs", "x_tests.rs"];

/// One citation of a file.
#[derive(Debug, PartialEq)]
struct Citation {
    /// Line that it begins on, from 1.
    line: usize,
    /// The file as it is named there.
    target: String,
    /// Numbers of its sections that are named with it.
    sections: Vec<String>,
}

/// Text without the marks of comments, its lines joined, so that a citation may go over the end of a line.
struct Prose {
    text: String,
    /// Where each line begins in `text`, with its number.
    starts: Vec<(usize, usize)>,
}

impl Prose {
    /// The comments of a program, or all of a page.
    fn new(source: &str, ending: &str) -> Self {
        let mut prose = Self { text: String::new(), starts: Vec::new() };
        for (number, line) in (1..).zip(source.lines()) {
            let line = line.trim();
            let said = match ending {
                "rs" => comment(line, "//").map(|c| c.trim_start_matches(['/', '!'])),
                "py" | "toml" => comment(line, "#"),
                _ => Some(line.trim_start_matches('#')),
            };
            if let Some(said) = said {
                prose.starts.push((prose.text.len(), number));
                prose.text.push_str(said.trim());
                prose.text.push(' ');
            }
        }
        prose
    }

    fn line_of(&self, at: usize) -> usize {
        self.starts[self.starts.partition_point(|&(start, _)| start <= at) - 1].1
    }
}

/// What follows the mark of a comment, whether the line begins with it or has it at its end; not where it stands within quotes.
fn comment<'a>(line: &'a str, mark: &str) -> Option<&'a str> {
    let at = line.find(mark)?;
    line[..at].matches('"').count().is_multiple_of(2).then(|| &line[at + mark.len()..])
}

/// Characters that a path is made of.
fn is_path(c: char) -> bool {
    c.is_ascii_alphanumeric() || "_-./".contains(c)
}

/// The citations of a text. In a page (`in_page`) paths into the rooms of the repository count with any ending.
fn citations(prose: &Prose, in_page: bool) -> Vec<Citation> {
    let mut found = Vec::new();
    let mut rest = 0;
    while let Some(start) = prose.text[rest..].find(is_path).map(|at| rest + at) {
        let end = prose.text[start..].find(|c| !is_path(c)).map_or(prose.text.len(), |at| start + at);
        rest = end;
        let name = prose.text[start..end].trim_end_matches('.');
        // What stands behind these is a pattern, a variable or an address, and no name of a file.
        let before = prose.text[..start].chars().next_back();
        if name.starts_with('/') || before.is_some_and(|c| "$*}~<:=@".contains(c)) {
            continue;
        }
        let ending = Path::new(name).extension().and_then(|e| e.to_str()).unwrap_or("");
        let stem = name.rsplit('/').next().unwrap_or("");
        // NAME.toml stands for any.
        let any = ending != "md"
            && stem.strip_suffix(ending).is_some_and(|s| s.len() > 1 && s.chars().all(|c| c.is_ascii_uppercase() || c == '.'));
        let in_a_room = in_page && ROOMS.iter().any(|room| name.starts_with(room)) && (name.ends_with('/') || !ending.is_empty());
        if any || !(in_a_room || (CITED.contains(&ending) && stem.len() > ending.len() + 1)) {
            continue;
        }
        let mut sections = Vec::new();
        if ending == "md" {
            sections = sections_after(&prose.text[end..]);
            sections.extend(section_before(&prose.text[..start]));
        }
        found.push(Citation { line: prose.line_of(start), target: name.to_owned(), sections });
    }
    found
}

/// The numbers of ", section 3.6" or "), sections 1 and 2".
fn sections_after(text: &str) -> Vec<String> {
    let text = text.trim_start_matches(|c: char| "`'\")],: ".contains(c));
    let Some(mut text) = text.strip_prefix("sections ").or_else(|| text.strip_prefix("section ")) else { return Vec::new() };
    let mut numbers = Vec::new();
    loop {
        let length = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
        let number = text[..length].trim_end_matches('.');
        if number.is_empty() {
            return numbers;
        }
        numbers.push(number.to_owned());
        text = &text[length..];
        let Some(next) = [", ", " and ", " to "].iter().find_map(|between| text.strip_prefix(between)) else { return numbers };
        text = next;
    }
}

/// The number of "section 3.6 of", before a name.
fn section_before(text: &str) -> Option<String> {
    let text = text.trim_end_matches(|c: char| "`'\"([ ".contains(c)).strip_suffix(" of")?;
    let (before, number) = text.rsplit_once(' ')?;
    let is_number = number.starts_with(|c: char| c.is_ascii_digit()) && number.chars().all(|c| c.is_ascii_digit() || c == '.');
    (before.ends_with("section") && is_number).then(|| number.to_owned())
}

/// The headings of a page, without the marks, and not those within code.
fn headings(page: &str) -> Vec<&str> {
    let mut in_code = false;
    let mut found = Vec::new();
    for line in page.lines() {
        in_code ^= line.trim_start().starts_with("```");
        if !in_code && line.starts_with('#') {
            found.push(line.trim_start_matches('#').trim());
        }
    }
    found
}

/// The number that a heading begins with.
fn number_of(heading: &str) -> Option<&str> {
    let first = heading.split_whitespace().next()?.trim_end_matches('.');
    first.starts_with(|c: char| c.is_ascii_digit()).then_some(first)
}

/// The anchors that a page's headings have, as GitHub and rustdoc make them.
fn anchors(page: &str) -> Vec<String> {
    let mut times: HashMap<String, usize> = HashMap::new();
    let anchor = |heading: &&str| {
        let kept = heading.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        let slug: String = kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect();
        let count = times.entry(slug.clone()).or_default();
        *count += 1;
        if *count == 1 { slug } else { format!("{slug}-{}", *count - 1) }
    };
    headings(page).iter().map(anchor).collect()
}

/// The relative links of a page, with their lines.
fn links(page: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut in_code = false;
    for (number, line) in (1..).zip(page.lines()) {
        in_code ^= line.trim_start().starts_with("```");
        if in_code {
            continue;
        }
        let targets = line.split("](").skip(1).filter_map(|after| Some(after.split_once(')')?.0));
        found.extend(targets.filter(|t| !t.contains("://") && !t.starts_with("mailto:")).map(|t| (number, t)));
    }
    found
}

/// The file that a name means for a file that cites it.
fn resolve(root: &Path, citing: &Path, name: &str) -> Option<PathBuf> {
    let above = citing.ancestors().skip(1).take_while(|folder| folder.starts_with(root));
    above.map(Path::to_path_buf).chain([root.join("docs")]).map(|folder| folder.join(name)).find(|path| path.exists())
}

/// All files of a folder whose text is read.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        let name = path.file_name().unwrap().to_string_lossy();
        if name.starts_with('.') || SKIPPED.contains(&&*name) {
            continue;
        }
        if path.is_dir() {
            files(&path, found);
        } else if name == "Makefile" || path.extension().is_some_and(|e| READ.iter().any(|r| e == *r)) {
            found.push(path);
        }
    }
}

/// What the file `path` with this text cites and the repository at `root` lacks.
fn problems_of(root: &Path, path: &Path, text: &str) -> Vec<String> {
    let ending = path.extension().map_or("", |e| e.to_str().unwrap_or(""));
    let shown = path.strip_prefix(root).unwrap_or(path).display().to_string();
    let mut problems = Vec::new();
    for Citation { line, target, sections } in citations(&Prose::new(text, ending), ending == "md") {
        if ANY.contains(&target.as_str()) {
            continue;
        }
        match resolve(root, path, &target) {
            None => problems.push(format!("{shown}:{line}: there is no {target}")),
            Some(file) if !sections.is_empty() => {
                let page = std::fs::read_to_string(file).unwrap();
                let numbers: Vec<&str> = headings(&page).into_iter().filter_map(number_of).collect();
                for section in sections.iter().filter(|s| !numbers.contains(&s.as_str())) {
                    problems.push(format!("{shown}:{line}: {target} has no section {section}"));
                }
            }
            Some(_) => {}
        }
    }
    if ending == "md" {
        for (line, link) in links(text) {
            let (target, anchor) = link.split_once('#').map_or((link, None), |(target, anchor)| (target, Some(anchor)));
            let file = path.parent().unwrap().join(target);
            if !target.is_empty() && !file.exists() {
                problems.push(format!("{shown}:{line}: the link {link} leads nowhere"));
            } else if let Some(anchor) = anchor {
                let page = if target.is_empty() { text.to_owned() } else { std::fs::read_to_string(&file).unwrap() };
                if !anchors(&page).iter().any(|a| a == anchor) {
                    problems.push(format!("{shown}:{line}: {target} has no heading #{anchor}"));
                }
            }
        }
    }
    problems
}

#[test]
fn what_the_repository_cites_of_itself_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut all = Vec::new();
    files(root, &mut all);
    assert!(all.len() > 100, "only {} files were found", all.len());
    let own = root.join(file!());
    let problems: Vec<String> = all
        .iter()
        // This file's own examples are wrong on purpose.
        .filter(|path| **path != own)
        .flat_map(|path| problems_of(root, path, &std::fs::read_to_string(path).unwrap()))
        .collect();
    assert!(problems.is_empty(), "{} citations are wrong:\n{}", problems.len(), problems.join("\n"));
}

mod the_finder {
    use super::*;

    fn found(source: &str, ending: &str) -> Vec<(String, Vec<String>)> {
        citations(&Prose::new(source, ending), ending == "md").into_iter().map(|c| (c.target, c.sections)).collect()
    }

    fn one(target: &str, sections: &[&str]) -> Vec<(String, Vec<String>)> {
        vec![(target.to_owned(), sections.iter().map(|&s| s.to_owned()).collect())]
    }

    #[test]
    fn finds_sections_behind_and_before_a_name_and_over_the_end_of_a_line() {
        assert_eq!(found("//! (`numerics.md`, section 3.6), and halves", "rs"), one("numerics.md", &["3.6"]));
        assert_eq!(found("    // see (`numerics.md`,\n    // section 3.6).", "rs"), one("numerics.md", &["3.6"]));
        assert_eq!(found("/// docs/numerics.md, sections 1, 3.2 and 4 tell", "rs"), one("docs/numerics.md", &["1", "3.2", "4"]));
        assert_eq!(found("as section 5 of `numerics.md` derives", "md"), one("numerics.md", &["5"]));
        assert_eq!(found("[errors](numerics.md), section 3.6.", "md"), one("numerics.md", &["3.6"]));
        assert_eq!(found("numerics.md: 3.6 of them", "md"), one("numerics.md", &[]));
    }

    #[test]
    fn reads_comments_only_in_programs_and_tells_names_from_addresses_and_variables() {
        assert_eq!(found("let x = 1; // as in filter/direct.rs", "rs"), one("filter/direct.rs", &[]));
        assert!(found("let x = \"//wrong.md\";", "rs").is_empty());
        assert!(found("https://example.org/docs/wrong.md, $FOLDER/wrong.md, *.md, `.md`", "md").is_empty());
        assert_eq!(found("reads samples/slice.csv", "md"), one("samples/slice.csv", &[]));
        assert!(found("// reads samples/slice.csv", "rs").is_empty());
        assert!(found("one of samples/NAME.toml", "md").is_empty());
    }

    #[test]
    fn knows_the_line_of_a_citation() {
        let prose = Prose::new("fn f() {}\n\n// one\n// a.md and\n// b.md\n", "rs");
        let lines: Vec<usize> = citations(&prose, false).iter().map(|c| c.line).collect();
        assert_eq!(lines, [4, 5]);
    }

    #[test]
    fn makes_the_anchors_that_a_page_has() {
        let page = "# A page: it's `code`, 3.6\n## Twice\n```\n# no heading\n```\n## Twice\n";
        assert_eq!(anchors(page), ["a-page-its-code-36", "twice", "twice-1"]);
        assert_eq!(number_of("3.6 Errors"), Some("3.6"));
        assert_eq!(number_of("Errors"), None);
    }

    /// A small repository with right and wrong citations.
    #[test]
    fn tells_wrong_files_sections_links_and_anchors_from_right_ones() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        std::fs::create_dir_all(root.join("docs")).unwrap();
        std::fs::create_dir_all(root.join("src/filter")).unwrap();
        std::fs::write(root.join("docs/numerics.md"), "# Numerics\n## 1 What\n## 3 Stages\n### 3.6 Errors\n").unwrap();
        std::fs::write(root.join("src/filter/direct.rs"), "").unwrap();
        let problems = |name: &str, text: &str| problems_of(root, &root.join(name), text);
        let none: [&str; 0] = [];

        let right = "//! `numerics.md`, section 3.6; `docs/numerics.md`, sections 1 and 3; `filter/direct.rs`, `direct.rs`\n";
        assert_eq!(problems("src/filter/x.rs", right), none);
        assert_eq!(problems("docs/x.md", "[one](numerics.md#36-errors), [two](../src/filter/direct.rs), [x](#me)\n# Me\n"), none);
        let wrong = "// `numerics.md`, section 3.7\n// docs/nothing.md\n// filter/gone.rs\n";
        assert_eq!(
            problems("src/filter/x.rs", wrong),
            [
                "src/filter/x.rs:1: numerics.md has no section 3.7",
                "src/filter/x.rs:2: there is no docs/nothing.md",
                "src/filter/x.rs:3: there is no filter/gone.rs"
            ]
        );
        let wrong = "[a](numerics.md#37-errors)\n[b](gone.png) and src/gone/\n";
        assert_eq!(
            problems("docs/x.md", wrong),
            [
                "docs/x.md:2: there is no src/gone/",
                "docs/x.md:1: numerics.md has no heading #37-errors",
                "docs/x.md:2: the link gone.png leads nowhere"
            ]
        );
    }
}
