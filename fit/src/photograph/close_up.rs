//! What the close-up says: the period, and for each surface how much of the picture it takes up and how much light it sends.
//!
//! From afar a dark thread that is wide looks as a bright one that is narrow: cover times colour is all that shows. The close-up takes them apart.
//! Its pixels are sorted by colour into as many clusters as the material has surfaces. Of each cluster three things are used, and each has its
//! counterpart in the small-scale surface seen under the same pair of directions:
//!
//! - the *cover*: its share of the picture where it is lit, against the area that both light and viewer see;
//! - the *light*: the sum of its radiance over all pixels of the picture, against the share of `S` that comes from that surface;
//! - its *tones*: the mean radiance of its darkest fifth, of its next one, and so on, against those of its facets. They tell gloss from
//!   diffuse light, and round threads from flat ones.
//!
//! Where the picture repeats as the model does, its *mean period* is used in place of all three: see [`crate::photograph::mean_period`].

use crate::photograph::blur;
use crate::photograph::dark::Dark;
use crate::photograph::image::Photograph;
use crate::photograph::mean_period::{self, MeanPeriod, TilePeriod};
use crate::photograph::params::PARAMS;
use crate::photograph::period::{Period, Straight, coordinates};
use crate::photograph::sight::Sight;
use biscale::direction::Pair;
use biscale::material::SmallScale;
use biscale::numerics::cast::truncate_usize;
use glam::DVec3;
use serde::Serialize;

/// Pixels darker than this share of the bright ones (the 90th percentile) are in shadow, or show gaps: their colour says little.
pub const DARK: f64 = 0.08;
/// Shares of a cluster's pixels, by brightness, at which its tones begin and end. The darkest ones lie at the
/// edges of threads and shadows, where a pixel shows something else as well; the brightest ones may be clipped.
pub const TONES: [f64; 7] = [0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 0.995];

/// What was found in a close-up.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CloseUp {
    /// Period along tile x and y, in the units of the close-up's camera.
    pub period: [Option<Period>; 2],
    /// How the camera blurs, if edges tell it.
    pub blur: Option<Blur>,
    /// Mean directions of all of the picture, tile's frame.
    #[serde(skip)]
    pub middle: Option<Directions>,
    /// The same in [`SPREAD`] x [`SPREAD`] parts of the picture, rows of tile x: perspective sees each under another angle.
    #[serde(skip)]
    pub parts: Vec<Directions>,
    /// What the picture says of light that lies over all of it.
    #[serde(skip)]
    pub dark: Dark,
    /// Mean radiance of all pixels that are used.
    #[serde(skip)]
    pub mean: [f64; 3],
    /// Relative standard deviation of its irradiance against that of the distant photographs; `None` where either is not known.
    #[serde(skip)]
    pub exposure_sigma: Option<f64>,
    /// Mean distance of the camera from the surface, along its normal.
    #[serde(skip)]
    pub distance: f64,
    /// Mean irradiance on a plane that faces the light.
    pub irradiance: [f64; 3],
    /// Whether the irradiance is known.
    pub exposure_known: bool,
    /// Clusters of pixels by colour; one if they cannot be told apart.
    #[serde(rename = "kinds")]
    pub clusters: Vec<ColourCluster>,
    /// Which surface each cluster may be: the choices that the start material does not rule out, the likeliest first.
    pub choices: Vec<Vec<usize>>,
    /// The choices that it does rule out, the likeliest first: for when no other explains the photographs.
    #[serde(skip)]
    pub other_choices: Vec<Vec<usize>>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// How the picture repeats, if it does so in another way than the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub other_periods: Option<String>,
    /// All periods registered with each other, if the picture repeats as the model does.
    pub mean_period: Option<MeanPeriod>,
    /// The cluster of each pixel of the photograph, 255 for none.
    #[serde(skip)]
    pub labels: Vec<u8>,
}

/// Mean directions to light and viewer of a part of a picture, tile's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Directions {
    /// To the light.
    pub wi: DVec3,
    /// Change of `wi` a degree of the light's azimuth and elevation.
    pub turn: [DVec3; 2],
    /// To the viewer.
    pub wo: DVec3,
}

impl Directions {
    fn mean<'a>(sights: impl Iterator<Item = &'a Sight> + Clone) -> Self {
        let n = sights.clone().count().max(1) as f64;
        let sum = |f: &dyn Fn(&Sight) -> DVec3| sights.clone().map(f).sum::<DVec3>();
        Self { wi: sum(&|s| s.wi).normalize(), turn: std::array::from_fn(|k| sum(&|s| s.turn[k]) / n), wo: sum(&|s| s.wo).normalize() }
    }

    /// The pair under a light that is turned by these degrees of azimuth and elevation.
    pub fn pair(&self, turn_deg: [f64; 2]) -> Pair {
        Pair { wi: (self.wi + turn_deg[0] * self.turn[0] + turn_deg[1] * self.turn[1]).normalize(), wo: self.wo }
    }
}

/// How a camera blurs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Blur {
    /// Standard deviation, pixels, beside the extent of the pixels themselves.
    pub pixels: f64,
    /// Standard deviation on the surface, in the units of the camera, with the extent of the pixels.
    pub length: f64,
}

/// Bounds of an exposure.
const EXPOSURES: [f64; 2] = [1e-2, 1e2];

/// Parts of the picture along either direction whose angles are told apart.
pub const SPREAD: usize = 4;

/// Standard deviation of a point within a pixel.
pub const BOX: f64 = 0.288_675_134_594_812_9;

/// Pixels of one colour.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ColourCluster {
    /// Share of the picture, without what is dark.
    pub cover: f64,
    /// Sum of the radiance of its pixels over the number of all pixels.
    pub light: [f64; 3],
    /// Mean radiance of its pixels that are not dark.
    pub colour: [f64; 3],
    /// Mean radiance of its pixels that are not dark, sorted by brightness, from each of [`TONES`] to the next; none where they are few.
    pub tones: Vec<[f64; 3]>,
}

impl CloseUp {
    /// Looks at the pixels of the close-up; `start` is the material to start from, `uniform` along which directions its tile does not change.
    pub fn new(photograph: &Photograph, sights: &[Sight], start: &SmallScale, uniform: [bool; 2], colours: &[[f64; 3]]) -> Self {
        let mut found = Self {
            exposure_known: photograph.exposure_known,
            exposure_sigma: photograph.exposure_known.then(|| photograph.irradiance_sigma()),
            ..Self::default()
        };
        let seen: Vec<(u32, DVec3)> = sights.iter().map(|s| (s.pixel, s.position)).collect();
        match Straight::new(photograph, &seen) {
            Some(straight) => {
                found.period = [0, 1].map(|axis| straight.period(axis));
                found.blur =
                    blur::of_edges(photograph, &seen).map(|blur| Blur { pixels: blur, length: blur.hypot(BOX) * straight.footprint });
            }
            None => found.notes.push("the period is found on planes and cylinders only, of at least 64 pixels".to_owned()),
        }
        let image = &photograph.image;
        let used: Vec<&Sight> = sights.iter().filter(|s| s.lit && !image.rgb[s.pixel as usize][0].is_nan()).collect();
        if used.is_empty() {
            found.notes.push("no pixel of the close-up shows the lit object: it says nothing".to_owned());
            return found;
        }
        let n = used.len() as f64;
        found.middle = Some(Directions::mean(used.iter().copied()));
        found.parts = parts(photograph, &used);
        found.dark = Dark::of(photograph, sights);
        found.distance = used.iter().map(|s| photograph.camera.origin.distance(s.position) * s.wo.z).sum::<f64>() / n;
        found.irradiance = std::array::from_fn(|c| used.iter().map(|s| s.irradiance[c]).sum::<f64>() / n);
        // As under a light that is the same everywhere: a lamp nearby is brighter on one side.
        let even = |s: &Sight, c: usize| if s.irradiance[c] > 0.0 { found.irradiance[c] / s.irradiance[c] } else { 1.0 };
        let pixel = |s: &&Sight| std::array::from_fn(|c| f64::from(image.rgb[s.pixel as usize][c]).max(0.0) * even(s, c));
        let pixels: Vec<[f64; 3]> = used.iter().map(pixel).collect();
        let tile = TilePeriod { length: start.tile.period.to_array(), uniform };
        found.mean = std::array::from_fn(|c| pixels.iter().map(|p| p[c]).sum::<f64>() / n);
        found.other_periods = mean_period::other_periods(found.period, tile);
        found.mean_period = MeanPeriod::new(photograph, &used, &pixels, found.period, tile);
        if !found.exposure_known {
            let what =
                if found.mean_period.is_some() { "it is found with the colours" } else { "only the cover of its surfaces is compared" };
            found.notes.push(format!("its irradiance is not known: {what}"));
        }
        let surfaces = start.surfaces.len();
        let mut light: Vec<f64> = pixels.iter().map(|p| p.iter().sum()).collect();
        light.sort_by(f64::total_cmp);
        let bright = light[bright_index(light.len())];
        let dark = DARK * bright;
        let (clusters, labels) =
            if (2..=PARAMS.most_clusters).contains(&surfaces) { sort(&pixels, surfaces, dark) } else { (1, vec![0; pixels.len()]) };
        if surfaces > 1 && clusters == 1 {
            let why = if surfaces > PARAMS.most_clusters { "they are too many" } else { "they have nearly the same colour" };
            found.notes.push(format!("the surfaces cannot be told apart in the close-up: {why}"));
        }
        found.clusters = (0..clusters).map(|k| cluster_of(&pixels, &labels, k, dark)).collect();
        (found.choices, found.other_choices) =
            if clusters == surfaces { choices(&found.clusters, colours) } else { (vec![vec![0; clusters]], Vec::new()) };
        if found.choices.len() > 1 {
            found.notes.push("which surface has which colour is not clear from the start material: several choices are tried".to_owned());
        }
        found.labels = vec![255; image.rgb.len()];
        for (sight, label) in used.iter().zip(&labels) {
            found.labels[sight.pixel as usize] = u8::try_from(*label).expect("few clusters");
        }
        found
    }

    /// Standard deviations of the blur along tile x and y, in periods of a tile; 0 where no period tells how large one is in the picture.
    pub fn blur_in_periods(&self, tile: [f64; 2]) -> [f64; 2] {
        let Some(blur) = self.blur else { return [0.0; 2] };
        let scale = |axis: usize| self.period[axis].map(|p| tile[axis] / p.length);
        let Some(any) = scale(0).or(scale(1)) else { return [0.0; 2] };
        [0, 1].map(|axis| blur.length * scale(axis).unwrap_or(any) / tile[axis])
    }

    /// With periods as the mean period has them, where there is one, and with standard deviations that know nothing of the heights of what
    /// repeats: these lie between `heights` of a tile whose period is `tile`, over the plane that the photograph's object names, and what lies under it is farther from the camera.
    #[must_use]
    pub fn at_any_height(&self, [low, high]: [f64; 2], tile: [f64; 2]) -> Self {
        let mut found = self.clone();
        // Nothing was seen that has a distance.
        if found.distance <= 0.0 {
            return found;
        }
        for (k, (period, tile)) in found.period.iter_mut().zip(tile).enumerate() {
            if let Some(period) = period {
                period.length = self.mean_period.as_ref().and_then(|mean| mean.length[k]).unwrap_or(period.length);
                let farthest = low.abs().max(high.abs()) * period.length / tile / self.distance;
                period.sigma = period.sigma.hypot(farthest * period.length);
            }
        }
        found
    }

    /// With periods as they are on the plane that the photograph's object names, where the mean period was registered at `height` of a tile whose period is `tile`: what lies under
    /// that plane is farther from the camera, and looks smaller.
    #[must_use]
    pub fn on_its_plane(&self, height: f64, tile: [f64; 2]) -> Self {
        let mut found = self.clone();
        let Some(mean) = &self.mean_period else { return found };
        for k in 0..2 {
            if let (Some(period), Some(length)) = (&mut found.period[k], mean.length[k]) {
                period.length = length / (1.0 + height * length / (tile[k] * self.distance));
                if let Some(mean) = &mut found.mean_period {
                    mean.length[k] = Some(period.length);
                }
            }
        }
        found
    }

    /// The pairs of all parts of the picture under its light turned by these degrees of azimuth and elevation.
    pub fn pairs(&self, turn_deg: [f64; 2]) -> Vec<Pair> {
        self.parts.iter().map(|part| part.pair(turn_deg)).collect()
    }

    /// Bounds of its exposure, the given irradiance over the true one, which is found with the colours; `None` where its radiance is not
    /// compared, but only the cover of its surfaces.
    pub fn exposures(&self) -> Option<[f64; 2]> {
        let compared = self.middle.is_some() && (self.mean_period.is_some() || self.exposure_known);
        compared.then_some(EXPOSURES)
    }

    /// Whether the clusters are surfaces.
    pub fn tells_surfaces_apart(&self, surfaces: usize) -> bool {
        !self.clusters.is_empty() && self.clusters.len() == surfaces
    }
}

/// Mean directions of the parts of the picture, each of as many pixels; of all pixels where the object has no coordinates along tile x and y.
fn parts(photograph: &Photograph, used: &[&Sight]) -> Vec<Directions> {
    let mean = |of: &[([f64; 2], &Sight)]| Directions::mean(of.iter().map(|(_, sight)| *sight));
    let points = used.iter().map(|s| Some((coordinates(photograph, s.position)?, *s))).collect::<Option<Vec<_>>>();
    let Some(mut points) = points.filter(|p| p.len() >= SPREAD * SPREAD) else {
        let all: Vec<([f64; 2], &Sight)> = used.iter().map(|s| ([0.0; 2], *s)).collect();
        return vec![mean(&all); SPREAD * SPREAD];
    };
    let mut parts = Vec::new();
    points.sort_by(|a, b| a.0[1].total_cmp(&b.0[1]));
    let cut = |of: usize, k: usize| of * k / SPREAD;
    for y in 0..SPREAD {
        let of = points.len();
        let row = &mut points[cut(of, y)..cut(of, y + 1)];
        row.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        parts.extend((0..SPREAD).map(|x| mean(&row[cut(row.len(), x)..cut(row.len(), x + 1)])));
    }
    parts
}

/// Step along the line between two colours at which pixels are counted.
const TWENTIETH: f64 = 0.05;

fn chromaticity(p: [f64; 3]) -> [f64; 3] {
    let sum: f64 = p.iter().sum();
    if sum > 0.0 { p.map(|v| v / sum) } else { [1.0 / 3.0; 3] }
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

/// Sorts pixels into clusters by chromaticity (Lloyd's iteration from the farthest points); one cluster if these are nearly the same.
fn sort(pixels: &[[f64; 3]], clusters: usize, dark: f64) -> (usize, Vec<usize>) {
    let chroma: Vec<[f64; 3]> = pixels.iter().map(|&p| chromaticity(p)).collect();
    let bright: Vec<usize> = (0..pixels.len()).filter(|&k| pixels[k].iter().sum::<f64>() > dark).collect();
    let one = (1, vec![0; pixels.len()]);
    if bright.len() < 8 * clusters {
        return one;
    }
    let mean = |members: &[usize]| -> [f64; 3] {
        std::array::from_fn(|c| members.iter().map(|&k| chroma[k][c]).sum::<f64>() / members.len() as f64)
    };
    // The first centre is the farthest from the mean of all: highlights, between the colours, are no good start.
    let mut centres: Vec<[f64; 3]> = vec![mean(&bright)];
    for _ in 0..clusters {
        let apart = |k: usize| centres.iter().map(|&c| distance(chroma[k], c)).fold(f64::INFINITY, f64::min);
        let far = bright.iter().copied().max_by(|&a, &b| apart(a).total_cmp(&apart(b)).then(b.cmp(&a)));
        centres.push(chroma[far.expect("there are bright pixels")]);
    }
    centres.remove(0);
    let Some(centres) = settle(&chroma, &bright, centres, PARAMS.cluster_rounds) else { return one };
    let apart = (0..clusters).flat_map(|a| (0..a).map(move |b| (a, b))).map(|(a, b)| distance(centres[a], centres[b]));
    let apart = apart.fold(f64::INFINITY, f64::min);
    let labels: Vec<usize> = chroma.iter().map(|&p| nearest(p, &centres)).collect();
    let own = |k: usize| bright.iter().copied().filter(|&p| labels[p] == k).map(|p| chroma[p]).collect::<Vec<_>>();
    let members: Vec<Vec<[f64; 3]>> = (0..clusters).map(own).collect();
    let few = members.iter().any(|m| (m.len() as f64) < PARAMS.least_share * bright.len() as f64);
    let run_together = |a: usize, b: usize| !has_valley(&members[a], &members[b], centres[a], centres[b]);
    if apart < PARAMS.least_distance || few || (0..clusters).any(|a| (0..a).any(|b| run_together(a, b))) {
        return one;
    }
    (clusters, labels)
}

/// Whether two clusters are two: between their colours there are fewer pixels than around either. A broad spread of colours that is cut in two has as many
/// there, one colour with more or less of a highlight on it has more than beyond.
fn has_valley(a: &[[f64; 3]], b: &[[f64; 3]], from: [f64; 3], to: [f64; 3]) -> bool {
    let length = distance(from, to).powi(2);
    let along = |p: &[f64; 3]| (0..3).map(|c| (p[c] - from[c]) * (to[c] - from[c])).sum::<f64>() / length;
    let mut along_line: Vec<f64> = a.iter().chain(b).map(along).collect();
    along_line.sort_by(f64::total_cmp);
    let within = |middle: f64| {
        let below = |t: f64| along_line.partition_point(|&p| p < t);
        below(middle + 0.5 * PARAMS.valley_window) - below(middle - 0.5 * PARAMS.valley_window)
    };
    let steps = |from: i32, to: i32| (from..=to).map(|k| within(f64::from(k) * TWENTIETH));
    // Peaks may stand inside or outside of the means, which highlights draw together.
    let ([from, to], [before, beyond]) = (PARAMS.valley_range, PARAMS.peak_range);
    let (first, second) = (steps(before, from).max().unwrap_or(0), steps(to, beyond).max().unwrap_or(0));
    let valley = steps(from, to).min().unwrap_or(0);
    (valley as f64) < PARAMS.valley_depth * first.min(second) as f64
}

fn nearest(p: [f64; 3], centres: &[[f64; 3]]) -> usize {
    (0..centres.len()).min_by(|&a, &b| distance(p, centres[a]).total_cmp(&distance(p, centres[b]))).expect("there are clusters")
}

/// Lloyd's iteration over the members of a list; `None` if a cluster has none.
fn settle(chroma: &[[f64; 3]], bright: &[usize], mut centres: Vec<[f64; 3]>, rounds: usize) -> Option<Vec<[f64; 3]>> {
    for _ in 0..rounds {
        let mut sums = vec![([0.0; 3], 0.0); centres.len()];
        for &k in bright {
            let (sum, count) = &mut sums[nearest(chroma[k], &centres)];
            (0..3).for_each(|c| sum[c] += chroma[k][c]);
            *count += 1.0;
        }
        if sums.iter().any(|s| s.1 == 0.0) {
            return None;
        }
        let new: Vec<[f64; 3]> = sums.into_iter().map(|(sum, count)| sum.map(|v| v / count)).collect();
        if new == centres {
            break;
        }
        centres = new;
    }
    Some(centres)
}

/// Sorts pixels by chromaticity from the clusters `labels` on, as the pixels of the photograph were; `None` if a cluster has no pixels.
pub fn sort_from(pixels: &[[f64; 3]], labels: &[usize], clusters: usize, dark: f64, rounds: usize) -> Option<Vec<usize>> {
    let chroma: Vec<[f64; 3]> = pixels.iter().map(|&p| chromaticity(p)).collect();
    let bright: Vec<usize> = (0..pixels.len()).filter(|&k| pixels[k].iter().sum::<f64>() > dark).collect();
    let mut sums = vec![([0.0; 3], 0.0); clusters];
    for &k in &bright {
        let (sum, count) = &mut sums[labels[k]];
        (0..3).for_each(|c| sum[c] += chroma[k][c]);
        *count += 1.0;
    }
    if sums.iter().any(|s| s.1 == 0.0) {
        return None;
    }
    let centres = settle(&chroma, &bright, sums.into_iter().map(|(sum, count)| sum.map(|v| v / count)).collect(), rounds)?;
    Some(chroma.iter().map(|&p| nearest(p, &centres)).collect())
}

/// Index of the 90th percentile in a sorted list: what is dark is so against that.
pub fn bright_index(count: usize) -> usize {
    truncate_usize((PARAMS.bright_rank * (count - 1) as f64).round())
}

fn cluster_of(pixels: &[[f64; 3]], labels: &[usize], cluster: usize, dark: f64) -> ColourCluster {
    let n = pixels.len() as f64;
    let own = || pixels.iter().zip(labels).filter(|(_, l)| **l == cluster).map(|(p, _)| *p);
    let mut lit: Vec<[f64; 3]> = own().filter(|p| p.iter().sum::<f64>() > dark).collect();
    lit.sort_by(|a, b| a.iter().sum::<f64>().total_cmp(&b.iter().sum::<f64>()));
    let tones = if lit.len() < PARAMS.least_tone_pixels { Vec::new() } else { tones(lit.iter().map(|&p| (1.0, p))) };
    ColourCluster {
        cover: lit.len() as f64 / n,
        light: std::array::from_fn(|c| own().map(|p| p[c]).sum::<f64>() / n),
        colour: std::array::from_fn(|c| lit.iter().map(|p| p[c]).sum::<f64>() / (lit.len() as f64).max(1.0)),
        tones,
    }
}

/// Means between the shares [`TONES`] of a list that is sorted by brightness, each with its area.
pub fn tones(sorted: impl Iterator<Item = (f64, [f64; 3])> + Clone) -> Vec<[f64; 3]> {
    let total: f64 = sorted.clone().map(|(area, _)| area).sum();
    let mut sums = vec![([0.0; 3], 0.0); TONES.len() - 1];
    let mut begun = 0.0;
    for (area, value) in sorted {
        let (from, to) = (begun / total, (begun + area) / total);
        for (sum, range) in sums.iter_mut().zip(TONES.windows(2)) {
            // What of this one lies in that share.
            let part = (to.min(range[1]) - from.max(range[0])).max(0.0);
            (0..3).for_each(|c| sum.0[c] += part * value[c]);
            sum.1 += part;
        }
        begun += area;
    }
    sums.into_iter().map(|(sum, part)| sum.map(|v| if part > 0.0 { v / part } else { 0.0 })).collect()
}

/// Which surface each cluster may be, by the chromaticities that the start material has: what these allow, and all others.
fn choices(clusters: &[ColourCluster], colours: &[[f64; 3]]) -> (Vec<Vec<usize>>, Vec<Vec<usize>>) {
    let n = clusters.len();
    let mut all: Vec<(f64, Vec<usize>)> = permutations(n)
        .into_iter()
        .map(|choice| {
            let cost =
                (0..n).map(|k| distance(chromaticity(clusters[k].colour), chromaticity(colours[choice[k]])).powi(2)).sum::<f64>().sqrt();
            (cost, choice)
        })
        .collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    let best = all[0].0;
    let likely = all.partition_point(|(cost, _)| *cost <= PARAMS.clear_choice * best + 1e-9);
    let mut choices: Vec<Vec<usize>> = all.into_iter().map(|(_, choice)| choice).collect();
    let rest = choices.split_off(likely);
    (choices, rest)
}

fn permutations(n: usize) -> Vec<Vec<usize>> {
    if n == 0 {
        return vec![Vec::new()];
    }
    let shorter = permutations(n - 1);
    shorter
        .iter()
        .flat_map(|p| {
            (0..n).map(move |at| {
                let mut q = p.clone();
                q.insert(at, n - 1);
                q
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_deep_has_a_longer_period_than_it_shows() {
        let mut found = CloseUp { distance: 22.0, ..CloseUp::default() };
        // Of tiles of period 1, seen at a period of 1/1.02 where edges lie .44 under the plane: 22.44 / 22.
        found.period[0] = Some(Period { length: 0.98, sigma: 0.01, agreement: 0.9 });
        assert_eq!(found.on_its_plane(-0.44, [1.0; 2]), found);
        found.mean_period = Some(MeanPeriod { length: [Some(1.0 / 1.02), None], ..MeanPeriod::default() });
        let on_plane = found.on_its_plane(-0.44, [1.0; 2]);
        let there = on_plane.period;
        assert_eq!(on_plane.mean_period.unwrap().length, there.map(|p| p.map(|p| p.length)));
        let sigma = found.at_any_height([-0.44, 0.0], [1.0; 2]).period[0].unwrap().sigma;
        assert!((sigma - 0.01_f64.hypot(0.02 / 1.02 / 1.02)).abs() < 1e-12, "{sigma}");
        assert!((there[0].unwrap().length - 1.0).abs() < 1e-3 && there[1].is_none(), "{there:?}");
    }

    #[test]
    fn pixels_of_two_colours_under_shading_and_highlights_are_sorted() {
        let mut pixels = Vec::new();
        for k in 0..400 {
            let (shade, gloss) = (0.2 + 0.8 * f64::from(k % 20) / 20.0, if k % 37 == 0 { 0.4 } else { 0.02 });
            let colour = if k < 300 { [0.6, 0.1, 0.05] } else { [0.05, 0.15, 0.5] };
            pixels.push(colour.map(|c: f64| c * shade + gloss));
        }
        pixels.extend([[0.0; 3]; 50]);
        let (clusters, labels) = sort(&pixels, 2, 0.05);
        assert_eq!(clusters, 2);
        assert!((0..300).all(|k| labels[k] == labels[0]) && (300..400).all(|k| labels[k] != labels[0]));
        let red = cluster_of(&pixels, &labels, labels[0], 0.05);
        assert!((red.cover - 300.0 / 450.0).abs() < 1e-12, "{red:?}");
    }

    #[test]
    fn one_colour_is_one_kind() {
        // Slightly different, and a colour with more or less of a highlight on it.
        let tinted = (0..100).map(|k| [0.3 + 1e-4 * f64::from(k), 0.3, 0.3]);
        let glossy = (0..100).map(|k| [0.4, 0.1, 0.1].map(|c: f64| c + 0.004 * f64::from(k)));
        for pixels in [tinted.collect::<Vec<_>>(), glossy.collect()] {
            assert_eq!(sort(&pixels, 2, 0.01).0, 1);
        }
    }

    #[test]
    fn tones_are_means_of_shares_however_the_areas_are_cut() {
        let value = |x: f64| [x, 2.0 * x, 0.0];
        let fine: Vec<(f64, [f64; 3])> = (0..1000).map(|k| (1.0, value((f64::from(k) + 0.5) / 1000.0))).collect();
        for (tone, range) in tones(fine.iter().copied()).iter().zip(TONES.windows(2)) {
            assert!(
                (tone[0] - 0.5 * (range[0] + range[1])).abs() < 1e-9 && (tone[1] - 2.0 * tone[0]).abs() < 1e-12,
                "{tone:?} in {range:?}"
            );
        }
        let coarse = [(3.0, value(0.25)), (1.0, value(0.75))];
        assert_eq!(tones(coarse.into_iter())[0], value(0.25));
        assert_eq!(tones(coarse.into_iter())[5], value(0.75));
    }

    #[test]
    fn clusters_go_to_the_surfaces_of_their_colour_and_to_any_where_these_are_alike() {
        let cluster = |colour| ColourCluster { cover: 0.5, light: [0.0; 3], colour, tones: Vec::new() };
        let clusters = [cluster([0.5, 0.1, 0.1]), cluster([0.1, 0.1, 0.5])];
        assert_eq!(choices(&clusters, &[[0.2, 0.2, 0.6], [0.6, 0.2, 0.2]]), (vec![vec![1, 0]], vec![vec![0, 1]]));
        assert_eq!(choices(&clusters, &[[0.4; 3], [0.4; 3]]).0.len(), 2);
    }
}
