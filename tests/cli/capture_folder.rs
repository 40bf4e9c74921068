//! `biscale capture FOLDER` through the binary: what it writes, what it says, and that the command it names next works.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

#[path = "../../capture/tests/support/mod.rs"]
mod studio;

use serde_json::Value;
use studio::phone::{Photo, shoot};
use support::Folder;

/// A folder `photos` with these photographs and the sidecar.
fn folder_of(photos: &[Photo]) -> Folder {
    let folder = Folder::new();
    std::fs::create_dir(folder.path("photos")).unwrap();
    for photo in photos {
        std::fs::write(folder.path("photos").join(&photo.name), photo.bytes()).unwrap();
    }
    folder.write("photos/kit.json", &shoot().sidecar);
    folder
}

#[test]
fn a_folder_is_sorted_and_the_next_command_measures_it() {
    let folder = folder_of(&shoot().usual());
    let said = folder.run(["capture", "photos"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    for words in [
        "11 views, IMG_0001.JPG to IMG_0011.JPG",
        "close-up    IMG_0015.JPG",
        "distant     IMG_0016.JPG",
        "wrote photos/shoot.toml",
        "next: biscale capture photos/shoot.toml -o photos/captured --assume-srgb",
    ] {
        assert!(said.stderr.contains(words), "no {words:?} in {}", said.stderr);
    }
    let said = folder.run(["check", "photos/shoot.toml"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    let said = folder.run(["capture", "photos/shoot.toml", "-o", "photos/captured", "--assume-srgb", "--json"]);
    let json: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!((said.status, &json["usable"]), (0, &Value::Bool(true)), "{}", said.stderr);
    // What a person edited is not overwritten.
    let said = folder.run(["capture", "photos"]);
    assert!(said.status == 2 && said.stderr.contains("--force"), "{}", said.stderr);
    let said = folder.run(["capture", "photos", "--force", "--json"]);
    let json: Value = serde_json::from_str(&said.stdout).unwrap();
    assert_eq!((&json["complete"], &json["photographs"]["close-up"][0]), (&Value::Bool(true), &Value::from("IMG_0015.JPG")));
}

#[test]
fn what_is_missing_is_named_and_nothing_is_written() {
    let photos: Vec<Photo> =
        shoot().usual().into_iter().filter(|p| !["IMG_0015.JPG", "IMG_0014.JPG", "IMG_0019.JPG"].contains(&&*p.name)).collect();
    let folder = folder_of(&photos);
    let before = folder.snapshot();
    let said = folder.run(["capture", "photos"]);
    assert_eq!(said.status, 2, "{}", said.stderr);
    for words in ["a close-up", "8 pixels", "the direction of the lamp of IMG_0016.JPG", "mirror ball", "--incomplete"] {
        assert!(said.stderr.contains(words), "no {words:?} in {}", said.stderr);
    }
    assert!(folder.snapshot() == before);
    let said = folder.run(["capture", "photos", "--incomplete", "--quiet"]);
    assert_eq!(said.status, 0, "{}", said.stderr);
    assert!(
        folder.read("photos/shoot.toml").contains("# Missing: a close-up: photograph the sample"),
        "{}",
        folder.read("photos/shoot.toml")
    );
    // A folder is not captured in one go, and a shoot file not without a name for the output.
    let said = folder.run(["capture", "photos", "-o", "captured"]);
    assert!(said.status == 2 && said.stderr.contains("capture photos/shoot.toml -o captured"), "{}", said.stderr);
    let said = folder.run(["capture", "photos/shoot.toml"]);
    assert!(said.status == 2 && said.stderr.contains("-o captured"), "{}", said.stderr);
}
