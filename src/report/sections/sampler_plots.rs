//! Plots of samplers under one scene and integrator.

use super::specs::ERROR_CURVES;
use crate::data::{RunData, View};
use crate::document::Illustration;
use crate::format;
use crate::plot::curves::{Curve, CurvePlot, Ticks};
use crate::plot::histogram::Histogram;
use crate::plot::panels::{self, Panel};
use crate::plot::pareto::{CellPoint, ParetoPlot};
use crate::samplers::{MeasuredSampler, Metric, UNRESOLVED, log_time};
use crate::spec::{PlotSpec, filled};
use crate::values::Value;
use raystone_stats::bias::BiasVerdict;
use raystone_stats::comparison::{Place, places};

/// Returns a caption's note on points that a logarithmic plot cannot show.
fn not_drawn(count: usize) -> String {
    match count {
        0 => String::new(),
        n => format!(" Not drawn: {} {UNRESOLVED}.", format::plural(n, "point")),
    }
}

/// Returns plots of error against samples and against seconds.
pub(crate) fn error_figures(
    data: &RunData,
    stem: &str,
    view: &View,
    values: &[Value],
    metric: Metric,
) -> [Option<Illustration>; 2] {
    let figure = view.figure(metric);
    let name = &figure.title;
    let hidden = values
        .iter()
        .filter(|v| v.figure.id == figure.id && v.is_unresolved());
    let hidden = not_drawn(hidden.count());
    let spec = PlotSpec {
        figures: &[(figure, "")],
        ..ERROR_CURVES
    };
    let by_spp = spec.plot(data, values).curves;
    // `unit` returns the suffix of a sampler's name, and one sample per pixel in units of the x axis.
    let plot = |x_title: &str, ticks, unit: &dyn Fn(&MeasuredSampler) -> Option<(String, f64)>| {
        let curve = |mut curve: Curve| {
            let sampler = view.samplers.iter().find(|s| s.name == curve.label)?;
            let (says, per_spp) = unit(sampler)?;
            curve.label += &says;
            curve.exact = sampler.is_deterministic();
            curve.points.iter_mut().for_each(|point| point.x *= per_spp);
            Some(curve)
        };
        let curves = by_spp.iter().cloned().filter_map(curve);
        CurvePlot::new(
            x_title,
            ticks,
            format!("{name} (mean over replicates)"),
            curves,
        )
    };
    let of_samples = plot(spec.x_title, spec.x_ticks, &|sampler| {
        let slope = sampler.slope(metric);
        let slope = slope.map(|slope| format!(": slope {}", format::slope(&slope)));
        Some((slope.unwrap_or_default(), 1.0))
    });
    let of_samples = of_samples.figure(
        format!("{stem}-{}-spp", metric.stem()),
        filled(spec.caption, &[name, &hidden]),
    );
    let of_seconds = view.fastest_structure().and_then(|structure| {
        let x_title = format!("render time with {structure}, seconds");
        let plot = plot(&x_title, Ticks::PowersOfTen, &|sampler| {
            let ms = view.ms_per_spp(&structure, &sampler.name)?.value;
            Some((format!(": {} ms per spp", format::number(ms)), ms / 1000.0))
        });
        plot.figure(
            format!("{stem}-{}-seconds", metric.stem()),
            format!("{name} against time: samples × measured ms per spp with {structure}.{hidden}"),
        )
    });
    [of_samples, of_seconds]
}

/// Returns the plot of run time against error at the common spp.
pub(crate) fn pareto_figure(data: &RunData, stem: &str, view: &View) -> Option<Illustration> {
    let spp = view.common_spp()?;
    let names = view.timed_structures().into_iter();
    let structures = names.map(|name| (name.clone(), data.structure_look(&name)));
    let structures: Vec<(String, usize)> = structures.collect();
    let measured = view.samplers.iter().filter(|s| !s.replicates.is_empty());
    let fair: Vec<&MeasuredSampler> = measured.filter(|s| s.fault().is_none()).collect();
    let samplers = fair
        .iter()
        .map(|s| (s.name.clone(), data.sampler_look(&s.name)));
    let mut points = Vec::new();
    // Curves of known noise, and their figures.
    let mut known = Vec::new();
    let mut figures = Vec::new();
    let mut hidden = 0;
    for (structure, (name, _)) in structures.iter().enumerate() {
        for (index, sampler) in fair.iter().enumerate() {
            let time = view.ms_per_spp(name, &sampler.name);
            let error = sampler.mean_error_at(Metric::RelMse, spp);
            let (Some(time), Some(mean)) = (time, error) else {
                continue;
            };
            if !mean.resolved || mean.error.value <= 0.0 {
                hidden += 1;
                continue;
            }
            let log_error = sampler.log_error(Metric::RelMse, [spp; 2], 0.0);
            let log_time = view.time(name, &sampler.name).and_then(|t| log_time(t));
            if let (Some(time), Some(error)) = (log_time, log_error)
                && sampler.is_ranked()
                && time.has_noise()
            {
                known.push(points.len());
                figures.push([time, error]);
            }
            points.push(CellPoint {
                structure,
                sampler: index,
                seconds: time.scaled(f64::from(spp) / 1000.0),
                error: mean.error,
                place: Place::Open,
            });
        }
    }
    for (point, place) in known.into_iter().zip(places(&figures)) {
        points[point].place = place;
    }
    let name = &view.figure(Metric::RelMse).title;
    let plot = ParetoPlot {
        x_title: format!("render time for {spp} spp, seconds"),
        y_title: format!("{name} at {spp} spp"),
        samplers: samplers.collect(),
        structures,
        points,
    };
    let caption = format!(
        "Run time against {name}, one point per cell without a fault; lines: 95 % intervals. Images are equal across \
         structures, so a structure moves a sampler only sideways. On the front for certain is what a test at 5 % finds better than every \
         other point in time or error; what the noise leaves open, and what was measured once, has a question mark.{}",
        not_drawn(hidden)
    );
    Some(Illustration::new(
        format!("{stem}-pareto"),
        caption,
        plot.draw()?,
    ))
}

/// Returns histograms of the p-values of every sampler that was checked.
pub(crate) fn histograms(stem: &str, view: &View) -> Option<Illustration> {
    let panel = |sampler: &MeasuredSampler| {
        let bias = sampler.bias.as_ref()?;
        let biased = bias.verdict == BiasVerdict::Biased;
        let counts = bias.p_histogram.clone();
        let title = if biased {
            format!("biased: {}", sampler.name)
        } else {
            sampler.name.clone()
        };
        let histogram = Histogram { counts, biased };
        let counted: usize = bias.p_histogram.iter().sum();
        let note = match (biased, histogram.is_flat()) {
            (true, _) => "p from 0 to 1: not flat, since it is biased",
            (false, true) => "p from 0 to 1: flat within chance",
            (false, false) => "p from 0 to 1: NOT flat, see below",
        };
        let note = format!("{note}; {counted} tiles");
        (counted > 0).then(|| Panel::new(title, note, histogram))
    };
    let panels: Vec<Panel> = view.samplers.iter().filter_map(panel).collect();
    let caption = "Bias check: p-values of the tiles of each sampler. Without bias all values from 0 to 1 are equally \
                   likely, so that bars reach the dashed line but for chance (χ² over ten bars at 1 %); red where biased. \
                   Tiles whose difference rounding explains, such as a black background, have p = 1 by definition: \
                   records of today leave them out, in older ones they stand in the last bar. The test is cautious where \
                   few pixels carry a tile's noise: small values are then rarer than chance would make them.";
    let drawing = (!panels.is_empty()).then(|| panels::draw(&panels, 2, (410.0, 90.0)))?;
    Some(Illustration::new(format!("{stem}-bias"), caption, drawing))
}
