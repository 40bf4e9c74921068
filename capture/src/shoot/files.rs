//! The files that a shoot file lists, opened: what they are, and what a capture would refuse.

use super::spec::{PhotoSpec, Role, Shoot};
use crate::lens_group::LensKey;
use crate::linear;
use crate::metadata::Metadata;
use crate::photo::{self, PlanarImage, Samples};
use biscale::bounded_file::{MAX_DATA_BYTES, read_bounded};
use biscale::error::{BadInput, Error, Result};
use std::path::Path;

/// Fields of view, across, that few lenses without a fish's eye have, degrees: above it a given focal length is doubted. Chosen: the widest lenses of phones have 105 over
/// the diagonal, 92 across.
pub const WIDE_DEG: f64 = 95.0;

/// A file that a shoot lists.
#[derive(Clone, Debug)]
pub struct ListedFile<'a> {
    /// Its entry.
    pub spec: &'a PhotoSpec,
    /// The file.
    pub path: &'a Path,
    /// Its lens and size.
    pub key: LensKey,
    /// How its samples are stored.
    pub samples: Samples,
    /// What it says.
    pub metadata: Metadata,
}

impl Shoot {
    /// Opens every file that the shoot lists, without decoding pixels where its format allows.
    ///
    /// # Errors
    /// Bad input that names every file that cannot be read, with the remedy of the first.
    pub fn open(&self) -> Result<Vec<ListedFile<'_>>> {
        let (mut out, mut bad): (Vec<ListedFile<'_>>, Vec<(String, BadInput)>) = (Vec::new(), Vec::new());
        for spec in &self.photos {
            for path in &spec.files {
                match listed(spec, path) {
                    Ok(file) => out.push(file),
                    Err(Error::BadInput(why)) => bad.push((own_name(path), why)),
                    Err(other) => return Err(other),
                }
            }
        }
        let Some((_, first)) = bad.first() else { return Ok(out) };
        let problem: Vec<String> = bad.iter().map(|(name, why)| format!("{name}: {}", why.problem)).collect();
        Err(BadInput::new(problem.join("; "), first.remedy.clone()).in_file(&self.file).into())
    }

    /// Checks that the camera of every photograph is known: by board views through the same lens at the same size, or as given.
    ///
    /// # Errors
    /// Bad input that names a photograph whose size or focal length no board view has.
    pub fn check_lenses(&self, files: &[ListedFile<'_>]) -> Result<()> {
        let board = |f: &&ListedFile<'_>| f.spec.role == Role::Board && self.board.is_some();
        let mut known: Vec<&LensKey> = files.iter().filter(board).map(|f| &f.key).collect();
        if known.is_empty() && self.camera.given.is_some() {
            known.extend(files.iter().find(|f| f.spec.role.is_sample()).map(|f| &f.key));
        }
        if known.is_empty() {
            return Ok(());
        }
        for file in files.iter().filter(|f| f.spec.role != Role::Board) {
            if !known.iter().any(|k| k.holds(&file.key).is_some() || k.scaled(&file.key).is_some()) {
                let problem =
                    format!("{} is {}, and the camera is known for {}", own_name(file.path), file.key.describe(), known[0].describe());
                let remedy = "add board views through this lens at this size, or take all photographs alike";
                return Err(BadInput::new(problem, remedy).in_file(&self.file).at_line(file.spec.line).into());
            }
        }
        Ok(())
    }

    /// Photographs whose values have a tone curve and are to be linear.
    pub fn encoded<'a>(&self, files: &[ListedFile<'a>]) -> Vec<&'a Path> {
        let nothing = PlanarImage::new(0, 0);
        let is = |f: &&ListedFile<'a>| {
            let photo = photo::Photo { picture: nothing.clone(), samples: f.samples, metadata: f.metadata.clone() };
            f.spec.role != Role::Board && linear::why_not_linear(&photo, &self.camera, false).is_some()
        };
        files.iter().filter(is).map(|f| f.path).collect()
    }

    /// The field of view across that the given camera has for these files, degrees.
    pub fn given_field_of_view(&self, files: &[ListedFile<'_>]) -> Option<f64> {
        let file = files.iter().find(|f| f.spec.role.is_sample()).or(files.first())?;
        Some(self.camera.given?.lens(file.key.size.0, file.key.size.1).field_of_view_deg())
    }
}

fn listed<'a>(spec: &'a PhotoSpec, path: &'a Path) -> Result<ListedFile<'a>> {
    if let Some(bad) = photo::why_not_read(path) {
        return Err(bad.into());
    }
    let size = photo::size(path)?;
    let bytes = read_bounded(path, MAX_DATA_BYTES, "no photograph is so large: this is something else")?;
    let ending = photo::ending(path);
    let metadata = Metadata::of(&ending, &bytes);
    let samples = photo::samples(&ending, &bytes);
    Ok(ListedFile { spec, path, key: LensKey::of(spec.lens.as_deref(), size, &metadata), samples, metadata })
}

fn own_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
