//! Strips of a weave as they are drawn: cut all round, marked where they go under, with their names at both ends.

use super::findings::Findings;
use super::page::{DRAWN, Kind, Page};
use super::read_pattern::ReadPattern;
use crate::polygon::contains;
use glam::DVec2;

/// What is wrong with what is drawn of the strips, in words.
pub(super) fn check(seen: &ReadPattern) -> Vec<String> {
    let mut findings = Findings::default();
    // The strips of each page, as cut lines name them.
    for (number, drawn) in seen.drawn.iter().enumerate() {
        let mut page = Page::new(number + 1, drawn, false, &mut findings);
        let here: Vec<&(String, Vec<DVec2>)> = seen.strips.iter().filter(|(name, _)| seen.strip_page.get(name) == Some(&number)).collect();
        for (name, corners) in here {
            strip(&mut page, seen, name, corners);
        }
    }
    findings.lines()
}

fn strip(page: &mut Page<'_>, seen: &ReadPattern, name: &str, corners: &[DVec2]) {
    let what = format!("the cut line of {name}");
    if let Some(mark) = page.one(&format!("cut {name} 1"), &what) {
        page.line(mark, corners, Kind::Cut, "cut", &what);
        let closed = matches!(&mark.shape, super::drawn::Shape::Line { paths, .. } if paths.iter().all(|(_, closed)| *closed));
        if !closed {
            page.wrong("not cut", what);
        }
    }
    let what = format!("the name of {name}");
    let names = page.all(&format!("strip-name {name}"));
    let ends = [0.5 * (corners[0] + corners[3]), 0.5 * (corners[1] + corners[2])];
    let right =
        |at: DVec2, words: &str| words.replace(' ', "-") == name && contains(corners, at) && ends.iter().any(|e| e.distance(at) < 8.0);
    let mut count = 0;
    for mark in names {
        if page.text(mark, &what).is_some_and(|(words, at, _)| right(at, words)) {
            count += 1;
        }
    }
    if count != 2 {
        page.wrong("says something else", what);
    }
    for (k, (_, over, polygon)) in seen.crossings.iter().filter(|c| c.0 == name).enumerate() {
        let what = format!("crossing {} of {name}", k + 1);
        if let Some(mark) = page.one(&format!("crossing {name} {}", k + 1), &what) {
            let colour = if let super::drawn::Shape::Fill { colour, .. } = &mark.shape { *colour } else { [0; 3] };
            page.fill(mark, polygon, if *over { colour } else { [255; 3] }, &what);
        }
        let mark = page.maybe(&format!("under {name} {}", k + 1), &what);
        let middle = polygon.iter().sum::<DVec2>() / polygon.len().max(1) as f64;
        let told =
            mark.is_some_and(|m| page.text(m, &what).is_some_and(|(words, at, _)| words == "u" && at.distance(middle) < 1.0 + DRAWN));
        if told == *over {
            page.wrong("says something else", format!("{what}: it goes {}", if *over { "over" } else { "under" }));
        }
    }
}
