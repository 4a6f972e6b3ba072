//! The page of a report in a real browser: nothing is logged, everything fits, sorts, filters, compares, and is
//! accessible; a hostile name stays a name; ten thousand records are no trouble.
//!
//! Skipped aloud where there is no Chromium; the rules of axe-core where npm cannot fetch it.

mod browser;
#[path = "../../../src/report/tests/fixture.rs"]
#[allow(dead_code)] // The library's own tests use more of it.
mod fixture;

use crate::support::needs;
use browser::{Browser, Seen};
use raystone::image::{FileFormat, Image, automatic_exposure, displayed, tone_map, write_png};
use raystone::measure::record::{Body, Line, axis};
use raystone::report::write_report;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Pixels of the synthetic images.
const SIZE: [u32; 2] = [32, 24];
/// The pixel that the browser reads.
const PIXEL: [u32; 2] = [7, 5];

/// An image whose every pixel is its own: shifted by a number that its name gives.
fn image(name: &str) -> Image {
    let shift = name.bytes().map(u32::from).sum::<u32>() % 17;
    let [width, height] = SIZE;
    let value = |i: u32| 0.05 + 0.01 * ((i + shift) % 97) as f32;
    let pixels = (0..width * height).map(|i| [value(i), value(2 * i), value(3 * i)]);
    Image::new(width, height, pixels.collect()).expect("an image")
}

/// Writes records and the images that they name, and makes their report.
fn write(dir: &Path, lines: &[Line]) -> PathBuf {
    std::fs::create_dir_all(dir.join("images")).expect("a folder");
    let line = |line: &Line| serde_json::to_string(line).expect("a record") + "\n";
    let text: String = lines.iter().map(line).collect();
    let named = text.split('"').filter(|part| part.starts_with("images/"));
    let exr = FileFormat::of(Path::new("x.exr")).expect("a format");
    let exposure = automatic_exposure(&image("reference"));
    for name in named.collect::<BTreeSet<_>>() {
        let path = dir.join(name);
        write_png(&path, &tone_map(&image(name), exposure)).expect("a picture");
        exr.write(&path.with_extension("exr"), &image(name), &[])
            .expect("an image");
    }
    std::fs::write(dir.join("records.jsonl"), text).expect("records");
    write_report(dir).expect("a report").html
}

fn small_page() -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let html = write(folder.path(), &fixture::small_run());
    let page = std::fs::read_to_string(html).expect("a page");
    (folder, page)
}

/// Returns the displayed colour of the pixel.
fn colour(name: &str, exposure: f32) -> [u8; 3] {
    let pixel = image(name).pixels[(PIXEL[1] * SIZE[0] + PIXEL[0]) as usize];
    displayed(&pixel, exposure).map(|v| (v * 255.0).round() as u8)
}

/// Returns `true` if two colours are the same but for the rounding of 16-bit floats.
fn close(a: [u8; 3], b: [u8; 3]) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 1)
}

fn check_common(seen: &Seen, what: &str) {
    assert!(seen.is("done"), "{what}: {seen:?}");
    assert_eq!(seen.console, Vec::<String>::new(), "{what}");
    for overflow in ["overflow", "overflowUnfolded"] {
        assert!(
            seen.number(overflow) <= 0.0,
            "{what}, {overflow}: {} {:?}",
            seen.number(overflow),
            seen.value("widest")
        );
    }
    assert_eq!(seen.text("hostile"), "[null,0,0]", "{what}");
    assert_eq!(
        seen.text("links"),
        "[]",
        "{what}: anchors that lead nowhere"
    );
    assert_eq!(
        seen.number("images"),
        0.0,
        "{what}: pictures without a text"
    );
    assert!(seen.number("canvasRight") <= 0.5, "{what}");
    match seen.value("axe") {
        None => needs::skip("npm", "there is no axe-core"),
        Some(found) => assert_eq!(found.to_string(), "[]", "{what}"),
    }
}

#[test]
fn a_page_works_in_a_browser_wide_and_narrow_light_and_dark() {
    let Some(browser) = Browser::find() else {
        return;
    };
    let (_folder, page) = small_page();
    for (width, dark) in [(1280, false), (400, false), (1280, true), (400, true)] {
        let seen = browser.visit(&page, width, dark, "Speed on cornell-box", 2, PIXEL);
        let what = format!("{width} px, dark {dark}");
        check_common(&seen, &what);
        assert_eq!(
            (seen.number("width"), seen.is("dark")),
            (f64::from(width), dark)
        );
        // Numbers are sorted as such, and back.
        assert_eq!(
            seen.texts("ascending"),
            ["0.310", "1.90", "4.98", "5.02"],
            "{what}"
        );
        assert_eq!(seen.texts("descending"), ["5.02", "4.98", "1.90", "0.310"]);
        assert_eq!(seen.texts("after"), seen.texts("before"));
        assert_eq!(seen.string("sortSaid"), "ascending");
        let [shown, all, fits] =
            [0, 1, 2].map(|i| seen.value("filtered").expect("a filter")[i].clone());
        assert!(
            shown.as_u64() < all.as_u64() && shown.as_u64() > Some(0) && fits == true,
            "{seen:?}"
        );
        assert_eq!(seen.number("unfiltered"), 0.0);
        // The tooltip of a plot matches its table.
        assert!(
            seen.string("tip").contains("primary rays") && !seen.is("tipHidden"),
            "{seen:?}"
        );
        check_comparer(&seen);
    }
}

/// The comparer shows the content of the images.
fn check_comparer(seen: &Seen) {
    let reference = "images/reference-cornell-box-path.png";
    let first = "images/render-cornell-box-path-pixel-hash-none.png";
    let exposure = automatic_exposure(&image(reference));
    let [a, b] = [reference, first].map(|name| colour(name, exposure));
    assert!(!close(a, b), "a test that could not fail");
    for (what, expected) in [
        ("flipA", a),
        ("flipB", b),
        ("swipeLeft", b),
        ("swipeRight", a),
    ] {
        let found = seen.colour(what);
        assert!(
            close(found, expected),
            "{what}: {found:?}, not {expected:?}"
        );
    }
    let sides = seen.value("side").expect("two views");
    assert!(close(browser::colour(&sides[0]), a) && close(browser::colour(&sides[1]), b));
    let at = |name: &str| image(name).pixels[(PIXEL[1] * SIZE[0] + PIXEL[0]) as usize];
    let values = seen.string("values");
    assert!(
        values.starts_with(&format!("pixel {}, {} ", PIXEL[0], PIXEL[1])),
        "{values}"
    );
    let told: Vec<f64> = values
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    let expected: Vec<f64> = [at(reference), at(first)]
        .concat()
        .into_iter()
        .map(f64::from)
        .collect();
    let is_told = |v: &f64| told.iter().any(|t| (t - v).abs() <= 1e-3 * v);
    assert!(
        expected.iter().all(is_told),
        "{values} lacks one of {expected:?}"
    );
    let square = |c: usize| {
        let [v, r] = [at(first), at(reference)].map(|pixel| f64::from(pixel[c]));
        (v - r).powi(2) / (r * r + 0.01)
    };
    let error = ((square(0) + square(1) + square(2)) / 3.0).sqrt();
    assert!(
        told.iter().any(|t| (t - error).abs() <= 2e-2 * error),
        "{values}: no {error}"
    );
    let map = raystone::image::viridis(error as f32);
    assert!(
        close(seen.colour("error"), map),
        "{:?}, not {map:?}",
        seen.colour("error")
    );
    assert!(seen.numbers("brighter").iter().all(|more| *more > 0.0));
}

#[test]
fn a_page_can_be_read_without_its_script() {
    let Some(browser) = Browser::find() else {
        return;
    };
    let (folder, page) = small_page();
    // Without its nonce the page's own script is like any other: the policy lets it not run.
    let at = page.rfind("<script nonce=").expect("a script");
    let end = at + page[at..].find('>').expect("an end");
    let mute = format!("{}<script>{}", &page[..at], &page[end + 1..]);
    let file = folder.path().join("mute.html");
    std::fs::write(&file, mute).expect("a page");
    let dom = browser.dump(&file);
    for text in [
        "Verdict on cornell-box",
        "<svg",
        "Speed on cornell-box",
        "needs JavaScript",
    ] {
        assert!(dom.contains(text), "{text}");
    }
    assert!(!dom.contains("class=\"scripted\"") && !dom.contains("<button"));
    assert_eq!(
        dom.matches("<details").count(),
        dom.matches("<summary").count()
    );
}

#[test]
fn hostile_names_are_inert() {
    let Some(browser) = Browser::find() else {
        return;
    };
    let long = "x".repeat(300);
    let names = [
        "<script>window.hacked=1</script>",
        "\"><img src=x onerror=window.hacked=1>",
        "\u{202e}txt.exe</title><svg onload=window.hacked=1>",
        "javascript:window.hacked=1//' onclick='window.hacked=1",
        &long,
        "</script><script>window.hacked=1</script>NONCE-OF-THIS-PAGE",
    ];
    // Each label of an axis gets another of them.
    let mut known: Vec<String> = Vec::new();
    let mut named = |label: &str| {
        let place = known.iter().position(|known| known == label);
        let place = place.unwrap_or_else(|| {
            known.push(label.to_owned());
            known.len() - 1
        });
        format!("{}{}", names[place % names.len()], place / names.len())
    };
    let mut lines = fixture::small_run();
    for line in &mut lines {
        for axis in [
            axis::SCENE,
            axis::ACCEL,
            axis::SEQUENCE,
            axis::DECORRELATION,
        ] {
            let label = line.key.label(axis).to_owned();
            if !label.is_empty() {
                line.key = line.key.clone().with(axis, named(&label));
            }
        }
        if let Body::Run(run) = &mut line.body {
            run.name = names[0].into();
            run.experiment = names[1].into();
            run.experiment_text = names[5].into();
        }
    }
    assert!(known.len() > names.len());
    let folder = tempfile::tempdir().expect("a folder");
    let page = std::fs::read_to_string(write(folder.path(), &lines)).expect("a page");
    assert!(page.contains("&lt;script&gt;"));
    for width in [1280, 400] {
        let seen = browser.visit(&page, width, false, "no such table", 0, PIXEL);
        check_common(&seen, "hostile");
    }
}

/// The full run of the fixture many times over, under other names of scenes and sequences.
fn many(records: usize) -> Vec<Line> {
    let full = fixture::full_run();
    let mut lines = full.clone();
    for copy in 1.. {
        for line in &full {
            let [scene, sequence] = [axis::SCENE, axis::SEQUENCE].map(|axis| line.key.label(axis));
            let mut key = line.key.clone();
            if !scene.is_empty() {
                key = key.with(axis::SCENE, format!("{scene} {}", copy % 4));
            }
            if !sequence.is_empty() {
                key = key.with(axis::SEQUENCE, format!("{sequence} {}", copy / 4));
            }
            if lines.len() == records {
                return lines;
            }
            if !line.key.is_empty() {
                let mut line = line.clone();
                line.key = key;
                lines.push(line);
            }
        }
    }
    lines
}

#[test]
#[ignore = "minutes without optimisation: cargo test --profile bench --test runs -- --ignored report_page"]
fn ten_thousand_records_make_a_page_of_less_than_ten_megabytes() {
    let lines = many(10_000);
    let folder = tempfile::tempdir().expect("a folder");
    let line = |line: &Line| serde_json::to_string(line).expect("a record") + "\n";
    let text: String = lines.iter().map(line).collect();
    std::fs::write(folder.path().join("records.jsonl"), text).expect("records");
    let start = Instant::now();
    let html = write_report(folder.path()).expect("a report").html;
    let seconds = start.elapsed().as_secs_f64();
    let bytes = std::fs::metadata(html).expect("a page").len();
    println!(
        "{} records: {seconds:.1} s, {:.1} MB",
        lines.len(),
        bytes as f64 / 1e6
    );
    assert!(bytes < 10_000_000, "{bytes} bytes");
}
