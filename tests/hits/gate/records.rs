//! A run with faulty structures: they are reported, and get no figures.

use super::faulty::{NOT_BUILT, NOT_VALID, SHORT_STACK, WRONG_INDEX};
use crate::support::*;
use raystone::accel::AccelKind;
use raystone::measure::record::{Body, StructureRecord, TimeRecord, axis};
use raystone::run::Registries;
use std::collections::BTreeMap;

fn registries() -> Registries {
    let mut registries = Registries::default();
    for kind in [&WRONG_INDEX, &SHORT_STACK, &NOT_VALID, &NOT_BUILT] {
        registries.accel.register(kind);
    }
    registries
}

const STRUCTURES: &str =
    r#"["wrong-index", "bvh", "short-stack", "not-valid", "not-built", "uniform-grid"]"#;

#[test]
fn structures_that_fail_the_gate_are_told_and_get_no_figures() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let experiment = SMALL.replace(r#"["bvh"]"#, STRUCTURES);
    let (summary, lines) = run(&experiment, &registries(), folder.path(), None);
    let mut structures: BTreeMap<&str, &StructureRecord> = BTreeMap::new();
    let mut times: BTreeMap<&str, &TimeRecord> = BTreeMap::new();
    for line in &lines {
        let accel = line.key.name(axis::ACCEL);
        match &line.body {
            Body::Structure(s) => assert!(structures.insert(accel, s).is_none()),
            Body::Time(t) => assert!(times.insert(accel, t).is_none()),
            _ => {}
        }
    }
    let faults = [
        (
            WRONG_INDEX.name(),
            "rays differ from the reference tracer; first: ray ",
        ),
        (SHORT_STACK.name(), "a traversal stack overflowed"),
        (NOT_VALID.name(), "node 3: planted fault"),
        (
            NOT_BUILT.name(),
            "planted limit: needs 2, the limit is 1; plant another",
        ),
    ];
    for (name, text) in faults {
        let structure = structures[name];
        let failure = structure.failure.as_deref().expect("a reason");
        assert!(failure.contains(text), "{name}: {failure}");
        assert!(
            structure.timings.is_empty() && structure.heat_map.is_none(),
            "{structure:?}"
        );
        assert!(
            structure.gate.as_ref().is_none_or(|gate| !gate.passed),
            "{structure:?}"
        );
        let time = times[name];
        let failure = time.failure.as_deref().expect("a reason");
        assert!(failure.contains("did not pass the gate"), "{failure}");
        assert!(time.ms.is_empty() && time.rays.is_empty(), "{time:?}");
        assert!(
            time.mrays_s.is_none() && time.ms_per_spp.is_none(),
            "{time:?}"
        );
    }
    for name in ["bvh", "uniform-grid"] {
        let structure = structures[name];
        assert!(structure.failure.is_none(), "{structure:?}");
        assert_eq!(structure.timings.len(), 5, "{structure:?}");
        assert!(structure.timings.iter().all(|t| t.mrays_s.value > 0.0));
        assert!(times[name].failure.is_none() && times[name].mrays_s.is_some());
    }
    assert_eq!((structures.len(), times.len()), (6, 6));
    // Four structures, and the full cell of each.
    assert_eq!((summary.failed, summary.bad_input), (8, false));
    match lines.last().map(|line| &line.body) {
        Some(Body::Finished(end)) => assert_eq!(end.failed, 8),
        other => panic!("the last record is {other:?}"),
    }
    // The report shows them without a rate.
    let tables = raystone::report::terminal_tables(&lines);
    assert!(tables.contains(WRONG_INDEX.name()), "{tables}");
}
