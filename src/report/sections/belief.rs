//! Reasons to believe the figures: every check of the run, with its evidence.

use super::targets;
use crate::data::{Measured, RunData, SAMPLER_AXES, SceneGroup, View, without_repeats};
use crate::document::*;
use crate::format::{self, count, plural};
use crate::samplers::{Metric, REFERENCE_SHARE, UNRESOLVED};
use raystone_record::{
    GateVerdict, PathsRecord, ReferenceCheck, ReferenceRecord, TimeRecord, Verdict, axis,
};
use raystone_stats::bias::BiasVerdict;

/// Returns the section.
pub fn section(data: &RunData) -> Section {
    let mut section = Section::new("belief", "Why to believe it");
    let (passed, others): (Vec<Check>, Vec<Check>) = checks(data)
        .into_iter()
        .partition(|check| check.verdict == Verdict::Pass);
    if !others.is_empty() {
        section.blocks.push(Block::Checks(others));
    }
    if !passed.is_empty() {
        section.blocks.push(Block::Fold(Fold {
            title: format!("{} passed", plural(passed.len(), "check")),
            note: "what was compared with what, and how often".into(),
            blocks: vec![Block::Checks(passed)],
            ..Fold::default()
        }));
    }
    section
}

/// Detail of a check without anything to test.
const NOTHING: &str = "nothing to test.";
/// Reasons why cells were left out that a check names.
const MOST_REASONS: usize = 3;

/// Returns every check: the experiment's own targets, and those behind its figures.
pub fn checks(data: &RunData) -> Vec<Check> {
    let mut checks = targets::checks(data);
    if data.scenes.is_empty() && !data.measured.is_empty() {
        // Nothing was traced or rendered for the others to check.
        checks.push(complete(data));
        return checks;
    }
    checks.extend(data.scenes.iter().map(gate));
    checks.push(judge(
        data,
        "The reference tracer against brute force",
        |gate| &gate.brute_force,
    ));
    checks.push(judge(
        data,
        "The reference tracer against the f64 oracle",
        |gate| &gate.oracle,
    ));
    checks.push(images(data));
    checks.extend(paths(data));
    checks.push(bias(data));
    checks.push(finite_pixels(data));
    checks.push(reference_noise(data));
    checks.push(complete(data));
    checks
}

/// Fails if anything was wrong; stays open if nothing was tested.
fn check(title: impl Into<String>, tested: bool, wrong: bool, detail: String) -> Check {
    let detail = if tested || wrong {
        detail
    } else {
        NOTHING.into()
    };
    Check {
        verdict: Verdict::new(tested, wrong),
        title: title.into(),
        detail,
    }
}

fn gate(scene: &SceneGroup) -> Check {
    let title = format!("Hits equal to the bit: {}", scene.name);
    let all = || scene.structures.iter().filter_map(|s| s.gate.as_ref());
    let gates = all().filter(|gate| !gate.inexact);
    let classes = || gates.clone().flat_map(|gate| &gate.classes);
    let rays: usize = classes().map(|class| class.rays).sum();
    let wrong: usize = classes().map(|class| class.wrong).sum();
    let ties: usize = classes().map(|class| class.ties).sum();
    let mut detail = format!(
        "{} through {}: id, t, u, v; {} differ, {}.",
        plural(rays, "ray"),
        plural(gates.clone().count(), "structure"),
        count(wrong as u64),
        plural(ties, "tie"),
    );
    let inexact: Vec<_> = all().filter(|gate| gate.inexact).collect();
    if !inexact.is_empty() {
        let others = inexact.iter().flat_map(|gate| &gate.classes);
        detail += &format!(
            " Up to rounding, with a triangle test that is not exact: {}, {} on another triangle.",
            plural(inexact.len(), "structure"),
            plural(others.map(|class| class.ties).sum(), "ray"),
        );
    }
    let faulty = scene
        .structures
        .iter()
        .filter_map(|s| Some((s, s.fault()?)));
    let faulty: Vec<_> = faulty.collect();
    for (s, fault) in &faulty {
        detail += &format!(" {} FAILED: {fault}.", s.structure);
    }
    check(title, rays > 0, !faulty.is_empty(), detail)
}

fn judge(data: &RunData, title: &str, pick: fn(&GateVerdict) -> &ReferenceCheck) -> Check {
    let mut details = Vec::new();
    let (mut all_rays, mut all_wrong) = (0, 0);
    for scene in &data.scenes {
        // The reference tracer is the same for all structures of a scene: its widest check counts.
        let gates = scene.structures.iter().filter_map(|s| s.gate.as_ref());
        let checks = gates.map(pick);
        let worst = checks.max_by_key(|check| (check.wrong, check.rays));
        let Some(check) = worst.filter(|check| check.rays > 0) else {
            details.push(format!("{}: not run", scene.name));
            continue;
        };
        all_rays += check.rays;
        all_wrong += check.wrong;
        let [wrong, near] = [check.wrong, check.ambiguous].map(|n| count(n as u64));
        let mut text = format!(
            "{}: {}, {wrong} differ",
            scene.name,
            plural(check.rays, "ray")
        );
        if check.ambiguous > 0 {
            text += &format!(", {near} within rounding of an edge or another surface");
        }
        if let Some(when) = check.reused_unix_s {
            text += &format!(", found on disk: checked {}", format::utc(when));
        }
        details.push(text);
    }
    check(title, all_rays > 0, all_wrong > 0, join(details))
}

fn images(data: &RunData) -> Check {
    let times: Vec<&Measured<TimeRecord>> = data
        .views()
        .flat_map(|(_, view)| &view.times)
        .filter(|t| !t.image_hash.is_empty())
        .collect();
    // An image that one structure alone rendered, organised in one way, equals itself.
    let has_peer = |t: &&&Measured<TimeRecord>| {
        let is_peer = |o: &&Measured<TimeRecord>| {
            let made_by = [axis::ACCEL, axis::ORGANISATION];
            o.key.agrees(&t.key, &SAMPLER_AXES) && !o.key.agrees(&t.key, &made_by)
        };
        times.iter().any(is_peer)
    };
    let compared = times.iter().filter(has_peer).count();
    let unequal = times.iter().filter(|time| !time.image_equal);
    let unequal = unequal.map(|t| {
        let scene = t.key.label(axis::SCENE);
        format!("{} with {} on {scene} differs", t.structure, t.sampler)
    });
    let unequal: Vec<String> = unequal.collect();
    let equal = compared.saturating_sub(unequal.len());
    let mut detail = format!("{equal} of {} equal to the bit", plural(compared, "image"));
    if compared < times.len() {
        let alone = count((times.len() - compared) as u64);
        detail += &format!("; {alone} rendered in one way alone");
    }
    if !unequal.is_empty() {
        detail += &format!(": {}", unequal.join(", "));
    }
    let title = "Images equal across structures and organisations";
    check(title, compared > 0, !unequal.is_empty(), detail + ".")
}

/// Returns the check of single paths of integrators against the oracle for images; none if a run checked none.
fn paths(data: &RunData) -> Option<Check> {
    let sum = |of: fn(&PathsRecord) -> usize| data.paths.iter().map(|p| of(p.body)).sum::<usize>();
    let [judged, wrong] = [sum(|p| p.paths), sum(|p| p.wrong)];
    let mut detail = format!(
        "{} against double precision: {} differ; {} ill-conditioned, {} within rounding of a decision",
        plural(judged, "path"),
        count(wrong as u64),
        count(sum(|p| p.ill_conditioned) as u64),
        count(sum(|p| p.flips) as u64),
    );
    let mut further = Vec::new();
    for one in &data.paths {
        let [scene, integrator] = [axis::SCENE, axis::INTEGRATOR].map(|axis| one.key.label(axis));
        if let Some(reason) = &one.not_judged {
            further.push(format!("; {integrator} on {scene} is NOT JUDGED: {reason}"));
        }
        if let Some(fault) = &one.fault {
            further.push(format!("; {integrator} on {scene} FAILED: {fault}"));
        }
    }
    // Kernels, tests and organisations are checked each by itself.
    detail += &without_repeats(further).concat();
    let failed = data.paths.iter().any(|p| p.fault.is_some());
    (!data.paths.is_empty()).then(|| Check {
        verdict: Verdict::new(judged > 0, failed),
        title: "Integrators path by path".into(),
        detail: detail + ".",
    })
}

fn bias(data: &RunData) -> Check {
    let records: Vec<_> = data
        .views()
        .flat_map(|(scene, view)| view.samplers.iter().map(move |s| (scene, view, s)))
        .filter_map(|(scene, view, s)| Some((scene, view, s, s.bias.as_ref()?)))
        .collect();
    let with = |verdict: BiasVerdict| records.iter().filter(move |r| r.3.verdict == verdict);
    let clean = with(BiasVerdict::NoBiasFound).count();
    let by_design = with(BiasVerdict::Biased).filter(|r| r.3.by_design).count();
    let biased = with(BiasVerdict::Biased).count() - by_design;
    let mut detail = format!(
        "{clean} without a bias found, {biased} biased, {by_design} biased by design, {} not testable",
        records.len() - clean - biased - by_design
    );
    if let Some((.., record)) = records.first() {
        detail += &format!(
            " (Student's t of the whole image, of a mean in which noisy places count less and, with Benjamini and Hochberg's correction, per tile, each at a third of {})",
            format::number(record.alpha)
        );
    }
    for (scene, view, sampler, _) in with(BiasVerdict::Biased) {
        let fault = sampler.fault().unwrap_or_default();
        let place = format!("{} on {}, {}", sampler.name, scene.name, view.name);
        detail += &format!("; {place}: {fault}");
    }
    // Samplers that cannot be tested, or are biased by design, are listed although they are no proof.
    let detail = if records.is_empty() {
        NOTHING.into()
    } else {
        detail + "."
    };
    Check {
        detail,
        ..check(
            "Samplers without bias",
            clean > 0,
            biased > 0,
            String::new(),
        )
    }
}

fn finite_pixels(data: &RunData) -> Check {
    let (mut images, mut bad, mut names) = (0, 0, String::new());
    for (scene, view) in data.views() {
        for sampler in &view.samplers {
            let pixels = sampler.replicates.iter().map(|r| r.non_finite_pixels);
            let pixels: usize = pixels.sum();
            images += sampler.replicates.len();
            bad += pixels;
            if pixels > 0 {
                names += &format!("; {} on {}, {}", sampler.name, scene.name, view.name);
            }
        }
    }
    let (pixels, of) = (plural(bad, "non-finite pixel"), plural(images, "image"));
    let detail = format!("{pixels} in {of}{names}.");
    check("Every pixel finite", images > 0, bad > 0, detail)
}

/// Checks the noise of references, which limits from below the errors that can be distinguished.
fn reference_noise(data: &RunData) -> Check {
    let mut details = Vec::new();
    let (mut tested, mut wrong) = (false, false);
    // Views without errors of their own, such as those of further organisations, need no reference.
    for (scene, view) in data.views().filter(|(_, view)| !view.samplers.is_empty()) {
        let fault = view.reference_fault();
        wrong |= fault.is_some();
        let known = match view.reference {
            None if fault.is_none() => continue,
            None => "no reference".into(),
            Some(reference) => {
                tested |= reference.file.is_none();
                match (reference.exact, &reference.file) {
                    (Some(_), _) => "exact".into(),
                    (None, Some(file)) => format!("{file}, of unknown noise"),
                    _ => noise_of(&reference, view),
                }
            }
        };
        let fault = fault.map_or(String::new(), |fault| format!(": {fault}"));
        details.push(format!("{}, {}: {known}{fault}", scene.name, view.name));
    }
    let share = format::percent(REFERENCE_SHARE);
    let title = format!("Reference noise below {share} of every error");
    check(title, tested, wrong, join(details))
}

/// Describes the noise of a rendered reference, and how many errors it hides.
fn noise_of(reference: &ReferenceRecord, view: &View) -> String {
    let mut text = format!("MSE {}", format::optional(reference.mse));
    if let Some(relmse) = reference.relmse {
        text += &format!(", relMSE {}", format::number(relmse));
    }
    text += &format!(" at {} spp", count(u64::from(reference.spp)));
    let errors = view
        .samplers
        .iter()
        .flat_map(|s| s.mean_errors(Metric::RelMse));
    let hidden = errors.filter(|mean| !mean.resolved).count();
    if hidden > 0 {
        text += &format!(", {} {UNRESOLVED}", plural(hidden, "error"));
    }
    text
}

fn complete(data: &RunData) -> Check {
    let title = "Every planned cell has figures";
    let Some(finished) = data.finished else {
        let why = data.interrupted.map(|early| format!(": {}", early.reason));
        let detail = format!("The run did not finish{}.", why.unwrap_or_default());
        return check(title, true, true, detail);
    };
    let failed = plural(finished.failed, "cell");
    let left_out = plural(finished.skipped, "cell");
    let why = reasons(data);
    let detail = format!("{failed} failed, {left_out} left out{why}.");
    check(title, true, finished.failed > 0, detail)
}

/// Returns the reasons for which cells were left out, each once; the first few.
fn reasons(data: &RunData) -> String {
    let all = data.skipped.iter().map(|skipped| skipped.reason.clone());
    let all = without_repeats(all.collect());
    if all.is_empty() {
        return String::new();
    }
    let shown = all.len().min(MOST_REASONS);
    let more = match all.len() - shown {
        0 => String::new(),
        1 => "; and one more reason, listed below".to_owned(),
        n => format!("; and {n} more reasons, listed below"),
    };
    format!(": {}{more}", all[..shown].join("; "))
}

fn join(details: Vec<String>) -> String {
    if details.is_empty() {
        NOTHING.into()
    } else {
        details.join("; ") + "."
    }
}
