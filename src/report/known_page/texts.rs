//! Comparisons, histories, verdicts and exports of known records, made anew before any is shown: a ratio the other way round
//! or the ends of an interval exchanged look like another program or another machine.
//!
//! The candidate of the comparison takes a quarter longer, visits twice as many nodes, holds half as many bytes and has one and a half
//! times the error; the history is of ten runs, the last four of which have half the rate. `comparison.txt` and `history.txt` were read against that.
//! Of exports `exports.txt` has the number of lines and a digest. They are written by
//! `RAYSTONE_WRITE_PAGES=1 cargo test -p raystone-report known_page`; read the difference before you commit it.

use super::{RECORDS, differing};
use crate::compare::judge::Effects;
use crate::compare::side::Side;
use crate::compare::{Comparison, Confirmed, Options, compare_sides, show};
use crate::export::select::Selection;
use crate::export::{FORMATS, Source, Writer};
use crate::history::History;
use crate::repro::judge::{Bounds, ClaimVerdict, factor};
use crate::terminal::Screen;
use raystone_record::{Interval, Line};
use serde_json::Value;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const COMPARISON: &str = include_str!("comparison.txt");
const HISTORY: &str = include_str!("history.txt");
const EXPORTS: &str = include_str!("exports.txt");

/// Makes them.
///
/// # Errors
/// A line of them is another: both.
pub fn check() -> Result<(), String> {
    let wrong = |fault| {
        format!(
            "{fault}: this program shows wrong figures; build it anew, and report what stays wrong"
        )
    };
    verdicts().map_err(wrong)?;
    for (what, text, expected) in [
        ("a comparison", comparison(), COMPARISON),
        ("a history", history(), HISTORY),
        ("an export", exports(), EXPORTS),
    ] {
        text.and_then(|text| differing(what, &text, expected))
            .map_err(wrong)?;
    }
    Ok(())
}

/// By what numbers of a key are multiplied.
type Factors = &'static [(&'static str, f64)];

const SLOWER: Factors = &[
    ("ms", 1.25),
    ("wall_ms", 1.25),
    ("build_ms", 1.25),
    ("ms_per_spp", 1.25),
    ("mrays_s", 0.8),
    ("nodes", 2.0),
    ("bytes", 0.5),
    ("metrics", 1.5),
];

/// Multiplies all numbers below the keys.
fn altered(value: &mut Value, factors: &[(&str, f64)], own: f64) {
    match value {
        Value::Number(number) if own != 1.0 => {
            let scaled = number.as_f64().unwrap_or(0.0) * own;
            *value = if number.is_f64() {
                scaled.into()
            } else {
                (scaled.round() as u64).into()
            };
        }
        // No two neighbours alike, so that intervals have a width.
        Value::Array(all) if own != 1.0 => {
            for (k, value) in all.iter_mut().enumerate() {
                altered(value, factors, own * (1.0 + 0.002 * (k % 3) as f64));
            }
        }
        Value::Array(all) => {
            for value in all {
                altered(value, factors, 1.0);
            }
        }
        Value::Object(all) => {
            for (key, value) in all {
                let factor = factors.iter().find(|(name, _)| name == key);
                altered(value, factors, factor.map_or(own, |(_, factor)| *factor));
            }
        }
        _ => {}
    }
}

/// The known records, altered, with the time of two processors beside each time of an image.
fn records(factors: &[(&str, f64)], started: u64) -> Result<Vec<Line>, String> {
    let fault = |error: serde_json::Error| format!("known records: {error}");
    let mut lines = Vec::new();
    for text in RECORDS.lines() {
        let mut line: Value = serde_json::from_str(text).map_err(fault)?;
        altered(&mut line, factors, 1.0);
        let body = &mut line["body"];
        if body["kind"] == "time" {
            let mut both = body["ms"].clone();
            altered(&mut both, &[], 2.0);
            body["cpu_ms"] = both;
        }
        if body["kind"] == "run" {
            body["started_unix_s"] = started.into();
        }
        lines.push(serde_json::from_value(line).map_err(fault)?);
    }
    Ok(lines)
}

/// By run, in the same rounds, and with a tolerance of exact figures.
fn comparison() -> Result<String, String> {
    let [base, candidate] = [records(&[], 0)?, records(SLOWER, 0)?];
    let compared = |in_rounds, exact| {
        let side = |name: &str, lines: &[Line]| Side {
            in_rounds,
            ..Side::new(name, lines.to_vec(), Vec::new())
        };
        let options = Options {
            effects: Effects {
                exact,
                ..Effects::default()
            },
            ..Options::default()
        };
        let (base, candidate) = (side("base", &base), side("candidate", &candidate));
        compare_sides(&base, &candidate, &options, &Confirmed::default())
    };
    let apart = compared(false, 0.0);
    let mut text = show::terminal(&apart, Screen::default());
    for (what, comparison) in [
        ("two runs", apart),
        ("the same rounds", compared(true, 0.0)),
        ("a tolerance of 0.6", compared(false, 0.6)),
    ] {
        text += &findings(what, &comparison);
    }
    Ok(text)
}

/// Of each figure the verdict on the first cell, and how many cells have it.
fn findings(what: &str, comparison: &Comparison) -> String {
    let mut text = format!("{what}: {}\n", show::verdict_line(comparison));
    let mut figures: Vec<&str> = Vec::new();
    for finding in &comparison.findings {
        let id: &str = &finding.figure.id;
        if figures.contains(&id) {
            continue;
        }
        figures.push(id);
        let alike = (comparison.findings.iter())
            .filter(|other| other.figure.id == id && other.verdict == finding.verdict);
        let change = finding.measured.map_or(String::new(), |measured| {
            let Interval { value, low, high } = measured.change;
            format!(" {value:.3} {low:.3} {high:.3} p {:.2e}", measured.p)
        });
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{id} {}: {} ({}){change} {:?} {}",
            finding.key,
            finding.verdict.word(),
            alike.count(),
            finding.shown,
            finding.why,
        );
    }
    text
}

/// Rates and bytes of ten runs, about one per cent apart; the last four have half the rate and, from the eighth on, twice the bytes.
fn history() -> Result<String, String> {
    let mut all: Vec<(PathBuf, Vec<Line>)> = Vec::new();
    // Not in the order of time.
    for run in (0..10_u32).rev() {
        let rate = (1.0 + 0.01 * f64::from(run % 3)) * if run < 6 { 1.0 } else { 0.5 };
        let bytes = if run < 7 { 1.0 } else { 2.0 };
        let factors = [("mrays_s", rate), ("bytes", bytes)];
        let lines = records(&factors, 1_763_700_000 + u64::from(run))?;
        all.push((PathBuf::from(format!("run-{run}")), lines));
    }
    let figures = ["mrays-per-s/v1", "bytes/v1"].map(str::to_owned);
    let choice = Selection::new(&figures, &[]).map_err(|e| e.to_string())?;
    let history = History::new(&all, &choice).map_err(|e| e.to_string())?;
    let mut text = history.summary() + "\n";
    for series in history.series.iter().filter(|series| series.tested) {
        for change in &series.changes {
            let folder = history.runs[change.run].folder.display();
            let p = change.p.map_or(String::new(), |p| format!(" p {p:.3}"));
            let _ = writeln!(
                text,
                "{} {}: from {folder} on {:.5} {:.5}{p}",
                series.figure.id, series.key, change.before, change.after
            );
        }
    }
    Ok(text)
}

/// Each format as lines and a digest.
fn exports() -> Result<String, String> {
    let lines = records(&[], 0)?;
    let choice = Selection::default();
    let source = Source::new(Path::new("no such folder"), &lines, &choice);
    let source = source.map_err(|e| e.to_string())?;
    let mut text = String::new();
    for format in &FORMATS {
        if let Writer::Text(write) = format.write {
            let exported = write(&source);
            let digest = blake3::hash(exported.text.as_bytes()).to_hex();
            let _ = writeln!(
                text,
                "{}: {} lines, {}, {} parts left out",
                format.name,
                exported.text.lines().count(),
                &digest[..16],
                exported.left_out.len()
            );
        }
    }
    Ok(text)
}

/// Verdicts on claims, and units.
fn verdicts() -> Result<(), String> {
    use ClaimVerdict::{Contradicted, NotTestable, Supported, Undecided};
    let interval = |low, high| Interval {
        value: 0.5 * (low + high),
        low,
        high,
    };
    for (least, most, low, high, expected) in [
        (Some(1.0), None, 1.1, 1.3, Supported),
        (Some(1.0), None, 0.7, 0.9, Contradicted),
        (Some(1.0), None, 0.9, 1.3, Undecided),
        (None, Some(1.0), 0.7, 0.9, Supported),
        (None, Some(1.0), 1.1, 1.3, Contradicted),
        (Some(1.0), Some(2.0), 1.2, 1.8, Supported),
        (Some(1.0), Some(2.0), 1.8, 2.2, Undecided),
        (Some(1.0), Some(2.0), 2.1, 2.2, Contradicted),
    ] {
        let found = Bounds::new(least, most).judge(interval(low, high));
        if found != expected {
            return Err(format!(
                "a claim that {low} to {high} is within {least:?} and {most:?} is {}, and should be {}",
                found.word(),
                expected.word()
            ));
        }
    }
    for (all, expected) in [
        (vec![Supported, NotTestable], Supported),
        (vec![Supported, Undecided, Supported], Undecided),
        (vec![Contradicted, Undecided, Supported], Contradicted),
        (Vec::new(), NotTestable),
    ] {
        let found = ClaimVerdict::of_all(all.iter().copied());
        if found != expected {
            return Err(format!(
                "a claim of {all:?} is {}, and should be {}",
                found.word(),
                expected.word()
            ));
        }
    }
    // Two seconds are 2,000 ms, and 3 KiB 3,072 bytes.
    for (from, to, expected) in [("s", "ms", 1e3), ("KiB", "bytes", 1024.0), ("%", "", 1e-2)] {
        let found = factor(from, to).unwrap_or(f64::NAN);
        let agrees = (found / expected - 1.0).abs() < 1e-12;
        if !agrees {
            return Err(format!(
                "1 {from} is {found} {to}, and should be {expected}"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_texts_are_the_known_ones() {
        if std::env::var_os("RAYSTONE_WRITE_PAGES").is_some() {
            let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("known_page");
            for (name, text) in [
                ("comparison.txt", comparison()),
                ("history.txt", history()),
                ("exports.txt", exports()),
            ] {
                std::fs::write(folder.join(name), text.expect("known records")).expect("written");
            }
            return;
        }
        assert_eq!(check(), Ok(()));
    }
}
