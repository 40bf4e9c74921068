//! The numbers of this stage, and where they come from.

/// How photographs are reduced to numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotographParams {
    /// Share of the pixels at exactly the largest value of a channel from which on the photograph counts as clipped there. Chosen, not
    /// measured: a small lamp or highlight may be clipped and is left in below it.
    pub clipped_share: f64,
    /// How much more often than any other value the largest one is there in a clipped channel. Chosen, not measured: a flat surface
    /// without noise repeats its values about equally often.
    pub clipped_repeats: usize,
    /// Pixels this near to a clipped value are clipped as well: demosaicing and resampling have moved them. Chosen, not measured.
    pub nearly_clipped: f32,
    /// Cosine to the light up to which a point is unlit wherever the light may stand: 5.7 degrees behind the terminator, over three
    /// standard deviations of a light's direction ([`super::image::LIGHT_SIGMA_DEG`]).
    pub unlit_cosine: f64,
    /// Unlit pixels that tell the stray light. Chosen, not measured: their median is then known to about a quarter of their scatter.
    pub enough_unlit: usize,
    /// Standard deviation of the stray-light offset of a photograph where nothing shows it, over the mean radiance of the photograph. Chosen,
    /// not measured (`docs/fit.md`, key `veil`).
    pub stray_light: f64,
    /// The same where unlit pixels show it: over the mean radiance, and over what is seen there. Chosen, not measured: light of a room, or
    /// through the cloth, is not the same all over (`docs/fit.md`, step 4).
    pub stray_light_seen: [f64; 2],
    /// Most stray light of a held-out photograph, in these standard deviations over what is expected of it: the rest is an error of the
    /// prediction. Chosen, not measured.
    pub stray_light_reach: f64,
    /// Pixels about the object that are not beside it: its outline is blurred over them. Chosen, not measured.
    pub background_margin: usize,
    /// Degrees by which the light is moved for the derivative of the direction to it. Chosen, not measured: 1e-3 of a radian leaves
    /// second-order terms below 1e-6.
    pub nudge_deg: f64,
    /// Size of a direction bin, in each coordinate of a pair, that is tried first, radians. Chosen, not measured.
    pub finest_step: f64,
    /// Factor to the next size. Chosen, not measured: of four coordinates, so that a step has about 1.15⁴ = 1.7 times fewer bins.
    pub wider_step: f64,
    /// Standard deviation of the second blur, pixels: Zhuo and Sim 2011, section 3.
    pub second_blur: f64,
    /// Share of the edges that are as strong as the ones that count: their weakest sets the scale. Chosen, not measured.
    pub strongest_edges: f64,
    /// Share of that strength down to which edges count: noise has edges everywhere, and they are sharp. Chosen, not measured; the test
    /// of bars holds to 25 % with it.
    pub strong_edge: f64,
    /// Rank of the answer among the strong edges, by sharpness: slopes of threads are softer than steps. Chosen, not measured.
    pub sharpness_rank: f64,
    /// Fewest edges that tell a blur. Chosen, not measured.
    pub least_edges: usize,
    /// Most pixels of the straight view, across or down: the cost of a correlation grows with their square. Chosen, not measured.
    pub straight_pixels: usize,
    /// Least correlation of a picture with itself at a shift by a period. Chosen, not measured; noise stays far below (test).
    pub least_agreement: f64,
    /// Share of the best correlation from which on a smaller shift is the period, and not a multiple of it. Chosen, not measured.
    pub first_agreement: f64,
    /// Correlation that a shift must fall below before one counts as a return. Chosen, not measured.
    pub away: f64,
    /// Most bins along a mean period. Chosen, not measured (`docs/fit.md`, step 5): finer bins have few pixels in a usual close-up.
    pub most_bins: usize,
    /// Fewest bins along a mean period that tell a thread from a gap. Chosen, not measured.
    pub least_bins: usize,
    /// Fewest pixels of a bin, on the average: fewer have no scatter. Chosen, not measured.
    pub least_pixels: f64,
    /// Fewest periods in the picture: one alone has no mean. Chosen, not measured.
    pub least_periods: f64,
    /// Most pixels that the lattice is found from: the rest does not make it better and takes time. Chosen, not measured.
    pub lattice_pixels: usize,
    /// First step of the search for the lattice, in periods at the side of the picture. Chosen, not measured.
    pub widest_lattice_step: f64,
    /// Last step, in the same unit: far below a bin of the mean period. Chosen, not measured.
    pub narrowest_lattice_step: f64,
    /// Farthest that a lattice may move from the one that it began as, in the same unit: farther, it is another one. Chosen, not
    /// measured.
    pub lattice_reach: f64,
    /// Largest difference of the ratio of the two periods from that of the tile. Chosen, not measured: perspective and depth change it by
    /// per cents.
    pub period_ratio: f64,
    /// Standard deviation of what the model says of a bin of the mean period, over the radiance there, or over a part of the brightest one. Chosen, not
    /// measured.
    pub model_sigma: f64,
    /// That part. Chosen, not measured.
    pub dark_share: f64,
    /// Share of the scatter from period to period that the mean period is uncertain by. Chosen, not measured: periods differ for reasons
    /// (edges, highlights that wander) that the mean does not remove.
    pub scatter_sigma: f64,
    /// Most surfaces that are told apart by colour. Chosen, not measured: all orders of them are tried, 24 of 4.
    pub most_clusters: usize,
    /// Least distance of the clusters' chromaticities. Chosen, not measured.
    pub least_distance: f64,
    /// Least share of the pixels that a cluster has: fewer are highlights. Chosen, not measured.
    pub least_share: f64,
    /// Pixels between two clusters, at most, over those around the one that has fewer, as densities along the line between their colours.
    /// Chosen, not measured: one colour with more or less of a highlight must stay one cluster (test), and so must a broad spread of
    /// colours.
    pub valley_depth: f64,
    /// Width of what is counted, over the distance of the two. Chosen, not measured.
    pub valley_window: f64,
    /// Where the valley is looked for, in twentieths of the way between the two colours. Chosen, not measured.
    pub valley_range: [i32; 2],
    /// How far beyond the two colours their peaks are looked for, in the same unit: highlights draw the means together. Chosen, not
    /// measured.
    pub peak_range: [i32; 2],
    /// A choice of surfaces for the clusters is taken when the next best is at least this factor worse. Chosen, not measured.
    pub clear_choice: f64,
    /// Least pixels of a cluster for its tones: the brightest tone has a fortieth of them. Chosen, not measured.
    pub least_tone_pixels: usize,
    /// Most rounds of Lloyd's iteration. Chosen, not measured: it ends by itself before.
    pub cluster_rounds: usize,
    /// Rank of the pixel that "dark" is relative to. Chosen, not measured.
    pub bright_rank: f64,
}

/// The values of this version.
pub const PARAMS: PhotographParams = PhotographParams {
    clipped_share: 2e-3,
    clipped_repeats: 4,
    nearly_clipped: 0.99,
    unlit_cosine: -0.1,
    enough_unlit: 25,
    stray_light: 0.04,
    stray_light_seen: [0.002, 0.4],
    stray_light_reach: 1.0,
    background_margin: 3,
    nudge_deg: 0.05,
    finest_step: 0.012,
    wider_step: 1.15,
    second_blur: 1.0,
    strongest_edges: 0.02,
    strong_edge: 0.5,
    sharpness_rank: 0.55,
    least_edges: 50,
    straight_pixels: 512,
    least_agreement: 0.3,
    first_agreement: 0.85,
    away: 0.9,
    most_bins: 24,
    least_bins: 6,
    least_pixels: 3.0,
    least_periods: 1.5,
    lattice_pixels: 30_000,
    widest_lattice_step: 0.08,
    narrowest_lattice_step: 0.002,
    lattice_reach: 0.25,
    period_ratio: 0.08,
    model_sigma: 0.01,
    dark_share: 0.3,
    scatter_sigma: 0.25,
    most_clusters: 4,
    least_distance: 0.03,
    least_share: 0.03,
    valley_depth: 0.6,
    valley_window: 0.2,
    valley_range: [7, 13],
    peak_range: [-10, 30],
    clear_choice: 1.3,
    least_tone_pixels: 200,
    cluster_rounds: 30,
    bright_rank: 0.9,
};
