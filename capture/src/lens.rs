//! The camera: a pinhole with radial and tangential distortion, and where it stands.
//!
//! `OpenCV`'s model and conventions: x to the right, y down, z forward; a pixel's centre has whole coordinates.
//!
//! ```text
//! x = X/Z, y = Y/Z, r² = x² + y²,  s = 1 + k1 r² + k2 r⁴ + k3 r⁶
//! x' = s x + 2 p1 x y + p2 (r² + 2 x²),  y' = s y + p1 (r² + 2 y²) + 2 p2 x y
//! u = fx x' + cx,  v = fy y' + cy
//! ```

use glam::{DMat3, DQuat, DVec2, DVec3};

/// A camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
    /// Focal lengths, px.
    pub focal: DVec2,
    /// Principal point, px.
    pub centre: DVec2,
    /// `k1, k2, p1, p2, k3`.
    pub distortion: [f64; 5],
}

/// The transform from the sample's frame to the camera's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Rotates directions.
    pub rotation: DMat3,
    /// Place of the sample's origin in the camera's frame, mm.
    pub translation: DVec3,
}

/// Newton's method that undoes the distortion.
struct UndistortParams {
    /// Steps; it converges quadratically, so that more than ten are needed near a fold only.
    steps: usize,
    /// Distance that ends it, in units of the focal length: rounding.
    enough: f64,
    /// Distance up to which the last step is taken for a solution.
    accepted: f64,
    /// Step of the central differences: the cube root of the rounding error is 6e-6.
    difference: f64,
    /// Determinant of the derivative from which on the model folds over itself. Chosen: 0.03 of the undistorted scale along each axis.
    least_determinant: f64,
}

const UNDISTORT: UndistortParams = UndistortParams { steps: 30, enough: 1e-12, accepted: 1e-8, difference: 1e-6, least_determinant: 1e-3 };

/// Depth below which a point is behind the camera, mm.
const LEAST_DEPTH: f64 = 1e-9;

impl Lens {
    /// The same without distortion.
    pub fn pinhole(&self) -> Self {
        Self { distortion: [0.0; 5], ..*self }
    }

    /// Whether there is distortion.
    pub fn is_distorted(&self) -> bool {
        self.distortion != [0.0; 5]
    }

    /// Where the distorted image of an undistorted place lies, both in units of the focal length.
    pub fn distort(&self, p: DVec2) -> DVec2 {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let r2 = p.length_squared();
        let s = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
        let xy = p.x * p.y;
        DVec2::new(s * p.x + 2.0 * p1 * xy + p2 * (r2 + 2.0 * p.x * p.x), s * p.y + p1 * (r2 + 2.0 * p.y * p.y) + 2.0 * p2 * xy)
    }

    /// The inverse of [`Lens::distort`] by Newton's method; `None` where the model folds over itself.
    pub fn undistort(&self, q: DVec2) -> Option<DVec2> {
        if !self.is_distorted() {
            return Some(q);
        }
        let mut p = q;
        for _ in 0..UNDISTORT.steps {
            let off = self.distort(p) - q;
            if off.length() < UNDISTORT.enough {
                return Some(p);
            }
            let h = UNDISTORT.difference;
            let dx = (self.distort(p + DVec2::new(h, 0.0)) - self.distort(p - DVec2::new(h, 0.0))) / (2.0 * h);
            let dy = (self.distort(p + DVec2::new(0.0, h)) - self.distort(p - DVec2::new(0.0, h))) / (2.0 * h);
            let det = dx.x * dy.y - dy.x * dx.y;
            if !(det > UNDISTORT.least_determinant) {
                return None;
            }
            p -= DVec2::new(dy.y * off.x - dy.x * off.y, dx.x * off.y - dx.y * off.x) / det;
        }
        (self.distort(p).distance(q) < UNDISTORT.accepted).then_some(p)
    }

    /// The pixel of a place in units of the focal length, without distortion.
    pub fn pixel(&self, p: DVec2) -> DVec2 {
        self.focal * p + self.centre
    }

    /// The place of a pixel in units of the focal length, without distortion.
    pub fn place(&self, pixel: DVec2) -> DVec2 {
        (pixel - self.centre) / self.focal
    }

    /// The pixel that a point in the camera's frame is seen at; `None` behind the camera.
    pub fn project(&self, point: DVec3) -> Option<DVec2> {
        (point.z > LEAST_DEPTH).then(|| self.pixel(self.distort(point.truncate() / point.z)))
    }

    /// Unit direction that a pixel looks along, in the camera's frame.
    pub fn ray(&self, pixel: DVec2) -> Option<DVec3> {
        self.undistort(self.place(pixel)).map(|p| p.extend(1.0).normalize())
    }

    /// Field of view across, without distortion, degrees.
    pub fn field_of_view_deg(&self) -> f64 {
        2.0 * (0.5 * self.width as f64 / self.focal.x).atan().to_degrees()
    }

    /// Distance of the farthest corner of the picture from the principal point, px.
    pub fn farthest(&self) -> f64 {
        farthest(self.width, self.height, self.centre)
    }
}

/// Distance of the farthest corner of a picture from a place, px.
pub fn farthest(width: usize, height: usize, from: DVec2) -> f64 {
    let (w, h) = ((width - 1) as f64, (height - 1) as f64);
    [(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].iter().map(|&c| DVec2::from(c).distance(from)).fold(1.0, f64::max)
}

impl Pose {
    /// A point of the sample in the camera's frame.
    pub fn to_camera(&self, point: DVec3) -> DVec3 {
        self.rotation * point + self.translation
    }

    /// A point of the camera's frame in the sample's.
    pub fn to_sample(&self, point: DVec3) -> DVec3 {
        self.rotation.transpose() * (point - self.translation)
    }

    /// The camera's place in the sample's frame.
    pub fn eye(&self) -> DVec3 {
        self.to_sample(DVec3::ZERO)
    }

    /// Turned by a rotation vector about the camera's axes, rad, and moved, mm.
    pub fn moved(&self, turn: DVec3, shift: DVec3) -> Self {
        Self { rotation: DMat3::from_quat(DQuat::from_scaled_axis(turn)) * self.rotation, translation: self.translation + shift }
    }

    /// The pose of a camera at `eye` that looks at `target` with `up` upwards in its picture.
    pub fn looking_at(eye: DVec3, target: DVec3, up: DVec3) -> Self {
        let z = (target - eye).normalize();
        let x = z.cross(up).normalize();
        let rotation = DMat3::from_cols(x, z.cross(x), z).transpose();
        Self { rotation, translation: -(rotation * eye) }
    }

    /// Angle between two poses' rotations, rad.
    pub fn angle_to(&self, other: &Self) -> f64 {
        // The trace loses digits near 0: the quaternion does not.
        let q = DQuat::from_mat3(&(self.rotation * other.rotation.transpose()));
        2.0 * q.xyz().length().atan2(q.w.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens {
        width: 640,
        height: 480,
        focal: DVec2::new(536.0, 536.0),
        centre: DVec2::new(342.0, 235.0),
        distortion: [-0.266, -0.0386, 0.00178, -0.00028, 0.238],
    };

    #[test]
    fn undistort_undoes_distort_all_over_the_picture() {
        for (u, v) in (0..13).flat_map(|i| (0..10).map(move |j| (f64::from(i) * 639.0 / 12.0, f64::from(j) * 479.0 / 9.0))) {
            let q = LENS.place(DVec2::new(u, v));
            let p = LENS.undistort(q).unwrap();
            assert!(LENS.distort(p).distance(q) < 1e-10, "{u} {v}");
        }
        let folding = Lens { distortion: [-2.0, 0.0, 0.0, 0.0, 0.0], ..LENS };
        assert_eq!(folding.undistort(DVec2::new(3.0, 0.0)), None);
    }

    #[test]
    fn a_camera_sees_what_it_looks_at_in_its_middle_and_up_is_up() {
        let pose = Pose::looking_at(DVec3::new(10.0, -100.0, 30.0), DVec3::new(1.0, 2.0, 3.0), DVec3::Z);
        let lens = LENS.pinhole();
        assert!(lens.project(pose.to_camera(DVec3::new(1.0, 2.0, 3.0))).unwrap().distance(lens.centre) < 1e-9);
        assert!(lens.project(pose.to_camera(DVec3::new(1.0, 2.0, 4.0))).unwrap().y < lens.centre.y);
        assert!(pose.eye().distance(DVec3::new(10.0, -100.0, 30.0)) < 1e-9 && (pose.rotation.determinant() - 1.0).abs() < 1e-12);
        assert!(lens.project(pose.to_camera(DVec3::new(10.0, -200.0, 30.0))).is_none(), "behind");
        assert!((pose.angle_to(&pose.moved(DVec3::new(0.0, 1e-4, 0.0), DVec3::ZERO)) - 1e-4).abs() < 1e-10);
    }
}
