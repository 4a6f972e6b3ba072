//! Figures of the words that samplers draw: discrepancies, errors of integrands, what several pixels draw,
//! and what drawing costs.

use super::file_stem;
use crate::measure::figure::figure;
use crate::measure::record::{FigureAtCount, Interval, Key, Recorded, StreamRecord, axis};
use crate::report::data::RunData;
use crate::report::document::*;
use crate::report::format;
use crate::report::pivot::Pivot;
use crate::report::plot::curves::{Curve, CurvePlot, CurvePoint, Guide, Ticks};
use crate::report::values::{Value, of_stream};

/// Columns of a table over N at most.
const COLUMNS: usize = 8;
/// What the figures are of.
const TAPPED: &str = "Tapped are a sampler's 32-bit words for (pixel, sample, dimension, seed), read back from a \
                      kernel that imports the renderer's modules and does nothing but draw; each was compared with \
                      the scalar twin. Every seed was taken in a pixel of its own: the first of the image, the last, \
                      and others in between, as the records say; where no seed changes anything, four pixels were \
                      found to draw the same.";
/// Functions that are plotted; all are in the table: a smooth one, and one with an edge.
const PLOTTED: [&str; 2] = ["exponential", "disk"];

/// The section; `None` when no stream was measured.
pub fn section(data: &RunData) -> Option<Section> {
    if data.streams.is_empty() && data.costs.is_empty() {
        return None;
    }
    let mut section = Section::new("discrepancy", "Streams: discrepancy and integration error");
    section.blocks.push(Block::Paragraph(TAPPED.into()));
    section.blocks.extend(worst_table(data).into_block());
    let mut pairs: Vec<(&str, [u32; 2])> = Vec::new();
    for stream in data.streams.iter().filter(|s| s.named) {
        if !pairs.contains(&(&stream.purpose, stream.dimensions)) {
            pairs.push((&stream.purpose, stream.dimensions));
        }
    }
    for (purpose, dimensions) in pairs {
        let is_of =
            |s: &&Recorded<StreamRecord>| s.purpose == purpose && s.dimensions == dimensions;
        let streams = data.streams.iter().filter(is_of).copied().collect();
        section.blocks.extend(Pair::new(data, streams).blocks());
    }
    section.blocks.extend(cost_table(data).into_block());
    Some(section)
}

/// The streams of one pair of dimensions.
struct Pair<'a> {
    data: &'a RunData<'a>,
    /// What the path uses the pair for, with its dimensions.
    what: String,
    /// Start of file names.
    stem: String,
    streams: Vec<Recorded<'a, StreamRecord>>,
}

impl<'a> Pair<'a> {
    fn new(data: &'a RunData<'a>, streams: Vec<Recorded<'a, StreamRecord>>) -> Self {
        let (purpose, [a, b]) = streams
            .first()
            .map_or(("", [0, 0]), |s| (&s.purpose, s.dimensions));
        Self {
            data,
            what: format!("{purpose} (dimensions {a} and {b})"),
            stem: format!("discrepancy-{}-{a}-{b}", file_stem(purpose)),
            streams,
        }
    }

    fn blocks(&self) -> Vec<Block> {
        let mut blocks = vec![Block::Heading(self.what.clone())];
        let figures = self.figures();
        if !figures.is_empty() {
            blocks.push(Block::Figures(figures));
        }
        let tables = [
            self.ranking_table(),
            self.count_table("star-discrepancy/v1"),
            self.count_table("l2-star/v1"),
            self.count_table("centered/v1"),
            self.pixel_table(),
        ];
        blocks.extend(tables.into_iter().filter_map(Table::into_block));
        blocks
    }

    fn figures(&self) -> Vec<Figure> {
        let guide = |factor, of| Guide {
            label: format!("{factor}/√N, fit of Dufay 2017 for {of}"),
            factor,
            exponent: -0.5,
        };
        let guides = vec![guide(2.5, "Halton"), guide(1.5, "Hammersley")];
        let mut plots = vec![(
            String::new(),
            "exact star discrepancy of the first N points".to_owned(),
            self.plot("star discrepancy D*", guides, star),
        )];
        for name in PLOTTED {
            let values = |s: &StreamRecord| {
                let found = s.figures.integrands.iter().find(|i| i.function == name);
                found.map_or(Vec::new(), |i| i.rmse.clone())
            };
            plots.push((
                format!("-{name}"),
                format!("RMSE of the integral of integrand:{name} over the first N points"),
                self.plot(&format!("RMSE of {name}"), Vec::new(), values),
            ));
        }
        let figure = |(ending, says, plot): (String, String, CurvePlot)| {
            let caption = format!(
                "{}: {says}. Bands: 95 % interval over seeds; dashed curves: deterministic.",
                self.what
            );
            Some(Figure::new(
                format!("{}{ending}", self.stem),
                caption,
                plot.draw()?,
            ))
        };
        plots.into_iter().filter_map(figure).collect()
    }

    fn plot(
        &self,
        y_title: &str,
        guides: Vec<Guide>,
        values: impl Fn(&StreamRecord) -> Vec<FigureAtCount>,
    ) -> CurvePlot {
        let curve = |stream: &Recorded<StreamRecord>| {
            let name = self.data.names.sampler(stream.key);
            let point = |at: FigureAtCount| CurvePoint::new(at.n as f64, &at.value);
            Curve {
                look: self.data.sampler_look(&name),
                label: name,
                exact: !stream.randomised,
                points: values(stream).into_iter().map(point).collect(),
            }
        };
        let curves = self.streams.iter().map(curve);
        CurvePlot {
            x_title: "number of points N".into(),
            x_ticks: Ticks::PowersOfTwo,
            y_title: y_title.into(),
            curves: curves.filter(|c| !c.points.is_empty()).collect(),
            guides,
        }
    }

    /// Exponents side by side: D* and errors do not rank alike.
    fn ranking_table(&self) -> Table {
        let functions: Vec<&str> = self.streams.first().map_or(Vec::new(), |s| {
            let integrands = s.figures.integrands.iter();
            integrands.map(|i| i.function.as_str()).collect()
        });
        let largest = self.streams.iter().filter_map(|s| s.star.last());
        let most = largest.map(|at| at.n).max().unwrap_or(0);
        let caption = format!(
            "{}: D* at N = {most}, and exponents of N fitted over all N [95 % interval over seeds]: of D*, and of \
             the RMSE of each integrand. Plain Monte Carlo has −0.5 everywhere. A small D* is no promise of a small \
             error: D* ranks a digital shift before Owen scrambling, errors of smooth functions rank them the other \
             way round",
            self.what
        );
        let mut table = Table::new(caption, &["sampler", "D*", "D* exponent"]);
        if functions.is_empty() {
            return table;
        }
        functions.iter().for_each(|name| table.add_column(*name));
        for stream in &self.streams {
            let last = stream.star.last().filter(|at| at.n == most);
            let mut row = vec![
                Cell::from(self.data.names.sampler(stream.key)),
                format::optional(last.map(|at| at.value.value)).into(),
                slope_cell(stream.figures.star_slope),
            ];
            row.extend(functions.iter().map(|name| {
                let found = stream.figures.integrands.iter();
                let found = found.filter(|i| i.function == *name).find_map(|i| i.slope);
                slope_cell(found)
            }));
            table.rows.push(row);
        }
        table
    }

    fn values(&self) -> Vec<Value<'static>> {
        self.streams.iter().flat_map(of_stream).collect()
    }

    /// One figure by N: mean over seeds.
    fn count_table(&self, id: &str) -> Table {
        let mut values = self.values();
        values.retain(|value| value.figure.id == id);
        let n = |value: &Value| value.key.label(axis::POINTS).parse::<usize>().unwrap_or(0);
        values.sort_by_key(n);
        let mut counts: Vec<usize> = values.iter().map(n).collect();
        counts.dedup();
        // Thinned from the end, so that the largest N always stays.
        let stride = counts.len().div_ceil(COLUMNS).max(1);
        let shown: Vec<usize> = counts.into_iter().rev().step_by(stride).collect();
        values.retain(|value| shown.contains(&n(value)));
        if values.is_empty() {
            return Table::default();
        }
        let row = |s: &Recorded<StreamRecord>| {
            let name = self.data.names.sampler(s.key);
            (name.clone(), vec![name.into(), seeds_cell(s)])
        };
        Pivot {
            caption: format!(
                "{} of {}: mean over seeds [95 % interval]",
                figure(id).title,
                self.what
            ),
            heads: &["sampler", "seeds"],
            rows: self.streams.iter().map(row).collect(),
            row: &|key| self.data.names.sampler(key),
            figures: &[id],
            across: Some(&points),
        }
        .table(&values)
    }

    /// Coherence and coverage.
    fn pixel_table(&self) -> Table {
        let row = |s: &Recorded<StreamRecord>| {
            (
                self.data.names.sampler(s.key),
                vec![self.data.names.sampler(s.key).into()],
            )
        };
        Pivot {
            caption: format!(
                "{}: mean angle between the directions of neighbouring pixels at the same sample, degrees (0: fully \
                 coherent), and share of a grid of 4√N × 4√N cells that the points of 150 pixels fall into",
                self.what
            ),
            heads: &["sampler"],
            rows: self.streams.iter().map(row).collect(),
            row: &|key| self.data.names.sampler(key),
            figures: &["neighbour-angle/v1", "coverage/v1"],
            across: Some(&points),
        }
        .table(&self.values())
    }
}

fn points(key: &Key) -> String {
    format!("N = {}", key.label(axis::POINTS))
}

/// The pair of dimensions with the greatest D* of each sampler.
fn worst_table(data: &RunData) -> Table {
    let caption = "The worst pair of dimensions of each sampler, by D* in one pixel among all pairs that the \
                   integrators draw: mean D* over seeds [95 % interval]";
    let columns = ["sampler", "dimensions", "purpose", "of pairs", "N", "D*"];
    let mut table = Table::new(caption, &columns);
    for stream in &data.streams {
        let (Some(of), Some(last)) = (stream.worst_of, stream.star.last()) else {
            continue;
        };
        let [a, b] = stream.dimensions;
        table.rows.push(vec![
            data.names.sampler(stream.key).into(),
            format!("{a} and {b}").into(),
            stream.purpose.as_str().into(),
            of.to_string().into(),
            last.n.to_string().into(),
            Cell::of(Some(last.value)),
        ]);
    }
    table
}

/// What drawing costs.
fn cost_table(data: &RunData) -> Table {
    let caption = "Cost of drawing on this adapter, nanoseconds per two-dimensional sample: median [95 % interval], \
                   empty loop taken off, all units of the adapter together";
    let mut table = Table::new(caption, &["sampler", "ns per sample", "empty loop, ns"]);
    for cost in &data.costs {
        table.rows.push(vec![
            data.names.sampler(cost.key).into(),
            Cell::of(Some(cost.ns_per_sample)),
            format::number(cost.loop_ns_per_sample.value).into(),
        ]);
    }
    table
}

fn star(stream: &StreamRecord) -> Vec<FigureAtCount> {
    stream.star.clone()
}

fn seeds_cell(stream: &StreamRecord) -> Cell {
    let seeds = stream.seeds.to_string();
    if stream.randomised {
        seeds.into()
    } else {
        Cell::with_detail(seeds, "deterministic")
    }
}

fn slope_cell(slope: Option<Interval>) -> Cell {
    let Some(slope) = slope else {
        return format::ABSENT.into();
    };
    let text = format::slope(&slope);
    match text.split_once(' ') {
        Some((value, bounds)) => Cell::with_detail(value, bounds),
        None => text.into(),
    }
}
