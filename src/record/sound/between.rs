//! Figures of one record that follow from each other: hits are whole rays, clocks are others, paths become fewer, and frames come
//! one after the other.

use crate::{AnimationRecord, ClassTiming, Cost, RayClass, TimeRecord};

/// What a share of hits may be off whole rays.
const OF_WHOLE: f64 = 1e-6;
/// Rounds from which on clocks that agree in all of them to the bit are one clock.
const ROUNDS: usize = 3;

/// Shares of whole rays; between the same ends as many rays hit as shadow rays do, but for those whose answers differ.
pub(super) fn of_hits(timings: &[ClassTiming], faults: &mut Vec<String>) {
    let hits = |timing: &ClassTiming| timing.hit_fraction * timing.rays as f64;
    let shadow = timings.iter().find(|t| t.class == RayClass::Shadow);
    for timing in timings {
        let own = hits(timing);
        let off = (own - own.round()).abs();
        let other = timing.unlike_shadow.zip(shadow);
        let other = other.filter(|(_, shadow)| shadow.rays == timing.rays);
        let is_other =
            other.is_some_and(|(n, shadow)| (own - hits(shadow)).abs() > n as f64 + OF_WHOLE);
        if off > OF_WHOLE || is_other {
            faults.push(format!(
                "{own} of {} {} rays hit something",
                timing.rays,
                timing.class.name()
            ));
        }
    }
}

/// Times of processors that are those of another clock. Where all stand still, they are equal.
pub(super) fn of_processors(cpu_ms: &[f64], others: [&[f64]; 2], faults: &mut Vec<String>) {
    let is_known = cpu_ms.len() >= ROUNDS && cpu_ms.iter().all(|ms| *ms > 0.0);
    if is_known && others.contains(&cpu_ms) {
        faults.push(format!(
            "{} rounds of the processors are those of another clock",
            cpu_ms.len()
        ));
    }
}

/// Each primary ray begins a path, and none begins later.
pub(super) fn of_paths(record: &TimeRecord, faults: &mut Vec<String>) {
    let live = &record.live_paths;
    let primary = record.rays.get("primary").copied();
    let is_begun = live.first().copied() == primary || live.is_empty() || primary.is_none();
    if !is_begun || !live.is_sorted_by(|a, b| a >= b) {
        faults.push(format!(
            "of {primary:?} primary rays {live:?} paths are followed after each bounce"
        ));
    }
}

/// All frames in order, with as many rounds by each clock, and each class of rays once.
pub(super) fn of_animation(record: &AnimationRecord, faults: &mut Vec<String>) {
    let frames = record.frames.iter();
    let is_ordered = frames
        .map(|frame| frame.frame)
        .eq(0..record.frames.len() as u32);
    let all = record.settings.frames as usize;
    let is_whole = match record.failure {
        None => record.frames.len() == all,
        Some(_) => record.frames.len() <= all,
    };
    if !is_ordered || !is_whole {
        let numbers: Vec<u32> = record.frames.iter().map(|frame| frame.frame).collect();
        faults.push(format!("the frames of {all} are {numbers:?}"));
    }
    for frame in &record.frames {
        let mut known: Vec<RayClass> = frame.classes.iter().map(|of| of.class).collect();
        known.sort();
        known.dedup();
        let traced: usize = frame.classes.iter().map(|of| of.rays).sum();
        if known.len() != frame.classes.len() || traced > frame.judged {
            faults.push(format!(
                "frame {}: {traced} rays of {} classes are timed, and {} were judged",
                frame.frame,
                frame.classes.len(),
                frame.judged
            ));
        }
        let of_classes = frame.classes.iter().flat_map(|of| &of.cost);
        let costs = [&frame.refit, &frame.rebuild].into_iter();
        let costs = costs.chain(&frame.refit_on_host).chain(of_classes);
        costs.for_each(|cost| of_cost(cost, faults));
    }
}

fn of_cost(cost: &Cost, faults: &mut Vec<String>) {
    let Cost {
        processor_ms,
        wall_ms,
        passes_ms,
    } = cost;
    super::rounds(wall_ms, [processor_ms, passes_ms], faults);
    of_processors(processor_ms, [wall_ms, passes_ms], faults);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FrameRays, FrameRecord, Interval};

    fn timing(class: RayClass, hit_fraction: f64, unlike_shadow: Option<usize>) -> ClassTiming {
        ClassTiming {
            class,
            rays: 1000,
            hit_fraction,
            unlike_shadow,
            ms: Vec::new(),
            wall_ms: Vec::new(),
            cpu_ms: Vec::new(),
            mrays_s: Interval::exact(1.0),
            counters: None,
            dispatches: 1,
            discarded: 0,
        }
    }

    #[test]
    fn shares_are_of_whole_rays_and_of_the_same_ends_alike() {
        let said = |reversed: f64, unlike: usize| {
            let mut faults = Vec::new();
            let timings = [
                timing(RayClass::Shadow, 0.25, None),
                timing(RayClass::ShadowReversed, reversed, Some(unlike)),
            ];
            of_hits(&timings, &mut faults);
            !faults.is_empty()
        };
        assert!(!said(0.25, 0) && !said(0.252, 2) && !said(0.25, 3));
        assert!(said(0.252, 1) && said(0.2505, 2));
    }

    #[test]
    fn processors_have_a_clock_of_their_own() {
        let said = |cpu: &[f64], wall: &[f64]| {
            let mut faults = Vec::new();
            of_processors(cpu, [&[1.0, 1.0], wall], &mut faults);
            !faults.is_empty()
        };
        assert!(said(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]));
        assert!(!said(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.5]) && !said(&[1.0, 1.0], &[1.0, 1.0]));
        assert!(!said(&[0.0; 3], &[0.0; 3]) && !said(&[], &[]));
    }

    #[test]
    fn frames_come_one_after_the_other_and_all_of_them() {
        let cost = |ms: f64| Cost {
            processor_ms: vec![2.0 * ms; 3],
            wall_ms: vec![ms; 3],
            passes_ms: Vec::new(),
        };
        let frame = |frame| FrameRecord {
            frame,
            judged: 10,
            refit: cost(1.0),
            refit_on_host: None,
            rebuild: cost(2.0),
            sah: [None; 2],
            classes: vec![FrameRays {
                class: RayClass::Primary,
                rays: 8,
                counters: [None; 2],
                cost: [cost(3.0), cost(4.0)],
            }],
        };
        let right = AnimationRecord {
            settings: raystone_config::Animation {
                frames: 3,
                ..Default::default()
            },
            triangles: 1,
            frames: [0, 1, 2].map(frame).to_vec(),
            failure: None,
        };
        let said = |change: fn(&mut AnimationRecord)| {
            let mut record = right.clone();
            change(&mut record);
            let mut faults = Vec::new();
            of_animation(&record, &mut faults);
            !faults.is_empty()
        };
        assert!(!said(|_| ()));
        let changes: [fn(&mut AnimationRecord); 6] = [
            |r| r.frames.truncate(2),
            |r| r.frames.swap(0, 1),
            |r| r.frames[1].judged = 7,
            |r| r.frames[2].classes = [0, 0].map(|_| r.frames[2].classes[0].clone()).to_vec(),
            |r| r.frames[0].refit.wall_ms.truncate(2),
            |r| r.frames[0].refit.processor_ms = vec![1.0; 3],
        ];
        for (place, change) in changes.into_iter().enumerate() {
            assert!(said(change), "{place}");
        }
    }
}
