//! From a folder of records to verdicts and pages: relevant records, scenes, page headers.

use super::root;
use super::rounds::{A, B, HERE, Sitting, drifted, timed};
use raystone::config::expect::Thesis;
use raystone::measure::record::{Body, Interval, Key, Line, Ran, text_of};
use raystone::report::data::RunData;
use raystone::report::document::{Block, Document, Tone};
use raystone::report::{html, markdown, sections};
use raystone::repro::judge::ClaimVerdict;
use raystone::repro::run::{Placed, Reproduced, Settings, is_done, prepare, recorded};
use raystone::repro::{NotCovered, Source, latex, page};
use raystone::run::Registries;
use serde_json::{Value, json};
use std::path::PathBuf;

const TEXT: &str = r#"
[run]
name = "made"
replicates = 1
resolution = [32, 32]
spp = [1]

[axes]
scene = ["cornell-box", "displaced-sphere"]
accel = ["bvh", "kd-tree"]
sequence = ["sobol"]
integrator = ["primary"]

[thesis]
title = "Someone 2001, Table 1: 5 % of A & B_c"
source = "someone-2001"

[quick]
set = ['run.resolution=[16,16]']

[software]
set = ['run.resolution=[24,24]']

[[substitute]]
original = "Box of 2001"
triangles = 1234
scene = "cornell-box"
quick = "cornell-box"

[[substitute]]
original = "Ball of 2001"
triangles = 5678
scene = "displaced-sphere"
why = "Round, too."

[[substitute]]
original = "Gone"
triangles = 99
why = "nobody has it"

[[expect]]
id = "ms"
says = "Time to build"
figure = "build-ms/v1"
compare = "shown"
column = "A & B"
at = [
    { row = "5 %", on = "Box of 2001", of = { accel = "bvh*" }, thesis = 11 },
    { row = "ball", on = "Ball of 2001", of = { accel = "bvh*" }, thesis = 22 },
    { row = "gone", on = "Gone", of = { accel = "bvh*" }, thesis = 33 },
]

[[expect]]
id = "nodes"
says = "A kd-tree has more nodes"
figure = "nodes/v1"
compare = "ratio"
of = { accel = "kd-tree*" }
over = { accel = "bvh*" }
least = 1.5
claims = ["H1"]
column = "nodes"
at = [
    { row = "5 %", on = "Box of 2001", thesis = 3.5 },
    { on = "Ball of 2001" },
    { on = "Gone" },
]

[[expect]]
id = "fewer"
says = "No ball has leaves beside a | or *stars*"
figure = "leaves/v1"
compare = "bound"
of = { accel = "!kd-tree*" }
most = 10
claims = ["H2"]
at = [{ on = "Ball of 2001" }]

[[expect]]
id = "clock"
says = "A BVH takes fewer bytes, by a clock"
figure = "bytes/v1"
compare = "ratio"
of = { accel = "kd-tree*" }
over = { accel = "bvh*" }
least = 1.0
device = "gpu"
claims = ["H3"]
at = [{ on = "Box of 2001" }, { on = "Ball of 2001" }]

[[expect]]
id = "paced"
says = "A BVH renders twice as fast, by the host's clock"
figure = "ms-per-spp/v1"
compare = "ratio"
of = { accel = "kd-tree*" }
over = { accel = "bvh*" }
least = 1.9
at = [{ on = "Box of 2001" }, { on = "Ball of 2001" }]
"#;

fn source() -> Source {
    Source {
        name: "made",
        text: TEXT,
    }
}

fn settings(out: &tempfile::TempDir) -> Settings {
    Settings {
        scenes: PathBuf::from("nowhere"),
        out: out.path().to_owned(),
        ..Settings::default()
    }
}

fn line(key: Key, body: Value) -> Line {
    Line::new(
        key,
        Ran::default(),
        serde_json::from_value(body).expect("a record"),
    )
}

fn run(text: &str, software: bool) -> Line {
    let environment = raystone::measure::record::Environment {
        adapter: "a device".into(),
        software,
        ..Default::default()
    };
    let body = json!({
        "kind": "run", "name": "made", "experiment": "made.toml", "experiment_text": text, "started_unix_s": 0,
        "environment": environment, "renders_full_product": 1, "renders_planned": 1,
    });
    line(Key::default(), body)
}

fn scene(name: &str, triangles: u64) -> Line {
    let body = json!({
        "kind": "scene", "triangles": triangles, "bounds_min": [0, 0, 0], "bounds_max": [1, 1, 1], "load_ms": 1.0,
        "bytes": 6400, "materials": 1, "textures": 0, "emitters": 1, "scene_hash": "abc",
        "camera": { "eye": [0, 0, 0], "target": [0, 0, 1], "up": [0, 1, 0], "vertical_fov_degrees": 40 },
        "report": { "dropped_non_finite": 0, "zero_area": 0, "warnings": [] },
    });
    line(Key::default().with("scene", name), body)
}

fn structure(scene: &str, accel: &str, [ms, nodes]: [f64; 2], failure: Option<&str>) -> Line {
    let gate = json!({
        "passed": true, "classes": [], "brute_force": { "rays": 0, "wrong": 0, "ambiguous": 0 },
        "oracle": { "rays": 0, "wrong": 0, "ambiguous": 0 }, "kernel_errors": [], "structural": null,
    });
    let body = json!({
        "kind": "structure", "build": [], "build_ms": ms,
        "stats": { "nodes": nodes as u64, "leaves": 50, "references": 1, "bytes": nodes as u64, "depth": 1, "leaf_histogram": [],
                   "sah_cost": null, "epo": null },
        "gate": if failure.is_some() { Value::Null } else { gate }, "timings": [],
        "heat_map": null, "heat_map_max": null, "failure": failure,
    });
    let key = Key::default().with("scene", scene).with("accel", accel);
    line(key, body)
}

fn finished() -> Line {
    let body = json!({ "kind": "finished", "wall_s": 1.0, "parts_s": {}, "overhead_s": 0.0, "failed": 0, "skipped": 0 });
    line(Key::default(), body)
}

fn lines(settings: &Settings, software: bool) -> Vec<Line> {
    let prepared = prepare(&source(), settings, &Registries::default().catalogue()).expect("sound");
    let at = |scene| Sitting { scene, ..HERE };
    let [box_at, ball] = ["cornell-box", "displaced-sphere"].map(at);
    let mut lines = vec![
        run(&prepared.experiment.text, software),
        scene("cornell-box", 34),
        scene("displaced-sphere", 70_001),
        structure("cornell-box", "bvh", [5.0, 100.0], None),
        structure("cornell-box", "kd-tree", [6.0, 200.0], None),
        structure("displaced-sphere", "bvh", [7.0, 100.0], None),
        structure("displaced-sphere", "kd-tree", [8.0, 300.0], None),
    ];
    for at in [box_at, ball] {
        lines.extend(timed("kd-tree", at, &drifted(A)));
        lines.extend(timed("bvh", at, &drifted(B)));
    }
    lines.push(finished());
    lines
}

fn judged(settings: &Settings, lines: &[Line]) -> Option<Reproduced> {
    let folder = settings.out.join("made");
    std::fs::create_dir_all(&folder).expect("a folder");
    let text = text_of(lines).expect("lines");
    std::fs::write(folder.join("records.jsonl"), text).expect("a file");
    recorded(&source(), settings, &Registries::default().catalogue()).expect("readable")
}

fn verdicts(table: &Reproduced) -> Vec<ClaimVerdict> {
    (0..table.claims.len()).map(|i| table.verdict(i)).collect()
}

#[test]
fn records_are_judged_and_a_clock_speaks_on_a_device_alone() {
    use ClaimVerdict::{Contradicted, NotTestable, Shown, Supported};
    let out = tempfile::tempdir().expect("a folder");
    let settings = settings(&out);
    let device = judged(&settings, &lines(&settings, false)).expect("a table");
    assert_eq!(
        verdicts(&device),
        [Shown, Supported, Contradicted, Supported, Supported]
    );
    let software = judged(&settings, &lines(&settings, true)).expect("a table");
    assert_eq!(
        verdicts(&software),
        [Shown, Supported, Contradicted, NotTestable, Supported]
    );
    assert_eq!(
        page::tally(&[software.clone(), device]),
        "5 supported, 2 contradicted, 1 not testable here"
    );
    // Substituted scenes, with their own triangle counts.
    let scenes: Vec<(String, Option<Placed>)> = (software.scenes.iter())
        .map(|(s, ours)| (s.original.clone(), ours.clone().ok()))
        .collect();
    let there =
        |original: &str, ours: &str, n| (original.to_owned(), Some((ours.to_owned(), Some(n))));
    assert_eq!(
        scenes,
        [
            there("Box of 2001", "cornell-box", 34),
            there("Ball of 2001", "displaced-sphere", 70_001),
            ("Gone".to_owned(), None)
        ]
    );
    let rows = &software.claims[1];
    let ours: Vec<_> = rows.iter().map(|row| row.ours.map(|i| i.value)).collect();
    assert_eq!(ours, [Some(2.0), Some(3.0), None]);
    assert!(rows[2].reason.contains("nobody has it"), "{:?}", rows[2]);
}

#[test]
fn records_of_another_experiment_of_a_killed_run_or_of_other_sizes_are_not_judged() {
    let out = tempfile::tempdir().expect("a folder");
    let whole = settings(&out);
    let own = lines(&whole, false);
    assert!(judged(&whole, &own).is_some());
    assert!(judged(&whole, &own[..own.len() - 1]).is_none());
    let text = |replaced: [&str; 2]| {
        let prepared =
            prepare(&source(), &whole, &Registries::default().catalogue()).expect("sound");
        let text = prepared.experiment.text.replace(replaced[0], replaced[1]);
        let mut lines = own.clone();
        lines[0] = run(&text, false);
        lines
    };
    assert!(
        judged(
            &whole,
            &text(["resolution = [32, 32]", "resolution = [64, 64]"])
        )
        .is_none()
    );
    assert!(judged(&whole, &text(["\"sobol\"", "\"halton\""])).is_none());
    // Other expectations of the same experiment are re-evaluated.
    assert!(judged(&whole, &text(["least = 1.5", "least = 2.5"])).is_some());
    let quick = Settings {
        quick: true,
        ..whole.clone()
    };
    assert!(judged(&quick, &own).is_none());
    assert!(judged(&whole, &lines(&quick, false)).is_none());
    // Records with the sizes of a software adapter count on any machine; the page lists the changes.
    let small = Settings {
        software: true,
        ..whole.clone()
    };
    let table = judged(&whole, &lines(&small, true)).expect("a table");
    assert_eq!(table.changes, ["run.resolution=[24,24]"]);
    assert!(!is_done(&out.path().join("nothing"), TEXT));
}

#[test]
fn a_structure_that_failed_or_was_left_out_is_not_testable_and_never_supported() {
    let out = tempfile::tempdir().expect("a folder");
    let settings = settings(&out);
    let mut failed = lines(&settings, false);
    failed[6] = structure(
        "displaced-sphere",
        "kd-tree",
        [0.0, 0.0],
        Some("out of memory"),
    );
    let table = judged(&settings, &failed).expect("a table");
    let row = &table.claims[1][1];
    assert_eq!(
        (row.verdict, &*row.reason),
        (ClaimVerdict::NotTestable, "out of memory")
    );
    // The other places decide.
    assert_eq!(table.verdict(1), ClaimVerdict::Supported);
    // Without any mention of it, the expectation is at fault.
    let mut absent = lines(&settings, false);
    absent.remove(6);
    let table = judged(&settings, &absent).expect("a table");
    assert_eq!(table.verdict(1), ClaimVerdict::Faulty);
    // Figures that are only shown have faults, too.
    absent.remove(5);
    let table = judged(&settings, &absent).expect("a table");
    assert_eq!(table.verdict(0), ClaimVerdict::Faulty);
    // A failed time states the reason.
    let mut slow = lines(&settings, false);
    for line in &mut slow {
        if let Body::Time(record) = &mut line.body {
            record.failure = Some("another image".to_owned());
            record.ms_per_spp = None;
        }
    }
    let row = judged(&settings, &slow).expect("a table").claims[4].remove(0);
    assert_eq!(
        (row.verdict, &*row.reason),
        (ClaimVerdict::NotTestable, "another image")
    );
}

fn shown(tables: &[Reproduced], failed: &page::Failures) -> (Document, String) {
    let nothing = NotCovered {
        table: Vec::new(),
        claim: Vec::new(),
    };
    let document = page::document(tables, failed, &nothing);
    let text = markdown::summary(&document);
    (document, text)
}

#[test]
fn the_page_begins_with_counts_and_shows_the_theses_number_before_ours() {
    let out = tempfile::tempdir().expect("a folder");
    let settings = settings(&out);
    let table = judged(&settings, &lines(&settings, true)).expect("a table");
    let failures = vec![("other-table".to_owned(), "no disk".to_owned())];
    let (document, text) = shown(std::slice::from_ref(&table), &failures);
    for part in [
        "other-table could not be run: no disk",
        "Claims: 2 supported, 1 contradicted, 1 not testable here.",
        "| made | H1 | A kd-tree has more nodes | **supported** | 2 supported, 1 not testable here |",
        "| made | H2 | No ball has leaves beside a \\| or \\*stars\\* | **contradicted** | 50.0 |",
        "| Box of 2001 | 1,234 | cornell-box | 34 |",
        "| Ball of 2001 | 5,678 | displaced-sphere | 70,001 | Round, too. |",
        "| Gone | 99 | – |",
        "| 5 % | 11 \\| 5.00 | 3.5 \\| 2.00 |",
        "| made | H3 | A BVH takes fewer bytes, by a clock | not testable here | 2 places: times of a software adapter say nothing of a GPU |",
        "| ball | 22 \\| 7.00 | – |",
        "| gone | 33 \\| – | – |",
        "| 5 %, nodes | 3.5 | 2.00 | **supported** | agrees: ≥ 1.5 |",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    assert!(!text.contains("A short run") && !text.contains("| made | ms |"));
    let tones = document.sections[0]
        .blocks
        .iter()
        .find_map(|block| match block {
            Block::Table(table) => Some(
                table
                    .rows
                    .iter()
                    .map(|row| (row[3].text.clone(), row[3].tone))
                    .collect::<Vec<_>>(),
            ),
            _ => None,
        });
    let tone = |word: &str, tone| (word.to_owned(), tone);
    let all = [
        tone("supported", Tone::Good),
        tone("contradicted", Tone::Bad),
        tone("not testable here", Tone::Plain),
        tone("supported", Tone::Good),
    ];
    assert_eq!(tones.expect("a table"), all);
    let i = Interval {
        value: 2.0,
        low: 1.0,
        high: 3.0,
    };
    assert_eq!(page::interval(i), "2.00 [1.00, 3.00]");
    assert_eq!(page::printed(Some(10.96)), "10.96");
    assert_eq!(page::printed(Some(0.1 + 0.2)), "0.300");
    let html = html::page(&document).expect("a page");
    assert!(html.contains("5 % of A &amp; B_c") && !html.contains("A & B_c"));
    let quick = Settings {
        quick: true,
        ..settings
    };
    let table = judged(&quick, &lines(&quick, true)).expect("a table");
    assert_eq!(table.claims[1][1].verdict, ClaimVerdict::NotTestable);
    let text = shown(&[table], &failures).1;
    assert!(
        text.contains("A short run on small built-in scenes"),
        "{text}"
    );
    assert!(
        text.contains("This short run has run.resolution=\\[16,16\\]."),
        "{text}"
    );
}

#[test]
fn latex_has_a_pair_of_columns_for_each_with_names_that_it_can_read() {
    let out = tempfile::tempdir().expect("a folder");
    let settings = settings(&out);
    let table = judged(&settings, &lines(&settings, true)).expect("a table");
    let text = latex::tables(&[table]);
    for part in [
        "\\caption{Someone 2001, Table 1: 5 \\% of A \\& B\\_c}",
        "\\begin{tabular}{lrrrr}",
        " & \\multicolumn{2}{c}{A \\& B} & \\multicolumn{2}{c}{nodes} \\\\",
        " & thesis & ours & thesis & ours \\\\",
        "5 \\% & 11 & 5.00 & 3.5 & 2.00 \\\\",
        "gone & 33 & --",
        "\\label{tab:made}",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}

#[test]
fn a_report_of_a_plain_run_says_what_runs_on_the_scenes_that_stand_for_the_theses() {
    let banners = |text: &str| {
        let lines = [run(text, false), finished()];
        let document = sections::document(root(), &RunData::new(&lines), &[]);
        let all = document.banners.iter().map(|b| b.text.clone());
        all.collect::<Vec<_>>().join("\n")
    };
    let plain = banners(TEXT);
    assert!(
        plain.contains("`raystone repro made`") && plain.contains("Someone 2001"),
        "{plain}"
    );
    let out = tempfile::tempdir().expect("a folder");
    let prepared = prepare(
        &source(),
        &settings(&out),
        &Registries::default().catalogue(),
    )
    .expect("sound");
    assert!(!banners(&prepared.experiment.text).contains("raystone repro"));
    let (head, _) = TEXT.split_once("[thesis]").expect("a head");
    assert!(!banners(head).contains("raystone repro"));
    let no_scenes = TEXT.split("[[substitute]]").next().expect("a head");
    assert!(Thesis::parse(no_scenes, "x").expect("sound").is_some());
    assert!(!banners(no_scenes).contains("raystone repro"));
}
