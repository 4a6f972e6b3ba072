//! Plots of samplers under one scene and integrator.

use crate::measure::bias::BiasVerdict;
use crate::report::data::{RunData, View};
use crate::report::document::Figure;
use crate::report::format;
use crate::report::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::report::plot::histogram::Histogram;
use crate::report::plot::pareto::{CellPoint, ParetoPlot};
use crate::report::samplers::{Metric, Sampler, UNRESOLVED};

/// What a caption says of points that a logarithmic plot cannot show.
fn not_drawn(count: usize) -> String {
    match count {
        0 => String::new(),
        1 => format!(" Not drawn: 1 point {UNRESOLVED}."),
        n => format!(" Not drawn: {n} points {UNRESOLVED}."),
    }
}

/// Points of all samplers that the reference does not resolve.
fn unresolved(view: &View, metric: Metric) -> usize {
    let means = view.samplers.iter().flat_map(|s| s.mean_errors(metric));
    means.filter(|mean| !mean.resolved).count()
}

/// Error against samples and against seconds, in both metrics.
pub fn error_figures(data: &RunData, stem: &str, view: &View) -> Vec<Figure> {
    let structure = view.fastest_structure();
    let mut figures = Vec::new();
    for metric in [Metric::RelMse, Metric::Rmse] {
        let name = metric.name();
        let y_title = format!("{name} (mean over replicates)");
        let hidden = not_drawn(unresolved(view, metric));
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
                "{name} against samples. Bands: 95 % interval, of replicates and reference; dashed: deterministic.{hidden}"
            );
            figures.push(Figure::new(
                format!("{stem}-{}-spp", metric.stem()),
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
            let caption = format!(
                "{name} against time: samples × measured ms per spp with {structure}.{hidden}"
            );
            figures.push(Figure::new(
                format!("{stem}-{}-seconds", metric.stem()),
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
        .filter(|mean| mean.resolved)
        .map(|mean| CurvePoint::new(f64::from(mean.spp) * x_per_spp, &mean.error))
        .collect();
    let (look, exact) = (data.sampler_look(&sampler.name), sampler.is_deterministic());
    (!points.is_empty()).then_some(Curve {
        label,
        look,
        exact,
        points,
    })
}

/// Run time against error at the common spp, and what its caption has to add; `None` without one.
pub fn pareto_plot(data: &RunData, view: &View) -> Option<(ParetoPlot, String)> {
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
    let mut hidden = 0;
    for (structure, (name, _)) in structures.iter().enumerate() {
        for (index, sampler) in fair.iter().enumerate() {
            let Some(t) = view.ms_per_spp(name, &sampler.name) else {
                continue;
            };
            let Some(mean) = sampler.mean_error_at(Metric::RelMse, spp) else {
                continue;
            };
            if !mean.resolved || mean.error.value <= 0.0 {
                hidden += 1;
                continue;
            }
            let scale = f64::from(spp) / 1000.0;
            let seconds = t.scaled(scale);
            points.push(CellPoint {
                structure,
                sampler: index,
                seconds,
                error: mean.error,
            });
        }
    }
    let plot = ParetoPlot {
        x_title: format!("render time for {spp} spp, seconds"),
        y_title: format!("{} at {spp} spp", Metric::RelMse.name()),
        structures,
        samplers,
        points,
    };
    Some((plot, not_drawn(hidden)))
}

/// The p-values of every sampler that was checked.
pub fn histograms(view: &View) -> Vec<Histogram> {
    let histogram = |sampler: &Sampler| {
        let bias = sampler.bias?;
        Some(Histogram {
            label: sampler.name.clone(),
            counts: bias.p_histogram.clone(),
            biased: bias.verdict == BiasVerdict::Biased,
        })
    };
    view.samplers.iter().filter_map(histogram).collect()
}
