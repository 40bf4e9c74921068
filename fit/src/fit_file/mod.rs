//! The fit file and all that it names: TOML in, a [`spec::Spec`] out.

pub mod assignment;
pub mod candidate;
mod capture;
pub mod default_moves;
pub mod material_text;
pub mod moving;
pub mod spec;
pub mod structure;
pub mod template;
pub mod variant;
