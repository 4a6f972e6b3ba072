//! Figures of the words that samplers draw: discrepancies, errors of integrands, what several pixels draw,
//! and what drawing costs.

use super::file_stem;
use crate::data::{RunData, SAMPLER_ROW};
use crate::document::*;
use crate::pivot::{FIGURES_ALONE, Part, Rows};
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Guide, Ticks};
use crate::values::{Value, number, of_readings, of_stream};
use raystone_record::figure::{self, Figure};
use raystone_record::{FigureAtCount, Key, Recorded, StreamRecord, axis};

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

/// Name in records of what drawing from a sampler costs.
pub(super) const COST: &str = "sampler-cost";

/// The section; `None` when no stream was measured.
pub(crate) fn section(data: &RunData) -> Option<Section> {
    if data.streams.is_empty() && data.measured_by(COST).is_empty() {
        return None;
    }
    let mut section = Section::new("discrepancy", "Point streams");
    let mut pairs: Vec<Pair> = Vec::new();
    for stream in data.streams.iter().filter(|s| s.named) {
        let what = stream.pair();
        match pairs.iter_mut().find(|pair| pair.what == what) {
            Some(pair) => pair.streams.push(stream),
            None => pairs.push(Pair::new(data, what, stream)),
        }
    }
    let blocks = pairs.iter().flat_map(Pair::blocks);
    section.blocks.extend(blocks);
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
    /// What the path uses the pair for, with its dimensions.
    what: String,
    /// Start of file names.
    stem: String,
    streams: Vec<&'a Recorded<'a, StreamRecord>>,
}

impl<'a> Pair<'a> {
    fn new(data: &'a RunData, what: String, first: &'a Recorded<StreamRecord>) -> Self {
        let [a, b] = first.dimensions;
        Self {
            data,
            what,
            stem: format!("discrepancy-{}-{a}-{b}", file_stem(&first.purpose)),
            streams: vec![first],
        }
    }

    fn blocks(&self) -> Vec<Block> {
        let values: Vec<Value> = self
            .streams
            .iter()
            .flat_map(|s| of_stream(self.data, **s))
            .collect();
        let tables = [
            self.ranking_table(&values),
            self.count_table(&values, &figure::STAR_DISCREPANCY),
            self.count_table(&values, &figure::L2_STAR),
            self.count_table(&values, &figure::CENTERED),
            self.pixel_table(&values),
        ];
        let mut figures = self.figures();
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

    fn figures(&self) -> Vec<Option<Illustration>> {
        let dufay = |factor, of| {
            let label = format!("{factor}/√N, fit of Dufay 2017 for {of}");
            Guide::new(label, factor, -0.5)
        };
        let guides = vec![dufay(2.5, "Halton"), dufay(1.5, "Hammersley")];
        let figure = |ending: String, says: String, plot: CurvePlot| {
            let caption = format!(
                "{}: {says}. Bands: 95 % interval over seeds; dashed curves: deterministic.",
                self.what
            );
            plot.figure(format!("{}{ending}", self.stem), caption)
        };
        let star = self.plot("star discrepancy D*", guides, |s| &s.star);
        let says = "exact star discrepancy of the first N points".to_owned();
        let mut figures = vec![figure(String::new(), says, star)];
        figures.extend(PLOTTED.map(|name| {
            let says = format!("RMSE of the integral of integrand:{name} over the first N points");
            let plot = self.plot(&format!("RMSE of {name}"), Vec::new(), |s| {
                let found = s.figures.integrands.iter().find(|i| i.function == name);
                found.map_or(&[], |i| i.rmse.as_slice())
            });
            figure(format!("-{name}"), says, plot)
        }));
        figures
    }

    fn plot(
        &self,
        y_title: &str,
        guides: Vec<Guide>,
        values: impl Fn(&StreamRecord) -> &[FigureAtCount],
    ) -> CurvePlot {
        let curve = |stream: &&Recorded<'a, StreamRecord>| {
            let label = self.data.names.sampler(stream.key);
            let point = |at: &FigureAtCount| CurvePoint::new(at.n as f64, &at.value);
            Curve {
                look: self.data.sampler_look(&label),
                label,
                exact: !stream.randomised,
                points: values(stream).iter().map(point).collect(),
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

    fn rows<'r>(&self, heads: &'r [&'r str]) -> Rows<'r> {
        let row = |s: &&Recorded<StreamRecord>| {
            let name = self.data.names.sampler(s.key).into();
            let cells = [name, TableCell::repeats(s.seeds, s.randomised)];
            let cells = cells.into_iter().take(heads.len());
            (s.key.clone(), cells.collect())
        };
        Rows::new(&SAMPLER_ROW, heads, self.streams.iter().map(row))
    }

    /// Exponents side by side: D* and errors do not rank alike.
    fn ranking_table(&self, values: &[Value]) -> Table {
        let most = |s: &&Recorded<StreamRecord>| Some(s.star.last()?.n);
        let most = self.streams.iter().filter_map(most).max().unwrap_or(0);
        let is_shown = |v: &&Value| {
            v.figure.id != figure::STAR_DISCREPANCY.id || number(&v.key, axis::POINTS) == most
        };
        let values: Vec<Value> = values.iter().filter(is_shown).cloned().collect();
        let caption = format!(
            "{}: D* at N = {most}, and exponents of N fitted over all N [95 % interval over seeds]: of D*, and of \
             the RMSE of each integrand. Plain Monte Carlo has −0.5 everywhere. A small D* is no promise of a small \
             error: D* ranks a digital shift before Owen scrambling, errors of smooth functions rank them the other \
             way round",
            self.what
        );
        let figures = [
            &figure::STAR_DISCREPANCY,
            &figure::STAR_EXPONENT,
            &figure::INTEGRAL_EXPONENT,
        ];
        let function = |key: &Key| key.label(axis::SUBJECT).to_owned();
        self.rows(&["sampler"])
            .table(&values, caption, &figures, &function)
    }

    /// One figure by N: mean over seeds.
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
        if values.is_empty() {
            return Table::default();
        }
        let title = &figure.title;
        let caption = format!("{title} of {}: mean over seeds [95 % interval]", self.what);
        self.rows(&["sampler", "seeds"])
            .table(&values, caption, &[figure], BY_POINTS)
    }

    /// Coherence and coverage.
    fn pixel_table(&self, values: &[Value]) -> Table {
        let caption = format!(
            "{}: mean angle between the directions of neighbouring pixels at the same sample, degrees (0: fully \
             coherent), and share of a grid of 4√N × 4√N cells that the points of 150 pixels fall into",
            self.what
        );
        let figures = [&figure::NEIGHBOUR_ANGLE, &figure::COVERAGE];
        self.rows(&["sampler"])
            .table(values, caption, &figures, BY_POINTS)
    }
}

const BY_POINTS: Part<'static> = &|key| format!("N = {}", key.label(axis::POINTS));

/// The pair of dimensions with the greatest D* of each sampler.
fn worst_table(data: &RunData) -> Table {
    let worst = || {
        data.streams
            .iter()
            .filter_map(|s| Some((s, s.worst_of?, s.star.last()?)))
    };
    let row = |(s, of, last): (&Recorded<StreamRecord>, usize, &FigureAtCount)| {
        let name = data.names.sampler(s.key);
        let cells = [name, s.pair(), of.to_string(), last.n.to_string()];
        let key = s.key.clone().with(axis::DIMENSIONS, s.pair());
        (key, cells.map(TableCell::from).into())
    };
    let mut values = Vec::new();
    for (s, _, last) in worst() {
        let of_stream = of_stream(data, *s).into_iter();
        values.extend(of_stream.filter(|v| number(&v.key, axis::POINTS) == last.n));
    }
    if values.is_empty() {
        return Table::default();
    }
    let by = [&SAMPLER_ROW[..], &[axis::DIMENSIONS]].concat();
    let heads = ["sampler", ":dimensions", "of pairs", "N"];
    Rows::new(&by, &heads, worst().map(row)).table(
        &values,
        "The worst pair of dimensions of each sampler, by D* in one pixel among all pairs that the integrators draw: \
         mean D* over seeds [95 % interval]",
        &[&figure::STAR_DISCREPANCY],
        FIGURES_ALONE,
    )
}

/// What drawing costs.
fn cost_table(data: &RunData) -> Table {
    let costs = data.measured_by(COST);
    let values: Vec<Value> = costs
        .iter()
        .flat_map(|cost| of_readings(data, *cost))
        .collect();
    let row = |key: &Key| (key.clone(), vec![data.names.sampler(key).into()]);
    let rows = costs.iter().map(|cost| row(cost.key));
    Rows::new(&SAMPLER_ROW, &["sampler"], rows).table(
        &values,
        "Cost of drawing on this adapter, nanoseconds per two-dimensional sample: median [95 % interval], empty loop \
         taken off, all units of the adapter together",
        &[&figure::NS_PER_SAMPLE, &figure::LOOP_NS],
        FIGURES_ALONE,
    )
}
