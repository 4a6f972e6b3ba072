//! Every check of a run can fail.

use super::*;
use crate::document::Block;

/// Returns a run without any fault.
fn clean_run() -> Vec<Line> {
    changed(|_, body| match body {
        Body::Structure(s) => s.gate = Some(gate(0)),
        Body::Bias(b) if b.verdict == BiasVerdict::Biased => b.verdict = BiasVerdict::NoBiasFound,
        Body::Finished(f) => f.failed = 0,
        _ => {}
    })
}

/// Returns the titles of the checks that do not pass, with their verdicts.
fn failing(lines: &[Line]) -> Vec<(String, Verdict)> {
    let checks = sections::belief::checks(&RunData::new(lines));
    let failing = checks
        .into_iter()
        .filter(|check| check.verdict != Verdict::Pass);
    failing.map(|check| (check.title, check.verdict)).collect()
}

#[test]
fn what_is_not_judged_of_several_cells_is_told_once() {
    let mut lines = clean_run();
    let is_paths = |line: &&Line| matches!(line.body, Body::Paths(_));
    let mut other = lines.iter().find(is_paths).unwrap().clone();
    other.body = Body::Paths(PathsRecord::not_judged("integrator `mine`"));
    for kernels in ["a", "b"] {
        let key = other.key.clone().with(axis::KERNELS, kernels);
        lines.push(Line {
            key,
            ..other.clone()
        });
    }
    let checks = sections::belief::checks(&RunData::new(&lines));
    let paths = checks.iter().find(|c| c.title.contains("path by path"));
    let told = paths.unwrap().detail.matches("NOT JUDGED").count();
    assert_eq!(told, 1, "{}", paths.unwrap().detail);
}

#[test]
fn a_noisy_reference_is_above_its_limit_in_the_digits_that_are_shown() {
    let lines = changed(|_, body| {
        if let Body::Error(error) = body {
            for at in &mut error.errors {
                at.metrics.insert("relmse-unbiased/eps=1e-2/v1".into(), 1.0);
                at.without_part.clear();
            }
        } else if let Body::Reference(reference) = body {
            reference.relmse = Some(0.010_04);
        }
    });
    let checks = sections::belief::checks(&RunData::new(&lines));
    let noise = checks.iter().find(|c| c.title.contains("Reference noise"));
    let detail = &noise.unwrap().detail;
    assert!(
        detail.contains("has 1.00 % of the least relMSE, more than 1 %"),
        "{detail}"
    );
}

#[test]
fn a_plan_that_saves_no_renders_does_not_say_so() {
    let says = |planned: usize| {
        let lines = changed(|_, body| {
            if let Body::Run(run) = body {
                run.renders_planned = planned;
            }
        });
        let sections = sections::run::sections(&RunData::new(&lines));
        let mut blocks = sections.iter().flat_map(|section| &section.blocks);
        blocks.any(|block| matches!(block, Block::Paragraph(text) if text.contains("saved")))
    };
    // Of 560 renders for every full cell.
    assert_eq!([152, 560, 600].map(says), [true, false, false]);
}

#[test]
fn an_image_that_no_other_structure_rendered_proves_nothing() {
    let mut lone = clean_run();
    lone.retain(|line| !matches!(line.body, Body::Time(_)) || line.key.name(axis::ACCEL) == "bvh");
    assert!(lone.len() < clean_run().len());
    let open = [(
        "Images equal across structures and organisations".to_owned(),
        Verdict::Open,
    )];
    assert_eq!(failing(&lone), open);
}

/// Returns a clean run whose errors are against a file, of which nothing is known.
fn against_a_file() -> Vec<Line> {
    let mut lines = clean_run();
    for line in &mut lines {
        match &mut line.body {
            Body::Reference(reference) => {
                reference.file = Some("mine.exr".to_owned());
                (reference.mse, reference.relmse) = (None, None);
            }
            Body::Error(error) => {
                for at in &mut error.errors {
                    let metrics = std::mem::take(&mut at.metrics).into_iter();
                    let plain = metrics.map(|(id, value)| (id.replace("-unbiased", ""), value));
                    at.metrics = plain.collect();
                }
            }
            _ => {}
        }
    }
    lines
}

#[test]
fn a_reference_of_unknown_noise_proves_nothing_and_its_errors_are_not_called_unbiased() {
    let lines = against_a_file();
    let open = failing(&lines);
    assert!(
        matches!(&open[..], [(title, Verdict::Open)] if title.contains("Reference noise")),
        "{open:?}"
    );
    let shown = terminal::terminal_tables(&lines);
    assert!(
        shown.contains("relMSE") && !shown.contains("unbiased"),
        "{shown}"
    );
    let data = RunData::new(&lines);
    let ids: Vec<String> = data
        .views()
        .flat_map(|(scene, view)| values::of_view(&data, scene, view))
        .map(|value| value.figure.id.to_string())
        .collect();
    let has = |id: &str| ids.iter().any(|other| other == id);
    assert!(has("relmse/v1") && has("rmse/v1"), "{ids:?}");
    assert!(!has("relmse-unbiased/v1") && !has("rmse-unbiased/v1"));
}

#[test]
fn a_cell_that_failed_has_no_image_that_differs() {
    let lines = changed(|_, body| {
        if let Body::Time(time) = body {
            (time.failure, time.image_equal) = (Some("its gate failed".to_owned()), false);
        }
    });
    let data = RunData::new(&lines);
    for (scene, view) in data.views() {
        let doubt = trust::doubt_of_rendering(scene, view);
        assert!(doubt.is_none_or(|why| !why.contains("the image of")));
    }
}

/// A fault in the records of one kind.
macro_rules! plant {
    ($kind:ident, $record:ident => $fault:expr) => {
        |line: &mut Line| {
            if let Body::$kind($record) = &mut line.body {
                $fault
            }
        }
    };
}

#[test]
fn every_check_passes_on_a_clean_run_and_fails_on_its_planted_fault() {
    let clean = clean_run();
    assert_eq!(failing(&clean), []);
    let fails = |title: &str, plant: fn(&mut Line)| {
        let mut lines = clean.clone();
        lines.iter_mut().for_each(plant);
        let failed = failing(&lines);
        assert!(
            failed.iter().any(|(name, _)| name.contains(title)),
            "{title} in {failed:?}"
        );
    };
    fails(
        "equal to the bit",
        plant!(Structure, s => s.gate = Some(gate(1))),
    );
    fails(
        "brute force",
        plant!(Structure, s => s.gate.as_mut().unwrap().brute_force.wrong = 1),
    );
    fails(
        "oracle",
        plant!(Structure, s => s.gate.as_mut().unwrap().oracle.wrong = 1),
    );
    fails(
        "across structures",
        plant!(Time, t => t.image_equal = false),
    );
    fails(
        "path by path",
        plant!(Paths, p => p.fault = Some("pixel (1, 2)".to_owned())),
    );
    fails(
        "path by path",
        plant!(Paths, p => *p = PathsRecord::not_judged("material `mine`")),
    );
    fails(
        "without bias",
        plant!(Bias, b => b.verdict = BiasVerdict::Biased),
    );
    fails("finite", plant!(Error, e => e.non_finite_pixels = 1));
    let noise = "Reference noise";
    fails(noise, plant!(Reference, f => f.mse = Some(1.0)));
    fails(noise, plant!(Reference, f => f.mse = Some(0.0)));
    fails(
        noise,
        plant!(Error, e => figures(e).for_each(|value| *value = -1e-9)),
    );
    fails(noise, |line| {
        if matches!(line.body, Body::Reference(_)) {
            line.key = line.key.clone().with(axis::INTEGRATOR, "another");
        }
    });
}

#[test]
fn an_image_that_failed_its_cell_fails_the_check_and_is_named() {
    let mut lines = clean_run();
    // As a run leaves the cell: replicates before, and the one with the fault, without figures.
    let is_it = |line: &Line| {
        matches!(&line.body, Body::Error(e) if e.replicate > 2)
            && line.key.label(axis::SEQUENCE) == "sobol"
    };
    lines.retain(|line| !is_it(line));
    for line in &mut lines {
        if let (Body::Error(e), "sobol") = (&mut line.body, line.key.label(axis::SEQUENCE))
            && e.replicate == 2
        {
            (e.errors, e.non_finite_pixels) = (Vec::new(), 7);
        }
    }
    let checks = sections::belief::checks(&RunData::new(&lines));
    let check = checks
        .iter()
        .find(|check| check.title == "Every pixel finite");
    let check = check.unwrap();
    assert_eq!(check.verdict, Verdict::Fail);
    let name = "; sobol × cranley-patterson on cornell-box, path";
    assert!(check.detail.contains(name), "{}", check.detail);
    // The page of such records can be made, and mentions it beside the sampler.
    let nowhere = Path::new("no such folder");
    let page = markdown::summary(&sections::document(nowhere, &RunData::new(&lines), &[]));
    assert!(page.contains("NaN or infinite pixels"));
}

#[test]
fn a_run_that_went_on_has_only_its_own_end() {
    let mut lines = clean_run();
    lines.push(run());
    assert!(RunData::new(&lines).finished.is_none());
    let open = failing(&lines);
    let complete = ("Every planned cell has figures".to_owned(), Verdict::Fail);
    assert!(open.contains(&complete), "{open:?}");
}

#[test]
fn the_first_failures_are_named_and_the_others_counted_without_what_was_left_out() {
    let mut lines = clean_run();
    let told = |kind: &str, number: usize| {
        let record = serde_json::json!({ "kind": kind, "cell": format!("{kind} {number}"), "reason": "no memory" });
        Line::about_all(serde_json::from_value(record).unwrap())
    };
    lines.extend((0..7).map(|number| told("failed", number)));
    lines.extend((0..3).map(|number| told("skipped", number)));
    let section = crate::sections::verdict::section(Path::new("nowhere"), &RunData::new(&lines));
    let text = serde_json::to_string(&section).unwrap();
    assert!(
        text.contains("failed 4") && !text.contains("failed 5\""),
        "{text}"
    );
    assert!(text.contains("and 2 more"), "{text}");
}
