//! Words to floats in [0, 1). Checks `to_unit` of `kernels/sampling/sampler.wesl` through
//! `kernels/stress/conversion.wesl`.

use super::{Gauge, NumericsError, U, rig};
use raystone_gpu::{Composition, Gpu, UniformValues, groups_for};
use raystone_render::with_sampler;

/// Words of one dispatch.
const PART: u32 = 1 << 22;
/// Words whose naive conversion is looked at: the largest ones.
const TOP: u32 = 512;

/// Checks that every draw has its upper 24 bits and none is 1, over all values of these bits, or over every 16th of
/// them in a quick suite.
pub(super) fn figures(gpu: &Gpu, quick: bool) -> Result<Vec<Gauge>, NumericsError> {
    let stride: u32 = if quick { 1 << 12 } else { 1 << 8 };
    let words = u32::MAX / stride + 1;
    let (mut wrong, mut largest) = (0_u64, 0.0_f64);
    for first in (0..words).step_by(PART as usize) {
        let count = PART.min(words - first);
        // The lower bits are all ones: rounding to nearest would carry.
        let word = |index: u32| (first + index) * stride + (stride - 1);
        for (index, [unit, _]) in (0..).zip(convert(gpu, word(0), stride, count)?) {
            let exact = f64::from(word(index) >> 8) * U;
            wrong += u64::from(f64::from(unit) != exact);
            largest = largest.max(f64::from(unit));
        }
    }
    let top = convert(gpu, u32::MAX - (TOP - 1), 1, TOP)?;
    let ones = |column: usize| top.iter().filter(|pair| pair[column] >= 1.0).count() as f64;
    let tried = format!("of {words} words with lower bits of ones");
    let of_top = format!("of the {TOP} largest words");
    let naive = format!("{of_top}, 128 in IEEE arithmetic: why draws take the upper bits");
    Ok(vec![
        Gauge::new("draws that lose one of 24 bits", wrong as f64, tried)
            .at_most(0.0)
            .in_unit("words"),
        Gauge::new("largest draw", largest, "1 would be outside of all tables").at_most(1.0 - U),
        Gauge::new("draws that are 1", ones(0), &*of_top)
            .at_most(0.0)
            .in_unit("words"),
        Gauge::new("words that f32(x) · 2⁻³² makes 1", ones(1), naive).in_unit("words"),
    ])
}

/// Returns the draw and the naive conversion of `count` words from `first` on.
fn convert(gpu: &Gpu, first: u32, stride: u32, count: u32) -> Result<Vec<[f32; 2]>, NumericsError> {
    let sampler = rig::sampler("pixel-hash", 1)?;
    let kernel = with_sampler(Composition::new("stress/conversion"), &sampler);
    let values = UniformValues::new()
        .u32("first", first)
        .u32("stride", stride)
        .u32("count", count);
    let units = [("units", u64::from(count) * 8)];
    let uniform = ("conversion", values);
    let played = gpu.evaluate(&kernel, uniform, &[], &units, groups_for(count))?;
    Ok(played.download("units")?)
}
