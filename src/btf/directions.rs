//! Sets of directions that BTFs are measured at.

use crate::direction::above_horizon;
use crate::error::BadInput;
use glam::DVec3;

/// Rings of a set: the polar angle in degrees, and how many azimuths stand at equal distances on it, the first at 0.
type Rings = &'static [(f64, u32)];

/// UBO2003: Müller, Meseth and Klein (002), section 3; the grid of Bonn's first database.
const UBO81: Rings = &[(0.0, 1), (15.0, 6), (30.0, 12), (45.0, 18), (60.0, 20), (75.0, 24)];
/// UBO2014: Weinmann, Gall and Klein 2014, "Material classification based on training data synthesized using a BTF database".
const UBO151: Rings =
    &[(0.0, 1), (11.0, 6), (23.5, 12), (30.0, 12), (37.5, 12), (45.0, 18), (52.5, 18), (60.0, 24), (67.5, 24), (75.0, 24)];

/// Most directions of a list: more do not fit into a BTF's file.
pub const MOST_DIRECTIONS: usize = 1 << 14;

/// Directions of lights or of views, unit vectors of the upper hemisphere, none of them twice.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectionSet {
    /// The directions, in order.
    pub directions: Vec<DVec3>,
}

impl DirectionSet {
    /// The set of a name: `ubo81`, `ubo151`.
    pub fn named(name: &str) -> Option<Self> {
        let rings = match name {
            "ubo81" => UBO81,
            "ubo151" => UBO151,
            _ => return None,
        };
        let ring = |&(theta_deg, count): &(f64, u32)| {
            (0..count).map(move |k| from_angles(theta_deg.to_radians(), f64::from(k) * std::f64::consts::TAU / f64::from(count)))
        };
        Some(Self { directions: rings.iter().flat_map(ring).collect() })
    }

    /// A list, one direction a line: `theta phi` in degrees, or `x y z` of any length; blanks or commas between, `#` begins a comment.
    ///
    /// # Errors
    /// Bad input that names the line: another number of numbers, one that is none, a direction below the horizon, one twice, or no direction.
    pub fn parse(text: &str) -> Result<Self, BadInput> {
        let mut directions: Vec<DVec3> = Vec::new();
        for (k, line) in text.lines().enumerate() {
            let line = line.split('#').next().unwrap_or("").trim();
            if line.is_empty() {
                continue;
            }
            let at = |what: String, remedy: &str| BadInput::new(format!("line {}: {what}", k + 1), remedy);
            let numbers: Result<Vec<f64>, _> =
                line.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()).map(str::parse::<f64>).collect();
            let numbers = numbers.map_err(|_| at(format!("\"{line}\" is not all numbers"), "write `theta phi` in degrees, or `x y z`"))?;
            let direction = match numbers[..] {
                [theta, phi] if (0.0..90.0).contains(&theta) && phi.is_finite() => {
                    above_horizon(from_angles(theta.to_radians(), phi.to_radians()))
                }
                [_, _] => None,
                [x, y, z] => scaled(DVec3::new(x, y, z)).and_then(above_horizon),
                _ => return Err(at(format!("{} numbers", numbers.len()), "write `theta phi` in degrees, or `x y z`")),
            };
            let Some(direction) = direction else {
                return Err(at(format!("\"{line}\" is not above the surface"), "use 0 <= theta < 90, or z >= 0"));
            };
            if directions.len() == MOST_DIRECTIONS {
                return Err(at(format!("more than {MOST_DIRECTIONS} directions"), "name fewer"));
            }
            if directions.iter().any(|d| d.distance(direction) < 1e-9) {
                return Err(at(format!("\"{line}\" stands there twice"), "leave one of them out"));
            }
            directions.push(direction);
        }
        if directions.is_empty() {
            return Err(BadInput::new("there is no direction", "write `theta phi` in degrees, one direction a line"));
        }
        Ok(Self { directions })
    }
}

/// A vector of length 1, however long or short it was.
fn scaled(v: DVec3) -> Option<DVec3> {
    (v / v.abs().max_element()).try_normalize()
}

fn from_angles(theta: f64, phi: f64) -> DVec3 {
    DVec3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_bonn_have_the_directions_that_their_names_say() {
        for (name, count) in [("ubo81", 81), ("ubo151", 151)] {
            let set = DirectionSet::named(name).unwrap();
            assert_eq!(set.directions.len(), count);
            assert!(set.directions[0] == DVec3::Z && set.directions.iter().all(|d| (d.length() - 1.0).abs() < 1e-12 && d.z > 0.25));
        }
        assert_eq!(DirectionSet::named("ubo"), None);
        // The seventh ring of the first set begins at 75 degrees, azimuth 0.
        let last = DirectionSet::named("ubo81").unwrap().directions[57];
        assert!((last - DVec3::new(75_f64.to_radians().sin(), 0.0, 75_f64.to_radians().cos())).length() < 1e-12, "{last}");
    }

    #[test]
    fn a_list_has_angles_or_vectors_and_says_which_line_is_wrong() {
        let set = DirectionSet::parse("# views\n0 0\n60, 90\n\n0 5e-200 5e-200 # a vector\n").unwrap();
        assert_eq!(set.directions.len(), 3);
        assert!((set.directions[1] - DVec3::new(0.0, 0.75_f64.sqrt(), 0.5)).length() < 1e-12);
        // What grazes is lifted, as in all of the program.
        assert_eq!(DirectionSet::parse("89.9999999 90").unwrap().directions[0].z, crate::direction::MIN_COSINE);
        for (text, words) in [
            ("89.9999999 0\n1 0 0", "twice"),
            ("0 0\n95 0", "line 2"),
            ("1 2 3 4", "4 numbers"),
            ("up 0", "not all numbers"),
            ("0 0\n0 0", "twice"),
            ("# nothing", "no direction"),
            ("0 0 -1", "not above"),
            ("nan 0", "not above"),
        ] {
            let error = DirectionSet::parse(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
