//! The files of a folder: which are photographs, and which of these are the same.

use crate::photo;
use biscale::bounded_file::{MAX_DATA_BYTES, read_bounded};
use biscale::error::{BadInput, Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What lies in a folder.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// Photographs that can be read, by name; of files with the same bytes the first.
    pub photographs: Vec<PathBuf>,
    /// JSON files, which may be sidecars.
    pub sidecars: Vec<PathBuf>,
    /// What is told of files that are not used.
    pub notes: Vec<String>,
    /// Files that would be photographs if they were converted, with the remedy.
    pub unread: Vec<(PathBuf, String)>,
    /// Folders in it that hold photographs.
    pub folders: Vec<PathBuf>,
}

/// Endings from the best to the worst for measuring: of one photograph in several formats the first is taken.
const BEST: [&str; 6] = ["exr", "tif", "tiff", "png", "jpg", "jpeg"];
/// Endings of what cameras, phones and this program lay beside photographs.
const BESIDE: [&str; 19] =
    ["aae", "xmp", "thm", "mov", "mp4", "m4v", "lrv", "txt", "toml", "csv", "pdf", "html", "svg", "ini", "db", "zip", "md", "log", "wif"];

/// Lists a folder.
///
/// # Errors
/// I/o; bad input if the folder holds nothing that could be a photograph.
pub fn gather(folder: &Path) -> Result<Gathered> {
    let failed = |source| Error::Io { action: "read", path: folder.to_path_buf(), source };
    let mut names: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        names.push(entry.map_err(failed)?.path());
    }
    names.sort();
    let mut out = Gathered::default();
    // Readable files by their name without ending: one photograph in several formats.
    let mut stems: BTreeMap<String, Vec<PathBuf>> = BTreeMap::new();
    for path in names {
        let name = name(&path);
        if name.starts_with('.') {
            continue;
        }
        if path.is_dir() {
            if holds_photographs(&path) {
                out.folders.push(path);
            }
            continue;
        }
        let ending = photo::ending(&path);
        if ending == "json" {
            out.sidecars.push(path);
        } else if photo::ENDINGS.contains(&&*ending) {
            stems.entry(stem(&path)).or_default().push(path);
        } else if let Some(bad) = photo::why_not_read(&path).filter(|_| !BESIDE.contains(&&*ending)) {
            out.unread.push((path, format!("{}; {}", bad.problem, bad.remedy)));
        }
    }
    let mut chosen = Vec::new();
    for files in stems.values() {
        let mut files = files.clone();
        files.sort_by_key(|f| BEST.iter().position(|e| *e == photo::ending(f)));
        for other in &files[1..] {
            out.notes.push(format!("{}: the same photograph as {}, which is taken", name(other), name(&files[0])));
        }
        chosen.push(files.swap_remove(0));
    }
    out.unread.retain(|(path, why)| match stems.get(&stem(path)) {
        Some(files) => {
            out.notes.push(format!("{}: {} lies beside it and is taken ({why})", name(path), name(&files[0])));
            false
        }
        None => true,
    });
    without_twins(chosen, &mut out)?;
    if out.photographs.is_empty() && out.unread.is_empty() {
        let problem = format!("there are no photographs in {}", folder.display());
        let remedy = match out.folders.first() {
            Some(inner) => format!("name the folder that holds them, such as {}", inner.display()),
            None => "copy the photographs of the shoot into one folder, and name that".to_owned(),
        };
        return Err(BadInput::new(problem, remedy).into());
    }
    Ok(out)
}

/// Of files with the same bytes the first by name.
fn without_twins(files: Vec<PathBuf>, out: &mut Gathered) -> Result<()> {
    let mut sizes: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
    for (k, file) in files.iter().enumerate() {
        sizes.entry(std::fs::metadata(file).map_or(0, |m| m.len())).or_default().push(k);
    }
    let mut twin = vec![None; files.len()];
    for same in sizes.values().filter(|s| s.len() > 1) {
        let bytes: Vec<Vec<u8>> =
            same.iter().map(|&k| read_bounded(&files[k], MAX_DATA_BYTES, "no photograph is so large")).collect::<Result<_>>()?;
        for i in 1..same.len() {
            twin[same[i]] = (0..i).find(|&j| bytes[j] == bytes[i]).map(|j| same[j]);
        }
    }
    for (k, file) in files.iter().enumerate() {
        match twin[k] {
            Some(first) => out.notes.push(format!("{}: the same bytes as {}", name(file), name(&files[first]))),
            None => out.photographs.push(file.clone()),
        }
    }
    Ok(())
}

fn holds_photographs(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    entries.flatten().any(|e| photo::ENDINGS.contains(&&*photo::ending(&e.path())))
}

/// A file's own name.
pub(super) fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The name without its ending, in lower case.
fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().to_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_beside_photographs_is_passed_over_and_each_is_taken_once() {
        let folder = tempfile::tempdir().unwrap();
        for (file, bytes) in [
            (".DS_Store", "x"),
            ("Thumbs.db", "x"),
            ("IMG_1.AAE", "x"),
            ("IMG_1.HEIC", "heic"),
            ("IMG_1.JPG", "one"),
            ("IMG_2.jpg", "two"),
            ("IMG_2 (1).jpg", "two"),
            ("IMG_3.DNG", "raw"),
            ("IMG_4.tif", "fine"),
            ("IMG_4.jpg", "coarse"),
            ("kit.json", "{}"),
        ] {
            std::fs::write(folder.path().join(file), bytes).unwrap();
        }
        let found = gather(folder.path()).unwrap();
        let names: Vec<String> = found.photographs.iter().map(|p| name(p)).collect();
        assert_eq!(names, ["IMG_1.JPG", "IMG_2.jpg", "IMG_4.tif"]);
        assert_eq!((found.sidecars.len(), found.unread.len()), (1, 1));
        assert!(found.unread[0].1.contains("-t 0"), "{}", found.unread[0].1);
        let told = found.notes.join("\n");
        for words in
            ["IMG_2 (1).jpg: the same bytes as IMG_2.jpg", "IMG_1.HEIC: IMG_1.JPG lies beside it", "IMG_4.jpg: the same photograph"]
        {
            assert!(told.contains(words), "no {words:?} in {told}");
        }
    }

    #[test]
    fn an_empty_folder_says_where_the_photographs_may_be() {
        let folder = tempfile::tempdir().unwrap();
        assert!(gather(folder.path()).unwrap_err().to_string().contains("copy the photographs"));
        std::fs::create_dir(folder.path().join("100APPLE")).unwrap();
        std::fs::write(folder.path().join("100APPLE/IMG_1.JPG"), "x").unwrap();
        assert!(gather(folder.path()).unwrap_err().to_string().contains("100APPLE"));
    }
}
