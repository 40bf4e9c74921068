//! The folder of a study: what is written where, and whether what is there belongs to the same study.

use crate::common::figure::Svg;
use crate::common::output::{self, Target};
use crate::common::pairs::COLUMNS;
use biscale::direction::Pair;
use biscale::error::{BadInput, Error, Result};
use biscale::study::{Asked, Truth};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// What the study asks; it goes on only where this is the same.
pub const STUDY: &str = "study.json";
/// A line a run.
pub const CSV: &str = "study.csv";
/// The report.
pub const REPORT: &str = "report.html";
/// The pairs of the list.
pub const PAIRS: &str = "pairs.csv";
/// The pairs of the table that are judged.
const JUDGED: &str = "pairs-table.csv";
/// Compressed BRDFs while a study runs; not the user's own, so that what computing them takes is seen.
pub const CACHE: &str = ".lowrank-cache";
/// What pictures say of who made them.
pub const MARK: &str = "made by biscale study";
/// Pixels of a PNG for one of the SVG.
const SCALE: f32 = 2.0;
/// Files that a new study takes away: what stands in them belongs to the old one.
const OLD: [&str; 4] = [CSV, REPORT, "truth-list.csv", "truth-table.csv"];

/// What makes runs comparable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyIdentity {
    /// Name of the material, for people.
    pub name: String,
    /// Hashes of the surface and of all pairs.
    pub material: String,
    pub pairs: String,
    pub seed: u64,
    /// How the truth is computed.
    pub truth: String,
}

impl StudyIdentity {
    /// What differs in another study, in words.
    fn differs(&self, other: &Self) -> String {
        let differs = [
            (self.material != other.material, "material"),
            (self.pairs != other.pairs, "pairs"),
            (self.seed != other.seed, "seed"),
            (self.truth != other.truth, "truth"),
        ];
        let named: Vec<&str> = differs.iter().filter(|d| d.0).map(|d| d.1).collect();
        if named.is_empty() { "name".to_owned() } else { named.join(" and ") }
    }
}

/// How a folder is opened.
pub struct Opening<'a> {
    /// Begin anew, whatever is there.
    pub force: bool,
    /// Files that the study reads.
    pub inputs: &'a [Option<&'a PathBuf>],
    /// Pictures that a new study takes away, as paths within the folder.
    pub pictures: &'a [String],
}

/// A mistake of where the output goes.
fn at_output(path: &Path, problem: String, remedy: &str) -> Error {
    BadInput::new(problem, remedy).in_file(path).at_field("output").into()
}

/// The folder.
pub struct Folder {
    path: PathBuf,
    written: RefCell<Vec<PathBuf>>,
}

impl Folder {
    /// Makes the folder, or goes on in one that holds the same study.
    ///
    /// # Errors
    /// Bad input if it holds another study, or files of other origin, unless `force`, or if an input is a file of the study; i/o.
    pub fn open(path: &Path, identity: &StudyIdentity, opening: &Opening<'_>) -> Result<Self> {
        if path.exists() && !path.is_dir() {
            return Err(at_output(path, "the output is no folder".to_owned(), "name a folder"));
        }
        std::fs::create_dir_all(path).map_err(|source| Error::Io { action: "create", path: path.to_path_buf(), source })?;
        let folder = Self { path: path.to_path_buf(), written: RefCell::default() };
        folder.check_inputs(opening.inputs)?;
        if folder.holds(identity, opening.force)? {
            return Ok(folder);
        }
        folder.remove_old(opening.pictures)?;
        let json = serde_json::to_vec_pretty(identity).map_err(|e| Error::Numeric(format!("{e}; please report this")))?;
        folder.write(STUDY, &json)?;
        Ok(folder)
    }

    /// Refuses a study that would replace what it reads.
    fn check_inputs(&self, inputs: &[Option<&PathBuf>]) -> Result<()> {
        let is_ours = |file: &Path| file.parent().is_some_and(|p| same(p, &self.path)) && file.extension().is_some_and(|e| e == "csv");
        for input in inputs.iter().flatten().filter(|input| is_ours(input)) {
            let name = input.file_name().unwrap_or_default().to_string_lossy();
            if [PAIRS, JUDGED, CSV].contains(&&*name) {
                return Err(at_output(&self.path, format!("the study would replace its own input {name}"), "name another folder"));
            }
        }
        Ok(())
    }

    /// Whether the same study is in the folder; another one, or files of other origin, may be replaced by `force` only.
    fn holds(&self, identity: &StudyIdentity, force: bool) -> Result<bool> {
        let bad = |problem: String| at_output(&self.path, problem, "name another folder, or begin anew with `force`");
        match std::fs::read(self.path(STUDY)) {
            Ok(bytes) => match serde_json::from_slice::<StudyIdentity>(&bytes) {
                Ok(before) if before == *identity => Ok(true),
                _ if force => Ok(false),
                Ok(before) => {
                    Err(bad(format!("this folder holds a study with another {}, of \"{}\"", before.differs(identity), before.name)))
                }
                Err(_) => Err(bad(format!("its {STUDY} is not one of this program"))),
            },
            Err(_) if force => Ok(false),
            Err(_) => match OLD.iter().chain(&[PAIRS, JUDGED]).find(|name| self.path(name).exists()) {
                Some(there) => Err(bad(format!("it holds a {there} of other origin"))),
                None => Ok(false),
            },
        }
    }

    /// Takes away what belongs to an old study.
    fn remove_old(&self, pictures: &[String]) -> Result<()> {
        for name in OLD.into_iter().chain(pictures.iter().map(String::as_str)) {
            match std::fs::remove_file(self.path(name)) {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::Io { action: "remove", path: self.path(name), source });
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Removes the compressed BRDFs.
    pub fn remove_cache(&self) -> Result<()> {
        let path = self.path(CACHE);
        match std::fs::remove_dir_all(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(Error::Io { action: "remove", path, source }),
            _ => Ok(()),
        }
    }

    /// The path of a file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The files of this study that were written, in their order, and the lines of the runs.
    pub fn written(&self) -> Vec<PathBuf> {
        let mut all = vec![self.path(CSV)];
        all.extend(self.written.borrow().iter().cloned());
        all
    }

    /// Writes a file, whole or not at all.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let path = self.path(name);
        Target::new(&path, true, &[], |_| true)?.write(|out| out.write_all(bytes))?;
        self.note(name);
        Ok(())
    }

    /// Counts a file among those written.
    pub fn note(&self, name: &str) {
        let (path, mut written) = (self.path(name), self.written.borrow_mut());
        if !written.contains(&path) {
            written.push(path);
        }
    }

    /// Writes a picture as SVG and PNG.
    pub fn write_chart(&self, name: &str, chart: &Svg) -> Result<()> {
        self.write(&format!("{name}.svg"), chart.finish(None).as_bytes())?;
        let pixels = chart.rasterise(SCALE, None)?;
        // Opaque: premultiplied colours are the colours.
        let rgb: Vec<u8> = pixels.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        let png = output::png::encode([pixels.width(), pixels.height()], &rgb, false, MARK, name)?;
        self.write(&format!("{name}.png"), &png)
    }

    /// Writes the pairs of the list.
    pub fn write_pairs(&self, pairs: &[Pair]) -> Result<()> {
        self.write(PAIRS, pairs_csv(pairs).as_bytes())
    }

    /// Writes the pairs of the table that are judged, and says where.
    pub fn write_judged(&self, pairs: &[Pair]) -> Result<PathBuf> {
        self.write(JUDGED, pairs_csv(pairs).as_bytes())?;
        Ok(self.path(JUDGED))
    }

    /// Writes the truth of a question, in the columns that `eval` writes as far as they are known.
    pub fn write_truth(&self, asked: Asked, pairs: &[Pair], truth: &Truth) -> Result<()> {
        let mut text = format!("{}\n", TRUTH_COLUMNS.join(","));
        for ((pair, value), se) in pairs.iter().zip(&truth.value).zip(&truth.se) {
            let numbers = pair.wi.to_array().into_iter().chain(pair.wo.to_array()).chain(*value).chain(*se);
            push_row(&mut text, numbers);
        }
        self.write(&truth_name(asked), text.as_bytes())
    }

    /// Reads the truth of a question back; `None` if it is not there, or not of this many pairs.
    pub fn read_truth(&self, asked: Asked, pairs: usize) -> Result<Option<Truth>> {
        let path = self.path(&truth_name(asked));
        if !path.exists() {
            return Ok(None);
        }
        let bad = |problem: String| Error::from(BadInput::new(problem, "begin anew with --force").in_file(&path));
        let mut reader = csv::Reader::from_path(&path).map_err(|e| bad(e.to_string()))?;
        if reader.headers().map_err(|e| bad(e.to_string()))? != TRUTH_COLUMNS[..] {
            return Err(bad("it has not the columns of a truth".to_owned()));
        }
        let mut truth = Truth::default();
        for row in reader.deserialize::<[f64; 12]>() {
            let row = row.map_err(|e| bad(e.to_string()))?;
            truth.value.push([row[6], row[7], row[8]]);
            truth.se.push([row[9], row[10], row[11]]);
        }
        Ok((truth.value.len() == pairs).then_some(truth))
    }
}

/// Whether two paths name the same place.
fn same(a: &Path, b: &Path) -> bool {
    let real = |p: &Path| std::fs::canonicalize(if p.as_os_str().is_empty() { Path::new(".") } else { p }).ok();
    real(a).is_some() && real(a) == real(b)
}

fn truth_name(asked: Asked) -> String {
    format!("truth-{}.csv", asked.name())
}

const TRUTH_COLUMNS: [&str; 12] = ["wi_x", "wi_y", "wi_z", "wo_x", "wo_y", "wo_z", "fbar_r", "fbar_g", "fbar_b", "se_r", "se_g", "se_b"];

fn pairs_csv(pairs: &[Pair]) -> String {
    let mut text = format!("{}\n", COLUMNS.join(","));
    for pair in pairs {
        push_row(&mut text, pair.wi.to_array().into_iter().chain(pair.wo.to_array()));
    }
    text
}

/// Numbers are the shortest that read back to the same bits.
fn push_row(text: &mut String, numbers: impl Iterator<Item = f64>) {
    for (k, x) in numbers.enumerate() {
        let _ = write!(text, "{}{x:?}", if k == 0 { "" } else { "," });
    }
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    const NEW: Opening<'_> = Opening { force: false, inputs: &[], pictures: &[] };

    fn identity() -> StudyIdentity {
        StudyIdentity { name: "m".into(), material: "1".into(), pairs: "2".into(), seed: 3, truth: "t".into() }
    }

    #[test]
    fn a_folder_is_gone_on_with_only_for_the_same_study() {
        let temporary = tempfile::tempdir().unwrap();
        let path = temporary.path().join("study");
        let open = |identity: &StudyIdentity, force| Folder::open(&path, identity, &Opening { force, inputs: &[], pictures: &[] });
        let folder = open(&identity(), false).unwrap();
        folder.write(REPORT, b"old").unwrap();
        open(&identity(), false).unwrap();
        assert!(folder.path(REPORT).exists(), "the same study goes on");
        let other = StudyIdentity { pairs: "5".into(), seed: 9, ..identity() };
        let message = open(&other, false).err().unwrap().to_string();
        assert!(message.contains("another pairs and seed") && message.contains("`force`"), "{message}");
        open(&other, true).unwrap();
        assert!(!folder.path(REPORT).exists(), "what is old stays beside what is new");
        std::fs::write(folder.path(STUDY), "{}").unwrap();
        assert!(open(&other, false).err().unwrap().to_string().contains("not one of this program"));
    }

    #[test]
    fn files_of_other_origin_are_not_replaced() {
        let temporary = tempfile::tempdir().unwrap();
        std::fs::write(temporary.path().join(REPORT), "mine").unwrap();
        let message = Folder::open(temporary.path(), &identity(), &NEW).err().unwrap().to_string();
        assert!(message.contains("report.html of other origin"), "{message}");
        let input = temporary.path().join(PAIRS);
        std::fs::write(&input, "").unwrap();
        let message = Folder::open(temporary.path(), &identity(), &Opening { force: true, inputs: &[Some(&input)], pictures: &[] })
            .err()
            .unwrap()
            .to_string();
        assert!(message.contains("its own input pairs.csv"), "{message}");
    }

    #[test]
    fn a_truth_is_read_as_it_was_written() {
        let temporary = tempfile::tempdir().unwrap();
        let folder = Folder::open(temporary.path(), &identity(), &NEW).unwrap();
        let pairs = biscale::study::list(1, 0).pairs;
        let values = |x: f64| (0..pairs.len()).map(|k| [x / (k + 3) as f64; 3]).collect();
        let truth = Truth { value: values(1.0), se: values(1e-3) };
        folder.write_truth(Asked::Table, &pairs, &truth).unwrap();
        assert_eq!(folder.read_truth(Asked::Table, pairs.len()).unwrap(), Some(truth));
        assert_eq!(folder.read_truth(Asked::Table, 1).unwrap(), None);
        assert_eq!(folder.read_truth(Asked::List, 1).unwrap(), None);
    }
}
