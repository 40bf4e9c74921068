//! Photographs of surfaces that are really there, by nothing of the fitter: rays to single threads and grooves, other triangles, other numbers at
//! random; and what cameras do to them.

pub mod drawn;
pub mod faulty;
pub mod question;
pub mod rows;
pub mod scene;

use biscale::filter::Control;
use biscale::material::{Material, SmallScale};
use biscale::numerics::colour::{linear_to_srgb, srgb_to_linear};
use biscale::numerics::low_discrepancy::{fraction, gaussian, hash, sobol_2d};
use biscale::render::Picture;
use biscale::toml_reader::Source;
use biscale::visibility::{Occlusion, PeriodicBvh, Traced};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Runs `work` with a control that never stops it.
pub fn with_control<T>(work: impl FnOnce(&Control<'_>) -> T) -> T {
    let cancel = AtomicBool::new(false);
    let began = std::time::Instant::now();
    work(&Control { cancel: &cancel, progress: &|_, _| {}, clock: &|| began.elapsed().as_secs_f64() })
}

/// What a camera does to a picture.
#[derive(Clone, Copy, Debug)]
pub struct Faults {
    /// Degrees by which the light stands elsewhere than the fit file says, in azimuth and elevation.
    pub light_off_deg: [f64; 2],
    /// Standard deviation of the blur, pixels.
    pub blur: f64,
    /// Light lost in the corners.
    pub vignetting: f64,
    /// Variance `a + b v` of a value `v`.
    pub noise: [f64; 2],
    /// Bits of a value; 8 bits are sRGB-encoded, as in a JPEG file, others linear.
    pub bits: Option<u32>,
    /// Whether 8 x 8 pixels are coded as a JPEG file of quality 90 does.
    pub jpeg: bool,
    /// Light that lies over all of a distant photograph, as a share of its brightest pixel.
    pub veil: f64,
    /// What the close-up's values are multiplied by, which its fit file says that nobody knows; 1 where it is known.
    pub exposure: f64,
    /// What the values of the distant photograph, the held-out one and the close-up are multiplied by, of which their fit file knows nothing.
    pub gain: [f64; 3],
    /// Degrees more by which the light of the close-up stands elsewhere.
    pub near_light_off_deg: [f64; 2],
    /// Light that lies over all of the close-up, as a share of its brightest pixel.
    pub near_veil: f64,
    /// Quarter turns of the close-up's pixels, and whether they are mirrored first.
    pub near_turned: (u32, bool),
    /// Light lost from the left side of a picture to the right, as a lamp nearby makes it.
    pub falloff: f64,
    /// Exponent of the values that the camera wrote, over the brightest one: 1 for a linear one.
    pub gamma: f64,
    /// Share of the brightest value at which the camera is full.
    pub full_at: f64,
    /// What the field of view is said to be over what it was.
    pub field_of_view: f64,
    /// Distance of the lamp from the middle of what is photographed, in its widths; and whether the fit file says so.
    pub lamp: (f64, bool),
    /// Pixels across the close-up, and down.
    pub near_pixels: u32,
    /// Radial distortion that nothing corrects: a place at the side of the picture is seen at `1 + distortion` times its distance from the middle.
    pub distortion: f64,
}

/// None.
pub const PERFECT: Faults = Faults {
    light_off_deg: [0.0; 2],
    blur: 0.0,
    vignetting: 0.0,
    noise: [0.0; 2],
    bits: None,
    jpeg: false,
    veil: 0.0,
    exposure: 1.0,
    gain: [1.0; 3],
    near_light_off_deg: [0.0; 2],
    near_veil: 0.0,
    near_turned: (0, false),
    falloff: 0.0,
    gamma: 1.0,
    full_at: 2.0,
    field_of_view: 1.0,
    lamp: (f64::INFINITY, false),
    near_pixels: 256,
    distortion: 0.0,
};
/// Those of a decent camera.
pub const REAL: Faults =
    Faults { light_off_deg: [0.35, 0.35], blur: 0.7, vignetting: 0.02, noise: [1e-6, 4e-5], bits: Some(12), jpeg: false, ..PERFECT };

impl Faults {
    /// Those of one photograph.
    pub fn of(&self, role: &str) -> Self {
        let gain = self.gain[["distant", "validation", "close-up"].iter().position(|r| *r == role).unwrap()];
        if role == "close-up" {
            let light_off_deg = std::array::from_fn(|k| self.light_off_deg[k] + self.near_light_off_deg[k]);
            Self { light_off_deg, veil: self.near_veil, exposure: self.exposure * gain, ..*self }
        } else {
            Self { exposure: gain, near_turned: (0, false), ..*self }
        }
    }
}

/// A camera that looks at an object at the origin.
#[derive(Clone, Copy, Debug)]
pub struct View {
    pub origin: [f64; 3],
    pub up: [f64; 3],
    pub fov_deg: f64,
    pub size: [u32; 2],
}

/// What the surface lies on.
#[derive(Clone, Copy, Debug)]
pub enum On {
    /// A cylinder of radius 1 around z, this high; its tile has this many units of the material's in a unit of length.
    Cylinder { height: f64, scale: f64 },
    /// The plane z = 0, this wide, in the material's own lengths.
    Plane { size: f64 },
}

impl On {
    /// How wide it is.
    fn width(self) -> f64 {
        match self {
            Self::Cylinder { .. } => 2.0,
            Self::Plane { size } => size,
        }
    }
}

/// A material from the text of its file.
pub fn material(text: &str) -> SmallScale {
    Material::parse(&Source { path: "truth.toml".into(), text: text.to_owned() }).unwrap().build().unwrap()
}

/// A direction turned in azimuth and elevation.
pub fn turned(v: [f64; 3], by_deg: [f64; 2]) -> DVec3 {
    let v = DVec3::from(v).normalize();
    let (a, e) = (v.y.atan2(v.x) + by_deg[0].to_radians(), v.z.asin() + by_deg[1].to_radians());
    DVec3::new(e.cos() * a.cos(), e.cos() * a.sin(), e.sin())
}

/// Photographs a surface: `samples` rays a pixel, each to the thread or groove that it meets, lit where nothing stands between, and by light that came along up to `bounces`
/// others. Irradiance is pi. What lies behind gaps is black.
pub fn photograph(
    small: &SmallScale,
    on: On,
    view: View,
    to_light: [f64; 3],
    samples: u32,
    (faults, bounces): (&Faults, u32),
    seed: u64,
) -> Picture {
    let bvh = PeriodicBvh::new(&small.tile).unwrap();
    let to_light = turned(to_light, faults.light_off_deg);
    let lamp = on.width() * faults.lamp.0;
    let origin = DVec3::from(view.origin);
    let forward = (-origin).normalize();
    let right = forward.cross(DVec3::from(view.up)).normalize();
    let axes = DMat3::from_cols(right, right.cross(forward), forward);
    let half = (0.5 * view.fov_deg.to_radians()).tan();
    let [w, h] = view.size;
    let radiance = |x: f64, y: f64, path: u32| -> DVec3 {
        let (x, y) = (2.0 * x / f64::from(w) - 1.0, (1.0 - 2.0 * y / f64::from(h)) * f64::from(h) / f64::from(w));
        let bent = 1.0 + faults.distortion * (x * x + y * y);
        let (across, up) = (bent * x * half, bent * y * half);
        let d = (axes * DVec3::new(across, up, 1.0)).normalize();
        let Some((frame, place, [s, t])) = meet(on, origin, d) else { return DVec3::ZERO };
        let (to_light, strength) = if lamp.is_finite() {
            let away = lamp * to_light - place;
            (away.normalize(), (lamp / away.length()).powi(2))
        } else {
            (to_light, 1.0)
        };
        let (wo, wi) = (frame.transpose() * -d, frame.transpose() * to_light);
        if wi.z <= 0.0 || wo.z <= 0.0 {
            return DVec3::ZERO;
        }
        let above = bvh.highest() + 1e-6;
        let start = DVec3::new(s, t, 0.0) + wo * (above / wo.z);
        let mut traced = bvh.trace(start, -wo, None);
        let (mut sum, mut throughput, mut viewer) = (DVec3::ZERO, DVec3::ONE, wo);
        for event in 0..=bounces {
            let Traced::Hit(hit) = traced else { break };
            let triangle = hit.triangle as usize;
            let [a, b, c] = small.tile.corners(triangle);
            let n = (b - a).cross(c - a).normalize();
            if n.dot(viewer) <= 0.0 {
                break;
            }
            let brdf = &small.surfaces[usize::from(small.surface_of_triangle[triangle])].brdf;
            if n.dot(wi) > 0.0 && bvh.occluded(triangle, hit.position, wi) != Occlusion::Blocked {
                sum += throughput * PI * n.dot(wi) * DVec3::from(brdf.eval(n, wi, viewer));
            }
            // On in any direction, as often as its cosine is large.
            let number = |k: u32| fraction(hash(path ^ hash(2 * event + k)));
            let (azimuth, sine) = (2.0 * PI * number(0), number(1).sqrt());
            let u = n.any_orthonormal_vector();
            let on = sine * (azimuth.cos() * u + azimuth.sin() * n.cross(u)) + (1.0 - sine * sine).max(1e-12).sqrt() * n;
            throughput *= PI * DVec3::from(brdf.eval(n, on, viewer));
            traced = bvh.trace(hit.position, on, Some(hit.triangle));
            viewer = -on;
        }
        strength * sum
    };
    let mut rgb: Vec<DVec3> = (0..w * h)
        .into_par_iter()
        .map(|k| {
            let one = |s: u32| {
                let [dx, dy] = sobol_2d(s, k ^ seed as u32).map(fraction);
                radiance(f64::from(k % w) + dx, f64::from(k / w) + dy, hash(s ^ hash(k ^ hash(seed as u32))))
            };
            (0..samples).map(one).sum::<DVec3>() / f64::from(samples)
        })
        .collect();
    blur(&mut rgb, [w as usize, h as usize], faults.blur);
    let brightest = |rgb: &[DVec3]| rgb.iter().map(|v| v.max_element()).fold(0.0, f64::max);
    let veil = faults.veil * brightest(&rgb);
    rgb.iter_mut().for_each(|v| *v = (*v + veil) * faults.exposure);
    let bright = brightest(&rgb);
    let top = 1.1 * bright;
    let recorded = |v: f64| bright * (v / bright).max(0.0).powf(faults.gamma);
    let mut picture = Picture::new(w, h);
    for (k, (pixel, value)) in picture.rgb.iter_mut().zip(&rgb).enumerate() {
        let at = |k: usize, size: u32| (k as f64 + 0.5) / f64::from(size) - 0.5;
        let (x, y) = (at(k % w as usize, w), at(k / w as usize, h));
        let shade = (1.0 - faults.vignetting * 2.0 * (x * x + y * y)) * (1.0 - faults.falloff * x);
        for c in 0..3 {
            let v = recorded(shade * value[c]).min(faults.full_at * bright);
            let v = v + gaussian(seed, (3 * k + c) as u64) * (faults.noise[0] + faults.noise[1] * v).sqrt();
            pixel[c] = quantised(v, top, faults.bits) as f32;
        }
    }
    if faults.jpeg {
        coded(&mut picture, top);
    }
    turned_pixels(picture, faults.near_turned)
}

/// A square picture mirrored, if asked, and turned by quarter turns.
fn turned_pixels(mut picture: Picture, (quarters, mirrored): (u32, bool)) -> Picture {
    let n = picture.width as usize;
    if mirrored {
        picture.rgb.chunks_exact_mut(n).for_each(<[[f32; 3]]>::reverse);
    }
    for _ in 0..quarters {
        assert_eq!(picture.width, picture.height);
        let old = picture.rgb.clone();
        for (k, pixel) in picture.rgb.iter_mut().enumerate() {
            *pixel = old[(k % n) * n + n - 1 - k / n];
        }
    }
    picture
}

/// Luminance quantisation of JPEG files (ISO/IEC 10918-1, annex K) at quality 90.
const QUANTISATION: [u8; 64] = [
    3, 2, 2, 3, 5, 8, 10, 12, 2, 2, 3, 4, 5, 12, 12, 11, 3, 3, 3, 5, 8, 11, 14, 11, 3, 3, 4, 6, 10, 17, 16, 12, 4, 4, 7, 11, 14, 22, 21,
    15, 5, 7, 11, 13, 16, 21, 23, 18, 10, 13, 16, 17, 21, 24, 24, 20, 14, 18, 19, 20, 22, 20, 21, 20,
];

/// Codes 8 x 8 pixels of each channel as a JPEG file does; what is left over at the sides stays.
fn coded(picture: &mut Picture, top: f64) {
    let basis = |u: usize, x: usize| {
        let norm = if u == 0 { (0.125_f64).sqrt() } else { 0.5 };
        norm * ((2 * x + 1) as f64 * u as f64 * PI / 16.0).cos()
    };
    let width = picture.width as usize;
    for (by, bx) in (0..picture.height as usize / 8).flat_map(|y| (0..width / 8).map(move |x| (8 * y, 8 * x))) {
        for c in 0..3 {
            let at = |k: usize| (by + k / 8) * width + bx + k % 8;
            let old: Vec<f64> = (0..64).map(|k| 255.0 * linear_to_srgb(f64::from(picture.rgb[at(k)][c]) / top) - 128.0).collect();
            let wave = |f: usize, k: usize| basis(f / 8, k / 8) * basis(f % 8, k % 8);
            let coefficient = |f: usize| {
                let step = f64::from(QUANTISATION[f]);
                ((0..64).map(|k| wave(f, k) * old[k]).sum::<f64>() / step).round() * step
            };
            let coefficients: Vec<f64> = (0..64).map(coefficient).collect();
            for k in 0..64 {
                let v = ((0..64).map(|f| wave(f, k) * coefficients[f]).sum::<f64>() + 128.0).round().clamp(0.0, 255.0);
                picture.rgb[at(k)][c] = (srgb_to_linear(v / 255.0) * top) as f32;
            }
        }
    }
}

fn quantised(v: f64, top: f64, bits: Option<u32>) -> f64 {
    match bits {
        None => v,
        Some(8) => srgb_to_linear((255.0 * linear_to_srgb(v / top)).round() / 255.0) * top,
        Some(bits) => {
            let steps = f64::from((1_u32 << bits) - 1);
            (v / top * steps).round().clamp(0.0, steps) / steps * top
        }
    }
}

/// The frame of the tile where a ray meets the object, where that is, and the place there in the tile's lengths.
fn meet(on: On, origin: DVec3, d: DVec3) -> Option<(DMat3, DVec3, [f64; 2])> {
    match on {
        On::Plane { size } => {
            let t = -origin.z / d.z;
            let p = origin + t * d;
            (t > 0.0 && p.x.abs() < 0.5 * size && p.y.abs() < 0.5 * size).then_some((DMat3::IDENTITY, p, [p.x, p.y]))
        }
        On::Cylinder { height, scale } => {
            let (a, b, c) = (d.x * d.x + d.y * d.y, origin.x * d.x + origin.y * d.y, origin.x * origin.x + origin.y * origin.y - 1.0);
            let root = (b * b - a * c).max(0.0).sqrt();
            let p = origin + (-b - root) / a * d;
            let n = DVec3::new(p.x, p.y, 0.0);
            let x = DVec3::new(-n.y, n.x, 0.0);
            (b * b > a * c && p.z.abs() < 0.5 * height)
                .then(|| (DMat3::from_cols(x, DVec3::Z, n), p, [scale * n.x.atan2(-n.y), scale * p.z]))
        }
    }
}

fn blur(rgb: &mut [DVec3], [w, h]: [usize; 2], sigma: f64) {
    if sigma <= 0.0 {
        return;
    }
    let reach = (3.0 * sigma).ceil() as i32;
    let weight = |k: i32| (-0.5 * (k as f64 / sigma).powi(2)).exp();
    for (count, stride, lines, step) in [(w, 1, h, w), (h, w, w, 1)] {
        for line in 0..lines {
            let last = i32::try_from(count).unwrap() - 1;
            let at = |k: i32| line * step + k as usize * stride;
            let old: Vec<DVec3> = (0..=last).map(|k| rgb[at(k)]).collect();
            for k in 0..=last {
                let (mut sum, mut total) = (DVec3::ZERO, 0.0);
                for j in -reach..=reach {
                    sum += weight(j) * old[(k + j).clamp(0, last) as usize];
                    total += weight(j);
                }
                rgb[at(k)] = sum / total;
            }
        }
    }
}

/// Writes a picture.
pub fn write(picture: &Picture, file: &Path) {
    let out = std::io::BufWriter::new(std::fs::File::create(file).unwrap());
    picture.write_exr(out, false, "a test").unwrap();
}

/// Three photographs of a surface and the tables of a fit file that describe them.
pub struct Set {
    /// `[object]`, `[camera]` and `[[photograph]]` tables.
    pub tables: String,
}

/// Camera of the distant photographs.
pub const DISTANT: View = View { origin: [0.0, -12.0, 0.0], up: [0.0, 0.0, 1.0], fov_deg: 10.95, size: [96, 60] };
/// Lights of the distant photograph, of the held-out one, and of the close-up.
pub const LIGHTS: [[f64; 3]; 3] = [[0.427, -0.854, 0.299], [-0.885, -0.442, 0.147], [0.453, -0.252, 0.855]];

/// Photographs `small`, `repeats` of whose periods go once around the cylinder, into `folder`.
pub fn set(folder: &Path, small: &SmallScale, repeats: f64, faults: &Faults, samples: u32) -> Set {
    set_under(folder, small, repeats, LIGHTS, (faults, 0), samples)
}

/// The same under other lights, which go along up to `bounces` threads more than the one that is seen.
pub fn set_under(
    folder: &Path,
    small: &SmallScale,
    repeats: f64,
    lights: [[f64; 3]; 3],
    (faults, bounces): (&Faults, u32),
    samples: u32,
) -> Set {
    let period = small.tile.period.x;
    let scale = repeats * period / (2.0 * PI);
    let size = 6.2 * period;
    let near = View { origin: [0.0, -period, 22.0 * period], up: [0.0, 1.0, 0.0], fov_deg: 15.8, size: [faults.near_pixels; 2] };
    let cylinder = On::Cylinder { height: 1.55, scale };
    let vector = |v: [f64; 3]| format!("[{}, {}, {}]", v[0], v[1], v[2]);
    let camera = |v: View, table: &str| {
        format!(
            "[{table}]\norigin = {}\ntarget = [0, 0, 0]\nup = {}\nfov_deg = {}\nwidth = {}\nheight = {}\n",
            vector(v.origin),
            vector(v.up),
            faults.field_of_view * v.fov_deg,
            v.size[0],
            v.size[1]
        )
    };
    let mut tables = format!("[object]\nkind = \"cylinder\"\nradius = 1\nheight = 1.55\n{}", camera(DISTANT, "camera"));
    for (k, (role, name)) in [("distant", "b"), ("validation", "c"), ("close-up", "a")].into_iter().enumerate() {
        let (on, view, rays) =
            if role == "close-up" { (On::Plane { size }, near, samples.div_ceil(4)) } else { (cylinder, DISTANT, samples) };
        let of_photograph = faults.of(role);
        let picture = photograph(small, on, view, lights[k], rays, (&of_photograph, bounces), 7 + k as u64);
        write(&picture, &folder.join(format!("{name}.exr")));
        tables.push_str(&format!("[[photograph]]\nrole = \"{role}\"\nimage = \"{name}.exr\"\n"));
        if role == "close-up" && faults.exposure != 1.0 {
            tables.push_str("exposure_known = false\n");
        }
        if role == "close-up" {
            tables.push_str(&camera(near, "photograph.camera"));
            tables.push_str(&format!("[photograph.object]\nkind = \"plane\"\nsize = [{size}, {size}]\n"));
        }
        let lamp = faults.lamp.0 * if role == "close-up" { On::Plane { size } } else { cylinder }.width();
        let light = if faults.lamp.1 {
            let position = vector((lamp * DVec3::from(lights[k]).normalize()).into());
            format!("type = \"point\"\nposition = {position}\nintensity_rgb = {}\n", PI * lamp * lamp)
        } else {
            format!("type = \"directional\"\nto_light = {}\nirradiance_rgb = {PI}\n", vector(lights[k]))
        };
        tables.push_str(&format!("[photograph.light]\n{light}"));
    }
    Set { tables }
}
