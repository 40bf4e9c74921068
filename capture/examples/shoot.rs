//! Writes the photographs of a made-up shoot and its shoot file into a folder: `cargo run --release -p biscale-capture --example shoot -- FOLDER [WIDTH]`.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "an example that makes files for a demonstration")]

#[path = "../tests/support/mod.rs"]
mod support;

fn main() {
    let mut arguments = std::env::args_os().skip(1);
    let folder = std::path::PathBuf::from(arguments.next().expect("name a folder"));
    let width = arguments.next().map_or(1200, |w| w.to_string_lossy().parse().expect("a width in pixels"));
    std::fs::create_dir_all(&folder).unwrap();
    support::flat_shoot::FlatShoot::write(&folder, width);
    println!("wrote {}", folder.join("shoot.toml").display());
}
