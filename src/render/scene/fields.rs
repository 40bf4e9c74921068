//! Ranges and forms that the fields of a scene file share.

use crate::error::Result;
use crate::toml_reader::{Range, TableReader, range};
use glam::DVec3;

/// Positions of the large scale.
pub(super) const POSITION: Range = range(-1e6, 1e6);
/// Lengths of the large scale.
pub(super) const LENGTH: Range = range(1e-6, 1e6);
/// Radiometric quantities.
pub(super) const LIGHT: Range = range(0.0, 1e9);

/// Three numbers as a unit vector.
pub(super) fn unit_vector(table: &TableReader<'_>, key: &'static str) -> Result<Option<DVec3>> {
    let Some(v) = table.array::<3>(key, POSITION)? else { return Ok(None) };
    match DVec3::from(v).try_normalize() {
        Some(unit) => Ok(Some(unit)),
        None => Err(table.error_at(key, "the vector has no length", "write a direction")),
    }
}

/// The value of a key that has no default.
pub(super) fn required<T>(table: &TableReader<'_>, key: &str, value: Option<T>, example: &str) -> Result<T> {
    value.ok_or_else(|| table.missing(key, example))
}
