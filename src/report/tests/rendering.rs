//! The structure that renders fastest is found by rendering.

use super::*;
use sections::rendering::{disagreements, fastest as renders_fastest};

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
