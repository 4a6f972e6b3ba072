//! Readings of known records, made anew before any figure is shown: a figure that is taken from its neighbour's field, or in
//! another unit, looks like a measurement.

use crate::coherence::Tally;
use crate::known_cells;
use crate::{
    BiasRecord, ClassTiming, CountersPerRay, FigureAtCount, FilteredError, GateVerdict,
    IntegrandFigures, Interval, PixelsAtCount, RayClass, Reading, ReferenceCheck, ReferenceRecord,
    Samples, SpectrumRecord, StreamFigures, StreamRecord, StructureRecord, TimeRecord,
};
use raystone_core::structure::{Counters, Phase, StructureStats};
use raystone_stats::bias::BiasVerdict;
use std::collections::BTreeMap;

/// Relative error that is rounding.
const ROUNDING: f64 = 1e-12;

/// Makes the readings of a structure, a full cell, a bias, a spectrum, a stream and a reference, every number of which is another.
///
/// # Errors
/// A reading is not what it should be: which, and both values.
pub fn check() -> Result<(), String> {
    let of_structure = structure();
    let of_cell = cell();
    let structures = of_structure.readings().into_iter().zip(STRUCTURE);
    let cells = of_cell.readings().into_iter().zip(CELL);
    let count = [of_structure.readings().len(), of_cell.readings().len()];
    if count != [STRUCTURE.len(), CELL.len()] {
        return Err(format!("known records have {count:?} readings"));
    }
    structures.chain(cells).try_for_each(agree)?;
    cycles()?;
    known_cells::check(cell())?;
    let (bias, spectrum, stream, reference) = further();
    let others = [
        (bias.readings(), &BIAS[..]),
        (spectrum.readings(), &SPECTRUM),
        (stream.readings(), &STREAM),
        (reference.readings(), &REFERENCE),
    ];
    others.into_iter().try_for_each(|(readings, known)| {
        if readings.len() != known.len() {
            return Err(format!("known records have {} readings", readings.len()));
        }
        let known = known.iter().map(|(id, value)| (*id, *value, 0.0));
        readings.into_iter().zip(known).try_for_each(agree)
    })
}

/// Cycles of known accesses: 25 an issue, 1 a line, 5 from the L2, 9 more from memory; and lanes that take part.
fn cycles() -> Result<(), String> {
    let tally = Tally {
        issues: 4,
        active: 32,
        lanes: 128,
        lines: 100,
        l1_hits: 70,
        l2_hits: 20,
        ..Tally::default()
    };
    let found = (tally.cost(), tally.efficiency(), tally.misses());
    let expected = (4 * 25 + 100 + 30 * 5 + 10 * 9, Some(0.25), 10);
    (found == expected).then_some(()).ok_or_else(|| {
        format!(
            "cycles, efficiency and misses of known accesses are {found:?}, and should be {expected:?}: this program shows \
             wrong figures; build it anew, and report what stays wrong"
        )
    })
}

fn agree((found, (id, value, round)): (Reading, (&str, f64, f64))) -> Result<(), String> {
    let near = |found: f64, expected: f64| (found - expected).abs() <= ROUNDING * expected.abs();
    let first = match &found.samples {
        Samples::Rounds { adapter, .. } => adapter.first().copied().unwrap_or(f64::NAN),
        _ => 0.0,
    };
    let is_right = found.figure == id && near(found.value.value, value) && near(first, round);
    is_right.then_some(()).ok_or_else(|| {
        format!(
            "the reading {} of a known record is {} with a first round of {first}, and should be {id}, {value}, {round}: \
             this program shows wrong figures; build it anew, and report what stays wrong",
            found.figure, found.value.value
        )
    })
}

/// Ids, values, and the first of their rounds, 0 where there are none.
const STRUCTURE: [(&str, f64, f64); 18] = [
    ("build-ms/v1", 5.0, 0.0),
    ("build-peak-bytes/v1", 4096.0, 0.0),
    ("update-ms/v1", 0.5, 0.0),
    ("bytes/v1", 1024.0, 0.0),
    ("nodes/v1", 15.0, 0.0),
    ("leaves/v1", 8.0, 0.0),
    ("references/v1", 16.0, 0.0),
    ("depth/v1", 6.0, 0.0),
    ("sah-cost/v1", 12.5, 0.0),
    ("epo/v1", 0.25, 0.0),
    ("leaf-share/v1", 1.0, 0.0),
    ("mrays-per-s/v1", 2.0, 3.0),
    ("rays/v1", 6000.0, 0.0),
    ("hit-share/v1", 0.75, 0.0),
    ("nodes-per-ray/v1", 2.0, 0.0),
    ("box-tests-per-ray/v1", 4.5, 0.0),
    ("triangle-tests-per-ray/v1", 1.5, 0.0),
    ("deepest-stack/v1", 5.0, 0.0),
];
/// Of four samples in 8, 10 and 12 ms, and 700 rays: 10 ms over 4, and 700 rays in 10 ms.
const CELL: [(&str, f64, f64); 2] = [
    ("ms-per-spp/v1", 2.5, 2.0),
    ("cell-mrays-per-s/v1", 0.07, 0.0875),
];

const BIAS: [(&str, f64); 9] = [
    ("bias-tiles/v1", 48.0),
    ("bias-rejected/v1", 2.0),
    ("bias-least-p/v1", 0.001),
    ("bias-z/v1", 2.5),
    ("bias-p/v1", 0.040_992_218_585_752_89),
    ("bias-freedom/v1", 7.0),
    ("bias-weighted-p/v1", 0.25),
    ("bias-weighted-freedom/v1", 6.5),
    ("bias-detectable/v1", 1.5),
];
/// Before the filter ½, after it ⅛.
const SPECTRUM: [(&str, f64); 5] = [
    ("low-frequency-power/v1", 0.75),
    ("loudest-wave/v1", 3.0),
    ("neighbour-correlation/v1", 0.125),
    ("luminance-rmse/v1", 0.5),
    ("filtered-share/v1", 0.25),
];
/// A quarter of π is 45 degrees.
const STREAM: [(&str, f64); 9] = [
    ("star-discrepancy/v1", 0.5),
    ("l2-star/v1", 0.25),
    ("centered/v1", 0.0625),
    ("star-exponent/v1", -0.75),
    ("l2-star-exponent/v1", -1.25),
    ("integral-rmse/v1", 0.03125),
    ("integral-exponent/v1", -1.5),
    ("neighbour-angle/v1", 45.0),
    ("coverage/v1", 0.875),
];
const REFERENCE: [(&str, f64); 1] = [("reference-mse/v1", 0.002)];

/// Records of a bias, a spectrum, a stream and a reference, every number of which is another.
pub(crate) fn further() -> (BiasRecord, SpectrumRecord, StreamRecord, ReferenceRecord) {
    let exact = |x| Some(Interval::exact(x));
    let bias = BiasRecord {
        tiles: 48,
        rejected: 2,
        alpha: 0.005,
        alpha_of_run: Some(0.01),
        min_p: 0.001,
        p_of_all: Some(0.04),
        p_histogram: vec![40, 8],
        z: Some(2.5),
        p: Some(0.040_992_218_585_752_89),
        degrees_of_freedom: Some(7.0),
        weighted_p: Some(0.25),
        weighted_degrees_of_freedom: Some(6.5),
        detectable: Some(0.015),
        by_design: false,
        verdict: BiasVerdict::NoBiasFound,
    };
    let filtered = |(sigma, rmse)| FilteredError {
        sigma,
        rmse: Interval::exact(rmse),
    };
    let spectrum = SpectrumRecord {
        spp: 4,
        replicates: 3,
        power: Vec::new(),
        low_frequency: exact(0.75),
        loudest: exact(3.0),
        autocorrelation: exact(0.125),
        filtered: [(0.0, 0.5), (1.0, 0.125)].map(filtered).to_vec(),
    };
    let at = |value| {
        let value = Interval::exact(value);
        vec![FigureAtCount { n: 64, value }]
    };
    let stream = StreamRecord {
        dimensions: [2, 3],
        purpose: "direction".to_owned(),
        named: true,
        worst_of: None,
        randomised: true,
        seeds: 1,
        pixels: vec![0],
        star: at(0.5),
        figures: StreamFigures {
            star_slope: exact(-0.75),
            l2_star: at(0.25),
            l2_star_slope: exact(-1.25),
            centered: at(0.0625),
            integrands: vec![IntegrandFigures {
                function: "exponential".to_owned(),
                integral: 3.0,
                rmse: at(0.03125),
                slope: exact(-1.5),
            }],
            pixels: vec![PixelsAtCount {
                n: 64,
                neighbour_angle: std::f64::consts::FRAC_PI_4,
                coverage: 0.875,
            }],
        },
        points: None,
    };
    let reference = ReferenceRecord {
        spp: 4096,
        exact: None,
        cached: false,
        file: None,
        sampler: "pixel-hash".to_owned(),
        seconds: 5.0,
        mse: Some(0.002),
        relmse: Some(0.003),
        image: String::new(),
        mean: 0.5,
    };
    (bias, spectrum, stream, reference)
}

fn structure() -> StructureRecord {
    // Means of 1 and 3, 2 and 7, 0 and 3, and the greatest of 5 and 4.
    let work =
        [[1, 2, 0, 5], [3, 7, 3, 4]].map(|[nodes, box_tests, triangle_tests, stack]| Counters {
            nodes,
            box_tests,
            triangle_tests,
            stack_high_water: stack,
        });
    let phase = |name: &str, ms| Phase {
        name: name.to_owned(),
        ms,
        cpu_ms: None,
    };
    StructureRecord {
        build: vec![phase("one", 2.0), phase("other", 3.0)],
        build_ms: 5.0,
        build_peak_bytes: Some(4096),
        update_ms: Some(0.5),
        stats: StructureStats {
            nodes: 15,
            leaves: 8,
            references: 16,
            leaf_histogram: vec![0, 0, 8],
            depth: Some(6),
            sah_cost: Some(12.5),
            epo: Some(0.25),
            bytes: 1024,
        },
        timings: vec![ClassTiming {
            class: RayClass::Bounce,
            rays: 6000,
            hit_fraction: 0.75,
            unlike_shadow: None,
            ms: vec![2.0, 3.0, 4.0],
            wall_ms: vec![2.5, 3.5, 4.5],
            cpu_ms: vec![],
            mrays_s: Interval::exact(2.0),
            counters: Some(CountersPerRay::mean_of(&work)),
            dispatches: 1,
            discarded: 0,
        }],
        gate: Some(GateVerdict {
            passed: true,
            classes: Vec::new(),
            brute_force: ReferenceCheck::default(),
            oracle: ReferenceCheck::default(),
            kernel_errors: Vec::new(),
            work: None,
            structural: None,
            elsewhere: None,
            inexact: false,
        }),
        ..StructureRecord::default()
    }
}

fn cell() -> TimeRecord {
    // Those that were left out are no rays.
    let rays = [
        ("primary", 400),
        ("shadow", 200),
        ("bounce", 100),
        ("skipped", 999),
    ];
    TimeRecord {
        resolution: [10, 10],
        spp: 4,
        ms: vec![8.0, 10.0, 12.0],
        wall_ms: vec![9.0, 11.0, 13.0],
        cpu_ms: Vec::new(),
        ms_per_spp: Some(Interval::exact(2.5)),
        rays: rays.map(|(class, rays)| (class.to_owned(), rays)).into(),
        mrays_s: Some(Interval::exact(0.07)),
        live_paths: Vec::new(),
        stages: BTreeMap::new(),
        orders: Vec::new(),
        primary: None,
        image_hash: String::new(),
        image_equal: true,
        failure: None,
    }
}

/// Both records.
#[cfg(test)]
pub(crate) fn known() -> (StructureRecord, TimeRecord) {
    (structure(), cell())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_as_by_hand_and_a_wrong_one_is_named() {
        assert_eq!(check(), Ok(()));
        for (reading, (id, value, round)) in structure().readings().into_iter().zip(STRUCTURE) {
            for wrong in [
                ("x", value, round),
                (id, value + 1.0, round),
                (id, value, round + 1.0),
            ] {
                let fault = agree((reading.clone(), wrong)).unwrap_err();
                assert!(fault.contains(id), "{fault}");
            }
        }
    }
}
