//! What a sidecar tells of a wrap sheet: `biscale capture` reads it.

use biscale_fabricate::wrap::{JOIN, SEAM, Target, Wrap, WrapFit};
use serde_json::{Value, json};

/// The object `wrap` of a sidecar.
pub fn wrap_json(target: Target, fit: WrapFit, wrap: &Wrap) -> Value {
    json!({
        "target": target,
        "fit": fit,
        "dictionary": "DICT_5X5_100",
        "seam_mm": SEAM,
        "origin_mm": wrap.parts[0].origin_mm,
        "turned": wrap.turned,
        "join_mm": JOIN,
        "joined_size_mm": wrap.size.to_array(),
        "cut_margins_mm": wrap.margins,
        "pages": wrap.parts,
        "markers": wrap.markers,
        "patches": wrap.patches,
    })
}
