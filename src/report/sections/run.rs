//! The run itself: economy of the plan, wall time, failures, machine.

use crate::data::{Measured, RunData, SceneGroup, View};
use crate::document::*;
use crate::format::{self, count, percent};
use crate::samplers::MeasuredSampler;
use raystone_record::{FinishedRecord, Key, RunRecord, StructureRecord, TimeRecord};

/// Largest fraction of the wall time for the harness itself.
const OVERHEAD_TARGET: f64 = 0.1;

/// Returns the closing sections.
pub fn sections(data: &RunData) -> Vec<Section> {
    let sections = [failures_section(data), time(data), environment(data)];
    sections.into_iter().flatten().collect()
}

fn time(data: &RunData) -> Option<Section> {
    let mut section = Section::new("time", "What the run cost");
    // Excludes may leave a sampler fewer full cells than it has renders: then nothing is saved.
    let saves = |run: &&RunRecord| run.renders_full_product > run.renders_planned;
    if let Some(run) = data.run.filter(saves) {
        let saved = 1.0 - run.renders_planned as f64 / run.renders_full_product as f64;
        section.blocks.push(Block::Paragraph(format!(
            "To measure the error of every full cell would need {} renders; the plan took {} ({} saved), because images \
             are equal across structures.",
            count(run.renders_full_product as u64),
            count(run.renders_planned as u64),
            percent(saved)
        )));
    }
    section.blocks.extend(overhead(data).map(Block::Paragraph));
    let table = data.finished.and_then(|end| wall_table(end).into_block());
    section.blocks.extend(table);
    (!section.blocks.is_empty()).then_some(section)
}

/// Returns the overhead of the harness; `None` if the run did not finish. No check, since no figure depends on it: a
/// slow disk or a tiny experiment is no fault of the results.
pub(crate) fn overhead(data: &RunData) -> Option<String> {
    let finished = data.finished.filter(|finished| finished.wall_s > 0.0)?;
    // Other programs on the machine lengthen wall time, most of all where threads wait for each other.
    let (share, whose) = match finished.cpu {
        Some(cpu) if cpu.whole_s > 0.0 => (cpu.overhead_s / cpu.whole_s, "CPU"),
        _ => (finished.overhead_s / finished.wall_s, "wall"),
    };
    let much = if share > OVERHEAD_TARGET {
        "more than"
    } else {
        "within"
    };
    let [share, target] = [share, OVERHEAD_TARGET].map(percent);
    Some(format!(
        "Harness overhead: {share} of the {whose} time is neither GPU work nor building, judging or loading ({much} the \
         {target} that the harness is meant to take)."
    ))
}

fn wall_table(finished: &FinishedRecord) -> Table {
    let parts = finished.parts_s.iter().map(|(name, s)| (name.as_str(), *s));
    let mut parts: Vec<(&str, f64)> = parts.collect();
    parts.sort_by(|a, b| b.1.total_cmp(&a.1));
    parts.push(("overhead", finished.overhead_s));
    parts.push(("whole run", finished.wall_s));
    let row = |(name, seconds): (&str, f64)| {
        let share = Some(seconds / finished.wall_s).filter(|share| share.is_finite());
        let share = share.map_or(format::ABSENT.into(), percent);
        [name.into(), format::number(seconds).into(), share.into()]
    };
    let (heads, rows) = (["part", "seconds", "share"], parts.into_iter().map(row));
    Table::of("Where the wall time went", &heads, rows)
}

/// State of a cell that failed.
pub const FAILED: &str = "FAILED";
/// State of a cell that was not tried.
const LEFT_OUT: &str = "left out";
/// State of a problem outside the measurements.
const WARNING: &str = "warning";

/// A cell, its state, and why.
pub(crate) struct Failure {
    /// Its cell.
    pub cell: String,
    /// [`FAILED`], left out, or a warning.
    pub state: &'static str,
    /// The reason.
    pub reason: String,
}

impl Failure {
    fn new(cell: impl Into<String>, state: &'static str, reason: impl Into<String>) -> Self {
        let (cell, reason) = (cell.into(), reason.into());
        Self {
            cell,
            state,
            reason,
        }
    }
}

/// Returns all failures, omissions and warnings.
pub(crate) fn failures(data: &RunData) -> Vec<Failure> {
    let mut all: Vec<Failure> = data.scenes.iter().flat_map(failed_structures).collect();
    let of_views = data.views().map(|(scene, view)| failed_cells(scene, view));
    all.extend(of_views.flatten());
    let failed = |key: &Key, failure: &Option<String>| {
        let reason = failure.as_ref()?;
        Some(Failure::new(key.to_string(), FAILED, reason))
    };
    let peers = data.scenes.iter().flat_map(|scene| &scene.peers);
    all.extend(peers.filter_map(|peer| failed(peer.key, &peer.failure)));
    let animations = data.scenes.iter().flat_map(|scene| &scene.animations);
    all.extend(animations.filter_map(|cell| failed(&cell.key, &cell.failure)));
    all.extend((data.measured.iter()).filter_map(|cell| failed(cell.key, &cell.failure)));
    for (records, state) in [
        (&data.failed, FAILED),
        (&data.skipped, LEFT_OUT),
        (&data.warnings, WARNING),
    ] {
        all.extend((records.iter()).map(|r| Failure::new(&*r.cell, state, &*r.reason)));
    }
    all
}

fn failures_section(data: &RunData) -> Option<Section> {
    let all = failures(data);
    let of = |state: &str| all.iter().filter(|f| f.state == state).collect::<Vec<_>>();
    let [failed, left_out, warnings] = [FAILED, LEFT_OUT, WARNING].map(of);
    let title = match (failed.is_empty(), left_out.is_empty(), warnings.is_empty()) {
        (true, true, true) => return None,
        (false, true, _) => "What failed",
        (false, false, _) => "What failed or was left out",
        (true, false, _) => "What was left out",
        (true, true, false) => "Warnings",
    };
    let mut section = Section::new("failures", title);
    let table = |caption: &str, failures: &[&Failure], tone| {
        let row = |failure: &&Failure| {
            let reason = TableCell::from(failure.reason.clone()).toned(tone);
            [failure.cell.clone().into(), reason]
        };
        Table::of(caption, &["cell", ":why"], failures.iter().map(row)).into_block()
    };
    let blocks = &mut section.blocks;
    blocks.extend(table("Failed", &failed, Tone::Bad));
    blocks.extend(table("Every warning of the run", &warnings, Tone::Note));
    let mut reasons: Vec<&str> = left_out.iter().map(|f| f.reason.as_str()).collect();
    reasons.sort_unstable();
    reasons.dedup();
    for reason in reasons {
        let cells = left_out.iter().filter(|f| f.reason == reason);
        let cells: Vec<&str> = cells.map(|f| f.cell.as_str()).collect();
        let title = format!("Left out: {reason}");
        blocks.push(Block::Fold(Fold {
            title,
            note: format::plural(cells.len(), "cell"),
            blocks: vec![Block::Verbatim(cells.join("\n"))],
            ..Fold::default()
        }));
    }
    Some(section)
}

fn failed_structures(scene: &SceneGroup) -> Vec<Failure> {
    let failure = |s: &Measured<StructureRecord>| {
        let cell = format!("{} · {}", scene.name, s.structure);
        Some(Failure::new(cell, FAILED, s.fault()?))
    };
    scene.structures.iter().filter_map(failure).collect()
}

fn failed_cells(scene: &SceneGroup, view: &View) -> Vec<Failure> {
    let time = |time: &Measured<TimeRecord>| {
        let unequal =
            (!time.image_equal).then(|| "its image differs from the other structures'".to_owned());
        let reason = time.failure.clone().or(unequal)?;
        let cell = [scene.name, &time.structure, &time.sampler, &view.name].join(" · ");
        Some(Failure::new(cell, FAILED, reason))
    };
    let sampler = |sampler: &MeasuredSampler| {
        let cell = format!("{} · {} · {}", scene.name, sampler.name, view.name);
        Some(Failure::new(cell, FAILED, sampler.failure()?))
    };
    let times = view.times.iter().filter_map(time);
    times
        .chain(view.samplers.iter().filter_map(sampler))
        .collect()
}

fn environment(data: &RunData) -> Option<Section> {
    let run = data.run?;
    let e = &run.environment;
    let yes_no = |flag| if flag { "yes" } else { "no" }.to_owned();
    let dirty = match e.dirty {
        Some(true) => " with uncommitted changes",
        _ => "",
    };
    let commit = e.commit.as_ref().map(|commit| format!("{commit}{dirty}"));
    let denormals = e
        .denormals
        .map(|kept| if kept { "kept" } else { "taken for 0" });
    let loops = e.loop_limit.map_or("run to their end".into(), |limit| {
        let limit = count(u64::from(limit));
        format!("END IN SILENCE after {limit} turns in all; kernels check for it")
    });
    let threads = format::plural(e.cpu_threads, "thread");
    let rows = [
        ("experiment", run.experiment.clone()),
        ("started", format::utc(run.started_unix_s)),
        ("adapter", e.adapter.clone()),
        ("device type", e.device_type.clone()),
        ("backend", e.backend.clone()),
        ("driver", format!("{} {}", e.driver, e.driver_info)),
        ("software adapter", yes_no(e.software)),
        ("GPU timestamps", yes_no(e.timestamps)),
        ("loops", loops),
        ("denormal numbers", denormals.unwrap_or_default().into()),
        ("processor", format!("{}, {threads}", e.cpu)),
        ("system", e.os.clone()),
        ("raystone", e.version.clone()),
        ("commit", commit.unwrap_or_default()),
    ];
    let row = |(what, value): (&str, String)| {
        let known = Some(value).filter(|value| !value.trim().is_empty());
        [what.into(), known.unwrap_or(format::ABSENT.into()).into()]
    };
    let table = Table::of("Environment", &["what", ":value"], rows.map(row));
    let mut section = Section::new("environment", "Where it ran");
    section.blocks.extend(table.into_block());
    let text = vec![Block::Verbatim(run.experiment_text.clone())];
    let text = Block::fold("The experiment file", text);
    section.blocks.extend(text);
    Some(section)
}
