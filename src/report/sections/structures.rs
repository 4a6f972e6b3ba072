//! Structures of a scene: speed, build, size, work per ray, heat maps.

use super::file_stem;
use super::trade_off;
use super::verdict::ray_classes;
use crate::accel::{Phase, Space};
use crate::image::viridis_css;
use crate::measure::record::{RayClass, StructureRecord, axis};
use crate::report::data::{Measured, RunData, SceneGroup};
use crate::report::document::*;
use crate::report::pivot::Pivot;
use crate::report::plot::rates::{Bar, RatePlot};
use crate::report::values::{Value, of_structures};
use crate::report::{format, pictures};
use std::path::Path;

/// Everything on the structures of the scene with this index.
pub fn blocks(dir: &Path, data: &RunData, index: usize, scene: &SceneGroup) -> Vec<Block> {
    let mut blocks = Vec::new();
    if scene.structures.is_empty() {
        return blocks;
    }
    blocks.push(Block::Heading("Structures".into()));
    if let Some(drawing) = rate_plot(data, scene).draw() {
        let name = format!("scene-{index}-{}-rates", file_stem(scene.name));
        let caption = format!(
            "Speed per ray class. Bars: median; lines: {}. The same rays for all.",
            speed_bounds(scene)
        );
        blocks.push(Block::Figures(vec![Figure::new(name, caption, drawing)]));
    }
    let classes = ray_classes(scene);
    let values = of_structures(data, scene);
    let mut tables = vec![speed_table(data, scene, &values)];
    tables.extend(trade_off::break_even_table(scene, &classes));
    let views = scene.views.iter();
    tables.extend(views.filter_map(|view| trade_off::time_to_image_table(scene, view)));
    tables.extend([
        build_table(data, scene, &values),
        shape_table(data, scene, &values),
        outside_table(data, scene, &values),
        leaf_table(scene),
        work_table(data, scene, &values),
    ]);
    blocks.extend(tables.into_iter().filter_map(Table::into_block));
    blocks.extend(heat_maps(dir, scene));
    blocks
}

fn speed_bounds(scene: &SceneGroup) -> String {
    let timings = scene.structures.iter().flat_map(|s| &s.timings);
    format::median_bounds(timings.map(|timing| timing.ms.len()))
}

/// What stands where a structure has no figure.
fn word_instead(structure: &StructureRecord) -> &'static str {
    if structure.fault().is_some() {
        "FAILED"
    } else {
        "not timed"
    }
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
            rate: timing
                .filter(|_| fault.is_none())
                .map(|timing| timing.mrays_s),
            instead: fault.map_or("not timed".into(), |fault| format!("FAILED: {fault}")),
        }
    };
    let group = |class| {
        let bars = scene.structures.iter().map(|s| bar(s, class)).collect();
        (format::ray_class(class).to_owned(), bars)
    };
    let stamped = data.run.is_none_or(|run| run.environment.timestamps);
    RatePlot {
        clock: if stamped { "GPU clock" } else { "wall clock" },
        groups: classes.into_iter().map(group).collect(),
    }
}

/// A row for each of some structures.
fn rows<'a>(
    structures: impl Iterator<Item = &'a Measured<'a, StructureRecord>>,
) -> Vec<(String, Vec<Cell>)> {
    structures
        .map(|s| (s.structure.clone(), vec![s.structure.clone().into()]))
        .collect()
}

/// Mrays/s, one row per structure and one column per ray class.
pub fn speed_table(data: &RunData, scene: &SceneGroup, values: &[Value]) -> Table {
    let row = |s: &Measured<StructureRecord>| {
        let (verdict, tone) = match s.fault() {
            None => ("passed", Tone::Good),
            Some(_) => ("FAILED", Tone::Bad),
        };
        let judge = match s.space {
            Space::World => "",
            Space::Instances => "judged over instances",
        };
        let gate = Cell::with_detail(verdict, judge).toned(tone);
        (s.structure.clone(), vec![s.structure.clone().into(), gate])
    };
    Pivot {
        caption: format!(
            "Speed on {}, Mrays/s: median [{}]",
            scene.name,
            speed_bounds(scene)
        ),
        heads: &["structure", ":gate"],
        rows: scene.structures.iter().map(row).collect(),
        row: &|key| data.names.structure(key),
        figures: &["mrays-per-s/v1"],
        across: Some(&|key| key.label(axis::RAYS).to_owned()),
    }
    .table(values)
}

/// What the build took.
fn build_table(data: &RunData, scene: &SceneGroup, values: &[Value]) -> Table {
    let updated = built(scene).any(|s| s.update_ms.is_some());
    let update = match updated {
        true => "; update: all instances moved, objects kept (median of 5)",
        false => "",
    };
    let row = |s: &Measured<StructureRecord>| {
        let phase = |phase: &Phase| format!("{} {}", phase.name, format::number(phase.ms));
        let phases: Vec<String> = s.build.iter().map(phase).collect();
        (
            s.structure.clone(),
            vec![s.structure.clone().into(), phases.join(" + ").into()],
        )
    };
    Pivot {
        caption: format!("Build (one each){update}"),
        heads: &["structure", ":phases of the build, ms"],
        rows: built(scene).map(row).collect(),
        row: &|key| data.names.structure(key),
        figures: &["build-ms/v1", "build-peak-bytes/v1", "update-ms/v1"],
        across: None,
    }
    .table(values)
}

fn built<'a>(scene: &'a SceneGroup) -> impl Iterator<Item = &'a Measured<'a, StructureRecord>> {
    scene.structures.iter().filter(|s| s.is_built())
}

/// Size and quality of what was built.
fn shape_table(data: &RunData, scene: &SceneGroup, values: &[Value]) -> Table {
    Pivot {
        caption: "Size and shape (nodes, leaves: cells where there are cells; SAH and end-point overlap with both \
                  constants 1)"
            .into(),
        heads: &["structure"],
        rows: rows(built(scene)),
        row: &|key| data.names.structure(key),
        figures: &[
            "bytes/v1",
            "bytes-per-triangle/v1",
            "nodes/v1",
            "leaves/v1",
            "references/v1",
            "references-per-triangle/v1",
            "depth/v1",
            "sah-cost/v1",
            "epo/v1",
        ],
        across: None,
    }
    .table(values)
}

/// Figures that this program does not measure itself.
pub fn outside_table(data: &RunData, scene: &SceneGroup, values: &[Value]) -> Table {
    let from_outside = data.run.iter().flat_map(|run| &run.figures);
    let ids: Vec<&str> = from_outside.map(|figure| &*figure.id).collect();
    Pivot {
        caption: format!("Further figures on {}", scene.name),
        heads: &["structure"],
        rows: rows(built(scene)),
        row: &|key| data.names.structure(key),
        figures: &ids,
        across: None,
    }
    .table(values)
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

/// Histogram of leaves by the references they hold.
fn leaf_table(scene: &SceneGroup) -> Table {
    let mut table = Table::new(
        "Leaves (or cells) by the number of references they hold, share",
        &["structure"],
    );
    for (title, ..) in LEAF_CLASSES {
        table.add_column(title);
    }
    for s in built(scene) {
        let histogram = &s.stats.leaf_histogram;
        let all: u64 = histogram.iter().sum();
        if all == 0 {
            continue;
        }
        let mut row = vec![s.structure.clone().into()];
        row.extend(LEAF_CLASSES.map(|(_, least, greatest)| {
            let inside = |(k, n): (usize, &u64)| (least <= k && k <= greatest).then_some(*n);
            let leaves: u64 = histogram.iter().enumerate().filter_map(inside).sum();
            if leaves == 0 {
                return format::ABSENT.into();
            }
            Cell::from(format::percent(leaves as f64 / all as f64))
        }));
        table.rows.push(row);
    }
    table
}

/// Counted work per ray.
fn work_table(data: &RunData, scene: &SceneGroup, values: &[Value]) -> Table {
    let passed = scene.structures.iter().filter(|s| s.fault().is_none());
    let rows = passed.flat_map(|s| {
        s.body.timings.iter().map(|timing| {
            let class = format::ray_class(timing.class);
            let cells = vec![s.structure.clone().into(), class.into()];
            (format!("{} {class}", s.structure), cells)
        })
    });
    Pivot {
        caption: "Counted work per ray (means over a class, from a separate run)".into(),
        heads: &["structure", ":rays"],
        rows: rows.collect(),
        row: &|key| format!("{} {}", data.names.structure(key), key.label(axis::RAYS)),
        figures: &[
            "rays/v1",
            "hit-share/v1",
            "nodes-per-ray/v1",
            "box-tests-per-ray/v1",
            "triangle-tests-per-ray/v1",
            "deepest-stack/v1",
        ],
        across: None,
    }
    .table(values)
}

fn heat_maps(dir: &Path, scene: &SceneGroup) -> Option<Block> {
    let mapped = || {
        scene
            .structures
            .iter()
            .filter_map(|s| Some((s, s.body.heat_map.as_deref()?)))
    };
    let maxima: Vec<f64> = mapped().filter_map(|(s, _)| s.heat_map_max).collect();
    let top = maxima.first().copied();
    let shared = maxima.iter().all(|max| Some(*max) == top);
    let items: Vec<Picture> = mapped()
        .map(|(s, path)| {
            let caption = match s.heat_map_max.filter(|_| !shared) {
                Some(max) => format!("{} (top of scale {})", s.structure, format::number(max)),
                None => s.structure.clone(),
            };
            let caption = if s.fault().is_some() {
                format!("{caption}: {}", word_instead(s))
            } else {
                caption
            };
            pictures::load(dir, path, caption)
        })
        .collect();
    let label = |share: f64| match top.filter(|_| shared) {
        Some(top) => format::number(top * share),
        None => format::percent(share),
    };
    let scale = (!maxima.is_empty()).then(|| ColorScale {
        gradient: viridis_css(),
        title: "nodes + triangle tests per primary ray".into(),
        labels: [0.0, 0.25, 0.5, 0.75, 1.0].map(label).to_vec(),
    });
    let caption = "Traversal cost of primary rays".into();
    (!items.is_empty()).then_some(Block::Gallery(Gallery {
        caption,
        items,
        scale,
    }))
}
