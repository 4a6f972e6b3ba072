//! Which structure renders fastest, by the times of whole cells, and where the speeds of ray classes say otherwise.

use super::kernels::is_repeat;
use super::verdict::{class_speed, ray_classes};
use crate::data::{FULL_CELLS, Measured, STRUCTURE_AXES, SceneGroup, View};
use crate::ruling::{Contender, Ruling, judge};
use crate::{format, trust};
use raystone_record::figure::Better;
use raystone_record::{Key, axis};
use raystone_stats::comparison::{LEVEL, LogFigure, Pairs};
use raystone_stats::statistics::LEAST_FOR_MEDIAN;

/// What else of a sampler than its kernels, which are those of the structure.
const POINT_AXES: [&str; 3] = [axis::SEQUENCE, axis::DECORRELATION, axis::OFFSET];

/// A structure that cells of a view were rendered through.
struct Renderer {
    key: Key,
    name: String,
    /// Milliseconds per sample per pixel: geometric mean over the samplers.
    time: LogFigure,
    /// Whether each of its times was taken often enough.
    is_ranked: bool,
}

/// Structures that were timed with the most samplers, and how long each takes with these.
fn renderers(scene: &SceneGroup, view: &View) -> Vec<Renderer> {
    let mut found: Vec<(Key, Vec<Key>, Vec<LogFigure>, bool)> = Vec::new();
    for time in view
        .valid_times()
        .filter(|time| !is_repeat(time, &view.times))
    {
        let Some(log) = time.rounds(FULL_CELLS, &time.ms) else {
            continue;
        };
        let log = log.scaled(1.0 / f64::from(time.spp));
        let key = time.key.only(&STRUCTURE_AXES);
        let points = time.key.only(&POINT_AXES);
        let often = time.ms.len() >= LEAST_FOR_MEDIAN;
        match found.iter_mut().find(|(known, ..)| *known == key) {
            None => found.push((key, vec![points], vec![log], often)),
            Some((_, samplers, logs, all_often)) => {
                samplers.push(points);
                logs.push(log);
                *all_often &= often;
            }
        }
    }
    let most = found.iter().map(|(_, samplers, ..)| samplers.len()).max();
    found.retain(|(_, samplers, ..)| Some(samplers.len()) == most);
    let renderer = |(key, _, logs, is_ranked): (Key, Vec<Key>, Vec<LogFigure>, bool)| {
        let same = |s: &&Measured<_>| s.key.agrees(&key, &STRUCTURE_AXES);
        let structure = scene.structures.iter().find(same);
        let label = key.label(axis::ACCEL);
        Renderer {
            name: structure.map_or(label.to_owned(), |s| s.structure.clone()),
            time: geometric_mean(&logs),
            key,
            is_ranked,
        }
    };
    found.into_iter().map(renderer).collect()
}

fn geometric_mean(logs: &[LogFigure]) -> LogFigure {
    let share = 1.0 / logs.len() as f64;
    let terms: Vec<(&LogFigure, f64)> = logs.iter().map(|log| (log, share)).collect();
    LogFigure::product(&terms)
}

/// Which structure renders fastest.
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

/// A line for each class of rays of which some structure is faster than the one that renders fastest, though it
/// renders slower: both by a test of the difference, corrected for all pairs of the comparison.
pub(crate) fn disagreements(scene: &SceneGroup) -> Vec<String> {
    scene
        .views
        .iter()
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
