//! The cells: every family through every structure with every triangle test.

use super::bench::{self, Expected};
use super::case::{Address, Case, Truth};
use super::families::{FAMILIES, Family};
use super::placement::Placement;
use super::record::{Findings, Line, Record, Rung, line, skipped};
use super::tally::{CaseJudge, Outcome, Tally};
use super::{StressError, StressOptions};
use raystone_accel::triangle::AnyTriangleTest;
use raystone_accel::{
    AccelKind, BuiltAccel, Hit, Intersection, NO_HIT, Ray, Space, Traced, TriangleSoup,
};
use raystone_gpu::{Gpu, GpuError};
use raystone_record::figure;
use raystone_record::{Key, RayClass, axis};
use raystone_render::Stage;
use raystone_verify::gate;
use raystone_verify::rays::RaySet;

/// Is told what is being done, by any thread.
pub(crate) type Progress<'a> = dyn Fn(&str) + Sync + 'a;

/// A structure under test.
pub(crate) type Kind = &'static dyn AccelKind;

/// The structure that every other one is compared with.
pub(crate) const BRUTE_FORCE: &str = "brute-force";
/// The structure that stands for all where not all are tried.
pub(crate) const PLAIN: &str = "bvh";
/// Cases that are timed if it has to be quick.
const TIMED_IF_QUICK: usize = 3;

/// What the suite runs on and with.
pub(crate) struct Suite<'a> {
    /// Devices of the adapter, one at least, which work at once where nothing is timed.
    pub gpus: &'a [Gpu],
    /// Whether it computes like the host.
    pub exact: bool,
    /// What to do.
    pub settings: &'a StressOptions,
    /// Structures, brute force among them if asked for.
    pub kinds: Vec<Kind>,
    /// Triangle tests, the default first.
    pub tests: Vec<AnyTriangleTest>,
}

/// What everything through a structure with a triangle test has in common.
pub(super) fn key(test: AnyTriangleTest, kind: Kind) -> Key {
    let key = Key::default().with(axis::TRIANGLE, test.name());
    key.with(axis::ACCEL, kind.name())
}

/// A cell while its cases are traced.
#[derive(Default)]
struct OpenCell {
    tally: Tally,
    rungs: Vec<Rung>,
    slowdown: Option<f64>,
    failures: Vec<String>,
    asked_any: bool,
}

impl OpenCell {
    fn findings(self) -> Findings {
        let mut found = self.tally.findings(self.asked_any);
        if let Some(slowdown) = self.slowdown {
            found.add(&figure::SLOWDOWN, slowdown);
        }
        Findings {
            failures: self.failures,
            rungs: self.rungs,
            ..found
        }
    }
}

impl Suite<'_> {
    /// The default triangle test with the default box test.
    pub(crate) fn with(triangle: AnyTriangleTest) -> Intersection {
        Intersection {
            triangle,
            ..Intersection::default()
        }
    }

    /// The device that times are measured on.
    pub(super) fn gpu(&self) -> &Gpu {
        &self.gpus[0]
    }

    /// Deals the items out to the devices, which work at once.
    pub(super) fn on_devices<T: Send>(
        &self,
        items: &mut [T],
        work: impl Fn(&Gpu, &mut T) -> Result<(), StressError> + Sync,
    ) -> Result<(), StressError> {
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

    /// Runs every family; `progress` is told what is being done.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub(crate) fn cells(&self, progress: &Progress) -> Result<Vec<Line>, StressError> {
        let chosen = |family: &&Family| self.settings.wants_family(family.name);
        let mut records = Vec::new();
        for family in FAMILIES.iter().filter(chosen) {
            progress(family.name);
            records.extend(self.family(family)?);
        }
        Ok(records)
    }

    fn family(&self, family: &Family) -> Result<Vec<Line>, StressError> {
        let settings = self.settings;
        let cases = family.cases(settings.seed, settings.quick, settings.rays);
        let row = || self.kinds.iter().map(|kind| (*kind, OpenCell::default()));
        let mut cells: Vec<Vec<(Kind, OpenCell)>> =
            (self.tests.iter()).map(|_| row().collect()).collect();
        let mut timed = 0;
        for case in &cases {
            let judge = CaseJudge::new(case);
            for (test, row) in self.tests.iter().zip(&mut cells) {
                self.case(case, &judge, *test, row)?;
            }
            if let Some(row) = cells.first_mut().filter(|_| self.is_timed(case, timed)) {
                timed += 1;
                self.time(case, row)?;
            }
        }
        let mut records = Vec::new();
        for (test, row) in self.tests.iter().zip(cells) {
            for (kind, cell) in row {
                let key = key(*test, kind).with(axis::FAMILY, family.name);
                records.push(match cell.rungs.is_empty() && cell.failures.is_empty() {
                    true => {
                        let what = format!("{}, {}, {}", test.name(), kind.name(), family.name);
                        skipped(key, what, "every case of it is left to other cells")
                    }
                    false => line(key, Record::Cell(cell.findings())),
                });
            }
        }
        Ok(records)
    }

    /// Whether this case is timed against ordinary rays: the first of a family, and all whose rays are not
    /// numbers; of these a few if it has to be quick.
    fn is_timed(&self, case: &Case, timed: usize) -> bool {
        let strange = case.family == "non-finite";
        match self.settings.quick {
            true => strange && timed < TIMED_IF_QUICK,
            false => strange || timed == 0,
        }
    }

    /// Other tests than the default one climb few rungs through structures other than the plain one.
    fn takes(&self, case: &Case, test: AnyTriangleTest, kind: Kind) -> bool {
        let is_default = Some(&test) == self.tests.first();
        let stands_for_all = kind.name() == PLAIN || kind.name() == BRUTE_FORCE;
        let coarse = Placement::ladder(true).contains(&case.place);
        is_default || stands_for_all || (coarse && !self.settings.quick)
    }

    /// Whether any hit is asked for: with the default test; through the plain structure only if it has to
    /// be quick, since every kernel has to be compiled.
    fn asks_any(&self, test: AnyTriangleTest, kind: Kind) -> bool {
        let is_default = Some(&test) == self.tests.first();
        is_default && (!self.settings.quick || kind.name() == PLAIN)
    }

    fn case(
        &self,
        case: &Case,
        judge: &CaseJudge,
        test: AnyTriangleTest,
        cells: &mut [(Kind, OpenCell)],
    ) -> Result<(), StressError> {
        let soup = TriangleSoup::new(&case.scene).intersecting(Self::with(test));
        let expected = Expected::new(&soup, &case.rays);
        // Structures mostly answer what brute force does: its answers are judged once.
        let known = expected.of(Space::World);
        let outcomes = judge.judge_all(known);
        self.on_devices(cells, |gpu, (kind, cell)| {
            if !self.takes(case, test, *kind) {
                return Ok(());
            }
            let built = match bench::build(*kind, &soup) {
                Ok(built) => built,
                Err(reason) => {
                    cell.failures.push(format!("{}: {reason}", case.label));
                    return Ok(());
                }
            };
            let stage = Stage::new(gpu, case.scene.clone(), Self::with(test))?;
            let trace = Trace {
                suite: self,
                case,
                judge,
                stage: &stage,
                expected: &expected,
                judged: known.iter().zip(&outcomes).collect(),
                test,
            };
            match trace.run(*kind, &*built, cell) {
                Err(error @ (GpuError::Lost(_) | GpuError::Timeout { .. })) => Err(error.into()),
                Err(error) => {
                    cell.failures.push(format!("{}: {error}", case.label));
                    Ok(())
                }
                Ok(()) => Ok(()),
            }
        })
    }

    /// Times the case with the default test through every structure that can be built; not through brute
    /// force, which does the same whatever the rays, if it has to be quick.
    fn time(&self, case: &Case, cells: &mut [(Kind, OpenCell)]) -> Result<(), StressError> {
        let stage = Stage::new(self.gpu(), case.scene.clone(), Intersection::default())?;
        let count = self.settings.timed_rays();
        let ordinary = bench::ordinary_rays(case, self.settings.seed, count);
        let rays = bench::repeated(&case.rays, count);
        let takes = |kind: Kind| !self.settings.quick || kind.name() != BRUTE_FORCE;
        for (kind, cell) in cells.iter_mut().filter(|(kind, _)| takes(*kind)) {
            if let Ok(built) = bench::build(*kind, &stage.soup) {
                let ratio = bench::ratio(
                    &stage,
                    &Traced::upload(&stage.gpu, &*built)?,
                    &rays,
                    &ordinary,
                )?;
                cell.slowdown = Some(cell.slowdown.map_or(ratio, |s: f64| s.max(ratio)));
            }
        }
        Ok(())
    }

    /// The command that shows what a structure with a triangle test does with a ray of a family's case.
    pub(crate) fn replay(
        &self,
        [family, label]: [&str; 2],
        [kind, test]: [&str; 2],
        ray: &Ray,
    ) -> String {
        let address = Address {
            family: family.to_owned(),
            label: label.to_owned(),
            seed: self.settings.seed,
        };
        format!("raystone trace --scene '{address}' --accel {kind} --triangle {test} --ray '{ray}'")
    }
}

/// One case through one structure with one triangle test.
struct Trace<'a> {
    suite: &'a Suite<'a>,
    case: &'a Case,
    judge: &'a CaseJudge<'a>,
    stage: &'a Stage,
    expected: &'a Expected,
    /// Answers whose outcomes are known.
    judged: Vec<(&'a Hit, &'a Outcome)>,
    test: AnyTriangleTest,
}

impl Trace<'_> {
    fn run(&self, kind: Kind, built: &dyn BuiltAccel, cell: &mut OpenCell) -> Result<(), GpuError> {
        let case = self.case;
        let traced = Traced::upload(&self.stage.gpu, built)?;
        let found = self.stage.closest(&traced, &case.rays)?;
        let expected = self.expected.of(built.space());
        let replay = |index: usize| {
            let ray = &case.rays[index];
            let names = [kind.name(), self.test.name()];
            self.suite.replay([case.family, &case.label], names, ray)
        };
        let mut errors = found.errors;
        let mut tally = Tally::default();
        let closed = matches!(case.truth, Truth::Closed | Truth::Hit);
        for (index, hit) in found.answers.iter().enumerate() {
            let (known, known_outcome) = self.judged[index];
            let outcome = match hit.same_bits(known) {
                true => *known_outcome,
                false => self.judge.judge(index, hit),
            };
            tally.add(&outcome, closed, || replay(index));
            if !hit.same_bits(&expected[index]) {
                tally.note(6e9, "differs from brute force", || replay(index));
            }
        }
        self.compare(built, &found.answers, &mut tally);
        if self.suite.asks_any(self.test, kind) {
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
        cell.rungs.push(tally.rung(case));
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
