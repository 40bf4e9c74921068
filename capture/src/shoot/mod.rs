//! The shoot file: which photographs there are, and what is known beforehand; `read` takes it from TOML.

mod files;
mod read;
mod spec;

pub use files::{ListedFile, WIDE_DEG};
pub use spec::{
    CameraSpec, FlatMethod, GivenLens, LightSpec, PhotoSpec, ROLES, Registration, Role, SATURATION, SampleSpec, Shape, Shoot, Stick,
    SurfaceKind,
};

/// What `biscale new shoot` writes.
pub const TEMPLATE: &str = include_str!("template.toml");
