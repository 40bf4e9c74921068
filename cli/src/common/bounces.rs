//! How many reflections after the first a result includes, and who said so: the option, the plan, or the material.

use biscale::filter::Quality;
use serde::Serialize;
use std::fmt;

/// Who said how many.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum SaidBy {
    /// `--bounces`.
    Option,
    /// `--plan`.
    Plan,
    /// The material file's `bounces`.
    Material,
    /// The baked table, which has what it was baked with.
    Table,
    /// Nobody: direct light.
    Default,
}

/// Reflections after the first of a result. Shown as `4 reflections after the first, as the material says`; in JSON `bounces` and `bounces_said_by`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Bounces {
    /// How many; 0 is direct light only.
    #[serde(rename = "bounces")]
    pub number: u32,
    #[serde(rename = "bounces_said_by")]
    said_by: SaidBy,
    /// How many the material file says.
    #[serde(skip)]
    of_material: u32,
}

impl Bounces {
    /// Of a material whose file says `of_material`, computed with this quality.
    pub fn of(quality: &Quality, of_material: u32) -> Self {
        let said_by = match (&quality.plan, quality.bounces) {
            (Some(_), _) => SaidBy::Plan,
            (None, Some(_)) => SaidBy::Option,
            (None, None) if of_material > 0 => SaidBy::Material,
            (None, None) => SaidBy::Default,
        };
        Self { number: quality.bounces_of(of_material), said_by, of_material }
    }

    /// Of a baked table.
    pub fn of_table(number: u32) -> Self {
        Self { number, said_by: SaidBy::Table, of_material: number }
    }

    /// Whether there is anything to tell: not of direct light where neither file nor option says anything else.
    pub fn is_told(self) -> bool {
        self.number > 0 || self.of_material > 0
    }

    /// As a line says it after a comma, where there is anything to tell.
    pub fn after_comma(self) -> String {
        if self.is_told() { format!(", {self}") } else { String::new() }
    }
}

impl fmt::Display for Bounces {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.number {
            0 => write!(f, "direct light only")?,
            1 => write!(f, "1 reflection after the first")?,
            n => write!(f, "{n} reflections after the first")?,
        }
        match self.said_by {
            SaidBy::Option => write!(f, ", as `--bounces` says")?,
            SaidBy::Plan => write!(f, ", as the plan says")?,
            SaidBy::Material => write!(f, ", as the material says")?,
            SaidBy::Table | SaidBy::Default => {}
        }
        if self.number != self.of_material && self.of_material > 0 { write!(f, " (the material: {})", self.of_material) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_said_how_many_is_told_where_there_is_anything_to_tell() {
        let quality = |bounces, plan: Option<&str>| Quality { bounces, plan: plan.map(|p| p.parse().unwrap()), ..Quality::default() };
        for (bounces, plan, of_material, told, text) in [
            (None, None, 0, false, "direct light only"),
            (None, None, 4, true, "4 reflections after the first, as the material says"),
            (Some(1), None, 0, true, "1 reflection after the first, as `--bounces` says"),
            (Some(0), None, 4, true, "direct light only, as `--bounces` says (the material: 4)"),
            (None, Some("reference:bounces=2:first=8"), 4, true, "2 reflections after the first, as the plan says (the material: 4)"),
            (None, Some("direct:2048x1"), 4, true, "direct light only, as the plan says (the material: 4)"),
        ] {
            let bounces = Bounces::of(&quality(bounces, plan), of_material);
            assert_eq!((bounces.is_told(), bounces.to_string().as_str()), (told, text));
        }
    }
}
