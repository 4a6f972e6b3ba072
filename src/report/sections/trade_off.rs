//! The cost of a build against its gain: break-even in rays, and time to an image.

use super::specs::{BREAK_EVENS, TIMES_TO_IMAGE};
use crate::data::{Measured, STRUCTURE_AXES, SceneGroup, View};
use crate::document::*;
use crate::format;
use crate::names::Names;
use crate::samplers::MeasuredSampler;
use crate::values::{Estimate, Value};
use raystone_record::figure;
use raystone_record::*;
use raystone_stats::statistics::LEAST_FOR_MEDIAN;

/// Returns the thousands of rays after which a structure has caught up with one that is built `extra_build_ms`
/// faster. Speeds in Mrays/s.
fn caught_up(extra_build_ms: f64, slow_build: &Interval, fast_build: &Interval) -> Estimate {
    if slow_build.high < fast_build.low {
        return Estimate::Word("never");
    }
    if slow_build.low <= fast_build.high {
        return Estimate::Word("undecided");
    }
    let seconds_per_million = 1.0 / fast_build.value - 1.0 / slow_build.value;
    (extra_build_ms.max(0.0) / seconds_per_million).into()
}

/// Returns the speed in a class, if it was measured often enough to have a 95 % interval.
fn rate<'a>(structure: &Measured<'a, StructureRecord>, class: RayClass) -> Option<&'a Interval> {
    let timing = (structure.body.timings.iter()).find(|t| t.class == class)?;
    (timing.ms.len() >= LEAST_FOR_MEDIAN).then_some(&timing.mrays_s)
}

/// Returns the ranked structures with speeds: the one that is built fastest, and the others.
fn by_build<'a>(
    scene: &'a SceneGroup,
) -> Option<(
    &'a Measured<'a, StructureRecord>,
    Vec<&'a Measured<'a, StructureRecord>>,
)> {
    let passed = scene.structures.iter();
    let mut passed: Vec<_> = passed
        .filter(|s| s.fault().is_none() && !s.is_inexact() && !s.timings.is_empty())
        .collect();
    let least = (passed.iter().enumerate())
        .min_by(|a, b| a.1.build_ms.total_cmp(&b.1.build_ms))?
        .0;
    Some((passed.remove(least), passed))
}

/// Returns the rays after which each structure has caught up with the one that is built fastest, per class.
pub(crate) fn break_even(scene: &SceneGroup) -> Vec<Value<'static>> {
    let Some((first, others)) = by_build(scene) else {
        return Vec::new();
    };
    let of = |s: &&Measured<StructureRecord>| {
        let extra_ms = s.build_ms - first.build_ms;
        let in_class = |timing: &ClassTiming| {
            let (own, other) = (rate(s, timing.class)?, rate(first, timing.class)?);
            let key = (s.key.clone()).with(axis::RAYS, timing.class.name());
            let reading = caught_up(extra_ms, own, other);
            Some(Value::new(&key, &figure::BREAK_EVEN, reading))
        };
        s.timings.iter().filter_map(in_class).collect::<Vec<_>>()
    };
    others.iter().flat_map(of).collect()
}

/// Returns the table of [`break_even`].
pub(crate) fn break_even_table(names: &Names, scene: &SceneGroup, values: &[Value]) -> Table {
    let Some((first, others)) = by_build(scene) else {
        return Table::default();
    };
    let rows = others.iter().map(|s| (s.key.clone(), Vec::new()));
    let words = [&*first.structure, &format::number(first.build_ms)];
    BREAK_EVENS.beside(names, values, &words, &[], rows)
}

/// Returns the sampler that most structures were timed with.
fn most_timed<'a>(view: &'a View) -> Option<&'a MeasuredSampler<'a>> {
    let timed = |s: &&MeasuredSampler| timed_with(view, s).count();
    view.samplers.iter().rev().max_by_key(timed)
}

/// Returns the times of cells with this sampler, whichever kernels they ran with.
fn timed_with<'a>(
    view: &'a View,
    sampler: &'a MeasuredSampler,
) -> impl Iterator<Item = &'a Measured<'a, TimeRecord>> {
    let axes = [axis::SEQUENCE, axis::DECORRELATION, axis::OFFSET];
    let times = view.valid_times();
    times.filter(move |time| time.key.agrees(&sampler.key, &axes))
}

/// Returns times of build and rendering together with that sampler, for one image of few samples and one of many.
pub(crate) fn times_to_image(scene: &SceneGroup, view: &View) -> Vec<Value<'static>> {
    let errors = view.samplers.iter().flat_map(|s| &s.replicates);
    let spps = errors.flat_map(|r| &r.errors).map(|e| e.spp);
    let (Some(sampler), Some(most)) = (most_timed(view), spps.max()) else {
        return Vec::new();
    };
    let mut counts = vec![1, most];
    counts.dedup();
    let of = |time: &Measured<TimeRecord>| {
        let is_it = |s: &&Measured<StructureRecord>| s.key.agrees(&time.key, &STRUCTURE_AXES);
        let built = scene.structures.iter().find(is_it)?;
        let ms = time.ms_per_spp?;
        let total = |spp: &u32| {
            let total = built.build_ms + ms.value * f64::from(*spp);
            let key = time.key.clone().with(axis::SPP, spp);
            Value::new(&key, &figure::TIME_TO_IMAGE, total)
        };
        Some(counts.iter().map(total).collect::<Vec<_>>())
    };
    timed_with(view, sampler).filter_map(of).flatten().collect()
}

/// Returns the table of [`times_to_image`].
pub(crate) fn time_to_image_table(
    names: &Names,
    scene: &SceneGroup,
    view: &View,
    builds: &[Value],
) -> Table {
    let times = times_to_image(scene, view);
    let sampler = most_timed(view).map_or("", |sampler| &sampler.name);
    let mut keys: Vec<Key> = times.iter().map(|value| value.key.clone()).collect();
    keys.dedup_by(|a, b| a.agrees(b, &STRUCTURE_AXES));
    let rows = keys.into_iter().map(|key| (key, Vec::new()));
    TIMES_TO_IMAGE.beside(
        names,
        &[builds, &times].concat(),
        &[&view.name, sampler],
        &[],
        rows,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slower_build_pays_after_the_rays_that_make_up_for_it_never_or_undecided() {
        let speed = |value: f64| Interval {
            value,
            low: value * 0.95,
            high: value * 1.05,
        };
        let of = |slow, fast| caught_up(100.0, &speed(slow), &speed(fast));
        // 100 ms more; 1 s/M rays against 2 s/M rays: after 100,000 rays.
        let Estimate::Known(found) = of(1.0, 0.5) else {
            panic!("no number");
        };
        assert!((found.value - 100.0).abs() < 1e-9, "{found:?}");
        assert_eq!(of(0.5, 1.0), Estimate::Word("never"));
        assert_eq!(of(1.0, 0.98), Estimate::Word("undecided"));
        // The intervals of both touch, though neither holds the other's value.
        assert_eq!(of(1.0, 0.93), Estimate::Word("undecided"));
    }
}
