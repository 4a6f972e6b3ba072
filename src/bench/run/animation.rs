//! Structures from frame to frame of a moving scene, where the experiment asks for it.

use super::cost::{Cost, Work};
use super::error::RunError;
use super::measurement::Measurement;
use super::session::{End, Session};
use super::structures::{Gated, Structures, image_settings};
use super::world::World;
use crate::animation::{Actor, Frame, moved, take_over};
use raystone_config::{Animation, Axis, Cell, Experiment, Plan};
use raystone_gpu::Gpu;
use raystone_record::{AnimationRecord, Body, Key, Line, Ran};
use raystone_render::Stage;
use raystone_verify::gate::{Checks, ReferenceTracer};

/// Structures from frame to frame of a moving scene.
pub(super) struct Animations;

impl Measurement for Animations {
    fn name(&self) -> &'static str {
        "animation"
    }

    fn plural(&self) -> &'static str {
        "animations"
    }

    fn cells(&self, experiment: &Experiment, plan: &Plan) -> Vec<Cell> {
        if experiment.animation.is_none() {
            return Vec::new();
        }
        plan.structures.clone()
    }

    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        Structures.rounds_of(cell)
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        let e = experiment;
        format!(
            "{:?}",
            (image_settings(e), &e.gate, &e.timing, &e.animation)
        )
    }

    fn cost(&self, _: &Cell, cost: &Cost) -> Work {
        Work::other(seconds_of(cost.experiment))
    }
}

/// Seconds that a structure takes for all frames.
fn seconds_of(experiment: &Experiment) -> f64 {
    experiment
        .animation
        .map_or(0.0, |animation| f64::from(animation.frames))
}

/// A structure whose frames are recorded.
struct Part<'a> {
    gated: &'a Gated,
    actor: Actor<'a>,
    gpu: &'a Gpu,
    record: AnimationRecord,
}

/// All structures of a world, frame by frame.
pub(super) fn run(session: &mut Session, world: &World, gated: &[Gated]) -> Result<(), RunError> {
    let Some(animation) = session.experiment.animation else {
        return Ok(());
    };
    if let Err(reason) = moved(&world.scene, &animation, 0) {
        for structure in gated {
            session.write_refused(name(structure), reason.clone())?;
        }
        return Ok(());
    }
    let mut parts = Vec::new();
    for structure in gated {
        if session.ledger.is_done(&name(structure)) {
            continue;
        }
        match part(session, world, structure, animation) {
            Ok(part) => parts.push(part),
            Err(reason) => session.write_refused(name(structure), reason)?,
        }
    }
    for number in 0..animation.frames {
        if parts.iter().all(|part| part.record.failure.is_some()) {
            break;
        }
        session.say(format!("{}: frame {number}", world.cell));
        if let Err(reason) = frame(session, world, &animation, number, &mut parts) {
            for part in &mut parts {
                let failure = || format!("frame {number}: {reason}");
                part.record.failure.get_or_insert_with(failure);
            }
        }
    }
    session.recorder.note_kernels("animation");
    for part in parts {
        let failure = part.record.failure.clone();
        let name = name(part.gated);
        let ran = Ran {
            unchecked: !part.gated.runtime_checks,
            ..Ran::default()
        };
        let body = Body::Animation(part.record);
        let end = End {
            failure,
            scene: &world.scene.hash,
            of: &[("animation", &format!("{animation:?}"))],
            shared: &["animation"],
            ..End::default()
        };
        session.progress.add(seconds_of(session.experiment));
        session.conclude(
            &name,
            Line::new(Key::from(&part.gated.cell), ran, body),
            end,
        )?;
    }
    Ok(())
}

fn name(structure: &Gated) -> String {
    Animations.unit_name(&structure.cell)
}

fn part<'a>(
    session: &Session<'a>,
    world: &'a World,
    structure: &'a Gated,
    settings: Animation,
) -> Result<Part<'a>, String> {
    let accel = &structure.cell[Axis::Accel];
    let kind = session.registries.accel.named("structure", &accel.name)?;
    let gpu = world.device.of(&structure.cell[Axis::Kernels]);
    let gpu = gpu.map_err(|e| e.to_string())?;
    Ok(Part {
        actor: Actor::new(kind, &accel.params, settings.motion, (&world.soup, gpu))?,
        gated: structure,
        gpu,
        record: AnimationRecord {
            settings,
            triangles: world.soup.records.len() as u64,
            frames: Vec::new(),
            failure: None,
        },
    })
}

/// Takes all that have not failed over to a frame, which gets a stage and a reference tracer of its own.
fn frame(
    session: &mut Session,
    world: &World,
    animation: &Animation,
    number: u32,
    parts: &mut [Part],
) -> Result<(), String> {
    let experiment = session.experiment;
    let seed = u64::from(experiment.run.seed);
    let scene = moved(&world.scene, animation, number)?;
    let tests = world.soup.intersection;
    let stage = Stage::new(world.gpu, scene, tests).map_err(|e| e.to_string())?;
    let reference = session.clock.time("judge", || {
        let settings = &experiment.gate;
        let past = Checks::Repeated;
        ReferenceTracer::new(
            &stage.scene,
            &stage.soup,
            world.camera,
            settings,
            seed,
            past,
        )
    });
    let frame = Frame {
        number,
        first: &world.soup,
        stage: &stage,
        reference: &reference.map_err(|e| e.to_string())?,
        probe: &world.probe,
        runtime_checks: experiment.run.runtime_checks,
        timing: &experiment.timing,
        seed,
    };
    let open = parts
        .iter_mut()
        .filter(|part| part.record.failure.is_none());
    let mut open: Vec<&mut Part> = open.collect();
    let actors: Vec<(&Actor, &Gpu)> = open.iter().map(|p| (&p.actor, p.gpu)).collect();
    let outcomes = (session.clock).time("animation", || take_over(&frame, &actors));
    for (part, outcome) in open.iter_mut().zip(outcomes) {
        match outcome {
            Ok(record) => part.record.frames.push(record),
            Err(fault) => part.record.failure = Some(format!("frame {number}: {fault}")),
        }
    }
    Ok(())
}
