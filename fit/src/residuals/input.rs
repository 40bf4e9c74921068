//! What a model of the photographs is made of.

use crate::fit_file::assignment::{Assignment, assign};
use crate::fit_file::spec::Spec;
use crate::fit_file::variant::Variant;
use crate::photograph::close_up::CloseUp;
use crate::photograph::direction_bins::DirectionBins;
use crate::residuals::near_interreflection::InterreflectionView;
use biscale::error::Result;
use biscale::material::MaterialValues;

/// How fine a model is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Samples of the small-scale surface.
    pub samples: u32,
    /// Most direction bins of all distant photographs.
    pub bins: usize,
}

/// Light that was reflected more than once, as it was found for one state of the material: kept while the search moves.
#[derive(Clone, Debug, Default)]
pub struct Interreflection {
    /// For each distant photograph and direction bin its radiance over irradiance.
    pub bins: Vec<Vec<[f64; 3]>>,
    /// In the close-up, all colour clusters together; nothing where it is compared texel by texel.
    pub close_up: [f64; 3],
    /// For each colour cluster of the close-up its share of that.
    pub clusters: Vec<[f64; 3]>,
    /// In the close-up texel by texel of a period, as each of its viewers sees it, if that is how it is compared.
    pub near: Vec<InterreflectionView>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Photographs as tables, and the question that they are to answer.
#[derive(Clone, Copy)]
pub struct ModelInput<'a> {
    /// The question.
    pub spec: &'a Spec,
    /// Direction bins of the distant photographs.
    pub photographs: &'a [DirectionBins],
    /// What the close-up says.
    pub close_up: Option<&'a CloseUp>,
    /// Which surface each colour cluster of the close-up is, and what else is no number that moves.
    pub variant: &'a Variant,
    /// What is added to direct light.
    pub interreflection: Option<&'a Interreflection>,
    /// Whether the surface has no gaps.
    pub opaque: bool,
}

/// The samples of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampling {
    /// How many samples of the small-scale surface.
    pub samples: u32,
    /// Another seed gives other ones.
    pub seed: u32,
}

impl ModelInput<'_> {
    /// The start material of a variant with the parameters at `values`.
    ///
    /// # Errors
    /// Bad input for a value out of range.
    pub fn material_values(&self, values: &[f64]) -> Result<MaterialValues> {
        material_values(self.spec, &assignments(self.spec, self.variant, values))
    }
}

/// What a variant and the values of all parameters set in the start material.
pub fn assignments(spec: &Spec, variant: &Variant, values: &[f64]) -> Vec<Assignment> {
    variant.assignment().into_iter().chain(spec.parameters.iter().zip(values).flat_map(|(p, &value)| p.assignments(value))).collect()
}

/// The start material with these values.
///
/// # Errors
/// Bad input for a value out of range.
pub fn material_values(spec: &Spec, assignments: &[Assignment]) -> Result<MaterialValues> {
    let mut values = spec.values.clone();
    assign(&mut values, assignments)?;
    Ok(values)
}
