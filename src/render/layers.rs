//! What covers an object: materials that lie over each other by masks, with tints and a normal map.
//!
//! At each place of an object its materials have weights that sum to 1: the share of a small area around it that each of them covers.
//! The place sends out the weighted sum of what its materials send out, in linear radiance, and hides what lies behind by the weighted
//! sum of their opacities. So it is the mean of a surface cut into these shares, which a mask filtered to the size of a sample stands for.
//!
//! A material of weight 0 is no part of the place, and nothing is computed for it there.

use super::mapping::{ImagePlace, Projection};
use super::normal_map::NormalMap;
use super::scene::Shape;
use super::texture::Texture;

/// What is left of a place's weights for the materials below counts as none under this: pixels are single precision, and the weights of
/// an interpolation sum to 1 up to rounding.
const ROUNDING: f64 = 1e-6;

/// What covers an object beside the materials of its parts.
#[derive(Clone, Debug, Default)]
pub struct Covering {
    /// Of the materials of the parts.
    pub tint: Tint,
    /// From the lowest to the uppermost.
    pub layers: Vec<Layer>,
    /// How their masks make weights.
    pub blend: Blend,
    /// What turns the normals of the object.
    pub normal_map: Option<NormalMap>,
}

/// How the masks of layers make weights; the material of the part has what they leave.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blend {
    /// A layer hides those below it by its mask: `w_k = m_k Π_{j > k} (1 - m_j)`.
    #[default]
    Over,
    /// A layer's weight is its mask, and the masks sum to at most 1 everywhere.
    Sum,
}

/// A material where a mask is.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Place of the material in the scene.
    pub material: usize,
    /// Where it is.
    pub mask: Mask,
    /// Its colour.
    pub tint: Tint,
    /// Turn of its tile about the normal, counter-clockwise seen from outside, radians.
    pub turn: f64,
}

/// A share in 0..=1 at each place of an object.
#[derive(Clone, Debug)]
pub struct Mask {
    /// The share.
    pub image: Texture<1>,
    /// Where the image lies.
    pub projection: Projection,
    /// Whether 1 minus the share counts.
    pub invert: bool,
}

/// What the radiance of a material is multiplied by: the product of all that is there, each in 0..=1.
#[derive(Clone, Debug)]
pub struct Tint {
    /// Everywhere.
    pub colour: [f64; 3],
    /// By texture coordinates.
    pub image: Option<Texture<3>>,
    /// Whether the colours of a mesh's vertices count.
    pub vertex_colours: bool,
}

impl Default for Tint {
    fn default() -> Self {
        Self { colour: [1.0; 3], image: None, vertex_colours: false }
    }
}

/// A material's share of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cover {
    /// Place of the material in the scene.
    pub material: usize,
    /// Its share, over 0; those of a place sum to 1 (within 1e-6).
    pub weight: f64,
    /// What its radiance is multiplied by.
    pub tint: [f64; 3],
    /// Turn of its tile about the normal, counter-clockwise seen from outside, radians.
    pub turn: f64,
}

impl Mask {
    /// The share at a place.
    fn share(&self, place: &ImagePlace<'_>) -> f64 {
        let chart = self.projection.chart(place);
        let [share] = chart.map_or([0.0], |chart| self.image.mean(chart.uv, chart.footprint(place.footprint)));
        // Weights of an interpolation sum to 1 up to rounding only.
        let share = share.clamp(0.0, 1.0);
        if self.invert { 1.0 - share } else { share }
    }
}

impl Tint {
    /// The colour at a place.
    fn at(&self, place: &ImagePlace<'_>) -> [f64; 3] {
        let mut colour = self.colour;
        let mut times = |other: [f64; 3]| (0..3).for_each(|c| colour[c] *= other[c]);
        if let Some(image) = &self.image
            && let Some(chart) = place.shape.chart(place.hit, place.position)
        {
            times(image.mean(chart.uv, chart.footprint(place.footprint)));
        }
        if self.vertex_colours
            && let Shape::Mesh(mesh) = place.shape
            && let Some(colour) = mesh.colour(place.hit)
        {
            times(colour.to_array());
        }
        colour
    }
}

impl Covering {
    /// Whether the materials of the parts are all that covers the object, as they are.
    pub fn is_plain(&self) -> bool {
        let Tint { colour, image, vertex_colours } = &self.tint;
        self.layers.is_empty() && *colour == [1.0; 3] && image.is_none() && !vertex_colours
    }

    /// Appends the materials at a place, the uppermost first; `base` is that of the part, with the turn of its tile.
    pub fn covers(&self, place: &ImagePlace<'_>, base: (usize, f64), covers: &mut Vec<Cover>) {
        let mut left = 1.0;
        for layer in self.layers.iter().rev() {
            if left < ROUNDING {
                return;
            }
            let share = layer.mask.share(place);
            let weight = match self.blend {
                Blend::Over => left * share,
                // Masks of a sum were checked pixel by pixel: what is over 1 is rounding, and the lowest layer goes without it.
                Blend::Sum => share.min(left),
            };
            if weight > 0.0 {
                covers.push(Cover { material: layer.material, weight, tint: layer.tint.at(place), turn: layer.turn });
                left -= weight;
            }
        }
        if left >= ROUNDING {
            let (material, turn) = base;
            covers.push(Cover { material, weight: left, tint: self.tint.at(place), turn });
        }
    }

    /// Places of the materials of the layers.
    pub fn materials(&self) -> impl Iterator<Item = usize> {
        self.layers.iter().map(|layer| layer.material)
    }
}
