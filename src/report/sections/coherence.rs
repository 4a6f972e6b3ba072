//! Modelled coherence of the rays of neighbouring lanes, and its predictions against measurements.

use super::specs::{COHERENCE, COHERENCE_OF_CLASSES, CYCLES_BY_SPP, EFFICIENCY_BY_BOUNCE};
use crate::data::{Measured, RunData, View, grouped};
use crate::document::*;
use crate::format;
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::values::Value;
use raystone_record::{ALL_RAYS, CoherenceRecord, Key, SINGLE_KERNEL, axis};
use raystone_stats::statistics::kendall_tau;

/// Returns the tables and plots of a view; nothing where nothing was modelled.
pub fn blocks(data: &RunData, stem: &str, view: &View, values: &[Value]) -> Vec<Block> {
    let Some(first) = view.coherence.first() else {
        return Vec::new();
    };
    let mut blocks = vec![Block::Paragraph(machine(first))];
    let chosen = |keep: &dyn Fn(&Key) -> bool| -> Vec<Value> {
        values.iter().filter(|v| keep(&v.key)).cloned().collect()
    };
    let is_of_all = |key: &Key| key.label(axis::RAYS) == ALL_RAYS;
    let is_single = |key: &Key| key.label(axis::SUBJECT) == SINGLE_KERNEL;
    let tables = [
        COHERENCE.table(&data.names, &chosen(&is_of_all), &[&view.name]),
        COHERENCE_OF_CLASSES.table(&data.names, &chosen(&is_single), &[&view.name]),
    ];
    blocks.extend(tables.into_iter().filter_map(Table::into_block));
    // Curves of samplers are drawn with the first structure.
    let structure = &first.structure;
    let is_drawn = |key: &Key| is_single(key) && key.label(axis::ACCEL) == *structure;
    let most = view.coherence.iter().flat_map(|cell| cell.at.last());
    let most = most.map(|at| at.spp.to_string()).next().unwrap_or_default();
    let at_most = chosen(&|key| is_drawn(key) && key.label(axis::SPP) == most);
    let by_spp = chosen(&is_drawn);
    let several = first.at.iter().any(|at| at.spp != first.at[0].spp);
    blocks.extend(Block::figures([
        EFFICIENCY_BY_BOUNCE.figure(data, &at_most, stem, &[structure]),
        several
            .then(|| CYCLES_BY_SPP.figure(data, &by_spp, stem, &[structure]))
            .flatten(),
        against_times(data, stem, view),
    ]));
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
        "Coherence, by a model on the host: warps of {} × {} pixels of an image of {} × {}, {} of each of {}, {} of each pixel; an L1 of {} ({}) \
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
        format::plural(s.groups as usize, "group"),
        format::plural(s.samples as usize, "sample"),
        size(s.l1_kib),
        ways(s.l1_ways),
        size(s.l2_kib),
        ways(s.l2_ways),
        s.line_bytes,
    )
}

/// Returns the plot of predicted cycles of a path against measured time, over all cells that were timed.
fn against_times(data: &RunData, stem: &str, view: &View) -> Option<Illustration> {
    let point = |cell: &Measured<CoherenceRecord>| {
        let predicted = cell.timed(SINGLE_KERNEL)?.cost_of_path()?;
        let measured = view.ms_per_spp(&cell.structure, &cell.sampler)?;
        Some((
            cell.structure.clone(),
            CurvePoint::new(predicted, &measured),
        ))
    };
    let points: Vec<(String, CurvePoint)> = view.coherence.iter().filter_map(point).collect();
    let pairs: Vec<[f64; 2]> = points.iter().map(|(_, p)| [p.x, p.y]).collect();
    let curve = |(label, points): (String, Vec<(String, CurvePoint)>)| {
        let mut points: Vec<CurvePoint> = points.into_iter().map(|(_, point)| point).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Curve {
            look: data.structure_look(&label),
            label,
            exact: false,
            points,
        }
    };
    let curves = grouped(points, |(name, _)| name.clone())
        .into_iter()
        .map(curve);
    let tau = kendall_tau(&pairs)?;
    let (x_title, y_title) = ("predicted cycles per path", "measured ms per spp");
    let plot = CurvePlot::new(x_title, Ticks::PowersOfTen, y_title, curves);
    let software = data.run.is_some_and(|run| run.environment.software);
    let adapter = if software {
        " The times are those of a software adapter, whose lanes and caches are others than the model's."
    } else {
        ""
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
