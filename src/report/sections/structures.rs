//! Structures of a scene: speed, build, size, work per ray, heat maps.

use super::file_stem;
use super::specs::{BUILD, LEAF_SIZES, OUTSIDE, RECORDED_RAYS, SHAPE, SPEED, WORK};
use super::trade_off;
use super::verdict::ray_classes;
use crate::advice;
use crate::data::{Measured, RunData, SceneGroup};
use crate::document::*;
use crate::names::Names;
use crate::plot::rates::{Bar, RatePlot};
use crate::spec::TableSpec;
use crate::values::{Value, of_structures};
use crate::{format, pictures};
use raystone_core::structure::{Phase, Space};
use raystone_image::viridis_css;
use raystone_record::figure::Figure;
use raystone_record::{RayClass, StructureRecord};
use std::path::Path;

/// Returns everything on the structures of the scene with this index.
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
    let names = &data.names;
    let views = scene.views.iter();
    let to_image = views.map(|view| trade_off::time_to_image_table(names, scene, view, &values));
    let costs = [
        build_table(names, scene, &values),
        trade_off::break_even_table(names, scene, &values),
    ];
    let folds = [
        (
            "Speeds as numbers",
            vec![speed_table(names, scene, &values)],
        ),
        (
            "What a build costs and when it pays",
            (costs.into_iter().chain(to_image))
                .chain([advice::table(data, scene)])
                .collect(),
        ),
        (
            "Size, shape and further figures",
            vec![
                SHAPE.table(names, &values, &[]),
                LEAF_SIZES.table(names, &values, &[]),
                outside_table(data, scene, &values),
            ],
        ),
        (
            "Work per ray and coherence",
            vec![
                WORK.table(names, &values, &[]),
                coherence_table(names, scene, &values),
            ],
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

/// Returns the table of Mrays/s, one row per structure and one column per ray class.
pub(crate) fn speed_table(names: &Names, scene: &SceneGroup, values: &[Value]) -> Table {
    let gate = |s: &StructureRecord| {
        let (verdict, tone) = match s.fault() {
            None => ("passed", Tone::Good),
            Some(_) => ("FAILED", Tone::Bad),
        };
        let judge = match s.space {
            Space::World => "",
            Space::Instances => "checked over instances",
        };
        TableCell::with_detail(verdict, judge).toned(tone)
    };
    let rows = scene
        .structures
        .iter()
        .map(|s| (s.key.clone(), vec![gate(s.body)]));
    let words = [scene.name, &speed_bounds(scene)];
    SPEED.beside(names, values, &words, &[":gate"], rows)
}

/// Returns the table of the cost of builds.
fn build_table(names: &Names, scene: &SceneGroup, values: &[Value]) -> Table {
    let built = || scene.structures.iter().filter(|s| s.is_built());
    let update = match built().any(|s| s.update_ms.is_some()) {
        true => "; update: all instances moved, objects kept (median of 5)",
        false => "",
    };
    let phases = |s: &StructureRecord| {
        let phase = |phase: &Phase| format!("{} {}", phase.name, format::number(phase.ms));
        let phases: Vec<String> = s.build.iter().map(phase).collect();
        phases.join(" + ").into()
    };
    let rows = built().map(|s| (s.key.clone(), vec![phases(s.body)]));
    BUILD.beside(
        names,
        values,
        &[update],
        &[":phases of the build, ms"],
        rows,
    )
}

/// Returns the table of figures that this program does not measure itself.
pub(crate) fn outside_table(data: &RunData, scene: &SceneGroup, values: &[Value]) -> Table {
    let from_outside = data.run.iter().flat_map(|run| &run.figures);
    let figures: Vec<&Figure> = from_outside.collect();
    let table = TableSpec {
        figures: &figures,
        ..OUTSIDE
    };
    table.table(&data.names, values, &[scene.name])
}

/// Returns the table of the recorded rays' coherence, by the model.
fn coherence_table(names: &Names, scene: &SceneGroup, values: &[Value]) -> Table {
    let Some(modelled) = scene.structures.iter().find_map(|s| s.coherence.as_ref()) else {
        return Table::default();
    };
    let s = &modelled.settings;
    let words = [s.warp[0] * s.warp[1], s.warps, s.groups].map(|n| n.to_string());
    RECORDED_RAYS.table(names, values, &words.each_ref().map(String::as_str))
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
