//! The question of the run, the winners, the failures, and the state of the checks.

use super::kernels::{self, is_repeat, repeats};
use super::{belief, compactions, rendering, run, targets};
use crate::data::{Measured, RAYS, RunData, SceneGroup, View, grouped, without_repeats};
use crate::document::*;
use crate::ruling::{Contender, Ruling, judge};
use crate::samplers::{MeasuredSampler, Metric};
use crate::{format, pictures, trust};
use raystone_record::figure::{self, Better};
use raystone_record::{
    ClassTiming, FigureAtCount, Interval, RayClass, Recorded, StreamRecord, StructureRecord,
    Verdict, axis,
};
use raystone_stats::comparison::LogFigure;
use raystone_stats::statistics::LEAST_FOR_MEDIAN;
use std::path::Path;

pub(crate) use super::race::Race;

/// Scenes whose answers are open at first; those of further ones unfold.
const OPEN_SCENES: usize = 3;
/// Pairs of dimensions whose point sets are ranked in the open.
const OPEN_PAIRS: usize = 2;
/// Failures that the first screens name; the others are in their own section.
const NAMED_FAILURES: usize = 5;

/// Kinds of images that the question names.
const NAMED_VIEWS: usize = 4;

/// Returns the section of the first screens.
pub fn section(dir: &Path, data: &RunData) -> Section {
    let mut section = Section::new("verdict", "Verdict");
    let blocks = &mut section.blocks;
    blocks.push(asked(dir, data));
    blocks.extend(failed(data));
    for (table, notes) in kernels::against_original(data) {
        blocks.extend(table.into_block());
        blocks.extend(notes.into_iter().map(Block::Paragraph));
    }
    for (index, scene) in data.scenes.iter().enumerate() {
        let answers = of_scene(scene);
        if index < OPEN_SCENES {
            blocks.extend(answers)
        } else {
            blocks.extend(Block::fold(format!("Verdict on {}", scene.name), answers))
        }
    }
    let mut pairs = point_sets(data);
    let further = pairs.split_off(pairs.len().min(OPEN_PAIRS));
    blocks.extend(answers("point sets", &pairs));
    let further = answers("further pairs of dimensions", &further);
    blocks.extend(Block::fold(
        "Verdict on further pairs of dimensions",
        further,
    ));
    if !data.scenes.is_empty() {
        let how = vec![Block::Paragraph(rule(data))];
        blocks.extend(Block::fold("How winners are found", how));
        return section;
    }
    blocks.push(Block::Paragraph(if data.measured.is_empty() {
        "Nothing was measured.".into()
    } else {
        "No structure and no sampler was measured on a scene. What was measured without one stands in sections of its own.".into()
    }));
    section
}

/// Returns the question of the run, beside pictures of its scenes, and the state of its checks.
fn asked(dir: &Path, data: &RunData) -> Block {
    let picture = |scene: &SceneGroup| {
        let references = scene.views.iter().filter_map(|view| view.reference);
        let drawn = references.filter(|r| !r.body.image.is_empty());
        let path = drawn.map(|r| &r.body.image).next()?;
        let alt = format!("The scene {} as its reference image shows it", scene.name);
        Some(pictures::load(dir, path, scene.name).described(alt))
    };
    let pictures = data.scenes.iter().filter_map(picture).take(OPEN_SCENES);
    let mut blocks = vec![Block::Paragraph(question(data))];
    blocks.push(Block::Checks(vec![summary(data)]));
    Block::Beside(Beside {
        pictures: pictures.collect(),
        blocks,
    })
}

fn question(data: &RunData) -> String {
    let named = |names: &[String], noun: &str| {
        let text = format!(
            "{} ({})",
            format::plural(names.len(), noun),
            names.join(", ")
        );
        (!names.is_empty()).then_some(text)
    };
    let scenes: Vec<String> = data.scenes.iter().map(|s| s.name.to_owned()).collect();
    let views = data.views().map(|(_, view)| view.name.clone());
    let views = without_repeats(views.collect());
    let mut parts = Vec::new();
    let ideas = kernels::ideas(data);
    if !ideas.is_empty() {
        let ideas: Vec<String> = ideas.iter().map(|idea| format!("@{idea}")).collect();
        parts.push(format!("what the kernels {} change", ideas.join(", ")));
    }
    let of = |names: &[String], noun, one: &str, many: &str| match names {
        [] => None,
        [only] => Some(format!("{one} {only}")),
        names => Some(format!("which of {} {many}", named(names, noun)?)),
    };
    let fast = "answers rays and renders fastest";
    let gated = data.scenes.iter().flat_map(|scene| &scene.structures);
    let ranked = gated
        .filter(|s| !s.is_inexact())
        .map(|s| s.structure.clone());
    let mut structures = without_repeats(ranked.collect());
    if structures.is_empty() {
        structures.clone_from(&data.structures);
    }
    parts.extend(of(&structures, "structure", "how fast is", fast));
    let exact = "errs least per sample and per second";
    parts.extend(of(&data.samplers, "sampler", "how exact is", exact));
    let mut methods: Vec<String> = { data.measured_by(compactions::NAME).into_iter() }
        .map(|c| c.key.name(axis::INTEGRATOR).to_owned())
        .collect();
    methods = without_repeats(methods);
    let compact = "compacts streams fastest";
    let how = "how fast streams are compacted by";
    parts.extend(of(&methods, "method", how, compact));
    if parts.is_empty() {
        let text = if data.measured.is_empty() {
            "Asked: nothing that a structure or a sampler answers."
        } else {
            "Asked: what is measured without a scene."
        };
        return text.into();
    }
    let mut text = format!("Asked: {}", parts.join(", and "));
    if let Some(scenes) = named(&scenes, "scene") {
        text += &format!(", on {scenes}");
    }
    if !views.is_empty() {
        text += &format!(", with {}", some_of(&views));
    }
    text + "." + &amounts(data)
}

/// Joins names; of many the first ones and the number of the others.
fn some_of(names: &[String]) -> String {
    let more = names.len().saturating_sub(NAMED_VIEWS);
    let shown = names[..names.len() - more].join(", ");
    match more {
        0 => shown,
        more => format!("{shown} and {more} more"),
    }
}

/// Returns the size of the images, samples and replicates, if there are images.
fn amounts(data: &RunData) -> String {
    let samplers = || data.views().flat_map(|(_, view)| &view.samplers);
    let Some(first) = samplers().flat_map(|s| &s.replicates).next() else {
        return String::new();
    };
    let errors = samplers()
        .flat_map(|s| &s.replicates)
        .flat_map(|r| &r.errors);
    let spps = errors.map(|e| (e.spp, e.spp));
    let spp = spps.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let spp = spp.map_or(String::new(), |(low, high)| {
        let samples = format::plural(high as usize, "sample");
        if low == high {
            format!(", {samples} per pixel")
        } else {
            format!(", {low} to {samples} per pixel")
        }
    });
    let most = samplers().map(|s| s.replicates.len()).max().unwrap_or(0);
    let [width, height] = first.resolution;
    let replicates = format::plural(most, "replicate");
    format!(" Images of {width} × {height} pixels{spp}, {replicates}.")
}

/// Sums up all checks in one.
fn summary(data: &RunData) -> Check {
    let checks = belief::checks(data);
    let titles = |verdict: Verdict| -> Vec<&str> {
        let of = checks.iter().filter(|check| check.verdict == verdict);
        of.map(|check| check.title.as_str()).collect()
    };
    let (failed, open) = (titles(Verdict::Fail), titles(Verdict::Open));
    let passed = checks.len() - failed.len() - open.len();
    let of_all = format::plural(checks.len(), "check");
    let targets: Vec<String> = { targets::checks(data) }
        .into_iter()
        .map(|t| t.title)
        .collect();
    let is_target = |title: &&str| targets.iter().any(|target| target == title);
    let (verdict, title) = match (failed.is_empty(), open.is_empty()) {
        (false, _) if failed.iter().all(is_target) => (Verdict::Fail, "A target is missed"),
        (false, _) => (Verdict::Fail, "Do not believe all of it"),
        (true, false) => (Verdict::Open, "Not all could be checked"),
        (true, true) if data.scenes.is_empty() && !targets.is_empty() => {
            (Verdict::Pass, "Every target is met")
        }
        (true, true) => (Verdict::Pass, "The figures can be believed"),
    };
    let mut detail = format!("{passed} of {of_all} passed");
    for (what, titles) in [("failed", failed), ("nothing to test for", open)] {
        if !titles.is_empty() {
            detail += &format!("; {what}: {}", titles.join(", "));
        }
    }
    if title == "Do not believe all of it" {
        detail += ". Questions that a failed check is about have no winner";
        if data.run.is_some_and(|run| run.lenient) {
            detail += "; the run was told to end with exit code 0 all the same (--lenient)";
        }
    }
    Check {
        verdict,
        title: title.into(),
        detail: detail + ".",
    }
}

/// Returns the first few failures.
fn failed(data: &RunData) -> Option<Block> {
    let failures = run::failures(data);
    let failed: Vec<_> = failures.iter().filter(|f| f.state == run::FAILED).collect();
    let row = |failure: &&&run::Failure| {
        let reason = TableCell::from(failure.reason.clone()).toned(Tone::Bad);
        [failure.cell.clone().into(), reason]
    };
    let named = failed.iter().take(NAMED_FAILURES).map(|f| row(&f));
    let mut table = Table::of("What failed", &["what", ":why"], named);
    if failed.len() > NAMED_FAILURES {
        let more = format!("and {} more", failed.len() - NAMED_FAILURES);
        let more = TableCell::from(more).linked("#failures");
        table.rows.push(vec![more, TableCell::default()]);
    }
    table.into_block()
}

/// Returns everything on one scene.
fn of_scene(scene: &SceneGroup) -> Vec<Block> {
    let rulings = rulings(scene);
    let mut blocks = answers(scene.name, &rulings);
    if blocks.is_empty() {
        let none = format!("On {} nothing could be compared.", scene.name);
        blocks.push(Block::Paragraph(none));
    }
    let warned = rendering::disagreements(scene).into_iter();
    let warned = warned.map(|line| Check {
        verdict: Verdict::Open,
        title: "Rays and rendering disagree".into(),
        detail: format!("{line}."),
    });
    let warned: Vec<Check> = warned.collect();
    if !warned.is_empty() {
        blocks.push(Block::Checks(warned));
    }
    blocks.extend(apart(scene));
    blocks
}

/// Returns the answers as a table, and a line for each contender without competition.
fn answers(of: &str, rulings: &[(String, Ruling)]) -> Vec<Block> {
    let alone = rulings.iter().filter(|(_, ruling)| !ruling.is_contest());
    let alone = by_answer(alone.cloned().collect());
    let caption = format!("Verdict on {of}");
    let mut blocks = Vec::from_iter(table_of(&caption, rulings).into_block());
    let place = if blocks.is_empty() {
        format!(" on {of}")
    } else {
        String::new()
    };
    blocks.extend(alone.into_iter().map(|(questions, ruling)| {
        let (answer, questions) = (ruling.answer(), together(&questions));
        Block::Paragraph(format!(
            "Without competition{place}: {answer} in {questions}."
        ))
    }));
    blocks
}

/// Questions that are listed; of more only their number.
const LISTED: usize = 2;

/// Questions that have one answer.
fn together(questions: &[String]) -> String {
    if questions.len() <= LISTED {
        return questions.join("; ");
    }
    format!("{} questions", format::count(questions.len() as u64))
}

/// Groups rulings by answer: the questions of each, at the place of the first of them.
fn by_answer(rulings: Vec<(String, Ruling)>) -> Vec<(Vec<String>, Ruling)> {
    let together = grouped(rulings, |(_, ruling)| ruling.answer()).into_iter();
    let unzip = |(_, rulings): (String, Vec<(String, Ruling)>)| {
        let (questions, mut rulings): (Vec<_>, Vec<_>) = rulings.into_iter().unzip();
        (questions, rulings.swap_remove(0))
    };
    together.map(unzip).collect()
}

/// Explains the rule for winners, with the number of comparisons.
fn rule(data: &RunData) -> String {
    let of_scenes = data.scenes.iter().flat_map(rulings);
    let all: Vec<_> = of_scenes.chain(point_sets(data)).collect();
    let rulings = || all.iter();
    let compared = || rulings().map(|(_, ruling)| ruling.comparisons());
    let questions = compared().filter(|pairs| *pairs > 0).count();
    format!(
        "A winner is named only where it differs from every other: by a test of their ratio, of times round by round where \
         both were timed in the same rounds, with the noise of images, reference and times together, at 5 % for all pairs of a question (Holm's correction). Where a question \
         stays undecided, those are named that do not differ from the best. Ratios of times are those of the rounds: on a \
         busy machine the medians beside them may have another ratio, or another order. {} made in {}.",
        format::plural(compared().sum(), "comparison"),
        format::plural(questions, "question")
    )
}

/// Returns the questions of one scene, each with its ruling.
pub(crate) fn rulings(scene: &SceneGroup) -> Vec<(String, Ruling)> {
    let mut rulings = Vec::new();
    for class in ray_classes(scene) {
        let question = format!("fastest, {} rays (Mrays/s)", class.name());
        rulings.push((question, fastest(scene, class)));
    }
    let timed = |view: &&View| view.valid_times().next().is_some();
    for view in scene.views.iter().filter(timed) {
        let question = format!("fastest for rendering: {} (ms per spp)", view.name);
        rulings.push((question, rendering::fastest(scene, view)));
    }
    for view in &scene.views {
        let metric = &view.figure(Metric::RelMse).title;
        if let Some(spp) = view.common_spp() {
            let what = format!("{}, {metric} at {spp} spp", view.name);
            rulings.push((
                format!("least error per sample: {what}"),
                best_per_sample(view, spp),
            ));
        }
        if let Some(race) = Race::new(view) {
            let seconds = format::number(race.seconds);
            let what = format!("{}, {metric} after {seconds} s", view.name);
            rulings.push((format!("least error per second: {what}"), race.ruling()));
        }
    }
    rulings
}

/// Returns the verdicts on one scene.
pub fn table(scene: &SceneGroup) -> Table {
    table_of(&format!("Verdict on {}", scene.name), &rulings(scene))
}

fn table_of(caption: &str, rulings: &[(String, Ruling)]) -> Table {
    let contests = rulings.iter().filter(|(_, ruling)| ruling.is_contest());
    let is_withheld = |(_, ruling): &&(String, Ruling)| matches!(ruling, Ruling::Withheld(_));
    let (withheld, ruled): (Vec<_>, Vec<_>) = contests.cloned().partition(|r| is_withheld(&r));
    let ruled = ruled
        .into_iter()
        .map(|(question, ruling)| row(question.into(), &ruling));
    // Questions whose answer is withheld by one failed check share a row.
    let withheld = by_answer(withheld).into_iter().map(|(questions, ruling)| {
        let (short, all) = (together(&questions), questions.join("; "));
        let detail = if short == all {
            String::new()
        } else {
            format!("({all})")
        };
        row(TableCell::with_detail(short, detail), &ruling)
    });
    let heads = [
        "question",
        ":answer",
        ":figure [95 % interval]",
        ":next best (ratio)",
    ];
    Table::of(caption, &heads, ruled.chain(withheld))
}

fn row(question: TableCell, ruling: &Ruling) -> [TableCell; 4] {
    let tone = match ruling {
        Ruling::Winner(..) => Tone::Good,
        Ruling::Nobody | Ruling::Withheld(_) => Tone::Bad,
        Ruling::Alone(_) | Ruling::Unclear(..) => Tone::Note,
    };
    let answer = TableCell::from(ruling.answer()).toned(tone);
    [
        question,
        answer,
        ruling.figure().into(),
        ruling.runner_up().into(),
    ]
}

/// Returns the sampler with the lowest D*, pair of dimensions by pair.
fn point_sets(data: &RunData) -> Vec<(String, Ruling)> {
    let named: Vec<_> = data.streams.iter().filter(|s| s.named).collect();
    let pairs = named.iter().map(|s| s.pair());
    let pairs = without_repeats(pairs.collect()).into_iter();
    let rule_on = |pair: String| {
        let of_pair = named.iter().filter(|s| s.pair() == pair);
        let mut of_pair: Vec<&&Recorded<StreamRecord>> = of_pair.collect();
        let ran: Vec<_> = of_pair.iter().map(|s| (s.key, s.ran)).collect();
        of_pair.retain(|s| !repeats((s.key, s.ran), ran.iter().copied()));
        let has = |n: usize| of_pair.iter().all(|s| s.star.iter().any(|at| at.n == n));
        let counts = of_pair.first()?.star.iter().rev().map(|at| at.n);
        let n = { counts }.find(|n| has(*n))?;
        let contender = |s: &&&Recorded<StreamRecord>| {
            let at = s.star.iter().find(|at| at.n == n)?;
            Some(Contender {
                name: data.names.sampler(s.key),
                figure: at.value,
                log: log_discrepancy(s, at),
            })
        };
        let contenders = of_pair.iter().filter_map(contender).collect();
        let question = format!("lowest D*: {pair}, {} points", format::count(n as u64));
        Some((question, judge(contenders, Better::Lower)))
    };
    pairs.filter_map(rule_on).collect()
}

/// Returns D* with its noise over seeds; that of a deterministic set is exact.
fn log_discrepancy(stream: &StreamRecord, at: &FigureAtCount) -> Option<LogFigure> {
    if !stream.randomised {
        return LogFigure::of_interval(Interval::exact(at.value.value), f64::INFINITY);
    }
    let freedom = stream.seeds.saturating_sub(1) as f64;
    LogFigure::of_interval(at.value, freedom).filter(|_| freedom > 0.0)
}

/// Lists contenders that may not win, with the reason, and those that are shown without a rank.
fn apart(scene: &SceneGroup) -> Vec<Block> {
    let brief = |name: String, fault: String| {
        let fault = fault.split(';').next().unwrap_or_default();
        format!("{name} ({fault})")
    };
    let faulty = scene.structures.iter();
    let faulty = faulty.filter_map(|s| Some(brief(s.structure.clone(), s.fault()?)));
    let with = |s: &MeasuredSampler, view: &View| format!("{} with {}", s.name, view.name);
    let of_views = |least: usize| {
        let views = scene
            .views
            .iter()
            .filter(move |view| view.samplers.len() > least);
        views.flat_map(|view| view.samplers.iter().map(move |s| (s, view)))
    };
    let biased = of_views(0).filter_map(|(s, view)| Some(brief(with(s, view), s.fault()?)));
    let single = of_views(1).filter(|(s, _)| s.replicates.len() == 1);
    let single = single.map(|(s, view)| with(s, view));
    let name = scene.name;
    let said = [
        (
            format!("Left out of the comparison on {name}"),
            faulty.chain(biased).collect::<Vec<_>>(),
        ),
        (
            format!(
                "Shown, but not ranked on {name}, since one image tells nothing of their spread"
            ),
            single.collect(),
        ),
    ];
    let said = said.into_iter().filter(|(_, names)| !names.is_empty());
    let said = said.map(|(what, names)| format!("{what}: {}.", names.join("; ")));
    said.map(Block::Paragraph).collect()
}

/// Returns the ray classes that some structure was timed on.
pub(crate) fn ray_classes(scene: &SceneGroup) -> Vec<RayClass> {
    let timings = scene.structures.iter().flat_map(|s| &s.timings);
    let mut classes: Vec<RayClass> = timings.map(|timing| timing.class).collect();
    classes.sort_unstable();
    classes.dedup();
    classes
}

/// Returns the speed in a class, Mrays/s, of a structure that passed the gate with exact hits and was timed often enough.
pub(crate) fn class_speed(s: &Measured<StructureRecord>, class: RayClass) -> Option<LogFigure> {
    let timing = s.timings.iter().find(|timing| timing.class == class)?;
    let often = timing.ms.len() >= LEAST_FOR_MEDIAN && s.fault().is_none();
    let ranked = often && !s.is_inexact();
    let ms = s.rounds(RAYS, &timing.ms).filter(|_| ranked)?;
    Some(ms.inverse().scaled(1e-3 * timing.rays as f64))
}

/// Compares the structures that passed the gate on one ray class.
pub(crate) fn fastest(scene: &SceneGroup, class: RayClass) -> Ruling {
    let contender = |s: &Measured<StructureRecord>| {
        let timing: &ClassTiming = s.timings.iter().find(|timing| timing.class == class)?;
        let is_fair = s.fault().is_none() && !s.is_inexact() && !is_repeat(s, &scene.structures);
        is_fair.then_some(Contender {
            name: s.structure.clone(),
            figure: timing.mrays_s,
            log: class_speed(s, class),
        })
    };
    match trust::doubt_of_rays(scene) {
        Some(reason) => Ruling::Withheld(reason),
        None => judge(
            scene.structures.iter().filter_map(contender).collect(),
            figure::MRAYS_PER_S.better,
        ),
    }
}

/// Compares the samplers that have no fault at one spp.
pub(crate) fn best_per_sample(view: &View, spp: u32) -> Ruling {
    let contender = |sampler: &MeasuredSampler| {
        Some(Contender {
            name: sampler.name.clone(),
            figure: sampler.mean_error_at(Metric::RelMse, spp)?.error,
            log: (sampler.log_error(Metric::RelMse, [spp; 2], 0.0)).filter(|_| sampler.is_ranked()),
        })
    };
    let fair = view.samplers.iter();
    let fair = fair.filter(|s| s.fault().is_none() && !view.is_same_image(s));
    rank(view, fair.filter_map(contender).collect())
}

/// Ranks errors, if the reference is good enough for that and no check of the images failed.
pub(super) fn rank(view: &View, contenders: Vec<Contender>) -> Ruling {
    match trust::doubt_of_errors(view) {
        Some(reason) => Ruling::Withheld(reason),
        None => judge(contenders, view.figure(Metric::RelMse).better),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::Interval;

    #[test]
    fn a_question_with_one_contender_says_what_it_is_about() {
        let alone = Contender {
            name: "sobol × none".into(),
            figure: Interval::exact(0.01),
            log: None,
        };
        let asked = [(
            "lowest D*: pixel x".to_owned(),
            judge(vec![alone], Better::Lower),
        )];
        for of in ["point sets", "further pairs of dimensions"] {
            let blocks = answers(of, &asked);
            let [Block::Paragraph(text)] = &blocks[..] else {
                panic!("no single paragraph");
            };
            assert_eq!(
                *text,
                format!("Without competition on {of}: sobol × none (alone) in lowest D*: pixel x.")
            );
        }
    }
}
