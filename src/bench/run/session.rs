//! State of a run: records, clock, progress, finished cells.

use super::cost::Cost;
use super::device::Device;
use super::error::RunError;
use super::inputs::{Current, place};
use super::kernels::Kernels;
use super::ledger::Ledger;
use super::options::RunOptions;
use super::progress::Progress;
use super::promised::Promised;
use super::recorder::Recorder;
use super::reference_file::ReferenceFile;
use super::resume::{Earlier, Kept};
use super::shard::shards;
use super::units::Unit;
use crate::environment::{capture, machine_load};
use raystone_config::{Axis, Cell, Experiment, Plan, Skipped};
use raystone_core::text::cell_hash;
use raystone_gpu::{Gpu, Stopwatch};
use raystone_image::{Attribute, FileFormat, Image, ImageError, Picture, write_png};
use raystone_record::Environment;
use raystone_record::{
    Body, CellRecord, CpuTime, FinishedRecord, Inputs, KernelFolder, Line, Outcome, RunRecord,
    SkippedRecord,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Images up to this many pixels store linear radiance by default: 1.5 MiB each.
const MOST_KEPT_PIXELS: usize = 1 << 17;

/// Accounts wall time to parts; unclaimed time is overhead of the program.
pub(super) struct Clock {
    start: Stopwatch,
    /// Unix time of `start` in seconds.
    began_unix_s: u64,
    parts_s: BTreeMap<String, f64>,
    /// CPU time of all parts, milliseconds.
    parts_cpu_ms: f64,
}

impl Clock {
    fn new() -> Self {
        Self {
            start: Stopwatch::start(),
            began_unix_s: raystone_core::clock::Instant::unix_s(),
            parts_s: BTreeMap::new(),
            parts_cpu_ms: 0.0,
        }
    }

    /// Runs `work` and books its time under `part`.
    pub(super) fn time<T>(&mut self, part: &str, work: impl FnOnce() -> T) -> T {
        let start = Stopwatch::start();
        let result = work();
        let spent = start.elapsed();
        *self.parts_s.entry(part.to_owned()).or_default() += spent.wall_ms * 1e-3;
        self.parts_cpu_ms += spent.cpu_ms.unwrap_or(0.0);
        result
    }
}

pub(super) struct Session<'a> {
    pub experiment: &'a Experiment,
    pub plan: &'a Plan,
    pub registries: &'a super::Registries,
    pub options: &'a RunOptions,
    pub clock: Clock,
    pub progress: Progress,
    /// Expected times of its steps.
    pub cost: Cost<'a>,
    /// Units left to measure.
    pub ledger: Ledger,
    /// Output.
    pub recorder: Recorder<'a>,
    /// Checks shared by several cells.
    pub checked: Checked,
    /// The reference image, if read from a file.
    pub reference_file: Option<ReferenceFile>,
}

/// Outcome of a unit.
#[derive(Default)]
pub(super) struct End<'a> {
    /// The failure reason, if it failed.
    pub failure: Option<String>,
    /// Hash of its scene; empty if it has none.
    pub scene: &'a str,
    /// Other inputs of its figures, by name.
    pub of: &'a [(&'a str, &'a str)],
    /// Hashes of further lines that belong to it.
    pub lines: Vec<String>,
    /// Names whose kernels also count for it.
    pub shared: &'a [&'a str],
}

/// Checks shared by several cells.
#[derive(Default)]
pub(super) struct Checked {
    /// Second scene of the correctness check.
    pub trial: super::trial::Trial,
    /// Hashes of the lines about integrators.
    pub integrator_lines: BTreeMap<String, String>,
    /// Errors of checked integrators.
    pub integrators: BTreeMap<String, Option<String>>,
    /// True to check on all trial scenes, not only on those of the plan's scenes.
    pub on_all_trials: bool,
    /// True once the gate has seen faults in its own data.
    pub gate_is_proven: bool,
    /// True once the device has sorted known keys.
    pub sort_is_proven: bool,
    /// True once the check of images has.
    pub image_gate_is_proven: bool,
    /// True once times followed work and clocks.
    pub clock_is_proven: bool,
    /// Samplers whose words were compared with the twin's.
    pub words: HashSet<String>,
}

impl<'a> Session<'a> {
    /// Opens the folder; fails before any measurement if it is not writable.
    pub(super) fn new(
        experiment: &'a Experiment,
        plan: &'a Plan,
        registries: &'a super::Registries,
        options: &'a RunOptions,
    ) -> Result<Self, RunError> {
        let reference_file = ReferenceFile::load(experiment)?;
        let recorder = Recorder::open(options)?;
        let mut session = Self::unrecorded(experiment, plan, registries, options);
        session.recorder = recorder;
        session.recorder.promised = Some(RefCell::new(Promised::of(experiment)));
        session.reference_file = reference_file;
        Ok(session)
    }

    /// Number of units left to measure besides `kept`.
    pub(super) fn open_beside(&self, kept: &Kept) -> usize {
        let names: HashSet<&str> = kept.cells.iter().map(|cell| cell.unit.as_str()).collect();
        let open = self.ledger.open_units();
        open.filter(|unit| !names.contains(unit.name.as_str()))
            .count()
    }

    /// Adopts valid results of an earlier run on this device; the first line tells their number.
    pub(super) fn begin(
        &mut self,
        device: &Device,
        kernels: &Kernels,
        (earlier, mut current): (&Earlier, Current<'a>),
    ) -> Result<usize, RunError> {
        self.recorder.use_device(&device.gpu);
        let environment = capture(&device.gpu, &self.options.program);
        current.device = Some(place(&environment));
        let kept = earlier.kept(&self.ledger.units, &current);
        let count = kept.cells.len();
        for (unit, why) in &kept.stale {
            self.tell_progress(&format!("{unit}: again, {why}"));
        }
        self.recorder.current = Some(current);
        self.take_over(kept)?;
        let open = self.cost.whole(self.ledger.open_units());
        self.progress.expect(open.seconds());
        self.write_start(environment, kernels.folders())?;
        Ok(count)
    }

    /// Fails all open units matching `is_one` for one reason, reported once.
    pub(super) fn fail_all(
        &mut self,
        about: &str,
        is_one: impl Fn(&Unit) -> bool,
        reason: String,
    ) -> Result<(), RunError> {
        self.write_failure(about, reason.clone())?;
        let hash = failure_hash(about, &reason);
        for name in self.ledger.open_names(is_one) {
            let lines = vec![hash.clone()];
            self.close(&name, (Outcome::Failed, &reason), lines, &[])?;
        }
        Ok(())
    }

    /// Skips all open units of a world for one reason, reported once.
    pub(super) fn leave_out(&mut self, world: &Cell, reason: String) -> Result<(), RunError> {
        let cell = format!("{world}: all structures, samplers and times");
        self.leave_out_units(&cell, reason, |unit| unit.cell.is_on(world))
    }

    /// Skips all open units of a world that render, for one reason.
    pub(super) fn leave_out_images(
        &mut self,
        world: &Cell,
        reason: String,
    ) -> Result<(), RunError> {
        let renders = |unit: &Unit| unit.cell.get(Axis::Integrator).is_some();
        self.leave_out_units(
            &format!("{world}: all samplers and times"),
            reason,
            |unit| unit.cell.is_on(world) && renders(unit),
        )
    }

    fn leave_out_units(
        &mut self,
        cell: &str,
        reason: String,
        is_one: impl Fn(&Unit) -> bool,
    ) -> Result<(), RunError> {
        let names = self.ledger.open_names(is_one);
        if names.is_empty() {
            return Ok(());
        }
        self.ledger.skipped += names.len();
        let hash = self.write_left_out(cell, &reason)?;
        for name in names {
            let lines = vec![hash.clone()];
            self.close(&name, (Outcome::LeftOut, &reason), lines, &[])?;
        }
        Ok(())
    }

    fn take_over(&mut self, kept: Kept) -> Result<(), RunError> {
        self.recorder.take_over(&kept.lines)?;
        for cell in kept.cells {
            if cell.outcome == Outcome::LeftOut {
                self.ledger.skipped += 1;
                self.ledger.refused.insert(cell.unit.clone(), cell.reason);
                self.ledger.set_unusable(&cell.unit);
            }
            self.ledger.finish(cell.unit);
        }
        Ok(())
    }

    /// Drops all units outside the shard of the options.
    pub(super) fn keep_shard(&mut self) {
        let Some(shard) = self.options.shard else {
            return;
        };
        let units = Arc::clone(&self.ledger.units);
        let numbers = shards(&units, shard.of, |unit| self.cost.seconds_of(unit));
        for (unit, number) in units.iter().zip(numbers) {
            if number != shard.number {
                self.ledger.finish(unit.name.clone());
            }
        }
    }

    /// Writes a unit's line, with the hash of all its inputs, and closes the unit.
    pub(super) fn conclude(&mut self, unit: &str, line: Line, end: End) -> Result<(), RunError> {
        let hash = line.content_hash(end.scene, end.of);
        self.recorder.write(&line.hashed(&hash))?;
        self.ledger.failed += usize::from(end.failure.is_some());
        let outcome = match &end.failure {
            Some(reason) => (Outcome::Failed, reason.as_str()),
            None => (Outcome::Done, ""),
        };
        let lines = [hash].into_iter().chain(end.lines).collect();
        self.close(unit, outcome, lines, end.shared)
    }

    /// Closes a unit with its lines' hashes. Kernels noted for `shared` also count for it.
    pub(super) fn close(
        &mut self,
        name: &str,
        (outcome, reason): (Outcome, &str),
        lines: Vec<String>,
        shared: &[&str],
    ) -> Result<(), RunError> {
        self.recorder.note_kernels(name);
        self.ledger.finish(name.to_owned());
        if outcome != Outcome::Done {
            self.ledger.set_unusable(name);
        }
        let Some(unit) = self.ledger.unit(name) else {
            return Ok(());
        };
        let record = CellRecord {
            unit: name.to_owned(),
            outcome,
            reason: reason.to_owned(),
            run_began_unix_s: self.clock.began_unix_s,
            inputs: Inputs::default(),
            lines,
        };
        self.recorder.write_cell(unit, record, shared)?;
        let word = match outcome {
            Outcome::Done => "done",
            Outcome::Failed => "failed",
            Outcome::LeftOut => "left out",
        };
        let between = if reason.is_empty() { "" } else { ": " };
        self.recorder
            .log(&format!("{name}: {word}{between}{reason}"));
        if outcome == Outcome::Failed && self.options.fail_fast {
            return Err(RunError::Wrong(format!("{name} failed: {reason}")));
        }
        Ok(())
    }

    /// A session that writes nothing.
    pub(super) fn unrecorded(
        experiment: &'a Experiment,
        plan: &'a Plan,
        registries: &'a super::Registries,
        options: &'a RunOptions,
    ) -> Self {
        let units = registries.measurements.units(experiment, plan);
        Self {
            experiment,
            plan,
            registries,
            options,
            clock: Clock::new(),
            progress: Progress::new(options),
            cost: Cost::new(experiment, plan, &registries.integrators),
            ledger: Ledger::new(units),
            recorder: Recorder::default(),
            checked: Checked::default(),
            reference_file: None,
        }
    }

    /// Destroys the device if a test requested it at this cell.
    pub(super) fn lose_device_on_request(&self, gpu: &Gpu, cell: &str) {
        if self.options.lose_device_at.as_deref() == Some(cell) {
            gpu.device.destroy();
        }
    }

    /// Issues a warning immediately, and in the report.
    pub(super) fn warn(&self, about: &str, reason: String) -> Result<(), RunError> {
        self.tell_warning(&format!("{about}: {reason}"));
        let body = Body::Warning(told(about, &reason));
        self.recorder.write(&Line::about_all(body))
    }

    /// Shows a warning above the progress bar.
    pub(super) fn tell_warning(&self, text: &str) {
        self.recorder.log(&format!("warning: {text}"));
        if let Some(tell) = self.options.warn {
            self.progress.bar.suspend(|| tell(text));
        }
    }

    fn write_start(
        &mut self,
        environment: Environment,
        kernels: Vec<KernelFolder>,
    ) -> Result<(), RunError> {
        let record = RunRecord {
            name: self.experiment.name.clone(),
            experiment: self.experiment.source.clone(),
            experiment_text: self.experiment.text.clone(),
            started_unix_s: self.clock.began_unix_s,
            environment,
            renders_full_product: self.plan.renders_full_product(),
            renders_planned: self.plan.renders_planned(),
            kernels,
            overrides: self.experiment.overrides.clone(),
            only: self.plan.only.clone(),
            shard: self.options.shard.map(|shard| shard.to_string()),
            figures: {
                let of_measurements = self.registries.measurements.figures();
                let of_structures = self.registries.figures.rows();
                of_structures
                    .cloned()
                    .chain(of_measurements.cloned())
                    .collect()
            },
            lenient: self.options.lenient,
            compilations: self.options.compilations.max(1),
        };
        self.recorder.write(&Line::about_all(Body::Run(record)))?;
        for skipped in &self.plan.skipped {
            self.write_skipped(skipped)?;
        }
        Ok(())
    }

    pub(super) fn write_skipped(&mut self, skipped: &Skipped) -> Result<(), RunError> {
        self.ledger.skipped += skipped.cells;
        let body = Body::Skipped(told(&skipped.cell, &skipped.reason));
        self.recorder.write(&Line::about_all(body))
    }

    /// Records a cell that needs longer loops than the driver supports.
    pub(super) fn write_refused(&mut self, cell: String, reason: String) -> Result<(), RunError> {
        self.ledger.refused.insert(cell.clone(), reason.clone());
        self.ledger.skipped += 1;
        let hash = self.write_left_out(&cell, &reason)?;
        self.close(&cell, (Outcome::LeftOut, &reason), vec![hash], &[])
    }

    /// Records why something was left out; the hash of the line.
    fn write_left_out(&self, cell: &str, reason: &str) -> Result<String, RunError> {
        let hash = cell_hash(&[("left out", cell), ("reason", reason)]);
        let body = Body::Skipped(told(cell, reason));
        self.recorder.write(&Line::about_all(body).hashed(&hash))?;
        Ok(hash)
    }

    /// Writes the last record, moves the results to their folder, and reports it.
    pub(super) fn write_end(&mut self) -> Result<PathBuf, RunError> {
        let whole = self.clock.start.elapsed();
        let wall_s = whole.wall_ms * 1e-3;
        let parts_s = self.clock.parts_s.clone();
        let overhead_s = (wall_s - parts_s.values().sum::<f64>()).max(0.0);
        let record = FinishedRecord {
            wall_s,
            parts_s,
            overhead_s,
            cpu: whole.cpu_ms.map(|ms| CpuTime {
                whole_s: ms * 1e-3,
                overhead_s: (ms - self.clock.parts_cpu_ms).max(0.0) * 1e-3,
            }),
            failed: self.ledger.failed,
            skipped: self.ledger.skipped,
            load: machine_load(),
        };
        self.progress.bar.finish_and_clear();
        self.recorder
            .write(&Line::about_all(Body::Finished(record)))?;
        let out = self.recorder.finish()?;
        Ok(out.unwrap_or_else(|| self.options.out.clone()))
    }

    /// Timed are the first samples of the set whose error is measured last: how near the rays of
    /// neighbouring pixels lie may depend on how many there are. So many are in that set.
    pub(super) fn timed_samples(&self) -> u32 {
        let experiment = self.experiment;
        experiment.run.spp.max().max(experiment.timing.spp)
    }

    /// Ends the run here if interrupted.
    pub(super) fn go_on(&self) -> Result<(), RunError> {
        if self.options.interrupt.is_asked() {
            Err(RunError::Interrupted)
        } else {
            Ok(())
        }
    }

    /// Records a cell that failed without a record of its own kind.
    pub(super) fn write_failure(&mut self, cell: &str, reason: String) -> Result<(), RunError> {
        self.ledger.failed += 1;
        let hash = failure_hash(cell, &reason);
        let body = Body::Failed(told(cell, &reason));
        self.recorder.write(&Line::about_all(body).hashed(&hash))?;
        self.close(cell, (Outcome::Failed, &reason), vec![hash], &[])
    }

    /// Shows progress above the bar, or as a line.
    pub(super) fn tell_progress(&self, text: &str) {
        self.recorder.log(text);
        if let Some(tell) = self.options.tell {
            self.progress.bar.suspend(|| tell(text));
        }
    }

    pub(super) fn say(&self, message: impl Into<String>) {
        let message = message.into();
        self.recorder.log(&message);
        self.progress.say(message);
    }

    /// Writes a picture of this kind, named by the labels; returns its path relative to the run's
    /// folder. A write error is a warning and affects no figure.
    pub(super) fn picture(
        &self,
        kind: &str,
        labels: &[String],
        picture: &Picture,
    ) -> Result<Option<String>, RunError> {
        self.image_file(kind, labels, "png", |path| write_png(path, picture))
    }

    /// Writes the linear radiance of a picture that the report compares pixel by pixel: in the
    /// requested format, else as EXR if small.
    pub(super) fn compared(
        &self,
        kind: &str,
        labels: &[String],
        image: &Image,
        attributes: &[Attribute],
    ) -> Result<(), RunError> {
        let is_small = image.pixels.len() <= MOST_KEPT_PIXELS;
        let exr = || {
            FileFormat::of(Path::new("kept.exr"))
                .ok()
                .filter(|_| is_small)
        };
        let format = self.options.images.or_else(exr);
        self.radiance(format, kind, labels, image, attributes)
    }

    /// Writes linear radiance next to the pictures, if requested.
    pub(super) fn linear(
        &self,
        kind: &str,
        labels: &[String],
        image: &Image,
        attributes: &[Attribute],
    ) -> Result<(), RunError> {
        self.radiance(self.options.images, kind, labels, image, attributes)
    }

    fn radiance(
        &self,
        format: Option<&FileFormat>,
        kind: &str,
        labels: &[String],
        image: &Image,
        attributes: &[Attribute],
    ) -> Result<(), RunError> {
        let Some(format) = format else {
            return Ok(());
        };
        let write = |path: &Path| format.write(path, image, attributes);
        self.image_file(kind, labels, format.ending, write)?;
        Ok(())
    }

    fn image_file(
        &self,
        kind: &str,
        labels: &[String],
        ending: &str,
        write: impl Fn(&Path) -> Result<(), ImageError>,
    ) -> Result<Option<String>, RunError> {
        let labels = labels.iter().map(String::as_str);
        let parts: Vec<&str> = std::iter::once(kind).chain(labels).collect();
        let written = self.recorder.image(&parts, ending, write);
        match written {
            Err(error @ ImageError::Altered { .. }) => Err(RunError::Wrong(error.to_string())),
            Err(error) => {
                self.warn(&parts.join(", "), error.to_string())?;
                Ok(None)
            }
            Ok(path) => Ok(path),
        }
    }
}

fn told(cell: &str, reason: &str) -> SkippedRecord {
    SkippedRecord {
        cell: cell.to_owned(),
        reason: reason.to_owned(),
    }
}

/// Hash of the lines that explain a cell's failure.
pub(super) fn failure_hash(cell: &str, reason: &str) -> String {
    cell_hash(&[("failed", cell), ("reason", reason)])
}
