//! `kind = "weave"`: cloth of warp and weft threads after any binary draft.
//!
//! Warp threads run along y, weft threads along x. Sections are ellipses, measured upright (width along the cloth, height along z).
//! Centre lines lie at `+a` where a thread is over and `-a` where it is under, flat while it floats, with a cosine between. The
//! amplitudes of warp and weft add up to the `crimp`, the distance of their centre lines where they cross; by default just so much that
//! the threads do not meet along their middle lines. There is no backing: gaps are see-through.

pub mod draft;
pub mod wif;

use super::Tile;
use super::builder::TileBuilder;
use super::params::{Param, Unit, Value, choice, derived, number, scaled, whole};
use super::values::GeometryValues;
use crate::error::Result;
use crate::toml_reader::range;
use draft::{Draft, gcd};
use glam::{DVec2, DVec3};
use std::collections::BTreeSet;
use std::f64::consts::{PI, TAU};
use wif::Wif;

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

/// The crimp by default is at most this factor of what keeps straight threads apart: where threads touch side by side they meet at the
/// corners of every crossing however strong they are bent.
const MAX_DEFAULT_CRIMP: f64 = 1.5;

/// Keeps the polygons of the sections apart, not only their ellipses: chords along a bend cut its inside.
const CLEARANCE: f64 = 1.02;

/// A share of the smaller height by which threads may meet without a note.
const QUIET_OVERLAP: f64 = 0.05;

/// Most colours of one direction that become parts.
const MAX_COLOURS: usize = 1000;

/// Cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct Weave {
    /// Where the warp lies over.
    pub draft: Draft,
    /// One thread a column of the draft.
    pub warp: Vec<Thread>,
    /// One thread a row of the draft.
    pub weft: Vec<Thread>,
    /// Size of the repeat.
    pub period: DVec2,
    /// Distance between the centre lines of warp and weft where they cross.
    pub crimp: f64,
    /// Share of the crimp by which the warp bends, 0 to 1.
    pub crimp_share: f64,
    /// Sides of a section.
    pub segments: u32,
    /// Pieces along each bend.
    pub steps: u32,
    /// Names of the parts.
    pub parts: Vec<String>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// One thread.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    /// Place of its centre line across its direction.
    pub centre: f64,
    /// Width of its section.
    pub width: f64,
    /// Height of its section.
    pub height: f64,
    /// Place in [`Weave::parts`].
    pub part: u16,
}

impl Weave {
    pub(super) fn read(values: &GeometryValues, unit_mm: f64) -> Result<Self> {
        let by_colour = values.choice("parts") != Some("by-direction");
        let (draft, file) = read_draft(values, by_colour)?;
        if values.choice("parts") == Some("by-colour") && file.as_ref().is_none_or(|f| f.palette.is_empty()) {
            return Err(values.error_at("parts", "there are no colours to name parts by", "give a `wif` with colours, or remove it"));
        }
        let mut notes = Vec::new();
        let (warp_wif, weft_wif) = file.as_ref().map_or((None, None), |f| (Some(&f.warp), Some(&f.weft)));
        let warp_sizes = sizes(values, WARP_KEYS, draft.columns, warp_wif, unit_mm, &mut notes)?;
        let weft_sizes = sizes(values, WEFT_KEYS, draft.rows, weft_wif, unit_mm, &mut notes)?;
        let colour = |threads: Option<&wif::Threads>, k: usize| threads.and_then(|t| t.colour.as_ref()).map(|c| c[k]);
        // A repeat of the draft in which threads, sizes and colours repeat is the same cloth with fewer triangles.
        let columns = draft.column_period(|a, b| warp_sizes[a] == warp_sizes[b] && colour(warp_wif, a) == colour(warp_wif, b));
        let rows = draft.row_period(|a, b| weft_sizes[a] == weft_sizes[b] && colour(weft_wif, a) == colour(weft_wif, b));
        if (columns, rows) != (draft.columns, draft.rows) {
            notes.push(format!("the {} x {} threads of the draft repeat after {columns} x {rows}", draft.columns, draft.rows));
        }
        for threads in [warp_wif, weft_wif].into_iter().flatten() {
            let used: BTreeSet<&u32> = threads.colour.iter().flatten().collect();
            if used.len() > MAX_COLOURS {
                let problem = format!("the file's threads have {} colours, more than {MAX_COLOURS}", used.len());
                return Err(values.error_at("wif", problem, "write `parts = \"by-direction\"`"));
            }
        }
        let mut parts: Vec<String> = Vec::new();
        let mut lay = |name: &str, sizes: &[Size], threads: Option<&wif::Threads>| -> (Vec<Thread>, f64) {
            let used: BTreeSet<Option<u32>> = (0..sizes.len()).map(|k| colour(threads, k)).collect();
            let first = parts.len();
            parts.extend(used.iter().map(|c| c.map_or(name.to_owned(), |c| format!("{name}-{c}"))));
            let mut edge = 0.0;
            let mut thread = |(k, size): (usize, &Size)| {
                let place = first + used.iter().position(|&c| c == colour(threads, k)).expect("every colour is in the set");
                let part = u16::try_from(place).expect("MAX_COLOURS of each direction fit");
                edge += size.spacing;
                Thread { centre: edge - 0.5 * size.spacing, width: size.width, height: size.height, part }
            };
            let laid = sizes.iter().enumerate().map(&mut thread).collect();
            (laid, edge)
        };
        let (warp, period_x) = lay("warp", &warp_sizes[..columns], warp_wif);
        let (weft, period_y) = lay("weft", &weft_sizes[..rows], weft_wif);
        let draft = draft.cropped(columns, rows);
        let period = DVec2::new(period_x, period_y);
        if !(period.min_element() >= 1e-6 && period.max_element() <= 1e6) {
            let problem = format!("the period is {period_x} x {period_y}");
            return Err(values.error_at("warp_width", problem, "choose widths and gaps that give 1e-6 to 1e6"));
        }
        if let Some(file) = &file {
            notes.extend(file.notes.iter().cloned());
            for part in &parts {
                if let Some(c) = part.split_once('-').and_then(|(_, entry)| file.palette.get(&entry.parse().ok()?)) {
                    notes.push(format!("part {part}: the file's colour is [{:.3}, {:.3}, {:.3}] in linear RGB", c[0], c[1], c[2]));
                }
            }
        }
        let (loose_warps, loose_wefts) = draft.loose();
        if loose_warps + loose_wefts > 0 {
            notes.push(format!("{loose_warps} warp and {loose_wefts} weft threads never change sides: nothing holds them"));
        }
        let whole = |key| values.whole(key).expect("has a default");
        let mut weave = Self {
            draft,
            warp,
            weft,
            period,
            crimp: 0.0,
            crimp_share: values.number("crimp_share"),
            segments: whole("segments"),
            steps: whole("steps"),
            parts,
            notes,
        };
        weave.crimp = match values.optional("crimp") {
            Some(crimp) => crimp,
            None => weave.least_crimp(),
        };
        let (overlap, smallest) = weave.overlap();
        if overlap > QUIET_OVERLAP * smallest {
            weave.notes.push(format!("warp and weft meet where they cross: up to {overlap:.3e} of {smallest:.3e} high threads"));
        }
        Ok(weave)
    }

    /// Height of half a section over its middle, at a share of the half width.
    fn rise(share: f64) -> f64 {
        (1.0 - share * share).max(0.0).sqrt()
    }

    /// For each thread of one direction its width over the distance to its nearest neighbour, where threads across it bend.
    fn crowding(threads: &[Thread], period: f64) -> f64 {
        let n = threads.len();
        let to_next =
            |k: usize| if k + 1 < n { threads[k + 1].centre - threads[k].centre } else { threads[0].centre + period - threads[k].centre };
        (0..n).map(|k| threads[k].width / to_next(k).min(to_next((k + n - 1) % n))).fold(0.0, f64::max)
    }

    fn heights(&self) -> (f64, f64) {
        let highest = |threads: &[Thread]| threads.iter().map(|t| t.height).fold(0.0, f64::max);
        (highest(&self.warp), highest(&self.weft))
    }

    /// The smallest crimp with which threads do not meet along their middle lines, at the most crowded crossing.
    ///
    /// At a distance `t` half widths from a crossing's middle along the warp, the warp's centre line has fallen to `a cos(pi/2 crowding t)`
    /// while the weft under it still rises `rise(t)` half heights; and the same along the weft.
    fn least_crimp(&self) -> f64 {
        let (warp_height, weft_height) = self.heights();
        let straight = 0.5 * (warp_height + weft_height);
        let along = |share: f64, across: f64, crowding: f64| {
            let own = 0.5 * (warp_height + weft_height - across);
            let needed = |k: u32| {
                let t = f64::from(k) / 64.0;
                let bend = libm::cos(0.5 * PI * (crowding * t).min(1.0)).max(0.0);
                (own + 0.5 * across * Self::rise(t)) / (share * bend + (1.0 - share)).max(f64::MIN_POSITIVE)
            };
            (0..=64).map(needed).fold(0.0, f64::max)
        };
        let warp = along(self.crimp_share, weft_height, Self::crowding(&self.weft, self.period.y));
        let weft = along(1.0 - self.crimp_share, warp_height, Self::crowding(&self.warp, self.period.x));
        (CLEARANCE * warp.max(weft)).min(MAX_DEFAULT_CRIMP * straight)
    }

    /// How deep threads meet at most at a crossing, and the height of the thinner ones.
    fn overlap(&self) -> (f64, f64) {
        let (warp_height, weft_height) = self.heights();
        let (warp_crowding, weft_crowding) = (Self::crowding(&self.warp, self.period.x), Self::crowding(&self.weft, self.period.y));
        let bend = |crowding: f64, t: f64| libm::cos(0.5 * PI * (crowding * t).min(1.0));
        let grid = || (0..=64_u32).map(|k| f64::from(k) / 64.0);
        let depth = |(x, y): (f64, f64)| {
            let apart = self.crimp * (self.crimp_share * bend(weft_crowding, y) + (1.0 - self.crimp_share) * bend(warp_crowding, x));
            0.5 * (warp_height * Self::rise(x) + weft_height * Self::rise(y)) - apart
        };
        let deepest = grid().flat_map(|x| grid().map(move |y| (x, y))).map(depth).fold(0.0, f64::max);
        (deepest, warp_height.min(weft_height))
    }

    pub(super) fn build(&self) -> Result<Tile> {
        let side_of = |over: bool| if over { 1.0 } else { -1.0 };
        let warp_lines: Vec<Vec<f64>> =
            (0..self.warp.len()).map(|i| (0..self.weft.len()).map(|j| side_of(self.draft.over(i, j))).collect()).collect();
        let weft_lines: Vec<Vec<f64>> =
            (0..self.weft.len()).map(|j| (0..self.warp.len()).map(|i| -side_of(self.draft.over(i, j))).collect()).collect();
        let pieces = |sides: &Vec<f64>| -> f64 {
            let bends = (0..sides.len()).filter(|&k| sides[k] != sides[(k + 1) % sides.len()]).count();
            (sides.len() - bends) as f64 + bends as f64 * f64::from(self.steps)
        };
        let total: f64 = warp_lines.iter().chain(&weft_lines).map(pieces).sum();
        TileBuilder::check_size(2.0 * f64::from(self.segments) * total, "use fewer segments or steps, or a smaller draft")?;
        let mut builder = TileBuilder::new(self.period, self.parts.iter().cloned());
        self.notes.iter().for_each(|note| builder.note(note.clone()));
        let warp_amplitude = self.crimp_share * self.crimp;
        for (thread, sides) in self.warp.iter().zip(&warp_lines) {
            let line = self.centre_line(&self.weft, sides, warp_amplitude, self.period.y);
            // Along y the section turns from +x to +z: y × z = x is outward.
            self.tube(&mut builder, thread, &line, DVec3::new, false);
        }
        for (thread, sides) in self.weft.iter().zip(&weft_lines) {
            let line = self.centre_line(&self.warp, sides, self.crimp - warp_amplitude, self.period.x);
            self.tube(&mut builder, thread, &line, |across, along, z| DVec3::new(along, across, z), true);
        }
        builder.finish()
    }

    /// Points (along, z) of a centre line over one period, from the first crossing to its repetition.
    fn centre_line(&self, crossed: &[Thread], sides: &[f64], amplitude: f64, period: f64) -> Vec<(f64, f64)> {
        let n = crossed.len();
        let mut line = vec![(crossed[0].centre, amplitude * sides[0])];
        for k in 0..n {
            let (start, from) = (crossed[k].centre, sides[k]);
            let (end, to) = if k + 1 < n { (crossed[k + 1].centre, sides[k + 1]) } else { (crossed[0].centre + period, sides[0]) };
            if from != to {
                for step in 1..self.steps {
                    let t = f64::from(step) / f64::from(self.steps);
                    line.push((start + t * (end - start), amplitude * from * libm::cos(PI * t)));
                }
            }
            line.push((end, amplitude * to));
        }
        line
    }

    /// Sweeps an upright ellipse along a centre line.
    fn tube(&self, builder: &mut TileBuilder, thread: &Thread, line: &[(f64, f64)], place: impl Fn(f64, f64, f64) -> DVec3, flip: bool) {
        let section: Vec<(f64, f64)> = (0..self.segments)
            .map(|k| {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(self.segments));
                (0.5 * thread.width * cos, 0.5 * thread.height * sin)
            })
            .collect();
        let mut last: Option<Vec<u32>> = None;
        for &(along, z) in line {
            let ring: Vec<u32> = section.iter().map(|(a, b)| builder.vertex(place(thread.centre + a, along, z + b))).collect();
            if let Some(last) = &last {
                for k in 0..ring.len() {
                    let next = (k + 1) % ring.len();
                    let [a, b, c, d] = [last[k], ring[k], ring[next], last[next]];
                    builder.quad(thread.part, if flip { [a, d, c, b] } else { [a, b, c, d] });
                }
            }
            last = Some(ring);
        }
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
