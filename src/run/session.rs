//! What lives as long as a run: records, clock, progress, cells already done.

use super::folder::Folder;
use super::reference_file::ReferenceFile;
use super::{RunError, RunOptions};
use crate::config::{Axis, Experiment, Plan, REFERENCE_PARTS, Skipped};
use crate::gpu::Environment;
use crate::gpu::Gpu;
use crate::image::{Attribute, FileFormat, Image, ImageError, Picture, write_png};
use crate::measure::record::{
    Body, FinishedRecord, KernelFolder, Line, RunRecord, SkippedRecord, axis,
};
use crate::text::cell_hash;
use indicatif::{ProgressBar, ProgressStyle};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Instant, SystemTime};

/// Pixels of images whose linear radiance is kept unasked: 1.5 MiB each.
const MOST_KEPT_PIXELS: usize = 1 << 17;

/// Where the wall time goes; what no part claims is the harness's own overhead.
pub(super) struct Clock {
    start: Instant,
    parts_s: BTreeMap<String, f64>,
}

impl Clock {
    fn new() -> Self {
        Self {
            start: Instant::now(),
            parts_s: BTreeMap::new(),
        }
    }

    /// Runs `work` and books its time under `part`.
    pub fn time<T>(&mut self, part: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        *self.parts_s.entry(part.to_owned()).or_default() += start.elapsed().as_secs_f64();
        result
    }
}

/// The state of a run.
pub(super) struct Session<'a> {
    pub experiment: &'a Experiment,
    pub plan: &'a Plan,
    pub registries: &'a super::Registries,
    pub options: &'a RunOptions,
    pub clock: Clock,
    pub progress: ProgressBar,
    pub failed: usize,
    pub skipped: usize,
    /// Whether a scene could not be loaded.
    pub bad_input: bool,
    /// The gate's second scene.
    pub trial: super::trial::Trial,
    /// Cells that need longer loops than the driver runs, with the reason.
    pub refused: BTreeMap<String, String>,
    /// Cells that have their record: not run again after a lost device.
    done: HashSet<String>,
    /// Samplers whose words were compared with the twin's.
    pub compared: HashSet<String>,
    /// What images are compared with, if it is not rendered.
    pub reference_file: Option<ReferenceFile>,
    /// What is wrong with the integrators that were judged.
    pub judged: BTreeMap<String, Option<String>>,
    /// Whether they are judged on all trial scenes, and not on those alone that are of a scene.
    pub judges_trials: bool,
    /// `None`: nothing is written (gate alone, single images).
    folder: Option<Arc<Folder>>,
}

impl<'a> Session<'a> {
    /// Opens the folder for writing; fails before anything is measured if it cannot be written.
    pub fn new(
        experiment: &'a Experiment,
        plan: &'a Plan,
        registries: &'a super::Registries,
        options: &'a RunOptions,
    ) -> Result<Self, RunError> {
        let reference_file = ReferenceFile::load(experiment)?;
        let folder = Arc::new(Folder::open(&options.out, options.existing)?);
        options.interrupt.begin(&folder);
        let mut session = Self::unrecorded(experiment, plan, registries, options);
        session.folder = Some(folder);
        session.reference_file = reference_file;
        Ok(session)
    }

    /// A session that writes nothing.
    pub fn unrecorded(
        experiment: &'a Experiment,
        plan: &'a Plan,
        registries: &'a super::Registries,
        options: &'a RunOptions,
    ) -> Self {
        let progress = if options.progress {
            ProgressBar::new(steps(experiment, plan))
        } else {
            ProgressBar::hidden()
        };
        let style = ProgressStyle::with_template(
            "{bar:32} {pos}/{len} · {elapsed} · about {eta} left · {wide_msg}",
        );
        progress.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Self {
            experiment,
            plan,
            registries,
            options,
            clock: Clock::new(),
            progress,
            failed: 0,
            skipped: 0,
            bad_input: false,
            trial: Default::default(),
            refused: BTreeMap::new(),
            done: HashSet::new(),
            compared: HashSet::new(),
            reference_file: None,
            judged: BTreeMap::new(),
            judges_trials: false,
            folder: None,
        }
    }

    /// Destroys the device if a test asked for it at this cell.
    pub fn lose_device_on_request(&self, gpu: &Gpu, cell: &str) {
        if self.options.lose_device_at.as_deref() == Some(cell) {
            gpu.device.destroy();
        }
    }

    /// Appends one record as one whole line and flushes it to the disk.
    pub fn write(&self, line: &Line) -> Result<(), RunError> {
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        let mut text = serde_json::to_string(line)
            .map_err(|e| RunError::Input(format!("a record cannot be written: {e}")))?;
        text.push('\n');
        folder.append(&text)
    }

    /// Tells what went wrong beside the measuring: now, and in the report.
    pub fn warn(&self, about: &str, reason: String) -> Result<(), RunError> {
        self.tell_warning(&format!("{about}: {reason}"));
        let cell = about.to_owned();
        self.write(&Line::about_all(Body::Warning(SkippedRecord {
            cell,
            reason,
        })))
    }

    /// Hands a warning on, above the progress bar.
    pub fn tell_warning(&self, text: &str) {
        if let Some(tell) = self.options.warn {
            self.progress.suspend(|| tell(text));
        }
    }

    /// The first record.
    pub fn write_start(
        &mut self,
        environment: Environment,
        kernels: Vec<KernelFolder>,
    ) -> Result<(), RunError> {
        let seconds = SystemTime::now()
            .duration_since(SystemTime::UNIX_EPOCH)
            .map_or(0, |d| d.as_secs());
        let record = RunRecord {
            name: self.experiment.name.clone(),
            experiment: self.experiment.source.clone(),
            experiment_text: self.experiment.text.clone(),
            started_unix_s: seconds,
            environment,
            renders_full_product: self.plan.renders_full_product(),
            renders_planned: self.plan.renders_planned(),
            kernels,
            figures: self.registries.figures.rows().cloned().collect(),
            lenient: self.options.lenient,
        };
        self.write(&Line::about_all(Body::Run(record)))?;
        for skipped in &self.plan.skipped {
            self.write_skipped(skipped)?;
        }
        Ok(())
    }

    /// Records cells that are left out.
    pub fn write_skipped(&mut self, skipped: &Skipped) -> Result<(), RunError> {
        self.skipped += skipped.cells;
        let record = SkippedRecord {
            cell: skipped.cell.clone(),
            reason: skipped.reason.clone(),
        };
        self.write(&Line::about_all(Body::Skipped(record)))
    }

    /// Records a cell that needs longer loops than the driver runs.
    pub fn write_refused(&mut self, cell: String, reason: String) -> Result<(), RunError> {
        self.finish(cell.clone());
        self.refused.insert(cell.clone(), reason.clone());
        self.write_skipped(&Skipped {
            cell,
            reason,
            cells: 1,
        })
    }

    /// The last record; puts the results in their place, and tells where that is.
    pub fn write_end(&mut self) -> Result<PathBuf, RunError> {
        let wall_s = self.clock.start.elapsed().as_secs_f64();
        let parts_s = self.clock.parts_s.clone();
        let overhead_s = (wall_s - parts_s.values().sum::<f64>()).max(0.0);
        let record = FinishedRecord {
            wall_s,
            parts_s,
            overhead_s,
            failed: self.failed,
            skipped: self.skipped,
        };
        self.progress.finish_and_clear();
        self.write(&Line::about_all(Body::Finished(record)))?;
        let Some(folder) = &self.folder else {
            return Ok(self.options.out.clone());
        };
        folder.finish()?;
        Ok(folder.out().to_owned())
    }

    /// Whether a cell has its record.
    pub fn is_done(&self, cell: &str) -> bool {
        self.done.contains(cell)
    }

    /// Notes that a cell has its record.
    pub fn finish(&mut self, cell: String) {
        self.done.insert(cell);
    }

    /// Records a cell that failed without a record of its own kind.
    pub fn write_failure(&mut self, cell: &str, reason: String) -> Result<(), RunError> {
        self.failed += 1;
        self.finish(cell.to_owned());
        let cell = cell.to_owned();
        self.write(&Line::about_all(Body::Failed(SkippedRecord {
            cell,
            reason,
        })))
    }

    /// Shows what is being done.
    pub fn say(&self, message: impl Into<String>) {
        self.progress.set_message(message.into());
    }

    /// Writes a picture of this kind, of what the labels name: its path relative to the run's folder. One that
    /// cannot be written is a warning, and costs no figure.
    pub fn picture(
        &self,
        kind: &str,
        labels: &[String],
        picture: &Picture,
    ) -> Result<Option<String>, RunError> {
        self.image_file(kind, labels, "png", |path| write_png(path, picture))
    }

    /// Writes the linear radiance of a picture that the report compares pixel by pixel: in the format that the run was
    /// asked for, else as EXR if it is small.
    pub fn compared(
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
        let Some(format) = self.options.images.or_else(exr) else {
            return Ok(());
        };
        let write = |path: &Path| format.write(path, image, attributes);
        self.image_file(kind, labels, format.ending, write)?;
        Ok(())
    }

    /// Writes linear radiance beside the pictures, if the run was asked for it.
    pub fn linear(
        &self,
        kind: &str,
        labels: &[String],
        image: &Image,
        attributes: &[Attribute],
    ) -> Result<(), RunError> {
        let Some(format) = self.options.images else {
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
        let Some(folder) = &self.folder else {
            return Ok(None);
        };
        let (relative, path) = folder.image(&parts, ending);
        match write(&path) {
            Ok(()) => Ok(Some(relative)),
            Err(error) => {
                self.warn(&parts.join(", "), error.to_string())?;
                Ok(None)
            }
        }
    }
}

/// Progress steps that loading and judging a scene count for: as long as so many timed rounds, roughly.
pub(super) const SCENE_STEPS: u64 = 20;

/// Rough number of progress steps: scenes, builds and gates, compiled and timed cells, renders, streams.
fn steps(experiment: &Experiment, plan: &Plan) -> u64 {
    let rounds = u64::from(experiment.timing.rounds) + 1;
    let structures = plan.structures.len() as u64 * (2 + 5 * rounds);
    let times = (plan.times.len() + plan.compactions.len()) as u64 * (1 + rounds);
    let worlds: usize = plan.scenes.iter().map(|s| plan.worlds(s).len()).sum();
    let scenes = worlds as u64 * SCENE_STEPS;
    let references = worlds * experiment.axes[Axis::Integrator].len() * REFERENCE_PARTS as usize;
    scenes + structures + times + (plan.renders_planned() + references + plan.streams.len()) as u64
}

/// Content hash of the cell of a line: its key, the bytes of its scene, the kernels that ran, and what else
/// its figures depend on.
pub(super) fn content_hash<B>(line: &Line<B>, scene_hash: &str, also: &[(&str, &str)]) -> String {
    // A scene is known by its bytes, wherever it lies.
    let key = line.key.clone().with(axis::SCENE, "");
    let key = serde_json::to_string(&key).unwrap_or_default();
    let parts = [
        ("key", key.as_str()),
        ("scene", scene_hash),
        ("kernel", &line.ran.kernel_hash),
        ("version", env!("CARGO_PKG_VERSION")),
    ];
    cell_hash(&[&parts, also].concat())
}
