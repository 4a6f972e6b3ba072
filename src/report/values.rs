//! What the records say, figure by figure: each value with its key. Tables and exports read these.

use super::data::{RunData, SceneGroup, View};
use super::document::TableCell;
use super::format;
use super::samplers::{HEAVY_TAILED, Metric};
use super::sections::{
    animation, compactions, kernels, organisations, peers, trade_off, verdict::Race,
};
use raystone_core::text::escape::visible;
use raystone_record::figure::{self, Figure};
use raystone_record::{
    BiasRecord, ClassCoherence, ClassTiming, CoherenceRecord, FigureAtCount, Interval, Key,
    MeasuredRecord, OrderTime, PrimaryRecord, RayClass, Recorded, SpectrumRecord, StreamRecord,
    StructureRecord, Tally, TimeRecord, axis,
};
use std::borrow::Cow;
use std::collections::BTreeSet;

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
    /// The value, with an interval that is not to be trusted: one pixel decides over it, see
    /// [`raystone_stats::heavy_tails`].
    HeavyTailed(Interval),
    /// Only that it is below this: the reference resolves no more.
    Below(f64),
    /// No number, for the reason that the word says.
    Word(&'static str),
}

impl Reading {
    /// The value with its interval, and whether that is not to be trusted.
    pub fn of(interval: Interval, heavy_tailed: bool) -> Self {
        match heavy_tailed {
            true => Self::HeavyTailed(interval),
            false => Self::Known(interval),
        }
    }
}

impl From<Interval> for Reading {
    fn from(value: Interval) -> Self {
        Self::Known(value)
    }
}

impl From<f64> for Reading {
    fn from(value: f64) -> Self {
        Self::Known(Interval::exact(value))
    }
}

impl Value<'static> {
    /// A figure of this crate.
    pub fn new(key: &Key, figure: &'static Figure, reading: impl Into<Reading>) -> Self {
        Self {
            key: key.clone(),
            figure: Cow::Borrowed(figure),
            reading: reading.into(),
        }
    }

    /// Those figures of a key that are known.
    pub fn known<T: Into<Reading>>(
        key: &Key,
        figures: impl IntoIterator<Item = (&'static Figure, Option<T>)>,
    ) -> Vec<Self> {
        let known = figures.into_iter();
        let known = known.filter_map(|(figure, value)| Some(Self::new(key, figure, value?)));
        known.collect()
    }
}

impl Value<'_> {
    /// Whether what is known is a number, with ends that are numbers.
    fn is_a_number(&self) -> bool {
        match self.reading {
            Reading::Known(i) | Reading::HeavyTailed(i) => {
                [i.value, i.low, i.high].iter().all(|x| x.is_finite())
            }
            Reading::Below(bound) => bound.is_finite(),
            Reading::Word(_) => true,
        }
    }

    /// Whether the reference is too noisy for it.
    pub(crate) fn is_unresolved(&self) -> bool {
        matches!(self.reading, Reading::Below(_))
    }

    /// Whether its interval is not to be trusted.
    pub(crate) fn is_heavy_tailed(&self) -> bool {
        matches!(self.reading, Reading::HeavyTailed(_))
    }

    /// The value as a table shows it.
    pub fn cell(&self) -> TableCell {
        let text = |value| format::figure(&self.figure, value);
        match self.reading {
            Reading::Word(word) => word.into(),
            Reading::Below(bound) => format!("<{}", text(bound)).into(),
            Reading::HeavyTailed(i) => TableCell::with_detail(
                format!("{} ‡", text(i.value)),
                format!("[{}, {}], not to be trusted", text(i.low), text(i.high)),
            ),
            Reading::Known(i) if i.low < i.high => TableCell::with_detail(
                text(i.value),
                format!("[{}, {}]", text(i.low), text(i.high)),
            ),
            Reading::Known(i) => text(i.value).into(),
        }
    }
}

/// The number on an axis; 0 without one.
pub fn number(key: &Key, axis: &str) -> usize {
    key.label(axis).parse().unwrap_or(0)
}

/// Everything that a run found.
pub fn values<'a>(data: &RunData<'a>) -> Vec<Value<'a>> {
    let mut values = Vec::new();
    for scene in &data.scenes {
        values.extend(of_structures(data, scene));
        values.extend(animation::values(data, scene));
        values.extend(peers::values(scene));
        values.extend(scene.views.iter().flat_map(|view| of_view(scene, view)));
        values.extend(of_references(scene));
    }
    values.extend(data.streams.iter().flat_map(|s| of_stream(s)));
    values.extend(
        data.measured
            .iter()
            .flat_map(|cell| of_readings(data, cell)),
    );
    values.extend(compactions::derived(data));
    // What a damaged record makes of a division is no figure.
    values.retain(Value::is_a_number);
    values
}

/// The readings of a cell that did not fail.
pub(crate) fn of_readings<'a>(
    data: &RunData<'a>,
    cell: &Recorded<'a, MeasuredRecord>,
) -> Vec<Value<'a>> {
    let sound = cell.readings.iter().filter(|_| cell.failure.is_none());
    let value = |reading: &raystone_record::Reading| Value {
        key: cell.key.clone().beside(&reading.at),
        figure: data.figure(&reading.figure),
        reading: Reading::Known(reading.value),
    };
    sound.map(value).collect()
}

/// Coherence of recorded rays, class by class.
fn of_classes(key: &Key, coherence: &ClassCoherence) -> Vec<Value<'static>> {
    let of_class = |(class, tally): &(RayClass, Tally)| {
        let key = key.clone().with(axis::RAYS, format::ray_class(*class));
        Value::known(&key, tally.figures(coherence.settings.line_bytes))
    };
    coherence.classes.iter().flat_map(of_class).collect()
}

/// Figures of all structures of a scene; those without a fault also have speeds.
pub(crate) fn of_structures<'a>(data: &RunData<'a>, scene: &SceneGroup<'a>) -> Vec<Value<'a>> {
    let triangles = scene.record.map_or(0, |record| record.triangles);
    let mut values = Vec::new();
    for s in &scene.structures {
        if s.is_built() {
            values.extend(of_build(&s.key, s, triangles));
        }
        if s.fault().is_none() {
            values.extend(s.timings.iter().flat_map(|timing| of_rays(&s.key, timing)));
            values.extend(s.coherence.iter().flat_map(|c| of_classes(&s.key, c)));
        }
        values.extend(s.body.figures.iter().map(|(id, value)| Value {
            key: s.key.clone(),
            figure: data.figure(id),
            reading: Reading::Known(*value),
        }));
    }
    values.extend(trade_off::break_even(scene));
    values
}

/// Classes of leaf sizes: title, least and greatest number of references.
const LEAF_CLASSES: [(&str, usize, usize); 8] = [
    ("0", 0, 0),
    ("1", 1, 1),
    ("2", 2, 2),
    ("3", 3, 3),
    ("4", 4, 4),
    ("5–8", 5, 8),
    ("9–16", 9, 16),
    ("17 or more", 17, usize::MAX),
];

fn of_build(key: &Key, s: &StructureRecord, triangles: usize) -> Vec<Value<'static>> {
    let per_triangle = |x: u64| (triangles > 0).then(|| x as f64 / triangles as f64);
    let stats = &s.stats;
    let rate = (s.build_ms > 0.0).then(|| triangles as f64 / s.build_ms * 1e-3);
    let figures = [
        (&figure::BUILD_MS, Some(s.build_ms)),
        (&figure::BUILD_RATE, rate),
        (
            &figure::BUILD_PEAK_BYTES,
            s.build_peak_bytes.map(|n| n as f64),
        ),
        (&figure::UPDATE_MS, s.update_ms),
        (&figure::BYTES, Some(stats.bytes as f64)),
        (&figure::BYTES_PER_TRIANGLE, per_triangle(stats.bytes)),
        (&figure::NODES, Some(stats.nodes as f64)),
        (&figure::LEAVES, Some(stats.leaves as f64)),
        (&figure::REFERENCES, Some(stats.references as f64)),
        (
            &figure::REFERENCES_PER_TRIANGLE,
            per_triangle(stats.references),
        ),
        (&figure::DEPTH, stats.depth.map(f64::from)),
        (&figure::SAH_COST, stats.sah_cost),
        (&figure::EPO, stats.epo),
    ];
    let all: u64 = stats.leaf_histogram.iter().sum();
    let leaves = LEAF_CLASSES.iter().filter_map(|(title, least, greatest)| {
        let sizes = stats.leaf_histogram.iter().enumerate();
        let inside = sizes.filter(|(size, _)| least <= size && size <= greatest);
        let leaves: u64 = inside.map(|(_, leaves)| leaves).sum();
        let key = key.clone().with(axis::SUBJECT, title);
        let share = leaves as f64 / all as f64;
        (leaves > 0).then(|| Value::new(&key, &figure::LEAF_SHARE, share))
    });
    let mut values = Value::known(key, figures);
    values.extend(leaves);
    values
}

fn of_rays(key: &Key, timing: &ClassTiming) -> Vec<Value<'static>> {
    let key = (key.clone()).with(axis::RAYS, format::ray_class(timing.class));
    let work = timing.counters;
    let unlike = timing
        .unlike_shadow
        .map(|rays| 1e6 * rays as f64 / timing.rays.max(1) as f64);
    let mut values = vec![Value::new(&key, &figure::MRAYS_PER_S, timing.mrays_s)];
    values.extend(Value::known(
        &key,
        [
            (&figure::RAYS, Some(timing.rays as f64)),
            (&figure::HIT_SHARE, Some(timing.hit_fraction)),
            (&figure::UNLIKE_SHADOW, unlike),
            (&figure::NODES_PER_RAY, work.map(|w| w.nodes)),
            (&figure::BOX_TESTS_PER_RAY, work.map(|w| w.box_tests)),
            (
                &figure::TRIANGLE_TESTS_PER_RAY,
                work.map(|w| w.triangle_tests),
            ),
            (
                &figure::DEEPEST_STACK,
                work.map(|w| f64::from(w.stack_high_water)),
            ),
        ],
    ));
    values
}

/// Errors, times and bias checks of one view.
pub(crate) fn of_view(scene: &SceneGroup, view: &View) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for sampler in &view.samplers {
        let key = &sampler.key;
        for metric in [Metric::RelMse, Metric::Rmse] {
            for mean in sampler.mean_errors(metric) {
                let reading = match mean.resolved {
                    true => Reading::of(mean.error, mean.heavy_tailed),
                    false => Reading::Below(mean.error.high.max(0.0)),
                };
                let key = key.clone().with(axis::SPP, mean.spp);
                values.push(Value::new(&key, metric.figure(), reading));
            }
            let heavy = metric == Metric::RelMse && sampler.is_heavy_tailed();
            let slope = sampler.slope(metric).map(|slope| Reading::of(slope, heavy));
            values.extend(Value::known(key, [(metric.slope_figure(), slope)]));
        }
        if let Some(spp) = sampler.highest_spp() {
            let key = key.clone().with(axis::SPP, spp);
            values.extend(Value::known(&key, sampler.further(spp)));
        }
        values.extend(sampler.bias.iter().flat_map(|bias| of_bias(key, bias)));
        let spectrum = sampler.spectrum.into_iter();
        values.extend(spectrum.flat_map(|s| of_spectrum(key, s)));
    }
    for time in view.valid_times() {
        let figures = [
            (&figure::MS_PER_SPP, time.ms_per_spp),
            (&figure::CELL_MRAYS_PER_S, time.mrays_s),
            (
                &figure::RAY_QUERY_SHARE,
                organisations::query_share(time).map(Interval::exact),
            ),
        ];
        values.extend(Value::known(&time.key, figures));
        values.extend(of_orders(&time.key, time));
        values.extend(time.primary.iter().flat_map(|p| of_primary(&time.key, p)));
    }
    values.extend(view.coherence.iter().flat_map(|c| of_coherence(&c.key, c)));
    values.extend(Race::new(view).iter().flat_map(Race::values));
    values.extend(trade_off::times_to_image(scene, view));
    values.extend(kernels::gains(scene, view));
    values.extend(organisations::against_single(scene, view));
    values
}

/// Errors of references, of which views have some in common.
fn of_references<'a>(scene: &SceneGroup<'a>) -> Vec<Value<'a>> {
    let mut known = BTreeSet::new();
    let references = scene
        .views
        .iter()
        .filter_map(|view| view.reference.as_ref());
    let references = references.filter(|r| known.insert(r.key.to_string()));
    let mse = references.filter_map(|r| Some(Value::new(r.key, &figure::REFERENCE_MSE, r.mse?)));
    mse.collect()
}

/// Times of a cell in orders of passes.
fn of_orders(key: &Key, time: &TimeRecord) -> Vec<Value<'static>> {
    let one_pass = time.orders.first().and_then(|at| at.ms_per_spp);
    let of_order = |at: &OrderTime| {
        let key = key.clone().with(axis::SUBJECT, &at.order);
        let ratio = at
            .ms_per_spp
            .zip(one_pass)
            .map(|(ms, one)| ms.value / one.value);
        let passes = at.passes as f64;
        let figures = [
            (&figure::ORDER_PASSES, Some(Interval::exact(passes))),
            (&figure::ORDER_MS, at.ms_per_spp),
            (&figure::ORDER_RATIO, ratio.map(Interval::exact)),
            (&figure::FIRST_PICTURE_MS, at.first_picture_ms),
        ];
        Value::known(&key, figures)
    };
    time.orders.iter().flat_map(of_order).collect()
}

/// Rasterised primary visibility against rays.
fn of_primary(key: &Key, primary: &PrimaryRecord) -> Vec<Value<'static>> {
    let share = |pixels: u64| {
        Some(Interval::exact(
            pixels as f64 / primary.pixels.max(1) as f64,
        ))
    };
    let exact = |x: f64| Some(Interval::exact(x));
    let figures = [
        (
            &figure::PRIMARY_OTHER_TRIANGLE,
            share(primary.other_triangle),
        ),
        (&figure::PRIMARY_OTHER_VALUE, share(primary.other_value)),
        (
            &figure::PRIMARY_MEAN_DIFFERENCE,
            exact(primary.mean_difference),
        ),
        (
            &figure::PRIMARY_RMS_DIFFERENCE,
            exact(primary.rms_difference),
        ),
        (&figure::RASTER_MS, primary.raster_ms),
        (&figure::TRACED_PRIMARY_MS, primary.traced_ms),
    ];
    Value::known(key, figures)
}

/// What stands on the axis of rays for all of them.
pub(crate) const ALL_RAYS: &str = "all";

/// Coherence by class of rays, and of all.
fn of_coherence(key: &Key, record: &CoherenceRecord) -> Vec<Value<'static>> {
    let mut values = Vec::new();
    for at in &record.at {
        let key = key.clone().with(axis::SPP, at.spp);
        let key = key.with(axis::SUBJECT, &at.organisation);
        let all = (ALL_RAYS.to_owned(), at.all());
        for (class, tally) in at.classes.iter().chain([&all]) {
            let key = key.clone().with(axis::RAYS, class);
            let figures = tally.figures(record.settings.line_bytes);
            values.extend(Value::known(&key, figures));
        }
        let key = key.with(axis::RAYS, ALL_RAYS);
        let path = [(&figure::CYCLES_PER_PATH, at.cost_of_path())];
        values.extend(Value::known(&key, path));
    }
    values
}

fn of_bias(key: &Key, bias: &BiasRecord) -> Vec<Value<'static>> {
    let tested = bias.p.map(|p| {
        [
            (&figure::BIAS_TILES, Some(bias.tiles as f64)),
            (&figure::BIAS_REJECTED, Some(bias.rejected as f64)),
            (&figure::BIAS_LEAST_P, Some(bias.min_p)),
            (&figure::BIAS_Z, bias.z),
            (&figure::BIAS_P, Some(p)),
            (&figure::BIAS_FREEDOM, bias.degrees_of_freedom),
            (&figure::BIAS_WEIGHTED_P, bias.weighted_p),
            (
                &figure::BIAS_WEIGHTED_FREEDOM,
                bias.weighted_degrees_of_freedom,
            ),
            (
                &figure::BIAS_DETECTABLE,
                bias.detectable.map(|part| 100.0 * part),
            ),
        ]
    });
    Value::known(key, tested.into_iter().flatten())
}

/// The error that shares of filtered ones are taken of; `None` if there is none.
pub(crate) fn unfiltered(spectrum: &SpectrumRecord) -> Option<f64> {
    let at = spectrum.filtered.iter().find(|at| at.sigma == 0.0)?;
    (at.rmse.value > 0.0).then_some(at.rmse.value)
}

fn of_spectrum(key: &Key, spectrum: &SpectrumRecord) -> Vec<Value<'static>> {
    let key = &key.clone().with(axis::SPP, spectrum.spp);
    let before = unfiltered(spectrum);
    let mut values = Value::known(
        key,
        [
            (&figure::LOW_FREQUENCY_POWER, spectrum.low_frequency),
            (&figure::LOUDEST_WAVE, spectrum.loudest),
            (&figure::NEIGHBOUR_CORRELATION, spectrum.autocorrelation),
            (&figure::LUMINANCE_RMSE, before.map(Interval::exact)),
        ],
    );
    for at in spectrum.filtered.iter().filter(|at| at.sigma > 0.0) {
        let key = (key.clone()).with(axis::SUBJECT, format!("σ = {} px", at.sigma));
        let share = before.map(|before| at.rmse.value / before);
        values.extend(Value::known(&key, [(&figure::FILTERED_SHARE, share)]));
    }
    values
}

/// What a stream's dimensions are used for, with their numbers.
pub(crate) fn pair_of_dimensions(stream: &StreamRecord) -> String {
    let [a, b] = stream.dimensions;
    format!("{} (dimensions {a} and {b})", stream.purpose)
}

/// Figures of a stream's points.
pub(crate) fn of_stream(stream: &Recorded<StreamRecord>) -> Vec<Value<'static>> {
    let key = (stream.key.clone()).with(axis::DIMENSIONS, pair_of_dimensions(stream));
    let figures = &stream.figures;
    let at = |key: &Key, figure: &'static Figure, counts: &[FigureAtCount]| -> Vec<Value> {
        let at = |at: &FigureAtCount| {
            Value::new(&key.clone().with(axis::POINTS, at.n), figure, at.value)
        };
        counts.iter().map(at).collect()
    };
    let mut values = at(&key, &figure::STAR_DISCREPANCY, &stream.star);
    values.extend(at(&key, &figure::L2_STAR, &figures.l2_star));
    values.extend(at(&key, &figure::CENTERED, &figures.centered));
    let exponents = [
        (&figure::STAR_EXPONENT, figures.star_slope),
        (&figure::L2_STAR_EXPONENT, figures.l2_star_slope),
    ];
    values.extend(Value::known(&key, exponents));
    for integrand in &figures.integrands {
        let key = key.clone().with(axis::SUBJECT, &integrand.function);
        values.extend(at(&key, &figure::INTEGRAL_RMSE, &integrand.rmse));
        let exponent = [(&figure::INTEGRAL_EXPONENT, integrand.slope)];
        values.extend(Value::known(&key, exponent));
    }
    for pixels in &figures.pixels {
        let key = key.clone().with(axis::POINTS, pixels.n);
        let angle = pixels.neighbour_angle.to_degrees();
        values.push(Value::new(&key, &figure::NEIGHBOUR_ANGLE, angle));
        values.push(Value::new(&key, &figure::COVERAGE, pixels.coverage));
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
    for Value {
        key,
        figure,
        reading,
    } in values
    {
        let numbers = match reading {
            Reading::Known(i) | Reading::HeavyTailed(i) => {
                [i.value, i.low, i.high].map(|x| x.to_string())
            }
            Reading::Below(bound) => [String::new(), String::new(), bound.to_string()],
            Reading::Word(_) => Default::default(),
        };
        let spread = match reading {
            Reading::Word(word) => (*word).to_owned(),
            Reading::HeavyTailed(_) => format!(
                "{}, not to be trusted: {HEAVY_TAILED}",
                figure.spread.words()
            ),
            _ => figure.spread.words().to_owned(),
        };
        let labels = axes.iter().map(|axis| no_formula(key.label(axis)));
        let row = [&figure.id, &figure.title, &figure.unit].map(ToString::to_string);
        text += &line(labels.chain(row).chain(numbers).chain([spread]));
    }
    text
}

/// A name that a spreadsheet would take for a formula has an apostrophe before it.
fn no_formula(name: &str) -> String {
    match name.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        true => format!("'{}", visible(name)),
        false => visible(name),
    }
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
        let known = Interval {
            value: 2.0,
            low: 1.0,
            high: 3.0,
        };
        let values = [
            Value::new(&key, &figure::BUILD_MS, known),
            Value::new(&other, &figure::RMSE_UNBIASED, Reading::Below(0.5)),
            Value::new(&other, &figure::BREAK_EVEN, Reading::Word("never")),
        ];
        assert_eq!(
            csv(&values),
            "scene,accel,figure,title,unit,value,low,high,interval\n\
             \"a,\"\"b\"\"\",,build-ms/v1,build,ms,2,1,3,measured once\n\
             ,bvh,rmse-unbiased/v1,unbiased RMSE,,,,0.5,\"jackknife, Student's 95 % interval\"\n\
             ,bvh,break-even/v1,break-even,thousand rays,,,,never\n"
        );
    }
}
