//! A folder as the output of a command: filled beside its place, and moved there when it is whole.

use super::target::list_unfinished;
use super::unfinished;
use biscale::error::{BadInput, Error, Result};
use std::path::{Path, PathBuf};

/// A folder to be written.
#[derive(Debug)]
pub struct OutputFolder {
    /// As the user named it.
    path: PathBuf,
    /// Something stands there that may be replaced.
    replace: bool,
}

impl OutputFolder {
    /// Checks that `path` can be written, before any work is done. A folder that exists is refused unless it is empty, `force`, or `made_here` says that the
    /// same command made it.
    ///
    /// # Errors
    /// Bad input if something else stands there or the folder around it is missing.
    pub fn new(path: &Path, force: bool, made_here: impl Fn(&Path) -> bool) -> Result<Self> {
        let bad = |problem: String, remedy: &str| Error::from(BadInput::new(problem, remedy).in_file(path));
        if path.file_name().is_none() {
            return Err(bad("this is not the name of a folder to make".into(), "name a new folder"));
        }
        if path.is_file() {
            return Err(bad("the output is a file".into(), "name a folder"));
        }
        let around = around(path);
        if !around.is_dir() {
            return Err(bad(format!("there is no folder {}", around.display()), "create it first, or name another output"));
        }
        unfinished::sweep(around);
        let replace = path.is_dir();
        if replace && !force {
            let empty = std::fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_none());
            if !empty && !made_here(path) {
                return Err(bad(
                    "this folder exists and was not made by this command".into(),
                    "name another one, or replace it with --force",
                ));
            }
        }
        Ok(Self { path: path.to_path_buf(), replace })
    }

    /// Fills the folder by `content`. After an error nothing is left of it. In a folder that exists, files of the same names are replaced and all others stay.
    ///
    /// # Errors
    /// Those of `content`; i/o.
    pub fn write<T>(&self, content: impl FnOnce(&Path) -> Result<T>) -> Result<T> {
        let failed = |source| Error::Io { action: "write", path: self.path.clone(), source };
        let prefix = unfinished::prefix();
        let temporary =
            tempfile::Builder::new().prefix(&prefix).suffix(unfinished::SUFFIX).tempdir_in(around(&self.path)).map_err(failed)?;
        // A folder is locked as a file is, where the system opens it as one.
        let _lock = std::fs::File::open(temporary.path()).inspect(unfinished::claim);
        #[cfg(unix)]
        {
            // As any program makes a folder; a temporary one is for its owner only.
            use std::os::unix::fs::PermissionsExt as _;
            std::fs::set_permissions(temporary.path(), std::fs::Permissions::from_mode(0o755)).map_err(failed)?;
        }
        let listed = list_unfinished(temporary.path());
        let out = content(temporary.path())?;
        if self.replace {
            // What else the user keeps there stays. The index of the command comes last: a folder without it is not whole.
            let mut files: Vec<PathBuf> = std::fs::read_dir(temporary.path())
                .map_err(failed)?
                .map(|e| e.map(|e| e.path()))
                .collect::<Result<_, _>>()
                .map_err(failed)?;
            files.sort_by_key(|f| f.extension().is_some_and(|e| e == "json"));
            for file in files {
                let name = file.file_name().unwrap_or_default();
                std::fs::rename(&file, self.path.join(name)).map_err(failed)?;
            }
            return Ok(out);
        }
        std::fs::rename(temporary.path(), &self.path).map_err(failed)?;
        // It has its name: nothing is left to remove.
        let _ = temporary.keep();
        drop(listed);
        Ok(out)
    }
}

fn around(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_appears_whole_or_not_at_all() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out");
        let target = || OutputFolder::new(&path, false, |p| p.join("mark").exists());
        let fill =
            |text: &'static str| move |folder: &Path| std::fs::write(folder.join("mark"), text).map_err(|e| Error::Numeric(e.to_string()));
        let failure = target().unwrap().write(|f| fill("half")(f).and(Err::<(), _>(Error::Interrupted)));
        assert!(matches!(failure, Err(Error::Interrupted)));
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 0);
        target().unwrap().write(fill("one")).unwrap();
        target().unwrap().write(fill("two")).unwrap();
        assert_eq!(std::fs::read_to_string(path.join("mark")).unwrap(), "two");
        assert_eq!(std::fs::read_dir(place.path()).unwrap().count(), 1);
        // What someone else made stays.
        std::fs::rename(path.join("mark"), path.join("precious")).unwrap();
        assert!(matches!(target(), Err(Error::BadInput(_))));
        OutputFolder::new(&path, true, |_| false).unwrap().write(fill("three")).unwrap();
        assert_eq!(std::fs::read_dir(&path).unwrap().count(), 2);
        assert!(OutputFolder::new(&path.join("precious"), true, |_| true).is_err());
        assert!(OutputFolder::new(&place.path().join("no/out"), true, |_| true).is_err());
    }
}
