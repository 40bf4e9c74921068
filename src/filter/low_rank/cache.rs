//! Compressed matrices `M` kept on disk, a file each: computing one takes from a second to many minutes, reading it a moment.
//!
//! A file is `biscale-m` and a version, the BLAKE3 hash of the rest, the hash of what the matrix was computed from (its name, too), a
//! label, and the numbers. Whatever does not fit is not used: the matrix is computed again and replaces it.

use super::normals::PairRows;
use super::precomputed::{Precomputed, Settings, maps};
use super::rates::Rates;
use crate::brdf::Brdf;
use crate::error::{Error, Result};
use crate::filter::plan::{LARGEST_MAPS, MapSides};
use crate::filter::quality::MatrixCache;
use crate::numerics::stable_bytes::StableBytes;
use faer::Mat;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

/// How the names of files begin and end that are being written.
const UNFINISHED: [&str; 2] = [".matrix-", ".part"];
/// A file that was begun this long ago is not being written any more. Chosen, not measured: a matrix is written in seconds.
const LONG_AGO: Duration = Duration::from_secs(3600);

/// First bytes of a file: the format and its version.
const MAGIC: &[u8; 12] = b"biscale-m\0\0\x02";
/// Version of what a [`key`] is taken of, and of the computation: changes where the same BRDF and settings give another matrix than before.
const KEY_VERSION: u64 = 3;
/// Ending of a file's name.
const ENDING: &str = "m";
/// Bytes of a hash.
const HASH: usize = 32;
/// Largest share of the allowed bytes that one matrix may take, so that two always fit. Chosen, not measured.
const MOST_OF_ALL: f64 = 0.5;

/// A file of a [`MatrixCache`].
#[derive(Clone, Debug, PartialEq)]
pub struct CacheEntry {
    /// Where it is.
    pub path: PathBuf,
    /// Bytes.
    pub bytes: u64,
    /// When it was last used.
    pub used: SystemTime,
    /// What it holds, or `None` for a file that cannot be read or is damaged.
    pub label: Option<String>,
}

/// What a look into the cache found.
pub(super) enum CacheLookup {
    /// The matrix.
    Hit(Box<Precomputed>),
    /// No such file.
    Missing,
    /// A file that is not what its name says, and why.
    Unusable(String),
}

/// The hash of all that a matrix is computed from: [`KEY_VERSION`], the settings, the BRDF.
fn key(brdf: &Brdf, settings: &Settings) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    let mut add = |bytes: &[u8]| {
        hasher.update(bytes);
    };
    let mut out = StableBytes::new(&mut add);
    out.whole(KEY_VERSION);
    settings.write(&mut out);
    brdf.write(&mut out);
    hasher.finalize()
}

impl MatrixCache {
    fn path(&self, key: &blake3::Hash) -> PathBuf {
        self.folder.join(key.to_hex().as_str()).with_extension(ENDING)
    }

    /// Looks for a matrix.
    pub(super) fn find(&self, brdf: &Brdf, settings: &Settings) -> CacheLookup {
        let key = key(brdf, settings);
        let path = self.path(&key);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return CacheLookup::Missing,
            Err(e) => return CacheLookup::Unusable(format!("cannot read {}: {e}", path.display())),
        };
        match decode(&bytes, Some((&key, settings))) {
            Ok((_, matrix)) => {
                // The time of use, for the order in which files go. Where it cannot be set the order is that of writing.
                let _ = fs::File::options().append(true).open(&path).and_then(|f| f.set_modified(SystemTime::now()));
                CacheLookup::Hit(Box::new(matrix))
            }
            Err(why) => CacheLookup::Unusable(format!("{} {why}", path.display())),
        }
    }

    /// Keeps a matrix, and removes the least recently used files beyond the allowed bytes. Returns what kept it from being kept.
    pub(super) fn keep(&self, brdf: &Brdf, settings: &Settings, matrix: &Precomputed) -> Result<(), String> {
        let key = key(brdf, settings);
        let bytes = encode(&key, &label(brdf, matrix), matrix);
        if bytes.len() as f64 > MOST_OF_ALL * self.max_bytes as f64 {
            return Err(format!("its {} bytes are more than half of the {} that the cache may take", bytes.len(), self.max_bytes));
        }
        let path = self.path(&key);
        let write = || -> std::io::Result<()> {
            fs::create_dir_all(&self.folder)?;
            self.remove_unfinished(LONG_AGO);
            let mut file = tempfile::Builder::new().prefix(UNFINISHED[0]).suffix(UNFINISHED[1]).tempfile_in(&self.folder)?;
            file.write_all(&bytes)?;
            file.as_file().sync_all()?;
            file.persist(&path).map_err(|e| e.error)?;
            Ok(())
        };
        write().map_err(|e| format!("cannot write {}: {e}", path.display()))?;
        self.shrink(&path).map_err(|e| e.to_string())
    }

    /// Removes files that were begun at least so long ago and not finished: processes that were killed left them. What cannot be removed stays.
    fn remove_unfinished(&self, age: Duration) {
        for entry in fs::read_dir(&self.folder).into_iter().flatten().flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let is_old = || entry.metadata().and_then(|m| m.modified()).is_ok_and(|time| time.elapsed().is_ok_and(|passed| passed >= age));
            if name.starts_with(UNFINISHED[0]) && name.ends_with(UNFINISHED[1]) && is_old() {
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// Removes files until the rest fits, the least recently used first, `keep` last.
    fn shrink(&self, keep: &Path) -> Result<()> {
        let mut files = self.files()?;
        files.sort_by_key(|(path, _, used)| (path == keep, *used));
        let mut all: u64 = files.iter().map(|f| f.1).sum();
        for (path, bytes, _) in files {
            if all <= self.max_bytes {
                break;
            }
            fs::remove_file(&path).map_err(|source| Error::Io { action: "remove", path, source })?;
            all -= bytes;
        }
        Ok(())
    }

    /// Its files, with their bytes and times.
    fn files(&self) -> Result<Vec<(PathBuf, u64, SystemTime)>> {
        let failed = |source| Error::Io { action: "read", path: self.folder.clone(), source };
        let entries = match fs::read_dir(&self.folder) {
            Ok(entries) => entries,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Vec::new()),
            Err(e) => return Err(failed(e)),
        };
        let mut files = Vec::new();
        for entry in entries {
            let path = entry.map_err(failed)?.path();
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let ours =
                name.len() == 2 * HASH && name.bytes().all(|b| b.is_ascii_hexdigit()) && path.extension().is_some_and(|e| e == ENDING);
            // A file may go away meanwhile: another program's cache is this one too.
            if ours && let Ok(meta) = fs::metadata(&path) {
                files.push((path, meta.len(), meta.modified().unwrap_or(SystemTime::UNIX_EPOCH)));
            }
        }
        files.sort();
        Ok(files)
    }

    /// All files, by name.
    ///
    /// # Errors
    /// [`Error::Io`] for a folder that cannot be read; one that is not there is empty.
    pub fn list(&self) -> Result<Vec<CacheEntry>> {
        let entry = |(path, bytes, used): (PathBuf, u64, SystemTime)| {
            let label = fs::read(&path).ok().and_then(|b| decode(&b, None).ok()).map(|d| d.0);
            CacheEntry { path, bytes, used, label }
        };
        Ok(self.files()?.into_iter().map(entry).collect())
    }

    /// Removes all files, and the folder if it is then empty. Returns how many files and bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn clear(&self) -> Result<(usize, u64)> {
        let files = self.files()?;
        for (path, _, _) in &files {
            fs::remove_file(path).map_err(|source| Error::Io { action: "remove", path: path.clone(), source })?;
        }
        self.remove_unfinished(Duration::ZERO);
        // Other files in it stay, and then so does the folder.
        let _ = fs::remove_dir(&self.folder);
        Ok((files.len(), files.iter().map(|f| f.1).sum()))
    }
}

/// What a matrix is of, for people.
fn label(brdf: &Brdf, matrix: &Precomputed) -> String {
    let brdf = match brdf {
        Brdf::Measured(measured) => format!("measured {}", measured.label),
        analytic => format!("{analytic:?}"),
    };
    format!("{brdf}: {} x {}, rank {}", matrix.pairs.rows(), matrix.normals.directions.len(), matrix.rank())
}

fn encode(key: &blake3::Hash, label: &str, m: &Precomputed) -> Vec<u8> {
    let mut body = Vec::with_capacity(m.bytes() + 1024);
    body.extend_from_slice(key.as_bytes());
    let whole = |body: &mut Vec<u8>, x: usize| body.extend_from_slice(&(x as u64).to_le_bytes());
    whole(&mut body, label.len());
    body.extend_from_slice(label.as_bytes());
    for x in [m.rates.sides.directions, m.rates.sides.normals, usize::from(m.pairs.reciprocal), m.rank()] {
        whole(&mut body, x);
    }
    let right = m.right.col_iter().flat_map(|c| c.iter().copied().collect::<Vec<f64>>());
    let numbers = [m.rates.missed_by_directions, m.rates.missed_by_normals, m.energy].into_iter();
    for x in numbers.chain(m.colour).chain(m.mean.iter().copied()).chain(right) {
        body.extend_from_slice(&x.to_le_bytes());
    }
    for x in &m.left {
        body.extend_from_slice(&x.to_le_bytes());
    }
    let mut bytes = MAGIC.to_vec();
    bytes.extend_from_slice(blake3::hash(&body).as_bytes());
    bytes.extend_from_slice(&body);
    bytes
}

/// The label and the matrix of a file, which must be of `expected`; or what is wrong with it.
fn decode(bytes: &[u8], expected: Option<(&blake3::Hash, &Settings)>) -> Result<(String, Precomputed), &'static str> {
    const DAMAGED: &str = "is damaged";
    let rest = bytes.strip_prefix(MAGIC).ok_or("is no matrix of this version")?;
    let (checksum, body) = rest.split_at_checked(HASH).ok_or(DAMAGED)?;
    if blake3::hash(body).as_bytes() != checksum {
        return Err(DAMAGED);
    }
    let (key, mut body) = body.split_at_checked(HASH).ok_or(DAMAGED)?;
    if expected.is_some_and(|(expected, _)| expected.as_bytes() != key) {
        return Err("is of another BRDF than its name says");
    }
    let mut take = |length: usize| {
        let (head, tail) = body.split_at_checked(length).ok_or(DAMAGED)?;
        body = tail;
        Ok::<&[u8], &'static str>(head)
    };
    let whole = |bytes: &[u8]| usize::try_from(u64::from_le_bytes(bytes.try_into().map_err(|_| DAMAGED)?)).map_err(|_| DAMAGED);
    let real = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().expect("eight bytes"));
    let length = whole(take(8)?)?;
    let label = String::from_utf8(take(length)?.to_vec()).map_err(|_| DAMAGED)?;
    let [directions, normals, reciprocal, rank] = [whole(take(8)?)?, whole(take(8)?)?, whole(take(8)?)?, whole(take(8)?)?];
    let sides = MapSides { directions, normals };
    // Of the maps only the sides are stored; a list of files shows labels alone, whatever the projection.
    let projection = expected.map_or(super::map::Projection::Paraboloid, |(_, settings)| settings.projection);
    let largest = LARGEST_MAPS;
    if !(1..=largest.directions).contains(&directions) || !(1..=largest.normals).contains(&normals) {
        return Err(DAMAGED);
    }
    let (directions, normals, pairs): (_, _, PairRows) = maps(projection, sides, reciprocal == 1);
    let columns = normals.directions.len();
    let mut reals = |count: usize| Ok::<Vec<f64>, &'static str>(take(8 * count)?.chunks_exact(8).map(real).collect());
    let head = reals(6)?;
    let mean = reals(columns)?;
    let right = reals(columns.checked_mul(rank).filter(|&n| n <= columns * columns).ok_or(DAMAGED)?)?;
    let left: Vec<f32> =
        take(4 * pairs.rows() * rank)?.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four bytes"))).collect();
    if !body.is_empty() {
        return Err(DAMAGED);
    }
    let rates = Rates { sides, missed_by_directions: head[0], missed_by_normals: head[1] };
    let right = Mat::from_fn(columns, rank, |j, k| right[k * columns + j]);
    let colour = [head[3], head[4], head[5]];
    Ok((label, Precomputed { directions, normals, pairs, rates, colour, energy: head[2], mean, right, left }))
}

#[cfg(test)]
mod tests {
    use super::super::map::Projection;
    use super::*;

    const SETTINGS: Settings = Settings {
        projection: Projection::Paraboloid,
        least_directions: 4,
        largest: MapSides { directions: 6, normals: 6 },
        energy: 0.98,
        seed: 1,
    };

    fn brdf(albedo: f64) -> Brdf {
        Brdf::Lambert { albedo: [albedo, 0.2, 0.1] }
    }

    fn matrix(brdf: &Brdf) -> Precomputed {
        Precomputed::compute(brdf, &SETTINGS, &|_| Ok(())).unwrap()
    }

    fn same(a: &Precomputed, b: &Precomputed) -> bool {
        (&a.left, &a.mean, a.colour, a.rates, a.energy, &a.directions, &a.normals)
            == (&b.left, &b.mean, b.colour, b.rates, b.energy, &b.directions, &b.normals)
            && a.right == b.right
    }

    fn cache(folder: &Path, max_bytes: u64) -> MatrixCache {
        MatrixCache { folder: folder.join("m"), max_bytes }
    }

    #[test]
    fn what_is_kept_is_found_with_the_same_bits_and_only_for_its_own_brdf_and_settings() {
        let folder = tempfile::tempdir().unwrap();
        let cache = cache(folder.path(), 1 << 30);
        assert!(matches!(cache.find(&brdf(0.5), &SETTINGS), CacheLookup::Missing));
        assert_eq!((cache.list().unwrap(), cache.clear().unwrap()), (Vec::new(), (0, 0)));
        let m = matrix(&brdf(0.5));
        cache.keep(&brdf(0.5), &SETTINGS, &m).unwrap();
        let CacheLookup::Hit(found) = cache.find(&brdf(0.5), &SETTINGS) else { panic!("kept and not found") };
        assert!(same(&m, &found));
        assert!(matches!(cache.find(&brdf(0.5000001), &SETTINGS), CacheLookup::Missing));
        assert!(matches!(cache.find(&brdf(0.5), &Settings { energy: 0.99, ..SETTINGS }), CacheLookup::Missing));
        let listed = cache.list().unwrap();
        assert!(listed.len() == 1 && listed[0].label.as_ref().is_some_and(|l| l.contains("Lambert")), "{listed:?}");
        fs::write(cache.folder.join("notes.txt"), "mine").unwrap();
        assert_eq!(cache.clear().unwrap().0, 1);
        assert!(cache.folder.join("notes.txt").exists(), "a file of someone else's went too");
    }

    #[test]
    fn what_a_killed_process_left_goes() {
        let folder = tempfile::tempdir().unwrap();
        let cache = cache(folder.path(), 1 << 30);
        let left = cache.folder.join(".matrix-AbCdEf.part");
        let others = cache.folder.join(".tmpAbCdEf");
        fs::create_dir(&cache.folder).unwrap();
        for path in [&left, &others] {
            fs::write(path, "half").unwrap();
        }
        let grey = brdf(0.5);
        cache.keep(&grey, &SETTINGS, &matrix(&grey)).unwrap();
        assert!(left.exists(), "what was begun just now may be being written");
        fs::File::options().write(true).open(&left).unwrap().set_modified(SystemTime::now() - 2 * LONG_AGO).unwrap();
        cache.keep(&grey, &SETTINGS, &matrix(&grey)).unwrap();
        assert!(!left.exists() && others.exists());
        fs::write(&left, "half").unwrap();
        cache.clear().unwrap();
        assert!(!left.exists() && others.exists());
    }

    #[test]
    fn a_key_is_taken_of_numbers_and_tags_alone() {
        // Version; map, sides, power, seed; model and albedo. Whoever changes this changes the version, too.
        let whole = |n: u64| n.to_le_bytes().to_vec();
        let reals = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
        let settings = [vec![1], whole(4), whole(6), whole(6), reals(&[0.98]), whole(1)].concat();
        let bytes = [whole(3), settings, vec![1], reals(&[0.5, 0.2, 0.1])].concat();
        assert_eq!(key(&brdf(0.5), &SETTINGS), blake3::hash(&bytes));
    }

    #[test]
    fn every_model_and_every_number_of_it_changes_the_key() {
        let gloss = |diffuse, f0| Brdf::CookTorrance {
            diffuse: [diffuse; 3],
            specular: [0.5; 3],
            alpha: 0.1,
            distribution: crate::brdf::Distribution::Ggx,
            f0,
        };
        let fit = |name, scale| Brdf::Measured(crate::brdf::Measured::fit(name, scale).unwrap().into());
        let all = [
            brdf(0.5),
            brdf(0.6),
            gloss(0.2, None),
            gloss(0.3, None),
            gloss(0.2, Some([0.04; 3])),
            Brdf::Ward { diffuse: [0.2; 3], specular: [0.5; 3], alpha: 0.1 },
            Brdf::BlinnPhong { diffuse: [0.2; 3], specular: [0.5; 3], exponent: 0.1 },
            fit("alum-bronze", 1.0),
            fit("alum-bronze", 2.0),
            fit("black-fabric", 1.0),
        ];
        let mut keys: Vec<String> = all.iter().map(|b| key(b, &SETTINGS).to_hex().to_string()).collect();
        keys.sort();
        keys.dedup();
        assert_eq!(keys.len(), all.len());
    }

    #[test]
    fn a_damaged_or_foreign_file_is_told_and_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let cache = cache(folder.path(), 1 << 30);
        let m = matrix(&brdf(0.5));
        cache.keep(&brdf(0.5), &SETTINGS, &m).unwrap();
        let path = cache.list().unwrap()[0].path.clone();
        let good = fs::read(&path).unwrap();
        let other = {
            cache.keep(&brdf(0.7), &SETTINGS, &matrix(&brdf(0.7))).unwrap();
            let entries = cache.list().unwrap();
            fs::read(&entries.iter().find(|e| e.path != path).unwrap().path).unwrap()
        };
        let mut flipped = good.clone();
        let middle = flipped.len() / 2;
        flipped[middle] ^= 1;
        let mut newer = good.clone();
        newer[11] += 1;
        for bytes in [&b""[..], b"hello", &good[..good.len() - 1], &good[..50], &flipped, &newer, &other, &[&good[..], b"x"].concat()] {
            fs::write(&path, bytes).unwrap();
            let CacheLookup::Unusable(why) = cache.find(&brdf(0.5), &SETTINGS) else { panic!("{} bytes were used", bytes.len()) };
            assert!(why.contains(&*path.to_string_lossy()), "{why}");
        }
        cache.keep(&brdf(0.5), &SETTINGS, &m).unwrap();
        assert!(matches!(cache.find(&brdf(0.5), &SETTINGS), CacheLookup::Hit(_)));
    }

    #[test]
    fn the_least_recently_used_goes_when_there_is_too_much() {
        let folder = tempfile::tempdir().unwrap();
        let one = encode(&blake3::hash(b""), "", &matrix(&brdf(0.5))).len() as u64 + 200;
        let cache = cache(folder.path(), 2 * one + one / 2);
        for albedo in [0.1, 0.2] {
            cache.keep(&brdf(albedo), &SETTINGS, &matrix(&brdf(albedo))).unwrap();
        }
        // Times of files may be coarse.
        std::thread::sleep(Duration::from_millis(20));
        assert!(matches!(cache.find(&brdf(0.1), &SETTINGS), CacheLookup::Hit(_)));
        cache.keep(&brdf(0.3), &SETTINGS, &matrix(&brdf(0.3))).unwrap();
        let there = |albedo| matches!(cache.find(&brdf(albedo), &SETTINGS), CacheLookup::Hit(_));
        assert_eq!([0.1, 0.2, 0.3].map(there), [true, false, true]);
        let tiny = MatrixCache { max_bytes: one, ..cache.clone() };
        assert!(tiny.keep(&brdf(0.4), &SETTINGS, &matrix(&brdf(0.4))).unwrap_err().contains("half"));
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "").unwrap();
        let error = cache(&file, 1 << 30).keep(&brdf(0.5), &SETTINGS, &matrix(&brdf(0.5))).unwrap_err();
        assert!(error.contains("cannot write"), "{error}");
    }
}
