//! The cells: every family through every structure with every triangle test.

use super::bench::{self, Expected, Stage};
use super::case::{Address, Case, Truth, ray_text};
use super::families::{FAMILIES, Family};
use super::place::Place;
use super::record::{CellRecord, Record, SkippedRecord};
use super::tally::{Judge, Outcome, Tally};
use super::{Settings, StressError};
use crate::accel::triangle::TriangleTest;
use crate::accel::{AccelKind, BuiltAccel, Hit, Intersection, NO_HIT};
use crate::gpu::{Gpu, GpuError};
use crate::integrator::Traced;
use crate::measure::gate;
use crate::measure::rays::RaySet;
use crate::measure::record::RayClass;

/// A structure under test.
pub type Kind = &'static dyn AccelKind;

/// The structure that every other one is compared with.
pub const BRUTE_FORCE: &str = "brute-force";
/// The structure that stands for all where not all are tried.
pub const PLAIN: &str = "bvh";

/// What the suite runs on and with.
pub struct Suite<'a> {
    /// The adapter.
    pub gpu: &'a Gpu,
    /// Whether it computes like the host.
    pub exact: bool,
    /// What to do.
    pub settings: &'a Settings,
    /// Structures, brute force among them if asked for.
    pub kinds: Vec<Kind>,
    /// Triangle tests, the default first.
    pub tests: Vec<TriangleTest>,
}

/// A cell while its cases are traced.
#[derive(Default)]
struct Cell {
    tally: Tally,
    rungs: Vec<super::record::Rung>,
    slowdown: Option<f64>,
    failures: Vec<String>,
    asked_any: bool,
}

impl Suite<'_> {
    /// The default triangle test with the default box test.
    pub fn with(triangle: TriangleTest) -> Intersection {
        Intersection {
            triangle,
            ..Intersection::default()
        }
    }

    /// Runs every family; `progress` is told what is being done.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn cells(&self, progress: &dyn Fn(&str)) -> Result<Vec<Record>, StressError> {
        let chosen = |family: &&Family| self.settings.wants_family(family.name);
        let mut records = Vec::new();
        for family in FAMILIES.iter().filter(chosen) {
            progress(family.name);
            records.extend(self.family(family)?);
        }
        Ok(records)
    }

    fn family(&self, family: &Family) -> Result<Vec<Record>, StressError> {
        let settings = self.settings;
        let cases = family.cases(settings.seed, settings.quick, settings.rays);
        let mut cells: Vec<Vec<Cell>> = (self.tests.iter())
            .map(|_| self.kinds.iter().map(|_| Cell::default()).collect())
            .collect();
        let mut timed = 0;
        for case in &cases {
            let judge = Judge::new(case);
            let is_timed = self.is_timed(case, timed);
            timed += usize::from(is_timed);
            for (row, test) in self.tests.iter().enumerate() {
                self.case(case, &judge, *test, is_timed && row == 0, &mut cells[row])?;
            }
        }
        let mut records = Vec::new();
        for (test, row) in self.tests.iter().zip(cells) {
            for (kind, cell) in self.kinds.iter().zip(row) {
                records.push(match cell.rungs.is_empty() && cell.failures.is_empty() {
                    true => Record::Skipped(SkippedRecord {
                        what: format!("{}, {}, {}", test.name(), kind.name(), family.name),
                        reason: "every case of it is left to other cells".into(),
                    }),
                    false => Record::Cell(cell.record(*test, kind.name(), family.name)),
                });
            }
        }
        Ok(records)
    }

    /// Whether this case is timed against ordinary rays: the first of a family, and all that are not
    /// numbers.
    fn is_timed(&self, case: &Case, timed: usize) -> bool {
        let strange = case.family == "non-finite";
        strange || (timed == 0 && !self.settings.quick)
    }

    /// Other tests than the default one climb few rungs through structures other than the plain one.
    fn takes(&self, case: &Case, test: TriangleTest, kind: Kind) -> bool {
        let is_default = Some(&test) == self.tests.first();
        let stands_for_all = kind.name() == PLAIN || kind.name() == BRUTE_FORCE;
        let coarse = Place::ladder(true).contains(&case.place);
        is_default || stands_for_all || (coarse && !self.settings.quick)
    }

    fn case(
        &self,
        case: &Case,
        judge: &Judge,
        test: TriangleTest,
        timed: bool,
        cells: &mut [Cell],
    ) -> Result<(), StressError> {
        let stage = Stage::new(self.gpu, &case.scene, Self::with(test))?;
        let expected = stage.brute_force(&case.rays);
        let is_default = Some(&test) == self.tests.first();
        // Structures mostly answer what brute force does: its answers are judged once.
        let mut judged: Option<(Vec<Hit>, Vec<Outcome>)> = None;
        for (kind, cell) in self.kinds.iter().zip(cells) {
            if !self.takes(case, test, *kind) {
                continue;
            }
            let built = match bench::build(*kind, &stage.soup) {
                Ok(built) => built,
                Err(reason) => {
                    cell.failures.push(format!("{}: {reason}", case.label));
                    continue;
                }
            };
            let trace = Trace {
                suite: self,
                case,
                judge,
                stage: &stage,
                expected: &expected,
                test,
            };
            let traced = stage.upload(&*built)?;
            let outcome = trace.run(*kind, &*built, &traced, is_default, cell, &mut judged);
            match outcome {
                Err(error @ (GpuError::Lost(_) | GpuError::Timeout { .. })) => {
                    return Err(error.into());
                }
                Err(error) => cell.failures.push(format!("{}: {error}", case.label)),
                Ok(()) => {}
            }
            if timed {
                let count = self.settings.timed_rays();
                let ordinary = bench::ordinary_rays(case, self.settings.seed, count);
                let rays = bench::repeated(&case.rays, count);
                let ratio = bench::ratio(&stage, &traced, &rays, &ordinary)?;
                cell.slowdown = Some(cell.slowdown.map_or(ratio, |s: f64| s.max(ratio)));
            }
        }
        Ok(())
    }

    /// The command that shows what a structure does with a ray of a case.
    pub fn replay(
        &self,
        case: &Case,
        kind: &str,
        test: TriangleTest,
        ray: &crate::accel::Ray,
    ) -> String {
        let address = Address {
            family: case.family.to_owned(),
            label: case.label.clone(),
            seed: self.settings.seed,
        };
        format!(
            "raystone trace --scene '{address}' --accel {kind} --triangle {} --ray '{}'",
            test.name(),
            ray_text(ray)
        )
    }
}

/// One case through one structure with one triangle test.
struct Trace<'a> {
    suite: &'a Suite<'a>,
    case: &'a Case,
    judge: &'a Judge<'a>,
    stage: &'a Stage<'a>,
    expected: &'a Expected,
    test: TriangleTest,
}

impl Trace<'_> {
    fn run(
        &self,
        kind: Kind,
        built: &dyn BuiltAccel,
        traced: &Traced,
        ask_any: bool,
        cell: &mut Cell,
        judged: &mut Option<(Vec<Hit>, Vec<Outcome>)>,
    ) -> Result<(), GpuError> {
        let case = self.case;
        let found = self.stage.closest(traced, &case.rays)?;
        let expected = self.expected.of(built.space());
        let mut errors = found.errors;
        let (known, outcomes) = judged
            .get_or_insert_with(|| (found.answers.clone(), self.judge.judge_all(&found.answers)));
        let mut tally = Tally::default();
        let closed = matches!(case.truth, Truth::Closed | Truth::Hit);
        for (index, (hit, ray)) in found.answers.iter().zip(&case.rays).enumerate() {
            let outcome = match hit.same_bits(&known[index]) {
                true => outcomes[index],
                false => self.judge.judge(index, hit),
            };
            let replay = || self.suite.replay(case, kind.name(), self.test, ray);
            tally.add(&outcome, closed, replay);
            if !hit.same_bits(&expected[index]) {
                tally.note(6e9, "differs from brute force", replay);
            }
        }
        self.compare(built, &found.answers, &mut tally);
        if ask_any {
            let any = self.stage.any(traced, &case.rays)?;
            errors |= any.errors;
            let pairs = any.answers.iter().zip(expected);
            let differ = pairs.filter(|(any, hit)| **any != (hit.triangle != NO_HIT));
            tally.any_differing = differ.count();
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
        let found: Vec<bool> = truth.iter().map(|hit| hit.triangle != NO_HIT).collect();
        let set = RaySet {
            class: RayClass::Chord,
            rays: self.case.rays.clone(),
            truth,
        };
        let exact = self.suite.exact;
        let verdict = gate::compare(&set, hits, &found, &self.stage.soup, built.space(), exact);
        tally.differing = verdict.wrong;
        tally.ties = verdict.ties;
    }
}

impl Cell {
    fn record(self, test: TriangleTest, accel: &str, family: &str) -> CellRecord {
        let tally = self.tally;
        CellRecord {
            triangle: test.name().to_owned(),
            accel: accel.to_owned(),
            family: family.to_owned(),
            rays: tally.rays,
            false_misses: tally.false_misses,
            unexplained_misses: tally.unexplained_misses,
            cracks: tally.cracks,
            false_hits: tally.false_hits,
            unexplained_hits: tally.unexplained_hits,
            wrong_triangle: tally.wrong_triangle,
            not_nearest: tally.not_nearest,
            borderline: tally.borderline,
            differing: tally.differing,
            any_differing: self.asked_any.then_some(tally.any_differing),
            ties: tally.ties,
            t_ulp: tally.quantiles(0),
            t_relative: tally.quantiles(1),
            point_ulp: tally.quantiles(2),
            point_relative: tally.quantiles(3),
            slowdown: self.slowdown,
            failures: self.failures,
            worst: tally.worst.map(|(_, worst)| worst),
            rungs: self.rungs,
        }
    }
}
