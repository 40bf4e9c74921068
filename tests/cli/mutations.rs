//! No file makes the program panic: good files with pieces cut, doubled or changed are accepted or refused, and that is all.

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use support::{Folder, MATERIAL, PAIRS, PLANE};

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

#[test]
fn a_damaged_file_is_accepted_or_refused_and_never_more() {
    let folder = Folder::new();
    for (name, good) in [("m.toml", MATERIAL), ("plane.obj", PLANE), ("p.csv", PAIRS)] {
        let mut refused = 0;
        for seed in 0..MUTATIONS {
            let bytes = mutate(good.as_bytes(), seed);
            folder.write(name, &bytes);
            let said = folder.run(["eval", "m.toml", "--pairs", "p.csv", "--tolerance", "1", "-o", "out.csv"]);
            let shown = format!("{name}, mutation {seed}:\n{}\n---\n{}", String::from_utf8_lossy(&bytes), said.stderr);
            assert!(matches!(said.status, 0..=2), "status {}: {shown}", said.status);
            assert!(!said.stderr.contains("panicked"), "{shown}");
            assert_eq!(folder.path("out.csv").exists(), said.status == 0, "the output of {shown}");
            if said.status == 0 {
                std::fs::remove_file(folder.path("out.csv")).unwrap();
            } else {
                refused += 1;
            }
        }
        assert!(refused > MUTATIONS / 4, "only {refused} of {MUTATIONS} mutations of {name} were refused");
        folder.write(name, good);
    }
}
