//! Tests of joined folders: of records that are written here, without a run.

use super::*;
use raystone_core::text::slug;
use raystone_record::{
    ErrorRecord, IMAGE_AXES, Key, Kind as _, PARTIAL, RECORDS_FILE, Ran, read_records,
};

const TEXT: &str = "[run]\nreplicates = 2\nspp = { pow2 = [0, 1] }\n[axes]\nscene = [\"cornell-box\"]\n\
     accel = [\"bvh\", \"uniform-grid\"]\nsequence = [\"pixel-hash\"]\nintegrator = [\"primary\"]\n";

fn run(text: &str) -> RunRecord {
    RunRecord {
        name: "made".to_owned(),
        experiment: "made.toml".to_owned(),
        experiment_text: text.to_owned(),
        started_unix_s: 0,
        environment: Default::default(),
        renders_full_product: 0,
        renders_planned: 0,
        kernels: Vec::new(),
        overrides: Vec::new(),
        only: Vec::new(),
        shard: None,
        figures: Vec::new(),
        lenient: false,
        compilations: 1,
    }
}

fn units() -> Vec<Unit> {
    let registries = Registries::default();
    let earlier = Earlier::new(vec![Line::about_all(Body::Run(run(TEXT)))]);
    let (experiment, plan) = earlier.planned(&registries).expect("a plan");
    assert!(plan.skipped.is_empty());
    registries.measurements.units(&experiment, &plan)
}

/// The first and the last line of a folder, which says nothing true of its cells.
fn ends(text: &str) -> [Line; 2] {
    let finished = FinishedRecord {
        wall_s: 2.0,
        parts_s: BTreeMap::new(),
        overhead_s: 0.5,
        cpu: Some(CpuTime {
            whole_s: 3.0,
            overhead_s: 0.25,
        }),
        failed: 3,
        skipped: 5,
        load: Default::default(),
    };
    [Body::Run(run(text)), Body::Finished(finished)].map(Line::about_all)
}

fn cell(unit: &Unit, outcome: Outcome, lines: &[&str]) -> Line {
    let reason = match outcome {
        Outcome::Done => "",
        _ => "a reason",
    };
    Line::about_all(Body::Cell(CellRecord {
        unit: unit.name.clone(),
        outcome,
        reason: reason.to_owned(),
        run_began_unix_s: 0,
        inputs: Default::default(),
        lines: lines.iter().map(|line| (*line).to_owned()).collect(),
    }))
}

/// Puts a folder of records.
fn put(dir: &Path, lines: &[Line]) -> PathBuf {
    fs::create_dir_all(dir).expect("a folder");
    fs::write(dir.join(RECORDS_FILE), text_of(lines).expect("lines")).expect("records");
    dir.to_owned()
}

/// A folder whose cells ended so; of those that are missing there is no record.
fn folder(dir: &Path, outcomes: &[Option<Outcome>]) -> PathBuf {
    let [first, last] = ends(TEXT);
    let units = units();
    assert!(outcomes.len() <= units.len());
    let others = std::iter::repeat(&Some(Outcome::Done));
    let ended = units.iter().zip(outcomes.iter().chain(others));
    let cells = ended.filter_map(|(unit, outcome)| Some(cell(unit, (*outcome)?, &[])));
    let lines: Vec<Line> = std::iter::once(first).chain(cells).chain([last]).collect();
    put(dir, &lines)
}

fn joined(dirs: &[PathBuf], out: &Path) -> (Merged, Vec<Line>) {
    let merged = merge(dirs, out, None, &Registries::default());
    let merged = merged.unwrap_or_else(|e| panic!("{e}"));
    (merged, read_records(out).expect("records").lines)
}

fn last(lines: &[Line]) -> &Body {
    &lines.last().expect("a line").body
}

#[test]
fn cells_are_counted_as_the_joined_records_hold_them() {
    use Outcome::{Done, Failed, LeftOut};
    let all = units().len();
    let any = |a: Outcome, b: Outcome| [[Some(a)], [Some(b)]];
    for (number, (outcomes, counts, incomplete)) in [
        (any(Failed, Done), [0, 0], false),
        (any(Done, Failed), [0, 0], false),
        (any(LeftOut, Done), [0, 0], false),
        (any(Failed, LeftOut), [0, 1], false),
        (any(LeftOut, LeftOut), [0, 1], false),
        (any(Failed, Failed), [1, 0], true),
    ]
    .into_iter()
    .enumerate()
    {
        let dir = tempfile::tempdir().expect("a folder");
        let [a, b] = [0, 1].map(|i| folder(&dir.path().join(format!("{i}")), &outcomes[i]));
        let (merged, lines) = joined(&[a, b], &dir.path().join("out"));
        let Body::Finished(end) = last(&lines) else {
            panic!("{number}: {:?}", last(&lines));
        };
        assert_eq!([end.failed, end.skipped], counts, "{number}");
        assert_eq!(
            (merged.cells, merged.incomplete),
            (all, incomplete),
            "{number}"
        );
        assert_eq!(end.wall_s, 4.0);
        let cpu = end.cpu.map(|cpu| [cpu.whole_s, cpu.overhead_s]);
        assert_eq!(cpu, Some([6.0, 0.5]));
    }
}

#[test]
fn a_cell_that_is_missing_everywhere_is_the_end_of_the_joined_run() {
    let dir = tempfile::tempdir().expect("a folder");
    let path = |name: &str| dir.path().join(name);
    let a = folder(&path("a"), &[None, Some(Outcome::Done)]);
    let b = folder(&path("b"), &[None]);
    let (merged, lines) = joined(&[a.clone(), b], &path("without"));
    assert!(merged.incomplete, "{merged:?}");
    let Body::Interrupted(early) = last(&lines) else {
        panic!("{:?}", last(&lines));
    };
    assert!(early.reason.starts_with("1 cell is missing: "), "{early:?}");
    // A part that was killed is no fault where others have its cells.
    let mut killed = read_records(&a).expect("records").lines;
    killed.pop();
    fs::remove_file(a.join(RECORDS_FILE)).expect("a file");
    put(&a.join(PARTIAL), &killed);
    let c = folder(&path("c"), &[]);
    let (merged, lines) = joined(&[a, c], &path("whole"));
    assert!(!merged.incomplete, "{merged:?}");
    assert!(
        matches!(last(&lines), Body::Finished(_)),
        "{:?}",
        last(&lines)
    );
}

#[test]
fn a_folder_that_was_resumed_is_of_its_last_experiment() {
    let dir = tempfile::tempdir().expect("a folder");
    let a = folder(&dir.path().join("a"), &[]);
    let mut lines = read_records(&a).expect("records").lines;
    let [before, _] = ends(&format!("{TEXT}# before\n"));
    lines.insert(0, before);
    let b = put(&dir.path().join("b"), &lines);
    let (merged, lines) = joined(&[b, a], &dir.path().join("out"));
    assert!(!merged.incomplete);
    let mut runs = lines.iter().filter_map(|line| RunRecord::of(&line.body));
    let text = &runs.next_back().expect("a first line").experiment_text;
    assert_eq!(text, TEXT);
}

#[test]
fn linear_images_go_along_with_the_pictures_beside_them() {
    let dir = tempfile::tempdir().expect("a folder");
    let units = units();
    let sampler = units.iter().find(|unit| unit.kind() == "sampler");
    let sampler = sampler.expect("a sampler");
    let record = ErrorRecord {
        randomised: true,
        replicate: 0,
        seed: 1,
        resolution: [1, 1],
        errors: Vec::new(),
        stop: None,
        non_finite_pixels: 0,
        image_hash: String::new(),
        image: Some("images-2/image-x.png".to_owned()),
        error_map: None,
    };
    let line = Line::new(
        Key::from(&sampler.cell),
        Ran::default(),
        Body::Error(record),
    );
    let [first, end] = ends(TEXT);
    let lines = [
        first,
        line.hashed("abc"),
        cell(sampler, Outcome::Done, &["abc"]),
        end,
    ];
    let a = put(&dir.path().join("a"), &lines);
    let labels = sampler.cell.labels(&IMAGE_AXES);
    let parts: Vec<&str> = std::iter::once("mean")
        .chain(labels.iter().map(String::as_str))
        .collect();
    let mean = format!("images-2/{}.npy", slug(&parts));
    let names = ["images-2/image-x.png", "images-2/image-x.pfm", &mean];
    fs::create_dir(a.join("images-2")).expect("a folder");
    for name in names.into_iter().chain(["images-2/foreign.pfm"]) {
        fs::write(a.join(name), name).expect("an image");
    }
    let out = dir.path().join("out");
    let (merged, _) = joined(&[a], &out);
    assert!(
        !merged.notes.iter().any(|note| note.contains("pictures")),
        "{merged:?}"
    );
    for name in names {
        let text = fs::read_to_string(out.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!(text, name);
    }
    assert_eq!(
        fs::read_dir(out.join("images-2")).expect("images").count(),
        3
    );
}
