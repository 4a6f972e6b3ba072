//! Figures of the words that samplers draw: discrepancies, errors of integrands, pixels against each other, and the
//! cost of drawing.

use super::file_stem;
use super::specs::{
    DISCREPANCY, DRAWING, INTEGRAL, POINT_SETS, POINTS, SEVERAL_PIXELS, WORST_PAIRS,
};
use crate::data::{RunData, grouped};
use crate::document::*;
use crate::plot::curves::Guide;
use crate::spec::{PlotSpec, TableSpec, filled};
use crate::values::{Value, median_bounds, number, of_readings, of_stream};
use raystone_record::figure::{self, Figure};
use raystone_record::{FigureAtCount, Recorded, StreamRecord, axis};

/// Columns of a table over N at most.
const COLUMNS: usize = 8;
/// Explanation of the figures.
const TAPPED: &str = "Tapped are a sampler's 32-bit words for (pixel, sample, dimension, seed), read back from a \
                      kernel that imports the renderer's modules and does nothing but draw; each was compared with \
                      the scalar twin. Every seed was taken in a pixel of its own: the first of the image, the last, \
                      and others in between, as the records say; where no seed changes anything, four pixels were \
                      found to draw the same.";
/// Functions that are plotted; all are in the table: a smooth one, and one with an edge.
const PLOTTED: [&str; 2] = ["exponential", "disk"];

/// Name of the measurement of the cost of drawing, in records.
pub(super) const COST: &str = "sampler-cost";

/// Returns the section; `None` when no stream was measured.
pub(crate) fn section(data: &RunData) -> Option<Section> {
    if data.streams.is_empty() && data.measured_by(COST).is_empty() {
        return None;
    }
    let mut section = Section::new("discrepancy", "Point streams");
    let named = data.streams.iter().filter(|s| s.named);
    for (what, streams) in grouped(named, |s| s.pair()) {
        let [a, b] = streams[0].dimensions;
        let stem = format!("discrepancy-{}-{a}-{b}", file_stem(&streams[0].purpose));
        let pair = Pair {
            data,
            what,
            stem,
            streams,
        };
        section.blocks.extend(pair.blocks());
    }
    let further = [worst_table(data), cost_table(data)];
    let further = further.into_iter().filter_map(Table::into_block);
    let mut inside = vec![Block::Paragraph(TAPPED.into())];
    inside.extend(further);
    let title = "What was tapped, the worst pairs, what drawing costs";
    section.blocks.extend(Block::fold(title, inside));
    Some(section)
}

/// The streams of one pair of dimensions.
struct Pair<'a> {
    data: &'a RunData<'a>,
    /// The use of the pair in the path, with its dimensions.
    what: String,
    /// Start of file names.
    stem: String,
    streams: Vec<&'a Recorded<'a, StreamRecord>>,
}

impl Pair<'_> {
    fn blocks(&self) -> Vec<Block> {
        let data = self.data;
        let values: Vec<Value> = (self.streams.iter().flat_map(|s| of_stream(data, **s))).collect();
        let names = &data.names;
        let tables = [
            self.ranking_table(&values),
            self.count_table(&values, &figure::STAR_DISCREPANCY),
            self.count_table(&values, &figure::L2_STAR),
            self.count_table(&values, &figure::CENTERED),
            SEVERAL_PIXELS.table(names, &values, &[&self.what]),
        ];
        let mut figures = self.figures(&values);
        let integrals = figures.split_off(1);
        let mut blocks = vec![Block::Heading(self.what.clone())];
        blocks.extend(Block::figures(figures));
        let integrals = Block::figures(integrals).into_iter().collect();
        blocks.extend(Block::fold(
            format!("Errors of integrals: {}", self.what),
            integrals,
        ));
        let tables = tables.into_iter().filter_map(Table::into_block).collect();
        blocks.extend(Block::fold(
            format!("Discrepancies as numbers: {}", self.what),
            tables,
        ));
        blocks
    }

    fn figures(&self, values: &[Value]) -> Vec<Option<Illustration>> {
        let dufay = |factor, of| {
            let label = format!("{factor}/√N, fit of Dufay 2017 for {of}");
            Guide::new(label, factor, -0.5)
        };
        let is_exact = |name: &str| {
            let fixed = self.streams.iter().filter(|s| !s.randomised);
            fixed
                .map(|s| self.data.names.sampler(s.key))
                .any(|known| known == name)
        };
        let draw = |spec: PlotSpec, values: &[Value], guides: Vec<Guide>, function: &str| {
            let mut plot = spec.plot(self.data, values).with_guides(guides);
            let curves = plot.curves.iter_mut();
            curves.for_each(|curve| curve.exact = is_exact(&curve.label));
            let caption = filled(spec.caption, &[&self.what, function]);
            plot.figure(format!("{}{}", self.stem, spec.name), caption)
        };
        let guides = vec![dufay(2.5, "Halton"), dufay(1.5, "Hammersley")];
        let mut figures = vec![draw(DISCREPANCY, values, guides, "")];
        figures.extend(PLOTTED.map(|name| {
            let is_of = |v: &&Value| v.key.label(axis::SUBJECT) == name;
            let of: Vec<Value> = values.iter().filter(is_of).cloned().collect();
            let (y_title, ending) = (&*format!("RMSE of {name}"), &*format!("-{name}"));
            let spec = PlotSpec {
                y_title,
                name: ending,
                ..INTEGRAL
            };
            draw(spec, &of, Vec::new(), name)
        }));
        figures
    }

    /// Exponents side by side: D* and errors do not rank alike.
    fn ranking_table(&self, values: &[Value]) -> Table {
        let most = |s: &&Recorded<StreamRecord>| Some(s.star.last()?.n);
        let most = self.streams.iter().filter_map(most).max().unwrap_or(0);
        let is_shown = |v: &&Value| {
            v.figure.id != figure::STAR_DISCREPANCY.id || number(&v.key, axis::POINTS) == most
        };
        let values: Vec<Value> = values.iter().filter(is_shown).cloned().collect();
        let words = [&*self.what, &most.to_string()];
        POINT_SETS.table(&self.data.names, &values, &words)
    }

    /// Returns the table of one figure by N: mean over seeds.
    fn count_table(&self, values: &[Value], figure: &Figure) -> Table {
        let n = |value: &Value| number(&value.key, axis::POINTS);
        let of_figure = values.iter().filter(|value| value.figure.id == figure.id);
        let mut values: Vec<Value> = of_figure.cloned().collect();
        values.sort_by_key(n);
        let mut counts: Vec<usize> = values.iter().map(n).collect();
        counts.dedup();
        // Thinned from the end, so that the largest N always stays.
        let stride = counts.len().div_ceil(COLUMNS).max(1);
        let shown: Vec<usize> = counts.into_iter().rev().step_by(stride).collect();
        values.retain(|value| shown.contains(&n(value)));
        let rows = self.streams.iter().filter(|_| !values.is_empty());
        let rows = rows.map(|s| {
            (
                s.key.clone(),
                vec![TableCell::repeats(s.seeds, s.randomised)],
            )
        });
        let table = TableSpec {
            figures: &[figure],
            ..POINTS
        };
        let words = [&*figure.title, &self.what];
        table.beside(&self.data.names, &values, &words, &["seeds"], rows)
    }
}

/// Returns the table of each sampler's pair of dimensions with the greatest D*.
fn worst_table(data: &RunData) -> Table {
    let worst = || {
        data.streams
            .iter()
            .filter_map(|s| Some((s, s.worst_of?, s.star.last()?)))
    };
    let row = |(s, of, last): (&Recorded<StreamRecord>, usize, &FigureAtCount)| {
        let key = s.key.clone().with(axis::DIMENSIONS, s.pair());
        (key, [of, last.n].map(|n| n.to_string().into()).to_vec())
    };
    let mut values = Vec::new();
    for (s, _, last) in worst() {
        let of_stream = of_stream(data, *s).into_iter();
        values.extend(of_stream.filter(|v| number(&v.key, axis::POINTS) == last.n));
    }
    WORST_PAIRS.beside(
        &data.names,
        &values,
        &[],
        &["of pairs", "N"],
        worst().map(row),
    )
}

/// Returns the table of the cost of drawing.
fn cost_table(data: &RunData) -> Table {
    let costs = data.measured_by(COST);
    let values: Vec<Value> = costs
        .iter()
        .flat_map(|cost| of_readings(data, *cost))
        .collect();
    DRAWING.table(&data.names, &values, &[&median_bounds(&values)])
}
