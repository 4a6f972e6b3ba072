//! Estimators change an image's noise, not its mean: strategies, heuristics, roulette. A limit on
//! contributions does, and reports it.

use crate::support::*;
use raystone::gpu::Gpu;
use raystone::integrator::path::{Roulette, Strategy};
use raystone::integrator::{ConfiguredIntegrator, IntegratorRegistry};
use raystone::params::{Choice as _, ParamValue, Variant};

/// Deep enough for roulette, from the first bounce on, to affect all indirect light.
const DEPTH: i64 = 4;

fn chosen(strategy: Strategy, roulette: Roulette, clamp: f64) -> Variant {
    let name = |name: &str| ParamValue::Name(name.to_owned());
    let changes = [
        ("max_depth", ParamValue::Integer(DEPTH)),
        ("strategy", name(strategy.name())),
        ("roulette", name(roulette.name())),
        ("roulette_depth", ParamValue::Integer(0)),
        ("clamp", ParamValue::Number(clamp)),
    ];
    integrator_variant("path", &changes)
}

fn estimate(gpu: &Gpu, what: &Variant, spp: u32) -> Estimate {
    let stage = Stage::builtin(gpu, "cornell-box", &[]);
    let traced = stage.traced(gpu, structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu, &traced, &sampler, what, [16, 16], false);
    Estimate::of(&replicate_means(&renderer, spp, 16))
}

/// Samples per pixel that make every strategy about equally precise: lamps are hard to hit.
fn spp(strategy: Strategy) -> u32 {
    match strategy {
        Strategy::Bsdf => 256,
        _ => 96,
    }
}

#[test]
fn all_strategies_and_roulettes_have_one_mean() {
    let exact = chosen(Strategy::MisBalance, Roulette::Never, 0.0);
    let exact = estimate(gpu(), &exact, 256);
    let mut largest = 0.0f64;
    let roulettes = |&strategy| {
        Roulette::ALL
            .iter()
            .map(move |&roulette| (strategy, roulette))
    };
    let all = Strategy::ALL.iter().flat_map(roulettes);
    for (strategy, roulette) in in_turn("strategies and roulettes", all) {
        let ours = estimate(gpu(), &chosen(strategy, roulette, 0.0), spp(strategy));
        let difference = ours.minus(&exact);
        let what = format!("{} and {}", strategy.name(), roulette.name());
        assert!(
            difference.agrees_with(0.0),
            "{what}: {ours:?}, not {exact:?}"
        );
        largest = largest.max(difference.error / exact.mean);
    }
    assert!(largest < 0.015, "{largest}: proves too little");
}

#[test]
fn a_fault_in_a_heuristic_or_a_roulette_moves_the_mean() {
    let faults = [
        (
            Strategy::MisBalance,
            Roulette::Never,
            "weight = found_weight(density, light_pdf(leaving, surface, hit));",
            "weight = 1.0;",
        ),
        (
            Strategy::MisPower,
            Roulette::Never,
            "select(less * less, 1.0, own >= other)",
            "1.0",
        ),
        (
            Strategy::Light,
            Roulette::Never,
            "@if(!found_emission) return 0.0;",
            "@if(!found_emission) return 1.0;",
        ),
        (
            Strategy::Light,
            Roulette::Albedo,
            "throughput /= survival;",
            "",
        ),
    ];
    let exact = chosen(Strategy::MisBalance, Roulette::Never, 0.0);
    let exact = estimate(gpu(), &exact, 256);
    for (strategy, roulette, right, wrong) in faults_in_turn("faults of estimators", faults) {
        let faulty = open(kernels_with("integrator/path", &[(right, wrong)]));
        let found = estimate(&faulty, &chosen(strategy, roulette, 0.0), spp(strategy));
        let difference = found.minus(&exact);
        assert!(!difference.agrees_with(0.0), "{right}: {found:?}");
    }
}

#[test]
fn a_limit_on_contributions_darkens_the_image_and_is_called_biased() {
    let unlimited = chosen(Strategy::Bsdf, Roulette::Never, 0.0);
    let limited = chosen(Strategy::Bsdf, Roulette::Never, 1.0);
    let [before, after] = [&unlimited, &limited].map(|what| estimate(gpu(), what, 64));
    assert!(after.mean < 0.9 * before.mean, "{after:?}, {before:?}");
    let is_biased = |what: &Variant| {
        let configured: ConfiguredIntegrator = IntegratorRegistry::default()
            .configured(what)
            .expect("known parameters");
        configured.facts.is_biased
    };
    assert!(is_biased(&limited) && !is_biased(&unlimited));
}
