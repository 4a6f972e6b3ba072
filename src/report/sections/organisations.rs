//! Organisations of the path tracer: time and stages of each, and the paths alive after each bounce.

use super::file_stem;
use super::kernels::time_over;
use super::specs::ORGANISATIONS;
use crate::data::{Measured, RunData, SceneGroup, View};
use crate::document::*;
use crate::format;
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::values::Value;
use raystone_record::figure::{self, Figure};
use raystone_record::{Interval, TimeRecord, axis};

/// The organisation that others are compared with.
const SINGLE: &str = "single-kernel";
const AGAINST: &Figure = &figure::AGAINST_SINGLE_KERNEL;

fn is_single(time: &Measured<TimeRecord>) -> bool {
    matches!(time.key.label(axis::ORGANISATION), "" | SINGLE)
}

/// Returns the time of each organisation of a view over that of the single kernel with everything else the same.
pub(crate) fn against_single(scene: &SceneGroup, view: &View) -> Vec<Value<'static>> {
    let others = view.valid_times().filter(|time| !is_single(time));
    let value = |time: &Measured<TimeRecord>| {
        let wanted = time.key.clone().with(axis::ORGANISATION, SINGLE);
        let mut times = scene.views.iter().flat_map(View::valid_times);
        let single = times.find(|other| other.key == wanted)?;
        let figure = (AGAINST, time_over(time, single));
        Value::known(&time.key, [figure]).pop()
    };
    others.filter_map(value).collect()
}

/// Returns the stages by their share of the time, the longest first.
fn stages(time: &TimeRecord) -> String {
    let all: f64 = time.stages.values().sum();
    let mut parts: Vec<(&String, f64)> = (time.stages.iter())
        .map(|(stage, ms)| (stage, ms / all.max(f64::MIN_POSITIVE)))
        .collect();
    parts.sort_by(|a, b| b.1.total_cmp(&a.1));
    let told = parts.iter().filter(|(_, share)| *share >= 0.005);
    let told: Vec<String> = told
        .map(|(stage, share)| format!("{stage} {}", format::percent(*share)))
        .collect();
    told.join(", ")
}

/// Returns table and plot; nothing where there is one kernel alone.
pub(crate) fn blocks(data: &RunData, scene: &SceneGroup) -> Vec<Block> {
    let times: Vec<&Measured<TimeRecord>> =
        scene.views.iter().flat_map(View::valid_times).collect();
    if times.iter().all(|time| is_single(time)) {
        return Vec::new();
    }
    let views = scene.views.iter();
    let mut values: Vec<Value> = views.flat_map(|view| against_single(scene, view)).collect();
    for time in &times {
        let share = time.query_share().map(Interval::exact);
        let figures = [
            (&figure::MS_PER_SPP, time.ms_per_spp),
            (&figure::RAY_QUERY_SHARE, share),
        ];
        values.extend(Value::known(&time.key, figures));
    }
    let rows = times.iter();
    let rows = rows.map(|time| (time.key.clone(), vec![stages(time).into()]));
    let table = ORGANISATIONS.beside(&data.names, &values, &[], &[":stages"], rows);
    let mut blocks: Vec<Block> = table.into_block().into_iter().collect();
    let stem = format!("organisations-{}", file_stem(scene.name));
    blocks.extend(Block::figures(vec![live(stem, scene)]));
    blocks
}

/// Paths that are alive after each bounce, by integrator: those of every organisation.
fn live(stem: String, scene: &SceneGroup) -> Option<Illustration> {
    let mut curves: Vec<Curve> = Vec::new();
    for time in scene.views.iter().flat_map(View::valid_times) {
        let label = time.key.label(axis::INTEGRATOR).to_owned();
        let is_new = curves.iter().all(|curve| curve.label != label);
        let Some(first) = time.live_paths.first().filter(|_| is_new) else {
            continue;
        };
        let share = |paths: &u64| Interval::exact(*paths as f64 / *first as f64);
        let points = (0u32..).zip(&time.live_paths);
        curves.push(Curve {
            label,
            look: curves.len(),
            exact: true,
            points: points
                .map(|(n, paths)| CurvePoint::new(n.into(), &share(paths)))
                .collect(),
        });
    }
    let plot = CurvePlot::new(
        "bounces before the ray",
        Ticks::Whole,
        "paths that are alive",
        curves,
    );
    let caption = "Share of the paths that send a ray after so many bounces, of the first sampler.";
    plot.figure(stem, caption.to_owned())
}
