//! Samplers under one scene and integrator: errors, times, bias, pictures.

use super::sampler_plots::{error_figures, histograms, pareto_plot};
use super::spectrum;
use super::verdict::Race;
use crate::measure::bias::BiasVerdict;
use crate::measure::record::{BiasRecord, Interval, axis};
use crate::report::data::{RunData, View, is_valid_time};
use crate::report::document::*;
use crate::report::pivot::Pivot;
use crate::report::plot::histogram;
use crate::report::plot::pareto::letter;
use crate::report::samplers::{Metric, Sampler, UNRESOLVED};
use crate::report::values::{Value, of_view};
use crate::report::{format, pictures};
use std::path::Path;

/// Everything on the samplers of a view; `stem` starts the names of its plots.
pub fn blocks(dir: &Path, data: &RunData, stem: &str, view: &View) -> Vec<Block> {
    let mut blocks = vec![Block::Heading(format!("Samplers with {}", view.name))];
    let figures = error_figures(data, stem, view);
    if !figures.is_empty() {
        blocks.push(Block::Figures(figures));
    }
    blocks.extend(error_table(data, view, Metric::RelMse).into_block());
    blocks.extend(error_table(data, view, Metric::Rmse).into_block());
    blocks.extend(spectrum::blocks(data, stem, view));
    blocks.extend(efficiency_table(view).into_block());
    if let Some((pareto, hidden)) = pareto_plot(data, view)
        && let Some(drawing) = pareto.draw()
    {
        let caption = format!(
            "Run time against {}, one point per cell without a fault; lines: 95 % intervals. \
             Images are equal across structures, so a structure moves a sampler only sideways.{hidden}",
            Metric::RelMse.name()
        );
        blocks.push(Block::Figures(vec![Figure::new(
            format!("{stem}-pareto"),
            caption,
            drawing,
        )]));
    }
    blocks.extend(time_table(data, view).into_block());
    blocks.extend(bias_table(view).into_block());
    if let Some(drawing) = histogram::draw(&histograms(view)) {
        let caption = "Bias check: p-values of all tiles per sampler; flat (dashed) without bias, red where biased.";
        blocks.push(Block::Figures(vec![Figure::new(
            format!("{stem}-bias"),
            caption,
            drawing,
        )]));
    }
    blocks.extend(gallery(dir, view));
    if blocks.len() == 1 {
        blocks.push(Block::Paragraph("Nothing was measured.".into()));
    }
    blocks
}

/// Mean error per spp, slope and bias verdict.
pub fn error_table(data: &RunData, view: &View, metric: Metric) -> Table {
    let id = view
        .samplers
        .iter()
        .find_map(|s| s.metric_id(metric))
        .unwrap_or(metric.name());
    let means = || view.samplers.iter().flat_map(|s| s.mean_errors(metric));
    let root = match metric {
        Metric::RelMse => "",
        Metric::Rmse => "root of ",
    };
    let caption = format!(
        "{} with {}: mean [95 % interval] at each spp; metric {root}{id}{}",
        metric.name(),
        view.name,
        match means().all(|mean| mean.resolved) {
            true => String::new(),
            false => format!("; <: {UNRESOLVED}"),
        }
    );
    let row = |s: &Sampler| (s.name.clone(), vec![s.name.clone().into(), replicates(s)]);
    let measured = view.samplers.iter().filter(|s| !s.replicates.is_empty());
    let mut values = of_view(view);
    let spp = |value: &Value| value.key.label(axis::SPP).parse::<u32>().unwrap_or(0);
    values.sort_by_key(spp);
    if means().next().is_none() {
        return Table::default();
    }
    Pivot {
        caption,
        heads: &["sampler", "replicates"],
        rows: measured.map(row).collect(),
        row: &|key| data.names.sampler(key),
        figures: &[metric.figure(), metric.slope_figure()],
        across: Some(&|key| match key.label(axis::SPP) {
            "" => "slope".into(),
            spp => format!("{spp} spp"),
        }),
    }
    .table(&values)
}

fn replicates(sampler: &Sampler) -> Cell {
    let n = sampler.replicates.len().to_string();
    if sampler.is_deterministic() {
        Cell::with_detail(n, "deterministic")
    } else {
        n.into()
    }
}

fn interval_cell(sampler: &Sampler, error: &Interval) -> Cell {
    let value = format::number(error.value);
    match sampler.is_ranked() {
        true => Cell::with_detail(value, format::bounds(error)),
        false => value.into(),
    }
}

/// Verdict on the bias of every sampler.
pub fn bias_table(view: &View) -> Table {
    let levels = view.samplers.iter().filter_map(|s| s.bias);
    let level = levels.map(|bias| bias.alpha).reduce(f64::min);
    let caption = format!(
        "Bias check with {}: biased if the p of the image is at most half of {}, or tiles are rejected \
         at the other half",
        view.name,
        format::optional(level)
    );
    let columns = [
        "sampler",
        ":verdict",
        "tiles",
        "rejected",
        "smallest p of a tile",
        "z of the image",
        "p of the image",
        "degrees of freedom",
    ];
    let mut table = Table::new(caption, &columns);
    for sampler in view.samplers.iter().filter(|s| !s.replicates.is_empty()) {
        let name = sampler.name.clone().into();
        let testable = |bias: &&&BiasRecord| bias.p.is_some();
        let bias = sampler.bias.as_ref().filter(testable);
        let count = |n: Option<usize>| n.map_or(format::ABSENT.into(), |n| format::count(n as u64));
        table.rows.push(vec![
            name,
            bias_verdict(sampler),
            count(bias.map(|bias| bias.tiles)).into(),
            count(bias.map(|bias| bias.rejected)).into(),
            format::optional(bias.map(|bias| bias.min_p)).into(),
            format::optional(bias.and_then(|bias| bias.z)).into(),
            format::optional(bias.and_then(|bias| bias.p)).into(),
            format::optional(bias.and_then(|bias| bias.degrees_of_freedom)).into(),
        ]);
    }
    table
}

fn bias_verdict(sampler: &Sampler) -> Cell {
    if let Some(fault) = sampler.fault() {
        return Cell::from(fault).toned(Tone::Bad);
    }
    match sampler.bias {
        None => "not tested".into(),
        Some(bias) if bias.verdict == BiasVerdict::NoBiasFound => {
            Cell::from("no bias found").toned(Tone::Good)
        }
        Some(bias) => bias.verdict.to_string().into(),
    }
}

/// What a second buys: time per sample, error × time, error at equal time.
pub fn efficiency_table(view: &View) -> Table {
    let (Some(race), Some(spp)) = (Race::new(view), view.common_spp()) else {
        return Table::default();
    };
    let caption = format!("Error per second with {}, {}", view.name, race.structure);
    let name = Metric::RelMse.name();
    let product = format!("{name} × seconds at {spp} spp");
    let equal_time = format!("{name} after {} s", format::number(race.seconds));
    let mut table = Table::new(caption, &["sampler", "ms per spp", &product, &equal_time]);
    for sampler in &view.samplers {
        let Some(per_spp) = view.ms_per_spp(&race.structure, &sampler.name) else {
            continue;
        };
        let seconds = f64::from(spp) * per_spp.value / 1000.0;
        let product = sampler
            .mean_error_at(Metric::RelMse, spp)
            .filter(|mean| mean.resolved)
            .map(|mean| mean.error.value * seconds);
        table.rows.push(vec![
            sampler.name.clone().into(),
            Cell::with_detail(format::number(per_spp.value), format::bounds(&per_spp)),
            format::optional(product).into(),
            race.error_of(&sampler.name)
                .map_or_else(|| format::ABSENT.into(), |e| interval_cell(sampler, &e)),
        ]);
    }
    table
}

/// Milliseconds per spp of every cell.
fn time_table(data: &RunData, view: &View) -> Table {
    let structures = view.timed_structures();
    let row = |(i, name): (usize, &String)| {
        let cell = Cell::with_detail(name.clone(), format!("({})", letter(i)));
        (name.clone(), vec![cell])
    };
    let mut table = Pivot {
        caption: format!(
            "Time of full cells with {}, ms per spp: median [{}]",
            view.name,
            format::median_bounds(view.times.iter().map(|time| time.ms.len()))
        ),
        heads: &["structure"],
        rows: structures.iter().enumerate().map(row).collect(),
        row: &|key| key.label(axis::ACCEL).to_owned(),
        figures: &["ms-per-spp/v1"],
        across: Some(&|key| data.names.sampler(key)),
    }
    .table(&of_view(view));
    for time in view.times.iter().filter(|time| !is_valid_time(time)) {
        let reason = match time.failure {
            None => "image differs",
            Some(_) => "FAILED",
        };
        let row = structures.iter().position(|s| *s == time.structure);
        let column = table.columns.iter().position(|c| c.title == time.sampler);
        if let (Some(row), Some(column)) = (row, column) {
            table.rows[row][column] = Cell::from(reason).toned(Tone::Bad);
        }
    }
    table
}

fn gallery(dir: &Path, view: &View) -> Option<Block> {
    let mut items = Vec::new();
    if let Some(reference) = view
        .reference
        .filter(|reference| !reference.image.is_empty())
    {
        let spp = format::count(u64::from(reference.spp));
        let caption = match reference.exact {
            Some(value) => format!("reference: the exact value, {value}"),
            None => format!(
                "reference: {spp} spp of {}, {} s",
                reference.sampler,
                format::number(reference.seconds)
            ),
        };
        items.push(pictures::load(dir, &reference.image, caption));
    }
    for sampler in &view.samplers {
        let Some(first) = sampler
            .replicates
            .iter()
            .find(|r| r.image.is_some() || r.error_map.is_some())
        else {
            continue;
        };
        let spp = first
            .errors
            .last()
            .map_or(String::new(), |error| format!(", {} spp", error.spp));
        if let Some(path) = &first.image {
            items.push(pictures::load(dir, path, format!("{}{spp}", sampler.name)));
        }
        if let Some(path) = &first.error_map {
            items.push(pictures::load(
                dir,
                path,
                format!("error of {}{spp}", sampler.name),
            ));
        }
    }
    let caption = format!("Renders and error maps with {}", view.name);
    (!items.is_empty()).then_some(Block::Gallery(Gallery {
        caption,
        items,
        scale: None,
    }))
}
