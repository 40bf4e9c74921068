//! Radiance as a linear function of the colours: `L = sum_k b_k c_k` over the slots `k` of a material, where `b_k` is the radiance that slot
//! `k` sends when its colour is 1 (its basis reflectance times the irradiance) and `c_k` its colour, solved for or given.

use crate::fit_file::spec::Colour;
use crate::residuals::unknowns::{Shot, Unknown, UnknownKind, colour_of, stray_light};
use biscale::filter::Slot;
use biscale::material::SmallScale;

/// The colours of one state of a material: which of them are solved for, and what the others are.
#[derive(Clone, Copy, Debug)]
pub struct ColourBasis<'a> {
    /// Colours of the fit file.
    pub colours: &'a [Colour],
    /// All linear unknowns.
    pub unknowns: &'a [Unknown],
    /// All colours that light is proportional to.
    pub slots: &'a [Slot],
    /// The surface, with the colours of the start material.
    pub small: &'a SmallScale,
}

impl ColourBasis<'_> {
    /// Coefficients of the unknowns in light whose part of each slot is `basis`, in a channel; and the part of colours that are given.
    pub fn terms(&self, basis: impl Fn(usize) -> f64, channel: usize) -> (Vec<(usize, f64)>, f64) {
        let (mut terms, mut known) = (Vec::new(), 0.0);
        for (place, slot) in self.slots.iter().enumerate() {
            let basis = basis(place);
            match self.unknown(*slot, channel) {
                Some(k) => terms.push((k, basis)),
                None => known += basis * colour_of(self.small, *slot)[channel],
            }
        }
        (terms, known)
    }

    /// The unknown that a slot's colour is in a channel.
    fn unknown(&self, slot: Slot, channel: usize) -> Option<usize> {
        self.unknowns.iter().position(|u| match u.kind {
            UnknownKind::Colour(k, c) => self.colours[k].slot == slot && c.is_none_or(|c| c == channel),
            UnknownKind::StrayLight(..) | UnknownKind::Exposure => false,
        })
    }

    /// The unknown of a kind that is no colour.
    pub fn position(&self, kind: UnknownKind) -> Option<usize> {
        self.unknowns.iter().position(|u| u.kind == kind)
    }

    /// By slot the colour times the irradiance, with the colours of `guess` where these are solved for.
    pub fn radiance(&self, irradiance: [f64; 3], guess: Option<&[f64]>) -> Vec<[f64; 3]> {
        let of = |slot: &Slot| {
            let colour = |c: usize| match (self.unknown(*slot, c), guess) {
                (Some(k), Some(guess)) => guess[k],
                _ => colour_of(self.small, *slot)[c],
            };
            std::array::from_fn(|c| irradiance[c] * colour(c))
        };
        self.slots.iter().map(of).collect()
    }

    /// The stray-light offset of a photograph.
    pub fn stray_light(&self, shot: Shot, linear: &[f64]) -> [f64; 3] {
        stray_light(self.unknowns, linear, shot)
    }

    /// The irradiance that the fit file gives of the close-up over the true one.
    pub fn exposure(&self, linear: &[f64]) -> f64 {
        self.position(UnknownKind::Exposure).map_or(1.0, |k| linear[k])
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::residuals::unknowns::slots;
    use biscale::filter::SlotColour;
    use biscale::material::{MaterialValues, NumberKey};
    use biscale::toml_reader::Source;

    /// V grooves: the left side's albedo is given, the right side's is solved for by channel.
    pub struct Grooves {
        pub small: SmallScale,
        pub colours: Vec<Colour>,
        pub unknowns: Vec<Unknown>,
        pub slots: Vec<Slot>,
    }

    impl Grooves {
        pub fn new() -> Self {
            let text = "format = 1\n[geometry]\nkind = \"grooves\"\nprofile = \"v\"\ndepth = 0.3\n[[surface]]\npart = \"left\"\n\
                        brdf = { model = \"lambert\", albedo = [0.6, 0.3, 0.1] }\n[[surface]]\npart = \"right\"\n\
                        brdf = { model = \"lambert\", albedo = [0.1, 0.2, 0.5] }\n";
            let source = Source { path: "m.toml".into(), text: text.to_owned() };
            let small = MaterialValues::parse(&source).unwrap().material().unwrap().build().unwrap();
            let slots = slots(&small.surfaces);
            let colour = Colour {
                key: "surface.right.brdf.albedo".to_owned(),
                number: NumberKey::Brdf { surface: 1, key: "albedo" },
                slot: Slot { surface: 1, colour: SlotColour::Diffuse },
                grey: false,
                bounds: [0.0, 1.0],
            };
            let unknown = |c| Unknown { name: format!("right {c}"), kind: UnknownKind::Colour(0, Some(c)), bounds: [0.0, 1.0] };
            Self { small, colours: vec![colour], unknowns: (0..3).map(unknown).collect(), slots }
        }

        pub fn basis(&self) -> ColourBasis<'_> {
            ColourBasis { colours: &self.colours, unknowns: &self.unknowns, slots: &self.slots, small: &self.small }
        }
    }

    #[test]
    fn a_colour_is_a_term_where_it_is_solved_for_and_known_where_it_is_given() {
        let grooves = Grooves::new();
        let (terms, known) = grooves.basis().terms(|slot| [2.0, 5.0][slot], 1);
        assert_eq!(terms, [(1, 5.0)]);
        assert!((known - 2.0 * 0.3).abs() < 1e-15);
        let radiance = grooves.basis().radiance([1.0, 2.0, 3.0], Some(&[0.9, 0.8, 0.7]));
        assert_eq!(radiance, [[0.6, 0.6, 0.1 * 3.0], [0.9, 1.6, 0.7 * 3.0]]);
    }
}
