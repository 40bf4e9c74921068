//! The rigid motion that brings points nearest to others.

use biscale::numerics::linear_algebra::largest_eigenvector;
use glam::{DMat3, DQuat, DVec3};

/// A rigid motion of space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) turn: DMat3,
    pub(super) shift: DVec3,
}

impl Motion {
    pub(super) fn apply(&self, p: DVec3) -> DVec3 {
        self.turn * p + self.shift
    }
}

/// The motion that brings the first points of the pairs nearest to the second ones in the sense of least squares (Horn 1987,
/// "Closed-form solution of absolute orientation using unit quaternions"): its quaternion is the eigenvector of the largest eigenvalue of a
/// matrix of products of coordinates. Points that are not finite are not turned.
pub(super) fn best_fit(pairs: &[(DVec3, DVec3, (u32, usize))]) -> Motion {
    let n = pairs.len() as f64;
    let (p0, q0) = (pairs.iter().map(|x| x.0).sum::<DVec3>() / n, pairs.iter().map(|x| x.1).sum::<DVec3>() / n);
    let mut s = [[0.0_f64; 3]; 3];
    for (p, q, _) in pairs {
        let (p, q) = ((*p - p0).to_array(), (*q - q0).to_array());
        for (row, a) in s.iter_mut().zip(p) {
            for (cell, b) in row.iter_mut().zip(q) {
                *cell += a * b;
            }
        }
    }
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = s;
    let matrix = [
        [xx + yy + zz, yz - zy, zx - xz, xy - yx],
        [yz - zy, xx - yy - zz, xy + yx, zx + xz],
        [zx - xz, xy + yx, yy - xx - zz, yz + zy],
        [xy - yx, zx + xz, yz + zy, zz - xx - yy],
    ];
    let quaternion = match largest_eigenvector(matrix.as_flattened(), 4).as_deref() {
        Some(&[w, x, y, z]) => DQuat::from_xyzw(x, y, z, w).normalize(),
        _ => DQuat::IDENTITY,
    };
    let turn = DMat3::from_quat(quaternion);
    Motion { turn, shift: q0 - turn * p0 }
}
