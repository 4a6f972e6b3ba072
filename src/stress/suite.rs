//! The cells: every family through every structure with every triangle test.

use super::Found;
use super::bench::{self, Expected};
use super::case::{Address, Case, Truth};
use super::families::Family;
use super::measurement::{Results, Scope, part_of};
use super::placement::Placement;
use super::tally::{CaseTruth, Outcome, Tally};
use raystone_accel::triangle::AnyTriangleTest;
use raystone_accel::{
    AccelKind, BuiltAccel, Hit, Intersection, NO_HIT, Ray, Space, Traced, TriangleSoup,
};
use raystone_bench::run::{Absent, Registries};
use raystone_config::{Axis, Cell};
use raystone_core::params::Variant;
use raystone_gpu::{Gpu, GpuError};
use raystone_record::figure;
use raystone_record::{Key, RayClass};
use raystone_render::Stage;
use raystone_verify::gate;
use raystone_verify::rays::RaySet;

/// The structure that every other one is compared with.
pub(crate) const BRUTE_FORCE: &str = "brute-force";
/// The structure that represents all where not all are tried.
pub(crate) const PLAIN: &str = "bvh";
/// Rays of a timed comparison.
const TIMED_RAYS: [usize; 2] = [16_384, 8192];
/// Cases that are timed if it has to be quick.
const TIMED_IF_QUICK: usize = 3;

/// The devices and settings of the suite.
pub(crate) struct Suite<'a> {
    /// Devices of the adapter, one at least, which work at once where nothing is timed.
    pub gpus: Vec<Gpu>,
    /// True if it computes like the host.
    pub exact: bool,
    /// The settings.
    pub scope: Scope,
    /// Seed of everything random.
    pub seed: u64,
    /// Everything that can be named.
    pub registries: &'a Registries,
}

/// A structure under test, with its parameters.
#[derive(Clone, Copy)]
pub(crate) struct Kind<'a> {
    accel: &'static dyn AccelKind,
    variant: &'a Variant,
}

impl Kind<'_> {
    /// Returns its name, with its parameters.
    pub(crate) fn label(&self) -> &str {
        &self.variant.label
    }

    fn is(&self, name: &str) -> bool {
        self.variant.name == name
    }

    /// Builds the structure and checks its invariants.
    ///
    /// # Errors
    /// The refusal or the violated invariant, in words.
    pub(crate) fn build(&self, soup: &TriangleSoup) -> Result<Box<dyn BuiltAccel>, String> {
        bench::build_with(self.accel, &self.variant.params, soup)
    }
}

/// Returns `true` if any case of a family goes through this structure with this triangle test.
pub(crate) fn has_cell(scope: &Scope, cell: &Cell) -> bool {
    scope.leads(cell) || stands_for_all(&cell[Axis::Accel].name) || !scope.settings.quick
}

fn stands_for_all(accel: &str) -> bool {
    accel == PLAIN || accel == BRUTE_FORCE
}

/// A cell while its cases are traced.
struct OpenCell<'a> {
    kind: Kind<'a>,
    test: AnyTriangleTest,
    /// True if its test is the one that is tried everywhere.
    leads: bool,
    tally: Tally,
    slowdown: Option<f64>,
    failures: Vec<String>,
    asked_any: bool,
    found: Found,
}

impl<'a> OpenCell<'a> {
    fn new(suite: &Suite, cell: &'a Cell) -> Result<Self, Absent> {
        Ok(Self {
            kind: suite.kind(cell)?,
            test: suite.test(cell)?,
            leads: suite.scope.leads(cell),
            tally: Tally::default(),
            slowdown: None,
            failures: Vec::new(),
            asked_any: false,
            found: Found::default(),
        })
    }

    /// Returns `true` if the case is traced: other tests than the leading one climb few rungs through structures
    /// other than the plain one.
    fn takes(&self, case: &Case, quick: bool) -> bool {
        let coarse = Placement::ladder(true).contains(&case.place);
        self.leads || stands_for_all(&self.kind.variant.name) || (coarse && !quick)
    }

    /// Returns `true` if any-hit queries are traced: in a quick suite only through the plain structure, since every
    /// kernel has to be compiled.
    fn asks_any(&self, quick: bool) -> bool {
        self.leads && (!quick || self.kind.is(PLAIN))
    }

    fn found(self) -> Found {
        let mut found = self.found;
        let is_brute_force = self.kind.is(BRUTE_FORCE);
        let at = Key::default();
        let slowdown = self.slowdown.map(|ratio| (&figure::SLOWDOWN, ratio));
        self.tally
            .tell(&mut found, &at, self.asked_any, is_brute_force);
        found.add(&at, slowdown);
        found.failures(&at, self.failures);
        found
    }
}

impl Suite<'_> {
    /// Returns the default box test with a triangle test.
    pub(crate) fn with(triangle: AnyTriangleTest) -> Intersection {
        Intersection {
            triangle,
            ..Intersection::default()
        }
    }

    /// Returns the device that times are measured on.
    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpus[0]
    }

    /// Returns the structure of a cell.
    ///
    /// # Errors
    /// It is not registered.
    pub(crate) fn kind<'c>(&self, cell: &'c Cell) -> Result<Kind<'c>, Absent> {
        let variant = &cell[Axis::Accel];
        let accel = self.registries.accel.get(&variant.name);
        let unknown = || Absent::Failed(format!("there is no structure {variant}"));
        let accel = accel.ok_or_else(unknown)?;
        Ok(Kind { accel, variant })
    }

    /// Returns the triangle test of a cell.
    ///
    /// # Errors
    /// It is not registered.
    pub(crate) fn test(&self, cell: &Cell) -> Result<AnyTriangleTest, Absent> {
        let name = &cell[Axis::Triangle].name;
        let test = self.registries.triangles.named("triangle test", name);
        test.map_err(Absent::Failed)
    }

    /// Deals the items out to the devices, which work at once.
    pub(super) fn on_devices<T: Send>(
        &self,
        items: &mut [T],
        work: impl Fn(&Gpu, &mut T) -> Result<(), Absent> + Sync,
    ) -> Result<(), Absent> {
        let mut hands: Vec<Vec<&mut T>> = self.gpus.iter().map(|_| Vec::new()).collect();
        for (place, item) in items.iter_mut().enumerate() {
            hands[place % self.gpus.len()].push(item);
        }
        let play = |gpu, hand: Vec<&mut T>| hand.into_iter().try_for_each(|item| work(gpu, item));
        std::thread::scope(|scope| {
            let players: Vec<_> = (self.gpus.iter().zip(hands))
                .map(|(gpu, hand)| scope.spawn(|| play(gpu, hand)))
                .collect();
            let mut ends = players.into_iter().map(|player| player.join());
            ends.try_for_each(|end| end.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
        })
    }

    /// Returns `true` if this case is timed against ordinary rays: the first of a family, and all whose rays are not
    /// numbers; only a few of the latter in a quick suite.
    fn is_timed(&self, case: &Case, timed: usize) -> bool {
        let strange = case.family == "non-finite";
        if self.scope.settings.quick {
            strange && timed < TIMED_IF_QUICK
        } else {
            strange || timed == 0
        }
    }

    /// Traces one case through all structures with one triangle test.
    fn case(
        &self,
        case: &Case,
        reference: &CaseTruth,
        cells: &mut [OpenCell],
    ) -> Result<(), Absent> {
        let test = cells[0].test;
        let quick = self.scope.settings.quick;
        let soup = TriangleSoup::new(&case.scene).intersecting(Self::with(test));
        let expected = Expected::new(&soup, &case.rays);
        // Structures mostly answer as brute force does: its answers are checked once.
        let known = expected.of(Space::World);
        let outcomes = reference.judge_all(known);
        self.on_devices(cells, |gpu, cell| {
            if !cell.takes(case, quick) {
                return Ok(());
            }
            let built = match cell.kind.build(&soup) {
                Ok(built) => built,
                Err(reason) => {
                    let text = format!("{}: {reason}", case.label);
                    cell.found.note(&Key::default(), "left out", text);
                    return Ok(());
                }
            };
            let stage = Stage::new(gpu, case.scene.clone(), Self::with(test))?;
            let trace = Trace {
                suite: self,
                case,
                reference,
                stage: &stage,
                expected: &expected,
                judged: known.iter().zip(&outcomes).collect(),
            };
            match trace.run(&*built, cell) {
                Err(error @ (GpuError::Lost(_) | GpuError::Timeout { .. })) => Err(error.into()),
                Err(error) => {
                    cell.failures.push(format!("{}: {error}", case.label));
                    Ok(())
                }
                Ok(()) => Ok(()),
            }
        })
    }

    /// Times the case with the leading test through every structure that can be built; in a quick suite not through
    /// brute force, whose work is the same for all rays.
    fn time(&self, case: &Case, cells: &mut [OpenCell]) -> Result<(), Absent> {
        let stage = Stage::new(self.gpu(), case.scene.clone(), Intersection::default())?;
        let count = self.scope.settings.either(TIMED_RAYS);
        let ordinary = bench::ordinary_rays(case, self.seed, count);
        let rays = bench::repeated(&case.rays, count);
        let quick = self.scope.settings.quick;
        let cells = cells.iter_mut().filter(|cell| cell.leads);
        for cell in cells.filter(|cell| !quick || !cell.kind.is(BRUTE_FORCE)) {
            if let Ok(built) = cell.kind.build(&stage.soup) {
                let traced = Traced::upload(&stage.gpu, &*built)?;
                let ratio = bench::ratio(&stage, &traced, &rays, &ordinary)?;
                cell.slowdown = Some(cell.slowdown.map_or(ratio, |s: f64| s.max(ratio)));
            }
        }
        Ok(())
    }

    /// Returns the command that shows how a structure with a triangle test traces a ray of a family's case.
    pub(crate) fn replay(
        &self,
        [family, label]: [&str; 2],
        [kind, test]: [&str; 2],
        ray: &Ray,
    ) -> String {
        let address = Address {
            family: family.to_owned(),
            label: label.to_owned(),
            seed: self.seed,
        };
        format!("raystone trace --scene '{address}' --accel {kind} --triangle {test} --ray '{ray}'")
    }
}

/// Traces one family through the structures of the cells with their triangle tests.
///
/// # Errors
/// The device is lost or hangs.
pub(crate) fn families(suite: &Suite, cells: &[Cell]) -> Results {
    let Some(family) = cells.first().and_then(|cell| Family::named(part_of(cell))) else {
        return Ok(Vec::new());
    };
    let settings = &suite.scope.settings;
    let cases = family.cases(suite.seed, settings.quick, settings.rays_of_a_case());
    let open = cells.iter().map(|cell| OpenCell::new(suite, cell));
    let mut open = open.collect::<Result<Vec<_>, _>>()?;
    let mut timed = 0;
    for case in &cases {
        let reference = CaseTruth::new(case);
        for row in open.chunk_by_mut(|a, b| a.test == b.test) {
            suite.case(case, &reference, row)?;
        }
        if suite.is_timed(case, timed) {
            timed += 1;
            suite.time(case, &mut open)?;
        }
    }
    Ok(open.into_iter().map(OpenCell::found).collect())
}

/// One case through one structure with one triangle test.
struct Trace<'a> {
    suite: &'a Suite<'a>,
    case: &'a Case,
    reference: &'a CaseTruth<'a>,
    stage: &'a Stage,
    expected: &'a Expected,
    /// Answers whose outcomes are known.
    judged: Vec<(&'a Hit, &'a Outcome)>,
}

impl Trace<'_> {
    fn run(&self, built: &dyn BuiltAccel, cell: &mut OpenCell) -> Result<(), GpuError> {
        let case = self.case;
        let traced = Traced::upload(&self.stage.gpu, built)?;
        let found = self.stage.closest(&traced, &case.rays)?;
        let expected = self.expected.of(built.space());
        let (kind, test) = (cell.kind, cell.test);
        let replay = |index: usize| {
            let ray = &case.rays[index];
            let names = [kind.label(), test.name()];
            self.suite.replay([case.family, &case.label], names, ray)
        };
        let mut errors = found.errors;
        let mut tally = Tally::default();
        let closed = matches!(case.truth, Truth::Closed | Truth::Hit);
        for (index, hit) in found.answers.iter().enumerate() {
            let (known, known_outcome) = self.judged[index];
            let outcome = if hit.same_bits(known) {
                *known_outcome
            } else {
                self.reference.judge(index, hit)
            };
            tally.add(&outcome, closed, || replay(index));
            if !hit.same_bits(&expected[index]) {
                tally.note(6e9, "differs from brute force", || replay(index));
            }
        }
        self.compare(built, &found.answers, &mut tally);
        if cell.asks_any(self.suite.scope.settings.quick) {
            let any = self.stage.any(&traced, &case.rays)?;
            errors |= any.errors;
            for (index, (any, hit)) in any.answers.iter().zip(expected).enumerate() {
                if *any != (hit.triangle != NO_HIT) {
                    tally.count(&figure::ANY_DIFFERING, 1);
                    tally.note(7e9, "any hit differs from brute force", || replay(index));
                }
            }
            cell.asked_any = true;
        }
        if let Some(text) = bench::error_text(errors) {
            cell.failures.push(format!("{}: {text}", case.label));
        }
        if cell.kind.is(BRUTE_FORCE) {
            tally.tell_rung(&mut cell.found, case);
        }
        cell.tally.join(tally);
        Ok(())
    }

    /// Counts differences from brute force, and ties among them where the adapter computes otherwise.
    fn compare(&self, built: &dyn BuiltAccel, hits: &[Hit], tally: &mut Tally) {
        let truth = self.expected.of(built.space()).to_vec();
        let found: Vec<_> = (truth.iter())
            .map(|hit| Some(hit.triangle != NO_HIT))
            .collect();
        let set = RaySet {
            class: RayClass::Chord,
            rays: self.case.rays.clone(),
            truth,
            shadow: Vec::new(),
        };
        let exact = self.suite.exact;
        let verdict = gate::compare(&set, hits, &found, &self.stage.soup, built.space(), exact);
        tally.count(&figure::DIFFERING, verdict.wrong);
        tally.count(&figure::TIES, verdict.ties);
    }
}
