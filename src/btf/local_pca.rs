//! Local principal component analysis of a BTF (Müller, Meseth and Klein (002), section 3; Kambhatla and Leen 1997).
//!
//! Vectors are divided into clusters, each with a mean and a few principal components; a vector belongs to the cluster that reconstructs it best. A vector is a texel's
//! BRDF or a pair's texture ([`Arrangement`]). Clusters and components are found in turns until the error stands still; what is found depends on the start, so
//! several are tried.
//!
//! The error is `|X - X~| / |X|` over all numbers: the formula that the paper prints sums lengths of vectors, so that it is not comparable between the arrangements.

use crate::error::{BadInput, Error, Result};
use crate::filter::Control;
use crate::numerics::cast::narrow;
use crate::numerics::linear_algebra::largest_eigenvectors;
use crate::numerics::low_discrepancy::gaussian;
use crate::numerics::random::Random;
use half::f16;
use rayon::prelude::*;

/// Clusters at most: labels are bytes.
pub const MOST_CLUSTERS: usize = 256;
/// Components of a cluster at most.
pub const MOST_COMPONENTS: usize = 256;
/// The search ends where the squared error falls by less than this share: that of the reference fits (`docs/btf.md`).
const STANDS_STILL: f64 = 1e-4;
/// Most turns of a search.
const MOST_TURNS: usize = 100;
/// Clusters of at most so many vectors are decomposed exactly, by the matrix of their products. Chosen: 128³ is little beside the products.
const EXACT: usize = 128;
/// Vectors beside the wanted ones in subspace iteration, so that the last of these converges.
const SPARE: usize = 6;
/// Steps of subspace iteration in each turn, which begin at the components before.
const STEPS_A_TURN: usize = 3;
/// Most steps at the end, and the share of the squares whose change ends them.
const MOST_STEPS: usize = 100;
const CONVERGED: f64 = 1e-6;
/// Columns that one thread sums at a time.
const COLUMNS: usize = 512;
/// The largest 16-bit float.
const LARGEST_HALF: f32 = 65504.0;
/// Lanes of a dot product.
const LANES: usize = 16;

/// What a vector is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arrangement {
    /// A vector for each texel: its values in all pairs of view and light.
    Brdf,
    /// A vector for each pair of view and light: the values of all texels.
    Texture,
}

impl Arrangement {
    /// As users name it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Brdf => "brdf",
            Self::Texture => "texture",
        }
    }
}

/// Vectors of equal length, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectors {
    /// How many numbers each has.
    pub length: usize,
    /// All numbers.
    pub values: Vec<f32>,
}

impl Vectors {
    /// The values of a BTF, image after image and each texel after texel, as vectors.
    ///
    /// # Errors
    /// Bad input without values, with one that is not finite, or all of which are 0: nothing can be said relative to them.
    ///
    /// # Panics
    /// If `values` are not whole images.
    pub fn arrange(values: &[[f32; 3]], texels: usize, arrangement: Arrangement) -> Result<Self, BadInput> {
        if values.is_empty() || texels == 0 {
            return Err(BadInput::new("there are no values to compress", "use a BTF with images"));
        }
        assert_eq!(values.len() % texels, 0, "whole images");
        if let Some(at) = values.iter().position(|v| v.iter().any(|v| !v.is_finite())) {
            let what = format!("texel {} of image {} is no finite number", at % texels, at / texels);
            return Err(BadInput::new(what, "write the BTF anew"));
        }
        if values.iter().flatten().all(|v| *v == 0.0) {
            return Err(BadInput::new("all values are 0: there is nothing to compress", "light the material"));
        }
        let pairs = values.len() / texels;
        Ok(match arrangement {
            Arrangement::Texture => Self { length: 3 * texels, values: values.as_flattened().to_vec() },
            Arrangement::Brdf => {
                let of_texel = |texel: usize| values.iter().skip(texel).step_by(texels).flatten().copied();
                Self { length: 3 * pairs, values: (0..texels).flat_map(of_texel).collect() }
            }
        })
    }

    /// The values of a BTF again: what [`Self::arrange`] was given.
    pub fn images(&self, arrangement: Arrangement) -> Vec<[f32; 3]> {
        let rgb = |at: &[f32]| [at[0], at[1], at[2]];
        match arrangement {
            Arrangement::Texture => self.values.chunks_exact(3).map(rgb).collect(),
            Arrangement::Brdf => {
                let (texels, pairs) = (self.count(), self.length / 3);
                (0..pairs).flat_map(|pair| (0..texels).map(move |t| rgb(&self.row(t)[3 * pair..]))).collect()
            }
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.values.len() / self.length
    }

    fn row(&self, at: usize) -> &[f32] {
        &self.values[at * self.length..(at + 1) * self.length]
    }

    fn squares(&self) -> f64 {
        self.values.iter().map(|v| f64::from(*v) * f64::from(*v)).sum()
    }
}

/// Vectors of a cluster: mean plus weighted components.
#[derive(Clone, Debug, PartialEq)]
struct Cluster {
    mean: Vec<f32>,
    /// Orthonormal, that of the largest variance first; fewer than asked for where the cluster has no more dimensions.
    components: Vec<Vec<f32>>,
}

/// How numbers are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit floats.
    Float,
    /// 16-bit floats.
    Half,
    /// Bytes between the least and the largest value of each mean, each component, and the weights of each component.
    Byte,
}

impl Precision {
    fn bytes(self) -> usize {
        match self {
            Self::Float => 4,
            Self::Half => 2,
            Self::Byte => 1,
        }
    }

    /// What is read of numbers that were stored; what is over the largest number of 16 bits is that.
    fn stored(self, values: &mut [f32]) {
        match self {
            Self::Float => {}
            Self::Half => values.iter_mut().for_each(|v| *v = f16::from_f32(v.clamp(-LARGEST_HALF, LARGEST_HALF)).to_f32()),
            Self::Byte => {
                let (least, most) = values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(l, m), v| (l.min(*v), m.max(*v)));
                let step = (most - least) / 255.0;
                if step > 0.0 {
                    values.iter_mut().for_each(|v| *v = least + step * ((*v - least) / step).round());
                }
            }
        }
    }
}

/// A local principal component analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalPca {
    clusters: Vec<Cluster>,
    /// The cluster of each vector.
    labels: Vec<u8>,
    /// The vectors' coordinates along the components of their cluster, `components` each.
    weights: Vec<f32>,
    components: usize,
    /// Turns of the search.
    pub turns: usize,
    /// Relative RMS error, `|X - X~| / |X|`.
    pub relative_rms: f64,
}

/// How a search is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalPcaSettings {
    /// Clusters, 1 to [`MOST_CLUSTERS`], and no more than there are vectors.
    pub clusters: usize,
    /// Components of each, 0 to [`MOST_COMPONENTS`].
    pub components: usize,
    /// Starts, of which the best result is kept; with one cluster they are all alike, and one is made. Every other one begins at vectors drawn evenly, as in the paper, the
    /// rest at vectors far from each other (k-means++, Arthur and Vassilvitskii 2007).
    pub starts: usize,
    /// Seed of them.
    pub seed: u64,
}

impl LocalPca {
    /// Finds clusters and components.
    ///
    /// # Errors
    /// Bad input for numbers of clusters, components or starts out of range; `Interrupted`.
    pub fn fit(vectors: &Vectors, settings: &LocalPcaSettings, control: &Control<'_>) -> Result<Self> {
        let within = |field: &str, value: usize, least: usize, most: usize| {
            if (least..=most).contains(&value) {
                return Ok(());
            }
            Err(Error::from(BadInput::new(format!("{value}"), format!("use {least} to {most}")).at_field(field)))
        };
        within("clusters", settings.clusters, 1, MOST_CLUSTERS.min(vectors.count()))?;
        within("components", settings.components, 0, MOST_COMPONENTS)?;
        within("starts", settings.starts, 1, usize::MAX)?;
        let starts = if settings.clusters == 1 { 1 } else { settings.starts };
        let mut best: Option<Self> = None;
        for start in 0..starts {
            let share = [start, start + 1].map(|s| s as f64 / starts as f64);
            let found = control.part(share[0]..share[1], |control| Search::new(vectors, settings, start as u64).run(control))?;
            if best.as_ref().is_none_or(|best| found.relative_rms < best.relative_rms) {
                best = Some(found);
            }
        }
        Ok(best.expect("at least one start"))
    }

    /// As it is read again after numbers were stored so; the error is measured anew, against the vectors that it was fitted to.
    #[must_use]
    pub fn stored(&self, vectors: &Vectors, precision: Precision) -> Self {
        let mut stored = self.clone();
        for cluster in &mut stored.clusters {
            precision.stored(&mut cluster.mean);
            cluster.components.iter_mut().for_each(|c| precision.stored(c));
        }
        for label in 0..stored.clusters.len() {
            let members = members(&stored.labels, label);
            for k in 0..stored.components {
                let mut column: Vec<f32> = members.iter().map(|&v| stored.weights[v * stored.components + k]).collect();
                precision.stored(&mut column);
                members.iter().zip(column).for_each(|(&v, weight)| stored.weights[v * stored.components + k] = weight);
            }
        }
        stored.relative_rms = relative_rms(vectors, &stored.reconstruct());
        stored
    }

    /// The vectors that it stands for.
    pub fn reconstruct(&self) -> Vectors {
        let length = self.clusters[0].mean.len();
        let mut values = vec![0.0; self.labels.len() * length];
        values.par_chunks_exact_mut(length).enumerate().for_each(|(v, row)| {
            let cluster = &self.clusters[usize::from(self.labels[v])];
            row.copy_from_slice(&cluster.mean);
            for (component, weight) in cluster.components.iter().zip(&self.weights[v * self.components..]) {
                row.iter_mut().zip(component).for_each(|(r, c)| *r += weight * c);
            }
        });
        Vectors { length, values }
    }
}

/// Bytes of a local principal component analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LocalPcaSize {
    /// Of components and weights: what Table 1 of the paper counts.
    pub components: usize,
    /// Of everything: with the means and labels that the table leaves out, and the ranges of bytes (two 32-bit floats each).
    pub all: usize,
}

impl LocalPcaSize {
    /// Of `vectors` vectors of `length` numbers.
    pub fn of(vectors: usize, length: usize, clusters: usize, components: usize, precision: Precision) -> Self {
        let of_components = precision.bytes() * components * (clusters * length + vectors);
        let ranges = if precision == Precision::Byte { 8 * clusters * (1 + 2 * components) } else { 0 };
        Self { components: of_components, all: of_components + precision.bytes() * clusters * length + vectors + ranges }
    }
}

/// The vectors of a cluster.
fn members(labels: &[u8], cluster: usize) -> Vec<usize> {
    (0..labels.len()).filter(|v| usize::from(labels[*v]) == cluster).collect()
}

/// `|X - X~| / |X|` over all numbers.
fn relative_rms(vectors: &Vectors, reconstructed: &Vectors) -> f64 {
    let differ = |(a, b): (&f32, &f32)| (f64::from(*a) - f64::from(*b)).powi(2);
    (vectors.values.iter().zip(&reconstructed.values).map(differ).sum::<f64>() / vectors.squares()).sqrt()
}

/// In lanes, each a sum of few enough numbers that 32 bits keep them.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.chunks(COLUMNS).zip(b.chunks(COLUMNS)) {
        let mut lanes = [0.0_f32; LANES];
        let (whole, rest) = a.as_chunks::<LANES>();
        let (others, rest_of_others) = b.as_chunks::<LANES>();
        for (a, b) in whole.iter().zip(others) {
            (0..LANES).for_each(|l| lanes[l] += a[l] * b[l]);
        }
        sum += f64::from(lanes.iter().sum::<f32>()) + rest.iter().zip(rest_of_others).map(|(a, b)| f64::from(a * b)).sum::<f64>();
    }
    sum
}

/// One start.
struct Search<'a> {
    vectors: &'a Vectors,
    components: usize,
    clusters: Vec<Cluster>,
    labels: Vec<u8>,
    /// Squared distance of each vector from what its cluster makes of it.
    errors: Vec<f64>,
}

impl<'a> Search<'a> {
    fn new(vectors: &'a Vectors, settings: &LocalPcaSettings, start: u64) -> Self {
        let mut random = Random::new(settings.seed.wrapping_add(start));
        let count = vectors.count();
        let mut first = vec![random.below(count)];
        let mut nearest = vec![f64::INFINITY; count];
        while first.len() < settings.clusters {
            let last = vectors.row(first[first.len() - 1]);
            nearest.par_iter_mut().enumerate().for_each(|(v, nearest)| *nearest = nearest.min(distance(vectors.row(v), last)));
            let all: f64 = nearest.iter().sum();
            let next = if start % 2 == 1 && all > 0.0 {
                let mut left = random.unit() * all;
                nearest
                    .iter()
                    .position(|d| {
                        left -= d;
                        left < 0.0
                    })
                    .unwrap_or(count - 1)
            } else {
                random.below(count)
            };
            // A vector that was drawn already begins no cluster of its own.
            let next = (0..count).map(|k| (next + k) % count).find(|v| !first.contains(v)).unwrap_or(next);
            first.push(next);
        }
        let clusters = first.iter().map(|&v| Cluster { mean: vectors.row(v).to_vec(), components: Vec::new() }).collect();
        Self { vectors, components: settings.components, clusters, labels: vec![0; count], errors: vec![0.0; count] }
    }

    fn run(mut self, control: &Control<'_>) -> Result<LocalPca> {
        let squares = self.vectors.squares();
        let mut before: Option<f64> = None;
        let mut turns = 0;
        loop {
            control.check()?;
            self.assign();
            self.fill_empty();
            let error: f64 = self.errors.iter().sum();
            (control.progress)("local principal components", turns as f64 / (turns + 10) as f64);
            let stands_still = before.is_some_and(|before| before - error <= STANDS_STILL * before);
            if turns == MOST_TURNS || stands_still || error <= f64::from(f32::EPSILON) * squares {
                break;
            }
            // The first assignment is by distance alone, and says nothing of what components do.
            before = (turns > 0).then_some(error);
            self.decompose(STEPS_A_TURN, control)?;
            turns += 1;
        }
        self.decompose(MOST_STEPS, control)?;
        let mut weights = vec![0.0; self.labels.len() * self.components];
        if self.components > 0 {
            weights.par_chunks_exact_mut(self.components).enumerate().for_each(|(v, weights)| {
                let Cluster { mean, components } = &self.clusters[usize::from(self.labels[v])];
                let centred: Vec<f32> = self.vectors.row(v).iter().zip(mean).map(|(a, b)| a - b).collect();
                weights.iter_mut().zip(components).for_each(|(w, c)| *w = narrow(dot(&centred, c)));
            });
        }
        let Self { vectors, components, clusters, labels, .. } = self;
        let mut found = LocalPca { clusters, labels, weights, components, turns, relative_rms: 0.0 };
        found.relative_rms = relative_rms(vectors, &found.reconstruct());
        Ok(found)
    }

    /// Gives each vector to the cluster that reconstructs it best, the first of equal ones.
    fn assign(&mut self) {
        let (vectors, clusters) = (self.vectors, &self.clusters);
        self.labels.par_iter_mut().zip(&mut self.errors).enumerate().for_each_init(
            || vec![0.0; vectors.length],
            |centred, (v, (label, error))| {
                *error = f64::INFINITY;
                for (k, cluster) in clusters.iter().enumerate() {
                    centred.iter_mut().zip(vectors.row(v)).zip(&cluster.mean).for_each(|((c, a), b)| *c = a - b);
                    let explained: f64 = cluster.components.iter().map(|c| dot(centred, c).powi(2)).sum();
                    let left = (dot(centred, centred) - explained).max(0.0);
                    if left < *error {
                        (*label, *error) = (u8::try_from(k).expect("at most 256 clusters"), left);
                    }
                }
            },
        );
    }

    /// Gives a cluster without vectors the one that is reconstructed worst.
    fn fill_empty(&mut self) {
        let mut counts = vec![0_usize; self.clusters.len()];
        self.labels.iter().for_each(|l| counts[usize::from(*l)] += 1);
        for empty in 0..counts.len() {
            if counts[empty] > 0 {
                continue;
            }
            let may_leave = |v: &usize| counts[usize::from(self.labels[*v])] > 1;
            let Some(worst) = (0..self.labels.len()).filter(may_leave).max_by(|a, b| self.errors[*a].total_cmp(&self.errors[*b])) else {
                return;
            };
            counts[usize::from(self.labels[worst])] -= 1;
            counts[empty] = 1;
            self.labels[worst] = u8::try_from(empty).expect("at most 256 clusters");
            self.errors[worst] = 0.0;
            self.clusters[empty].components.clear();
        }
    }

    /// Means and components of the clusters as they are.
    fn decompose(&mut self, steps: usize, control: &Control<'_>) -> Result<()> {
        for k in 0..self.clusters.len() {
            let members = members(&self.labels, k);
            if !members.is_empty() {
                let before = std::mem::take(&mut self.clusters[k].components);
                self.clusters[k] = decomposed(self.vectors, &members, self.components, before, (steps, control))?;
            }
        }
        Ok(())
    }
}

fn distance(a: &[f32], b: &[f32]) -> f64 {
    a.iter().zip(b).map(|(a, b)| f64::from((a - b) * (a - b))).sum()
}

/// Mean and principal components of some vectors; subspace iteration begins at `before`.
fn decomposed(
    vectors: &Vectors,
    members: &[usize],
    components: usize,
    before: Vec<Vec<f32>>,
    steps: (usize, &Control<'_>),
) -> Result<Cluster> {
    let length = vectors.length;
    let mut sum = vec![0.0_f64; length];
    members.iter().for_each(|&v| sum.iter_mut().zip(vectors.row(v)).for_each(|(s, a)| *s += f64::from(*a)));
    let mean: Vec<f32> = sum.iter().map(|s| narrow(s / members.len() as f64)).collect();
    let mut centred = Vectors { length, values: Vec::with_capacity(members.len() * length) };
    members.iter().for_each(|&v| centred.values.extend(vectors.row(v).iter().zip(&mean).map(|(a, b)| a - b)));
    let wanted = components.min(members.len() - 1).min(length);
    let components = match wanted {
        0 => Vec::new(),
        _ if members.len() <= EXACT => by_products(&centred, wanted)?,
        _ => by_subspace(&centred, wanted, before, steps)?,
    };
    Ok(Cluster { mean, components })
}

/// The eigenvectors of a matrix of products.
fn eigenvectors(products: &[f64], n: usize, wanted: usize) -> Result<Vec<Vec<f64>>> {
    let too_large = || Error::Numeric("principal components: products of the values are over the largest 32-bit number".to_owned());
    if n == 0 { Err(too_large()) } else { largest_eigenvectors(products, n, wanted).ok_or_else(too_large) }
}

/// Components of few vectors: eigenvectors of the matrix of their products.
fn by_products(centred: &Vectors, wanted: usize) -> Result<Vec<Vec<f32>>> {
    let n = centred.count();
    let products: Vec<f64> =
        (0..n * n).into_par_iter().map(|at| if at % n <= at / n { dot(centred.row(at / n), centred.row(at % n)) } else { 0.0 }).collect();
    let found = eigenvectors(&products, n, wanted)?;
    let combined = |u: &Vec<f64>| {
        let mut component = vec![0.0_f32; centred.length];
        for (v, weight) in u.iter().enumerate() {
            component.iter_mut().zip(centred.row(v)).for_each(|(c, a)| *c += narrow(*weight) * a);
        }
        component
    };
    Ok(orthonormal(found.par_iter().map(combined).collect()))
}

/// Components of many vectors: subspace iteration (Halko, Martinsson and Tropp 2011, algorithm 4.4), and the best basis of the subspace that it ends in.
/// Not [`randomized_svd`](crate::numerics::randomized_svd), which begins at random each time and keeps `f64`: clusters change little from turn to turn.
fn by_subspace(centred: &Vectors, wanted: usize, before: Vec<Vec<f32>>, (steps, control): (usize, &Control<'_>)) -> Result<Vec<Vec<f32>>> {
    let length = centred.length;
    let mut basis = before;
    let all = (wanted + SPARE).min(length).min(centred.count());
    let noise = |k: usize| (0..length).map(|at| narrow(gaussian(k as u64, at as u64))).collect();
    basis.extend((basis.len()..all).map(noise));
    let mut basis = orthonormal(basis);
    let squares = centred.squares();
    let mut held = 0.0;
    let along = |basis: &[Vec<f32>]| -> Vec<f64> {
        (0..centred.count()).into_par_iter().flat_map_iter(|v| basis.iter().map(move |b| dot(centred.row(v), b))).collect()
    };
    for _ in 0..steps {
        let weights = along(&basis);
        let now: f64 = weights.iter().map(|w| w * w).sum();
        control.check()?;
        if now - held <= CONVERGED * squares {
            break;
        }
        held = now;
        basis = orthonormal(multiplied(centred, &weights, basis.len()));
    }
    let n = basis.len();
    let weights = along(&basis);
    let mut products = vec![0.0; n * n];
    weights.chunks_exact(n.max(1)).for_each(|w| (0..n * n).for_each(|at| products[at] += w[at / n] * w[at % n]));
    let turned = |u: &Vec<f64>| {
        let mut component = vec![0.0_f32; length];
        u.iter().zip(&basis).for_each(|(w, b)| component.iter_mut().zip(b).for_each(|(c, b)| *c += narrow(*w) * b));
        component
    };
    Ok(orthonormal(eigenvectors(&products, n, wanted)?.iter().map(turned).collect()))
}

/// The sums of the vectors, each times its weight, for each of `n` weights a vector.
fn multiplied(centred: &Vectors, weights: &[f64], n: usize) -> Vec<Vec<f32>> {
    let weights: Vec<f32> = weights.iter().map(|w| narrow(*w)).collect();
    let blocks: Vec<Vec<f32>> = (0..centred.length.div_ceil(COLUMNS))
        .into_par_iter()
        .map(|block| {
            let columns = block * COLUMNS..((block + 1) * COLUMNS).min(centred.length);
            let mut sums = vec![0.0_f32; n * columns.len()];
            for (v, weights) in weights.chunks_exact(n).enumerate() {
                let row = &centred.row(v)[columns.clone()];
                for (sums, weight) in sums.chunks_exact_mut(row.len()).zip(weights) {
                    sums.iter_mut().zip(row).for_each(|(s, a)| *s += weight * a);
                }
            }
            sums
        })
        .collect();
    (0..n).map(|k| blocks.iter().flat_map(|b| b[k * (b.len() / n)..(k + 1) * (b.len() / n)].iter().copied()).collect()).collect()
}

/// An orthonormal basis, by Gram and Schmidt's procedure twice ("twice is enough"); vectors that the ones before leave nothing of are dropped.
fn orthonormal(vectors: Vec<Vec<f32>>) -> Vec<Vec<f32>> {
    let mut basis: Vec<Vec<f32>> = Vec::new();
    for mut vector in vectors {
        let whole = dot(&vector, &vector);
        for _ in 0..2 {
            for other in &basis {
                let along = narrow(dot(&vector, other));
                vector.iter_mut().zip(other).for_each(|(v, o)| *v -= along * o);
            }
        }
        let left = dot(&vector, &vector);
        if left.is_finite() && left > 1e-9 * whole {
            let scale = narrow(1.0 / left.sqrt());
            vector.iter_mut().for_each(|v| *v *= scale);
            basis.push(vector);
        }
    }
    basis
}

#[cfg(test)]
#[path = "local_pca_tests.rs"]
mod tests;
