//! What `biscale new KIND` writes: a material file with every parameter, its unit, range, default and help.

use super::kinds::describe;
use std::fmt::Write as _;

/// Colours of the parts in a template, linear RGB; they repeat.
const COLOURS: [&str; 4] = ["[0.10, 0.50, 0.15]", "[0.70, 0.55, 0.05]", "[0.60, 0.08, 0.08]", "[0.10, 0.20, 0.60]"];

/// A complete, commented material file of `kind`, or `None` for a kind that does not exist.
///
/// It can be used as it is, except that kinds which read a file need that file.
pub fn template(kind: &str) -> Option<String> {
    let description = describe(kind)?;
    let mut text = format!(
        "# {}.\n# Lengths are in `unit`, angles in degrees, colours linear RGB (sRGB primaries).\nformat = 1\nname = \"{kind}\"\n\
         unit = \"mm\"  # nm, um, mm, cm or m\n# Reflections after the first that its look includes, 0 to 64 (default 0, direct light only)\n# bounces = 4\n\n[geometry]\nkind = \"{kind}\"\n\n",
        description.help
    );
    for param in description.params {
        writeln!(text, "{}", param.template_lines(description.params)).expect("a String can be written to");
    }
    text.push_str("# One [[surface]] for each part; part = \"*\" is all the rest.\n");
    for (place, (part, what)) in description.parts.iter().enumerate() {
        let colour = COLOURS[place % COLOURS.len()];
        let surface = format!(
            "# {part}: {what}\n[[surface]]\npart = \"{part}\"\nbrdf = {{ model = \"lambert\", albedo = {colour} }}\n\
             # brdf = {{ model = \"cook-torrance\", diffuse = {colour}, specular = 0.1, alpha = 0.2 }}\n\
             # brdf = {{ model = \"measured\", name = \"gold-metallic-paint\" }}  # `biscale list brdfs` names them\n\
             # Colour weight, 0 to 1 (default 1){}\ntint = [1.0, 1.0, 1.0]\n\n",
            if matches!(kind, "mesh" | "height-field") { "; may be an image: tint = \"tint.png\"" } else { "" }
        );
        text.push_str(&surface);
    }
    text.truncate(text.trim_end().len());
    text.push('\n');
    Some(text)
}
