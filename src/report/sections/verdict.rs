//! Who wins, per scene.

use super::rendering;
use crate::measure::comparison::LogFigure;
use crate::measure::figure::figure;
use crate::measure::record::{ClassTiming, Interval, RayClass, StructureRecord, axis};
use crate::measure::statistics::{LEAST_FOR_MEDIAN, Spread};
use crate::report::data::{Measured, RunData, SceneGroup, View};
use crate::report::document::*;
use crate::report::format;
use crate::report::ruling::{Contender, Ruling, judge};
use crate::report::samplers::{MeanError, MeasuredSampler, Metric, log_time, place_on};
use crate::report::values::Value;

/// The verdict box.
pub fn section(data: &RunData) -> Section {
    let mut section = Section::new("verdict", "Verdict");
    for scene in &data.scenes {
        let verdicts = table(scene).into_block();
        let none = || Block::Paragraph(format!("On {} nothing could be compared.", scene.name));
        section.blocks.push(verdicts.unwrap_or_else(none));
        let lines = rendering::disagreements(scene).into_iter();
        let warned = lines.map(|line| Block::Paragraph(format!("Warning: {line}.")));
        section.blocks.extend(warned);
        section.blocks.extend(apart(scene));
    }
    let rule = match (section.blocks.is_empty(), data.compactions.is_empty()) {
        (true, true) => "Nothing was measured.".to_owned(),
        (true, false) => "No structure and no sampler was measured. How the methods of compaction compare stands in \
                          their own section."
            .to_owned(),
        (false, _) => rule(data),
    };
    section.blocks.push(Block::Paragraph(rule));
    section
}

/// How winners are found, and how many comparisons that took.
fn rule(data: &RunData) -> String {
    let rulings = || data.scenes.iter().flat_map(rulings);
    let compared = || rulings().map(|(_, ruling)| ruling.comparisons());
    let questions = compared().filter(|pairs| *pairs > 0).count();
    format!(
        "A winner is named only where it differs from every other: by Welch's test of the logarithms, with the noise of \
         images, reference and times together, at 5 % for all pairs of a question (Holm's correction). Where a question \
         stays undecided, those are named that do not differ from the best. {} made in {}.",
        format::plural(compared().sum(), "comparison"),
        format::plural(questions, "question")
    )
}

/// Questions of one scene, each with what is ruled.
fn rulings(scene: &SceneGroup) -> Vec<(String, Ruling)> {
    let mut rulings = Vec::new();
    for class in ray_classes(scene) {
        let question = format!("fastest, {} rays (Mrays/s)", format::ray_class(class));
        rulings.push((question, fastest(scene, class)));
    }
    for view in scene
        .views
        .iter()
        .filter(|view| view.valid_times().next().is_some())
    {
        let question = format!("fastest for rendering: {} (ms per spp)", view.name);
        rulings.push((question, rendering::fastest(scene, view)));
    }
    let metric = Metric::RelMse.name();
    for view in &scene.views {
        if let Some(spp) = view.common_spp() {
            let question = format!(
                "least error per sample: {}, {metric} at {spp} spp",
                view.name
            );
            rulings.push((question, best_per_sample(view, spp)));
        }
        if let Some(race) = Race::new(view) {
            let question = format!(
                "least error per second: {}, {metric} after {} s",
                view.name,
                format::number(race.seconds)
            );
            rulings.push((question, race.ruling()));
        }
    }
    rulings
}

/// The verdicts on one scene.
pub fn table(scene: &SceneGroup) -> Table {
    let mut table = Table::new(
        format!("Verdict on {}", scene.name),
        &[
            "question",
            ":answer",
            ":figure [95 % interval]",
            ":next best (ratio)",
            "pairs compared",
        ],
    );
    let rulings = rulings(scene);
    let rows = rulings
        .into_iter()
        .map(|(question, ruling)| row(question, &ruling));
    table.rows.extend(rows);
    table
}

fn row(question: String, ruling: &Ruling) -> Vec<TableCell> {
    let tone = match ruling {
        Ruling::Winner(..) => Tone::Good,
        Ruling::Nobody => Tone::Bad,
        Ruling::Withheld(_) | Ruling::Alone(_) | Ruling::Unclear(..) => Tone::Note,
    };
    let answer = TableCell::from(ruling.answer()).toned(tone);
    let (figure, next) = (ruling.figure(), ruling.runner_up());
    let pairs = ruling.comparisons().to_string();
    vec![
        question.into(),
        answer,
        figure.into(),
        next.into(),
        pairs.into(),
    ]
}

/// Who may not win, with the reason, and who is shown without being ranked.
fn apart(scene: &SceneGroup) -> Vec<Block> {
    let faulty =
        (scene.structures.iter()).filter_map(|s| Some(format!("{} ({})", s.structure, s.fault()?)));
    let samplers = || {
        let views = scene.views.iter();
        views.flat_map(|view| view.samplers.iter().map(move |s| (s, &view.name)))
    };
    let biased =
        samplers().filter_map(|(s, view)| Some(format!("{} with {view} ({})", s.name, s.fault()?)));
    let single = samplers().filter(|(s, _)| s.replicates.len() == 1);
    let single = single.map(|(s, view)| format!("{} with {view}", s.name));
    let said = [
        (
            format!("Left out of the comparison on {}", scene.name),
            faulty.chain(biased).collect::<Vec<_>>(),
        ),
        (
            format!(
                "Shown, but not ranked on {}, since one image tells nothing of their spread",
                scene.name
            ),
            single.collect(),
        ),
    ];
    let said = said.into_iter().filter(|(_, names)| !names.is_empty());
    let said = said.map(|(what, names)| format!("{what}: {}.", names.join("; ")));
    said.map(Block::Paragraph).collect()
}

/// Ray classes that some structure was timed on.
pub fn ray_classes(scene: &SceneGroup) -> Vec<RayClass> {
    let timings = scene.structures.iter().flat_map(|s| &s.timings);
    let mut classes: Vec<RayClass> = timings.map(|timing| timing.class).collect();
    classes.sort_unstable();
    classes.dedup();
    classes
}

/// Speed in a class, Mrays/s, of a structure that passed the gate and was timed often enough.
pub fn class_speed(s: &Measured<StructureRecord>, class: RayClass) -> Option<LogFigure> {
    let timing = s.timings.iter().find(|timing| timing.class == class)?;
    let often = timing.ms.len() >= LEAST_FOR_MEDIAN && s.fault().is_none();
    let ms = LogFigure::of_times(&timing.ms).filter(|_| often)?;
    Some(ms.inverse().scaled(1e-3 * timing.rays as f64))
}

/// Compares the structures that passed the gate on one ray class.
pub fn fastest(scene: &SceneGroup, class: RayClass) -> Ruling {
    let contender = |s: &Measured<StructureRecord>| {
        let timing: &ClassTiming = s.timings.iter().find(|timing| timing.class == class)?;
        s.fault().is_none().then_some(Contender {
            name: s.structure.clone(),
            figure: timing.mrays_s,
            log: class_speed(s, class),
        })
    };
    judge(
        scene.structures.iter().filter_map(contender).collect(),
        figure("mrays-per-s/v1").better,
    )
}

/// Compares the samplers that have no fault at one spp.
pub fn best_per_sample(view: &View, spp: u32) -> Ruling {
    let contender = |sampler: &MeasuredSampler| {
        Some(Contender {
            name: sampler.name.clone(),
            figure: sampler.mean_error_at(Metric::RelMse, spp)?.error,
            log: (sampler.log_error(Metric::RelMse, [spp; 2], 0.0)).filter(|_| sampler.is_ranked()),
        })
    };
    let fair = view.samplers.iter().filter(|s| s.fault().is_none());
    rank(view, fair.filter_map(contender).collect())
}

/// Ranks errors, if the reference is good enough for that.
fn rank(view: &View, contenders: Vec<Contender>) -> Ruling {
    match view.reference_fault() {
        Some(reason) => Ruling::Withheld(reason),
        None => judge(contenders, figure(Metric::RelMse.figure()).better),
    }
}

/// Samplers at equal time, under the fastest structure.
pub struct Race<'a> {
    /// When the first of them ends: the time at which errors are compared.
    pub seconds: f64,
    /// The structure under which all were timed.
    pub structure: String,
    view: &'a View<'a>,
    runners: Vec<Runner<'a>>,
}

struct Runner<'a> {
    sampler: &'a MeasuredSampler<'a>,
    /// Milliseconds per sample per pixel.
    time: LogFigure,
    /// Samples per pixel and seconds, growing; those whose errors are resolved.
    curve: Vec<(u32, f64)>,
}

impl<'a> Runner<'a> {
    fn new(view: &View, structure: &str, sampler: &'a MeasuredSampler<'a>) -> Option<Self> {
        let time = log_time(view.time(structure, &sampler.name)?)?;
        let means = sampler.mean_errors(Metric::RelMse);
        let resolved = means.iter().filter(|mean| mean.resolved);
        let at = |m: &MeanError| (m.spp, f64::from(m.spp) * time.log.exp() / 1000.0);
        Some(Self {
            sampler,
            curve: resolved.map(at).collect(),
            time,
        })
    }

    /// Whether all its noise is known.
    fn is_ranked(&self) -> bool {
        self.sampler.is_ranked() && !self.time.own.is_empty()
    }

    /// The noise of the time in a figure that goes as this power of it; none beside an image whose own noise is not
    /// known.
    fn noise(&self, power: f64) -> Option<Spread> {
        let noise = self.time.own.first().filter(|_| self.sampler.is_ranked())?;
        Some(noise.times(power * power))
    }

    /// The error after so many seconds. A time per sample that is off by a part moves it along the curve.
    fn error_after(&self, seconds: f64) -> Option<LogFigure> {
        let times: Vec<f64> = self.curve.iter().map(|at| at.1).collect();
        let (neighbours, share) = place_on(&times, seconds)?;
        let [a, b] = neighbours.map(|i| self.curve[i].0);
        let error = |spps, share| self.sampler.log_error(Metric::RelMse, spps, share);
        // At a point of the curve, errors are taken to fall as one over the samples.
        let slope = match a < b {
            true => {
                (error([b; 2], 0.0)?.log - error([a; 2], 0.0)?.log)
                    / (f64::from(b) / f64::from(a)).ln()
            }
            false => -1.0,
        };
        Some(error([a, b], share)?.with_noise(self.noise(slope)))
    }

    /// Error × seconds, one over the efficiency.
    fn error_seconds(&self, spp: u32) -> Option<LogFigure> {
        let error = self.sampler.log_error(Metric::RelMse, [spp; 2], 0.0)?;
        let seconds = f64::from(spp) * self.time.log.exp() / 1000.0;
        Some(error.scaled(seconds).with_noise(self.noise(1.0)))
    }

    /// Seconds until the error falls to `target`.
    fn seconds_to(&self, target: f64) -> Option<LogFigure> {
        let spp = self.sampler.spp_to(Metric::RelMse, target)?;
        Some(
            spp.scaled(self.time.log.exp() / 1000.0)
                .with_noise(self.noise(1.0)),
        )
    }
}

impl<'a> Race<'a> {
    /// `None` without a sampler that has both errors and a time.
    pub fn new(view: &'a View<'a>) -> Option<Self> {
        let structure = view.fastest_structure()?;
        let runner = |sampler: &'a MeasuredSampler<'a>| {
            let runner = Runner::new(view, &structure, sampler)?;
            (!runner.curve.is_empty() && sampler.fault().is_none()).then_some(runner)
        };
        let runners: Vec<Runner> = view.samplers.iter().filter_map(runner).collect();
        let seconds = runners
            .iter()
            .filter_map(|r| Some(r.curve.last()?.1))
            .reduce(f64::min)?;
        Some(Self {
            seconds,
            structure,
            view,
            runners,
        })
    }

    /// The error that samples and seconds are counted to: that of the rule that ends cells, else the least
    /// that all of the race reach, rounded up to two digits.
    fn target(&self) -> Option<f64> {
        let stopped = self.view.samplers.iter().flat_map(|s| &s.replicates);
        if let Some(rule) = stopped.filter_map(|r| r.stop.as_ref()).next() {
            return Some(rule.relmse);
        }
        let last = |runner: &Runner| {
            let (spp, _) = runner.curve.last()?;
            Some(
                runner
                    .sampler
                    .mean_error_at(Metric::RelMse, *spp)?
                    .error
                    .value,
            )
        };
        let most = self.runners.iter().filter_map(last).reduce(f64::max)?;
        let unit = 10f64.powf(most.log10().floor() - 1.0);
        (most > 0.0).then(|| (most / unit).ceil() * unit)
    }

    /// What a second buys: error × time at the common spp, errors when the race ends, samples and seconds to an
    /// error.
    pub fn values(&self) -> Vec<Value<'static>> {
        let metric = Metric::RelMse.name();
        let (common, target) = (self.view.common_spp(), self.target());
        let mut values = Vec::new();
        for sampler in &self.view.samplers {
            let Some(time) = self.view.time(&self.structure, &sampler.name) else {
                continue;
            };
            let Some(runner) = Runner::new(self.view, &self.structure, sampler) else {
                continue;
            };
            let mut add = |what: String, id: &str, figure: Option<LogFigure>| {
                let key = time.key.clone().with(axis::SUBJECT, what);
                let figure = figure.map(|figure| figure.interval());
                values.extend(Value::known(&key, [(id, figure)]));
            };
            let resolved = |spp: &u32| runner.curve.iter().any(|at| at.0 == *spp);
            if let Some(spp) = common.filter(resolved) {
                let what = format!("{metric} × seconds at {spp} spp");
                add(what, "error-seconds/v1", runner.error_seconds(spp));
            }
            let what = format!("{metric} after {} s", format::number(self.seconds));
            let fair = sampler.fault().is_none();
            let end = runner.error_after(self.seconds).filter(|_| fair);
            add(what, "error-at-time/v1", end);
            if let Some(target) = target {
                let to = format!("to {metric} {}", format::significant(target, 2));
                let spp = sampler.spp_to(Metric::RelMse, target);
                add(format!("spp {to}"), "spp-to-error/v1", spp);
                add(
                    format!("seconds {to}"),
                    "seconds-to-error/v1",
                    runner.seconds_to(target),
                );
            }
        }
        values
    }

    /// Error of a sampler when the race ends.
    pub fn error_of(&self, sampler: &str) -> Option<Interval> {
        let is_it = |runner: &&Runner| runner.sampler.name == sampler;
        let runner = self.runners.iter().find(is_it)?;
        Some(runner.error_after(self.seconds)?.interval())
    }

    /// Who has the least error when the race ends.
    pub fn ruling(&self) -> Ruling {
        let contender = |runner: &Runner| {
            let log = runner.error_after(self.seconds)?;
            Some(Contender {
                name: runner.sampler.name.clone(),
                figure: log.interval(),
                log: Some(log).filter(|_| runner.is_ranked()),
            })
        };
        rank(
            self.view,
            self.runners.iter().filter_map(contender).collect(),
        )
    }
}
