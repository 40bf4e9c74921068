//! What one photograph of a surface tells by itself, without a board, a scale or a known light, and what it cannot tell.
//!
//! Ratios are kept by an unknown scale and an unknown exposure: of pitches, of widths, of colours. Sizes, reflectances, heights, gloss and the light are not in the
//! picture; nothing is said of them but that.

use crate::linear;
use crate::photo;
use crate::shoot::CameraSpec;
use crate::weave::{self, Analysis, FindingCode, MaterialGuesses, Measured, Profile, RectifiedPhoto, Relief, Weave, WeaveOptions};
use biscale::error::Result;
use biscale::numerics::cast::truncate_usize;
use std::path::Path;

/// What a photograph by itself tells.
#[derive(Clone, Debug)]
pub struct Single {
    /// The analysis; lengths are pixels.
    pub analysis: Analysis,
    /// What is known: a name, and the value with its error.
    pub known: Vec<(&'static str, String)>,
    /// What makes it doubtful.
    pub doubts: Vec<String>,
    /// What is not known, and what would tell it.
    pub unknown: Vec<(&'static str, &'static str)>,
    /// A material that looks about so, of the same repeat; none where nothing was recognised.
    pub material: Option<String>,
}

/// What no single photograph tells.
const NEVER: [(&str, &str); 5] = [
    ("size", "a marker or a ruler in the picture: lengths are pixels"),
    ("reflectance", "a colour checker and the exposure: colours hold the light, its highlights, the shading and the camera's curve"),
    ("heights and the direction of the light", "a light whose direction is known, and the fit of a distant photograph"),
    ("gloss", "photographs from afar under two lights"),
    ("the back, and what lies behind the gaps", "a photograph against the light"),
];

/// Looks at a photograph that shows a surface straight on. Values with a tone curve are taken as sRGB.
///
/// # Errors
/// A file that cannot be read, or is too small.
pub fn look(file: &Path, options: &WeaveOptions) -> Result<Single> {
    let photo = photo::read(file)?;
    let encoded = photo::is_encoded(photo.samples, &photo.metadata);
    let camera = CameraSpec::default();
    let (picture, saturated) = linear::sensor(photo, &camera, encoded);
    let rgb: Vec<[f32; 3]> = (0..saturated.len()).map(|i| picture.planes.each_ref().map(|p| p[i])).collect();
    let good: Vec<bool> = saturated.iter().map(|s| !s).collect();
    let rectified = RectifiedPhoto { width: picture.width, height: picture.height, rgb: &rgb, mask: Some(&good), mm_per_pixel: None };
    let analysis = weave::analyse(&rectified, options)?;
    let mut doubts: Vec<String> = analysis.findings.iter().map(|f| f.message.clone()).collect();
    if encoded {
        doubts
            .push("its values were taken as sRGB, and cameras change them by more than that curve: ratios of colours are about so".into());
    }
    let seen = |code| analysis.findings.iter().any(|f| f.code == code);
    let uncertain = seen(FindingCode::Undersampled) || seen(FindingCode::AmbiguousWeave);
    let mut known = Vec::new();
    match (&analysis.weave, &analysis.relief) {
        (Some(weave), _) => threads(weave, uncertain, &mut known),
        (None, Some(relief)) => profile(relief, &mut known),
        (None, None) => {}
    }
    // The name is in every picture of the material, beside a scale bar in the units of the file.
    let name = format!("{}, 1 mm is a pixel", file.file_stem().unwrap_or_default().to_string_lossy());
    let material = analysis.material(&name, &MaterialGuesses::default()).map(|text| {
        let marks: String = doubts.iter().map(|d| format!("# Doubtful: {}.\n", d.replace(char::is_control, " "))).collect();
        format!("# From one photograph: the repeat, and ratios of widths and colours. Lengths, heights and reflectances are guesses.\n{marks}{text}")
    });
    let mut unknown = NEVER.to_vec();
    if uncertain && analysis.weave.is_some() {
        unknown.insert(0, ("which thread is on top, and how wide threads are", "a photograph from nearer: 8 pixels a thread or more"));
    }
    Ok(Single { analysis, known, doubts, unknown, material })
}

/// A ratio with the error of both.
fn ratio(a: Measured, b: Measured) -> String {
    let value = a.value / b.value;
    let error = value * (a.error / a.value).hypot(b.error / b.value);
    // Two digits of the error, of an error that is not below what is worth writing.
    let decimals = if error > 0.0 { truncate_usize((1.0 - error.log10().floor()).clamp(2.0, 6.0)) } else { 6 };
    format!("{value:.decimals$} +/- {error:.decimals$}")
}

/// What is known of threads; with `uncertain` no more than what repeats.
fn threads(weave: &Weave, uncertain: bool, known: &mut Vec<(&'static str, String)>) {
    let (warp, weft) = (&weave.warp, &weave.weft);
    let class = if uncertain {
        format!("likeliest {}, which is not certain", weave.class)
    } else {
        format!("{} (confidence {:.2})", weave.class, weave.confidence)
    };
    known.push(("weave", class));
    known.push(("distance of the warp threads over that of the weft", ratio(warp.pitch, weft.pitch)));
    known.push(("repeat", format!("{} x {} threads", weave.draft.columns, weave.draft.rows)));
    if uncertain {
        return;
    }
    known.push(("width of the warp over that of the weft", ratio(warp.width, weft.width)));
    known.push(("width of the warp over its distance", ratio(warp.width, warp.pitch)));
    known.push(("width of the weft over its distance", ratio(weft.width, weft.pitch)));
    let over = |c: usize| warp.colour[c] / weft.colour[c];
    if weft.colour.iter().all(|c| *c > 0.0) {
        known.push((
            "colour of the warp over that of the weft, as seen (red, green, blue)",
            format!("{:.2}, {:.2}, {:.2}", over(0), over(1), over(2)),
        ));
    }
    known.push(("difference of both colours", format!("Delta E {:.1}", weave.colour_difference)));
}

fn profile(relief: &Relief, known: &mut Vec<(&'static str, String)>) {
    known.push(("relief", format!("{:?}", relief.profile)));
    if let (Profile::Pyramids, [x, y]) = (&relief.profile, &relief.period[..]) {
        known.push(("period along x over that along y", ratio(*x, *y)));
    }
}
