//! Damaged records: no reader panics, and no impossible value becomes a figure.

use super::{folder_of, records, run_folder};
use raystone::compare::judge::ChangeVerdict;
use raystone::compare::side::Side;
use raystone::compare::{Confirmed, Options, compare_sides, show};
use raystone::export::select::Selection;
use raystone::export::{FORMATS, Source, Writer};
use raystone::history::History;
use raystone::measure::record::{Records, read_records};
use raystone::random::Pcg32;
use raystone::report::write_report;
use raystone::run::{Inventory, Registries, merge};
use serde_json::{Value, json};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// Damaged files of one run of the test.
const MUTANTS: u64 = 300;
/// One in so many of them is made into pages, which take longest.
const PAGES: u64 = 10;

/// Replacements of a value. Numbers of another unit, sign or size; words; nothing.
fn damages(old: &Value) -> Vec<Value> {
    let mut all = vec![
        json!(0),
        json!(-1),
        json!(-0.5),
        json!(1e300),
        json!(-1e300),
        json!(5e-324),
        json!(u64::MAX),
        json!(i64::MIN),
        json!(u32::MAX),
        json!("NaN"),
        json!(""),
        json!("\u{0}/../x"),
        json!([]),
        json!({}),
        json!([[[]]]),
        json!(true),
        Value::Null,
    ];
    if let Some(number) = old.as_f64() {
        all.extend([1e3, 1e-3, -1.0, 1.001].map(|unit| json!(unit * number)));
    }
    if let Some(list) = old.as_array() {
        all.push(json!([list.first()]));
        all.push(json!(list.iter().chain(list).collect::<Vec<_>>()));
        all.push(json!(list.iter().skip(1).collect::<Vec<_>>()));
    }
    all
}

/// Lists the places of all values of a record.
fn places(value: &Value, at: &str, into: &mut Vec<String>) {
    match value {
        Value::Object(map) => {
            for (key, inner) in map {
                let key = key.replace('~', "~0").replace('/', "~1");
                places(inner, &format!("{at}/{key}"), into);
            }
        }
        Value::Array(list) => {
            for (index, inner) in list.iter().enumerate().take(3) {
                places(inner, &format!("{at}/{index}"), into);
            }
        }
        _ => {}
    }
    into.push(at.to_owned());
}

fn pick<'a, T>(random: &mut Pcg32, of: &'a [T]) -> &'a T {
    &of[random.below(of.len())]
}

/// Removes a value, or renames it.
fn rename(record: &mut Value, at: &str, to: Option<&str>) {
    let Some((parent, key)) = at.rsplit_once('/') else {
        return;
    };
    if let Some(map) = record.pointer_mut(parent).and_then(Value::as_object_mut) {
        let value = map.remove(&key.replace("~1", "/"));
        if let (Some(to), Some(value)) = (to, value) {
            map.insert(to.to_owned(), value);
        }
    }
}

/// The records after one to three damages.
fn damaged(lines: &[Value], random: &mut Pcg32) -> String {
    let mut lines = lines.to_vec();
    let mut text = None;
    for _ in 0..1 + random.below(3) {
        let index = random.below(lines.len());
        let mut all = Vec::new();
        places(&lines[index], "", &mut all);
        let at = pick(random, &all).clone();
        match random.below(8) {
            0 => rename(&mut lines[index], &at, None),
            1 => rename(&mut lines[index], &at, Some("renamed")),
            2 => drop(lines.remove(index)),
            3 => {
                let twice = lines[index].clone();
                lines.insert(random.below(lines.len()), twice);
            }
            4 => {
                // Text that is no JSON, and numbers that are none.
                let mut raw: Vec<String> = lines.iter().map(Value::to_string).collect();
                let line = &mut raw[index];
                match random.below(3) {
                    0 => line.truncate(line.floor_char_boundary(random.below(line.len()))),
                    1 => *line = line.replacen(":1", ":1e999", 1),
                    _ => *line = line.replacen(":1", ":NaN", 1),
                }
                text = Some(raw.join("\n"));
            }
            _ => {
                if let Some(value) = lines[index].pointer_mut(&at) {
                    *value = pick(random, &damages(value)).clone();
                }
            }
        }
        if lines.is_empty() {
            break;
        }
    }
    let whole = || lines.iter().map(|line| format!("{line}\n")).collect();
    text.unwrap_or_else(whole)
}

/// Everything that reads records, on a folder of them beside a sound one. Errors are answers.
fn read_all(sound: &Side, folder: &Path, pages: bool) {
    let out = tempfile::tempdir().expect("a temporary folder");
    let registries = Registries::default();
    if let Ok(side) = Side::read(folder) {
        let found = compare_sides(sound, &side, &Options::default(), &Confirmed::new());
        let _ = (show::markdown(&found), show::json(&found));
        let _ = compare_sides(&side, sound, &Options::default(), &Confirmed::new());
    }
    let _ = Inventory::read(folder, &registries);
    let Ok(Records { lines, .. }) = read_records(folder) else {
        return;
    };
    let all = Selection::new(&[], &[]).expect("no choice");
    if let Ok(source) = Source::new(folder, &lines, &all) {
        for format in &FORMATS {
            match &format.write {
                Writer::Text(write) => drop(write(&source)),
                Writer::Folder(write) => drop(write(&source, &out.path().join(format.name))),
            }
        }
    }
    let runs = [run_folder(), folder.to_owned()].map(|dir: PathBuf| {
        let lines = read_records(&dir).map(|records| records.lines);
        (dir, lines.unwrap_or_default())
    });
    if let Ok(history) = History::new(&runs, &all) {
        let _ = (history.json(), history.changes_table(), history.summary());
    }
    let dirs = [run_folder(), folder.to_owned()];
    let _ = merge(&dirs, &out.path().join("merged"), None, &registries);
    if pages {
        let _ = write_report(folder);
    }
}

fn lines() -> Vec<Value> {
    let parsed = |line: &str| serde_json::from_str(line).expect("a record");
    records().lines().map(parsed).collect()
}

#[test]
fn nothing_panics_on_damaged_records() {
    let sound = Side::read(&run_folder()).expect("sound records");
    let lines = lines();
    let mut panics = Vec::new();
    for mutant in 0..MUTANTS {
        let text = damaged(&lines, &mut Pcg32::new(mutant));
        let folder = folder_of(&text);
        let read = || read_all(&sound, folder.path(), mutant % PAGES == 0);
        if catch_unwind(AssertUnwindSafe(read)).is_err() {
            panics.push(mutant);
        }
    }
    assert!(panics.is_empty(), "mutants {panics:?} of {MUTANTS}");
}

/// A record of the run with this in the place of a value, or without it.
fn with(kind: &str, at: &str, value: Option<Value>) -> String {
    let mut lines = lines();
    let mut hit = 0;
    for line in lines.iter_mut().filter(|l| l["body"]["kind"] == kind) {
        let Some(place) = line.pointer_mut(at) else {
            continue;
        };
        hit += 1;
        match &value {
            Some(value) => *place = value.clone(),
            None => rename(line, at, Some("renamed")),
        }
    }
    assert!(hit > 0, "no {kind} with {at}");
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// Compares with damaged records: an error, or the verdict.
fn said(text: &str) -> Result<(ChangeVerdict, usize), String> {
    let folder = folder_of(text);
    let sound = Side::read(&run_folder()).expect("sound records");
    let side = Side::read(folder.path()).map_err(|e| e.to_string())?;
    let found = compare_sides(&sound, &side, &Options::default(), &Confirmed::new());
    Ok((found.verdict(), found.count(ChangeVerdict::Undecided)))
}

#[test]
fn what_cannot_be_is_named_with_its_line() {
    const TIMES: [&str; 3] = [
        "/body/timings/0/ms/0",
        "/body/timings/0/cpu_ms/1",
        "/body/timings/0/wall_ms/0",
    ];
    let structure = TIMES.map(|at| ("structure", at)).into_iter();
    let counters = [
        ("structure", "/body/timings/0/counters/nodes"),
        ("structure", "/body/timings/0/hit_fraction"),
        ("structure", "/body/build_ms"),
        ("time", "/body/cpu_ms/0"),
        ("time", "/body/ms/2"),
        ("error", "/body/errors/0/metrics/mae~1v1"),
        ("stream", "/body/star/0/value/value"),
    ];
    for (kind, at) in structure.chain(counters) {
        for value in [json!(-1.5), json!("NaN"), json!([])] {
            let error = said(&with(kind, at, Some(value.clone()))).expect_err(at);
            assert!(error.contains("records.jsonl:"), "{at} = {value}: {error}");
        }
        let far = with(kind, at, Some(json!("far"))).replacen("\"far\"", "1e999", 1);
        assert!(said(&far).is_err(), "{at}");
    }
}

#[test]
fn what_is_missing_or_nothing_is_not_compared() {
    // Every time of a round is 0: there is no ratio.
    for (kind, at) in [
        ("structure", "/body/timings/0/cpu_ms/0"),
        ("time", "/body/cpu_ms/0"),
    ] {
        let (verdict, open) = said(&with(kind, at, Some(json!(0.0)))).expect("records");
        assert_eq!(verdict, ChangeVerdict::Undecided, "{at}");
        assert!(open > 0, "{at}");
    }
    // Called otherwise, as by a program to come.
    for (kind, at) in [
        ("structure", "/body/timings/0/counters"),
        (
            "error",
            "/body/errors/0/metrics/relmse-unbiased~1eps=1e-2~1v1",
        ),
        ("time", "/body/ms_per_spp"),
    ] {
        let (verdict, open) = said(&with(kind, at, None)).expect("records");
        assert_eq!(
            (verdict, open > 0),
            (ChangeVerdict::Undecided, true),
            "{at}"
        );
    }
    for (kind, at) in [
        ("structure", "/body/timings/0/ms"),
        ("error", "/body/seed"),
        ("stream", "/body/star"),
    ] {
        let error = said(&with(kind, at, None)).expect_err(at);
        assert!(error.contains("missing field"), "{at}: {error}");
    }
    // Rounds by one clock that another lacks.
    let fewer = with("time", "/body/cpu_ms", Some(json!([1.0])));
    let error = said(&fewer).expect_err("fewer rounds");
    assert!(error.contains("by one clock and 1 by another"), "{error}");
}
