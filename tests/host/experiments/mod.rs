//! Experiment files through the public interface: accepted input, and answers to mistakes.

mod mistakes;

use raystone::config::{Axis, Catalogue, ConfigError, Experiment, Plan};
use raystone::params::{Entry, ParamRange, ParamValue, Parameter, Variant};
use std::collections::BTreeSet;
use std::path::Path;

fn entry(name: &str, schema: Vec<Parameter>) -> Entry {
    Entry {
        name: name.to_owned(),
        description: String::new(),
        schema,
    }
}

fn plain(names: &[&str]) -> Vec<Entry> {
    names.iter().map(|name| entry(name, Vec::new())).collect()
}

fn parameter(name: &'static str, default: ParamValue, range: ParamRange) -> Parameter {
    Parameter {
        name,
        description: "",
        default,
        range,
    }
}

/// A separate catalogue, so that these tests do not depend on the registries.
fn catalogue() -> Catalogue {
    let lambda = ParamRange::Number {
        min: 0.1,
        max: 100.0,
    };
    let mut accel = plain(&["brute-force", "bvh", "roped-bvh"]);
    accel.push(entry(
        "uniform-grid",
        vec![
            parameter("lambda", ParamValue::Number(5.0), lambda),
            parameter(
                "max_cells",
                ParamValue::Integer(4096),
                ParamRange::Integer { min: 1, max: 65536 },
            ),
        ],
    ));
    let mut sequence = plain(&["halton", "sobol"]);
    sequence.push(entry(
        "pixel-hash",
        vec![
            parameter(
                "hash",
                ParamValue::Name("pcg".into()),
                ParamRange::Choice(&["pcg", "wang"]),
            ),
            parameter("shuffle", ParamValue::Flag(false), ParamRange::Flag),
        ],
    ));
    let mut catalogue = Catalogue::default();
    catalogue[Axis::Scene] = plain(&["cornell-box", "displaced-sphere", "teapot-in-a-stadium"]);
    catalogue[Axis::Accel] = accel;
    catalogue[Axis::Sequence] = sequence;
    catalogue[Axis::Decorrelation] = plain(&["none", "cranley-patterson"]);
    catalogue[Axis::Integrator] = plain(&["primary", "ao", "path"]);
    catalogue[Axis::Triangle] = plain(&["watertight", "pluecker"]);
    catalogue[Axis::BoxTest] = plain(&["padded-16", "plain"]);
    catalogue[Axis::Offset] = plain(&["error-bound", "none"]);
    catalogue[Axis::Organisation] = plain(&["single-kernel", "wavefront"]);
    catalogue[Axis::Peer] = plain(&["none", "obvhs-bvh2"]);
    catalogue[Axis::Workgroup] = plain(&["auto", "32", "16x16"]);
    catalogue[Axis::Load] = plain(&["auto", "buffer", "texture"]);
    catalogue
}

const AXES: &str = "[axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\", \"uniform-grid\"]\n\
                    sequence = [\"pixel-hash\", \"sobol\"]\n";

fn parse_with(text: &str, overrides: &[&str]) -> Result<Experiment, ConfigError> {
    let overrides: Vec<String> = overrides.iter().map(|text| (*text).to_owned()).collect();
    Experiment::parse(text, "dir/trial.toml", &overrides, &catalogue())
}

/// The experiment of [`AXES`] with additional lines, which start on line 5.
fn parse(more: &str) -> Result<Experiment, ConfigError> {
    parse_with(&format!("{AXES}{more}"), &[])
}

fn good(more: &str) -> Experiment {
    parse(more).unwrap_or_else(|error| panic!("{more}: {error}"))
}

#[track_caller]
fn assert_says(result: Result<impl std::fmt::Debug, ConfigError>, pieces: &[&str]) {
    let message = result.expect_err("a mistake was accepted").to_string();
    for piece in pieces {
        assert!(message.contains(piece), "no `{piece}` in: {message}");
    }
}

fn labels(variants: &[Variant]) -> Vec<&str> {
    variants.iter().map(|v| v.label.as_str()).collect()
}

fn plan(experiment: &Experiment, only: &[&str]) -> Result<Plan, ConfigError> {
    let only: Vec<String> = only.iter().map(|text| (*text).to_owned()).collect();
    Plan::new(experiment, &only, |sequence, decorrelation| {
        Ok(sequence.name == "pixel-hash" || decorrelation.name == "cranley-patterson")
    })
}

#[test]
fn a_filter_that_leaves_out_what_a_condition_does_leaves_nothing_to_be_told() {
    let text = AXES.replace(
        "[\"cornell-box\"]",
        "[\"cornell-box\", \"displaced-sphere\"]",
    );
    let when = "[accel.bvh]\nwhen = { scene = \"displaced-sphere\" }\n";
    let experiment = parse_with(&(text + when), &[]).unwrap();
    let told = |only: &[&str]| -> usize {
        let skipped = plan(&experiment, only).unwrap().skipped;
        skipped.iter().map(|skipped| skipped.cells).sum()
    };
    // Two samplers with the structure in the other scene.
    assert_eq!(told(&[]), 2);
    assert_eq!(told(&["sequence=sobol"]), 1);
    assert_eq!(told(&["scene=displaced-sphere"]), 0);
    let one = plan(&experiment, &["sequence=sobol"]).unwrap().describe();
    assert!(one.contains(" (1 cell): "), "{one}");
}

#[test]
fn names_with_parameters_are_written_as_reports_write_them() {
    let accels = |overrides: &[&str]| {
        let experiment = parse_with(
            &format!("{AXES}[accel.uniform-grid]\nlambda = [3, 4]\n"),
            overrides,
        );
        let experiment = experiment.unwrap_or_else(|error| panic!("{overrides:?}: {error}"));
        let accels = &experiment.axes[Axis::Accel];
        labels(accels).join(" ")
    };
    // Beside others, without quotes, and with all other parameters at their defaults, whatever a section says.
    let set = "axes.accel=bvh,uniform-grid(lambda=3,max_cells=64)";
    assert_eq!(accels(&[set]), "bvh uniform-grid(lambda=3,max_cells=64)");
    let set = "axes.accel=[\"uniform-grid( max_cells = 64 )\"]";
    assert_eq!(accels(&[set]), "uniform-grid(max_cells=64)");
    // One that a section has, too, is there once.
    let set = "axes.accel=uniform-grid,uniform-grid(lambda=4)";
    assert_eq!(
        accels(&[set]),
        "uniform-grid(lambda=3) uniform-grid(lambda=4)"
    );
    let text = AXES.replace("\"pixel-hash\"", "\"pixel-hash(hash=wang,shuffle=true)\"");
    let experiment = parse_with(&text, &[]).unwrap();
    let sequences = &experiment.axes[Axis::Sequence];
    assert_eq!(
        labels(sequences),
        ["pixel-hash(hash=wang,shuffle=true)", "sobol"]
    );
    assert_eq!(sequences[0].name, "pixel-hash");
    for (accel, pieces) in [
        (
            "uniform-grid(lamda=3)",
            ["`lamda`", "did you mean `lambda`?"],
        ),
        (
            "uniform-grid(lambda=300)",
            ["accel.uniform-grid.lambda", "100"],
        ),
        (
            "uniform-grid(3)",
            ["unknown accel `uniform-grid(3)`", "did you mean"],
        ),
        (
            "gird(lambda=3)",
            ["unknown accel `gird(lambda=3)`", "known:"],
        ),
    ] {
        assert_says(
            parse_with(AXES, &[&format!("axes.accel=[\"{accel}\"]")]),
            &pieces,
        );
    }
    // A section whose entry is not on the axis under its own name would not be read.
    let text = "[accel.uniform-grid]\nlambda = 3\n";
    let text = format!(
        "{}{text}",
        AXES.replace("\"uniform-grid\"", "\"uniform-grid(lambda=4)\"")
    );
    assert_says(
        parse_with(&text, &[]),
        &["uniform-grid", "is not in axes.accel"],
    );
}

#[test]
fn a_minimal_file_gets_the_documented_defaults() {
    let experiment = good("");
    assert_eq!(experiment.name, "trial");
    assert_eq!(experiment.run.replicates, 16);
    assert_eq!(experiment.run.resolution, [192, 144]);
    assert_eq!(
        experiment.run.spp.counts().collect::<Vec<_>>(),
        [1, 2, 4, 8, 16, 32]
    );
    assert_eq!(experiment.run.spp.max(), 32);
    assert!(experiment.run.runtime_checks);
    assert!(experiment.camera.is_none());
    assert_eq!(labels(&experiment.axes[Axis::Decorrelation]), ["none"]);
    assert_eq!(labels(&experiment.axes[Axis::Integrator]), ["path"]);
    assert_eq!(
        experiment.reference.sequence.params.0["hash"].to_string(),
        "pcg"
    );
    assert_eq!(experiment.timing.rounds, 9);
    assert_eq!(experiment.gate.rays, 32768);
    assert_eq!(experiment.stop, None);
    assert_eq!(
        experiment.discrepancy.pairs,
        [[0, 1], [2, 3], [4, 5], [0, 2], [1, 3], [2, 4]]
    );
    assert_eq!(experiment.seeds().replicates.len(), 16);
}

#[test]
fn every_section_is_read() {
    let experiment = good(
        "[run]\nname = \"n\"\nreplicates = 2\nseed = 7\nresolution = [64, 48]\n\
         spp = { pow2 = [1, 3] }\nruntime_checks = false\n\
         stop = { relmse = 1e-3, confidence = 0.9 }\n\
         [camera]\neye = [0, 1, 2.5]\ntarget = [0, 0, 0]\nfov = 60\n\
         [reference]\nspp = 64\nsequence = \"sobol\"\ndecorrelation = \"cranley-patterson\"\n\
         seed = 3\n[timing]\nrounds = 5\nspp = 2\nmin_warmup_ms = 1\nmax_warmup_ms = 10\n\
         rays = 2048\n[gate]\nrays = 512\nbrute_force_tests = 10\noracle_rays = 0\n\
         [discrepancy]\npoints = 64\npairs = [[4, 9]]\nseeds = 3\n",
    );
    assert_eq!(experiment.name, "n");
    assert_eq!(experiment.seeds().replicates, [7, 8]);
    assert_eq!(experiment.run.resolution, [64, 48]);
    assert_eq!(experiment.run.spp.counts().collect::<Vec<_>>(), [2, 4, 8]);
    assert!(!experiment.run.runtime_checks);
    let stop = experiment.stop.expect("a rule");
    assert_eq!((stop.relmse, stop.confidence), (1e-3, 0.9));
    let camera = experiment.camera.expect("a camera");
    assert_eq!(camera.eye.to_array(), [0.0, 1.0, 2.5]);
    assert_eq!(camera.up.to_array(), [0.0, 1.0, 0.0]);
    assert_eq!(camera.vertical_fov_degrees, 60.0);
    assert_eq!(experiment.reference.spp, 64);
    assert_eq!(experiment.reference.sequence.label, "sobol");
    assert_eq!(experiment.timing.max_warmup_ms, 10);
    assert_eq!(experiment.gate.brute_force_tests, 10);
    assert_eq!(experiment.discrepancy.pairs, [[4, 9]]);
    assert_eq!(experiment.discrepancy.seeds, 3);
}

#[test]
fn without_images_structures_alone_are_measured() {
    let planned = |text: &str| {
        let plan = Plan::new(&good(text), &[], |_, _| Ok(true)).expect("a plan");
        let rest = plan.samplers.len() + plan.times.len() + plan.streams.len();
        (plan.structures.len(), rest)
    };
    let (structures, rest) = planned("");
    assert!(structures > 0 && rest > 0);
    assert_eq!(planned("[run]\nimages = false\n"), (structures, 0));
}

#[test]
fn lists_of_parameters_make_variants_in_the_order_of_the_schema() {
    let experiment = good(
        "[accel.uniform-grid]\nmax_cells = [4096, 8]\nlambda = [3, 5.0]\n\
         [sequence.pixel-hash]\nhash = \"wang\"\nshuffle = [false, true]\n",
    );
    assert_eq!(
        labels(&experiment.axes[Axis::Accel]),
        [
            "bvh",
            "uniform-grid(lambda=3)",
            "uniform-grid(lambda=3,max_cells=8)",
            "uniform-grid",
            "uniform-grid(max_cells=8)",
        ]
    );
    assert_eq!(
        experiment.axes[Axis::Accel][1].params.0["lambda"],
        ParamValue::Number(3.0)
    );
    assert_eq!(
        experiment.axes[Axis::Accel][2].params.0["max_cells"],
        ParamValue::Integer(8)
    );
    assert_eq!(
        labels(&experiment.axes[Axis::Sequence]),
        [
            "pixel-hash(hash=wang)",
            "pixel-hash(hash=wang,shuffle=true)",
            "sobol"
        ]
    );
}

#[test]
fn double_brackets_make_variants_side_by_side_and_none_twice() {
    let experiment = good(
        "[[accel.uniform-grid]]\nlambda = [3, 5]\n\
         [[accel.uniform-grid]]\nmax_cells = [4096, 8]\n",
    );
    assert_eq!(
        labels(&experiment.axes[Axis::Accel]),
        [
            "bvh",
            "uniform-grid(lambda=3)",
            "uniform-grid",
            "uniform-grid(max_cells=8)"
        ]
    );
    assert_says(
        parse("[[accel.uniform-grid]]\nlambada = 3\n"),
        &["parameter of accel uniform-grid", "`lambada`", "`lambda`"],
    );
}

#[test]
fn overrides_replace_values_of_the_file_and_are_cited() {
    let text = format!("{AXES}[run]\nresolution = [64, 64]\n[accel.uniform-grid]\nlambda = 3\n");
    let overrides = [
        "run.resolution=[32,16]",
        "run.spp.pow2=[0,2]",
        "run.name=other name",
        "accel.uniform-grid.lambda=3,8",
        "axes.scene=../models/dragon.ply,cornell-box",
        "timing.rounds=3",
        "timing.rounds=4",
    ];
    let experiment = parse_with(&text, &overrides).expect("good overrides");
    assert_eq!(experiment.run.resolution, [32, 16]);
    assert_eq!(experiment.run.spp.max(), 4);
    assert_eq!(experiment.name, "other name");
    assert_eq!(
        labels(&experiment.axes[Axis::Scene]),
        ["dragon.ply", "cornell-box"]
    );
    assert_eq!(experiment.axes[Axis::Scene][0].name, "../models/dragon.ply");
    assert_eq!(experiment.axes[Axis::Accel].len(), 3);
    assert_eq!(experiment.timing.rounds, 4);
    assert!(experiment.text.starts_with(&text));
    assert!(experiment.text.contains("# --set run.resolution=[32,16]\n"));
    for (text, pieces) in [
        (
            "run.sead=1",
            ["--set run.sead=1", "key in [run] `sead`", "`seed`"],
        ),
        (
            "axes.scene=cornellbox",
            ["--set axes.scene=cornellbox", "scene", "`cornell-box`"],
        ),
        (
            "run.resolution=8,8",
            ["--set run.resolution=8,8", "= 8", "[16, 8192]"],
        ),
        (
            "run=3",
            ["--set run=3", "`run` must be a section", "the integer 3"],
        ),
        ("seed", ["--set seed", "no `=`", "section.key=value"]),
        (
            "run.resolution=[8",
            ["--set run.resolution=[8", "bad value", "key=value"],
        ),
    ] {
        assert_says(parse_with(AXES, &[text]), &pieces);
    }
}

#[test]
fn a_file_that_cannot_be_read_is_named() {
    let path = Path::new("no/such/experiment.toml");
    assert_says(
        Experiment::load(path, &[], &catalogue()),
        &["no/such/experiment.toml", "cannot read"],
    );
    let model = Path::new("no/such/MODEL.Ply");
    assert_says(
        Experiment::load(model, &[], &catalogue()),
        &["MODEL.Ply is a model", "--scene no/such/MODEL.Ply"],
    );
}

const SWEEP: &str = "[run]\nreplicates = 4\n[axes]\n\
    scene = [\"cornell-box\", \"displaced-sphere\"]\n\
    accel = [\"brute-force\", \"bvh\", \"uniform-grid\"]\n\
    sequence = [\"pixel-hash\", \"sobol\"]\ndecorrelation = [\"none\", \"cranley-patterson\"]\n\
    integrator = [\"ao\", \"path\"]\n[accel.uniform-grid]\nlambda = [3, 8]\n\
    [[exclude]]\nsequence = \"pixel-hash\"\ndecorrelation = \"cranley-patterson\"\n\
    [[exclude]]\naccel = \"brute-force\"\nscene = \"!cornell-box\"\n";

#[test]
fn a_plan_measures_errors_once_and_times_every_cell() {
    let experiment = parse_with(SWEEP, &[]).expect("a good sweep");
    let plan = plan(&experiment, &[]).expect("a plan");
    assert_eq!(plan.scenes.len(), 2);
    // 4 structures on the box, 3 on the sphere; 3 samplers; 2 integrators.
    assert_eq!(plan.structures.len(), 7);
    assert_eq!(plan.samplers.len(), 2 * 2 * 3);
    assert_eq!(plan.times.len(), 7 * 2 * 3);
    assert_eq!(plan.streams.len(), 3);
    // Two samplers are randomised and need 4 renders, one is not and needs 1.
    assert_eq!(plan.renders_planned(), 2 * 2 * (4 + 4 + 1));
    assert_eq!(plan.renders_full_product(), 7 * 2 * (4 + 4 + 1));
    let brute_force = plan
        .structures
        .iter()
        .filter(|s| s[Axis::Accel].name == "brute-force");
    assert_eq!(brute_force.count(), 1);
    let cells: Vec<usize> = plan.skipped.iter().map(|skipped| skipped.cells).collect();
    // Of the eight cells of brute force on the sphere the first exclude has left out two.
    assert_eq!(cells, [2 * 4 * 2, 2 * 4 - 2]);
    let product = 2 * 4 * 2 * 2 * 2;
    assert_eq!(cells.iter().sum::<usize>() + plan.times.len(), product);
    let text = plan.describe();
    for piece in [
        "7 structures",
        "cornell-box: brute-force, bvh, uniform-grid(lambda=3), uniform-grid(lambda=8)",
        "12 samplers",
        "displaced-sphere, path, sobol × none, replicates: 1",
        "42 full cells",
        "excluded by dir/trial.toml:11",
        "for the error: 36 (measured for every full cell it would be 126)",
    ] {
        assert!(text.contains(piece), "no `{piece}` in:\n{text}");
    }
}

#[test]
fn workgroups_are_swept_for_times_and_not_for_errors() {
    let text = AXES.replace(
        "[axes]\n",
        "[axes]\nworkgroup = [\"auto\", \"32\", \"16x16\"]\n",
    );
    let whole = plan(&parse_with(&text, &[]).expect("a good sweep"), &[]).expect("a plan");
    assert_eq!(whole.structures.len(), 2 * 3);
    assert_eq!(whole.samplers.len(), 2);
    assert_eq!(whole.times.len(), 2 * 2 * 3);
    assert_eq!(whole.streams.len(), 2);
    let names: BTreeSet<String> = whole.times.iter().map(ToString::to_string).collect();
    assert_eq!(names.len(), whole.times.len());
    assert!(
        names.iter().any(|name| name.ends_with("workgroup 16x16")),
        "{names:?}"
    );
    let wrong = parse_with(&text.replace("16x16", "16x61"), &[]).expect_err("no such workgroup");
    assert!(wrong.to_string().contains("16x16"), "{wrong}");
}

#[test]
fn tests_and_offsets_are_swept_where_they_matter() {
    let text = AXES.replace(
        "[axes]\n",
        "[axes]\ntriangle = [\"watertight\", \"pluecker\"]\nbox_test = [\"padded-16\", \"plain\"]\n\
         offset = [\"none\", \"error-bound\"]\n",
    );
    let exclude = "[[exclude]]\ntriangle = \"pluecker\"\nbox_test = \"plain\"\n";
    let experiment = parse_with(&format!("{text}{exclude}"), &[]).expect("a good sweep");
    let whole = plan(&experiment, &[]).expect("a plan");
    // Three pairs of tests; 2 structures, shared by offsets; 2 sequences; 2 offsets.
    assert_eq!(whole.structures.len(), 3 * 2);
    assert_eq!(whole.samplers.len(), 3 * 2 * 2);
    assert_eq!(whole.times.len(), 3 * 2 * 2 * 2);
    assert_eq!(whole.streams.len(), 2);
    assert!(
        whole
            .structures
            .iter()
            .all(|c| c.get(Axis::Offset).is_none())
    );
    let worlds: Vec<String> = (whole
        .worlds(&whole.scenes[0])
        .iter()
        .map(ToString::to_string))
    .collect();
    assert_eq!(
        worlds,
        [
            "cornell-box",
            "cornell-box, box_test plain",
            "cornell-box, triangle pluecker"
        ]
    );
    // Non-default values follow the names, and cell names are unique.
    let names: BTreeSet<String> = whole.times.iter().map(ToString::to_string).collect();
    assert_eq!(names.len(), whole.times.len());
    assert!(
        names.contains("cornell-box, bvh, path, sobol × none"),
        "{names:?}"
    );
    assert!(names.contains("cornell-box, bvh, path, sobol × none, triangle pluecker, offset none"));
    let some = plan(&experiment, &["triangle=pluecker,offset=error-bound"]).unwrap();
    assert_eq!((some.structures.len(), some.times.len()), (2, 4));
}

#[test]
fn filters_keep_what_fits_all_axes() {
    let experiment = parse_with(SWEEP, &[]).expect("a good sweep");
    let some = plan(
        &experiment,
        &["accel=uniform*,integrator=path", "scene=*sphere"],
    )
    .unwrap();
    assert_eq!(some.structures.len(), 2);
    assert_eq!(some.samplers.len(), 3);
    assert_eq!(some.times.len(), 6);
    assert_eq!(some.scenes.len(), 1);
    let one = plan(
        &experiment,
        &["accel=uniform-grid(lambda=3),accel=bvh,sequence=sobol"],
    );
    let one = one.unwrap();
    assert_eq!(one.structures.len(), 4);
    assert_eq!(one.streams.len(), 2);
    // A scene that the filter leaves without a structure stays visible as skipped.
    let brute = plan(&experiment, &["accel=brute-force,integrator=ao"]).unwrap();
    assert_eq!(brute.scenes.len(), 1);
    assert_eq!(brute.samplers.len(), 3);
    let left_out = brute
        .skipped
        .iter()
        .filter(|s| s.reason.contains("no structure"));
    assert_eq!(left_out.count(), 3);
}

#[test]
fn filters_and_excludes_that_fit_nothing_are_mistakes() {
    let experiment = parse_with(SWEEP, &[]).expect("a good sweep");
    for (only, pieces) in [
        ("acel=bvh", ["--only acel=bvh", "axis `acel`", "`accel`"]),
        (
            "accel=bhv",
            ["--only accel=bhv", "no accel fits `bhv`", "`bvh`"],
        ),
        ("bvh", ["--only bvh", "no `=`", "axis=pattern"]),
        ("", ["--only ''", "it is empty", "axis=pattern"]),
    ] {
        assert_says(plan(&experiment, &[only]), &pieces);
    }
    assert_says(
        plan(&experiment, &["accel=brute-force,scene=displaced-sphere"]),
        &["nothing is left", "--only"],
    );
    assert_says(
        parse("[[exclude]]\naccel = \"bhv\"\n"),
        &["trial.toml:6", "no accel fits `bhv`", "`bvh`"],
    );
    let never = format!("{SWEEP}[[exclude]]\nscene = \"!*\"\naccel = \"bvh\"\n");
    assert_says(
        plan(&parse_with(&never, &[]).expect("parses"), &[]),
        &["trial.toml:17", "scene = !*, accel = bvh", "fits no cell"],
    );
    let all = format!("{SWEEP}[[exclude]]\naccel = \"*\"\n");
    assert_says(
        plan(&parse_with(&all, &[]).expect("parses"), &[]),
        &["nothing is left"],
    );
    // The same leftover exclude is allowed if the command line replaced its axis.
    let other = parse_with(SWEEP, &["axes.scene=a/b.obj"]).expect("a replaced axis");
    assert_eq!(plan(&other, &[]).unwrap().structures.len(), 3);
    let narrowed = parse_with(SWEEP, &["axes.sequence=sobol"]).expect("a replaced axis");
    assert_eq!(plan(&narrowed, &[]).unwrap().streams.len(), 2);
}

#[test]
fn the_documentation_holds_the_table_of_all_keys() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/experiments.md");
    let text = std::fs::read_to_string(&path).expect("docs/experiments.md");
    let table = raystone::registries().catalogue().table();
    assert!(table.lines().count() > 60);
    assert!(
        text.contains(&table),
        "docs/experiments.md lacks this table; paste it there:\n{table}"
    );
}

#[test]
fn every_default_is_accepted_by_the_parser() {
    let mut accepted = 0;
    for section in catalogue().sections() {
        let (name, schema) = (section.name(), &section.entry.schema);
        let required: String = match name {
            "camera" => "eye = [0, 0, 0]\ntarget = [0, 0, 1]\n".to_owned(),
            "run.stop" => "relmse = 0.1\nconfidence = 0.9\n".to_owned(),
            _ => String::new(),
        };
        for key in schema {
            let has_default = key.range.allows(&key.default);
            let is_required = section.required.contains(&key.name);
            assert!(!(has_default && is_required), "{name}.{}", key.name);
            if has_default {
                let value = match &key.default {
                    ParamValue::Name(text) => format!("\"{text}\""),
                    value => value.to_string(),
                };
                good(&format!("[{name}]\n{required}{} = {value}\n", key.name));
                accepted += 1;
            }
        }
        let known = |required: &&str| schema.iter().any(|key| key.name == *required);
        assert!(section.required.iter().all(known), "{name}");
        good(&format!("[{name}]\n{required}"));
    }
    assert!(accepted > 35, "{accepted}");
}

#[test]
fn committed_experiments_parse_and_plan() {
    let registries = raystone::registries();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let mut seen = 0;
    for folder in [folder.clone(), folder.join("thesis")] {
        for file in std::fs::read_dir(&folder).expect("a folder of experiments") {
            let path = file.expect("a directory entry").path();
            if path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            let experiment = Experiment::load(&path, &[], &registries.catalogue())
                .unwrap_or_else(|error| panic!("{error}"));
            let is_randomised =
                |sequence: &_, decorrelation: &_| registries.is_randomised(sequence, decorrelation);
            let plan = Plan::new(&experiment, &[], is_randomised)
                .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let renders = !plan.times.is_empty() && !plan.streams.is_empty();
            let structures_alone = !experiment.run.images && !plan.structures.is_empty();
            assert!(renders || structures_alone || !plan.benches.is_empty());
            // The saving is in axes that no image depends on.
            let unseen = [Axis::Accel, Axis::Organisation, Axis::Workgroup, Axis::Load];
            match unseen.map(|axis| experiment.axes[axis].len()) {
                _ if !renders => {}
                [1, 1, 1, 1] => assert_eq!(plan.renders_planned(), plan.renders_full_product()),
                _ => assert!(plan.renders_planned() < plan.renders_full_product()),
            }
            seen += 1;
        }
    }
    assert!(seen >= 8, "only {seen} experiments found");
}
