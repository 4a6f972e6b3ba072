//! The project's checks detect faults: those planted on purpose must turn them red, and nothing else may.
//!
//! `raystone stress --mutants` runs the ignored test, which plants all of them.

mod checks;
mod command;
mod plan;
mod plant;
mod report;
mod soups;
mod subject;
mod table;
#[path = "../support/tier.rs"]
#[allow(dead_code)] // Other programs use the rest of it.
mod tier;
mod world;

use checks::Check;
use plan::{CheckError, Mutant, MutantError, Options};
use plant::Plant;
use raystone::gpu::{AdapterChoice, GpuError};
use report::{Outcome, Report, Verdict};
use std::collections::BTreeSet;
use std::io::IsTerminal as _;
use std::path::PathBuf;
use subject::Subject;
use table::mutants;

/// One fault of so many is planted by an ordinary run of the tests.
const PARTS: usize = 11;

fn run(names: &[&str]) -> (Report, Vec<String>) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = Options {
        adapter: AdapterChoice::Best,
        folder: folder.path().to_owned(),
        names: names.iter().map(|&name| name.to_owned()).collect(),
    };
    let told = std::sync::Mutex::new(Vec::new());
    let note = |outcome: &Outcome| {
        let name = outcome.mutant.name.to_owned();
        println!("{name}: {:?}, {:.0} ms", outcome.killed_by(), outcome.ms);
        told.lock().expect("no panic elsewhere").push(name);
    };
    let report = plan::run(&options, &note).unwrap_or_else(|e| panic!("{e}"));
    (report, told.into_inner().expect("no panic elsewhere"))
}

#[test]
fn every_fault_of_the_table_still_applies() {
    plan::check_table().unwrap_or_else(|e| panic!("{e}"));
    let all = mutants();
    // One that is no longer a valid kernel is reported, too.
    let faulty = Mutant {
        plant: Plant::Kernel {
            file: "integrator/path",
            from: "*result += limited(throughput * emission * weight, depth);",
            to: "*if (depth < 2u) { }",
            times: 1,
        },
        ..all[0]
    };
    let told = plan::check_rows(&[faulty]).expect_err("no kernel");
    assert!(told.to_string().contains("path.wesl"), "{told}");
    assert!(all.len() >= 40, "{} faults", all.len());
    let names: BTreeSet<_> = all.iter().map(|m| m.name).collect();
    assert_eq!(names.len(), all.len(), "two faults of one name");
    for mutant in &all {
        let checks = mutant.subject.checks();
        assert!(checks.contains(&mutant.expected), "{}", mutant.name);
        if let Plant::Kernel { from, to, .. } = mutant.plant {
            assert_ne!(from, to, "{}", mutant.name);
        }
    }
    let structures = raystone::accel::AccelRegistry::default();
    // `auto` is one of the others, with their kernels.
    for kind in structures.iter().filter(|kind| kind.name() != "auto") {
        let has =
            |s: &Subject| matches!(s, Subject::Structure { name, .. } if *name == kind.name());
        assert!(
            all.iter().any(|m| has(&m.subject)),
            "no fault for {}",
            kind.name()
        );
    }
}

/// A row of the page's table.
fn row(mutant: &Mutant) -> String {
    let place = match mutant.plant {
        Plant::Kernel { file, .. } => file.to_owned(),
        plant => plant.place(),
    };
    let (name, what, subject) = (mutant.name, mutant.what, mutant.subject.label());
    format!(
        "| `{name}` | {what} | {place} | {subject} | {} |",
        mutant.expected
    )
}

/// Lists the differences of the page from the table here: rows, and the number of faults.
fn beside_the_table(page: &str) -> Vec<String> {
    let rows: BTreeSet<String> = mutants().iter().map(row).collect();
    let below = page
        .split_once("\n## The faults\n")
        .map_or("", |(_, below)| below);
    let listed: Vec<&str> = below
        .lines()
        .filter(|line| line.starts_with("| `"))
        .collect();
    let lacks = rows.iter().filter(|row| !listed.contains(&row.as_str()));
    let mut faults: Vec<String> = lacks.map(|row| format!("lacks {row}")).collect();
    let extra = listed.iter().filter(|row| !rows.contains(**row));
    faults.extend(extra.map(|row| format!("has {row}")));
    if listed.len() != rows.len() {
        faults.push(format!(
            "lists {} rows for {} faults",
            listed.len(),
            rows.len()
        ));
    }
    let all = format!(": {0} of {0} faults killed, ", rows.len());
    if !below.contains(&all) {
        faults.push(format!("does not say `{all}`"));
    }
    faults
}

#[test]
fn the_page_lists_every_fault_once_and_tells_how_many_there_are() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/mutants.md");
    let text = std::fs::read_to_string(&path).expect("docs/mutants.md");
    let faults = beside_the_table(&text);
    assert!(faults.is_empty(), "docs/mutants.md:\n{}", faults.join("\n"));
    // The page is looked at, not only read.
    let last = text.trim_end().rsplit_once('\n').expect("rows").1;
    let number = format!("{} of", mutants().len());
    for other in [
        text.replace(last, ""),
        format!("{text}{last}\n"),
        text.replace("| `distance-not-compared` |", "| `no-such-fault` |"),
        text.replace(&number, "197 of"),
    ] {
        assert!(!beside_the_table(&other).is_empty());
    }
}

#[test]
fn faults_are_seen_by_the_checks_that_should_see_them_and_the_sound_ones_are_green() {
    if tier::is_full() {
        // That is for `every_fault_of_the_table_is_seen_or_explained`.
        return;
    }
    let all = mutants();
    let names = tier::one_of(PARTS, "planted faults", all.iter().map(|m| m.name));
    let (report, told) = run(&names);
    println!("{}", report.table());
    assert_eq!(report.mutants.len(), names.len());
    assert_eq!(
        BTreeSet::from_iter(told),
        names
            .iter()
            .map(|&name| name.to_owned())
            .collect::<BTreeSet<_>>()
    );
    assert!(report.is_passed(), "{}", report.table());
    for outcome in &report.mutants {
        let expected = Some(outcome.mutant.expected);
        assert_eq!(outcome.killed_by(), expected, "{}", outcome.mutant.name);
    }
    for control in &report.controls {
        assert!(!control.green.is_empty(), "{}", control.subject.label());
    }
    for record in report.records() {
        let line = serde_json::to_string(&record).expect("a line");
        assert!(
            line.starts_with(r#"{"kind":"mutant","#) && !line.contains('\n'),
            "{line}"
        );
    }
}

/// Reads the arguments of the command: the folder of kernels, records and table, and the adapter.
/// `RAYSTONE_MUTANTS_NAMES` names faults in place of all.
#[test]
#[ignore = "some minutes: all faults; `raystone stress --mutants` runs this"]
fn every_fault_of_the_table_is_seen_or_explained() {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let out = std::env::var_os("RAYSTONE_MUTANTS_OUT").map(PathBuf::from);
    let adapter = std::env::var("RAYSTONE_MUTANTS_ADAPTER").unwrap_or_default();
    let options = Options {
        adapter: match adapter.as_str() {
            "" => AdapterChoice::Best,
            name => name.parse().unwrap_or_default(),
        },
        folder: match &out {
            Some(out) => out.join("mutants"),
            None => temporary.path().to_owned(),
        },
        names: std::env::var("RAYSTONE_MUTANTS_NAMES")
            .map(|names| names.split_whitespace().map(str::to_owned).collect())
            .unwrap_or_default(),
    };
    let shows = std::io::stderr().is_terminal();
    let progress = |outcome: &Outcome| {
        if shows {
            eprintln!("{}: {:?}", outcome.mutant.name, outcome.killed_by());
        }
    };
    let report = plan::run(&options, &progress).unwrap_or_else(|e| panic!("{e}"));
    let out = out.unwrap_or(options.folder);
    report
        .write(&out)
        .unwrap_or_else(|e| panic!("{}: {e}", out.display()));
    println!("{}", report.table());
    assert!(report.is_passed(), "{}", report.verdict());
}

/// The gate of integrators alone sees the faults that images are checked for by other means, too.
#[test]
#[ignore = "some minutes: all faults of integrators by single paths; `cargo test --release --test mutants -- --ignored single_paths`"]
fn single_paths_show_every_fault_of_integrators() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let options = Options {
        adapter: AdapterChoice::Best,
        folder: folder.path().to_owned(),
        names: Vec::new(),
    };
    // How far rays start from their surface shows at walls that are thinner than that.
    let of_images = |m: &Mutant| {
        let is_one = matches!(m.subject, Subject::Integrators | Subject::Paths);
        is_one && m.expected != Check::ThinWalls
    };
    let by_paths = |m: Mutant| Mutant {
        subject: Subject::Paths,
        expected: Check::Paths,
        ..m
    };
    let selected = mutants().into_iter().filter(of_images).map(by_paths);
    let note = |outcome: &Outcome| println!("{}: {:?}", outcome.mutant.name, outcome.killed_by());
    let report = plan::run_selected(&options, selected.collect(), &note);
    let report = report.unwrap_or_else(|e| panic!("{e}"));
    println!("{}", report.table());
    assert!(report.is_passed(), "{}", report.verdict());
}

#[test]
fn a_run_is_not_passed_with_a_survivor_or_a_red_control() {
    let (mut report, _) = run(&["tie-broken-the-other-way"]);
    assert!(report.is_passed(), "{}", report.table());
    let sound = report.clone();
    report.mutants[0].verdict = Verdict::Survived;
    assert!(!report.is_passed(), "an unexplained survivor");
    let mut report = sound.clone();
    report.controls[0]
        .red
        .push((Check::Gate, "planted".to_owned()));
    assert!(!report.is_passed(), "a red control");
    let mut report = sound.clone();
    // Twenty faults more that are seen: it is not for the number of those that are not.
    let seen = report.mutants[0].clone();
    report.mutants.extend(vec![seen; 20]);
    report.mutants[0].verdict = plan::judged(Check::Gate, out_of_time())
        .expect("a verdict")
        .expect("one that decides");
    assert!(!report.is_passed(), "time that ran out");
    assert!(
        report
            .table()
            .contains("timed out tie-broken-the-other-way"),
        "{}",
        report.table()
    );
    assert_eq!(report.records()[0].verdict, "timed-out");
    report.mutants[0].mutant.hangs = true;
    assert!(report.is_passed(), "{}", report.table());
    let mut report = sound;
    report.mutants.clear();
    assert!(!report.is_passed(), "nothing was run");
}

fn out_of_time() -> Result<Option<String>, CheckError> {
    Err(GpuError::Timeout { seconds: 60 }.into())
}

#[test]
fn a_name_that_does_not_exist_is_an_error() {
    let options = Options {
        adapter: AdapterChoice::Best,
        folder: std::env::temp_dir(),
        names: vec!["no-such-fault".to_owned()],
    };
    let error = plan::run(&options, &|_| {}).expect_err("no such mutant");
    assert!(matches!(error, MutantError::Unknown(_)), "{error}");
}
