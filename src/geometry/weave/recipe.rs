//! What a material file says of a weave: draft, sizes, parts.

use super::super::params::{Param, Unit, Value, choice, derived, number, scaled, whole};
use super::super::values::GeometryValues;
use super::cloth::{Thread, Weave};
use super::crimp::Overlap;
use super::draft::{Draft, gcd};
use super::wif::{self, Wif};
use crate::error::Result;
use crate::toml_reader::range;
use glam::DVec2;
use std::collections::BTreeSet;

const fn optional_whole(key: &'static str, max: u32, help: &'static str) -> Param {
    Param { key, value: Value::Whole { default: None, min: 1, max }, help }
}

/// Parameters of this kind.
pub const PARAMS: &[Param] = &[
    choice("weave", "plain", &["plain", "twill", "satin"], "Which crossings the warp lies over (or give `draft` or `wif`)"),
    optional_whole("over", 64, "Twill (default 2) and satin (default 4): wefts that a warp passes over, then"),
    optional_whole("under", 64, "Twill (default 2) and satin (default 1): under"),
    optional_whole("shift", 127, "Twill (default 1) and satin (default 2): warps by which the next weft is moved"),
    Param {
        key: "draft",
        value: Value::Texts { example: "[\"10\", \"01\"]" },
        help: "Any weave: one text a weft, the first at the lowest y; one character a warp, 1 where the warp lies over",
    },
    Param {
        key: "wif",
        value: Value::File { example: "draft.wif", required: false },
        help: "Any weave from a weaving program's file; it also gives widths, gaps and colours that are not set here",
    },
    number("warp_width", Unit::Length, 0.42, range(1e-9, 1e6), "Width of the warp threads, which run along y"),
    scaled("warp_gap", "warp_width", 0.2, range(0.0, 1e6), "Distance from a warp thread to the next"),
    scaled("warp_height", "warp_width", 1.0 / 3.0, range(1e-15, 1e9), "Height of the warp threads' sections"),
    scaled("weft_width", "warp_width", 1.0, range(1e-9, 1e6), "Width of the weft threads, which run along x"),
    scaled("weft_gap", "weft_width", 0.2, range(0.0, 1e6), "Distance from a weft thread to the next"),
    scaled("weft_height", "weft_width", 1.0 / 3.0, range(1e-15, 1e9), "Height of the weft threads' sections"),
    derived(
        "crimp",
        Unit::Length,
        ("the least that keeps the threads apart", 0.15),
        range(0.0, 1e9),
        "Distance between the centre lines of warp and weft where they cross",
    ),
    number("crimp_share", Unit::One, 0.5, range(0.0, 1.0), "Share of the crimp by which the warp bends; the weft takes the rest"),
    whole("segments", 16, 4, 256, "Sides of a thread's section"),
    whole("steps", 8, 1, 256, "Pieces along each bend"),
    Param {
        key: "parts",
        value: Value::Choice { default: None, words: &["by-direction", "by-colour"] },
        help: "Parts \"warp\" and \"weft\", or by colour of a WIF file (its default): \"warp-1\", \"weft-2\" by palette entry",
    },
];

/// Parts of this kind, with what they are.
pub const PARTS: &[(&str, &str)] = &[("warp", "the threads along y"), ("weft", "the threads along x")];

/// A share of the smaller height by which threads may meet without a note.
const QUIET_OVERLAP: f64 = 0.05;

/// Most colours of one direction that become parts.
const MAX_COLOURS: usize = 1000;

impl Weave {
    /// Threads after the draft, with sizes from the material file, else from the WIF file, else the defaults.
    pub(in crate::geometry) fn read(values: &GeometryValues, unit_mm: f64) -> Result<Self> {
        let by_colour = values.choice("parts") != Some("by-direction");
        let (draft, file) = read_draft(values, by_colour)?;
        if values.choice("parts") == Some("by-colour") && file.as_ref().is_none_or(|f| f.palette.is_empty()) {
            return Err(values.error_at("parts", "there are no colours to name parts by", "give a `wif` with colours, or remove it"));
        }
        let mut notes = Vec::new();
        let warp = Direction::read(values, WARP_KEYS, draft.columns, file.as_ref().map(|f| &f.warp), unit_mm, &mut notes)?;
        let weft = Direction::read(values, WEFT_KEYS, draft.rows, file.as_ref().map(|f| &f.weft), unit_mm, &mut notes)?;
        // A repeat of the draft in which threads, sizes and colours repeat is the same cloth with fewer triangles.
        let (columns, rows) = (draft.column_period(|a, b| warp.alike(a, b)), draft.row_period(|a, b| weft.alike(a, b)));
        if (columns, rows) != (draft.columns, draft.rows) {
            notes.push(format!("the {} x {} threads of the draft repeat after {columns} x {rows}", draft.columns, draft.rows));
        }
        warp.check_colours(values)?;
        weft.check_colours(values)?;
        let draft = draft.cropped(columns, rows);
        let mut parts: Vec<String> = Vec::new();
        let (warp, period_x) = warp.side_by_side(columns, &mut parts);
        let (weft, period_y) = weft.side_by_side(rows, &mut parts);
        let period = DVec2::new(period_x, period_y);
        if !(period.min_element() >= 1e-6 && period.max_element() <= 1e6) {
            let problem = format!("the period is {period_x} x {period_y}");
            return Err(values.error_at("warp_width", problem, "choose widths and gaps that give 1e-6 to 1e6"));
        }
        if let Some(file) = &file {
            notes.extend(file.notes.iter().cloned());
            notes.extend(colour_notes(file, &parts));
        }
        let (loose_warps, loose_wefts) = draft.loose();
        if loose_warps + loose_wefts > 0 {
            notes.push(format!("{loose_warps} warp and {loose_wefts} weft threads never change sides: nothing holds them"));
        }
        let whole = |key| values.whole(key).expect("has a default");
        let crimp_share = values.number("crimp_share");
        let weave =
            Self { draft, warp, weft, period, crimp: 0.0, crimp_share, segments: whole("segments"), steps: whole("steps"), parts, notes };
        Ok(weave.with_crimp(values.optional("crimp")))
    }

    /// The cloth with this crimp, or with the least that keeps its threads apart.
    fn with_crimp(mut self, crimp: Option<f64>) -> Self {
        self.crimp = crimp.unwrap_or_else(|| self.least_crimp());
        let Overlap { deepest, thinner } = self.overlap();
        if deepest > QUIET_OVERLAP * thinner {
            self.notes.push(format!("warp and weft meet where they cross: up to {deepest:.3e} of {thinner:.3e} high threads"));
        }
        self
    }
}

/// What the user should know of the colours that the WIF file gives to parts.
fn colour_notes(file: &Wif, parts: &[String]) -> Vec<String> {
    let mut notes = Vec::new();
    for part in parts {
        if let Some(c) = part.split_once('-').and_then(|(_, entry)| file.palette.get(&entry.parse().ok()?)) {
            notes.push(format!("part {part}: the file's colour is [{:.3}, {:.3}, {:.3}] in linear RGB", c[0], c[1], c[2]));
        }
    }
    notes
}

/// Threads of one direction before they are laid side by side.
struct Direction<'a> {
    name: &'static str,
    sizes: Vec<Size>,
    /// What the WIF file says of them.
    file: Option<&'a wif::Threads>,
}

impl<'a> Direction<'a> {
    fn read(
        values: &GeometryValues,
        keys: Keys,
        count: usize,
        file: Option<&'a wif::Threads>,
        unit_mm: f64,
        notes: &mut Vec<String>,
    ) -> Result<Self> {
        Ok(Self { name: keys.0, sizes: sizes(values, keys, count, file, unit_mm, notes)?, file })
    }

    fn colour(&self, k: usize) -> Option<u32> {
        self.file.and_then(|t| t.colour.as_ref()).map(|c| c[k])
    }

    /// Whether two threads have one size and one colour.
    fn alike(&self, a: usize, b: usize) -> bool {
        self.sizes[a] == self.sizes[b] && self.colour(a) == self.colour(b)
    }

    fn check_colours(&self, values: &GeometryValues) -> Result<()> {
        let used: BTreeSet<&u32> = self.file.iter().flat_map(|f| f.colour.iter().flatten()).collect();
        if used.len() > MAX_COLOURS {
            let problem = format!("the file's threads have {} colours, more than {MAX_COLOURS}", used.len());
            return Err(values.error_at("wif", problem, "write `parts = \"by-direction\"`"));
        }
        Ok(())
    }

    /// The first `count` threads side by side from 0, and where the last one's room ends. Adds a part for each colour.
    fn side_by_side(&self, count: usize, parts: &mut Vec<String>) -> (Vec<Thread>, f64) {
        let used: BTreeSet<Option<u32>> = (0..count).map(|k| self.colour(k)).collect();
        let first = parts.len();
        parts.extend(used.iter().map(|c| c.map_or(self.name.to_owned(), |c| format!("{}-{c}", self.name))));
        let mut edge = 0.0;
        let thread = |k: usize| {
            let size = &self.sizes[k];
            let place = first + used.iter().position(|&c| c == self.colour(k)).expect("every colour is in the set");
            let part = u16::try_from(place).expect("MAX_COLOURS of each direction fit");
            edge += size.spacing;
            Thread { centre: edge - 0.5 * size.spacing, width: size.width, height: size.height, part }
        };
        let threads = (0..count).map(thread).collect();
        (threads, edge)
    }
}

/// The draft, and the WIF file it came from.
fn read_draft(values: &GeometryValues, colours: bool) -> Result<(Draft, Option<Wif>)> {
    let given: Vec<&str> = ["weave", "draft", "wif"].into_iter().filter(|&k| values.has(k)).collect();
    if let [_, second, ..] = given[..] {
        return Err(values.error_at(second, format!("{} are given together", given.join(" and ")), "keep one of them"));
    }
    let word = if given.iter().any(|&k| k != "weave") { None } else { values.choice("weave") };
    let name = given.first().copied().unwrap_or("weave");
    let (over, under, shift) = (values.whole("over"), values.whole("under"), values.whole("shift"));
    let defaults = match word {
        Some("twill") => (2, 2, 1),
        Some("satin") => (4, 1, 2),
        _ => {
            for (key, value) in [("over", over), ("under", under), ("shift", shift)] {
                if value.is_some() {
                    let problem = format!("this {name} has no such key");
                    return Err(values.error_at(key, problem, "remove it, or write `weave = \"twill\"` or \"satin\""));
                }
            }
            (1, 1, 1)
        }
    };
    if let Some(path) = values.path("wif")? {
        let file = wif::read(path, colours)?;
        return Ok((file.draft.clone(), Some(file)));
    }
    if let Some(rows) = values.texts("draft") {
        let columns = rows.first().map_or(0, |r| r.len());
        if columns == 0 || rows.iter().any(|r| r.len() != columns || r.bytes().any(|c| c != b'0' && c != b'1')) {
            return Err(values.error_at("draft", "the rows are not texts of 0 and 1 of one length", "write it like [\"10\", \"01\"]"));
        }
        return Ok((Draft::from_fn(columns, rows.len(), |i, j| rows[j].as_bytes()[i] == b'1'), None));
    }
    let (over, under, shift) = (over.unwrap_or(defaults.0), under.unwrap_or(defaults.1), shift.unwrap_or(defaults.2));
    let repeat = over + under;
    if shift >= repeat {
        return Err(values.error_at("shift", format!("{shift} is not below over + under"), format!("write 1 to {}", repeat - 1)));
    }
    if word == Some("satin") && (over.min(under) != 1 || shift < 2 || shift + 2 > repeat || gcd(shift, repeat) != 1) {
        let problem = format!("over {over}, under {under}, shift {shift} make no satin");
        let remedy = "one of over and under is 1; shift is 2 or more, two less than their sum at most, and shares no divisor with it";
        return Err(values.error_at("weave", problem, remedy));
    }
    Ok((Draft::shifted(over, under, shift), None))
}

/// Room and section of one thread.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Size {
    spacing: f64,
    width: f64,
    height: f64,
}

/// Keys of one direction: its name, width, gap and height.
type Keys = (&'static str, [&'static str; 3]);
const WARP_KEYS: Keys = ("warp", ["warp_width", "warp_gap", "warp_height"]);
const WEFT_KEYS: Keys = ("weft", ["weft_width", "weft_gap", "weft_height"]);

/// Sizes of the threads of one direction: from the material file, else from the WIF file, else the defaults.
fn sizes(
    values: &GeometryValues,
    (name, [width_key, gap_key, height_key]): Keys,
    count: usize,
    file: Option<&wif::Threads>,
    unit_mm: f64,
    notes: &mut Vec<String>,
) -> Result<Vec<Size>> {
    let (width, gap, height) = (values.optional(width_key), values.optional(gap_key), values.optional(height_key));
    let in_unit = |list: Option<&Vec<f64>>, k: usize| list.map(|l| l[k] / unit_mm);
    let default_width = values.number(width_key);
    // A file with spacing alone: the threads fill it as the defaults do.
    let default_fill = default_width / (default_width + values.number(gap_key));
    let mut narrowed = 0;
    let mut sizes = Vec::with_capacity(count);
    for k in 0..count {
        let file_spacing = in_unit(file.and_then(|f| f.spacing.as_ref()), k);
        let file_width = in_unit(file.and_then(|f| f.thickness.as_ref()), k);
        let own = width.or(file_width).or(file_spacing.map(|s| s * default_fill)).unwrap_or(default_width);
        let spacing = match (gap, file_spacing) {
            (Some(gap), _) => own + gap,
            (None, Some(spacing)) => spacing,
            (None, None) => own / default_fill,
        };
        narrowed += usize::from(own > spacing);
        let own = own.min(spacing);
        sizes.push(Size { spacing, width: own, height: height.unwrap_or(own / 3.0) });
    }
    if narrowed > 0 {
        notes.push(format!("{narrowed} {name} threads are thicker than their spacing: they are narrowed to it"));
    }
    Ok(sizes)
}
