//! What `biscale fold` says about a pattern: to a person, and to other programs in the sidecar.

use biscale_fabricate::drawing::{Sheets, order};
use biscale_fabricate::mesh::Mesh;
use biscale_fabricate::preview::Preview;
use biscale_fabricate::unfold::Pattern;
use glam::DVec2;
use serde_json::{Value, json};
use std::path::PathBuf;

/// What was folded.
pub(super) struct FoldedDesign {
    pub(super) title: String,
    pub(super) mesh: Mesh,
    pub(super) pattern: Pattern,
    pub(super) sheets: Sheets,
    pub(super) notes: Vec<String>,
    /// Volume between the design and a plane through its lowest point, mm³.
    pub(super) volume: f64,
    /// What the sidecar tells of the wrap sheet.
    pub(super) wrap: Option<Value>,
    pub(super) preview: Option<Preview>,
}

impl FoldedDesign {
    /// What the sidecar says; nothing in it depends on the clock.
    pub(super) fn summary(&self) -> Value {
        let (least, _) = self.mesh.narrowest();
        json!({
            "title": self.title,
            "facets": self.mesh.facets.len(),
            "pieces": self.pattern.pieces.len(),
            "different_pieces": self.different(),
            "glued_edges": self.pattern.glued.len(),
            "folds": self.pattern.pieces.iter().map(|p| p.folds.iter().filter(|f| f.angle != 0.0).count()).sum::<usize>(),
            "pages": self.sheets.pages.len(),
            "narrowest_facet_mm": least,
            "preview": self.preview,
            "notes": self.notes,
        })
    }

    /// How many shapes of pieces there are.
    fn different(&self) -> usize {
        self.pattern.pieces.iter().map(|p| p.like).collect::<std::collections::BTreeSet<_>>().len()
    }

    pub(super) fn tell(&self, milliseconds: f64, names: &[PathBuf]) -> String {
        let mut text = format!(
            "{}: {} facets in {} pieces ({} different), {} glued edges, {} pages; {milliseconds:.0} ms",
            self.title,
            self.mesh.facets.len(),
            self.pattern.pieces.len(),
            self.different(),
            self.pattern.glued.len(),
            self.sheets.pages.len()
        );
        for note in &self.notes {
            text.push_str(&format!("\nnote: {note}"));
        }
        text.push_str(&preview_text(self.preview.as_ref()));
        text.push_str(&written(names));
        text
    }
}

/// What other programs want to know of the sheets, in mm.
pub(super) fn sidecar(folded: &FoldedDesign, recipe: &Value, summary: &Value) -> Value {
    let pieces: Vec<Value> = folded
        .pattern
        .pieces
        .iter()
        .zip(&folded.sheets.places)
        .enumerate()
        .map(|(k, (piece, place))| {
            let moved = piece.moved(place.x, place.shift);
            let (l, h) = moved.outline.iter().flatten().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
            json!({
                "piece": piece.name,
                "copy": piece.copy,
                "copies": piece.copies,
                "like": folded.pattern.pieces[piece.like].name,
                "alike": folded.pattern.alike(k),
                "page": place.page + 1,
                "low_mm": l.to_array(),
                "high_mm": h.to_array(),
                "facets": piece.facets.len(),
            })
        })
        .collect();
    let pages: Vec<Value> = folded.sheets.pages.iter().map(|p| json!({ "size_mm": p.size.to_array() })).collect();
    json!({
        "creator": biscale_fabricate::formats::CREATOR,
        "format": 1,
        "recipe": recipe,
        "summary": summary,
        "pages": pages,
        "pieces": pieces,
        "wrap": folded.wrap,
        "order": order(&folded.mesh, &folded.pattern).iter().map(|&k| &folded.pattern.pieces[k]).filter(|p| p.copy == 1).map(|p| p.name).collect::<Vec<_>>(),
    })
}

/// The files written, as a line of its own.
pub(super) fn written(names: &[PathBuf]) -> String {
    let list = match names {
        [one, rest @ .., last] if rest.len() > 1 => format!("{} ... {}", one.display(), last.display()),
        _ => names.iter().map(|n| n.display().to_string()).collect::<Vec<_>>().join(", "),
    };
    format!("\nwrote {list}")
}

/// What a preview says, as a line of its own; nothing without one.
pub(super) fn preview_text(preview: Option<&Preview>) -> String {
    let Some(p) = preview else { return String::new() };
    let sampling = if p.sampling_rms > 0.0 { format!("sampling alone {:.1} %, ", 100.0 * p.sampling_rms) } else { String::new() };
    format!(
        "\npreview: {} change the effective BRDF by {:.1} % (relative RMS of {} pairs; {sampling}error {:.1} %)",
        p.crafted.text(),
        100.0 * p.relative_rms,
        p.pairs,
        100.0 * p.error
    )
}

/// Width, depth and height of a surface.
pub(super) fn size_text(mesh: &Mesh) -> String {
    let low = mesh.vertices.iter().copied().fold(glam::DVec3::INFINITY, glam::DVec3::min);
    let high = mesh.vertices.iter().copied().fold(glam::DVec3::NEG_INFINITY, glam::DVec3::max);
    let d = high - low;
    format!("{:.0} x {:.0} x {:.0} mm", d.x, d.y, d.z)
}
