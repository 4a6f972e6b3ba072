//! Compactions of streams: time per element, growth with the number of elements, effects of parameters.

use super::specs::GROWTH;
use crate::data::{RunData, grouped};
use crate::document::*;
use crate::format::{ABSENT, median_bounds};
use crate::pivot::{FIGURES_ALONE, Rows};
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::values::{Estimate, Value, of_readings};
use raystone_core::params::ParamValue;
use raystone_record::figure::{self, COMPACTION_NS};
use raystone_record::{Interval, Key, MeasuredRecord, Recorded, axis};
use raystone_stats::growth::{Growth, growth};
use raystone_stats::statistics::median_interval;
use std::collections::BTreeSet;

type Measured<'a> = Recorded<'a, MeasuredRecord>;

/// Name of the measurement in records.
pub(crate) const NAME: &str = "compaction";

/// Axes that distinguish the compactions of a run.
const ROW: [&str; 2] = [axis::INTEGRATOR, axis::KERNELS];
/// Parameters of the stream.
const STREAM: [&str; 3] = ["elements", "valid", "bytes"];
/// The baseline: the method that the thesis proposes, with its own parameters.
const BASELINE: &str = "compaction:roger";
/// A curve has so many points at least.
const LEAST_POINTS: usize = 3;

const CHECKED: &str = "Each method first compacted its stream once and was checked word by word against what the flags \
                      say: elements that stay, no hole, none twice, in their order where that is promised. Then all \
                      were timed in the same rounds; before each turn the count was set to a wrong number and what \
                      stayed wiped out, and after it two sums over what stayed were compared with the host's. What \
                      differs has no figure. Times are those of all passes of a method together.";

/// Returns the section; `None` when no compaction was measured.
pub(crate) fn section(data: &RunData) -> Option<Section> {
    if data.measured_by(NAME).is_empty() {
        return None;
    }
    let mut section = Section::new("compaction", "Compaction of streams");
    section.blocks.push(Block::Paragraph(CHECKED.into()));
    section.blocks.extend(Block::figures(plots(data)));
    let values = values(data);
    let tables = [growth_table(data, &values), table(data, &values)];
    let blocks = tables.into_iter().filter_map(Table::into_block);
    section.blocks.extend(blocks);
    Some(section)
}

/// Returns the label of a cell without some parameters.
fn label_without(key: &Key, left_out: &[&str]) -> String {
    let label = key.label(axis::INTEGRATOR);
    let (name, parameters) = label.split_once('(').unwrap_or((label, ""));
    let is_left_out = |part: &&str| {
        let name = part.split('=').next().unwrap_or_default();
        left_out.contains(&name)
    };
    let parts = parameters.trim_end_matches(')').split(',');
    let parts: Vec<&str> = parts.filter(|p| !p.is_empty() && !is_left_out(p)).collect();
    let mut text = if parts.is_empty() {
        name.to_owned()
    } else {
        format!("{name}({})", parts.join(","))
    };
    if let Some(kernels) = key.get(axis::KERNELS) {
        text += &format!(", @{kernels}");
    }
    text
}

/// Nanoseconds per element, round by round; `None` for a cell that failed.
fn time<'a>(cell: &Measured<'a>) -> Option<&'a raystone_record::Reading> {
    let mut readings = cell.readings.iter();
    readings.find(|reading| reading.figure == COMPACTION_NS.id)
}

/// Returns a parameter of the stream or the method.
fn parameter(key: &Key, name: &str) -> Option<f64> {
    match key.get(axis::INTEGRATOR)?.params.0.get(name)? {
        ParamValue::Integer(x) => Some(*x as f64),
        ParamValue::Number(x) => Some(*x),
        _ => None,
    }
}

/// Returns the common part of all cells of a curve over a parameter.
fn others(key: &Key, parameter: &str) -> (String, String) {
    let Some(variant) = key.get(axis::INTEGRATOR) else {
        return Default::default();
    };
    let mut params = variant.params.clone();
    params.0.remove(parameter);
    let text = format!("{} {:?}", variant.name, params.0);
    (text, key.label(axis::KERNELS).to_owned())
}

/// Returns the cells that differ in one parameter alone, by growing values of it.
fn over<'a>(data: &RunData<'a>, name: &str) -> Vec<Vec<(f64, Measured<'a>)>> {
    let cells = data.measured_by(NAME).into_iter();
    let timed = cells.filter(|cell| time(cell).is_some());
    let placed = timed.filter_map(|cell| Some((parameter(cell.key, name)?, cell)));
    let groups = grouped(placed, |(_, cell)| others(cell.key, name));
    let mut groups: Vec<_> = groups.into_iter().map(|(_, cells)| cells).collect();
    let sort = |cells: &mut Vec<(f64, _)>| cells.sort_by(|a, b| a.0.total_cmp(&b.0));
    groups.iter_mut().for_each(sort);
    groups.retain(|cells| cells.len() >= LEAST_POINTS);
    groups
}

/// Returns a plot for each parameter that was varied.
fn plots(data: &RunData) -> Vec<Option<Illustration>> {
    let variants = data.measured_by(NAME).into_iter();
    let variants = variants.filter_map(|c| c.key.get(axis::INTEGRATOR));
    let own = variants.flat_map(|v| v.params.0.keys().map(String::as_str));
    let own: BTreeSet<&str> = own.filter(|name| !STREAM.contains(name)).collect();
    let all = STREAM.into_iter().chain(own);
    all.map(|parameter| plot(data, parameter)).collect()
}

fn plot(data: &RunData, parameter: &str) -> Option<Illustration> {
    let whole = parameter == "elements";
    let curve = |cells: Vec<(f64, Measured)>| {
        let (_, first) = cells.first()?;
        let point = |(x, cell): &(f64, Measured)| {
            let time = time(cell)?;
            // The whole stream, in milliseconds.
            let y = time.value.scaled(if whole { x * 1e-6 } else { 1.0 });
            Some(CurvePoint::new(*x, &y))
        };
        Some(Curve {
            label: label_without(first.key, &[parameter]),
            look: look(data, first.key),
            exact: false,
            points: cells.iter().filter_map(point).collect(),
        })
    };
    let groups = over(data, parameter).into_iter();
    let mut curves: Vec<Curve> = groups.filter_map(curve).collect();
    // If one method has several curves, colours do not stand for methods.
    let looks: BTreeSet<usize> = curves.iter().map(|curve| curve.look).collect();
    if looks.len() < curves.len() {
        let numbered = curves.iter_mut().enumerate();
        numbered.for_each(|(place, curve)| curve.look = place);
    }
    let (y_title, says) = if whole {
        ("time, ms", "Time of a compaction")
    } else {
        ("time per element, ns", "Time per element of the stream")
    };
    let (x_title, x_ticks) = match parameter {
        "elements" => ("elements", Ticks::PowersOfTwo),
        "valid" => ("share of elements that stay", Ticks::PowersOfTen),
        "bytes" => ("bytes of an element", Ticks::PowersOfTwo),
        other => (other, Ticks::PowersOfTwo),
    };
    let plot = CurvePlot::new(x_title, x_ticks, y_title, curves);
    let caption = format!(
        "{says}, against {x_title}. Lines: median, bands: {}.",
        bounds(data)
    );
    plot.figure(format!("compaction-{parameter}"), caption)
}

/// Describes the bounds of the medians of all compactions.
fn bounds(data: &RunData) -> String {
    let cells = data.measured_by(NAME).into_iter();
    median_bounds(cells.filter_map(|cell| Some(time(&cell)?.rounds().len())))
}

/// Returns the look shared by all variants of a method.
fn look(data: &RunData, key: &Key) -> usize {
    let cells = data.measured_by(NAME).into_iter();
    let methods = grouped(cells, |cell| cell.key.name(axis::INTEGRATOR).to_owned());
    let own = key.name(axis::INTEGRATOR);
    let at = methods.iter().position(|(name, _)| name == own);
    at.unwrap_or(0)
}

/// Returns every figure of compactions.
pub(crate) fn values<'a>(data: &RunData<'a>) -> Vec<Value<'a>> {
    let cells = data.measured_by(NAME);
    let read = cells.iter().flat_map(|cell| of_readings(data, *cell));
    let mut values: Vec<Value> = read.collect();
    values.extend(derived(data));
    values
}

/// Returns the figures that follow from several cells.
pub(crate) fn derived(data: &RunData) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for cell in data.measured_by(NAME) {
        let ratio = [(&figure::COMPACTION_RATIO, over_baseline(data, &cell))];
        values.extend(Value::known(cell.key, ratio));
    }
    for (key, growth) in growths(data) {
        let figures = [
            (&figure::GROWTH_LINEAR, Estimate::from(growth.linear)),
            (&figure::GROWTH_LINEARITHMIC, growth.linearithmic.into()),
            (&figure::GROWTH_DIFFERENCE, growth.difference.into()),
        ];
        values.extend(figures.map(|(id, value)| Value::new(&key, id, value)));
    }
    values
}

/// Returns the time over that of the baseline on the same stream, round by round.
fn over_baseline(data: &RunData, cell: &Measured) -> Option<Interval> {
    let stream = |key: &Key| STREAM.map(|name| parameter(key, name));
    let is_baseline = |other: &Measured| {
        label_without(other.key, &STREAM) == BASELINE && stream(other.key) == stream(cell.key)
    };
    let baseline = data.measured_by(NAME).into_iter().find(is_baseline)?;
    let (own, other) = (time(cell)?.rounds(), time(&baseline)?.rounds());
    let ratios = own.iter().zip(other).map(|(a, b)| a / b);
    median_interval(&ratios.collect::<Vec<_>>())
}

/// Returns the growth of each method that has enough sizes.
fn growths(data: &RunData) -> Vec<(Key, Growth)> {
    let of = |cells: Vec<(f64, Measured)>| {
        let timed = cells
            .iter()
            .filter_map(|(n, cell)| Some((*n, time(cell)?.rounds())));
        let timed: Vec<(f64, &[f64])> = timed.collect();
        let rounds = timed.iter().map(|(_, rounds)| rounds.len()).min()?;
        let round = |r: usize| {
            timed
                .iter()
                .map(|(n, rounds)| (*n, n * rounds[r]))
                .collect()
        };
        let rounds: Vec<Vec<(f64, f64)>> = (0..rounds).map(round).collect();
        let key = cells.first()?.1.key;
        let label = label_without(key, &["elements"]);
        Some((key.clone().with(axis::INTEGRATOR, label), growth(&rounds)?))
    };
    over(data, "elements").into_iter().filter_map(of).collect()
}

/// Returns the table of the model of growth that fits each method better.
pub(crate) fn growth_table(data: &RunData, values: &[Value]) -> Table {
    let row = |(key, growth): (Key, Growth)| {
        let better = growth.better.map_or("neither", |model| model.name());
        (key, vec![better.into()])
    };
    GROWTH.beside(
        &data.names,
        values,
        &[&bounds(data)],
        &[":fits better"],
        growths(data).into_iter().map(row),
    )
}

/// Returns the table of every cell.
pub(crate) fn table(data: &RunData, values: &[Value]) -> Table {
    let row = |cell: &Measured| {
        let judged = match &cell.failure {
            None => TableCell::from("passed").toned(Tone::Good),
            Some(fault) => TableCell::with_detail("FAILED", fault.clone()).toned(Tone::Bad),
        };
        let stream = |place: usize| {
            let value = parameter(cell.key, STREAM[place]);
            value.map_or_else(|| ABSENT.into(), |x| TableCell::from(x.to_string()))
        };
        let cells = vec![
            label_without(cell.key, &STREAM).into(),
            stream(0),
            stream(1),
            stream(2),
            judged,
        ];
        (cell.key.clone(), cells)
    };
    let heads = ["method", "elements", "valid", "bytes", ":correctness check"];
    Rows::new(&ROW, &heads, data.measured_by(NAME).iter().map(row)).table(
        values,
        format!(
            "All compactions: median [{}]. Least traffic: flags once, what stays once from and once to memory",
            bounds(data)
        ),
        &[
            &figure::COMPACTION_NS,
            &figure::COMPACTION_MELEMENTS_PER_S,
            &figure::COMPACTION_GB_PER_S,
            &figure::COMPACTION_RATIO,
            &figure::COMPACTION_PASSES,
            &figure::COMPACTION_SCRATCH,
        ],
        FIGURES_ALONE,
    )
}
