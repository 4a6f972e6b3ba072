//! The values of the records, figure by figure, each with its key. Tables and exports read these.

use super::data::{FULL_CELLS, RAYS, RunData, SceneGroup, View, sitting, world};
use super::document::TableCell;
use super::format;
use super::samplers::{HEAVY_TAILED, MeasuredSampler, Metric};
use super::sections::{
    animation, compactions, kernels, organisations, peers, structures, trade_off, verdict::Race,
};
use raystone_core::text::escape::visible;
use raystone_record::figure::{self, Figure, Spread};
use raystone_record::{
    BiasRecord, CellRecord, Interval, Key, MeasuredRecord, Ran, Recorded, ReferenceRecord, Samples,
    StreamRecord, StructureRecord, axis,
};
use raystone_stats::comparison::LogFigure;
use raystone_stats::statistics::LEAST_FOR_MEDIAN;
use std::borrow::Cow;
use std::collections::BTreeSet;

/// A figure of one key.
#[derive(Debug, Clone, PartialEq)]
pub struct Value<'a> {
    /// Its subject.
    pub key: Key,
    /// Its row in the table of figures.
    pub figure: Cow<'a, Figure>,
    /// Its estimate.
    pub estimate: Estimate,
    /// Its source.
    pub source: Source<'a>,
}

/// The source of a value.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Source<'a> {
    /// The samples.
    pub samples: Samples,
    /// Equal for two values whose samples belong together one by one, as those timed in the same rounds
    /// do; empty where that is not known.
    pub sitting: String,
    /// Description of the work, equal for two values of the same work.
    pub work: String,
    /// Hash of the kernels; empty if none is recorded.
    pub kernel: &'a str,
}

/// An estimate of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Estimate {
    /// The value, with an interval that has no width where none is known.
    Known(Interval),
    /// The value, with an interval that is not to be trusted: one pixel decides over it, see
    /// [`raystone_stats::heavy_tails`].
    HeavyTailed(Interval),
    /// Only that it is below this: the reference resolves no more.
    Below(f64),
    /// No number, for the reason given by the word.
    Word(&'static str),
}

impl Estimate {
    /// Returns a value with its interval; `heavy_tailed` if that is unreliable.
    pub fn of(interval: Interval, heavy_tailed: bool) -> Self {
        if heavy_tailed {
            Self::HeavyTailed(interval)
        } else {
            Self::Known(interval)
        }
    }
}

impl From<Interval> for Estimate {
    fn from(value: Interval) -> Self {
        Self::Known(value)
    }
}

impl From<f64> for Estimate {
    fn from(value: f64) -> Self {
        Self::Known(Interval::exact(value))
    }
}

/// Describes the bounds of the medians among these values.
pub(crate) fn median_bounds(values: &[Value]) -> String {
    let rounds = |value: &Value| match &value.source.samples {
        Samples::Rounds { adapter, .. } => adapter.len(),
        _ => 0,
    };
    format::median_bounds(values.iter().map(rounds))
}

impl Value<'static> {
    /// Creates a figure of this crate.
    pub fn new(key: &Key, figure: &'static Figure, estimate: impl Into<Estimate>) -> Self {
        Self {
            key: key.clone(),
            figure: Cow::Borrowed(figure),
            estimate: estimate.into(),
            source: Source::default(),
        }
    }

    /// Returns the known ones of these figures of a key.
    pub fn known<T: Into<Estimate>>(
        key: &Key,
        figures: impl IntoIterator<Item = (&'static Figure, Option<T>)>,
    ) -> Vec<Self> {
        let known = figures.into_iter();
        let known = known.filter_map(|(figure, value)| Some(Self::new(key, figure, value?)));
        known.collect()
    }
}

impl<'a> Value<'a> {
    /// Returns the value of a reading in a line with this key.
    pub(crate) fn of_reading(
        data: &RunData<'a>,
        key: &Key,
        reading: raystone_record::Reading,
    ) -> Self {
        Self {
            key: key.clone().beside(&reading.at),
            figure: data.figure(&reading.figure),
            estimate: Estimate::Known(reading.value),
            source: Source {
                samples: reading.samples,
                work: reading.work,
                ..Source::default()
            },
        }
    }

    /// Returns the same value, measured in the rounds that all of this kind had on its scene.
    pub(crate) fn measured(mut self, kind: &str, ran: &'a Ran, cell: Option<&CellRecord>) -> Self {
        self.source.kernel = &ran.kernel_hash;
        self.source.sitting = match &self.source.samples {
            Samples::Once => String::new(),
            Samples::Rounds { .. } => sitting(kind, &self.key, cell),
            // If the numbers of groups differ, groups cannot be paired.
            Samples::Groups(groups) => {
                format!("{} groups of warps\n{}", groups.len(), world(&self.key))
            }
        };
        self
    }

    /// Describes its interval: that of the figure, but for a median of rounds too few for one.
    pub(crate) fn spread_words(&self) -> Cow<'static, str> {
        let spread = self.figure.spread;
        match &self.source.samples {
            Samples::Rounds { adapter, .. }
                if spread == Spread::Median && adapter.len() < LEAST_FOR_MEDIAN =>
            {
                let bounds = format::median_bounds(std::iter::once(adapter.len()));
                format!("median, {bounds}").into()
            }
            _ => spread.words().into(),
        }
    }

    /// Returns its logarithm with the noise of its parts, round by round or group by group, where these are known.
    pub fn by_parts(&self) -> Option<LogFigure> {
        match &self.source.samples {
            Samples::Once => None,
            Samples::Rounds { adapter, .. } => LogFigure::of_rounds(&self.source.sitting, adapter),
            Samples::Groups(groups) => Some(LogFigure::of_groups(&self.source.sitting, groups)),
        }
    }

    /// Returns `true` if its number, if any, is finite, as are the ends of its interval.
    fn is_a_number(&self) -> bool {
        match self.estimate {
            Estimate::Known(i) | Estimate::HeavyTailed(i) => {
                [i.value, i.low, i.high].iter().all(|x| x.is_finite())
            }
            Estimate::Below(bound) => bound.is_finite(),
            Estimate::Word(_) => true,
        }
    }

    /// Returns `true` if the reference is too noisy for it.
    pub(crate) fn is_unresolved(&self) -> bool {
        matches!(self.estimate, Estimate::Below(_))
    }

    /// Returns `true` if its interval is unreliable.
    pub(crate) fn is_heavy_tailed(&self) -> bool {
        matches!(self.estimate, Estimate::HeavyTailed(_))
    }

    /// Returns the value as a table shows it.
    pub fn cell(&self) -> TableCell {
        let text = |value| format::figure(&self.figure, value);
        match self.estimate {
            Estimate::Word(word) => word.into(),
            Estimate::Below(bound) => format!("<{}", text(bound)).into(),
            Estimate::HeavyTailed(i) => TableCell::with_detail(
                format!("{} ‡", text(i.value)),
                format!("[{}, {}], not to be trusted", text(i.low), text(i.high)),
            ),
            Estimate::Known(i) if i.low < i.high => TableCell::with_detail(
                text(i.value),
                format!("[{}, {}]", text(i.low), text(i.high)),
            ),
            Estimate::Known(i) => text(i.value).into(),
        }
    }
}

/// Returns the number on an axis; 0 without one.
pub fn number(key: &Key, axis: &str) -> usize {
    key.label(axis).parse().unwrap_or(0)
}

/// Returns all values of a run.
pub fn values<'a>(data: &RunData<'a>) -> Vec<Value<'a>> {
    let mut values = Vec::new();
    for scene in &data.scenes {
        values.extend(of_structures(data, scene));
        values.extend(animation::values(data, scene));
        values.extend(peers::values(scene));
        values.extend(structures::prices(scene));
        values.extend((scene.views.iter()).flat_map(|view| of_view(data, scene, view)));
        values.extend(of_references(data, scene));
    }
    values.extend(data.streams.iter().flat_map(|s| of_stream(data, *s)));
    values.extend(
        data.measured
            .iter()
            .flat_map(|cell| of_readings(data, *cell)),
    );
    values.extend(compactions::derived(data));
    // A quotient from a damaged record that is no number is no figure.
    values.retain(Value::is_a_number);
    values
}

/// Returns the readings of a cell that did not fail.
pub(crate) fn of_readings<'a>(
    data: &RunData<'a>,
    cell: Recorded<'a, MeasuredRecord>,
) -> Vec<Value<'a>> {
    if cell.failure.is_some() {
        return Vec::new();
    }
    let at = data.cell_of(cell.hash);
    let value = |reading: &raystone_record::Reading| {
        Value::of_reading(data, cell.key, reading.clone()).measured(&cell.measurement, cell.ran, at)
    };
    cell.readings.iter().map(value).collect()
}

/// Returns the figures of all structures of a scene; those without a fault also have speeds.
pub(crate) fn of_structures<'a>(data: &RunData<'a>, scene: &SceneGroup<'a>) -> Vec<Value<'a>> {
    let triangles = scene.record.map_or(0, |record| record.triangles);
    let mut values = Vec::new();
    for s in &scene.structures {
        let own = s.values(data, RAYS, s.body.readings());
        values.extend(of_triangles(&s.key, s.body, triangles));
        values.extend(own);
    }
    values.extend(trade_off::break_even(scene));
    values
}

/// Returns the figures of a build per triangle of its scene.
fn of_triangles(key: &Key, s: &StructureRecord, triangles: usize) -> Vec<Value<'static>> {
    let known = s.is_built() && triangles > 0;
    let per_triangle = |x: u64| known.then(|| x as f64 / triangles as f64);
    let is_timed = s.is_built() && s.build_ms > 0.0;
    let rate = is_timed.then(|| triangles as f64 / s.build_ms * 1e-3);
    let figures = [
        (&figure::BUILD_RATE, rate),
        (&figure::BYTES_PER_TRIANGLE, per_triangle(s.stats.bytes)),
        (
            &figure::REFERENCES_PER_TRIANGLE,
            per_triangle(s.stats.references),
        ),
    ];
    Value::known(key, figures)
}

/// Returns errors, times and bias checks of one view.
pub(crate) fn of_view<'a>(
    data: &RunData<'a>,
    scene: &SceneGroup<'a>,
    view: &View<'a>,
) -> Vec<Value<'a>> {
    let mut values = Vec::new();
    for sampler in &view.samplers {
        values.extend(of_sampler(data, sampler));
    }
    for time in view.valid_times() {
        values.extend(time.values(data, FULL_CELLS, time.body.readings()));
    }
    for cell in &view.coherence {
        values.extend(cell.values(data, FULL_CELLS, cell.body.readings()));
    }
    let of_races: Vec<_> = Race::new(view).iter().flat_map(Race::values).collect();
    values.extend(of_races);
    values.extend(trade_off::times_to_image(scene, view));
    values.extend(kernels::gains(scene, view));
    values.extend(organisations::against_single(scene, view));
    values
}

/// Returns the statistics of the replicates of a sampler.
fn of_sampler<'a>(data: &RunData<'a>, sampler: &MeasuredSampler<'a>) -> Vec<Value<'a>> {
    let key = &sampler.key;
    let mut values = Vec::new();
    for metric in [Metric::RelMse, Metric::Rmse] {
        for mean in sampler.mean_errors(metric) {
            let reading = if mean.resolved {
                Estimate::of(mean.error, mean.heavy_tailed)
            } else {
                Estimate::Below(mean.error.high.max(0.0))
            };
            let key = key.clone().with(axis::SPP, mean.spp);
            values.push(Value::new(&key, sampler.figure(metric), reading));
        }
        let heavy = metric == Metric::RelMse && sampler.is_heavy_tailed();
        let slope = sampler
            .slope(metric)
            .map(|slope| Estimate::of(slope, heavy));
        values.extend(Value::known(key, [(metric.slope_figure(), slope)]));
    }
    if let Some(spp) = sampler.highest_spp() {
        let key = key.clone().with(axis::SPP, spp);
        values.extend(Value::known(&key, sampler.further(spp)));
    }
    let bias = sampler.bias.iter().flat_map(BiasRecord::readings);
    let spectrum = sampler.spectrum.iter().flat_map(|s| s.readings());
    let readings = bias.chain(spectrum);
    values.extend(readings.map(|reading| Value::of_reading(data, key, reading)));
    values
}

/// Returns the errors of references, of which views have some in common.
fn of_references<'a>(data: &RunData<'a>, scene: &SceneGroup<'a>) -> Vec<Value<'a>> {
    let mut known = BTreeSet::new();
    let references = scene.views.iter().filter_map(|view| view.reference);
    let references = references.filter(|r| known.insert(r.key.to_string()));
    let of_one = |r: Recorded<'a, ReferenceRecord>| {
        let readings = r.body.readings().into_iter();
        readings
            .map(|reading| Value::of_reading(data, r.key, reading))
            .collect::<Vec<_>>()
    };
    references.flat_map(of_one).collect()
}

/// Returns the figures of a stream's points.
pub(crate) fn of_stream<'a>(
    data: &RunData<'a>,
    stream: Recorded<'a, StreamRecord>,
) -> Vec<Value<'a>> {
    let readings = stream.body.readings().into_iter();
    readings
        .map(|reading| Value::of_reading(data, stream.key, reading))
        .collect()
}

/// Returns the values as comma-separated text: one line for each key and figure, a column for each axis.
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
        let Value {
            key,
            figure,
            estimate,
            ..
        } = value;
        let numbers = match estimate {
            Estimate::Known(i) | Estimate::HeavyTailed(i) => {
                [i.value, i.low, i.high].map(|x| x.to_string())
            }
            Estimate::Below(bound) => [String::new(), String::new(), bound.to_string()],
            Estimate::Word(_) => Default::default(),
        };
        let spread = match estimate {
            Estimate::Word(word) => (*word).to_owned(),
            Estimate::HeavyTailed(_) => format!(
                "{}, not to be trusted: {HEAVY_TAILED}",
                value.spread_words()
            ),
            _ => value.spread_words().into_owned(),
        };
        let labels = axes.iter().map(|axis| no_formula(key.label(axis)));
        let row = [&figure.id, &figure.title, &figure.unit].map(ToString::to_string);
        text += &line(labels.chain(row).chain(numbers).chain([spread]));
    }
    text
}

/// Returns the first line of a table that does not hold its value: columns are found by their heads.
pub(crate) fn csv_fault(values: &[Value], text: &str) -> Option<String> {
    let mut rows = rows_of(text).into_iter();
    let heads = rows.next().unwrap_or_default();
    let wrong = values.iter().zip(1..).find_map(|(value, line)| {
        let row = rows.next().unwrap_or_default();
        let field = |name: &str| {
            let column = heads.iter().position(|head| head == name)?;
            row.get(column).map(String::as_str)
        };
        let number = |name: &str| field(name).and_then(|text| text.parse::<f64>().ok());
        let holds = |numbers: [Option<f64>; 3]| ["value", "low", "high"].map(number) == numbers;
        let is_named = field("figure") == Some(&*value.figure.id);
        let mut labels = value.key.labels();
        let is_at = labels.all(|(axis, label)| field(axis) == Some(&*no_formula(label)));
        let is_there = match value.estimate {
            Estimate::Known(i) | Estimate::HeavyTailed(i) => {
                holds([i.value, i.low, i.high].map(Some))
            }
            Estimate::Below(bound) => holds([None, None, Some(bound)]),
            Estimate::Word(_) => holds([None; 3]),
        };
        (!(is_named && is_at && is_there)).then(|| format!("value {line}, {}", value.key))
    });
    wrong.or_else(|| rows.next().map(|_| "a line too many".to_owned()))
}

/// Fields by line (RFC 4180).
fn rows_of(text: &str) -> Vec<Vec<String>> {
    let (mut rows, mut row, mut field) = (Vec::new(), Vec::new(), String::new());
    let mut is_quoted = false;
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.next_if_eq(&'"').is_some() => field.push('"'),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => row.push(std::mem::take(&mut field)),
            '\n' if !is_quoted => {
                row.push(std::mem::take(&mut field));
                rows.push(std::mem::take(&mut row));
            }
            _ => field.push(letter),
        }
    }
    rows
}

/// Returns a name, with an apostrophe before it if a spreadsheet would read it as a formula.
fn no_formula(name: &str) -> String {
    if name.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        format!("'{}", visible(name))
    } else {
        visible(name)
    }
}

fn line(fields: impl Iterator<Item = String>) -> String {
    let quoted = |field: String| {
        if field.contains(['"', ',', '\n', '\r']) {
            format!("\"{}\"", field.replace('"', "\"\""))
        } else {
            field
        }
    };
    fields.map(quoted).collect::<Vec<_>>().join(",") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_median_of_few_rounds_is_told_with_a_range() {
        let of = |rounds: usize, figure| {
            let known = Interval {
                value: 2.0,
                low: 1.0,
                high: 3.0,
            };
            let mut value = Value::new(&Key::default(), figure, known);
            value.source.samples = Samples::Rounds {
                adapter: vec![2.0; rounds],
                wall: Vec::new(),
                processors: Vec::new(),
            };
            value
        };
        let told = |value: Value| csv(&[value]).lines().nth(1).map(str::to_owned);
        let range = "range of 5 samples, 6 are needed for a 95 % interval";
        assert_eq!(
            told(of(5, &figure::MRAYS_PER_S)),
            Some(format!(
                "mrays-per-s/v1,speed,Mrays/s,2,1,3,\"median, {range}\""
            ))
        );
        // A caption speaks for the medians of fewest rounds.
        let timed = [5, 9].map(|rounds| of(rounds, &figure::NS_PER_SAMPLE));
        assert_eq!(median_bounds(&timed), range);
        assert_eq!(median_bounds(&timed[1..]), "95 % interval");
        let enough = of(6, &figure::MRAYS_PER_S);
        assert_eq!(enough.spread_words(), Spread::Median.words());
        assert_eq!(
            of(5, &figure::BREAK_EVEN).spread_words(),
            figure::BREAK_EVEN.spread.words()
        );
    }

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
            Value::new(&other, &figure::RMSE_UNBIASED, Estimate::Below(0.5)),
            Value::new(&other, &figure::BREAK_EVEN, Estimate::Word("never")),
        ];
        assert_eq!(
            csv(&values),
            "scene,accel,figure,title,unit,value,low,high,interval\n\
             \"a,\"\"b\"\"\",,build-ms/v1,build,ms,2,1,3,measured once\n\
             ,bvh,rmse-unbiased/v1,unbiased RMSE,,,,0.5,\"jackknife, Student's 95 % interval\"\n\
             ,bvh,break-even/v1,break-even,thousand rays,,,,never\n"
        );
        let text = csv(&values);
        assert_eq!(csv_fault(&values, &text), None);
        for (from, to) in [
            (",2,1,3,", ",2,3,1,"),
            ("scene,accel", "accel,scene"),
            ("value,low,high", "low,value,high"),
            (",never", ",never\nx"),
        ] {
            let wrong = text.replace(from, to);
            assert!(
                wrong != text && csv_fault(&values, &wrong).is_some(),
                "{from}"
            );
        }
        let less = text.lines().take(2).collect::<Vec<_>>().join("\n") + "\n";
        assert!(csv_fault(&values, &less).is_some());
    }
}
