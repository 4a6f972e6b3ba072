//! Exports of a real run: each format is checked against its own shape, and read by its own consumer where that is
//! installed; a hostile name is shown and never executed; records that are cut or of another version are named.

mod consumers;
mod damaged;
mod validator;
mod web;

use raystone::export::{FORMATS, record_schema};
use raystone::image::read_linear;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

/// A name that would run, redirect, end a string or colour a terminal.
const HOSTILE: &str =
    "=cmd|'/C calc'!A0 <script>\\input{/etc/passwd} \u{1b}[31m $(rm x) `y` \"]]>&%#_{}~^, 中 [a]*";

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raystone"));
    command
        .args(arguments)
        .env("RAYSTONE_CACHE", "")
        .env_remove("COLUMNS")
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}

fn program(arguments: &[&str]) -> Output {
    command(arguments).output().expect("the program starts")
}

/// Standard output of a command that was done.
fn done(arguments: &[&str]) -> String {
    let output = program(arguments);
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {words}");
    String::from_utf8(output.stdout).expect("text")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a path in UTF-8")
}

/// The tiny experiment, run once, with linear images.
static RUN: LazyLock<tempfile::TempDir> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let out = folder.path().join("run");
    let images = ["--images", "exr", "--quiet", "--out", text(&out)];
    done(&[&["run", "tests/data/tiny.toml"][..], &images].concat());
    folder
});

fn run_folder() -> PathBuf {
    RUN.path().join("run")
}

fn records() -> String {
    std::fs::read_to_string(run_folder().join("records.jsonl")).expect("records")
}

/// A folder with these records.
fn folder_of(records: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("records.jsonl"), records).expect("a writable folder");
    folder
}

fn export(folder: &Path, format: &str) -> String {
    done(&["export", text(folder), "--format", format])
}

fn json(folder: &Path, format: &str) -> Value {
    serde_json::from_str(&export(folder, format)).expect("JSON")
}

/// The run with the scene's name replaced by [`HOSTILE`].
fn hostile_folder() -> tempfile::TempDir {
    let name = serde_json::to_string(HOSTILE).expect("JSON");
    folder_of(&records().replace("\"cornell-box\"", &name))
}

#[test]
fn every_format_is_listed_and_written() {
    let list = done(&["list", "format"]);
    for format in &FORMATS {
        assert!(
            list.contains(&format!("  {} ", format.name)),
            "{}",
            format.name
        );
        if format.name != "npy" {
            assert!(
                !export(&run_folder(), format.name).is_empty(),
                "{}",
                format.name
            );
        }
    }
    let unknown = program(&["export", text(&run_folder()), "--format", "hyperfin"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("did you mean `hyperfine`"));
}

#[test]
fn the_formats_of_tools_have_the_shape_that_these_ask_for() {
    let (run, hostile) = (run_folder(), hostile_folder());
    for folder in [run.as_path(), hostile.path()] {
        validator::bencher(&json(folder, "bencher")).expect("Bencher Metric Format");
        let bigger = json(folder, "github-bigger-is-better");
        let smaller = json(folder, "github-smaller-is-better");
        validator::github(&bigger).expect("customBiggerIsBetter");
        validator::github(&smaller).expect("customSmallerIsBetter");
        let has = |entries: &Value, id: &str| {
            let names = entries.as_array().expect("entries").iter();
            let mut names = names.filter_map(|entry| entry["name"].as_str());
            names.any(|name| name.starts_with(id))
        };
        assert!(has(&bigger, "mrays-per-s/v1") && !has(&bigger, "build-ms/v1"));
        assert!(has(&smaller, "build-ms/v1") && !has(&smaller, "mrays-per-s/v1"));
        validator::google_benchmark(&json(folder, "google-benchmark")).expect("Google Benchmark");
        validator::hyperfine(&json(folder, "hyperfine")).expect("hyperfine");
    }
}

#[test]
fn shapes_that_tools_refuse_are_refused() {
    let mut benchmark = json(&run_folder(), "google-benchmark");
    benchmark["benchmarks"][0]["real_time"] = Value::Null;
    assert!(validator::google_benchmark(&benchmark).is_err());
    let mut hyperfine = json(&run_folder(), "hyperfine");
    hyperfine["results"][0]["times"][0] = 1e9.into();
    assert!(validator::hyperfine(&hyperfine).is_err());
    let mut bencher = json(&run_folder(), "bencher");
    let first = bencher.as_object_mut().and_then(|b| b.values_mut().next());
    *first.expect("a benchmark") = serde_json::json!({ "build-ms-v1": { "value": null } });
    assert!(validator::bencher(&bencher).is_err());
    let mut github = json(&run_folder(), "github-smaller-is-better");
    let twice = github[0].clone();
    github.as_array_mut().expect("entries").push(twice);
    assert!(validator::github(&github).is_err());
}

#[test]
fn raw_times_are_those_of_the_records() {
    let hyperfine = json(&run_folder(), "hyperfine");
    let results = hyperfine["results"].as_array().expect("results");
    let class = results.iter().find(|r| {
        let name = r["command"].as_str().unwrap_or_default();
        name.starts_with("mrays-per-s/v1") && name.ends_with("rays:primary")
    });
    // Three rounds, see tests/data/tiny.toml.
    assert_eq!(
        class.expect("primary rays")["times"]
            .as_array()
            .map(Vec::len),
        Some(3)
    );
}

#[test]
fn checks_are_test_cases_and_failures_have_messages() {
    let folder = hostile_folder();
    let broken = records().replacen("\"passed\":true", "\"passed\":false", 1);
    let broken = folder_of(&broken);
    let failures = |folder: &Path| {
        let text = export(folder, "junit");
        let document = roxmltree::Document::parse(&text).expect("XML");
        let all = |tag: &str| {
            document
                .descendants()
                .filter(|n| n.has_tag_name(tag))
                .count()
        };
        let root = document.root_element();
        assert_eq!(
            root.attribute("tests"),
            Some(all("testcase").to_string().as_str())
        );
        assert_eq!(
            root.attribute("failures"),
            Some(all("failure").to_string().as_str())
        );
        assert!(all("testcase") > 10, "{text}");
        all("failure")
    };
    assert!(failures(folder.path()) < failures(broken.path()));
}

#[test]
fn hostile_names_are_shown_and_nothing_else() {
    let folder = hostile_folder();
    for format in FORMATS.iter().filter(|format| format.name != "npy") {
        let text = export(folder.path(), format.name);
        assert!(!text.contains('\u{1b}'), "{}", format.name);
    }
    let latex = export(folder.path(), "latex");
    assert!(
        latex.contains("\\textbackslash{}input\\{/etc/passwd\\}"),
        "{latex}"
    );
    assert!(!latex.contains("\\input"));
    let csv = export(folder.path(), "csv");
    assert!(
        !csv.lines()
            .any(|line| line.starts_with('=') || line.starts_with("\"=")),
        "{csv}"
    );
    let markdown = export(folder.path(), "markdown");
    assert!(!markdown.contains("<script>"), "{markdown}");
}

#[test]
fn images_are_the_same_to_the_bit() {
    let out = RUN.path().join("npy");
    done(&[
        "export",
        text(&run_folder()),
        "--format",
        "npy",
        "--out",
        text(&out),
    ]);
    let written: Vec<_> = std::fs::read_dir(&out).expect("a folder").collect();
    assert!(written.len() >= 3, "{}", written.len());
    for entry in written {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name");
        let original = run_folder()
            .join("images")
            .join(name)
            .with_added_extension("exr");
        let [a, b] = [&path, &original].map(|path| read_linear(path).expect("an image"));
        assert_eq!(a, b, "{}", path.display());
    }
    // A run that replaced another has its images in another folder.
    let forced = folder_of(&records().replace("\"images/", "\"images-2/"));
    std::fs::create_dir(forced.path().join("images-2")).expect("a folder");
    let originals = std::fs::read_dir(run_folder().join("images")).expect("images");
    for original in originals.flatten() {
        let copy = forced.path().join("images-2").join(original.file_name());
        std::fs::copy(original.path(), copy).expect("a copy");
    }
    let again = RUN.path().join("npy-again");
    done(&[
        "export",
        text(forced.path()),
        "--format",
        "npy",
        "--out",
        text(&again),
    ]);
    let count = |folder: &Path| std::fs::read_dir(folder).expect("a folder").count();
    assert_eq!(count(&again), count(&out));
    let none = folder_of(&records());
    let output = program(&[
        "export",
        text(none.path()),
        "--format",
        "npy",
        "-o",
        text(&out),
    ]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_choice_of_figures_is_kept_and_one_that_fits_nothing_is_named() {
    let folder = run_folder();
    let chosen = [
        "--figure",
        "nodes-per-ray",
        "--only",
        "accel=bvh,rays=primary",
    ];
    let arguments = [&["export", text(&folder), "--format", "csv"][..], &chosen].concat();
    assert_eq!(done(&arguments).lines().count(), 2);
    for wrong in [
        ["--figure", "no-such"],
        ["--only", "acel=bvh"],
        ["--only", "accel=zzz"],
    ] {
        let arguments = [&["export", text(&folder), "--format", "csv"][..], &wrong].concat();
        let output = program(&arguments);
        assert_eq!(output.status.code(), Some(2), "{wrong:?}");
    }
}

#[test]
fn records_that_are_cut_or_of_another_version_are_named() {
    let whole = records();
    let cut = folder_of(&whole[..whole.len() - 20]);
    let output = program(&["export", text(cut.path()), "--format", "csv"]);
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.success() && words.contains("is cut off"),
        "{words}"
    );
    let mut lines: Vec<&str> = whole.lines().collect();
    let half = &lines[3][..lines[3].floor_char_boundary(lines[3].len() / 2)];
    lines[3] = half;
    let inside = folder_of(&(lines.join("\n") + "\n"));
    let other =
        whole
            .replacen("raystone/3", "raystone/9", 4)
            .replacen("raystone/9", "raystone/3", 3);
    let other = folder_of(&other);
    for (folder, told) in [
        (inside, "jsonl:4: not a record"),
        (other, "jsonl:4: schema \"raystone/9\""),
    ] {
        for command in ["export", "history"] {
            let format: &[&str] = if command == "export" {
                &["--format", "csv"]
            } else {
                &[]
            };
            let output = program(&[&[command, text(folder.path())][..], format].concat());
            let words = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{words}");
            assert!(words.contains(told), "{words}");
        }
    }
}

#[test]
fn the_committed_schema_is_that_of_the_types() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/records.schema.json");
    let committed = std::fs::read_to_string(file).expect("the committed schema");
    let remedy = "write it again: raystone help --schema > docs/records.schema.json";
    assert!(committed == done(&["help", "--schema"]), "{remedy}");
    assert_eq!(
        serde_json::from_str::<Value>(&committed).expect("JSON"),
        record_schema()
    );
}

#[test]
fn every_record_fits_the_schema_and_what_is_none_does_not() {
    let schema = record_schema();
    let records = records();
    let lines = records
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("JSON"));
    let lines: Vec<Value> = lines.collect();
    assert!(lines.len() > 10);
    for line in &lines {
        validator::validate(&schema, &schema, line).expect("a record");
    }
    let structure = lines
        .iter()
        .find(|line| line["body"]["kind"] == "structure");
    let structure = structure.expect("a structure");
    let planted: [fn(&mut Value); 5] = [
        |line| line["schema"] = "raystone/1".into(),
        |line| line["body"]["kind"] = "structur".into(),
        |line| line["body"]["build_ms"] = "12".into(),
        |line| line["body"]["gate"]["classes"][0]["wrong"] = (-1).into(),
        |line| {
            line["body"]
                .as_object_mut()
                .expect("a body")
                .remove("stats");
        },
    ];
    for (number, plant) in planted.iter().enumerate() {
        let mut line = structure.clone();
        plant(&mut line);
        let fault = validator::validate(&schema, &schema, &line);
        assert!(fault.is_err(), "fault {number} is not seen");
    }
}

#[test]
fn a_history_finds_the_run_in_which_a_count_changed() {
    let whole = records();
    let mut dirs = Vec::new();
    for run in 0..4 {
        let mut lines: Vec<Value> = whole
            .lines()
            .map(|l| serde_json::from_str(l).expect("JSON"))
            .collect();
        for line in &mut lines {
            let body = &mut line["body"];
            if body["kind"] == "run" {
                body["started_unix_s"] = (1_000_000 + 100 * run).into();
                body["environment"]["commit"] = format!("c{run}").into();
            }
            if body["kind"] == "structure" && run >= 2 {
                let nodes = body["stats"]["nodes"].as_u64().expect("nodes");
                body["stats"]["nodes"] = (nodes + 1).into();
            }
        }
        let lines: Vec<String> = lines.iter().map(Value::to_string).collect();
        dirs.push(folder_of(&(lines.join("\n") + "\n")));
    }
    // The order of time counts, not that of the command line.
    let order = [3, 0, 2, 1].map(|run: usize| text(dirs[run].path()));
    let out = RUN.path().join("history");
    let more = ["--figure", "nodes", "--json", "--out", text(&out)];
    let found = done(&[&["history"][..], &order, &more].concat());
    let found: Value = serde_json::from_str(&found).expect("JSON");
    let series = found["series"].as_array().expect("series");
    assert_eq!(series.len(), 2, "two structures: {found:#}");
    for one in series {
        assert_eq!(one["changes"].as_array().map(Vec::len), Some(1), "{one:#}");
        assert_eq!(one["changes"][0]["run"], 2);
        assert_eq!(one["changes"][0]["p"], Value::Null);
    }
    assert!(out.join("index.html").exists() && out.join("plots/nodes-v1-0.svg").exists());
    let table = done(&[&["history"][..], &order, &["--figure", "nodes"]].concat());
    assert!(table.contains("c2"), "{table}");
    // A folder counts once.
    let twice = [
        &["history"][..],
        &order,
        &order[..1],
        &["--figure", "nodes"],
    ]
    .concat();
    let output = program(&twice);
    assert_eq!(String::from_utf8_lossy(&output.stdout), table);
    assert!(String::from_utf8_lossy(&output.stderr).contains("given before"));
}

#[test]
fn a_gallery_has_what_inspection_finds_whole() {
    let whole = records();
    let other = folder_of(&whole.replace("\"software\":true", "\"software\":false"));
    // Without the last cell: unfinished.
    let cells: Vec<&str> = whole
        .lines()
        .filter(|line| line.contains("\"kind\":\"cell\""))
        .collect();
    let last = cells.last().expect("a cell");
    let unfinished: String = whole
        .lines()
        .filter(|line| line != last)
        .map(|line| format!("{line}\n"))
        .collect();
    let unfinished = folder_of(&unfinished);
    let damaged = folder_of(&whole.replacen("\"build_ms\":", "\"build_ms\":-", 1));
    let (run, out) = (run_folder(), RUN.path().join("gallery"));
    let found = done(&[
        "gallery",
        text(&run),
        text(other.path()),
        text(unfinished.path()),
        text(damaged.path()),
        "--json",
        "--out",
        text(&out),
    ]);
    let found: Value = serde_json::from_str(&found).expect("JSON");
    assert_eq!(
        found["devices"].as_array().map(Vec::len),
        Some(2),
        "{found:#}"
    );
    assert_eq!(found["devices"][0]["software"], false);
    let reasons = found["left_out"].to_string();
    assert_eq!(
        found["left_out"].as_array().map(Vec::len),
        Some(2),
        "{found:#}"
    );
    assert!(
        reasons.contains("cells are missing") && reasons.contains("damaged"),
        "{reasons}"
    );
    let page = std::fs::read_to_string(out.join("index.html")).expect("a page");
    assert!(page.contains("software adapters: "));
}

#[test]
fn devices_are_never_in_one_series() {
    let other = folder_of(&records().replacen("\"adapter\":\"", "\"adapter\":\"other ", 1));
    let run = run_folder();
    let found = done(&[
        "history",
        text(&run),
        text(other.path()),
        "--figure",
        "nodes",
        "--json",
    ]);
    let found: Value = serde_json::from_str(&found).expect("JSON");
    let series = found["series"].as_array().expect("series");
    assert_eq!(series.len(), 4);
    assert!(
        series
            .iter()
            .all(|one| one["points"].as_array().map(Vec::len) == Some(1))
    );
}

#[test]
fn json_has_one_head_for_every_command() {
    let folder = run_folder();
    let points = RUN.path().join("points.txt");
    std::fs::write(&points, "0.5 0.25\n0.75 0.5\n").expect("a file");
    let merged = RUN.path().join("merged");
    let tiny = "tests/data/tiny.toml";
    let commands: [&[&str]; 21] = [
        &[
            "compare",
            text(&folder),
            text(&folder),
            "--no-confirm",
            "--json",
        ],
        &["inspect", tiny, "--json"],
        &["run", tiny, "--dry-run", "--json"],
        &["merge", text(&folder), "--out", text(&merged), "--json"],
        &["inspect", text(&folder), "--json"],
        &["inspect", text(&folder), "cornell-box, bvh", "--json"],
        // Names that these had before.
        &["plan", tiny, "--json"],
        &["verify-run", text(&folder), "--json"],
        &["explain", text(&folder), "cornell-box, bvh", "--json"],
        &["repro", "--list", "--json"],
        &["list", "model", "--json"],
        &["scenes", "--json"],
        &["points", "--sequence", "sobol", "--count", "3", "--json"],
        &["points", text(&points)],
        &["discrepancy", text(&points)],
        &[
            "points",
            "--sequence",
            "sobol",
            "--count",
            "4",
            "--measure",
            "star",
        ],
        &["list", "--json"],
        &["list", "figure", "--json"],
        &["doctor", "--json"],
        &["report", text(&folder), "--json"],
        &["history", text(&folder), "--json"],
    ];
    for command in commands {
        let found: Value = serde_json::from_str(&done(command)).expect("JSON");
        assert_eq!(found["schema"], "raystone-output/1", "{command:?}");
        let now = match command[0] {
            "plan" | "verify-run" | "explain" => "inspect",
            "scenes" => "list",
            "discrepancy" => "points",
            name => name,
        };
        assert_eq!(found["command"], now);
    }
}

#[test]
fn completions_and_manual_pages_know_every_command() {
    let script = done(&["help", "--completions", "bash"]);
    let man = RUN.path().join("man");
    done(&["help", "--man", text(&man)]);
    for command in ["run", "export", "history", "help"] {
        assert!(script.contains(command), "{command}");
        let page = std::fs::read_to_string(man.join(format!("raystone-{command}.1")));
        assert!(page.expect("a page").contains(".TH"), "{command}");
    }
    consumers::shell(
        "bash",
        &["-c", "source /dev/stdin && complete -p raystone"],
        &script,
    );
    let zsh = done(&["help", "--completions", "zsh"]);
    let check =
        "autoload -U compinit && compinit -u -D && source /dev/stdin && print $_comps[raystone]";
    consumers::shell("zsh", &["-f", "-c", check], &zsh);
}

#[test]
fn the_tools_themselves_read_what_is_written() {
    let (run, hostile) = (run_folder(), hostile_folder());
    for folder in [run.as_path(), hostile.path()] {
        consumers::all(&|format| export(folder, format));
        let records = std::fs::read_to_string(folder.join("records.jsonl")).expect("records");
        consumers::records(&record_schema().to_string(), &records);
    }
}
