//! What a photograph shows.

use super::folder::name;
use crate::board::Board;
use crate::colour::checker_rgb;
use crate::edges::GreyImage as _;
use crate::kit::Kit;
use crate::lens::Lens;
use crate::light;
use crate::linear;
use crate::metadata::Metadata;
use crate::photo::{self, PlanarImage, Samples};
use crate::shoot::CameraSpec;
use crate::vision::board::{DetectedBoard, detect};
use crate::vision::markers::other_family;
use crate::vision::{GreyImage8, Luminance, checker, circle};
use crate::weave::{self, FindingCode, RectifiedPhoto, WeaveOptions};
use biscale::error::{Error, Result};
use biscale::numerics::linear_algebra;
use biscale::numerics::statistics::upper_median;
use glam::DVec2;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How things are told apart. Chosen, not measured; `capture/tests/folders.rs` holds twenty folders to what they are.
struct LookParams {
    /// Corners of the squares from which on a photograph is a view of the board.
    board_corners: usize,
    /// Blocks across and down of the small picture that copies and even surfaces are told by.
    blocks: usize,
    /// RMS of what a paraboloid leaves of the blocks of an even surface, relative.
    even: f64,
    /// RMS of the differences of neighbours in an even surface, relative: it is out of focus, so that what is left is noise.
    smooth: f64,
    /// Range of the mean of an even surface: exposed, and not burnt out.
    exposed: [f64; 2],
    /// Largest over smallest mean of the channels of white paper: of values with a tone curve, and of a sensor's own.
    neutral: [f64; 2],
    /// Mean Delta E 2000 below which what looks like a checker is one.
    checker: f64,
    /// Focal length over the picture's width that outlines of balls are judged with: a phone's main lens has about 0.75, a portrait lens 2.
    focal: f64,
    /// Side of the piece in the middle that is looked at for repetition, px.
    piece: usize,
    /// Correlation of the small pictures from which on two photographs show the same.
    copy: f64,
    /// Share of a relief that its profile explains, from which on it is one.
    relief: f64,
}

/// What is said of a photograph of which nothing is known.
const UNKNOWN: &str = "nothing of the shoot is seen in it";

const PARAMS: LookParams = LookParams {
    board_corners: 6,
    blocks: 32,
    even: 0.03,
    smooth: 0.1,
    exposed: [0.04, 0.97],
    neutral: [1.35, 3.0],
    checker: 10.0,
    focal: 1.2,
    piece: 768,
    copy: 0.9985,
    relief: 0.8,
};

/// What a photograph is of.
#[derive(Clone, Debug, PartialEq)]
pub enum Subject {
    /// The calibration board, with so many of its corners.
    Board(usize),
    /// The sheet of the sample.
    Sheet(SheetView),
    /// An even surface.
    Even,
    /// A colour checker.
    Checker,
    /// Nothing but a surface that repeats.
    Repeats(String),
    /// Nothing that is known; in words.
    Nothing(String),
}

/// The markers of a sheet in a photograph.
#[derive(Clone, Debug, PartialEq)]
pub struct SheetView {
    /// Middles of the markers by their numbers, px.
    pub middles: BTreeMap<i32, DVec2>,
    /// Light of the paper around each, linear, over exposure where that is known.
    pub paper: BTreeMap<i32, f64>,
    /// Pixels a millimetre, at the median marker.
    pub px_per_mm: f64,
    /// Whether a mirror ball with a highlight is seen.
    pub ball: bool,
}

/// A photograph that was looked at.
#[derive(Clone, Debug)]
pub struct Seen {
    /// The file.
    pub path: PathBuf,
    /// Pixels across and down.
    pub size: (usize, usize),
    /// How its samples are stored.
    pub samples: Samples,
    /// What the file says.
    pub metadata: Metadata,
    /// What it shows.
    pub subject: Subject,
    /// Means of blocks of its luminance, less their mean and over their deviation.
    small: Vec<f64>,
}

impl Seen {
    /// The file's name.
    pub fn name(&self) -> String {
        name(&self.path)
    }

    /// Whether its values have a tone curve.
    pub fn is_encoded(&self) -> bool {
        photo::is_encoded(self.samples, &self.metadata)
    }

    /// Light that a value of 1 stands for, relative; `None` where the file tells no time.
    pub fn exposure(&self) -> Option<f64> {
        let m = &self.metadata;
        Some(m.seconds? * m.iso.unwrap_or(100.0) / m.f_number.unwrap_or(1.0).powi(2))
    }
}

/// Looks at a photograph; what cannot be read is told in words.
pub(super) fn look(file: &Path, kit: &Kit) -> Result<Result<Seen, String>> {
    let photo = match photo::read(file) {
        Ok(photo) => photo,
        Err(Error::BadInput(bad)) => return Ok(Err(format!("{}: {}; {}", name(file), bad.problem, bad.remedy))),
        Err(other) => return Err(other),
    };
    let (samples, metadata) = (photo.samples, photo.metadata.clone());
    let encoded = photo::is_encoded(samples, &metadata);
    let size = (photo.picture.width, photo.picture.height);
    let grey = GreyImage8::of(&photo.picture, encoded);
    let small = blocks(&grey);
    let camera = CameraSpec::default();
    let even = is_even(&photo.picture, encoded, samples);
    let (linear, saturated) = linear::sensor(photo, &camera, encoded);
    let subject = if even { Subject::Even } else { subject(&grey, &linear, &saturated, kit)? };
    Ok(Ok(Seen { path: file.to_path_buf(), size, samples, metadata, subject, small: normalised(small) }))
}

fn subject(grey: &GreyImage8, linear: &PlanarImage, saturated: &[bool], kit: &Kit) -> Result<Subject> {
    if let Some(board) = kit.board.layout() {
        let found = detect(grey, &board)?;
        if found.corners.len() >= PARAMS.board_corners {
            return Ok(Subject::Board(found.corners.len()));
        }
    }
    let mut view = None;
    if let Some((_, sheet)) = &kit.sheet {
        let layout = Board::of_sheet(sheet);
        let found = detect(grey, &layout)?;
        if !found.markers.is_empty() {
            view = Some(sheet_view(&found, &layout, linear, grey)?);
        }
    }
    if view.as_ref().is_none_or(|v| !v.ball)
        && let Some(found) = checker::find(linear, saturated, None, None)?
        && found.correction.mean_delta_e() < PARAMS.checker
        && found.measured.len() == checker_rgb().len()
    {
        return Ok(Subject::Checker);
    }
    if let Some(view) = view {
        return Ok(Subject::Sheet(view));
    }
    let dictionary = kit.board.layout().and_then(|b| b.dictionary);
    if let Some((family, count)) = other_family(grey, dictionary.as_ref())? {
        return Ok(Subject::Nothing(format!("{count} markers of {family} are seen, which are neither the board's nor the sheet's")));
    }
    repeats(linear)
}

fn sheet_view(found: &DetectedBoard, layout: &Board, linear: &PlanarImage, grey: &GreyImage8) -> Result<SheetView> {
    let luminance = Luminance(linear);
    let cells = layout.dictionary.as_ref().map_or(7.0, |d| d.cells() as f64);
    let (mut middles, mut paper, mut scales) = (BTreeMap::new(), BTreeMap::new(), Vec::new());
    for (id, corners) in &found.markers {
        let middle = corners.iter().sum::<DVec2>() / 4.0;
        middles.insert(*id, middle);
        let places = crate::vision::board::marker_places(layout, *id).unwrap_or_default();
        // The longest side: on a cylinder the others are foreshortened.
        let longest = (0..4).map(|k| corners[k].distance(corners[(k + 1) % 4])).fold(0.0, f64::max);
        scales.push(longest / places[0].distance(places[1]).max(1e-9));
        // Half a cell away from the middle of each side there is white.
        let mut around: Vec<f64> = (0..4)
            .filter_map(|k| {
                let side = 0.5 * (corners[k] + corners[(k + 1) % 4]);
                luminance.value(side + (side - middle) / cells)
            })
            .collect();
        if let Some(light) = upper_median(&mut around) {
            paper.insert(*id, light);
        }
    }
    let px_per_mm = upper_median(&mut scales).unwrap_or(0.0);
    Ok(SheetView { middles, paper, px_per_mm, ball: shows_ball(linear, grey)? })
}

/// Whether a mirror ball is seen: a circle of which half is an edge, around a small highlight.
fn shows_ball(linear: &PlanarImage, grey: &GreyImage8) -> Result<bool> {
    let focal = PARAMS.focal * grey.width.max(grey.height) as f64;
    let centre = 0.5 * DVec2::new(grey.width as f64 - 1.0, grey.height as f64 - 1.0);
    let lens = Lens { width: grey.width, height: grey.height, focal: DVec2::splat(focal), centre, distortion: [0.0; 5] };
    let luminance = Luminance(linear);
    for (spot, size) in circle::spots(linear) {
        for candidate in circle::around(grey, spot, size)? {
            let rays: Vec<Vec<glam::DVec3>> =
                circle::outline(&luminance, candidate).iter().map(|e| e.iter().filter_map(|p| lens.ray(*p)).collect()).collect();
            let Some(outline) = light::ball_outline(&rays, 1.0 / focal) else { continue };
            if 2 * outline.rays >= circle::RAYS as usize && circle::highlight(&luminance, candidate).is_some() {
                return Ok(true);
            }
        }
    }
    Ok(false)
}

/// What repeats in the middle of a photograph that shows no marker. A chessboard and a fence repeat, too: a weave must explain what is seen.
fn repeats(linear: &PlanarImage) -> Result<Subject> {
    let (w, h) = (linear.width.min(PARAMS.piece), linear.height.min(PARAMS.piece));
    let (left, top) = ((linear.width - w) / 2, (linear.height - h) / 2);
    let rgb: Vec<[f32; 3]> = (0..w * h).map(|i| linear.at(left + i % w, top + i / w)).collect();
    let photo = RectifiedPhoto { width: w, height: h, rgb: &rgb, mask: None, mm_per_pixel: None };
    let found = match weave::analyse(&photo, &WeaveOptions::default()) {
        Ok(found) => found,
        Err(Error::BadInput(_)) => return Ok(Subject::Nothing(UNKNOWN.into())),
        Err(other) => return Err(other),
    };
    let finding = |code| found.findings.iter().any(|f| f.code == code);
    let unsure = "something repeats in it, but no weave explains it: if it is the close-up, take it with a marker in the picture";
    Ok(match (&found.weave, &found.relief) {
        _ if finding(FindingCode::NoPeriod) => Subject::Nothing(UNKNOWN.into()),
        (Some(weave), _) if !finding(FindingCode::AmbiguousWeave) => {
            Subject::Repeats(format!("a weave, {:.1} pixels a thread", weave.warp.pixels.min(weave.weft.pixels)))
        }
        (None, Some(relief)) if relief.explained > PARAMS.relief => Subject::Repeats("a surface that repeats".to_owned()),
        _ => Subject::Nothing(unsure.into()),
    })
}

/// Means of blocks of a grey picture.
fn blocks(grey: &GreyImage8) -> Vec<f64> {
    let n = PARAMS.blocks;
    let edge = |k: usize, whole: usize| k * whole / n;
    let mut out = Vec::with_capacity(n * n);
    for j in 0..n {
        for i in 0..n {
            let (x, y) = (
                edge(i, grey.width)..edge(i + 1, grey.width).max(edge(i, grey.width) + 1),
                edge(j, grey.height)..edge(j + 1, grey.height).max(edge(j, grey.height) + 1),
            );
            let count = (x.len() * y.len()) as f64;
            let sum: f64 = y.map(|row| x.clone().map(|column| f64::from(grey.pixels[row * grey.width + column])).sum::<f64>()).sum();
            out.push(sum / count);
        }
    }
    out
}

fn normalised(mut values: Vec<f64>) -> Vec<f64> {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    values.iter_mut().for_each(|v| *v -= mean);
    let norm = values.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-9);
    values.iter_mut().for_each(|v| *v /= norm);
    values
}

/// Whether a picture is of white or grey paper out of focus: neutral, smooth, and nothing but a falloff and a slope.
fn is_even(picture: &PlanarImage, encoded: bool, samples: Samples) -> bool {
    let n = PARAMS.blocks;
    let (bw, bh) = (picture.width / n, picture.height / n);
    if bw < 4 || bh < 4 {
        return false;
    }
    let mut means = [vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]];
    let mut rough = 0.0;
    for (mean, plane) in means.iter_mut().zip(&picture.planes) {
        for (k, m) in mean.iter_mut().enumerate() {
            let (left, top) = ((k % n) * bw, (k / n) * bh);
            let mut differences = 0.0;
            for y in top..top + bh {
                let line = &plane[y * picture.width + left..y * picture.width + left + bw];
                *m += line.iter().map(|v| f64::from(*v)).sum::<f64>();
                differences += line.windows(2).map(|w| f64::from(w[1] - w[0]).powi(2)).sum::<f64>();
            }
            let count = (bw * bh) as f64;
            *m /= count;
            rough += differences / count / m.max(1e-6).powi(2) / (3 * n * n) as f64;
        }
    }
    let of = |values: &[f64]| values.iter().sum::<f64>() / (n * n) as f64;
    let channels = [of(&means[0]), of(&means[1]), of(&means[2])];
    let (low, high) = channels.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), c| (l.min(*c), h.max(*c)));
    let neutral = PARAMS.neutral[usize::from(!encoded)];
    let [least, most] = PARAMS.exposed;
    let exposed = samples == Samples::Float || (low > least && high < most);
    exposed && high < neutral * low && rough.sqrt() < PARAMS.smooth && beside_paraboloid(&means[1]) < PARAMS.even
}

/// RMS of what `1, x, y, x², x y, y²` leave of the means of blocks, relative to their mean.
fn beside_paraboloid(values: &[f64]) -> f64 {
    let n = PARAMS.blocks;
    let place = |k: usize| (2.0 * ((k % n) as f64 + 0.5) / n as f64 - 1.0, 2.0 * ((k / n) as f64 + 0.5) / n as f64 - 1.0);
    let terms = |k: usize| {
        let (x, y) = place(k);
        let r2 = x * x + y * y;
        [1.0, x, y, x * x, x * y, y * y, r2 * r2]
    };
    let rows: Vec<Vec<f64>> = (0..values.len()).map(|k| terms(k).to_vec()).collect();
    let Some(c) = linear_algebra::least_squares(&rows, values) else { return f64::INFINITY };
    let left: f64 = values.iter().enumerate().map(|(k, v)| (v - terms(k).iter().zip(&c).map(|(t, c)| t * c).sum::<f64>()).powi(2)).sum();
    (left / values.len() as f64).sqrt() / (values.iter().sum::<f64>() / values.len() as f64).max(1e-9)
}

/// Takes out photographs that are copies of others: reduced and written again by a messenger, or taken twice of the same view.
pub(super) fn without_copies(seen: Vec<Seen>, notes: &mut Vec<String>) -> Vec<Seen> {
    let mut seen = seen;
    // The largest first; of one size those whose files tell more.
    seen.sort_by_key(|s| (std::cmp::Reverse(s.size.0 * s.size.1), s.metadata.seconds.is_none(), s.name()));
    let mut kept: Vec<Seen> = Vec::new();
    for one in seen {
        // Even surfaces all look alike, and brackets of one view are no copies.
        let original = kept.iter().find(|k| {
            let alike = k.small.iter().zip(&one.small).map(|(a, b)| a * b).sum::<f64>() > PARAMS.copy;
            let bracket = k.exposure().zip(one.exposure()).is_some_and(|(a, b)| (a / b).ln().abs() > 0.1);
            alike && !bracket && one.subject != Subject::Even && std::mem::discriminant(&k.subject) == std::mem::discriminant(&one.subject)
        });
        match original {
            Some(original) if original.size == one.size => {
                notes.push(format!("{}: shows the same as {}, which is taken", one.name(), original.name()));
            }
            Some(original) => notes.push(format!(
                "{}: a copy of {} of {} x {} pixels (as messengers send them): the original of {} x {} is taken",
                one.name(),
                original.name(),
                one.size.0,
                one.size.1,
                original.size.0,
                original.size.1
            )),
            None => kept.push(one),
        }
    }
    // In the order they were taken.
    kept.sort_by_key(|s| (s.metadata.taken.clone(), s.name()));
    kept
}
