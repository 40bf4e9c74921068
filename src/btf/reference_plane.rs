//! The plane whose texels show the surface, and where each place of the surface lands on it.

use crate::geometry::Tile;
use crate::numerics::cast::truncate_usize;
use glam::{DVec2, DVec3};

/// How high the reference plane lies. It decides only where a thing that is seen obliquely lands: with another plane the image moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaneHeight {
    /// Halfway between the lowest and the highest vertex.
    Middle,
    /// At the highest vertex.
    Top,
    /// At this z, in the tile's unit.
    At(f64),
}

/// The reference plane of a tile: one period, cut into texels. Row 0 is the one of the largest y, column 0 that of the smallest x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferencePlane {
    /// Its height, in the tile's unit.
    pub z: f64,
    /// The period.
    pub period: DVec2,
    /// Texels across (x) and along (y).
    pub texels: [usize; 2],
}

impl ReferencePlane {
    /// Of a tile.
    pub fn new(tile: &Tile, height: PlaneHeight, texels: [usize; 2]) -> Self {
        let used = tile.triangles.iter().flatten().map(|&v| tile.vertices[v as usize].z);
        let [low, high] = used.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)]);
        let z = match height {
            PlaneHeight::Middle => 0.5 * (low + high),
            PlaneHeight::Top => high,
            PlaneHeight::At(z) => z,
        };
        Self { z, period: tile.period, texels }
    }

    /// Texels in all.
    pub fn count(&self) -> usize {
        self.texels[0] * self.texels[1]
    }

    /// The texel that shows a place of the surface from `wo`, which is above the horizon: where the line through the place along `wo` meets the plane.
    #[inline]
    pub fn texel(&self, place: DVec3, wo: DVec3) -> usize {
        let at = (place.truncate() - (place.z - self.z) / wo.z * wo.truncate()) / self.period;
        let [columns, rows] = self.texels;
        let cell = |u: f64, n: usize| truncate_usize((u - u.floor()) * n as f64).min(n - 1);
        (rows - 1 - cell(at.y, rows)) * columns + cell(at.x, columns)
    }

    /// The place of the plane at `within` (0..1 to the right and up) of a texel.
    pub fn place(&self, texel: usize, within: DVec2) -> DVec3 {
        let [columns, rows] = self.texels;
        let (row, column) = (texel / columns, texel % columns);
        let u = DVec2::new((column as f64 + within.x) / columns as f64, ((rows - 1 - row) as f64 + within.y) / rows as f64);
        (u * self.period).extend(self.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_of_the_plane_is_seen_in_its_own_texel_and_what_lies_deeper_moves_towards_the_viewer() {
        let plane = ReferencePlane { z: 0.5, period: DVec2::new(2.0, 3.0), texels: [4, 6] };
        let wo = DVec3::new(0.6, 0.0, 0.8);
        for texel in 0..plane.count() {
            let place = plane.place(texel, DVec2::new(0.3, 0.7));
            assert_eq!(plane.texel(place, wo), texel);
            // One lattice step aside.
            assert_eq!(plane.texel(place + DVec3::new(-2.0, 6.0, 0.0), wo), texel);
        }
        // Row 0 has the largest y.
        assert_eq!(plane.texel(DVec3::new(0.1, 2.9, 0.5), DVec3::Z), 0);
        assert_eq!(plane.texel(DVec3::new(0.1, 0.1, 0.5), DVec3::Z), 20);
        // Half a unit below the plane it appears .375 further along +x: B_z'(x) = B_z(x - (z' - z) tan(theta_o)).
        assert_eq!(plane.texel(DVec3::new(0.2, 2.9, 0.0), wo), 1);
    }
}
