//! Bad input through the binary: the right exit status, one message that says where and what, nothing written.

#![allow(clippy::unwrap_used, reason = "a test that meets the unexpected should panic")]

#[allow(dead_code, reason = "shared by several test programs; each uses its part")]
mod support;

use support::cases::Wrong::{self, Also, Arguments, File, Material, Mesh, NoFile, Pairs};
use support::cases::try_all;
use support::{Folder, MATERIAL};

#[test]
fn wrong_material_files_are_refused_by_line_and_field() {
    try_all(&[
        ("a bracket is missing", Material("[geometry]", "[geometry"), 2, &["m.toml:4", "not valid TOML"]),
        ("a key twice", Material("kind = \"mesh\"", "kind = \"mesh\"\nkind = \"mesh\""), 2, &["m.toml:6", "not valid TOML", "duplicate"]),
        ("a text without end", Material("\"plane\"", "\"plane"), 2, &["m.toml:2", "not valid TOML"]),
        ("not UTF-8", File("m.toml", b"format = 1\nname = \"caf\xe9\"\n"), 2, &["m.toml:2", "UTF-8"]),
        ("empty", File("m.toml", b""), 2, &["m.toml:1", "format", "add `format = 1`"]),
        ("binary", File("m.toml", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), 2, &["m.toml: this is a PNG image", "height-field"]),
        ("not there", NoFile("m.toml"), 2, &["m.toml", "no such file", "check the path"]),
        ("a folder", Wrong::Folder("m.toml"), 2, &["m.toml", "folder", "name a file"]),
        ("inside a file", Arguments(&["check", "plane.obj/m.toml"]), 2, &["plane.obj/m.toml", "no such file"]),
        ("no format", Material("format = 1\n", ""), 2, &["m.toml:1", "format", "required"]),
        ("a later format", Material("format = 1", "format = 2"), 2, &["m.toml:1: format", "2", "`format = 1`"]),
        ("a format that is text", Material("format = 1", "format = \"1\""), 2, &["m.toml:1: format", "\"1\" is a string", "whole number"]),
        ("an unknown unit", Material("name =", "unit = \"inch\"\nname ="), 2, &["m.toml:2: unit", "inch", "mm"]),
        ("an unknown key", Material("name =", "nmae ="), 2, &["m.toml:2: nmae", "unknown key `nmae`", "did you mean `name`?"]),
        ("an unknown table", Material("[geometry]", "[goemetry]"), 2, &["m.toml:4", "geometry", "did you mean", "`goemetry`"]),
        (
            "a required key misspelt",
            Material("file =", "flie ="),
            2,
            &["m.toml:6: geometry.flie", "unknown key `flie`", "did you mean `file`?"],
        ),
        ("a part misspelt", Material("part =", "prat ="), 2, &["m.toml:10: surface[0].part", "`prat` on line 10"]),
        ("a BRDF misspelt", Material("brdf =", "bdrf ="), 2, &["m.toml:11: surface[0].brdf", "`bdrf` on line 11"]),
        ("the surfaces misspelt", Material("[[surface]]", "[[surfaces]]"), 2, &["m.toml:9", "surface", "did you mean", "`surfaces`"]),
        ("the format misspelt", Material("format =", "fromat ="), 2, &["m.toml:1: format", "`fromat` on line 1"]),
        ("an albedo misspelt", Material("albedo =", "albdeo ="), 2, &["m.toml:11: surface[0].brdf.albedo", "`albdeo` on line 11"]),
        (
            "no geometry",
            Material("[geometry]\nkind = \"mesh\"\nfile = \"plane.obj\"\nperiod = [1.0, 1.0]\n", ""),
            2,
            &["m.toml", "no [geometry]", "biscale new"],
        ),
        (
            "geometry that is no table",
            Material("[geometry]\nkind = \"mesh\"\nfile = \"plane.obj\"\nperiod = [1.0, 1.0]\n", "geometry = 3\n"),
            2,
            &["m.toml:4: geometry", "3 is an integer", "table"],
        ),
        (
            "no surface",
            Material("[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.5 }\n", ""),
            2,
            &["m.toml", "no [[surface]]", "part = \"*\""],
        ),
        ("one surface that is no list", Material("[[surface]]", "[surface]"), 2, &["m.toml:9: surface", "[[surface]]"]),
        ("a surface without a part", Material("part = \"*\"\n", ""), 2, &["m.toml:9: surface[0].part", "required"]),
        (
            "a surface without a BRDF",
            Material("brdf = { model = \"lambert\", albedo = 0.5 }\n", ""),
            2,
            &["m.toml:9: surface[0].brdf", "required", "lambert"],
        ),
        (
            "a part that is not there",
            Material("part = \"*\"", "part = \"lowe\""),
            2,
            &["m.toml:9: surface", "\"lowe\"", "did you mean `low`?"],
        ),
        ("a part left out", Material("part = \"*\"", "part = \"low\""), 2, &["m.toml", "no surface covers part \"high\"", "part = \"*\""]),
        (
            "a part covered twice",
            Material("[[surface]]", "[[surface]]\npart = \"*\"\nbrdf = { model = \"lambert\", albedo = 0.1 }\n[[surface]]"),
            2,
            &["m.toml:12: surface", "covered twice"],
        ),
        (
            "a tint over 1",
            Material("part = \"*\"", "part = \"*\"\ntint = [1.0, 2.0, 1.0]"),
            2,
            &["m.toml:11: surface[0].tint", "2.0", "from 0 to 1"],
        ),
        (
            "a tint of two numbers",
            Material("part = \"*\"", "part = \"*\"\ntint = [1.0, 1.0]"),
            2,
            &["m.toml:11: surface[0].tint", "2 elements", "3 numbers"],
        ),
    ]);
}

#[test]
fn wrong_brdfs_are_refused_by_line_and_field() {
    const GOOD: &str = "model = \"lambert\", albedo = 0.5";
    try_all(&[
        (
            "an unknown model",
            Material("lambert", "lambret"),
            2,
            &["m.toml:11: surface[0].brdf.model", "lambret", "did you mean `lambert`?"],
        ),
        ("no model", Material("model = \"lambert\", ", ""), 2, &["m.toml:11: surface[0].brdf.model", "required"]),
        ("a model that is a number", Material("\"lambert\"", "1"), 2, &["m.toml:11: surface[0].brdf.model", "1 is an integer", "text"]),
        ("no albedo", Material(", albedo = 0.5", ""), 2, &["m.toml:11: surface[0].brdf.albedo", "required", "albedo = 0.5"]),
        ("an albedo over 1", Material("0.5", "1.5"), 2, &["m.toml:11: surface[0].brdf.albedo", "1.5", "from 0 to 1"]),
        ("a negative albedo", Material("0.5", "[0.5, -0.1, 0.5]"), 2, &["m.toml:11: surface[0].brdf.albedo", "-0.1", "from 0 to 1"]),
        ("an albedo that is no number", Material("0.5", "nan"), 2, &["m.toml:11: surface[0].brdf.albedo", "nan", "from 0 to 1"]),
        ("an infinite albedo", Material("0.5", "inf"), 2, &["m.toml:11: surface[0].brdf.albedo", "inf", "from 0 to 1"]),
        ("an albedo in words", Material("0.5", "\"white\""), 2, &["m.toml:11: surface[0].brdf.albedo", "\"white\"", "numbers"]),
        ("a key of another model", Material("0.5", "0.5, alpha = 0.1"), 2, &["m.toml:11: surface[0].brdf.alpha", "unknown key `alpha`"]),
        (
            "an alpha of 0",
            Material(GOOD, "model = \"cook-torrance\", specular = 1, alpha = 0"),
            2,
            &["brdf.alpha", "0 is out of range", "from 0.001 to 1"],
        ),
        ("an alpha over 1", Material(GOOD, "model = \"ward\", specular = 1, alpha = 1.01"), 2, &["brdf.alpha", "1.01", "from 0.001 to 1"]),
        ("no alpha", Material(GOOD, "model = \"ward\", specular = 1"), 2, &["brdf.alpha", "required"]),
        (
            "an exponent over a million",
            Material(GOOD, "model = \"blinn-phong\", specular = 1, exponent = 2e6"),
            2,
            &["brdf.exponent", "2e6", "1000000"],
        ),
        (
            "an unknown distribution",
            Material(GOOD, "model = \"cook-torrance\", specular = 1, alpha = 0.1, distribution = \"gxx\""),
            2,
            &["brdf.distribution", "gxx", "ggx"],
        ),
        (
            "an f0 over 1",
            Material(GOOD, "model = \"cook-torrance\", specular = 1, alpha = 0.1, f0 = [1, 1, 1.2]"),
            2,
            &["brdf.f0", "1.2", "from 0 to 1"],
        ),
        ("a BRDF in words", Material("{ model = \"lambert\", albedo = 0.5 }", "\"lambert\""), 2, &["m.toml:11: surface[0].brdf", "table"]),
    ]);
}

#[test]
fn wrong_meshes_are_refused_by_line() {
    try_all(&[
        ("no file key", Material("file = \"plane.obj\"\n", ""), 2, &["m.toml:4: geometry.file", "required"]),
        ("a mesh that is not there", Material("plane.obj", "plain.obj"), 2, &["m.toml:6: geometry.file", "no file \"plain.obj\""]),
        ("a mesh that is a folder", Wrong::Folder("plane.obj"), 2, &["m.toml:6: geometry.file", "\"plane.obj\" is a folder"]),
        ("no period", Material("period = [1.0, 1.0]\n", ""), 2, &["m.toml:4: geometry.period", "required"]),
        ("a period of 0", Material("[1.0, 1.0]", "[1.0, 0.0]"), 2, &["m.toml:7: geometry.period", "0.0", "from 0.000001 to 1000000"]),
        ("one period", Material("[1.0, 1.0]", "1.0"), 2, &["m.toml:7: geometry.period", "1.0 is a float", "2 numbers"]),
        ("a negative scale", Material("period", "scale = -1.0\nperiod"), 2, &["m.toml:7: geometry.scale", "-1.0"]),
        (
            "an unknown kind",
            Material("kind = \"mesh\"", "kind = \"mash\""),
            2,
            &["m.toml:5: geometry.kind", "mash", "did you mean `mesh`?"],
        ),
        ("no kind", Material("kind = \"mesh\"\n", ""), 2, &["m.toml:4: geometry.kind", "required"]),
        ("a key of another kind", Material("period", "depth = 1\nperiod"), 2, &["m.toml:7: geometry.depth", "unknown key `depth`"]),
        ("a vertex of two numbers", Mesh("v 1 0 0", "v 1 0"), 2, &["plane.obj:2", "1 0"]),
        ("a vertex in words", Mesh("v 1 0 0", "v 1 zero 0"), 2, &["plane.obj:2", "zero"]),
        ("a face of a vertex that is not there", Mesh("f 1 3 4", "f 1 3 9"), 2, &["plane.obj:8", "9"]),
        ("a face of vertex 0", Mesh("f 1 3 4", "f 1 3 0"), 2, &["plane.obj:8", "0"]),
        ("a face of two corners", Mesh("f 1 3 4", "f 1 3"), 2, &["plane.obj:8", "face"]),
        ("not UTF-8", File("plane.obj", b"v 0 0 0\nv 1 0 0\xff\n"), 2, &["plane.obj:2"]),
    ]);
}

#[test]
fn wrong_pairs_are_refused_by_line_and_column() {
    try_all(&[
        ("not there", NoFile("p.csv"), 2, &["p.csv", "no such file"]),
        ("a folder", Wrong::Folder("p.csv"), 2, &["p.csv", "folder", "name a file"]),
        ("empty", File("p.csv", b""), 2, &["p.csv", "empty", "wi_x,wi_y,wi_z,wo_x,wo_y,wo_z"]),
        ("binary", File("p.csv", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR"), 2, &["p.csv:1", "lacks the columns wi_x"]),
        (
            "no header",
            Pairs("wi_x,wi_y,wi_z,wo_x,wo_y,wo_z\n", ""),
            2,
            &["p.csv:1", "lacks the columns wi_x, wi_y, wi_z, wo_x, wo_y, wo_z"],
        ),
        ("a column missing", Pairs("wo_z", "wo"), 2, &["p.csv:1", "lacks the column wo_z"]),
        ("a column twice", Pairs("wi_y", "wi_x"), 2, &["p.csv:1: wi_x", "twice"]),
        ("semicolons", Pairs("wi_x,wi_y,wi_z,wo_x,wo_y,wo_z", "wi_x;wi_y;wi_z;wo_x;wo_y;wo_z"), 2, &["p.csv:1", "separated by commas"]),
        ("too long a direction", Pairs("0.6,0,0.8", "0.6,0,0.9"), 2, &["p.csv:3: wi", "1.0816", "length 1"]),
        ("too short a direction", Pairs("0,0.6,0.8", "0,0.5,0.8"), 2, &["p.csv:3: wo", "0.943", "length 1"]),
        ("a direction of length 0", Pairs("0,0,1", "0,0,0"), 2, &["p.csv:2: wi", "length 0"]),
        ("not a number", Pairs("0.6,0,0.8", "0.6,NaN,0.8"), 2, &["p.csv:3: wi_y", "NaN", "not finite"]),
        ("infinite", Pairs("0.6,0,0.8", "-inf,0,0.8"), 2, &["p.csv:3: wi_x", "-inf", "not finite"]),
        ("a word", Pairs("0.6,0,0.8", "0.6,0,up"), 2, &["p.csv:3: wi_z", "up", "not a number"]),
        ("no value", Pairs("0.6,0,0.8", "0.6,,0.8"), 2, &["p.csv:3: wi_y", "no value"]),
        ("a short row", Pairs("0,0.6,0.8", "0,0.6"), 2, &["p.csv:3", "5 values", "6 columns"]),
        ("a long row", Pairs("0,0.6,0.8", "0,0.6,0.8,1"), 2, &["p.csv:3", "7 values", "6 columns"]),
        ("a comma in a number", Pairs("0,0.6,0.8", "0,0,6,0,8"), 2, &["p.csv:3", "8 values", "point in decimal numbers"]),
    ]);
}

#[test]
fn wrong_outputs_are_refused_before_the_work() {
    try_all(&[
        ("it exists", File("out.csv", b"mine\n"), 2, &["out.csv", "exists", "--force"]),
        ("it is a folder", Wrong::Folder("out.csv"), 2, &["out.csv", "folder"]),
        (
            "its folder is missing",
            Arguments(&["eval", "m.toml", "--pairs", "p.csv", "-o", "no/out.csv"]),
            2,
            &["no/out.csv", "no folder no", "create it"],
        ),
        (
            "its folder is a file",
            Arguments(&["eval", "m.toml", "--pairs", "p.csv", "-o", "p.csv/out.csv"]),
            2,
            &["p.csv/out.csv", "not a folder"],
        ),
        ("its name is empty", Arguments(&["eval", "m.toml", "--pairs", "p.csv", "-o", ""]), 2, &["--output", "value is required"]),
        ("it is an input", Arguments(&["eval", "m.toml", "--pairs", "p.csv", "-o", "p.csv"]), 2, &["p.csv", "read by the command"]),
        ("it is the material", Arguments(&["eval", "m.toml", "--pairs", "p.csv", "-o", "./m.toml"]), 2, &["m.toml", "read by the command"]),
        ("new over a file", Arguments(&["new", "mesh", "m.toml"]), 2, &["m.toml", "exists", "--force"]),
        ("new in a folder that is missing", Arguments(&["new", "mesh", "no/m.toml"]), 2, &["no/m.toml", "no folder"]),
    ]);
}

#[test]
fn wrong_arguments_are_refused_with_what_would_be_right() {
    try_all(&[
        ("no tolerance", Also(&["--tolerance", "0"]), 2, &["--tolerance", "'0'", "0.005"]),
        ("a negative tolerance", Also(&["--tolerance", "-0.1"]), 2, &["--tolerance", "-0.1", "0.005"]),
        ("a tolerance that is no number", Also(&["--tolerance", "nan"]), 2, &["--tolerance", "nan", "0.005"]),
        ("a tolerance in percent", Also(&["--tolerance", "1%"]), 2, &["--tolerance", "1%", "0.005"]),
        ("a budget without unit", Also(&["--budget", "100"]), 2, &["--budget", "100", "unit", "100ms"]),
        ("a negative budget", Also(&["--budget", "-1s"]), 2, &["--budget", "-1s", "100ms"]),
        ("a budget of words", Also(&["--budget", "soon"]), 2, &["--budget", "soon", "100ms"]),
        ("a negative seed", Also(&["--seed", "-1"]), 2, &["--seed", "-1"]),
        ("a broken seed", Also(&["--seed", "1.5"]), 2, &["--seed", "1.5"]),
        ("threads below 0", Also(&["--threads", "-2"]), 2, &["--threads", "-2"]),
        ("too many threads", Also(&["--threads", "100000"]), 2, &["--threads", "100000"]),
        ("broken bounces", Also(&["--bounces", "x"]), 2, &["--bounces", "x"]),
        ("an unknown method", Also(&["--method", "fast"]), 2, &["--method", "fast", "direct"]),
        ("an unknown device", Also(&["--device", "tpu"]), 2, &["--device", "tpu", "cpu"]),
        ("an empty plan", Also(&["--plan", " "]), 2, &["--plan", "empty", "copy"]),
        ("a plan that is none", Also(&["--plan", "fast"]), 2, &["plan", "fast"]),
        ("a plan of another method", Also(&["--plan", "direct:2048", "--method", "reference"]), 2, &["plan", "direct:2048"]),
        ("a plan of nothing", Also(&["--plan", "direct:0"]), 2, &["plan", "direct:0"]),
        ("a plan beyond all memory", Also(&["--plan", "direct:99999999999999999999"]), 2, &["plan", "direct:9999"]),
        ("a plan and a budget", Also(&["--plan", "direct:2048", "--budget", "1s"]), 2, &["--plan", "--budget"]),
        ("an unknown option", Also(&["--tolerence", "1"]), 2, &["--tolerence", "--tolerance"]),
        ("reflections of direct light", Also(&["--method", "direct", "--bounces", "2"]), 2, &["bounces", "2 reflections", "reference"]),
        ("a device not built yet", Also(&["--device", "gpu"]), 1, &["--device gpu", "not built yet"]),
        ("no pairs", Arguments(&["eval", "m.toml"]), 2, &["--pairs"]),
        ("no material", Arguments(&["eval", "--pairs", "p.csv"]), 2, &["MATERIAL"]),
        ("nothing to check", Arguments(&["check"]), 2, &["FILE"]),
        ("an unknown kind", Arguments(&["new", "groove", "x.toml"]), 2, &["groove", "grooves"]),
        ("no file to write", Arguments(&["new", "mesh"]), 2, &["FILE"]),
        ("two files to write", Arguments(&["new", "mesh", "a.toml", "b.toml"]), 2, &["two files"]),
        ("an unknown command", Arguments(&["evla", "m.toml"]), 2, &["evla", "eval"]),
    ]);
}

#[test]
fn check_refuses_what_a_method_would_refuse_later() {
    let folder = Folder::new();
    for arguments in [
        &["--method", "sg", "--budget", "1s"][..],
        &["--method", "lowrank", "--budget", "1s"],
        &["--method", "sg", "--bounces", "1"],
        &["--method", "sg", "--plan", "direct:8192x4:weighted"],
        &["--method", "lowrank", "--plan", "direct:8192x4:weighted"],
        &["--method", "direct", "--plan", "reference:bounces=0:first=8"],
    ] {
        let said = ["check", "eval"].map(|command| {
            let pairs: &[&str] = if command == "eval" { &["--pairs", "p.csv"] } else { &[] };
            folder.run([command, "m.toml"].iter().chain(pairs).chain(arguments))
        });
        let [check, eval] = &said;
        assert!(check.status != 0 && check.status == eval.status, "{arguments:?}: {} {}", check.stderr, eval.stderr);
        assert_eq!(check.stderr, eval.stderr, "{arguments:?}");
    }
}

/// Files of other programs: name, content, what they are, and what takes them.
const FOREIGN: [(&str, &[u8], &str, &str); 12] = [
    ("x.wif", b"[WIF]\nVersion=1.1\nDate=April 20, 1997\n", "a weaving draft (WIF)", "`wif`"),
    ("x.obj", b"# made by hand\nv 0 0 0\nf 1 1 1\n", "an OBJ mesh", "`kind = \"mesh\"`"),
    ("x.stl", b"solid x\nendsolid x\n", "an STL mesh", "`kind = \"mesh\"`"),
    ("x.ply", b"ply\nformat ascii 1.0\nend_header\n", "a PLY mesh", "`kind = \"mesh\"`"),
    ("x.png", b"\x89PNG\r\n\x1a\n", "a PNG image", "height-field"),
    ("x.exr", b"\x76\x2f\x31\x01\x02\0\0\0", "an OpenEXR image", "[environment]"),
    ("x.tif", b"II*\0\x08\0\0\0", "a TIFF image", "height-field"),
    ("x.hdr", b"#?RADIANCE\n\n", "a radiance map", "[environment]"),
    ("x.csv", b"wi_x,wi_y\n0,0\n", "a comma-separated list", "--pairs"),
    ("x.json", b"{\"a\": 1}", "a JSON document", "capture.json"),
    ("x.bsdf", b"tensor_file\0\x01", "a table of a measured BRDF", "measured"),
    // Another program's file under our ending.
    ("y.toml", b"\xef\xbb\xbf[WIF]\r\nVersion=1.1\r\n", "a weaving draft (WIF)", "`wif`"),
];

#[test]
fn files_of_other_programs_are_named_and_so_is_what_takes_them() {
    let folder = Folder::new();
    for (name, content, what, used) in FOREIGN {
        folder.write(name, content);
        let is_mesh = what.ends_with("mesh");
        let commands: [&[&str]; 5] = [
            &["check", name],
            &["eval", name, "--pairs", "p.csv"],
            &["fold", name, "-o", "out.pdf"],
            &["render", name, "-o", "out.png"],
            &["fit", name, "-o", "out"],
        ];
        // A mesh is folded as it is, and a table of `bake` is evaluated.
        for arguments in commands.into_iter().filter(|a| (a[0] != "fold" || !is_mesh) && (a[0] != "eval" || name != "x.exr")) {
            let said = folder.run(arguments);
            assert_eq!(said.status, 2, "{arguments:?}: {}", said.stderr);
            for word in [name, what, used] {
                assert!(said.stderr.contains(word), "{arguments:?}: no {word:?}: {}", said.stderr);
            }
        }
    }
}

#[test]
fn control_characters_of_a_name_are_shown_and_do_not_reach_the_terminal() {
    let folder = Folder::new();
    folder.write("named.toml", MATERIAL.replace("\"plane\"", "\"a\\u001b[31mred\\u0007\\u202e\""));
    for arguments in [
        &["check", "named.toml"][..],
        &["eval", "named.toml", "--pairs", "p.csv", "-o", "out.csv"],
        &["fold", "named.toml", "-o", "o.svg", "--scale", "40"],
    ] {
        let said = folder.run(arguments);
        let text = said.stdout + &said.stderr;
        assert!(said.status == 0 && text.contains("a\\u{1b}[31mred\\u{7}\\u{202e}"), "{arguments:?}: {text:?}");
        assert!(!text.contains(['\u{1b}', '\u{7}', '\u{202e}']), "{arguments:?}: {text:?}");
    }
}

#[test]
fn check_looks_at_every_file_and_fails_if_one_is_bad() {
    let folder = Folder::new();
    folder.write("bad.toml", MATERIAL.replace("0.5", "5"));
    let said = folder.run(["check", "bad.toml", "m.toml", "none.toml"]);
    assert_eq!(said.status, 2, "{}", said.stderr);
    assert!(said.stdout.starts_with("m.toml: ok\n"), "{}", said.stdout);
    assert_eq!(said.stderr.lines().count(), 2, "{}", said.stderr);
    assert!(said.stderr.contains("bad.toml:11") && said.stderr.contains("none.toml"), "{}", said.stderr);
    let said = folder.run(["check", "bad.toml", "m.toml", "--quiet"]);
    assert_eq!((said.status, said.stdout.as_str(), said.stderr.lines().count()), (2, "m.toml: ok\n", 1), "{}", said.stderr);
}

#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_cannot_be_written_is_an_error_of_the_system() {
    try_all(&[(
        "no file can be created there",
        Arguments(&["eval", "m.toml", "--pairs", "p.csv", "-o", "/proc/out.csv"]),
        1,
        &["/proc/out.csv"],
    )]);
}

#[test]
fn a_file_of_another_kind_is_named_and_so_is_the_command_that_takes_it() {
    let folder = Folder::new();
    for (kind, file) in [("scene", "scene.toml"), ("shoot", "shoot.toml"), ("fit", "fit.toml")] {
        assert_eq!(folder.run(["new", kind, file]).status, 0, "{kind}");
    }
    let before = folder.snapshot();
    let commands: [(&str, &[&str]); 8] = [
        ("material", &["eval", "--pairs", "p.csv"]),
        ("material", &["bake", "-o", "out.exr"]),
        ("material", &["plot", "-o", "out"]),
        ("material", &["study", "-o", "out"]),
        ("material", &["fold", "-o", "out.pdf"]),
        ("scene", &["render", "-o", "out.png"]),
        ("shoot", &["capture", "-o", "out"]),
        ("fit", &["fit", "-o", "out"]),
    ];
    for (wanted, arguments) in commands {
        if wanted == "shoot" && cfg!(not(feature = "capture")) {
            continue;
        }
        for (kind, takes, file) in [
            ("material", "biscale eval", "m.toml"),
            ("scene", "biscale render", "scene.toml"),
            ("shoot", "biscale capture", "shoot.toml"),
            ("fit", "biscale fit", "fit.toml"),
        ] {
            if kind == wanted {
                continue;
            }
            let said = folder.run(std::iter::once(&arguments[0]).chain(&[file]).chain(&arguments[1..]));
            assert_eq!(said.status, 2, "{arguments:?} {file}: {}", said.stderr);
            for word in [file, &format!("this is a {kind} file, not a {wanted} file"), takes] {
                assert!(said.stderr.contains(word), "{arguments:?} {file}: {}", said.stderr);
            }
        }
    }
    assert_eq!(folder.snapshot(), before, "something was written");
}
