//! What one pixel of a photograph sees of its object.

use glam::DVec3;

/// Least cosines to the light and to the viewer of pixels that are used: nearer to the terminator shadows are as long as the object
/// bends, and nearer to the outline a pixel shows many directions at once.
pub const LEAST_COSINES: [f64; 2] = [0.25, 0.2];

/// A pixel of the object.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// Its index in the picture, rows of x.
    pub pixel: u32,
    /// In the world.
    pub position: DVec3,
    /// To the light, tile's frame.
    pub wi: DVec3,
    /// To the viewer.
    pub wo: DVec3,
    /// Change of `wi` a degree of azimuth and elevation.
    pub turn: [DVec3; 2],
    /// Irradiance on a plane that faces the light.
    pub irradiance: [f64; 3],
    /// Whether the light reaches it.
    pub lit: bool,
}
