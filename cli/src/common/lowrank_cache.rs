//! Where this user's compressed BRDFs of the low-rank method are kept between runs.

use biscale::filter::MatrixCache;
use std::path::PathBuf;

/// Names the folder, should it not be the system's usual one.
pub const VARIABLE: &str = "BISCALE_CACHE";
/// Most bytes of all files.
const MAX_BYTES: u64 = 4 << 30;

/// The cache of this user, if the system names a folder for such.
pub fn user_cache() -> Option<MatrixCache> {
    let folder = match std::env::var_os(VARIABLE).filter(|v| !v.is_empty()) {
        Some(folder) => PathBuf::from(folder),
        None => dirs::cache_dir()?.join("biscale"),
    };
    Some(MatrixCache { folder, max_bytes: MAX_BYTES })
}
