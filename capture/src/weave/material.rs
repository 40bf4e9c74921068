//! A measured weave or relief as a material file, which `biscale check`, `eval` and `fit` take.

use super::analysis::{Analysis, Weave};
use super::relief::{Profile, Relief};

/// What the photograph does not say, and what is written in its place. The defaults are chosen, not measured.
#[derive(Clone, Copy, Debug)]
pub struct MaterialGuesses {
    /// Reflectance of what has the value 1 in the photograph; divides the colours into albedos.
    pub white_reflectance: f64,
    /// Height of threads over their width where the shading says nothing better.
    pub flatness: f64,
    /// Depth of grooves and height of pyramids over their period.
    pub depth: f64,
}

impl Default for MaterialGuesses {
    fn default() -> Self {
        Self { white_reflectance: 1.0, flatness: 1.0 / 3.0, depth: 0.25 }
    }
}

impl Analysis {
    /// The surface as a material file, or nothing if none was recognised.
    ///
    /// Lengths are in mm; without a scale the `unit` stays mm and a comment says that they are pixels. What was measured is written with
    /// its error, what is a guess says so.
    pub fn material(&self, name: &str, guesses: &MaterialGuesses) -> Option<String> {
        let mut text = String::new();
        let scale = if self.mm_per_pixel.is_some() { "" } else { "# The photograph has no scale: lengths are pixels, written as mm.\n" };
        let name: String = name.chars().filter(|c| !c.is_control() && *c != '"' && *c != '\\').collect();
        let head = format!(
            "# Measured from a photograph; a guess to start from.\n{scale}format = 1\nname = \"{name}\"\nunit = \"mm\"\n\n[geometry]\n"
        );
        if let Some(weave) = &self.weave {
            text.push_str(&head);
            write_weave(&mut text, weave, guesses);
        } else {
            let relief = self.relief.as_ref()?;
            text.push_str(&head);
            write_relief(&mut text, relief, guesses);
        }
        Some(text)
    }
}

/// A number that a TOML reader takes for one with a point.
fn number(value: f64) -> String {
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0');
    if text.ends_with('.') { format!("{text}0") } else { text.to_owned() }
}

fn albedo(colour: [f64; 3], guesses: &MaterialGuesses) -> String {
    let [r, g, b] = colour.map(|c| number((c * guesses.white_reflectance).clamp(0.0, 1.0)));
    format!("[{r}, {g}, {b}]")
}

fn write_weave(text: &mut String, weave: &Weave, guesses: &MaterialGuesses) {
    let mut line = |l: String| {
        text.push_str(&l);
        text.push('\n');
    };
    line(format!("kind = \"weave\"  # {}, confidence {:.2}", weave.class, weave.confidence));
    let rows: Vec<String> = weave
        .draft
        .warp_over
        .chunks(weave.draft.columns)
        .map(|row| format!("\"{}\"", row.iter().map(|&over| if over { '1' } else { '0' }).collect::<String>()))
        .collect();
    line(format!("draft = [{}]", rows.join(", ")));
    for (name, axis) in [("warp", &weave.warp), ("weft", &weave.weft)] {
        line(format!("{name}_width = {}  # +- {:.2e}", number(axis.width.value), axis.width.error));
        // The pitch is measured far better than the width: the gap is what the width leaves of it.
        line(format!("{name}_gap = {}  # pitch {:.6} +- {:.1e}", number(axis.gap), axis.pitch.value, axis.pitch.error));
        line(format!("{name}_height = {}  # a guess: {:.3} of the width", number(axis.width.value * guesses.flatness), guesses.flatness));
    }
    for (name, axis) in [("warp", &weave.warp), ("weft", &weave.weft)] {
        line(format!("\n# Mean colour of {:.0} pixels; it holds the shading.\n[[surface]]\npart = \"{name}\"", axis.colour_pixels));
        line(format!("brdf = {{ model = \"lambert\", albedo = {} }}", albedo(axis.colour, guesses)));
    }
}

fn write_relief(text: &mut String, relief: &Relief, guesses: &MaterialGuesses) {
    let mut line = |l: String| {
        text.push_str(&l);
        text.push('\n');
    };
    let period = relief.period[0].value;
    let depth = number(period * guesses.depth);
    match relief.profile {
        Profile::Pyramids => {
            line("kind = \"pyramids\"".into());
            line(format!("period = {}  # +- {:.1e}", number(period), relief.period[0].error));
            let ratio = relief.period.get(1).map_or(1.0, |y| period / y.value);
            line(format!("ratio = {}\nheight = {depth}  # a guess", number(ratio)));
        }
        Profile::V { .. } | Profile::Sawtooth { .. } | Profile::Flat { .. } => {
            let name = match relief.profile {
                Profile::V { .. } => "v",
                Profile::Sawtooth { .. } => "sawtooth",
                _ => "flat",
            };
            line(format!("kind = \"grooves\"  # they run {:.2} degrees from the picture's y axis\nprofile = \"{name}\"", relief.turn_deg));
            line(format!("period = {}  # +- {:.1e}\ndepth = {depth}  # a guess", number(period), relief.period[0].error));
            if let Profile::Flat { floor, top } = relief.profile {
                line(format!("floor_width = {}\ntop_width = {}", number(floor * period), number(top * period)));
            }
            if let Profile::Sawtooth { steep } = relief.profile {
                let angle = guesses.depth.atan2(steep).to_degrees().clamp(1.0, 90.0);
                line(format!("steep_angle_deg = {}  # a guess, as the depth", number(angle)));
            }
        }
    }
    line(format!(
        "\n# Mean colour of the photograph; it holds the shading.\n[[surface]]\npart = \"*\"\nbrdf = {{ model = \"lambert\", albedo = {} }}",
        albedo(relief.colour, guesses)
    ));
}
