//! Times, counted work and heat maps of structures that passed their gate.

use super::cost::Work;
use super::error::{Fault, RunError};
use super::peers;
use super::session::Session;
use super::structures::{Gated, write_failed};
use super::world::World;
use crate::clock_check;
use crate::heat_map::{heat_map, scale_of};
use crate::timed_rays::TimedRays;
use crate::timing::{Measured, Samples, Watch, empty_rounds, interleave};
use glam::Vec3;
use raystone_accel::tracer::count_work;
use raystone_accel::{Ask, NO_HIT, Query, Ray, RayBatch, Tracer};
use raystone_config::Axis;
use raystone_core::geometry::Camera;
use raystone_gpu::{Gpu, GpuError, slow_slice};
use raystone_record::{ClassTiming, CountersPerRay};
use raystone_stats::interval::Interval;
use raystone_stats::rates::{
    is_hidden, millions_per_second, overhead_fault, rate_fault, without_overhead,
};
use raystone_stats::statistics::median;
use raystone_verify::rays::{RaySet, primary_pixels, primary_rays};
use raystone_verify::shadow_rays::unlike_shadow;

/// A ray class through a structure, measured.
struct Timed<'a> {
    /// Place among the gated.
    structure: usize,
    set: &'a RaySet,
    rays: TimedRays,
}

/// Records the structure under which the device was lost; the others get their turn on a new one.
fn fail_lost(
    session: &mut Session,
    world: &World,
    mut lost: Gated,
    error: GpuError,
) -> Result<Vec<Gated>, RunError> {
    lost.record.body.failure = Some(error.to_string());
    write_failed(session, world, &lost.cell, lost.record)?;
    Ok(Vec::new())
}

/// Prepares every timed class for every structure. What fails at it is entered under its structure; a lost device
/// ends it, with the structure that lost it.
fn all_prepared<'a>(
    session: &mut Session,
    world: &'a World,
    gated: &[Gated],
    failures: &mut [Option<String>],
) -> Result<Result<Vec<Timed<'a>>, (usize, GpuError)>, RunError> {
    let mut timed = Vec::new();
    for (structure, one) in gated.iter().enumerate() {
        let gpu = world.device.of(&one.cell[Axis::Kernels])?;
        let sets = &world.reference.of(one.traced.space).sets;
        for set in sets.iter().filter(|set| set.is_timed()) {
            match prepare(gpu, world, one, set, &set.rays) {
                Ok(batch) => timed.push(Timed {
                    structure,
                    set,
                    rays: TimedRays::new(batch),
                }),
                Err(error) if world.gpu.lost().is_some() => return Ok(Err((structure, error))),
                Err(error) => failures[structure] = Some(error.to_string()),
            }
        }
        session.recorder.note_kernels(&one.cell.to_string());
    }
    Ok(Ok(timed))
}

/// Times every class through every structure in interleaved rounds, then counts the work. Structures that
/// fail at it are recorded and left out.
pub(super) fn time_all(
    session: &mut Session,
    world: &World,
    mut gated: Vec<Gated>,
) -> Result<Vec<Gated>, RunError> {
    session.say(format!("{}: timing structures", world.cell));
    let mut failures: Vec<Option<String>> = vec![None; gated.len()];
    let timed = match all_prepared(session, world, &gated, &mut failures)? {
        Ok(timed) => timed,
        Err((structure, error)) => {
            return fail_lost(session, world, gated.swap_remove(structure), error);
        }
    };
    let rivals = peers::build(session, world);
    let (cast, refused) = peers::batches(&rivals, world);
    session.recorder.note_kernels("peers");
    let timing = session.experiment.timing;
    let seed = u64::from(session.experiment.run.seed);
    let turns = session.cost.timed(Work::rays(timing.rays));
    let (progress, step_s) = (session.progress.clone(), session.cost.step_s(turns));
    let ours = timed.iter().map(|item| &item.rays as &dyn Measured);
    let all: Vec<&dyn Measured> = ours.chain(cast.iter().map(|item| item as _)).collect();
    let mut samples = match session.clock.time("gpu", || {
        interleave(&all, &timing, seed, || progress.add(step_s))
    }) {
        Ok(samples) => samples,
        Err((index, error)) => {
            let lost = gated.swap_remove(timed[index].structure);
            return fail_lost(session, world, lost, error);
        }
    };
    let theirs = samples.split_off(timed.len());
    let theirs = session
        .clock
        .time("gate", || peers::judged(world, cast, theirs));
    peers::write(session, world, rivals, refused, theirs)?;
    let known = timed
        .iter()
        .zip(&samples)
        .filter_map(|(item, samples)| Some((item, median(&samples.as_ref().ok()?.ms)?)));
    prove_clock(session, world, &gated, &known.collect::<Vec<_>>())?;
    for (item, samples) in timed.iter().zip(samples) {
        let one = &mut gated[item.structure];
        match class_timing(session, world, one, item, samples) {
            Ok(timing) => one.record.body.timings.extend(timing),
            Err(fault) => failures[item.structure] = Some(fault.of_cell()?),
        }
        one.record.ran.features = item.rays.batch.tracer().features();
        session.recorder.note_kernels(&one.cell.to_string());
    }
    let mut kept = Vec::new();
    for (mut one, failure) in gated.into_iter().zip(failures) {
        if let Some(failure) = failure {
            one.record.body.failure = Some(failure);
            one.record.body.timings.clear();
            write_failed(session, world, &one.cell, one.record)?;
        } else {
            let rates = one.record.body.timings.iter().map(|t| t.mrays_s.value);
            one.speed = rates.map(f64::ln).sum();
            kept.push(one);
        }
    }
    Ok(kept)
}

/// Rays of a class, ready to be traced through a structure.
fn prepare(
    gpu: &Gpu,
    world: &World,
    one: &Gated,
    set: &RaySet,
    rays: &[Ray],
) -> Result<RayBatch, GpuError> {
    let ask = Ask {
        coherent: set.is_coherent(),
        runtime_checks: one.runtime_checks,
        ..set.query().into()
    };
    Tracer::new(gpu, &world.buffers.triangles, &one.traced, ask)?.batch(rays)
}

/// Milliseconds that the clock check wants to measure, and the most rays that it traces for it.
const CLOCK_MS: f64 = 10.0;
const CLOCK_RAYS: usize = 1 << 20;

/// Ends the run if the times of the slowest batch follow neither its rays nor the clock around it,
/// once per run.
fn prove_clock(
    session: &mut Session,
    world: &World,
    gated: &[Gated],
    timed: &[(&Timed, f64)],
) -> Result<(), RunError> {
    let slowest = timed.iter().max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((item, ms)) = slowest.filter(|_| !session.checked.clock_is_proven) else {
        return Ok(());
    };
    session.checked.clock_is_proven = true;
    let (set, one) = (item.set, &gated[item.structure]);
    if Watch::is_blind() || !sees_a_wrong_answer(world, one, item) {
        return Err(RunError::Wrong(
            "the comparison of timed answers is blind: one that is wrong is not seen; no time would mean anything"
                .to_owned(),
        ));
    }
    let most = (CLOCK_RAYS / set.rays.len()).max(1);
    let repeats = ((CLOCK_MS / ms).ceil() as usize).clamp(1, most);
    let batch = |times: usize| {
        let rays = set
            .rays
            .iter()
            .cycle()
            .take(times * repeats * set.rays.len());
        let rays: Vec<Ray> = rays.copied().collect();
        prepare(item.rays.batch.gpu(), world, one, set, &rays)
    };
    let found = session
        .clock
        .time("gpu", || clock_check::fault(&batch(1)?, &batch(2)?));
    session.recorder.note_kernels(&one.cell.to_string());
    match found {
        Ok(Some(fault)) => Err(RunError::Wrong(format!(
            "the clocks of this run are wrong: {fault}; no time would mean anything"
        ))),
        // A device that is lost, or has no room for so many rays, fails where it is used.
        Ok(None) | Err(_) => Ok(()),
    }
}

/// Compares the last timed turn with answers of which one is wrong. A device that is lost, or other arithmetic, says nothing.
fn sees_a_wrong_answer(world: &World, one: &Gated, item: &Timed) -> bool {
    if !world.probe.is_exact() || !world.soup.intersection.triangle.is_exact() {
        return true;
    }
    let mut wrong = item.set.clone();
    if let Some(last) = wrong.truth.last_mut() {
        last.triangle = if last.triangle == NO_HIT { 0 } else { NO_HIT };
    }
    let found = (item.rays).fault(&wrong, &world.soup, one.traced.space, true);
    found.is_err() || found.is_ok_and(|fault| fault.is_some())
}

/// The figures of a class, if its answers are right: without what a dispatch of nothing takes, unless they take no longer.
fn class_timing(
    session: &mut Session,
    world: &World,
    one: &Gated,
    item: &Timed,
    samples: Result<Samples, GpuError>,
) -> Result<Option<ClassTiming>, Fault> {
    let text = |error: GpuError| error.to_string();
    let set = item.set;
    let gpu = world.device.of(&one.cell[Axis::Kernels])?;
    let exact = world.probe.is_exact();
    let fault = (item.rays).fault(set, &world.soup, one.traced.space, exact);
    if let Some(fault) = fault.map_err(text)? {
        return Err(format!("{} rays: {fault}", set.class.name()).into());
    }
    let samples = samples.map_err(text)?;
    if gpu.has_clock() && !samples.ms.is_empty() && samples.ms == samples.wall_ms {
        return Err(
            "its rounds are those of the wall clock, though the device has one"
                .to_owned()
                .into(),
        );
    }
    if samples.cpu_ms.len() > 2 && [&samples.ms, &samples.wall_ms].contains(&&samples.cpu_ms) {
        let text = "its processors' time is that of another clock";
        return Err(text.to_owned().into());
    }
    if let Some(slow) = slow_slice(item.rays.batch.longest_slice_ms()) {
        session.tell_warning(&format!("{}, {} rays: {slow}", one.cell, set.class.name()));
    }
    let mut empties = session
        .clock
        .time("gpu", || empty_rounds(|| item.rays.batch.trace_nothing()))
        .map_err(text)?;
    let triangles = &world.buffers.triangles;
    let work = session
        .clock
        .time("gpu", || {
            count_work(gpu, triangles, &one.traced, set.query(), &set.rays)
        })
        .map_err(text)?;
    let mut empty = median(&empties).unwrap_or(0.0);
    if is_hidden(&samples.ms, empty) {
        session.tell_warning(&format!(
            "{}, {} rays: a dispatch of nothing takes as long ({empty:.3} ms), and is in their time: they are at least as fast as shown; raise timing.rays",
            one.cell,
            set.class.name()
        ));
        (empties, empty) = (Vec::new(), 0.0);
    }
    let ms = without_overhead(&samples.ms, empty);
    let rays = set.rays.len() as f64;
    let rate = millions_per_second(&ms, rays);
    let fault = overhead_fault(&samples.ms, &empties, &ms)
        .or_else(|| rate.and_then(|rate| rate_fault(&rate, rays, &ms)));
    if let Some(fault) = fault {
        return Err(fault.into());
    }
    Ok(rate.map(|mrays_s| ClassTiming {
        unlike_shadow: unlike_shadow(set, &world.reference.of(one.traced.space).sets),
        counters: work.as_deref().map(CountersPerRay::mean_of),
        ..of_rounds(set, (ms, samples), mrays_s, gpu.is_software())
    }))
}

/// The figures of a class from its rounds, those by the device's clock without what a dispatch of nothing takes.
pub(super) fn of_rounds(
    set: &RaySet,
    (ms, samples): (Vec<f64>, Samples),
    mrays_s: Interval,
    is_software: bool,
) -> ClassTiming {
    ClassTiming {
        class: set.class,
        rays: set.rays.len(),
        hit_fraction: set.hit_fraction(),
        unlike_shadow: None,
        ms,
        wall_ms: samples.wall_ms,
        cpu_ms: if is_software {
            samples.cpu_ms
        } else {
            Vec::new()
        },
        mrays_s,
        counters: None,
        dispatches: 1,
        discarded: 0,
    }
}

/// Compares the cost of pixels with that of the rays that point there. Returns the first that is another's.
fn misplaced(
    costs: &[f32],
    (rays, counted): (&[Ray], &[f32]),
    camera: Camera,
    size: [u32; 2],
) -> Option<String> {
    let [forward, right, up] = camera.basis(size);
    let last = costs.len().checked_sub(1)?;
    let dearest = (0..=last).max_by(|a, b| costs[*a].total_cmp(&costs[*b]))?;
    let wrong = [0, dearest, last].into_iter().find(|pixel| {
        let [column, row] = [*pixel as u32 % size[0], *pixel as u32 / size[0]];
        let [width, height] = size.map(|edge| edge as f32);
        let across = right * (2.0 * (column as f32 + 0.5) / width - 1.0);
        let down = up * (2.0 * (row as f32 + 0.5) / height - 1.0);
        let towards = (forward + across - down).normalize();
        let beside = |ray: &Ray| Vec3::from(ray.direction).distance_squared(towards);
        let nearest =
            (0..rays.len()).min_by(|a, b| beside(&rays[*a]).total_cmp(&beside(&rays[*b])));
        nearest.is_some_and(|ray| counted[ray].to_bits() != costs[*pixel].to_bits())
    })?;
    let at = [wrong as u32 % size[0], wrong as u32 / size[0]];
    Some(format!(
        "a heat map has the cost of another ray at pixel {at:?}: no picture of it would mean anything"
    ))
}

/// Cost of every pixel's primary ray as a picture, one scale for all structures of a scene. The
/// scale ends at the 99th percentile of the costliest structure but brute force, whose cost is the
/// same everywhere and would leave the others black.
pub(super) fn draw_heat_maps(
    session: &mut Session,
    world: &World,
    mut gated: Vec<Gated>,
) -> Result<Vec<Gated>, RunError> {
    let [width, height] = session.experiment.run.resolution;
    let rays = primary_rays(world.camera, width, height);
    let pixels = primary_pixels(width, height);
    for structure in &mut gated {
        let gpu = world.device.of(&structure.cell[Axis::Kernels])?;
        let work = session.clock.time("gpu", || {
            count_work(
                gpu,
                &world.buffers.triangles,
                &structure.traced,
                Query::Closest,
                &rays,
            )
        });
        session.recorder.note_kernels(&structure.cell.to_string());
        let Ok(Some(work)) = work else { continue };
        structure.costs = vec![0.0; rays.len()];
        for (pixel, counters) in pixels.iter().zip(&work) {
            structure.costs[*pixel as usize] = (counters.nodes + counters.triangle_tests) as f32;
        }
        let counted: Vec<f32> = work
            .iter()
            .map(|w| (w.nodes + w.triangle_tests) as f32)
            .collect();
        let size = [width, height];
        if let Some(fault) = misplaced(&structure.costs, (&rays, &counted), world.camera, size) {
            return Err(RunError::Wrong(fault));
        }
    }
    let others = gated
        .iter()
        .filter(|g| g.cell[Axis::Accel].name != "brute-force");
    let scale = scale_of(others.map(|g| &*g.costs));
    for structure in gated.iter_mut().filter(|s| !s.costs.is_empty()) {
        let picture = heat_map(&structure.costs, scale, [width, height]);
        let labels = structure.cell.labels(&[Axis::Scene, Axis::Accel]);
        structure.record.body.heat_map = session.picture("heat", &labels, &picture)?;
        structure.record.body.heat_map_max = Some(f64::from(scale));
    }
    Ok(gated)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heat_map_that_is_turned_or_shifted_is_told() {
        let size = [16, 8];
        let camera = Camera::upright(Vec3::ZERO, Vec3::Z, 40.0);
        let (rays, pixels) = (primary_rays(camera, 16, 8), primary_pixels(16, 8));
        let counted: Vec<f32> = (0..rays.len()).map(|ray| (ray * 7 % 128) as f32).collect();
        let map = |place: &dyn Fn(usize) -> usize| {
            let mut costs = vec![0.0; counted.len()];
            let pairs = pixels.iter().zip(&counted);
            pairs.for_each(|(pixel, cost)| costs[place(*pixel as usize)] = *cost);
            misplaced(&costs, (&rays, &counted), camera, size)
        };
        assert_eq!(map(&|pixel| pixel), None);
        assert!(map(&|pixel| 127 - pixel).is_some());
        assert!(map(&|pixel| (pixel + 1) % 128).is_some());
        assert!(map(&|pixel| 16 * (7 - pixel / 16) + pixel % 16).is_some());
    }
}
