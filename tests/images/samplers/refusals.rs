//! Invalid combinations and exceeded limits are refused with an actionable reason.

use super::*;
use crate::support;
use raystone::config::{Experiment, Plan};
use raystone::run::{Registries, dump_stream};

#[track_caller]
fn assert_refused(made: Result<Sampler, SamplerError>, pieces: &[&str]) {
    let message = made.err().expect("it was accepted").to_string();
    for piece in pieces {
        assert!(message.contains(piece), "no `{piece}` in: {message}");
    }
}

#[test]
fn pairs_that_make_no_sense_are_refused_with_the_reason() {
    let demand = demand(16, 1);
    for (sequence, decorrelation, reason) in [
        ("pixel-hash", "cranley-patterson", "nothing to decorrelate"),
        ("pixel-hash", "micro-jitter", "nothing to decorrelate"),
        ("pixel-hash", "blue-noise", "nothing to decorrelate"),
        ("owen-sobol", "digital-shift", "independent numbers"),
        ("halton", "owen-hash", "base 2"),
        ("halton", "digital-shift", "base 2"),
        ("hammersley", "digital-shift", "base 2"),
        ("rank1-lattice", "owen-hash", "base 2"),
        ("hammersley", "index-offset", "moves the index"),
        ("rank1-lattice", "index-offset", "moves the index"),
        ("pmj02", "owen-hash", "moves the index"),
        ("van-der-corput", "disc-rotation", "one dimension"),
    ] {
        let made = try_sampler((sequence, &[]), (decorrelation, &[]), &demand);
        assert_refused(made, &[sequence, decorrelation, reason]);
    }
    // The validity of a pair may depend on parameters.
    let shared = [("seeding", name("sample"))];
    assert!(try_sampler(("owen-sobol", &shared), ("digital-shift", &[]), &demand).is_ok());
    let third = [("base", ParamValue::Integer(3))];
    assert!(try_sampler(("van-der-corput", &third), ("owen-hash", &[]), &demand).is_err());
    assert!(try_sampler(("van-der-corput", &[]), ("owen-hash", &[]), &demand).is_ok());
}

#[test]
fn samples_and_dimensions_beyond_a_limit_are_refused_with_the_limit() {
    for (sequence, samples, dimensions, limit) in [
        ("owen-sobol", 65_537, 2, "65536"),
        ("hammersley", 65_537, 2, "65536"),
        ("pmj02", 1 << 17, 2, "65536"),
        ("rank1-lattice", 1 << 17, 2, "65536"),
        ("sobol", 16, 21_202, "21201"),
        ("owen-sobol", 16, 257, "256"),
        ("halton", 16, 257, "256"),
        ("pmj02", 16, 129, "128"),
        ("rank1-lattice", 16, 129, "128"),
        ("van-der-corput", 16, 2, "has 1"),
        ("r2", 16, 3, "has 2"),
    ] {
        let made = try_sampler((sequence, &[]), ("none", &[]), &demand(samples, dimensions));
        assert_refused(made, &[sequence, limit]);
    }
}

#[test]
fn what_depends_on_a_number_that_is_not_known_is_refused() {
    let unknown = Demand {
        samples: None,
        dimensions: 2,
        width: None,
    };
    for (sequence, decorrelation, what) in [
        ("hammersley", "none", "the number of samples"),
        ("halton", "micro-jitter", "the number of samples"),
        ("sobol", "blue-noise", "the width of the image"),
    ] {
        assert_refused(
            try_sampler((sequence, &[]), (decorrelation, &[]), &unknown),
            &[what],
        );
    }
    assert!(try_sampler(("sobol", &[]), ("owen-hash", &[]), &unknown).is_ok());
}

#[test]
fn a_folder_without_tables_is_refused_with_the_file_that_is_missing() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let tables = [(
        "tables",
        name(folder.path().to_str().expect("a path in UTF-8")),
    )];
    let make = |samples| try_sampler(("sobol", &[]), ("blue-noise", &tables), &demand(samples, 2));
    assert_refused(make(16), &["sobol_256spp_256d.u8"]);
    std::fs::write(folder.path().join("sobol_256spp_256d.u8"), "short").expect("a written file");
    assert_refused(make(16), &["5 bytes", "65536"]);
    assert_refused(make(24), &["24"]);
    assert_refused(make(512), &["512", "256"]);
    let halton = try_sampler(("halton", &[]), ("blue-noise", &tables), &demand(16, 2));
    assert_refused(halton, &["take sobol"]);
}

#[test]
fn a_dimension_that_a_sampler_was_not_made_for_is_refused() {
    let beyond = [at(0, 2)];
    let gpu = support::gpu();
    let error = dump_stream(gpu, &sampler("sobol", "none", &demand(4, 2)), &beyond);
    assert!(error.expect_err("it was accepted").contains("dimension 2"));
    assert!(dump_stream(gpu, &sampler("sobol", "none", &demand(4, 3)), &beyond).is_ok());
}

const AXES: &str = "[axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\"]\n";

fn plan(axes: &str) -> Result<Plan, String> {
    let registries = Registries::default();
    let text = format!("{AXES}{axes}");
    let experiment = Experiment::parse(&text, "test", &[], &registries.catalogue());
    let experiment = experiment.map_err(|e| e.to_string())?;
    let randomised = |s: &Variant, d: &Variant| registries.is_randomised(s, d);
    Plan::new(&experiment, &[], randomised).map_err(|e| e.to_string())
}

#[test]
fn a_plan_leaves_out_pairs_that_make_no_sense_and_says_why() {
    let axes = "sequence = [\"pixel-hash\", \"halton\", \"sobol\"]\n\
                decorrelation = [\"none\", \"cranley-patterson\", \"owen-hash\"]\n";
    let plan = plan(axes).expect("a plan");
    // Of nine pairs, two of pixel-hash and one of halton are invalid.
    assert_eq!(
        (plan.streams.len(), plan.samplers.len(), plan.times.len()),
        (6, 6, 6)
    );
    assert_eq!(plan.skipped.len(), 3);
    let text = plan.describe();
    assert!(
        text.contains("left out: pixel-hash × cranley-patterson (1 cell): "),
        "{text}"
    );
    assert!(text.contains("halton is not digital in base 2"), "{text}");
}

#[test]
fn a_plan_of_nothing_but_nonsense_or_with_a_senseless_reference_is_a_mistake() {
    let nonsense = "sequence = [\"pixel-hash\"]\ndecorrelation = [\"micro-jitter\"]\n";
    let message = plan(nonsense).expect_err("it was accepted");
    assert!(message.contains("nothing to decorrelate"), "{message}");
    let reference = "sequence = [\"sobol\"]\n[reference]\ndecorrelation = \"owen-hash\"\n";
    let message = plan(reference).expect_err("it was accepted");
    assert!(
        message.contains("[reference]") && message.contains("nothing to decorrelate"),
        "{message}"
    );
}

#[test]
fn the_quick_experiment_keeps_its_cells_and_its_excludes() {
    let registries = Registries::default();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments/quick.toml");
    let experiment = Experiment::load(&file, &[], &registries.catalogue()).expect("a good file");
    let randomised = |s: &Variant, d: &Variant| registries.is_randomised(s, d);
    let plan = Plan::new(&experiment, &[], randomised).expect("a plan");
    assert_eq!(plan.streams.len(), 4);
    assert!(
        plan.skipped
            .iter()
            .all(|s| s.reason.contains("excluded by"))
    );
}
