//! `biscale new weave --wif` and `biscale list`: what is written and listed can be used as it is.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use serde_json::Value;
use support::{Folder, project};

#[test]
fn a_weave_after_a_draft_has_its_colours_and_passes_check() {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("drafts")).unwrap();
    std::fs::copy(project("samples/8452.wif"), folder.path("drafts/8452.wif")).unwrap();
    let said = folder.run(["new", "weave", "--wif", "drafts/8452.wif", "towel.toml"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let text = folder.read("towel.toml");
    for line in
        ["wif = \"drafts/8452.wif\"", "part = \"warp-1\"\nbrdf = { model = \"lambert\", albedo = [0.0, 0.13, 0.0] }", "part = \"weft-2\""]
    {
        assert!(text.contains(line), "no {line:?} in {text}");
    }
    let said = folder.run(["check", "towel.toml"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    // A draft without colours has a part a direction.
    folder.write("plain.wif", "[WIF]\nVersion=1.1\n[CONTENTS]\nTHREADING=1\nTIEUP=1\nTREADLING=1\nWARP=1\nWEFT=1\n[WEAVING]\nShafts=2\nTreadles=2\n[WARP]\nThreads=2\n[WEFT]\nThreads=2\n[THREADING]\n1=1\n2=2\n[TIEUP]\n1=1\n2=2\n[TREADLING]\n1=1\n2=2\n");
    let said = folder.run(["new", "weave", "--wif", "plain.wif", "-"]);
    assert!(
        said.status == 0 && said.stdout.contains("part = \"warp\"") && said.stdout.contains("no colours"),
        "{}{}",
        said.stdout,
        said.stderr
    );
}

#[test]
fn a_draft_that_is_none_and_a_kind_that_takes_none_are_refused() {
    let folder = Folder::new();
    for (arguments, words) in [
        (&["new", "rods", "--wif", "p.csv", "r.toml"][..], &["--wif", "new weave"][..]),
        (&["new", "weave", "--wif", "no.wif", "r.toml"], &["no.wif", "no such file"]),
        (&["new", "weave", "--wif", "p.csv", "r.toml"], &["p.csv"]),
    ] {
        let said = folder.run(arguments);
        assert_eq!(said.status, 2, "{arguments:?}: {}", said.stderr);
        assert!(words.iter().all(|word| said.stderr.contains(word)), "{arguments:?}: {}", said.stderr);
        assert!(!folder.path("r.toml").exists());
    }
}

#[test]
fn built_in_brdfs_are_listed_and_each_can_be_used() {
    let folder = Folder::new();
    let said = folder.run(["list", "brdfs", "--json"]);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    let brdfs = object["brdfs"].as_array().unwrap();
    assert_eq!(brdfs.len(), 100);
    let gold = brdfs.iter().find(|b| b["name"] == "gold-metallic-paint").unwrap();
    let [r, g, b] = [0, 1, 2].map(|c| gold["albedo"][c].as_f64().unwrap());
    assert!(r > g && g > b && r < 1.0, "gold reflects {r} {g} {b}");
    let lines = folder.run(["list", "brdfs"]).stdout;
    assert!(lines.lines().count() == 100 && lines.contains("\nwhite-fabric "), "{lines}");
    folder.write(
        "g.toml",
        support::MATERIAL.replace("model = \"lambert\", albedo = 0.5", "model = \"measured\", name = \"gold-metallic-paint\""),
    );
    assert_eq!(folder.run(["check", "g.toml"]).status, 0);
    assert_eq!(folder.run(["list", "brdfs", "-o", "balls.jpg"]).status, 2);
}

#[test]
fn what_a_capture_needs_is_printed_with_its_sidecar() {
    use biscale_capture::kit::{Kit, PrintedBoard};
    let folder = Folder::new();
    let said = folder.run(["new", "board", "kit.pdf"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(said.stderr.contains("100 %") && said.stderr.contains("biscale capture FOLDER"), "{}", said.stderr);
    let pdf = std::fs::read(folder.path("kit.pdf")).unwrap();
    assert!(pdf.starts_with(b"%PDF"));
    // A4 in points: the board and the sheet on a page each.
    let boxes = pdf.windows(10).filter(|w| w.starts_with(b"/MediaBox")).count();
    assert_eq!(boxes, 2, "pages");
    let kit = Kit::read(&[folder.path("kit.json")]).unwrap();
    assert!(kit.board_told && kit.board == PrintedBoard::standard());
    let (_, sheet) = kit.sheet.unwrap();
    assert_eq!(sheet.target, biscale_capture::sheet::Target::Cylinder { radius: 30.0, height: 60.0 });
    assert!(sheet.markers.len() > 15 && sheet.markers.iter().all(|m| m.id < 76), "{}", sheet.markers.len());
    // Neither is replaced unasked.
    assert_eq!(folder.run(["new", "board", "kit.pdf"]).status, 2);
    let said = folder.run(["new", "board", "plane.pdf", "--on", "plane:width=100,height=80", "--page", "letter", "--json"]);
    let object: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!((said.status, &object["pages"], &object["sidecar"]), (0, &Value::from(2), &Value::from("plane.json")));
    for (arguments, words) in [
        (&["new", "board", "kit.svg"][..], &["kit.svg", ".pdf"][..]),
        (&["new", "board", "c.pdf", "--on", "cone:radius=30,height=50"], &["--on", "cylinder or a plane"]),
        (&["new", "board", "c.pdf", "--page", "a7"], &["--page", "a4"]),
        (&["new", "board", "c.pdf", "--on", "plane:width=900,height=900", "--page", "roll:1200"], &["the board's"]),
        (&["new", "rods", "r.toml", "--on", "plane:width=10,height=8"], &["--on", "new board"]),
    ] {
        let said = folder.run(arguments);
        assert_eq!(said.status, 2, "{arguments:?}: {}", said.stderr);
        assert!(words.iter().all(|word| said.stderr.contains(word)), "{arguments:?}: {}", said.stderr);
        assert!(!folder.path("c.pdf").exists() && !folder.path("c.json").exists());
    }
}
