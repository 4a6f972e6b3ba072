//! From two lists of figures to findings: pairs, drift, correction for the number of tests.

use super::drift::{Drift, Place};
use super::facts::IMAGE;
use super::judge::{ChangeVerdict, IN_TURNS, Measured, Outcome, TimeRatio, compare, direction};
use super::side::{self, Side};
use super::taken::{Evidence, Taken, contradictions, taken};
use super::{Confirmed, Finding, Identity, Options};
use crate::format;
use raystone_record::figure::Spread;
use raystone_record::{FinishedRecord, RunRecord, all_of, axis};
use raystone_stats::hypothesis::benjamini_hochberg;
use std::collections::{BTreeMap, BTreeSet};

/// Measured with the shipped `ci.toml` (docs/compare.md): compilations alternate over the rounds, the data of a cell does not.
const PLACES: &str = "a cell may be some percent slower than its twin in all rounds of a process, perhaps by where its data lies (one of some 500 \
                      cells of equal work: 4 %), and lines in another order may compile to other code (9 % and more): another process tells the first";

/// Note on a run that was not made to compare its kernels.
const COMPILED_ONCE: &str = "each kernel was compiled once, and those of equal text together: what one compilation has over another by \
                             chance looks like a change of time, and controls do not show it; raystone compare --kernels compiles \
                             several times";

/// A finding on its way to a verdict.
pub(super) struct Open {
    pub finding: Finding,
    ratio: Option<TimeRatio>,
    identity: Identity,
}

pub(super) struct Work<'a> {
    options: &'a Options,
    in_rounds: bool,
    /// Number of compilations of each side.
    compilations: usize,
    /// The reason why times are not compared.
    refused: Option<String>,
    same_place: bool,
    /// `true` if the runs have different seeds.
    other_seeds: bool,
    pub findings: Vec<Open>,
    pub notes: Vec<String>,
    contradicted: BTreeSet<Identity>,
}

impl<'a> Work<'a> {
    pub(super) fn new(base: &Side, candidate: &Side, options: &'a Options) -> Self {
        let sides = [("base", base), ("candidate", candidate)];
        let mut notes = Vec::new();
        for (name, side) in sides {
            notes.extend(side.notes.iter().map(|note| format!("{name}: {note}")));
        }
        if base.in_rounds {
            notes = base.notes.clone();
        }
        let contradicted = [base, candidate]
            .iter()
            .flat_map(|s| contradictions(s))
            .collect();
        let refused = refusal(base, candidate);
        notes.extend(refused.clone());
        notes.extend(turned_round(base, candidate));
        let seeds = seeds_differ(base, candidate);
        notes.extend(seeds.clone());
        Self {
            options,
            in_rounds: base.in_rounds && candidate.in_rounds,
            compilations: base.compilations(),
            same_place: refused.is_none(),
            other_seeds: seeds.is_some(),
            refused,
            findings: Vec::new(),
            notes,
            contradicted,
        }
    }

    /// Pairs the figures of both sides, and compares all but times.
    pub(super) fn find(&mut self, base: &Side, candidate: &Side) {
        let mut theirs: BTreeMap<_, Taken> = BTreeMap::new();
        let mut order = Vec::new();
        for new in taken(candidate) {
            order.push(new.identity());
            theirs.insert(new.identity(), new);
        }
        for old in taken(base) {
            let identity = old.identity();
            let open = match theirs.remove(&identity) {
                Some(new) => self.pair(&old, &new),
                None => self.alone(&old, 0),
            };
            self.findings.push(open);
        }
        let rest = order.iter().filter_map(|identity| theirs.remove(identity));
        let ended = all_of::<FinishedRecord>(&base.lines).next().is_some();
        let rest = rest.map(|new| {
            let mut open = self.alone(&new, 1);
            if open.finding.verdict == ChangeVerdict::New && !ended {
                open.finding.verdict = ChangeVerdict::Undecided;
                open.finding.why = "the base did not reach its end, and lacks it".into();
            }
            open
        });
        let rest: Vec<Open> = rest.collect();
        self.findings.extend(rest);
    }

    fn pair(&self, old: &Taken, new: &Taken) -> Open {
        let identity = old.identity();
        let is_time = matches!(old.evidence, Evidence::Times { .. });
        // Bit-identical round by round: one was copied, as resumed runs do. It shows no drift either.
        let is_copy = is_time && self.refused.is_none() && old.evidence == new.evidence;
        let outcome = if self.contradicted.contains(&identity) {
            Outcome::Known(
                ChangeVerdict::Undecided,
                "the records contradict themselves: two lines on it differ".into(),
            )
        } else if let Some(why) = other_work(old, new).or_else(|| other_seeds(old, new)) {
            Outcome::Known(ChangeVerdict::Undecided, why)
        } else if is_copy {
            Outcome::Known(ChangeVerdict::Same, "the same measurement".into())
        } else if is_time {
            Outcome::Known(
                ChangeVerdict::Undecided,
                "its times cannot be compared".into(),
            )
        } else if old.figure.id == IMAGE && old.evidence != new.evidence {
            self.image()
        } else {
            compare(
                &old.figure,
                &old.evidence,
                &new.evidence,
                &self.options.effects,
            )
        };
        // Two lines of times do not contradict each other: `contradictions` ignores them.
        let other = other_work(old, new).or_else(|| other_seeds(old, new));
        let comparable = is_time && !is_copy && other.is_none();
        let ratio = TimeRatio::new(
            &old.evidence,
            &new.evidence,
            self.in_rounds,
            self.compilations,
        );
        let (verdict, why, measured) = match outcome {
            Outcome::Known(verdict, why) => (verdict, why, None),
            Outcome::Tested(measured) => (
                ChangeVerdict::Undecided,
                measured.how.to_owned(),
                Some(measured),
            ),
        };
        Open {
            finding: Finding {
                key: new.key.clone(),
                figure: new.figure.clone(),
                shown: shown(old, new).map(Some),
                measured,
                exact_change: exact_change(&old.evidence, &new.evidence),
                verdict,
                why,
                is_time,
                looks_worse: false,
                is_control: comparable && !old.kernel.is_empty() && old.kernel == new.kernel,
            },
            ratio: ratio.filter(|_| comparable),
            identity,
        }
    }

    /// Returns the finding on a figure of one side alone. A test that failed with other seeds is no evidence on the change.
    fn alone(&self, taken: &Taken, side: usize) -> Open {
        let mut open = alone(taken, side);
        let decided = matches!(
            open.finding.verdict,
            ChangeVerdict::Worse | ChangeVerdict::Better
        );
        if decided && taken.seed.is_some() && self.other_seeds {
            open.finding.verdict = ChangeVerdict::Undecided;
            open.finding.why += ", with other seeds (run.seed)";
        }
        open
    }

    fn image(&self) -> Outcome {
        match (self.options.effects.images, self.same_place) {
            (true, _) => Outcome::Known(ChangeVerdict::Changed, "other images are meant".into()),
            (_, false) => Outcome::Known(
                ChangeVerdict::Changed,
                "another device may round otherwise".into(),
            ),
            _ => Outcome::Known(
                ChangeVerdict::Worse,
                "another image from the same seeds: if that is meant, say --new-images".into(),
            ),
        }
    }

    /// Adds notes on effects in times of changed kernels that rounds and controls do not show.
    pub(super) fn warn_of_compilations(&mut self) {
        let is_alarm = |f: &Finding| {
            f.is_time
                && !f.is_control
                && matches!(f.verdict, ChangeVerdict::Worse | ChangeVerdict::Better)
        };
        if !self.in_rounds || !self.findings.iter().any(|open| is_alarm(&open.finding)) {
            return;
        }
        self.notes.push(PLACES.into());
        if self.compilations == 1 {
            self.notes.push(COMPILED_ONCE.into());
        }
    }

    /// Measures the ratios of times against the drift of controls.
    pub(super) fn measure_times(&mut self, confirmed: &Confirmed) {
        self.controls_did_the_same_work();
        let of_runs = self.drift(self.in_rounds, |open| open.ratio.as_ref());
        let of_confirmed = self.drift(true, |open| confirmed.get(&open.identity));
        if self.refused.is_none() {
            self.notes.extend(of_runs.words());
        }
        let margin = self.options.effects.time;
        let (in_rounds, refused) = (self.in_rounds, self.refused.is_some());
        for open in self.findings.iter_mut().filter(|open| open.finding.is_time) {
            let again = confirmed.get(&open.identity);
            let Some(ratio) = again.or(open.ratio.as_ref()) else {
                continue;
            };
            let finding = &mut open.finding;
            // Equal kernels are no control of two alternating programs.
            finding.is_control &= ratio.clock != IN_TURNS;
            if refused && again.is_none() {
                finding.why = "times of different devices or machines are not compared".into();
                finding.is_control = false;
                continue;
            }
            let drift = if again.is_some() {
                &of_confirmed
            } else {
                &of_runs
            };
            let own = finding.is_control.then_some(ratio.log);
            let spread = drift.of(&place(finding, ratio.clock), ratio.rounds.variance, own);
            let measured = ratio.measured(&finding.figure, spread, margin);
            let grew = direction(&finding.figure, measured.change.value) == ChangeVerdict::Worse;
            finding.looks_worse =
                grew && measured.change.value.abs() > margin && !in_rounds && again.is_none();
            if spread.is_none() && !in_rounds && again.is_none() {
                finding.why =
                    "two runs without enough unchanged cells to tell the machine's drift by".into();
                let moved = format!("{:+.1}", 100.0 * measured.change.value);
                finding.why += &format!("; it moved by {} %", moved.replace('-', "−"));
                continue;
            }
            finding.why = format!("{}, {}", ratio.clock, measured.how);
            if again.is_some() {
                finding.why += ", measured again side by side";
            }
            finding.measured = Some(measured);
        }
    }

    /// Collects the movement of the controls.
    fn drift<'o>(
        &'o self,
        in_rounds: bool,
        ratio: impl Fn(&'o Open) -> Option<&'o TimeRatio>,
    ) -> Drift {
        let mut drift = Drift::new(in_rounds);
        for open in self.findings.iter().filter(|open| open.finding.is_control) {
            if let Some(ratio) = ratio(open).filter(|ratio| ratio.clock != IN_TURNS) {
                drift.add(
                    place(&open.finding, ratio.clock),
                    ratio.log,
                    ratio.rounds.variance,
                );
            }
        }
        drift
    }

    /// Drops controls where an exact figure of the same structure differs: then the data did change.
    fn controls_did_the_same_work(&mut self) {
        let of = |f: &Finding| [axis::SCENE, axis::ACCEL].map(|axis| f.key.label(axis).to_owned());
        let differs = |f: &&Open| {
            let exact = !f.finding.is_time && f.finding.figure.spread == Spread::Exact;
            exact && !matches!(f.finding.verdict, ChangeVerdict::Same | ChangeVerdict::New)
        };
        let touched: BTreeSet<[String; 2]> = self
            .findings
            .iter()
            .filter(differs)
            .map(|f| of(&f.finding))
            .collect();
        for open in &mut self.findings {
            let finding = &mut open.finding;
            finding.is_control &= !touched.contains(&of(finding));
        }
    }

    /// Gives verdicts to the tested differences, controls among themselves, all others together. Returns the number of tests.
    pub(super) fn decide(&mut self) -> usize {
        let mut tests = 0;
        for is_control in [true, false] {
            let tested = self.findings.iter_mut().map(|open| &mut open.finding);
            let mut tested: Vec<&mut Finding> = tested
                .filter(|f| f.measured.is_some() && f.is_control == is_control)
                .collect();
            let p: Vec<f64> = tested
                .iter()
                .map(|f| f.measured.map_or(1.0, |m| m.p))
                .collect();
            let rejected = benjamini_hochberg(&p, self.options.alpha);
            for (finding, rejected) in tested.iter_mut().zip(rejected) {
                decide(finding, rejected);
            }
            tests += if is_control { 0 } else { p.len() };
        }
        if !self.options.times_decide {
            for open in self.findings.iter_mut().filter(|open| open.finding.is_time) {
                open.finding.verdict = ChangeVerdict::Told;
            }
        }
        tests
    }
}

fn decide(finding: &mut Finding, rejected: bool) {
    let Some(Measured { change, margin, .. }) = finding.measured else {
        return;
    };
    let within = change.low > -margin && change.high < margin;
    let counts = rejected && change.value.abs() >= margin;
    finding.verdict = match (finding.is_control, counts) {
        (false, true) => direction(&finding.figure, change.value),
        (false, false) if within => ChangeVerdict::Same,
        (false, false) => ChangeVerdict::Undecided,
        (true, false) => ChangeVerdict::Same,
        (true, true) => ChangeVerdict::Undecided,
    };
    if finding.is_control {
        finding.why = if counts {
            format!(
                "kernels and work are equal, but it moved unlike all others ({})",
                finding.why
            )
        } else {
            "equal kernels and work: a control".into()
        };
    }
}

/// Returns the values as shown; exact ones that differ only in digits that tables omit have as many as tell them apart.
fn shown(old: &Taken, new: &Taken) -> [String; 2] {
    match (&old.evidence, &new.evidence) {
        (Evidence::Exact(a), Evidence::Exact(b)) if a != b && old.shown == new.shown => {
            told_apart([*a, *b])
        }
        _ => [old, new].map(|taken| taken.shown.clone()),
    }
}

/// Returns two numbers with as few digits as tell them apart, at least four.
fn told_apart(pair: [f64; 2]) -> [String; 2] {
    let rounded = |x: f64, after: usize| format!("{x:.after$e}").parse().unwrap_or(x);
    let with = |after| pair.map(|x: f64| f64::to_string(&rounded(x, after)));
    let told = (3..16).map(with).find(|[a, b]| a != b);
    told.unwrap_or_else(|| pair.map(|x| x.to_string()))
}

fn exact_change(old: &Evidence, new: &Evidence) -> Option<f64> {
    match (old, new) {
        (Evidence::Exact(a), Evidence::Exact(b)) | (Evidence::Once(a), Evidence::Once(b)) => {
            let part = (b - a) / a.abs();
            (part.is_finite() && part != 0.0).then_some(part)
        }
        _ => None,
    }
}

fn place(finding: &Finding, clock: &'static str) -> Place {
    Place {
        figure: finding.figure.title.to_string(),
        scene: finding.key.label(axis::SCENE).to_owned(),
        clock,
    }
}

/// Returns the finding on a figure of one side alone.
fn alone(taken: &Taken, side: usize) -> Open {
    let fails = matches!(taken.evidence, Evidence::Fact { fails: true, .. });
    let (verdict, why) = match (side, fails) {
        (0, true) => (ChangeVerdict::Better, "it failed before".to_owned()),
        (0, false) => (
            ChangeVerdict::Undecided,
            "missing in the candidate".to_owned(),
        ),
        (_, true) => (ChangeVerdict::Worse, "a new failure".to_owned()),
        _ => (ChangeVerdict::New, String::new()),
    };
    let mut shown = [None, None];
    shown[side] = Some(taken.shown.clone());
    Open {
        finding: Finding {
            key: taken.key.clone(),
            figure: taken.figure.clone(),
            shown,
            measured: None,
            exact_change: None,
            verdict,
            why,
            is_time: matches!(taken.evidence, Evidence::Times { .. }),
            is_control: false,
            looks_worse: false,
        },
        ratio: None,
        identity: taken.identity(),
    }
}

/// Returns the reason why two figures are not of the same work.
fn other_work(old: &Taken, new: &Taken) -> Option<String> {
    if old.work != new.work {
        return Some(format!("other work: {} before, {} now", old.work, new.work));
    }
    let parameters = |taken: &Taken| -> BTreeMap<String, String> {
        let axes = taken
            .key
            .labels()
            .filter_map(|(axis, _)| Some((axis, taken.key.get(axis)?)));
        let all = axes.flat_map(|(axis, variant)| {
            let values = variant.params.0.iter();
            values.map(move |(name, value)| (format!("{axis}.{name}"), value.to_string()))
        });
        all.collect()
    };
    let (old, new) = (parameters(old), parameters(new));
    let changed = |(name, value): (&String, &String)| {
        let before = old.get(name)?;
        (before != value).then(|| format!("another default: {name} was {before} and is {value}"))
    };
    new.iter().find_map(changed)
}

/// Returns the reason why two differing figures cannot be compared: single samples of different seeds show no spread.
fn other_seeds(old: &Taken, new: &Taken) -> Option<String> {
    let (a, b) = (old.seed?, new.seed?);
    let differ = a != b && old.evidence != new.evidence;
    differ.then(|| format!("other seeds: run.seed was {a} and is {b}, so that it is of other rays"))
}

/// Returns a note if the candidate is older than the base, as when both are given in the wrong order.
fn turned_round(base: &Side, candidate: &Side) -> Option<String> {
    let start = |side: &Side| {
        all_of::<RunRecord>(&side.lines)
            .next()
            .map(|run| run.body.started_unix_s)
    };
    let (old, new) = (start(base)?, start(candidate)?);
    (new < old).then(|| {
        format!(
            "The candidate was measured before the base ({} and {}): BASE comes first.",
            format::utc(new),
            format::utc(old)
        )
    })
}

/// Returns a note on two runs with different seeds.
fn seeds_differ(base: &Side, candidate: &Side) -> Option<String> {
    let seed = |side: &Side| all_of::<RunRecord>(&side.lines).next()?.body.seed();
    let (a, b) = (seed(base)?, seed(candidate)?);
    (a != b).then(|| {
        format!(
            "The runs have other seeds (run.seed {a} and {b}): errors are compared as independent replicates; rays, their counters and \
             times, and pictures are other samples of the same, which one run each leaves open."
        )
    })
}

/// Returns the reason why the times of two sides cannot be compared, if any.
fn refusal(base: &Side, candidate: &Side) -> Option<String> {
    let all: Vec<_> = base
        .environments()
        .chain(candidate.environments())
        .collect();
    let Some((first, others)) = all.split_first() else {
        return Some("Times are not compared: no record says where they were taken.".into());
    };
    if base.environments().next().is_none() || candidate.environments().next().is_none() {
        return Some("Times are not compared: one side does not say where they were taken.".into());
    }
    let differing = others
        .iter()
        .flat_map(|other| side::differences(first, other))
        .next();
    let (name, a, b) = differing?;
    Some(format!(
        "Times are not compared: they were taken on different machines or devices ({name}: {a} against {b}). \
         Counters, errors and discrepancies are."
    ))
}
