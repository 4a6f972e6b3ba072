//! Taking structures over from frame to frame of a moving scene, against building them anew.

use crate::data::{Measured, RunData, SceneGroup};
use crate::document::*;
use crate::format;
use crate::pivot::{FIGURES_ALONE, Rows};
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::values::{Reading, Value};
use raystone_config::{Animation, Motion};
use raystone_record::figure;
use raystone_record::{AnimationRecord, FrameRays, FrameRecord, Interval, Key, RayClass, axis};
use raystone_stats::statistics::median_interval;

/// What tells rows apart.
const ROWS: [&str; 3] = [axis::ACCEL, axis::KERNELS, axis::SUBJECT];

type Animated<'a> = Measured<'a, AnimationRecord>;

/// What the tables of a scene begin with, its plots and tables.
pub fn blocks(data: &RunData, stem: &str, scene: &SceneGroup) -> Vec<Block> {
    let Some(first) = scene.animations.first() else {
        return Vec::new();
    };
    let values = values(data, scene);
    let mut blocks = vec![
        Block::Heading("In motion".into()),
        Block::Paragraph(introduction(&first.settings)),
    ];
    blocks.extend(Block::figures(plots(data, stem, scene)));
    blocks.extend(failures_table(scene).into_block());
    let tables = [costs_table(scene, &values), rays_table(scene, &values)];
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
         builder. Each frame has a judge of its own, whose rays both answer as it does, to the bit. Costs are those of the \
         tree alone, transfers included; the layout is the same for both."
    )
}

/// The class of rays that curves show: those that leave surfaces, where there are any.
fn shown(frame: &FrameRecord) -> Option<&FrameRays> {
    let bounce = |rays: &&FrameRays| rays.class == RayClass::Bounce;
    let classes = &frame.classes;
    classes.iter().find(bounce).or(classes.first())
}

fn plots(data: &RunData, stem: &str, scene: &SceneGroup) -> Vec<Option<Illustration>> {
    let software = is_software(data);
    let curve =
        |cell: &Animated, what: &str, exact, y: &dyn Fn(&FrameRecord) -> Option<Interval>| {
            let frames = cell.frames.iter();
            let point = |f: &FrameRecord| Some(CurvePoint::new(f64::from(f.frame), &y(f)?));
            Curve {
                label: format!("{}{what}", cell.structure),
                look: data.structure_look(&cell.structure),
                exact,
                points: frames.filter_map(point).collect(),
            }
        };
    let figure = |name: &str, y_title: &str, caption: &str, curves: Vec<Curve>| {
        let plot = CurvePlot {
            x_title: "frame".into(),
            x_ticks: Ticks::Whole,
            y_title: y_title.into(),
            curves: curves
                .into_iter()
                .filter(|c| !c.points.is_empty())
                .collect(),
            guides: Vec::new(),
        };
        plot.figure(format!("{stem}-animation-{name}"), caption)
    };
    let all = |y: &dyn Fn(&FrameRecord) -> Option<Interval>| -> Vec<Curve> {
        let cells = scene.animations.iter();
        cells.map(|cell| curve(cell, "", false, y)).collect()
    };
    let costs = scene.animations.iter().flat_map(|cell| {
        let ms = |f: &FrameRecord| median_interval(f.refit.ms(software));
        let anew = |f: &FrameRecord| median_interval(f.rebuild.ms(software));
        [
            curve(cell, ", refitted", false, &ms),
            curve(cell, ", rebuilt", true, &anew),
        ]
    });
    vec![
        figure(
            "sah",
            "SAH, refitted over rebuilt",
            "SAH cost of the refitted tree over that of the tree built anew, frame by frame.",
            all(&|frame| sah_ratio(frame).map(Interval::exact)),
        ),
        figure(
            "cost",
            "cost of a frame, ms",
            "What refitting (full lines) and building anew (dashed) cost in each frame, median with 95 % interval.",
            costs.collect(),
        ),
        figure(
            "nodes",
            "nodes per ray, refitted over rebuilt",
            "Nodes that a bounce ray (where there are none: the first class) visits in the refitted tree, over those in \
             the tree built anew.",
            all(&|frame| nodes_ratio(shown(frame)?).map(Interval::exact)),
        ),
    ]
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

/// The quotient of the times of rays, round by round.
fn time_ratio(rays: &FrameRays, software: bool) -> Option<Interval> {
    let [refitted, rebuilt] = [0, 1].map(|place| rays.cost[place].ms(software));
    let ratios = refitted.iter().zip(rebuilt).map(|(a, b)| a / b);
    median_interval(&ratios.collect::<Vec<_>>())
}

/// From how many million rays of the class in the frame on building anew pays: what it costs more, over what a ray costs
/// less. No number where the interval
/// of the difference holds 0.
fn break_even(frame: &FrameRecord, rays: &FrameRays, software: bool) -> Option<Reading> {
    let of = |ms: &[f64]| median_interval(ms).map(|i| i.value);
    let more = of(frame.rebuild.ms(software))? - of(frame.refit.ms(software))?;
    let [refitted, rebuilt] = [0, 1].map(|place| rays.cost[place].ms(software));
    let differences: Vec<f64> = refitted.iter().zip(rebuilt).map(|(a, b)| a - b).collect();
    let saved = median_interval(&differences)?;
    if more <= 0.0 {
        return Some(Reading::Word("any"));
    }
    if saved.high <= 0.0 {
        return Some(Reading::Word("none"));
    }
    if saved.low <= 0.0 {
        return Some(Reading::Word("unresolved"));
    }
    let million_rays = rays.rays as f64 * 1e-6;
    Some(Reading::from(million_rays * more / saved.value))
}

/// The key of a frame.
fn key_of(cell: &Animated, frame: &FrameRecord) -> Key {
    (cell.key.clone()).with(axis::SUBJECT, format!("frame {}", frame.frame))
}

/// Every figure of the animations of a scene.
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
                        nodes_ratio(rays).map(Reading::from),
                    ),
                    (
                        &figure::FRAME_TIME_RATIO,
                        time_ratio(rays, software).map(Reading::from),
                    ),
                    (&figure::FRAME_BREAK_EVEN, break_even(frame, rays, software)),
                ];
                values.extend(Value::known(&key, read));
            }
        }
    }
    values
}

const HEADS: [&str; 2] = ["structure", ":frame"];

fn rows<'a>(scene: &SceneGroup) -> Rows<'a> {
    let of_cell = |cell: &Animated| {
        let row = |frame: &FrameRecord| {
            let cells = vec![
                cell.structure.clone().into(),
                frame.frame.to_string().into(),
            ];
            (key_of(cell, frame), cells)
        };
        cell.frames.iter().map(row).collect::<Vec<_>>()
    };
    Rows::new(&ROWS, &HEADS, scene.animations.iter().flat_map(of_cell))
}

/// Trees and what they cost.
pub(crate) fn costs_table(scene: &SceneGroup, values: &[Value]) -> Table {
    let of_trees: Vec<Value> = (values.iter().filter(|v| v.key.label(axis::RAYS).is_empty()))
        .cloned()
        .collect();
    rows(scene).table(
        &of_trees,
        "Trees frame by frame: SAH cost, and what refitting and building anew cost (median [95 % interval]); rays of each \
         gate",
        &[
            &figure::FRAME_SAH_REFITTED,
            &figure::FRAME_SAH_REBUILT,
            &figure::FRAME_SAH_RATIO,
            &figure::FRAME_REFIT_MS,
            &figure::FRAME_REFIT_HOST_MS,
            &figure::FRAME_REBUILD_MS,
            &figure::FRAME_JUDGED,
        ],
        FIGURES_ALONE,
    )
}

/// Rays through both.
fn rays_table(scene: &SceneGroup, values: &[Value]) -> Table {
    rows(scene).table(
        values,
        "Rays frame by frame: nodes visited and time in the refitted tree over those in the tree built anew, and from how \
         many million rays of a class on building anew pays in that frame (none: its rays are slower; unresolved: \
         the interval of the difference holds 0; any: it costs no more)",
        &[
            &figure::FRAME_NODES_RATIO,
            &figure::FRAME_TIME_RATIO,
            &figure::FRAME_BREAK_EVEN,
        ],
        &|key| key.label(axis::RAYS).to_owned(),
    )
}

/// What failed.
fn failures_table(scene: &SceneGroup) -> Table {
    let mut table = Table::new("Animations that failed", &["structure", ":fault"]);
    for cell in &scene.animations {
        if let Some(fault) = &cell.failure {
            let fault = TableCell::from(fault.clone()).toned(Tone::Bad);
            table.rows.push(vec![cell.structure.clone().into(), fault]);
        }
    }
    table
}
