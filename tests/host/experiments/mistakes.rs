//! Exact messages for every kind of mistake, and the settings in cell hashes.
//!
//! `mistakes.txt` has one case per line `= name`: lines appended to [`AXES`], directives (`% …`),
//! and after `>` the expected output. Directives: `whole` (no prefix), `set` and `only` (as on the
//! command line), `load` (a file), `refuse` (of the sequences, only `pixel-hash` is valid),
//! `settings` (print the hash inputs, not only acceptance). `RAYSTONE_WRITE_MISTAKES=1` rewrites
//! the answers, for an intended change.

use super::{AXES, assert_says, catalogue, parse};
use raystone::config::{ConfigError, Experiment, Plan};
use raystone::params::Variant;
use std::collections::BTreeSet;
use std::path::Path;

const CASES: &str = include_str!("mistakes.txt");

const ERRORS: [&str; 17] = [
    "Duplicate",
    "Empty",
    "Missing",
    "NoMatch",
    "NotOnAxis",
    "NothingLeft",
    "Only",
    "OutOfRange",
    "Override",
    "Read",
    "Refused",
    "Several",
    "Syntax",
    "TooMany",
    "Unknown",
    "UselessExclude",
    "WrongType",
];

#[derive(Default)]
struct Case {
    lines: Vec<&'static str>,
    answer: Vec<&'static str>,
}

impl Case {
    fn directives(&self, name: &str) -> Vec<String> {
        let of = |line: &&str| {
            let directive = line.strip_prefix("% ")?;
            let (word, text) = directive.split_once(' ').unwrap_or((directive, ""));
            (word == name).then(|| text.to_owned())
        };
        self.lines.iter().filter_map(of).collect()
    }

    fn has(&self, name: &str) -> bool {
        !self.directives(name).is_empty()
    }

    fn outcome(&self) -> Result<String, ConfigError> {
        let known = catalogue();
        if let [path] = &self.directives("load")[..] {
            Experiment::load(Path::new(path), &[], &known)?;
        }
        let mut text = if self.has("whole") { "" } else { AXES }.to_owned();
        for line in self.lines.iter().filter(|line| !line.starts_with("% ")) {
            text += &format!("{line}\n");
        }
        let experiment =
            Experiment::parse(&text, "dir/trial.toml", &self.directives("set"), &known)?;
        let refuses = self.has("refuse");
        let is_randomised = |sequence: &Variant, _: &Variant| {
            if refuses && sequence.name != "pixel-hash" {
                return Err(format!("{} goes with nothing", sequence.name));
            }
            Ok(true)
        };
        let plan = Plan::new(&experiment, &self.directives("only"), is_randomised)?;
        Ok(if self.has("settings") {
            settings(&experiment)
        } else {
            format!("accepted, {} cells", plan.times.len())
        })
    }
}

/// Hash inputs of cells, see `measure`'s inputs.
fn settings(e: &Experiment) -> String {
    [
        format!(
            "{:?}",
            (&e.name, e.run.replicates, e.run.seed, e.run.resolution)
        ),
        format!("{:?}", (&e.run.spp, &e.stop, e.run.runtime_checks)),
        format!("{:?}", e.camera),
        format!("{:?}", e.reference),
        format!("{:?}", e.timing),
        format!("{:?}", e.gate),
        format!("{:?}", e.discrepancy),
        format!("{:?}", e.coherence),
        format!("{:?}", e.animation),
        format!("{:?}", e.window),
    ]
    .join("\n")
}

fn cases() -> Vec<(&'static str, Case)> {
    let mut cases: Vec<(&str, Case)> = Vec::new();
    for line in CASES.lines() {
        match (line.strip_prefix("= "), cases.last_mut()) {
            (Some(name), _) => cases.push((name, Case::default())),
            (None, Some((_, case))) => match line.strip_prefix("> ") {
                Some(answer) => case.answer.push(answer),
                None => case.lines.push(line),
            },
            (None, None) => panic!("`{line}` stands before the first case"),
        }
    }
    cases
}

#[test]
fn every_mistake_is_answered_word_for_word() {
    let (mut seen, mut wrong, mut text) = (BTreeSet::new(), String::new(), String::new());
    for (name, case) in cases() {
        let outcome = case.outcome().unwrap_or_else(|error| {
            let debug = format!("{error:?}");
            seen.extend(debug.split([' ', '{', '(']).next().map(str::to_owned));
            error.to_string()
        });
        let expected = case.answer.join("\n");
        if outcome != expected {
            wrong += &format!("\n= {name}\n  expected: {expected}\n  found:    {outcome}");
        }
        let lines = case.lines.iter().map(|line| format!("{line}\n"));
        let answer = outcome.lines().map(|line| format!("> {line}\n"));
        text += &format!("= {name}\n{}", lines.chain(answer).collect::<String>());
    }
    assert_eq!(seen.iter().map(String::as_str).collect::<Vec<_>>(), ERRORS);
    if std::env::var_os("RAYSTONE_WRITE_MISTAKES").is_some() {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/host/experiments/mistakes.txt");
        std::fs::write(path, text).expect("the file of mistakes");
    } else {
        assert!(wrong.is_empty(), "{wrong}");
    }
}

#[test]
fn seeds_that_renders_share_are_refused_and_equal_numbers_that_do_not_meet_are_not() {
    let with = |run: u32, reference: u32| {
        parse(&format!(
            "[run]\nseed = {run}\n[reference]\nseed = {reference}\n"
        ))
    };
    let seeds = with(1, 9001).expect("no seed is shared").seeds();
    // PCG's hash of 9001, worked by hand.
    let first = 2_772_611_379;
    assert_eq!(seeds.replicates, (1..=16).collect::<Vec<u32>>());
    let parts: Vec<u32> = (first..first + 8).collect();
    assert_eq!(seeds.reference_parts, parts);
    for shared in [first - 7, first, first + 7] {
        let name = if shared < first { first } else { shared };
        assert_says(
            with(shared, 9001),
            &[
                ":8",
                "`reference.seed` = 9001",
                &name.to_string(),
                "replicates",
            ],
        );
    }
    for apart in [first - 16, first + 8, 9001, 9000, 8994] {
        assert!(with(apart, 9001).is_ok(), "{apart}");
    }
}
