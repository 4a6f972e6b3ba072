//! Runs with other seeds: the same figures from other samples, neither better nor worse.

use super::compared;
use super::records::Made;
use raystone::compare::judge::ChangeVerdict;
use raystone::compare::side::Side;
use raystone::compare::{Confirmed, Options, compare_sides, show};
use raystone::measure::record::{Body, Line, RunRecord};
use raystone::report::terminal::Screen;
use std::path::Path;
use std::process::Command;

fn of_text(text: &str, lines: Vec<Line>) -> Side {
    let with = |mut line: Line| {
        if let Body::Run(run) = &mut line.body {
            run.experiment_text = text.to_owned();
        }
        line
    };
    Side::new("made", lines.into_iter().map(with).collect(), Vec::new())
}

/// As with another seed: other rays, counts and images.
fn of_other_rays(mut lines: Vec<Line>) -> Vec<Line> {
    for line in &mut lines {
        match &mut line.body {
            Body::Structure(record) => {
                for timing in &mut record.timings {
                    timing.hit_fraction = 0.74;
                    timing.cpu_ms.iter_mut().for_each(|ms| *ms *= 1.3);
                    if let Some(work) = &mut timing.counters {
                        work.nodes *= 1.01;
                        work.stack_high_water += 1;
                    }
                }
            }
            Body::Error(record) => record.seed += 100,
            _ => {}
        }
    }
    lines
}

#[test]
fn the_seed_of_a_run_is_that_of_its_experiment_with_what_was_laid_over() {
    let seed = |text: &str| {
        let lines = of_text(text, Made::default().lines()).lines;
        let run = lines.into_iter().find_map(|line| match line.body {
            Body::Run(run) => Some(run),
            _ => None,
        });
        run.as_ref().and_then(RunRecord::seed)
    };
    assert_eq!(seed("[run]\nname = \"a\"\n"), Some(1));
    assert_eq!(seed("[run]\nseed = 7\n"), Some(7));
    assert_eq!(
        seed("[run]\nseed = 7\n# --set run.seed=8\n# --set run.spp=[1]\n"),
        Some(8)
    );
    assert_eq!(seed("[run\n"), None);
}

#[test]
fn what_no_seed_changes_is_the_same_with_another() {
    let one_image = |seed: u32| {
        let mut lines = Made::default().lines();
        lines.retain(|line| !matches!(&line.body, Body::Error(record) if record.replicate > 0));
        for line in &mut lines {
            if let Body::Error(record) = &mut line.body {
                (record.randomised, record.seed) = (false, seed);
            }
        }
        of_text(&format!("[run]\nseed = {seed}\n"), lines)
    };
    let found = compared(&one_image(1), &one_image(2));
    for figure in ["relmse-unbiased/v1", "rmse-unbiased/v1", "image/v1"] {
        let of_it = found.findings.iter().filter(|f| f.figure.id == figure);
        let verdicts: Vec<ChangeVerdict> = of_it.map(|f| f.verdict).collect();
        assert!(!verdicts.is_empty(), "{figure}");
        assert!(
            verdicts.iter().all(|v| *v == ChangeVerdict::Same),
            "{figure}: {verdicts:?}"
        );
    }
}

#[test]
fn what_is_not_listed_is_counted_with_its_reason_if_it_has_one() {
    let mut lines = Made::default().lines();
    let all = of_text("", lines.clone());
    lines.retain(|line| !matches!(&line.body, Body::Error(_)));
    let found = compared(&of_text("", lines), &all);
    let text = show::terminal(&found, Screen::default());
    let more: Vec<&str> = text
        .lines()
        .filter(|line| line.contains(" more new"))
        .collect();
    assert!(!more.is_empty(), "{text}");
    assert!(
        more.iter().all(|line| line.ends_with(" more new")),
        "{more:?}"
    );
}

#[test]
fn another_seed_is_undecided_and_the_same_seed_is_worse() {
    let base = || of_text("[run]\nseed = 1\n", Made::default().lines());
    let others = || of_other_rays(Made::default().lines());
    let found = compared(&base(), &of_text("[run]\nseed = 2\n", others()));
    assert_eq!(
        found.count(ChangeVerdict::Worse) + found.count(ChangeVerdict::Better),
        0
    );
    assert_eq!(found.verdict(), ChangeVerdict::Undecided);
    let is_other = |f: &&raystone::compare::Finding| f.why.contains("other seeds");
    // Hits, nodes, stack and times of two classes of twelve structures.
    assert_eq!(found.findings.iter().filter(is_other).count(), 24 * 4);
    assert!(
        found
            .notes
            .iter()
            .any(|note| note.contains("run.seed 1 and 2"))
    );
    // In words, not as a program writes values.
    assert!(
        found
            .findings
            .iter()
            .any(|f| f.why.contains("pixels, seeds "))
    );
    assert!(found.findings.iter().all(|f| !f.why.contains("Some")));
    // Seed-independent values are compared bit by bit.
    let mut slower = others();
    for line in &mut slower {
        if let Body::Structure(record) = &mut line.body {
            record.stats.sah_cost = Some(13.0);
        }
    }
    let found = compared(&base(), &of_text("[run]\nseed = 2\n", slower));
    assert_eq!(found.count(ChangeVerdict::Worse), 12);
    let found = compared(&base(), &of_text("[run]\nseed = 1\n", others()));
    assert!(found.count(ChangeVerdict::Worse) >= 48, "{:?}", found.notes);
}

fn run(out: &Path, seed: u32) -> Side {
    let mut command = Command::new(env!("CARGO_BIN_EXE_raystone"));
    command.args(["run", "tests/data/tiny.toml", "--quiet", "--out"]);
    command.arg(out).env("RAYSTONE_CACHE", "");
    command.args(["--set", &format!("run.seed={seed}")]);
    command.current_dir(env!("CARGO_MANIFEST_DIR"));
    let output = command.output().expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr);
    assert!(out.join("records.jsonl").exists(), "{words}");
    Side::read(out).expect("records").alone()
}

#[test]
fn two_seeds_of_a_real_run_are_never_worse_and_a_worsening_of_one_is_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let first = run(&at("a"), 1);
    let second = run(&at("b"), 2);
    let options = Options {
        times_decide: false,
        ..Options::default()
    };
    let of = |a: &Side, b: &Side| compare_sides(a, b, &options, &Confirmed::new());
    for found in [of(&first, &second), of(&second, &first)] {
        let worse = found
            .findings
            .iter()
            .filter(|f| f.verdict == ChangeVerdict::Worse);
        let worse: Vec<_> = worse.map(|f| (&f.key, &f.figure.id, &f.why)).collect();
        assert!(worse.is_empty(), "{worse:?}");
    }
    // The same seed, and one node more per ray.
    let mut changed = first.clone();
    for line in &mut changed.lines {
        if let Body::Structure(record) = &mut line.body {
            for timing in &mut record.timings {
                if let Some(work) = &mut timing.counters {
                    work.nodes += 1.0;
                }
            }
        }
    }
    let found = of(&first, &changed);
    assert_eq!(found.verdict(), ChangeVerdict::Worse);
}
