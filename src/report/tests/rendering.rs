//! The structure that renders fastest is found by rendering.

use super::*;
use sections::rendering::{disagreements, fastest as renders_fastest};
use sections::samplers::further_table;
use sections::spectrum;

const VIEW: [&str; 2] = ["room", "path"];

/// Returns structures with speeds of rays and times of rendering, relative.
fn lines(structures: &[(&str, f64, f64)]) -> Vec<Line> {
    let of_rays = structures
        .iter()
        .map(|(name, mrays, _)| structure(VIEW[0], name, *mrays, 0));
    let of_cells: Vec<(&str, f64)> = structures
        .iter()
        .map(|(name, _, ms)| (*name, *ms))
        .collect();
    of_rays.chain(times(VIEW, &of_cells)).collect()
}

#[test]
fn rendering_decides_and_a_class_of_rays_that_says_otherwise_is_warned_of() {
    let said = |structures: &[(&str, f64, f64)]| {
        let lines = lines(structures);
        let data = RunData::new(&lines);
        let scene = &data.scenes[0];
        let ruling = renders_fastest(scene, &scene.views[0]);
        let shown = terminal_tables(&lines);
        assert!(shown.contains("fastest for rendering: path"), "{shown}");
        let warned = disagreements(scene);
        assert_eq!(shown.contains("warning: room, path: "), !warned.is_empty());
        (ruling.answer(), warned)
    };
    // Rays and rendering agree.
    let (answer, warned) = said(&[("bvh", 5.0, 1.0), ("grid", 2.0, 1.6)]);
    assert_eq!((&*answer, warned.len()), ("bvh", 0));
    // They do not: each class of rays ranks the slower renderer first.
    let (answer, warned) = said(&[("bvh", 2.0, 1.0), ("grid", 5.0, 1.6)]);
    assert_eq!((&*answer, warned.len()), ("bvh", CLASSES.len()));
    assert!(
        warned[0].contains("bvh renders fastest") && warned[0].contains("rank grid before it"),
        "{warned:?}"
    );
    // No difference beyond the noise, in one or in the other.
    let (answer, warned) = said(&[("bvh", 2.0, 1.0), ("grid", 5.0, 1.001)]);
    assert!(
        answer.starts_with("undecided") && warned.is_empty(),
        "{answer} {warned:?}"
    );
    let (answer, warned) = said(&[("bvh", 5.0, 1.0), ("grid", 5.02, 1.6)]);
    assert_eq!((&*answer, warned.len()), ("bvh", 0));
}

#[test]
fn samplers_are_compared_per_second_under_the_fastest_structure_that_was_timed_with_most_of_them() {
    let view = ["cornell-box", "path"];
    let of_others = small_run().into_iter().filter(|line| {
        let is_time = matches!(line.body, Body::Time(_));
        !is_time
    });
    let mut lines: Vec<Line> = of_others.collect();
    lines.extend(times(
        view,
        &[("slow", 2.0), ("fast", 0.8), ("slowest", 3.0)],
    ));
    let one_sampler = times(view, &[("fastest", 0.1)]).swap_remove(0);
    lines.push(one_sampler);
    let data = RunData::new(&lines);
    let found = path_view(&data).fastest_structure();
    assert_eq!(found.as_deref(), Some("fast"));
}

/// Returns captions of the last errors and of the spectra, and the spp column of each, where Sobol' points end with so many.
fn ended_with(end: u32) -> [(String, Vec<String>); 2] {
    let mut lines = small_run();
    for line in &mut lines {
        let stops = line.key.label(axis::SEQUENCE) == "sobol";
        match &mut line.body {
            Body::Error(record) => {
                record.errors.retain(|at| !stops || at.spp <= end);
                for at in &mut record.errors {
                    at.metrics.insert("mae/v1".to_owned(), 0.25);
                }
            }
            Body::Spectrum(record) if stops => record.spp = end,
            _ => {}
        }
    }
    let data = RunData::new(&lines);
    let view = path_view(&data);
    let values = values::of_view(&data, &data.scenes[0], view);
    let tables = [
        further_table(&data.names, view, &values),
        spectrum::table(&data, view, &values),
    ];
    tables.map(|table| {
        assert_eq!(table.rows.len(), SAMPLERS.len(), "{}", table.caption);
        let place = table.columns.iter().position(|c| c.title == "spp");
        let of_row = |row: &Vec<document::TableCell>| Some(row[place?].text.clone());
        (
            table.caption.clone(),
            table.rows.iter().filter_map(of_row).collect(),
        )
    })
}

#[test]
fn a_table_of_last_errors_says_with_how_many_samples_each_sampler_ended() {
    for (caption, column) in ended_with(32) {
        assert!(caption.contains("with path at 32 spp"), "{caption}");
        assert!(column.is_empty(), "{column:?}");
    }
    for (caption, column) in ended_with(8) {
        assert!(caption.contains("that each ended with"), "{caption}");
        assert_eq!(column, ["32", "32", "32", "8", "8"], "{caption}");
    }
}

/// Returns the tables among blocks, folded ones too.
fn tables_in(blocks: &[document::Block]) -> Vec<&document::Table> {
    let mut tables = Vec::new();
    for block in blocks {
        match block {
            document::Block::Table(table) => tables.push(table),
            document::Block::Fold(fold) => tables.extend(tables_in(&fold.blocks)),
            _ => {}
        }
    }
    tables
}

#[test]
fn a_table_of_discrepancies_without_room_for_all_counts_keeps_the_largest() {
    for counts in [8, 9, 12, 17] {
        let lines = changed(|_, body| {
            if let Body::Stream(record) = body {
                let first = record.star[0];
                let at = |k: usize| FigureAtCount { n: 4 << k, ..first };
                record.star = (0..counts).map(at).collect();
            }
        });
        let data = RunData::new(&lines);
        let section = sections::streams::section(&data).unwrap();
        let tables = tables_in(&section.blocks);
        let star = tables
            .iter()
            .find(|t| t.caption.starts_with("D*, star discrepancy of"));
        let star = star.unwrap_or_else(|| panic!("{counts} counts"));
        let titles: Vec<&str> = star.columns.iter().map(|c| c.title.as_str()).collect();
        let last = titles.last().unwrap().replace(',', "");
        assert!(
            last.ends_with(&(4 << (counts - 1)).to_string()),
            "{titles:?}"
        );
        assert!((4..=8 + 2).contains(&titles.len()), "{titles:?}");
    }
}
