//! The rigid motion that brings points nearest to others.

use glam::{DMat3, DVec3};

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
/// "Closed-form solution of absolute orientation using unit quaternions"), by power iteration on Horn's matrix, shifted to be positive.
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
    let q = largest_eigenvector(matrix);
    let turn = DMat3::from_quat(glam::DQuat::from_xyzw(q[1], q[2], q[3], q[0]).normalize());
    Motion { turn, shift: q0 - turn * p0 }
}

/// Eigenvector of the largest eigenvalue of a symmetric matrix, by Jacobi rotations.
fn largest_eigenvector(mut a: [[f64; 4]; 4]) -> [f64; 4] {
    let mut v = [[0.0; 4]; 4];
    for (k, row) in v.iter_mut().enumerate() {
        row[k] = 1.0;
    }
    for _ in 0..50 {
        for p in 0..3 {
            for q in p + 1..4 {
                if a[p][q] == 0.0 {
                    continue;
                }
                let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
                let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
                let (c, s) = (1.0 / t.hypot(1.0), t / t.hypot(1.0));
                for k in 0..4 {
                    let (x, y) = (a[k][p], a[k][q]);
                    a[k][p] = c * x - s * y;
                    a[k][q] = s * x + c * y;
                }
                for k in 0..4 {
                    let (x, y) = (a[p][k], a[q][k]);
                    a[p][k] = c * x - s * y;
                    a[q][k] = s * x + c * y;
                }
                for row in &mut v {
                    let (x, y) = (row[p], row[q]);
                    row[p] = c * x - s * y;
                    row[q] = s * x + c * y;
                }
            }
        }
    }
    let best = (0..4).max_by(|&i, &j| a[i][i].total_cmp(&a[j][j])).expect("four of them");
    v.map(|row| row[best])
}
