//! Images as runs render them: many pixels, borders of dispatches, full queues, counted rays.

use super::{Bench, Finding};
use crate::subject::{build, sampler};
use crate::world::Stage;
use crate::{CheckError, Plant};
use raystone::accel::{Intersection, Traced};
use raystone::gpu::GpuError;
use raystone::integrator::organisation::fault_of_order;
use raystone::integrator::{
    BLOCK_SAMPLES, ConfiguredIntegrator, IntegratorRegistry, OrganisationRegistry, RayOffset,
    RenderJob, Renderer, SceneBuffers, Stage as StagedScene,
};
use raystone::measure::image_gate::{Choice, Frame, Pixels, answers, judge, sums};
use raystone::measure::path_oracle::{Estimator, PathOracle, View};
use raystone::measure::ray_counts;
use raystone::params::{ParamValue, Params, Variant};
use raystone::sampling::{Demand, Sampler};

/// Samples of which the last one is looked at.
const SPP: u32 = 70_001;
const SEED: u32 = 4711;
/// Whose sums are compared, and whose rays are counted.
const SMALL: Frame = Frame {
    size: [26, 19],
    choice: Choice::Every(1),
    samples: 1,
    summed: 2 * BLOCK_SAMPLES,
    view: 0.5,
};

/// A scene, its structure and its oracle on the host and on a device.
struct Setup<'a> {
    bench: &'a Bench<'a>,
    stage: &'a Stage,
    buffers: SceneBuffers,
    traced: Traced,
    oracle: PathOracle<'a>,
}

impl<'a> Setup<'a> {
    fn new(bench: &'a Bench, stage: &'a Stage) -> Result<Self, CheckError> {
        let built = build("bvh", &[], &stage.soup)?;
        Ok(Self {
            bench,
            stage,
            buffers: SceneBuffers::upload(bench.gpu, &stage.scene, &stage.soup)?,
            traced: Traced::upload(bench.gpu, &*built)?,
            oracle: PathOracle::new(&stage.scene).map_err(CheckError::Stale)?,
        })
    }

    /// What a check finds with a renderer of these pixels; what the renderer itself refuses to hand
    /// out is found, too.
    fn find(
        &self,
        integrator: &ConfiguredIntegrator,
        frame: &Frame,
        ray_counts: bool,
        check: impl Fn(&Renderer, &View, &Pixels) -> Result<Option<String>, GpuError>,
    ) -> Finding {
        let sampler = independent(integrator, frame)?;
        let camera = frame.camera(self.stage.camera);
        let view = View {
            estimator: Estimator::of(integrator).map_err(CheckError::Stale)?,
            camera,
            size: frame.size,
            sampler: &sampler,
        };
        let job = RenderJob {
            size: frame.size,
            camera,
            sampler: &sampler,
            integrator,
            offset: RayOffset::default(),
            runtime_checks: true,
        };
        let (gpu, buffers) = (self.bench.gpu, &self.buffers);
        let renderer = Renderer::new(gpu, buffers, &self.traced, &job, ray_counts)?;
        match check(&renderer, &view, &frame.pixels(SPP, SEED)) {
            Err(e @ (GpuError::Samples { .. } | GpuError::Kernels(_))) => Ok(Some(e.to_string())),
            other => Ok(other?),
        }
    }
}

fn independent(integrator: &ConfiguredIntegrator, frame: &Frame) -> Result<Sampler, CheckError> {
    let demand = Demand {
        samples: None,
        dimensions: integrator.facts.dimensions,
        width: Some(frame.size[0]),
    };
    sampler(("pixel-hash", &[]), "none", &demand, &Plant::Nothing)
}

/// An integrator, in an organisation whose queues are as short as they can be.
fn integrator(name: &str, organisation: &str) -> Result<ConfiguredIntegrator, CheckError> {
    let variant = |name: &str, params| Variant {
        name: name.to_owned(),
        params,
        ..Variant::default()
    };
    let stale = |e: String| CheckError::Stale(e);
    let plain = IntegratorRegistry::default().configured(&variant(name, Params::default()));
    let slots = (
        "capacity".to_owned(),
        ParamValue::Integer(Frame::SLOTS.into()),
    );
    let params = match organisation {
        "wavefront" => Params([slots].into()),
        _ => Params::default(),
    };
    let by = OrganisationRegistry::default().configured(&variant(organisation, params));
    let plain = plain.map_err(|e| stale(e.to_string()))?;
    plain.organised(by.map_err(stale)?).map_err(stale)
}

/// Pixels of a large image, and of queues that are exactly full and of one path more; sums; the order of paths in a wavefront.
pub fn frames(bench: &Bench, organisation: &str) -> Finding {
    let stage = Stage::builtin("cornell-box", &[])?;
    let setup = Setup::new(bench, &stage)?;
    let path = integrator("path", organisation)?;
    for frame in [Frame::LARGE, SMALL].iter().chain(&Frame::FULL) {
        let found = setup.find(&path, frame, false, |renderer, view, pixels| {
            let sums = match frame.summed {
                0 => None,
                summed => sums(renderer, pixels, summed)?,
            };
            let judged = judge(&setup.oracle, view, &answers(renderer, pixels)?);
            Ok(sums.or(judged.fault))
        })?;
        if found.is_some() {
            return Ok(found);
        }
    }
    match organisation {
        "wavefront" => order(bench, &stage, &path),
        _ => Ok(None),
    }
}

/// The order into which a wavefront can sort its paths.
fn order(bench: &Bench, stage: &Stage, path: &ConfiguredIntegrator) -> Finding {
    let sampler = independent(path, &SMALL)?;
    let job = RenderJob {
        size: SMALL.size,
        camera: SMALL.camera(stage.camera),
        sampler: &sampler,
        integrator: path,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let staged = StagedScene::new(bench.gpu, stage.scene.clone(), Intersection::default())?;
    let built = build("bvh", &[], &staged.soup)?;
    let traced = Traced::upload(bench.gpu, &*built)?;
    Ok(fault_of_order(bench.gpu, &staged, &traced, &job)?)
}

/// Counted rays of all integrators against the oracle's.
pub fn counts(bench: &Bench, organisation: &str) -> Finding {
    let stage = Stage::builtin("cornell-box", &[])?;
    let setup = Setup::new(bench, &stage)?;
    let all = ["path", "ao", "primary"];
    let single = organisation == "single-kernel";
    for name in all.iter().take(if single { all.len() } else { 1 }) {
        let what = integrator(name, organisation)?;
        let found = setup.find(&what, &SMALL, true, |renderer, view, pixels| {
            ray_counts::fault(renderer, &setup.oracle, view, pixels)
        })?;
        if found.is_some() {
            return Ok(found.map(|fault| format!("{name}: {fault}")));
        }
    }
    Ok(None)
}
