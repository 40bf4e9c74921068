//! The numbers that the residuals are made with, and where they come from.

/// Standard deviations, weights and limits of the residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualParams {
    /// Residuals beyond this many standard deviations count linearly (Huber 1964, "Robust estimation of a location parameter"). Chosen, not
    /// measured: 1.345 is the textbook's 95 % efficiency; 2.5 leaves all but 1.2 % of Gaussian residuals as least squares have them.
    pub huber: f64,
    /// Most rounds of iterative reweighting, and the relative change of the objective that ends them. Chosen, not measured: far below the
    /// tolerances of the search, which are 2e-3 at the finest.
    pub huber_rounds: usize,
    /// See [`Self::huber_rounds`].
    pub huber_settled: f64,
    /// How often the model's mean period is registered with that of the close-up anew, with the colours that were found. Chosen, not measured.
    pub registrations: usize,
    /// Relative standard deviation of the light of a colour cluster: in direct light, and with interreflections. Chosen, not measured.
    pub cluster_light: [f64; 2],
    /// The same of its tones. Chosen, not measured.
    pub cluster_tone: [f64; 2],
    /// What a tone counts: neighbouring tones tell nearly the same. Chosen, not measured.
    pub tone_weight: f64,
    /// Standard deviation of the cover of a colour cluster. Chosen, not measured.
    pub cover: f64,
    /// Least cover that the interreflection of a cluster is divided by, for the radiance where it is. Guards a division; clusters of fewer than
    /// 3 % of the pixels are none.
    pub least_cover: f64,
    /// Share of the brightest channel that a channel's standard deviation is relative to at least: one that is nearly dark is not known to a
    /// share of itself. Chosen, not measured.
    pub dark_channel: f64,
    /// How many residuals all places of the mean period count for together: model errors of neighbours, and of three channels, are alike.
    /// Chosen, not measured.
    pub mean_period_weight: f64,
    /// Standard deviation of the interreflection at a place of the period over all of its light, where it was traced for a state of the
    /// material nearby, and where it was not traced yet. Chosen, not measured.
    pub traced: f64,
    /// See [`Self::traced`].
    pub untraced: f64,
    /// Rays along a period of the view that tells how high its edges lie. Chosen, not measured: a first guess, which is settled later.
    pub edge_rays: usize,
    /// Equal steps of height that are tried first, over all that is seen, and how often the step is halved: to a 192nd of the height in all.
    /// Chosen, not measured.
    pub heights: usize,
    /// See [`Self::heights`].
    pub height_halvings: usize,
    /// Sides of a thread's section from which on it counts as round from near. Chosen, not measured.
    pub round_sides: u32,
    /// Places of the mean period that are one in the coarse search for the shift. Chosen, not measured: a fourth of the shifts, and the
    /// refinement reaches a place far.
    pub coarse_places: usize,
    /// Shifts that may be the best one, at most: a weave shifted by half a period looks much like itself.
    pub shift_peaks: usize,
    /// Share of the best likeness that another shift must have. Chosen, not measured.
    pub shift_peak: f64,
    /// Brightness that colours are divided by beside their own, over the mean one: highlights and shades take part of the contrast
    /// otherwise. Chosen, not measured.
    pub flattening: f64,
    /// Most Gauss-Newton steps to the best shift. Chosen, not measured.
    pub shift_steps: usize,
    /// Longest step, in places: beyond it the residuals are not linear.
    pub longest_shift: f64,
    /// A step that ends the search, in places. Chosen, not measured; the tests find shifts to a thousandth of a period.
    pub settled_shift: f64,
    /// Most rounds of Lloyd's iteration over the model's pixels, which begin near the answer. Chosen, not measured.
    pub view_cluster_rounds: usize,
    /// Places along a period at which corners of triangles count as one, for their mean normal: far finer than triangles, far coarser
    /// than rounding.
    pub corner_grid: f64,
    /// Standard deviation, in pixels of the view, of a blur that is not worth the work. Chosen, not measured: neighbours get less than
    /// 1e-5 of a pixel.
    pub sharp: f64,
    /// Half the distance of the central differences, over the range of an unknown. Chosen, not measured (`docs/fit.md`, step 10):
    /// visibility bits spoil smaller steps.
    pub difference_step: f64,
    /// The same of a colour where it moves what the close-up's pixels are clustered by, over the colour. Chosen, not measured
    /// (`docs/fit.md`, step 10).
    pub colour_step: f64,
    /// The least of it. Chosen, not measured.
    pub least_colour_step: f64,
    /// Tolerance of the traced interreflections: half of [`Self::traced`], which they are uncertain by.
    pub interreflection_tolerance: f64,
    /// Direction bins whose directions are this near share what is traced, radians: it changes slowly with directions. Chosen, not
    /// measured.
    pub interreflection_step: f64,
}

/// The values of this version.
pub const PARAMS: ResidualParams = ResidualParams {
    huber: 2.5,
    huber_rounds: 12,
    huber_settled: 1e-7,
    registrations: 2,
    cluster_light: [0.015, 0.025],
    cluster_tone: [0.025, 0.035],
    tone_weight: 0.5,
    cover: 0.015,
    least_cover: 0.05,
    dark_channel: 0.3,
    mean_period_weight: 160.0,
    traced: 0.02,
    untraced: 0.1,
    edge_rays: 32,
    heights: 6,
    height_halvings: 5,
    round_sides: 24,
    coarse_places: 2,
    shift_peaks: 2,
    shift_peak: 0.3,
    flattening: 0.2,
    shift_steps: 4,
    longest_shift: 1.0,
    settled_shift: 1e-3,
    view_cluster_rounds: 8,
    corner_grid: 1e6,
    sharp: 0.2,
    difference_step: 0.03,
    colour_step: 0.15,
    least_colour_step: 0.02,
    interreflection_tolerance: 0.01,
    interreflection_step: 0.12,
};
