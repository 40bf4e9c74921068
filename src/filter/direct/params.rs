//! The numbers that the direct method chooses by.

/// What the direct method chooses by: how many samples it starts with, when it tries a part of a list first, what it lets clusters cost.
pub(super) struct DirectParams {
    /// Fewest samples without a budget: the spread of eight replicates of fewer says little. Chosen, not measured; `cargo bench --bench accuracy` tells how
    /// far estimates are off that start here.
    pub min_samples: u32,
    /// Fewest samples with a budget, or where they are known to be enough. Chosen, not measured: 32 a replicate.
    pub min_budget_samples: u32,
    /// Most samples to start with, however many triangles there are. Chosen, not measured.
    pub most_first: u32,
    /// Samples after which, if many more are needed, they go where a pilot run of as many finds them worth most; or the first samples, if those are
    /// more. Chosen, not measured: fewer make the pilot's noise look like importance, more cost what they should save.
    pub pilot_samples: u32,
    /// Samples go where the pilot run finds them worth most if that makes the variance so many times smaller: else it costs a round for nothing, as on
    /// a height field that is seen from everywhere. Chosen, not measured.
    pub least_gain: f64,
    /// Weighted samples are worth about so many others: from two to four, so a weighted block is begun with a quarter of the samples.
    /// Chosen, not measured.
    pub samples_per_weighted: u32,
    /// Stretches of the surface that the pilot run tells apart: eight of its samples each.
    pub stretches: usize,

    /// Longer lists of distinct pairs choose the number of samples on a part, and each round on the whole is a new one: their sums are not kept
    /// (192 bytes a pair). Chosen, not measured.
    pub long_list: usize,
    /// Lists of more distinct pairs begin with clusters of unequal normals. On shorter ones equal normals, or facets one by one, are as fast, more exact,
    /// and may go where they are worth most (`biscale study`, tables of 272 and 600 directions).
    pub wide_clusters: usize,
    /// Most bytes of visibility bits that a long list keeps. Chosen, not measured.
    pub max_bit_bytes: usize,

    /// Lists from so many distinct pairs on find their samples on a part (`biscale study`).
    pub part_pairs: usize,
    /// Lists from so many directions on do, too. Directions cost: a table of so many has four times those of its part, and a list that repeats none
    /// of its directions at least as many times those of the smallest part (`biscale study`).
    pub part_directions: usize,
    /// A part has one in so many of the pairs of its list: what costs less than rounds on the whole list, and still tells its error
    /// (`biscale study`; it was one in 16 before).
    pub part_one_in: usize,
    /// Share of the progress that rounds on a part make: some rounds of one in 24 pairs. Chosen, not measured.
    pub part_progress: f64,
    /// Fewest pairs of a part. Chosen, not measured.
    pub part_least: usize,
    /// Most pairs of a part. Chosen, not measured.
    pub part_most: usize,

    /// Most clusters: of a surface that needs more, each facet is summed by itself. Each cluster fills up words of 64 facets, so that 64 clusters may
    /// add up to 4,096 facets that stand for nothing. Chosen, not measured.
    pub most_clusters: usize,
    /// The same for long lists, which take more samples (`cargo bench --bench paper_matrix`). Chosen, not measured.
    pub most_clusters_long: usize,
    /// About so many pairs of a list tell the bias of clusters: eight times the 256 that `docs/numerics.md` asks for, since few grazing viewers make most
    /// of it.
    pub bias_pairs: usize,
    /// Share of a tolerance that this bias may take: more leaves too little for that of the samples. Chosen, not measured.
    pub bias_share: f64,

    /// Share of a budget that may be planned for: clocks and predictions are rough (`cargo bench --bench budget`: runs end within 1.2 budgets).
    pub planned: f64,
    /// Share of what may be planned for that finding the samples on a part of a list may take. Chosen, not measured.
    pub part_budget: f64,
    /// Times a budget up to which a run counts as within it: the limit of `cargo bench --bench budget`.
    pub overdrawn: f64,

    /// Samples up to which under-sampled directions are searched: the error of what no sample shows is in no estimate (`cargo test --test extremes`: at
    /// 89.99 degrees 2,048 samples of a groove show nothing).
    pub most_search: u32,
    /// The same as samples times pairs: about a second.
    pub most_search_sums: usize,
}

/// The numbers that are used.
pub(super) const PARAMS: DirectParams = DirectParams {
    min_samples: 2048,
    min_budget_samples: 256,
    most_first: 1 << 14,
    pilot_samples: 8192,
    least_gain: 1.5,
    samples_per_weighted: 4,
    stretches: 1024,
    long_list: 1 << 15,
    wide_clusters: 1 << 18,
    max_bit_bytes: 256 << 20,
    part_pairs: 1024,
    part_directions: 512,
    part_one_in: 24,
    part_progress: 0.15,
    part_least: 64,
    part_most: 1 << 13,
    most_clusters: 64,
    most_clusters_long: 2048,
    bias_pairs: 2048,
    bias_share: 0.4,
    planned: 0.85,
    part_budget: 0.25,
    overdrawn: 1.2,
    most_search: 1 << 18,
    most_search_sums: 1 << 30,
};
