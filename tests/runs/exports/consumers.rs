//! The tools that read exports, where they are installed. `RAYSTONE_PYTHON` names a Python that has their packages:
//! `pip install junitparser jsonschema numpy scipy`.

use crate::support::needs;
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Write as _;
use std::process::{Command, Stdio};

fn python() -> String {
    std::env::var("RAYSTONE_PYTHON").unwrap_or_else(|_| "python3".into())
}

/// Standard output of a command that reads `input`; `None` if it is not installed.
fn answer(program: &str, arguments: &[&str], input: &str) -> Option<(bool, String)> {
    let mut command = Command::new(program);
    command
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().ok()?;
    // A program that does not read to the end reports the reason itself.
    let _ = child
        .stdin
        .take()
        .map(|mut stdin| stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().ok()?;
    let words = [output.stdout, output.stderr].concat();
    Some((
        output.status.success(),
        String::from_utf8_lossy(&words).into_owned(),
    ))
}

/// A shell that loads the completions and then knows raystone.
pub fn shell(shell: &str, arguments: &[&str], script: &str) {
    match answer(shell, arguments, script) {
        None => needs::skip("shells", format!("{shell} is not installed")),
        Some((fine, words)) => assert!(fine && words.contains("raystone"), "{shell}: {words}"),
    }
}

/// Runs Python on a text, if it has the module.
fn with_module(module: &str, code: &str, input: &str) {
    let import = format!("import {module}");
    match answer(&python(), &["-c", &import], "") {
        Some((true, _)) => {}
        _ => return needs::skip("python-modules", format!("{} has no {module}", python())),
    }
    let code = format!("import sys, json\n{import}\n{code}");
    let (fine, words) = answer(&python(), &["-c", &code], input).expect("Python");
    assert!(fine, "{module}: {words}");
}

const JUNIT: &str = "
xml = junitparser.JUnitXml.fromstring(sys.stdin.read().encode())
cases = [case for suite in xml for case in suite]
assert len(cases) == xml.tests > 10, (len(cases), xml.tests)
";

const HYPERFINE: &str = "
# As hyperfine's scripts/advanced_statistics.py and plot_whisker.py do.
for result in json.load(sys.stdin)['results']:
    times = numpy.array(result['times'], dtype=float)
    assert len(times) > 0 and numpy.all(times >= 0), result['command']
    assert abs(numpy.mean(times) - result['mean']) <= 1e-9 * result['mean']
    assert abs(numpy.median(times) - result['median']) <= 1e-9 * result['median']
";

const CSV: &str = "
rows = list(csv.DictReader(sys.stdin))
assert rows and all(None not in row and None not in row.values() for row in rows)
";

const RECORDS: &str = "
schema, *lines = sys.stdin.read().split('\\n')
schema = json.loads(schema)
jsonschema.Draft202012Validator.check_schema(schema)
judge = jsonschema.Draft202012Validator(schema)
for line in filter(None, lines):
    judge.validate(json.loads(line))
";

/// The whole of JSON Schema, where our own part of it could be wrong.
pub fn records(schema: &str, lines: &str) {
    with_module("jsonschema", RECORDS, &format!("{schema}\n{lines}"));
}

/// Google Benchmark's own comparison, where Debian's package `libbenchmark-tools` puts it.
const GBENCH: &str = "/usr/share/benchmark/compare.py";

/// The file beside itself: all names are found on both sides with all their repetitions, and nothing differs.
fn google_benchmark(file: &str) {
    let imports = ["-c", "import scipy"];
    let has_scipy = answer(&python(), &imports, "").is_some_and(|(fine, _)| fine);
    if !has_scipy || !std::path::Path::new(GBENCH).is_file() {
        return eprintln!(
            "SKIPPED: {GBENCH} is not installed, or {} has no scipy",
            python()
        );
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let [input, output] = ["in.json", "out.json"].map(|name| folder.path().join(name));
    std::fs::write(&input, file).expect("a writable folder");
    let [input, output] = [&input, &output].map(|path| path.to_str().expect("UTF-8"));
    let arguments = [GBENCH, "--dump_to_json", output, "benchmarks", input, input];
    let (fine, words) = answer(&python(), &arguments, "").expect("Python");
    assert!(fine, "{words}");
    let json = |text: &str| serde_json::from_str::<Value>(text).expect("JSON");
    let found = json(&std::fs::read_to_string(output).expect("what it found"));
    let mut repetitions = BTreeMap::<&str, usize>::new();
    for of_one in found.as_array().expect("families") {
        let measured = of_one["measurements"].as_array().expect("measurements");
        assert!(
            measured.iter().all(|m| m["time"] == 0.0 && m["cpu"] == 0.0),
            "{of_one}"
        );
        if of_one["run_type"] == "iteration" {
            *repetitions
                .entry(of_one["name"].as_str().expect("a name"))
                .or_default() += measured.len();
        }
    }
    let given = json(file);
    let given = given["benchmarks"].as_array().expect("benchmarks").iter();
    let mut wanted = BTreeMap::<&str, usize>::new();
    for one in given {
        *wanted
            .entry(one["name"].as_str().expect("a name"))
            .or_default() += 1;
    }
    assert_eq!(repetitions, wanted);
}

/// Every consumer.
pub fn all(export: &dyn Fn(&str) -> String) {
    with_module("junitparser", JUNIT, &export("junit"));
    with_module("numpy", HYPERFINE, &export("hyperfine"));
    with_module("csv", CSV, &export("csv"));
    google_benchmark(&export("google-benchmark"));
    latex(&export("latex"));
}

/// The tables in a document of their own.
fn latex(tables: &str) {
    if answer("pdflatex", &["--version"], "").is_none() {
        return needs::skip("pdflatex", "pdflatex is not installed");
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let document = format!(
        "\\documentclass{{article}}\n\\usepackage{{booktabs}}\n\\extrafloats{{200}}\n\\begin{{document}}\n{}\n\\end{{document}}\n",
        tables.replace("\\end{table}", "\\end{table}\\clearpage")
    );
    let file = folder.path().join("tables.tex");
    std::fs::write(&file, document).expect("a writable folder");
    let output = Command::new("pdflatex")
        .args([
            "-interaction=nonstopmode",
            "-halt-on-error",
            "-no-shell-escape",
            "tables.tex",
        ])
        .current_dir(folder.path())
        .output()
        .expect("pdflatex starts");
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{words}");
    assert!(!words.contains("Missing character"), "{words}");
}
