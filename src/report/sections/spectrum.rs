//! Spectra of the errors of samplers, and errors left by filters.

use super::samplers::at_ends;
use super::specs::SPECTRA;
use crate::data::{RunData, View};
use crate::document::*;
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Guide, Ticks};
use crate::samplers::MeasuredSampler;
use crate::values::Value;
use raystone_record::{FilteredError, Interval, PowerAt, SpectrumRecord};

/// Returns the plots and table of a view; nothing without spectra.
pub fn blocks(data: &RunData, stem: &str, view: &View, values: &[Value]) -> Vec<Block> {
    let by_frequency = |y_title: &str, at: &dyn Fn(&PowerAt) -> Option<Interval>| {
        let point = |of: &PowerAt| Some(CurvePoint::new(of.frequency, &at(of)?));
        let curves = curves(data, view, |r| r.power.iter().filter_map(point).collect());
        let plot = CurvePlot::new(
            "frequency, cycles per pixel",
            Ticks::PowersOfTen,
            y_title,
            curves,
        );
        plot.with_guides([Guide::new("white noise", 1.0, 0.0)])
    };
    let power = by_frequency("power, white noise = 1", &|at| Some(at.power));
    let of_images = by_frequency("power of single images, variance = 1", &|at| {
        let [value, .., high] = at.quantiles?;
        Some(Interval {
            value,
            low: value,
            high,
        })
    });
    let filtered = curves(data, view, |record| {
        let wide = record.filtered.iter().filter(|at| at.sigma > 0.0);
        let share = |before: f64| {
            let at =
                move |at: &FilteredError| CurvePoint::new(at.sigma, &at.rmse.scaled(1.0 / before));
            wide.map(at).collect()
        };
        record.unfiltered().map_or(Vec::new(), share)
    });
    let x_title = "standard deviation σ of the filter, pixels";
    let filtered = CurvePlot::new(
        x_title,
        Ticks::PowersOfTwo,
        "filtered error / error",
        filtered,
    );
    // ∫ of the squared Gaussian: 1 / (4 π σ²).
    let white = 0.5 / std::f64::consts::PI.sqrt();
    let filtered = filtered.with_guides([Guide::new("white noise, 1 / (2σ√π)", white, -1.0)]);
    let figures = [
        power.figure(
            format!("{stem}-spectrum"),
            "Spectrum of the error at the highest spp: signed luminance error, mean over a ring of frequencies, \
             white noise at 1. The eye and denoisers take out high frequencies: a curve that rises from the left is \
             good, one that falls shows as blotches.",
        ),
        of_images.figure(
            format!("{stem}-outliers"),
            "The same of single images, in units of the variance of all replicates: the line is the median image, the \
             band reaches up to the worst. An image with fireflies has more power at all frequencies: a wide band says \
             that the mean is carried by few images.",
        ),
        filtered.figure(
            format!("{stem}-filtered"),
            "What a Gaussian filter leaves of the error, per unit of the error before it. Dashed: white noise far \
             from borders. Below it, neighbours cancel; above it, they err together.",
        ),
    ];
    let blocks = [
        Block::figures(figures),
        table(data, view, values).into_block(),
    ];
    blocks.into_iter().flatten().collect()
}

fn curves(
    data: &RunData,
    view: &View,
    points: impl Fn(&SpectrumRecord) -> Vec<CurvePoint>,
) -> Vec<Curve> {
    let spectra = view.samplers.iter().filter_map(|s| Some((s, s.spectrum?)));
    let curve = |(sampler, record): (&MeasuredSampler, &SpectrumRecord)| Curve {
        label: sampler.name.clone(),
        look: data.sampler_look(&sampler.name),
        exact: record.replicates == 1,
        points: points(record),
    };
    spectra.map(curve).collect()
}

pub(crate) fn table(data: &RunData, view: &View, values: &[Value]) -> Table {
    let end = |sampler: &MeasuredSampler| Some(sampler.spectrum?.spp);
    at_ends(SPECTRA, &data.names, view, values, end)
}
