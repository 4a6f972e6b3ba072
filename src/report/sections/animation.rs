//! Updates of structures from frame to frame of a moving scene, against full builds.

use super::specs::{FRAME_PLOTS, FRAME_RAYS, TREES};
use crate::data::{Measured, RunData, SceneGroup};
use crate::document::*;
use crate::format;
use crate::values::{Estimate, Value};
use raystone_config::{Animation, Motion};
use raystone_record::figure;
use raystone_record::{AnimationRecord, FrameRays, FrameRecord, Interval, Key, RayClass, axis};
use raystone_stats::statistics::median_interval;

type Animated<'a> = Measured<'a, AnimationRecord>;

/// Returns the blocks of a scene: heading, introduction, plots and tables.
pub fn blocks(data: &RunData, stem: &str, scene: &SceneGroup) -> Vec<Block> {
    let Some(first) = scene.animations.first() else {
        return Vec::new();
    };
    let values = values(data, scene);
    let bounds = bounds(data, scene);
    let tables = [TREES, FRAME_RAYS].map(|table| table.table(&data.names, &values, &[&bounds]));
    let mut blocks = vec![
        Block::Heading("In motion".into()),
        Block::Paragraph(introduction(&first.settings)),
    ];
    blocks.extend(plots(data, stem, scene, &values));
    let tables = tables.into_iter().filter_map(Table::into_block).collect();
    blocks.extend(Block::fold("Frames as numbers", tables));
    blocks
}

fn introduction(settings: &Animation) -> String {
    let radii = |x: f64| format!("{} radii of the scene", format::number(x));
    let motion = match settings.motion {
        Motion::Deform => format!(
            "Every vertex moves in a wave (amplitude {}, wavelength {}) that travels by one wavelength from the first \
             frame to the last",
            radii(settings.amplitude),
            radii(settings.wavelength)
        ),
        Motion::Instances => format!(
            "Every instance moves straight on in a direction of its own, by {} until the last frame",
            radii(settings.amplitude)
        ),
    };
    format!(
        "{motion}. Refitted: the first frame's tree with new boxes, fitted on the device (a tree refitted on the host is \
         equal to the bit), or new transforms under what was built over the objects. Rebuilt: by the structure's own \
         builder. Each frame has a reference tracer of its own, whose rays both answer as it does, to the bit. Costs are those of the \
         tree alone, transfers included; the layout is the same for both."
    )
}

/// Returns the class of rays that curves show: those that leave surfaces, where there are any.
fn shown(frame: &FrameRecord) -> &'static str {
    let classes = || frame.classes.iter().map(|rays| rays.class);
    let bounce = classes().find(|class| *class == RayClass::Bounce);
    bounce.or(classes().next()).map_or("", RayClass::name)
}

fn plots(data: &RunData, stem: &str, scene: &SceneGroup, values: &[Value]) -> Option<Block> {
    let first = scene.animations.iter().find_map(|cell| cell.frames.first());
    let rays = ["", first.map_or("", shown)];
    let is_shown = |v: &&Value| rays.contains(&v.key.label(axis::RAYS));
    let values: Vec<Value> = values.iter().filter(is_shown).cloned().collect();
    Block::figures(
        FRAME_PLOTS.map(|plot| plot.figure(data, &values, stem, &[&bounds(data, scene)])),
    )
}

/// Describes the bounds of what updates and builds cost.
pub(crate) fn bounds(data: &RunData, scene: &SceneGroup) -> String {
    let frames = scene.animations.iter().flat_map(|cell| &cell.frames);
    let costs = frames.flat_map(|frame| [&frame.refit, &frame.rebuild]);
    format::median_bounds(costs.map(|cost| cost.ms(is_software(data)).len()))
}

fn is_software(data: &RunData) -> bool {
    data.run.is_some_and(|run| run.environment.software)
}

fn sah_ratio(frame: &FrameRecord) -> Option<f64> {
    let [refitted, rebuilt] = frame.sah;
    Some(refitted? / rebuilt?)
}

fn nodes_ratio(rays: &FrameRays) -> Option<f64> {
    let [refitted, rebuilt] = rays.counters;
    Some(refitted?.nodes / rebuilt?.nodes)
}

/// Returns the quotient of the times of rays, round by round.
fn time_ratio(rays: &FrameRays, software: bool) -> Option<Interval> {
    let [refitted, rebuilt] = [0, 1].map(|place| rays.cost[place].ms(software));
    let ratios = refitted.iter().zip(rebuilt).map(|(a, b)| a / b);
    median_interval(&ratios.collect::<Vec<_>>())
}

/// Returns the number of million rays of the class in the frame from which a rebuild pays: its additional cost over the
/// saving per ray. A word if it costs no more (`few`: and its rays are slower, so that many rays pay for the refit), or if
/// the interval of the saving is not above 0.
fn break_even(frame: &FrameRecord, rays: &FrameRays, software: bool) -> Option<Estimate> {
    let of = |ms: &[f64]| median_interval(ms).map(|i| i.value);
    let more = of(frame.rebuild.ms(software))? - of(frame.refit.ms(software))?;
    let [refitted, rebuilt] = [0, 1].map(|place| rays.cost[place].ms(software));
    let differences: Vec<f64> = refitted.iter().zip(rebuilt).map(|(a, b)| a - b).collect();
    let saved = median_interval(&differences)?;
    if more <= 0.0 {
        let is_slower = saved.high < 0.0;
        return Some(Estimate::Word(if is_slower { "few" } else { "any" }));
    }
    if saved.high <= 0.0 {
        return Some(Estimate::Word("none"));
    }
    if saved.low <= 0.0 {
        return Some(Estimate::Word("unresolved"));
    }
    let million_rays = rays.rays as f64 * 1e-6;
    Some(Estimate::from(million_rays * more / saved.value))
}

/// Returns the key of a frame.
fn key_of(cell: &Animated, frame: &FrameRecord) -> Key {
    (cell.key.clone()).with(axis::SUBJECT, format!("frame {}", frame.frame))
}

/// Returns every figure of the animations of a scene.
pub fn values(data: &RunData, scene: &SceneGroup) -> Vec<Value<'static>> {
    let software = is_software(data);
    let mut values = Vec::new();
    for cell in &scene.animations {
        for frame in &cell.frames {
            let key = key_of(cell, frame);
            let ms = |cost: &raystone_record::Cost| median_interval(cost.ms(software));
            let on_host = frame.refit_on_host.as_ref();
            let costs = [
                (&figure::FRAME_REFIT_MS, ms(&frame.refit)),
                (&figure::FRAME_REFIT_HOST_MS, on_host.and_then(ms)),
                (&figure::FRAME_REBUILD_MS, ms(&frame.rebuild)),
            ];
            let trees = [
                (&figure::FRAME_SAH_REFITTED, frame.sah[0]),
                (&figure::FRAME_SAH_REBUILT, frame.sah[1]),
                (&figure::FRAME_SAH_RATIO, sah_ratio(frame)),
            ];
            values.extend(Value::known(&key, trees));
            values.extend(Value::known(&key, costs));
            values.push(Value::new(&key, &figure::FRAME_JUDGED, frame.judged as f64));
            for rays in &frame.classes {
                let key = key.clone().with(axis::RAYS, rays.class.name());
                let read = [
                    (
                        &figure::FRAME_NODES_RATIO,
                        nodes_ratio(rays).map(Estimate::from),
                    ),
                    (
                        &figure::FRAME_TIME_RATIO,
                        time_ratio(rays, software).map(Estimate::from),
                    ),
                    (&figure::FRAME_BREAK_EVEN, break_even(frame, rays, software)),
                ];
                values.extend(Value::known(&key, read));
            }
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::Cost;

    fn cost(ms: &[f64]) -> Cost {
        Cost {
            wall_ms: ms.to_vec(),
            ..Cost::default()
        }
    }

    /// Rounds of a million rays in the refitted tree and in the one that was built anew, which cost 2 ms and so many.
    fn rays_until(built_ms: f64, [refitted, rebuilt]: [[f64; 7]; 2]) -> Option<Estimate> {
        let frame = FrameRecord {
            frame: 0,
            judged: 1,
            refit: cost(&[2.0; 7]),
            refit_on_host: None,
            rebuild: cost(&[built_ms; 7]),
            sah: [None; 2],
            classes: Vec::new(),
        };
        let rays = FrameRays {
            class: RayClass::Bounce,
            rays: 1_000_000,
            counters: [None; 2],
            cost: [cost(&refitted), cost(&rebuilt)],
        };
        break_even(&frame, &rays, false)
    }

    #[test]
    fn a_rebuilt_tree_pays_after_the_rays_that_save_its_build_never_or_nobody_knows() {
        // 10 ms more, 2 ms less for each million rays: after five million.
        let Some(Estimate::Known(found)) = rays_until(12.0, [[6.0; 7], [4.0; 7]]) else {
            panic!("no number");
        };
        assert!((found.value - 5.0).abs() < 1e-9, "{found:?}");
        let slower = rays_until(12.0, [[4.0; 7], [6.0; 7]]);
        assert!(matches!(slower, Some(Estimate::Word("none"))));
        // Faster in most rounds, but not in all that the interval of the median holds.
        let noisy = [3.0, 5.0, 3.9, 5.1, 4.6, 3.5, 5.2];
        let unclear = rays_until(12.0, [noisy, [4.0; 7]]);
        assert!(matches!(unclear, Some(Estimate::Word("unresolved"))));
        // Building anew costs less: at once, or until the faster rays of the refitted tree make up for it.
        let faster = rays_until(1.0, [[6.0; 7], [4.0; 7]]);
        assert!(matches!(faster, Some(Estimate::Word("any"))));
        let slower = rays_until(1.0, [[4.0; 7], [6.0; 7]]);
        assert!(matches!(slower, Some(Estimate::Word("few"))));
    }
}
