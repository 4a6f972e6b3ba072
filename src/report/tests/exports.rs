//! Exports of records that were resumed, merged or made with every clock.

use super::*;
use crate::export::select::Selection;
use crate::export::{ExportError, FORMATS, Source, Writer};
use raystone_image::{FileFormat, Image, read_linear};
use raystone_record::figure;
use serde_json::Value as Json;

fn chosen(only: &[&str]) -> Result<Selection, ExportError> {
    let only: Vec<String> = only.iter().map(|text| (*text).to_owned()).collect();
    Selection::new(&[], &only)
}

fn text(lines: &[Line], format: &str, only: &[&str]) -> Result<String, ExportError> {
    let source = Source::new(Path::new("nowhere"), lines, &chosen(only)?)?;
    let format = FORMATS.iter().find(|known| known.name == format).unwrap();
    match format.write {
        Writer::Text(write) => Ok(write(&source).text),
        Writer::Folder(_) => panic!("{} is no text", format.name),
    }
}

#[test]
fn latex_has_a_command_for_every_character_of_a_report() {
    let mut lines = full_run();
    for line in &mut lines {
        match &mut line.body {
            // Errors far below a thousandth, as at many samples.
            Body::Error(record) => figures(record).for_each(|value| *value *= 1e-7),
            Body::Structure(record) => record.stats.sah_cost = Some(6.33e-12),
            _ => {}
        }
    }
    let latex = text(&lines, "latex", &[]).unwrap();
    assert!(latex.is_ascii());
    assert!(!latex.contains("U+"), "{latex}");
    assert!(latex.contains("$\\cdot$10$^{-12}$"), "{latex}");
}

#[test]
fn a_line_of_csv_has_each_figure_under_its_head() {
    let mut lines = small_run();
    for line in &mut lines {
        if let Body::Structure(record) = &mut line.body {
            record.stats.nodes = 1234;
        }
    }
    let csv = text(&lines, "csv", &["accel=bvh"]).unwrap();
    let mut rows = csv.lines();
    let heads = rows.next().unwrap();
    assert!(
        heads.ends_with(",figure,title,unit,value,low,high,interval"),
        "{heads}"
    );
    let place = |name: &str| heads.split(',').position(|head| head == name).unwrap();
    let nodes: Vec<&str> = rows
        .find(|row| row.contains(",1234,"))
        .unwrap()
        .split(',')
        .collect();
    let of = [
        "scene", "accel", "figure", "title", "unit", "value", "low", "high",
    ];
    let found = of.map(|name| nodes[place(name)]);
    assert_eq!(
        found,
        [
            "cornell-box",
            "bvh",
            "nodes/v1",
            "nodes",
            "",
            "1234",
            "1234",
            "1234"
        ]
    );
    // Speeds have intervals around them.
    let speed = csv
        .lines()
        .find(|row| row.contains(",mrays-per-s/v1,"))
        .unwrap();
    let speed: Vec<&str> = speed.split(',').collect();
    assert_eq!(speed[place("unit")], "Mrays/s");
    let number = |name| -> f64 { speed[place(name)].parse().unwrap() };
    let [low, value, high] = ["low", "value", "high"].map(number);
    assert!(low < value && value < high, "{speed:?}");
}

#[test]
fn a_label_with_parameters_is_chosen_as_it_is_written() {
    let mut lines = full_run();
    let label = "uniform-grid(lambda=3,cells=2)";
    for line in &mut lines {
        if line.key.label(axis::ACCEL) == "roped-bvh" {
            line.key = line.key.clone().with(axis::ACCEL, label);
        }
    }
    let rows = |only: &[&str]| {
        let csv = text(&lines, "csv", only).map(|csv| csv.lines().count() - 1);
        csv.map_err(|error| error.to_string())
    };
    let one = format!("accel={label}");
    let of_one = rows(&[&one]).unwrap();
    let of_bvh = rows(&["accel=bvh"]).unwrap();
    assert!(of_one > 0 && of_bvh > 0);
    assert_eq!(rows(&[&format!("{one},bvh")]), Ok(of_one + of_bvh));
    assert_eq!(rows(&[&format!("{one},accel=bvh")]), Ok(of_one + of_bvh));
    // Without the driver's checks it is another competitor, of the same name.
    let unchecked = lines.iter().cloned().map(|mut line| {
        line.ran.unchecked = line.key.label(axis::ACCEL) == "bvh";
        line
    });
    let unchecked: Vec<Line> = unchecked.collect();
    let csv = text(&unchecked, "csv", &["accel=bvh"]).unwrap();
    assert_eq!(csv.lines().count() - 1, of_bvh);
    assert!(
        csv.lines()
            .skip(1)
            .all(|line| line.contains("bvh (unchecked)")),
        "{csv}"
    );
    let of_rays = rows(&[&format!("{one},rays=primary")]).unwrap();
    assert!(0 < of_rays && of_rays < of_one);
    for (wrong, told) in [
        ("accel=bvh,zzz", "no accel fits `zzz`"),
        ("accel=!zzz", "no accel fits `!zzz`"),
        ("acel=bvh", "did you mean `accel`"),
        ("bvh", "no `=`"),
    ] {
        let refused = rows(&[wrong]).unwrap_err();
        assert!(refused.contains(told), "{refused}");
    }
}

#[test]
fn google_benchmark_has_the_rays_that_were_traced_and_the_clocks_that_were_read() {
    let lines = changed(|_, body| {
        if let Body::Time(record) = body {
            record.rays.insert("skipped".to_owned(), 1_000_000);
            record.cpu_ms = record.ms.iter().map(|ms| 2.0 * ms).collect();
        }
    });
    let found: Json =
        serde_json::from_str(&text(&lines, "google-benchmark", &[]).unwrap()).unwrap();
    let benchmarks = found["benchmarks"].as_array().unwrap();
    let named = |name: &str| {
        let mut all = benchmarks.iter();
        all.find(|b| b["name"].as_str().unwrap().starts_with(name))
            .unwrap()
    };
    let number = |of: &Json, field: &str| of[field].as_f64().unwrap();
    let cell = named(&figure::MS_PER_SPP.id);
    let seconds = 1e-9 * number(cell, "real_time");
    let rays = number(cell, "items_per_second") * seconds;
    // Times and rays are of one of the four samples per pixel, as the name says.
    assert!((rays - 110_592.0 / 4.0).abs() < 1e-3, "{rays}");
    let shown = lines.iter().find_map(|line| match &line.body {
        Body::Time(time) => time.ms.first().map(|ms| 1e-3 * ms / 4.0),
        _ => None,
    });
    assert!((seconds / shown.unwrap() - 1.0).abs() < 1e-9);
    assert_eq!(number(cell, "cpu_time"), 2.0 * number(cell, "real_time"));
    assert_eq!(cell["label"], "cpu_time: processors, all threads");
    // The wall clock is none of the processors'.
    let class = named(&figure::MRAYS_PER_S.id);
    assert_eq!(class["cpu_time"], class["real_time"]);
    assert!(
        class["label"].as_str().unwrap().contains("not measured"),
        "{class}"
    );
}

/// Writes the linear image of this name, one pixel of this value.
fn keep(dir: &Path, name: &str, value: f32) {
    let path = dir.join(name);
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let image = Image::new(1, 1, vec![[value; 3]]).unwrap();
    let format = FileFormat::of(&path).unwrap();
    format.write(&path, &image, &[]).unwrap();
}

#[test]
fn linear_images_are_those_that_the_records_name_and_missing_ones_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let (dir, out) = (folder.path(), folder.path().join("npy"));
    // A resumed run: its references are in one folder, later renders in another.
    let lines = changed(|_, body| {
        if let Body::Error(record) = body {
            for name in [&mut record.image, &mut record.error_map]
                .into_iter()
                .flatten()
            {
                *name = name.replacen("images/", "images-2/", 1);
            }
        }
    });
    let npy = FORMATS.iter().find(|format| format.name == "npy").unwrap();
    let Writer::Folder(write) = npy.write else {
        panic!("npy is a folder");
    };
    let source = Source::new(dir, &lines, &Selection::default()).unwrap();
    let nothing = write(&source, &out).unwrap_err().to_string();
    assert!(
        nothing.contains("none of the 24 linear images"),
        "{nothing}"
    );
    let references = ["cornell-box", "displaced-sphere"];
    let references = references.map(|scene| ["path", "ao"].map(|i| format!("{scene}-{i}")));
    for name in references.as_flattened() {
        keep(dir, &format!("images/reference-{name}.pfm"), 1.0);
    }
    let image = "render-cornell-box-path-sobol-none";
    keep(dir, &format!("images-2/{image}.pfm"), 2.0);
    // Files that no record names any more.
    keep(dir, &format!("images/{image}.pfm"), 3.0);
    keep(dir, "images/foreign.pfm", 3.0);
    let files = write(&source, &out).unwrap();
    assert_eq!((files.count, files.left_out.len()), (5, 1));
    assert!(
        files.left_out[0].starts_with("19 of 24 linear images"),
        "{files:?}"
    );
    assert!(
        files.left_out[0].contains("render-cornell-box-ao-halton-none"),
        "{files:?}"
    );
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 5);
    let found = read_linear(&out.join(format!("{image}.npy"))).unwrap();
    assert_eq!(found.pixels, [[2.0; 3]]);
    // If one mean was stored, the others are missing.
    let mean = raystone_core::text::slug(&["mean", "cornell-box", "path", "pixel-hash", "none"]);
    keep(dir, &format!("images-2/{mean}.pfm"), 4.0);
    let files = write(&source, &out).unwrap();
    // Means and variances of three randomised samplers in four views.
    assert!(
        files.left_out[0].starts_with("42 of 48 linear images"),
        "{files:?}"
    );
}

#[test]
fn every_cell_that_failed_is_a_test_case_whatever_its_kind() {
    let mut lines = full_run();
    let cell = |unit: &str, outcome: &str, reason: &str| {
        let record = serde_json::json!({ "kind": "cell", "unit": unit, "outcome": outcome, "reason": reason });
        Line::about_all(serde_json::from_value(record).unwrap())
    };
    // A peer that failed has a record of its own kind; the last word on a cell counts.
    lines.push(cell("cornell-box, peer embree", "failed", "no library"));
    lines.push(cell("cornell-box, peer obvhs", "failed", "before"));
    lines.push(cell("cornell-box, peer obvhs", "done", ""));
    let failed = RunData::new(&lines).failures();
    assert_eq!(failed["cornell-box, peer embree"], "no library");
    assert!(
        !failed.contains_key("cornell-box, peer obvhs"),
        "{failed:?}"
    );
    let xml = text(&lines, "junit", &[]).unwrap();
    assert!(xml.contains("<failure message=\"no library\">"), "{xml}");
    assert!(!xml.contains("before"), "{xml}");
}

#[test]
fn a_change_is_in_the_run_that_shows_it_even_if_the_first_run_lacks_the_figure() {
    let of_run = |number: u64| {
        let mut lines = vec![run(), structure("cornell-box", "bvh", 88.0, 0)];
        lines.truncate(if number == 0 { 1 } else { 2 });
        for line in &mut lines {
            match &mut line.body {
                Body::Run(record) => record.started_unix_s = 100 * number,
                Body::Structure(record) => record.stats.nodes += u64::from(number >= 2),
                _ => {}
            }
        }
        (std::path::PathBuf::from(format!("run-{number}")), lines)
    };
    let all: Vec<_> = (0..4).map(of_run).collect();
    let nodes = Selection::new(&["nodes".to_owned()], &[]).unwrap();
    let history = crate::history::History::new(&all, &nodes).unwrap();
    let changes = history.series.iter().flat_map(|series| &series.changes);
    let changes: Vec<usize> = changes.map(|change| change.run).collect();
    assert_eq!(changes, [2]);
}

#[test]
fn runs_with_other_work_are_in_another_series_that_says_so() {
    let of_run = |number: u64| {
        let mut lines = vec![run(), structure("cornell-box", "bvh", 88.0, 0)];
        for line in &mut lines {
            match &mut line.body {
                Body::Run(record) => record.started_unix_s = 100 * number,
                Body::Structure(record) if number >= 8 => {
                    for timing in &mut record.timings {
                        timing.rays *= 2;
                        timing.mrays_s = timing.mrays_s.scaled(0.5);
                    }
                }
                _ => {}
            }
        }
        (std::path::PathBuf::from(format!("run-{number}")), lines)
    };
    let all: Vec<_> = (0..16).map(of_run).collect();
    let speed = Selection::new(&["mrays-per-s".to_owned()], &[]).unwrap();
    let history = crate::history::History::new(&all, &speed).unwrap();
    assert_eq!(history.series.len(), 2 * CLASSES.len());
    assert!(history.series.iter().all(|series| series.points.len() == 8));
    assert!(
        history
            .series
            .iter()
            .all(|series| series.changes.is_empty())
    );
    let json = history.json();
    assert_eq!(json["series"][0]["work"], "32768 rays");
    let page = crate::html::page(&history.document()).unwrap();
    assert!(page.contains("65536 rays"), "{page}");
}
