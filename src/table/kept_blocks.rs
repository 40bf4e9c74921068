//! A file of the blocks of tables that are made so far: what is left of a bake that was interrupted.
//!
//! The file begins with a line of text and the fingerprint of the bake; blocks follow, each with its name, its length and a checksum, as they
//! are finished. One of another bake is begun anew. What follows the first block that is cut or damaged is dropped: the process may have been
//! killed while it wrote.

use crate::direction::Pair;
use crate::error::{BadInput, Error, Result};
use crate::numerics::hash::Fnv1a;
use rustc_hash::FxHashMap;
use std::fs::{File, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The line that the file begins with.
const HEAD: &[u8] = b"biscale, blocks of a table that is being baked 2\n";
/// Numbers of a pair: `S` and its standard error, three channels each, and `av` of its viewer.
const NUMBERS: usize = 7;
/// Bytes before the numbers of a block: rings, number, pairs and checksum.
const NAME: usize = 32;

/// Values of the pairs of a block, in their order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BlockValues(Vec<f32>);

impl BlockValues {
    /// Adds a pair.
    pub fn push(&mut self, s: [f32; 6], av: f32) {
        self.0.extend(s);
        self.0.push(av);
    }

    /// `S` and its standard errors, and `av`, of each pair.
    pub fn values(&self) -> impl Iterator<Item = ([f32; 6], f32)> + '_ {
        self.0.as_chunks::<NUMBERS>().0.iter().map(|&[r, g, b, er, eg, eb, av]| ([r, g, b, er, eg, eb], av))
    }

    fn bytes(&self) -> Vec<u8> {
        self.0.iter().flat_map(|v| v.to_le_bytes()).collect()
    }
}

/// The file, open.
#[derive(Debug)]
pub struct KeptBlocks {
    file: File,
    path: PathBuf,
    /// Of the bake.
    fingerprint: u64,
    /// Where the numbers of a block `[rings, number]` begin, their pairs, and their checksum.
    blocks: FxHashMap<[u64; 2], (u64, u64, u64)>,
    /// Where the next block goes.
    end: u64,
}

impl KeptBlocks {
    /// Opens the file of a bake, or begins it.
    ///
    /// # Errors
    /// [`Error::BadInput`] if the file is of another kind, or another bake writes it; [`Error::Io`].
    pub fn open(path: &Path, fingerprint: u64) -> Result<Self> {
        let failed = |source| Error::Io { action: "write", path: path.to_path_buf(), source };
        let mut file = File::options().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            let problem = "another bake to this output keeps its blocks here";
            return Err(BadInput::new(problem, "wait until it is done, or name another output").in_file(path).into());
        }
        let mut head = Vec::new();
        (&mut file).take(HEAD.len() as u64 + 8).read_to_end(&mut head).map_err(failed)?;
        if !head.starts_with(HEAD) && !HEAD.starts_with(&head) {
            let problem = "the blocks of an unfinished table are kept here, and this file is none";
            return Err(BadInput::new(problem, "move it away, or name another output").in_file(path).into());
        }
        let mut kept = Self { file, path: path.to_path_buf(), fingerprint, blocks: FxHashMap::default(), end: HEAD.len() as u64 + 8 };
        if head.get(HEAD.len()..) == Some(&fingerprint.to_le_bytes()[..]) {
            kept.list().map_err(failed)?;
        } else {
            let begin = |file: &mut File| {
                file.set_len(0)?;
                file.rewind()?;
                file.write_all(HEAD)?;
                file.write_all(&fingerprint.to_le_bytes())
            };
            begin(&mut kept.file).map_err(failed)?;
        }
        Ok(kept)
    }

    /// Finds where the blocks are.
    fn list(&mut self) -> io::Result<()> {
        let length = self.file.metadata()?.len();
        loop {
            self.file.seek(SeekFrom::Start(self.end))?;
            let mut name = [0; NAME];
            if self.end + NAME as u64 > length || self.file.read_exact(&mut name).is_err() {
                return Ok(());
            }
            let word = |k: usize| u64::from_le_bytes(std::array::from_fn(|b| name[8 * k + b]));
            if word(2) == 0 {
                return Ok(());
            }
            let begins = self.end + NAME as u64;
            let ends = word(2).checked_mul(4 * NUMBERS as u64).and_then(|bytes| begins.checked_add(bytes)).filter(|&ends| ends <= length);
            let Some(ends) = ends else { return Ok(()) };
            self.blocks.insert([word(0), word(1)], (begins, word(2), word(3)));
            self.end = ends;
        }
    }

    /// The values of a block of these pairs, if they are here and whole.
    pub(super) fn find(&mut self, name: [usize; 2], pairs: &[Pair]) -> Result<Option<BlockValues>> {
        let Some(&(begins, kept, checksum)) = self.blocks.get(&name.map(|n| n as u64)) else { return Ok(None) };
        if kept != pairs.len() as u64 {
            return Ok(None);
        }
        let mut bytes = vec![0; 4 * NUMBERS * pairs.len()];
        let read = self.file.seek(SeekFrom::Start(begins)).and_then(|_| self.file.read_exact(&mut bytes));
        read.map_err(|source| Error::Io { action: "read", path: self.path.clone(), source })?;
        let values = bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
        Ok((self.checksum(name, pairs, &bytes) == checksum).then_some(BlockValues(values)))
    }

    /// Adds a block.
    pub(super) fn keep(&mut self, name: [usize; 2], pairs: &[Pair], block: &BlockValues) -> Result<()> {
        let bytes = block.bytes();
        let checksum = self.checksum(name, pairs, &bytes);
        let [rings, number] = name.map(|n| n as u64);
        let mut record: Vec<u8> = [rings, number, pairs.len() as u64, checksum].iter().flat_map(|word| word.to_le_bytes()).collect();
        record.extend(&bytes);
        let written = self.file.seek(SeekFrom::Start(self.end)).and_then(|_| self.file.write_all(&record));
        written.map_err(|source| Error::Io { action: "write", path: self.path.clone(), source })?;
        self.blocks.insert([rings, number], (self.end + NAME as u64, pairs.len() as u64, checksum));
        self.end += record.len() as u64;
        Ok(())
    }

    /// Of all that a block is: its bake, its name, its pairs and its numbers.
    fn checksum(&self, name: [usize; 2], pairs: &[Pair], bytes: &[u8]) -> u64 {
        let mut hash = Fnv1a::default();
        hash.add(&self.fingerprint.to_le_bytes());
        name.iter().for_each(|n| hash.add(&(*n as u64).to_le_bytes()));
        pairs.iter().flat_map(|p| [p.wi, p.wo]).flat_map(|w| w.to_array()).for_each(|x| hash.add(&x.to_le_bytes()));
        hash.add(bytes);
        hash.value()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn block(first: f32) -> BlockValues {
        let mut block = BlockValues::default();
        for k in 0..3_u8 {
            block.push([first, 1.0, 2.0, 3.0, 4.0, f32::from(k)], 0.5);
        }
        block
    }

    fn pairs(count: u8) -> Vec<Pair> {
        (0..count).map(|k| Pair { wi: DVec3::new(0.1 * f64::from(k), 0.0, 1.0).normalize(), wo: DVec3::Z }).collect()
    }

    #[test]
    fn blocks_are_found_again_and_those_of_another_bake_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.exr.kept");
        let mut kept = KeptBlocks::open(&path, 7).unwrap();
        assert_eq!(kept.find([8, 0], &pairs(3)).unwrap(), None);
        kept.keep([8, 0], &pairs(3), &block(1.0)).unwrap();
        kept.keep([36, 1], &pairs(3), &block(2.0)).unwrap();
        drop(kept);
        let mut again = KeptBlocks::open(&path, 7).unwrap();
        assert_eq!(again.find([36, 1], &pairs(3)).unwrap(), Some(block(2.0)));
        assert_eq!(again.find([8, 0], &pairs(3)).unwrap(), Some(block(1.0)));
        assert_eq!(again.find([8, 0], &pairs(4)).unwrap(), None, "of another length");
        let reversed: Vec<Pair> = pairs(3).into_iter().rev().collect();
        assert_eq!(again.find([8, 0], &reversed).unwrap(), None, "of other directions");
        again.keep([36, 2], &pairs(3), &block(3.0)).unwrap();
        let locked = KeptBlocks::open(&path, 7).unwrap_err().to_string();
        assert!(locked.contains("another bake") && locked.contains("t.exr.kept"), "{locked}");
        drop(again);
        assert_eq!(KeptBlocks::open(&path, 7).unwrap().find([36, 2], &pairs(3)).unwrap(), Some(block(3.0)));
        assert_eq!(KeptBlocks::open(&path, 8).unwrap().find([36, 2], &pairs(3)).unwrap(), None);
    }

    #[test]
    fn a_file_that_was_cut_or_damaged_keeps_what_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.exr.kept");
        let mut kept = KeptBlocks::open(&path, 7).unwrap();
        kept.keep([8, 0], &pairs(3), &block(1.0)).unwrap();
        kept.keep([8, 1], &pairs(3), &block(2.0)).unwrap();
        drop(kept);
        let whole = std::fs::read(&path).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let mut cut = KeptBlocks::open(&path, 7).unwrap();
            let first = HEAD.len() + 8 + NAME + 3 * 4 * NUMBERS;
            assert_eq!(cut.find([8, 0], &pairs(3)).unwrap().is_some(), length >= first, "{length}");
            assert_eq!(cut.find([8, 1], &pairs(3)).unwrap(), None, "{length}");
            cut.keep([8, 1], &pairs(3), &block(4.0)).unwrap();
            drop(cut);
            assert_eq!(KeptBlocks::open(&path, 7).unwrap().find([8, 1], &pairs(3)).unwrap(), Some(block(4.0)), "{length}");
        }
        let mut damaged = whole.clone();
        let last = damaged.len() - 1;
        damaged[last] ^= 1;
        std::fs::write(&path, &damaged).unwrap();
        assert_eq!(KeptBlocks::open(&path, 7).unwrap().find([8, 1], &pairs(3)).unwrap(), None);
    }

    #[test]
    fn a_file_of_another_kind_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.exr.kept");
        std::fs::write(&path, "my notes").unwrap();
        let error = KeptBlocks::open(&path, 7).unwrap_err().to_string();
        assert!(error.contains("t.exr.kept") && error.contains("move it away"), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), b"my notes");
    }
}
