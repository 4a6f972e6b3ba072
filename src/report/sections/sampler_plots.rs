//! Plots of samplers under one scene and integrator.

use crate::measure::record::Interval;
use crate::report::data::{RunData, View};
use crate::report::document::Figure;
use crate::report::format;
use crate::report::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::report::plot::histogram::Histogram;
use crate::report::plot::pareto::{CellPoint, ParetoPlot};
use crate::report::samplers::{Metric, Sampler};

/// Error against samples and against seconds, in both metrics.
pub fn error_figures(data: &RunData, stem: &str, view: &View) -> Vec<Figure> {
    let structure = view.fastest_structure();
    let mut figures = Vec::new();
    for metric in [Metric::RelMse, Metric::Rmse] {
        let name = metric.name();
        let y_title = format!("{name} (mean over replicates)");
        let by_spp = CurvePlot {
            x_title: "samples per pixel".into(),
            x_ticks: Ticks::PowersOfTwo,
            y_title: y_title.clone(),
            curves: view
                .samplers
                .iter()
                .filter_map(|s| curve_by_spp(data, s, metric))
                .collect(),
            guides: Vec::new(),
        };
        if let Some(drawing) = by_spp.draw() {
            let caption = format!(
                "{name} against samples. Bands: 95 % interval of the mean; dashed: deterministic."
            );
            figures.push(Figure::new(
                format!("{stem}-{}-spp", name.to_lowercase()),
                caption,
                drawing,
            ));
        }
        let Some(structure) = &structure else {
            continue;
        };
        let by_seconds = CurvePlot {
            x_title: format!("render time with {structure}, seconds"),
            x_ticks: Ticks::PowersOfTen,
            y_title,
            curves: view
                .samplers
                .iter()
                .filter_map(|s| curve_by_time(data, view, s, metric, structure))
                .collect(),
            guides: Vec::new(),
        };
        if let Some(drawing) = by_seconds.draw() {
            let caption =
                format!("{name} against time: samples × measured ms per spp with {structure}.");
            figures.push(Figure::new(
                format!("{stem}-{}-seconds", name.to_lowercase()),
                caption,
                drawing,
            ));
        }
    }
    figures
}

fn curve_by_spp(data: &RunData, sampler: &Sampler, metric: Metric) -> Option<Curve> {
    let label = match sampler.slope(metric) {
        Some(slope) => format!("{}: slope {}", sampler.name, format::slope(&slope)),
        None => sampler.name.clone(),
    };
    curve(data, sampler, metric, 1.0, label)
}

fn curve_by_time(
    data: &RunData,
    view: &View,
    sampler: &Sampler,
    metric: Metric,
    structure: &str,
) -> Option<Curve> {
    let per_spp = view.ms_per_spp(structure, &sampler.name)?;
    let label = format!(
        "{}: {} ms per spp",
        sampler.name,
        format::number(per_spp.value)
    );
    curve(data, sampler, metric, per_spp.value / 1000.0, label)
}

fn curve(
    data: &RunData,
    sampler: &Sampler,
    metric: Metric,
    x_per_spp: f64,
    label: String,
) -> Option<Curve> {
    let points: Vec<CurvePoint> = sampler
        .mean_errors(metric)
        .iter()
        .map(|mean| CurvePoint {
            x: f64::from(mean.spp) * x_per_spp,
            y: mean.error.value,
            low: mean.error.low,
            high: mean.error.high,
        })
        .collect();
    let (look, exact) = (data.sampler_look(&sampler.name), sampler.is_deterministic());
    (!points.is_empty()).then_some(Curve {
        label,
        look,
        exact,
        points,
    })
}

/// Run time against error at the common spp; `None` without one.
pub fn pareto_plot(data: &RunData, view: &View) -> Option<ParetoPlot> {
    let spp = view.common_spp()?;
    let with_look = |names: Vec<String>, look: &dyn Fn(&str) -> usize| -> Vec<(String, usize)> {
        names
            .into_iter()
            .map(|name| (name.clone(), look(&name)))
            .collect()
    };
    let structures = with_look(view.timed_structures(), &|name| data.structure_look(name));
    let fair: Vec<&Sampler> = view
        .samplers
        .iter()
        .filter(|s| s.fault().is_none() && !s.replicates.is_empty())
        .collect();
    let names = fair.iter().map(|s| s.name.clone()).collect();
    let samplers = with_look(names, &|name| data.sampler_look(name));
    let mut points = Vec::new();
    for (structure, (name, _)) in structures.iter().enumerate() {
        for (index, sampler) in fair.iter().enumerate() {
            let Some(t) = view.ms_per_spp(name, &sampler.name) else {
                continue;
            };
            let Some(error) = sampler.mean_error_at(Metric::RelMse, spp) else {
                continue;
            };
            let scale = f64::from(spp) / 1000.0;
            let seconds = Interval {
                value: t.value * scale,
                low: t.low * scale,
                high: t.high * scale,
            };
            points.push(CellPoint {
                structure,
                sampler: index,
                seconds,
                error,
            });
        }
    }
    Some(ParetoPlot {
        x_title: format!("render time for {spp} spp, seconds"),
        y_title: format!("relMSE at {spp} spp"),
        structures,
        samplers,
        points,
    })
}

/// The p-values of every sampler that was checked.
pub fn histograms(view: &View) -> Vec<Histogram> {
    let histogram = |sampler: &Sampler| {
        let bias = sampler.bias?;
        Some(Histogram {
            label: sampler.name.clone(),
            counts: bias.p_histogram.clone(),
            biased: bias.verdict == "biased",
        })
    };
    view.samplers.iter().filter_map(histogram).collect()
}
