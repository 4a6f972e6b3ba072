//! Probes of the adapter's arithmetic and loops at start-up.

use super::compose::Composition;
use super::{
    Bindings, Gpu, GpuError, LOOPS_CUT, Recording, Storage, UniformValues, groups_for, wait_for,
};
use serde::{Deserialize, Serialize};

/// Agreement of the adapter's arithmetic with the host's f32, in the patterns of traversal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct ArithmeticProbe {
    /// `a*b + c` is rounded twice, never fused.
    pub unfused: bool,
    /// `a / b` is correctly rounded.
    pub exact_division: bool,
    /// `sqrt(a)` is correctly rounded.
    pub exact_sqrt: bool,
    /// The rounding error of a product can be computed exactly, by splitting the factors.
    #[serde(default)]
    pub exact_products: bool,
    /// Denormals are not flushed to 0. Hits depend on it only for rays and scenes of such sizes.
    #[serde(default)]
    pub denormals: bool,
}

impl ArithmeticProbe {
    /// True if hits should be bit-identical to the host's.
    pub fn is_exact(&self) -> bool {
        self.unfused && self.exact_division
    }
}

const COUNT: u32 = 4096;

/// Runs a small kernel on pseudo-random ordinary numbers and compares with the host.
///
/// # Errors
/// The kernel does not run.
pub fn probe_arithmetic(gpu: &Gpu) -> Result<ArithmeticProbe, GpuError> {
    wait_for(probe_arithmetic_async(gpu))
}

/// The same as a future.
///
/// # Errors
/// As [`probe_arithmetic`].
pub async fn probe_arithmetic_async(gpu: &Gpu) -> Result<ArithmeticProbe, GpuError> {
    let mut state = 0x9e37_79b9_u32;
    let mut next = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        // Exponents −8 … 7: no denormal or overflow in any of the patterns.
        f32::from_bits(
            ((state >> 28) + 119) << 23 | (state & 0x007f_ffff) | (state << 4 & 0x8000_0000),
        )
    };
    // The fourth number is denormal or just not: half of it is denormal.
    let input: Vec<[f32; 4]> = (0..COUNT)
        .map(|_| {
            [
                next(),
                next(),
                next(),
                f32::from_bits(next().to_bits() & 0x00ff_ffff),
            ]
        })
        .collect();
    let pipeline = gpu.pipeline(&Composition::new("common/probe"), true)?;
    let output = gpu.zeroed("probe_out", u64::from(COUNT) * 32)?;
    let mut bindings = Bindings::new();
    bindings
        .buffer("probe_in", &gpu.storage("probe_in", &input)?)
        .buffer("probe_out", &output);
    let mut recording = Recording::new();
    recording
        .run("probe", &pipeline, &bindings, groups_for(COUNT))
        .download("probe", &output);
    let result: Vec<[f32; 8]> = gpu.play_async(&recording).await?.download("probe")?;
    let all = |expected: fn(&[f32; 4]) -> f32, lane: usize| {
        input
            .iter()
            .zip(&result)
            .all(|(i, o)| expected(i).to_bits() == o[lane].to_bits())
    };
    Ok(ArithmeticProbe {
        unfused: all(|[a, b, c, _]| a * b + c, 0) && all(|[a, b, c, _]| a * b - c * a, 1),
        exact_division: all(|[a, b, ..]| a / b, 2),
        exact_sqrt: all(|[a, ..]| a.abs().sqrt(), 3),
        exact_products: all(|[a, b, ..]| product_error(*a, *b, a * b), 4)
            && all(|[_, b, c, _]| product_error(*b, *c, b * c), 5),
        denormals: all(|[.., d]| d * 0.5, 7),
    })
}

/// Rounding error of the product `p` of `a` and `b`, by splitting the factors; as in
/// `kernels/accel/triangle/compensated.wesl`.
fn product_error(a: f32, b: f32, p: f32) -> f32 {
    // The upper half of a significand.
    const UPPER: u32 = 0xffff_f000;
    let a1 = f32::from_bits(a.to_bits() & UPPER);
    let b1 = f32::from_bits(b.to_bits() & UPPER);
    let (a2, b2) = (a - a1, b - b1);
    a2 * b2 - (((p - a1 * b1) - a2 * b1) - a1 * b2)
}

/// Iterations of the loops that [`probe_loops`] runs: outer and inner.
const LOOPS: [[u32; 2]; 2] = [[1, 1_000_000], [1000, 1000]];

/// Total loop iterations per invocation after which the driver silently ends loops; `None` if a
/// million iterations complete, in one loop and in two nested ones.
///
/// Mesa's software driver up to 22.3 has such a limit: 65,536 iterations over all loops of a vector
/// of invocations together (`LP_MAX_TGSI_LOOP_ITERATIONS` in its source). After that every loop
/// ends with its first iteration, which `check_loops` of `kernels/common/errors.wesl` detects.
///
/// # Errors
/// The kernel does not run, or loops end early undetected by the kernel.
pub(super) async fn probe_loops(gpu: &Gpu) -> Result<Option<u32>, GpuError> {
    let kernel = Composition::new("common/loops").feature("loops_cut", true);
    let pipeline = gpu.pipeline(&kernel, true)?;
    let mut limit = None;
    for [outer, inner] in LOOPS {
        let [turns, status] = [("turns", 8), ("status", 64)].map(|(n, b)| Storage::scratch(n, b));
        let loops = UniformValues::new().u32("outer", outer).u32("inner", inner);
        let mut bindings = Bindings::new();
        bindings
            .buffer("turns", &turns)
            .buffer("status", &status)
            .uniform("loops", loops);
        let mut recording = Recording::new();
        recording
            .clear(&turns)
            .clear(&status)
            .run("loops", &pipeline, &bindings, [1, 1, 1])
            .download("turns", &turns)
            .download("status", &status);
        let played = gpu.play_async(&recording).await?;
        let taken = played.download::<u32>("turns")?[0];
        let noticed = played.download::<u32>("status")?[0] & LOOPS_CUT != 0;
        let wanted = outer * inner;
        if taken == wanted && !noticed {
            continue;
        }
        if !noticed {
            return Err(GpuError::LoopsUnsound {
                adapter: gpu.info.name.clone(),
                turns: taken,
                wanted,
            });
        }
        limit.get_or_insert(taken);
    }
    Ok(limit)
}

/// Timestamps that [`probe_clock_step`] looks at.
const TICKS: usize = 32;

/// Step of the adapter's timestamps in nanoseconds, where all of many are multiples of it: browsers round them. `None`
/// without timestamps, or for a step of at most a tick.
///
/// # Errors
/// The kernel does not run.
pub async fn probe_clock_step(gpu: &Gpu) -> Result<Option<u64>, GpuError> {
    let Some(period) = gpu.timestamp_period else {
        return Ok(None);
    };
    let kernel = Composition::new("common/loops").feature("loops_cut", true);
    let pipeline = gpu.pipeline(&kernel, true)?;
    let loops = UniformValues::new().u32("outer", 1).u32("inner", 1);
    let mut bindings = Bindings::new();
    bindings
        .buffer("turns", Storage::scratch("turns", 8))
        .buffer("status", Storage::scratch("status", 64))
        .uniform("loops", loops);
    let mut recording = Recording::new();
    recording.run("loops", &pipeline, &bindings, [1, 1, 1]);
    let mut ticks = Vec::new();
    while ticks.len() < TICKS {
        let played = gpu.play_async(&recording).await?;
        ticks.extend(played.ticks.into_iter().flatten());
    }
    Ok(common_step(&ticks).map(|step| (step as f64 * f64::from(period)) as u64))
}

/// The greatest step that all ticks are multiples of, if it is above 1.
fn common_step(ticks: &[u64]) -> Option<u64> {
    let divisor = |mut a: u64, mut b: u64| {
        while b != 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let step = ticks.iter().copied().fold(0, divisor);
    (step > 1).then_some(step)
}

#[cfg(test)]
mod tests {
    use super::common_step;

    #[test]
    fn rounded_ticks_tell_their_step() {
        let ticks: Vec<u64> = (0..32).map(|i| 7_123_456_789 + 1_234_567 * i * i).collect();
        assert_eq!(common_step(&ticks), None);
        for step in [65_536, 100_000] {
            let rounded: Vec<u64> = ticks.iter().map(|tick| tick / step * step).collect();
            assert_eq!(common_step(&rounded), Some(step));
        }
        assert_eq!(common_step(&[]), None);
        assert_eq!(common_step(&[0, 0]), None);
    }
}
