//! Reading `records.jsonl`.

use super::ReportError;
use crate::measure::record::{Line, SCHEMA};
use serde::Deserialize;
use std::path::Path;

/// Name of the records in a run's folder.
pub const RECORDS_FILE: &str = "records.jsonl";

/// Folder, below that of a run, that holds records and images until the run ends; what a killed run
/// leaves.
pub const PARTIAL: &str = "partial";

/// What a folder's records say.
#[derive(Debug, Clone, PartialEq)]
pub struct Records {
    /// Every whole line, in order.
    pub lines: Vec<Line>,
    /// What was left out while reading, in words.
    pub warnings: Vec<String>,
}

/// Only the tag, so that a line of another version is told from a broken one.
#[derive(Deserialize)]
struct Tag {
    schema: String,
}

/// Reads the records in `dir`. A last line without its newline that does not parse is what a crash
/// leaves: it is left out with a warning.
///
/// # Errors
/// A missing or empty file, a line of another schema, or a broken line elsewhere.
pub fn read_records(dir: &Path) -> Result<Records, ReportError> {
    let path = dir.join(RECORDS_FILE);
    // Bytes, because a crash can cut a line inside a character.
    let bytes = std::fs::read(&path).map_err(|source| ReportError::Read {
        path: path.clone(),
        source,
    })?;
    let mut records = Records {
        lines: Vec::new(),
        warnings: Vec::new(),
    };
    let whole = bytes.is_empty() || bytes.ends_with(b"\n");
    let mut rows = bytes.split(|&byte| byte == b'\n').enumerate().peekable();
    while let Some((index, row)) = rows.next() {
        if row.trim_ascii().is_empty() {
            continue;
        }
        let truncated = !whole && rows.peek().is_none();
        match serde_json::from_slice::<Tag>(row) {
            Ok(tag) if tag.schema != SCHEMA => {
                return Err(ReportError::Schema {
                    path,
                    line: index + 1,
                    found: tag.schema,
                });
            }
            Err(_) if truncated => {
                let text = format!(
                    "line {} of {RECORDS_FILE} is cut off and was left out",
                    index + 1
                );
                records.warnings.push(text);
                continue;
            }
            _ => {}
        }
        let line = serde_json::from_slice(row).map_err(|source| ReportError::Parse {
            path: path.clone(),
            line: index + 1,
            source,
        })?;
        records.lines.push(line);
    }
    if records.lines.is_empty() {
        return Err(ReportError::NoRecords { path });
    }
    Ok(records)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str =
        r#"{"schema":"raystone/1","hash":"","record":{"kind":"skipped","cell":"a","reason":"b"}}"#;

    fn read(text: &str) -> Result<Records, ReportError> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join(RECORDS_FILE), text).unwrap();
        read_records(dir.path())
    }

    #[test]
    fn a_cut_off_last_line_is_left_out_with_a_warning() {
        let records = read(&format!("{GOOD}\n{}", &GOOD[..40])).unwrap();
        assert_eq!((records.lines.len(), records.warnings.len()), (1, 1));
        assert!(records.warnings[0].contains("line 2"));
        let whole = read(&format!("{GOOD}\n{GOOD}")).unwrap();
        assert_eq!((whole.lines.len(), whole.warnings.len()), (2, 0));
    }

    #[test]
    fn a_broken_line_that_was_ended_is_an_error_with_its_number() {
        let text = format!("{GOOD}\n{}\n{GOOD}\n", &GOOD[..40]);
        assert!(matches!(
            read(&text),
            Err(ReportError::Parse { line: 2, .. })
        ));
    }

    #[test]
    fn another_schema_is_named_in_the_error() {
        let error = read(&GOOD.replace("raystone/1", "raystone/7"))
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("raystone/7") && error.contains("raystone/1") && error.contains(":1"),
            "{error}"
        );
    }

    #[test]
    fn a_missing_and_an_empty_file_are_errors() {
        assert!(matches!(read(""), Err(ReportError::NoRecords { .. })));
        assert!(matches!(
            read_records(Path::new("/nonexistent")),
            Err(ReportError::Read { .. })
        ));
    }
}
