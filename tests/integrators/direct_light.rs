//! Next-event estimation changes the noise of an image, not its mean.

use crate::MAX_DEPTH;
use crate::support::*;
use raystone::gpu::Gpu;

const DIRECT: &str = "result += throughput * direct_light(surface, depth, sampler);";
const WEIGHT: &str = "weight = density / (density + light_pdf(surface, hit.t));";

fn estimate(gpu: &Gpu, spp: u32) -> Estimate {
    let stage = Stage::builtin(gpu, "cornell-box", &[]);
    let traced = stage.traced(gpu, structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu, &traced, &sampler, &path(MAX_DEPTH), [16, 16], false);
    Estimate::of(&replicate_means(&renderer, spp, 16))
}

#[test]
fn direct_light_gives_the_mean_of_plain_path_tracing_and_counted_twice_it_does_not() {
    let plain = open(kernels_with(
        "integrator/path",
        &[(DIRECT, ""), (WEIGHT, "weight = 1.0;")],
    ));
    let twice = open(kernels_with(
        "integrator/path",
        &[(WEIGHT, "weight = 1.0;")],
    ));
    let plain = estimate(&plain, 256);
    let ours = estimate(gpu(), 32);
    let difference = ours.minus(&plain);
    assert!(difference.agrees_with(0.0), "{ours:?} against {plain:?}");
    assert!(difference.error < 0.02 * plain.mean, "{difference:?}");
    let twice = estimate(&twice, 32).minus(&plain);
    assert!(!twice.agrees_with(0.0), "{twice:?} proves nothing");
}
