//! Thesis numbers match the digests' tables: each is looked up by its subject (scene, structure, method, samples), to
//! detect swapped rows or columns, scenes, units or ratios.

use super::printed::Place;
use super::{digest, theses};
use raystone::config::expect::{Compare, Expect, Thesis};
use raystone::measure::figure::FIGURES;
use raystone::repro::SOURCES;
use std::collections::BTreeSet;

/// Units of the columns, required of a figure unless the file names another unit.
const UNITS: [(&str, &str); 7] = [
    ("ms", "ms"),
    ("Mrays/s", "Mrays/s"),
    ("primary Mrays/s", "Mrays/s"),
    ("coherent Mrays/s", "Mrays/s"),
    ("BVH Mrays/s", "Mrays/s"),
    ("Roped Mrays/s", "Mrays/s"),
    ("Cornell Box", "ms"),
];

/// Tolerance of a file's number: zero for a copied one, the last digit for a quotient.
fn rounding(expect: &Expect, ours: f64, value: f64) -> f64 {
    if expect.compare == Compare::Shown {
        return 1e-9 * value.abs();
    }
    let text = ours.to_string();
    let digits = text.split_once('.').map_or(0, |(_, digits)| digits.len());
    let digits = if ours < 10.0 { digits.max(2) } else { digits };
    0.51 * 10f64.powi(-(digits as i32))
}

/// The unit of a figure, of the table or of a measurement.
fn unit_of(id: &str) -> String {
    let registries = raystone::registries();
    let figures = registries.measurements.figures();
    let mut all = FIGURES.iter().copied().chain(figures);
    let found = all.find(|figure| figure.id == id);
    found.map_or_else(String::new, |figure| figure.unit.to_string())
}

/// Faults in a file's numbers, and how many were compared with the digest.
fn faults(name: &str, thesis: &Thesis, text: &str) -> (Vec<String>, usize) {
    let mut faults = Vec::new();
    let mut held = 0;
    for expect in &thesis.expects {
        for at in expect.at.iter().filter(|at| at.thesis.is_some()) {
            let place = Place::new(expect, at);
            let ours = at.thesis.unwrap_or_default();
            held += 1;
            let at = format!("{name}, {}, {}", expect.id, at.row);
            match place.printed(name, text) {
                None => faults.push(format!("{at}: {ours} stands for nothing in the digest")),
                Some((_, value)) if (ours - value).abs() > rounding(expect, ours, value) => {
                    faults.push(format!("{at}: {ours}, but the digest has {value}"));
                }
                Some((row, _)) if !place.at.row.eq_ignore_ascii_case(&row) => {
                    faults.push(format!("{at}: this is the row of {row}"));
                }
                Some(_) => {}
            }
            let unit = UNITS.iter().find(|(column, _)| *column == place.column());
            let own = if expect.unit.is_empty() {
                unit_of(&expect.figure)
            } else {
                expect.unit.clone()
            };
            if unit.is_some_and(|(_, unit)| expect.compare == Compare::Shown && *unit != own) {
                faults.push(format!("{at}: {ours} in {own}"));
            }
        }
    }
    (faults, held)
}

#[test]
fn every_number_of_a_thesis_stands_in_the_digest_where_its_place_says() {
    let mut held = 0;
    for (name, thesis) in theses() {
        let Some(text) = digest(&thesis.source) else {
            return;
        };
        let (faults, of_file) = faults(name, &thesis, &text);
        assert_eq!(faults, [""; 0]);
        held += of_file;
    }
    assert!(held > 250, "{held}");
}

#[test]
fn triangles_of_scenes_are_those_of_the_digest() {
    for (name, thesis) in theses() {
        let Some(text) = digest(&thesis.source) else {
            return;
        };
        for substitute in &thesis.substitutes {
            let Some(triangles) = substitute.triangles else {
                continue;
            };
            let scene = substitute
                .original
                .trim_end_matches(" Scene")
                .trim_end_matches(" 100 Lights");
            let count = raystone::report::format::count(triangles);
            // By a row of the table of scenes, or in a list: "Record Player (79,667)".
            let row = text.lines().find(|line| {
                line.starts_with('|')
                    && line[1..]
                        .to_lowercase()
                        .trim_start()
                        .starts_with(&scene.to_lowercase())
            });
            let in_list = text.contains(&format!("{scene} ({count}"));
            let is_row = row.is_some_and(|row| row.contains(&count));
            let is_siebnik = scene == "Siebnik" && triangles == 80_000;
            assert!(
                in_list || is_row || is_siebnik,
                "{name}: {scene} has {count} triangles"
            );
        }
    }
}

/// Faults planted in the files: file, text, replacement.
const PLANTED: [(&str, &str, &str); 19] = [
    // A row swapped, a column swapped, neighbouring digits.
    (
        "nilsson-table-5-2",
        "of = { accel = \"bvh*\" }, thesis = 12.0 }",
        "of = { accel = \"bvh*\" }, thesis = 10.96 }",
    ),
    ("nilsson-table-5-2", "thesis = 529 }", "thesis = 259 }"),
    (
        "dufay-table-5-1",
        "row = \"64\", of = { spp = \"64\" }, thesis = 0.0239",
        "row = \"64\", of = { spp = \"64\" }, thesis = 0.0236",
    ),
    (
        "dufay-table-5-1",
        "row = \"16\", of = { spp = \"16\" }, thesis = 0.0572",
        "row = \"16\", of = { spp = \"32\" }, thesis = 0.0572",
    ),
    // Another scene, in the number and in the row.
    (
        "nilsson-table-5-2",
        "on = \"Record Player\", of = { accel = \"bvh*\" }, thesis = 33.09",
        "on = \"Living Room\", of = { accel = \"bvh*\" }, thesis = 33.09",
    ),
    (
        "dufay-table-4-2",
        "row = \"Museum\", on = \"Museum\", thesis = 0.358",
        "row = \"Hairball\", on = \"Museum\", thesis = 0.358",
    ),
    // Another unit.
    (
        "nilsson-table-5-2",
        "column = \"ms\"\n",
        "column = \"ms\"\nunit = \"s\"\n",
    ),
    (
        "nilsson-table-5-4",
        "column = \"Cornell Box\"\n",
        "column = \"Cornell Box\"\nunit = \"s\"\n",
    ),
    // A ratio inverted, with another side, of another figure.
    ("nilsson-table-5-2", "thesis = 1.156", "thesis = 0.865"),
    (
        "nilsson-table-5-3",
        "of = { sequence = \"pixel-hash(seeding=sample)\" }\nover = { sequence = \"pixel-hash\" }",
        "of = { sequence = \"pixel-hash\" }\nover = { sequence = \"pixel-hash(seeding=sample)\" }",
    ),
    (
        "dufay-table-4-2",
        "thesis = 1.763, least",
        "thesis = 1.768, least = 1.0, most",
    ),
    ("dufay-table-2-2", "thesis = 1.26 }", "thesis = 1.2 }"),
    // Errata: the factors of San Miguel are swapped in print.
    ("dufay-tables-3-2-to-3-5", "thesis = 1.667", "thesis = 1.41"),
    // A table of another GPU, other roulette.
    (
        "dufay-tables-3-2-to-3-5",
        "column = \"3.2: GTX 970\"",
        "column = \"3.3: K4000M\"",
    ),
    // Another method, other numbers of elements.
    (
        "roger-stream-reduction",
        "compaction:blelloch(elements=262144,valid=0.6,bytes=8)\" }, thesis = 3.9",
        "compaction:horn(elements=262144,valid=0.6,bytes=8)\" }, thesis = 3.9",
    ),
    ("roger-stream-reduction", "thesis = 0.37", "thesis = 0.36"),
    // Another list, the other pipeline, another size.
    (
        "pfeuti-tables-4-1-to-4-5",
        "media:pipeline(points=halton,photons=512,side=*)\" }, thesis = 163",
        "media:pipeline(points=random,photons=512,side=*)\" }, thesis = 163",
    ),
    (
        "pfeuti-tables-4-1-to-4-5",
        "column = \"Reference\", thesis = 110",
        "column = \"Adaptive\", thesis = 110",
    ),
    (
        "pfeuti-tables-4-1-to-4-5",
        "(photons=512,side=*)\" }, thesis = 109",
        "(photons=256,side=*)\" }, thesis = 109",
    ),
];

#[test]
fn faults_planted_in_numbers_rows_columns_scenes_and_units_are_seen() {
    let mut unseen = BTreeSet::new();
    for (name, old, new) in PLANTED {
        let source = SOURCES.iter().find(|source| source.name == name);
        let whole = source.expect("a file").text;
        assert!(whole.contains(old), "{name} has no {old}");
        let thesis = Thesis::parse(&whole.replacen(old, new, 1), name);
        let thesis = thesis.expect("readable").expect("a thesis");
        let Some(text) = digest(&thesis.source) else {
            return;
        };
        if faults(name, &thesis, &text).0.is_empty() {
            unseen.insert((name, new));
        }
    }
    assert!(unseen.is_empty(), "{unseen:?}");
}
