//! Writes the photographs of a made-up phone around a cylinder, as they come off it, into a folder, which `biscale capture FOLDER` sorts:
//! `cargo run --release -p biscale-capture --example phone -- FOLDER`.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example that makes files for a demonstration")]

#[path = "../tests/support/mod.rs"]
mod support;

fn main() {
    let folder = std::path::PathBuf::from(std::env::args_os().nth(1).expect("name a folder"));
    std::fs::create_dir_all(&folder).unwrap();
    let shoot = support::phone::shoot();
    for photo in shoot.usual() {
        std::fs::write(folder.join(&photo.name), photo.bytes()).unwrap();
    }
    std::fs::write(folder.join("kit.json"), &shoot.sidecar).unwrap();
    println!("wrote {}", folder.display());
}
