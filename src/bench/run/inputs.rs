//! Inputs of a cell's figures, and validity of an earlier run's figures.

use super::kernels::Kernels;
use super::reference_file::ReferenceFile;
use super::registries::Registries;
use super::units::Unit;
use raystone_config::{Axis, Experiment};
use raystone_core::store;
use raystone_core::text::cell_hash;
use raystone_record::Environment;
use raystone_record::{CellRecord, Inputs, KernelSetRecord, Key};
use std::collections::{BTreeMap, HashMap};
use std::sync::OnceLock;

/// Stored hash digits.
const DIGITS: usize = 16;

fn short(parts: &[(&str, &str)]) -> String {
    cell_hash(parts)[..DIGITS].to_owned()
}

/// Identity of the sources that figures depend on: the hash noted by the build, plus, for programs
/// that use the library with their own registries, the bytes of the program.
pub(super) fn program() -> &'static str {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        let own = env!("RAYSTONE_HOST");
        let is_own = std::env::current_exe().is_ok_and(|path| {
            let stem = path.file_stem();
            stem.is_some_and(|stem| stem == "raystone")
        });
        match store::program().filter(|_| !is_own) {
            Some(bytes) => short(&[("host", own), ("program", bytes)]),
            None => own.to_owned(),
        }
    })
}

/// Where clocks were read; figures from different places must not be compared.
pub fn place(environment: &Environment) -> String {
    let e = environment;
    format!(
        "{} ({} {}, {}), {} × {}, {}",
        e.adapter, e.driver, e.driver_info, e.backend, e.cpu_threads, e.cpu, e.os
    )
}

/// Current inputs of a run's cells.
pub(super) struct Current<'a> {
    /// Name of a measurement → the settings that it depends on.
    pub settings: BTreeMap<&'static str, String>,
    kernels: &'a Kernels,
    /// Label of a scene → hash of its content, or why it has none.
    pub scenes: HashMap<String, Result<String, String>>,
    /// Where clocks are read; unknown before a device is open.
    pub device: Option<String>,
}

impl<'a> Current<'a> {
    /// Inputs of an experiment with these kernels; `reference_file` is the hash of that image.
    pub(super) fn new(
        experiment: &Experiment,
        reference_file: Option<&ReferenceFile>,
        registries: &Registries,
        kernels: &'a Kernels,
    ) -> Self {
        let measurements = registries.measurements.iter();
        let reference_file = reference_file.map_or("", |file| &file.hash);
        // Sections added by others may matter to any measurement.
        let further = if experiment.further.is_empty() {
            String::new()
        } else {
            format!("{:?}", experiment.further)
        };
        let settings = measurements.map(|m| {
            let own = m.settings(experiment, reference_file);
            (m.name(), own + &further)
        });
        Self {
            settings: settings.collect(),
            kernels,
            scenes: HashMap::new(),
            device: None,
        }
    }

    /// Hash of a unit's parameters and relevant settings.
    pub(super) fn settings_of(&self, unit: &Unit) -> String {
        let key = serde_json::to_string(&Key::from(&unit.cell)).unwrap_or_default();
        let settings = self.settings.get(unit.kind()).map_or("", String::as_str);
        short(&[("kind", unit.kind()), ("key", &key), ("settings", settings)])
    }

    /// Inputs of a unit that are known before measuring.
    pub(super) fn inputs(&self, unit: &Unit) -> Inputs {
        let scene = unit.cell.get(Axis::Scene);
        let scene = scene.and_then(|scene| self.scenes.get(&scene.label)?.clone().ok());
        Inputs {
            program: program().to_owned(),
            settings: self.settings_of(unit),
            scene: scene.unwrap_or_default(),
            kernels: String::new(),
            device: if unit.measurement.is_timed() {
                self.device.clone().unwrap_or_default()
            } else {
                String::new()
            },
        }
    }

    /// Change in each set of kernel modules, by id; `None` if there is none.
    pub(super) fn changed<'s>(
        &self,
        sets: &HashMap<&'s str, &KernelSetRecord>,
    ) -> HashMap<&'s str, Option<String>> {
        let sets = sets.iter();
        sets.map(|(id, set)| (*id, self.kernels.changed(set)))
            .collect()
    }

    /// Why a unit's record is no longer valid; `None` if it is. `sets`: see [`Self::changed`].
    pub(super) fn stale(
        &self,
        unit: &Unit,
        record: &CellRecord,
        sets: &HashMap<&str, Option<String>>,
    ) -> Option<String> {
        let was = &record.inputs;
        if was.program != program() {
            return Some("another program measured it".to_owned());
        }
        if was.settings != self.settings_of(unit) {
            return Some("its parameters or the settings that it depends on changed".to_owned());
        }
        let scene = unit.cell.get(Axis::Scene);
        let scene = scene.and_then(|scene| self.scenes.get(&scene.label));
        match scene {
            Some(Ok(hash)) if *hash != was.scene => return Some("its scene changed".to_owned()),
            Some(Err(reason)) => return Some(format!("its scene cannot be loaded: {reason}")),
            _ => {}
        }
        let device = self.device.as_ref().filter(|_| unit.measurement.is_timed());
        if let Some(device) = device.filter(|device| **device != was.device) {
            let before = &was.device;
            return Some(format!("it was timed on {before}, and this is {device}"));
        }
        if was.kernels.is_empty() {
            return None;
        }
        match sets.get(was.kernels.as_str()) {
            Some(changed) => changed.clone(),
            None => Some("what its kernels were made of is not recorded".to_owned()),
        }
    }
}

/// Provenance of a measurement: its inputs, and the modules of its kernels if recorded.
pub(super) type MadeOf<'a> = (&'a Inputs, Option<&'a KernelSetRecord>);

/// The first difference in provenance that two measurements of one cell must not have. If errors
/// are rendered through the fastest structure, machines may choose different ones: only modules
/// used by both have to be equal.
pub(super) fn differing((a, set_a): MadeOf, (b, set_b): MadeOf) -> Option<&'static str> {
    let other_kernels = match (set_a, set_b) {
        (Some(a), Some(b)) => {
            let mut both =
                (a.modules.iter()).filter_map(|(name, hash)| Some((hash, b.modules.get(name)?)));
            a.kernels != b.kernels || both.any(|(a, b)| a != b)
        }
        _ => a.kernels != b.kernels,
    };
    let differs = [
        ("the program", a.program != b.program),
        ("the settings", a.settings != b.settings),
        ("the scene", a.scene != b.scene),
        ("the kernels", other_kernels),
    ];
    differs
        .into_iter()
        .find(|(_, differs)| *differs)
        .map(|(what, _)| what)
}

/// Record of a set of kernel modules.
pub(super) fn kernel_set(kernels: &str, modules: BTreeMap<String, String>) -> KernelSetRecord {
    let mut parts = vec![("kernels", kernels)];
    parts.extend(
        modules
            .iter()
            .map(|(name, hash)| (name.as_str(), hash.as_str())),
    );
    KernelSetRecord {
        id: short(&parts),
        kernels: kernels.to_owned(),
        modules,
    }
}
