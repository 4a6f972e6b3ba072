//! Whole pages as text, compared with the committed ones. `RAYSTONE_WRITE_PAGES=1` writes them anew; read the
//! difference before you commit it.

use super::*;
use crate::document::{Block, Illustration, Table, TableCell, Tone};
use crate::plot::drawing::Shape;
use crate::repro::claim::{Context, judge};
use crate::repro::table::Reproduced;
use serde_json::json;

/// Returns the page and the terminal's tables.
fn page(lines: &[Line]) -> String {
    let document = sections::document(Path::new("no such folder"), &RunData::new(lines), &[]);
    of_document(&document) + "\n# Terminal\n" + &terminal_tables(lines)
}

/// Returns the text of tables of theses from the committed records.
fn thesis(names: [&str; 2]) -> String {
    let reproduced = repro::chosen(&names.map(str::to_owned)).unwrap();
    let reproduced = reproduced.iter().map(|source| {
        let (lines, thesis) = (recorded(source.name), source.thesis().unwrap());
        let (data, mut context) = (RunData::new(&lines), Context::default());
        context.software = true;
        let pattern = |scene: &String| format!("*{}*", scene.rsplit('/').next().unwrap());
        context.scenes.extend(thesis.substitutes.iter().map(|s| {
            let ours = s.scene.as_ref().map(pattern).ok_or(s.why.clone());
            (s.original.clone(), ours)
        }));
        let placed = context.scenes.iter().cloned().zip(&thesis.substitutes);
        let placed = placed.map(|((_, ours), s)| (s.clone(), ours.map(|name| (name, Some(36)))));
        let (scenes, found) = (placed.collect(), values::values(&data));
        let claims = thesis
            .expects
            .iter()
            .map(|expect| judge(expect, &found, &context));
        Reproduced {
            name: source.name,
            environment: data.run.map(|run| run.environment.clone()),
            started: 0,
            quick: false,
            changes: vec!["run.replicates=4".into()],
            figures: Vec::new(),
            scenes,
            claims: claims.collect(),
            thesis,
        }
    });
    let reproduced: Vec<Reproduced> = reproduced.collect();
    let failed = [("made".to_owned(), "no scene".to_owned())];
    of_document(&repro::page::document(
        &reproduced,
        &failed,
        &repro::not_covered().unwrap(),
    ))
}

fn of_document(document: &Document) -> String {
    let mut text = format!("{}\n{}\n", document.title, document.subtitle);
    for banner in &document.banners {
        text += &format!("{:?}: {}\n", banner.tone, banner.text);
    }
    for section in &document.sections {
        text += &format!("\n# {} ({})\n", section.title, section.id);
        let blocks: String = section.blocks.iter().map(block).collect();
        // Every figure of every cell, all of which are in tables, too.
        match section.id.as_str() {
            "cells" => text += &format!("{} lines, {}\n", blocks.lines().count(), hash(&blocks)),
            _ => text += &blocks,
        }
    }
    text
}

fn block(block: &Block) -> String {
    match block {
        Block::Heading(text) => format!("## {text}\n"),
        Block::Paragraph(text) => format!("{text}\n"),
        Block::Checks(checks) => checks.iter().map(|check| check.line()).collect(),
        Block::Table(table) => of_table(table),
        Block::Figures(figures) => figures.iter().map(of_plot).collect(),
        Block::Gallery(gallery) => {
            let picture =
                |p: &document::Picture| format!("{}: {} ({})\n", p.path, p.caption, p.alt);
            let pictures: String = gallery.items.iter().map(picture).collect();
            let scale = gallery.scale.iter();
            let scale = scale.map(|s| format!("{}: {}\n", s.title, s.labels.join(" ")));
            format!(
                "gallery: {}\n{pictures}{}",
                gallery.caption,
                scale.collect::<String>()
            )
        }
        Block::Verbatim(text) => format!("{text}\n"),
        Block::Fold(fold) => {
            let inside: String = fold.blocks.iter().map(self::block).collect();
            format!("> {} {}\n{inside}<\n", fold.title, fold.note)
        }
        Block::Beside(beside) => {
            let pictures = beside.pictures.iter();
            let pictures = pictures.map(|p| format!("{}: {}\n", p.path, p.caption));
            let blocks = beside.blocks.iter().map(self::block);
            pictures.chain(blocks).collect()
        }
        Block::Terms(terms) => {
            let words: Vec<&str> = terms.iter().map(|term| term.word).collect();
            format!("terms: {}\n", words.join(", "))
        }
        Block::Comparer(comparer) => format!("{}: {}\n", comparer.caption, comparer.note),
    }
}

fn of_table(table: &Table) -> String {
    let head = |c: &document::Column| format!("{}{}", if c.text { ":" } else { "" }, c.title);
    let heads: Vec<String> = table.columns.iter().map(head).collect();
    let cell = |cell: &TableCell| {
        let tone = match cell.tone {
            Tone::Plain => "",
            Tone::Good => "+",
            Tone::Bad => "!",
            Tone::Note => "?",
        };
        let link = if cell.link.is_empty() { "" } else { " #" };
        format!("{tone}{}{link}", cell.flat())
    };
    let row = |row: &Vec<TableCell>| row.iter().map(cell).collect::<Vec<_>>().join(" | ") + "\n";
    let rows: String = table.rows.iter().map(row).collect();
    format!("table: {}\n{}\n{rows}", table.caption, heads.join(" | "))
}

/// Returns the description, the texts, the number of shapes, and the tooltips of a plot.
fn of_plot(figure: &Illustration) -> String {
    let drawing = &figure.drawing;
    let text = |shape: &Shape| match shape {
        Shape::Text { text, .. } => Some(text.clone()),
        _ => None,
    };
    let texts: Vec<String> = drawing.shapes.iter().filter_map(text).collect();
    let spots: String = drawing
        .spots
        .iter()
        .map(|spot| spot.text.clone() + "\n")
        .collect();
    format!(
        "plot {}: {}\n{}\n{} shapes, {} spots {}\n{}\n",
        figure.name,
        figure.caption,
        figure.alt,
        drawing.shapes.len(),
        drawing.spots.len(),
        hash(&spots),
        texts.join(" | ")
    )
}

fn hash(text: &str) -> String {
    blake3::hash(text.as_bytes()).to_hex()[..12].to_owned()
}

/// Returns lines that [`full_run`] lacks: frames, peers, orders of passes, rasterised paths, organisations.
fn further() -> Vec<Line> {
    let scene = (axis::SCENE, "cornell-box");
    let structure = [scene, (axis::ACCEL, "bvh")];
    let cost =
        |ms: f64| json!({ "processor_ms": jittered(ms), "wall_ms": jittered(ms), "passes_ms": [] });
    let counters = |nodes: f64| json!({ "nodes": nodes, "box_tests": 80.0, "triangle_tests": 5.3, "stack_high_water": 12 });
    let frame = |i: u32| {
        let worse = 1.0 + 0.2 * f64::from(i);
        let rays = |class: &str| {
            json!({
                "class": class, "rays": 32_768, "counters": [counters(40.0 * worse), counters(40.0)],
                "cost": [cost(6.0 * worse), cost(6.0)],
            })
        };
        json!({
            "frame": i, "judged": 65_536, "refit": cost(1.5), "refit_on_host": cost(4.0), "rebuild": cost(31.0),
            "sah": [61.2 * worse, 61.2], "classes": [rays("primary"), rays("bounce")],
        })
    };
    let settings = json!({ "motion": "deform", "frames": 3, "amplitude": 0.05, "wavelength": 1.0 });
    let animated = |accel: &str, failure: Option<&str>| {
        let frames: Vec<_> = (0..3).map(frame).collect();
        let body = json!({
            "kind": "animation", "settings": settings, "triangles": 36, "frames": frames, "failure": failure,
        });
        line(&[scene, (axis::ACCEL, accel)], body)
    };
    let timing = |class: &str| {
        json!({
            "class": class, "rays": 32_768, "wall_ms": jittered(3.0), "cpu_ms": jittered(6.0),
            "mrays_s": around(10.9, 0.03), "unlike": 3, "judged": 3, "farthest": 1.2e-6,
        })
    };
    let peer = |name: &str, absent: Option<&str>| {
        let timings = ["primary", "shadow", "ao", "bounce"].map(timing);
        let timings = if absent.is_some() {
            vec![]
        } else {
            timings.to_vec()
        };
        let body = json!({
            "kind": "peer", "about": "version 4", "build_ms": 3.25, "timings": timings, "absent": absent,
        });
        line(&[scene, (axis::PEER, name)], body)
    };
    let order = |order: &str, passes: u32| {
        json!({
            "order": order, "passes": passes, "ms_per_spp": around(6.0 + f64::from(passes), 0.02),
            "first_picture_ms": around(9.0 / f64::from(passes), 0.02),
        })
    };
    let organised = |organisation: &str| {
        let body = json!({
            "kind": "time", "resolution": [192, 144], "spp": 4, "ms": jittered(30.0), "wall_ms": vec![11.0; 7],
            "ms_per_spp": around(7.5, 0.02), "rays": { "primary": 110_592 }, "mrays_s": around(3.0, 0.02),
            "image_hash": "0", "image_equal": true, "live_paths": [110_592, 60_000, 20_000, 5_000],
            "stages": { "generate": 3.0, "extend": 14.0, "shade": 9.0, "connect": 4.0, "sort": 0.1 },
            "orders": [order("one-pass", 1), order("tiles", 4)],
            "primary": {
                "pixels": 27_648, "other_triangle": 3, "other_value": 5, "unexplained": 0, "mean_difference": 1.5e-6,
                "rms_difference": 2.5e-5, "raster_ms": around(0.5, 0.02), "traced_ms": around(2.5, 0.02),
            },
        });
        let mut line = sampled(["cornell-box", "path"], &SAMPLERS[0], body);
        line.key = line
            .key
            .with(axis::ACCEL, "bvh")
            .with(axis::ORGANISATION, organisation);
        line
    };
    let measured = line(
        &structure,
        json!({ "kind": "measured", "measurement": "memory" }),
    );
    let readings = [(&figure::NS_PER_SAMPLE, 2.5), (&figure::LOOP_NS, 7.5)];
    let readings = readings.map(|(figure, value)| Reading::new(figure, Interval::exact(value)));
    let mut lines = vec![
        animated("bvh", None),
        animated("roped-bvh", Some("frame 3: 5 rays differ")),
        peer("embree", None),
        peer("obvhs", Some("no library")),
        measured.with_readings(readings.into()),
    ];
    lines.extend(["single-kernel", "wavefront"].map(organised));
    lines
}

fn recorded(name: &str) -> Vec<Line> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = root.join("results/llvmpipe/thesis").join(name);
    read_records(&folder).unwrap().lines
}

/// Returns the records of one scene, and those without a scene.
fn of_scene(name: &str, scene: &str) -> Vec<Line> {
    let mut lines = recorded(name);
    lines.retain(|line| ["", scene].contains(&line.key.label(axis::SCENE)));
    lines
}

#[test]
fn pages_say_what_they_said() {
    let quick = [full_run(), further()].concat();
    let pages = [
        ("quick", quick),
        ("structures", recorded("dufay-h16-kd-tree")),
        ("samplers", recorded("dufay-table-5-1")),
        ("compaction", recorded("roger-stream-reduction")),
        ("coherence", of_scene("nilsson-table-5-3", "cornell-box")),
    ];
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/pages");
    let theses = thesis(["dufay-table-5-1", "nilsson-table-5-3"]);
    let pages = pages.map(|(name, lines)| (name, page(&lines)));
    for (name, text) in pages.into_iter().chain([("thesis", theses)]) {
        let path = folder.join(name).with_extension("txt");
        if std::env::var_os("RAYSTONE_WRITE_PAGES").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        let known = std::fs::read_to_string(&path).unwrap();
        let differs = known.lines().zip(text.lines()).find(|(a, b)| a != b);
        assert_eq!(differs, None, "{name}");
        assert!(known == text, "{name} is longer or shorter");
    }
}
