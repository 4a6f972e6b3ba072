//! Reading and writing files of records.

use super::old::{is_old, renewed};
use super::sound::fault_of;
use super::{Line, SCHEMA, Sound};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// Name of the records in a run's folder.
pub const RECORDS_FILE: &str = "records.jsonl";

/// Name of records packed by gzip, as published results are stored.
const PACKED_FILE: &str = "records.jsonl.gz";

/// The first bytes of a gzip file (RFC 1952).
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Folder, below that of a run, that holds records and images until the run ends; left over by a killed run.
pub const PARTIAL: &str = "partial";

/// The content of a file of records.
#[derive(Debug, Clone, PartialEq)]
pub struct Records<B = super::Body> {
    /// Every whole line, in order.
    pub lines: Vec<Line<B>>,
    /// Parts left out while reading, in words.
    pub warnings: Vec<String>,
    /// Number of lines of older versions.
    pub old: usize,
}

/// A reason why records cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The file cannot be read.
    #[error("cannot read {}: {source}; give the folder that `raystone run` or `raystone stress` wrote", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// The file holds no record.
    #[error("{} holds no record: the run wrote nothing before it ended", path.display())]
    NoRecords {
        /// The file.
        path: PathBuf,
    },
    /// The records are of another version.
    #[error(
        "{}:{line}: schema {found:?}, but this program reads {wanted:?}; use the version that wrote it",
        path.display()
    )]
    Schema {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The schema found.
        found: String,
        /// The schema that is read.
        wanted: &'static str,
    },
    /// A line is no record.
    #[error("{}:{line}: not a record: {source}; remove the line to read the rest", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The cause.
        source: serde_json::Error,
    },
    /// A line holds values that no run writes.
    #[error("{}:{line}: a damaged record: {what}; remove the line to read the rest", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The impossible value.
        what: String,
    },
}

/// Only the tag, by which a line of another version is distinguished from a broken one.
#[derive(Deserialize)]
struct Tag {
    schema: String,
}

/// Returns the file with the records of a run's folder: packed ones only where there are no plain ones.
pub fn records_file(dir: &Path) -> PathBuf {
    let plain = dir.join(RECORDS_FILE);
    let packed = dir.join(PACKED_FILE);
    let is_there = |path: &Path| std::fs::symlink_metadata(path).is_ok();
    if !is_there(&plain) && is_there(&packed) {
        packed
    } else {
        plain
    }
}

/// Reads the records of a run in `dir`: see [`read_lines`].
///
/// # Errors
/// As there.
pub fn read_records(dir: &Path) -> Result<Records, RecordError> {
    read_lines(&records_file(dir), SCHEMA)
}

/// Returns the bytes of a file, unpacked if it was packed by gzip. Bytes, because a crash can cut a line inside a
/// character.
fn unpacked(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = std::fs::read(path)?;
    if !bytes.starts_with(&GZIP) {
        return Ok(bytes);
    }
    let mut text = Vec::new();
    flate2::read::MultiGzDecoder::new(&*bytes).read_to_end(&mut text)?;
    Ok(text)
}

/// Reads a file of records of this schema, packed by gzip or not, those of a run also if they are of an older version. A
/// last line without its newline that does not parse is left by a crash: it is left out with a warning.
///
/// # Errors
/// A missing or empty file, a line of another schema, a broken line elsewhere, or one that no run writes.
pub fn read_lines<B: DeserializeOwned + Sound>(
    path: &Path,
    wanted: &'static str,
) -> Result<Records<B>, RecordError> {
    let bytes = unpacked(path).map_err(|source| RecordError::Read {
        path: path.into(),
        source,
    })?;
    let mut records = Records {
        lines: Vec::new(),
        warnings: Vec::new(),
        old: 0,
    };
    let whole = bytes.is_empty() || bytes.ends_with(b"\n");
    let mut rows = bytes.split(|&byte| byte == b'\n').enumerate().peekable();
    while let Some((index, row)) = rows.next() {
        if row.trim_ascii().is_empty() {
            continue;
        }
        let truncated = !whole && rows.peek().is_none();
        let line = index + 1;
        let parsed = match serde_json::from_slice::<Tag>(row) {
            Ok(tag) if is_old(&tag.schema, wanted) => {
                records.old += 1;
                serde_json::from_slice(row)
                    .and_then(renewed)
                    .and_then(serde_json::from_value)
            }
            Ok(Tag { schema: found }) if found != wanted => {
                return Err(RecordError::Schema {
                    path: path.into(),
                    line,
                    found,
                    wanted,
                });
            }
            Err(_) if truncated => {
                let file = path.file_name().unwrap_or_default().display();
                let text = format!("line {line} of {file} is cut off and was left out");
                records.warnings.push(text);
                continue;
            }
            _ => serde_json::from_slice(row),
        };
        let parsed: Line<B> = parsed.map_err(|source| RecordError::Parse {
            path: path.into(),
            line,
            source,
        })?;
        if let Some(what) = parsed.body.fault().or_else(|| fault_of(&parsed.readings)) {
            return Err(RecordError::Damaged {
                path: path.into(),
                line,
                what,
            });
        }
        records.lines.push(parsed);
    }
    if records.lines.is_empty() {
        Err(RecordError::NoRecords { path: path.into() })
    } else {
        Ok(records)
    }
}

/// Returns lines as they are written to a file.
///
/// # Errors
/// A body cannot be written as JSON.
pub fn text_of<'a, B: Serialize + 'a>(
    lines: impl IntoIterator<Item = &'a Line<B>>,
) -> serde_json::Result<String> {
    let mut text = String::new();
    for line in lines {
        text += &serde_json::to_string(line)?;
        text.push('\n');
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str =
        r#"{"schema":"raystone/3","body":{"kind":"skipped","cell":"a","reason":"b"}}"#;

    fn read(text: &str) -> Result<Records, RecordError> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join(RECORDS_FILE), text).unwrap();
        read_records(dir.path())
    }

    #[test]
    fn a_cut_off_last_line_is_left_out_with_a_warning() {
        let records = read(&format!("{GOOD}\n{}", &GOOD[..40])).unwrap();
        assert_eq!((records.lines.len(), records.warnings.len()), (1, 1));
        assert!(records.warnings[0].contains("line 2 of records.jsonl"));
        let whole = read(&format!("{GOOD}\n{GOOD}")).unwrap();
        assert_eq!((whole.lines.len(), whole.warnings.len()), (2, 0));
        assert_eq!(text_of(&whole.lines).unwrap(), format!("{GOOD}\n{GOOD}\n"));
    }

    #[test]
    fn a_broken_line_that_was_ended_is_an_error_with_its_number() {
        let text = format!("{GOOD}\n{}\n{GOOD}\n", &GOOD[..40]);
        assert!(matches!(
            read(&text),
            Err(RecordError::Parse { line: 2, .. })
        ));
        // Readers of structures take lists for them.
        for schema in ["raystone/1", "raystone/2", "raystone/3"] {
            let list = read(&format!("{GOOD}\n[\"{schema}\"]\n"));
            assert!(
                matches!(list, Err(RecordError::Parse { line: 2, .. })),
                "{schema}: {list:?}"
            );
        }
    }

    #[test]
    fn packed_records_stand_for_those_that_are_not_there() {
        use std::io::Write as _;
        let dir = tempfile::tempdir().unwrap();
        let packed = |text: &str| {
            let mut out = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            out.write_all(text.as_bytes()).unwrap();
            out.finish().unwrap()
        };
        let write = |name, bytes: &[u8]| std::fs::write(dir.path().join(name), bytes).unwrap();
        // Two parts, as of two packed files put together.
        let both = [packed(&format!("{GOOD}\n")), packed(&format!("{GOOD}\n"))].concat();
        write(PACKED_FILE, &both);
        assert_eq!(read_records(dir.path()).unwrap().lines.len(), 2);
        write(PACKED_FILE, &both[..both.len() - 9]);
        let cut = read_records(dir.path()).unwrap_err();
        assert!(matches!(cut, RecordError::Read { .. }), "{cut}");
        assert!(cut.to_string().contains(PACKED_FILE), "{cut}");
        write(RECORDS_FILE, format!("{GOOD}\n").as_bytes());
        assert_eq!(read_records(dir.path()).unwrap().lines.len(), 1);
    }

    #[test]
    fn a_missing_and_an_empty_file_are_errors() {
        assert!(matches!(read(""), Err(RecordError::NoRecords { .. })));
        assert!(matches!(
            read_records(Path::new("/nonexistent")),
            Err(RecordError::Read { .. })
        ));
    }
}
