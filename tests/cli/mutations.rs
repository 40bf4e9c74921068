//! No file makes the program panic: good files with pieces cut, doubled or changed are accepted or refused, and that is all.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use support::{Folder, MATERIAL, PAIRS, PLANE, project};

/// Mutations of each file.
const MUTATIONS: u64 = 120;
/// What a mutation may put in: what parsers stumble over.
const PIECES: [&[u8]; 24] = [
    b"",
    b"\n",
    b"\0",
    b"\xff",
    b"-",
    b"nan",
    b"inf",
    b"-0",
    b"1e308",
    b"1e-320",
    b"99999999999999999999",
    b"\"",
    b"'",
    b"[",
    b"]",
    b"{",
    b"}",
    b"=",
    b",",
    b"#",
    b"0",
    b"-1",
    b"\xef\xbb\xbf",
    b"/",
];

/// The next number of a sequence that is the same in every run (Steele et al. 2014, `SplitMix64`).
fn next(state: &mut u64) -> usize {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    usize::try_from((z ^ (z >> 31)) >> 33).unwrap()
}

/// `good` with one to three pieces cut out, put in or put in the place of others.
fn mutate(good: &[u8], seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut bytes = good.to_vec();
    for _ in 0..=next(&mut state) % 3 {
        let from = next(&mut state) % (bytes.len() + 1);
        let to = (from + [0, 1, 3, 12, 1000][next(&mut state) % 5]).min(bytes.len());
        let piece = PIECES[next(&mut state) % PIECES.len()];
        bytes.splice(from..to, piece.iter().copied());
    }
    bytes
}

/// Runs the command with these arguments and checks that it did no more than accept or refuse. Returns whether it accepted.
fn accepted(folder: &Folder, arguments: &[&str], what: &str) -> bool {
    let said = folder.run(arguments);
    assert!(matches!(said.status, 0..=2), "status {}: {what}\n{}", said.status, said.stderr);
    assert!(!said.stderr.contains("panicked"), "{what}\n{}", said.stderr);
    said.status == 0
}

#[test]
fn a_damaged_file_is_accepted_or_refused_and_never_more() {
    let folder = Folder::new();
    for (name, good) in [("m.toml", MATERIAL), ("plane.obj", PLANE), ("p.csv", PAIRS)] {
        let mut refused = 0;
        for seed in 0..MUTATIONS {
            let bytes = mutate(good.as_bytes(), seed);
            folder.write(name, &bytes);
            let shown = format!("{name}, mutation {seed}:\n{}", String::from_utf8_lossy(&bytes));
            if accepted(&folder, &["eval", "m.toml", "--pairs", "p.csv", "--tolerance", "1", "-o", "out.csv"], &shown) {
                std::fs::remove_file(folder.path("out.csv")).unwrap();
            } else {
                assert!(!folder.path("out.csv").exists(), "an output in spite of {shown}");
                refused += 1;
            }
        }
        assert!(refused > MUTATIONS / 4, "only {refused} of {MUTATIONS} mutations of {name} were refused");
        folder.write(name, good);
    }
}

#[test]
fn a_damaged_template_is_accepted_or_refused_and_never_more() {
    let folder = Folder::new();
    for kind in ["grooves", "pyramids", "rods", "weave"] {
        let good = folder.run(["new", kind, "-"]).stdout;
        for seed in 0..MUTATIONS / 2 {
            let bytes = mutate(good.as_bytes(), seed);
            folder.write("m.toml", &bytes);
            accepted(&folder, &["check", "m.toml"], &format!("{kind}, mutation {seed}:\n{}", String::from_utf8_lossy(&bytes)));
        }
    }
}

/// Binary and text files that materials refer to, small and right: name, content, and the `[geometry]` table that reads them.
fn referred() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let f32s = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let triangle = |b: [f32; 3], c: [f32; 3]| [f32s(&[0.0; 6]), f32s(&b), f32s(&c), vec![0, 0]].concat();
    let stl =
        [vec![0; 80], 2_u32.to_le_bytes().to_vec(), triangle([1.0, 0.0, 0.0], [1.0, 1.0, 0.0]), triangle([1.0, 1.0, 0.0], [0.0, 1.0, 0.0])]
            .concat();
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                  element face 1\nproperty list uchar int vertex_indices\nend_header\n";
    let corners = f32s(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    let ply = [header.as_bytes(), &corners, &[3, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0]].concat();
    let heights: Vec<f32> = (0..16_u8).map(|k| f32::from(k % 5) / 10.0).collect();
    let sizes = [4_u32.to_le_bytes(), 4_u32.to_le_bytes()].concat();
    let tmd = [&b"Binary TrueMap Data File v2.0\r\n\0a scan\0"[..], &sizes, &f32s(&[1.0, 1.0, 0.0, 0.0]), &f32s(&heights)].concat();
    let wif = std::fs::read(project("tests/data/wif/41753.wif")).unwrap();
    vec![
        ("a.stl", stl, "kind = \"mesh\"\nfile = \"a.stl\"\nperiod = [1.0, 1.0]"),
        ("a.ply", ply, "kind = \"mesh\"\nfile = \"a.ply\"\nperiod = [1.0, 1.0]"),
        ("a.tmd", tmd, "kind = \"height-field\"\nfile = \"a.tmd\""),
        ("a.wif", wif, "kind = \"weave\"\nwif = \"a.wif\""),
    ]
}

#[test]
fn a_damaged_file_that_a_material_refers_to_is_accepted_or_refused_and_never_more() {
    let folder = Folder::new();
    for (name, good, geometry) in referred() {
        let surface = "[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.5 }\n";
        folder.write("m.toml", format!("format = 1\n[geometry]\n{geometry}\n{surface}"));
        folder.write(name, &good);
        assert!(accepted(&folder, &["check", "m.toml"], name), "{name} is right: {}", folder.run(["check", "m.toml"]).stderr);
        for seed in 0..MUTATIONS {
            folder.write(name, mutate(&good, seed));
            accepted(&folder, &["check", "m.toml"], &format!("{name}, mutation {seed}"));
        }
    }
}
