//! Between near and far: bidirectional texture functions (BTF).
//!
//! From afar a surface is its effective BRDF, from near its geometry. Between them it is a texture that depends on light and viewer: `B(x; wi, wo)`, 1/sr, the radiance
//! that leaves towards `wo`, seen through the point `x` of a reference plane, when a distant light of irradiance 1 on a plane that faces it stands at `wi`.
//! Foreshortening at the surface is in it: a flat Lambert plane has `albedo/pi cos(theta_i)`, as in Bosserhoff and Nicoll (001) and in Müller, Meseth and Klein
//! (002). Its mean over a period is `S / cos(theta_o)`, so that the look from afar follows from it: `docs/btf.md`.
//!
//! | file | in -> out |
//! |---|---|
//! | `directions` | the name of a set, or a list -> directions of lights or views |
//! | `reference_plane` | a place of the surface and a view -> the texel that shows it |
//! | `cover` | rays through the texels of a view -> how much of each shows the surface |
//! | `seen` | facets that a view shows -> the sums of their light, texel by texel |
//! | `file` | a file that is written and read view by view |
//! | `render` | tile, texels, directions, tolerance -> images with standard errors |
//! | `local_pca` | images -> clusters of vectors, each a mean and principal components |
//! | `ptm`, `ptm_file` | images of one view -> polynomials of the light's direction; PTM 1.2 files |

mod cover;
mod directions;
mod file;
mod local_pca;
mod ptm;
mod ptm_file;
mod reference_plane;
mod render;
mod seen;

pub use directions::DirectionSet;
pub use file::{BtfAbout, BtfFile, BtfWriter};
pub use local_pca::{Arrangement, LocalPca, LocalPcaSettings, LocalPcaSize, MOST_CLUSTERS, MOST_COMPONENTS, Precision, Vectors};
pub use ptm::{LightFit, Ptm, PtmColours, TERMS};
pub use reference_plane::{PlaneHeight, ReferencePlane};
pub use render::{BtfQuestion, BtfSummary, ImageMean, ViewImages, ViewLights, render};
