//! A photograph becomes numbers: linear radiance with camera, light and shape; from afar a table over direction bins, from near a mean period
//! and colour clusters.

pub mod blur;
pub mod close_up;
pub mod dark;
pub mod direction_bins;
pub mod image;
pub mod mean_period;
pub mod params;
pub mod period;
pub mod sight;
