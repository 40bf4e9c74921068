//! One period of the small-scale surface as the close-up shows it: pixel by pixel, blurred as the camera blurs, and clustered by colour as the
//! pixels of the photograph are. What a camera does at the edges of threads so happens on both sides of the comparison.
//!
//! The rays keep their places in the period while the surface changes, so that what is found moves smoothly with the parameters.

use crate::photograph::close_up::{self, DARK};
use crate::residuals::params::PARAMS;
use biscale::brdf::Brdf;
use biscale::direction::Pair;
use biscale::error::Result;
use biscale::filter::Control;
use biscale::filter::{Slot, basis_brdf, basis_tint};
use biscale::material::SmallScale;
use biscale::numerics::cast::{truncate_i64, truncate_usize};
use biscale::numerics::low_discrepancy::{fraction, hash};
use biscale::visibility::{Hit, Occlusion, PeriodicBvh, Traced};
use glam::{DVec2, DVec3};
use rustc_hash::FxHashMap;

/// One period.
#[derive(Clone, Debug, PartialEq)]
pub struct TileView {
    /// Pixels across and along.
    pub(crate) size: usize,
    /// By surface the share of each pixel that shows it.
    covers: Vec<Vec<f64>>,
    /// Height of what each pixel shows, below all where it shows nothing.
    heights: Vec<f64>,
    /// By slot and pixel the radiance over irradiance when that colour is 1.
    pub(crate) basis: Vec<Vec<[f64; 3]>>,
}

/// How a period is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewParams {
    /// Rays along x and along y.
    pub size: usize,
    /// Whether the surface is shaded as if it were round: from near the sides of threads, which a file may cut into few, show one by one.
    pub round: bool,
    /// Standard deviation of the blur along x and y, in periods, the extent of the photograph's pixels included.
    pub blur: [f64; 2],
    /// Height at which a place is the same in all pairs.
    pub height: f64,
    /// Seed of the places of the rays.
    pub seed: u32,
}

/// Pixels of one cluster, as [`close_up::ColourCluster`] has them; light and tones in shares of each slot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClusterView {
    /// Share of the picture, without what is dark.
    pub cover: f64,
    /// By slot the sum of the shares of its pixels over the number of all pixels.
    pub light: Vec<[f64; 3]>,
    /// By slot the tones, black if nothing is bright.
    pub tones: Vec<Vec<[f64; 3]>>,
}

impl TileView {
    /// The period seen at `pairs`, as many along x as along y: a photograph of many periods sees each of them from elsewhere.
    ///
    /// # Errors
    /// `Interrupted`; a surface that rays cannot be traced to.
    pub fn new(small: &SmallScale, slots: &[Slot], pairs: &[Pair], params: &ViewParams, control: &Control<'_>) -> Result<Self> {
        let size = params.size;
        let tracer = PixelTracer::new(small, slots, params)?;
        let mut view = Self {
            size,
            covers: vec![vec![0.0; size * size]; small.surfaces.len()],
            basis: vec![vec![[0.0; 3]; size * size]; slots.len()],
            heights: vec![f64::NEG_INFINITY; size * size],
        };
        let spread = pairs.len().isqrt();
        for row in 0..size {
            control.check()?;
            for column in 0..size {
                let at = row * size + column;
                // Neighbours take all pairs in turn, and so does each row and column.
                let pair = pairs[(row / spread + column) % spread * spread + (row + column) % spread];
                let Some(hit) = tracer.hit([column, row], pair.wo) else { continue };
                view.covers[tracer.surface(&hit)][at] = 1.0;
                view.heights[at] = hit.position.z;
                if let Some(normal) = tracer.lit_normal(&hit, pair) {
                    tracer.shade(&hit, normal, pair, |slot, share| view.basis[slot][at] = share);
                }
            }
        }
        view.smooth(params.blur);
        Ok(view)
    }

    /// Blurs as the camera does.
    fn smooth(&mut self, blur: [f64; 2]) {
        for cover in &mut self.covers {
            smooth(cover, self.size, &kernels(blur, self.size), |sum: &mut f64, weight, v| *sum += weight * v);
        }
        for shares in &mut self.basis {
            smooth_colours(shares, self.size, blur);
        }
    }

    /// The pixels in clusters as those of the photograph: by colour if `by_colour`, else by the surface that each shows most of. `choice`
    /// is the surface of each cluster, none if all pixels are of one; `radiance` what each slot's share is multiplied by.
    pub fn clustered(&self, radiance: &[[f64; 3]], choice: Option<&[usize]>, by_colour: bool) -> Vec<ClusterView> {
        let count = self.size * self.size;
        let pixels = self.picture(radiance);
        let brightness: Vec<f64> = pixels.iter().map(|p| p.iter().sum()).collect();
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| brightness[a].total_cmp(&brightness[b]).then(a.cmp(&b)));
        let dark = DARK * brightness[order[close_up::bright_index(count)]];
        let clusters = choice.map_or(1, <[usize]>::len);
        let mut labels = vec![0; count];
        if let Some(choice) = choice {
            for (at, label) in labels.iter_mut().enumerate() {
                let most = |&a: &usize, &b: &usize| self.covers[choice[a]][at].total_cmp(&self.covers[choice[b]][at]).then(b.cmp(&a));
                *label = (0..clusters).max_by(most).unwrap_or(0);
            }
            if by_colour && let Some(better) = close_up::sort_from(&pixels, &labels, clusters, dark, PARAMS.view_cluster_rounds) {
                labels = better;
            }
        }
        (0..clusters).map(|k| self.part(&order, &|at| labels[at] == k, &|at| brightness[at] > dark)).collect()
    }

    /// The period where `radiance` is what each slot's share is multiplied by.
    pub fn picture(&self, radiance: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut pixels = vec![[0.0; 3]; self.size * self.size];
        for (shares, colour) in self.basis.iter().zip(radiance) {
            for (pixel, share) in pixels.iter_mut().zip(shares) {
                (0..3).for_each(|c| pixel[c] += colour[c] * share[c]);
            }
        }
        pixels
    }

    /// The mean height of the edges between what is bright and what is not, by how much these differ, where `radiance` is what each slot's share is multiplied by.
    /// An edge is where its upper side is. For views that are not blurred.
    pub fn height_of_edges(&self, radiance: &[[f64; 3]]) -> f64 {
        let picture = self.picture(radiance);
        let n = self.size;
        let (mut sum, mut total) = (0.0, 0.0);
        for at in 0..n * n {
            for next in [at / n * n + (at + 1) % n, (at + n) % (n * n)] {
                let height = self.heights[at].max(self.heights[next]);
                let differ: f64 = (0..3).map(|c| (picture[at][c] - picture[next][c]).powi(2)).sum();
                if height.is_finite() {
                    sum += differ * height;
                    total += differ;
                }
            }
        }
        if total > 0.0 { sum / total } else { 0.0 }
    }

    /// The lowest and the highest that is seen; `None` if nothing is.
    pub fn heights(&self) -> Option<[f64; 2]> {
        let seen = self.heights.iter().copied().filter(|h| h.is_finite());
        let (low, high) = seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        (low <= high).then_some([low, high])
    }

    /// The mean share of a slot where its surface is seen.
    pub fn mean_basis(&self, slot: usize, surface: usize) -> f64 {
        let light: f64 = self.basis[slot].iter().flatten().sum::<f64>() / 3.0;
        light / self.covers[surface].iter().sum::<f64>().max(1e-9)
    }

    /// By slot the sum of the shares of all pixels over their number.
    pub fn whole_light(&self) -> Vec<[f64; 3]> {
        let count = (self.size * self.size) as f64;
        let light = |shares: &Vec<[f64; 3]>| std::array::from_fn(|c| shares.iter().map(|s| s[c]).sum::<f64>() / count);
        self.basis.iter().map(light).collect()
    }

    fn part(&self, order: &[usize], is_own: &dyn Fn(usize) -> bool, is_bright: &dyn Fn(usize) -> bool) -> ClusterView {
        let count = order.len() as f64;
        let own: Vec<usize> = order.iter().copied().filter(|&at| is_own(at)).collect();
        let bright: Vec<usize> = own.iter().copied().filter(|&at| is_bright(at)).collect();
        let light = |shares: &Vec<[f64; 3]>| std::array::from_fn(|c| own.iter().map(|&at| shares[at][c]).sum::<f64>() / count);
        let tones = |shares: &Vec<[f64; 3]>| close_up::tones(bright.iter().map(|&at| (1.0, shares[at])));
        ClusterView {
            cover: bright.len() as f64 / count,
            light: self.basis.iter().map(light).collect(),
            tones: self.basis.iter().map(tones).collect(),
        }
    }
}

/// Steps of Roberts' sequence in two dimensions (Roberts 2018, "The Unreasonable Effectiveness of Quasirandom Sequences"): `1/g` and `1/g²`,
/// where `g³ = g + 1`.
const ROBERTS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
/// How far above the highest point rays start, over the period: more than rounding moves it.
const START_ABOVE: f64 = 1e-6;

/// One ray for each pixel, and what it sees.
struct PixelTracer<'a> {
    small: &'a SmallScale,
    slots: &'a [Slot],
    bvh: PeriodicBvh,
    /// Normals of a surface that is shaded as if it were round.
    normals: Option<Normals>,
    /// By slot the BRDF when that colour is 1, and the tint.
    brdfs: Vec<(Brdf, [f64; 3])>,
    params: &'a ViewParams,
    /// Moves all rays within their pixels.
    offset: [f64; 2],
}

impl<'a> PixelTracer<'a> {
    fn new(small: &'a SmallScale, slots: &'a [Slot], params: &'a ViewParams) -> Result<Self> {
        let brdf = |slot: &Slot| {
            let surface = &small.surfaces[slot.surface];
            (basis_brdf(&surface.brdf, slot.colour), basis_tint(surface, slot.colour))
        };
        Ok(Self {
            small,
            slots,
            bvh: PeriodicBvh::new(&small.tile)?,
            normals: params.round.then(|| Normals::new(small)),
            brdfs: slots.iter().map(brdf).collect(),
            params,
            offset: [fraction(hash(params.seed)), fraction(hash(!params.seed))],
        })
    }

    /// What a pixel, whose column and row are given, sees along `wo`.
    fn hit(&self, [column, row]: [usize; 2], wo: DVec3) -> Option<Hit> {
        let ViewParams { size, height, .. } = *self.params;
        let period = self.small.tile.period;
        let above = self.bvh.highest() + START_ABOVE * period.max_element();
        // Neighbours along a row or column take all places within their pixels in turn.
        let [u, v] = ROBERTS.map(|step| step * (row * size + column) as f64);
        let x = (column as f64 + (u + self.offset[0]).fract()) / size as f64;
        let y = (row as f64 + (v + self.offset[1]).fract()) / size as f64;
        let start = DVec3::new(x * period.x, y * period.y, height) + wo * ((above - height) / wo.z);
        match self.bvh.trace(start, -wo, None) {
            Traced::Hit(hit) => Some(hit),
            Traced::Left | Traced::GaveUp => None,
        }
    }

    fn surface(&self, hit: &Hit) -> usize {
        usize::from(self.small.surface_of_triangle[hit.triangle as usize])
    }

    /// The normal that a point is shaded with; `None` where it sends no direct light to the viewer.
    fn lit_normal(&self, hit: &Hit, pair: Pair) -> Option<DVec3> {
        let triangle = hit.triangle as usize;
        let [a, b, c] = self.small.tile.corners(triangle);
        let flat = (b - a).cross(c - a).normalize_or_zero();
        let normal = self.normals.as_ref().map_or(flat, |n| n.at(triangle, hit.barycentric));
        let faces = [flat, normal].iter().all(|n| n.dot(pair.wo) > 0.0 && n.dot(pair.wi) > 0.0);
        (faces && self.bvh.occluded(triangle, hit.position, pair.wi) != Occlusion::Blocked).then_some(normal)
    }

    /// Tells `add` each slot of the surface there, and its radiance over irradiance.
    fn shade(&self, hit: &Hit, normal: DVec3, pair: Pair, mut add: impl FnMut(usize, [f64; 3])) {
        let surface = self.surface(hit);
        for (k, (brdf, tint)) in self.brdfs.iter().enumerate().filter(|(k, _)| self.slots[*k].surface == surface) {
            let fr = brdf.eval(normal, pair.wi, pair.wo);
            add(k, std::array::from_fn(|c| fr[c] * tint[c] * normal.dot(pair.wi)));
        }
    }
}

/// Normals at the corners of all triangles: the mean of those of the faces around, of the same surface, weighted by area.
struct Normals(Vec<[DVec3; 3]>);

impl Normals {
    fn new(small: &SmallScale) -> Self {
        let tile = &small.tile;
        // A thread that leaves the tile on one side comes back on the other.
        let wrapped = |v: f64, period: f64| ((v / period).rem_euclid(1.0) * PARAMS.corner_grid).round() % PARAMS.corner_grid;
        let key = |p: DVec3, surface: u16| {
            let high = p.z / tile.period.max_element() * PARAMS.corner_grid;
            let [x, y, z] = [wrapped(p.x, tile.period.x), wrapped(p.y, tile.period.y), high.round()].map(truncate_i64);
            [x, y, z, i64::from(surface)]
        };
        let corners = || small.surface_of_triangle.iter().enumerate().map(|(t, &surface)| (tile.corners(t), surface));
        let mut sums: FxHashMap<[i64; 4], DVec3> = FxHashMap::default();
        for ([a, b, c], surface) in corners() {
            let area = (b - a).cross(c - a);
            for p in [a, b, c] {
                *sums.entry(key(p, surface)).or_default() += area;
            }
        }
        Self(corners().map(|(corners, surface)| corners.map(|p| sums[&key(p, surface)].normalize_or_zero())).collect())
    }

    fn at(&self, triangle: usize, barycentric: DVec2) -> DVec3 {
        let [a, b, c] = self.0[triangle];
        ((1.0 - barycentric.x - barycentric.y) * a + barycentric.x * b + barycentric.y * c).normalize_or_zero()
    }
}

/// Weights of a Gaussian from its middle outward.
fn kernel(sigma: f64) -> Vec<f64> {
    if sigma < PARAMS.sharp {
        return vec![1.0];
    }
    let reach = truncate_usize((3.0 * sigma).ceil());
    let weights: Vec<f64> = (0..=reach).map(|k| (-0.5 * (k as f64 / sigma).powi(2)).exp()).collect();
    let total = 2.0 * weights.iter().sum::<f64>() - weights[0];
    weights.into_iter().map(|w| w / total).collect()
}

/// Weights along x and y of a blur in periods, for a picture of `size` x `size` pixels of a period.
fn kernels(blur: [f64; 2], size: usize) -> [Vec<f64>; 2] {
    // Rays anywhere within a pixel are a blur already.
    blur.map(|b| kernel(((b * size as f64).powi(2) - 1.0 / 12.0).max(0.0).sqrt()))
}

/// Blurs a picture of `size` x `size` pixels of a period, whose values are means over their pixels, by these standard deviations along x and y, in periods.
pub(crate) fn smooth_colours(picture: &mut [[f64; 3]], size: usize, blur: [f64; 2]) {
    smooth(picture, size, &kernels(blur, size), |sum: &mut [f64; 3], weight, v| (0..3).for_each(|c| sum[c] += weight * v[c]));
}

/// Blurs a periodic picture along x, then along y.
fn smooth<T: Copy + Default>(picture: &mut [T], size: usize, kernels: &[Vec<f64>; 2], add: impl Fn(&mut T, f64, T)) {
    for (kernel, stride, line) in [(&kernels[0], 1, size), (&kernels[1], size, 1)] {
        if kernel.len() == 1 {
            continue;
        }
        let mut old = vec![T::default(); size];
        for l in 0..size {
            (0..size).for_each(|k| old[k] = picture[l * line + k * stride]);
            for k in 0..size {
                let mut sum = T::default();
                add(&mut sum, kernel[0], old[k]);
                for (j, &w) in kernel.iter().enumerate().skip(1) {
                    let j = j % size;
                    add(&mut sum, w, old[(k + j) % size]);
                    add(&mut sum, w, old[(k + size - j) % size]);
                }
                picture[l * line + k * stride] = sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::residuals::unknowns::slots;
    use biscale::material::Material;
    use biscale::toml_reader::Source;

    fn grooves() -> SmallScale {
        let text = "format = 1\n[geometry]\nkind = \"grooves\"\nfloor_width = 0.3\ntop_width = 0.3\ndepth = 1e-6\n[[surface]]\npart = \"floor\"\n\
                    brdf = { model = \"lambert\", albedo = [0.6, 0.1, 0.1] }\n[[surface]]\npart = \"sides\"\n\
                    brdf = { model = \"lambert\", albedo = [0.1, 0.6, 0.1] }\n[[surface]]\npart = \"tops\"\n\
                    brdf = { model = \"lambert\", albedo = [0.1, 0.1, 0.6] }\n";
        Material::parse(&Source { path: "t.toml".into(), text: text.to_owned() }).unwrap().build().unwrap()
    }

    fn view(blur: f64) -> Vec<ClusterView> {
        let cancel = std::sync::atomic::AtomicBool::new(false);
        let control = Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| 0.0 };
        let small = grooves();
        let slots = slots(&small.surfaces);
        let pair = Pair { wi: DVec3::new(0.3, 0.0, 0.7).normalize(), wo: DVec3::Z };
        let view =
            TileView::new(&small, &slots, &[pair], &ViewParams { size: 60, round: false, blur: [blur; 2], height: 0.0, seed: 1 }, &control)
                .unwrap();
        let colours: Vec<[f64; 3]> = vec![[0.6, 0.1, 0.1], [0.1, 0.6, 0.1], [0.1, 0.1, 0.6]];
        view.clustered(&colours, Some(&[0, 1, 2]), true)
    }

    #[test]
    fn flat_stripes_cover_their_widths_and_send_their_light() {
        let light = DVec3::new(0.3, 0.0, 0.7).normalize().z / std::f64::consts::PI;
        for (k, (part, width)) in view(0.0).iter().zip([0.3, 0.4, 0.3]).enumerate() {
            assert!((part.cover - width).abs() < 2e-3 && (part.light[k][0] - width * light).abs() < 2e-3, "{part:?}");
            assert!((part.tones[k][2][1] - light).abs() < 1e-4, "{part:?}");
        }
    }

    #[test]
    fn blur_moves_light_between_clusters_and_loses_none() {
        let (sharp, soft) = (view(0.0), view(0.04));
        for slot in 0..3 {
            let all = |parts: &[ClusterView]| parts.iter().map(|p| p.light[slot][0]).sum::<f64>();
            assert!((all(&sharp) / all(&soft) - 1.0).abs() < 1e-9);
            assert!(soft[slot].light[slot][0] < 0.97 * sharp[slot].light[slot][0]);
        }
    }
}
