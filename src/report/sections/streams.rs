//! Star discrepancy of what the path consumed.

use super::file_stem;
use crate::measure::record::StreamRecord;
use crate::report::data::{RunData, sampler_name};
use crate::report::document::*;
use crate::report::format;
use crate::report::plot::curves::{Curve, CurvePlot, CurvePoint, Guide, Ticks};

/// Columns of the table at most.
const COLUMNS: usize = 8;

/// The section; `None` when no stream was measured.
pub fn section(data: &RunData) -> Option<Section> {
    if data.streams.is_empty() {
        return None;
    }
    let mut section = Section::new("discrepancy", "Star discrepancy of the streams");
    let mut purposes: Vec<(&str, [u32; 2])> = Vec::new();
    for stream in &data.streams {
        if !purposes.contains(&(&stream.purpose, stream.dimensions)) {
            purposes.push((&stream.purpose, stream.dimensions));
        }
    }
    let mut figures = Vec::new();
    let mut tables = Vec::new();
    for (purpose, dimensions) in purposes {
        let is_of = |s: &&&StreamRecord| s.purpose == purpose && s.dimensions == dimensions;
        let streams: Vec<&StreamRecord> = data.streams.iter().filter(is_of).copied().collect();
        let what = format!(
            "{purpose} (dimensions {} and {})",
            dimensions[0], dimensions[1]
        );
        if let Some(drawing) = plot(data, &streams).draw() {
            let stem = format!(
                "discrepancy-{}-{}-{}",
                file_stem(purpose),
                dimensions[0],
                dimensions[1]
            );
            let caption = format!(
                "{what}: exact star discrepancy of the first N points. Bands: 95 % interval over seeds; dashed curves: deterministic."
            );
            figures.push(Figure::new(stem, caption, drawing));
        }
        tables.extend(table(&what, &streams).into_block());
    }
    if !figures.is_empty() {
        section.blocks.push(Block::Figures(figures));
    }
    section.blocks.extend(tables);
    Some(section)
}

fn plot(data: &RunData, streams: &[&StreamRecord]) -> CurvePlot {
    let curve = |stream: &&StreamRecord| {
        let name = sampler_name(&stream.sequence, &stream.decorrelation);
        let point = |at: &crate::measure::record::StarAtCount| CurvePoint {
            x: at.n as f64,
            y: at.star.value,
            low: at.star.low,
            high: at.star.high,
        };
        Curve {
            look: data.sampler_look(&name),
            label: name,
            exact: !stream.randomised,
            points: stream.star.iter().map(point).collect(),
        }
    };
    let guide = |factor, of| Guide {
        label: format!("{factor}/√N, fit of Dufay 2017 for {of}"),
        factor,
        exponent: -0.5,
    };
    CurvePlot {
        x_title: "number of points N".into(),
        x_ticks: Ticks::PowersOfTwo,
        y_title: "star discrepancy D*".into(),
        curves: streams.iter().map(curve).collect(),
        guides: vec![guide(2.5, "Halton"), guide(1.5, "Hammersley")],
    }
}

fn table(what: &str, streams: &[&StreamRecord]) -> Table {
    let mut table = Table::new(
        format!("D* of {what}: mean over seeds [95 % interval]"),
        &["sampler", "seeds"],
    );
    let mut counts: Vec<usize> = streams
        .iter()
        .flat_map(|s| &s.star)
        .map(|at| at.n)
        .collect();
    counts.sort_unstable();
    counts.dedup();
    // Thinned from the end, so that the largest N always stays.
    let stride = counts.len().div_ceil(COLUMNS).max(1);
    let mut shown: Vec<usize> = counts.into_iter().rev().step_by(stride).collect();
    shown.reverse();
    if shown.is_empty() {
        return table;
    }
    shown
        .iter()
        .for_each(|n| table.add_column(format!("N = {n}")));
    for stream in streams {
        let seeds = stream.seeds.to_string();
        let seeds = if stream.randomised {
            seeds.into()
        } else {
            Cell::with_detail(seeds, "deterministic")
        };
        let mut row = vec![
            sampler_name(&stream.sequence, &stream.decorrelation).into(),
            seeds,
        ];
        row.extend(shown.iter().map(|&n| {
            match stream.star.iter().find(|at| at.n == n).map(|at| at.star) {
                Some(star) if star.low < star.high => {
                    Cell::with_detail(format::number(star.value), format::bounds(&star))
                }
                Some(star) => format::number(star.value).into(),
                None => format::ABSENT.into(),
            }
        }));
        table.rows.push(row);
    }
    table
}
