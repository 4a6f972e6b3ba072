//! Measures of point sets against published values and their definitions, the `raystone
//! points` command, and SciPy on the same points.

mod bounds;
mod nets;
mod quadratic;
mod sets;
mod star;
mod sweep;

use crate::support::needs;
use raystone::discrepancy::{Budget, Measure, PointSet, Quadratic, quadratic};
use serde_json::Value;
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Output, Stdio};

fn run(arguments: &[&str], input: &str) -> Output {
    let mut child = Command::new(env!("CARGO_BIN_EXE_raystone"))
        .arg("points")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    // With bad arguments the program ends before reading its input.
    let _ = stdin.write_all(input.as_bytes());
    drop(stdin);
    child.wait_with_output().expect("the program ends")
}

fn results(arguments: &[&str], input: &str) -> Value {
    let output = run(arguments, input);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn refusal(arguments: &[&str], input: &str) -> String {
    let output = run(arguments, input);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.starts_with("error: "), "{message}");
    assert!(!message.contains("panicked"), "{message}");
    message
}

const SIX: &str = "\
# six points
0.083333333333333329 0.41666666666666669
0.25,0.91666666666666663
0.41666666666666669\t0.25
0.58333333333333337 0.75  # blanks
0.75, 0.083333333333333329

0.91666666666666663 0.58333333333333337
";

#[test]
fn points_from_standard_input_are_measured_to_the_published_values() {
    let results = results(&[], SIX);
    assert_eq!((&results["n"], &results["dim"]), (&6.into(), &2.into()));
    let star = &results["measures"]["star"];
    assert_eq!(star["exact"], Value::Bool(true));
    for (measure, field, expected) in [
        ("star", "value", 0.229_166_666_666_666_69),
        ("star", "lower", 0.229_166_666_666_666_69),
        ("star", "upper", 0.229_166_666_666_666_69),
        ("l2star", "root", 0.06833606212558091),
        ("centered", "square", 0.008142039609053464),
        ("wrap", "square", 0.01684670781892894),
        ("mixture", "square", 0.014895592206789487),
    ] {
        let found = results["measures"][measure][field].as_f64().expect(field);
        assert!(
            (found - expected).abs() < 2e-15,
            "{measure} {field}: {found}"
        );
        assert!(
            results["measures"][measure]["seconds"].is_f64(),
            "{measure}"
        );
    }
}

#[test]
fn a_file_and_fewer_dimensions_can_be_chosen() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join("points.csv");
    std::fs::write(&file, "0.5,0.25,0.9\n0.125,0.75,0.1\n").expect("a writable folder");
    let name = file.to_str().expect("a path in UTF-8");
    let results = results(&["--dim", "1", "--measure", "star, distance", name], "");
    assert_eq!(results["dim"], 1);
    assert_eq!(results["measures"]["star"]["value"], 0.5);
    assert_eq!(results["measures"]["distance"]["value"], 0.375);
    let message = refusal(&["--dim", "4", name], "");
    assert!(
        message.contains("--dim 4") && message.contains("3 coordinates"),
        "{message}"
    );
}

#[test]
fn every_measure_has_a_result_or_a_reason() {
    let results = results(&["--measure", "all", "-"], "0 0\n0.5 0.5\n0.25 0.75\n");
    let measures = results["measures"].as_object().expect("measures");
    assert_eq!(measures.len(), Measure::ALL.len());
    for kind in Measure::ALL {
        let fields = measures[kind.name()].as_object().expect("fields");
        assert!(fields.len() >= 2, "{fields:?}");
        let needs_a_power_of_two = matches!(kind, Measure::NetQuality | Measure::Intervals);
        assert_eq!(
            fields.contains_key("reason"),
            needs_a_power_of_two,
            "{fields:?}"
        );
    }
}

#[test]
fn a_star_discrepancy_out_of_time_is_an_interval_without_a_value() {
    let mut text = String::new();
    let mut state = 1u64;
    for index in 0..7 * 4000 {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        let gap = if index % 7 == 6 { '\n' } else { ' ' };
        // Writing to a string cannot fail.
        let _ = write!(text, "{}{gap}", (state >> 11) as f64 / 2f64.powi(53));
    }
    let results = results(&["--measure", "star", "--budget", "0.5"], &text);
    let star = results["measures"]["star"].as_object().expect("fields");
    assert_eq!(star["exact"], Value::Bool(false));
    assert!(!star.contains_key("value"), "{star:?}");
    let bound = |name: &str| star[name].as_f64().expect("a bound");
    assert!(
        0.0 < bound("lower") && bound("lower") < bound("upper"),
        "{star:?}"
    );
}

#[test]
fn bad_input_ends_with_2_and_names_the_line_or_the_nearest_name() {
    for (input, words) in [
        ("0.5 0.5\n0.5 1.5\n", ["standard input:2", "1.5"]),
        ("0.5 nan\n", ["standard input:1", "NaN"]),
        ("0.5 0.5\n\n0.5\n", ["standard input:3", "have 2"]),
        ("0.5 abc\n", ["standard input:1", "`abc`"]),
        ("\n\n0.5 -1e-9\n", ["standard input:3", "-0.000000001"]),
        ("inf 0\n", ["standard input:1", "inf"]),
        ("# nothing\n\n", ["standard input", "at least one point"]),
        ("", ["standard input", "at least one point"]),
    ] {
        let message = refusal(&[], input);
        assert!(words.iter().all(|w| message.contains(w)), "{message}");
    }
    for (arguments, word) in [
        (&["--measure", "centred"][..], "did you mean `centered`"),
        (&["--budget", "0"], "--budget"),
        (&["--budget", "-1"], "--budget"),
        (&["--budget", "nan"], "--budget"),
        (&["--dim", "0"], "--dim"),
        (&["no/such.txt"], "no/such.txt"),
    ] {
        let message = refusal(arguments, "0.5 0.5\n");
        assert!(message.contains(word), "{message}");
    }
}

const SCIPY: &str = "\
import sys, numpy as np
from scipy.stats import qmc
for line in sys.stdin:
    dim, *values = line.split()
    points = np.array(values, dtype=float).reshape(-1, int(dim))
    found = [qmc.discrepancy(points, method=m) for m in ('L2-star', 'CD', 'WD', 'MD')]
    print(*(repr(float(v)) for v in found))
";

/// A Python with SciPy, from `$RAYSTONE_PYTHON` or the path; or why there is none.
fn python_with_scipy() -> Result<String, String> {
    let python = std::env::var("RAYSTONE_PYTHON").unwrap_or_else(|_| "python3".to_owned());
    let found = Command::new(&python)
        .args(["-c", "import scipy.stats"])
        .output();
    match found {
        Ok(output) if output.status.success() => Ok(python),
        Ok(output) => Err(String::from_utf8_lossy(&output.stderr).into_owned()),
        Err(error) => Err(format!("{python}: {error}")),
    }
}

#[test]
fn mean_square_discrepancies_agree_with_scipy() {
    let python = match python_with_scipy() {
        Ok(python) => python,
        Err(reason) => {
            needs::skip("scipy", reason);
            return;
        }
    };
    let mut state = 7u64;
    let mut next = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / 2f64.powi(53)
    };
    let sets: Vec<PointSet> = [(2, 17), (2, 300), (3, 64), (5, 100), (1, 9), (8, 33)]
        .map(|(dim, n)| PointSet::new(dim, (0..dim * n).map(|_| next()).collect()))
        .into_iter()
        .map(|set| set.expect("points"))
        .collect();
    let mut text = String::new();
    for set in &sets {
        let all = set.points().flatten().map(f64::to_string);
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} {}", set.dim(), all.collect::<Vec<_>>().join(" "));
    }
    let mut child = Command::new(python)
        .args(["-c", SCIPY])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("Python starts");
    let mut stdin = child.stdin.take().expect("a pipe");
    stdin.write_all(text.as_bytes()).expect("Python reads");
    drop(stdin);
    let output = child.wait_with_output().expect("Python ends");
    let answer = String::from_utf8(output.stdout).expect("text");
    assert_eq!(answer.lines().count(), sets.len());
    for (set, line) in sets.iter().zip(answer.lines()) {
        let found: Vec<f64> = line
            .split(' ')
            .map(|v| v.parse().expect("a number"))
            .collect();
        let kinds = [
            Quadratic::L2Star,
            Quadratic::Centered,
            Quadratic::WrapAround,
            Quadratic::Mixture,
        ];
        for (kind, found) in kinds.into_iter().zip(found) {
            let square = quadratic(set, kind, &Budget::seconds(60.0)).expect("a value");
            // SciPy gives the root of the first and the square of the others.
            let own = if kind == Quadratic::L2Star {
                square.sqrt()
            } else {
                square
            };
            assert!(
                (own / found - 1.0).abs() < 1e-9,
                "{kind:?}: {own} is not {found}"
            );
        }
    }
}
