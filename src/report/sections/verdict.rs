//! Who wins, per scene.

use crate::measure::figure::figure;
use crate::measure::record::{ClassTiming, Interval, RayClass, StructureRecord, axis};
use crate::measure::statistics::LEAST_FOR_MEDIAN;
use crate::report::data::{Measured, RunData, SceneGroup, View};
use crate::report::document::*;
use crate::report::format;
use crate::report::ruling::{Contender, Ruling, judge};
use crate::report::samplers::{MeanError, Metric, Sampler, error_after};
use crate::report::values::Value;

/// The verdict box.
pub fn section(data: &RunData) -> Section {
    let mut section = Section::new("verdict", "Verdict");
    for scene in &data.scenes {
        let verdicts = table(scene).into_block();
        let none = || Block::Paragraph(format!("On {} nothing could be compared.", scene.name));
        section.blocks.push(verdicts.unwrap_or_else(none));
        section.blocks.extend(apart(scene));
    }
    let rule = match section.blocks.is_empty() {
        true => "Nothing was measured.",
        false => {
            "A winner is named only where its 95 % interval is apart from that of every other."
        }
    };
    section.blocks.push(Block::Paragraph(rule.into()));
    section
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
        ],
    );
    for class in ray_classes(scene) {
        let question = format!("fastest, {} rays (Mrays/s)", format::ray_class(class));
        table.rows.push(row(question, &fastest(scene, class)));
    }
    let metric = Metric::RelMse.name();
    for view in &scene.views {
        if let Some(spp) = view.common_spp() {
            let question = format!(
                "least error per sample: {}, {metric} at {spp} spp",
                view.name
            );
            table.rows.push(row(question, &best_per_sample(view, spp)));
        }
        if let Some(race) = Race::new(view) {
            let question = format!(
                "least error per second: {}, {metric} after {} s",
                view.name,
                format::number(race.seconds)
            );
            table.rows.push(row(question, &race.ruling()));
        }
    }
    table
}

fn row(question: String, ruling: &Ruling) -> Vec<Cell> {
    let tone = match ruling {
        Ruling::Winner(..) => Tone::Good,
        Ruling::Nobody => Tone::Bad,
        Ruling::Withheld(_) | Ruling::Alone(_) | Ruling::Unclear(_) => Tone::Note,
    };
    let answer = Cell::from(ruling.answer()).toned(tone);
    let (figure, next) = (ruling.figure(), ruling.runner_up());
    vec![question.into(), answer, figure.into(), next.into()]
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

/// Compares the structures that passed the gate on one ray class.
pub fn fastest(scene: &SceneGroup, class: RayClass) -> Ruling {
    let contender = |s: &Measured<StructureRecord>| {
        let timing: &ClassTiming = s.timings.iter().find(|timing| timing.class == class)?;
        let name = s.structure.clone();
        let has_spread = timing.ms.len() >= LEAST_FOR_MEDIAN;
        s.fault().is_none().then_some(Contender {
            name,
            figure: timing.mrays_s,
            has_spread,
        })
    };
    judge(
        scene.structures.iter().filter_map(contender).collect(),
        figure("mrays-per-s/v1").better,
    )
}

/// Compares the samplers that have no fault at one spp.
pub fn best_per_sample(view: &View, spp: u32) -> Ruling {
    let contender = |sampler: &Sampler| {
        Some(Contender {
            name: sampler.name.clone(),
            figure: sampler.mean_error_at(Metric::RelMse, spp)?.error,
            has_spread: sampler.is_ranked(),
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
    sampler: &'a Sampler<'a>,
    ms_per_spp: Interval,
    /// How often that was measured.
    rounds: usize,
    /// Seconds and error, by growing time; resolved ones only.
    curve: Vec<(f64, Interval)>,
}

impl Runner<'_> {
    /// The error after so many seconds. Its interval also holds what the time per sample leaves open:
    /// errors fall about as one over the number of samples, which the time decides on.
    fn error_after(&self, seconds: f64) -> Option<Interval> {
        let error = error_after(&self.curve, seconds)?;
        let ms = self.ms_per_spp;
        Some(Interval {
            low: error.low * ms.low / ms.value,
            high: error.high * ms.high / ms.value,
            ..error
        })
    }
}

impl<'a> Race<'a> {
    /// `None` without a sampler that has both errors and a time.
    pub fn new(view: &'a View<'a>) -> Option<Self> {
        let structure = view.fastest_structure()?;
        let runner = |sampler: &'a Sampler<'a>| {
            let time = view.time(&structure, &sampler.name)?;
            let ms_per_spp = time.ms_per_spp?;
            let means = sampler.mean_errors(Metric::RelMse);
            let resolved = means.iter().filter(|mean| mean.resolved);
            let at = |m: &MeanError| (f64::from(m.spp) * ms_per_spp.value / 1000.0, m.error);
            let curve: Vec<_> = resolved.map(at).collect();
            (!curve.is_empty() && sampler.fault().is_none()).then_some(Runner {
                sampler,
                ms_per_spp,
                rounds: time.ms.len(),
                curve,
            })
        };
        let runners: Vec<Runner> = view.samplers.iter().filter_map(runner).collect();
        let seconds = runners
            .iter()
            .filter_map(|r| Some(r.curve.last()?.0))
            .reduce(f64::min)?;
        Some(Self {
            seconds,
            structure,
            view,
            runners,
        })
    }

    /// What a second buys: error × time at the common spp, and the errors when the race ends.
    pub fn values(&self) -> Vec<Value<'static>> {
        let metric = Metric::RelMse;
        let mut values = Vec::new();
        for sampler in &self.view.samplers {
            let Some(time) = self.view.time(&self.structure, &sampler.name) else {
                continue;
            };
            let ms = time.ms_per_spp.map(|ms| ms.value);
            let at = (self.view.common_spp()).and_then(|spp| sampler.mean_error_at(metric, spp));
            if let (Some(ms), Some(mean)) = (ms, at.filter(|mean| mean.resolved)) {
                let product = mean.error.value * f64::from(mean.spp) * ms / 1000.0;
                let what = format!("{} × seconds at {} spp", metric.name(), mean.spp);
                let key = time.key.clone().with(axis::SUBJECT, what);
                values.push(Value::new(&key, "error-seconds/v1", product));
            }
            let what = format!("{} after {} s", metric.name(), format::number(self.seconds));
            let key = time.key.clone().with(axis::SUBJECT, what);
            let end = self.error_of(&sampler.name);
            let end = end.map(|e| {
                if sampler.is_ranked() {
                    e
                } else {
                    Interval::exact(e.value)
                }
            });
            values.extend(Value::known(&key, [("error-at-time/v1", end)]));
        }
        values
    }

    /// Error of a sampler when the race ends.
    pub fn error_of(&self, sampler: &str) -> Option<Interval> {
        let is_it = |runner: &&Runner| runner.sampler.name == sampler;
        self.runners.iter().find(is_it)?.error_after(self.seconds)
    }

    /// Who has the least error when the race ends.
    pub fn ruling(&self) -> Ruling {
        let contender = |runner: &Runner| {
            Some(Contender {
                name: runner.sampler.name.clone(),
                figure: runner.error_after(self.seconds)?,
                has_spread: runner.sampler.is_ranked() && runner.rounds >= LEAST_FOR_MEDIAN,
            })
        };
        rank(
            self.view,
            self.runners.iter().filter_map(contender).collect(),
        )
    }
}
