//! The correctness check: right structures pass, planted faults fail with a replayable ray.

mod bare;
mod compare;
mod faults;
mod faulty;
mod passes;
mod records;

mod timed;

use crate::support::Stage;
use raystone::accel::AccelKind;
use raystone::gpu::Gpu;
use raystone::measure::gate::{Checks, ReferenceTracer};
use raystone::measure::record::GateVerdict;

fn judge(stage: &Stage, rays: u32) -> ReferenceTracer {
    stage.judge(Checks::Repeated, [rays, 20_000_000, 512])
}

fn verdict(
    gpu: &Gpu,
    stage: &Stage,
    kind: &dyn AccelKind,
    reference: &ReferenceTracer,
) -> GateVerdict {
    let traced = stage.traced(gpu, kind);
    let verdict = stage.verdict(gpu, &traced, reference);
    verdict.unwrap_or_else(|e| panic!("{}: {e}", kind.name()))
}

fn wrong(verdict: &GateVerdict) -> usize {
    verdict.classes.iter().map(|class| class.wrong).sum()
}
