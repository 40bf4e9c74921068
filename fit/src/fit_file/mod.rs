//! The fit file and all that it names: TOML in, a [`spec::Spec`] out.

pub mod assignment;
mod capture;
pub mod material_text;
pub mod spec;
pub mod template;
pub mod variant;
