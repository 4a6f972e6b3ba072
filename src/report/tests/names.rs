//! Runs that vary tests of rays against triangles and boxes, or offsets: differing competitors are named and
//! distinguished.

use super::*;

/// Returns a run whose cells used both labels of an axis. With the second one structures are half as fast, renders
/// twice as slow and errors three times as large.
fn both(axis: &str, labels: [&str; 2]) -> Vec<Line> {
    let with = |mut line: Line, label: &str| {
        line.key = line.key.with(axis, label);
        line
    };
    let mut lines = Vec::new();
    for line in small_run() {
        match line.body {
            // References are always rendered with the default offset.
            Body::Reference(_) if axis == axis::OFFSET => lines.push(with(line, labels[0])),
            Body::Structure(_) if axis == axis::OFFSET => lines.push(with(line, labels[0])),
            Body::Structure(_)
            | Body::Time(_)
            | Body::Error(_)
            | Body::Bias(_)
            | Body::Spectrum(_)
            | Body::Reference(_) => {
                lines.push(with(line.clone(), labels[0]));
                let mut other = with(line, labels[1]);
                match &mut other.body {
                    Body::Structure(s) => {
                        for timing in &mut s.timings {
                            timing.mrays_s = timing.mrays_s.scaled(0.5);
                            timing.ms.iter_mut().for_each(|ms| *ms *= 2.0);
                        }
                    }
                    Body::Time(t) => t.ms_per_spp = t.ms_per_spp.map(|ms| ms.scaled(2.0)),
                    Body::Error(e) => {
                        let metrics = e.errors.iter_mut().flat_map(|at| at.metrics.values_mut());
                        metrics.for_each(|value| *value *= 3.0);
                    }
                    _ => {}
                }
                lines.push(other);
            }
            _ => lines.push(line),
        }
    }
    lines
}

fn names(data: &RunData) -> (Vec<String>, Vec<String>, Vec<String>) {
    let views = data.views().map(|(_, view)| view.name.clone()).collect();
    (data.structures.clone(), data.samplers.clone(), views)
}

#[test]
fn a_test_that_is_not_exact_breaks_even_with_nobody_however_fast_it_is_built() {
    let mut lines = both(axis::TRIANGLE, ["bare", "watertight"]);
    for line in &mut lines {
        if let (Body::Structure(s), "bare") = (&mut line.body, line.key.label(axis::TRIANGLE)) {
            s.build_ms *= 1e-3;
            s.gate.iter_mut().for_each(|gate| gate.inexact = true);
        }
    }
    let data = RunData::new(&lines);
    let values = sections::trade_off::break_even(&data.scenes[0]);
    let exact = |value: &crate::values::Value| value.key.label(axis::TRIANGLE) == "watertight";
    assert!(!values.is_empty() && values.iter().all(exact));
    let (_, summary) = report("inexact", &lines);
    let mut tables = (summary.lines()).filter(|line| line.contains("which is built fastest"));
    let named = tables.next().expect("a table of break-evens");
    assert!(!named.contains("bare"), "{named}");
}

#[test]
fn two_triangle_or_box_tests_make_two_competitors_and_two_views_each() {
    for axis in [axis::TRIANGLE, axis::BOX_TEST] {
        let lines = both(axis, ["ours", "theirs"]);
        let data = RunData::new(&lines);
        let scene = &data.scenes[0];
        assert_eq!(scene.structures.len(), 8, "four structures, two tests");
        let (_, samplers, views) = names(&data);
        assert_eq!(views, ["path · ours", "path · theirs"]);
        assert_eq!(samplers.len(), SAMPLERS.len());
        let fastest = sections::verdict::fastest(scene, RayClass::Shadow);
        assert_eq!(fastest.answer(), "undecided: bvh · ours, roped-bvh · ours");
        let [a, b] = [0, 1].map(|i| &scene.views[i]);
        for view in [a, b] {
            assert_eq!(view.samplers.len(), SAMPLERS.len());
            assert_eq!(view.timed_structures()[0], "bvh");
            let reference = view.reference.expect("a reference of its own");
            assert_eq!(format!("path · {}", reference.key.label(axis)), view.name);
        }
        let sampler = &a.samplers[0].name;
        let ratio = |of: &dyn Fn(&data::View) -> f64| of(b) / of(a);
        let ms = ratio(&|view| view.ms_per_spp("bvh", sampler).unwrap().value);
        let metric = samplers::Metric::RelMse;
        let error = ratio(&|view| {
            let of_view = view.samplers[0].mean_error_at(metric, 8).unwrap();
            of_view.error.value
        });
        assert!((ms - 2.0).abs() < 1e-9 && (error - 3.0).abs() < 1e-9);
        let (html, summary) = report(&format!("two-{axis}"), &lines);
        let text = terminal_tables(&lines);
        for name in ["bvh · ours", "bvh · theirs", "path · ours", "path · theirs"] {
            for shown in [&html, &summary, &text] {
                assert!(shown.contains(name), "{name} of {axis}");
            }
        }
        let row = text
            .lines()
            .find(|line| line.starts_with("roped-bvh · theirs"));
        let words: Vec<&str> = row.unwrap_or_default().split_whitespace().collect();
        assert_eq!(words[3..5], ["passed", "2.49"], "{text}");
        let plots = ["path-ours-0-pareto", "path-theirs-1-pareto"];
        assert!(plots.iter().all(|name| html.contains(name)));
    }
}

#[test]
fn two_offsets_make_two_samplers_in_one_view() {
    let lines = both(axis::OFFSET, ["error-bound", "none"]);
    let data = RunData::new(&lines);
    let (structures, samplers, views) = names(&data);
    assert_eq!(views, ["path"]);
    assert!(
        structures.iter().all(|name| !name.contains('·')),
        "{structures:?}"
    );
    let view = &data.scenes[0].views[0];
    assert_eq!(view.samplers.len(), 2 * SAMPLERS.len());
    let ms = |offset: &str| {
        let sampler = format!("sobol × none · {offset}");
        view.ms_per_spp("bvh", &sampler).unwrap().value
    };
    assert!((ms("none") / ms("error-bound") - 2.0).abs() < 1e-9);
    // No ray is traced for the words themselves.
    assert!(
        samplers.contains(&"sobol × none".to_owned()),
        "{samplers:?}"
    );
    let (html, _) = report("two-offsets", &lines);
    assert!(
        html.contains("pixel-hash × none · error-bound")
            && html.contains("Points of halton × none.")
    );
    assert!(!html.contains("the records hold none of its points"));
}

#[test]
fn an_axis_with_one_value_is_named_nowhere() {
    let plain = terminal_tables(&small_run());
    for axis in [axis::TRIANGLE, axis::BOX_TEST, axis::OFFSET] {
        let mut one = small_run();
        for line in &mut one {
            if !line.key.label(axis::SCENE).is_empty() {
                line.key = line.key.clone().with(axis, "only");
            }
        }
        assert_eq!(terminal_tables(&one), plain);
        // A reference with the default offset makes no second value, and one of a known value, for which no ray was
        // traced, belongs to every view.
        for line in &mut one {
            if matches!(line.body, Body::Reference(_)) {
                let label = if axis == axis::OFFSET { "default" } else { "" };
                line.key = line.key.clone().with(axis, label);
            }
        }
        assert_eq!(terminal_tables(&one), plain);
    }
}

#[test]
fn kernels_of_a_folder_are_named_whether_or_not_they_vary() {
    let mut lines = small_run();
    for line in &mut lines {
        if !line.key.label(axis::SCENE).is_empty() {
            line.key = line.key.clone().with(axis::KERNELS, "idea");
        }
    }
    let data = RunData::new(&lines);
    let (structures, samplers, views) = names(&data);
    assert_eq!(structures[0], "bvh @idea");
    assert_eq!(samplers[0], "pixel-hash × none @idea");
    assert_eq!(views, ["path"]);
    assert_eq!(data.scenes[0].views[0].timed_structures()[0], "bvh");
}
