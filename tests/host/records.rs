//! Records of the previous version are read, with any content.

use raystone::config::Cell;
use raystone::measure::bias::BiasVerdict;
use raystone::measure::record::{
    BiasRecord, Body, Line, RecordError, SCHEMA, StreamRecord, StructureRecord, TimeRecord, all_of,
    axis, read_lines, text_of,
};
use std::collections::BTreeSet;
use std::path::Path;

/// One line of every kind, as `raystone/1` wrote them.
const OLD: &str = "fuzz/corpus/records/all-kinds.jsonl";

fn read(path: &Path) -> Result<Vec<Line>, RecordError> {
    Ok(read_lines(path, SCHEMA)?.lines)
}

#[test]
fn every_kind_of_the_old_schema_is_read_with_its_key() {
    let lines = read(Path::new(OLD)).expect("old records");
    let kinds: BTreeSet<String> = lines
        .iter()
        .map(|line| format!("{:?}", std::mem::discriminant(&line.body)))
        .collect();
    // Every kind but a failed cell, which is written as a skipped one.
    assert_eq!(kinds.len(), 14, "{kinds:?}");
    assert!(lines.iter().all(|line| line.schema == SCHEMA));
    let structure = all_of::<StructureRecord>(&lines).next().expect("one");
    assert_eq!(structure.key.label(axis::SCENE), "cornell-box");
    assert_eq!(structure.key.name(axis::ACCEL), "brute-force");
    let time = all_of::<TimeRecord>(&lines).next().expect("one");
    let accel = time.key.get(axis::ACCEL).expect("a structure");
    assert_eq!(accel.label, "uniform-grid(lambda=3)");
    assert_eq!(accel.params.0["lambda"].to_string(), "3");
    let cell = Cell::from(time.key).to_string();
    assert!(cell.ends_with("sobol × none"), "{cell}");
    let stream = all_of::<StreamRecord>(&lines).next().expect("one");
    assert_eq!(stream.star[0].value.value, 0.171875);
    let bias = all_of::<BiasRecord>(&lines).next().expect("one");
    assert_eq!(bias.verdict, BiasVerdict::NoBiasFound);
}

#[test]
fn kernels_checks_and_tests_of_old_records_move_to_the_key_and_to_what_ran() {
    let text = std::fs::read_to_string(OLD).expect("old records");
    let line = text
        .lines()
        .find(|line| line.contains("\"kind\":\"structure\""));
    let line = line.expect("a structure");
    let line = line
        .replace("\"label\":\"brute-force\"", "\"label\":\"brute-force @mine\"")
        .replace("\"features\":[]", "\"features\":[\"nee\"]")
        .replace(
            "\"runtime_checks\":true",
            "\"runtime_checks\":false,\"ran\":{\"kernels\":\"mine\",\"triangle\":\"pluecker\",\"kernel_hash\":\"ab\"}",
        );
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("records.jsonl");
    std::fs::write(&path, line + "\n").expect("a file");
    let line = read(&path).expect("a record").remove(0);
    assert_eq!(line.key.label(axis::ACCEL), "brute-force");
    assert_eq!(line.key.label(axis::KERNELS), "mine");
    assert_eq!(line.key.label(axis::TRIANGLE), "pluecker");
    assert_eq!(line.ran.kernel_hash, "ab");
    assert!(line.ran.unchecked && line.ran.features == ["nee"]);
    // Re-written in the present schema, it reads back the same.
    let written = text_of([&line]).expect("JSON");
    assert!(
        written.contains(SCHEMA) && written.contains("\"key\""),
        "{written}"
    );
    std::fs::write(&path, &written).expect("a file");
    assert_eq!(read(&path).expect("a record"), [line]);
}

#[test]
fn an_old_line_that_lost_its_record_is_refused_with_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("records.jsonl");
    for broken in [
        r#"{"schema":"raystone/1","hash":""}"#,
        r#"{"schema":"raystone/1","record":{"kind":"structure","scene":"a"}}"#,
        r#"{"schema":"raystone/0","record":{}}"#,
    ] {
        std::fs::write(&path, format!("{broken}\n")).expect("a file");
        let error = read(&path).expect_err(broken).to_string();
        assert!(error.contains("records.jsonl:1: "), "{error}");
    }
    let line = Line::<Body>::about_all(Body::Failed(raystone::measure::record::SkippedRecord {
        cell: "a".into(),
        reason: "b".into(),
    }));
    assert!(
        text_of([&line])
            .expect("JSON")
            .starts_with("{\"schema\":\"raystone/3\",\"body\"")
    );
}
