//! BTFs made by an independent path tracer (`tests/data/truth_btf/README.md`).

use biscale::btf::{BtfQuestion, BtfSummary, PlaneHeight, ReferencePlane, ViewImages, ViewLights, render};
use biscale::filter::Control;
use biscale::material::{Material, SmallScale};
use glam::DVec3;
use std::path::{Path, PathBuf};

/// One tile in one BRDF: 32 x 32 texels of some pairs.
pub struct BtfTruth {
    pub small: SmallScale,
    pub plane: ReferencePlane,
    pub views: Vec<ViewLights>,
    /// `B`, pair after pair.
    pub value: Vec<f32>,
    /// Share of rays that met front faces, and anything.
    pub cover: Vec<[f64; 2]>,
}

fn folder(name: &str) -> PathBuf {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data")).join(name)
}

/// The numbers of a file of numpy: float32, uint16 or uint8.
fn numbers(path: &Path) -> Vec<f32> {
    let bytes = std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let header = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
    let text = std::str::from_utf8(&bytes[10..10 + header]).unwrap();
    let data = &bytes[10 + header..];
    if text.contains("'<f4'") {
        data.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect()
    } else {
        if text.contains("'|u1'") {
            return data.iter().map(|&b| f32::from(b)).collect();
        }
        assert!(text.contains("'<u2'"), "{text}");
        data.chunks_exact(2).map(|b| f32::from(u16::from_le_bytes(b.try_into().unwrap()))).collect()
    }
}

impl BtfTruth {
    /// `set` is the name of the pairs, `tile` or `tile.top`.
    pub fn load(tile: &str, set: &str, brdf: &str, height: PlaneHeight) -> Self {
        let of = |name: String| folder("truth_btf").join(name);
        let small = Material::load(&folder("truth").join(format!("{tile}.{brdf}.toml"))).unwrap().build().unwrap();
        let pairs = std::fs::read_to_string(of(format!("{set}.pairs.csv"))).unwrap();
        let views = pairs.lines().skip(1).map(|line| {
            let w: Vec<f64> = line.split(',').map(|v| v.parse().unwrap()).collect();
            let [wi, wo] = [0, 3].map(|k| DVec3::from_slice(&w[k..k + 3]).normalize());
            ViewLights { wo, lights: vec![wi] }
        });
        let cover = numbers(&of(format!("{set}.cover.npy")));
        Self {
            plane: ReferencePlane::new(&small.tile, height, [32, 32]),
            small,
            views: views.collect(),
            value: numbers(&of(format!("{set}.{brdf}.btf.npy"))),
            cover: cover.chunks_exact(2).map(|c| [f64::from(c[0]) / 1600.0, f64::from(c[1]) / 1600.0]).collect(),
        }
    }

    pub fn render(&self, tolerance: f64, seed: u32) -> (Vec<ViewImages>, BtfSummary) {
        let mut images = Vec::new();
        let question = BtfQuestion { plane: self.plane, views: &self.views, tolerance, seed };
        let summary = render(&self.small, question, &Control::quiet(), &mut |_, view| {
            images.push(view);
            Ok(())
        });
        (images, summary.unwrap())
    }

    /// Relative RMS difference of all texels.
    pub fn relative_rms(&self, images: &[ViewImages]) -> f64 {
        let got = images.iter().flat_map(|view| view.value.iter().flatten());
        let (mut off, mut all) = (0.0, 0.0);
        for (got, truth) in got.zip(&self.value) {
            off += f64::from(got - truth).powi(2);
            all += f64::from(*truth).powi(2);
        }
        (off / all).sqrt()
    }

    /// Largest difference of the mean cover of a pair's texels, of front faces and of anything, and RMS difference of texels.
    pub fn cover_off(&self, images: &[ViewImages]) -> (f64, f64) {
        let count = self.plane.count();
        let (mut largest, mut squares) = (0.0_f64, 0.0);
        for (view, truth) in images.iter().zip(self.cover.chunks_exact(count)) {
            for k in 0..2 {
                let off = view.cover.iter().zip(truth).map(|(c, t)| f64::from(c[k]) - t[k]);
                squares += off.clone().map(|v| v * v).sum::<f64>();
                largest = largest.max((off.sum::<f64>() / count as f64).abs());
            }
        }
        (largest, (squares / (2 * count * images.len()) as f64).sqrt())
    }
}

/// The lights of a stack of images of a weave, and those images from above and from 50 degrees: light after light, 24 x 24 texels each.
pub fn slots() -> (Vec<DVec3>, Vec<Vec<[f32; 3]>>) {
    const SCALE: f32 = 1.890_989_9;
    let text = std::fs::read_to_string(folder("truth_btf").join("weave.ggx_0.30.directions.csv")).unwrap();
    let light = |line: &str| DVec3::from_slice(&line.split(',').map(|v| v.parse().unwrap()).collect::<Vec<f64>>());
    let lights: Vec<DVec3> = text.lines().skip(1).map(light).collect();
    let codes = numbers(&folder("truth_btf").join("weave.ggx_0.30.slots.npy"));
    let (texels, count) = (24 * 24, lights.len());
    let value = |code: f32| (code / 255.0) * (code / 255.0) * SCALE;
    let slot = |slot: usize| {
        let of = |light: usize, texel: usize| ((slot * texels + texel) * count + light) * 3;
        (0..count * texels).map(|k| [0, 1, 2].map(|c| value(codes[of(k / texels, k % texels) + c]))).collect()
    };
    (lights, (0..2).map(slot).collect())
}
