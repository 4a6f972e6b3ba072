//! Sums of 2²⁰ terms in f32, in five ways, against exact ones. Checks `kernels/stress/sums.wesl`.

use super::{Gauge, NumericsError, U, rig};
use raystone_gpu::{Composition, Gpu, UniformValues};
use raystone_render::{BLOCK_SAMPLES, with_sampler};
use raystone_sampling::{Coordinate, Sampler};

/// Terms of a long sum: a million samples per pixel.
const TERMS: u32 = 1 << 20;
/// Sums of noise, each over other terms.
const LANES: u32 = 16;
const SEED: u32 = 17;
const SHORTENED: &str = "; no more terms, because this driver ends loops";

/// The ways of the kernel in its order: name, alarm as a relative error for n terms, and a note. The alarms are the
/// a-priori bounds for terms of one sign (N. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed., 2002,
/// section 4.2), doubled for terms of second order.
type Way = (&'static str, fn(f64) -> f64, &'static str);

const WAYS: [Way; 5] = [
    ("plain", |n| n * U, "what the renderer does within a block"),
    (
        "Kahan as written",
        |n| n * U,
        "compilers may drop the compensation",
    ),
    (
        "Kahan behind barriers",
        |_| 4.0 * U,
        "intermediate bits pass through a zero that is loaded",
    ),
    (
        "pairwise",
        |n| 2.0 * n.log2() * U,
        "needs a partial sum per power of two",
    ),
    (
        "in blocks of 1024",
        |n| 2.0 * (1024.0 + n / 1024.0) * U,
        "needs one sum more; the renderer's blocks end on the host",
    ),
];

/// Measures the largest relative error of each way, over a constant and over noise.
pub(super) fn figures(gpu: &Gpu) -> Result<Vec<Gauge>, NumericsError> {
    let sampler = rig::sampler("pixel-hash", 1)?;
    let terms = longest(gpu.loop_limit);
    let long = errors(gpu, &sampler, terms)?;
    let block = errors(gpu, &sampler, BLOCK_SAMPLES)?;
    let figure = |((name, alarm, note), error): (&Way, f64), n: u32, note_of_n: &str| {
        let name = format!("sum of {n} terms, {name}");
        Gauge::new(name, error, format!("{note}{note_of_n}"))
            .at_most(alarm(f64::from(n)))
            .in_unit("relative")
    };
    let mut figures: Vec<_> = WAYS
        .iter()
        .zip(long)
        .map(|way| figure(way, terms, if terms < TERMS { SHORTENED } else { "" }))
        .collect();
    let whole = ": a whole one";
    figures.push(figure((&WAYS[0], block[0]), BLOCK_SAMPLES, whole));
    Ok(figures)
}

/// Returns the number of terms of a long sum, with about two turns of loops each, on a driver that ends loops.
fn longest(loop_limit: Option<u32>) -> u32 {
    loop_limit.map_or(TERMS, |limit| TERMS.min(1 << (limit / 4).max(1).ilog2()))
}

fn errors(gpu: &Gpu, sampler: &Sampler, terms: u32) -> Result<[f64; 5], NumericsError> {
    let mut worst = [0.0_f64; 5];
    for constant in [true, false] {
        let totals = totals(gpu, sampler, terms, constant)?;
        for (lane, totals) in (0..).zip(totals) {
            let exact = if constant {
                f64::from(terms) * f64::from(0.1_f32)
            } else {
                exact_noise(sampler, terms, lane)
            };
            for (worst, total) in worst.iter_mut().zip(totals) {
                let error = (f64::from(total) / exact - 1.0).abs();
                // NaN must not be lost.
                *worst = if error <= *worst { *worst } else { error };
            }
        }
    }
    Ok(worst)
}

/// Returns the sum of the noise of a lane: multiples of 2⁻²⁴ have exact sums in 64 bits.
fn exact_noise(sampler: &Sampler, terms: u32, lane: u32) -> f64 {
    let word = |sample| {
        let at = Coordinate {
            pixel: lane,
            sample,
            dimension: 0,
            seed: SEED,
        };
        u64::from(sampler.sample_u32(at) >> 8)
    };
    (0..terms).map(word).sum::<u64>() as f64 * U
}

/// Returns the sums of all lanes in the order of [`WAYS`].
fn totals(
    gpu: &Gpu,
    sampler: &Sampler,
    terms: u32,
    constant: bool,
) -> Result<Vec<[f32; 5]>, NumericsError> {
    let kernel = with_sampler(Composition::new("stress/sums"), sampler);
    let values = UniformValues::new()
        .u32("count", terms)
        .u32("constant", u32::from(constant))
        .u32("seed", SEED)
        .u32("zero", 0);
    let table = bytemuck::cast_slice(sampler.table.words());
    let played = gpu.evaluate(
        &kernel,
        ("sums", values),
        &[("sampler_table", table)],
        &[("totals", u64::from(LANES) * 32)],
        [1, 1, 1],
    )?;
    let words: Vec<[f32; 8]> = played.download("totals")?;
    let ways = words.iter();
    Ok(ways
        .map(|[a, b, c, d, e, ..]| [*a, *b, *c, *d, *e])
        .collect())
}
