//! Compactions of streams: each judged word by word, then all timed in the same rounds.

use super::RunError;
use super::kernels::Device;
use super::session::{Session, content_hash};
use crate::compaction::{Bench, Inputs, Load, benched, stream};
use crate::timing::{Measured, Samples, interleave, millions_per_second};
use raystone_config::{Axis, Cell};
use raystone_gpu::compaction::Order;
use raystone_gpu::{Elapsed, Gpu, GpuError, Player};
use raystone_record::{Body, CompactionRecord, Key, Line, Outcome, Ran};
use raystone_stats::statistics::median_interval;
use std::sync::Arc;

/// A cell that passed its judge.
struct Timed {
    cell: Cell,
    bench: Bench,
    record: CompactionRecord,
}

impl Measured for Timed {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        self.bench.measure()
    }
}

/// Streams that were uploaded, and what they are of.
type Uploaded = Vec<((u64, u32, u32), Arc<Inputs>)>;

/// All compactions of the plan.
pub(super) fn run(session: &mut Session, device: &Device) -> Result<(), RunError> {
    let cells = session.plan.compactions.iter();
    let cells: Vec<Cell> = cells
        .filter(|c| !session.is_done(&c.to_string()))
        .cloned()
        .collect();
    let player = Arc::new(Player::new(&device.gpu));
    let mut uploaded = Uploaded::new();
    let mut timed = Vec::new();
    for cell in &cells {
        session.go_on()?;
        let gpu = device.of(&cell[Axis::Kernels])?;
        session.say(format!("{cell}: judging"));
        session.lose_device_on_request(gpu, &cell.to_string());
        let prepared = prepare(session, gpu, &player, &mut uploaded, cell, &cells);
        session.note_kernels(&cell.to_string());
        match prepared {
            Ok(item) => timed.push(item),
            Err(Absent::Refused(reason)) => session.write_refused(cell.to_string(), reason)?,
            Err(Absent::Failed(reason)) => fail(session, cell, reason)?,
        }
        session.progress.add(session.weights.compaction);
        if gpu.lost().is_some() {
            return Ok(());
        }
    }
    let timing = session.experiment.timing;
    let seed = u64::from(session.experiment.run.seed);
    let (progress, weight) = (session.progress.clone(), session.weights.compaction);
    session.say("timing compactions");
    let measured = (session.clock).time("gpu", || {
        interleave(&timed, &timing, seed, || progress.add(weight))
    });
    let measured = match measured {
        Ok(measured) => measured,
        Err((index, error)) => return fail(session, &timed[index].cell, error.to_string()),
    };
    for (item, samples) in timed.into_iter().zip(measured) {
        match samples {
            Ok(samples) => write(session, &item.cell, finished(item.record, samples))?,
            Err(error) => fail(session, &item.cell, error.to_string())?,
        }
    }
    Ok(())
}

/// Why a cell is not timed.
enum Absent {
    /// The adapter cannot run it.
    Refused(String),
    /// It is wrong.
    Failed(String),
}

impl From<GpuError> for Absent {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::TooLarge { .. } => Self::Refused(error.to_string()),
            error => Self::Failed(error.to_string()),
        }
    }
}

fn prepare(
    session: &mut Session,
    gpu: &Gpu,
    player: &Arc<Player>,
    uploaded: &mut Uploaded,
    cell: &Cell,
    cells: &[Cell],
) -> Result<Timed, Absent> {
    let registry = &session.registries.compactions;
    let configured = |cell: &Cell| benched(registry, &cell[Axis::Integrator]);
    let method = configured(cell).map_err(Absent::Failed)?;
    let load = Load::of(&cell[Axis::Integrator]);
    if let Some(reason) = method.refusal(gpu) {
        return Err(Absent::Refused(reason));
    }
    let kind = (load.valid.to_bits(), method.buckets(), load.bytes);
    // The longest stream of its kind is uploaded once, and each cell takes its beginning.
    let length = |other: &Cell| {
        let load = Load::of(&other[Axis::Integrator]);
        let buckets = configured(other).ok()?.buckets();
        ((load.valid.to_bits(), buckets, load.bytes) == kind).then_some(load.elements)
    };
    let longest = cells.iter().filter_map(length).max();
    let longest = longest.unwrap_or(load.elements);
    let inputs = match uploaded.iter().find(|(known, _)| *known == kind) {
        Some((_, inputs)) => Arc::clone(inputs),
        None => {
            let seed = u64::from(session.experiment.run.seed);
            let flags = stream::flags(longest, load.valid, method.buckets(), seed);
            let inputs = Arc::new(Inputs::upload(gpu, flags, load.bytes)?);
            uploaded.push((kind, Arc::clone(&inputs)));
            inputs
        }
    };
    let stable = method.order() != Order::Any;
    let bench = Bench::new(player, gpu, method, &inputs, [load.elements; 2])?;
    if let Some(fault) = session.clock.time("gate", || bench.judge())? {
        return Err(Absent::Failed(fault));
    }
    let record = CompactionRecord {
        elements: load.elements,
        valid: load.valid,
        bytes: load.bytes,
        kept: bench.kept_elements,
        stable,
        passes: bench.runs,
        scratch_bytes: bench.scratch_bytes,
        least_bytes: bench.least_bytes(),
        ..CompactionRecord::default()
    };
    Ok(Timed {
        cell: cell.clone(),
        bench,
        record,
    })
}

fn finished(mut record: CompactionRecord, samples: Samples) -> CompactionRecord {
    let elements = f64::from(record.elements);
    let over = |ms: &[f64], of: f64| ms.iter().map(|ms| ms * 1e6 / of).collect::<Vec<_>>();
    record.ns_per_element = median_interval(&over(&samples.ms, elements));
    record.melements_s = millions_per_second(&samples.ms, elements);
    record.gb_s = millions_per_second(&samples.ms, record.least_bytes as f64 * 1e-3);
    record.ms = samples.ms;
    record.wall_ms = samples.wall_ms;
    record
}

fn fail(session: &mut Session, cell: &Cell, reason: String) -> Result<(), RunError> {
    session.failed += 1;
    let load = Load::of(&cell[Axis::Integrator]);
    let record = CompactionRecord {
        elements: load.elements,
        valid: load.valid,
        bytes: load.bytes,
        failure: Some(reason),
        ..CompactionRecord::default()
    };
    write(session, cell, record)
}

fn write(session: &mut Session, cell: &Cell, record: CompactionRecord) -> Result<(), RunError> {
    let failure = record.failure.clone();
    let line = Line::new(Key::from(cell), Ran::default(), Body::Compaction(record));
    let hash = content_hash(&line, "", &[("what", "compaction")]);
    session.write(&line.hashed(&hash))?;
    let ended = match &failure {
        Some(reason) => (Outcome::Failed, reason.as_str()),
        None => (Outcome::Done, ""),
    };
    session.close(&cell.to_string(), ended, vec![hash], &[])
}
