//! Accumulation and sampling on this machine's adapter.

use crate::support::{faults_in_turn, gpu, kernels_with, open};
use raystone::stress::numerics::{Gauge, run};
use std::sync::OnceLock;

/// The figures of the embedded kernels, measured once.
fn figures() -> &'static [Gauge] {
    static FIGURES: OnceLock<Vec<Gauge>> = OnceLock::new();
    FIGURES.get_or_init(|| {
        let figures = run(gpu(), true).expect("the figures are taken");
        for figure in &figures {
            println!("{figure:?}");
        }
        figures
    })
}

/// The embedded kernels with one text of one module replaced.
fn with_fault(module: &str, from: &str, to: &str) -> Vec<Gauge> {
    let kernels = kernels_with(module, &[(from, to)]);
    run(&open(kernels), true).expect("the figures are taken")
}

fn alarms(figures: &[Gauge]) -> Vec<&str> {
    let failed = figures.iter().filter(|figure| !figure.passed);
    failed.map(|figure| figure.name.as_str()).collect()
}

#[test]
fn no_figure_of_this_adapter_is_an_alarm() {
    assert!(figures().len() >= 20, "{} figures", figures().len());
    assert_eq!(alarms(figures()), Vec::<&str>::new());
}

#[test]
fn compensated_sums_are_exact_only_behind_barriers_or_the_compiler_is_kind() {
    let value = |end: &str| {
        let found = figures()
            .iter()
            .find(|f| f.name.starts_with("sum of 1048576") && f.name.ends_with(end));
        found.unwrap_or_else(|| panic!("no sum {end}")).value
    };
    assert!(value("Kahan behind barriers") < value("plain") / 1e3);
    assert!(value("pairwise") < value("in blocks of 1024"));
    assert!(value("in blocks of 1024") < value("plain"));
}

#[test]
fn a_planted_fault_in_each_kernel_raises_an_alarm() {
    let faults = [
        // Rounds to nearest: the largest draws become 1.
        (
            "sampling/sampler",
            "f32(x >> 8u) * 5.9604645e-8",
            "f32(x) * 2.3283064e-10",
            "draws that are 1",
        ),
        (
            "shading/hemisphere",
            "sqrt(1.0 - u.x)",
            "1.0 - u.x",
            "length of directions, off 1",
        ),
        (
            // Through the next wall, where it is near.
            "integrator/offset/error_bound",
            "let step = n * distance;",
            "let step = n * distance * 1e6;",
            "energy lost",
        ),
        (
            "sampling/radical_inverse",
            "rest %= weight;",
            "rest = (rest % weight) % 7u;",
            "Halton words that differ",
        ),
        (
            "stress/sums",
            "lost_held = held(held(",
            "lost_held = 0.0 * held(held(",
            "Kahan behind barriers",
        ),
    ];
    for (module, from, to, expected) in faults_in_turn("faults of numerics", faults) {
        let figures = with_fault(module, from, to);
        let alarms = alarms(&figures);
        assert!(
            alarms.iter().any(|name| name.contains(expected)),
            "{module}: {alarms:?}"
        );
    }
}
