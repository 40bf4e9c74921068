//! The kinds of files that a user writes, told by what is in them.

use biscale::error::{BadInput, Error};
use biscale::render::Scene;
use biscale::toml_reader::Source;
use biscale_capture::shoot::Shoot;
use biscale_fit::fit_file::spec::Spec;
use std::path::Path;

/// What a file is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    Material,
    Scene,
    Shoot,
    Fit,
}

impl FileKind {
    /// The kind of a file by its tables. What has none of another kind's is a material, so that its errors are those of one.
    pub fn of(source: &Source) -> Self {
        if Spec::is_fit(source) {
            Self::Fit
        } else if Shoot::is_shoot(source) {
            Self::Shoot
        } else if Scene::is_scene(source) {
            Self::Scene
        } else {
            Self::Material
        }
    }

    /// As an error names it.
    fn name(self) -> &'static str {
        match self {
            Self::Material => "material file",
            Self::Scene => "scene file",
            Self::Shoot => "shoot file",
            Self::Fit => "fit file",
        }
    }

    /// The commands that take such files.
    fn commands(self) -> &'static str {
        match self {
            Self::Material => "`biscale eval`, `bake`, `plot`, `study` and `fold` take it",
            Self::Scene => "`biscale render` takes it",
            Self::Shoot => "`biscale capture` takes it",
            Self::Fit => "`biscale fit` takes it",
        }
    }
}

/// The error of a command that wants a file of kind `wanted` and got `path`: if that is a file of another kind, this is what a user must
/// know, and not which of its keys are unknown.
pub fn explain(error: Error, wanted: FileKind, path: &Path) -> Error {
    match &error {
        Error::BadInput(bad) if bad.file.as_deref() == Some(path) => {}
        _ => return error,
    }
    let Ok(source) = Source::read(path) else { return error };
    // A text that is none of anything is not called a material.
    let kind = FileKind::of(&source);
    let certain = kind != FileKind::Material || source.parse().is_ok_and(|root| root.get_ref().contains_key("geometry"));
    if kind == wanted || !certain {
        return error;
    }
    BadInput::new(format!("this is a {}, not a {}", kind.name(), wanted.name()), kind.commands()).in_file(path).into()
}
