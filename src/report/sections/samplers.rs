//! Samplers under one scene and integrator: errors, times, bias, pictures.

use super::cells::Cells;
use super::coherence;
use super::comparer;
use super::sampler_plots::{error_figures, histograms, pareto_figure};
use super::specs::{BIAS, EFFICIENCY, ERRORS, FURTHER_ERRORS, ORDERS, PRIMARY};
use super::spectrum;
use super::verdict::Race;
use crate::data::{RunData, SceneGroup, View};
use crate::document::*;
use crate::names::Names;
use crate::pivot::Rows;
use crate::plot::pareto::letter;
use crate::samplers::{HEAVY_TAILED, MeasuredSampler, Metric, UNRESOLVED};
use crate::spec::TableSpec;
use crate::values::{Value, number, of_view};
use crate::{format, pictures};
use raystone_image::viridis_css;
use raystone_record::figure;
use raystone_record::{Key, axis};
use raystone_stats::bias::BiasVerdict;
use std::path::Path;

/// Returns everything on the samplers of a view; `stem` starts the names of its plots.
pub fn blocks(
    dir: &Path,
    data: &RunData,
    cells: &Cells,
    stem: &str,
    (scene, view): (&SceneGroup, &View),
) -> Vec<Block> {
    let values = of_view(data, scene, view);
    let mut blocks = vec![Block::Heading(format!("Samplers with {}", view.name))];
    let names = &data.names;
    let curves = |metric| Block::figures(error_figures(data, stem, view, &values, metric));
    blocks.extend(curves(Metric::RelMse));
    blocks.extend(comparer::block(dir, data, stem, view));
    let table = |table: Table| table.into_block();
    let one = |block: Option<Block>| block.into_iter().collect::<Vec<Block>>();
    let mut numbers = one(table(error_table(names, view, &values, Metric::RelMse)));
    numbers.extend(curves(Metric::Rmse));
    numbers.extend(table(error_table(names, view, &values, Metric::Rmse)));
    numbers.extend(table(further_table(names, view, &values)));
    let mut matrix = one(Block::figures([pareto_figure(data, stem, view)]));
    matrix.extend(table(time_table(data, view, &values, cells)));
    let counts = view.times.iter().map(|time| time.ms.len());
    let words = [&*view.name, &format::median_bounds(counts)];
    let rays = [ORDERS, PRIMARY].map(|spec| table(spec.table(names, &values, &words)));
    let mut rays: Vec<Block> = rays.into_iter().flatten().collect();
    rays.extend(coherence::blocks(data, stem, view, &values));
    let mut bias = one(table(bias_table(names, view, &values)));
    bias.extend(Block::figures([histograms(stem, view)]));
    let bought = one(table(efficiency_table(names, view, &values)));
    let spectra = spectrum::blocks(data, stem, view, &values);
    let pictures = galleries(dir, view).into_iter().flatten().collect();
    let folds = [
        ("Errors as numbers, and other metrics", numbers),
        ("What a second buys", bought),
        (
            "Time against error: structure × sampler, Pareto front",
            matrix,
        ),
        ("What the error looks like: spectra and filters", spectra),
        ("Order and coherence of the rays", rays),
        ("Bias check", bias),
        ("Pictures and error maps", pictures),
    ];
    let folds = folds.into_iter();
    blocks.extend(folds.filter_map(|(title, inside)| Block::fold(title, inside)));
    if blocks.len() == 1 {
        blocks.push(Block::Paragraph("Nothing was measured.".into()));
    }
    blocks
}

/// Returns a row for each sampler with images, with a further cell.
fn measured(
    view: &View,
    cell: impl Fn(&MeasuredSampler) -> TableCell,
) -> Vec<(Key, Vec<TableCell>)> {
    let measured = view.samplers.iter().filter(|s| !s.replicates.is_empty());
    measured.map(|s| (s.key.clone(), vec![cell(s)])).collect()
}

/// Returns the table of mean error per spp, slope and bias verdict.
pub fn error_table(names: &Names, view: &View, values: &[Value], metric: Metric) -> Table {
    let id = view.samplers.iter().find_map(|s| s.metric_id(metric));
    let shown = [view.figure(metric), metric.slope_figure()];
    let of_metric = values
        .iter()
        .filter(|v| shown.iter().any(|f| f.id == v.figure.id));
    let mut values: Vec<Value> = of_metric.cloned().collect();
    values.sort_by_key(|value| number(&value.key, axis::SPP));
    let Some(id) = id.filter(|_| !values.is_empty()) else {
        return Table::default();
    };
    let errors = view.samplers.iter().flat_map(|s| &s.replicates);
    let errors = errors.flat_map(|replicate| &replicate.errors);
    let partial: Vec<u32> = errors.filter(|e| e.partial_net).map(|e| e.spp).collect();
    let id = match metric {
        Metric::RelMse => id.to_owned(),
        Metric::Rmse => format!("root of {id}"),
    };
    let mut notes = String::new();
    if values.iter().any(Value::is_unresolved) {
        notes += &format!("; <: {UNRESOLVED}");
    }
    if values.iter().any(Value::is_heavy_tailed) {
        notes += &format!("; ‡: an interval not to be trusted: {HEAVY_TAILED}");
    }
    if !partial.is_empty() {
        notes += "; †: no whole net of samplers in base 2";
    }
    let rows = measured(view, |s| {
        TableCell::repeats(s.replicates.len(), !s.is_deterministic())
    });
    let words = [&*shown[0].title, &view.name, &id, &notes];
    let spec = TableSpec {
        figures: &shown,
        ..ERRORS
    };
    let mut table = spec.beside(names, &values, &words, &["replicates"], rows);
    for spp in partial {
        let title = format!("{spp} spp");
        let mut columns = table.columns.iter_mut();
        if let Some(column) = columns.find(|column| column.title == title) {
            column.title += " †";
        }
    }
    table
}

/// Returns other metrics at the highest spp.
pub(crate) fn further_table(names: &Names, view: &View, values: &[Value]) -> Table {
    at_ends(FURTHER_ERRORS, names, view, values, |sampler| {
        sampler.highest_spp()
    })
}

/// Returns a table of figures at the samples that each sampler ended with: told once if they are the same, and of each
/// where `run.stop` ended them apart.
pub(super) fn at_ends(
    spec: TableSpec,
    names: &Names,
    view: &View,
    values: &[Value],
    end: impl Fn(&MeasuredSampler) -> Option<u32>,
) -> Table {
    let ends = view.samplers.iter().filter_map(|s| Some((&s.key, end(s)?)));
    let ends: Vec<(&Key, u32)> = ends.collect();
    let Some((_, first)) = ends.first() else {
        return Table::default();
    };
    if ends.iter().all(|(_, spp)| spp == first) {
        return spec.table(names, values, &[&view.name, &format!("{first} spp")]);
    }
    let rows = ends
        .iter()
        .map(|(key, spp)| ((*key).clone(), vec![spp.to_string().into()]));
    let words = [&*view.name, "the spp that each ended with"];
    spec.beside(names, values, &words, &["spp"], rows)
}

/// Returns the table of bias verdicts.
fn bias_table(names: &Names, view: &View, values: &[Value]) -> Table {
    let levels = view.samplers.iter().filter_map(|s| s.bias.as_ref());
    let level = levels.map(|bias| bias.alpha).reduce(f64::min);
    let verdict = |sampler: &MeasuredSampler| match (sampler.fault(), &sampler.bias) {
        (Some(fault), _) => TableCell::from(fault).toned(Tone::Bad),
        (None, None) => "not tested".into(),
        (None, Some(bias)) if bias.verdict == BiasVerdict::NoBiasFound => {
            let least = bias.detectable.map_or(String::new(), |part| {
                format!(" (of {} % or more)", format::significant(100.0 * part, 2))
            });
            TableCell::from(format!("no bias found{least}")).toned(Tone::Good)
        }
        (None, Some(bias)) => bias.verdict.to_string().into(),
    };
    let (words, rows) = (
        [&*view.name, &format::optional(level)],
        measured(view, verdict),
    );
    BIAS.beside(names, values, &words, &[":verdict"], rows)
}

/// Returns the table of efficiency: time per sample, error × time, error at equal time.
pub(crate) fn efficiency_table(names: &Names, view: &View, values: &[Value]) -> Table {
    let Some(race) = Race::new(view) else {
        return Table::default();
    };
    let is_its = |value: &&Value| value.key.label(axis::ACCEL) == race.structure;
    let values: Vec<Value> = values.iter().filter(is_its).cloned().collect();
    EFFICIENCY.table(names, &values, &[&view.name, &race.structure])
}

/// Returns the table of milliseconds per spp of every cell.
fn time_table(data: &RunData, view: &View, values: &[Value], cells: &Cells) -> Table {
    let structures = view.timed_structures();
    let row = |(i, name): (usize, &String)| {
        let cell = TableCell::with_detail(name.clone(), format!("({})", letter(i)));
        (Key::default().with(axis::ACCEL, name), vec![cell])
    };
    let bounds = format::median_bounds(view.times.iter().map(|time| time.ms.len()));
    let caption = format!(
        "Structure × sampler with {}: time of full cells, ms per spp: median [{bounds}]; each leads to its cell",
        view.name
    );
    let rows = structures.iter().enumerate().map(row);
    let rows = Rows::new(&[axis::ACCEL], &["structure"], rows);
    let mut table = rows.table(values, caption, &[&figure::MS_PER_SPP], &|key| {
        data.names.sampler(key)
    });
    for time in &view.times {
        let row = structures.iter().position(|s| *s == time.structure);
        let column = table.columns.iter().position(|c| c.title == time.sampler);
        if let (Some(row), Some(column)) = (row, column) {
            let cell = &mut table.rows[row][column];
            if !time.is_valid() {
                let reason = match time.failure {
                    None => "image differs",
                    Some(_) => "FAILED",
                };
                *cell = TableCell::from(reason).toned(Tone::Bad);
            }
            cell.link = cells.link(&time.key);
        }
    }
    table
}

/// Returns the reference and a render of each sampler, then where each render is wrong.
fn galleries(dir: &Path, view: &View) -> [Option<Block>; 2] {
    let mut renders = Vec::new();
    let mut errors = Vec::new();
    if let Some(reference) = view.reference.filter(|r| !r.image.is_empty()) {
        let caption = match (reference.exact, &reference.file) {
            (Some(value), _) => format!("reference: the exact value, {value}"),
            (None, Some(file)) => format!("reference: {file}"),
            (None, None) => {
                let spp = format::count(u64::from(reference.spp));
                let origin = if reference.cached {
                    "kept from an earlier run".to_owned()
                } else {
                    format!("{} s", format::number(reference.seconds))
                };
                format!("reference: {spp} spp of {}, {origin}", reference.sampler)
            }
        };
        let alt = format!("Reference image with {}", view.name);
        renders.push(pictures::load(dir, &reference.image, caption).described(alt));
    }
    for sampler in &view.samplers {
        let mut replicates = sampler.replicates.iter();
        let shown = replicates.find(|r| r.image.is_some() || r.error_map.is_some());
        let Some(first) = shown else { continue };
        let last = first.errors.last();
        let spp = last.map_or(String::new(), |error| format!(", {} spp", error.spp));
        let name = format!("{}{spp}", sampler.name);
        let load = |path: &String, what: &str| {
            let alt = format!("{what} of {name} with {}", view.name);
            pictures::load(dir, path, name.clone()).described(alt)
        };
        renders.extend(first.image.as_ref().map(|path| load(path, "Image")));
        errors.extend(first.error_map.as_ref().map(|path| load(path, "Error map")));
    }
    let scale = ColorScale {
        gradient: viridis_css(),
        title: "error of a pixel relative to the reference: √ of the mean over red, green and blue of \
                (value − reference)² / (reference² + 0.01), no unit; the same scale for all, 1 and more in one colour; \
                pixels that are no numbers in magenta"
            .into(),
        labels: [0.0, 0.25, 0.5, 0.75, 1.0].map(format::number).to_vec(),
    };
    let caption = |what: &str| format!("{what} with {}", view.name);
    [
        Block::gallery(caption("Renders"), renders, None),
        Block::gallery(caption("Error maps"), errors, Some(scale)),
    ]
}
