//! The parts of the suite as measurements: the name of each on the axis of integrators, its cells, its time.

use super::families::FAMILIES;
use super::suite::{BRUTE_FORCE, PLAIN, Suite};
use super::{Found, axes, numerics, shots, suite};
use raystone_accel::Intersection;
use raystone_bench::run::{Absent, At, Cost, Measurement, Preparation, Prepared, Registries, Work};
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan, STRESS, Settings as Section};
use raystone_core::parameters;
use raystone_core::params::Entry;
use raystone_gpu::probe_arithmetic;
use std::path::PathBuf;

/// Rays per case and shots per mesh: of the whole suite, and of a quick one.
const RAYS: [u32; 2] = [512, 128];
const SHOTS: [u32; 2] = [1_000_000, 16_384];

parameters! {
    /// How much the numerical stress suite tries.
    #[derive(Eq)]
    pub struct Settings {
        /// Whether few rungs, rays and shots are tried, for a minute at most.
        quick: bool = false;
        /// Rays of a case; without it 512, of a quick suite 128.
        rays: Option<u32> = None, in 1..=1 << 20;
        /// Shots at each closed mesh, 0 for none; without it 1,000,000, of a quick suite 16,384.
        shots: Option<u32> = None, in 0..=1 << 30;
        /// A model to shoot at from inside, its holes closed; without it, none.
        model: Option<PathBuf> = None;
    }
}

impl Section for Settings {
    const SECTION: &'static str = "stress";
}

impl Settings {
    /// Returns the settings of an experiment.
    pub fn of(experiment: &Experiment) -> Self {
        experiment.settings().unwrap_or_default()
    }

    /// Returns one of two values: that of the whole suite, or that of a quick one.
    pub(crate) fn either<T: Copy>(&self, of: [T; 2]) -> T {
        of[usize::from(self.quick)]
    }

    /// Returns the number of rays of a case.
    pub(crate) fn rays_of_a_case(&self) -> usize {
        self.rays.unwrap_or(self.either(RAYS)) as usize
    }

    /// Shots at each mesh.
    pub(crate) fn shots_at_a_mesh(&self) -> usize {
        self.shots.unwrap_or(self.either(SHOTS)) as usize
    }
}

/// The settings of the suite that a plan needs.
pub(crate) struct Scope {
    pub settings: Settings,
    /// The triangle test that is tried everywhere: the default one, or the first where that is not on the axis.
    pub lead: String,
}

impl Scope {
    fn of(experiment: &Experiment) -> Self {
        let tests = || {
            experiment.axes[Axis::Triangle]
                .iter()
                .map(|test| &*test.name)
        };
        let default = Intersection::default().triangle;
        let lead = tests().find(|test| *test == default.name());
        Self {
            settings: Settings::of(experiment),
            lead: lead.or(tests().next()).unwrap_or_default().to_owned(),
        }
    }

    /// Returns `true` if a cell has the test that is tried everywhere.
    pub(crate) fn leads(&self, cell: &Cell) -> bool {
        cell[Axis::Triangle].name == self.lead
    }
}

/// Results of cells, in their order.
pub(crate) type Results = Result<Vec<Found>, Absent>;

/// A part of the suite.
struct Part {
    name: &'static str,
    plural: &'static str,
    /// Names on the axis of integrators, after [`STRESS`], with descriptions.
    entries: fn() -> Vec<[&'static str; 2]>,
    /// The axes that matter to it beside the integrator and the kernels.
    axes: &'static [Axis],
    /// True if it has such a cell.
    has: fn(&Scope, &Cell) -> bool,
    measure: fn(&Suite, &[Cell]) -> Results,
    /// Seconds of a cell, of the whole suite and of a quick one.
    seconds: [f64; 2],
    is_timed: bool,
}

static PARTS: [Part; 6] = [
    Part {
        name: "stress:families",
        plural: "families of hard rays",
        entries: || FAMILIES.iter().map(|f| [f.name, f.description]).collect(),
        axes: &[Axis::Triangle, Axis::Accel],
        has: suite::has_cell,
        measure: suite::families,
        seconds: [0.15, 0.08],
        is_timed: true,
    },
    Part {
        name: "stress:shots",
        plural: "series of shots",
        entries: || {
            vec![[
                "shots",
                "shots at closed meshes from inside, and at a plane: misses",
            ]]
        },
        axes: &[Axis::Triangle, Axis::Accel],
        has: |scope, cell| {
            let accel = &*cell[Axis::Accel].name;
            let is_tried = if scope.leads(cell) {
                accel != BRUTE_FORCE
            } else {
                accel == PLAIN
            };
            is_tried && scope.settings.shots != Some(0)
        },
        measure: shots::shots,
        seconds: [15.0, 1.0],
        is_timed: false,
    },
    Part {
        name: "stress:box-tests",
        plural: "box tests",
        entries: || vec![["box-tests", "box tests and their pads: hits that they lose"]],
        axes: &[Axis::Accel],
        has: axes::has_box_tests,
        measure: axes::box_tests,
        seconds: [5.0, 2.0],
        is_timed: false,
    },
    Part {
        name: "stress:offsets",
        plural: "ray offsets",
        entries: || {
            vec![[
                "offsets",
                "ray offsets: chains of mirror bounces inside closed meshes",
            ]]
        },
        axes: &[],
        has: |_, _| true,
        measure: axes::offsets,
        seconds: [2.0, 0.5],
        is_timed: false,
    },
    Part {
        name: "stress:costs",
        plural: "costs of triangle tests",
        entries: || {
            vec![[
                "costs",
                "times of triangle tests, alone and in a traversal; not of a quick suite",
            ]]
        },
        axes: &[Axis::Triangle],
        // Times of a few rays are meaningless.
        has: |scope, _| !scope.settings.quick,
        measure: axes::costs,
        seconds: [4.0, 0.0],
        is_timed: true,
    },
    Part {
        name: "stress:numerics",
        plural: "figures of accumulation and sampling",
        entries: || {
            vec![[
                "numerics",
                "sums, conversions, digits, mappings, long paths: what f32 loses",
            ]]
        },
        axes: &[],
        has: |_, _| true,
        measure: |suite, cells| {
            let found =
                numerics::found(suite).map_err(|error| Absent::Failed(error.to_string()))?;
            Ok(vec![found; cells.len()])
        },
        seconds: [40.0, 3.0],
        is_timed: false,
    },
];

/// Adds the suite to the measurements.
///
/// # Errors
/// It is there already.
pub fn register(registries: &mut Registries) -> Result<(), String> {
    let mut parts = PARTS.iter();
    parts.try_for_each(|part| registries.measurements.add(part))
}

/// Returns the name of an integrator without [`STRESS`].
pub(crate) fn part_of(cell: &Cell) -> &str {
    cell[Axis::Integrator].name.trim_start_matches(STRESS)
}

/// Returns the common axes of cells that are measured together.
fn together(cell: &Cell) -> Cell {
    cell.on(&[Axis::Integrator, Axis::Kernels])
}

impl Part {
    /// Measures cells that belong together, with a result for each.
    fn measure(&self, at: &At, cells: &[Cell]) -> Result<Vec<Result<Found, Absent>>, Absent> {
        at.say(part_of(&cells[0]).to_owned());
        let gpus = at.gpus(&cells[0])?;
        let probe = probe_arithmetic(&gpus[0])?;
        let suite = Suite {
            exact: probe.is_exact(),
            gpus,
            scope: Scope::of(at.experiment),
            seed: u64::from(at.experiment.run.seed),
            registries: at.registries,
        };
        let refusal = |cell: &Cell| match cell.get(Axis::Triangle) {
            None => Ok(None),
            Some(_) => Ok(Suite::with(suite.test(cell)?).kept_by(&probe).err()),
        };
        let refusals: Vec<Option<String>> =
            cells.iter().map(refusal).collect::<Result<_, Absent>>()?;
        let kept = cells
            .iter()
            .zip(&refusals)
            .filter(|(_, refusal)| refusal.is_none());
        let kept: Vec<Cell> = kept.map(|(cell, _)| cell.clone()).collect();
        let mut found = (self.measure)(&suite, &kept)?.into_iter();
        let none = || Absent::Failed("nothing was found of it".to_owned());
        let result = |refusal: Option<String>| match refusal {
            Some(reason) => Err(Absent::Refused(reason)),
            None => found.next().ok_or_else(none),
        };
        Ok(refusals.into_iter().map(result).collect())
    }
}

impl Measurement for Part {
    fn name(&self) -> &'static str {
        self.name
    }

    fn plural(&self) -> &'static str {
        self.plural
    }

    fn declare(&self, catalogue: &mut Catalogue) {
        catalogue.add_section::<Settings>();
        let entries = (self.entries)()
            .into_iter()
            .map(|[name, description]| Entry {
                name: format!("{STRESS}{name}"),
                description: description.to_owned(),
                schema: Vec::new(),
            });
        catalogue[Axis::Integrator].extend(entries);
    }

    fn cells(&self, experiment: &Experiment, plan: &Plan) -> Vec<Cell> {
        let scope = Scope::of(experiment);
        let own = (self.entries)();
        let axes = [&[Axis::Integrator, Axis::Kernels], self.axes].concat();
        let mut cells = plan.benches_on(&axes);
        cells.retain(|cell| {
            let name = cell[Axis::Integrator].name.strip_prefix(STRESS);
            own.iter().any(|[own, _]| name == Some(own)) && (self.has)(&scope, cell)
        });
        cells
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        (self.name, together(cell))
    }

    fn is_shared(&self) -> bool {
        true
    }

    fn is_timed(&self) -> bool {
        self.is_timed
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        let tests = &experiment.axes[Axis::Triangle];
        format!(
            "{:?}",
            (experiment.run.seed, Scope::of(experiment).lead, tests)
        )
    }

    fn cost(&self, _: &Cell, cost: &Cost) -> Work {
        Work::other(Settings::of(cost.experiment).either(self.seconds))
    }

    fn prepare<'a>(&'a self, at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let groups = cells.chunk_by(|a, b| together(a) == together(b));
        Box::new(groups.flat_map(|cells| {
            let results = self.measure(at, cells);
            let results = results.unwrap_or_else(|absent| vec![Err(absent); cells.len()]);
            let ready = |found| Box::new(found) as Box<dyn Prepared>;
            results.into_iter().map(move |result| result.map(ready))
        }))
    }
}
