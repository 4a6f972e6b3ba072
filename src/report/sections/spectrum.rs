//! What the errors of samplers look like: spectra, and what filters leave.

use crate::measure::record::{FilteredError, SpectrumRecord};
use crate::report::data::{RunData, View};
use crate::report::document::*;
use crate::report::format;
use crate::report::plot::curves::{Curve, CurvePlot, CurvePoint, Guide, Ticks};

/// Plots and table of a view; nothing without spectra.
pub fn blocks(data: &RunData, stem: &str, view: &View) -> Vec<Block> {
    let found = Found::new(view);
    let mut figures = Vec::new();
    if let Some(drawing) = found.power_plot(data).draw() {
        let caption = "Spectrum of the error at the highest spp: signed luminance error, mean over a ring of \
                       frequencies, white noise at 1. The eye and denoisers take out high frequencies: a curve \
                       that rises from the left is good, one that falls shows as blotches.";
        figures.push(Figure::new(format!("{stem}-spectrum"), caption, drawing));
    }
    if let Some(drawing) = found.filter_plot(data).draw() {
        let caption = "What a Gaussian filter leaves of the error, per unit of the error before it. Dashed: \
                       white noise far from borders. Below it, neighbours cancel; above it, they err together.";
        figures.push(Figure::new(format!("{stem}-filtered"), caption, drawing));
    }
    let mut blocks = Vec::new();
    if !figures.is_empty() {
        blocks.push(Block::Figures(figures));
    }
    blocks.extend(found.table(view).into_block());
    blocks
}

/// The spectra of a view, by sampler.
struct Found<'a>(Vec<(&'a str, &'a SpectrumRecord)>);

impl<'a> Found<'a> {
    fn new(view: &'a View) -> Self {
        let samplers = view.samplers.iter();
        Self(
            samplers
                .filter_map(|s| Some((s.name.as_str(), s.spectrum?)))
                .collect(),
        )
    }

    fn curves(
        &self,
        data: &RunData,
        points: impl Fn(&SpectrumRecord) -> Vec<CurvePoint>,
    ) -> Vec<Curve> {
        let curve = |(name, record): &(&str, &SpectrumRecord)| Curve {
            label: (*name).to_owned(),
            look: data.sampler_look(name),
            exact: record.replicates == 1,
            points: points(record),
        };
        let curves = self.0.iter().map(curve);
        curves.filter(|c| !c.points.is_empty()).collect()
    }

    fn power_plot(&self, data: &RunData) -> CurvePlot {
        let points = |record: &SpectrumRecord| {
            let at =
                |at: &crate::measure::record::PowerAt| CurvePoint::new(at.frequency, &at.power);
            record.power.iter().map(at).collect()
        };
        CurvePlot {
            x_title: "frequency, cycles per pixel".into(),
            x_ticks: Ticks::PowersOfTen,
            y_title: "power, white noise = 1".into(),
            curves: self.curves(data, points),
            guides: vec![guide("white noise", 1.0, 0.0)],
        }
    }

    fn filter_plot(&self, data: &RunData) -> CurvePlot {
        let points = |record: &SpectrumRecord| {
            let Some(before) = unfiltered(record) else {
                return Vec::new();
            };
            let at = |at: &FilteredError| CurvePoint::new(at.sigma, &at.rmse.scaled(1.0 / before));
            let wide = record.filtered.iter().filter(|at| at.sigma > 0.0);
            wide.map(at).collect()
        };
        // ∫ of the squared Gaussian: 1 / (4 π σ²).
        let white = 0.5 / std::f64::consts::PI.sqrt();
        CurvePlot {
            x_title: "standard deviation σ of the filter, pixels".into(),
            x_ticks: Ticks::PowersOfTwo,
            y_title: "filtered error / error".into(),
            curves: self.curves(data, points),
            guides: vec![guide("white noise, 1 / (2σ√π)", white, -1.0)],
        }
    }

    fn table(&self, view: &View) -> Table {
        let spp = self.0.first().map_or(0, |(_, record)| record.spp);
        let caption = format!(
            "Error in space with {} at {spp} spp, luminance: power up to 1/8 cycle per pixel (white noise 1), \
             correlation of neighbours (white noise 0), RMSE, and share of it after filters",
            view.name
        );
        let columns = ["sampler", "low-frequency power", "correlation", "RMSE"];
        let mut table = Table::new(caption, &columns);
        let Some((_, first)) = self.0.first() else {
            return table;
        };
        let wide = first.filtered.iter().filter(|at| at.sigma > 0.0);
        let sigmas: Vec<f64> = wide.map(|at| at.sigma).collect();
        for sigma in &sigmas {
            table.add_column(format!("σ = {sigma} px"));
        }
        for (name, record) in &self.0 {
            let before = unfiltered(record);
            let mut row = vec![
                Cell::from(*name),
                Cell::of(record.low_frequency),
                Cell::of(record.autocorrelation),
                format::optional(before).into(),
            ];
            row.extend(sigmas.iter().map(|&sigma| {
                let left = at_sigma(record, sigma);
                let share = left.zip(before).map(|(left, before)| left / before);
                Cell::from(share.map_or_else(|| format::ABSENT.into(), format::percent))
            }));
            table.rows.push(row);
        }
        table
    }
}

fn at_sigma(record: &SpectrumRecord, sigma: f64) -> Option<f64> {
    let at = record.filtered.iter().find(|at| at.sigma == sigma)?;
    Some(at.rmse.value)
}

/// The error that shares are taken of; `None` if there is no error.
fn unfiltered(record: &SpectrumRecord) -> Option<f64> {
    at_sigma(record, 0.0).filter(|rmse| *rmse > 0.0)
}

fn guide(label: &str, factor: f64, exponent: f64) -> Guide {
    Guide {
        label: label.into(),
        factor,
        exponent,
    }
}
