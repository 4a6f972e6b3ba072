//! What the errors of samplers look like: spectra, and what filters leave.

use super::samplers::{SAMPLER, rows};
use crate::data::{RunData, View};
use crate::document::*;
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Guide, Ticks};
use crate::values::Value;
use raystone_record::figure;
use raystone_record::{FilteredError, Interval, Key, PowerAt, SpectrumRecord, axis};

/// Plots and table of a view; nothing without spectra.
pub fn blocks(data: &RunData, stem: &str, view: &View, values: &[Value]) -> Vec<Block> {
    let power = CurvePlot {
        x_title: "frequency, cycles per pixel".into(),
        x_ticks: Ticks::PowersOfTen,
        y_title: "power, white noise = 1".into(),
        curves: curves(data, view, |record| {
            let at = |at: &PowerAt| CurvePoint::new(at.frequency, &at.power);
            record.power.iter().map(at).collect()
        }),
        guides: vec![Guide::new("white noise", 1.0, 0.0)],
    };
    let of_images = CurvePlot {
        x_title: "frequency, cycles per pixel".into(),
        x_ticks: Ticks::PowersOfTen,
        y_title: "power of single images, variance = 1".into(),
        curves: curves(data, view, |record| {
            let at = |at: &PowerAt| {
                let [middle, .., worst] = at.quantiles?;
                let (value, low, high) = (middle, middle, worst);
                Some(CurvePoint::new(
                    at.frequency,
                    &Interval { value, low, high },
                ))
            };
            record.power.iter().filter_map(at).collect()
        }),
        guides: vec![Guide::new("white noise", 1.0, 0.0)],
    };
    // ∫ of the squared Gaussian: 1 / (4 π σ²).
    let white = 0.5 / std::f64::consts::PI.sqrt();
    let filtered = CurvePlot {
        x_title: "standard deviation σ of the filter, pixels".into(),
        x_ticks: Ticks::PowersOfTwo,
        y_title: "filtered error / error".into(),
        curves: curves(data, view, |record| {
            let wide = record.filtered.iter().filter(|at| at.sigma > 0.0);
            let share = |before: f64| {
                let at = move |at: &FilteredError| {
                    CurvePoint::new(at.sigma, &at.rmse.scaled(1.0 / before))
                };
                wide.map(at).collect()
            };
            record.unfiltered().map_or(Vec::new(), share)
        }),
        guides: vec![Guide::new("white noise, 1 / (2σ√π)", white, -1.0)],
    };
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
    let blocks = [Block::figures(figures), table(view, values).into_block()];
    blocks.into_iter().flatten().collect()
}

fn curves(
    data: &RunData,
    view: &View,
    points: impl Fn(&SpectrumRecord) -> Vec<CurvePoint>,
) -> Vec<Curve> {
    let spectra = view.samplers.iter().filter_map(|s| Some((s, s.spectrum?)));
    let curves = spectra.map(|(sampler, record)| Curve {
        label: sampler.name.clone(),
        look: data.sampler_look(&sampler.name),
        exact: record.replicates == 1,
        points: points(record),
    });
    curves.filter(|c| !c.points.is_empty()).collect()
}

fn table(view: &View, values: &[Value]) -> Table {
    let measured = view.samplers.iter().filter(|s| s.spectrum.is_some());
    let spp = measured
        .clone()
        .find_map(|s| s.spectrum)
        .map_or(0, |s| s.spp);
    if spp == 0 {
        return Table::default();
    }
    let caption = format!(
        "Error in space with {} at {spp} spp, luminance: power up to 1/8 cycle per pixel (white noise 1), power of the \
         loudest wave (n pixels of white noise: about ln n), correlation of neighbours (white noise 0), RMSE, and share of it after Gaussian filters of standard deviation σ",
        view.name
    );
    let figures = [
        &figure::LOW_FREQUENCY_POWER,
        &figure::LOUDEST_WAVE,
        &figure::NEIGHBOUR_CORRELATION,
        &figure::LUMINANCE_RMSE,
        &figure::FILTERED_SHARE,
    ];
    let sigma = |key: &Key| key.label(axis::SUBJECT).to_owned();
    rows(measured, &SAMPLER, |_| Vec::new()).table(values, caption, &figures, &sigma)
}
