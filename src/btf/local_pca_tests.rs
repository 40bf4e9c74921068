use super::*;
use crate::numerics::linear_algebra::symmetric_eigenvalues;

fn settings(clusters: usize, components: usize) -> LocalPcaSettings {
    LocalPcaSettings { clusters, components, starts: 4, seed: 0 }
}

fn fit(vectors: &Vectors, clusters: usize, components: usize) -> LocalPca {
    LocalPca::fit(vectors, &settings(clusters, components), &Control::quiet()).unwrap()
}

fn noise(seed: u64, at: usize) -> f32 {
    narrow(gaussian(seed, at as u64))
}

/// `count` vectors around each of `planes` points, in the plane of two directions of its own.
fn planted(planes: usize, count: usize, length: usize) -> Vectors {
    let mut values = Vec::new();
    for plane in 0..planes {
        let seed = 10 * plane as u64;
        for v in 0..count {
            let along = [noise(seed + 3, v), noise(seed + 4, v)];
            values.extend((0..length).map(|at| 3.0 * noise(seed, at) + along[0] * noise(seed + 1, at) + along[1] * noise(seed + 2, at)));
        }
    }
    Vectors { length, values }
}

/// Relative RMS error of the best `components` of one cluster, by the eigenvalues of the covariance.
fn by_covariance(vectors: &Vectors, components: usize) -> f64 {
    let (n, d) = (vectors.count(), vectors.length);
    let mean: Vec<f64> = (0..d).map(|i| (0..n).map(|v| f64::from(vectors.row(v)[i])).sum::<f64>() / n as f64).collect();
    let centred = |v: usize, i: usize| f64::from(vectors.row(v)[i]) - mean[i];
    let covariance: Vec<f64> = (0..d * d).map(|at| (0..n).map(|v| centred(v, at / d) * centred(v, at % d)).sum()).collect();
    let left: f64 = symmetric_eigenvalues(&covariance, d)[..d - components].iter().sum();
    (left / vectors.squares()).sqrt()
}

#[test]
fn one_cluster_is_as_good_as_the_eigenvectors_of_the_covariance() {
    // More and fewer vectors than are decomposed exactly.
    for count in [400, 60] {
        let vectors = Vectors { length: 50, values: (0..50 * count).map(|at| 0.3 + noise(1, at) / (1.0 + (at % 50) as f32)).collect() };
        for components in [0, 1, 4, 12] {
            let (found, best) = (fit(&vectors, 1, components).relative_rms, by_covariance(&vectors, components));
            assert!((found / best - 1.0).abs() < 2e-4, "{count} {components}: {found} {best}");
        }
    }
}

#[test]
fn planted_planes_are_found() {
    for count in [40, 300] {
        let vectors = planted(3, count, 64);
        let found = fit(&vectors, 3, 2);
        assert!(found.relative_rms < 1e-4, "{}", found.relative_rms);
        let label = |v: usize| found.labels[v];
        assert!((0..3 * count).all(|v| label(v) == label(v / count * count)), "{:?}", found.labels);
        assert!(fit(&vectors, 2, 2).relative_rms > 0.1 && fit(&vectors, 3, 1).relative_rms > 0.1);
    }
}

#[test]
fn the_error_told_is_that_of_what_is_reconstructed_and_more_clusters_or_components_make_it_less() {
    let vectors =
        Vectors { length: 48, values: (0..48 * 200).map(|at| noise(5, at / 7) * noise(6, at % 48) + 0.1 * noise(7, at)).collect() };
    let mut before = f64::INFINITY;
    for (clusters, components) in [(1, 0), (1, 3), (4, 3), (4, 8), (16, 8)] {
        let found = fit(&vectors, clusters, components);
        assert!((relative_rms(&vectors, &found.reconstruct()) - found.relative_rms).abs() < 1e-12);
        assert!(found.relative_rms < before, "{clusters} {components}: {} {before}", found.relative_rms);
        before = found.relative_rms;
    }
}

#[test]
fn halves_and_bytes_cost_little_and_are_what_is_measured() {
    let vectors = planted(3, 100, 64);
    let found = fit(&vectors, 2, 2);
    assert_eq!(found.stored(&vectors, Precision::Float), found);
    let half = found.stored(&vectors, Precision::Half).relative_rms;
    let byte = found.stored(&vectors, Precision::Byte).relative_rms;
    assert!((half / found.relative_rms - 1.0).abs() < 1e-3, "{half}");
    assert!(byte > found.relative_rms && byte < 1.1 * found.relative_rms, "{byte} {}", found.relative_rms);
}

#[test]
fn numbers_of_any_size_are_stored_without_overflow() {
    for scale in [1e-40, 1e-30, 1.0, 6e4, 1e9] {
        let vectors = Vectors { length: 40, values: (0..40 * 30).map(|at| scale * (1.0 + noise(8, at).abs())).collect() };
        let found = fit(&vectors, 2, 3);
        for precision in [Precision::Float, Precision::Half, Precision::Byte] {
            let stored = found.stored(&vectors, precision);
            assert!(stored.reconstruct().values.iter().all(|v| v.is_finite()), "{scale} {precision:?}");
            // Squares of the smallest are 0 in 32 bits, and halves have no numbers of their size: then components are of no use, and the error says so.
            assert!(stored.relative_rms.is_finite());
            let can = precision != Precision::Half || (1e-3..1e4).contains(&scale);
            assert!(!can || scale < 1e-20 || stored.relative_rms < 0.5, "{scale} {precision:?}: {}", stored.relative_rms);
        }
    }
}

/// Those of the reference fits of a weave, 24 x 24 texels in 41 x 41 pairs: `docs/btf.md`.
#[test]
fn sizes_count_what_table_1_counts_and_what_it_leaves_out() {
    let size = |vectors, length, clusters| LocalPcaSize::of(vectors, length, clusters, 8, Precision::Half);
    for (clusters, components, all) in [(1, 89_904, 100_566), (4, 331_968, 372_888), (16, 1_300_224, 1_462_176), (32, 2_591_232, 2_914_560)]
    {
        assert_eq!(size(576, 5043, clusters), LocalPcaSize { components, all });
    }
    for (clusters, components, all) in [(1, 54_544, 59_681), (4, 137_488, 152_993), (16, 469_264, 526_241), (32, 911_632, 1_023_905)] {
        assert_eq!(size(1681, 1728, clusters), LocalPcaSize { components, all });
    }
    let of_bytes = LocalPcaSize::of(60, 20, 2, 3, Precision::Byte).all;
    assert_eq!(of_bytes, 3 * (2 * 20 + 60) + 2 * 20 + 60 + 8 * 2 * 7);
}

#[test]
fn images_become_vectors_of_texels_or_pairs_and_images_again() {
    let images: Vec<[f32; 3]> = (0_u8..24).map(|at| [f32::from(at), 0.25, f32::from(at) + 0.5]).collect();
    let by_texel = Vectors::arrange(&images, 6, Arrangement::Brdf).unwrap();
    assert!(by_texel.count() == 6 && by_texel.row(2)[..6] == [2.0, 0.25, 2.5, 8.0, 0.25, 8.5]);
    let by_pair = Vectors::arrange(&images, 6, Arrangement::Texture).unwrap();
    assert!(by_pair.count() == 4 && by_pair.row(1)[..3] == [6.0, 0.25, 6.5]);
    assert!(by_texel.images(Arrangement::Brdf) == images && by_pair.images(Arrangement::Texture) == images);
}

#[test]
fn what_is_degenerate_is_kept_exactly_or_refused_in_words() {
    let equal = Vectors { length: 5, values: vec![0.7; 20] };
    for (clusters, components) in [(1, 0), (2, 3), (4, 8)] {
        assert!(fit(&equal, clusters, components).relative_rms < 1e-6);
    }
    let alone = Vectors { length: 3, values: vec![1.0, 2.0, 3.0] };
    assert!(fit(&alone, 1, 2).relative_rms < 1e-6);
    // A cluster for each vector, more components than there are dimensions.
    let few = planted(3, 2, 4);
    assert!(fit(&few, 6, 0).relative_rms < 1e-6 && fit(&few, 1, 60).relative_rms < 1e-5);
    // Mostly dark, one highlight: far from all others.
    let mut values = vec![0.0; 300 * 8];
    values[801] = 1e4;
    assert!(fit(&Vectors { length: 8, values }, 2, 1).relative_rms < 1e-6);
    let refused = |clusters, components, starts| {
        let settings = LocalPcaSettings { clusters, components, starts, seed: 0 };
        LocalPca::fit(&few, &settings, &Control::quiet()).unwrap_err().to_string()
    };
    assert!(refused(7, 1, 1).contains("clusters: 7; use 1 to 6"), "{}", refused(7, 1, 1));
    assert!(
        refused(0, 1, 1).contains("clusters: 0") && refused(1, 257, 1).contains("components: 257") && refused(1, 1, 0).contains("starts")
    );
    // Their squares are no 32-bit numbers.
    for count in [20, 300] {
        let huge = Vectors { length: 40, values: (0..40 * count).map(|at| 1e25 * noise(9, at)).collect() };
        let error = LocalPca::fit(&huge, &settings(1, 2), &Control::quiet()).unwrap_err();
        assert!(matches!(&error, Error::Numeric(text) if text.contains("over the largest")), "{error}");
    }
    for values in [vec![], vec![[0.0; 3]; 4], vec![[0.0, f32::NAN, 1.0]; 4]] {
        assert!(Vectors::arrange(&values, 2, Arrangement::Brdf).is_err());
    }
}

#[test]
fn a_search_that_is_to_be_stopped_stops() {
    let cancel = std::sync::atomic::AtomicBool::new(true);
    let control = Control { cancel: &cancel, ..Control::quiet() };
    assert!(matches!(LocalPca::fit(&planted(2, 20, 8), &settings(2, 1), &control), Err(Error::Interrupted)));
}

#[test]
fn the_same_bits_come_out_at_any_number_of_threads() {
    let vectors = planted(4, 150, 1100);
    let at = |threads: usize| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| fit(&vectors, 3, 2));
    assert_eq!(at(1), at(3));
}
