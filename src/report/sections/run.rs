//! The run itself: economy of the plan, wall time, what failed, where it ran.

use crate::measure::record::Verdict;
use crate::report::data::{RunData, structure_name};
use crate::report::document::*;
use crate::report::format::{self, count, percent};

/// Largest share of the wall time that the harness may take for itself.
const OVERHEAD_TARGET: f64 = 0.1;

/// The closing sections.
pub fn sections(data: &RunData) -> Vec<Section> {
    [time(data), failures(data), environment(data)]
        .into_iter()
        .flatten()
        .collect()
}

fn time(data: &RunData) -> Option<Section> {
    let mut section = Section::new("time", "What the run cost");
    if let Some(run) = data.run.filter(|run| run.renders_full_product > 0) {
        let saved = 1.0 - run.renders_planned as f64 / run.renders_full_product as f64;
        section.blocks.push(Block::Paragraph(format!(
            "The full product of all axes needs {} renders; the plan took {} ({} saved), because images are equal \
             across structures.",
            count(run.renders_full_product as u64),
            count(run.renders_planned as u64),
            percent(saved)
        )));
    }
    if let Some(finished) = data.finished {
        section
            .blocks
            .extend(overhead_check(data).map(|check| Block::Checks(vec![check])));
        section.blocks.extend(wall_table(finished).into_block());
    }
    (!section.blocks.is_empty()).then_some(section)
}

/// Whether the harness keeps to its share of the wall time; `None` if the run did not finish.
pub fn overhead_check(data: &RunData) -> Option<Check> {
    let finished = data.finished.filter(|finished| finished.wall_s > 0.0)?;
    let share = finished.overhead_s / finished.wall_s;
    Some(Check {
        verdict: Verdict::new(true, share > OVERHEAD_TARGET),
        title: format!("Harness overhead at most {}", percent(OVERHEAD_TARGET)),
        detail: format!(
            "{} of the wall time is neither GPU work nor building, judging or loading.",
            percent(share)
        ),
    })
}

fn wall_table(finished: &crate::measure::record::FinishedRecord) -> Table {
    let mut table = Table::new("Where the wall time went", &["part", "seconds", "share"]);
    let mut parts: Vec<(&str, f64)> = finished
        .parts_s
        .iter()
        .map(|(name, s)| (name.as_str(), *s))
        .collect();
    parts.sort_by(|a, b| b.1.total_cmp(&a.1));
    parts.push(("overhead", finished.overhead_s));
    parts.push(("whole run", finished.wall_s));
    for (name, seconds) in parts {
        let share = seconds / finished.wall_s;
        let share = if share.is_finite() {
            percent(share)
        } else {
            format::ABSENT.into()
        };
        table.rows.push(vec![
            name.into(),
            format::number(seconds).into(),
            share.into(),
        ]);
    }
    table
}

fn failures(data: &RunData) -> Option<Section> {
    let mut table = Table::new("Failed and skipped cells", &["cell", ":state", ":reason"]);
    let mut add = |cell: String, state: &str, tone, reason: String| {
        table.rows.push(vec![
            cell.into(),
            Cell::from(state).toned(tone),
            reason.into(),
        ]);
    };
    for scene in &data.scenes {
        for s in &scene.structures {
            let Some(mut fault) = s.fault() else { continue };
            let classes = s.gate.iter().flat_map(|gate| &gate.classes);
            for class in classes.filter(|class| class.first_wrong.is_some()) {
                let ray = class.first_wrong.as_deref().unwrap_or_default();
                fault += &format!(
                    "; first wrong {} ray: {ray}",
                    format::ray_class(class.class)
                );
            }
            let cell = format!("{} · {}", scene.name, structure_name(*s));
            add(cell, "FAILED", Tone::Bad, fault);
        }
    }
    for (scene, view) in data.views() {
        for time in &view.times {
            let unequal = (!time.image_equal)
                .then(|| "its image differs from the other structures'".to_owned());
            let Some(reason) = time.failure.clone().or(unequal) else {
                continue;
            };
            let structure = structure_name(*time);
            let sampler = time.key.sampler();
            let cell = format!(
                "{} · {structure} · {sampler} · {}",
                scene.name, view.integrator
            );
            add(cell, "FAILED", Tone::Bad, reason);
        }
        for sampler in &view.samplers {
            let Some(fault) = sampler.fault() else {
                continue;
            };
            add(
                format!("{} · {} · {}", scene.name, sampler.name, view.integrator),
                "FAILED",
                Tone::Bad,
                fault,
            );
        }
    }
    for failed in &data.failed {
        add(
            failed.cell.clone(),
            "FAILED",
            Tone::Bad,
            failed.reason.clone(),
        );
    }
    for skipped in &data.skipped {
        add(
            skipped.cell.clone(),
            "skipped",
            Tone::Note,
            skipped.reason.clone(),
        );
    }
    for warning in &data.warnings {
        add(
            warning.cell.clone(),
            "warning",
            Tone::Note,
            warning.reason.clone(),
        );
    }
    let mut section = Section::new("failures", "Failed and skipped");
    let none = || Block::Paragraph("No cell failed and none was skipped.".into());
    section.blocks.push(table.into_block().unwrap_or_else(none));
    Some(section)
}

fn environment(data: &RunData) -> Option<Section> {
    let run = data.run?;
    let e = &run.environment;
    let yes_no = |flag| if flag { "yes" } else { "no" };
    let commit = e.commit.as_ref().map_or(format::ABSENT.into(), |commit| {
        format!(
            "{commit}{}",
            if e.dirty == Some(true) {
                " with uncommitted changes"
            } else {
                ""
            }
        )
    });
    let denormals = match e.denormals {
        Some(kept) => if kept { "kept" } else { "taken for 0" }.to_owned(),
        None => format::ABSENT.into(),
    };
    let loops = e.loop_limit.map_or("run to their end".into(), |limit| {
        let limit = count(u64::from(limit));
        format!("END IN SILENCE after {limit} turns in all; kernels check for it")
    });
    let rows: [(&str, String); 14] = [
        ("experiment", run.experiment.clone()),
        ("started", format::utc(run.started_unix_s)),
        ("adapter", e.adapter.clone()),
        ("device type", e.device_type.clone()),
        ("backend", e.backend.clone()),
        ("driver", format!("{} {}", e.driver, e.driver_info)),
        ("software adapter", yes_no(e.software).into()),
        ("GPU timestamps", yes_no(e.timestamps).into()),
        ("loops", loops),
        ("denormal numbers", denormals),
        (
            "processor",
            format!("{}, {}", e.cpu, format::plural(e.cpu_threads, "thread")),
        ),
        ("system", e.os.clone()),
        ("raystone", e.version.clone()),
        ("commit", commit),
    ];
    let mut table = Table::new("Environment", &["what", ":value"]);
    let or_absent = |text: String| {
        if text.trim().is_empty() {
            format::ABSENT.to_owned()
        } else {
            text
        }
    };
    table
        .rows
        .extend(rows.map(|(what, value)| vec![what.into(), or_absent(value).into()]));
    let mut section = Section::new("environment", "Where it ran");
    section.blocks.extend(table.into_block());
    section.blocks.push(Block::Heading("Experiment".into()));
    section
        .blocks
        .push(Block::Verbatim(run.experiment_text.clone()));
    Some(section)
}
