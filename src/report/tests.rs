//! The whole report on synthetic but realistic records.

mod checks;
mod fixture;
mod names;
mod streams;

use super::*;
use crate::measure::bias::BiasVerdict;
use crate::measure::record::*;
use fixture::*;

/// Tells one kind of record.
type IsKind = fn(&Body) -> bool;

/// A run's folder; pictures for the first scene only.
fn folder(lines: &[Line]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("images")).unwrap();
    let text: String = lines
        .iter()
        .map(|line| serde_json::to_string(line).unwrap() + "\n")
        .collect();
    let named = text
        .split('"')
        .filter(|part| part.starts_with("images/") && part.contains("cornell"));
    for path in named.collect::<std::collections::BTreeSet<_>>() {
        let colour =
            |x: u32, y: u32| image::Rgb(crate::image::viridis((x * y) as f32 / (96.0 * 72.0)));
        image::RgbImage::from_fn(96, 72, colour)
            .save(dir.path().join(path))
            .unwrap();
    }
    std::fs::write(dir.path().join(RECORDS_FILE), text).unwrap();
    dir
}

/// Page and summary of these records. With `RAYSTONE_REPORT_DIR` set, the folder is kept there to be
/// looked at.
fn report(name: &str, lines: &[Line]) -> (String, String) {
    let dir = folder(lines);
    let paths = write_report(dir.path()).unwrap();
    let texts = (
        std::fs::read_to_string(&paths.html).unwrap(),
        std::fs::read_to_string(&paths.summary).unwrap(),
    );
    assert!(paths.plots.iter().all(|path| path.is_file()));
    if let Some(keep) = std::env::var_os("RAYSTONE_REPORT_DIR") {
        let to = Path::new(&keep).join(name);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::process::Command::new("cp")
            .arg("-rT")
            .arg(dir.path())
            .arg(&to)
            .status()
            .unwrap();
    }
    texts
}

/// The page without embedded pictures, whose text may spell anything.
fn without_pictures(html: &str) -> String {
    let parts = html.split("base64,").enumerate();
    let text = parts.map(|(i, part)| match (i, part.find('"')) {
        (0, _) | (_, None) => part,
        (_, Some(end)) => &part[end..],
    });
    text.collect()
}

fn without(lines: Vec<Line>, dropped: IsKind) -> Vec<Line> {
    lines
        .into_iter()
        .filter(|line| !dropped(&line.body))
        .collect()
}

#[test]
fn a_full_run_names_winners_failures_and_reasons() {
    let (html, summary) = report("full", &full_run());
    for text in [
        "no clear winner: bvh, roped-bvh",
        "FAILED: 41 of 131072 rays differ",
        "first: ray 17",
        "more than brute-force takes",
        "biased: 57 of 432 tiles rejected",
        "times compare structures on this adapter only",
        "152 (73 % saved)",
        "fit of Dufay 2017 for Halton",
        "heat-displaced-sphere-bvh.png is missing",
        "Points of halton × cranley-patterson.",
    ] {
        assert!(html.contains(text), "{text}");
    }
    assert!(
        summary.contains("## Verdict") && summary.contains("(plots/scene-0-cornell-box-rates.png)")
    );
}

#[test]
fn the_page_is_self_contained_and_escapes_names() {
    let (html, _) = report("escape", &small_run());
    assert!(html.contains("a&lt;b&gt;&amp;c") && !html.contains("a<b>"));
    assert!(html.contains("no texture &lt;x.png&gt;"));
    assert!(!html.contains("<script") && !html.contains("src=\"http") && !html.contains("@import"));
    assert!(html.contains("<svg") && html.contains("src=\"data:image/png;base64,"));
    assert!(!html.contains("<?xml"));
}

#[test]
fn hostile_names_stay_text_everywhere() {
    let mut lines = small_run();
    for line in &mut lines {
        if matches!(line.body, Body::Structure(_)) {
            let label = format!("<b>&{}", line.key.label(axis::ACCEL));
            line.key = line.key.clone().with(axis::ACCEL, label);
        }
    }
    let (html, summary) = report("hostile", &lines);
    assert!(html.contains("&lt;b&gt;&amp;bvh") && !html.contains("<b>"));
    assert!(!summary.contains(" <b>"));
}

#[test]
fn a_biased_sampler_and_a_failed_structure_never_win() {
    let lines = full_run();
    let data = RunData::new(&lines);
    let view = &data.scenes[1].views[0];
    let mut spoiled = lines.clone();
    let best = sections::verdict::best_per_sample(view, 32).answer();
    assert_eq!(best, "sobol × cranley-patterson");
    for line in &mut spoiled {
        let is = |axis, label| line.key.label(axis) == label;
        match &mut line.body {
            Body::Bias(b) if is(axis::SEQUENCE, "sobol") => b.verdict = BiasVerdict::Biased,
            Body::Structure(s) if is(axis::ACCEL, "bvh") => s.gate = Some(gate(1)),
            _ => {}
        }
    }
    let data = RunData::new(&spoiled);
    let scene = &data.scenes[1];
    assert_ne!(
        sections::verdict::best_per_sample(&scene.views[0], 32).answer(),
        best
    );
    assert_eq!(
        sections::verdict::fastest(scene, RayClass::Primary).answer(),
        "roped-bvh (alone)"
    );
}

/// The run with the figures of one integrator on the second scene changed.
fn with_errors(change: impl Fn(&Key, &mut ErrorRecord)) -> Vec<Line> {
    let mut lines = full_run();
    let view = Key::default().with(axis::SCENE, "displaced-sphere");
    let view = view.with(axis::INTEGRATOR, "path");
    for line in &mut lines {
        if let Body::Error(e) = &mut line.body
            && line.key.agrees(&view, &[axis::SCENE, axis::INTEGRATOR])
        {
            change(&line.key, e);
        }
    }
    lines
}

#[test]
fn what_has_one_replicate_is_shown_and_neither_wins_nor_makes_a_winner() {
    // The deterministic one is far better than all others.
    let lines = with_errors(|key, e| {
        if key.label(axis::SEQUENCE) == "sobol" && key.label(axis::DECORRELATION) == "none" {
            let metrics = e.errors.iter_mut().flat_map(|at| at.metrics.values_mut());
            metrics.for_each(|value| *value *= 0.02);
        }
    });
    let data = RunData::new(&lines);
    let ruling = sections::verdict::best_per_sample(&data.scenes[1].views[0], 32);
    assert_eq!(ruling.answer(), "sobol × cranley-patterson");
    let next = ruling.runner_up();
    assert!(next.starts_with("pixel-hash × none"), "{next}");
    let (html, _) = report("single", &lines);
    assert!(html.contains("not ranked on displaced-sphere"));
    // All but one have one replicate: the one with many has beaten nobody.
    let mut few = lines.clone();
    few.retain(|line| match &line.body {
        Body::Error(e) => e.replicate == 0 || line.key.name(axis::SEQUENCE) == "pixel-hash",
        _ => true,
    });
    let data = RunData::new(&few);
    let ruling = sections::verdict::best_per_sample(&data.scenes[1].views[0], 32);
    assert_eq!(ruling.answer(), "pixel-hash × none (alone)");
}

#[test]
fn no_winner_and_no_point_where_the_reference_is_too_noisy() {
    // An estimate about 0, as noise makes it from an error below the reference's own.
    let lines = with_errors(|key, e| {
        if key.name(axis::SEQUENCE) == "sobol" && e.randomised {
            let negative = -1e-7 * (1.0 + f64::from(e.replicate));
            let last = e.errors.last_mut().unwrap();
            last.metrics
                .values_mut()
                .for_each(|value| *value = negative);
        }
    });
    let data = RunData::new(&lines);
    let view = &data.scenes[1].views[0];
    let ruling = sections::verdict::best_per_sample(view, 32);
    assert!(
        ruling
            .answer()
            .contains("below what the reference can resolve")
    );
    assert_eq!(ruling.figure(), "–");
    let race = sections::verdict::Race::new(view).unwrap();
    assert!(race.ruling().answer().starts_with("no winner"));
    let (html, summary) = report("unresolved", &lines);
    assert!(html.contains("Not drawn: 1 point below what the reference can resolve."));
    assert!(
        summary.contains("<0") || summary.contains("&lt;0"),
        "the table says that it is not resolved"
    );
    assert!(!without_pictures(&html).contains("NaN"));
    let failed = failed_checks(&lines);
    assert!(
        failed
            .iter()
            .any(|check| check.starts_with("Reference noise")),
        "{failed:?}"
    );
}

#[test]
fn a_scene_without_noise_is_no_fault_of_its_reference() {
    let mut lines = full_run();
    for line in &mut lines {
        match &mut line.body {
            Body::Error(e) => {
                let metrics = e.errors.iter_mut().flat_map(|at| at.metrics.values_mut());
                metrics.for_each(|value| *value = 0.0);
            }
            Body::Reference(r) => r.mse = 0.0,
            _ => {}
        }
    }
    let failed = failed_checks(&lines);
    assert!(
        !failed
            .iter()
            .any(|check| check.starts_with("Reference noise")),
        "{failed:?}"
    );
    let (html, _) = report("no-noise", &lines);
    assert!(!without_pictures(&html).contains("NaN"));
}

#[test]
fn a_slow_sampler_wins_per_second_only_if_its_time_is_known_well_enough() {
    let lines = full_run();
    let data = RunData::new(&lines);
    let race = sections::verdict::Race::new(&data.scenes[1].views[0]).unwrap();
    let sharp = race.error_of("sobol × cranley-patterson").unwrap();
    let mut vague = full_run();
    for line in &mut vague {
        if let Body::Time(time) = &mut line.body
            && let Some(ms) = &mut time.ms_per_spp
        {
            (ms.low, ms.high) = (0.5 * ms.value, 2.0 * ms.value);
        }
    }
    let data = RunData::new(&vague);
    let race = sections::verdict::Race::new(&data.scenes[1].views[0]).unwrap();
    let wide = race.error_of("sobol × cranley-patterson").unwrap();
    assert_eq!(wide.value, sharp.value);
    assert!(wide.low < 0.6 * sharp.low && wide.high > 1.8 * sharp.high);
    assert!(race.ruling().answer().starts_with("no clear winner"));
}

#[test]
fn a_bias_by_design_never_wins_and_is_no_failure() {
    let mut lines = full_run();
    for line in &mut lines {
        if let Body::Bias(b) = &mut line.body
            && b.verdict == BiasVerdict::Biased
        {
            b.by_design = true;
        }
    }
    let checks = sections::belief::checks(&RunData::new(&lines));
    let bias = checks
        .iter()
        .find(|c| c.title.contains("without bias"))
        .unwrap();
    assert_eq!(bias.verdict, Verdict::Pass, "{bias:?}");
    assert!(
        bias.detail.contains("2 biased by design"),
        "{}",
        bias.detail
    );
    let (html, _) = report("by-design", &lines);
    assert!(html.contains("biased by design: 57 of 432 tiles rejected, image z = "));
}

#[test]
fn a_run_without_one_kind_of_record_still_reports() {
    let kinds: [(&str, IsKind); 11] = [
        ("no-run", |r| matches!(r, Body::Run(_))),
        ("no-scene", |r| matches!(r, Body::Scene(_))),
        ("no-structure", |r| matches!(r, Body::Structure(_))),
        ("no-reference", |r| matches!(r, Body::Reference(_))),
        ("no-error", |r| matches!(r, Body::Error(_))),
        ("no-bias", |r| matches!(r, Body::Bias(_))),
        ("no-time", |r| matches!(r, Body::Time(_))),
        ("no-stream", |r| matches!(r, Body::Stream(_))),
        ("no-spectrum", |r| matches!(r, Body::Spectrum(_))),
        ("no-cost", |r| matches!(r, Body::SamplerCost(_))),
        ("no-finished", |r| matches!(r, Body::Finished(_))),
    ];
    let small = small_run();
    for (name, is_kind) in kinds {
        let (html, _) = report(name, &without(small.clone(), is_kind));
        let html = without_pictures(&html);
        assert!(
            html.contains("Why to believe it") && !html.contains("NaN") && !html.contains(">inf"),
            "{name}"
        );
    }
    let only_run = vec![Line::about_all(run())];
    let (html, _) = report("only-run", &only_run);
    assert!(html.contains("Nothing was measured") && html.contains("did not finish"));
}

#[test]
fn one_structure_one_sampler_and_one_spp_are_enough() {
    let mut lines = small_run();
    lines.retain(|line| {
        let is = |axis, label| line.key.label(axis) == label;
        match line.body {
            Body::Structure(_) => is(axis::ACCEL, "bvh"),
            Body::Time(_) => is(axis::ACCEL, "bvh") && is(axis::SEQUENCE, "pixel-hash"),
            Body::Error(_) => is(axis::SEQUENCE, "pixel-hash"),
            Body::Bias(_) => false,
            _ => true,
        }
    });
    for line in &mut lines {
        if let Body::Error(record) = &mut line.body {
            record.errors.truncate(1);
        }
    }
    let (html, _) = report("one", &lines);
    assert!(html.contains("bvh (alone)") && html.contains("pixel-hash × none (alone)"));
}

#[test]
fn a_run_where_everything_failed_shows_it_and_no_figure() {
    let mut lines = without(small_run(), |r| matches!(r, Body::Error(_) | Body::Bias(_)));
    for line in &mut lines {
        let [scene, accel] = [axis::SCENE, axis::ACCEL].map(|axis| line.key.label(axis));
        match &mut line.body {
            Body::Structure(_) => *line = structure(scene, accel, 1.0, 9),
            Body::Time(t) => t.failure = Some("device lost".into()),
            _ => {}
        }
    }
    let (html, _) = report("failed", &lines);
    assert!(html.contains("device lost") && html.contains("9 of 131072 rays differ"));
    assert!(!html.contains("5.02"));
}

#[test]
fn twelve_structures_fit_into_plots_and_tables() {
    let mut lines = without(small_run(), |r| {
        matches!(r, Body::Structure(_) | Body::Time(_))
    });
    let names: Vec<String> = (0..12)
        .map(|i| format!("structure-{i} [leaf-size={i}, split-limit=0.25]"))
        .collect();
    let scene = "cornell-box";
    for (i, name) in names.iter().enumerate() {
        lines.push(structure(scene, name, 6.0 / (1.0 + i as f64 * 0.3), 0));
    }
    let timed: Vec<(&str, f64)> = names
        .iter()
        .enumerate()
        .map(|(i, name)| (name.as_str(), 1.0 + 0.3 * i as f64))
        .collect();
    lines.extend(times(scene, "path", &timed));
    let (html, _) = report("twelve", &lines);
    assert!(names.iter().all(|name| html.contains(name)));
}

#[test]
fn the_terminal_shows_tables_and_checks() {
    let text = terminal_tables(&full_run());
    if std::env::var_os("RAYSTONE_REPORT_DIR").is_some() {
        println!("{text}");
    }
    for part in [
        "Speed on cornell-box",
        "Verdict on displaced-sphere",
        "no clear winner",
        "FAIL  Hits equal",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    assert!(!terminal_tables(&[]).contains("NaN"));
}
