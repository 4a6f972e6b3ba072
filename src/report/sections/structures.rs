//! Structures of a scene: speed, build, size, work per ray, heat maps.

use super::file_stem;
use super::trade_off;
use super::verdict::ray_classes;
use crate::data::{Measured, RunData, STRUCTURE_AXES, SceneGroup};
use crate::document::*;
use crate::pivot::{FIGURES_ALONE, Part, Rows};
use crate::plot::rates::{Bar, RatePlot};
use crate::values::{Value, of_structures};
use crate::{format, pictures};
use raystone_core::structure::{Phase, Space};
use raystone_image::viridis_css;
use raystone_record::figure::{self, Figure};
use raystone_record::{RayClass, StructureRecord, axis};
use std::path::Path;

/// Everything on the structures of the scene with this index.
pub fn blocks(dir: &Path, data: &RunData, index: usize, scene: &SceneGroup) -> Vec<Block> {
    if scene.structures.is_empty() {
        return Vec::new();
    }
    let mut blocks = vec![Block::Heading("Structures".into())];
    if let Some(drawing) = rate_plot(data, scene).draw() {
        let name = format!("scene-{index}-{}-rates", file_stem(scene.name));
        let caption = format!(
            "Speed per ray class. Bars: median; lines: {}. The same rays for all.",
            speed_bounds(scene)
        );
        blocks.push(Block::Figures(vec![Illustration::new(
            name, caption, drawing,
        )]));
    }
    let values = of_structures(data, scene);
    let views = scene.views.iter();
    let to_image = views.filter_map(|view| trade_off::time_to_image_table(scene, view, &values));
    let mut costs = vec![build_table(scene, &values)];
    costs.extend(trade_off::break_even_table(scene, &values));
    costs.extend(to_image);
    let shape = built(scene).table(&values, SHAPE, &SHAPE_FIGURES, FIGURES_ALONE);
    let folds = [
        ("Speeds as numbers", vec![speed_table(scene, &values)]),
        ("What a build costs and when it pays", costs),
        (
            "Size, shape and further figures",
            vec![
                shape,
                leaf_table(scene, &values),
                outside_table(data, scene, &values),
            ],
        ),
        (
            "Work per ray and coherence",
            vec![work_table(scene, &values), coherence_table(scene, &values)],
        ),
    ];
    for (title, tables) in folds {
        let tables = tables.into_iter().filter_map(Table::into_block);
        blocks.extend(Block::fold(title, tables.collect()));
    }
    let maps = heat_maps(dir, scene).into_iter().collect();
    blocks.extend(Block::fold("Where rays cost most: heat maps", maps));
    blocks
}

fn speed_bounds(scene: &SceneGroup) -> String {
    let timings = scene.structures.iter().flat_map(|s| &s.timings);
    format::median_bounds(timings.map(|timing| timing.ms.len()))
}

fn rate_plot(data: &RunData, scene: &SceneGroup) -> RatePlot {
    let mut classes = ray_classes(scene);
    if classes.is_empty() {
        // Nothing passed: one group still shows who failed.
        classes.push(RayClass::Primary);
    }
    let bar = |s: &Measured<StructureRecord>, class| {
        let timing = s.timings.iter().find(|timing| timing.class == class);
        let fault = s.fault();
        Bar {
            label: s.structure.clone(),
            look: data.structure_look(&s.structure),
            rate: timing.filter(|_| fault.is_none()).map(|t| t.mrays_s),
            instead: fault.map_or("not timed".into(), |fault| format!("FAILED: {fault}")),
        }
    };
    let group = |class| {
        let bars = scene.structures.iter().map(|s| bar(s, class)).collect();
        (class.name().to_owned(), bars)
    };
    let stamped = data.run.is_none_or(|run| run.environment.timestamps);
    RatePlot {
        clock: if stamped { "GPU clock" } else { "wall clock" },
        groups: classes.into_iter().map(group).collect(),
    }
}

/// Columns by class of rays.
pub(crate) const BY_RAYS: Part<'static> = &|key| key.label(axis::RAYS).to_owned();

/// A row for each of some structures, with a further cell if there is a second head.
fn rows<'a>(
    structures: impl Iterator<Item = &'a Measured<'a, StructureRecord>>,
    heads: &'a [&'a str],
    further: impl Fn(&StructureRecord) -> TableCell,
) -> Rows<'a> {
    let row = |s: &Measured<StructureRecord>| {
        let cells = [s.structure.clone().into(), further(s)];
        let cells = cells.into_iter().take(heads.len());
        (s.key.clone(), cells.collect())
    };
    Rows::new(&STRUCTURE_AXES, heads, structures.map(row))
}

fn all_built<'a>(scene: &'a SceneGroup) -> impl Iterator<Item = &'a Measured<'a, StructureRecord>> {
    scene.structures.iter().filter(|s| s.is_built())
}

fn built<'a>(scene: &'a SceneGroup) -> Rows<'a> {
    rows(all_built(scene), &["structure"], |_| TableCell::default())
}

/// Mrays/s, one row per structure and one column per ray class.
pub(crate) fn speed_table(scene: &SceneGroup, values: &[Value]) -> Table {
    let gate = |s: &StructureRecord| {
        let (verdict, tone) = match s.fault() {
            None => ("passed", Tone::Good),
            Some(_) => ("FAILED", Tone::Bad),
        };
        let judge = match s.space {
            Space::World => "",
            Space::Instances => "judged over instances",
        };
        TableCell::with_detail(verdict, judge).toned(tone)
    };
    let bounds = speed_bounds(scene);
    let caption = format!("Speed on {}, Mrays/s: median [{bounds}]", scene.name);
    let rows = rows(scene.structures.iter(), &["structure", ":gate"], gate);
    rows.table(values, caption, &[&figure::MRAYS_PER_S], BY_RAYS)
}

/// What the build took.
fn build_table(scene: &SceneGroup, values: &[Value]) -> Table {
    let update = match all_built(scene).any(|s| s.update_ms.is_some()) {
        true => "; update: all instances moved, objects kept (median of 5)",
        false => "",
    };
    let phases = |s: &StructureRecord| {
        let phase = |phase: &Phase| format!("{} {}", phase.name, format::number(phase.ms));
        let phases: Vec<String> = s.build.iter().map(phase).collect();
        phases.join(" + ").into()
    };
    let heads = ["structure", ":phases of the build, ms"];
    rows(all_built(scene), &heads, phases).table(
        values,
        format!("Build (one each){update}"),
        &[
            &figure::BUILD_MS,
            &figure::BUILD_RATE,
            &figure::BUILD_PEAK_BYTES,
            &figure::UPDATE_MS,
        ],
        FIGURES_ALONE,
    )
}

/// Size and quality of what was built.
const SHAPE: &str = "Size and shape (nodes, leaves: cells where there are cells; SAH and end-point overlap with \
                     both constants 1)";
const SHAPE_FIGURES: [&Figure; 9] = [
    &figure::BYTES,
    &figure::BYTES_PER_TRIANGLE,
    &figure::NODES,
    &figure::LEAVES,
    &figure::REFERENCES,
    &figure::REFERENCES_PER_TRIANGLE,
    &figure::DEPTH,
    &figure::SAH_COST,
    &figure::EPO,
];

/// Figures that this program does not measure itself.
pub(crate) fn outside_table(data: &RunData, scene: &SceneGroup, values: &[Value]) -> Table {
    let from_outside = data.run.iter().flat_map(|run| &run.figures);
    let figures: Vec<&Figure> = from_outside.collect();
    let caption = format!("Further figures on {}", scene.name);
    built(scene).table(values, caption, &figures, FIGURES_ALONE)
}

/// Leaves by the references they hold.
fn leaf_table(scene: &SceneGroup, values: &[Value]) -> Table {
    let with_leaves = all_built(scene).filter(|s| s.stats.leaf_histogram.iter().any(|n| *n > 0));
    rows(with_leaves, &["structure"], |_| TableCell::default()).table(
        values,
        "Leaves (or cells) by the number of references they hold, share",
        &[&figure::LEAF_SHARE],
        &|key| key.label(axis::SUBJECT).to_owned(),
    )
}

/// A row for each class of rays and each of the structures that were timed with it.
fn class_rows<'a>(scene: &'a SceneGroup, by: &'a [&'a str]) -> Rows<'a> {
    let passed = || scene.structures.iter().filter(|s| s.fault().is_none());
    let rows = ray_classes(scene).into_iter().flat_map(|class| {
        let timed = passed().filter(move |s| s.timings.iter().any(|t| t.class == class));
        timed.map(move |s| {
            let class = class.name();
            let key = s.key.clone().with(axis::RAYS, class);
            (key, vec![class.into(), s.structure.clone().into()])
        })
    });
    Rows::new(by, &["class", ":structure"], rows)
}

/// Coherence of the recorded rays, by the model.
fn coherence_table(scene: &SceneGroup, values: &[Value]) -> Table {
    let by = [&[axis::RAYS], &STRUCTURE_AXES[..]].concat();
    let Some(modelled) = scene.structures.iter().find_map(|s| s.coherence.as_ref()) else {
        return Table::default();
    };
    let s = &modelled.settings;
    let caption = format!(
        "Coherence of the recorded rays, by a model on the host: warps of {} rays that follow each other, {} in each of {} groups",
        s.warp[0] * s.warp[1],
        s.warps,
        s.groups,
    );
    let figures = [
        &figure::SIMT_EFFICIENCY,
        &figure::LINES_PER_ISSUE,
        &figure::L1_HITS,
        &figure::ISSUES_PER_RAY,
        &figure::L2_BYTES_PER_RAY,
        &figure::CYCLES_PER_RAY,
    ];
    class_rows(scene, &by).table(values, caption, &figures, FIGURES_ALONE)
}

/// Counted work per ray.
fn work_table(scene: &SceneGroup, values: &[Value]) -> Table {
    let by = [&[axis::RAYS], &STRUCTURE_AXES[..]].concat();
    class_rows(scene, &by).table(
        values,
        "Counted work per ray (means over a class, from a separate run)",
        &[
            &figure::RAYS,
            &figure::HIT_SHARE,
            &figure::UNLIKE_SHADOW,
            &figure::NODES_PER_RAY,
            &figure::BOX_TESTS_PER_RAY,
            &figure::TRIANGLE_TESTS_PER_RAY,
            &figure::DEEPEST_STACK,
        ],
        FIGURES_ALONE,
    )
}

fn heat_maps(dir: &Path, scene: &SceneGroup) -> Option<Block> {
    let mapped: Vec<_> = (scene.structures.iter())
        .filter_map(|s| Some((s, s.body.heat_map.as_deref()?)))
        .collect();
    let maxima: Vec<f64> = mapped.iter().filter_map(|(s, _)| s.heat_map_max).collect();
    let shared = maxima
        .first()
        .filter(|top| maxima.iter().all(|max| max == *top));
    let picture = |(s, path): &(&Measured<StructureRecord>, &str)| {
        let mut caption = s.structure.clone();
        if let Some(max) = s.heat_map_max.filter(|_| shared.is_none()) {
            caption += &format!(" (top of scale {})", format::number(max));
        }
        if s.fault().is_some() {
            caption += ": FAILED";
        }
        let alt = format!(
            "Heat map of {}: steps of each primary ray through {}",
            scene.name, s.structure
        );
        pictures::load(dir, path, caption).described(alt)
    };
    let items: Vec<Picture> = mapped.iter().map(picture).collect();
    let label = |share: f64| match shared {
        Some(top) => format::number(top * share),
        None => format::percent(share),
    };
    let scale = (!maxima.is_empty()).then(|| ColorScale {
        gradient: viridis_css(),
        title: match shared {
            Some(_) => "nodes + triangle tests per primary ray; the same scale for all; what costs more has the top colour".into(),
            None => "nodes + triangle tests per primary ray, share of each map's own top".into(),
        },
        labels: [0.0, 0.25, 0.5, 0.75, 1.0].map(label).to_vec(),
    });
    Block::gallery("Traversal cost of primary rays", items, scale)
}
