//! What the records say, figure by figure: each value with its key. Tables and exports read these.

use super::data::{RunData, SceneGroup, View};
use super::document::Cell;
use super::format;
use super::samplers::Metric;
use crate::measure::figure::{Figure, figure};
use crate::measure::record::{
    FigureAtCount, Interval, Key, Recorded, StreamRecord, StructureRecord, axis,
};
use std::borrow::Cow;

/// A figure of one key.
#[derive(Debug, Clone, PartialEq)]
pub struct Value<'a> {
    /// What it is of.
    pub key: Key,
    /// Its row in the table of figures.
    pub figure: Cow<'a, Figure>,
    /// What was found.
    pub reading: Reading,
}

/// What is known of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reading {
    /// The value, with an interval that has no width where none is known.
    Known(Interval),
    /// Only that it is below this: the reference resolves no more.
    Below(f64),
}

impl Value<'static> {
    /// A figure of this crate.
    pub fn new(key: &Key, id: &str, value: Interval) -> Self {
        Self {
            key: key.clone(),
            figure: Cow::Borrowed(figure(id)),
            reading: Reading::Known(value),
        }
    }

    /// One without an interval.
    pub fn exact(key: &Key, id: &str, value: f64) -> Self {
        Self::new(key, id, Interval::exact(value))
    }
}

impl Value<'_> {
    /// The value as a table shows it.
    pub fn cell(&self) -> Cell {
        let text = |value| format::figure(&self.figure, value);
        match self.reading {
            Reading::Below(bound) => format!("<{}", text(bound)).into(),
            Reading::Known(i) if i.low < i.high => Cell::with_detail(
                text(i.value),
                format!("[{}, {}]", text(i.low), text(i.high)),
            ),
            Reading::Known(i) => text(i.value).into(),
        }
    }
}

/// Everything that a run found.
pub fn values<'a>(data: &RunData<'a>) -> Vec<Value<'a>> {
    let mut values = Vec::new();
    for scene in &data.scenes {
        values.extend(of_structures(data, scene));
        for view in &scene.views {
            values.extend(of_view(view));
        }
    }
    for stream in &data.streams {
        values.extend(of_stream(stream));
    }
    for cost in &data.costs {
        values.push(Value::new(cost.key, "ns-per-sample/v1", cost.ns_per_sample));
    }
    values
}

/// Figures of all structures of a scene; those without a fault also have speeds.
pub fn of_structures<'a>(data: &RunData<'a>, scene: &SceneGroup<'a>) -> Vec<Value<'a>> {
    let triangles = scene.record.map_or(0, |record| record.triangles);
    let mut values = Vec::new();
    for s in &scene.structures {
        let key = &s.key;
        if s.is_built() {
            values.extend(of_build(key, s, triangles));
        }
        if s.fault().is_none() {
            values.extend(of_rays(key, s));
        }
        values.extend(s.body.figures.iter().map(|(id, value)| Value {
            key: key.clone(),
            figure: data.figure(id),
            reading: Reading::Known(*value),
        }));
    }
    values
}

fn of_build(key: &Key, s: &StructureRecord, triangles: usize) -> Vec<Value<'static>> {
    let per_triangle = |x: u64| (triangles > 0).then(|| x as f64 / triangles as f64);
    let stats = &s.stats;
    let of = |id: &str, value: Option<f64>| Some(Value::exact(key, id, value?));
    [
        of("build-ms/v1", Some(s.build_ms)),
        of("build-peak-bytes/v1", s.build_peak_bytes.map(|n| n as f64)),
        of("update-ms/v1", s.update_ms),
        of("bytes/v1", Some(stats.bytes as f64)),
        of("bytes-per-triangle/v1", per_triangle(stats.bytes)),
        of("nodes/v1", Some(stats.nodes as f64)),
        of("leaves/v1", Some(stats.leaves as f64)),
        of("references/v1", Some(stats.references as f64)),
        of("references-per-triangle/v1", per_triangle(stats.references)),
        of("depth/v1", stats.depth.map(f64::from)),
        of("sah-cost/v1", stats.sah_cost),
        of("epo/v1", stats.epo),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn of_rays(key: &Key, s: &StructureRecord) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for timing in &s.timings {
        let key = key
            .clone()
            .with(axis::RAYS, format::ray_class(timing.class));
        values.push(Value::new(&key, "mrays-per-s/v1", timing.mrays_s));
        let rays = [
            ("rays/v1", timing.rays as f64),
            ("hit-share/v1", timing.hit_fraction),
        ];
        let work = timing.counters.iter().flat_map(|work| {
            [
                ("nodes-per-ray/v1", work.nodes),
                ("box-tests-per-ray/v1", work.box_tests),
                ("triangle-tests-per-ray/v1", work.triangle_tests),
                ("deepest-stack/v1", f64::from(work.stack_high_water)),
            ]
        });
        for (id, value) in rays.into_iter().chain(work) {
            values.push(Value::exact(&key, id, value));
        }
    }
    values
}

/// Errors and times under one integrator.
pub fn of_view(view: &View) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for sampler in &view.samplers {
        let key = &sampler.key;
        for metric in [Metric::RelMse, Metric::Rmse] {
            values.extend(sampler.mean_errors(metric).iter().map(|mean| Value {
                key: key.clone().with(axis::SPP, mean.spp),
                figure: Cow::Borrowed(figure(metric.figure())),
                reading: match mean.resolved {
                    true => Reading::Known(mean.error),
                    false => Reading::Below(mean.error.high.max(0.0)),
                },
            }));
            let slope = sampler.slope(metric);
            values.extend(slope.map(|slope| Value::new(key, metric.slope_figure(), slope)));
        }
        let z = sampler.bias.and_then(|bias| bias.z);
        values.extend(z.map(|z| Value::exact(key, "bias-z/v1", z)));
        if let Some(s) = sampler.spectrum {
            let key = &key.clone().with(axis::SPP, s.spp);
            let power = s
                .low_frequency
                .map(|x| Value::new(key, "low-frequency-power/v1", x));
            let next = s
                .autocorrelation
                .map(|x| Value::new(key, "neighbour-correlation/v1", x));
            values.extend(power.into_iter().chain(next));
        }
    }
    for time in view.valid_times() {
        let key = &time.key;
        let ms = time
            .ms_per_spp
            .map(|ms| Value::new(key, "ms-per-spp/v1", ms));
        let rate = time
            .mrays_s
            .map(|rate| Value::new(key, "cell-mrays-per-s/v1", rate));
        values.extend(ms.into_iter().chain(rate));
    }
    values.extend(
        view.reference
            .map(|reference| Value::exact(reference.key, "reference-mse/v1", reference.mse)),
    );
    values
}

/// Figures of a stream's points.
pub fn of_stream(stream: &Recorded<StreamRecord>) -> Vec<Value<'static>> {
    let [a, b] = stream.dimensions;
    let what = format!("{} (dimensions {a} and {b})", stream.purpose);
    let key = stream.key.clone().with(axis::DIMENSIONS, what);
    let figures = &stream.figures;
    let at = |key: &Key, id: &str, counts: &[FigureAtCount]| -> Vec<Value> {
        let at =
            |at: &FigureAtCount| Value::new(&key.clone().with(axis::POINTS, at.n), id, at.value);
        counts.iter().map(at).collect()
    };
    let mut values = at(&key, "star-discrepancy/v1", &stream.star);
    values.extend(at(&key, "l2-star/v1", &figures.l2_star));
    values.extend(at(&key, "centered/v1", &figures.centered));
    for (id, slope) in [
        ("star-exponent/v1", figures.star_slope),
        ("l2-star-exponent/v1", figures.l2_star_slope),
    ] {
        values.extend(slope.map(|slope| Value::new(&key, id, slope)));
    }
    for integrand in &figures.integrands {
        let key = key.clone().with(axis::SUBJECT, &integrand.function);
        values.extend(at(&key, "integral-rmse/v1", &integrand.rmse));
        let slope = integrand.slope;
        values.extend(slope.map(|slope| Value::new(&key, "integral-exponent/v1", slope)));
    }
    for pixels in &figures.pixels {
        let key = key.clone().with(axis::POINTS, pixels.n);
        let angle = pixels.neighbour_angle.to_degrees();
        values.push(Value::exact(&key, "neighbour-angle/v1", angle));
        values.push(Value::exact(&key, "coverage/v1", pixels.coverage));
    }
    values
}

/// The values as comma-separated text: one line for each key and figure, a column for each axis.
pub fn csv(values: &[Value]) -> String {
    let mut axes: Vec<&str> = Vec::new();
    for (axis, _) in values.iter().flat_map(|value| value.key.labels()) {
        if !axes.contains(&axis) {
            axes.push(axis);
        }
    }
    let place = |axis: &&str| axis::ALL.iter().position(|known| known == axis);
    axes.sort_by_key(|axis| place(axis).unwrap_or(axis::ALL.len()));
    let named = [
        "figure", "title", "unit", "value", "low", "high", "interval",
    ];
    let mut text = line(axes.iter().chain(&named).map(|head| (*head).to_owned()));
    for value in values {
        let Figure {
            id,
            title,
            unit,
            spread,
            ..
        } = &*value.figure;
        let numbers = match value.reading {
            Reading::Known(i) => [i.value, i.low, i.high].map(|x| x.to_string()),
            Reading::Below(bound) => [String::new(), String::new(), bound.to_string()],
        };
        let labels = axes.iter().map(|axis| value.key.label(axis).to_owned());
        let row = [id, title, unit].map(ToString::to_string);
        let row = row
            .into_iter()
            .chain(numbers)
            .chain([spread.words().to_owned()]);
        text += &line(labels.chain(row));
    }
    text
}

fn line(fields: impl Iterator<Item = String>) -> String {
    let quoted = |field: String| match field.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", field.replace('"', "\"\"")),
        false => field,
    };
    fields.map(quoted).collect::<Vec<_>>().join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_the_export_holds_every_axis_and_quotes_what_needs_it() {
        let key = Key::default().with(axis::SCENE, "a,\"b\"");
        let other = Key::default().with(axis::ACCEL, "bvh");
        let known = Value::new(
            &key,
            "build-ms/v1",
            Interval {
                value: 2.0,
                low: 1.0,
                high: 3.0,
            },
        );
        let mut below = Value::exact(&other, "rmse-unbiased/v1", 0.0);
        below.reading = Reading::Below(0.5);
        assert_eq!(
            csv(&[known, below]),
            "scene,accel,figure,title,unit,value,low,high,interval\n\
             \"a,\"\"b\"\"\",,build-ms/v1,build,ms,2,1,3,measured once\n\
             ,bvh,rmse-unbiased/v1,unbiased RMSE,,,,0.5,\"jackknife, Student's 95 % interval\"\n"
        );
    }
}
