//! Sabotage: each way to spoil a right pattern is found, and named.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod surfaces;

use biscale_fabricate::drawing::Look;
use biscale_fabricate::paper::Paper;
use serde_json::{Value, json};
use surfaces::{A4, Printed, boxes, field, l_prism, look, printed};

/// The pattern with one line of its first page that has all `parts` changed, the `nth` of them from 0.
fn changed(pattern: &mut Printed, parts: &[&str], nth: usize, change: impl Fn(&str) -> String) {
    for page in &mut pattern.svg {
        let mut count = 0;
        let mut done = false;
        let lines: Vec<String> = page
            .lines()
            .map(|line| {
                let here = parts.iter().all(|p| line.contains(p));
                count += usize::from(here);
                if here && !done && count == nth + 1 {
                    done = true;
                    change(line)
                } else {
                    line.to_owned()
                }
            })
            .collect();
        if done {
            *page = lines.join("\n");
            return;
        }
    }
    panic!("no line has {parts:?}");
}

/// All lines that have all `parts` changed, on all pages.
fn all_changed(pattern: &mut Printed, parts: &[&str], change: impl Fn(&str) -> String) {
    let mut any = false;
    for page in &mut pattern.svg {
        let lines: Vec<String> = page
            .lines()
            .map(|line| {
                if parts.iter().all(|p| line.contains(p)) {
                    any = true;
                    change(line)
                } else {
                    line.to_owned()
                }
            })
            .collect();
        *page = lines.join("\n");
    }
    assert!(any, "no line has {parts:?}");
}

fn gone(_: &str) -> String {
    String::new()
}

fn attribute(line: &str, name: &str) -> String {
    line.split(&format!(" {name}=\"")).nth(1).unwrap_or_else(|| panic!("no {name} in {line}")).split('"').next().unwrap().to_owned()
}

fn with(line: &str, name: &str, value: &str) -> String {
    let old = attribute(line, name);
    line.replacen(&format!(" {name}=\"{old}\""), &format!(" {name}=\"{value}\""), 1)
}

/// The first number of an attribute, changed.
fn moved(line: &str, name: &str, by: f64) -> String {
    let old = attribute(line, name);
    let start = old.find(|c: char| c.is_ascii_digit()).unwrap();
    let end = start + old[start..].find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(old.len() - start);
    let value: f64 = old[start..end].parse().unwrap();
    with(line, name, &format!("{}{}{}", &old[..start], value + by, &old[end..]))
}

fn words(line: &str, text: &str) -> String {
    let (start, end) = (line.find('>').unwrap() + 1, line.rfind("</text>").unwrap());
    format!("{}{text}{}", &line[..start], &line[end..])
}

fn said(line: &str) -> String {
    line[line.find('>').unwrap() + 1..line.rfind("</text>").unwrap()].to_owned()
}

fn as_valley(line: &str) -> String {
    with(&with(line, "stroke", "#3050c0"), "stroke-dasharray", "1.6 1.1")
}

fn as_mountain(line: &str) -> String {
    with(&with(line, "stroke", "#c03030"), "stroke-dasharray", "3 0.9 0.5 0.9")
}

fn inserted(pattern: &mut Printed, layer: &str, mark: &str) {
    let page = &mut pattern.svg[0];
    let at = page.find(&format!("<g id=\"{layer}\"")).unwrap();
    let end = at + page[at..].find('>').unwrap() + 1;
    page.insert_str(end, mark);
}

/// A way to spoil the pages: its name, what it does, a word of what must be said of it.
type Sabotage = (&'static str, fn(&mut Printed), &'static str);

const PIECES: &[Sabotage] = &[
    ("a facet deleted", |p| changed(p, &["data-facet="], 2, gone), "missing"),
    ("a facet twice", |p| changed(p, &["data-facet="], 2, |l| format!("{l}\n{l}")), "double"),
    ("a facet's corner moved by a hundredth of a millimetre", |p| changed(p, &["data-facet="], 1, |l| moved(l, "points", 0.01)), "length"),
    ("a facet of another colour", |p| changed(p, &["data-facet="], 3, |l| with(l, "fill", "#00ff00")), "another colour"),
    (
        "a facet of another colour by a style",
        |p| changed(p, &["data-facet="], 3, |l| l.replacen(" data-", " style=\"fill:#00ff00\" data-", 1)),
        "another colour",
    ),
    ("a facet hidden", |p| changed(p, &["data-facet="], 3, |l| l.replacen(" data-", " visibility=\"hidden\" data-", 1)), "not drawn"),
    ("a facet transparent", |p| changed(p, &["data-facet="], 3, |l| l.replacen(" data-", " opacity=\".5\" data-", 1)), "transparent"),
    ("the colours of all facets", |p| all_changed(p, &["data-facet="], |l| with(l, "fill", "#eeeeee")), "another colour"),
    ("colour beyond an edge deleted", |p| changed(p, &["data-bleed="], 0, gone), "colour beyond edge"),
    ("colour beyond an edge changed", |p| changed(p, &["data-bleed="], 1, |l| with(l, "fill", "#123456")), "another colour"),
    ("colour on a tab deleted", |p| changed(p, &["data-tab-colour="], 0, gone), "colour beyond edge"),
    ("one tab deleted", |p| changed(p, &["data-tab-of="], 0, gone), "0 tabs"),
    ("all tabs deleted", |p| all_changed(p, &["data-tab-of="], gone), "0 tabs"),
    (
        "one tab deleted with all that is on it",
        |p| {
            let mut edge = String::new();
            changed(p, &["data-tab-of="], 0, |l| l.to_owned());
            for line in p.svg[0].lines().filter(|l| l.contains("data-tab-of=")).take(1) {
                edge = attribute(line, "data-tab-of");
            }
            for name in ["data-tab-of", "data-tab-colour", "data-tab"] {
                all_changed(p, &[&format!("{name}=\"{edge}\"")], gone);
            }
        },
        "0 tabs",
    ),
    ("a tab drawn elsewhere", |p| changed(p, &["data-tab-of="], 0, |l| moved(l, "points", 3.0)), "tab"),
    ("a tab in colour", |p| changed(p, &["data-tab-of="], 0, |l| with(l, "fill", "#ff0000")), "another colour"),
    ("a tab's fold deleted", |p| changed(p, &["data-tab=\""], 0, gone), "fold of the tab"),
    ("a tab's fold the other way", |p| changed(p, &["data-tab=\"", "3 0.9"], 0, as_valley), "another kind of line"),
    ("a tab's fold moved", |p| changed(p, &["data-tab=\""], 0, |l| moved(l, "d", 1.0)), "elsewhere"),
    ("a fold deleted", |p| changed(p, &["data-edge="], 1, gone), "fold"),
    ("a fold twice", |p| changed(p, &["data-edge="], 1, |l| format!("{l}\n{l}")), "twice"),
    ("a fold hidden", |p| changed(p, &["data-edge="], 1, |l| with(l, "stroke", "none")), "not drawn"),
    ("a fold white", |p| changed(p, &["data-edge="], 1, |l| with(l, "stroke", "#ffffff")), "another kind of line"),
    (
        "a fold that does not show",
        |p| changed(p, &["data-edge="], 1, |l| l.replacen(" data-", " stroke-opacity=\"0\" data-", 1)),
        "not drawn",
    ),
    ("a fold drawn as the other kind", |p| changed(p, &["data-edge=", "3 0.9"], 0, as_valley), "another kind of line"),
    ("all mountains drawn as valleys", |p| all_changed(p, &["data-edge=", "3 0.9"], as_valley), "another kind of line"),
    ("all folds drawn as mountains", |p| all_changed(p, &["data-edge=", "1.6 1.1"], as_mountain), "another kind of line"),
    ("a fold without dashes", |p| changed(p, &["data-edge="], 0, |l| with(l, "stroke-dasharray", "none")), "another kind of line"),
    ("a fold's angle changed in the data", |p| changed(p, &["data-edge="], 0, |l| moved(l, "data-angle", 5.0)), "fold is off"),
    ("a fold drawn elsewhere", |p| changed(p, &["data-edge="], 0, |l| moved(l, "d", 2.0)), "fold"),
    (
        "a fold shifted by a transform",
        |p| changed(p, &["data-edge="], 0, |l| l.replacen(" data-", " transform=\"translate(2 0)\" data-", 1)),
        "elsewhere",
    ),
    ("a fold of a hair's width", |p| changed(p, &["data-edge="], 0, |l| with(l, "stroke-width", "0.001")), "another kind of line"),
    ("the cut line opened", |p| changed(p, &["data-loop="], 0, |l| l.replace("Z\"", "\"").replace(" Z\"", "\"")), "not cut"),
    ("the cut line deleted", |p| changed(p, &["data-loop="], 0, gone), "not cut"),
    ("the cut line twice", |p| changed(p, &["data-loop="], 0, |l| format!("{l}\n{l}")), "cut where nothing ends"),
    ("the cut line invisible", |p| changed(p, &["data-loop="], 0, |l| with(l, "stroke", "none")), "not cut"),
    ("the cut line not displayed", |p| changed(p, &["data-loop="], 0, |l| l.replacen(" data-", " display=\"none\" data-", 1)), "not cut"),
    ("the cut line white", |p| changed(p, &["data-loop="], 0, |l| with(l, "stroke", "#ffffff")), "another kind of line"),
    (
        "the cut line dashed",
        |p| changed(p, &["data-loop="], 0, |l| l.replacen(" data-", " stroke-dasharray=\"1 1\" data-", 1)),
        "another kind of line",
    ),
    ("the cut line's corner moved", |p| changed(p, &["data-loop="], 0, |l| moved(l, "d", 0.5)), "not cut"),
    (
        "the cut line in the score layer",
        |p| {
            let mut line = String::new();
            for l in p.svg[0].lines().filter(|l| l.contains("data-loop=")).take(1) {
                line = l.to_owned();
            }
            changed(p, &["data-loop="], 0, gone);
            inserted(p, "score", &line);
        },
        "another layer",
    ),
    (
        "an extra cut",
        |p| inserted(p, "cut", "<path d=\"M40 40 L60 60\" fill=\"none\" stroke=\"#000000\" stroke-width=\"0.2\"/>"),
        "nothing of the pattern",
    ),
    (
        "an extra cut that claims to be the piece's",
        |p| {
            inserted(
                p,
                "cut",
                "<path data-piece=\"1\" data-loop=\"7\" d=\"M40 40 L60 60\" fill=\"none\" stroke=\"#000000\" stroke-width=\"0.2\"/>",
            );
        },
        "cut where nothing ends",
    ),
    (
        "an extra score line",
        |p| inserted(p, "score", "<line x1=\"40\" y1=\"40\" x2=\"60\" y2=\"60\" stroke=\"#c03030\" stroke-width=\"0.2\"/>"),
        "nothing of the pattern",
    ),
    (
        "the cut layer shifted",
        |p| p.svg[0] = p.svg[0].replacen("<g id=\"cut\"", "<g transform=\"translate(1 0)\" id=\"cut\"", 1),
        "not cut",
    ),
    (
        "the score layer scaled",
        |p| p.svg[0] = p.svg[0].replacen("<g id=\"score\"", "<g transform=\"scale(1.02)\" id=\"score\"", 1),
        "elsewhere",
    ),
    ("the score layer hidden", |p| p.svg[0] = p.svg[0].replacen("<g id=\"score\"", "<g display=\"none\" id=\"score\"", 1), "not drawn"),
    ("the cut layer transparent", |p| p.svg[0] = p.svg[0].replacen("<g id=\"cut\"", "<g opacity=\"0.1\" id=\"cut\"", 1), "transparent"),
    (
        "the layers' names exchanged",
        |p| {
            p.svg[0] = p.svg[0].replacen("<g id=\"cut\"", "<g id=\"tuc\"", 1).replacen("<g id=\"score\"", "<g id=\"cut\"", 1).replacen(
                "<g id=\"tuc\"",
                "<g id=\"score\"",
                1,
            );
        },
        "another layer",
    ),
    (
        "styles for all lines",
        |p| {
            let at = p.svg[0].find("<rect").unwrap();
            p.svg[0].insert_str(at, "<style>path { stroke: #ffffff !important }</style>");
        },
        "another kind of line",
    ),
    (
        "a white sheet over all",
        |p| {
            let at = p.svg[0].rfind("</svg>").unwrap();
            p.svg[0].insert_str(at, "<rect width=\"210\" height=\"297\" fill=\"#ffffff\"/>");
        },
        "under what is drawn later",
    ),
    (
        "a clip",
        |p| {
            let at = p.svg[0].find("<rect").unwrap();
            p.svg[0].insert_str(at, "<clipPath id=\"c\"><rect width=\"90\" height=\"90\"/></clipPath>");
            p.svg[0] = p.svg[0].replacen("<g id=\"cut\"", "<g clip-path=\"url(#c)\" id=\"cut\"", 1);
        },
        "clipped",
    ),
    ("something in the margin", |p| inserted(p, "print", "<polygon points=\"1,1 9,1 9,9\"/>"), "margin"),
    (
        "the facets over their lines",
        |p| {
            let facets: String = p.svg[0].lines().filter(|l| l.contains("data-facet=")).collect::<Vec<_>>().join("\n");
            all_changed(p, &["data-facet="], gone);
            let at = p.svg[0].rfind("</g>").unwrap();
            p.svg[0].insert_str(at, &facets);
        },
        "under what is drawn later",
    ),
];

const TEXTS: &[Sabotage] = &[
    ("an angle that is wrong", |p| changed(p, &["data-angle-of="], 0, |l| words(l, "17°")), "says something else"),
    ("an angle deleted", |p| changed(p, &["data-angle-of="], 0, gone), "the angle of the fold"),
    (
        "an angle elsewhere",
        |p| changed(p, &["data-angle-of="], 0, |l| moved(&l.replacen("transform=", "data-transform=", 1), "x", 15.0)),
        "not beside",
    ),
    ("a number deleted", |p| changed(p, &["data-number-of=", "<text"], 0, gone), "the number of edge"),
    ("all numbers deleted", |p| all_changed(p, &["data-number-of="], gone), "the number of edge"),
    (
        "a number changed",
        |p| {
            changed(p, &["data-number-of=", "<text"], 0, |l| {
                let t = said(l);
                words(l, &format!("{t}7"))
            });
        },
        "numbers at glued edges are wrong",
    ),
    (
        "a number changed on both sides to one that is used",
        |p| {
            let numbers: Vec<String> = p.svg[0]
                .lines()
                .filter(|l| l.contains("data-number-of=") && l.contains("<text"))
                .map(|l| attribute(l, "data-number-of"))
                .collect();
            let other = p.svg[0]
                .lines()
                .find(|l| l.contains("<text") && l.contains("data-number-of=") && attribute(l, "data-number-of") != numbers[0])
                .map(said)
                .unwrap();
            all_changed(p, &[&format!("data-number-of=\"{}\"", numbers[0]), "<text"], |l| words(l, &other));
        },
        "numbers at glued edges are wrong",
    ),
    (
        "a number moved",
        |p| changed(p, &["data-number-of=", "<text"], 1, |l| moved(&l.replacen("transform=", "data-transform=", 1), "x", 20.0)),
        "not beside",
    ),
    (
        "two numbers exchanged",
        |p| {
            let lines: Vec<String> =
                p.svg[0].lines().filter(|l| l.contains("<text") && l.contains("data-number-of=")).map(str::to_owned).collect();
            let other = lines.iter().find(|l| said(l) != said(&lines[0])).unwrap().clone();
            let (a, b) = (said(&lines[0]), said(&other));
            p.svg[0] = p.svg[0].replacen(&lines[0], &words(&lines[0], &b), 1).replacen(&other, &words(&other, &a), 1);
        },
        "wrong",
    ),
    ("a number too small", |p| changed(p, &["data-number-of=", "<text"], 0, |l| with(l, "font-size", "0.9")), "too small"),
    ("numbers in white", |p| all_changed(p, &["data-number-of=", "<text"], |l| with(l, "fill", "#ffffff")), "too faint"),
    (
        "an upside-down number",
        |p| changed(p, &["text-decoration=\"underline\""], 0, |l| with(l, "text-decoration", "none")),
        "underlined wrongly",
    ),
    ("a piece's number wrong", |p| changed(p, &["data-name=", "<text"], 0, |l| words(l, "77")), "the name of piece"),
    ("a piece's number deleted", |p| changed(p, &["data-name=", "<text"], 0, gone), "the name of piece"),
    (
        "a piece's number elsewhere",
        |p| changed(p, &["data-name=", "<text"], 0, |l| moved(&l.replacen("transform=", "data-transform=", 1), "x", 90.0)),
        "not beside",
    ),
    ("a facet named as another piece's", |p| changed(p, &["data-facet=", "data-piece=\"1\""], 0, |l| with(l, "data-piece", "9")), "piece"),
    (
        "a text that says something",
        |p| inserted(p, "print", "<text x=\"30\" y=\"200\" font-size=\"3\">fold this first</text>"),
        "nothing of the pattern",
    ),
    (
        "a text on another one",
        |p| changed(p, &["data-title="], 0, |l| with(l, "y", &attribute(l, "y").parse::<f64>().map(|y| (y + 3.8).to_string()).unwrap())),
        "on each other",
    ),
];

const FRAME: &[Sabotage] = &[
    ("the bar longer", |p| changed(p, &["data-bar="], 0, |l| l.replacen("110.2", "112.2", 1)), "not true to scale"),
    ("the bar's words", |p| changed(p, &["data-note="], 0, |l| words(l, "90 mm: print at 100 %")), "the note at the bar"),
    ("the bar deleted", |p| changed(p, &["data-bar="], 0, gone), "the bar of 100 mm"),
    ("a tick moved", |p| changed(p, &["data-tick=\"4\""], 0, |l| moved(l, "d", 3.0)), "tick"),
    ("the legend exchanged", |p| all_changed(p, &["data-legend=\"mountain\""], as_valley), "another kind of line"),
    (
        "the legend's words",
        |p| changed(p, &["data-legend-text=\"mountain\""], 0, |l| words(l, "mountain: fold towards you")),
        "the legend of mountain",
    ),
    ("the legend deleted", |p| all_changed(p, &["data-legend=\"valley\""], gone), "the legend of valley"),
    (
        "the number of the page",
        |p| {
            changed(p, &["data-title="], 0, |l| {
                let t = said(l);
                words(l, &t.replace("page 1", "page 2"))
            });
        },
        "the title",
    ),
    ("a page 216 mm wide", |p| p.svg[0] = p.svg[0].replacen("width=\"210mm\"", "width=\"216mm\"", 1), "page"),
    (
        "sizes in pixels",
        |p| p.svg[0] = p.svg[0].replacen("width=\"210mm\"", "width=\"210px\"", 1).replacen("height=\"297mm\"", "height=\"297px\"", 1),
        "page",
    ),
    (
        "another scale by the view box",
        |p| p.svg[0] = p.svg[0].replacen("viewBox=\"0 0 210 297\"", "viewBox=\"0 0 200 282.857\"", 1),
        "elsewhere",
    ),
    ("no size", |p| p.svg[0] = p.svg[0].replacen("width=\"210mm\" height=\"297mm\"", "", 1), "page"),
    (
        "a page missing",
        |p| {
            p.svg.pop();
        },
        "pages",
    ),
    (
        "the picture's colour of one facet",
        |p| changed(p, &["data-of-facet="], 5, |l| with(&with(l, "fill", "#3040ff"), "stroke", "#3040ff")),
        "another colour",
    ),
    ("a part of the picture deleted", |p| changed(p, &["data-of-facet="], 9, gone), "not drawn whole"),
    ("a facet of the picture moved", |p| changed(p, &["data-of-facet="], 9, |l| moved(l, "points", 4.0)), "not drawn whole"),
    ("a picture deleted", |p| all_changed(p, &["data-view=\"from behind and below\""], gone), "from behind and below"),
    ("a number in the picture", |p| changed(p, &["data-piece-at=", "<text"], 0, |l| words(l, "99")), "the number of piece"),
    ("the numbers of the picture deleted", |p| all_changed(p, &["data-piece-at="], gone), "the numbers of the pieces"),
    (
        "the instructions",
        |p| {
            changed(p, &["data-instruction=\"0\""], 0, |l| {
                let t = said(l);
                words(l, &t.replace("away from", "towards"))
            });
        },
        "instructions",
    ),
    ("a piece not listed", |p| all_changed(p, &["data-list=\"1\""], gone), "piece 1 is not listed"),
    (
        "a listed piece's number",
        |p| {
            changed(p, &["data-list=\"1\"", "<text"], 0, |l| {
                let t = said(l);
                words(l, &t.replace("piece 1", "piece 2"))
            });
        },
        "is listed as",
    ),
    (
        "the order",
        |p| {
            changed(p, &["data-list=\"1\"", "<text"], 0, |l| {
                let t = said(l);
                words(l, &format!("4{t}"))
            });
        },
        "order",
    ),
    ("a listed piece's shape", |p| all_changed(p, &["data-list=\"1\"", "<polygon"], |l| moved(l, "points", 9.0)), "shape of piece 1"),
    ("a listed piece's colour", |p| all_changed(p, &["data-list=\"1\"", "<polygon"], |l| with(l, "fill", "#00ff88")), "no shade"),
];

fn run(sabotages: &[Sabotage], pattern: &Printed) -> Vec<String> {
    assert_eq!(pattern.pages(), Vec::<String>::new(), "the pattern is right before");
    sabotages
        .iter()
        .filter_map(|(name, sabotage, word)| {
            let mut bad = pattern.clone();
            sabotage(&mut bad);
            assert!(bad.svg != pattern.svg, "{name}: nothing was changed");
            let found = bad.pages();
            (!found.iter().any(|f| f.contains(word))).then(|| format!("{name}: {found:?}"))
        })
        .collect()
}

/// Coloured, with mountains and valleys, on several pages of the same seed.
fn pattern() -> Printed {
    printed(field(4, 16.0, 9.0, 3, true), &look(), A4, 1)
}

#[test]
fn whatever_is_wrong_with_facets_tabs_and_lines_is_found() {
    let missed = run(PIECES, &pattern());
    assert!(missed.is_empty(), "{} of {} missed\n{}", missed.len(), PIECES.len(), missed.join("\n"));
}

#[test]
fn whatever_is_wrong_with_texts_is_found() {
    let missed = run(TEXTS, &pattern());
    assert!(missed.is_empty(), "{} of {} missed\n{}", missed.len(), TEXTS.len(), missed.join("\n"));
}

#[test]
fn whatever_is_wrong_with_pages_and_their_assembly_is_found() {
    let missed = run(FRAME, &pattern());
    assert!(missed.is_empty(), "{} of {} missed\n{}", missed.len(), FRAME.len(), missed.join("\n"));
}

#[test]
fn what_is_wrong_with_backs_and_registration_marks_is_found() {
    let look = Look { back: true, silhouette: true, ..look() };
    let pattern = printed(l_prism(), &look, Paper { inset: 11.0, ..A4 }, 0);
    let cases: &[Sabotage] = &[
        ("a mark of the cutter moved", |p| changed(p, &["data-registration=", "<polygon"], 0, |l| moved(l, "points", 1.0)), "registration"),
        ("a mark of the cutter deleted", |p| changed(p, &["data-registration=", "<path"], 0, gone), "registration"),
        (
            "the back's folds of the front's kind",
            |p| p.svg[1] = p.svg[1].replace("#3050c0", "#c03030").replace("1.6 1.1", "3 0.9 0.5 0.9"),
            "another kind of line",
        ),
        (
            "a cut line of the back deleted",
            |p| p.svg[1] = p.svg[1].lines().filter(|l| !l.contains("data-loop=")).collect::<Vec<_>>().join("\n"),
            "not cut",
        ),
        (
            "the back not mirrored",
            |p| p.svg[1] = p.svg[1].replacen("<g id=\"print\"", "<g transform=\"matrix(-1 0 0 1 210 0)\" id=\"print\"", 1),
            "elsewhere",
        ),
    ];
    let missed = run(cases, &pattern);
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

/// A way to spoil a FOLD file.
type DataSabotage = (&'static str, fn(&mut Value), &'static str);

#[test]
fn whatever_is_wrong_with_a_fold_file_is_found() {
    let cases: &[DataSabotage] = &[
        ("inches", |f| f["frame_unit"] = json!("in"), "frame_unit"),
        (
            "no unit",
            |f| {
                f.as_object_mut().unwrap().remove("frame_unit");
            },
            "frame_unit",
        ),
        (
            "faces of an edge exchanged",
            |f| {
                let k = f["edges_faces"].as_array().unwrap().iter().position(|s| s[1].is_u64()).unwrap();
                let (a, b) = (f["edges_faces"][k][0].clone(), f["edges_faces"][k][1].clone());
                f["edges_faces"][k] = json!([b, a]);
            },
            "edges_faces",
        ),
        ("a face of an edge that is another's", |f| f["edges_faces"][0] = json!([7, null]), "edges_faces"),
        (
            "a face of a fold deleted",
            |f| {
                let k = f["edges_faces"].as_array().unwrap().iter().position(|s| s[1].is_u64()).unwrap();
                f["edges_faces"][k][1] = Value::Null;
            },
            "edges",
        ),
        (
            "no edges_faces",
            |f| {
                f.as_object_mut().unwrap().remove("edges_faces");
            },
            "edges_faces",
        ),
        ("a facet of another piece", |f| f["faces_biscale:piece"][0] = json!(2), "piece"),
        (
            "a piece's name changed throughout",
            |f| {
                for name in f["faces_biscale:piece"].as_array_mut().unwrap().iter_mut().filter(|n| **n == 1) {
                    *name = json!(40);
                }
            },
            "names of the pieces",
        ),
        ("a copy's number", |f| f["faces_biscale:copy"][0] = json!(5), "piece"),
        (
            "a fold the other way",
            |f| {
                let k = f["edges_assignment"].as_array().unwrap().iter().position(|a| a == "M").unwrap();
                f["edges_assignment"][k] = json!("V");
                f["edges_foldAngle"][k] = json!(-f["edges_foldAngle"][k].as_f64().unwrap());
            },
            "fold is off",
        ),
        (
            "a fold that is a border",
            |f| {
                let k = f["edges_assignment"].as_array().unwrap().iter().position(|a| a == "M").unwrap();
                f["edges_assignment"][k] = json!("B");
            },
            "edges_assignment",
        ),
        (
            "a number deleted",
            |f| {
                let k = f["edges_biscale:number"].as_array().unwrap().iter().position(|n| n.as_u64() > Some(0)).unwrap();
                f["edges_biscale:number"][k] = json!(0);
            },
            "number",
        ),
        (
            "an edge that is another one",
            |f| {
                let a = f["edges_biscale:edge"][0].clone();
                f["edges_biscale:edge"][0] = f["edges_biscale:edge"][3].clone();
                f["edges_biscale:edge"][3] = a;
            },
            "edges_biscale:edge",
        ),
        ("a vertex moved", |f| f["vertices_coords"][0][0] = json!(f["vertices_coords"][0][0].as_f64().unwrap() + 0.1), "length"),
        ("the folded form moved", |f| f["file_frames"][0]["vertices_coords"][0][0] = json!(99.0), "folded form"),
    ];
    let pattern = printed(boxes(2, 30.0), &look(), A4, 0);
    assert_eq!(pattern.data(), Vec::<String>::new());
    let pattern = printed(field(4, 16.0, 9.0, 3, true), &look(), A4, 1);
    assert_eq!(pattern.data(), Vec::<String>::new());
    let missed: Vec<String> = cases
        .iter()
        .filter_map(|(name, sabotage, word)| {
            let mut bad = pattern.clone();
            sabotage(&mut bad.fold);
            assert!(bad.fold != pattern.fold, "{name}: nothing was changed");
            let found = bad.data();
            (!found.iter().any(|f| f.contains(word))).then(|| format!("{name}: {found:?}"))
        })
        .collect();
    assert!(missed.is_empty(), "{} of {} missed\n{}", missed.len(), cases.len(), missed.join("\n"));
}

#[test]
fn there_are_more_ways_to_spoil_a_pattern_than_were_counted() {
    assert!(PIECES.len() + TEXTS.len() + FRAME.len() >= 63, "{}", PIECES.len() + TEXTS.len() + FRAME.len());
}
