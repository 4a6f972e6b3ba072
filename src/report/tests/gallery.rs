//! The page of many devices.

use super::*;
use crate::document::{Block, Tone};
use crate::gallery::{Gallery, Offer};

/// Records of a scene with three structures, of which the second fails its gate and the third has none.
fn of_device(adapter: &str, software: bool, mrays: f64) -> Vec<Line> {
    let mut lines = vec![
        run(),
        structure("cornell-box", "bvh", mrays, 0),
        structure("cornell-box", "kd-tree", 1234.0, 17),
        structure("cornell-box", "octree", 4321.0, 0),
    ];
    if let Body::Run(run) = &mut lines[0].body {
        run.environment.adapter = adapter.to_owned();
        run.environment.software = software;
        run.environment.clock_step_ns = Some(65_536);
        run.environment.browser = Some("A browser".to_owned());
    }
    if let Body::Structure(record) = &mut lines[3].body {
        record.gate = None;
    }
    lines
}

fn offers(all: Vec<Result<Vec<Line>, String>>) -> Vec<Offer> {
    let offer = |(number, lines)| Offer {
        dir: format!("folder-{number}").into(),
        lines,
    };
    all.into_iter().enumerate().map(offer).collect()
}

#[test]
fn a_gallery_has_only_what_passed_and_says_what_it_leaves_out() {
    let gallery = Gallery::new(&offers(vec![
        Ok(of_device("Zeta <GPU>", false, 88.0)),
        Ok(of_device("SwiftShader", true, 3.0)),
        Err("damaged".to_owned()),
        Ok(of_device("Alpha", false, 99.0)),
        Ok(vec![run()]),
        Ok(vec![structure("cornell-box", "bvh", 77.0, 0)]),
    ]));
    let left_out: Vec<String> = gallery.left_out().collect();
    let of = |folder: &str, what: &str| {
        let is_told = |line: &&String| line.starts_with(folder) && line.contains(what);
        left_out.iter().filter(is_told).count()
    };
    for folder in ["folder-0", "folder-1", "folder-3"] {
        assert_eq!(of(folder, "octree: not gated"), 1, "{left_out:#?}");
        assert_eq!(of(folder, "kd-tree: 17 of"), 1, "{left_out:#?}");
    }
    assert_eq!(of("folder-2", "damaged"), 1);
    assert_eq!(of("folder-4", "no structure"), 1);
    assert_eq!(of("folder-5", "what measured it"), 1);
    assert_eq!(left_out.len(), 9, "{left_out:#?}");
    let names: Vec<_> = gallery
        .table()
        .rows
        .iter()
        .map(|row| row[0].text.clone())
        .collect();
    assert_eq!(names, ["Alpha", "Zeta <GPU>", "SwiftShader"]);
    let document = gallery.document();
    assert_eq!(document.subtitle, "3 devices");
    let page = crate::html::page(&document).unwrap();
    assert!(!page.contains("1234") && !page.contains("4321") && !page.contains("1,234"));
    assert!(page.contains("Zeta &lt;GPU&gt;") && page.contains("65,536 ns"));
    let section = |part: &str| {
        let found = document.sections.iter().find(|s| s.title.starts_with(part));
        serde_json::to_string(found.unwrap()).unwrap()
    };
    let (hardware, software) = (
        section("cornell-box"),
        section("software adapters: cornell-box"),
    );
    assert!(hardware.contains("Alpha") && !hardware.contains("SwiftShader"));
    assert!(software.contains("SwiftShader") && !software.contains("Alpha"));
    for part in [&hardware, &software] {
        assert!(
            part.contains("1 of 3 passed") && part.contains("primary: "),
            "{part}"
        );
    }
}

#[test]
fn the_structure_of_the_most_rays_per_second_stands_out() {
    let mut lines = of_device("Alpha", false, 50.0);
    lines.push(structure("cornell-box", "cwbvh", 70.0, 0));
    lines.push(structure("cornell-box", "bvh4", 60.0, 0));
    let document = Gallery::new(&offers(vec![Ok(lines)])).document();
    let section = document
        .sections
        .iter()
        .find(|s| s.id.starts_with("cornell"));
    let tables = section
        .unwrap()
        .blocks
        .iter()
        .filter_map(|block| match block {
            Block::Table(table) => Some(table),
            _ => None,
        });
    let mut good = Vec::new();
    for table in tables {
        let rates = table.columns.iter().zip(&table.rows[0]).skip(3);
        good.extend(rates.filter(|(_, cell)| cell.tone == Tone::Good));
    }
    assert!(!good.is_empty());
    assert!(good.iter().all(|(column, _)| column.title == "cwbvh"));
}

#[test]
fn two_runs_of_a_device_are_one_device() {
    let run = || Ok(of_device("Alpha", false, 99.0));
    let gallery = Gallery::new(&offers(vec![run(), run()]));
    assert_eq!(gallery.document().subtitle, "1 device, 2 runs");
}

#[test]
fn a_gallery_of_nothing_is_empty() {
    let gallery = Gallery::new(&offers(vec![Err("unreadable".to_owned())]));
    assert!(gallery.is_empty());
    assert_eq!(gallery.left_out().count(), 1);
    assert!(
        crate::html::page(&gallery.document())
            .unwrap()
            .contains("unreadable")
    );
}
