//! Which photographs share a lens: a phone switches lenses and sizes, and a calibration holds for one of each.

use crate::lens::Lens;
use crate::metadata::Metadata;
use glam::DVec2;

/// Relative difference up to which two focal lengths are the same: files round them.
const SAME_FOCAL: f64 = 0.01;
/// Relative difference up to which the shapes of two pictures are the same: sizes are whole numbers.
const SAME_SHAPE: f64 = 2e-3;

/// What tells a lens apart, by the file and by the shoot file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LensKey {
    /// The name that the shoot file gives (`lens`); photographs of one name belong together, and to no other.
    pub name: Option<String>,
    /// Pixels across and down, as the file has them.
    pub size: (usize, usize),
    /// Focal length, mm.
    pub focal_mm: Option<f64>,
    /// Focal length of a camera of 36 x 24 mm with the same field of view, mm: digital zoom changes it.
    pub focal_35mm: Option<f64>,
}

/// How the pixels of a photograph lie in the frame of its group.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// As they are; or turned by a half, which sizes do not tell.
    None,
    /// By a quarter, which way sizes do not tell.
    Quarter,
}

impl LensKey {
    /// The key of a photograph of this size; `name` is what the shoot file says.
    pub fn of(name: Option<&str>, size: (usize, usize), metadata: &Metadata) -> Self {
        Self { name: name.map(str::to_owned), size, focal_mm: metadata.focal_mm, focal_35mm: metadata.focal_35mm }
    }

    /// Whether a photograph belongs to this group, and how it is turned. What a file does not tell agrees with everything.
    pub fn holds(&self, other: &Self) -> Option<Turn> {
        let (w, h) = self.size;
        let turn = match other.size {
            size if size == (w, h) => Turn::None,
            size if size == (h, w) => Turn::Quarter,
            _ => return None,
        };
        self.same_optics(other).then_some(turn)
    }

    /// Whether a photograph is one of this group, reduced (or enlarged) as a whole: the factor by which it is larger.
    ///
    /// Only where both files tell the same focal length in both ways, so that it cannot be a crop.
    pub fn scaled(&self, other: &Self) -> Option<f64> {
        let shape = |k: &Self| k.size.0 as f64 / k.size.1 as f64;
        let told = self.focal_mm.and(other.focal_mm).and(self.focal_35mm).and(other.focal_35mm).is_some();
        (told && self.same_optics(other) && (shape(self) / shape(other) - 1.0).abs() < SAME_SHAPE)
            .then(|| other.size.0 as f64 / self.size.0 as f64)
    }

    fn same_optics(&self, other: &Self) -> bool {
        let same = |a: Option<f64>, b: Option<f64>| a.zip(b).is_none_or(|(a, b)| (a / b - 1.0).abs() <= SAME_FOCAL);
        self.name == other.name && same(self.focal_mm, other.focal_mm) && same(self.focal_35mm, other.focal_35mm)
    }

    /// In words.
    pub fn describe(&self) -> String {
        let mut out = format!("{} x {} pixels", self.size.0, self.size.1);
        if let Some(f) = self.focal_mm {
            out.push_str(&format!(", focal length {f} mm"));
        }
        if let Some(f) = self.focal_35mm {
            out.push_str(&format!(" (as {f} mm on 36 x 24 mm)"));
        }
        if let Some(name) = &self.name {
            out.push_str(&format!(", lens \"{name}\""));
        }
        out
    }
}

impl Lens {
    /// The lens of pictures whose pixels are turned by a half.
    pub fn half_turned(&self) -> Self {
        let [k1, k2, p1, p2, k3] = self.distortion;
        let last = DVec2::new((self.width - 1) as f64, (self.height - 1) as f64);
        Self { centre: last - self.centre, distortion: [k1, k2, -p1, -p2, k3], ..*self }
    }

    /// The lens of the same pictures at another size, `factor` times as large; sizes are those of the other picture.
    pub fn resized(&self, (width, height): (usize, usize)) -> Self {
        let factor = DVec2::new(width as f64 / self.width as f64, height as f64 / self.height as f64);
        Self { width, height, focal: self.focal * factor, centre: (self.centre + 0.5) * factor - 0.5, distortion: self.distortion }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn key(size: (usize, usize), focal: f64, focal_35: f64) -> LensKey {
        LensKey { name: None, size, focal_mm: Some(focal), focal_35mm: Some(focal_35) }
    }

    #[test]
    fn sizes_and_focal_lengths_tell_lenses_apart() {
        let main = key((4032, 3024), 6.86, 24.0);
        assert_eq!(main.holds(&key((4032, 3024), 6.9, 24.0)), Some(Turn::None));
        assert_eq!(main.holds(&key((3024, 4032), 6.86, 24.0)), Some(Turn::Quarter));
        assert_eq!(main.holds(&key((4032, 3024), 9.0, 77.0)), None, "another lens");
        assert_eq!(main.holds(&key((4032, 3024), 6.86, 48.0)), None, "digital zoom");
        assert_eq!(main.holds(&LensKey { size: (4032, 3024), ..LensKey::default() }), Some(Turn::None), "a file that tells nothing");
        let near = LensKey { name: Some("near".into()), ..main.clone() };
        assert_eq!((main.holds(&near), near.holds(&near)), (None, Some(Turn::None)));
        assert_eq!(main.scaled(&key((2016, 1512), 6.86, 24.0)), Some(0.5));
        assert_eq!(main.scaled(&key((2016, 1134), 6.86, 24.0)), None, "cut to another shape");
        assert_eq!(main.scaled(&LensKey { size: (2016, 1512), ..LensKey::default() }), None, "may be a crop");
    }

    #[test]
    fn turned_and_resized_lenses_see_the_same_points_there() {
        let lens = Lens {
            width: 640,
            height: 480,
            focal: DVec2::new(536.0, 530.0),
            centre: DVec2::new(342.0, 235.0),
            distortion: [-0.266, -0.0386, 0.00178, -0.00028, 0.238],
        };
        let point = DVec3::new(0.2, -0.1, 1.0);
        let seen = lens.project(point).unwrap();
        // A picture turned by a half shows the world turned by a half about the axis.
        let turned = lens.half_turned().project(DVec3::new(-point.x, -point.y, 1.0)).unwrap();
        assert!((DVec2::new(639.0, 479.0) - seen).distance(turned) < 1e-9, "{turned}");
        let small = lens.resized((320, 240)).project(point).unwrap();
        assert!(((seen + 0.5) * 0.5 - 0.5).distance(small) < 1e-9, "{small}");
    }
}
