//! `biscale cache`: the compressed BRDFs that `--method lowrank` keeps between runs.

use crate::common::lowrank_cache::{VARIABLE, user_cache};
use crate::common::options::CommonArgs;
use crate::common::output;
use biscale::error::{Error, Result};
use biscale::filter::MatrixCache;
use biscale::filter::low_rank::CacheEntry;
use clap::{Args, Subcommand};
use serde::Serialize;
use std::time::SystemTime;

/// Arguments of `biscale cache`.
#[derive(Args, Debug)]
#[command(
    after_help = "The folder is the user's cache folder, or the one that BISCALE_CACHE names. All its files together take at most 4 GiB; \
    the least recently used go first. --no-cache of other commands neither reads nor writes it."
)]
pub struct CacheArgs {
    #[command(subcommand)]
    action: Action,
}

/// What to do.
#[derive(Subcommand, Debug)]
enum Action {
    /// List the files: what they hold, their size, when they were last used
    List,
    /// Remove all files
    Clear,
}

/// Runs the command.
///
/// # Errors
/// [`Error::Io`] for files that cannot be read or removed; [`Error::Unsupported`] where there is no folder for caches.
pub fn run(args: &CacheArgs, common: &CommonArgs) -> Result<()> {
    let cache = user_cache().ok_or_else(|| Error::Unsupported {
        what: "a cache on a system that names no folder for it".to_owned(),
        remedy: format!("set {VARIABLE} to a folder"),
    })?;
    match args.action {
        Action::List => list(&cache, common),
        Action::Clear => {
            let (files, bytes) = cache.clear()?;
            if common.json {
                return output::print_json(&Cleared { folder: cache.folder.display().to_string(), files, bytes });
            }
            output::tell(common, &format!("removed {files} files, {}, from {}", size(bytes), cache.folder.display()));
            Ok(())
        }
    }
}

fn list(cache: &MatrixCache, common: &CommonArgs) -> Result<()> {
    let entries = cache.list()?;
    let bytes = entries.iter().map(|e| e.bytes).sum();
    if common.json {
        let entries = entries.iter().map(Listed::from).collect();
        return output::print_json(&List { folder: cache.folder.display().to_string(), bytes, max_bytes: cache.max_bytes, entries });
    }
    let mut text = String::new();
    for entry in &entries {
        let what = entry.label.as_deref().unwrap_or("damaged, or of another version: it is not used");
        let name = entry.path.file_name().unwrap_or_default().to_string_lossy();
        text += &format!("{:>10}  {:>12}  {}  {what}\n", size(entry.bytes), age(entry.used), &name[..name.len().min(12)]);
    }
    text += &format!("{} files, {} of {}, in {}\n", entries.len(), size(bytes), size(cache.max_bytes), cache.folder.display());
    output::print(&text)
}

/// The output of `list --json`.
#[derive(Serialize)]
struct List {
    folder: String,
    bytes: u64,
    max_bytes: u64,
    entries: Vec<Listed>,
}

/// One file.
#[derive(Serialize)]
struct Listed {
    path: String,
    bytes: u64,
    seconds_since_use: f64,
    label: Option<String>,
}

impl From<&CacheEntry> for Listed {
    fn from(entry: &CacheEntry) -> Self {
        Self {
            path: entry.path.display().to_string(),
            bytes: entry.bytes,
            seconds_since_use: seconds_since(entry.used),
            label: entry.label.clone(),
        }
    }
}

/// The output of `clear --json`.
#[derive(Serialize)]
struct Cleared {
    folder: String,
    files: usize,
    bytes: u64,
}

fn seconds_since(time: SystemTime) -> f64 {
    SystemTime::now().duration_since(time).unwrap_or_default().as_secs_f64()
}

/// A size for people.
fn size(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.1} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.2} GB", bytes as f64 / 1e9),
    }
}

/// How long ago, for people.
fn age(time: SystemTime) -> String {
    let seconds = seconds_since(time);
    let (number, unit) = if seconds < 90.0 {
        (seconds, "s")
    } else if seconds < 5400.0 {
        (seconds / 60.0, "min")
    } else if seconds < 129_600.0 {
        (seconds / 3600.0, "h")
    } else {
        (seconds / 86_400.0, "days")
    };
    format!("{number:.0} {unit} ago")
}
