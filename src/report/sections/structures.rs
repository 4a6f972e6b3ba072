//! Structures of a scene: speed, build, size, work per ray, heat maps.

use super::file_stem;
use super::specs::{BUILD, EXACTNESS, LEAF_SIZES, OUTSIDE, RECORDED_RAYS, SHAPE, SPEED, WORK};
use super::trade_off;
use super::verdict::ray_classes;
use crate::advice;
use crate::data::{Measured, RunData, STRUCTURE_AXES, SceneGroup};
use crate::document::*;
use crate::names::Names;
use crate::plot::rates::{Bar, RatePlot};
use crate::spec::TableSpec;
use crate::values::{Value, of_structures};
use crate::{format, pictures};
use raystone_core::structure::{Phase, Space};
use raystone_image::viridis_css;
use raystone_record::figure::{self, Figure};
use raystone_record::{ClassTiming, RayClass, StructureRecord, axis};
use raystone_stats::comparison::LogFigure;
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
            vec![
                speed_table(names, scene, &values),
                EXACTNESS.table(names, &prices(scene), &[]),
            ],
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
                leaf_table(names, &values),
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

/// Returns the table of leaves by size, the classes of sizes in their order whichever structure has them first.
fn leaf_table(names: &Names, values: &[Value]) -> Table {
    let mut table = LEAF_SIZES.table(names, values, &[]);
    // The least number of references of the class; columns before the classes have none, and stay in front.
    let class = |title: &str| -> Option<u32> {
        title
            .split(|c: char| !c.is_ascii_digit())
            .next()?
            .parse()
            .ok()
    };
    let mut order: Vec<usize> = (0..table.columns.len()).collect();
    order.sort_by_key(|&at| class(&table.columns[at].title));
    table.columns = order.iter().map(|&at| table.columns[at].clone()).collect();
    for row in &mut table.rows {
        *row = order.iter().map(|&at| row[at].clone()).collect();
    }
    table
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
            None if s.is_inexact() => ("passed up to rounding", Tone::Note),
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

/// Returns what exactness costs each structure that was also timed with a triangle test that is not exact: the ratio of times of
/// the processors where they trace, else of those by the clock.
pub(crate) fn prices(scene: &SceneGroup) -> Vec<Value<'static>> {
    let timed = || scene.structures.iter().filter(|s| s.fault().is_none());
    let price = |exact: &ClassTiming, bare: &ClassTiming| {
        let of = |t: &ClassTiming| {
            if t.cpu_ms.is_empty() {
                LogFigure::of_times(&t.ms)
            } else {
                LogFigure::of_times(&t.cpu_ms)
            }
        };
        Some(of(exact)?.compared_with(&of(bare)?).ratio)
    };
    let of_pair = |exact: &Measured<StructureRecord>, bare: &Measured<StructureRecord>| {
        let pairs = exact.timings.iter().filter_map(|of| {
            let same = |other: &&ClassTiming| other.class == of.class && other.rays == of.rays;
            Some((of, bare.timings.iter().find(same)?))
        });
        let values = pairs.flat_map(|(exact_rays, bare_rays)| {
            let key = (exact.key.clone()).with(axis::RAYS, exact_rays.class.name());
            Value::known(
                &key,
                [(&figure::PRICE_OF_EXACTNESS, price(exact_rays, bare_rays))],
            )
        });
        values.collect::<Vec<_>>()
    };
    let bare = || timed().filter(|s| s.is_inexact());
    let but_for_the_test = STRUCTURE_AXES
        .iter()
        .filter(|axis| **axis != axis::TRIANGLE);
    let axes: Vec<&str> = but_for_the_test.copied().collect();
    (timed().filter(|s| !s.is_inexact()))
        .flat_map(|exact| {
            let rival = bare().find(|s| s.key.agrees(&exact.key, &axes));
            rival.map_or_else(Vec::new, |rival| of_pair(exact, rival))
        })
        .collect()
}

/// Returns the table of the cost of builds.
fn build_table(names: &Names, scene: &SceneGroup, values: &[Value]) -> Table {
    let built = || scene.structures.iter().filter(|s| s.is_built());
    let update = if built().any(|s| s.update_ms.is_some()) {
        "; update: all instances moved, objects kept (median of 5)"
    } else {
        ""
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
    let words = [
        (s.warp[0] * s.warp[1]).to_string(),
        s.warps.to_string(),
        format::plural(s.groups as usize, "group"),
    ];
    RECORDED_RAYS.table(names, values, &words.each_ref().map(String::as_str))
}

fn heat_maps(dir: &Path, scene: &SceneGroup) -> Option<Block> {
    let mapped: Vec<_> = (scene.structures.iter())
        .filter_map(|s| Some((s, s.body.heat_map.as_deref()?)))
        .collect();
    let maxima: Vec<f64> = mapped.iter().filter_map(|(s, _)| s.heat_map_max).collect();
    let shared = shared_top(&maxima);
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
    let scale = color_scale(&maxima);
    Block::gallery("Traversal cost of primary rays", items, scale)
}

/// The top of the colour scale, if all maps have the same.
fn shared_top(maxima: &[f64]) -> Option<f64> {
    let first = *maxima.first()?;
    maxima.iter().all(|max| *max == first).then_some(first)
}

/// The scale below heat maps with these tops.
pub(crate) fn color_scale(maxima: &[f64]) -> Option<ColorScale> {
    let shared = shared_top(maxima);
    let label = |share: f64| match shared {
        Some(top) => format::number(top * share),
        None => format::percent(share),
    };
    (!maxima.is_empty()).then(|| ColorScale {
        gradient: viridis_css(),
        title: match shared {
            Some(_) => "nodes + triangle tests per primary ray; the same scale for all; what costs more has the top colour".into(),
            None => "nodes + triangle tests per primary ray, share of each map's own top".into(),
        },
        labels: [0.0, 0.25, 0.5, 0.75, 1.0].map(label).to_vec(),
    })
}
