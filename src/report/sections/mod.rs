//! The content of the report, section by section.

pub mod animation;
pub mod belief;
pub mod cells;
pub mod coherence;
pub(crate) mod compactions;
mod comparer;
pub mod kernels;
pub(crate) mod measured;
pub(crate) mod organisations;
pub mod peers;
pub(crate) mod plots;
pub(crate) mod point_sets;
pub(crate) mod race;
pub(crate) mod rendering;
pub mod run;
pub(crate) mod sampler_plots;
pub mod samplers;
pub(crate) mod specs;
pub mod spectrum;
pub(crate) mod streams;
pub(crate) mod stress;
pub mod structures;
pub(crate) mod targets;
pub(crate) mod trade_off;
pub mod verdict;

use super::data::{RunData, SceneGroup};
use super::document::*;
use super::{format, terms, values};
use cells::Cells;
use raystone_config::expect::Thesis;
use raystone_record::{Interval, KernelFolder, RunRecord};
use raystone_stats::statistics::LEAST_FOR_MEDIAN;
use std::path::Path;

/// Builds the whole report. `dir` is where the pictures lie; `warnings` come from reading.
pub fn document(dir: &Path, data: &RunData, warnings: &[String]) -> Document {
    let values = values::values(data);
    with_cells(dir, data, &Cells::new(data, &values), warnings)
}

/// Returns the same with cells that are known already.
pub fn with_cells(dir: &Path, data: &RunData, cells: &Cells, warnings: &[String]) -> Document {
    let mut sections = vec![verdict::section(dir, data), belief::section(data)];
    sections.extend(plots::section(data, cells.values()));
    for (index, scene) in data.scenes.iter().enumerate() {
        sections.push(scene_section(dir, data, cells, index, scene));
    }
    sections.extend(streams::section(data));
    sections.extend(point_sets::section(data));
    sections.extend(compactions::section(data));
    sections.extend(stress::section(data));
    sections.extend(measured::section(data, dir));
    sections.extend(cells.section(data));
    sections.extend(run::sections(data));
    let mut document = Document {
        title: title(data),
        subtitle: subtitle(data),
        banners: banners(data, warnings),
        sections,
    };
    terms::explain(&mut document);
    document
}

fn title(data: &RunData) -> String {
    let run = data.run.map(|run| format!("Raystone: {}", run.name));
    run.unwrap_or_else(|| "Raystone report".into())
}

fn subtitle(data: &RunData) -> String {
    let Some(run) = data.run else {
        return "The record of the run itself is missing.".into();
    };
    let e = &run.environment;
    let place = format::where_and_when(e, run.started_unix_s);
    format!("{place}, {}", e.os)
}

fn banners(data: &RunData, warnings: &[String]) -> Vec<Banner> {
    let note = |text: &str| Banner::new(Tone::Note, text);
    let bad = |text: &str| Banner::new(Tone::Bad, text);
    let mut banners = Vec::new();
    match data.run.map(|run| &run.environment) {
        None => banners.push(bad(
            "The first record of the run is missing: where and what it ran is unknown.",
        )),
        Some(e) => {
            let software = "Software adapter: times compare structures on this adapter only.";
            let unstamped = "This adapter has no GPU timestamps: all times are wall clock.";
            banners.extend(e.software.then(|| note(software)));
            banners.extend((!e.timestamps).then(|| note(unstamped)));
        }
    }
    banners.extend(busy(data).map(|text| note(&text)));
    banners.extend(loaded(data).into_iter().map(|text| note(&text)));
    banners.extend(sittings(data).map(|text| note(&text)));
    banners.extend(data.run.and_then(plain_thesis).map(|text| note(&text)));
    let lenient = data.run.is_some_and(|run| run.lenient);
    let told = "The run was told to end with exit code 0 whatever fails (--lenient).";
    banners.extend(lenient.then(|| note(told)));
    let folders = data.run.iter().flat_map(|run| &run.kernels);
    banners.extend(folders.map(|folder| note(&kernels_banner(folder))));
    let shown = "this report shows what was recorded until then.";
    if let Some(ended) = data.interrupted {
        let (seconds, reason) = (format::number(ended.wall_s), &ended.reason);
        let text = format!("The run was interrupted after {seconds} s ({reason}): {shown}");
        banners.push(bad(&text));
    } else if data.finished.is_none() {
        banners.push(bad(&format!("The run did not finish: {shown}")));
    }
    banners.extend(warnings.iter().map(|warning| note(warning)));
    banners
}

/// Load of the machine over its processors from which it is called busy.
const BUSY: f64 = 0.7;
/// Half-width of the intervals of times, relative, above which a machine is called busy.
const CALM: f64 = 0.05;

/// Warns if times of the same work spread so widely that the machine must have been busy.
fn busy(data: &RunData) -> Option<String> {
    let structures = data.scenes.iter().flat_map(|scene| &scene.structures);
    let timings = structures.flat_map(|s| &s.body.timings);
    let often = timings.filter(|timing| timing.ms.len() >= LEAST_FOR_MEDIAN);
    let rates = often.map(|timing| timing.mrays_s);
    let half = |rate: Interval| 0.5 * (rate.high - rate.low) / rate.value;
    let mut halves: Vec<f64> = rates.map(half).filter(|half| half.is_finite()).collect();
    halves.sort_unstable_by(f64::total_cmp);
    let middle = *halves.get(halves.len() / 2)?;
    (middle > CALM).then(|| {
        format!(
            "The machine was busy or throttled: times of the same rays are known to ±{} only (median of the 95 % \
             intervals; ±{} is calm). Small differences are lost in this.",
            format::percent(middle),
            format::percent(CALM)
        )
    })
}

/// Returns what the system reported of other work and of heat.
fn loaded(data: &RunData) -> Vec<String> {
    let Some(run) = data.run else {
        return Vec::new();
    };
    let (e, before) = (&run.environment, run.environment.load);
    let mut said = Vec::new();
    if let Some(load) = before.minute.filter(|l| *l > BUSY * e.cpu_threads as f64) {
        said.push(format!(
            "The machine was busy when the run began: a load of {} on {}. Times may be of other work, too.",
            format::number(load),
            format::plural(e.cpu_threads, "processor")
        ));
    }
    let after = data.finished.and_then(|finished| finished.load.throttled);
    if let (Some(before), Some(after)) = (before.throttled, after)
        && after > before
    {
        said.push(format!(
            "Processors were throttled for heat {} during the run: times are too long.",
            format::plural((after - before) as usize, "time")
        ));
    }
    said
}

/// Warns that times are from different runs.
fn sittings(data: &RunData) -> Option<String> {
    let sittings = data.sittings();
    let (first, last) = (sittings.first()?, sittings.last()?);
    (first != last).then(|| {
        format!(
            "Times were measured in {} runs that began between {} and {} (resumed, or joined of parts). What stands in \
             one table of a scene was timed in turns within one of them; across scenes and samplers the machine may \
             have been another.",
            sittings.len(),
            format::utc(*first),
            format::utc(*last)
        )
    })
}

/// Warns that an experiment of a thesis used other scenes than the substitutes for the thesis's.
fn plain_thesis(run: &RunRecord) -> Option<String> {
    let thesis = Thesis::parse(&run.experiment_text, &run.experiment).ok()??;
    let is_plain = !run.experiment_text.contains("# --set axes.scene=");
    (is_plain && !thesis.substitutes.is_empty()).then(|| {
        format!(
            "This run of \"{}\" took the scenes of the file's own axis. `raystone repro {}` takes those that stand for the \
             thesis's, and holds what it finds against its numbers and claims.",
            thesis.title, run.name
        )
    })
}

/// Digits of a hash that distinguish two kernels.
const SHORT_HASH: usize = 12;

/// Lists the embedded kernels that a folder replaced.
fn kernels_banner(folder: &KernelFolder) -> String {
    let short = |hash: &str| hash.chars().take(SHORT_HASH).collect::<String>();
    let list = |replaces: bool| {
        let files = folder.files.iter().filter(|file| file.replaces == replaces);
        let files = files.map(|file| format!("{} ({})", file.file, short(&file.hash)));
        files.collect::<Vec<_>>().join(", ")
    };
    let mut text = format!(
        "Not the program's own kernels: what is marked @{} ran with those of the folder {} ({})",
        folder.label,
        folder.folder,
        short(&folder.hash)
    );
    for (what, files) in [("replaced", list(true)), ("added", list(false))] {
        if !files.is_empty() {
            text += &format!("; {what}: {files}");
        }
    }
    text + ". References are rendered with the program's own."
}

fn scene_section(
    dir: &Path,
    data: &RunData,
    cells: &Cells,
    index: usize,
    scene: &SceneGroup,
) -> Section {
    let mut section = Section::new(format!("scene-{index}"), format!("Scene: {}", scene.name));
    let blocks = &mut section.blocks;
    blocks.extend(facts(scene));
    blocks.extend(structures::blocks(dir, data, index, scene));
    blocks.extend(peers::blocks(data, scene));
    blocks.extend(animation::blocks(data, &format!("scene-{index}"), scene));
    for (number, view) in scene.views.iter().enumerate() {
        let stem = format!("scene-{index}-{}-{number}", file_stem(&view.name));
        blocks.extend(samplers::blocks(dir, data, cells, &stem, (scene, view)));
    }
    let kernels = kernels::blocks(data, scene);
    let title = "Kernels: gains, and what was compiled in and out";
    blocks.extend(Block::fold(title, kernels));
    blocks.extend(organisations::blocks(data, scene));
    section
}

fn facts(scene: &SceneGroup) -> Vec<Block> {
    let Some(record) = scene.record else {
        return vec![Block::Paragraph("No record of the scene itself.".into())];
    };
    let mut text = format!(
        "{}, {}, {}, {}; {} on the host, loaded in {} ms.",
        format::plural(record.triangles, "triangle"),
        format::plural(record.materials, "material"),
        format::plural(record.textures, "texture"),
        format::plural(record.emitters, "emissive triangle"),
        format::bytes(record.bytes),
        format::number(record.load_ms),
    );
    let report = &record.report;
    if report.zero_area > 0 {
        let flat = format::plural(report.zero_area, "triangle");
        text += &format!(" {flat} of zero area kept.");
    }
    let warnings = report.lines().into_iter();
    let warnings = warnings.map(|w| Block::Paragraph(format!("While loading: {w}")));
    [Block::Paragraph(text)]
        .into_iter()
        .chain(warnings)
        .collect()
}

/// Returns a name as part of a file name: lower-case letters, digits and single dashes.
pub(crate) fn file_stem(name: &str) -> String {
    let mut stem = String::new();
    for c in name.chars() {
        if c.is_ascii_alphanumeric() {
            stem.push(c.to_ascii_lowercase());
        } else if !stem.ends_with('-') && !stem.is_empty() {
            stem.push('-');
        }
    }
    stem.trim_end_matches('-').into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_stems_are_safe() {
        assert_eq!(file_stem("path [depth=3]"), "path-depth-3");
        assert_eq!(file_stem("../../a<b>&c"), "a-b-c");
    }
}
