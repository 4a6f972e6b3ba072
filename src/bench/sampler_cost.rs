//! Cost of sampling in nanoseconds per two-dimensional sample, to explain Mrays/s of samplers.
//!
//! One kernel draws in a loop and does nothing else; another runs the same loop without drawing.
//! They alternate; the difference is the cost: throughput of the adapter, not latency.

use raystone_gpu::{Bindings, Composition, Gpu, GpuError, Recording, UniformValues, groups_for};
use raystone_record::Reading;
use raystone_record::figure::{LOOP_NS, NS_PER_SAMPLE};
use raystone_render::with_sampler;
use raystone_sampling::{Coordinate, Sampler};
use raystone_stats::statistics::median_interval;

/// Invocations, one per pixel.
const PIXELS: u32 = 1 << 14;
/// Dimension pairs drawn per sample, if available: one or two bounces of a path.
const MOST_PAIRS: u32 = 4;
/// Samples per pixel in one dispatch, if available.
const MOST_SAMPLES: u32 = 1 << 12;
/// Maximum loop iterations per drawn number: one per digit of a word.
const TURNS_PER_DRAW: u32 = 33;
/// Target time of a dispatch, milliseconds.
const DISPATCH_MS: f64 = 25.0;
const ROUNDS: usize = 9;
/// Samples of the dispatch whose sums are compared with the host's.
const CHECKED: u32 = 2;

struct Loop<'a> {
    gpu: &'a Gpu,
    bindings: Bindings,
    pairs: u32,
}

impl Loop<'_> {
    /// Milliseconds of one dispatch that draws `samples` samples per pixel, or none.
    fn run(&self, kernel: &Composition, samples: u32) -> Result<f64, GpuError> {
        let mut bindings = self.bindings.clone();
        let values = UniformValues::new()
            .u32("first_sample", 0)
            .u32("samples", samples)
            .u32("pairs", self.pairs)
            .u32("seed", 1);
        bindings.uniform("cost", values);
        let pipeline = self.gpu.pipeline(kernel, true)?;
        let mut recording = Recording::new();
        recording.run("cost", &pipeline, &bindings, groups_for(PIXELS));
        Ok(self.gpu.play(&recording)?.elapsed().measured()?.ms())
    }
}

/// Nanoseconds per pair of dimensions of a dispatch that draws so many of each sample.
pub(crate) fn ns_per_draw(ms: f64, pairs: u32, samples: u32) -> f64 {
    ms * 1e6 / (u64::from(PIXELS) * u64::from(pairs) * u64::from(samples)) as f64
}

/// Nanoseconds per pair of dimensions, of drawing alone and of the loop around it, from the milliseconds of dispatches with draws
/// and without.
fn costs([with, without]: [f64; 2], pairs: u32, samples: u32) -> [f64; 2] {
    [with - without, without].map(|ms| ns_per_draw(ms, pairs, samples))
}

/// Compares what a dispatch of a loop leaves in some pixels with the loop over the sampler's twin, or over none: one that draws
/// fewer numbers than are counted looks cheap.
fn check_sums(
    sampler: Option<&Sampler>,
    [pairs, samples]: [u32; 2],
    found: &[u32],
) -> Result<(), String> {
    let expected = |pixel: u32| {
        let draws = (0..samples).flat_map(|sample| (0..2 * pairs).map(move |d| (sample, d)));
        draws.fold(0_u32, |sum, (sample, dimension)| {
            let at = Coordinate {
                pixel,
                sample,
                dimension,
                seed: 1,
            };
            let drawn = sampler.map_or(sample + dimension, |sampler| sampler.sample_u32(at));
            (sum ^ drawn).wrapping_add(pixel)
        })
    };
    let wrong = [0, 1, 63, 64, PIXELS - 1]
        .into_iter()
        .find(|pixel| found.get(*pixel as usize) != Some(&expected(*pixel)));
    wrong.map_or(Ok(()), |pixel| {
        Err(format!(
            "the loop whose time is the cost of {} leaves {:?} in pixel {pixel}, and should leave {}: it does not draw {samples} \
             samples of {pairs} pairs",
            sampler.map_or("nothing".to_owned(), Sampler::label),
            found.get(pixel as usize),
            expected(pixel)
        ))
    })
}

/// Measures a sampler's cost on this adapter: nanoseconds of adapter time per two-dimensional
/// sample minus the empty loop (near zero it may be negative), and those of the empty loop, as
/// medians of the rounds. Also returns the BLAKE3 hash of the drawing kernel. Uses the sampler's
/// first samples and first eight dimensions.
///
/// # Errors
/// The sampler has fewer than two dimensions, its kernel does not run, or its table is too large.
pub fn sampler_cost(gpu: &Gpu, sampler: &Sampler) -> Result<([Reading; 2], String), GpuError> {
    let pairs = (sampler.demand.dimensions / 2).min(MOST_PAIRS);
    if pairs == 0 {
        return Err(GpuError::Kernel(format!(
            "the cost of {} is measured per pair of dimensions, and it was made for one",
            sampler.label()
        )));
    }
    let drawing = with_sampler(Composition::new("sampling/sampler_cost"), sampler);
    let empty = Composition::new("sampling/sampler_cost").feature("empty", true);
    let sums = gpu.zeroed("sums", u64::from(PIXELS) * 4)?;
    let mut bindings = Bindings::new();
    bindings
        .buffer(
            "sampler_table",
            &gpu.storage("sampler_table", sampler.table.words())?,
        )
        .buffer("sums", &sums);
    let work = Loop {
        gpu,
        bindings,
        pairs,
    };
    // First runs include the driver's compiler.
    let checked = CHECKED.min(sampler.demand.samples.unwrap_or(CHECKED));
    for (kernel, draws) in [(&empty, None), (&drawing, Some(sampler))] {
        work.run(kernel, checked)?;
        check_sums(draws, [pairs, checked], &gpu.read(&sums)?).map_err(GpuError::Kernel)?;
    }
    let most = sampler.demand.samples.unwrap_or(MOST_SAMPLES);
    let turns = 2 * pairs * TURNS_PER_DRAW;
    let allowed = gpu
        .loop_limit
        .map_or(MOST_SAMPLES, |limit| limit / 2 / turns);
    let most = most.min(allowed).clamp(1, MOST_SAMPLES);
    let per_sample = work.run(&drawing, most.min(8))? / f64::from(most.min(8));
    let samples = ((DISPATCH_MS / per_sample.max(1e-6)) as u32).clamp(1, most);
    let mut drawn = Vec::with_capacity(ROUNDS);
    let mut looped = Vec::with_capacity(ROUNDS);
    for _ in 0..ROUNDS {
        let without = work.run(&empty, samples)?;
        let with = work.run(&drawing, samples)?;
        let [draw, turn] = costs([with, without], pairs, samples);
        drawn.push(draw);
        looped.push(turn);
    }
    let interval = |values: &[f64]| {
        median_interval(values)
            .ok_or_else(|| GpuError::Driver("a clock returned what is no time".to_owned()))
    };
    let readings = [
        Reading::new(&NS_PER_SAMPLE, interval(&drawn)?),
        Reading::new(&LOOP_NS, interval(&looped)?),
    ];
    Ok((readings, gpu.pipeline(&drawing, true)?.kernel.hash()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cost_of_a_draw_is_without_that_of_the_loop() {
        // As many pairs as nanoseconds in the difference.
        let draws = f64::from(PIXELS) * 3.0 * 8.0;
        let [draw, turn] = costs([5e-6 * draws, 4e-6 * draws], 3, 8);
        assert!(
            (draw - 1.0).abs() < 1e-9 && (turn - 4.0).abs() < 1e-9,
            "{draw} and {turn}"
        );
    }
}
