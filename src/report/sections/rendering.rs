//! The fastest structure for rendering, by the times of whole cells, and contradictions by the speeds of ray classes.

use super::kernels::is_repeat;
use super::verdict::{class_speed, ray_classes};
use crate::data::{FULL_CELLS, Measured, STRUCTURE_AXES, SceneGroup, View, grouped};
use crate::ruling::{Contender, Ruling, judge};
use crate::{format, trust};
use raystone_record::figure::Better;
use raystone_record::{Key, TimeRecord, axis};
use raystone_stats::comparison::{LEVEL, LogFigure, Pairs};
use raystone_stats::statistics::LEAST_FOR_MEDIAN;

/// A structure that cells of a view were rendered through.
struct Renderer {
    key: Key,
    name: String,
    /// Milliseconds per sample per pixel: geometric mean over the samplers.
    time: LogFigure,
    /// True if each of its times was measured often enough.
    is_ranked: bool,
}

/// Returns the structures that were timed with the most samplers, with their times.
fn renderers(scene: &SceneGroup, view: &View) -> Vec<Renderer> {
    let times = view.valid_times();
    let times = times.filter(|time| !is_repeat(time, &view.times));
    let timed = times.filter_map(|time| Some((time, time.rounds(FULL_CELLS, &time.ms)?)));
    let mut found = grouped(timed, |(time, _)| time.key.only(&STRUCTURE_AXES));
    let most = found.iter().map(|(_, times)| times.len()).max();
    found.retain(|(_, times)| Some(times.len()) == most);
    let renderer = |(key, times): (Key, Vec<(&Measured<TimeRecord>, LogFigure)>)| {
        let same = |s: &&Measured<_>| s.key.agrees(&key, &STRUCTURE_AXES);
        let structure = scene.structures.iter().find(same);
        let label = key.label(axis::ACCEL);
        let per_spp = times
            .iter()
            .map(|(time, log)| log.scaled(1.0 / f64::from(time.spp)));
        Renderer {
            name: structure.map_or(label.to_owned(), |s| s.structure.clone()),
            time: geometric_mean(&per_spp.collect::<Vec<_>>()),
            is_ranked: times
                .iter()
                .all(|(time, _)| time.ms.len() >= LEAST_FOR_MEDIAN),
            key,
        }
    };
    found.into_iter().map(renderer).collect()
}

fn geometric_mean(logs: &[LogFigure]) -> LogFigure {
    let share = 1.0 / logs.len() as f64;
    let terms: Vec<(&LogFigure, f64)> = logs.iter().map(|log| (log, share)).collect();
    LogFigure::product(&terms)
}

/// Returns the ruling on the fastest structure for rendering.
pub(crate) fn fastest(scene: &SceneGroup, view: &View) -> Ruling {
    if let Some(reason) = trust::doubt_of_rendering(scene, view) {
        return Ruling::Withheld(reason);
    }
    let contender = |renderer: Renderer| Contender {
        name: renderer.name,
        figure: renderer.time.interval(),
        log: Some(renderer.time).filter(|_| renderer.is_ranked),
    };
    let all = renderers(scene, view).into_iter().map(contender).collect();
    judge(all, Better::Lower)
}

/// Returns a line for each class of rays of which some structure is faster than the one that renders fastest, though
/// it renders slower: both by a test of the difference, corrected for all pairs of the comparison.
pub(crate) fn disagreements(scene: &SceneGroup) -> Vec<String> {
    let views = scene.views.iter();
    views
        .flat_map(|view| disagreements_of(scene, view))
        .collect()
}

fn disagreements_of(scene: &SceneGroup, view: &View) -> Vec<String> {
    let mut ranked = renderers(scene, view);
    ranked.retain(|renderer| renderer.is_ranked);
    let times: Vec<&LogFigure> = ranked.iter().map(|r| &r.time).collect();
    let renders = Pairs::of(&times);
    let Some(best) = renders.least() else {
        return Vec::new();
    };
    let mut lines = Vec::new();
    for class in ray_classes(scene) {
        let speed_of = |renderer: &Renderer| {
            let same = |s: &&Measured<_>| s.key.agrees(&renderer.key, &STRUCTURE_AXES);
            class_speed(scene.structures.iter().find(same)?, class)
        };
        let speeds: Vec<Option<LogFigure>> = ranked.iter().map(speed_of).collect();
        let Some(speed_of_best) = &speeds[best] else {
            continue;
        };
        let compared = speeds.iter().flatten().count();
        let pairs = (compared * compared.saturating_sub(1) / 2).max(1) as f64;
        for (other, speed) in speeds.iter().enumerate() {
            let Some(speed) = speed.as_ref().filter(|_| other != best) else {
                continue;
            };
            let faster = speed.compared_with(speed_of_best);
            let times_as_long = renders.log_ratio(other, best);
            let slower = renders.differ(best, other) && times_as_long > 0.0;
            if slower && faster.log_ratio > 0.0 && faster.p * pairs <= LEVEL {
                lines.push(format!(
                    "{}, {}: {} renders fastest, but {} rays rank {} before it ({}× as fast), which takes {}× the time \
                     to render; where rendering matters, go by the times of rendering",
                    scene.name,
                    view.name,
                    ranked[best].name,
                    class.name(),
                    ranked[other].name,
                    format::number(faster.log_ratio.exp()),
                    format::number(times_as_long.exp()),
                ));
            }
        }
    }
    lines
}
