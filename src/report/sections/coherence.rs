//! How alike the rays of neighbouring lanes are, by the model; and what it predicts, against what was measured.

use crate::data::{Measured, RunData, View};
use crate::document::*;
use crate::format;
use crate::pivot::{FIGURES_ALONE, Rows};
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::values::Value;
use raystone_record::SINGLE_KERNEL;
use raystone_record::figure::{self, Figure};
use raystone_record::{ALL_RAYS, CoherenceAt, CoherenceRecord, Interval, Key, axis};
use raystone_stats::statistics::kendall_tau;

/// Figures of all rays together, in the order of the columns.
const FIGURES: [&Figure; 9] = [
    &figure::SIMT_EFFICIENCY,
    &figure::LINES_PER_ISSUE,
    &figure::L1_HITS,
    &figure::L2_HITS,
    &figure::ISSUES_PER_RAY,
    &figure::L2_BYTES_PER_RAY,
    &figure::MEMORY_BYTES_PER_RAY,
    &figure::CYCLES_PER_RAY,
    &figure::CYCLES_PER_PATH,
];

/// What tells cells of a view and their organisations apart.
const ROWS: [&str; 6] = [
    axis::ACCEL,
    axis::SEQUENCE,
    axis::DECORRELATION,
    axis::OFFSET,
    axis::SPP,
    axis::SUBJECT,
];

/// Tables and plots of a view; nothing where nothing was modelled.
pub fn blocks(data: &RunData, stem: &str, view: &View, values: &[Value]) -> Vec<Block> {
    let Some(first) = view.coherence.first() else {
        return Vec::new();
    };
    let mut blocks = vec![Block::Paragraph(machine(first))];
    blocks.extend(table(data, view, values).into_block());
    blocks.extend(class_table(data, view, values).into_block());
    let mut figures = vec![by_bounce(data, stem, view), by_spp(data, stem, view)];
    figures.push(against_times(data, stem, view));
    blocks.extend(Block::figures(figures));
    blocks
}

fn machine(record: &CoherenceRecord) -> String {
    let s = &record.settings;
    let ways = |ways: u32| match ways {
        0 => "fully associative".to_owned(),
        ways => format!("{ways}-way"),
    };
    let size = |kib: u32| format::bytes(1024 * u64::from(kib));
    format!(
        "Coherence, by a model on the host: warps of {} × {} pixels of an image of {} × {}, {} of each of {} groups, {} of each pixel; an L1 of {} ({}) \
         for each group and an L2 of {} ({}) for all, both empty at first, with lines of {} bytes, of which those go that were used \
         longest ago. An issue is a visit of a node or a test of a triangle that lanes of a warp do together; cycles are those of one \
         multiprocessor if nothing but throughput counted. Single kernel: lanes keep their pixels and wait once the path has ended; \
         compacted: the rays that are left fill the group's warps anew at each bounce, in their order or, where a compaction is \
         unstable, with warps or rays in any order.",
        s.warp[0],
        s.warp[1],
        s.resolution[0],
        s.resolution[1],
        format::plural(s.warps as usize, "warp"),
        s.groups,
        format::plural(s.samples as usize, "sample"),
        size(s.l1_kib),
        ways(s.l1_ways),
        size(s.l2_kib),
        ways(s.l2_ways),
        s.line_bytes,
    )
}

/// A row for each cell and organisation at the highest number of samples, or at each.
fn rows<'a>(
    data: &RunData,
    view: &View,
    heads: &'a [&'a str],
    shown: impl Fn(&CoherenceAt, &CoherenceRecord) -> bool,
) -> Rows<'a> {
    let mut rows = Vec::new();
    for cell in &view.coherence {
        for at in cell.at.iter().filter(|at| shown(at, cell.body)) {
            let key = (cell.key.clone())
                .with(axis::SPP, at.spp)
                .with(axis::SUBJECT, &at.organisation);
            let mut cells: Vec<TableCell> = vec![
                cell.structure.clone().into(),
                data.names.sampler(&cell.key).into(),
                at.spp.to_string().into(),
            ];
            if heads.len() > cells.len() {
                cells.push(at.organisation.clone().into());
            }
            rows.push((key, cells));
        }
    }
    Rows::new(&ROWS, heads, rows)
}

fn table(data: &RunData, view: &View, values: &[Value]) -> Table {
    let is_all = |value: &&Value| value.key.label(axis::RAYS) == ALL_RAYS;
    let values: Vec<Value> = values.iter().filter(is_all).cloned().collect();
    let heads = ["structure", ":sampler", "spp", ":lanes"];
    let caption = format!("Coherence with {}, all rays together", view.name);
    rows(data, view, &heads, |_, _| true).table(&values, caption, &FIGURES, FIGURES_ALONE)
}

fn is_single_kernel(at: &CoherenceAt) -> bool {
    at.organisation == SINGLE_KERNEL
}

/// SIMT efficiency of each class of rays.
fn class_table(data: &RunData, view: &View, values: &[Value]) -> Table {
    let caption = format!(
        "SIMT efficiency with {} by class of rays, single kernel: of the lanes of warps with any such ray, those that take \
         part in an issue",
        view.name
    );
    let heads = ["structure", ":sampler", "spp"];
    let rows = rows(data, view, &heads, |at, _| is_single_kernel(at));
    let class = |key: &Key| key.label(axis::RAYS).to_owned();
    rows.table(values, caption, &[&figure::SIMT_EFFICIENCY], &class)
}

/// The structure that curves of samplers are drawn with: the first.
fn shown_structure<'a>(view: &'a View) -> impl Iterator<Item = &'a Measured<'a, CoherenceRecord>> {
    let first = view.coherence.first().map(|cell| &cell.structure);
    let is_it = move |cell: &&Measured<CoherenceRecord>| Some(&cell.structure) == first;
    view.coherence.iter().filter(is_it)
}

/// A curve for each sampler.
fn curves(
    data: &RunData,
    view: &View,
    points: impl Fn(&CoherenceRecord) -> Vec<[f64; 2]>,
) -> Vec<Curve> {
    let curve = |cell: &Measured<CoherenceRecord>| {
        let points = points(cell.body).into_iter();
        let points = points.map(|[x, y]| CurvePoint::new(x, &Interval::exact(y)));
        Curve {
            label: cell.sampler.clone(),
            look: data.sampler_look(&cell.sampler),
            exact: false,
            points: points.collect(),
        }
    };
    let curves = shown_structure(view).map(curve);
    curves.filter(|curve| !curve.points.is_empty()).collect()
}

/// SIMT efficiency of the rays from surface to surface, by the number of bounces before them.
fn by_bounce(data: &RunData, stem: &str, view: &View) -> Option<Illustration> {
    let structure = &view.coherence.first()?.structure;
    let curves = curves(data, view, |record| {
        let last = record.at.iter().rev().find(|at| is_single_kernel(at));
        let classes = last.into_iter().flat_map(|at| &at.classes);
        let point = |(class, tally): &(String, _)| {
            let bounce = match class.as_str() {
                "primary" => Some(0.0),
                class => class.strip_prefix("bounce ")?.parse().ok(),
            };
            let tally: &raystone_record::Tally = tally;
            Some([bounce?, tally.efficiency()?])
        };
        classes.filter_map(point).collect()
    });
    let plot = CurvePlot {
        x_title: "bounces before the ray".into(),
        x_ticks: Ticks::Whole,
        y_title: "SIMT efficiency".into(),
        curves,
        guides: Vec::new(),
    };
    plot.figure(
        format!("{stem}-efficiency-bounces"),
        format!(
            "SIMT efficiency by bounce at the highest spp, with {structure}, single kernel: lanes that take part in an issue over \
             lanes of warps with any ray of that bounce."
        ),
    )
}

/// Predicted cycles of a path against the number of samples that the sampler was made for.
fn by_spp(data: &RunData, stem: &str, view: &View) -> Option<Illustration> {
    let structure = &view.coherence.first()?.structure;
    let curves = curves(data, view, |record| {
        let single = record.at.iter().filter(|at| is_single_kernel(at));
        let point = |at: &CoherenceAt| Some([f64::from(at.spp), at.cost_of_path()?]);
        single.filter_map(point).collect()
    });
    let several = curves.iter().any(|curve| curve.points.len() > 1);
    let plot = CurvePlot {
        x_title: "samples per pixel".into(),
        x_ticks: Ticks::PowersOfTwo,
        y_title: "predicted cycles per path".into(),
        curves,
        guides: Vec::new(),
    };
    let caption = format!(
        "Predicted cycles of a path by samples per pixel, with {structure}, single kernel."
    );
    several.then(|| plot.figure(format!("{stem}-cycles-spp"), caption))?
}

/// Predicted cycles of a path against measured time, over all cells that were timed.
fn against_times(data: &RunData, stem: &str, view: &View) -> Option<Illustration> {
    let mut curves: Vec<Curve> = Vec::new();
    let mut pairs: Vec<[f64; 2]> = Vec::new();
    for cell in &view.coherence {
        let timed = cell.timed(SINGLE_KERNEL);
        let predicted = timed.and_then(CoherenceAt::cost_of_path);
        let measured = view.ms_per_spp(&cell.structure, &cell.sampler);
        let (Some(predicted), Some(measured)) = (predicted, measured) else {
            continue;
        };
        pairs.push([predicted, measured.value]);
        let point = CurvePoint::new(predicted, &measured);
        match curves
            .iter_mut()
            .find(|curve| curve.label == cell.structure)
        {
            Some(curve) => curve.points.push(point),
            None => curves.push(Curve {
                label: cell.structure.clone(),
                look: data.structure_look(&cell.structure),
                exact: false,
                points: vec![point],
            }),
        }
    }
    for curve in &mut curves {
        curve.points.sort_by(|a, b| a.x.total_cmp(&b.x));
    }
    let tau = kendall_tau(&pairs)?;
    let plot = CurvePlot {
        x_title: "predicted cycles per path".into(),
        x_ticks: Ticks::PowersOfTen,
        y_title: "measured ms per spp".into(),
        curves,
        guides: Vec::new(),
    };
    let software = data.run.is_some_and(|run| run.environment.software);
    let adapter = match software {
        true => {
            " The times are those of a software adapter, whose lanes and caches are others than the model's."
        }
        false => "",
    };
    plot.figure(
        format!("{stem}-predicted-times"),
        format!(
            "Prediction against measured time, a point for each of {} cells. Rank correlation (Kendall's τ): {}.{adapter}",
            pairs.len(),
            format::significant(tau, 2)
        ),
    )
}
