//! Runs cell-by-cell measurements: skips finished cells, prepares and checks the others one by one,
//! times those of a group in the same rounds, and records them.

use super::error::RunError;
use super::measurement::{Absent, At, Measurement, Prepared};
use super::session::{End, Session};
use crate::timing::{Measured, Samples, interleave};
use raystone_config::{Axis, Cell};
use raystone_gpu::GpuError;
use raystone_image::Picture;
use raystone_record::{Body, Key, Line, MeasuredRecord, Note, Ran, Reading, fault_of};

struct Ready<'a> {
    cell: &'a Cell,
    item: Box<dyn Prepared + 'a>,
}

/// Runs the open cells of a measurement on `world`, the scene and tests of [`At::stage`]; without
/// one, those without a scene. Ends early when the device is lost; another continues.
pub(super) fn run(
    session: &mut Session,
    measurement: &'static dyn Measurement,
    at: &At,
    world: Option<&Cell>,
) -> Result<(), RunError> {
    let is_here = |cell: &Cell| match world {
        Some(world) => cell.is_on(world),
        None => cell.get(Axis::Scene).is_none(),
    };
    let mut cells = measurement.cells(session.experiment, session.plan);
    cells.retain(|cell| is_here(cell) && !session.ledger.is_done(&measurement.unit_name(cell)));
    for group in cells.chunk_by(|a, b| measurement.group(a) == measurement.group(b)) {
        run_group(session, measurement, at, group)?;
        if at.device.gpu.lost().is_some() {
            break;
        }
    }
    Ok(())
}

fn run_group(
    session: &mut Session,
    measurement: &'static dyn Measurement,
    at: &At,
    cells: &[Cell],
) -> Result<(), RunError> {
    let mut ready = Vec::new();
    let mut preparation = measurement.prepare(at, cells);
    for cell in cells {
        session.go_on()?;
        let name = measurement.unit_name(cell);
        session.say(format!("{name}: preparing"));
        session.lose_device_on_request(&at.device.gpu, &name);
        let prepared = session.clock.time("gate", || preparation.next());
        session.recorder.note_kernels(if measurement.is_shared() {
            measurement.name()
        } else {
            &name
        });
        match prepared {
            Some(Ok(item)) => ready.push(Ready { cell, item }),
            Some(Err(Absent::Refused(reason))) => session.write_refused(name, reason)?,
            Some(Err(Absent::Failed(reason))) => {
                write(session, measurement, at, (cell, Err(reason)))?
            }
            None => {
                let reason = "nothing was prepared of it".to_owned();
                write(session, measurement, at, (cell, Err(reason)))?;
            }
        }
        session.progress.add(step_s(session, measurement, cell));
        if at.device.gpu.lost().is_some() {
            return Ok(());
        }
    }
    let samples = match time(session, measurement, &ready) {
        Ok(samples) => samples,
        Err((place, error)) => {
            return write(
                session,
                measurement,
                at,
                (ready[place].cell, Err(error.to_string())),
            );
        }
    };
    for (Ready { cell, item }, samples) in ready.iter().zip(samples) {
        let samples = match samples {
            Err(Absent::Refused(reason)) => {
                session.write_refused(measurement.unit_name(cell), reason)?;
                continue;
            }
            Err(Absent::Failed(reason)) => Err(reason),
            Ok(samples) => Ok(samples),
        };
        let found = samples.and_then(|samples| {
            Ok(Found {
                readings: sound(item.readings(samples)?)?,
                notes: item.notes(),
                picture: item.picture(),
            })
        });
        write(session, measurement, at, (cell, found))?;
    }
    Ok(())
}

/// Fails readings whose record could not be read back.
fn sound(readings: Vec<Reading>) -> Result<Vec<Reading>, String> {
    match fault_of(&readings) {
        Some(fault) => Err(fault),
        None => Ok(readings),
    }
}

/// Seconds of one step of a cell, which consist of preparation, warm-up, and each round.
fn step_s(session: &Session, measurement: &dyn Measurement, cell: &Cell) -> f64 {
    let seconds = measurement.cost(cell, &session.cost).seconds();
    // What is shared is done once it is prepared.
    if measurement.is_timed() && !measurement.is_shared() {
        seconds / f64::from(session.experiment.timing.rounds + 2)
    } else {
        seconds
    }
}

/// Samples of each timed item of a cell, or why there are none.
type Timed = Result<Vec<Samples>, Absent>;

/// Samples of each cell, or its failure; if the device is lost, the index of the cell being timed.
fn time(
    session: &mut Session,
    measurement: &dyn Measurement,
    ready: &[Ready],
) -> Result<Vec<Timed>, (usize, GpuError)> {
    let of_cells: Vec<Vec<&dyn Measured>> = ready.iter().map(|one| one.item.timed()).collect();
    let places = of_cells.iter().enumerate();
    let places: Vec<usize> = places
        .flat_map(|(place, own)| vec![place; own.len()])
        .collect();
    let all: Vec<&dyn Measured> = of_cells.iter().flatten().copied().collect();
    let steps: f64 = ready
        .iter()
        .map(|one| step_s(session, measurement, one.cell))
        .sum();
    let step_s = steps / all.len().max(1) as f64;
    session.say(format!("timing {}", measurement.plural()));
    let timing = session.experiment.timing;
    let seed = u64::from(session.experiment.run.seed);
    let progress = session.progress.clone();
    let samples = (session.clock).time("gpu", || {
        interleave(&all, &timing, seed, || progress.add(step_s))
    });
    let samples = samples.map_err(|(index, error)| (places[index], error))?;
    let mut samples = samples.into_iter();
    let own = |own: Vec<&dyn Measured>| {
        let own = samples.by_ref().take(own.len());
        own.map(|one| one.map_err(Absent::from)).collect()
    };
    Ok(of_cells.into_iter().map(own).collect())
}

/// Readings of a cell, and what they cannot say.
#[derive(Default)]
struct Found {
    readings: Vec<Reading>,
    notes: Vec<Note>,
    picture: Option<Picture>,
}

fn write(
    session: &mut Session,
    measurement: &dyn Measurement,
    at: &At,
    (cell, found): (&Cell, Result<Found, String>),
) -> Result<(), RunError> {
    let (found, failure) = match found {
        Ok(found) => (found, None),
        Err(reason) => (Found::default(), Some(reason)),
    };
    let labels = [measurement.unit_name(cell)];
    let drawn = found.picture.map(|p| session.picture("map", &labels, &p));
    let readings = found.readings;
    let ran = Ran {
        unchecked: at.stage.is_some() && !session.experiment.run.runtime_checks,
        ..Ran::default()
    };
    let body = MeasuredRecord {
        measurement: measurement.name().to_owned(),
        failure: failure.clone(),
        notes: found.notes,
        picture: drawn.transpose()?.flatten(),
    };
    let line = Line::new(Key::from(cell), ran, Body::Measured(body)).with_readings(readings);
    let scene = at.stage.map_or("", |stage| &stage.scene.hash);
    let end = End {
        failure,
        scene,
        of: &[("what", measurement.name())],
        shared: &[measurement.name()],
        ..End::default()
    };
    session.conclude(&measurement.unit_name(cell), line, end)
}
