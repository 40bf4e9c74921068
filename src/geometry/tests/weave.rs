//! Cloth: threads closed over the period, apart from each other, after the draft.

use super::*;
use std::path::PathBuf;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/wif").join(name)
}

fn with_wif(path: &Path, extra: &str) -> Result<SmallScale> {
    build_in(Path::new(""), &format!("kind = \"weave\"\nsegments = 6\nsteps = 3\nwif = '{}'\n{extra}", path.display()))
}

#[test]
fn thread_tubes_close_over_the_period() {
    for geometry in [
        "weave = \"plain\"",
        "weave = \"twill\"\nwarp_gap = 0.0\nweft_gap = 0.0",
        "weave = \"satin\"\nover = 7\nunder = 1\nshift = 3\nweft_width = 0.2",
        "draft = [\"110\", \"001\"]\ncrimp_share = 0.0",
        "draft = [\"1\"]",
    ] {
        let tile = build(&format!("kind = \"weave\"\n{geometry}"));
        assert_eq!(open_edges(&tile), 0, "{geometry}");
        assert!(projected(&tile).abs() < 1e-9, "{geometry}: tubes have as much underside as upper side");
        assert!(volume(&tile) > 0.0, "{geometry}: the tubes' outsides face out");
    }
}

/// Volume enclosed by tubes over one period, by the divergence theorem with z: the open ends are vertical and do not count.
fn volume(tile: &Tile) -> f64 {
    (0..tile.triangles.len()).map(|t| doubled(tile, t).z / 6.0 * tile.corners(t).iter().map(|c| c.z).sum::<f64>()).sum()
}

#[test]
fn upper_sides_cover_width_times_length_and_volume_is_that_of_the_sections() {
    let tile = build(
        "kind = \"weave\"\nweave = \"twill\"\nwarp_width = 0.4\nwarp_gap = 0.1\nweft_width = 0.3\nweft_gap = 0.2\nweft_height = 0.06\nsegments = 8",
    );
    assert_eq!(tile.period, DVec2::new(2.0, 2.0));
    let up = |part: &str| {
        let place = tile.parts.iter().position(|p| p == part).unwrap();
        let mine = (0..tile.triangles.len()).filter(|&t| usize::from(tile.part_of_triangle[t]) == place);
        mine.map(|t| 0.5 * doubled(&tile, t).z.max(0.0)).sum::<f64>()
    };
    assert_near(up("warp"), 4.0 * 0.4 * 2.0, 1e-12, "warp");
    assert_near(up("weft"), 4.0 * 0.3 * 2.0, 1e-12, "weft");
    // An inscribed octagon has 2 sqrt(2) / pi of its ellipse's area; upright sections keep the volume however threads bend.
    let section = |w: f64, h: f64| 2.0 * 2.0_f64.sqrt() * 0.25 * w * h;
    assert_near(volume(&tile), 8.0 * (section(0.4, 0.4 / 3.0) + section(0.3, 0.06)), 1e-9, "volume");
}

#[test]
fn centre_lines_follow_the_draft_and_floats_are_flat() {
    let tile =
        build("kind = \"weave\"\ndraft = [\"110\", \"011\", \"101\", \"000\"]\ncrimp = 0.2\ncrimp_share = 0.25\nsegments = 4\nsteps = 4");
    let rows = ["110", "011", "101", "000"];
    let spacing = 0.42 * 1.2;
    // Middles of the rings over each crossing: with 4 segments the corners at the sides lie at the height of the centre line.
    let height = |x: f64, y: f64, part: usize| {
        let used: std::collections::HashSet<u32> =
            (0..tile.triangles.len()).filter(|&t| usize::from(tile.part_of_triangle[t]) == part).flat_map(|t| tile.triangles[t]).collect();
        let across = |v: &DVec3| if part == 0 { ((v.x - x).abs() - 0.21, v.y - y) } else { ((v.y - y).abs() - 0.21, v.x - x) };
        let found = used.iter().map(|&v| tile.vertices[v as usize]).find(|v| across(v).0.abs() < 1e-9 && across(v).1.abs() < 1e-9);
        found.unwrap_or_else(|| panic!("part {part} has no ring over ({x}, {y})")).z
    };
    for (j, row) in rows.iter().enumerate() {
        for (i, over) in row.bytes().enumerate() {
            let (x, y) = ((i as f64 + 0.5) * spacing, (j as f64 + 0.5) * spacing);
            let sign = if over == b'1' { 1.0 } else { -1.0 };
            assert!((height(x, y, 0) - sign * 0.05).abs() < 1e-12, "warp {i} over weft {j}");
            assert!((height(x, y, 1) + sign * 0.15).abs() < 1e-12, "weft {j} under warp {i}");
        }
    }
}

/// Height of the cloth's surface over points of the crossing of the first warp and weft, from the tile itself: highest underside of what lies
/// over, minus highest upper side of what lies under; negative where they meet.
fn least_gap(tile: &Tile, warp_first: bool) -> f64 {
    let (upper, lower) = if warp_first { (0, 1) } else { (1, 0) };
    let centre = tile.period * 0.25;
    let mut least = f64::INFINITY;
    for k in 0..41 {
        for (dx, dy) in [(k, 20), (20, k)] {
            let p = centre + (DVec2::new(f64::from(dx), f64::from(dy)) - 20.0) / 20.0 * 0.2;
            let z_of = |part: u16, up: bool| {
                let facing = |t: &usize| tile.part_of_triangle[*t] == part && (doubled(tile, *t).z > 0.0) == up;
                (0..tile.triangles.len()).filter(facing).filter_map(|t| height_over(tile.corners(t), p)).reduce(f64::max)
            };
            if let (Some(bottom), Some(top)) = (z_of(upper, false), z_of(lower, true)) {
                least = least.min(bottom - top);
            }
        }
    }
    least
}

fn height_over([a, b, c]: [DVec3; 3], p: DVec2) -> Option<f64> {
    let side = |u: DVec3, v: DVec3| (v.truncate() - u.truncate()).perp_dot(p - u.truncate());
    let (wa, wb, wc) = (side(b, c), side(c, a), side(a, b));
    let all = wa + wb + wc;
    let inside = all != 0.0 && wa / all >= 0.0 && wb / all >= 0.0 && wc / all >= 0.0;
    inside.then(|| (wa * a.z + wb * b.z + wc * c.z) / all)
}

#[test]
fn by_default_threads_do_not_meet_along_their_middle_lines() {
    // Plain weave at default sizes: period 1.008, the first crossing at a quarter of it.
    let tile = build("kind = \"weave\"\nsegments = 64\nsteps = 16");
    let gap = least_gap(&tile, true);
    assert!((0.0..0.04).contains(&gap), "gap {gap} of threads 0.14 high");
    let tight = build("kind = \"weave\"\ncrimp = 0.12");
    assert!(least_gap(&tight, true) < 0.0);
    assert!(tight.notes.iter().any(|n| n.contains("meet where they cross")), "{:?}", tight.notes);
}

#[test]
fn a_repeat_of_the_draft_is_enough_and_sizes_come_from_the_file() {
    let towel = with_wif(&data("41753.wif"), "").unwrap().tile;
    // 0.0185 cm is 0.185 mm; the treadling and threading repeat after 12 threads.
    assert!(towel.notes.iter().any(|n| n.contains("48 x 48 threads of the draft repeat after 12 x 12")), "{:?}", towel.notes);
    assert!((towel.period - DVec2::splat(12.0 * 0.185)).length() < 1e-12, "{}", towel.period);
    assert_eq!(towel.parts, ["warp-2", "weft-1"]);
    assert!(towel.notes.iter().any(|n| n.contains("part warp-2: the file's colour is [0.033, 0.000, 1.000]")), "{:?}", towel.notes);
    assert!(towel.notes.iter().any(|n| n.contains("narrowed")), "{:?}", towel.notes);
    let plain = with_wif(&data("41753.wif"), "parts = \"by-direction\"\nwarp_width = 0.1\nwarp_gap = 0.1").unwrap().tile;
    assert_eq!(plain.parts, ["warp", "weft"]);
    assert!((plain.period - DVec2::new(2.4, 2.22)).length() < 1e-12, "{}", plain.period);
}

#[test]
fn files_with_defaults_and_oddities_are_read() {
    let plan = with_wif(&data("liftplan-with-defaults.wif"), "").unwrap().tile;
    // Threading 3, 2, none, none; lift plan {1,2,4}, {}, {}, {3,4} (6 wefts announced): warp 2 is over weft 1, warp 1 over weft 4.
    assert!(plan.notes.iter().any(|n| n.contains("2 warp threads are on no shaft")), "{:?}", plan.notes);
    assert!((plan.period - DVec2::new(4.0, 4.0) * 2.12).length() < 1e-9, "{}", plan.period);
    let treadles = with_wif(&data("treadles-with-defaults.wif"), "").unwrap().tile;
    assert!(treadles.parts.len() > 2, "{:?}", treadles.parts);
    let parallel = with_wif(&data("3parallelwarps.wif"), "").unwrap().tile;
    assert!(parallel.notes.iter().any(|n| n.contains("have no colour")), "{:?}", parallel.notes);
}

#[test]
fn bad_files_are_refused_with_file_and_line() {
    let mut count = 0;
    for entry in std::fs::read_dir(data("")).unwrap() {
        let path = entry.unwrap().path();
        if path.file_name().unwrap().to_string_lossy().starts_with("bad-") {
            let message = with_wif(&path, "").expect_err(&path.display().to_string()).to_string();
            assert!(message.contains(".wif") && message.contains("; "), "{message}");
            count += 1;
        }
    }
    assert_eq!(count, 14);
}

#[test]
fn every_draft_of_the_data_folder_is_read_or_refused_as_it_should_be() {
    let Some(root) = std::env::var_os("BISCALE_DATA").map(|d| PathBuf::from(d).join("wif")) else {
        println!("skipped: BISCALE_DATA is not set");
        return;
    };
    let (mut folders, mut read, mut refused) = (vec![root], 0, 0);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "wif") {
                let bad = folder.ends_with("bad_wif");
                let built = with_wif(&path, "");
                if built.as_ref().is_err_and(|e| e.to_string().contains("triangles, more than")) {
                    println!("{} is too large", path.display());
                    continue;
                }
                assert_eq!(built.is_err(), bad, "{}: {:?}", path.display(), built.err().map(|e| e.to_string()));
                *(if bad { &mut refused } else { &mut read }) += 1;
            }
        }
    }
    println!("{read} drafts read, {refused} refused");
    assert!(read > 20 && refused > 10);
}

#[test]
fn cloth_survives_the_extremes() {
    for width in ["1e-6", "1.0", "1e5"] {
        let w: f64 = width.parse().unwrap();
        for aspect in [1e-6, 1e3] {
            for gap in [0.0, 3.0] {
                let (height, gap) = (aspect * w, gap * w);
                let geometry = format!(
                    "kind = \"weave\"\nwarp_width = {width}\nwarp_height = {height:e}\nweft_height = {height:e}\nwarp_gap = {gap:e}"
                );
                let tile = build(&geometry);
                assert!(tile.vertices.iter().all(|v| v.is_finite()), "{geometry}");
                assert!(!tile.notes.iter().any(|n| n.contains("dropped")), "{geometry}: {:?}", tile.notes);
            }
        }
    }
}
