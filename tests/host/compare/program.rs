//! The command itself: exit codes, effects of flags, contents of outputs, and bad input.

use super::records::Made;
use raystone::measure::record::{Body, Line, text_of};
use serde_json::Value;
use std::path::PathBuf;
use std::process::{Command, Output};

/// Folders of records, and the program to run on them.
struct Runs(tempfile::TempDir);

impl Runs {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn with(self, name: &str, lines: &[Line]) -> Self {
        self.with_text(name, &text_of(lines).expect("text"))
    }

    fn with_text(self, name: &str, text: &str) -> Self {
        std::fs::create_dir_all(self.path(name)).expect("a folder");
        std::fs::write(self.path(name).join("records.jsonl"), text).expect("written");
        self
    }

    fn compare(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_raystone"))
            .arg("compare")
            .args(arguments)
            .current_dir(self.0.path())
            .env_remove("COLUMNS")
            .output()
            .expect("the program starts")
    }

    /// Exit code and standard output of base against candidate with these flags.
    fn code(&self, flags: &[&str]) -> (Option<i32>, String) {
        let output = self.compare(&[&["base", "candidate"], flags].concat());
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(words, "", "{flags:?}");
        let text = String::from_utf8(output.stdout).expect("text");
        (output.status.code(), text)
    }

    fn refusal(&self, arguments: &[&str]) -> String {
        let output = self.compare(arguments);
        let words = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {words}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        assert!(words.starts_with("error: "), "{arguments:?}: {words}");
        words
    }
}

fn changed(change: impl Fn(&mut Vec<Line>)) -> Vec<Line> {
    let mut lines = Made::default().lines();
    change(&mut lines);
    lines
}

fn with_cost(cost: f64) -> Vec<Line> {
    changed(|lines| {
        for line in lines {
            if let Body::Structure(record) = &mut line.body {
                record.stats.sah_cost = Some(cost);
            }
        }
    })
}

fn without(lines: Vec<Line>, structure: &str) -> Vec<Line> {
    let others = lines.into_iter();
    others
        .filter(|line| line.key.label("accel") != structure)
        .collect()
}

fn pair(base: &[Line], candidate: &[Line]) -> Runs {
    Runs::new().with("base", base).with("candidate", candidate)
}

#[test]
fn exit_codes_and_the_last_line_say_what_it_comes_to() {
    let made = Made::default().lines();
    let fewer = |cost| without(with_cost(cost), "structure-3");
    let cases = [
        (made.clone(), made.clone(), 0, "SAME"),
        (made.clone(), with_cost(13.0), 1, "WORSE"),
        (with_cost(13.0), made.clone(), 0, "BETTER"),
        (made.clone(), fewer(12.5), 4, "UNDECIDED"),
        // Worse takes precedence over open, and open over better.
        (made.clone(), fewer(13.0), 1, "WORSE"),
        (made.clone(), fewer(12.0), 4, "UNDECIDED"),
        (fewer(12.5), made.clone(), 0, "SAME"),
    ];
    for (number, (base, candidate, code, word)) in cases.iter().enumerate() {
        let (found, text) = pair(base, candidate).code(&[]);
        assert_eq!(found, Some(*code), "{number}: {text}");
        let last = text.lines().next_back().unwrap_or_default();
        let start = format!("{word}: candidate against base: ");
        assert!(last.starts_with(&start), "{number}: {last}");
    }
}

#[test]
fn flags_say_which_differences_count() {
    let made = Made::default();
    let errors = Made {
        worse: |sampler| if sampler == 2 { 1.01 } else { 1.0 },
        ..made.clone()
    };
    let cost = pair(&made.lines(), &with_cost(13.0));
    let error = pair(&made.lines(), &errors.lines());
    let image = changed(|lines| {
        for line in lines {
            if let Body::Error(record) = &mut line.body {
                record.image_hash = "another".into();
            }
        }
    });
    let image = pair(&made.lines(), &image);
    for (runs, flags, code) in [
        (&cost, &["--exact", "3.9"][..], 1),
        (&cost, &["--exact", "4.1"], 0),
        // Errors are 1 % larger, and images differ.
        (&error, &["--new-images"], 1),
        (&error, &["--new-images", "--error-effect", "2"], 0),
        (&error, &["--new-images", "--time-effect", "2"], 1),
        (&error, &["--new-images", "--alpha", "0"], 4),
        (&image, &[], 1),
        (&image, &["--new-images"], 0),
    ] {
        let (found, text) = runs.code(flags);
        assert_eq!(found, Some(code), "{flags:?}: {text}");
    }
}

/// Two runs of a quiet machine with other kernels in half of the structures, one slower.
fn slower() -> Runs {
    let base = Made {
        rounds: 21,
        noise: super::records::QUIET,
        ..Made::default()
    };
    let candidate = Made {
        seed: 2,
        machine: 2,
        candidate: true,
        slower: |structure| if structure == 8 { 1.5 } else { 1.0 },
        ..base.clone()
    };
    pair(&base.lines(), &candidate.lines())
}

#[test]
fn times_decide_or_are_told_and_what_nothing_confirms_says_so() {
    let runs = slower();
    let (code, text) = runs.code(&[]);
    assert_eq!(code, Some(1), "{text}");
    // The records come from no program of this version.
    assert!(
        text.contains(
            "What looks slower was not measured again: a side was measured by another program"
        ),
        "{text}"
    );
    assert!(text.contains("; not confirmed"), "{text}");
    let (code, text) = runs.code(&["--no-confirm"]);
    assert_eq!(code, Some(1));
    assert!(
        text.contains("was not measured again: --no-confirm."),
        "{text}"
    );
    let (code, text) = runs.code(&["--times", "show"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains(" told") && !text.contains("not measured again"),
        "{text}"
    );
    // 50 % is no more than this.
    assert_ne!(
        runs.code(&["--no-confirm", "--time-effect", "60"]).0,
        Some(1)
    );
    assert_eq!(
        runs.code(&["--no-confirm", "--error-effect", "60"]).0,
        Some(1)
    );
}

fn object(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn other_programs_read_both_sides_as_they_are() {
    let runs = pair(&Made::default().lines(), &with_cost(13.0));
    let (code, text) = runs.code(&["--json", "--markdown", "comment.md"]);
    assert_eq!(code, Some(1));
    let found = object(&text);
    assert_eq!(
        (&found["command"], &found["verdict"]),
        (&"compare".into(), &"worse".into())
    );
    let findings = found["findings"].as_array().expect("findings");
    let of_cost = findings
        .iter()
        .find(|f| f["figure"] == "sah-cost/v1")
        .expect("a cost");
    assert_eq!(
        (&of_cost["base"], &of_cost["candidate"]),
        (&"12.5".into(), &"13.0".into())
    );
    assert!((of_cost["change"].as_f64().expect("a number") - 0.04).abs() < 1e-12);
    let comment = std::fs::read_to_string(runs.path("comment.md")).expect("a comment");
    assert!(
        comment.starts_with("### ❌ WORSE: candidate against base: "),
        "{comment}"
    );
    assert!(
        comment.contains("| 12.5 → 13.0 | +4.00 % | exact |"),
        "{comment}"
    );
    // Values that differ beyond a table's digits have as many as tell them apart.
    let (_, text) = pair(&with_cost(16.661_507_561), &with_cost(16.662_974_007)).code(&[]);
    assert!(text.contains("16.662 → 16.663"), "{text}");
    let (_, text) = pair(&with_cost(12.5), &with_cost(12.5000125)).code(&[]);
    assert!(
        text.contains("12.5 → 12.50001 ") && text.contains("+1.0e−4 %"),
        "{text}"
    );
    let errors = Made {
        worse: |sampler| if sampler == 2 { 1.01 } else { 1.0 },
        ..Made::default()
    };
    let (_, text) = pair(&Made::default().lines(), &errors.lines()).code(&["--json"]);
    let found = object(&text);
    let findings = found["findings"].as_array().expect("findings");
    let worse = findings
        .iter()
        .filter(|f| f["verdict"] == "worse" && f["figure"] == "relmse-unbiased/v1");
    let worse: Vec<&Value> = worse.collect();
    assert_eq!(worse.len(), 4);
    for finding in worse {
        let [low, change, high] =
            ["low", "change", "high"].map(|name| finding[name].as_f64().expect("a number"));
        assert!(low < change && change < high && low > 0.0, "{finding}");
    }
}

#[test]
fn one_run_with_two_sets_of_kernels_is_compared_without_its_controls_drift() {
    let idea = Made {
        candidate: true,
        ..Made::default()
    };
    let mut lines = Made::default().lines();
    let of_idea = idea.lines().into_iter().filter(|line| {
        matches!(
            line.body,
            Body::Structure(_) | Body::Error(_) | Body::Stream(_)
        )
    });
    lines.extend(of_idea.map(|mut line| {
        line.key = line.key.with("kernels", "idea");
        line
    }));
    let runs = Runs::new().with("run", &lines);
    let output = runs.compare(&["run"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.contains("SAME: idea against embedded: "), "{text}");
    // Reversed by name.
    let output = runs.compare(&["run", "--kernels", "idea", "embedded"]);
    assert!(String::from_utf8_lossy(&output.stdout).contains("SAME: embedded against idea: "));
    assert!(
        runs.refusal(&["run", "--kernels", "idea", "other"])
            .contains("embedded, idea: other is none of them")
    );
}

#[test]
fn bad_input_is_named_with_what_to_do() {
    let made = Made::default().lines();
    let text = text_of(&made).expect("text");
    let (first, rest) = text.split_at(400);
    let runs = Runs::new()
        .with("base", &made)
        .with_text("broken", &format!("{first}\n{rest}"))
        .with_text("later", &text.replacen("raystone/3", "raystone/4", 1))
        .with_text("empty-file", "")
        .with_text("killed/partial", &text);
    std::fs::create_dir(runs.path("empty")).expect("a folder");
    for (arguments, said) in [
        (
            &["base", "empty"][..],
            "empty is neither a file of records nor a folder with records.jsonl",
        ),
        (
            &["base", "nowhere"],
            "nowhere is neither a file of records nor a folder",
        ),
        (
            &["base", "killed"],
            "its run did not end: name its folder `partial`",
        ),
        (&["base", "broken"], "records.jsonl:1: not a record"),
        (&["base", "later"], "records.jsonl:1: schema \"raystone/4\""),
        (&["base", "empty-file"], "records.jsonl"),
        (&["base"], "give a second run"),
        (&[], "give two runs"),
        (&["base", "base", "--kernels", "a", "b"], "not two paths"),
        (&["base.toml"], "--kernels A B: which kernels are compared?"),
        (
            &["base", "base", "--alpha=-1"],
            "a number from 0 to below 100 is wanted",
        ),
    ] {
        let words = runs.refusal(arguments);
        assert!(words.contains(said), "{arguments:?}: {words}");
    }
    // A killed run's measurements are compared on request, and marked as partial.
    let cut = Runs::new()
        .with("base", &made)
        .with_text("candidate", &text[..text.len() - 30]);
    let (code, words) = cut.code(&[]);
    assert_eq!(code, Some(1), "{words}");
    assert!(words.contains("The run did not finish."), "{words}");
    assert!(
        words.contains("note: candidate: line ") && words.contains("is cut off"),
        "{words}"
    );
    assert!(
        words.contains("note: candidate: the run did not reach its end"),
        "{words}"
    );
}

#[test]
fn the_wrong_order_and_one_run_twice_are_said() {
    let later = changed(|lines| {
        if let Body::Run(record) = &mut lines[0].body {
            record.started_unix_s = 86_400;
        }
    });
    let runs = pair(&later, &Made::default().lines());
    let (code, text) = runs.code(&[]);
    assert_eq!(code, Some(0));
    assert!(
        text.contains("note: The candidate was measured before the base (1970-01-01"),
        "{text}"
    );
    let text = |paths: &[&str]| String::from_utf8(runs.compare(paths).stdout).expect("text");
    assert!(!text(&["candidate", "base"]).contains("note:"));
    for twice in ["base", "./base/", "base/../base"] {
        let text = text(&["base", twice]);
        assert!(
            text.starts_with("note: BASE and CANDIDATE are the same records"),
            "{text}"
        );
    }
}

/// Root can read every folder.
#[cfg(unix)]
#[test]
fn records_that_may_not_be_read_are_named() {
    use std::os::unix::fs::PermissionsExt as _;
    let made = Made::default().lines();
    let runs = pair(&made, &made);
    let file = runs.path("candidate/records.jsonl");
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o000)).expect("permissions");
    match std::fs::read(&file) {
        Ok(_) => eprintln!("SKIPPED: root may read all files"),
        Err(_) => assert!(
            runs.refusal(&["base", "candidate"])
                .contains("candidate/records.jsonl")
        ),
    }
}

/// A fake measuring program that ends in this way.
#[cfg(unix)]
fn stand_in(runs: &Runs, name: &str, script: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt as _;
    let path = runs.path(name);
    std::fs::write(&path, format!("#!/bin/sh\n{script}\n")).expect("a script");
    let executable = std::fs::Permissions::from_mode(0o755);
    std::fs::set_permissions(&path, executable).expect("permissions");
    path
}

#[cfg(unix)]
#[test]
fn a_program_that_fails_in_its_turn_is_named_with_its_status_and_last_words() {
    let runs = slower();
    let records = runs.path("candidate/records.jsonl");
    let leaves = format!(
        "out=$4; mkdir -p \"$out\"; cp {} \"$out\"",
        records.display()
    );
    let many = "for i in 1 2 3 4 5 6 7 8; do echo \"line $i\" >&2; done";
    for (number, (script, told)) in [
        // Records from an earlier part of the run do not hide how it ended.
        (
            format!("{leaves}; {many}; echo 'error: no space' >&2; exit 3"),
            "ended with exit status: 3: line 5; line 6; line 7; line 8; error: no space",
        ),
        (
            "kill -9 $$".to_owned(),
            "ended with signal: 9 (SIGKILL): it said nothing",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let program = stand_in(&runs, &format!("base-{number}"), &script);
        let program = program.to_str().expect("UTF-8");
        let output = runs.compare(&[
            "base",
            "candidate",
            "--base-program",
            program,
            "--rounds",
            "2",
        ]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains(told), "{told} in {text}");
    }
}
