//! What a run writes: lines, the log, images, and of which kernels and inputs each cell was made.

use super::error::RunError;
use super::folder::Folder;
use super::inputs::{Current, kernel_set};
use super::options::RunOptions;
use super::promised::Promised;
use super::resume::Earlier;
use super::units::Unit;
use raystone_config::Axis;
use raystone_core::params::Variant;
use raystone_gpu::Gpu;
use raystone_image::ImageError;
use raystone_record::{
    Body, CellRecord, KernelSetRecord, Line, Sound, contradiction, fault_of, text_of,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The records of a run on their way to its folder.
#[derive(Default)]
pub(super) struct Recorder<'a> {
    /// `None`: nothing is written (gate alone, single images).
    folder: Option<Arc<Folder>>,
    /// What cells depend on.
    pub current: Option<Current<'a>>,
    /// What the experiment asks for.
    pub promised: Option<RefCell<Promised>>,
    /// Modules of kernels that were used for a unit, or for something that several share.
    used: BTreeMap<String, BTreeMap<String, String>>,
    /// Kernel sets that are recorded.
    sets: HashSet<String>,
    /// The device that kernels run on.
    gpu: Option<Gpu>,
}

impl<'a> Recorder<'a> {
    /// Opens the folder of the options for writing.
    pub(super) fn open(options: &RunOptions) -> Result<Self, RunError> {
        let folder = Arc::new(Folder::open(&options.out, options.existing, options.wait)?);
        options.interrupt.begin(&folder);
        Ok(Self {
            folder: Some(folder),
            ..Self::default()
        })
    }

    /// The lines of the run that is resumed.
    pub(super) fn take_earlier(&self) -> Earlier {
        let lines = self.folder.as_ref().map(|folder| folder.take_earlier());
        Earlier::new(lines.unwrap_or_default())
    }

    /// Leaves the folder as it was.
    pub(super) fn abandon(&self) {
        if let Some(folder) = &self.folder {
            folder.abandon();
        }
    }

    /// Puts the results in their place, and tells where that is; `None` if nothing is written.
    pub(super) fn finish(&self) -> Result<Option<PathBuf>, RunError> {
        let Some(folder) = &self.folder else {
            return Ok(None);
        };
        folder.finish()?;
        Ok(Some(folder.out().to_owned()))
    }

    /// The content of a scene that was loaded.
    pub(super) fn note_scene(&mut self, scene: &Variant, hash: &str) {
        if let Some(current) = &mut self.current {
            let hash = Ok(hash.to_owned());
            current.scenes.insert(scene.label.clone(), hash);
        }
    }

    /// Kernels run on this device from now on.
    pub(super) fn use_device(&mut self, gpu: &Gpu) {
        self.gpu = Some(gpu.clone());
    }

    /// Counts the kernels that were asked for since the last call as used for this: a unit, or something that several share.
    pub(super) fn note_kernels(&mut self, used_for: &str) {
        let modules = self.gpu.as_ref().map(Gpu::take_modules).unwrap_or_default();
        if !modules.is_empty() {
            let used = self.used.entry(used_for.to_owned()).or_default();
            used.extend(modules);
        }
    }

    /// Takes over lines of an earlier run.
    pub(super) fn take_over(&mut self, lines: &[Line]) -> Result<(), RunError> {
        for line in lines {
            if let Body::Kernels(set) = &line.body {
                self.sets.insert(set.id.clone());
            }
        }
        let text = text_of(lines).map_err(unwritable)?;
        match &self.folder {
            Some(folder) if !text.is_empty() => folder.append(&text),
            _ => Ok(()),
        }
    }

    /// Appends one record as one whole line and flushes it to the disk. One that contradicts itself or the experiment ends the
    /// run.
    pub(super) fn write(&self, line: &Line) -> Result<(), RunError> {
        let Some(folder) = &self.folder else {
            return Ok(());
        };
        let promised = self.promised.iter();
        let other = promised.filter_map(|promised| promised.borrow_mut().fault(line));
        let own = line.body.fault().or_else(|| contradiction(&line.body));
        let own = own.or_else(|| fault_of(&line.readings));
        if let Some(fault) = other.chain(own).next() {
            return Err(RunError::Wrong(format!(
                "a record is wrong: {fault}; this program measures or writes otherwise than it should: report this"
            )));
        }
        let mut text = serde_json::to_string(line).map_err(unwritable)?;
        text.push('\n');
        folder.append(&text)
    }

    /// Writes how a unit ended, with what it depends on: its own kernels and those that were noted for `shared`, which are
    /// recorded once. Nothing where inputs are unknown, since nothing is recorded then.
    pub(super) fn write_cell(
        &mut self,
        unit: &Unit,
        mut record: CellRecord,
        shared: &[&str],
    ) -> Result<(), RunError> {
        let Some(current) = &self.current else {
            return Ok(());
        };
        record.inputs = current.inputs(unit);
        let mut modules = self.used.remove(&unit.name).unwrap_or_default();
        for other in shared.iter().filter_map(|name| self.used.get(*name)) {
            modules.extend(other.clone());
        }
        if !modules.is_empty() {
            let kernels = &unit.cell[Axis::Kernels];
            let label = if kernels.name.is_empty() {
                ""
            } else {
                &kernels.label
            };
            let set: KernelSetRecord = kernel_set(label, modules);
            record.inputs.kernels.clone_from(&set.id);
            if self.sets.insert(set.id.clone()) {
                self.write(&Line::about_all(Body::Kernels(set)))?;
            }
        }
        self.write(&Line::about_all(Body::Cell(record)))
    }

    /// Writes a line to the log of the run. A log that cannot be written is no reason to end.
    pub(super) fn log(&self, text: &str) {
        if let Some(folder) = &self.folder {
            folder.log(text);
        }
    }

    /// Writes an image of what the parts name: its path relative to the run's folder; `None` if nothing is written.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn image(
        &self,
        parts: &[&str],
        ending: &str,
        write: impl Fn(&Path) -> Result<(), ImageError>,
    ) -> Result<Option<String>, ImageError> {
        let Some(folder) = &self.folder else {
            return Ok(None);
        };
        let (relative, path) = folder.image(parts, ending);
        write(&path)?;
        Ok(Some(relative))
    }
}

fn unwritable(error: serde_json::Error) -> RunError {
    RunError::Input(format!("a record cannot be written: {error}"))
}
