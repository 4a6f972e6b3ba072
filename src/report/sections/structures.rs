//! Structures of a scene: speed, build, size, work per ray, heat maps.

use super::file_stem;
use super::trade_off;
use super::verdict::ray_classes;
use crate::accel::Space;
use crate::image::viridis_css;
use crate::measure::record::{RayClass, Recorded, StructureRecord};
use crate::report::data::{RunData, SceneGroup, structure_name};
use crate::report::document::*;
use crate::report::plot::rates::{Bar, RatePlot};
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
    let mut tables = vec![speed_table(scene)];
    tables.extend(trade_off::break_even_table(scene, &classes));
    let views = scene.views.iter();
    tables.extend(views.filter_map(|view| trade_off::time_to_image_table(scene, view)));
    tables.extend([build_table, shape_table, leaf_table, work_table].map(|table| table(scene)));
    blocks.extend(tables.into_iter().filter_map(Table::into_block));
    blocks.extend(heat_maps(dir, scene));
    blocks
}

fn speed_bounds(scene: &SceneGroup) -> String {
    let timings = scene.structures.iter().flat_map(|s| &s.timings);
    format::median_bounds(timings.map(|timing| timing.ms.len()))
}

fn name(structure: &Recorded<StructureRecord>) -> String {
    structure_name(*structure)
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
    let bar = |s: &Recorded<StructureRecord>, class| {
        let timing = s.timings.iter().find(|timing| timing.class == class);
        let fault = s.fault();
        Bar {
            label: name(s),
            look: data.structure_look(&name(s)),
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

/// Mrays/s, one row per structure and one column per ray class.
pub fn speed_table(scene: &SceneGroup) -> Table {
    let caption = format!(
        "Speed on {}, Mrays/s: median [{}]",
        scene.name,
        speed_bounds(scene)
    );
    let mut table = Table::new(caption, &["structure", ":gate"]);
    let classes = ray_classes(scene);
    classes
        .iter()
        .for_each(|&class| table.add_column(format::ray_class(class)));
    for s in &scene.structures {
        let fault = s.fault();
        let verdict = if fault.is_none() { "passed" } else { "FAILED" };
        let judge = match s.space {
            Space::World => "",
            Space::Instances => "judged over instances",
        };
        let tone = if fault.is_none() {
            Tone::Good
        } else {
            Tone::Bad
        };
        let mut row = vec![
            name(s).into(),
            Cell::with_detail(verdict, judge).toned(tone),
        ];
        row.extend(classes.iter().map(|&class| {
            let timing = s
                .timings
                .iter()
                .find(|t| t.class == class)
                .filter(|_| fault.is_none());
            timing.map_or_else(
                || format::ABSENT.into(),
                |t| Cell::with_detail(format::number(t.mrays_s.value), format::bounds(&t.mrays_s)),
            )
        }));
        table.rows.push(row);
    }
    table
}

/// What the build took.
fn build_table(scene: &SceneGroup) -> Table {
    let columns = ["structure", "build, ms", ":of which, ms", "peak memory"];
    let mut table = Table::new("Build (one each)", &columns);
    let updated = built(scene).any(|s| s.update_ms.is_some());
    if updated {
        table.caption += "; update: all instances moved, objects kept (median of 5)";
        table.add_column("update, ms");
    }
    for s in built(scene) {
        let phases: Vec<String> = s
            .build
            .iter()
            .map(|phase| format!("{} {}", phase.name, format::number(phase.ms)))
            .collect();
        let mut row = vec![
            name(s).into(),
            format::number(s.build_ms).into(),
            phases.join(" + ").into(),
            s.build_peak_bytes
                .map_or(format::ABSENT.into(), format::bytes)
                .into(),
        ];
        row.extend(updated.then(|| format::optional(s.update_ms).into()));
        table.rows.push(row);
    }
    table
}

fn built<'a>(scene: &'a SceneGroup) -> impl Iterator<Item = &'a Recorded<'a, StructureRecord>> {
    let is_built = |s: &&Recorded<StructureRecord>| !s.build.is_empty() || s.gate.is_some();
    scene.structures.iter().filter(is_built)
}

fn triangles(scene: &SceneGroup) -> Option<f64> {
    let triangles = scene.record?.triangles;
    (triangles > 0).then_some(triangles as f64)
}

/// Size and quality of what was built.
fn shape_table(scene: &SceneGroup) -> Table {
    let columns = [
        "structure",
        "size",
        "bytes/triangle",
        "nodes",
        "leaves",
        "references",
        "references/triangle",
        "depth",
        "SAH cost",
        "EPO",
    ];
    let caption = "Size and shape (nodes, leaves: cells where there are cells; SAH and end-point overlap with both \
                   constants 1)";
    let mut table = Table::new(caption, &columns);
    for s in built(scene) {
        let stats = &s.stats;
        let per_triangle = |x: u64| format::optional(triangles(scene).map(|n| x as f64 / n));
        table.rows.push(vec![
            name(s).into(),
            format::bytes(stats.bytes).into(),
            per_triangle(stats.bytes).into(),
            format::count(stats.nodes).into(),
            format::count(stats.leaves).into(),
            format::count(stats.references).into(),
            per_triangle(stats.references).into(),
            stats
                .depth
                .map_or(format::ABSENT.into(), |depth| depth.to_string())
                .into(),
            format::optional(stats.sah_cost).into(),
            format::optional(stats.epo).into(),
        ]);
    }
    table
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
        let mut row = vec![name(s).into()];
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
fn work_table(scene: &SceneGroup) -> Table {
    let columns = [
        "structure",
        ":rays",
        "number",
        "hit",
        "nodes/ray",
        "box tests/ray",
        "triangle tests/ray",
        "deepest stack",
    ];
    let mut table = Table::new(
        "Counted work per ray (means over a class, from a separate run)",
        &columns,
    );
    for s in scene.structures.iter().filter(|s| s.fault().is_none()) {
        for timing in &s.timings {
            let counters = &timing.counters;
            table.rows.push(vec![
                name(s).into(),
                format::ray_class(timing.class).into(),
                format::count(timing.rays as u64).into(),
                format::percent(timing.hit_fraction).into(),
                format::number(counters.nodes).into(),
                format::number(counters.box_tests).into(),
                format::number(counters.triangle_tests).into(),
                counters.stack_high_water.to_string().into(),
            ]);
        }
    }
    table
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
                Some(max) => format!("{} (top of scale {})", name(s), format::number(max)),
                None => name(s),
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
