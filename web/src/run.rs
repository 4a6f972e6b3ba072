//! A measurement from its first record to its last.

use crate::PROGRAM;
use crate::host::{Host, no_device};
use crate::plan::{FILE, plan};
use crate::world::{Outcome, World};
use raystone_bench::run::Registries;
use raystone_config::{Axis, Cell, Experiment, Plan};
use raystone_core::clock::Instant;
use raystone_core::text::cell_hash;
use raystone_gpu::{
    ArithmeticProbe, Gpu, GpuError, device_type, limits_of_runs, probe_arithmetic_async,
    probe_clock_step,
};
use raystone_record::{
    Body, CellRecord, Environment, FinishedRecord, Inputs, Line, Outcome as CellOutcome, RunRecord,
    SkippedRecord,
};
use std::cell::Cell as Shared;
use std::collections::BTreeMap;

/// Rounds, gate and building of a structure in units of progress; a scene costs `SCENE` beside.
const SCENE: f64 = 4.0;
const STRUCTURE: f64 = 3.0;

/// A measurement under way.
pub(crate) struct Run<'a, H: Host> {
    pub host: &'a H,
    pub registries: &'a Registries,
    pub experiment: &'a Experiment,
    began_unix_s: u64,
    done: Shared<f64>,
    whole: f64,
    failed: Shared<usize>,
    skipped: Shared<usize>,
}

/// A device with what was found out about it.
pub(crate) struct Device {
    pub gpu: Gpu,
    pub probe: ArithmeticProbe,
    clock_step_ns: Option<u64>,
}

impl Device {
    async fn open(host: &impl Host, registries: &Registries) -> Result<Self, GpuError> {
        let gpu = host.open(registries.library()).await?;
        Ok(Self {
            probe: probe_arithmetic_async(&gpu).await?,
            clock_step_ns: probe_clock_step(&gpu).await?,
            gpu,
        })
    }
}

/// Measures the experiment with `overrides`, as far as `only` says.
///
/// # Errors
/// An override or filter is wrong, or there is no device.
pub async fn run(host: &impl Host, overrides: &[String], only: &[String]) -> Result<(), String> {
    let registries = Registries::default();
    let (experiment, plan) = plan(&registries, overrides, only)?;
    let start = Instant::now();
    let mut device = Device::open(host, &registries)
        .await
        .map_err(|error| no_device(&error))?;
    let run = Run {
        host,
        registries: &registries,
        experiment: &experiment,
        began_unix_s: Instant::unix_s(),
        done: Shared::new(0.0),
        whole: plan.scenes.len() as f64 * SCENE + plan.structures.len() as f64 * STRUCTURE,
        failed: Shared::new(0),
        skipped: Shared::new(0),
    };
    run.write_start(&plan, &device);
    for scene in &plan.scenes {
        for world in plan.worlds(scene) {
            let cells = plan.structures.iter().filter(|cell| cell.is_on(&world));
            let mut cells: Vec<Cell> = cells.cloned().collect();
            // A structure under which the device is lost fails; another device goes on with the others.
            while let Some(lost) = run.world(&device, &world, &mut cells).await {
                run.host.say(
                    &format!("the device was lost ({lost}); opening another"),
                    run.share(),
                );
                device = Device::open(host, &registries)
                    .await
                    .map_err(|error| no_device(&error))?;
            }
        }
    }
    let wall_s = start.elapsed().as_secs_f64();
    host.write(&Line::about_all(Body::Finished(FinishedRecord {
        wall_s,
        parts_s: BTreeMap::new(),
        overhead_s: 0.0,
        cpu: None,
        failed: run.failed.get(),
        skipped: run.skipped.get(),
        load: Default::default(),
    })));
    host.say("done", 1.0);
    Ok(())
}

impl<H: Host> Run<'_, H> {
    /// Measures the cells of a world. Returns why, if the device was lost; `cells` are then those that are left.
    async fn world(&self, device: &Device, cell: &Cell, cells: &mut Vec<Cell>) -> Option<String> {
        if cells.is_empty() {
            return None;
        }
        let world = match World::new(self, device, cell).await {
            Ok(world) => world,
            Err(reason) => {
                self.fail_all(std::mem::take(cells), &reason);
                return device.gpu.lost();
            }
        };
        self.step("", SCENE);
        match world.measure(self, cells).await {
            Outcome::Done => {
                cells.clear();
                None
            }
            Outcome::Lost { at, cause } => {
                let lost = cells.remove(at);
                self.fail_all(vec![lost], &cause);
                Some(cause)
            }
        }
    }

    fn fail_all(&self, cells: Vec<Cell>, reason: &str) {
        for cell in cells {
            let (name, reason) = (cell.to_string(), reason.to_owned());
            let hash = cell_hash(&[("failed", &name), ("reason", &reason)]);
            let told = SkippedRecord {
                cell: name.clone(),
                reason: reason.clone(),
            };
            self.host
                .write(&Line::about_all(Body::Failed(told)).hashed(&hash));
            self.close(&name, CellOutcome::Failed, reason, hash);
            self.step("", STRUCTURE);
        }
    }

    /// Says that a cell is done, failed or left out.
    pub(crate) fn close(&self, unit: &str, outcome: CellOutcome, reason: String, hash: String) {
        let count = match outcome {
            CellOutcome::Done => None,
            CellOutcome::Failed => Some(&self.failed),
            CellOutcome::LeftOut => Some(&self.skipped),
        };
        count.inspect(|count| count.set(count.get() + 1));
        self.host.write(&Line::about_all(Body::Cell(CellRecord {
            unit: unit.to_owned(),
            outcome,
            reason,
            run_began_unix_s: self.began_unix_s,
            inputs: Inputs::default(),
            lines: vec![hash],
        })));
    }

    /// Says what is being done, after work of this many units.
    pub(crate) fn step(&self, what: &str, units: f64) {
        self.done.set(self.done.get() + units);
        if !what.is_empty() {
            self.host.say(what, self.share());
        }
    }

    /// Units of a structure, of which building and gating it is the first third.
    pub(crate) const STRUCTURE: f64 = STRUCTURE;

    fn share(&self) -> f64 {
        (self.done.get() / self.whole).min(0.999)
    }

    fn write_start(&self, plan: &Plan, device: &Device) {
        let experiment = self.experiment;
        let record = RunRecord {
            name: experiment.name.clone(),
            experiment: FILE.to_owned(),
            experiment_text: experiment.text.clone(),
            started_unix_s: self.began_unix_s,
            environment: self.environment(device),
            renders_full_product: plan.renders_full_product(),
            renders_planned: plan.renders_planned(),
            kernels: Vec::new(),
            overrides: experiment.overrides.clone(),
            only: plan.only.clone(),
            shard: None,
            figures: Vec::new(),
            lenient: false,
            compilations: 1,
        };
        self.host.write(&Line::about_all(Body::Run(record)));
        for skipped in &plan.skipped {
            self.skipped.set(self.skipped.get() + skipped.cells);
            let told = SkippedRecord {
                cell: skipped.cell.clone(),
                reason: skipped.reason.clone(),
            };
            self.host.write(&Line::about_all(Body::Skipped(told)));
        }
    }

    fn environment(&self, device: &Device) -> Environment {
        let (gpu, program) = (&device.gpu, PROGRAM);
        Environment {
            adapter: gpu.info.name.clone(),
            backend: gpu.info.backend.to_str().to_owned(),
            driver: gpu.info.driver.clone(),
            driver_info: gpu.info.driver_info.clone(),
            device_type: device_type(gpu.info.device_type).to_owned(),
            software: gpu.is_software(),
            timestamps: gpu.has_clock(),
            loop_limit: gpu.loop_limit,
            denormals: Some(device.probe.denormals),
            os: std::env::consts::OS.to_owned(),
            cpu: std::env::consts::ARCH.to_owned(),
            cpu_threads: 1,
            version: program.version.to_owned(),
            commit: program.commit.map(str::to_owned),
            dirty: program.dirty,
            subgroup: (gpu.info.subgroup_max_size > 0)
                .then_some([gpu.info.subgroup_min_size, gpu.info.subgroup_max_size]),
            limits: limits_of_runs(&gpu.limits),
            browser: self.host.browser(),
            clock_step_ns: device.clock_step_ns,
            ..Environment::default()
        }
    }
}

/// Name of a scene in messages.
pub(crate) fn name_of(cell: &Cell) -> String {
    cell[Axis::Scene].label.clone()
}
