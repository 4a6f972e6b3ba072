//! Who wins, per scene.

use crate::measure::record::{ClassTiming, Interval, RayClass};
use crate::report::data::{RunData, SceneGroup, View, structure_name};
use crate::report::document::*;
use crate::report::format;
use crate::report::ruling::{Better, Contender, Ruling, judge};
use crate::report::samplers::{Metric, Sampler, error_after};

/// The verdict box.
pub fn section(data: &RunData) -> Section {
    let mut section = Section::new("verdict", "Verdict");
    for scene in &data.scenes {
        let verdicts = table(scene).into_block();
        let none = || Block::Paragraph(format!("On {} nothing could be compared.", scene.name));
        section.blocks.push(verdicts.unwrap_or_else(none));
        section.blocks.extend(left_out(scene).map(Block::Paragraph));
    }
    if section.blocks.is_empty() {
        section
            .blocks
            .push(Block::Paragraph("Nothing was measured.".into()));
    } else {
        let rule =
            "A winner is named only where its 95 % interval is apart from that of every other.";
        section.blocks.push(Block::Paragraph(rule.into()));
    }
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
        let ruling = fastest(scene, class);
        table.rows.push(row(
            format!("fastest, {} rays (Mrays/s)", format::ray_class(class)),
            &ruling,
        ));
    }
    for view in &scene.views {
        if let Some(spp) = view.common_spp() {
            let question = format!(
                "least error per sample: {}, relMSE at {spp} spp",
                view.integrator
            );
            table.rows.push(row(question, &best_per_sample(view, spp)));
        }
        if let Some(race) = Race::new(view) {
            let seconds = format::number(race.seconds);
            let question = format!(
                "least error per second: {}, relMSE after {seconds} s",
                view.integrator
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
        Ruling::Alone(_) | Ruling::Unclear(_) => Tone::Note,
    };
    vec![
        question.into(),
        Cell::from(ruling.answer()).toned(tone),
        ruling.figure().into(),
        ruling.runner_up().into(),
    ]
}

/// Who may not win, with the reason.
fn left_out(scene: &SceneGroup) -> Option<String> {
    let structures = scene.structures.iter().filter_map(|s| {
        Some(format!(
            "{} ({})",
            structure_name(&s.accel, s.runtime_checks),
            s.fault()?
        ))
    });
    let samplers = scene.views.iter().flat_map(|view| {
        let fault = |s: &Sampler| {
            Some(format!(
                "{} with {} ({})",
                s.name,
                view.integrator,
                s.fault()?
            ))
        };
        view.samplers.iter().filter_map(fault)
    });
    let names: Vec<String> = structures.chain(samplers).collect();
    (!names.is_empty()).then(|| {
        format!(
            "Left out of the comparison on {}: {}.",
            scene.name,
            names.join("; ")
        )
    })
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
    let contender = |s: &&crate::measure::record::StructureRecord| {
        let timing: &ClassTiming = s.timings.iter().find(|timing| timing.class == class)?;
        let name = structure_name(&s.accel, s.runtime_checks);
        let has_spread = timing.ms.len() > 1;
        s.fault().is_none().then_some(Contender {
            name,
            figure: timing.mrays_s,
            has_spread,
        })
    };
    judge(
        scene.structures.iter().filter_map(contender).collect(),
        Better::Higher,
    )
}

/// Compares the samplers that have no fault at one spp.
pub fn best_per_sample(view: &View, spp: u32) -> Ruling {
    let contender = |sampler: &&Sampler| {
        let figure = sampler.mean_error_at(Metric::RelMse, spp)?;
        Some(Contender {
            name: sampler.name.clone(),
            figure,
            has_spread: !sampler.lacks_spread(),
        })
    };
    let fair = view
        .samplers
        .iter()
        .filter(|sampler| sampler.fault().is_none());
    judge(fair.filter_map(|s| contender(&s)).collect(), Better::Lower)
}

/// Samplers at equal time, under the fastest structure.
pub struct Race<'a> {
    /// When the first of them ends: the time at which errors are compared.
    pub seconds: f64,
    /// The structure under which all were timed.
    pub structure: String,
    runners: Vec<Runner<'a>>,
}

struct Runner<'a> {
    sampler: &'a Sampler<'a>,
    curve: Vec<(f64, Interval)>,
}

impl<'a> Race<'a> {
    /// `None` without a sampler that has both errors and a time.
    pub fn new(view: &'a View<'a>) -> Option<Self> {
        let structure = view.fastest_structure()?;
        let runner = |sampler: &'a Sampler<'a>| {
            let per_spp = view.ms_per_spp(&structure, &sampler.name)?.value / 1000.0;
            let means = sampler.mean_errors(Metric::RelMse);
            let curve: Vec<_> = means
                .iter()
                .map(|m| (f64::from(m.spp) * per_spp, m.error))
                .collect();
            (!curve.is_empty() && sampler.fault().is_none()).then_some(Runner { sampler, curve })
        };
        let runners: Vec<Runner> = view.samplers.iter().filter_map(runner).collect();
        let seconds = runners
            .iter()
            .filter_map(|r| Some(r.curve.last()?.0))
            .reduce(f64::min)?;
        Some(Self {
            seconds,
            structure,
            runners,
        })
    }

    /// Error of a sampler when the race ends.
    pub fn error_of(&self, sampler: &str) -> Option<Interval> {
        let runner = self
            .runners
            .iter()
            .find(|runner| runner.sampler.name == sampler)?;
        error_after(&runner.curve, self.seconds)
    }

    /// Who has the least error when the race ends.
    pub fn ruling(&self) -> Ruling {
        let contender = |runner: &Runner| {
            let figure = error_after(&runner.curve, self.seconds)?;
            let has_spread = !runner.sampler.lacks_spread();
            Some(Contender {
                name: runner.sampler.name.clone(),
                figure,
                has_spread,
            })
        };
        judge(
            self.runners.iter().filter_map(contender).collect(),
            Better::Lower,
        )
    }
}
