//! What the photographs can say: how well each unknown is known, and which are not to be trusted.

pub mod identify;
pub mod params;
pub mod profile;
