//! The whole report on synthetic but realistic records.

mod checks;
mod exports;
mod fixture;
mod gallery;
mod idea;
mod names;
mod pages;
mod rendering;

use super::*;
use fixture::*;
use raystone_record::*;
use raystone_stats::bias::BiasVerdict;
use sections::verdict::{Race, best_per_sample, fastest};
use std::collections::BTreeSet;

/// Returns page and summary of these records, with pictures for the first scene only. If `RAYSTONE_REPORT_DIR` is
/// set, they are left there for inspection.
fn report(name: &str, lines: &[Line]) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let keep = std::env::var_os("RAYSTONE_REPORT_DIR").map(|keep| Path::new(&keep).join(name));
    let dir = keep.as_deref().unwrap_or(folder.path());
    std::fs::create_dir_all(dir.join("images")).unwrap();
    let line = |line: &Line| serde_json::to_string(line).unwrap() + "\n";
    let text: String = lines.iter().map(line).collect();
    let is_shown = |part: &&str| part.starts_with("images/") && part.contains("cornell");
    for path in text.split('"').filter(is_shown).collect::<BTreeSet<_>>() {
        let colour =
            |x: u32, y: u32| image::Rgb(raystone_image::viridis((x * y) as f32 / (96.0 * 72.0)));
        let picture = image::RgbImage::from_fn(96, 72, colour);
        picture.save(dir.join(path)).unwrap();
    }
    std::fs::write(dir.join(RECORDS_FILE), text).unwrap();
    let paths = write_report(dir).unwrap();
    assert!(paths.plots.iter().all(|path| path.is_file()));
    let read = |path| std::fs::read_to_string(path).unwrap();
    (read(&paths.html), read(&paths.summary))
}

/// Returns the page without embedded pictures and its script, whose text may spell anything.
fn without_pictures(html: &str) -> String {
    let html = html.split("<script").next().unwrap_or(html);
    let parts = html.split("base64,").enumerate();
    let text = parts.map(|(i, part)| match (i, part.find('"')) {
        (0, _) | (_, None) => part,
        (_, Some(end)) => &part[end..],
    });
    text.collect()
}

fn path_view<'d, 'a>(data: &'d data::RunData<'a>) -> &'d data::View<'a> {
    &data.scenes[0].views[0]
}

/// Returns the full run with some records changed.
fn changed(mut change: impl FnMut(&Key, &mut Body)) -> Vec<Line> {
    let mut lines = full_run();
    lines
        .iter_mut()
        .for_each(|line| change(&line.key, &mut line.body));
    lines
}

/// Returns all figures of a record of errors.
fn figures(record: &mut ErrorRecord) -> impl Iterator<Item = &mut f64> {
    record
        .errors
        .iter_mut()
        .flat_map(|at| at.metrics.values_mut())
}

#[test]
fn a_full_run_names_winners_failures_and_reasons() {
    let (html, summary) = report("full", &full_run());
    for text in [
        "undecided: bvh, roped-bvh",
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
    assert!(html.contains(" comparisons made in "));
    assert!(summary.contains("## Verdict"));
    assert!(summary.contains("(plots/scene-0-cornell-box-rates.png)"));
}

#[test]
fn the_page_is_self_contained_and_hostile_names_stay_text_everywhere() {
    let mut lines = small_run();
    for line in &mut lines {
        if matches!(line.body, Body::Structure(_)) {
            let label = format!("<b>&{}", line.key.label(axis::ACCEL));
            line.key = line.key.clone().with(axis::ACCEL, label);
        }
    }
    let (html, summary) = report("hostile", &lines);
    for text in [
        "a&lt;b&gt;&amp;c",
        "no texture &lt;x.png&gt;",
        "&lt;b&gt;&amp;bvh",
        "<svg",
        "src=\"data:image/png;base64,",
    ] {
        assert!(html.contains(text), "{text}");
    }
    for text in ["<b>", "src=\"http", "@import", "<?xml"] {
        assert!(!html.contains(text), "{text}");
    }
    // The page's own script, which alone has the nonce of the policy.
    let scripts: Vec<&str> = html.split("<script").skip(1).collect();
    assert_eq!(scripts.len(), 1);
    let nonce = scripts[0].split('"').nth(1).unwrap();
    assert!(nonce.len() == 64 && html.contains(&format!("script-src 'nonce-{nonce}'")));
    assert!(!summary.contains(" <b>"));
}

#[test]
fn a_biased_sampler_and_a_failed_structure_never_win() {
    let lines = full_run();
    let best = best_per_sample(path_view(&RunData::new(&lines)), 32).answer();
    assert_eq!(best, "sobol × cranley-patterson");
    let ruling = fastest(&RunData::new(&lines).scenes[0], RayClass::Primary);
    assert_eq!(ruling.answer(), "undecided: bvh, roped-bvh");
    let spoiled = changed(|key, body| match body {
        Body::Bias(b) if key.label(axis::SEQUENCE) == "sobol" => b.verdict = BiasVerdict::Biased,
        Body::Structure(s) if key.label(axis::ACCEL) == "brute-force" => s.gate = Some(gate(1)),
        _ => {}
    });
    // Nor does anybody else where the check of one failed.
    let data = RunData::new(&spoiled);
    let answer = best_per_sample(path_view(&data), 32).answer();
    assert!(answer.starts_with("no winner: sobol × "), "{answer}");
    let answer = Race::new(path_view(&data)).unwrap().ruling().answer();
    assert!(answer.starts_with("no winner: sobol × "), "{answer}");
    let fastest = fastest(&data.scenes[0], RayClass::Primary).answer();
    assert_eq!(fastest, "no winner: brute-force has failed the gate");
    let renders = sections::rendering::fastest(&data.scenes[0], path_view(&data)).answer();
    assert_eq!(renders, "no winner: brute-force has failed the gate");
}

#[test]
fn what_rests_on_a_failed_check_has_no_winner() {
    let said = |plant: fn(&mut Body)| {
        let lines = changed(|_, body| plant(body));
        let data = RunData::new(&lines);
        let view = path_view(&data);
        let rulings = [
            fastest(&data.scenes[0], RayClass::Bounce),
            sections::rendering::fastest(&data.scenes[0], view),
            best_per_sample(view, 32),
        ];
        rulings.map(|ruling| ruling.answer().starts_with("no winner"))
    };
    assert_eq!(said(|_| {}), [false; 3]);
    let image = |body: &mut Body| {
        if let Body::Time(t) = body {
            t.image_equal = false;
        }
    };
    assert_eq!(said(image), [false, true, false]);
    let judge = |body: &mut Body| {
        if let Body::Structure(s) = body {
            s.gate.as_mut().unwrap().oracle.wrong = 1;
        }
    };
    assert_eq!(said(judge), [true, true, false]);
    let path = |body: &mut Body| {
        if let Body::Paths(p) = body {
            p.fault = Some("pixel (1, 2)".into());
        }
    };
    assert_eq!(said(path), [false, false, true]);
    let pixel = |body: &mut Body| {
        if let Body::Error(e) = body {
            e.non_finite_pixels = 1;
        }
    };
    assert_eq!(said(pixel), [false, false, true]);
}

#[test]
fn nothing_is_headed_failed_where_nothing_failed_and_a_lenient_run_says_so() {
    let clean = changed(|_, body| match body {
        Body::Structure(s) => s.gate = Some(gate(0)),
        Body::Bias(b) if b.verdict == BiasVerdict::Biased => b.verdict = BiasVerdict::NoBiasFound,
        Body::Finished(f) => f.failed = 0,
        _ => {}
    });
    let said = |lines: &[Line]| {
        let data = RunData::new(lines);
        let nowhere = Path::new("no such folder");
        markdown::summary(&sections::document(nowhere, &data, &[]))
    };
    let text = said(&clean);
    assert!(text.contains("The figures can be believed") && !text.contains("lenient"));
    for heading in ["What failed", "## Failed", "\nFailed"] {
        assert!(!text.contains(heading), "{heading}");
    }
    assert!(text.contains("What was left out"));
    let text = said(&full_run());
    assert!(text.contains("What failed") && text.contains("Do not believe all of it"));
    let lenient = changed(|_, body| {
        if let Body::Run(run) = body {
            run.lenient = true;
        }
    });
    assert!(said(&lenient).contains("(--lenient)"));
}

#[test]
fn what_has_one_replicate_is_shown_and_neither_wins_nor_makes_a_winner() {
    // The deterministic one is far better than all others.
    let lines = changed(|key, body| {
        let names = [axis::SEQUENCE, axis::DECORRELATION].map(|axis| key.label(axis));
        if let (Body::Error(e), ["sobol", "none"]) = (body, names) {
            figures(e).for_each(|value| *value *= 0.02);
        }
    });
    let ruling = best_per_sample(path_view(&RunData::new(&lines)), 32);
    assert_eq!(ruling.answer(), "sobol × cranley-patterson");
    let next = ruling.runner_up();
    assert!(next.starts_with("halton × cranley-patterson"), "{next}");
    let (html, _) = report("single", &lines);
    assert!(html.contains("not ranked on cornell-box"));
    // All but one have one replicate: the one with many has beaten nobody.
    let mut few = lines.clone();
    few.retain(|line| match &line.body {
        Body::Error(e) => e.replicate == 0 || line.key.name(axis::SEQUENCE) == "pixel-hash",
        _ => true,
    });
    let ruling = best_per_sample(path_view(&RunData::new(&few)), 32);
    assert_eq!(ruling.answer(), "pixel-hash × none (alone)");
}

fn fails_for_noise(lines: &[Line]) -> bool {
    failed_checks(lines)
        .iter()
        .any(|check| check.starts_with("Reference noise"))
}

#[test]
fn no_winner_and_no_point_where_the_reference_is_too_noisy() {
    // An estimate about 0, as noise makes it from an error below the reference's own.
    let lines = changed(|key, body| {
        if let (Body::Error(e), "sobol") = (body, key.name(axis::SEQUENCE))
            && e.randomised
        {
            let negative = -1e-7 * (1.0 + f64::from(e.replicate));
            let last = e.errors.last_mut().unwrap();
            last.metrics
                .values_mut()
                .for_each(|value| *value = negative);
        }
    });
    let data = RunData::new(&lines);
    let ruling = best_per_sample(path_view(&data), 32);
    assert!(
        ruling
            .answer()
            .contains("below what the reference can resolve")
    );
    assert_eq!(ruling.figure(), "–");
    let race = Race::new(path_view(&data)).unwrap();
    assert!(race.ruling().answer().starts_with("no winner"));
    let (html, summary) = report("unresolved", &lines);
    assert!(html.contains("Not drawn: 1 point below what the reference can resolve."));
    assert!(
        summary.contains("&lt;0"),
        "the table says that it is not resolved"
    );
    assert!(!without_pictures(&html).contains("NaN"));
    assert!(fails_for_noise(&lines));
}

#[test]
fn a_scene_without_noise_is_no_fault_of_its_reference() {
    let lines = changed(|_, body| match body {
        Body::Error(e) => figures(e).for_each(|value| *value = 0.0),
        Body::Reference(r) => r.mse = Some(0.0),
        _ => {}
    });
    assert!(!fails_for_noise(&lines));
    let (html, _) = report("no-noise", &lines);
    assert!(!without_pictures(&html).contains("NaN"));
}

#[test]
fn a_slow_sampler_wins_per_second_only_if_its_time_is_known_well_enough() {
    let race = |lines: &[Line]| {
        let data = RunData::new(lines);
        let race = Race::new(path_view(&data)).unwrap();
        let error = race.error_of("sobol × cranley-patterson").unwrap();
        (error, race.ruling().answer())
    };
    let (sharp, _) = race(&full_run());
    let (wide, answer) = race(&changed(|_, body| {
        if let Body::Time(time) = body {
            for (i, ms) in time.ms.iter_mut().enumerate() {
                *ms *= 2f64.powf(i as f64 - 3.0);
            }
        }
    }));
    // The same but for the rounding of its mean.
    assert!((wide.value / sharp.value - 1.0).abs() < 1e-12);
    assert!(wide.low < 0.6 * sharp.low && wide.high > 1.8 * sharp.high);
    assert!(answer.starts_with("undecided"), "{answer}");
}

#[test]
fn a_bias_by_design_never_wins_and_is_no_failure() {
    let lines = changed(|_, body| {
        if let Body::Bias(b) = body {
            b.by_design = b.verdict == BiasVerdict::Biased;
        }
    });
    let checks = sections::belief::checks(&RunData::new(&lines));
    let bias = checks
        .iter()
        .find(|c| c.title.contains("without bias"))
        .unwrap();
    assert_eq!(bias.verdict, Verdict::Pass, "{bias:?}");
    assert!(bias.detail.contains("2 biased by design"), "{bias:?}");
    let (html, _) = report("by-design", &lines);
    assert!(html.contains("biased by design: 57 of 432 tiles rejected, image z = "));
}

/// Counts the biased samplers where the first one of a view has p = 0.3 % against a share of 1 % of `level`, and
/// `found` others are biased.
fn biased_samplers(level: Option<f64>, found: usize) -> usize {
    let mut seen = 0;
    let lines = changed(|_, body| {
        if let Body::Bias(b) = body {
            seen += 1;
            b.alpha = 0.0025;
            b.alpha_of_run = level;
            b.p_of_all = Some(if seen == 1 { 0.003 } else { 0.9 });
            b.verdict = if (2..2 + found).contains(&seen) {
                BiasVerdict::Biased
            } else {
                BiasVerdict::NoBiasFound
            };
        }
    });
    let data = RunData::new(&lines);
    let samplers = data.views().flat_map(|(_, view)| &view.samplers);
    samplers.filter(|s| s.fault().is_some()).count()
}

#[test]
fn samplers_that_are_biased_leave_their_share_of_the_level_to_the_others() {
    // Four share 1 %: 0.3 % is more than a quarter of it, and less than a third.
    assert_eq!(biased_samplers(Some(0.01), 0), 0);
    assert_eq!(biased_samplers(Some(0.01), 1), 2);
    assert_eq!(biased_samplers(Some(0.01), 2), 3);
    // Records that do not know the level of the run stay as they are.
    assert_eq!(biased_samplers(None, 1), 1);
}

#[test]
fn a_run_without_one_kind_of_record_still_reports() {
    let kind = |line: &Line| serde_json::to_value(&line.body).unwrap()["kind"].clone();
    let lines = small_run();
    let mut kinds: Vec<serde_json::Value> = lines.iter().map(kind).collect();
    kinds.dedup();
    assert!(kinds.len() >= 11, "{kinds:?}");
    for left_out in kinds {
        let kept = lines.iter().filter(|line| kind(line) != left_out);
        let (html, _) = report(
            &format!("no-{left_out}"),
            &kept.cloned().collect::<Vec<_>>(),
        );
        let html = without_pictures(&html);
        let odd = html.contains("NaN") || html.contains(">inf");
        assert!(html.contains("Why to believe it") && !odd, "{left_out}");
    }
    let (html, _) = report("only-run", &[run()]);
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
    let mut lines = small_run();
    lines.retain(|line| !matches!(line.body, Body::Error(_) | Body::Bias(_)));
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
    let mut lines = small_run();
    lines.retain(|line| !matches!(line.body, Body::Structure(_) | Body::Time(_)));
    let name = |i: i32| format!("structure-{i} [leaf-size={i}, split-limit=0.25]");
    let names: Vec<String> = (0..12).map(name).collect();
    for (i, name) in names.iter().enumerate() {
        let slower = 1.0 + 0.3 * i as f64;
        lines.push(structure("cornell-box", name, 6.0 / slower, 0));
        lines.extend(times(["cornell-box", "path"], &[(name, slower)]));
    }
    let (html, _) = report("twelve", &lines);
    assert!(names.iter().all(|name| html.contains(name)));
}

#[test]
fn the_terminal_shows_tables_and_checks() {
    let text = terminal_tables(&full_run());
    for part in [
        "Speed on cornell-box",
        "Verdict on displaced-sphere",
        "undecided",
        "FAIL  Hits equal",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    assert!(!terminal_tables(&[]).contains("NaN"));
}

#[test]
fn times_of_several_runs_are_named_as_such_and_cells_without_a_clock_are_not_counted() {
    let cell = |device: &str, began: u64| {
        let body = serde_json::json!({
            "kind": "cell", "unit": "u", "outcome": "done", "device": device, "run_began_unix_s": began,
        });
        Line::about_all(serde_json::from_value(body).unwrap())
    };
    let page = |name: &str, cells: [Line; 2]| report(name, &[small_run(), cells.into()].concat()).0;
    let told = "Times were measured in 2 runs that began between 2023-11-14 22:13 UTC and 2023-11-15 22:13 UTC";
    let (day, next) = (1_700_000_000, 1_700_086_400);
    let html = page("sittings", [cell("a", next), cell("a", day)]);
    assert!(html.contains(told));
    for others in [
        [cell("a", day), cell("a", day)],
        [cell("a", day), cell("", next)],
    ] {
        assert!(!page("one sitting", others).contains("Times were measured in"));
    }
}
