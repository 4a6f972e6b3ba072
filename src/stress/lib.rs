//! The numerical stress suite: every triangle test and structure on scenes and rays that rounding makes
//! hard, judged exactly. What is counted and why: `docs/stress.md`.
//!
//! Families make cases (`families`), a suite traces them on the adapter (`suite`) and a million
//! shots at closed meshes ([`shots`]), the exact oracle judges ([`tally`]), and everything ends up as
//! records ([`record`]), from which tables and the page of the report derive.
#![warn(missing_docs)]

pub mod axes;
pub(crate) mod bench;
pub mod case;
pub mod explain;
pub(crate) mod families;
pub mod numerics;
pub mod placement;
pub mod record;
pub mod report;
pub(crate) mod shapes;
pub(crate) mod shot_meshes;
pub mod shots;
pub(crate) mod suite;
pub mod tally;
pub mod targets;

use raystone_accel::triangle::AnyTriangleTest;
use raystone_accel::{AccelError, AccelRegistry, Intersection, TriangleRegistry};
use raystone_bench::environment::capture as capture_environment;
use raystone_core::program::Program;
use raystone_gpu::{Gpu, GpuError, probe_arithmetic};
use raystone_record::Key;
use record::{Line, Record, SuiteRecord, about_all, skipped};
use std::path::PathBuf;
use std::time::{Instant, SystemTime};
use suite::{BRUTE_FORCE, Progress, Suite};
use thiserror::Error;

/// Rays per case and shots per mesh: of the whole suite, and of the quick one.
const RAYS: (usize, usize) = (512, 128);
const SHOTS: (usize, usize) = (1_000_000, 16_384);
/// Rays of a timed comparison.
const TIMED_RAYS: (usize, usize) = (16_384, 8192);

/// What to do.
#[derive(Debug, Clone)]
pub struct StressOptions {
    /// The program, as records name it.
    pub program: Program,
    /// Few rungs and shots, for a minute at most.
    pub quick: bool,
    /// Seed of everything random.
    pub seed: u64,
    /// Families; none: all.
    pub families: Vec<String>,
    /// Structures; none: all.
    pub accels: Vec<String>,
    /// Triangle tests; none: all.
    pub triangles: Vec<String>,
    /// Rays a case.
    pub rays: usize,
    /// Shots at each closed mesh.
    pub shots: usize,
    /// A model to shoot at, its holes closed; `None` leaves the shots at a model out.
    pub model: Option<PathBuf>,
}

impl StressOptions {
    /// The whole suite, or the quick one.
    pub fn new(quick: bool) -> Self {
        let of = |(whole, few): (usize, usize)| if quick { few } else { whole };
        Self {
            program: Program::default(),
            quick,
            seed: 1,
            families: Vec::new(),
            accels: Vec::new(),
            triangles: Vec::new(),
            rays: of(RAYS),
            shots: of(SHOTS),
            model: None,
        }
    }

    /// Checks every name.
    ///
    /// # Errors
    /// [`StressError::Unknown`].
    pub fn check(&self) -> Result<(), StressError> {
        let families = families::FAMILIES.iter().map(|f| f.name);
        check_names("family", &self.families, families)?;
        let registry = AccelRegistry::default();
        let structures = registry.iter().map(|kind| kind.name());
        check_names("structure", &self.accels, structures)?;
        let tests = TriangleRegistry::default();
        let tests = tests.iter().map(|test| test.name());
        check_names("triangle test", &self.triangles, tests)
    }

    pub(crate) fn wants_family(&self, name: &str) -> bool {
        self.families.is_empty() || self.families.iter().any(|family| family == name)
    }

    fn timed_rays(&self) -> usize {
        let (whole, few) = TIMED_RAYS;
        if self.quick { few } else { whole }
    }
}

/// Why the suite cannot go on.
#[derive(Debug, Error)]
pub enum StressError {
    /// The adapter.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The figures of accumulation and sampling.
    #[error(transparent)]
    Numerics(#[from] numerics::NumericsError),
    /// A tree that the suite itself needs.
    #[error("a tree of the suite is not built: {0}")]
    Build(#[from] AccelError),
    /// A name that nothing has.
    #[error("unknown {what} `{name}`; there are: {known}")]
    Unknown {
        /// Kind of name.
        what: &'static str,
        /// The name.
        name: String,
        /// All names.
        known: String,
    },
}

/// Runs the suite on devices of one adapter, one at least: they work at once where nothing is timed.
/// `progress` is told what is being done.
///
/// # Errors
/// A name that does not exist, or a device is lost or hangs.
///
/// # Panics
/// Without a device.
pub fn run(
    gpus: &[Gpu],
    settings: &StressOptions,
    progress: &Progress,
) -> Result<Vec<Line>, StressError> {
    let start = Instant::now();
    let gpu = gpus.first().expect("a device");
    settings.check()?;
    let probe = probe_arithmetic(gpu)?;
    let first = first_record(gpu, settings, probe.is_exact());
    let mut records = vec![about_all(Record::Suite(first))];
    let mut tests = tests(settings);
    tests.retain(|test| match Suite::with(*test).kept_by(&probe) {
        Ok(()) => true,
        Err(reason) => {
            records.push(skipped(Key::default(), test.name().to_owned(), reason));
            false
        }
    });
    let suite = Suite {
        gpus,
        exact: probe.is_exact(),
        settings,
        kinds: kinds(settings),
        tests,
    };
    records.extend(suite.cells(progress)?);
    if settings.shots > 0 {
        records.extend(suite.shots(progress)?);
    }
    if settings.families.is_empty() {
        records.extend(suite.box_tests(progress)?);
        records.extend(suite.offsets(progress)?);
        // Times of a few rays tell nothing.
        if !settings.quick {
            records.extend(suite.costs(progress)?);
        }
        progress("accumulation and sampling");
        let gauges = numerics::run(gpu, settings.quick)?.into_iter();
        records.extend(gauges.map(Record::Gauge).map(about_all));
    }
    let targets = targets::targets(&records);
    records.extend(targets.into_iter().map(Record::Target).map(about_all));
    let wall_s = start.elapsed().as_secs_f64();
    records.push(about_all(Record::Finished { wall_s }));
    Ok(records)
}

fn first_record(gpu: &Gpu, settings: &StressOptions, exact: bool) -> SuiteRecord {
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    SuiteRecord {
        started_unix_s: now.map_or(0, |d| d.as_secs()),
        environment: Box::new(capture_environment(gpu, &settings.program)),
        quick: settings.quick,
        seed: settings.seed,
        rays: settings.rays,
        shots: settings.shots,
        exact_adapter: exact,
        default_triangle: Intersection::default().triangle.name().to_owned(),
    }
}

fn check_names<'a>(
    what: &'static str,
    wanted: &[String],
    known: impl Iterator<Item = &'a str>,
) -> Result<(), StressError> {
    let known: Vec<&str> = known.collect();
    let unknown = wanted.iter().find(|name| !known.contains(&name.as_str()));
    match unknown {
        None => Ok(()),
        Some(name) => Err(StressError::Unknown {
            what,
            name: name.clone(),
            known: known.join(", "),
        }),
    }
}

/// The structures to try, brute force first.
fn kinds(settings: &StressOptions) -> Vec<suite::Kind> {
    let wanted = |name: &str| {
        let accels = &settings.accels;
        accels.is_empty() || name == BRUTE_FORCE || accels.iter().any(|a| a == name)
    };
    let registry = AccelRegistry::default();
    let mut kinds: Vec<suite::Kind> = registry.iter().filter(|kind| wanted(kind.name())).collect();
    kinds.sort_by_key(|kind| kind.name() != BRUTE_FORCE);
    kinds
}

/// The triangle tests to try, the default first.
fn tests(settings: &StressOptions) -> Vec<AnyTriangleTest> {
    let wanted = |test: &AnyTriangleTest| {
        settings.triangles.is_empty() || settings.triangles.iter().any(|t| t == test.name())
    };
    let mut tests: Vec<AnyTriangleTest> =
        TriangleRegistry::default().iter().filter(wanted).collect();
    tests.sort_by_key(|test| *test != Intersection::default().triangle);
    tests
}
