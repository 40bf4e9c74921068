//! Temporary files and folders beside outputs: whose they are, and the end of those that a killed process left.
//!
//! A name says host and process, and whoever writes holds a lock on it until it ends, however it ends. So one is left over where its name says this host, nobody
//! holds its lock, and no process has its number; a number that came to another process counts for nothing after [`LONG_AGO`]. What another host wrote is never
//! touched: its processes are not seen from here, and locks need not cross a network.

use std::collections::BTreeSet;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::Duration;

/// Age from which on the number of a process says nothing. Chosen, not measured: no process is this long between creating a file and locking it.
const LONG_AGO: Duration = Duration::from_secs(3600);
/// The end of all names.
pub(super) const SUFFIX: &str = ".part";

/// This host as names say it, where the system tells.
static HOST: LazyLock<Option<String>> =
    LazyLock::new(|| Some(in_names(std::fs::read_to_string("/proc/sys/kernel/hostname").ok()?.trim())).filter(|name| !name.is_empty()));

/// The name of a host as names of files say it: two hosts never alike, and without dashes, so that one ends it.
fn in_names(host: &str) -> String {
    host.bytes().map(|b| if b.is_ascii_alphanumeric() { char::from(b).to_string() } else { format!("_{b:02x}") }).collect()
}

/// The beginning of the names of this process.
pub(super) fn prefix() -> String {
    format!(".biscale-{}-{}-", HOST.as_deref().unwrap_or(""), std::process::id())
}

/// Locks what this process writes, until `file` is closed. A file system without locks has none; there [`sweep`] finds nothing left over.
pub(super) fn claim(file: &File) {
    let _ = file.try_lock_shared();
}

/// Removes what processes that are no more left in `folder`; looks at each folder once. What cannot be read or removed stays.
pub(super) fn sweep(folder: &Path) {
    static SWEPT: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let Ok(real) = folder.canonicalize() else { return };
    if !SWEPT.lock().unwrap_or_else(PoisonError::into_inner).insert(real.clone()) {
        return;
    }
    let (Some(host), Ok(entries)) = (HOST.as_deref(), std::fs::read_dir(real)) else { return };
    for entry in entries.flatten() {
        if process(&entry.file_name().to_string_lossy(), host).is_some_and(|process| is_left_over(&entry.path(), process).unwrap_or(false))
        {
            let path = entry.path();
            let _ = if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
        }
    }
}

/// The process that a temporary name of this host says.
fn process(name: &str, host: &str) -> Option<u32> {
    let (process, random) = name.strip_prefix(".biscale-")?.strip_prefix(host)?.strip_prefix('-')?.strip_suffix(SUFFIX)?.split_once('-')?;
    (!random.is_empty()).then_some(())?;
    process.parse().ok()
}

fn is_left_over(path: &Path, process: u32) -> io::Result<bool> {
    let metadata = std::fs::symlink_metadata(path)?;
    if !metadata.is_file() && !metadata.is_dir() {
        return Ok(false);
    }
    let is_old = || metadata.modified().is_ok_and(|time| time.elapsed().is_ok_and(|age| age > LONG_AGO));
    let lives = process == std::process::id() || !Path::new("/proc/self").exists() || Path::new(&format!("/proc/{process}")).exists();
    if process == std::process::id() || (lives && !is_old()) {
        return Ok(false);
    }
    // Whoever writes holds it shared: this succeeds if nobody does.
    Ok(File::open(path)?.try_lock().is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hosts_that_differ_in_punctuation_have_names_of_their_own() {
        let hosts = ["render-1", "render1", "render.1", "render_1", "ren-der1", "render_2d1"];
        let mut names: Vec<String> = hosts.iter().map(|host| in_names(host)).collect();
        assert!(names.iter().all(|name| !name.contains(['-', '/', '.'])), "{names:?}");
        names.sort();
        names.dedup();
        assert_eq!(names.len(), hosts.len());
    }

    /// The number of a process that has ended.
    fn dead() -> u32 {
        let mut child = std::process::Command::new("true").spawn().unwrap();
        child.wait().unwrap();
        child.id()
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn only_what_a_dead_process_of_this_host_left_goes() {
        let folder = tempfile::tempdir().unwrap();
        let host = HOST.as_deref().unwrap();
        let dead = dead();
        let name = |host: &str, process: u32, rest: &str| folder.path().join(format!(".biscale-{host}-{process}-{rest}"));
        let left = [name(host, dead, "a.part"), name(host, dead, "b.part")];
        std::fs::write(&left[0], "half").unwrap();
        std::fs::create_dir(&left[1]).unwrap();
        std::fs::write(left[1].join("inner"), "half").unwrap();
        let kept = [
            name("another", dead, "a.part"),
            name(host, std::process::id(), "a.part"),
            // The first process lives as long as the machine.
            name(host, 1, "a.part"),
            name(host, dead, "a.png"),
            name(host, dead, ".part"),
            folder.path().join(".biscale-AbCdEf.part"),
            folder.path().join("mine.part"),
            name(host, dead, "locked.part"),
        ];
        kept.iter().for_each(|path| std::fs::write(path, "kept").unwrap());
        let locked = File::open(&kept[7]).unwrap();
        claim(&locked);
        sweep(folder.path());
        assert!(left.iter().all(|path| !path.exists()), "{left:?}");
        assert!(kept.iter().all(|path| path.exists()), "{:?}", kept.iter().find(|path| !path.exists()));
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_number_that_came_to_another_process_keeps_nothing_for_ever() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!(".biscale-{}-1-a.part", HOST.as_deref().unwrap()));
        let file = File::create(&path).unwrap();
        file.set_modified(std::time::SystemTime::now() - 2 * LONG_AGO).unwrap();
        claim(&file);
        assert!(!is_left_over(&path, 1).unwrap());
        drop(file);
        assert!(is_left_over(&path, 1).unwrap());
    }
}
