//! The report of a run with several sets of kernels: first the effect of the idea, by structure.

use super::records::{Made, QUIET};
use raystone::measure::record::{Body, Line, axis};
use raystone::report::{sections, terminal_tables};
use std::path::Path;

/// A run of the program's own kernels and an idea's, slower by this much where its kernels differ.
fn run(slower: fn(usize) -> f64) -> Vec<Line> {
    let base = Made {
        noise: QUIET,
        rounds: 31,
        structures: 8,
        ..Made::default()
    };
    let idea = Made {
        seed: 2,
        candidate: true,
        slower,
        ..base.clone()
    };
    let mut lines = base.lines();
    let of_idea = idea.lines().into_iter().filter_map(|mut line| {
        let is_of_kernels = matches!(line.body, Body::Structure(_) | Body::Error(_));
        line.key = line.key.with(axis::KERNELS, "my-idea");
        is_of_kernels.then_some(line)
    });
    let end = lines.pop();
    lines.extend(of_idea);
    lines.extend(end);
    lines
}

fn idea_is_slower(structure: usize) -> f64 {
    if structure == 5 { 1.2 } else { 1.0 }
}

fn table(tables: &str, caption: &str) -> Vec<String> {
    let from = tables.lines().skip_while(|line| !line.starts_with(caption));
    from.take_while(|line| !line.is_empty())
        .map(str::to_owned)
        .collect()
}

#[test]
fn a_run_of_two_sets_of_kernels_leads_with_what_the_idea_changes() {
    let tables = terminal_tables(&run(idea_is_slower));
    assert!(
        tables.starts_with("What the kernels @my-idea change, against embedded"),
        "{tables}"
    );
    let lead = table(&tables, "What the kernels @my-idea change");
    let row = |structure: &str| {
        let row = lead.iter().find(|line| line.starts_with(structure));
        row.unwrap_or_else(|| panic!("{lead:#?}"))
    };
    assert!(
        row("structure-5 ").contains("slower  ")
            && row("structure-5 ").contains("primary rays: speed −16"),
        "{lead:#?}"
    );
    assert!(!row("structure-6 ").contains("slower") && !row("structure-6 ").contains("control"));
    for unchanged in ["structure-0 ", "structure-3 "] {
        assert!(row(unchanged).contains("unchanged control"), "{lead:#?}");
    }
    // Changed ones come first.
    let place = |structure: &str| lead.iter().position(|line| line.starts_with(structure));
    assert!(place("structure-7") < place("structure-0"), "{lead:#?}");
}

#[test]
fn what_the_idea_does_not_change_is_no_rival_of_itself() {
    let tables = terminal_tables(&run(|_| 1.0));
    let verdict = table(&tables, "Verdict on box").join("\n");
    assert!(verdict.contains("structure-0"), "{verdict}");
    assert!(!verdict.contains("structure-0 @my-idea"), "{verdict}");
    assert!(!verdict.contains("none @my-idea"), "{verdict}");
    // Without its kernel in the records, it is not known to be the same.
    let mut unsaid = run(|_| 1.0);
    unsaid
        .iter_mut()
        .for_each(|line| line.ran.kernel_hash.clear());
    let tables = terminal_tables(&unsaid);
    let verdict = table(&tables, "Verdict on box").join("\n");
    assert!(verdict.contains("structure-0 @my-idea"), "{verdict}");
}

#[test]
fn the_page_leads_with_it_too_and_a_run_of_one_set_has_no_such_table() {
    let page = |lines: &[Line]| {
        let data = raystone::report::data::RunData::new(lines);
        let document = sections::document(Path::new("."), &data, &[]);
        serde_json::to_string(&document.sections[0]).expect("JSON")
    };
    let text = page(&run(idea_is_slower));
    let lead = text.find("What the kernels @my-idea change, against embedded");
    let winners = text.find("Verdict on box");
    assert!(lead.is_some() && lead < winners, "{lead:?} {winners:?}");
    assert!(
        text.contains("Asked: what the kernels @my-idea change"),
        "{text}"
    );
    assert!(text.contains("compiled once"), "{text}");
    let alone = page(&Made::default().lines());
    assert!(!alone.contains("What the kernels"), "{alone}");
    assert!(!terminal_tables(&Made::default().lines()).contains("What the kernels"));
}
