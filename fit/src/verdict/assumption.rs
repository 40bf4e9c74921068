//! What a fit takes for granted of its photographs, made otherwise one thing at a time: the one that makes the photographs agree is the likely cause
//! of a failure.

use crate::fit_file::spec::{Spec, USUAL_BOUNCES};
use crate::photograph::image::{Image, Photograph, Role};
use crate::residuals::unknowns::Shot;
use biscale::numerics::cast::narrow;
use biscale::numerics::colour::{linear_to_srgb, srgb_to_linear};

/// Standard deviation of a light's direction where little of what the file says of it is believed, degrees. Chosen, not measured: its bounds are 24
/// degrees, over which directions in the tile's frame still turn about linearly with the angle.
pub const FREE_LIGHT_SIGMA_DEG: f64 = 3.0;

/// Fields of view that are tried, over that of the file. Chosen, not measured: a lens that focuses near sees about so much less, and errors of 4 to
/// 12 % become smaller by one of the two.
const FIELDS_OF_VIEW: [f64; 2] = [0.93, 1.07];

/// Values over the brightest of their channel from which on pixels count as those of a sensor that was full. Chosen, not measured: noise of a tenth.
const BRIGHTEST: f32 = 0.9;

/// One thing, otherwise than the fit file says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Assumption {
    /// The close-up's pixels are turned by quarter turns.
    NearTurned(u32),
    /// They are mirrored left to right.
    NearMirrored,
    /// The distant photograph and the held-out one are each other.
    Swapped,
    /// Values are encoded by the curve of sRGB, and not linear.
    Encoded,
    /// Linear values were taken for encoded ones, and decoded.
    Decoded,
    /// The brightest values are those of a sensor that was full.
    Full,
    /// Other reflections after the first: none, or the usual number.
    Bounces,
    /// The light of a photograph stands anywhere.
    Light(Shot),
    /// The distant cameras see this many times the angle.
    FieldOfView(f64),
}

impl Assumption {
    /// All that make a difference for a fit file.
    pub fn all(spec: &Spec) -> Vec<Self> {
        let near = spec.of_role(Role::CloseUp).next();
        let mut all = Vec::new();
        if let Some(near) = near {
            let square = near.image.width == near.image.height;
            all.extend([1, 2, 3].into_iter().filter(|quarters| square || *quarters == 2).map(Self::NearTurned));
            all.push(Self::NearMirrored);
            all.extend(is_held(near).then_some(Self::Light(Shot::CloseUp)));
        }
        let size = |p: &Photograph| (p.image.width, p.image.height);
        let pair = spec.of_role(Role::Distant).next().zip(spec.of_role(Role::Validation).next());
        all.extend(pair.filter(|(a, b)| size(a) == size(b)).map(|_| Self::Swapped));
        let distant = spec.of_role(Role::Distant).enumerate().filter(|(_, p)| is_held(p));
        all.extend(distant.map(|(k, _)| Self::Light(Shot::Distant(k))));
        all.extend([Self::Encoded, Self::Decoded, Self::Full, Self::Bounces]);
        all.extend(FIELDS_OF_VIEW.map(Self::FieldOfView));
        all
    }

    /// Whether the values of photographs are others, and not only what is said of them.
    pub fn changes_values(self) -> bool {
        matches!(self, Self::Swapped | Self::Encoded | Self::Decoded | Self::Full)
    }

    /// The fit file with this otherwise.
    pub fn applied(self, spec: &Spec) -> Spec {
        let mut spec = spec.clone();
        match self {
            Self::NearTurned(quarters) => near(&mut spec).for_each(|p| (0..quarters).for_each(|_| turn(&mut p.image))),
            Self::NearMirrored => near(&mut spec).for_each(|p| mirror(&mut p.image)),
            Self::Swapped => swap(&mut spec),
            Self::Encoded => spec.photographs.iter_mut().for_each(|p| map(&mut p.image, srgb_to_linear)),
            Self::Decoded => spec.photographs.iter_mut().for_each(|p| map(&mut p.image, linear_to_srgb)),
            Self::Full => spec.photographs.iter_mut().for_each(|p| without_brightest(&mut p.image)),
            Self::Bounces => spec.bounces = if spec.bounces == 0 { USUAL_BOUNCES } else { 0 },
            Self::FieldOfView(factor) => {
                let distant = spec.photographs.iter_mut().filter(|p| p.role != Role::CloseUp);
                distant.for_each(|p| p.camera.focal = p.camera.focal.map(|focal| focal / factor));
            }
            Self::Light(shot) => {
                let role = if shot == Shot::CloseUp { Role::CloseUp } else { Role::Distant };
                let place = if let Shot::Distant(k) = shot { k } else { 0 };
                let light = spec.photographs.iter_mut().filter(|p| p.role == role).nth(place);
                light.into_iter().for_each(|p| p.light_sigma_deg = FREE_LIGHT_SIGMA_DEG);
            }
        }
        spec
    }

    /// What to do about it, where it makes the photographs agree.
    pub fn remedy(self, spec: &Spec) -> String {
        let name = |role| spec.of_role(role).next().map_or_else(String::new, Photograph::name);
        let close_up = name(Role::CloseUp);
        match self {
            Self::NearTurned(2) => format!("the close-up {close_up} is upside down: turn it by 180 degrees, or the `up` of its camera"),
            Self::NearTurned(_) => format!("the close-up {close_up} is turned by a quarter turn: turn it back, or the `up` of its camera"),
            Self::NearMirrored => format!("the close-up {close_up} is mirrored: flip it from left to right"),
            Self::Swapped => format!("{} and {} are each other: swap the two files", name(Role::Distant), name(Role::Validation)),
            Self::Encoded => {
                "the values of the photographs are encoded for a screen (sRGB), not linear: linearise them, as `biscale capture` does"
                    .to_owned()
            }
            Self::Decoded => {
                "the values of the photographs were linearised twice: give them as they were before the second time".to_owned()
            }
            Self::Full => {
                "the brightest places of the photographs are overexposed: without them they agree; expose less, or mask these places"
                    .to_owned()
            }
            Self::Bounces if spec.bounces == 0 => {
                format!("the photographs show light that was reflected more than once: write `bounces = {USUAL_BOUNCES}` into the fit file")
            }
            Self::Bounces => "the photographs show direct light only: write `bounces = 0` into the fit file".to_owned(),
            Self::FieldOfView(factor) => format!(
                "the cameras of the distant photographs see a {} angle than the file says, by some {:.0} %: check `fov_deg`, and the distance",
                if factor > 1.0 { "wider" } else { "narrower" },
                100.0 * (factor - 1.0).abs()
            ),
            Self::Light(Shot::CloseUp) => format!("the light of the close-up {close_up} stands elsewhere than the file says"),
            Self::Light(Shot::Distant(k)) => {
                let photograph = spec.of_role(Role::Distant).nth(k).map_or_else(String::new, Photograph::name);
                format!("the light of {photograph} stands elsewhere than the file says")
            }
        }
    }
}

/// Whether the light of a photograph is less free than it may be.
fn is_held(photograph: &Photograph) -> bool {
    photograph.light_sigma_deg < FREE_LIGHT_SIGMA_DEG
}

fn near(spec: &mut Spec) -> impl Iterator<Item = &mut Photograph> {
    spec.photographs.iter_mut().filter(|p| p.role == Role::CloseUp)
}

fn mirror(image: &mut Image) {
    image.rgb.chunks_exact_mut(image.width as usize).for_each(<[[f32; 3]]>::reverse);
}

/// A quarter turn to the left of a square picture, or of any picture where it is done twice.
fn turn(image: &mut Image) {
    let (width, height) = (image.width as usize, image.height as usize);
    let old = image.rgb.clone();
    for (k, pixel) in image.rgb.iter_mut().enumerate() {
        let (column, row) = (k % height, k / height);
        *pixel = old[column * width + width - 1 - row];
    }
    (image.width, image.height) = (image.height, image.width);
}

/// The first distant photograph and the first held-out one change their pixels.
fn swap(spec: &mut Spec) {
    let place = |role| spec.photographs.iter().position(|p| p.role == role);
    if let (Some(a), Some(b)) = (place(Role::Distant), place(Role::Validation)) {
        let image = spec.photographs[a].image.clone();
        spec.photographs[a].image = std::mem::replace(&mut spec.photographs[b].image, image);
    }
}

/// Leaves out the pixels of which a channel is nearly as bright as the brightest there is: where a sensor was full, noise lies about that.
fn without_brightest(image: &mut Image) {
    let tops: [f32; 3] = std::array::from_fn(|c| image.rgb.iter().map(|p| p[c]).filter(|v| v.is_finite()).fold(0.0, f32::max));
    for pixel in &mut image.rgb {
        if (0..3).any(|c| tops[c] > 0.0 && pixel[c] >= BRIGHTEST * tops[c]) {
            *pixel = [f32::NAN; 3];
        }
    }
}

/// Maps all values by a curve of 0 to 1, which is the brightest.
fn map(image: &mut Image, curve: impl Fn(f64) -> f64) {
    let top = image.rgb.iter().flatten().copied().filter(|v| v.is_finite()).fold(0.0, f32::max);
    if top > 0.0 {
        let of = |v: f32| if v > 0.0 { narrow(curve(f64::from(v / top)) * f64::from(top)) } else { v };
        image.rgb.iter_mut().for_each(|pixel| *pixel = pixel.map(of));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, height: u32) -> Image {
        let rgb = (0..width * height).map(|k| [k as f32, 0.5 * k as f32, 1.0]).collect();
        Image { width, height, rgb, notes: Vec::new() }
    }

    #[test]
    fn four_quarter_turns_and_two_mirrors_change_nothing() {
        for (width, height) in [(5, 5), (4, 3)] {
            let before = image(width, height);
            let mut turned = before.clone();
            turn(&mut turned);
            assert_eq!((turned.width, turned.height, turned.rgb[0]), (height, width, before.rgb[width as usize - 1]));
            (0..3).for_each(|_| turn(&mut turned));
            assert_eq!(turned, before);
            mirror(&mut turned);
            assert_eq!(turned.rgb[0], before.rgb[width as usize - 1]);
            mirror(&mut turned);
            assert_eq!(turned, before);
        }
    }

    #[test]
    fn without_the_brightest_pixels_the_others_stay() {
        let mut there = image(11, 1);
        there.rgb.iter_mut().for_each(|p| p[2] = 0.3 * p[0]);
        without_brightest(&mut there);
        assert!(
            there.rgb[..9].iter().enumerate().all(|(k, p)| p[0] == k as f32)
                && there.rgb[9].iter().chain(&there.rgb[10]).all(|v| v.is_nan())
        );
    }

    #[test]
    fn encoding_keeps_black_the_brightest_value_and_holes() {
        let mut there = image(4, 1);
        there.rgb[1][0] = f32::NAN;
        map(&mut there, srgb_to_linear);
        assert!(there.rgb[0][0] == 0.0 && there.rgb[1][0].is_nan() && (there.rgb[3][0] - 3.0).abs() < 1e-6);
        assert!(there.rgb[2][0] < 1.5, "{there:?}");
    }
}
