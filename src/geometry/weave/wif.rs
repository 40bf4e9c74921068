//! WIF: the Weaving Information File of weaving programs (version 1.1, 1997), an INI file.
//!
//! What is read: threading with either treadling and tie-up or a lift plan, which give the draft; colours with their table;
//! spacing and thickness of the threads. Real files are loose: there are lines before the first section, comments, keys without
//! values, sections in any order; all that is taken as it is meant. A draft that names shafts, treadles or colours which do not
//! exist is refused.

use super::draft::{Draft, MAX_CROSSINGS};
use crate::bounded_file::{MAX_TEXT_BYTES, read_bounded};
use crate::error::{BadInput, Result};
use crate::text_file::decode;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// Most threads of one direction; the widest looms have a tenth of it.
const MAX_THREADS: u32 = 100_000;
/// Most shafts or treadles; the largest looms have 40.
const MAX_SHAFTS: u32 = 1_000;

/// A weave as a WIF file describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wif {
    /// Where the warp lies over. Warp thread 1 is column 0, weft thread 1 row 0.
    pub draft: Draft,
    /// The warp threads.
    pub warp: Threads,
    /// The weft threads.
    pub weft: Threads,
    /// Linear RGB of each palette entry.
    pub palette: BTreeMap<u32, [f64; 3]>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// What a WIF file says about the threads of one direction.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Threads {
    /// Palette entry of each thread, if the file has colours.
    pub colour: Option<Vec<u32>>,
    /// Distance that each thread takes up, in mm, if the file says it.
    pub spacing: Option<Vec<f64>>,
    /// Thickness of each thread, in mm, if the file says it.
    pub thickness: Option<Vec<f64>>,
}

/// Reads a WIF file; without `colours` the file's colours are not looked at.
///
/// # Errors
/// Bad input names the line where there is one.
pub fn read(path: &Path, colours: bool) -> Result<Wif> {
    let bytes = read_bounded(path, MAX_TEXT_BYTES, "no draft is so long: this is something else")?;
    parse(&bytes, colours).map_err(|bad| bad.in_file(path).into())
}

/// Parses the bytes of a WIF file.
pub(super) fn parse(bytes: &[u8], colours: bool) -> Result<Wif, BadInput> {
    let mut file = Sections::parse(bytes)?;
    let mut notes = std::mem::take(&mut file.notes);
    let weaving = file.required("weaving")?;
    let declared = weaving.count("shafts", MAX_SHAFTS)?;
    let (warp, weft) = (file.required("warp")?, file.required("weft")?);
    let columns = file.required("threading")?.threads("warp", warp.count("threads", MAX_THREADS)?, &mut notes)?;
    let Some(lifts) = file.get("liftplan").or(file.get("treadling")) else {
        return Err(BadInput::new("there is neither [TREADLING] nor [LIFTPLAN]", "a draft needs one of them"));
    };
    let rows = lifts.threads("weft", weft.count("threads", MAX_THREADS)?, &mut notes)?;
    if columns as usize * rows as usize > MAX_CROSSINGS {
        let problem = format!("{columns} x {rows} threads cross more than {MAX_CROSSINGS} times");
        return Err(BadInput::new(problem, "use one repeat of the draft").at_line(warp.line));
    }
    let threading = file.required("threading")?.lists(columns, MAX_SHAFTS, "shaft", &mut notes)?;
    let lifted = lifted_shafts(&file, rows, declared, &mut notes)?;
    // The count of shafts is a remark in the header; what the threads use is the draft.
    let shafts = threading.iter().chain(&lifted).flatten().copied().fold(declared, u32::max);
    if shafts > declared {
        notes.push(format!("the draft uses shaft {shafts} where the file announces {declared}"));
    }
    let unthreaded = threading.iter().filter(|shafts| shafts.is_empty()).count();
    if unthreaded > 0 {
        notes.push(format!("{unthreaded} warp threads are on no shaft: they always lie under"));
    }
    let mut raised = vec![false; shafts as usize + 1];
    let mut warp_over = Vec::with_capacity(columns as usize * rows as usize);
    for lift in &lifted {
        raised.fill(false);
        lift.iter().for_each(|&s| raised[s as usize] = true);
        warp_over.extend(threading.iter().map(|on| on.iter().any(|&s| raised[s as usize])));
    }
    let draft = Draft { columns: columns as usize, rows: rows as usize, warp_over };
    let palette = if colours { file.palette()? } else { BTreeMap::new() };
    let mut threads = |name: &str, section: &Section, count: u32| -> Result<Threads, BadInput> {
        Ok(Threads {
            colour: if colours { file.colours(name, section, count, &palette, &mut notes)? } else { None },
            spacing: file.sizes(name, "spacing", section, count, &mut notes)?,
            thickness: file.sizes(name, "thickness", section, count, &mut notes)?,
        })
    };
    let (warp, weft) = (threads("warp", warp, columns)?, threads("weft", weft, rows)?);
    Ok(Wif { draft, warp, weft, palette, notes })
}

/// For each weft the shafts that are up.
fn lifted_shafts(file: &Sections, rows: u32, shafts: u32, notes: &mut Vec<String>) -> Result<Vec<Vec<u32>>, BadInput> {
    let (lift_plan, treadling, tie_up) = (file.get("liftplan"), file.get("treadling"), file.get("tieup"));
    match (lift_plan, treadling, tie_up) {
        (Some(plan), ..) => {
            if treadling.is_some() {
                notes.push("the file has a lift plan and a treadling: the lift plan is used".into());
            }
            plan.lists(rows, MAX_SHAFTS, "shaft", notes)
        }
        (None, Some(treadling), Some(tie_up)) => {
            let weaving = file.required("weaving")?;
            let treadles = weaving.count("treadles", MAX_SHAFTS)?;
            let rising = weaving.get("rising shed").is_none_or(|e| truth(&e.value));
            let tied = tie_up.lists(treadles, MAX_SHAFTS, "shaft", notes)?;
            let pressed = treadling.lists(rows, treadles, "treadle", notes)?;
            let lift = |treadles: &Vec<u32>| {
                let moved: Vec<u32> = treadles.iter().flat_map(|&t| tied[t as usize - 1].iter().copied()).collect();
                if rising { moved } else { (1..=shafts).filter(|s| !moved.contains(s)).collect() }
            };
            Ok(pressed.iter().map(lift).collect())
        }
        (None, Some(treadling), None) => {
            Err(BadInput::new("there is a [TREADLING] without a [TIEUP]", "add the tie-up, or a [LIFTPLAN]").at_line(treadling.line))
        }
        (None, None, _) => unreachable!("parse has looked for one of them"),
    }
}

/// One `key=value` line.
struct Entry {
    value: String,
    line: usize,
}

struct Section {
    name: String,
    line: usize,
    entries: HashMap<String, Entry>,
}

struct Sections {
    sections: HashMap<String, Section>,
    /// What the user should know of the sections themselves.
    notes: Vec<String>,
}

/// A WIF boolean.
fn truth(word: &str) -> bool {
    matches!(&*word.to_ascii_lowercase(), "true" | "on" | "yes" | "1")
}

impl Sections {
    fn parse(bytes: &[u8]) -> Result<Self, BadInput> {
        let text = decode(bytes);
        let mut notes = Vec::new();
        let mut sections: HashMap<String, Section> = HashMap::new();
        let mut current: Option<String> = None;
        for (number, line) in (1..).zip(text.lines()) {
            let line = line.trim();
            if line.is_empty() || line.starts_with(';') {
                continue;
            }
            if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
                let key = name.trim().to_ascii_lowercase();
                let new = || Section { name: name.trim().to_ascii_uppercase(), line: number, entries: HashMap::new() };
                sections.entry(key.clone()).or_insert_with(new);
                current = Some(key);
            } else if let Some(section) = current.as_ref().and_then(|key| sections.get_mut(key)) {
                // A key without "=" has no value: its default holds.
                let (key, value) = line.split_once('=').unwrap_or((line, ""));
                let value = value.split(';').next().unwrap_or_default().trim().to_owned();
                let key = key.trim().to_ascii_lowercase();
                // Some programs write "001=1".
                let key = key.parse::<u32>().map_or(key, |number| number.to_string());
                let twice = section.entries.insert(key.clone(), Entry { value, line: number });
                if let Some(first) = twice.filter(|first| first.value != section.entries[&key].value) {
                    notes.push(format!("[{}] has \"{key}\" in lines {} and {number}: the last one counts", section.name, first.line));
                }
            }
        }
        // Some programs leave [WIF] away; the other two are what a draft is made of.
        if !sections.contains_key("wif") {
            if !["weaving", "threading"].iter().all(|name| sections.contains_key(*name)) {
                return Err(BadInput::new("there is no [WIF] section, and no [WEAVING] with a [THREADING]", "this is not a WIF file"));
            }
            notes.push("the file lacks its [WIF] line".to_owned());
        }
        Ok(Self { sections, notes })
    }

    fn get(&self, name: &str) -> Option<&Section> {
        self.sections.get(name)
    }

    fn required(&self, name: &str) -> Result<&Section, BadInput> {
        let missing = || BadInput::new(format!("there is no [{}] section", name.to_ascii_uppercase()), "a draft needs it");
        self.get(name).ok_or_else(missing)
    }

    /// Linear RGB of the colour table; empty without one.
    fn palette(&self) -> Result<BTreeMap<u32, [f64; 3]>, BadInput> {
        let Some(table) = self.get("color table") else { return Ok(BTreeMap::new()) };
        let (low, high) = match self.get("color palette").and_then(|s| s.get("range")) {
            None => (0.0, 255.0),
            Some(entry) => match entry.numbers()?[..] {
                [low, high] if low < high => (low, high),
                _ => return Err(entry.bad("is not a range", "write Range=0,255")),
            },
        };
        let mut palette = BTreeMap::new();
        for (key, entry) in &table.entries {
            let place: u32 = key.parse().map_err(|_| entry.bad("stands under a key that is no number", "number the colours from 1"))?;
            let [r, g, b] = entry.numbers()?[..] else { return Err(entry.bad("is not a colour", "write three numbers")) };
            if [r, g, b].iter().any(|v| !(low..=high).contains(v)) {
                return Err(entry.bad("is outside the palette's range", &format!("write numbers from {low} to {high}")));
            }
            let linear = [r, g, b].map(|v| crate::numerics::colour::srgb_to_linear((v - low) / (high - low)));
            palette.insert(place, linear);
        }
        Ok(palette)
    }

    /// Palette entry of each thread; `None` if the file gives no colours to this direction.
    fn colours(
        &self,
        name: &str,
        section: &Section,
        count: u32,
        palette: &BTreeMap<u32, [f64; 3]>,
        notes: &mut Vec<String>,
    ) -> Result<Option<Vec<u32>>, BadInput> {
        let default = section.get("color").filter(|e| !e.value.is_empty());
        let own = self.get(&format!("{name} colors"));
        if default.is_none() && own.is_none() {
            return Ok(None);
        }
        let check = |entry: &Entry| -> Result<u32, BadInput> {
            // "Color=3,255,0,0" repeats the colour after its index.
            let first = entry.value.split(',').next().unwrap_or_default().trim();
            match first.parse::<u32>() {
                Ok(place) if palette.contains_key(&place) => Ok(place),
                _ => Err(entry.bad(
                    "is not an entry of the [COLOR TABLE]",
                    &format!("use one of its {} entries, or write `parts = \"by-direction\"` to use no colours", palette.len()),
                )),
            }
        };
        let mut without = 0;
        let mut colours = Vec::with_capacity(count as usize);
        for thread in 1..=count {
            let entry = own.and_then(|s| s.get(&thread.to_string())).filter(|e| !e.value.is_empty()).or(default);
            colours.push(match entry {
                Some(entry) => check(entry)?,
                None => {
                    without += 1;
                    let first = palette.keys().next();
                    *first.ok_or_else(|| BadInput::new("there is no [COLOR TABLE]", "add one").at_line(section.line))?
                }
            });
        }
        if without > 0 {
            notes.push(format!("{without} {name} threads have no colour: they take the first of the colour table"));
        }
        Ok(Some(colours))
    }

    /// Spacing or thickness of each thread, in mm.
    fn sizes(&self, name: &str, what: &str, section: &Section, count: u32, notes: &mut Vec<String>) -> Result<Option<Vec<f64>>, BadInput> {
        let own = self.get(&format!("{name} {what}"));
        let default = section.get(what).filter(|e| !e.value.is_empty());
        if own.is_none() && default.is_none() {
            return Ok(None);
        }
        let millimetres = match section.get("units").map(|e| (e.value.to_ascii_lowercase(), e)) {
            Some((unit, _)) if unit.starts_with("cent") || unit == "cm" => 10.0,
            Some((unit, _)) if unit.starts_with("inch") => 25.4,
            // A point is 1/72 inch, a decipoint a tenth of it.
            Some((unit, _)) if unit.starts_with("decip") => 25.4 / 720.0,
            Some((_, entry)) => return Err(entry.bad("is not a unit", "write Units=centimeters, inches or decipoints")),
            None => {
                notes.push(format!("the {name}'s {what} is not used: the file gives no Units"));
                return Ok(None);
            }
        };
        let size = |entry: &Entry| -> Result<f64, BadInput> {
            let value = entry.value.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0 && *v < 1e6);
            Ok(millimetres * value.ok_or_else(|| entry.bad(&format!("is not a {what}"), "write a positive number"))?)
        };
        let mut sizes = Vec::with_capacity(count as usize);
        for thread in 1..=count {
            let entry = own.and_then(|s| s.get(&thread.to_string())).filter(|e| !e.value.is_empty()).or(default);
            match entry {
                Some(entry) => sizes.push(size(entry)?),
                None => {
                    notes.push(format!("the {name}'s {what} is not used: thread {thread} has none"));
                    return Ok(None);
                }
            }
        }
        Ok(Some(sizes))
    }
}

impl Section {
    fn get(&self, key: &str) -> Option<&Entry> {
        self.entries.get(key)
    }

    /// A count from 1 to `max`.
    fn count(&self, key: &str, max: u32) -> Result<u32, BadInput> {
        let remedy = format!("write {key}= with a whole number from 1 to {max}");
        let Some(entry) = self.get(key) else {
            return Err(BadInput::new(format!("[{}] has no {key}", self.name), remedy).at_line(self.line));
        };
        entry.value.parse().ok().filter(|n| (1..=max).contains(n)).ok_or_else(|| entry.bad(&format!("is not the number of {key}"), &remedy))
    }

    /// Threads of the draft: those that this threading, treadling or lift plan goes up to, at most the `announced` ones.
    fn threads(&self, name: &str, announced: u32, notes: &mut Vec<String>) -> Result<u32, BadInput> {
        let last = self.entries.keys().filter_map(|k| k.parse::<u32>().ok()).max().unwrap_or(0);
        if last == 0 {
            return Err(BadInput::new(format!("[{}] is empty", self.name), "number its threads from 1").at_line(self.line));
        }
        if last < announced {
            notes
                .push(format!("the file announces {announced} {name} threads, but its [{}] ends after {last}: those are woven", self.name));
        }
        Ok(last.min(announced))
    }

    /// The lists under the keys 1 to `count`, of numbers from 1 to `max`; a missing key is an empty list, and so is 0. Keys beyond the
    /// count are not used.
    fn lists(&self, count: u32, max: u32, what: &str, notes: &mut Vec<String>) -> Result<Vec<Vec<u32>>, BadInput> {
        let beyond = |(key, entry): &(&String, &Entry)| {
            !key.parse::<u32>().is_ok_and(|k| (1..=count).contains(&k)) && entry.value.chars().any(|c| ('1'..='9').contains(&c))
        };
        let unused = self.entries.iter().filter(beyond).count();
        if unused > 0 {
            notes.push(format!("{unused} lines of [{}] are not used: there are {count}", self.name));
        }
        let list = |key: u32| -> Result<Vec<u32>, BadInput> {
            let Some(entry) = self.get(&key.to_string()) else { return Ok(Vec::new()) };
            let mut list = Vec::new();
            for word in entry.value.split(',').map(str::trim).filter(|w| !w.is_empty()) {
                match word.parse::<u32>() {
                    Ok(0) => {}
                    Ok(number) if number <= max => list.push(number),
                    _ => return Err(entry.bad(&format!("names a {what} that does not exist"), &format!("use 1 to {max}"))),
                }
            }
            Ok(list)
        };
        (1..=count).map(list).collect()
    }
}

impl Entry {
    fn bad(&self, what: &str, remedy: &str) -> BadInput {
        BadInput::new(format!("\"{}\" {what}", self.value), remedy).at_line(self.line)
    }

    fn numbers(&self) -> Result<Vec<f64>, BadInput> {
        let number = |word: &str| word.trim().parse::<f64>().ok().filter(|v| v.is_finite());
        self.value.split(',').map(number).collect::<Option<_>>().ok_or_else(|| self.bad("is not a list of numbers", "write numbers"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const TWILL: &str = "noise\n[WIF]\nVersion=1.1\n[WEAVING]\nShafts=4\nTreadles=4\nRising Shed=yes\n[WARP]\nThreads=4\nUnits=inches\nSpacing=0.1\n\
        Color=2\n[WEFT]\nThreads=4\nUnits=centimeters\nSpacing=0.3\nThickness=.2\nColor=1\n[WEFT SPACING]\n2=0.6\n[COLOR PALETTE]\nRange=0,100\n\
        [COLOR TABLE]\n1=0,50,100\n2=100,100,100\n[WARP COLORS]\n3=1\n[THREADING]\n1=1\n2=2\n3=3\n4=4\n[TIEUP]\n1=1,2\n2=2,3\n3=3,4\n4=4,1\n\
        ; a comment\n[TREADLING]\n1=1\n2=2\n3=3\n4=4\n";

    #[test]
    fn a_twill_comes_out_with_its_colours_and_sizes() {
        let wif = parse(TWILL.as_bytes(), true).unwrap();
        assert_eq!(wif.draft, Draft::shifted(2, 2, 1));
        assert_eq!((wif.warp.colour, wif.weft.colour), (Some(vec![2, 2, 1, 2]), Some(vec![1; 4])));
        assert_eq!(wif.warp.spacing.unwrap(), [2.54; 4]);
        assert_eq!(wif.weft.spacing.unwrap(), [3.0, 6.0, 3.0, 3.0]);
        assert_eq!((wif.warp.thickness, wif.weft.thickness), (None, Some(vec![2.0; 4])));
        // sRGB 0.5 is linear 0.214.
        assert!((wif.palette[&1][1] - 0.214_041_14).abs() < 1e-6 && wif.palette[&2] == [1.0; 3]);
    }

    #[test]
    fn a_sinking_shed_turns_the_draft_over_and_a_lift_plan_replaces_treadles() {
        let sinking = parse(TWILL.replace("Rising Shed=yes", "Rising Shed=false").as_bytes(), true).unwrap();
        assert_eq!(sinking.draft, Draft::from_fn(4, 4, |i, j| !Draft::shifted(2, 2, 1).over(i, j)));
        let plan = TWILL.replace("[TREADLING]\n1=1\n2=2\n3=3\n4=4\n", "[LIFTPLAN]\n1=1,2\n2=2,3\n3=3,4\n4=4,1,0\n");
        assert_eq!(parse(plan.as_bytes(), true).unwrap().draft, Draft::shifted(2, 2, 1));
    }

    #[test]
    fn mistakes_are_reported_with_their_line() {
        for (from, to, part) in [
            ("[WEAVING]", "[KNITTING]", "no [WEAVING]"),
            ("Shafts=4", "Shafts=many", "many"),
            ("Shafts=4", "Shafts=1001", "1001"),
            ("4=4,1", "4=4,1001", "names a shaft that does not exist"),
            ("Treadles=4", "Treadles=3", "names a treadle that does not exist"),
            ("[WARP]\nThreads=4", "[WARP]\nThreads=4000000000", "4000000000"),
            ("Threads=4", "Treads=4", "no threads"),
            ("Units=inches", "Units=furlongs", "furlongs"),
            ("Spacing=0.1", "Spacing=-0.1", "-0.1"),
            ("Color=2", "Color=3", "[COLOR TABLE]"),
            ("1=0,50,100", "1=0,50", "not a colour"),
            ("1=0,50,100", "1=0,50,101", "outside"),
            ("Range=0,100", "Range=100,0", "not a range"),
            ("[TIEUP]", "[TIEDOWN]", "without a [TIEUP]"),
            ("[TREADLING]", "[PEDALLING]", "neither"),
            ("[THREADING]", "[SLEYING]", "no [THREADING]"),
        ] {
            match parse(TWILL.replacen(from, to, 1).as_bytes(), true) {
                Err(bad) => assert!(bad.problem.contains(part), "{to:?} gave {bad}"),
                Ok(_) => panic!("{to:?} was accepted"),
            }
        }
    }

    #[test]
    fn a_header_that_counts_too_few_shafts_or_threads_is_noted() {
        let few = parse(TWILL.replace("Shafts=4", "Shafts=3").as_bytes(), true).unwrap();
        assert_eq!(few.draft, Draft::shifted(2, 2, 1));
        assert_eq!(few.notes, ["the draft uses shaft 4 where the file announces 3"]);
        let short = parse(TWILL.replace("[WEFT]\nThreads=4", "[WEFT]\nThreads=3").as_bytes(), true).unwrap();
        assert_eq!((short.draft.rows, short.notes), (3, vec!["1 lines of [TREADLING] are not used: there are 3".to_owned()]));
    }

    #[test]
    fn numbers_with_leading_zeros_and_lines_that_are_lacking_or_twice_are_as_meant() {
        let zeros = TWILL.replace("\n1=", "\n001=").replace("\n4=", "\n0004=");
        let wif = parse(zeros.as_bytes(), true).unwrap();
        assert_eq!((wif.draft, wif.notes.len()), (Draft::shifted(2, 2, 1), 0));
        assert_eq!((wif.warp.colour, wif.weft.spacing), (Some(vec![2, 2, 1, 2]), Some(vec![3.0, 6.0, 3.0, 3.0])));
        let bare = parse(TWILL.replace("[WIF]\nVersion=1.1\n", "").as_bytes(), true).unwrap();
        assert_eq!((bare.draft, bare.notes), (Draft::shifted(2, 2, 1), vec!["the file lacks its [WIF] line".to_owned()]));
        let twice = parse(TWILL.replace("[TIEUP]\n", "[TIEUP]\n01=3\n").as_bytes(), true).unwrap();
        assert!(twice.notes[0].contains("has \"1\" in lines 34 and 35"), "{:?}", twice.notes);
        for form in [TWILL.replace('\n', "\r").into_bytes(), format!("\u{feff}{}", &TWILL[6..]).into_bytes()] {
            assert_eq!(parse(&form, true).unwrap().draft, Draft::shifted(2, 2, 1));
        }
        for text in ["", "[WEAVING]\nShafts=2\n", "[THREADING]\n1=1\n"] {
            let Err(bad) = parse(text.as_bytes(), true) else { panic!("{text:?} was accepted") };
            assert!(bad.problem.contains("no [WIF] section"), "{bad}");
        }
    }

    #[test]
    fn colours_that_are_not_asked_for_are_not_checked() {
        let wif = parse(TWILL.replace("Color=2", "Color=3").as_bytes(), false).unwrap();
        assert_eq!((wif.warp.colour, wif.palette.len()), (None, 0));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 2_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn damaged_files_never_panic(damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6), cut in any::<prop::sample::Index>()) {
            let mut bytes = TWILL.as_bytes().to_vec();
            for (place, byte) in damage {
                let place = place.index(bytes.len());
                bytes[place] = byte;
            }
            bytes.truncate(cut.index(bytes.len()) + 1);
            let _ = parse(&bytes, true);
        }
    }
}
