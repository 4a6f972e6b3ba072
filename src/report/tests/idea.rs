//! Another set of kernels beside the program's own.

use super::*;

/// Returns the small run with all that has kernels measured again with those of a folder: the hashes of kernels of structures
/// that begin so differ.
fn with_idea(changes: &[&str], streams_too: bool) -> Vec<Line> {
    let mut lines = Vec::new();
    for mut line in small_run() {
        let is_stream = matches!(line.body, Body::Stream(_));
        let twice = matches!(
            line.body,
            Body::Structure(_) | Body::Time(_) | Body::Error(_)
        );
        if !(twice || is_stream) {
            lines.push(line);
            continue;
        }
        let of = [axis::ACCEL, axis::SEQUENCE, axis::DECORRELATION];
        line.ran.kernel_hash = line.key.labels_on(&of).join(" ");
        let mut copy = line.clone();
        copy.key = copy.key.with(axis::KERNELS, "idea");
        let accel = copy.key.label(axis::ACCEL);
        let is_changed = !accel.is_empty() && changes.contains(&accel);
        if is_changed || (is_stream && streams_too) {
            copy.ran.kernel_hash += " changed";
            slow_down(&mut copy.body);
        }
        lines.extend([line, copy]);
    }
    lines
}

fn slow_down(body: &mut Body) {
    match body {
        Body::Structure(record) => {
            let times = record.timings.iter_mut().flat_map(|timing| &mut timing.ms);
            times.for_each(|ms| *ms *= 1.25);
        }
        Body::Time(record) => record.ms.iter_mut().for_each(|ms| *ms *= 1.25),
        _ => {}
    }
}

/// Returns the row on the discrepancy of point sets.
fn lowest(lines: &[Line]) -> String {
    let (_, summary) = report("points", lines);
    let row = summary.lines().find(|line| line.starts_with("| lowest D"));
    row.expect("a row on point sets").to_owned()
}

#[test]
fn points_of_equal_kernels_are_no_rivals_of_themselves() {
    let plain = lowest(&small_run());
    assert!(plain.contains("undecided: sobol × none"), "{plain}");
    assert_eq!(lowest(&with_idea(&["bvh"], false)), plain);
    let changed = lowest(&with_idea(&["bvh"], true));
    assert!(changed.contains("sobol × none &#64;idea"), "{changed}");
}

#[test]
fn the_time_to_an_image_has_a_row_for_other_kernels_too() {
    let lines = with_idea(&["bvh"], false);
    let (_, summary) = report("idea", &lines);
    let table = summary.split("Time to image: ").nth(1).expect("the table");
    let rows = table.lines().skip_while(|line| !line.starts_with('|'));
    let rows: Vec<&str> = rows.take_while(|line| line.starts_with('|')).collect();
    for structure in ["| bvh |", "| bvh &#64;idea |"] {
        assert!(
            rows.iter().any(|row| row.starts_with(structure)),
            "{rows:?}"
        );
    }
}

#[test]
fn the_clock_of_changes_is_named() {
    let (_, summary) = report("idea", &with_idea(&["bvh"], false));
    let said = summary
        .lines()
        .find(|line| line.starts_with("the changes are of: "));
    assert!(
        said.is_some_and(|line| line.contains("adapter time")),
        "{said:?}"
    );
}

#[test]
fn leaves_are_shown_by_size_whichever_structure_has_the_smallest() {
    let lines = changed(|key, body| {
        if let Body::Structure(record) = body
            && key.label(axis::ACCEL) == "brute-force"
        {
            record.stats.leaf_histogram = vec![3, 1, 0, 0, 0, 0, 2];
        }
    });
    let (_, summary) = report("leaves", &lines);
    let table = summary
        .split("Leaves (or cells) by the number")
        .nth(1)
        .expect("the table");
    let heads = table.lines().find(|line| line.starts_with('|'));
    assert_eq!(heads, Some("| structure | 0 | 1 | 2 | 3 | 4 | 5–8 |"));
}
