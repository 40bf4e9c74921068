//! Files: what is written is what is read, and what is damaged or foreign is refused.

use super::super::effective_table::tests::{Groove, lambert, recipe};
use super::*;
use crate::brdf::{Brdf, Distribution};
use crate::error::Error;
use crate::table::{BakeAids, BakeRecipe, GuideLobes, build};
use exr::prelude::{AttributeValue, Text, WritableImage};
use std::io::Cursor;
use std::path::Path;

fn bytes(table: &EffectiveTable) -> Vec<u8> {
    let mut out = Cursor::new(Vec::new());
    table.write(&mut out).unwrap();
    out.into_inner()
}

fn read(bytes: &[u8]) -> Result<EffectiveTable, Error> {
    EffectiveTable::read(Cursor::new(bytes), Path::new("table.exr"))
}

/// A small table with a guide, and one that is not reciprocal.
fn tables() -> [EffectiveTable; 2] {
    let glossy = Brdf::CookTorrance { diffuse: [0.2; 3], specular: [0.5; 3], alpha: 0.15, distribution: Distribution::Ggx, f0: None };
    let guided = Groove::new(30.0, glossy).table(5);
    assert!(guided.guide().is_some(), "the file must have its third layer");
    [guided, Groove { not_reciprocal: true, ..Groove::new(30.0, lambert(0.7)) }.table(4)]
}

#[test]
fn a_table_comes_back_bit_for_bit_and_evaluates_the_same() {
    for table in tables() {
        let back = read(&bytes(&table)).unwrap();
        assert_eq!((back.reciprocal, back.grid.rings()), (table.reciprocal, table.grid.rings()));
        assert_eq!((&back.planes, &back.av, &back.guide), (&table.planes, &table.av, &table.guide));
        assert_eq!(back.about, table.about);
        let (wi, wo) = (DVec3::new(0.3, -0.4, 0.75_f64.sqrt()), DVec3::new(-0.1, 0.2, 0.95_f64.sqrt()));
        assert_eq!(back.eval(wi, wo), table.eval(wi, wo));
    }
}

#[test]
fn the_same_table_makes_the_same_bytes() {
    for (one, other) in tables().iter().zip(&tables()) {
        assert!(bytes(one) == bytes(other), "two files differ");
    }
}

#[test]
fn texts_in_any_language_and_control_characters_come_back() {
    let groove = Groove::new(20.0, lambert(0.5));
    let material = "# Größe 10 µm, 😀\nname = \"溝\"\n\"\\ \u{1}\t";
    let recipe = BakeRecipe { name: "溝 \"ü\"", material, rings: Some(4), ..recipe() };
    let table = build(&recipe, GuideLobes::of(&groove.surface()).as_ref(), &BakeAids::none(), &mut groove.values(0.0)).unwrap();
    let back = read(&bytes(&table)).unwrap();
    assert_eq!((back.about.material.as_str(), back.about.name.as_str()), (material, "溝 \"ü\""));
}

#[test]
fn a_file_in_a_folder_is_saved_and_loaded() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.exr");
    let table = Groove::new(20.0, lambert(0.5)).table(4);
    table.save(&path).unwrap();
    assert_eq!(EffectiveTable::load(&path).unwrap().planes, table.planes);
    assert!(matches!(table.save(&folder.path().join("none").join("table.exr")), Err(Error::Io { .. })));
    let text = EffectiveTable::load(&folder.path().join("none.exr")).unwrap_err().to_string();
    assert!(text.contains("none.exr: there is no such file"), "{text}");
}

#[test]
fn a_truncated_file_is_refused_wherever_it_ends() {
    let whole = bytes(&tables()[0]);
    for length in (0..whole.len()).step_by(whole.len() / 97).chain([1, 4, 8, whole.len() - 1]) {
        match read(&whole[..length]) {
            Err(Error::BadInput(bad)) => assert!(bad.file.is_some() && !bad.remedy.is_empty(), "{bad}"),
            other => panic!("{length} of {} bytes: {other:?}", whole.len()),
        }
    }
}

#[test]
fn a_changed_byte_is_found_or_changes_nothing_that_counts() {
    let table = &tables()[0];
    let whole = bytes(table);
    // A stride that is coprime to the sizes of the structures meets all kinds of fields; the header is looked at closer.
    for place in (0..2000).step_by(7).chain((2000..whole.len()).step_by(911)) {
        for bit in [0x01, 0x80] {
            let mut changed = whole.clone();
            changed[place] ^= bit;
            match read(&changed) {
                Err(Error::BadInput(_)) => {}
                // A letter of a note, or a field of OpenEXR's that nobody needs.
                Ok(back) => {
                    let same = (&back.planes, &back.av, &back.guide) == (&table.planes, &table.av, &table.guide);
                    assert!(same, "byte {place} changed the numbers unnoticed");
                }
                Err(other) => panic!("byte {place}: {other:?}"),
            }
        }
    }
}

/// The file with its description changed by `change`.
fn redescribed(table: &EffectiveTable, change: impl Fn(&str) -> String) -> Vec<u8> {
    let mut image = exr::prelude::read_all_flat_layers_from_file(saved(table).path()).unwrap();
    for layer in &mut image.layer_data {
        for value in layer.attributes.other.values_mut() {
            if let AttributeValue::Text(text) = value {
                *value = AttributeValue::Text(Text::new_or_panic(change(&text.to_string())));
            }
        }
    }
    let mut out = Cursor::new(Vec::new());
    image.write().to_buffered(&mut out).unwrap();
    out.into_inner()
}

fn saved(table: &EffectiveTable) -> tempfile::NamedTempFile {
    let file = tempfile::NamedTempFile::new().unwrap();
    table.save(file.path()).unwrap();
    file
}

#[test]
fn a_file_that_other_software_wrote_again_is_still_read() {
    let table = &tables()[0];
    assert_eq!(read(&redescribed(table, str::to_owned)).unwrap().planes, table.planes);
}

#[test]
fn what_is_not_ours_newer_or_contradictory_is_refused_with_the_reason() {
    let table = &tables()[0];
    let cases: [(&str, &str, &str); 7] = [
        ("\"version\": 1", "\"version\": 2", "version: the file has version 2; this program reads up to version 1"),
        ("\"version\": 1", "\"version\": 0", "the file has version 0"),
        ("biscale effective BRDF", "some other table", "this file holds \"some other table\""),
        ("\"rings\": 5", "\"rings\": 6", "its layers are not those"),
        ("\"rings\": 5", "\"rings\": 4000000000", "out of range"),
        ("\"reciprocal\": true", "\"reciprocal\": false", "its layers are not those"),
        ("\"seed\": 0", "\"seed\": \"none\"", "its description is wrong"),
    ];
    for (from, to, expected) in cases {
        let changed = redescribed(table, |text| {
            assert!(text.contains(from), "{text}");
            text.replace(from, to)
        });
        match read(&changed) {
            Err(Error::BadInput(bad)) => assert!(bad.to_string().contains(expected), "{bad} for {to}"),
            other => panic!("{to}: {other:?}"),
        }
    }
}

#[test]
fn pictures_and_texts_are_refused() {
    let mut picture = Cursor::new(Vec::new());
    let pixels = exr::prelude::SpecificChannels::rgb(|_| (0.5_f32, 0.5_f32, 0.5_f32));
    Image::from_channels((4, 4), pixels).write().to_buffered(&mut picture).unwrap();
    for (bytes, expected) in [
        (picture.into_inner(), "this OpenEXR file is no effective BRDF"),
        (b"wi_x,wi_y\n".to_vec(), "no readable OpenEXR file"),
        (Vec::new(), "no readable OpenEXR file"),
    ] {
        let text = read(&bytes).unwrap_err().to_string();
        assert!(text.contains(expected), "{text}");
    }
}
