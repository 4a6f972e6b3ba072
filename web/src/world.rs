//! A scene with its structures: built, gated against the reference tracer, then timed together.

use crate::host::Host;
use crate::rounds::{Timed, order};
use crate::run::{Device, Run, name_of};
use raystone_accel::tracer::{count_work_async, kernel_hash};
use raystone_accel::{Ask, BuildLog, Traced, Tracer, TriangleBuffers, TriangleSoup};
use raystone_config::{Axis, Cell};
use raystone_core::clock::Instant;
use raystone_core::random::Pcg32;
use raystone_gpu::{GpuError, slow_slice};
use raystone_record::{
    Body, CountersPerRay, Key, Line, Outcome as CellOutcome, Ran, SkippedRecord, StructureRecord,
    fault_text,
};
use raystone_scene::{LoadOptions, SceneData};
use raystone_verify::gate::{Checks, ReferenceTracer, gate_async, timed_fault_async};
use raystone_verify::scene_record::scene_record;
use raystone_verify::self_test::unseen_hit;
use raystone_verify::twin_work::{TwinWork, fault_of_kernels};

/// How the measurement of a world ended.
pub(crate) enum Outcome {
    Done,
    /// The device was lost at this cell.
    Lost {
        at: usize,
        cause: String,
    },
}

/// A scene on the device, with the answers that structures must give.
pub(crate) struct World<'a> {
    device: &'a Device,
    scene_hash: String,
    soup: TriangleSoup,
    triangles: TriangleBuffers,
    reference: ReferenceTracer,
}

/// A structure that passed its gate.
struct Gated {
    /// Place among the cells.
    at: usize,
    traced: Traced,
    record: Line<StructureRecord>,
}

impl<'a> World<'a> {
    /// Loads a scene, checks its reference tracer and the gate itself.
    pub(crate) async fn new<H: Host>(
        run: &Run<'_, H>,
        device: &'a Device,
        cell: &Cell,
    ) -> Result<Self, String> {
        let name = name_of(cell);
        run.step(
            &format!("{name}: building the scene and its reference answers"),
            0.0,
        );
        run.host.allowed().await;
        let start = Instant::now();
        let variant = &cell[Axis::Scene];
        let scene =
            raystone_scene::load(variant, &LoadOptions::default()).map_err(|e| e.to_string())?;
        let camera = scene.view(run.experiment.aspect());
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        let key = Key::from(&Cell::default().with(Axis::Scene, variant));
        let record = Body::Scene(scene_record(&scene, camera, load_ms));
        run.host
            .write(&Line::new(key, Ran::default(), record).hashed(&scene.hash));
        let tests = run.registries.intersection(cell)?;
        tests.kept_by(&device.probe)?;
        let soup = TriangleSoup::new(&scene).intersecting(tests);
        let mut settings = run.experiment.gate;
        settings.rays = settings.rays.max(run.experiment.timing.rays);
        let seed = u64::from(run.experiment.run.seed);
        let reference =
            ReferenceTracer::new(&scene, &soup, camera, &settings, seed, Checks::Repeated);
        let reference = reference.map_err(|e| e.to_string())?;
        Self::prove_gate(&scene, &soup, &reference, device)?;
        Ok(Self {
            triangles: TriangleBuffers::upload(&device.gpu, &soup).map_err(|e| e.to_string())?,
            scene_hash: scene.hash,
            device,
            soup,
            reference,
        })
    }

    /// Faults that are planted into the gate's own data must show.
    fn prove_gate(
        scene: &SceneData,
        soup: &TriangleSoup,
        reference: &ReferenceTracer,
        device: &Device,
    ) -> Result<(), String> {
        match unseen_hit(scene, soup, reference, device.probe.is_exact()) {
            None => Ok(()),
            Some(fault) => Err(format!(
                "the gate is blind: of faults planted into its own data it does not see {fault}; nothing that it passes is proven"
            )),
        }
    }

    /// Gates all structures, then times those that passed.
    pub(crate) async fn measure<H: Host>(&self, run: &Run<'_, H>, cells: &[Cell]) -> Outcome {
        let mut gated = Vec::new();
        for (at, cell) in cells.iter().enumerate() {
            run.step(&format!("{cell}: build and gate"), 0.0);
            run.host.allowed().await;
            let mut line = Line::new(Key::from(cell), Ran::default(), StructureRecord::default());
            let judged = self.build_and_gate(run, cell, &mut line).await;
            if let Some(cause) = self.device.gpu.lost() {
                return Outcome::Lost { at, cause };
            }
            match judged {
                Ok(traced) => gated.push(Gated {
                    at,
                    traced,
                    record: line,
                }),
                Err(reason) => {
                    self.conclude(run, cell, line, Some(reason));
                    // It is not timed.
                    run.step("", Run::<H>::STRUCTURE / 3.0 * 2.0);
                }
            }
            run.step("", Run::<H>::STRUCTURE / 3.0);
        }
        let timed = self.time(run, &mut gated, cells).await;
        if let Some(cause) = self.device.gpu.lost() {
            let at = timed.err().map_or(0, |(at, _)| at);
            return Outcome::Lost { at, cause };
        }
        let failure = timed.err().map(|(_, error)| error.to_string());
        for one in gated {
            let failure = one.record.body.failure.clone().or_else(|| failure.clone());
            self.conclude(run, &cells[one.at], one.record, failure);
        }
        Outcome::Done
    }

    async fn build_and_gate<H: Host>(
        &self,
        run: &Run<'_, H>,
        cell: &Cell,
        line: &mut Line<StructureRecord>,
    ) -> Result<Traced, String> {
        let text = |error: GpuError| error.to_string();
        let accel = &cell[Axis::Accel];
        let kind = run.registries.accel.named("structure", &accel.name)?;
        let gpu = &self.device.gpu;
        let record = &mut line.body;
        let limit = gpu.limits.max_storage_buffer_binding_size;
        let mut log = BuildLog::default().binding(limit).noting_quality();
        let built = kind.build(&self.soup, &accel.params, &mut log);
        record.build_ms = log.total_ms();
        record.build = log.phases;
        let built = built.map_err(|e| e.to_string())?;
        record.space = built.space();
        record.stats = built.stats();
        let structural = built.validate(&self.soup).err().map(|e| e.to_string());
        let exact = self.device.probe.is_exact();
        let expected = TwinWork::of_structure(&*built, &self.soup, &self.reference, exact);
        let traced = Traced::upload(gpu, &*built).map_err(text)?;
        drop(built);
        record.load = Some(if traced.texels { "texture" } else { "buffer" }.to_owned());
        let on_device = (gpu, &self.triangles, &self.soup);
        let gated = gate_async(
            on_device,
            &traced,
            &self.reference,
            &self.device.probe,
            true,
        )
        .await;
        let mut verdict = gated
            .inspect_err(|error| record.refused = error.is_refusal())
            .map_err(text)?;
        if verdict.passed {
            let work = fault_of_kernels(gpu, &self.triangles, &traced, &expected).await;
            verdict.work = work.map_err(text)?;
        }
        verdict.structural = structural;
        verdict.passed &= verdict.work.is_none() && verdict.structural.is_none();
        line.ran.kernel_hash = kernel_hash(gpu, &self.triangles, &traced).map_err(text)?;
        let fault = (!verdict.passed).then(|| fault_text(&verdict));
        record.gate = Some(verdict);
        fault.map_or(Ok(traced), Err)
    }

    /// Times every class through every structure in interleaved rounds. An error comes with the place of its cell.
    async fn time<H: Host>(
        &self,
        run: &Run<'_, H>,
        gated: &mut [Gated],
        cells: &[Cell],
    ) -> Result<(), (usize, GpuError)> {
        let gpu = &self.device.gpu;
        let mut timed = Vec::new();
        for (structure, one) in gated.iter_mut().enumerate() {
            run.step(&format!("{}: warming up", cells[one.at]), 0.0);
            for set in self
                .reference
                .of(one.traced.space)
                .sets
                .iter()
                .filter(|set| set.is_timed())
            {
                let ask = Ask {
                    coherent: set.is_coherent(),
                    ..set.query().into()
                };
                let batch =
                    Tracer::new(gpu, &self.triangles, &one.traced, ask).and_then(|tracer| {
                        one.record.ran.features = tracer.features();
                        tracer.batch(&set.rays)
                    });
                let at = |error| (one.at, error);
                timed.push(
                    Timed::new(structure, set, batch.map_err(at)?)
                        .await
                        .map_err(at)?,
                );
            }
        }
        let rounds = run.experiment.timing.rounds;
        let units = Run::<H>::STRUCTURE / 3.0 * 2.0 * gated.len() as f64 / f64::from(rounds);
        let mut random = Pcg32::new(u64::from(run.experiment.run.seed));
        for round in 1..=rounds {
            let scene = cells.first().map(name_of).unwrap_or_default();
            run.step(
                &format!("{scene}: timing, round {round} of {rounds}"),
                units,
            );
            for index in order(&mut random, timed.len()) {
                run.host.allowed().await;
                let item: &mut Timed = &mut timed[index];
                item.turn()
                    .await
                    .map_err(|error| (gated[item.structure].at, error))?;
            }
        }
        for item in timed {
            let one = &mut gated[item.structure];
            self.note(run, item, one, cells)
                .await
                .map_err(|error| (one.at, error))?;
        }
        Ok(())
    }

    /// Notes the figures of a class, if its timed answers are right.
    async fn note<H: Host>(
        &self,
        run: &Run<'_, H>,
        item: Timed<'_>,
        one: &mut Gated,
        cells: &[Cell],
    ) -> Result<(), GpuError> {
        let (set, space) = (item.set, one.traced.space);
        let exact = self.device.probe.is_exact();
        let last = timed_fault_async(&item.batch, set, &self.soup, space, exact).await?;
        if let Some(slow) = slow_slice(item.batch.longest_slice_ms()) {
            let told = SkippedRecord {
                cell: cells[one.at].to_string(),
                reason: format!("{} rays: {slow}", set.class.name()),
            };
            run.host.write(&Line::about_all(Body::Warning(told)));
        }
        let work = count_work_async(
            &self.device.gpu,
            &self.triangles,
            &one.traced,
            set.query(),
            &set.rays,
        )
        .await?;
        let fault = item
            .fault()
            .or(last)
            .map(|fault| format!("{} rays: {fault}", set.class.name()));
        match fault.map_or_else(|| item.timing(), Err) {
            Ok(Some(mut timing)) => {
                timing.counters = work.as_deref().map(CountersPerRay::mean_of);
                one.record.body.timings.push(timing);
            }
            Ok(None) => {}
            Err(fault) => one.record.body.failure = Some(fault),
        }
        Ok(())
    }

    fn conclude<H: Host>(
        &self,
        run: &Run<'_, H>,
        cell: &Cell,
        mut line: Line<StructureRecord>,
        failure: Option<String>,
    ) {
        if failure.is_some() {
            line.body.timings.clear();
            line.body.failure.clone_from(&failure);
        }
        let hash = line.content_hash(&self.scene_hash, &[]);
        let outcome = match (&failure, line.body.refused) {
            (None, _) => CellOutcome::Done,
            (Some(_), true) => CellOutcome::LeftOut,
            (Some(_), false) => CellOutcome::Failed,
        };
        let readings = line.body.readings();
        let line = line.with_readings(readings).hashed(&hash);
        run.host.write(&line.with_body(Body::Structure));
        run.close(
            &cell.to_string(),
            outcome,
            failure.unwrap_or_default(),
            hash,
        );
    }
}
