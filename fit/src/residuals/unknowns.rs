//! What a fit looks for: the numbers that the search moves, and the colours and stray-light offsets that are solved for.

use crate::fit_file::spec::Spec;
use crate::photograph::close_up::CloseUp;
use crate::photograph::image::Role;
use biscale::brdf::Brdf;
use biscale::filter::{Slot, SlotColour};
use biscale::material::{SmallScale, Surface, Tint};

/// Bounds of a light's angles, in standard deviations: 12 degrees at [`crate::photograph::image::LIGHT_SIGMA_DEG`], so that a light that a
/// person noted wrongly by 10 degrees is found and told, not fitted around.
pub const LIGHT_REACH: f64 = 8.0;

/// Mean and standard deviation of the logarithm of how much more a close-up is blurred than its edges tell, the extent of a pixel included. Edges of fine
/// threads lie so near each other that they look sharper than they are: of 56 made close-ups the mean is .06 of grooves, .16 of plain weaves, .27
/// of twills and rods, and .17 of all, with a scatter of .15 (`COUNT=100 cargo test -p biscale-fit --test scenes blur_of -- --nocapture`). The standard
/// deviation is wider, since lenses blur otherwise than by the normal distribution of these.
pub const BLUR_PRIOR: [f64; 2] = [0.165, 0.25];

/// Bounds of that logarithm, in standard deviations about the mean. Chosen, not measured.
const BLUR_REACH: f64 = 3.0;

/// A photograph that is fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shot {
    /// A distant one, by its place among these.
    Distant(usize),
    /// The close-up.
    CloseUp,
}

impl Shot {
    /// Its name, for people.
    fn name(self) -> String {
        match self {
            Self::Distant(k) => (k + 1).to_string(),
            Self::CloseUp => "close-up".to_owned(),
        }
    }
}

/// What the search moves, one unknown in 0..1 each.
#[derive(Clone, Debug, PartialEq)]
pub enum Variable {
    /// A parameter of the fit file, by its place there.
    Parameter(usize),
    /// The light of a photograph: azimuth (0) or elevation (1), degrees.
    Light {
        /// Which photograph.
        shot: Shot,
        /// Which angle.
        axis: usize,
        /// Standard deviation, degrees; the bounds are [`LIGHT_REACH`] of them.
        sigma: f64,
    },
    /// The blur of the close-up over what its edges tell, [`BLUR_PRIOR`].
    Blur,
    /// A linear unknown, in the mode that moves all together.
    Linear(usize),
}

/// A linear unknown.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Its name, for people: `surface.warp.brdf.diffuse red`.
    pub name: String,
    /// What it is.
    pub kind: UnknownKind,
    /// Bounds.
    pub bounds: [f64; 2],
}

/// What a linear unknown is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UnknownKind {
    /// A colour of the fit file, by its place there; in one channel, or in all.
    Colour(usize, Option<usize>),
    /// The stray-light offset of a photograph in a channel; of the close-up times [`Self::Exposure`].
    StrayLight(Shot, usize),
    /// The irradiance that the fit file gives of the close-up over the true one.
    Exposure,
}

/// The unknowns of a fit, in the order of the file: colours by channel, then stray-light offsets of the `distant` photographs and of the
/// close-up if its radiance is compared, then the exposure of that, within `exposure`.
pub fn unknowns(spec: &Spec, distant: usize, exposure: Option<[f64; 2]>) -> Vec<Unknown> {
    const CHANNELS: [&str; 3] = ["red", "green", "blue"];
    let mut unknowns = Vec::new();
    for (k, colour) in spec.colours.iter().enumerate() {
        if colour.grey {
            unknowns.push(Unknown { name: colour.key.clone(), kind: UnknownKind::Colour(k, None), bounds: colour.bounds });
        } else {
            unknowns.extend((0..3).map(|c| Unknown {
                name: format!("{} {}", colour.key, CHANNELS[c]),
                kind: UnknownKind::Colour(k, Some(c)),
                bounds: colour.bounds,
            }));
        }
    }
    if spec.stray_light {
        for shot in (0..distant).map(Shot::Distant).chain(exposure.map(|_| Shot::CloseUp)) {
            unknowns.extend((0..3).map(|c| Unknown {
                name: format!("veil {} {}", shot.name(), CHANNELS[c]),
                kind: UnknownKind::StrayLight(shot, c),
                bounds: [0.0, 1e9],
            }));
        }
    }
    if let Some(bounds) = exposure {
        unknowns.push(Unknown { name: "exposure of the close-up".to_owned(), kind: UnknownKind::Exposure, bounds });
    }
    unknowns
}

/// What the search moves: free parameters, then the lights of the distant photographs, then that of the close-up, then the blur of that, if its
/// mean period is compared and its edges tell one.
pub fn variables(spec: &Spec, close_up: Option<&CloseUp>) -> Vec<Variable> {
    let parameters = spec.parameters.iter().enumerate().filter(|(_, p)| p.is_free()).map(|(k, _)| Variable::Parameter(k));
    let distant = spec.of_role(Role::Distant).enumerate().map(|(k, photograph)| (Shot::Distant(k), photograph));
    let near = spec.of_role(Role::CloseUp).map(|photograph| (Shot::CloseUp, photograph));
    let lights = distant.chain(near).flat_map(|(shot, photograph)| {
        let sigma = photograph.light_sigma_deg;
        (0..2).filter(move |_| sigma > 0.0).map(move |axis| Variable::Light { shot, axis, sigma })
    });
    let blurred = close_up.is_some_and(|found| found.mean_period.is_some() && found.blur.is_some());
    parameters.chain(lights).chain(blurred.then_some(Variable::Blur)).collect()
}

impl Variable {
    /// Its value at a place between its bounds.
    pub fn at(&self, spec: &Spec, unknowns: &[Unknown], unit: f64) -> f64 {
        match self {
            Self::Parameter(k) => spec.parameters[*k].at(unit),
            Self::Light { sigma, .. } => LIGHT_REACH * sigma * (2.0 * unit - 1.0),
            Self::Blur => (BLUR_PRIOR[0] + BLUR_REACH * BLUR_PRIOR[1] * (2.0 * unit - 1.0)).exp(),
            Self::Linear(k) => unknowns[*k].bounds[0] + unit * (unknowns[*k].bounds[1].min(1.0) - unknowns[*k].bounds[0]),
        }
    }

    /// Its name, for people.
    pub fn name(&self, spec: &Spec, unknowns: &[Unknown]) -> String {
        match self {
            Self::Parameter(k) => spec.parameters[*k].key.clone(),
            Self::Light { shot, axis, .. } => format!("light {} {}", shot.name(), ["azimuth_deg", "elevation_deg"][*axis]),
            Self::Blur => "blur of the close-up".to_owned(),
            Self::Linear(k) => unknowns[*k].name.clone(),
        }
    }

    /// Width of its bounds.
    pub fn range(&self, spec: &Spec, unknowns: &[Unknown]) -> f64 {
        self.at(spec, unknowns, 1.0) - self.at(spec, unknowns, 0.0)
    }
}

/// All colours that light is proportional to.
pub fn slots(surfaces: &[Surface]) -> Vec<Slot> {
    let of = |(surface, s): (usize, &Surface)| Slot::of(&s.brdf).iter().map(move |&colour| Slot { surface, colour }).collect::<Vec<_>>();
    surfaces.iter().enumerate().flat_map(of).collect()
}

/// The colour of a slot as the material has it.
pub fn colour_of(small: &SmallScale, slot: Slot) -> [f64; 3] {
    let surface = &small.surfaces[slot.surface];
    match (&surface.brdf, slot.colour) {
        (Brdf::Lambert { albedo }, _) => *albedo,
        (Brdf::BlinnPhong { diffuse, .. } | Brdf::CookTorrance { diffuse, .. } | Brdf::Ward { diffuse, .. }, SlotColour::Diffuse) => {
            *diffuse
        }
        (Brdf::BlinnPhong { specular, .. } | Brdf::CookTorrance { specular, .. } | Brdf::Ward { specular, .. }, _) => *specular,
        (Brdf::Measured(_), _) => match surface.tint {
            Tint::Uniform(tint) => tint,
            Tint::Image(_) => [1.0; 3],
        },
    }
}

/// The stray-light offset of a photograph, where the linear unknowns are these.
pub fn stray_light(unknowns: &[Unknown], linear: &[f64], shot: Shot) -> [f64; 3] {
    let of = |c: usize| unknowns.iter().position(|u| u.kind == UnknownKind::StrayLight(shot, c)).map_or(0.0, |k| linear[k]);
    std::array::from_fn(of)
}
