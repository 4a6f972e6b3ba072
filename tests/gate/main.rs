//! The gate: right structures pass it, and every planted fault turns it red, with the right count and
//! a ray that can be replayed.

mod compare;
mod faults;
mod faulty;
mod passes;
mod records;

#[path = "../support/mod.rs"]
mod support;
mod timed;

use raystone::accel::AccelKind;
use raystone::config::Gate;
use raystone::gpu::{Gpu, probe_arithmetic};
use raystone::measure::gate::{Checks, Judge, gate};
use raystone::measure::record::GateVerdict;
use support::Stage;

/// The judge of a scene with `rays` rays of each class.
fn judge(stage: &Stage, rays: u32) -> Judge {
    let settings = Gate {
        rays,
        brute_force_tests: 20_000_000,
        oracle_rays: 512,
        ao_length: 0.0,
        offset: 0.0,
    };
    Judge::new(
        &stage.scene,
        &stage.soup,
        stage.camera,
        &settings,
        1,
        Checks::Repeated,
    )
    .expect("a judge")
}

/// The verdict on one structure.
fn verdict(gpu: &Gpu, stage: &Stage, kind: &dyn AccelKind, judge: &Judge) -> GateVerdict {
    let traced = stage.traced(gpu, kind);
    let probe = probe_arithmetic(gpu).expect("the probe runs");
    gate(
        gpu,
        &stage.buffers.triangles,
        &stage.soup,
        &traced,
        judge,
        &probe,
        true,
    )
    .unwrap_or_else(|e| panic!("{}: {e}", kind.name()))
}

/// Wrong rays of all classes.
fn wrong(verdict: &GateVerdict) -> usize {
    verdict.classes.iter().map(|class| class.wrong).sum()
}
