//! What `biscale --version` says beside the version: commit, features, target and profile.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let features = if std::env::var_os("CARGO_FEATURE_CAPTURE").is_some() { "capture (OpenCV)" } else { "none (without capture)" };
    println!("cargo::rustc-env=BISCALE_FEATURES={features}");
    println!("cargo::rustc-env=BISCALE_TARGET={}", std::env::var("TARGET").unwrap_or_else(|_| "unknown".to_owned()));
    println!("cargo::rustc-env=BISCALE_PROFILE={}", profile().unwrap_or_else(|| "unknown".to_owned()));
    println!("cargo::rustc-env=BISCALE_COMMIT={}", commit().unwrap_or_else(|| "unknown".to_owned()));
}

/// The profile's folder, which stands above `build/PACKAGE/out`: cargo tells of a profile only whether it is like `debug` or `release`.
fn profile() -> Option<String> {
    let out = std::env::var("OUT_DIR").ok()?;
    Some(Path::new(&out).ancestors().nth(3)?.file_name()?.to_str()?.to_owned())
}

/// The commit of the checkout, if this is one. The script runs again after a commit or a checkout only: git logs both in `logs/HEAD`.
fn commit() -> Option<String> {
    let root = Path::new("..");
    if !root.join(".git").exists() {
        return None;
    }
    let git = |arguments: &[&str]| -> Option<String> {
        let output = Command::new("git").args(arguments).current_dir(root).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    };
    for name in ["HEAD", "logs/HEAD"] {
        let path = root.join(git(&["rev-parse", "--git-path", name])?);
        // A path that is not there would make the script run every time.
        if path.exists() {
            println!("cargo::rerun-if-changed={}", path.display());
        }
    }
    git(&["rev-parse", "--short=12", "HEAD"])
}
