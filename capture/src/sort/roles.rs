//! What each photograph is for.

use super::look::{Seen, SheetView, Subject};
use crate::kit::Kit;
use crate::lens_group::LensKey;
use crate::sheet::Target;
use biscale::numerics::statistics::upper_median;
use glam::DVec2;

/// How photographs of the sample are told apart. Chosen, not measured; `capture/tests/folders.rs` holds them.
struct RoleParams {
    /// Magnification over that of the distant photographs from which on a photograph is a close-up.
    nearer: f64,
    /// Shorter side of what a photograph shows over that of the sample, below which it is a close-up.
    whole: f64,
    /// Standard deviation of the logarithm of the ratio of the paper's light at the markers, below and above which two lights are the same, and are not.
    same_light: [f64; 2],
    /// Fewest markers that two photographs must share for that.
    shared: usize,
    /// Light of the paper over the brightest below which a marker lies in the shade.
    lit: f64,
    /// Distance of the markers, px, up to which two photographs are of one view.
    same_view_px: f64,
    /// Logarithm of the ratio of two exposures from which on photographs of one view are brackets.
    bracket: f64,
}

const PARAMS: RoleParams =
    RoleParams { nearer: 1.7, whole: 0.8, same_light: [0.06, 0.12], shared: 3, lit: 0.15, same_view_px: 3.0, bracket: 0.1 };

/// Words of a file's name that tell that it is kept back to test a fit.
const VALIDATION: &str = "valid";
/// Name of the light of the distant photograph, which is the shoot file's default, and of that of the validation.
pub(super) const LIGHTS: [&str; 2] = ["light", "other"];

/// A photograph of the sample from afar: one file, or brackets of one view.
#[derive(Clone, Debug)]
pub struct View {
    /// The files.
    pub files: Vec<Seen>,
    /// Why it has its role, for a person.
    pub why: String,
}

/// A photograph of the mirror ball.
#[derive(Clone, Debug)]
pub struct Ball {
    /// The photograph.
    pub seen: Seen,
    /// Place of its light in [`LIGHTS`].
    pub light: usize,
    /// Why, for a person.
    pub why: String,
}

/// The photographs by what they are for.
#[derive(Clone, Debug, Default)]
pub struct Roles {
    /// Views of the board.
    pub boards: Vec<Seen>,
    /// Even surfaces.
    pub flats: Vec<Seen>,
    /// Checkers.
    pub checkers: Vec<Seen>,
    /// Mirror balls.
    pub balls: Vec<Ball>,
    /// Close-ups, the best first.
    pub close_ups: Vec<Seen>,
    /// From afar, under the first light.
    pub distant: Vec<View>,
    /// The same under another light.
    pub validation: Vec<View>,
    /// What is known of none of these.
    pub unknown: Vec<Seen>,
}

impl Roles {
    /// Photographs that a capture reads linear values from.
    pub(super) fn linear(&self) -> impl Iterator<Item = &Seen> {
        let views = self.distant.iter().chain(&self.validation).flat_map(|v| &v.files);
        let balls = self.balls.iter().map(|b| &b.seen);
        self.flats.iter().chain(&self.checkers).chain(balls).chain(self.close_ups.first()).chain(views)
    }

    pub(super) fn need_srgb(&self) -> bool {
        self.linear().any(Seen::is_encoded)
    }

    /// Board views through the lens of a photograph.
    pub(super) fn boards_for(&self, seen: &Seen) -> usize {
        let key = |s: &Seen| LensKey::of(None, s.size, &s.metadata);
        let own = key(seen);
        self.boards.iter().filter(|b| key(b).holds(&own).is_some() || key(b).scaled(&own).is_some()).count()
    }
}

fn sheet(seen: &Seen) -> Option<&SheetView> {
    if let Subject::Sheet(view) = &seen.subject { Some(view) } else { None }
}

/// Gives every photograph its role. They come in the order they were taken.
pub(super) fn assign(seen: Vec<Seen>, kit: &Kit, notes: &mut Vec<String>) -> Roles {
    let mut roles = Roles::default();
    let (mut sheets, mut balls, mut repeating) = (Vec::new(), Vec::new(), Vec::new());
    for one in seen {
        match &one.subject {
            Subject::Board(_) => roles.boards.push(one),
            Subject::Even => roles.flats.push(one),
            Subject::Checker => roles.checkers.push(one),
            Subject::Sheet(view) if view.ball => balls.push(one),
            Subject::Sheet(_) => sheets.push(one),
            Subject::Repeats(_) => repeating.push(one),
            Subject::Nothing(why) => {
                notes.push(format!("{}: {why}: it is not used", one.name()));
                roles.unknown.push(one);
            }
        }
    }
    let far: Vec<f64> = balls.iter().filter_map(|b| Some(sheet(b)?.px_per_mm)).collect();
    close_ups(&mut sheets, repeating, &far, kit, &mut roles, notes);
    views(sheets, &mut roles, notes);
    lights(balls, &mut roles);
    roles
}

/// Close-ups are far larger than the rest (`far`: pixels a mm of other photographs), or too near to show the whole sample, or show nothing but a surface that
/// repeats.
fn close_ups(sheets: &mut Vec<Seen>, repeating: Vec<Seen>, far: &[f64], kit: &Kit, roles: &mut Roles, notes: &mut Vec<String>) {
    let scale = |s: &Seen| sheet(s).map_or(0.0, |v| v.px_per_mm);
    let least = sheets.iter().map(scale).chain(far.iter().copied()).fold(f64::INFINITY, f64::min);
    let object = kit.sheet.as_ref().map_or(0.0, |(_, s)| match s.target {
        Target::Cylinder { radius, height } => height.min(2.0 * radius),
        Target::Plane { width, height } => height.min(width),
        Target::Cone {} | Target::Box {} => 0.0,
    });
    let is_near = |s: &Seen| scale(s) > PARAMS.nearer * least || s.size.0.min(s.size.1) as f64 / scale(s).max(1e-9) < PARAMS.whole * object;
    let (mut near, far): (Vec<Seen>, Vec<Seen>) = sheets.drain(..).partition(is_near);
    *sheets = far;
    near.sort_by(|a, b| scale(b).total_cmp(&scale(a)));
    // With a marker its scale is known: those come first.
    near.extend(repeating);
    for other in near.iter().skip(1) {
        notes.push(format!("{}: another close-up; only {} is analysed", other.name(), near[0].name()));
    }
    roles.close_ups = near;
}

/// Merges brackets, and tells distant photographs from those under another light.
fn views(sheets: Vec<Seen>, roles: &mut Roles, notes: &mut Vec<String>) {
    let mut views: Vec<Vec<Seen>> = Vec::new();
    for one in sheets {
        match views.iter_mut().find(|v| is_bracket(&v[0], &one)) {
            Some(view) => view.push(one),
            None => views.push(vec![one]),
        }
    }
    let hinted = |v: &[Seen]| v.iter().any(|s| s.name().to_lowercase().contains(VALIDATION));
    let first = views.iter().position(|v| !hinted(v)).unwrap_or(0);
    let count = views.len();
    let reference = views.get(first).map(|v| v[0].clone());
    for (k, files) in views.into_iter().enumerate() {
        let Some(reference) = &reference else { break };
        let same = same_light(reference, &files[0]);
        let (validation, why) = match same {
            _ if k == first => (false, "the first photograph of the sample from afar".to_owned()),
            _ if hinted(&files) => (true, "its name says so".to_owned()),
            Some(true) => (false, format!("under the light of {}", reference.name())),
            Some(false) => (true, format!("the paper around the markers is lit otherwise than in {}", reference.name())),
            None if k + 1 == count => {
                notes.push(format!(
                    "{}: taken as the validation photograph, since it is the last one from afar; whether its light is another one its markers do not tell",
                    files[0].name()
                ));
                (true, "the last photograph of the sample from afar".to_owned())
            }
            None => (false, "a photograph of the sample from afar".to_owned()),
        };
        let view = View { files, why };
        if validation { roles.validation.push(view) } else { roles.distant.push(view) }
    }
}

/// Whether two photographs are of one view with different exposures.
fn is_bracket(a: &Seen, b: &Seen) -> bool {
    let (Some(va), Some(vb), Some(ea), Some(eb)) = (sheet(a), sheet(b), a.exposure(), b.exposure()) else { return false };
    let mut apart: Vec<f64> = va.middles.iter().filter_map(|(id, p)| Some(vb.middles.get(id)?.distance(*p))).collect();
    let count = apart.len();
    let off = upper_median(&mut apart).unwrap_or(f64::INFINITY);
    count >= PARAMS.shared && a.size == b.size && off < PARAMS.same_view_px && (ea / eb).ln().abs() > PARAMS.bracket
}

/// Whether the paper around the markers is lit alike in two photographs; `None` where that does not tell: few markers in common, or a flat sheet, on which every
/// distant lamp is even.
fn same_light(a: &Seen, b: &Seen) -> Option<bool> {
    let (a, b) = (sheet(a)?, sheet(b)?);
    let top = |v: &SheetView| v.paper.values().fold(0.0_f64, |t, p| t.max(*p));
    let lit = |v: &SheetView, p: f64| p > PARAMS.lit * top(v);
    let pairs: Vec<(f64, f64, DVec2)> = a
        .paper
        .iter()
        .filter_map(|(id, p)| Some((*p, *b.paper.get(id)?, *a.middles.get(id)?)))
        .filter(|(p, q, _)| lit(a, *p) || lit(b, *q))
        .map(|(p, q, at)| (p.max(1e-4), q.max(1e-4), at))
        .collect();
    if pairs.len() < PARAMS.shared {
        return None;
    }
    let logs: Vec<f64> = pairs.iter().map(|(p, q, _)| (p / q).ln()).collect();
    let mean = logs.iter().sum::<f64>() / logs.len() as f64;
    let deviation = (logs.iter().map(|l| (l - mean).powi(2)).sum::<f64>() / logs.len() as f64).sqrt();
    let own: Vec<f64> = pairs.iter().map(|(p, _, _)| p.ln()).collect();
    let spread = own.iter().fold(f64::NEG_INFINITY, |t, v| t.max(*v)) - own.iter().fold(f64::INFINITY, |t, v| t.min(*v));
    if deviation > PARAMS.same_light[1] {
        return Some(false);
    }
    // Even light on even paper says nothing.
    (deviation < PARAMS.same_light[0] && spread > PARAMS.same_light[1]).then_some(true)
}

/// Gives each ball the light of the photograph whose paper is lit alike; those that do not tell in turn.
fn lights(balls: Vec<Seen>, roles: &mut Roles) {
    for (k, ball) in balls.into_iter().enumerate() {
        let alike = |views: &[View]| views.first().and_then(|v| same_light(&v.files[0], &ball));
        let (light, why) = match (alike(&roles.distant), alike(&roles.validation)) {
            (Some(true), other) if other != Some(true) => (0, "lit as the distant photograph"),
            (other, Some(true)) if other != Some(true) => (1, "lit as the validation photograph"),
            (Some(false), None) => (1, "lit otherwise than the distant photograph"),
            (None, Some(false)) => (0, "lit otherwise than the validation photograph"),
            _ => (k.min(1), "by its turn: its markers do not tell under which lamp it is"),
        };
        roles.balls.push(Ball { seen: ball, light, why: why.to_owned() });
    }
}
