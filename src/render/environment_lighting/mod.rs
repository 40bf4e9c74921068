//! Lighting by an environment as a whole, in real time: what each viewer sees is looked up, and no light is sampled.
//!
//! ```text
//! environment ─> prefilter ──────────────┬────────────────────────┐
//! material ───> material (half_vectors, response) ─┬─> light_field ─> lit ─> picture
//! large scale ─> sites ────────────────────────────┘            raster ─┘
//! ```
//!
//! The light that a place sends out depends on the camera by the direction to the viewer only, as long as scene and environment stand still. So the
//! part of a material that is not sharp is summed once: at each site of the large scale (`sites`), for each viewer of a grid, over all texels of its hemisphere
//! with the light that comes through there (`light_field`): the triple product of environment, visibility and effective BRDF, without any approximation by lobes. What
//! is too sharp for such grids are lobes of half vectors (`half_vectors`), which look up the environment prefiltered to their width (`prefilter`), as Iwasaki et al.
//! 2012, section 5, do with all of it; the viewer turns them about exactly. How a material splits is measured (`material`), and both parts together reflect the energy
//! that its effective BRDF does (`response`).
//!
//! | file | in -> out |
//! |---|---|
//! | `octahedron` | directions as places in a square |
//! | `prefilter` | environment -> its mean under lobes of any sharpness |
//! | `half_vectors` | surface -> its sharp lobes of half vectors |
//! | `response` | effective values -> numbers that sum incident light to radiance |
//! | `material` | material, environment -> the coarsest response that keeps the tolerance |
//! | `sites` | large scale -> places at which light is kept |
//! | `light_field` | sites, responses, prefiltered environment -> what leaves each site |
//! | `raster` | large scale, camera -> what each pixel sees first |
//! | `lit` | all of it -> pictures |
//! | `report` | how they were made, and their error |

mod half_vectors;
mod light_field;
mod lit;
mod material;
mod octahedron;
mod prefilter;
mod raster;
mod report;
mod response;
mod sites;
#[cfg(test)]
mod tests;

pub use lit::{EnvironmentLit, LEAST_TOLERANCE};
pub use report::{EnvironmentReport, PictureError, ResponseReport};
