//! Shared parts of the test programs: one device for each, scenes and structures on it, rays and their answers,
//! renderers, kernels with planted faults, samples with their standard error, runs.
#![allow(dead_code, unused_imports)] // Every test program uses its own part of this.

pub mod cpu;
mod hits;
pub mod needs;
pub mod scenes;
pub mod tier;

pub use hits::*;
pub use tier::{faults_in_turn, in_turn, is_full, one_of, so_many};

use raystone::accel::{
    AccelError, AccelKind, AccelRegistry, Access, BuildLog, BuiltAccel, Intersection, Traced,
    TriangleSoup,
};
use raystone::config::{Experiment, Gate, Plan};
use raystone::geometry::Camera;
use raystone::gpu::{AdapterChoice, Gpu, GpuError, KernelLibrary, probe_arithmetic};
use raystone::integrator::RayOffset;
use raystone::integrator::{self, IntegratorRegistry, RenderJob, Renderer};
use raystone::measure::gate::{Checks, ReferenceTracer, gate};
use raystone::measure::record::{GateVerdict, Line, SCHEMA};
use raystone::measure::statistics::{mean, variance};
use raystone::params::{Entry, ParamValue, Params, Variant};
use raystone::run::{Registries, RunOptions, RunSummary};
use raystone::sampling::{Demand, Sampler, SamplerRegistry, dimensions};
use raystone::scene::{LoadOptions, SceneData, builtin_scenes, load};
use std::ops::{Deref, DerefMut};
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// The device that all tests of one program share, with the embedded kernels.
pub fn gpu() -> &'static Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    GPU.get_or_init(|| alone(KernelLibrary::default()))
}

/// The shared device with other kernels; kernels that compose to the same text are not compiled again.
pub fn open(kernels: KernelLibrary) -> Gpu {
    gpu().with_kernels(kernels)
}

/// A device of its own: for tests that change its limits, examine its opening or compilation, or plant faults that may lose
/// it.
pub fn alone(kernels: KernelLibrary) -> Gpu {
    raystone::gpu::open(&AdapterChoice::Best, kernels)
        .unwrap_or_else(|e| panic!("no adapter: run scripts/install-driver ({e})"))
}

/// Returns `true` if the adapter computes like the host; reports if it does not.
pub fn is_exact(gpu: &Gpu) -> bool {
    let probe = probe_arithmetic(gpu).expect("the probe runs");
    if !probe.is_exact() {
        let why = format!("{} fuses or rounds differently ({probe:?})", gpu.info.name);
        needs::skip("exact-adapter", why);
    }
    probe.is_exact()
}

/// A path tracer in the Cornell box with a plain BVH, with as little of all else as a run needs.
pub const SMALL: &str = r#"
[run]
name = "small"
replicates = 2
resolution = [16, 16]
spp = { pow2 = [0, 1] }
[axes]
scene = ["cornell-box"]
accel = ["bvh"]
sequence = ["pixel-hash"]
decorrelation = ["none"]
integrator = ["path"]
[reference]
spp = 8
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 1
rays = 1024
[gate]
rays = 1024
brute_force_tests = 1000
oracle_rays = 16
[discrepancy]
points = 16
"#;

/// [`SMALL`] with these keys set, each `section.key = value` as experiment files write it.
pub fn small_with(changes: &[&str]) -> String {
    fn lay(over: toml::Table, table: &mut toml::Table) {
        for (key, value) in over {
            match (value, table.get_mut(&key)) {
                // Not those of one line: they are values.
                (toml::Value::Table(inner), Some(toml::Value::Table(below))) if key != "spp" => {
                    lay(inner, below);
                }
                (value, _) => drop(table.insert(key, value)),
            }
        }
    }
    let parsed = |text: &str| -> toml::Table {
        toml::from_str(text).unwrap_or_else(|e| panic!("`{text}`: {e}"))
    };
    let mut table = parsed(SMALL);
    for change in changes {
        lay(parsed(change), &mut table);
    }
    toml::to_string(&table).expect("a table is text")
}

/// The embedded kernels with one text replaced in one of them. Panics unless `from` occurs there exactly once, so
/// that no fault misses the kernel.
pub fn kernels_with(module: &str, changes: &[(&str, &str)]) -> KernelLibrary {
    let library = KernelLibrary::default();
    let mut text = library.text(module).expect("a known module").to_owned();
    for (from, to) in changes {
        assert_eq!(text.matches(from).count(), 1, "`{from}` in {module}");
        text = text.replace(from, to);
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let file = folder.path().join(module).with_extension("wesl");
    std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
    std::fs::write(&file, text).expect("a kernel file");
    library.with_folder(folder.path()).expect("the kernels")
}

/// Returns `true` if an error, by its `Debug` text, or the words of a panic are the effect of a planted fault. A kernel that
/// does not compile shows nothing: its error names the file.
pub fn shows(said: &str) -> bool {
    !said.contains("Kernel(\"") && !said.contains(".wesl")
}

/// The same for a panic caught by `catch_unwind`.
pub fn panic_shows(caught: &(dyn std::any::Any + Send)) -> bool {
    let text = caught.downcast_ref::<String>().map(String::as_str);
    shows(
        text.or_else(|| caught.downcast_ref::<&str>().copied())
            .unwrap_or_default(),
    )
}

/// The entry `name` with some parameters changed from their defaults.
pub fn variant(entries: &[Entry], name: &str, changes: &[(&str, ParamValue)]) -> Variant {
    let found = entries.iter().find(|e| e.name == name);
    let entry = found.unwrap_or_else(|| panic!("{name} is not registered"));
    let defaults = entry.schema.iter();
    let mut params: Params = Params(
        defaults
            .map(|p| (p.name.to_owned(), p.default.clone()))
            .collect(),
    );
    for (key, value) in changes {
        let slot = params.0.get_mut(*key);
        *slot.unwrap_or_else(|| panic!("{name} has no parameter {key}")) = value.clone();
    }
    Variant {
        name: name.to_owned(),
        params,
        label: name.to_owned(),
    }
}

/// A scene ready to be traced, with its own camera.
pub struct Stage {
    stage: integrator::Stage,
    pub camera: Camera,
}

impl Deref for Stage {
    type Target = integrator::Stage;

    fn deref(&self) -> &integrator::Stage {
        &self.stage
    }
}

impl DerefMut for Stage {
    fn deref_mut(&mut self) -> &mut integrator::Stage {
        &mut self.stage
    }
}

impl Stage {
    /// `scene` as it is, seen by its own camera.
    pub fn new(gpu: &Gpu, scene: impl Into<Arc<SceneData>>) -> Self {
        let scene = scene.into();
        let camera = scene.view(1.0);
        let stage = integrator::Stage::new(gpu, scene, Intersection::default());
        let stage = stage.expect("buffers that fit");
        Self { stage, camera }
    }

    /// A built-in scene.
    pub fn builtin(gpu: &Gpu, name: &str, changes: &[(&str, ParamValue)]) -> Self {
        Self::new(gpu, builtin(name, changes))
    }

    /// A structure with its default parameters, built on this scene.
    pub fn build(&self, kind: &dyn AccelKind) -> Result<Box<dyn BuiltAccel>, AccelError> {
        kind.build(
            &self.soup,
            &default_params(&kind.parameters()),
            &mut BuildLog::default(),
        )
    }

    /// [`Stage::build`], on the GPU.
    pub fn traced(&self, gpu: &Gpu, kind: &dyn AccelKind) -> Traced {
        let built = self
            .build(kind)
            .unwrap_or_else(|e| panic!("{} does not build: {e}", kind.name()));
        Traced::upload(gpu, &*built).expect("buffers that fit")
    }

    /// The reference tracer of this scene: rays of each class, triangles that brute force tests, rays of the oracle.
    pub fn judge(
        &self,
        checks: Checks,
        [rays, brute_force_tests, oracle_rays]: [u32; 3],
    ) -> ReferenceTracer {
        let settings = Gate {
            rays,
            brute_force_tests: brute_force_tests.into(),
            oracle_rays,
            ao_length: 0.0,
            offset: 0.0,
            shadow_orders: false,
        };
        ReferenceTracer::new(&self.scene, &self.soup, self.camera, &settings, 1, checks)
            .expect("a reference tracer")
    }

    /// Returns the verdict on the structure on the GPU.
    pub fn verdict(
        &self,
        gpu: &Gpu,
        traced: &Traced,
        reference: &ReferenceTracer,
    ) -> Result<GateVerdict, GpuError> {
        let probe = probe_arithmetic(gpu)?;
        let triangles = &self.buffers.triangles;
        gate(gpu, triangles, &self.soup, traced, reference, &probe, true)
    }

    /// A compiled image of `size` pixels. The AO radius is a fraction of the scene's diagonal, as
    /// in a run.
    pub fn renderer<'a>(
        &'a self,
        gpu: &'a Gpu,
        traced: &Traced,
        sampler: &Sampler,
        what: &Variant,
        size: [u32; 2],
        ray_counts: bool,
    ) -> Renderer<'a> {
        let integrator = IntegratorRegistry::default().configured(what);
        let job = RenderJob {
            size,
            camera: self.camera,
            sampler,
            integrator: &integrator.unwrap_or_else(|e| panic!("{e}")),
            offset: RayOffset::default(),
            runtime_checks: true,
        };
        Renderer::new(gpu, &self.buffers, traced, &job, ray_counts)
            .unwrap_or_else(|e| panic!("{what} with {} does not compile: {e}", sampler.label()))
    }
}

/// A built-in scene.
pub fn builtin(name: &str, changes: &[(&str, ParamValue)]) -> SceneData {
    let variant = variant(&builtin_scenes(), name, changes);
    load(&variant, &LoadOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// A scene from a file.
pub fn from_file(path: &Path) -> SceneData {
    let variant = Variant {
        name: path.display().to_string(),
        params: Params::default(),
        label: "file".to_owned(),
    };
    load(&variant, &LoadOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The registered structures; never none.
pub fn structures() -> Vec<&'static dyn AccelKind> {
    let found: Vec<_> = AccelRegistry::default().iter().collect();
    assert!(found.len() >= 4, "{} structures", found.len());
    found
}

/// Those that kernels can import; the others answer buffers of rays in passes of their own.
pub fn inline_structures() -> Vec<&'static dyn AccelKind> {
    let nothing = TriangleSoup::default();
    let is_inline = |kind: &&'static dyn AccelKind| {
        let built = build(*kind, &nothing, &default_params(&kind.parameters()));
        matches!(built.access(), Access::Inline)
    };
    structures().into_iter().filter(is_inline).collect()
}

/// The structure of this name.
pub fn structure(name: &str) -> &'static dyn AccelKind {
    AccelRegistry::default()
        .get(name)
        .expect("a known structure")
}

/// A sampler of 64 samples with default parameters.
pub fn sampler(sequence: &str, decorrelation: &str) -> Sampler {
    sampler_of(sequence, decorrelation, 64)
}

/// A sampler with as many dimensions as a path needs, else with default parameters.
pub fn sampler_of(sequence: &str, decorrelation: &str, samples: u32) -> Sampler {
    let registry = SamplerRegistry::default();
    let needed = dimensions::needed(6);
    let dimensions = ("dimensions", ParamValue::Integer(i64::from(needed)));
    let changes = if sequence == "r2" {
        &[dimensions][..]
    } else {
        &[]
    };
    let sequence = variant(&registry.sequence_entries(), sequence, changes);
    let decorrelation = variant(&registry.decorrelation_entries(), decorrelation, &[]);
    let demand = Demand {
        samples: Some(samples),
        dimensions: needed,
        width: Some(16),
    };
    registry
        .sampler(&sequence, &decorrelation, &demand)
        .unwrap_or_else(|e| panic!("{e}"))
}

/// Every sequence that a path can use, and every decorrelation of one of them, for so many samples;
/// never none. Kernels and twins of all pairs are compared in `samplers.rs`.
pub fn samplers(samples: u32) -> Vec<Sampler> {
    let registry = SamplerRegistry::default();
    let sequences = registry.sequences.iter().map(|s| (s.name(), "none"));
    let decorrelations = registry.decorrelations.iter().map(|d| ("sobol", d.name()));
    let pairs = sequences.chain(decorrelations);
    let usable = pairs.filter(|pair| pair.0 != "van-der-corput" && *pair != ("sobol", "none"));
    let mut found: Vec<_> = usable.map(|(s, d)| sampler_of(s, d, samples)).collect();
    found.push(sampler_of("sobol", "none", samples));
    assert!(found.len() >= 12, "{} samplers", found.len());
    found
}

/// An integrator with some parameters changed from their defaults.
pub fn integrator_variant(name: &str, changes: &[(&str, ParamValue)]) -> Variant {
    variant(&IntegratorRegistry::default().entries(), name, changes)
}

/// The path integrator with this many bounces.
pub fn path(max_depth: i64) -> Variant {
    integrator_variant("path", &[("max_depth", ParamValue::Integer(max_depth))])
}

/// A mean with its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Estimate {
    pub mean: f64,
    pub error: f64,
}

/// More standard errors than this are no accident: below 2 · 10⁻⁴ for 16 replicates (Student's t).
const STANDARD_ERRORS: f64 = 5.0;
/// Relative error of f32 sums.
const ROUNDING: f64 = 1e-5;

impl Estimate {
    /// The mean of independent replicates.
    pub fn of(replicates: &[f64]) -> Self {
        let spread = variance(replicates).expect("two replicates or more");
        Self {
            mean: mean(replicates).expect("finite values"),
            error: (spread / replicates.len() as f64).sqrt(),
        }
    }

    /// Returns `true` if the true mean may be `expected`.
    pub fn agrees_with(&self, expected: f64) -> bool {
        let rounding = ROUNDING * expected.abs();
        (self.mean - expected).abs() <= STANDARD_ERRORS * self.error + rounding
    }

    /// The difference of two independent estimates.
    pub fn minus(&self, other: &Self) -> Self {
        Self {
            mean: self.mean - other.mean,
            error: self.error.hypot(other.error),
        }
    }
}

/// Mean radiance of `count` replicates with different seeds. Panics if a kernel raised its error
/// word.
pub fn replicate_means(renderer: &Renderer, spp: u32, count: u32) -> Vec<f64> {
    let one = |seed| {
        let shot = renderer
            .render(&[spp], seed)
            .expect("the device renders")
            .remove(0);
        assert_eq!(renderer.error_word().expect("a status"), 0, "error word");
        shot.image.mean()
    };
    (0..count).map(|k| one(1000 + 77 * k)).collect()
}

/// Runs an experiment to its end, reads its records back and writes the report. Panics if a line of them is
/// broken.
pub fn run(
    experiment: &str,
    registries: &Registries,
    out: &Path,
    lose_device_at: Option<&str>,
) -> (RunSummary, Vec<Line>) {
    let options = RunOptions {
        out: out.to_owned(),
        lose_device_at: lose_device_at.map(str::to_owned),
        ..RunOptions::default()
    };
    let (experiment, plan) = plan(experiment, registries);
    let summary = raystone::run::run(&experiment, &plan, registries, &options)
        .unwrap_or_else(|e| panic!("the run ends early: {e}"));
    raystone::report::write_report(out).unwrap_or_else(|e| panic!("no report: {e}"));
    (summary, records(out))
}

/// An experiment text and its plan.
pub fn plan(text: &str, registries: &Registries) -> (Experiment, Plan) {
    let experiment = Experiment::parse(text, "test", &[], &registries.catalogue());
    let experiment = experiment.unwrap_or_else(|e| panic!("{e}"));
    let randomised = |s: &Variant, d: &Variant| registries.is_randomised(s, d);
    let plan = Plan::new(&experiment, &[], randomised).unwrap_or_else(|e| panic!("{e}"));
    (experiment, plan)
}

/// Every record of a folder, none broken.
pub fn records(out: &Path) -> Vec<Line> {
    let text = std::fs::read_to_string(out.join("records.jsonl")).expect("records");
    assert!(text.ends_with('\n'), "the last line is not whole");
    let parse = |line: &str| {
        let line: Line = serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"));
        assert_eq!(line.schema, SCHEMA);
        line
    };
    text.lines().map(parse).collect()
}
